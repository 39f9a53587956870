//! The budget of every pixel: what a surface gains by each cause, against sums by hand.

use std::path::Path;

use isotherm::internals::{CHANNELS, DeviceEngine, Prepared, STEFAN_BOLTZMANN, read_exr, run as run_scene, start};
use isotherm::{EngineError, Image, Reach, Scene};
use serde_json::Value;

use super::craft::{Folder, never, scene_with};
use super::device::context;
use super::mesh_network::{CELLS, SKIN, TRANSITION};
use super::model::make::Maker;
use super::program::{run, succeed};

/// Places of the causes in a budget.
const SUN: usize = 0;
const EXCHANGE: usize = 3;
const CONDUCTION: usize = 4;
const HEATER: usize = 5;
const STORED: usize = 6;
const EMITTED: usize = 7;

const ASKS: &str = "[output]\nbudget = true\n";

/// Horizontal squares of 2 x 2 m, each with a name, the place of its middle and whether its front looks up.
pub(super) fn squares(scene: &str, all: &[(&str, [f32; 3], bool)]) -> Folder {
    let folder = Folder::new(scene);
    let mut maker = Maker::new();
    (maker.json["nodes"], maker.json["scenes"][0]["nodes"]) = (serde_json::json!([]), serde_json::json!([]));
    for (name, [x, y, z], up) in all {
        let material = maker.push("materials", serde_json::json!({ "name": name }));
        let corners = [[x - 1.0, y - 1.0, *z], [x + 1.0, y - 1.0, *z], [x + 1.0, y + 1.0, *z], [x - 1.0, y + 1.0, *z]];
        let positions = maker.floats(&corners);
        let order: [u8; 6] = if *up { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
        let indices = maker.accessor(&order, serde_json::json!({"componentType": 5121, "count": 6, "type": "SCALAR"}));
        let attributes = serde_json::json!({ "POSITION": positions });
        let primitive = serde_json::json!({"attributes": attributes, "indices": indices, "material": material});
        let mesh = maker.primitive(primitive);
        let node = maker.push("nodes", serde_json::json!({"name": name, "mesh": mesh}));
        maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(serde_json::json!(node));
    }
    maker.save(folder.0.path());
    folder
}

const STEP: f64 = 60.0;
const CAPACITY: f64 = 2430.0;
const START: f64 = 300.0;

/// Plates below a Sun that stands 45 deg above +x, without planet and background.
pub(super) fn scene(materials: &[(&str, &str)], sun: &str, rest: &str) -> String {
    let skins: String = materials
        .iter()
        .map(|(name, own)| format!("[[material]]\nmatch = \"{name}\"\nabsorptivity = 0.6\n{own}"))
        .collect();
    format!(
        "name = \"plates\"\n[model]\npath = \"made.glb\"\nmax_edge = 0.5\n[time]\nstep = {STEP}\nsteps = 10\ndraw_every = 5\n\
         [orbit]\naltitude = 408e3\nbeta_deg = 45\n[attitude]\nmode = \"inertial\"\nquaternion = [1, 0, 0, 0]\n\
         [environment]\neclipse = false\n{sun}{skins}\
         [camera]\nwidth = 80\nheight = 60\nfov_deg = 45\nframe = \"body\"\nposition = [-5, -1, 5]\nlook_at = [0, 0, 0]\nup = [0, 0, 1]\n{ASKS}{rest}"
    )
}

pub(super) const LIT: &str = "solar_constant = 1361.0\n";
pub(super) const DARK: &str = "";

fn image(folder: &Folder, step: u32) -> Image {
    read_exr(&folder.path(&format!("out/frames/step_{step:06}.exr"))).expect("an image").0
}

/// Budgets of the pixels of a part, counted from 1.
fn of_part(image: &Image, part: u32) -> Vec<[f64; 8]> {
    let shown = image.budget.iter().zip(&image.part).filter(|(_, of)| **of == part);
    let budgets: Vec<[f64; 8]> = shown.map(|(budget, _)| budget.map(f64::from)).collect();
    assert!(budgets.len() > 100, "{} pixels", budgets.len());
    budgets
}

/// Largest sum of a pixel's budget over the largest emission, with one cause times a factor.
fn closure(image: &Image, cause: usize, factor: f64) -> f64 {
    let shown = || image.budget.iter().zip(&image.part).filter(|(_, part)| **part != 0).map(|(budget, _)| budget);
    let emission = shown().map(|budget| f64::from(budget[EMITTED]).abs()).fold(0.0, f64::max);
    let sum = |budget: &[f32; 8]| {
        let gains =
            budget.iter().enumerate().map(|(own, gain)| f64::from(*gain) * if own == cause { factor } else { 1.0 });
        gains.sum::<f64>().abs()
    };
    assert!(emission > 0.0 && shown().count() > 100);
    shown().map(sum).fold(0.0, f64::max) / emission
}

fn assert_near(name: &str, computed: f64, known: f64, relative: f64) {
    let off = (computed - known).abs();
    assert!(off <= relative * known.abs().max(1.0), "{name}: {computed} W/m2 for {known}");
}

/// Absorbed sunlight of a lit plate by hand [W/m2].
pub(super) fn sunlight() -> f64 {
    0.6 * 1361.0 * 0.5f64.sqrt()
}

/// Temperature of a lit plate [K] after a time [s], from C dT/dt = q - eps sigma T^4 in steps of a tenth of a second.
fn plate(time: f64) -> f64 {
    let rate = |t: f64| (sunlight() - 0.8 * STEFAN_BOLTZMANN * t.powi(4)) / CAPACITY;
    let mut temperature = START;
    for _ in 0..(time / 0.1).round() as u32 {
        let middle = temperature + 0.05 * rate(temperature);
        temperature += 0.1 * rate(middle);
    }
    temperature
}

/// Stefan-Boltzmann's law, and C dT/dt by a difference of temperatures: all four numbers are found without a budget.
#[test]
fn a_plate_has_the_budget_that_is_found_by_hand() {
    let own = format!("emissivity = 0.8\nheat_capacity_per_area = {CAPACITY}\nsides = \"outside\"\n");
    for (response, device) in [("radiative", "cpu"), ("network", "cpu"), ("radiative", "gpu"), ("network", "gpu")] {
        let own = format!("{own}response = \"{response}\"\n");
        let rest = format!("[initial]\ntemperature = {START}\n");
        let folder = squares(&scene(&[("plate", &own)], LIT, &rest), &[("plate", [0.0; 3], true)]);
        let device: &[&str] = if device == "cpu" { &["--device", "cpu"] } else { &[] };
        let ran = run(folder.0.path(), &[&["run", "scene.toml", "-o", "out"], device].concat());
        assert_eq!(ran.code, 0, "{}", ran.err);
        for step in [0, 5, 10] {
            let time = f64::from(step) * STEP;
            let stored = if step == 0 {
                sunlight() - 0.8 * STEFAN_BOLTZMANN * START.powi(4)
            } else {
                CAPACITY * (plate(time + 1.0) - plate(time - 1.0)) / 2.0
            };
            let image = image(&folder, step);
            for budget in of_part(&image, 1) {
                assert_near("sun", budget[SUN], sunlight(), 1e-5);
                assert_near("emitted", budget[EMITTED], -0.8 * STEFAN_BOLTZMANN * plate(time).powi(4), 1e-4);
                assert_near("stored", budget[STORED], -stored, 1e-3);
                for none in [1, 2, EXCHANGE, CONDUCTION, HEATER] {
                    assert!(budget[none].abs() < 1e-3, "{}: {}", CHANNELS[none], budget[none]);
                }
            }
            assert!(closure(&image, SUN, 1.0) < 1e-6 && closure(&image, SUN, 1.001) > 1e-4);
        }
        let report: Value =
            serde_json::from_slice(&std::fs::read(folder.path("out/report.json")).expect("a report")).expect("JSON");
        let mean = report["budgets"][0]["mean_w_per_m2"]["Q_stored"].as_f64().expect("a number");
        let whole = CAPACITY * (plate(600.0) - START) / 600.0;
        assert!((mean / -whole - 1.0).abs() < 0.005, "{mean} W/m2 for {whole}");
    }
}

/// A surface without a memory is in balance, and a transition's budget closes by what it makes or loses.
#[test]
fn surfaces_without_capacity_have_budgets_too() {
    let own = "emissivity = 0.8\nsides = \"outside\"\nresponse = \"instant\"\n";
    let moves = "emissivity = 0.8\nsides = \"outside\"\nresponse = \"transition\"\nretarget = \"merge\"\n\
                 heating = { function = \"linear\", t_max_steps = 20 }\ncooling = { function = \"linear\", t_max_steps = 20 }\n";
    let rest = format!("[initial]\ntemperature = {START}\n");
    let both = [("plate", [0.0; 3], true), ("slow", [0.0, 2.5, 0.0], true)];
    let folder = squares(&scene(&[("plate", own), ("slow", moves)], LIT, &rest), &both);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    let image = image(&folder, 5);
    for budget in of_part(&image, 1) {
        assert_near("emitted", budget[EMITTED], -sunlight(), 1e-5);
        assert!(budget[STORED].abs() < 1e-2, "{budget:?}");
    }
    // A linear way of 20 steps from the start to the balance is at a quarter after five.
    let goal = (sunlight() / (0.8 * STEFAN_BOLTZMANN)).powf(0.25);
    let emitted = 0.8 * STEFAN_BOLTZMANN * (START + 0.25 * (goal - START)).powi(4);
    for budget in of_part(&image, 2) {
        assert_near("emitted", budget[EMITTED], -emitted, 1e-4);
        assert_near("stored", budget[STORED], emitted - sunlight(), 1e-3);
    }
}

/// A cover over one half: the Sun stands above +x at 45 deg, so a cover that is 1 m higher and 1 m further to +x darkens the plate below it.
#[test]
fn a_shadow_takes_the_sun_and_nothing_else() {
    let own = format!(
        "emissivity = 0.8\nheat_capacity_per_area = {CAPACITY}\nsides = \"both\"\nback = {{ absorptivity = 0.6, emissivity = 0.8 }}\nresponse = \"network\"\n"
    );
    let rest = format!("[shadows]\n[initial]\ntemperature = {START}\n");
    let all = [("plate", [0.0; 3], true), ("lit", [-3.0, 0.0, 0.0], true), ("cover", [1.0, 0.0, 1.0], true)];
    let folder = squares(&scene(&[("plate", &own), ("lit", &own), ("cover", &own)], LIT, &rest), &all);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    let image = image(&folder, 0);
    let emitted = 1.6 * STEFAN_BOLTZMANN * START.powi(4);
    for (part, sun) in [(1, 0.0), (2, sunlight())] {
        let budgets = of_part(&image, part);
        // The penumbra on the rim of the plate is left out.
        let inner = budgets.iter().filter(|budget| (budget[SUN] - sun).abs() < 0.02 * sunlight()).count();
        assert!(inner as f64 > 0.8 * budgets.len() as f64, "{inner} of {} pixels of part {part}", budgets.len());
        for budget in budgets {
            assert_near("emitted", budget[EMITTED], -emitted, 1e-4);
            assert_near("stored", budget[STORED], emitted - budget[SUN], 1e-4);
        }
    }
}

/// Two radiators of 4 m2 with a contact, and a heater of 300 W on the first: Newton's method on two equations.
#[test]
fn a_radiator_with_a_heater_has_the_budget_that_is_found_by_hand() {
    let (emissivity, area, power, contact) = (0.8, 4.0, 300.0, 1.5);
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nconductivity = 1e5\nthickness = 0.01\nsides = \"outside\"\nresponse = \"network\"\n";
    let rest = "[[heater]]\npart = \"hot\"\npower = 300\n\
                [[contact]]\nbetween = [\"hot\", \"cold\"]\nconductance = 1.5\ndistance = 0.3\n";
    let all = [("hot", [0.0; 3], true), ("cold", [2.2, 0.0, 0.0], true)];
    let folder = squares(&scene(&[("hot", own), ("cold", own)], DARK, rest), &all);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    let radiation = emissivity * STEFAN_BOLTZMANN * area;
    let (mut hot, mut cold) = (200.0f64, 150.0f64);
    for _ in 0..100 {
        let off = [
            power - contact * (hot - cold) - radiation * hot.powi(4),
            contact * (hot - cold) - radiation * cold.powi(4),
        ];
        let [a, d] = [hot, cold].map(|t| -contact - 4.0 * radiation * t.powi(3));
        let whole = a * d - contact * contact;
        hot -= (off[0] * d - contact * off[1]) / whole;
        cold -= (off[1] * a - contact * off[0]) / whole;
    }
    let moved = contact * (hot - cold) / area;
    for step in [0, 10] {
        let image = image(&folder, step);
        let known = [(1, power / area, -moved, hot), (2, 0.0, moved, cold)];
        for (part, heater, conduction, temperature) in known {
            let budgets = of_part(&image, part);
            let mean = |cause: usize| budgets.iter().map(|budget| budget[cause]).sum::<f64>() / budgets.len() as f64;
            assert_near("heater", mean(HEATER), heater, 1e-5);
            // A contact meets the rim alone, and the plate conducts nearly without a drop.
            assert_near("conduction", mean(CONDUCTION) + mean(STORED), conduction, 0.02);
            assert_near("emitted", mean(EMITTED), -radiation / area * temperature.powi(4), 2e-3);
        }
    }
    let table = std::fs::read_to_string(folder.path("out/budget.csv")).expect("a table");
    let row = table.lines().rfind(|line| line.starts_with("600,hot,")).expect("the last row");
    let cells: Vec<f64> = row.split(',').skip(2).map(|cell| cell.parse().expect("a number")).collect();
    assert_near("heater of the part", cells[HEATER], power / area, 1e-6);
    assert_near("conduction of the part", cells[CONDUCTION], -moved, 1e-3);
    assert_near("storage of the part", cells[STORED], 0.0, 0.05);
}

/// Two black squares face to face at the distance of half their side. View factor: Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11.
#[test]
fn facing_plates_give_each_other_what_the_view_factor_says() {
    let own = "emissivity = 1.0\nheat_capacity_per_area = 1e9\nsides = \"outside\"\nresponse = \"network\"\n";
    let rest = "[exchange]\n[initial]\ntemperature = 300\n";
    let all = [("low", [0.0; 3], true), ("high", [0.0, 0.0, 1.0], false)];
    let text = scene(&[("low", own), ("high", own)], DARK, rest);
    let x: f64 = 2.0;
    let y: f64 = 1.0 + x * x;
    let factor = 2.0 / (std::f64::consts::PI * x * x)
        * ((y * y / (1.0 + 2.0 * x * x)).sqrt().ln() + 2.0 * x * y.sqrt() * (x / y.sqrt()).atan() - 2.0 * x * x.atan());
    for device in [&["--device", "cpu"][..], &[]] {
        let folder = squares(&text, &all);
        succeed(folder.0.path(), &[&["run", "scene.toml", "-o", "out"], device].concat());
        let table = std::fs::read_to_string(folder.path("out/budget.csv")).expect("a table");
        let row = table.lines().rfind(|line| line.starts_with("600,low,")).expect("the last row");
        let cells: Vec<f64> = row.split(',').skip(2).map(|cell| cell.parse().expect("a number")).collect();
        assert_near("exchange", cells[EXCHANGE], factor * STEFAN_BOLTZMANN * 300f64.powi(4), 0.005);
        assert!(closure(&image(&folder, 10), EMITTED, 1.0) < 1e-6);
    }
}

/// The craft with a network, transitions, shadows and exchange through an entry into eclipse.
fn craft(drawn: &str, output: &str) -> Folder {
    let scene = scene_with(&[
        ("draw_every = 4", drawn),
        (TRANSITION, SKIN),
        (CELLS, "response = \"radiative\"\nheat_capacity_per_area = 1500\n"),
    ]);
    Folder::new(&format!(
        "{scene}\n[shadows]\n[exchange]\nrays = 64\n[[heater]]\npart = \"body\"\npower = 40\n{output}"
    ))
}

fn bits(path: &Path) -> Vec<u32> {
    let (image, _) = read_exr(path).expect("an image");
    assert!(closure(&image, SUN, 1.0) < 1e-5, "{}", closure(&image, SUN, 1.0));
    image.budget.iter().flatten().map(|gain| gain.to_bits()).collect()
}

/// A run, a still, images of poses and a run that went on have the same budgets.
#[test]
fn every_place_states_the_budget_of_a_run() {
    for device in [&["--device", "cpu"][..], &[]] {
        let folder = craft("draw_every = 4", ASKS);
        let root = folder.0.path();
        succeed(root, &[&["run", "scene.toml", "-o", "out"], device].concat());
        succeed(root, &[&["render", "scene.toml", "--time", "480", "-o", "one.exr"], device].concat());
        let late = bits(&folder.path("out/frames/step_000008.exr"));
        assert!(late != bits(&folder.path("out/frames/step_000004.exr")));
        assert!(late == bits(&folder.path("one.exr")));
    }
    let folder = craft("images = { start = 0, stop = 600, rate_hz = 0.005 }", ASKS);
    let root = folder.0.path();
    succeed(root, &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    succeed(root, &["render", "scene.toml", "--poses", "out/images.csv", "-o", "poses", "--device", "cpu"]);
    for number in 0..4 {
        let file = format!("frames/image_{number:06}.exr");
        let [run, poses] = ["out", "poses"].map(|of| bits(&folder.path(&format!("{of}/{file}"))));
        let off = |(run, poses): (&u32, &u32)| (f32::from_bits(*run) - f32::from_bits(*poses)).abs();
        // Rounding of what a pixel stores in balance.
        assert!(run.iter().zip(&poses).all(|pair| off(pair) < 1e-9), "{file}");
    }
}

/// The device's budgets are those of its twin.
#[test]
fn the_device_has_the_budgets_of_the_reference() {
    let folder = craft("draw_every = 4", ASKS);
    let root = folder.0.path();
    succeed(root, &["run", "scene.toml", "-o", "cpu", "--device", "cpu"]);
    succeed(root, &["run", "scene.toml", "-o", "gpu"]);
    let rows = |of: &str| -> Vec<Vec<f64>> {
        let table = std::fs::read_to_string(folder.path(&format!("{of}/budget.csv"))).expect("a table");
        let numbers = |line: &str| line.split(',').filter_map(|cell| cell.parse().ok()).collect();
        table.lines().skip(1).map(numbers).collect()
    };
    let [cpu, gpu] = ["cpu", "gpu"].map(rows);
    assert!(cpu.len() == gpu.len() && cpu.len() == 13 * 4, "{} rows", cpu.len());
    let off = |factor: f64| {
        let pairs = cpu.iter().flatten().zip(gpu.iter().flatten());
        pairs.map(|(cpu, gpu)| (cpu - factor * gpu).abs()).fold(0.0, f64::max)
    };
    assert!(off(1.0) < 0.05, "{} W/m2", off(1.0));
    assert!(off(1.001) > 0.05);
}

#[test]
fn only_who_asks_gets_a_budget() {
    let [asks, silent] = [ASKS, ""].map(|output| craft("draw_every = 4", output));
    let root = silent.0.path();
    succeed(root, &["run", "scene.toml", "-o", "out"]);
    let (image, _) = read_exr(&silent.path("out/frames/step_000004.exr")).expect("an image");
    assert!(image.budget.is_empty() && !silent.path("out/budget.csv").exists());
    let report: Value =
        serde_json::from_slice(&std::fs::read(silent.path("out/report.json")).expect("a report")).expect("JSON");
    assert!(report.get("budgets").is_none());
    // Who asks pays on the host: the device has the same passes, modules and buffers.
    let told = |folder: &Folder| succeed(folder.0.path(), &["info", "scene.toml"]);
    let of_device =
        |text: String| text.lines().filter(|line| !line.contains("budget")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(of_device(told(&asks)), of_device(told(&silent)));
    silent.write(
        "bad.toml",
        &format!("{}[output]\nbudget = 3\n", std::fs::read_to_string(silent.path("scene.toml")).expect("a scene")),
    );
    let ran = run(root, &["run", "bad.toml", "-o", "bad"]);
    assert!(ran.code == 2 && ran.err.contains("output.budget: "), "{}", ran.err);
    assert!(!silent.path("bad").exists());
}

/// The images of a model through an orbit in coarse steps, each with its closure. The warm-up is left out.
fn closures(model: &str, rays: u32) -> Vec<f64> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let text = std::fs::read_to_string(models.join(model)).expect("a model");
    let with = |line: &str| match line.split(" =").next() {
        Some("step") => "step = 1852".to_owned(),
        Some("steps") => "steps = 3".to_owned(),
        Some("draw_every") => "draw_every = 1".to_owned(),
        Some("rays") => format!("rays = {rays}"),
        Some("warm_up" | "warm_up_tolerance" | "warm_up_orbits") => String::new(),
        _ => line.to_owned(),
    };
    let text = text.lines().map(with).collect::<Vec<_>>().join("\n");
    let mut scene = Scene::parse_within(&text, &models.join(model), Reach::Anywhere).expect("a scene");
    scene.images.budget = true;
    let prepared = Prepared::from_scene(scene, &mut |_| ()).expect("a scene that can run");
    let context = context();
    let camera = prepared.scene.camera.clone();
    let mut engine = DeviceEngine::new(&context, &prepared, camera.as_ref()).expect("it fits");
    start(&prepared, &mut engine, None, &never(), &mut || ()).expect("the engine starts");
    let mut closures = Vec::new();
    run_scene::<EngineError>(&prepared, &mut engine, None, &never(), &mut |result| {
        closures.extend(result.delivered.image.iter().map(|image| closure(image, SUN, 1.0)));
        Ok(())
    })
    .expect("the engine runs");
    closures
}

/// Every pixel closes through an orbit with networks, joints, sheets, blankets and exchange.
#[test]
#[ignore = "minutes"]
fn every_pixel_of_the_models_closes_over_an_orbit() {
    for model in ["station.toml", "iss.toml", "cubesat_conduction.toml"] {
        if model == "iss.toml"
            && !Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/models/ISS_42.glb").exists()
        {
            println!("skipped: ../shared/data/models/ISS_42.glb is not there");
            continue;
        }
        let closures = closures(model, 32);
        let largest = closures.iter().copied().fold(0.0, f64::max);
        println!("{model}: {largest:.1e} of the largest emission over {} images", closures.len());
        assert!(closures.len() == 4 && largest < 1e-4, "{model}: {closures:?}");
    }
}
