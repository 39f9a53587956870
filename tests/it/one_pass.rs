//! A scene's network in one pass a step: barriers, bindings, device against twin, and the integrator's choice.

use ash::vk::PipelineStageFlags2;
use isotherm::gpu::frame::{Frame, StepRange, Wanted};
use isotherm::gpu::one_pass::frame::OnePassShape;
use isotherm::gpu::one_pass_variant::OnePassVariant;
use isotherm::gpu::pass::Kernel;
use isotherm::gpu::variant::{Curve, StepKind, ThermalVariant};
use isotherm::simulation::device_engine::DeviceEngine;
use isotherm::simulation::prepare::Prepared;
use isotherm::simulation::reference_engine::ReferenceEngine;

use super::craft::{Folder, scene_with};
use super::device::{Worst, assert_silent, context};
use super::hazard::{hazards, unread_by_host};
use super::hazards::each_barrier_is_needed;
use super::mesh_network::{SKIN, TRANSITION, history};
use super::shaders::{bindings_of, declared};

const ONE_PASS: &str = "[network]\nintegrator = \"one_pass\"\n";

/// Shapes with and without blocks, with and without nodes outside them.
fn shapes() -> Vec<OnePassShape> {
    let mut shapes = Vec::new();
    for ends in [[0, 0, 0, 0, 300], [0, 0, 0, 300, 300], [300; 5], [0, 300, 300, 300, 300], [100, 150, 200, 250, 300]] {
        for switches in 0..8 {
            let is = |bit: u32| switches >> bit & 1 == 1;
            shapes.push(OnePassShape { ends, heated: is(0), fine: is(1), masked: is(2) });
        }
    }
    shapes
}

/// The frames of a run, with steps that have no past. A last frame reads the temperatures.
fn frames(shape: OnePassShape) -> Vec<Frame> {
    let variant = ThermalVariant {
        kind: StepKind::Absorb,
        curve: Curve::Power,
        both_sides: false,
        sun: true,
        planet_ir: true,
        albedo: true,
        shadow: false,
        fused: false,
    };
    let ranges = [StepRange { variant, groups: (0, 64), joint: 0 }];
    let mut odd = false;
    let mut frames = vec![Frame::settle(&ranges)];
    for (count, tried) in [(1, false), (1, true), (1, false), (2, false), (3, true), (1, false), (2, true), (2, false)]
    {
        let (steps, next) = shape.steps(count, tried, odd);
        odd = next;
        frames.push(Frame::step(&ranges, Wanted::default()).then(steps));
    }
    frames.push(Frame::step(&[], Wanted { temperatures: true, ..Wanted::default() }));
    frames
}

/// Every list of every shape.
pub fn lists_of_all_shapes() -> Vec<Frame> {
    shapes().into_iter().flat_map(frames).collect()
}

#[test]
fn frames_have_all_their_barriers_and_no_other() {
    for shape in shapes().into_iter().step_by(8) {
        let frames = frames(shape);
        assert_eq!(hazards(&frames), []);
        assert_eq!(unread_by_host(&frames), []);
        each_barrier_is_needed(&frames, 2);
    }
}

#[test]
fn passes_declare_what_their_shaders_touch() {
    let mut seen = Vec::new();
    for frame in lists_of_all_shapes() {
        for pass in frame.passes() {
            if let Some(Kernel::OnePass(variant)) = pass.kernel()
                && !seen.contains(&variant)
            {
                assert_eq!(declared(pass), bindings_of(&variant.shader()), "{}", pass.name);
                assert!(pass.accesses.iter().all(|access| access.scope.stage == PipelineStageFlags2::COMPUTE_SHADER));
                seen.push(variant);
            }
        }
    }
    let mut all = OnePassVariant::all();
    // The last step of a frame is shown, and a trial is followed by it.
    seen.sort_unstable();
    all.sort_unstable();
    assert_eq!(seen, all);
}

fn on_device(prepared: &Prepared) -> Vec<f64> {
    let context = context();
    let found = history(prepared, &mut DeviceEngine::new(&context, prepared, None).expect("a small scene"));
    assert_silent(&context);
    found.concat()
}

fn twin(prepared: &Prepared) -> Vec<f64> {
    history(prepared, &mut ReferenceEngine::new(prepared, None)).concat()
}

const MAST: &str =
    "response = \"network\"\nthickness = 0.001\ndensity = 1600\nspecific_heat = 900\nconductivity = 20\n";
const LAYERS: &str = "response = \"network\"\nthickness = 0.0003\ndensity = 1420\nspecific_heat = 1090\n\
                      over = { effective_emittance = 0.05, thickness = 0.002, density = 2700, specific_heat = 900, \
                      conductivity = 160 }\n";
const CONTACT: &str = "[[contact]]\nbetween = [\"body\", \"mast\"]\nconductance = 0.5\n";
const HEATER: &str = "[[heater]]\npart = \"mast\"\npower = { time = [0, 300, 300], power = [0, 5, 1] }\n";

/// Scenes for one pass: a skin, blankets over structure, a contact, a heater, and a finer mesh in short and long steps.
fn cases() -> Vec<(&'static str, String)> {
    let scene = |changes: &[(&str, &str)], tail: &str| scene_with(changes) + ONE_PASS + tail;
    let skin = (TRANSITION, SKIN);
    let mast = ("response = \"instant\"\n", MAST);
    let warm = "[initial]\ntemperature = 282\n";
    vec![
        ("skin", scene(&[skin], "")),
        ("contact", scene(&[skin, mast], CONTACT)),
        ("layers and a heater", scene(&[(TRANSITION, LAYERS), mast], &format!("{CONTACT}{HEATER}{warm}"))),
        ("fine mesh", scene(&[skin, mast, ("max_edge = 0.7", "max_edge = 0.2"), ("step = 60", "step = 20")], CONTACT)),
        ("short steps", scene(&[skin, mast, ("step = 60", "step = 0.1"), ("steps = 12", "steps = 200")], CONTACT)),
    ]
}

#[test]
fn device_and_twin_agree() {
    for (name, scene) in cases() {
        let prepared = Folder::new(&scene).prepared();
        let network = prepared.network.as_ref().expect("a network");
        assert!(network.plan().is_some(), "{name}: {:?}", prepared.warnings);
        Worst::of(&on_device(&prepared), &twin(&prepared), |node| format!("value {node}")).within(2e-3, "K", name);
    }
}

#[test]
fn one_pass_is_near_the_default_integrator() {
    for (name, scene) in cases() {
        let accurate = Folder::new(&scene.replace("one_pass", "accurate")).prepared();
        let one_pass = Folder::new(&scene).prepared();
        let (one_pass, accurate) = (twin(&one_pass), twin(&accurate));
        let squares = one_pass.iter().zip(&accurate).map(|(found, truth)| (found - truth).powi(2));
        let rms = (squares.sum::<f64>() / accurate.len() as f64).sqrt();
        println!("{name}: {rms:.4} K rms");
        assert!(rms < 0.1, "{name}: {rms} K rms");
        Worst::of(&one_pass, &accurate, |node| format!("value {node}")).within(1.0, "K", name);
    }
}

/// Slow heating is not lost in f32: 2000 steps of 10 ms move a node by less than a thousandth of its rounding each.
#[test]
fn slow_heating_is_not_lost() {
    let scene = scene_with(&[
        (TRANSITION, &SKIN.replace("0.002", "0.2")),
        ("step = 60", "step = 0.01"),
        ("steps = 12", "steps = 2000"),
    ]) + ONE_PASS;
    let prepared = Folder::new(&scene).prepared();
    let (device, twin) = (on_device(&prepared), twin(&prepared));
    let moved = Worst::of(&twin[..prepared.nodes.count], &twin[twin.len() - prepared.nodes.count..], |_| String::new());
    assert!(moved.difference > 1e-3, "the scene must heat: {moved:?}");
    Worst::of(&device, &twin, |node| format!("value {node}")).within(2e-4, "K", "slow heating");
}

/// What one pass does not take is stepped as before, and the user is told.
#[test]
fn a_network_that_does_not_fit_is_stepped_by_the_default_integrator() {
    let massless = LAYERS.replace("density = 1420", "density = 0");
    let switched = "[[heater]]\npart = \"body\"\npower = 300\nprobe = \"side\"\non_below = 281\noff_above = 283\n\
                    [[probe]]\nname = \"side\"\nposition = [1, 0, 0]\npart = \"body\"\n";
    for (reason, skin, tail) in [("stores no heat", massless.as_str(), ""), ("thermostat", SKIN, switched)] {
        let scene = scene_with(&[(TRANSITION, skin)]) + ONE_PASS + tail;
        let prepared = Folder::new(&scene).prepared();
        let network = prepared.network.as_ref().expect("a network");
        assert!(network.plan().is_none());
        assert!(prepared.warnings.iter().any(|text| text.contains(reason)), "{:?}", prepared.warnings);
        assert!(network.description().iter().any(|(_, value)| value.contains(reason)));
        let other = Folder::new(&scene.replace(ONE_PASS, "")).prepared();
        assert_eq!(twin(&prepared), twin(&other));
    }
}

/// A periodic warm-up has long steps, which are divided, and a shorter last one.
#[test]
fn a_periodic_warm_up_ends_near_that_of_the_accurate_integrator() {
    let scene = scene_with(&[
        (TRANSITION, SKIN),
        ("step = 60\n", "step = 60\nwarm_up = \"periodic\"\nwarm_up_tolerance = 0.01\nwarm_up_orbits = 30\n"),
    ]) + ONE_PASS;
    let one_pass = Folder::new(&scene).prepared();
    assert!(one_pass.network.as_ref().is_some_and(|network| network.plan().is_some()));
    let accurate = Folder::new(&scene.replace("one_pass", "accurate")).prepared();
    let accurate = twin(&accurate);
    Worst::of(&twin(&one_pass), &accurate, |node| format!("value {node}")).within(0.5, "K", "the twin");
    Worst::of(&on_device(&one_pass), &accurate, |node| format!("value {node}")).within(0.5, "K", "the device");
}
