//! `T_error`: the stated error of every pixel against known temperatures.

use std::path::Path;

use glam::{DVec2, DVec3};
use isotherm::internals::{STEFAN_BOLTZMANN, decode, encode, read_exr};
use isotherm::{Image, Placement, Pose, Simulation, Target};
use serde_json::{Value, json};

use super::craft::{Folder, scene_with};
use super::model::make::Maker;
use super::program::{end, isotherm, refusal, stderr, succeed};

const STEP: f64 = 60.0;
const STEPS: u32 = 20;
const CAPACITY: f64 = 2430.0;
const START: f64 = 300.0;
/// Where the shadow on the plate ends [m].
const BORDER: f64 = 0.13;

/// A plate of 4 x 4 m below the Sun, and one beside it at `height` [m] from `beside` [m] on. The Sun stands 45 deg above +x.
fn folder(output: &str, [beside, height]: [f32; 2]) -> Folder {
    let skin = |name: &str| {
        format!(
            "[[material]]\nmatch = \"{name}\"\nabsorptivity = 0.6\nemissivity = 0.8\nheat_capacity_per_area = {CAPACITY}\n\
             thickness = 0.001\nsides = \"outside\"\nresponse = \"radiative\"\n"
        )
    };
    let scene = format!(
        "name = \"plates\"\n[model]\npath = \"made.glb\"\nmax_edge = 0.5\n[time]\nstep = {STEP}\nsteps = {STEPS}\ndraw_every = 10\n\
         [initial]\ntemperature = {START}\n[orbit]\naltitude = 408e3\nbeta_deg = 45\n[attitude]\nmode = \"inertial\"\n\
         quaternion = [1, 0, 0, 0]\n[environment]\nsolar_constant = 1361.0\neclipse = false\n[shadows]\n{}{}\
         [camera]\nwidth = 160\nheight = 120\nfov_deg = 45\nframe = \"body\"\nposition = [-5, -1, 5]\nlook_at = [0, 0, 0]\nup = [0, 0, 1]\n{output}",
        skin("plate"),
        skin("cover"),
    );
    let folder = Folder::new(&scene);
    let mut maker = Maker::new();
    for (name, [from, to], at) in [("plate", [-2.0, 2.0], 0.0), ("cover", [beside, beside + 2.0], height)] {
        let material = maker.push("materials", json!({ "name": name }));
        let corners = [[from, -2.0, at], [to, -2.0, at], [to, 2.0, at], [from, 2.0, at]];
        let positions = maker.floats(&corners);
        let indices =
            maker.accessor(&[0u8, 1, 2, 0, 2, 3], json!({"componentType": 5121, "count": 6, "type": "SCALAR"}));
        let attributes = json!({ "POSITION": positions });
        let mesh = maker.primitive(json!({"attributes": attributes, "indices": indices, "material": material}));
        let node = maker.push("nodes", json!({"name": name, "mesh": mesh}));
        maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    }
    maker.save(folder.0.path());
    folder
}

/// Temperature of the plate under a sunlight of so many solar constants [K]: its balance in steps of a tenth of a second.
fn truth(lit: f64, time: f64) -> f64 {
    let absorbed = 0.6 * 1361.0 * lit * 0.5f64.sqrt();
    let rate = |t: f64| (absorbed - 0.8 * STEFAN_BOLTZMANN * t.powi(4)) / CAPACITY;
    let (mut temperature, length) = (START, 0.1);
    for _ in 0..(time / length).round() as u32 {
        let middle = temperature + 0.5 * length * rate(temperature);
        temperature += length * rate(middle);
    }
    temperature
}

/// True and stated errors of the pixels of the plate [K]. `lit` is the light at a place.
fn errors(folder: &Folder, lit: impl Fn(DVec3) -> f64) -> Vec<[f64; 2]> {
    let mut errors = Vec::new();
    for step in [10, STEPS] {
        let (image, _) = read_exr(&folder.path(&format!("out/frames/step_{step:06}.exr"))).expect("an image");
        let time = f64::from(step) * STEP;
        let [dark, bright] = [0.0, 1.0].map(|lit| truth(lit, time));
        for (pixel, at) in places(&image) {
            let known = if lit(at) > 0.5 { bright } else { dark };
            errors.push([f64::from(image.temperature[pixel]) - known, f64::from(image.error[pixel])]);
        }
    }
    assert!(errors.len() > 2000, "{} pixels", errors.len());
    errors
}

/// Pixels that show the plate, and where [m]. Pixels in the penumbra, or on the rim of the plate, are left out.
fn places(image: &Image) -> Vec<(usize, DVec3)> {
    let to_body = image.camera_from_body.inverse();
    let place = |pixel: usize| {
        let at = [pixel % image.camera.width as usize, pixel / image.camera.width as usize];
        let ray = image.camera.lens.unproject(DVec2::new(at[0] as f64 + 0.5, at[1] as f64 + 0.5))?;
        let at = to_body.transform_point3(DVec3::new(ray.x, ray.y, 1.0) * f64::from(image.depth[pixel]));
        let clear = at.z.abs() < 1e-3 && at.x.abs() < 1.97 && at.y.abs() < 1.97 && (at.x - BORDER).abs() > 0.02;
        (image.part[pixel] != 0 && clear).then_some((pixel, at))
    };
    (0..image.part.len()).filter_map(place).collect()
}

/// Share of the pixels that lie within twice of what is stated, and the stated error over the true one, both rms.
fn honesty(errors: &[[f64; 2]], scale: f64) -> [f64; 2] {
    let within = errors.iter().filter(|[off, stated]| off.abs() <= 2.0 * scale * stated).count();
    let square = |place: usize| errors.iter().map(|both| both[place] * both[place]).sum::<f64>();
    [within as f64 / errors.len() as f64, scale * (square(1) / square(0)).sqrt()]
}

#[test]
fn the_error_at_the_border_of_a_shadow_is_stated() {
    let folder = folder("[output]\nerror = true\n", [1.0 + BORDER as f32, 1.0]);
    let said = succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    let border = |at: DVec3| if at.x < BORDER { 1.0 } else { 0.0 };
    let errors = errors(&folder, border);
    let [within, ratio] = honesty(&errors, 1.0);
    println!("{within:.3} within twice, {ratio:.2} of the true error");
    assert!(within >= 0.9 && ratio <= 4.0, "{within} within twice, {ratio} of the true error");
    assert!(honesty(&errors, 0.1)[0] < 0.9, "a tenth of it is not honest");
    assert!(honesty(&errors, 5.0)[1] > 4.0, "five times it says too little");
    // A shadow that ends elsewhere is an error that the run can not know of.
    let wrong = self::errors(&folder, |at| if at.x < BORDER - 0.8 { 1.0 } else { 0.0 });
    assert!(honesty(&wrong, 1.0)[0] < 0.9, "{:?}", honesty(&wrong, 1.0));
    // The report has it before the difference from the twin.
    let report: Value =
        serde_json::from_slice(&std::fs::read(folder.path("out/report.json")).expect("a report")).expect("JSON");
    let stated = report["pixel_error"]["rms_k"].as_f64().expect("a number");
    assert!(stated > 0.5 && report["pixel_error"]["p99_k"].as_f64() > Some(stated), "{}", report["pixel_error"]);
    assert!(said.contains("error of a pixel's temperature, one standard deviation: rms"), "{said}");
}

#[test]
fn a_sheet_that_is_lit_evenly_has_almost_no_error() {
    // The Sun stands over +x, and the other plate lies to that side, deeper.
    let folder = folder("[output]\nerror = true\n", [2.0, -0.5]);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    let errors = errors(&folder, |_| 1.0);
    let largest = |place: usize| errors.iter().map(|both| both[place].abs()).fold(0.0, f64::max);
    assert!(largest(0) < 0.01 && largest(1) < 0.01, "true {} K, stated {} K", largest(0), largest(1));
    assert!(honesty(&errors, 1.0)[0] >= 0.9, "{:?}", honesty(&errors, 1.0));
}

#[test]
fn only_who_asks_gets_the_channel() {
    let folder = folder("", [1.0 + BORDER as f32, 1.0]);
    let said = succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    let (image, _) = read_exr(&folder.path("out/frames/step_000010.exr")).expect("an image");
    assert!(image.error.is_empty());
    assert!(said.contains("state error = true in [output]"), "{said}");
    let report: Value =
        serde_json::from_slice(&std::fs::read(folder.path("out/report.json")).expect("a report")).expect("JSON");
    assert_eq!(report["pixel_error"], Value::Null);
    for (output, why) in [("error = \"yes\"", "output.error: "), ("errors = true", "output.errors: unknown key")] {
        let scene = std::fs::read_to_string(folder.path("scene.toml")).expect("the scene");
        folder.write("bad.toml", &format!("{scene}[output]\n{output}\n"));
        let (code, line) = refusal(&end(isotherm(folder.0.path(), &["run", "bad.toml", "-o", "bad"])));
        assert!(code == Some(2) && line.contains(why), "{line}");
    }
}

/// The craft in its own shadow and radiation, after a warm-up, with images at the ends of steps or at their own times.
fn craft(output: &str, drawn: &str) -> Folder {
    let scene = scene_with(&[("draw_every = 4", &format!("{drawn}\nwarm_up_orbits = 0.1"))]);
    Folder::new(&format!("{scene}\n[shadows]\n[exchange]\nrays = 64\n{output}"))
}

const ASKS: &str = "[output]\nerror = true\n";

fn image_in(path: &Path) -> Image {
    read_exr(path).expect("an image").0
}

/// The image that a simulation shows at a time [s].
fn image_at(simulation: &mut Simulation, time: f64) -> Image {
    simulation.step_to(time).expect("it steps");
    let camera = simulation.camera().expect("a camera").clone();
    simulation.image(&camera, &Pose::OfCamera).expect("an image")
}

/// Bits of the stated errors.
fn bits(image: &Image) -> Vec<u32> {
    assert!(image.error.iter().any(|error| *error > 0.0), "some pixel has an error");
    image.error.iter().map(|error| error.to_bits()).collect()
}

/// One image, images of poses, and a simulation that is driven from outside state the errors of a run.
#[test]
fn every_place_states_the_errors_of_a_run() {
    let folder = craft(ASKS, "draw_every = 4");
    let root = folder.0.path();
    let load = || Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene");
    succeed(
        root,
        &["run", "scene.toml", "-o", "out", "--device", "cpu", "--save-state", "state", "--save-state-at", "240"],
    );
    let [early, late] = [4, 8].map(|step| image_in(&folder.path(&format!("out/frames/step_{step:06}.exr"))));
    assert_ne!(bits(&early), bits(&late), "another time has other errors");

    succeed(root, &["render", "scene.toml", "--time", "480", "-o", "one.exr", "--device", "cpu"]);
    assert_eq!(bits(&image_in(&folder.path("one.exr"))), bits(&late));

    let mut simulation = load();
    assert_eq!(bits(&image_at(&mut simulation, 240.0)), bits(&early));
    // A saved state has the errors, in a simulation and in the file of a run.
    let saved = encode(&simulation.save().expect("a state")).expect("bytes");
    let of_run = std::fs::read(folder.path("state")).expect("the state of the run");
    for bytes in [&saved, &of_run] {
        let mut other = load();
        other.step_to(60.0).expect("it steps");
        other.restore(&decode(bytes).expect("a state")).expect("it fits");
        assert_eq!(bits(&image_at(&mut other, 480.0)), bits(&late));
    }
    // A step in two halves is another way, and its errors are other ones.
    simulation.step_to(270.0).expect("it steps");
    let halves = image_at(&mut simulation, 480.0);
    assert_ne!(bits(&halves), bits(&late));
    // They begin anew with a state that has none.
    let silent = craft("", "draw_every = 4");
    let mut silent = Simulation::load(&silent.path("scene.toml"), &Target::Reference).expect("a scene");
    let without = image_at(&mut silent, 240.0);
    assert!(without.error.is_empty() && without.temperature == early.temperature, "errors change no temperature");
    let mut anew = load();
    anew.restore(&silent.save().expect("a state")).expect("it fits");
    let anew = image_at(&mut anew, 480.0);
    assert!(bits(&anew) != bits(&late) && anew.temperature == late.temperature);
}

#[test]
fn images_of_poses_state_the_errors_of_a_run() {
    let folder = craft(ASKS, "images = { start = 0, stop = 600, rate_hz = 0.005 }");
    let root = folder.0.path();
    succeed(root, &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    succeed(root, &["render", "scene.toml", "--poses", "out/images.csv", "-o", "poses", "--device", "cpu"]);
    let images =
        |of: &str| [1, 2, 3].map(|number| bits(&image_in(&folder.path(&format!("{of}/frames/image_{number:06}.exr")))));
    let [run, poses] = ["out", "poses"].map(images);
    assert!(run == poses && run[0] != run[1] && run[1] != run[2]);
}

#[test]
fn a_state_without_errors_is_told() {
    let folder = craft("", "draw_every = 4");
    let root = folder.0.path();
    succeed(
        root,
        &["run", "scene.toml", "-o", "out", "--device", "cpu", "--save-state", "state", "--save-state-at", "0"],
    );
    let scene = std::fs::read_to_string(folder.path("scene.toml")).expect("the scene");
    folder.write("asks.toml", &format!("{scene}{ASKS}"));
    let from = |scene: &str| {
        let arguments = ["render", scene, "--time", "60", "-o", "a.exr", "--device", "cpu", "--from-state", "state"];
        stderr(&end(isotherm(root, &arguments)))
    };
    assert!(from("asks.toml").contains("T_error begins anew at time 0"), "{}", from("asks.toml"));
    assert!(!image_in(&folder.path("a.exr")).error.is_empty());
    assert!(!from("scene.toml").contains("T_error"));
    assert!(image_in(&folder.path("a.exr")).error.is_empty());
}

/// Nothing says where a placed craft was before, so its errors begin at its first place.
#[test]
fn the_errors_of_a_placed_craft_begin_with_its_first_place() {
    let folder = craft(ASKS, "draw_every = 4");
    let load = || Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene");
    let [mut placed, mut own] = [load(), load()];
    for time in [100.0, 160.0] {
        placed.place(Placement { time, ..Placement::default() }).expect("a place");
    }
    let image = image_at(&mut placed, 160.0);
    assert!(image.error.iter().all(|error| error.is_finite()));
    assert_ne!(bits(&image), bits(&image_at(&mut own, 160.0)));
}

/// A sheet that a joint turns by 180 deg in four steps, whose load is that of the middle of each. All of it errs alike, so conduction takes none of the error away.
#[test]
fn the_error_of_a_conducting_sheet_that_errs_alike_stays() {
    let scene = "name = \"sheet\"\n[model]\npath = \"made.glb\"\nmax_edge = 0.1\n[time]\nstep = 60\nsteps = 12\ndraw_steps = [4, 12]\n\
         [initial]\ntemperature = 300\n[orbit]\naltitude = 408e3\nbeta_deg = 0\n[attitude]\nmode = \"inertial\"\n\
         quaternion = [1, 0, 0, 0]\n[environment]\nsolar_constant = 1361.0\neclipse = false\n[output]\nerror = true\n\
         [[material]]\nmatch = \"sheet\"\nabsorptivity = 0.9\nemissivity = 0.8\nsides = \"both\"\n\
         back = { absorptivity = 0.2, emissivity = 0.7 }\nheat_capacity_per_area = 4000\nthickness = 0.001\n\
         conductivity = 160\nresponse = \"network\"\n[[joint]]\npart = \"sheet\"\nmode = \"schedule\"\naxis = \"+Y\"\n\
         schedule = { time = [0, 240], angle_deg = [0, 180] }\n\
         [camera]\nwidth = 64\nheight = 48\nfov_deg = 30\nframe = \"body\"\nposition = [2, -1, 1]\nlook_at = [0, 0, 0]\n";
    let folder = Folder::new(scene);
    let mut maker = Maker::new();
    let material = maker.push("materials", json!({ "name": "sheet" }));
    let positions = maker.floats(&[[0.0, -0.5, -0.5], [0.0, 0.5, -0.5], [0.0, 0.5, 0.5], [0.0, -0.5, 0.5]]);
    let indices = maker.accessor(&[0u8, 1, 2, 0, 2, 3], json!({"componentType": 5121, "count": 6, "type": "SCALAR"}));
    maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "material": material}));
    // The first node of a new model shows its first mesh.
    maker.json["nodes"][0]["name"] = json!("sheet");
    maker.save(folder.0.path());
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    // The balance of one temperature, in steps of a tenth of a second.
    let rate = |time: f64, t: f64| {
        let cosine = (std::f64::consts::PI * (time / 240.0).min(1.0)).cos();
        let absorptivity = if cosine > 0.0 { 0.9 } else { 0.2 };
        (absorptivity * 1361.0 * cosine.abs() - 1.5 * STEFAN_BOLTZMANN * t.powi(4)) / 4000.0
    };
    let mut known = 300.0;
    for tenth in 0..7200 {
        let time = 0.1 * f64::from(tenth);
        let middle = known + 0.05 * rate(time, known);
        known += 0.1 * rate(time + 0.05, middle);
        let Some(step) = [4, 12].into_iter().find(|step| 600 * step == tenth + 1) else { continue };
        let (image, _) = read_exr(&folder.path(&format!("out/frames/step_{step:06}.exr"))).expect("an image");
        let seen: Vec<usize> = (0..image.part.len()).filter(|pixel| image.part[*pixel] != 0).collect();
        assert!(seen.len() > 100, "{}", seen.len());
        for pixel in seen {
            let off = (f64::from(image.temperature[pixel]) - known).abs();
            let stated = f64::from(image.error[pixel]);
            assert!(off > 0.2 && stated > 0.5 * off && stated < 2.0 * off, "step {step}: {stated} for {off}");
        }
    }
}
