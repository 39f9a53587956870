//! Models that were quantized or compressed have the temperatures of the plain file, with shadows too.

use glam::{DQuat, DVec3};
use isotherm::model::nodes::{GROUP, PADDING};
use isotherm::simulation::reference_engine::ReferenceEngine;
use serde_json::json;

use super::craft::{SCENE, prepared};
use super::mesh_network::{TRANSITION, history};
use super::model::make::Maker;

/// Half the extent to which positions are normalized [m].
const EXTENT: f64 = 4.0;

/// A part: positions [m], unit normals and triangles.
struct Piece {
    name: &'static str,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u16; 3]>,
}

/// How a file stores its vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stored {
    /// 32-bit floats.
    Plain,
    /// 16-bit positions and 8-bit normals (KHR_mesh_quantization).
    Quantized,
    /// The same, with normals through the octahedral filter, all compressed (EXT_meshopt_compression).
    Compressed,
    /// Quantized, with 6-bit normals: too coarse.
    Coarse,
}

/// A grid of `n` x `m` cells.
fn piece(name: &'static str, [n, m]: [usize; 2], place: impl Fn(f64, f64) -> [DVec3; 2]) -> Piece {
    let mut piece = Piece { name, positions: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
    for (j, i) in (0..=m).flat_map(|j| (0..=n).map(move |i| (j, i))) {
        let [position, normal] = place(i as f64 / n as f64, j as f64 / m as f64);
        piece.positions.push(position);
        piece.normals.push(normal.normalize());
    }
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u16;
    for (j, i) in (0..m).flat_map(|j| (0..n).map(move |i| (j, i))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        piece.triangles.extend([[a, b, c], [a, c, d]]);
    }
    piece
}

/// A barrel, a flat panel that leans against all axes and shadows it, and a ball. Barrel and ball have a seam.
fn pieces() -> Vec<Piece> {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 0.7, -0.4).normalize(), 0.9);
    let around = |x: f64| {
        let (sine, cosine) = (std::f64::consts::TAU * x).sin_cos();
        turn * DVec3::new(cosine, sine, 0.0)
    };
    let normal = turn * DVec3::Z;
    let ball = |x: f64, y: f64| {
        let (sine, cosine) = (std::f64::consts::PI * y).sin_cos();
        let (s, c) = (-std::f64::consts::TAU * x).sin_cos();
        turn * DVec3::new(sine * c, sine * s, cosine)
    };
    vec![
        piece("barrel", [24, 6], |x, y| [around(x) + normal * (3.0 * y - 1.5), around(x)]),
        piece("panel", [12, 4], |x, y| [normal * 2.0 + turn * DVec3::new(3.0 * x - 1.5, 1.2 * y, 0.0), normal]),
        piece("ball", [16, 10], |x, y| [DVec3::new(-2.0, 1.0, -2.5) + ball(x, y), ball(x, y)]),
    ]
}

/// Integers as a stream of mode 0, every group of deltas as it is.
fn attribute_stream(elements: &[u8], stride: usize) -> Vec<u8> {
    let mut stream = vec![0xa0];
    let mut last = vec![0u8; stride];
    let size = (8192 / stride / 16 * 16).min(256);
    for block in elements.chunks(size * stride) {
        for byte in 0..stride {
            let count = block.len() / stride;
            let groups = count.div_ceil(16);
            stream.extend(vec![0xff; groups.div_ceil(4)]);
            let delta = |at: usize, last: &mut u8| {
                let value = block.get(at * stride + byte).copied().unwrap_or(*last);
                let delta = value.wrapping_sub(*last) as i8;
                *last = value;
                ((delta << 1) ^ (delta >> 7)) as u8
            };
            stream.extend((0..groups * 16).map(|at| delta(at, &mut last[byte])));
        }
    }
    stream.extend(vec![0; 32usize.saturating_sub(stride) + stride]);
    stream
}

/// Indices as a stream of mode 2.
fn index_stream(indices: impl Iterator<Item = u16>) -> Vec<u8> {
    let (mut stream, mut last) = (vec![0xd1], 0i64);
    for index in indices {
        let delta = i64::from(index) - last;
        last = i64::from(index);
        let mut value = (((delta << 1) ^ (delta >> 63)) << 1) as u64;
        while value >= 128 {
            stream.push(value as u8 | 128);
            value >>= 7;
        }
        stream.push(value as u8);
    }
    stream.extend([0; 4]);
    stream
}

/// Both coordinates on the octahedron.
fn octahedral(normal: DVec3) -> [i8; 4] {
    let flat = normal / normal.abs().element_sum();
    let fold = |a: f64, b: f64| if flat.z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
    let [x, y] = [fold(flat.x, flat.y), fold(flat.y, flat.x)];
    [(x * 127.0).round() as i8, (y * 127.0).round() as i8, 127, 0]
}

/// A file with these pieces.
fn file(stored: Stored) -> Maker {
    let mut maker = Maker::new();
    maker.push("materials", json!({ "name": "skin" }));
    maker.json["nodes"] = json!([]);
    maker.json["scenes"][0]["nodes"] = json!([]);
    if stored != Stored::Plain {
        maker.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        maker.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    }
    if stored == Stored::Compressed {
        maker.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "EXT_meshopt_compression"]);
        maker.push(
            "buffers",
            json!({"byteLength": 1 << 20, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}),
        );
    }
    for piece in pieces() {
        let count = piece.positions.len();
        let floats = |values: &[DVec3]| values.iter().map(|value| value.as_vec3().to_array()).collect::<Vec<_>>();
        let bytes_of_indices: Vec<u8> =
            piece.triangles.as_flattened().iter().flat_map(|index| index.to_le_bytes()).collect();
        let indices = json!({"componentType": 5123, "count": 3 * piece.triangles.len(), "type": "SCALAR"});
        let view = |maker: &mut Maker, bytes: &[u8], stride: usize, mode: &str, filter: &str| {
            let elements = bytes.len() / stride;
            let stream = match mode {
                "ATTRIBUTES" => attribute_stream(bytes, stride),
                _ => index_stream(piece.triangles.as_flattened().iter().copied()),
            };
            let view = maker.view(if stored == Stored::Compressed { &stream } else { bytes });
            let place = maker.json["bufferViews"][view].clone();
            if stored == Stored::Compressed {
                maker.json["bufferViews"][view] = json!({
                    "buffer": 1, "byteOffset": 0, "byteLength": bytes.len(),
                    "extensions": {"EXT_meshopt_compression": {
                        "buffer": 0, "byteOffset": place["byteOffset"], "byteLength": place["byteLength"],
                        "byteStride": stride, "count": elements, "mode": mode, "filter": filter}}
                });
            } else if mode == "ATTRIBUTES" {
                maker.json["bufferViews"][view]["byteStride"] = json!(stride);
            }
            view
        };
        let (positions, normals, indices) = if stored == Stored::Plain {
            let (positions, normals) = (maker.floats(&floats(&piece.positions)), maker.floats(&floats(&piece.normals)));
            (positions, normals, maker.accessor(&bytes_of_indices, indices))
        } else {
            let wide = |value: f64| ((value / EXTENT * 32767.0).round() as i16).to_le_bytes();
            let position = |at: &DVec3| [at.x, at.y, at.z, 0.0].map(wide).as_flattened().to_vec();
            let bytes: Vec<u8> = piece.positions.iter().flat_map(position).collect();
            let view_of_positions = view(&mut maker, &bytes, 8, "ATTRIBUTES", "NONE");
            let unit = if stored == Stored::Coarse { 31.0 } else { 127.0 };
            let rounded = |normal: &DVec3| match stored {
                Stored::Compressed => octahedral(*normal),
                _ => [normal.x, normal.y, normal.z, 0.0]
                    .map(|value| ((value * unit).round() * 127.0 / unit).round() as i8),
            };
            let bytes: Vec<u8> = piece.normals.iter().flat_map(rounded).map(|value| value as u8).collect();
            let view_of_normals = view(&mut maker, &bytes, 4, "ATTRIBUTES", "OCTAHEDRAL");
            let view_of_indices = view(&mut maker, &bytes_of_indices, 2, "INDICES", "NONE");
            let mut on = |view: usize, mut fields: serde_json::Value| {
                fields["bufferView"] = json!(view);
                maker.push("accessors", fields)
            };
            let vectors = |component: u32| json!({"componentType": component, "normalized": true, "count": count, "type": "VEC3"});
            (on(view_of_positions, vectors(5122)), on(view_of_normals, vectors(5120)), on(view_of_indices, indices))
        };
        let attributes = json!({"POSITION": positions, "NORMAL": normals});
        let mesh = maker.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
        let scale = if stored == Stored::Plain { 1.0 } else { EXTENT };
        let node = maker.push("nodes", json!({"name": piece.name, "mesh": mesh, "scale": [scale, scale, scale]}));
        maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    }
    maker
}

/// Mean temperature of every part at every step [K].
fn means(stored: Stored, shadows: &str) -> Vec<Vec<f64>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    file(stored).save(folder.path());
    let (body, _) = SCENE.split_once("[[probe]]").expect("a scene with a probe");
    let scene = body.replace(TRANSITION, "response = \"instant\"\n").replace("max_edge = 0.7", "max_edge = 0.6");
    let scene = scene.replace("step = 60\nsteps = 12", "step = 400\nsteps = 14") + shadows;
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).expect("the folder can be written");
    let prepared = prepared(&path);
    let nodes = &prepared.nodes;
    let real: Vec<usize> =
        (0..nodes.vertex_of_node.len()).filter(|node| nodes.vertex_of_node[*node] != PADDING).collect();
    let of_step = |temperatures: Vec<f64>| {
        let mut sums = vec![[0.0; 2]; prepared.parts.len()];
        for (node, temperature) in real.iter().zip(temperatures) {
            let [sum, area] = &mut sums[nodes.group_part[node / GROUP] as usize];
            let own = nodes.areas[*node];
            *sum += own * temperature;
            *area += own;
        }
        sums.into_iter().map(|[sum, area]| sum / area).collect()
    };
    history(&prepared, &mut ReferenceEngine::new(&prepared, None)).into_iter().map(of_step).collect()
}

#[test]
#[ignore = "long: tools/test --all"]
fn quantized_and_compressed_files_have_the_temperatures_of_the_plain_one() {
    for shadows in ["", "[shadows]\nmethod = \"exact\"\n", "[shadows]\n"] {
        let plain = means(Stored::Plain, shadows);
        let lit = plain.iter().flatten().fold(0.0, |highest: f64, mean| highest.max(*mean));
        assert!(lit > 280.0, "the Sun shines: {lit} K");
        let worst = |stored: Stored| {
            let pairs = plain.iter().zip(means(stored, shadows)).enumerate();
            let all = pairs.flat_map(|(step, (plain, found))| {
                let parts = plain.iter().zip(found).enumerate().map(|(part, (a, b))| ((a - b).abs(), step, part));
                parts.collect::<Vec<_>>()
            });
            all.max_by(|a, b| a.0.total_cmp(&b.0)).expect("steps")
        };
        // The octahedral filter rounds to 8 bits twice. On the ball, a coarse one of 160 cells, no mean direction of the facets undoes this.
        for (stored, bound) in [(Stored::Quantized, 0.05), (Stored::Compressed, 0.12)] {
            let (error, step, part) = worst(stored);
            println!("{shadows:?} {stored:?}: {error:.4} K in step {step}, part {part}");
            assert!(error < bound, "{shadows:?} {stored:?}: {error} K in step {step}, part {part}");
        }
        let (coarse, ..) = worst(Stored::Coarse);
        println!("{shadows:?} Coarse: {coarse:.4} K");
        assert!(coarse > 0.12, "coarser normals would be seen: {coarse} K");
    }
}
