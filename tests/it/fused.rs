//! Many steps in one dispatch give the same result as single steps, through an eclipse, with shadows and with joints that turn.

use isotherm::internals::{DeviceEngine, Engine, EngineOrder as Order, EngineStep, FUSED_STEPS, Prepared};

use super::craft::{Folder, scene_with};
use super::device::{assert_silent, context};

/// Number of steps: sunlight, penumbra, umbra and back.
const STEPS: u32 = 80;

/// The skin has its own function, and the cells use the restart rule. The scene has one more section.
fn prepared(section: &str) -> Prepared {
    let skin = "heating = { function = \"quadratic\", t_max_steps = 20 }";
    let own = "heating = { function = \"expression\", text = \"s*s*(3.0-2.0*s)\", t_max_steps = 20 }";
    let cells = "heating = { function = \"quadratic\", t_max_steps = 4 }";
    let anew = format!("retarget = \"restart\"\n{cells}");
    let scene = scene_with(&[
        (skin, own),
        (&format!("retarget = \"merge\"\n{cells}"), &anew),
        ("[radiance]", &format!("{section}[radiance]")),
    ]);
    Folder::new(&scene).prepared()
}

/// The state after the steps, done singly or several at once. `change` scales the Sun of one of the last steps.
fn state(prepared: &Prepared, at_once: usize, change: f64) -> (Vec<f32>, DeviceEngine) {
    let context = context();
    let mut engine = DeviceEngine::new(&context, prepared, None).expect("a small scene");
    engine.settle_at(250.0, prepared.nodes.vertex_of_node.len()).expect("it settles");
    let step = prepared.scene.time.step;
    let starts: Vec<f64> = (0..STEPS).map(|number| f64::from(number) * step).collect();
    let mut loads: Vec<_> = starts.iter().map(|start| prepared.loads.step_load(*start, start + step)).collect();
    assert!(loads.iter().any(|load| load.sun.is_empty()) && loads.iter().any(|load| load.albedo.is_some()));
    loads[STEPS as usize - 3].sun.iter_mut().for_each(|sample| sample.flux *= change);
    let steps: Vec<EngineStep<'_>> = starts
        .iter()
        .zip(&loads)
        .map(|(start, load)| EngineStep { load, steps: 1.0, start: *start, length: step })
        .collect();
    for some in steps.chunks(at_once) {
        if at_once == 1 {
            engine.submit(Some(some[0]), Order::default()).expect("submitted");
            engine.deliver().expect("delivered");
        } else {
            engine.forward(some).expect("they pass");
        }
    }
    engine.submit(None, Order { temperatures: true, ..Order::default() }).expect("submitted");
    let temperatures = engine.deliver().expect("delivered").temperatures.expect("temperatures");
    assert_silent(&context);
    (temperatures, engine)
}

fn dispatches(engine: &dyn Engine, fused: bool) -> usize {
    let passes = engine.pass_times().expect("a device").iter();
    let start = if fused { "forward thermal_step." } else { "thermal_step." };
    let thermal = passes.filter(|(name, _)| name.starts_with(start));
    thermal.map(|(_, samples)| samples.len()).sum()
}

#[test]
#[ignore = "long: tools/test --all"]
fn many_steps_in_a_dispatch_leave_what_they_leave_one_by_one() {
    let prepared = prepared("");
    let (one_by_one, separate) = state(&prepared, 1, 1.0);
    let (at_once, together) = state(&prepared, STEPS as usize, 1.0);
    assert!(one_by_one == at_once, "to the last bit");
    let (other, _) = state(&prepared, STEPS as usize, 0.999);
    assert!(one_by_one != other, "a Sun dimmer by a thousandth in one step shows");

    // Lit, dark, lit: each phase may end with a single step.
    assert_eq!(separate.fused_steps(), 0);
    assert!((u64::from(STEPS) - 3..=u64::from(STEPS)).contains(&together.fused_steps()));
    assert_eq!((together.steps(), dispatches(&separate, true)), (u64::from(STEPS), 0));
    // Ranges of skin and cells in three phases. No run is longer than a dispatch allows.
    let ranges = prepared.step_ranges().iter().filter(|range| range.variant.kind.has_state()).count();
    let most = ranges * (3 + STEPS as usize / FUSED_STEPS + 1);
    let found = dispatches(&together, true);
    assert!(found > 0 && found <= most, "{found} dispatches for {ranges} ranges, at most {most}");
    assert_eq!(dispatches(&separate, false), prepared.step_ranges().len() * STEPS as usize);
}

#[test]
#[ignore = "long: tools/test --all"]
fn shadows_found_anew_end_a_dispatch() {
    let prepared = prepared("[shadows]\nredraw_angle_deg = 10\n");
    let (one_by_one, _) = state(&prepared, 1, 1.0);
    let (at_once, together) = state(&prepared, STEPS as usize, 1.0);
    assert!(one_by_one == at_once, "to the last bit");
    let (without, free) = state(&self::prepared(""), STEPS as usize, 1.0);
    assert!(one_by_one != without, "shadows show");
    assert!(dispatches(&together, true) > dispatches(&free, true), "light found anew ends a dispatch");
}

#[test]
fn each_joint_has_its_own_loads_in_a_dispatch() {
    let wings = "[[joint]]\npart = \"wing_*\"\nmode = \"sun\"\naxis = \"+Y\"\nsun_axis = \"-Z\"\n";
    let prepared = prepared(wings);
    let (one_by_one, _) = state(&prepared, 1, 1.0);
    let (at_once, together) = state(&prepared, STEPS as usize, 1.0);
    assert!(one_by_one == at_once, "to the last bit");
    assert!((u64::from(STEPS) - 3..=u64::from(STEPS)).contains(&together.fused_steps()));
    let (fixed, _) = state(&self::prepared(""), STEPS as usize, 1.0);
    assert!(one_by_one != fixed, "turned wings show");
}
