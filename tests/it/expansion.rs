//! A short file can not become gigabytes: what contents take is counted before they are made.

use std::io::Write;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compression, write::ZlibEncoder};
use hdf5_writer::{AttributeBuilder, DatasetBuilder, Hdf5Builder, WriteOptions, jenkins_lookup3};
use isotherm::Reach;
use isotherm::internals::{Model, Tmd, mesh, planet_map, read_png};

/// The refusal of contents that take too much.
const REFUSED: &str = "contents take more than 268435456";

fn zeros(count: usize) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    for _ in 0..count / 1_000_000 {
        encoder.write_all(&[0; 1_000_000]).expect("memory");
    }
    encoder.write_all(&vec![0; count % 1_000_000]).expect("memory");
    encoder.finish().expect("memory")
}

/// A mesh of `pieces`, each of which reads one block of `count` zeros as coordinates and as temperatures.
fn vtu(count: usize, pieces: usize, stated: &str) -> Vec<u8> {
    let piece = format!(
        "<Piece {stated}><Points><DataArray type=\"Int8\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points><CellData/>\
         <PointData><DataArray type=\"Int8\" Name=\"T\" format=\"appended\" offset=\"OTHER\"/></PointData></Piece>"
    );
    let block = |count: usize| {
        let stored = zeros(count);
        let words = [1, count as u32, count as u32, stored.len() as u32];
        [words.iter().flat_map(|word| word.to_le_bytes()).collect(), stored].concat()
    };
    let (places, values) = (block(count), block(count / 3));
    let head = "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>";
    let pieces = piece.repeat(pieces).replace("OTHER", &places.len().to_string());
    let text = format!("{head}{pieces}</UnstructuredGrid><AppendedData encoding=\"raw\">_");
    [text.as_bytes(), &places, &values, b"</AppendedData></VTKFile>"].concat()
}

#[test]
fn blocks_of_a_mesh_are_counted_before_they_are_inflated() {
    let read = |bytes: &[u8]| mesh(bytes, Path::new("mesh.vtu")).map_err(|error| error.to_string());
    assert_eq!(read(&vtu(3000, 1, "NumberOfPoints=\"1000\"")), Ok(1000));
    assert_eq!(read(&vtu(3000, 2, "")), Ok(2000));
    // One block of 300 MB in 1.3 MB. Then 3 MB, which many pieces read.
    for bytes in [vtu(300_000_000, 1, ""), vtu(3_000_000, 40, "")] {
        assert!(bytes.len() < 2_000_000);
        let message = read(&bytes).expect_err("refused");
        assert!(message.contains("contents take more than"), "{message}");
    }
    let message = read(&vtu(3000, 1, "NumberOfPoints=\"1000000000000000000\"")).expect_err("refused");
    assert!(message.contains("states 1000000000000000000 by NumberOfPoints, and has 1000"), "{message}");
    for wrong in ["NumberOfPoints=\"999\"", "NumberOfPoints=\"1e18\"", "NumberOfPoints=\"-1\""] {
        assert!(read(&vtu(3000, 1, wrong)).is_err(), "{wrong}");
    }
}

/// A model with `triangles` of one mesh at `copies` places.
fn copied(triangles: usize, copies: usize) -> Vec<u8> {
    let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|value| value.to_le_bytes());
    let indices = (0..triangles).flat_map(|_| [0u16, 1, 2]).flat_map(u16::to_le_bytes);
    let mut data: Vec<u8> = corners.chain(indices).collect();
    data.resize(data.len().next_multiple_of(4), 0);
    let places = data.len();
    data.extend((0..3 * copies).flat_map(|at| (at as f32).to_le_bytes()));
    serde_json::json!({
        "asset": {"version": "2.0"}, "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "buffers": [{"byteLength": data.len(), "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(&data))}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6 * triangles},
            {"buffer": 0, "byteOffset": places, "byteLength": 12 * copies},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3 * triangles, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": copies, "type": "VEC3"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}}],
        "scenes": [{"nodes": [0]}],
    })
    .to_string()
    .into_bytes()
}

#[test]
fn copies_of_a_mesh_are_counted_before_they_are_placed() {
    let path = Path::new("model.gltf");
    let read = |bytes: &[u8]| Model::parse(bytes, path, &Reach::of(path)).map_err(|error| error.to_string());
    assert_eq!(read(&copied(1000, 20)).expect("a model").triangles.len(), 20_000);
    let message = read(&copied(20_000, 20_000)).expect_err("refused");
    assert!(message.contains(REFUSED), "{message}");
}

/// The nodes stand in the text of the file, so that its length counts too.
#[test]
fn a_mesh_at_many_nodes_takes_what_their_text_allows() {
    let mut file: serde_json::Value = serde_json::from_slice(&copied(12, 1)).expect("JSON");
    let nodes: Vec<_> = (0..60_000).map(|node| serde_json::json!({"mesh": 0, "name": format!("n{node}")})).collect();
    file["scenes"][0]["nodes"] = (0..nodes.len()).collect();
    file["nodes"] = nodes.into();
    let path = Path::new("model.gltf");
    let model = Model::parse(file.to_string().as_bytes(), path, &Reach::of(path)).expect("a model");
    assert_eq!(model.parts.len(), 60_000);
}

/// Times that are stored.
const STORED: u64 = 7777;

/// A TMD whose list of times has this length. Only the first `STORED` times are stored.
fn tmd(times: u64) -> Vec<u8> {
    let set = "AnalysisSet1";
    let values: Vec<f64> = (0..STORED).map(|time| time as f64).collect();
    let listed = DatasetBuilder::typed_data(format!("{set}/DataGroup1/times"), [STORED], &values).expect("numbers");
    let plan = Hdf5Builder::new()
        .attribute(AttributeBuilder::fixed_string_vector("FileVersion", &["01.00"]).expect("a text"))
        .group_attribute(set, AttributeBuilder::scalar("TAbs", 273.15).expect("a number"))
        .dataset(listed.chunked([STORED]))
        .into_plan();
    let mut bytes = plan.and_then(|plan| plan.encode(WriteOptions::default())).expect("a file");
    let at = bytes.windows(8).position(|window| window == STORED.to_le_bytes()).expect("the extent");
    bytes[at..at + 8].copy_from_slice(&times.to_le_bytes());
    // The object header (version 2) has its length behind its flags, and ends with a checksum.
    let begin = bytes[..at].windows(4).rposition(|window| window == b"OHDR").expect("a header");
    let width = 1 << (bytes[begin + 5] & 3);
    let mut length = [0; 8];
    length[..width].copy_from_slice(&bytes[begin + 6..begin + 6 + width]);
    let end = begin + 6 + width + u64::from_le_bytes(length) as usize;
    let sum = jenkins_lookup3(&bytes[begin..end]);
    bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
    bytes
}

#[test]
fn a_dataset_is_counted_before_it_is_read() {
    let read = |bytes| Tmd::parse(bytes, Path::new("case.TMD")).expect_err("no whole TMD").to_string();
    let message = read(tmd(STORED));
    assert!(message.contains("thermalNodes"), "the times are read, and then the nodes are missing: {message}");
    for times in [100_000_000, 1 << 40, u64::MAX / 8] {
        let message = read(tmd(times));
        assert!(message.contains("times: ") && message.contains(REFUSED), "{message}");
    }
}

/// A grey PNG of 8 bits with the pixels of a smaller one.
fn png(columns: u32, rows: u32) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [&columns.to_be_bytes()[..], &rows.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    for (kind, content) in [(b"IHDR", header), (b"IDAT", zeros(20)), (b"IEND", Vec::new())] {
        let mut sum = flate2::Crc::new();
        sum.update(kind);
        sum.update(&content);
        file.extend((content.len() as u32).to_be_bytes());
        file.extend([&kind[..], &content, &sum.sum().to_be_bytes()].concat());
    }
    file
}

#[test]
fn the_pixels_of_an_image_are_counted_before_they_are_decoded() {
    assert_eq!(planet_map(&png(4, 4)), Ok(16));
    assert_eq!(read_png(&png(4, 4)).expect("an image").0, [4, 4]);
    assert!(planet_map(&png(65_535, 65_535)).expect_err("refused").contains("at most"));
    let message = read_png(&png(65_535, 65_535)).expect_err("refused").to_string();
    assert!(message.contains("contents take more than"), "{message}");
}
