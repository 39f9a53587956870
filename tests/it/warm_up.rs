//! The periodic warm-up against plain orbits, one after another, until nothing is left of their start.

use isotherm::internals::{Engine, EngineOrder as Order, PADDING, Prepared, ReferenceEngine, start};

use super::craft::{Folder, never, scene_with};
use super::mesh_network::{CELLS, SKIN, TRANSITION};

/// Tolerance of the warm-up, and bound of its difference from plain orbits [K].
const TOLERANCE: f64 = 0.01;

/// A scene whose orbit is 93 steps, up to the warm-up of its time.
fn scene(changes: &[(&str, &str)], warm_up: &str) -> Prepared {
    let time = format!("step = 60\n{warm_up}\n");
    let whole = [("step = 60\n", &*time), ("period = 5553.6", "period = 5580")];
    let text = scene_with(&[&whole, changes].concat());
    let network =
        if text.contains("\"network\"") { "[network]\nintegrator = \"accurate\"\ntolerance = 1e-4\n" } else { "" };
    Folder::new(&(text + network)).prepared()
}

/// Steps of the warm-up in orbits, whether a periodic one met its tolerance, and its summary; and the temperatures at time 0 of the network and of structures below
/// plates, or of the drawn nodes [K].
fn state(prepared: &Prepared) -> ((f64, bool, String), Vec<f64>) {
    let mut engine = ReferenceEngine::new(prepared, None);
    let done = start(prepared, &mut engine, None, &never(), &mut || ()).expect("it starts");
    let mut all = engine.network_temperatures().expect("f64").unwrap_or_default();
    all.extend(engine.structures().expect("f64"));
    engine.submit(None, Order { temperatures: true, ..Order::default() }).expect("it shows");
    let drawn = engine.deliver().expect("it answers").temperatures.expect("they were asked for");
    // Nodes of a network that was moved are drawn by their next step.
    if all.is_empty() {
        let vertices = &prepared.nodes.vertex_of_node;
        all.extend((0..drawn.len()).filter(|slot| vertices[*slot] != PADDING).map(|slot| f64::from(drawn[slot])));
    }
    let steps = engine.steps() as f64 / 93.0;
    ((steps, done.is_some_and(|done| done.is_met()), done.map_or(String::new(), |done| done.summary())), all)
}

#[test]
#[ignore = "long: tools/test --all"]
fn a_periodic_warm_up_ends_where_plain_orbits_end() {
    let instant = "response = \"instant\"\n";
    let cases = [
        ("network", vec![(TRANSITION, SKIN), (CELLS, instant)], 60, 3, 5.0),
        ("network and transition", vec![(TRANSITION, SKIN)], 60, 3, 5.0),
        ("transition", vec![], 60, 0, 5.0),
        ("instant", vec![(TRANSITION, instant), (CELLS, instant)], 2, 0, 2.0),
    ];
    for (name, changes, plain, few, most) in cases {
        let warm = format!("warm_up = \"periodic\"\nwarm_up_tolerance = {TOLERANCE}\nwarm_up_orbits = 40");
        let ((orbits, is_met, summary), found) = state(&scene(&changes, &warm));
        let after = |orbits: u32| state(&scene(&changes, &format!("warm_up_orbits = {orbits}"))).1;
        let apart = |other: &[f64]| found.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let (left, not_yet) = (apart(&after(plain)), if few > 0 { apart(&after(few)) } else { f64::INFINITY });
        println!(
            "{name}: {orbits:.2} orbits of steps, {summary}; {left:.1e} K off {plain} plain orbits, {not_yet:.1e} K off {few}"
        );
        assert!(is_met && orbits <= most, "{name}: {orbits:.2} orbits of steps, {summary}");
        assert!(left <= TOLERANCE, "{name}: {left}");
        assert!(not_yet > TOLERANCE, "{name}: {few} orbits would do: {not_yet}");
    }
}
