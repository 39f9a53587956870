//! Temperatures of a file (`temperatures.file`): CSV, TMD and VTK on a device and on the f64 reference, what is not mapped, and what is refused.

use std::path::PathBuf;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use glam::DVec3;
use isotherm::internals::{Conductors, DeviceEngine, GROUP, PADDING, Prepared, ReferenceEngine, Tmd, TmdNode};

use super::craft::{Folder, scene_with};
use super::device::{assert_silent, context};
use super::mesh_network::history;
use super::program::run as run_program;
use super::shown::{Shown, images};

const PARTS: [&str; 4] = ["body", "wing_port", "wing_starboard", "mast"];

/// The craft with a file of temperatures. Materials need no response.
fn craft(file: &str, text: &[u8], keys: &str) -> Folder {
    let scene: String = scene_with(&[])
        .lines()
        .filter(|line| !["response", "retarget", "heating", "cooling"].iter().any(|key| line.starts_with(key)))
        .map(|line| format!("{line}\n"))
        .collect();
    let folder = Folder::new(&format!("{scene}[temperatures]\nfile = \"{file}\"\n{keys}"));
    std::fs::write(folder.path(file), text).expect("written");
    folder
}

fn refused(folder: &Folder) -> String {
    let error = Prepared::new(&folder.path("scene.toml"), &mut |_| ()).err().expect("refused").to_string();
    error.replace(&format!("{}/", folder.0.path().display()), "")
}

/// Part and place of each node, in the order of `history`.
fn nodes(prepared: &Prepared) -> Vec<(String, DVec3)> {
    let nodes = &prepared.nodes;
    let real = (0..nodes.vertex_of_node.len()).filter(|slot| nodes.vertex_of_node[*slot] != PADDING);
    real.map(|slot| {
        let part = &prepared.parts[nodes.group_part[slot / GROUP] as usize];
        (part.clone(), nodes.positions[slot].as_dvec3())
    })
    .collect()
}

/// Whether a device and the reference show at every step what `expected` says of a part, a place and a time.
fn shows(folder: &Folder, expected: impl Fn(&str, DVec3, f64) -> f64) -> bool {
    let prepared = folder.prepared();
    let context = context();
    let mut device = DeviceEngine::new(&context, &prepared, None).expect("a device");
    let found = [history(&prepared, &mut device), history(&prepared, &mut ReferenceEngine::new(&prepared, None))];
    assert_silent(&context);
    assert_eq!(found[0], found[1], "the device shows what the reference shows");
    let nodes = nodes(&prepared);
    assert_eq!(found[1].len(), 13);
    let off = found[1].iter().enumerate().flat_map(|(step, row)| {
        let time = 60.0 * step as f64;
        let expected = &expected;
        nodes
            .iter()
            .zip(row)
            .map(move |((part, at), kelvin)| ((kelvin - expected(part, *at, time)).abs(), part, at, time))
    });
    let (off, part, at, time) = off.max_by(|a, b| a.0.total_cmp(&b.0)).expect("nodes");
    println!("at most {off:.1e} K off, on {part} at {at} m, {time} s");
    // The series is in f32.
    off < 2e-5
}

/// A number for each part, and a temperature that bends at 300 s.
fn bent(part: &str, time: f64) -> f64 {
    let own = PARTS.iter().position(|own| *own == part).expect("a part") as f64;
    200.0 + 20.0 * own + if time <= 300.0 { 0.1 * time } else { 30.0 - 0.05 * (time - 300.0) }
}

/// The same temperatures as a table of rows.
fn rows() -> String {
    let row = |part: &&str, time: f64| format!("{part},{time},{}\n", bent(part, time));
    let rows = PARTS.iter().flat_map(|part| [0.0, 300.0, 720.0].map(|time| row(part, time)));
    "part,time,T\n".to_owned() + &rows.collect::<String>()
}

#[test]
fn parts_take_the_rows_of_a_csv_by_name() {
    let folder = craft("t.csv", rows().as_bytes(), "");
    assert!(shows(&folder, |part, _, time| bent(part, time)));
    assert!(!shows(&folder, |part, _, time| bent(part, time + 1.0)), "another time must not pass");
    assert!(
        folder.prepared().scene.assumptions.iter().any(|text| text.contains("All temperatures are those of t.csv"))
    );
    // A column for each node, in degrees Celsius, from 1000 s on.
    let mut wide = "time,body,wing_port,wing_starboard,mast\n".to_owned();
    for time in [0.0, 300.0, 720.0] {
        let cells = PARTS.map(|part| format!("{}", bent(part, time) - 273.15));
        wide += &format!("{},{}\n", 1000.0 + time, cells.join(","));
    }
    let folder = craft("t.csv", wide.as_bytes(), "unit = \"degC\"\nstart = 1000\n");
    assert!(shows(&folder, |part, _, time| bent(part, time)));
}

#[test]
fn images_show_the_temperatures_of_the_file_at_steps_and_between_them() {
    for draw in ["draw_every = 4", "images = [0, 90, 330, 715]"] {
        let folder = craft("t.csv", rows().as_bytes(), "");
        let scene = std::fs::read_to_string(folder.path("scene.toml")).expect("read").replace("draw_every = 4", draw);
        folder.write("scene.toml", &scene);
        let prepared = folder.prepared();
        for images in images(&prepared) {
            let mut seen = 0;
            for Shown { time, pixels } in &images {
                for (part, kelvin) in pixels {
                    let expected = bent(&prepared.parts[*part], *time);
                    assert!((kelvin - expected).abs() < 1e-3, "{draw}: {kelvin} K, not {expected}");
                    seen += 1;
                }
            }
            assert!(images.len() == 4 && seen > 2000, "{draw}: {seen} pixels of {} images", images.len());
        }
    }
}

/// Nodes of a TMD with names of parts as labels, and a place.
fn tmd() -> Tmd {
    let times = [0.0, 300.0, 720.0];
    let node = |(number, part): (i64, &&str)| TmdNode {
        number: 100 + number,
        name: String::new(),
        label: (*part).to_owned(),
        kind: 'D',
        position: DVec3::new(number as f64, 0.0, 0.0),
        temperatures: times.iter().map(|time| bent(part, *time)).collect(),
        capacitances: vec![1.0; 3],
        loads: [0; 5].map(|_| vec![0.0; 3]),
    };
    let mut nodes: Vec<TmdNode> = (0..).zip(&PARTS).map(node).collect();
    nodes.push(TmdNode { number: 900, label: "DEEP".to_owned(), kind: 'B', ..nodes[0].clone() });
    nodes.push(TmdNode { number: 901, label: "OLD".to_owned(), kind: 'X', ..nodes[0].clone() });
    let none = Conductors::default;
    Tmd {
        description: "CRAFT".to_owned(),
        times: times.to_vec(),
        nodes,
        linear: none(),
        radiative: none(),
        notes: Vec::new(),
    }
}

#[test]
fn parts_take_the_nodes_of_a_tmd_by_label_and_by_a_table() {
    let bytes = tmd().bytes().expect("a file");
    let folder = craft("craft.TMD", &bytes, "");
    assert!(shows(&folder, |part, _, time| bent(part, time)));
    let warnings = folder.prepared().warnings.join("\n");
    assert!(warnings.contains("Inactive nodes are left out: 901 (OLD)"), "{warnings}");
    assert!(warnings.contains("1 of the 5 nodes of craft.TMD are not on the model: 900 (DEEP)"), "{warnings}");

    let folder = craft("craft.TMD", &bytes, "map = \"map.csv\"\n");
    folder.write("map.csv", "part,node\nbody,100\nwing_*,102\nmast,mast\nkeel,100\nmast,77\n");
    assert!(shows(&folder, |part, _, time| bent(if part == "wing_port" { "wing_starboard" } else { part }, time)));
    let warnings = folder.prepared().warnings.join("\n");
    assert!(warnings.contains("the model has no part 'keel'; known here: body, "), "{warnings}");
    assert!(warnings.contains("craft.TMD has no node '77'; "), "{warnings}");

    for length in [9, bytes.len() / 2, bytes.len() - 1] {
        let message = refused(&craft("craft.TMD", &bytes[..length], ""));
        assert!(message.contains("temperatures.file: craft.TMD: ") && message.contains("truncated"), "{message}");
    }
}

/// Some field over the craft.
fn field(at: DVec3) -> f64 {
    250.0 + 10.0 * at.x - 3.0 * at.y + at.z
}

fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(|value| format!("{value} ")).collect()
}

/// Places of the craft's nodes, moved by 5 mm, and the temperatures there.
fn cloud() -> Vec<(DVec3, f64)> {
    let places = nodes(&craft("t.csv", rows().as_bytes(), "").prepared());
    places.into_iter().map(|(_, at)| (at + DVec3::new(0.003, -0.004, 0.0), field(at))).collect()
}

fn vtu(points: &[(DVec3, f64)]) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n\
         <UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"0\">\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points>\n\
         <PointData><DataArray type=\"Float64\" Name=\"T\" format=\"ascii\">{}</DataArray></PointData>\n\
         </Piece></UnstructuredGrid></VTKFile>\n",
        points.len(),
        numbers(points.iter().flat_map(|(at, _)| at.to_array())),
        numbers(points.iter().map(|(_, kelvin)| *kelvin)),
    )
}

#[test]
fn vertices_take_the_nearest_point_of_a_mesh() {
    let points = cloud();
    let folder = craft("t.vtu", vtu(&points).as_bytes(), "distance = 0.0051\n");
    assert!(shows(&folder, |_, at, _| field(at)));
    let mut other = points.clone();
    other[7].1 += 0.01;
    assert!(!shows(&craft("t.vtu", vtu(&other).as_bytes(), "distance = 0.0051\n"), |_, at, _| field(at)));

    let message = refused(&craft("t.vtu", vtu(&points).as_bytes(), "distance = 0.0049\n"));
    assert!(message.contains("no node of ") && message.contains("fits any surface by place"), "{message}");
    // Without the points of the mast, whose nodes then have none near enough.
    let places = nodes(&folder.prepared());
    let mast = places.iter().filter(|(part, _)| part == "mast").count();
    let rest: Vec<_> =
        points.iter().zip(&places).filter(|(_, (part, _))| part != "mast").map(|(point, _)| *point).collect();
    let message = refused(&craft("t.vtu", vtu(&rest).as_bytes(), "distance = 0.0051\n"));
    assert!(message.contains("surfaces of 1 part have no node of the file: mast ("), "{message}");
    let folder = craft("t.vtu", vtu(&rest).as_bytes(), "distance = 0.0051\nunmapped = 111\n");
    let warnings = folder.prepared().warnings.join("\n");
    assert!(warnings.contains("at 111 K (temperatures.unmapped): mast ("), "{warnings}");
    let at_111 = history(&folder.prepared(), &mut ReferenceEngine::new(&folder.prepared(), None))[3].clone();
    let bare = at_111.iter().filter(|kelvin| **kelvin == 111.0).count();
    assert!((1..=mast).contains(&bare), "{bare} of {mast}");
}

/// An array of a VTK file: one block of zlib in base64.
fn packed(bytes: &[u8]) -> String {
    use std::io::Write;
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(bytes).expect("packed");
    let stored = packer.finish().expect("packed");
    let header: Vec<u8> =
        [1, bytes.len() as u32, 0, stored.len() as u32].iter().flat_map(|word| word.to_le_bytes()).collect();
    BASE64_STANDARD.encode(header) + &BASE64_STANDARD.encode(stored)
}

#[test]
fn packed_polygons_have_the_temperature_at_their_centres() {
    // Each place is the centre of a triangle.
    let points = cloud();
    let corners = [DVec3::X, DVec3::new(-0.5, 0.8, 0.0), DVec3::new(-0.5, -0.8, 0.0)].map(|corner| 0.001 * corner);
    let bytes = |values: &mut dyn Iterator<Item = f64>| {
        packed(&values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<_>>())
    };
    let places =
        bytes(&mut points.iter().flat_map(|(at, _)| corners.map(|corner| at + corner)).flat_map(|at| at.to_array()));
    let kelvin = bytes(&mut points.iter().map(|(_, kelvin)| *kelvin));
    let count = points.len();
    let whole = |words: &mut dyn Iterator<Item = usize>| {
        packed(&words.flat_map(|word| (word as i64).to_le_bytes()).collect::<Vec<_>>())
    };
    let array = |kind: &str, name: &str, data: &str| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\">{data}</DataArray>\n")
    };
    let text = format!(
        "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"><PolyData>\n\
         <Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{count}\"><Points>{}</Points><Polys>{}{}</Polys><CellData>{}</CellData></Piece>\n\
         </PolyData></VTKFile>\n",
        3 * count,
        array("Float32", "Points", &places),
        array("Int64", "connectivity", &whole(&mut (0..3 * count))),
        array("Int64", "offsets", &whole(&mut (1..=count).map(|cell| 3 * cell))),
        array("Float32", "skin", &kelvin),
    );
    let keys = "distance = 0.0052\narray = \"skin\"\n";
    assert!(shows(&craft("t.vtp", text.as_bytes(), keys), |_, at, _| f64::from(field(at) as f32)));
    let message = refused(&craft("t.vtp", text.as_bytes(), "distance = 0.0052\n"));
    assert!(message.contains("has no array temperature") && message.contains("there are: skin"), "{message}");
    let cut = text.replace(&kelvin, &kelvin[..kelvin.len() - 8]);
    let message = refused(&craft("t.vtp", cut.as_bytes(), keys));
    assert!(message.contains("skin: is truncated or damaged"), "{message}");
}

#[test]
fn what_does_not_fit_is_refused() {
    let all = rows();
    for (text, keys, expected) in [
        (
            all.replace("part,time,T", "part,time,heat"),
            "",
            "t.csv:1: header: must have the columns node and temperature",
        ),
        (all.replace("mast,300,290", "mast,300,hot"), "", "temperature: 'hot' is not a number"),
        (all.replace("mast,300,290", "mast,300,-290"), "", "a temperature is from 0 to 1000000 K"),
        (all.replace("mast,300,290", "mast,800,290"), "", "720 s of node 'mast' does not come after its row before"),
        (all.replace("mast", "boom"), "", "surfaces of 1 part have no node of the file: mast (all "),
        (
            all.replace("body", "hull").replace("wing", "sail").replace("mast", "boom"),
            "",
            "the file has 4 nodes (hull, sail_port",
        ),
        (all.clone(), "start = 100\n", "covers 0 to 720 s, and the scene needs 100 to 820 s"),
        (all.clone(), "by = \"place\"\n", "temperatures.distance: is missing"),
        (all.clone(), "by = \"place\"\ndistance = 1\n", "temperatures.by: the nodes of the file have no place"),
        (all.clone(), "by = \"table\"\n", "temperatures.map: is missing"),
        (all.clone(), "array = \"T\"\n", "temperatures.array: belongs to a VTK file"),
        (all.clone(), "unmapped = -1\n", "temperatures.unmapped: must be"),
        (String::new(), "", "t.csv:1: row: is missing: the table is empty"),
    ] {
        let message = refused(&craft("t.csv", text.as_bytes(), keys));
        assert!(message.contains(expected), "{keys}: {message}");
    }
    // Other keys of the scene that are wrong are told too.
    let folder = craft("t.csv", b"part,heat\n", "");
    let scene = std::fs::read_to_string(folder.path("scene.toml")).expect("read").replace("albedo = 0.3", "albedo = 3");
    folder.write("scene.toml", &scene);
    let message = refused(&folder);
    assert!(
        message.contains("environment.albedo") && message.contains("t.csv:1") && message.lines().count() == 2,
        "{message}"
    );
}

#[test]
fn the_program_renders_a_file_and_compares_no_responses() {
    let folder = craft("t.csv", rows().as_bytes(), "");
    let out: PathBuf = folder.path("out");
    let ran = run_program(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let report = std::fs::read_to_string(out.join("report.html")).expect("a report");
    assert!(report.contains("Temperatures from a file") && report.contains("by the names of the parts"));
    let series = std::fs::read_to_string(out.join("series.csv")).expect("a series");
    assert!(series.lines().nth(6).is_some_and(|line| line.contains("290")), "{series}");
    let ran = run_program(folder.0.path(), &["compare", "scene.toml", "-o", "both"]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("no responses to compare"), "{}", ran.err);
}
