//! Radiation between surfaces on the device: rays and steps against their f64 twins, barriers, and what is absent without it.

use std::sync::Arc;

use isotherm::EngineError;
use isotherm::internals::{
    Context, Curve, DeviceData, DeviceEngine, Engine, EngineOrder as Order, EngineStep, ExchangeTables, Frame, Lit,
    PADDING, Prepared, ReferenceEngine, STEFAN_BOLTZMANN, StepKind, StepRange, ThermalVariant, Wanted, run,
};
use serde_json::json;

use crate::craft::{Folder, glb_of_box, never, scene_with};
use crate::device::{Worst, assert_silent, context};
use crate::hazards::each_barrier_is_needed;
use crate::mesh_network::{CELLS, SKIN, TRANSITION, history};
use crate::model::make::Maker;
use crate::program::{end, isotherm, stderr, succeed};

const EXCHANGE: &str =
    "[shadows]\nmethod = \"exact\"\n[exchange]\nrays = 128\npatch_edge = 0.8\nredraw_angle_deg = 0\n[radiance]";

/// Wings that mirror half of the sunlight that they reflect, and a body that mirrors more.
const MIRRORS: [(&str, &str); 3] = [
    ("absorptivity = 0.75\n", "absorptivity = 0.4\nspecular = 0.5\n"),
    ("absorptivity = 0.29\n", "absorptivity = 0.29\nspecular = 0.8\nroughness = 0.1\n"),
    ("[radiance]", "specular_sunlight = true\n[radiance]"),
];

/// The craft with exchange and these changes.
fn prepared(changes: &[(&str, &str)]) -> Prepared {
    Folder::new(&scene_with(&[&[("[radiance]", EXCHANGE)], changes].concat())).prepared()
}

/// Differences over a run. Both engines cast their own rays.
fn apart(context: &Arc<Context>, prepared: &Prepared) -> Worst {
    let device = history(prepared, &mut DeviceEngine::new(context, prepared, None).expect("a small scene")).concat();
    let twin = history(prepared, &mut ReferenceEngine::new(prepared, None)).concat();
    Worst::of(&device, &twin, |node| format!("value {node}"))
}

#[test]
fn steps_follow_their_twin_with_every_response() {
    let context = context();
    let radiative = "response = \"radiative\"\nheat_capacity_per_area = 4000\n";
    for (what, changes) in [
        ("transition", vec![]),
        ("network", vec![(TRANSITION, SKIN)]),
        ("radiative", vec![(TRANSITION, radiative), (CELLS, radiative)]),
        ("instant", vec![(CELLS, "response = \"instant\"\n")]),
        ("mirrors", MIRRORS.to_vec()),
    ] {
        let prepared = prepared(&changes);
        let worst = apart(&context, &prepared);
        println!("{what}: {:.1e} K", worst.difference);
        worst.within(0.05, "K", what);
        let of_section = |change: &&(&str, &str)| change.1.starts_with("specular_sunlight");
        let others: Vec<(&str, &str)> = changes.iter().filter(|change| !of_section(change)).copied().collect();
        let without = Folder::new(&scene_with(
            &[&[("[radiance]", "[shadows]\nmethod = \"exact\"\n[radiance]")], &others[..]].concat(),
        ));
        let alone = history(&without.prepared(), &mut ReferenceEngine::new(&without.prepared(), None)).concat();
        let with = history(&prepared, &mut ReferenceEngine::new(&prepared, None)).concat();
        let change = Worst::of(&with, &alone, |node| format!("value {node}"));
        assert!(change.difference > 1.0, "{what}: exchange changes {} K", change.difference);
    }
    assert_silent(&context);
}

/// Temperatures after these steps of 60 s.
fn advance(prepared: &Prepared, engine: &mut DeviceEngine, steps: std::ops::Range<u32>) -> Vec<f32> {
    for number in steps {
        let (start, length) = (60.0 * f64::from(number), 60.0);
        let load = prepared.loads.step_load(start, start + length);
        engine.submit(Some(EngineStep { load: &load, steps: 1.0, start, length }), Order::default()).expect("a step");
        engine.deliver().expect("a step");
    }
    engine.submit(None, Order { temperatures: true, ..Order::default() }).expect("a state");
    engine.deliver().expect("a state").temperatures.expect("temperatures")
}

/// Infrared that is held over the time of a saved state goes on to hold.
#[test]
fn a_saved_state_goes_on_while_infrared_is_held() {
    let context = context();
    let prepared = prepared(&[("redraw_angle_deg = 0\n", "redraw_angle_deg = 90\nhold = 3600\n")]);
    let engine = || DeviceEngine::new(&context, &prepared, None).expect("a small scene");
    let advance = |engine: &mut DeviceEngine, steps| advance(&prepared, engine, steps);
    let mut whole = engine();
    whole.settle_at(300.0, prepared.nodes.vertex_of_node.len()).expect("a start");
    advance(&mut whole, 0..3);
    let saved = whole.save().expect("a state");
    let held = whole.renderer.received().expect("what patches received");
    assert!(held.iter().any(|flux| *flux > 1.0), "something is held");
    let mut resumed = engine();
    resumed.restore(&saved, 100).expect("its own state");
    assert_eq!(advance(&mut whole, 3..6), advance(&mut resumed, 3..6));
    assert_eq!(whole.renderer.received().expect("what patches received"), held, "it was held until the end");
    assert_silent(&context);
}

/// Surfaces of a convex craft do not see each other. The device steps it all the same.
#[test]
fn a_convex_craft_has_exchange_without_rows() {
    let folder = Folder::new(
        "name = \"box\"\n[model]\npath = \"made.glb\"\nmax_edge = \"file\"\n[time]\nstep = 60\nsteps = 5\ndraw_every = 0\n[orbit]\naltitude = 408e3\n[attitude]\nmode = \"nadir\"\n\
             [environment]\nsolar_constant = 1361\nplanet_ir = 237\neclipse = false\n[initial]\ntemperature = 300\n\
             [[material]]\nmatch = \"skin\"\nabsorptivity = 0.4\nemissivity = 0.63\nsides = \"outside\"\nresponse = \"radiative\"\n\
             heat_capacity_per_area = 200\n[shadows]\n[exchange]\n[radiance]\nband_um = [8, 14]\n",
    );
    glb_of_box().save(folder.0.path());
    let worst = apart(&context(), &folder.prepared());
    worst.within(0.01, "K", "a box with exchange");
}

/// A start that knows no neighbours is told, unless the scene states a start or has no exchange.
#[test]
fn a_start_without_neighbours_is_told() {
    let is_told = |prepared: Prepared| prepared.warnings.iter().any(|warning| warning.contains("without --from-state"));
    assert!(is_told(prepared(&[])));
    assert!(!is_told(prepared(&[("[radiance]", "[initial]\ntemperature = 290\n[radiance]")])));
    assert!(!is_told(prepared(&[("step = ", "warm_up = \"periodic\"\nstep = ")])));
    assert!(!is_told(Folder::new(&scene_with(&[])).prepared()));
}

/// The key changes temperatures where a material mirrors. Where none does, it changes nothing and says so.
#[test]
fn mirrored_sunlight_is_an_option() {
    let temperatures = |changes: &[(&str, &str)]| {
        let prepared = prepared(changes);
        (history(&prepared, &mut ReferenceEngine::new(&prepared, None)).concat(), prepared.warnings.join("\n"))
    };
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let (with, warnings) = temperatures(&MIRRORS);
    let change = apart(&with, &temperatures(&MIRRORS[..2]).0);
    println!("mirrored sunlight changes {change:.2} K");
    assert!(change > 0.5 && !warnings.contains("specular_sunlight"), "{change} K, {warnings}");
    let (none, warnings) = temperatures(&MIRRORS[2..]);
    assert_eq!(apart(&none, &temperatures(&[]).0), 0.0);
    assert!(warnings.contains("specular_sunlight changes nothing"), "{warnings}");
    let has_buffers = |changes: &[(&str, &str)]| {
        let prepared = prepared(changes);
        let craft = prepared.exchange.as_ref().expect("the scene has exchange");
        let tables = ExchangeTables::new(&craft.cast(&[]), false);
        let data = DeviceData::new(&prepared).with_exchange(Some(tables));
        format!("{:?}", data.scene_data(&prepared, None).plan()).contains("ExchangeMirror")
    };
    assert!(has_buffers(&MIRRORS) && !has_buffers(&MIRRORS[..2]) && !has_buffers(&MIRRORS[2..]));
}

/// What patches absorb, and space gets, is what they send, to 1e-6. The twin has the same factors.
#[test]
fn the_energy_of_a_step_balances() {
    balances(&prepared(&[]));
    balances(&prepared(&MIRRORS));
}

fn balances(prepared: &Prepared) {
    let context = context();
    let craft = prepared.exchange.as_ref().expect("the scene has exchange");
    let exchange = craft.cast(&[]);
    let mut engine = DeviceEngine::new(&context, prepared, None).expect("a small scene");
    engine.settle_at(300.0, prepared.nodes.vertex_of_node.len()).expect("the engine settles");
    for number in 0..3 {
        let (start, length) = (60.0 * f64::from(number), 60.0);
        let before = {
            engine.submit(None, Order { temperatures: true, ..Order::default() }).expect("a state");
            engine.deliver().expect("a state").temperatures.expect("temperatures")
        };
        let load = prepared.loads.step_load(start, start + length);
        engine.submit(Some(EngineStep { load: &load, steps: 1.0, start, length }), Order::default()).expect("a step");
        engine.deliver().expect("a step");
        let areas = engine.renderer.lit_areas().expect("shadows");
        let lit = Lit { areas, by_rays: true };
        // The device finds light anew in every step of an angle of 0.
        let mirrored = craft.mirrors.as_ref().map(|mirrors| mirrors.mirrored(&load));
        let light = exchange.light(&load, &lit, mirrored.as_ref());
        let sent = exchange.sent(&load, &light, |node| f64::from(before[node]));
        let twin = exchange.absorbed(&sent, &light);
        let found = engine.renderer.received().expect("what patches received");
        let largest = twin.iter().copied().fold(0.0, f64::max);
        let (mut absorbed, mut leaves, mut all) = (0.0, 0.0, 0.0);
        for (number, patch) in exchange.patches.iter().enumerate() {
            assert!((f64::from(found[number]) - twin[number]).abs() < 1e-4 * largest, "patch {number}");
            absorbed += patch.area * f64::from(found[number]);
            leaves += exchange.infrared.space[number] * sent[number]
                + exchange.for_light.sunlight.space[number] * light.reflected[number][1];
            all += patch.area * (sent[number] + light.reflected[number][1]);
            // What others mirror onto it is absorbed without being sent by a patch.
            all += patch.area * light.mirrored.get(number).unwrap_or(&0.0);
        }
        let off = (absorbed + leaves - all) / all;
        println!("step {number}: sent {all:.1} W, absorbed {absorbed:.1} W, off {off:.1e}");
        assert!(off.abs() < 1e-6, "{off}");
        let heat: f64 = exchange.patches.iter().zip(&twin).map(|(patch, absorbed)| patch.area * absorbed).sum();
        assert!(((heat + leaves - all) / all).abs() < 1e-12, "the twin is exact");
    }
    assert_silent(&context);
}

/// A cube whose skin looks inwards, with two materials.
fn room() -> Maker {
    let mut maker = Maker::new();
    let positions = maker.floats(&crate::model::make::cube_corners());
    for (number, name) in ["dull", "shiny"].into_iter().enumerate() {
        maker.push("materials", json!({ "name": name }));
        let indices: Vec<u8> = crate::model::make::CUBE_TRIANGLES[18 * number..18 * number + 18]
            .chunks(3)
            .flat_map(|triangle| [triangle[0], triangle[2], triangle[1]])
            .collect();
        let indices = maker.accessor(&indices, json!({"componentType": 5121, "count": 18, "type": "SCALAR"}));
        maker.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "material": number}));
        if number > 0 {
            let index = maker.push("nodes", json!({"name": name, "mesh": number}));
            maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(index));
        }
    }
    maker
}

const ROOM: &str = r#"
[model]
path = "made.glb"
max_edge = 0.5
[time]
step = 15
steps = 370
draw_every = 0
[orbit]
altitude = 408e3
period = 5553.6
[attitude]
mode = "nadir"
nadir_axis = "+Z"
forward_axis = "+X"
[environment]
background_temperature = 2.7
[exchange]
patch_edge = 0.7
rays = 64
[initial]
temperature = 300
[[material]]
match = "dull"
absorptivity = 0.5
emissivity = 0.9
response = "network"
thickness = 0.001
density = 2700
specific_heat = 900
conductivity = 160
[[material]]
match = "shiny"
absorptivity = 0.5
emissivity = 0.05
response = "radiative"
heat_capacity_per_area = 500
"#;

#[test]
fn a_closed_box_keeps_its_temperature_for_an_orbit() {
    let context = context();
    let folder = Folder::new(ROOM);
    room().save(folder.0.path());
    let drift = |prepared: &Prepared, engine: &mut dyn Engine| {
        let all = history(prepared, engine).concat();
        all.iter().map(|temperature| (temperature - 300.0).abs()).fold(0.0, f64::max)
    };
    let prepared = folder.prepared();
    let device = drift(&prepared, &mut DeviceEngine::new(&context, &prepared, None).expect("a small scene"));
    let twin = drift(&prepared, &mut ReferenceEngine::new(&prepared, None));
    println!("drift {device:.1e} K on the device, {twin:.1e} K in f64");
    assert!(device < 1e-3 && twin < 1e-3, "{device} {twin}");
    folder.write("scene.toml", &ROOM.replace("[exchange]\npatch_edge = 0.7\nrays = 64\n", ""));
    let open = folder.prepared();
    assert!(drift(&open, &mut ReferenceEngine::new(&open, None)) > 50.0, "without exchange it cools");
    assert_silent(&context);
}

#[test]
fn each_barrier_of_exchange_is_needed() {
    for (anew, mirrors) in [(false, false), (true, false), (true, true)] {
        let variant = ThermalVariant {
            both_sides: true,
            sun: true,
            planet_ir: true,
            albedo: true,
            exchange: true,
            ..ThermalVariant::bare(StepKind::Merge, Curve::Power)
        };
        let range = [StepRange { variant, groups: (0, 64), joint: 0 }];
        let step = crate::resources::exchange(70, variant, anew, mirrors).then(Frame::step(&range, Wanted::default()));
        each_barrier_is_needed(&[Frame::settle(&range), step.clone(), step.clone(), step], 1);
    }
}

#[test]
fn without_exchange_there_is_no_buffer_and_no_pass() {
    let names = |prepared: &Prepared| {
        let data = DeviceData::new(prepared);
        let data = data.scene_data(prepared, None);
        let planned: Vec<String> = data.plan().iter().map(|planned| format!("{:?}", planned.resource)).collect();
        let passes = Frame::step(&data.ranges, Wanted::default()).to_string();
        (planned, passes)
    };
    let (planned, passes) = names(&Folder::new(crate::craft::SCENE).prepared());
    assert!(planned.iter().all(|name| !name.starts_with("Exchange")) && !passes.contains("xchange"));
    assert!(names(&prepared(&[])).1.contains("ExchangeOnNodes"), "with exchange the thermal step reads it");
}

/// The craft with a wing that turns by an angle [deg] in 720 s, and rays for poses so far apart [deg].
fn turning_wing(apart: u32, angle: u32) -> Prepared {
    let joint = format!(
        "redraw_angle_deg = {apart}\n[[joint]]\npart = \"wing_port\"\naxis = \"+Y\"\norigin = [0, 0, 0]\nmode = \"schedule\"\n\
         schedule = {{ time = [0, 720], angle_deg = [0, {angle}] }}\n[radiance]"
    );
    Folder::new(&scene_with(&[("[radiance]", &EXCHANGE.replace("redraw_angle_deg = 0\n[radiance]", &joint))]))
        .prepared()
}

/// A wing that turns: rays are cast anew, and both engines agree.
#[test]
fn rays_are_cast_anew_as_a_joint_turns() {
    let context = context();
    let prepared = turning_wing(10, 60);
    let worst = apart(&context, &prepared);
    println!("with a joint: {:.1e} K", worst.difference);
    worst.within(0.05, "K", "a craft with a joint");
    assert_silent(&context);
}

/// A state that is saved while a joint turns goes on with the same bits, whichever of the two places on the device its findings had.
#[test]
fn a_saved_state_goes_on_while_a_joint_turns() {
    let context = context();
    let prepared = turning_wing(13, 47);
    let engine = || DeviceEngine::new(&context, &prepared, None).expect("a small scene");
    for saved_at in 3..8 {
        let mut whole = engine();
        whole.settle_at(300.0, prepared.nodes.vertex_of_node.len()).expect("a start");
        advance(&prepared, &mut whole, 0..saved_at);
        let saved = whole.save().expect("a state");
        let mut resumed = engine();
        resumed.restore(&saved, 100).expect("its own state");
        for step in saved_at..11 {
            let [one, other] = [&mut whole, &mut resumed].map(|engine| {
                let temperatures = advance(&prepared, engine, step..step + 1);
                (temperatures, engine.renderer.received().expect("what patches received"))
            });
            assert!(one == other, "saved after step {saved_at}, step {step}");
        }
    }
    assert_silent(&context);
}

/// A mast that slides into the body is told with its area; one that slides away is not.
#[test]
fn patches_that_a_joint_moves_into_others_are_told() {
    let context = context();
    let told = |way: &str| {
        let joint = format!(
            "redraw_angle_deg = 10\n[[joint]]\npart = \"mast\"\nkind = \"translation\"\naxis = \"{way}\"\nmode = \"schedule\"\n\
             schedule = {{ time = [0, 600], distance = [0, 2] }}\n[radiance]"
        );
        let with = EXCHANGE.replace("redraw_angle_deg = 0\n[radiance]", &joint);
        let prepared = Folder::new(&scene_with(&[("[radiance]", &with)])).prepared();
        let mut engine = DeviceEngine::new(&context, &prepared, None).expect("a small scene");
        history(&prepared, &mut engine);
        engine.exchange_description().into_iter().find(|(name, _)| name.contains("joints moved into other parts"))
    };
    let (_, inside) = told("+Z").expect("the mast is inside the body at the end");
    println!("{inside}");
    assert!(inside.contains("of 0.40 m2"), "{inside}");
    assert_eq!(told("-Z"), None);
    assert_silent(&context);
}

#[test]
fn the_command_writes_rows_that_sum_to_1() {
    let folder = Folder::new(&scene_with(&[("[radiance]", EXCHANGE)]));
    for patches in [false, true] {
        let mut arguments = vec!["view-factors", "scene.toml", "-o", "f.csv", "--gr", "gr.csv"];
        arguments.extend(patches.then_some("--patches"));
        arguments.extend(["--sky", "sky.png", "--fish-eye", "seen.png", "--patch", "3"]);
        succeed(folder.0.path(), &arguments);
        let text = std::fs::read_to_string(folder.path("f.csv")).expect("a file");
        assert!(text.starts_with("from,to,view_factor,standard_error\n"), "{text}");
        let mut sums = std::collections::BTreeMap::<String, f64>::new();
        for row in text.lines().skip(1) {
            let cells: Vec<&str> = row.split(',').collect();
            *sums.entry(cells[0].to_owned()).or_default() += cells[2].parse::<f64>().expect("a number");
        }
        assert!(sums.len() >= 4 && sums.values().all(|sum| (sum - 1.0).abs() < 1e-4), "{sums:?}");
        assert!(text.contains(",planet,") && text.contains(",space,"), "{text}");
        for picture in ["sky.png", "seen.png"] {
            let bytes = std::fs::read(folder.path(picture)).expect("a picture");
            assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 2000, "{picture}: {} bytes", bytes.len());
        }
        let areas = std::fs::read_to_string(folder.path("gr.csv")).expect("a file");
        assert!(areas.starts_with("from,to,gr_m2\n") && areas.contains(",space,"), "{areas}");
    }
    let bare = Folder::new(crate::craft::SCENE);
    // Without the section patches and rays have its defaults.
    let told = end(isotherm(bare.0.path(), &["view-factors", "scene.toml", "-o", "f.csv"]));
    assert!(told.status.success() && stderr(&told).contains("rays of a patch: 4096"), "{}", stderr(&told));
    let text = std::fs::read_to_string(bare.path("f.csv")).expect("a file");
    assert!(text.starts_with("from,to,view_factor,standard_error\n") && text.contains(",space,"), "{text}");
}

#[test]
fn a_run_with_exchange_delivers_every_step() {
    let context = context();
    let prepared = prepared(&[]);
    let mut engine = DeviceEngine::new(&context, &prepared, None).expect("a small scene");
    isotherm::internals::start(&prepared, &mut engine, None, &never(), &mut || ()).expect("the engine starts");
    let mut steps = 0;
    run::<EngineError>(&prepared, &mut engine, None, &never(), &mut |result| {
        let all = result.delivered.temperatures.expect("temperatures");
        let real = all.iter().zip(&prepared.nodes.vertex_of_node).filter(|(_, vertex)| **vertex != PADDING);
        assert!(real.clone().count() > 0 && real.into_iter().all(|(t, _)| t.is_finite() && *t > 2.0));
        steps += 1;
        Ok(())
    })
    .expect("the engine runs");
    assert_eq!(steps, 13);
    let most = STEFAN_BOLTZMANN * 400f64.powi(4);
    assert!(engine.renderer.received().expect("received").iter().all(|flux| (0.0..most).contains(&f64::from(*flux))));
}
