//! `isotherm info` lists exactly the passes that a run records.

use isotherm::EngineError;
use isotherm::internals::{DeviceEngine, run, start};

use super::craft::{Folder, never, scene_with};
use super::device::context;
use super::joints::MOVING;
use super::mesh_network::{SKIN, TRANSITION};
use super::program::json;
use super::reflections::shining;

/// Lit from the first step to the last, with an image in each. The Sun turns far enough for new shadows in each step.
const LIT: [(&str, &str); 3] =
    [("phase_deg = 80", "phase_deg = 0"), ("steps = 12", "steps = 2"), ("draw_every = 4", "draw_every = 1")];
const SHADOWS: &str = "[shadows]\nredraw_angle_deg = 0\n";
const RAYS: &str = "[shadows]\nredraw_angle_deg = 0\nmethod = \"exact\"\n";
const EXCHANGE: &str = "[exchange]\nrays = 64\npatch_edge = 2\nredraw_angle_deg = 0\n";
const SENSOR: &str =
    "[sensor]\nseed = 3\nnetd = 0.05\nrange = [150, 400]\npoint_spread = \"gaussian\"\nsigma = 0.7\nbits = 14\n";

/// A scene for each effect, and scenes with many at once.
fn scenes() -> Vec<(&'static str, String)> {
    let lit = |changes: &[(&str, &str)], tail: &str| scene_with(&[&LIT[..], changes].concat()) + tail;
    let network = "[network]\nintegrator = \"one_pass\"\n";
    let shown = |changes: &[(&str, &str)]| shining(&[&LIT[..], changes].concat());
    let samples = ("near = 0.5", "near = 0.5\nsamples = 4");
    vec![
        ("plain", lit(&[], "")),
        ("shadow map", lit(&[], SHADOWS)),
        ("rays of shadows", lit(&[], RAYS)),
        ("joints", lit(&[], &format!("{SHADOWS}{MOVING}"))),
        ("exchange", lit(&[], &format!("{RAYS}{EXCHANGE}"))),
        ("network", lit(&[(TRANSITION, SKIN)], network)),
        ("samples", lit(&[samples], "")),
        ("sky and reflections", shown(&[])),
        ("reflections of the craft", shown(&[("reflections = \"environment\"", "reflections = \"traced\"")])),
        ("sensor", lit(&[], SENSOR)),
        ("many at once", lit(&[(TRANSITION, SKIN), samples], &format!("{network}{RAYS}{MOVING}{SENSOR}"))),
    ]
}

#[test]
fn info_lists_the_passes_that_a_run_records() {
    let context = context();
    for (name, scene) in scenes() {
        let folder = Folder::new(&scene);
        let prepared = folder.prepared();
        let told = json(folder.0.path(), &["info", "scene.toml", "--json"]);
        let entries = told["frame"].as_array().expect("a frame");
        let listed: Vec<&str> = entries.iter().filter_map(|entry| entry["pass"].as_str()).collect();
        let mut engine = DeviceEngine::new(&context, &prepared, prepared.scene.camera.as_ref()).expect("a small scene");
        start(&prepared, &mut engine, None, &never(), &mut || ()).expect("the engine starts");
        engine.renderer.take_pass_names();
        run::<EngineError>(&prepared, &mut engine, None, &never(), &mut |_| Ok(())).expect("the engine runs");
        let frames = engine.renderer.take_pass_names();
        // Triangles are culled for the first image, at the start, and then hold while the camera stands still.
        let is_culled = |pass: &&str| *pass == "cull";
        let has = |frame: &&Vec<String>, pass: &str| frame.iter().any(|one| one.starts_with(pass));
        let image = frames.iter().find(|frame| has(frame, "cull")).expect("an image");
        // The first step has the load for which the craft was settled. An image that needs the temperatures of its step has a frame after it.
        let step = frames.iter().rposition(|frame| has(&frame, "thermal_step")).expect("a step");
        let is_whole = has(&&frames[step], "read radiance");
        let of_step = &frames[step..=step + usize::from(!is_whole)];
        assert!(of_step.iter().any(|frame| has(&frame, "read radiance")), "{name}: an image");
        let recorded: Vec<&str> = of_step.iter().flatten().map(String::as_str).collect();
        let drawn: Vec<&str> = image.iter().map(String::as_str).collect();
        let count = |passes: &[&str]| passes.iter().copied().filter(|pass| is_culled(pass)).count();
        let others = |passes: &[&str]| {
            let mut others: Vec<&str> = passes.iter().copied().filter(|pass| !is_culled(pass)).collect();
            if !is_whole {
                // Temperatures are read before the image.
                others.sort_unstable();
            }
            others.join("\n")
        };
        assert_eq!(count(&drawn), count(&listed), "{name}");
        assert_eq!(others(&recorded), others(&listed), "{name}");
        // Later frames have the same work, or less.
        let kind = |pass: &str| pass.split('.').next().unwrap_or_default().to_owned();
        for pass in frames.iter().flatten() {
            assert!(listed.iter().any(|one| kind(one) == kind(pass)), "{name}: '{pass}' is not listed");
        }
    }
}
