//! The readers that are fuzzed, each with valid seeds. A reader may refuse a case; it must not panic, and what it accepts must be finite.

use std::path::Path;

use base64::Engine;
use isotherm::internals::{Files, Function, Model, NetworkFile, SkyModel, Tmd, convert, tmd};
use isotherm::{Reach, Scene, internals};

use crate::containers;
use crate::folder::Folder;
use crate::mutate::Random;

/// Makes a case from seeds.
type MakeCase = fn(&mut Random, &[Vec<u8>]) -> Vec<u8>;

/// A reader of one kind of input.
#[derive(Clone, Copy)]
pub struct Target {
    pub name: &'static str,
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Makes a valid container around sizes that may be hostile, where the format is one.
    pub make: Option<MakeCase>,
    /// Reads a case. The error is the reader's refusal.
    pub read: fn(&[u8], &Folder) -> Result<(), String>,
}

pub const TARGETS: [Target; 17] = [
    Target { name: "scene", seeds: scenes, make: None, read: read_scene },
    Target { name: "materials", seeds: material_tables, make: None, read: read_materials },
    Target { name: "network", seeds: networks, make: None, read: read_network },
    Target { name: "gltf", seeds: models, make: None, read: read_model },
    Target { name: "tle", seeds: || texts(&[TLE]), make: None, read: read_trajectory },
    Target { name: "oem", seeds: || texts(&[OEM, OEM_XML]), make: None, read: read_trajectory },
    Target { name: "aem", seeds: || texts(&[AEM, AEM_XML]), make: None, read: read_attitude },
    Target { name: "csv", seeds: || texts(&CSV), make: None, read: read_csv },
    Target { name: "import", seeds: || texts(&[include_str!("seeds/import.txt")]), make: None, read: read_import },
    Target { name: "tmd", seeds: tmds, make: None, read: read_tmd },
    Target { name: "expression", seeds: || texts(&EXPRESSIONS), make: None, read: read_expression },
    Target { name: "vtk", seeds: meshes, make: Some(containers::vtk), read: read_mesh },
    Target { name: "hdf5", seeds: containers::tmds, make: Some(containers::hdf5), read: read_tmd },
    Target {
        name: "png",
        seeds: || containers::some(containers::png, is_map),
        make: Some(containers::png),
        read: read_png,
    },
    Target { name: "exr", seeds: containers::exrs, make: Some(containers::exr), read: read_exr },
    Target { name: "frame", seeds: frames, make: Some(containers::exr), read: read_frame },
    Target { name: "meshopt", seeds: compressed, make: Some(containers::meshopt), read: read_model },
];

const TLE: &str = include_str!("../../../models/iss.tle");
const OEM: &str = "\
CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2024-02-29T00:00:00
ORIGINATOR = TEST

META_START
OBJECT_NAME = CRAFT
OBJECT_ID = 2024-001A
CENTER_NAME = EARTH
REF_FRAME = EME2000
TIME_SYSTEM = UTC
START_TIME = 2024-02-29T00:00:00
STOP_TIME = 2024-02-29T00:03:00
INTERPOLATION = HERMITE
INTERPOLATION_DEGREE = 7
META_STOP
2024-02-29T00:00:00 6778.0 0.0 0.0 0.0 7.668 0.0
2024-02-29T00:01:00 6762.3 459.7 0.0 -0.520 7.650 0.0
2024-02-29T00:02:00 6715.4 917.3 0.0 -1.038 7.597 0.0
2024-02-29T00:03:00 6637.5 1370.6 0.0 -1.551 7.509 0.0
";
const OEM_XML: &str = "\
<?xml version=\"1.0\"?>
<ndm><oem id=\"CCSDS_OEM_VERS\" version=\"2.0\"><header/><body><segment><metadata><OBJECT_NAME>CRAFT</OBJECT_NAME>
<OBJECT_ID>2024-001A</OBJECT_ID><CENTER_NAME>EARTH</CENTER_NAME><REF_FRAME>TEME</REF_FRAME><TIME_SYSTEM>UTC</TIME_SYSTEM>
<START_TIME>2024-02-29T00:00:00</START_TIME><STOP_TIME>2024-02-29T00:01:00</STOP_TIME></metadata><data>
<stateVector><EPOCH>2024-02-29T00:00:00</EPOCH><X units=\"km\">6778.0</X><Y>0</Y><Z>0</Z><X_DOT>0</X_DOT><Y_DOT>7.6</Y_DOT><Z_DOT>0</Z_DOT></stateVector>
<stateVector><EPOCH>2024-02-29T00:01:00</EPOCH><X>6762.3</X><Y>459.7</Y><Z>0</Z><X_DOT>-0.5</X_DOT><Y_DOT>7.6</Y_DOT><Z_DOT>0</Z_DOT></stateVector>
</data></segment></body></oem></ndm>
";
const AEM: &str = "\
CCSDS_AEM_VERS = 2.0
CREATION_DATE = 2024-02-29
ORIGINATOR = TEST
META_START
OBJECT_NAME = CRAFT
OBJECT_ID = 2024-001A
CENTER_NAME = EARTH
TIME_SYSTEM = UTC
REF_FRAME_A = EME2000
REF_FRAME_B = SC_BODY_1
ATTITUDE_TYPE = QUATERNION
START_TIME = 2024-060T00:00:00
STOP_TIME = 2024-060T00:01:00
META_STOP
DATA_START
2024-060T00:00:00 0 0 0 1
2024-060T00:00:30 0 0 0.1 0.99499
2024-060T00:01:00 0 0 0.2 0.97980
DATA_STOP
";
const AEM_XML: &str = "\
<?xml version=\"1.0\"?>
<aem id=\"CCSDS_AEM_VERS\" version=\"2.0\"><header/><body><segment><metadata><OBJECT_NAME>CRAFT</OBJECT_NAME><OBJECT_ID>2024-001A</OBJECT_ID>
<REF_FRAME_A>EME2000</REF_FRAME_A><REF_FRAME_B>SC_BODY_1</REF_FRAME_B><TIME_SYSTEM>UTC</TIME_SYSTEM><START_TIME>2024-060T00:00:00</START_TIME>
<STOP_TIME>2024-060T00:01:00</STOP_TIME><ATTITUDE_TYPE>EULER_ANGLE</ATTITUDE_TYPE><EULER_ROT_SEQ>ZXZ</EULER_ROT_SEQ></metadata><data>
<attitudeState><eulerAngle><EPOCH>2024-060T00:00:00</EPOCH><ANGLE_1 units=\"deg\">10</ANGLE_1><ANGLE_2>20</ANGLE_2><ANGLE_3>30</ANGLE_3></eulerAngle></attitudeState>
<attitudeState><eulerAngle><EPOCH>2024-060T00:01:00</EPOCH><ANGLE_1>11</ANGLE_1><ANGLE_2>21</ANGLE_2><ANGLE_3>31</ANGLE_3></eulerAngle></attitudeState>
</data></segment></body></aem>
";
const CSV: [&str; 4] = [
    "step,target\n1,267\n20,300\n360,250.5\n",
    "# measured\ntime,temperature\n0,300\n10,290\n30,275\n90,262\n200,260\n",
    "time,x,y,z,vx,vy,vz\n0,6778000,0,0,0,7668,0\n60,6762300,459700,0,-520,7650,0\n120,6715400,917300,0,-1038,7597,0\n",
    "time,qw,qx,qy,qz\n0,1,0,0,0\n60,0.995,0,0.0998,0\n120,0.98,0,0.199,0\n",
];
const EXPRESSIONS: [&str; 6] = [
    "s*s*(3.0-2.0*s)",
    "s < 0.5 ? 2.0*s*s : 1.0-2.0*(1.0-s)*(1.0-s)",
    "1.0-pow(1.0-s, 3.0)",
    "sin(0.5*3.141592653589793*s)",
    "mix(s, sqrt(s), 0.25)",
    "(1.0-exp(-3.0*s))/(1.0-exp(-3.0))",
];

fn texts(all: &[&str]) -> Vec<Vec<u8>> {
    all.iter().map(|text| text.as_bytes().to_vec()).collect()
}

fn scenes() -> Vec<Vec<u8>> {
    texts(&[
        include_str!("../../../tests/it/scene/full.toml"),
        include_str!("../../../tests/it/scene/short.toml"),
        include_str!("../../../models/iss_orbit.toml"),
        include_str!("seeds/moving.toml"),
    ])
}

fn material_tables() -> Vec<Vec<u8>> {
    texts(&[crate::folder::TABLE, include_str!("seeds/materials.toml")])
}

fn networks() -> Vec<Vec<u8>> {
    texts(&[include_str!("../../../models/cubesat_network.toml"), include_str!("seeds/network.toml")])
}

/// A tetrahedron as `.gltf` with a data URI, with a file beside it, and as `.glb`.
fn models() -> Vec<Vec<u8>> {
    let binary = crate::folder::tetrahedron();
    let json = |uri: &str| include_str!("seeds/model.gltf").replace("\"uri\": \"\"", uri);
    let data = base64::engine::general_purpose::STANDARD.encode(&binary);
    let embedded = json(&format!("\"uri\": \"data:application/octet-stream;base64,{data}\""));
    let beside = json("\"uri\": \"model.bin\"");
    let mut chunk = json("\"name\": \"chunk\"").into_bytes();
    chunk.resize(chunk.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((12 + 8 + chunk.len() + 8 + binary.len()).to_le_bytes()[..4].iter());
    for (kind, content) in [(b"JSON", &chunk), (b"BIN\0", &binary)] {
        glb.extend(&content.len().to_le_bytes()[..4]);
        glb.extend(kind);
        glb.extend(content);
    }
    vec![embedded.into_bytes(), beside.into_bytes(), glb]
}

/// The text of a case. What is not UTF-8 never reaches a reader of text, so it is replaced here.
fn text(case: &[u8]) -> String {
    String::from_utf8_lossy(case).into_owned()
}

fn read_scene(case: &[u8], folder: &Folder) -> Result<(), String> {
    let scene = Scene::parse(&text(case), &folder.path("scene.toml")).map_err(told)?;
    let Ok(sky) = SkyModel::new(&scene.orbit, &scene.attitude, &scene.environment) else { return Ok(()) };
    let end = f64::from(scene.time.steps) * scene.time.step;
    if sky.check(0.0, end).is_ok() {
        for time in [0.0, 0.5 * end, end] {
            let sky = sky.sky(time);
            assert!(sky.sun_direction.is_finite() && sky.nadir_direction.is_finite() && sky.lit_fraction.is_finite());
        }
    }
    Ok(())
}

fn read_materials(case: &[u8], folder: &Folder) -> Result<(), String> {
    internals::materials(&text(case), &folder.path("table.toml")).map(|_| ()).map_err(told)
}

fn read_network(case: &[u8], _: &Folder) -> Result<(), String> {
    let file = NetworkFile::parse(&text(case), Path::new("network.toml")).map_err(told)?;
    assert!(file.network.temperatures.iter().chain(&file.schedule.times).all(|value| value.is_finite()));
    Ok(())
}

/// The files of a folder stand in one text, each after a line with its name.
fn read_import(case: &[u8], _: &Folder) -> Result<(), String> {
    let text = text(case);
    let parts: Vec<(&str, &str)> = text.split("== ").filter_map(|part| part.split_once('\n')).collect();
    let read = |file: &str| Ok(parts.iter().find(|(name, _)| name.trim() == file).map(|(_, text)| (*text).to_owned()));
    let imported = convert(&Files { folder: Path::new("folder"), read: &read })?;
    // Values may be refused, but what is written is TOML.
    if let Err(error) = imported.text.parse::<toml::Table>() {
        panic!("the network file is not TOML: {error}");
    }
    NetworkFile::parse(&imported.text, Path::new("network.toml")).map(|_| ()).map_err(told)
}

fn read_tmd(case: &[u8], _: &Folder) -> Result<(), String> {
    let read = Tmd::parse(case.to_vec(), Path::new("case.TMD")).map_err(told)?;
    let finite =
        read.nodes.iter().flat_map(|node| &node.temperatures).chain(&read.times).all(|value| value.is_finite());
    assert!(finite);
    let text = internals::network(&read)?.file.text(&[], &[]);
    if let Err(error) = text.parse::<toml::Table>() {
        panic!("the network file is not TOML: {error}");
    }
    Ok(())
}

/// The networks that are seeds, as TMD.
fn tmds() -> Vec<Vec<u8>> {
    let networks = networks();
    let files = networks.iter().filter_map(|seed| NetworkFile::parse(&text(seed), Path::new("network.toml")).ok());
    files.filter_map(|file| tmd(&file, "seed", None).0.bytes().ok()).collect()
}

fn read_model(case: &[u8], folder: &Folder) -> Result<(), String> {
    let path = folder.path("model.gltf");
    let model = Model::parse(case, &path, &Reach::of(&path)).map_err(told)?;
    assert!(model.positions.iter().all(|position| position.is_finite()));
    assert!(model.weld().node_areas().iter().all(|area| area.is_finite()));
    Ok(())
}

fn meshes() -> Vec<Vec<u8>> {
    containers::some(containers::vtk, |bytes| internals::mesh(bytes, Path::new("mesh.vtu")).is_ok())
}

fn read_mesh(case: &[u8], _: &Folder) -> Result<(), String> {
    internals::mesh(case, Path::new("mesh.vtu")).map(|_| ()).map_err(told)
}

fn is_map(bytes: &[u8]) -> bool {
    internals::planet_map(bytes).is_ok()
}

/// A PNG is read as a planet's map and as a map of labels.
fn read_png(case: &[u8], _: &Folder) -> Result<(), String> {
    let labels = internals::read_png(case).map(|_| ()).map_err(told);
    internals::planet_map(case).map(|_| ()).or(labels)
}

fn read_exr(case: &[u8], _: &Folder) -> Result<(), String> {
    internals::planet_map(case).map(|_| ())
}

/// A frame that isotherm wrote.
fn frames() -> Vec<Vec<u8>> {
    vec![include_bytes!("../../../tests/golden/craft.exr").to_vec()]
}

fn read_frame(case: &[u8], _: &Folder) -> Result<(), String> {
    internals::decode_exr(case, Path::new("frame.exr")).map(|_| ()).map_err(told)
}

fn compressed() -> Vec<Vec<u8>> {
    let path = Path::new("model.gltf");
    containers::some(containers::meshopt, |bytes| Model::parse(bytes, path, &Reach::of(path)).is_ok())
}

fn read_trajectory(case: &[u8], _: &Folder) -> Result<(), String> {
    let trajectory = internals::trajectory(&text(case), Path::new("trajectory")).map_err(told)?;
    if trajectory.check(0.0, 60.0).is_ok() {
        let state = trajectory.state(30.0);
        assert!(state.is_none_or(|state| state.position.is_finite()), "{:?}", state.map(|state| state.position));
    }
    Ok(())
}

fn read_attitude(case: &[u8], _: &Folder) -> Result<(), String> {
    internals::attitude(&text(case), Path::new("attitude")).map(|_| ()).map_err(told)
}

/// A table counts as accepted where one of its readers takes it.
fn read_csv(case: &[u8], folder: &Folder) -> Result<(), String> {
    let (text, path) = (text(case), folder.path("case.csv"));
    let function = Function::parse_table(&text, &path, None);
    if let Ok(function) = &function {
        check_function(function);
    }
    let of_time = |read: &dyn Fn() -> Result<(), String>| {
        if text.starts_with("time") { read() } else { Err("it has no times".to_owned()) }
    };
    let results = [
        internals::parse(&text, &path).map(|_| ()).map_err(told),
        function.map(|_| ()).map_err(told),
        of_time(&|| internals::trajectory(&text, &path).map(|_| ()).map_err(told)),
        of_time(&|| internals::attitude(&text, &path).map(|_| ()).map_err(told)),
    ];
    results.into_iter().reduce(|before, after| before.or(after)).unwrap_or(Ok(()))
}

fn read_expression(case: &[u8], _: &Folder) -> Result<(), String> {
    check_function(&Function::expression(&text(case)).map_err(told)?);
    Ok(())
}

fn told(error: impl std::error::Error) -> String {
    error.to_string()
}

fn check_function(function: &Function) {
    for part in 0..=16 {
        let done = function.done(f64::from(part) / 16.0);
        assert!((-1e-6..=1.0 + 1e-6).contains(&done), "f({part}/16) = {done}");
    }
}
