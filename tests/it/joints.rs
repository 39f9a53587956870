//! Joints: a rotated joint equals a rotated model, device against twin, moving shadows, and refusals.

use glam::{DQuat, DVec3};
use isotherm::internals::{
    DeviceData, DeviceEngine, Engine, Frame, PADDING, Prepared, ReferenceEngine, Renderer, Request, StepRange,
    TriangleRun, Wanted, run, start,
};
use isotherm::{EngineError, Image, Reach, Scene};
use serde_json::json;

use super::craft::{Folder, glb, never, prepared, scene_with};
use super::device::{Worst, assert_silent, context};
use super::hazard::{barrier_count, hazards, unread_by_host, without_barrier};
use super::model::make::Maker;

/// A tracking wing, a wing with a schedule, and a sliding mast: all kinds of motion.
pub const MOVING: &str = r#"
[[joint]]
part = "wing_starboard"
mode = "sun"
axis = "+Y"
sun_axis = "-Z"
rate_deg = 0.2

[[joint]]
part = "wing_port"
mode = "schedule"
axis = "+X"
limits_deg = [-90, 90]
schedule = { time = [0, 700], angle_deg = [0, 75] }

[[joint]]
part = "mast"
kind = "translation"
mode = "schedule"
axis = "-Z"
rate = 0.01
schedule = { time = [0, 600], distance = [0, 1.5] }
"#;

const SHADOWS: &str = "[shadows]\n";

/// The craft with additions to its scene and changes to its model.
fn craft(more: &str, change: impl FnOnce(&mut Maker)) -> Prepared {
    let folder = Folder::new(&format!("{}{more}", scene_with(&[])));
    let mut maker = glb();
    change(&mut maker);
    maker.save(folder.0.path());
    folder.prepared()
}

fn node_of<'a>(maker: &'a mut Maker, name: &str) -> &'a mut serde_json::Value {
    let nodes = maker.json["nodes"].as_array_mut().expect("a list");
    nodes.iter_mut().find(|node| node["name"] == name).expect("a node of that name")
}

/// Temperatures [K] at every step in vertex order, and the images.
fn history(prepared: &Prepared, engine: &mut dyn Engine) -> (Vec<f64>, Vec<Image>) {
    start(prepared, engine, None, &never(), &mut || ()).expect("the engine starts");
    let (mut temperatures, mut images) = (Vec::new(), Vec::new());
    run::<EngineError>(prepared, engine, None, &never(), &mut |result| {
        let all = result.delivered.temperatures.expect("a run reads temperatures");
        temperatures.extend(prepared.nodes.node_of_vertex.iter().map(|node| f64::from(all[*node as usize])));
        images.extend(result.delivered.image);
        Ok(())
    })
    .expect("the engine runs");
    (temperatures, images)
}

fn on_device(prepared: &Prepared) -> (Vec<f64>, Vec<Image>) {
    let context = context();
    let camera = prepared.scene.camera.clone();
    let found = history(prepared, &mut DeviceEngine::new(&context, prepared, camera.as_ref()).expect("a small scene"));
    assert_silent(&context);
    found
}

fn in_f64(prepared: &Prepared) -> (Vec<f64>, Vec<Image>) {
    let camera = prepared.scene.camera.clone();
    history(prepared, &mut ReferenceEngine::new(prepared, camera.as_ref()))
}

fn worst(a: &[f64], b: &[f64]) -> Worst {
    Worst::of(a, b, |node| format!("value {node}"))
}

/// Pixels with different parts, or with temperatures more than `apart` [K] apart.
fn pixels_apart(a: &[Image], b: &[Image], apart: f32) -> usize {
    assert!(!a.is_empty() && a.len() == b.len());
    let of_image = |(a, b): (&Image, &Image)| {
        let differs = |pixel: &usize| {
            let temperatures = a.temperature[*pixel] - b.temperature[*pixel];
            a.labels(*pixel) != b.labels(*pixel) || temperatures.abs() > apart
        };
        (0..a.part.len()).filter(differs).count()
    };
    a.iter().zip(b).map(of_image).sum()
}

/// A wing rotated by 30 degrees about its X and a mast moved by 0.4 m along its -Z: by joints, and in the file.
#[test]
#[ignore = "long: tools/test --all"]
fn a_joint_that_stands_is_a_model_made_so() {
    let turn = |degrees: f64| {
        let q = DQuat::from_rotation_x(degrees.to_radians());
        json!([q.x, q.y, q.z, q.w])
    };
    let made = |degrees: f64| {
        craft(SHADOWS, |maker| {
            node_of(maker, "wing_starboard")["rotation"] = turn(degrees);
            node_of(maker, "mast")["translation"] = json!([0, 0, -3.4]);
        })
    };
    let joints = "[[joint]]\npart = \"wing_starboard\"\nmode = \"fixed\"\naxis = \"+X\"\nangle_deg = 30\n\
                  [[joint]]\npart = \"mast\"\nkind = \"translation\"\nmode = \"fixed\"\naxis = \"-Z\"\ndistance = 0.4\n";
    let jointed = craft(&format!("{SHADOWS}{joints}"), |_| ());
    assert_eq!(jointed.joints(), 3);
    let (expected, expected_images) = on_device(&made(30.0));
    let (found, images) = on_device(&jointed);
    // Positions and loads in f32 are rotated in the opposite order. A ray may pass an edge on the other side: one of 96 at the border of a shadow is
    // T / (4 x 96), up to a kelvin.
    worst(&found, &expected).within(1.0, "K", "a standing joint");
    let beyond = found.iter().zip(&expected).filter(|(a, b)| (*a - *b).abs() > 0.02).count();
    assert!(beyond * 40 < found.len(), "{beyond} of {} values", found.len());
    // In four images a few pixel centres may be on the other side of an edge.
    let apart = pixels_apart(&images, &expected_images, 1.0);
    assert!(apart <= 8, "{apart} pixels");
    let (other, other_images) = on_device(&made(45.0));
    assert!(worst(&found, &other).difference > 2.0, "a turn must show");
    let moved = pixels_apart(&images, &other_images, 1.0);
    assert!(moved > 50, "{moved} pixels");
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_device_moves_as_its_twin() {
    for shadows in ["", SHADOWS] {
        let prepared = craft(&format!("{shadows}{MOVING}"), |_| ());
        let (found, images) = on_device(&prepared);
        let (expected, expected_images) = in_f64(&prepared);
        let worst = worst(&found, &expected);
        worst.within(0.02, "K", "moving joints");
        let apart = pixels_apart(&images, &expected_images, 0.05);
        assert!(apart <= 12, "{apart} pixels");
        // Without joints the difference must be large.
        let still = craft(shadows, |_| ());
        let (other, other_images) = in_f64(&still);
        assert!(Worst::of(&found, &other, |i| format!("{i}")).difference > 5.0);
        assert!(pixels_apart(&images, &other_images, 1.0) > 100);
    }
}

#[test]
fn shadows_are_found_anew_when_a_joint_has_turned() {
    let context = context();
    let slide = "[[joint]]\npart = \"wing_port\"\nmode = \"schedule\"\naxis = \"+X\"\n\
                 schedule = { time = [0, 100], angle_deg = [0, 10] }\n";
    let prepared = craft(&format!("[shadows]\nredraw_angle_deg = 3\n{slide}"), |_| ());
    let data = DeviceData::new(&prepared);
    let mut renderer = Renderer::new(&context, &data.scene_data(&prepared, None)).expect("a small scene");
    let drawn = |slot: &usize| prepared.nodes.vertex_of_node[*slot] != PADDING;
    let slots: Vec<usize> = (0..prepared.nodes.vertex_of_node.len()).filter(drawn).collect();
    let mut in_f64 = prepared.lit_areas(slots.iter().copied()).expect("shadows are on");
    // The Sun is fixed. The wing turns by a degree in ten seconds.
    let mut load = prepared.loads.step_load(0.0, 0.0);
    let mut anew = Vec::new();
    for time in [0.0, 20.0, 40.0, 60.0, 80.0, 100.0] {
        load.joints = prepared.loads.joints_at(time).1;
        let submitted = renderer.submit(Request::step(&load, 1.0)).expect("the device steps");
        renderer.collect(submitted).expect("the device answers");
        let expected = in_f64.find(&load);
        anew.push(expected.is_some());
        let Some(expected) = expected else { continue };
        let found = renderer.lit_areas().expect("the device answers");
        for (slot, expected) in slots.iter().zip(expected) {
            assert!(found[*slot].vector.distance(expected.vector) < 1e-6, "{time} s, node {slot}");
        }
    }
    assert_eq!(anew, [true, false, true, false, true, false], "every 4 degrees, the first beyond 3");
    assert_silent(&context);
}

/// The mast slides out of the box's shadow. The image and its light must show it.
#[test]
fn what_slides_out_moves_image_and_shadow() {
    let slide = |distance: f64| {
        let joint = format!(
            "[[joint]]\npart = \"wing_starboard\"\nkind = \"translation\"\nmode = \"fixed\"\naxis = \"+Y\"\ndistance = {distance}\n"
        );
        craft(&format!("{SHADOWS}{joint}"), |_| ())
    };
    let (inside, out) = (slide(-4.0), slide(0.0));
    let sun = |prepared: &Prepared| {
        let load = prepared.loads.step_load(0.0, 0.0);
        let slots = 0..prepared.nodes.vertex_of_node.len();
        let lit = prepared.lit_areas(slots).expect("shadows are on").find(&load).expect("the first time");
        let sun = load.sun[0].direction;
        let wing = prepared.parts.iter().position(|part| part == "wing_starboard").expect("the wing") as u32;
        let of_wing = |slot: &usize| {
            prepared.nodes.group_part[slot / 4] == wing && prepared.nodes.vertex_of_node[*slot] != PADDING
        };
        let share = |slot: usize| {
            let area = prepared.nodes.areas[slot];
            [area * lit[slot].vector.dot(sun).abs(), area * prepared.nodes.normals[slot].as_dvec3().dot(sun).abs()]
        };
        let shares = (0..lit.len()).filter(of_wing).map(share);
        let [lit, all] = shares.fold([0.0; 2], |[lit, all], [area, whole]| [lit + area, all + whole]);
        lit / all
    };
    // A retracted wing is half inside the box (y from -1 to 1, z from -1 to 1).
    assert!(sun(&out) > 0.9 && sun(&inside) < 0.6, "{} {}", sun(&out), sun(&inside));
    let (images, moved) = (on_device(&out).1, on_device(&inside).1);
    assert!(pixels_apart(&images, &moved, 1.0) > 200);
}

#[test]
fn a_contact_holds_across_a_joint_at_any_angle() {
    let skin = "response = \"network\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 160\n";
    let scene = |joint: &str| {
        let old = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 20 }\n\
                   cooling = { function = \"linear\", t_max_steps = 30 }\n";
        let cells = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 4 }\n\
                     cooling = { function = \"quadratic\", t_max_steps = 6 }\n";
        let contact = "[[contact]]\nbetween = [\"body\", \"wing_starboard\"]\nconductance = 5\ndistance = 0.6\n";
        scene_with(&[(old, skin), (cells, skin), ("draw_every = 4", "draw_every = 0")]) + contact + joint
    };
    let at = |angle: f64| {
        format!("[[joint]]\npart = \"wing_starboard\"\nmode = \"fixed\"\naxis = \"+X\"\nangle_deg = {angle}\n")
    };
    let prepared = |joint: &str| Folder::new(&scene(joint)).prepared();
    let (still, turned) = (prepared(""), prepared(&at(80.0)));
    let contact = |prepared: &Prepared| {
        let network = prepared.network.as_ref().expect("a network");
        network.shell.summary.contacts.clone()
    };
    assert_eq!(contact(&still), contact(&turned));
    let (_, pairs, total) = &contact(&turned)[0];
    assert!(*pairs > 0 && (total - 5.0).abs() < 1e-9, "{pairs} conductors of {total} W/K");
    // The rotated wing has other loads, and the contact passes their effect to the body.
    let body = |prepared: &Prepared| {
        let found = in_f64(prepared).0;
        let vertices = prepared.nodes.node_of_vertex.len();
        let part = prepared.parts.iter().position(|part| part == "body").expect("the box") as u32;
        let of_body =
            |vertex: &usize| prepared.nodes.group_part[prepared.nodes.node_of_vertex[*vertex] as usize / 4] == part;
        (0..vertices).filter(of_body).map(|vertex| found[found.len() - vertices + vertex]).collect::<Vec<_>>()
    };
    let difference = worst(&body(&still), &body(&turned)).difference;
    assert!(difference > 0.1, "{difference} K");
    let (device, twin) = (on_device(&turned).0, in_f64(&turned).0);
    worst(&device, &twin).within(0.02, "K", "a network across a joint");
}

#[test]
#[ignore = "long: tools/test --all"]
fn an_animation_in_the_file_is_played() {
    let animate = |maker: &mut Maker| {
        let times: Vec<u8> = [0.0f32, 600.0].iter().flat_map(|time| time.to_le_bytes()).collect();
        let input = maker.accessor(&times, json!({"componentType": 5126, "count": 2, "type": "SCALAR"}));
        let turns: Vec<u8> = [0.0f64, 60.0]
            .iter()
            .flat_map(|degrees| DQuat::from_rotation_x(degrees.to_radians()).to_array())
            .flat_map(|value| (value as f32).to_le_bytes())
            .collect();
        let output = maker.accessor(&turns, json!({"componentType": 5126, "count": 2, "type": "VEC4"}));
        let node = maker.json["nodes"].as_array().expect("a list").iter().position(|n| n["name"] == "wing_port");
        maker.json["animations"] = json!([{
            "name": "unfold",
            "samplers": [{"input": input, "output": output, "interpolation": "LINEAR"}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "rotation"}}]
        }]);
    };
    let joint = "[[joint]]\npart = \"wing_port\"\nmode = \"animation\"\nanimation = \"unfold\"\n";
    let schedule = |to: f64| {
        format!(
            "[[joint]]\npart = \"wing_port\"\nmode = \"schedule\"\naxis = \"+X\"\n\
             schedule = {{ time = [0, 600], angle_deg = [0, {to}] }}\n"
        )
    };
    let (played, images) = in_f64(&craft(joint, animate));
    let (scheduled, expected) = in_f64(&craft(&schedule(60.0), |_| ()));
    // The file's keys are f32.
    worst(&played, &scheduled).within(1e-3, "K", "an animation");
    assert!(pixels_apart(&images, &expected, 0.01) <= 4);
    let (other, _) = in_f64(&craft(&schedule(61.0), |_| ()));
    assert!(worst(&played, &other).difference > 0.05);

    let scaled = |maker: &mut Maker| {
        animate(maker);
        maker.json["animations"][0]["channels"][0]["target"]["path"] = json!("scale");
    };
    let refused = |scene: &str, change: &dyn Fn(&mut Maker)| {
        let folder = Folder::new(&format!("{}{scene}", scene_with(&[])));
        let mut maker = glb();
        change(&mut maker);
        maker.save(folder.0.path());
        let error = Prepared::new(&folder.path("scene.toml"), &mut |_| ()).err().expect("a refusal");
        error.to_string()
    };
    let message = refused(joint, &scaled);
    assert!(message.contains("changes its scale"), "{message}");
    let message = refused(&joint.replace("wing_port", "mast"), &animate);
    assert!(message.contains("does not move it; it moves wing_port"), "{message}");
    let message = refused(joint, &|_| ());
    assert!(message.contains("no animation 'unfold'; none is known here"), "{message}");
}

/// Mean cosine between the Sun and the normals of nodes that face the Sun in the file's pose.
fn cosine(prepared: &Prepared, part: impl Fn(&str) -> bool, cells: &str, normal: DVec3, time: f64) -> f64 {
    let sun = prepared.loads.sky_model().sun_direction(time);
    let poses = prepared.loads.joints_at(time).1;
    let nodes = &prepared.nodes;
    let fits = |slot: &usize| {
        nodes.vertex_of_node[*slot] != PADDING
            && part(&prepared.parts[nodes.group_part[slot / 4] as usize])
            && prepared.materials[nodes.group_material[slot / 4] as usize].name == cells
            && nodes.normals[*slot].as_dvec3().dot(normal) > 0.99
    };
    let cosines: Vec<f64> = (0..nodes.vertex_of_node.len())
        .filter(fits)
        .map(|slot| (poses[nodes.joint(slot) as usize].matrix3 * nodes.normals[slot].as_dvec3()).dot(sun))
        .collect();
    assert!(cosines.len() >= 8, "{} nodes", cosines.len());
    let least = cosines.iter().fold(f64::INFINITY, |least, cosine| least.min(*cosine));
    let mean = cosines.iter().sum::<f64>() / cosines.len() as f64;
    assert!(mean - least < 1e-5, "all alike");
    mean
}

fn without_splitting(path: &std::path::Path) -> Prepared {
    let mut scene = Scene::load_within(path, Reach::Anywhere).expect("a scene");
    scene.density = Default::default();
    Prepared::from_scene(scene, &mut |_| ()).expect("a scene that can run")
}

#[test]
fn the_arrays_of_both_models_face_the_sun_all_the_way_round() {
    let models = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let station = without_splitting(&models.join("station_transition.toml"));
    assert_eq!(station.joints(), 1 + 2 + 8);
    let round = |prepared: &Prepared| {
        let period = prepared.scene.orbit.period();
        (-20..=20).map(move |i| 0.05 * f64::from(i) * period)
    };
    for time in round(&station) {
        let cosine = cosine(&station, |part| part.starts_with("array_wing"), "solar_cells", -DVec3::Z, time);
        assert!(cosine > 1.0 - 1e-6, "station at {time} s: {cosine}");
    }
    let iss = models.join("iss_transition.toml");
    if !models.join("../../shared/data/models/ISS_42.glb").exists() {
        println!("skipped: ../shared/data/models/ISS_42.glb is not there");
        return;
    }
    let iss = without_splitting(&iss);
    assert_eq!(iss.joints(), 1 + 2 + 8 + 2);
    for time in round(&iss) {
        let wings = cosine(&iss, |part| part.ends_with("_ISS_SolarPanel"), "SOLAR_CELL", DVec3::Z, time);
        assert!(wings > 1.0 - 1e-6, "ISS at {time} s: {wings}");
        // One axis along Y leaves the cosine of beta, 20 deg.
        let small = cosine(&iss, |part| part.ends_with("_SM_SolarPanel"), "SOLAR_CELL", DVec3::Z, time);
        assert!((small - 20f64.to_radians().cos()).abs() < 1e-6, "ISS at {time} s: {small}");
    }
}

/// Two joints have their own ranges and runs: no hazard in any two frames, and every barrier is needed.
#[test]
fn frames_with_joints_have_all_their_barriers() {
    let prepared = craft(&format!("[shadows]\n{MOVING}"), |_| ());
    let ranges: Vec<StepRange> = prepared.step_ranges();
    assert!(ranges.iter().any(|range| range.joint == 2) && ranges.iter().any(|range| range.joint == 0));
    let runs: &[TriangleRun] = &prepared.triangle_runs;
    assert_eq!(runs.iter().map(|run| run.joint).collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert!(runs.iter().all(|run| run.triangles.0 % 64 == 0));
    let wanted = Wanted { image: true, cull: prepared.triangles.len() as u32, temperatures: true, ..Wanted::default() };
    let settle = Frame::settle(&ranges);
    let [all, one] = [runs, &runs[1..2]].map(|culled| Frame::step_in_runs(&ranges, wanted, culled));
    assert_eq!(one.passes().filter(|pass| pass.entry() == Some("cull.comp")).count(), 1);
    for sequence in [[&settle, &all, &one], [&settle, &one, &all], [&settle, &all, &all]] {
        assert_eq!(hazards(sequence), []);
    }
    for n in 0..barrier_count(&all) {
        let broken = without_barrier(&all, n);
        let missed =
            [&settle, &all, &one].iter().any(|before| !hazards([&settle, before, &broken, &broken]).is_empty());
        assert!(missed || !unread_by_host([&broken]).is_empty(), "barrier {n} of\n{all}");
    }
}

#[test]
fn what_cannot_move_is_refused() {
    let refused = |joint: &str| {
        let folder = Folder::new(&format!("{}{joint}", scene_with(&[])));
        folder.write("angles.csv", "time,angle_deg\n0,0\n10,x\n");
        Prepared::new(&folder.path("scene.toml"), &mut |_| ()).err().expect("a refusal").to_string()
    };
    let sun = "[[joint]]\npart = \"wing_port\"\nmode = \"sun\"\naxis = \"+X\"\nsun_axis = \"+Z\"\n";
    for (from, to, expected) in [
        ("wing_port", "wing_prot", "the model has no node 'wing_prot'; did you mean 'wing_port'?"),
        ("\"+Z\"", "\"-X\"", "is parallel to 'axis'"),
        ("axis = \"+X\"\n", "", "joint.axis: is missing"),
        ("mode", "limits_deg = [10, -10]\nmode", "must run from low to high"),
        ("mode", "limits = [0, 1]\nmode", "belongs to mode = 'fixed'"),
        ("mode", "angle_deg = 10\nmode", "belongs to mode = 'fixed'"),
        ("mode", "rate = 1\nmode", "belongs to mode = 'schedule'"),
        ("mode", "rate_deg = 0\nmode", "must be above 0"),
        ("mode", "kind = \"translation\"\nmode", "cannot face the Sun"),
        ("mode", "speed = 1\nmode", "unknown key"),
        ("\"sun\"", "\"sum\"", "did you mean 'sun'?"),
        ("mode = \"sun\"", "mode = \"fixed\"", "sun_axis: belongs to mode = 'sun'"),
        (
            "mode = \"sun\"\naxis = \"+X\"\nsun_axis = \"+Z\"",
            "mode = \"fixed\"\naxis = \"+X\"",
            "angle_deg: is missing",
        ),
        (
            "mode = \"sun\"\naxis = \"+X\"\nsun_axis = \"+Z\"",
            "mode = \"fixed\"\naxis = \"+X\"\nlimits_deg = [0, 20]\nangle_deg = 30",
            "30 deg is beyond limits_deg, 0 to 20",
        ),
        (
            "mode = \"sun\"\naxis = \"+X\"\nsun_axis = \"+Z\"",
            "mode = \"schedule\"\naxis = \"+X\"\nschedule = { time = [0, 10, 5], angle_deg = [0, 1, 2] }",
            "must not fall",
        ),
        (
            "mode = \"sun\"\naxis = \"+X\"\nsun_axis = \"+Z\"",
            "mode = \"schedule\"\naxis = \"+X\"\nschedule = { time = [0, 10], angle_deg = [0] }",
            "2 times and 1 positions",
        ),
        (
            "mode = \"sun\"\naxis = \"+X\"\nsun_axis = \"+Z\"",
            "mode = \"schedule\"\naxis = \"+X\"\nschedule = { file = \"angles.csv\" }",
            "angles.csv:3: 'x' is not a number",
        ),
    ] {
        assert!(sun.contains(from), "{from}");
        let message = refused(&sun.replace(from, to));
        assert!(message.contains(expected), "{message}\nis not: {expected}");
    }
    let message = refused(&format!("{sun}{}", sun.replace("wing_port", "wing_*")));
    assert!(message.contains("the node 'wing_port' has the joint of line"), "{message}");
}

/// Every default of a joint is reported.
#[test]
fn what_is_assumed_of_joints_is_printed() {
    let folder = Folder::new(&format!("{}{MOVING}", scene_with(&[])));
    let scene = prepared(&folder.path("scene.toml")).scene;
    for sentence in [
        "'wing_starboard' starts where it is asked to be",
        "'wing_port' follows without delay",
        "pose in the middle of the step",
    ] {
        assert!(scene.assumptions.iter().any(|said| said.contains(sentence)), "{sentence}: {:?}", scene.assumptions);
    }
}
