//! The network of a scene as a network file: solved by itself it has the temperatures of the scene.

use isotherm::EngineError;
use isotherm::internals::{
    Engine, IntegrationSettings, Integrator, NetworkFile, Prepared, ReferenceEngine, ReferenceStepper, integrate,
    network_file, run, start,
};

use super::craft::{Folder, never, scene_with};
use super::mesh_network::{SKIN, TRANSITION};
use super::model::shared_files::shared;
use super::program::run as run_program;

/// What the scene and its network file may differ by [K]: the integrator's own limit of 2 mK.
const LIMIT: f64 = 2e-3;

/// Temperatures of the network at the end of a scene [K].
fn of_the_scene(prepared: &Prepared) -> Vec<f64> {
    let mut engine = ReferenceEngine::new(prepared, None);
    start(prepared, &mut engine, None, &never(), &mut || ()).expect("it starts");
    run::<EngineError>(prepared, &mut engine, None, &never(), &mut |_| Ok(())).expect("it runs");
    engine.network_temperatures().expect("f64").expect("a network")
}

/// The same from the network file alone, by way of its text.
fn of_the_file(prepared: &Prepared, change: impl Fn(&mut NetworkFile)) -> Vec<f64> {
    let file = network_file(prepared, &never(), &mut || ()).expect("a start").expect("a network");
    let mut file =
        NetworkFile::parse(&file.text(&[], &[]), std::path::Path::new("network.toml")).expect("a network file");
    change(&mut file);
    let mut stepper = ReferenceStepper::new(file.network.clone(), &file.schedule.sensors());
    let settings = IntegrationSettings::of(Integrator::Accurate);
    let series = integrate(&mut stepper, &file.network, &file.schedule, &settings, |_| true).expect("a solution");
    series.rows.last().expect("rows").clone()
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn agrees(prepared: &Prepared, name: &str) {
    let scene = of_the_scene(prepared);
    let error = worst(&scene, &of_the_file(prepared, |_| ()));
    println!("{name}: {} nodes, the network file is {:.3} mK off the scene", scene.len(), 1e3 * error);
    assert!(error <= LIMIT, "{name}: {error}");
    let other = of_the_file(prepared, |file| file.network.emissive_areas[0] *= 1.1);
    assert!(worst(&scene, &other) > LIMIT, "{name}: another network must not pass");
}

const ACCURATE: &str = "[network]\nintegrator = \"accurate\"\n";

#[test]
fn a_network_file_has_the_temperatures_of_its_scene() {
    let tail = "[[heater]]\npart = \"mast\"\npower = { time = [0, 300, 300], power = [0, 5, 1] }\n\
                [[heater]]\npart = \"body\"\npower = 300\nprobe = \"side\"\non_below = 281\noff_above = 283\n\
                [[contact]]\nbetween = [\"body\", \"mast\"]\nconductance = 0.5\n\
                [[probe]]\nname = \"side\"\nposition = [1, 0, 0]\npart = \"body\"\n[shadows]\n[initial]\ntemperature = 282\n";
    let mast = "response = \"network\"\nthickness = 0.001\ndensity = 1600\nspecific_heat = 900\nconductivity = 20\n";
    let scene = scene_with(&[(TRANSITION, SKIN), ("response = \"instant\"\n", mast)]);
    agrees(&Folder::new(&format!("{scene}{tail}{ACCURATE}")).prepared(), "craft");
}

#[test]
fn the_network_file_of_a_cubesat_has_its_temperatures() {
    let Some(shared) = shared() else { return };
    let folder = Folder::new("");
    std::fs::copy(shared.join("models/Cubesat3U_42.glb"), folder.path("made.glb")).expect("copied");
    let scene = format!(
        "[model]\npath = \"made.glb\"\nmax_edge = 0.1\n[time]\nstep = 60\nsteps = 95\ndraw_every = 0\n[orbit]\naltitude = 500e3\nbeta_deg = 20\n\
         [attitude]\nmode = \"nadir\"\n[environment]\nsolar_constant = 1361\nalbedo = 0.3\nplanet_ir = 237\n\
         background_temperature = 2.7\n{ACCURATE}[[material]]\nmatch = \"*\"\nabsorptivity = 0.6\nemissivity = 0.8\n{SKIN}"
    );
    folder.write("scene.toml", &scene);
    agrees(&folder.prepared(), "cubesat, an orbit");
}

#[test]
fn the_program_writes_the_network_of_a_scene() {
    let folder = Folder::new(&(scene_with(&[(TRANSITION, SKIN)]) + ACCURATE));
    let ran = run_program(folder.0.path(), &["info", "scene.toml", "--network", "network"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let file = NetworkFile::load(&folder.path("network/network.toml")).expect("a network file");
    assert!(file.labels[0].starts_with("body:1") && file.times.len() == 13, "{:?}", file.labels);
    let table = std::fs::read_to_string(folder.path("network/nodes.csv")).expect("a table");
    assert_eq!(table.lines().count(), file.labels.len() + 1);
    let ran = run_program(folder.0.path(), &["info", "scene.toml", "--network", "network"]);
    assert_eq!(ran.code, 2, "the folder has files");
    let ran = run_program(folder.0.path(), &["info", "scene.toml", "--network", "network", "--force"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let folder = Folder::new(&scene_with(&[]));
    let ran = run_program(folder.0.path(), &["info", "scene.toml", "--network", "network"]);
    assert!(ran.code == 2 && ran.err.contains("has no thermal network"), "{}", ran.err);
}
