//! `isotherm::Simulation`: its images are those of a run, bit for bit, whatever the camera, the thread or the interruption.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::{DQuat, DVec3};
use isotherm::internals::{StepResult, decode, encode, run, start};
use isotherm::{Camera, CameraFrame, Image, Placement, Pose, Simulation, SimulationError, Target};

use super::craft::{Folder, SCENE, never, scene_with};
use super::device::{assert_silent, context, validated_context};

fn simulation(folder: &Folder, target: &Target) -> Simulation {
    Simulation::load(&folder.path("scene.toml"), target).expect("a scene that can run")
}

fn own_image(simulation: &mut Simulation) -> Image {
    let camera = simulation.camera().expect("a camera").clone();
    simulation.image(&camera, &Pose::OfCamera).expect("an image")
}

/// Images and temperatures of the drawn steps of a whole run.
fn of_a_run(folder: &Folder, target: &Target) -> Vec<StepResult> {
    let prepared = folder.prepared();
    let mut engine = target.engine(&prepared, prepared.scene.camera.as_ref()).expect("an engine");
    start(&prepared, &mut *engine, None, &never(), &mut || ()).expect("it starts");
    let mut results = Vec::new();
    let mut take = |result: StepResult| {
        results.push(result);
        Ok::<_, isotherm::EngineError>(())
    };
    run(&prepared, &mut *engine, None, &never(), &mut take).expect("it runs");
    results
}

fn targets() -> [Target; 2] {
    [Target::Device(context()), Target::Reference]
}

#[test]
fn its_images_are_those_of_a_run() {
    let sensor = "[sensor]\nnetd = 0.05\nrange = [150, 400]\ntime_constant = 20\n";
    let warm = scene_with(&[("draw_every = 4", "draw_every = 4\nwarm_up_orbits = 0.1")]);
    for scene in [warm.clone(), format!("{warm}\n[shadows]\n"), format!("{warm}\n{sensor}")] {
        let folder = Folder::new(&scene);
        for target in targets() {
            let mut simulation = simulation(&folder, &target);
            let mut before: Option<Image> = None;
            for result in of_a_run(&folder, &target) {
                simulation.step_to(result.time).expect("it steps");
                let Some(expected) = result.delivered.image else { continue };
                let image = own_image(&mut simulation);
                // The sensor has no radiometric output.
                let expected = Image { counts: None, ..expected };
                assert!(image == expected, "step {} on {}", result.step, simulation.device_name());
                assert!(before.is_none_or(|before| before.temperature != image.temperature));
                before = Some(image);
                let temperatures = result.delivered.temperatures.expect("temperatures");
                let nodes = &simulation.prepared().nodes.node_of_vertex.clone();
                let expected: Vec<f32> = nodes.iter().map(|slot| temperatures[*slot as usize]).collect();
                assert_eq!(simulation.node_temperatures().expect("temperatures"), expected);
            }
        }
    }
}

#[test]
fn parts_have_means_over_their_areas() {
    let folder = Folder::new(SCENE);
    let mut simulation = simulation(&folder, &Target::Reference);
    simulation.step_to(240.0).expect("it steps");
    let of_nodes = simulation.node_temperatures().expect("temperatures");
    let parts = simulation.part_temperatures().expect("temperatures");
    assert_eq!(parts.len(), simulation.prepared().parts.len());
    assert_eq!(simulation.node_positions().len(), of_nodes.len());
    for (number, part) in parts.iter().enumerate() {
        let own = of_nodes.iter().zip(simulation.node_parts()).filter(|(_, of)| *of as usize == number);
        let own: Vec<f64> = own.map(|(temperature, _)| f64::from(*temperature)).collect();
        let range = own.iter().fold([f64::INFINITY, 0.0f64], |[low, high], t| [low.min(*t), high.max(*t)]);
        assert_eq!([part.least, part.greatest], range, "{}", part.part);
        assert!(part.least - 1e-9 <= part.mean && part.mean <= part.greatest + 1e-9, "{part:?}");
    }
    assert!(parts.iter().any(|part| part.part == "mast"));
}

/// A camera of another size, lens and place is that of a scene that states it.
#[test]
fn a_camera_may_change_with_every_image() {
    let folder = Folder::new(SCENE);
    let pose = "position = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]";
    let elsewhere = "position = [0, -9, -3]\nlook_at = [0, 1, 0]\nup = [0, 0, -1]";
    let cases = [
        scene_with(&[(pose, elsewhere)]),
        scene_with(&[(pose, elsewhere), ("fov_deg = 45", "fov_deg = 30")]),
        scene_with(&[("width = 96", "width = 40"), ("near = 0.5", "near = 0.7")]),
        scene_with(&[("samples = 1", "samples = 4")]),
    ];
    let position = DVec3::new(0.0, -9.0, -3.0);
    let look = Pose::look_at(CameraFrame::Body, position, DVec3::Y, DVec3::NEG_Z).expect("a pose");
    for target in targets() {
        let mut one = simulation(&folder, &target);
        one.step_to(300.0).expect("it steps");
        let own = own_image(&mut one);
        for (number, case) in cases.iter().enumerate() {
            folder.write("other.toml", case);
            let mut other = Simulation::load(&folder.path("other.toml"), &target).expect("a scene");
            other.step_to(300.0).expect("it steps");
            let expected = own_image(&mut other);
            let camera = other.camera().expect("a camera").clone();
            let image = one.image(&camera, &Pose::OfCamera).expect("an image");
            assert!(image == expected, "case {number}");
            assert!(image.radiance != own.radiance, "case {number}");
            if number < 2 {
                assert_eq!(one.image(&camera, &look).expect("an image").depth, image.depth);
            }
        }
        assert!(own_image(&mut one) == own, "the scene's camera sees the same as before");
        let narrow = Camera { width: 0, ..one.camera().expect("a camera").clone() };
        let error = one.image(&narrow, &Pose::OfCamera).unwrap_err().to_string();
        assert_eq!(error, "camera: width must be 1 to 16384 pixels, not 0");
        assert!(own_image(&mut one) == own);
    }
}

#[test]
fn a_restored_state_goes_on_as_before() {
    let folder = Folder::new(SCENE);
    for target in targets() {
        let mut one = simulation(&folder, &target);
        one.step_to(150.0).expect("it steps");
        let saved = one.save().expect("a state");
        one.step_to(420.0).expect("it steps");
        let late = own_image(&mut one);
        assert!(matches!(one.step_to(60.0), Err(SimulationError::Time { .. })));
        let saved = decode(&encode(&saved).expect("bytes")).expect("the bytes of a state");
        one.restore(&saved).expect("its own state");
        assert_eq!(one.time(), 150.0);
        assert!(own_image(&mut one) != late);
        one.step_to(420.0).expect("it steps");
        assert!(own_image(&mut one) == late);
        folder.write("other.toml", &scene_with(&[("t_max_steps = 20", "t_max_steps = 21")]));
        let mut other = Simulation::load(&folder.path("other.toml"), &target).expect("a scene");
        let refused = other.restore(&saved).unwrap_err().to_string();
        assert!(refused.contains("the material 'skin' has other values"), "{refused}");
    }
}

/// Places along the scene's own orbit give its temperatures; a turned craft has others.
#[test]
fn places_from_outside_take_the_place_of_the_orbit() {
    let folder = Folder::new(SCENE);
    let mut own = simulation(&folder, &Target::Reference);
    own.step_to(600.0).expect("it steps");
    let expected = own.node_temperatures().expect("temperatures");
    let mut worst = [0.0f32; 2];
    for (case, worst) in worst.iter_mut().enumerate() {
        let mut placed = simulation(&folder, &Target::Reference);
        placed.begin().expect("it begins");
        for minute in 1..=10 {
            let time = 60.0 * f64::from(minute);
            let sky = own.prepared().loads.sky_model().sky(time);
            let attitude = DQuat::from_mat3(&sky.body_from_inertial.transpose());
            let turned = attitude * DQuat::from_rotation_x(0.5);
            let inertial_from_body = (case == 1).then_some(turned);
            placed.place(Placement { time, inertial_from_body, ..Placement::default() }).expect("a place");
            placed.step_to(time).expect("it steps");
        }
        let error = placed.step_to(660.0).unwrap_err().to_string();
        assert_eq!(error, "the craft has places from 480 to 600 s, and one at 660 s is needed");
        let found = placed.node_temperatures().expect("temperatures");
        *worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    }
    // The albedo of a given place is interpolated between altitudes.
    assert!(worst[0] < 0.01 && worst[1] > 1.0, "{worst:?}");
}

/// A craft that is placed before anything else begins in balance where it is.
#[test]
fn a_placed_craft_needs_no_orbit_of_its_own() {
    let folder = Folder::new(&scene_with(&[("eclipse = true", "eclipse = false")]));
    for target in targets() {
        let mut craft = simulation(&folder, &target);
        let place = |time: f64, axis: f64| Placement {
            time,
            position: Some(DVec3::new(0.0, 7e6, 0.0)),
            velocity: Some(DVec3::X * 7500.0),
            sun: Some(DVec3::X * 1.496e11),
            inertial_from_body: Some(DQuat::from_rotation_z(axis)),
        };
        craft.place(place(1000.0, 0.0)).expect("a place");
        assert_eq!(craft.time(), 1000.0);
        assert!(craft.sky().sun_direction.distance(DVec3::X) < 1e-4);
        assert!(craft.sky().nadir_direction.distance(DVec3::NEG_Y) < 1e-12);
        let lit = craft.part_temperatures().expect("temperatures");
        craft.place(place(1300.0, FRAC_PI_2)).expect("a place");
        craft.step_to(1300.0).expect("it steps");
        assert!(craft.sky().sun_direction.distance(DVec3::NEG_Y) < 1e-4);
        assert!(craft.part_temperatures().expect("temperatures") != lit);
        let early = craft.place(place(1200.0, 0.0)).unwrap_err().to_string();
        assert_eq!(early, "a place at 1200 s must come after the one at 1300 s");
    }
}

#[test]
fn joints_are_set_from_outside() {
    let wing =
        "[[joint]]\npart = \"wing_port\"\nmode = \"fixed\"\naxis = \"+Y\"\nangle_deg = 0\nlimits_deg = [-90, 90]\n";
    let folder = Folder::new(&format!("{SCENE}\n{wing}"));
    for target in targets() {
        let mut craft = simulation(&folder, &target);
        let before = own_image(&mut craft);
        assert_eq!(craft.joints(), [("wing_port".to_owned(), 0.0)]);
        craft.set_joint("wing_port", 1.0).expect("a joint");
        let after = own_image(&mut craft);
        assert!(before.depth != after.depth);
        craft.step_to(120.0).expect("it steps");
        assert_eq!(craft.joints()[0].1, 1.0);
        let beyond = craft.set_joint("wing_port", 2.0).unwrap_err().to_string();
        assert!(beyond.contains("the joint 'wing_port' can not be at 2"), "{beyond}");
        let unknown = craft.set_joint("wing", 0.0).unwrap_err().to_string();
        assert_eq!(unknown, "there is no joint 'wing'; there are: wing_port");
    }
}

#[test]
fn a_joint_without_limits_has_those_of_a_scene() {
    let wing = "[[joint]]\npart = \"wing_port\"\nmode = \"fixed\"\naxis = \"+Y\"\nangle_deg = 0\n";
    let mut craft = simulation(&Folder::new(&format!("{SCENE}\n{wing}")), &Target::Reference);
    craft.set_joint("wing_port", 100.0).expect("some turns");
    for position in [1e300, f64::NAN] {
        let beyond = craft.set_joint("wing_port", position).unwrap_err().to_string();
        assert!(beyond.contains("its positions go from -17453292.5") && beyond.ends_with("rad"), "{beyond}");
    }
}

#[test]
fn a_stop_between_steps_loses_nothing() {
    let folder = Folder::new(SCENE);
    for target in targets() {
        let mut whole = simulation(&folder, &target);
        whole.step_to(720.0).expect("it steps");
        let mut stopped = simulation(&folder, &target);
        let (stop, mut steps) = (AtomicBool::new(false), 0);
        let mut progress = || {
            steps += 1;
            stop.store(steps == 3, Ordering::Relaxed);
        };
        let there = stopped.step_to_with(720.0, &stop, &mut progress).expect("it steps");
        // A dispatch may have taken all steps already.
        assert_eq!(there, stopped.time() == 720.0);
        stopped.step_to(720.0).expect("it steps");
        assert!(own_image(&mut stopped) == own_image(&mut whole));
    }
}

/// Two threads share one device and its queue. Their images are those of a simulation that is alone.
#[test]
fn two_threads_share_a_device() {
    let Some(context) = validated_context() else { return };
    let target = Target::Device(Arc::clone(&context));
    let scenes = [SCENE.to_owned(), format!("{}\n[shadows]\n", scene_with(&[("beta_deg = 20", "beta_deg = -40")]))];
    let folders = scenes.map(|scene| Folder::new(&scene));
    let images = |folder: &Folder| -> Vec<Image> {
        let mut simulation = simulation(folder, &target);
        let image = |step: u32| {
            simulation.step_to(15.0 * f64::from(step)).expect("it steps");
            let mut camera = simulation.camera().expect("a camera").clone();
            // From time to time the resources of the image are made anew.
            camera.width += u32::from(step.is_multiple_of(8));
            simulation.image(&camera, &Pose::OfCamera).expect("an image")
        };
        (0..24).map(image).collect()
    };
    let alone = folders.each_ref().map(images);
    let done = AtomicUsize::new(0);
    std::thread::scope(|threads| {
        for (folder, alone) in folders.iter().zip(&alone) {
            let (images, done) = (&images, &done);
            threads.spawn(move || {
                for _ in 0..2 {
                    assert!(images(folder) == *alone);
                }
                done.fetch_add(1, Ordering::Relaxed);
            });
        }
    });
    assert_eq!(done.into_inner(), 2);
    assert!(alone[0] != alone[1]);
    assert_silent(&context);
}

#[test]
fn errors_tell_file_line_and_key() {
    let wrong = scene_with(&[("step = 60", "step = -60")]);
    let Err(error) = Simulation::parse(&wrong, Path::new("somewhere/scene.toml"), &Target::Reference) else {
        panic!("a negative step is refused")
    };
    let (file, line, key) = error.place();
    let line_of_step = wrong.lines().position(|line| line == "step = -60").expect("the line") + 1;
    assert!(error.is_of_the_user());
    assert_eq!((file, line), (Some(Path::new("somewhere/scene.toml")), Some(3)), "{error}");
    assert_eq!(key, Some("model.path"));
    let folder = Folder::new(&wrong);
    let Err(error) = Simulation::load(&folder.path("scene.toml"), &Target::Reference) else {
        panic!("a negative step is refused")
    };
    let scene = folder.path("scene.toml");
    assert_eq!(error.place(), (Some(scene.as_path()), Some(line_of_step), Some("time.step")));
}

/// At 1e17 s a sum of steps of one second stays where it is. Python calls the same functions.
#[test]
fn a_time_beyond_reason_is_refused_at_every_door() {
    let folder = Folder::new(SCENE);
    let mut craft = simulation(&folder, &Target::Reference);
    let saved = craft.save().expect("a state");
    for time in [1e17, -1e17, 1.01e11, f64::MAX, f64::NAN, f64::INFINITY] {
        let placed = craft.place(Placement { time, position: Some(DVec3::X * 7e6), ..Placement::default() });
        assert!(placed.is_err() && craft.step_to(time).is_err() && craft.restore_at(&saved, time).is_err(), "{time}");
    }
    // The latest time of all, and steps beyond count from there on.
    let place = |time: f64| Placement {
        time,
        position: Some(DVec3::new(7e6, 0.0, 0.0)),
        velocity: Some(DVec3::Y * 7500.0),
        sun: Some(DVec3::X * 1.5e11),
        inertial_from_body: Some(DQuat::IDENTITY),
    };
    let mut late = simulation(&folder, &Target::Reference);
    late.place(place(9.99e10)).expect("a place");
    late.place(place(9.99e10 + 600.0)).expect("a place");
    late.step_to(9.99e10 + 600.0).expect("ten steps");
    assert_eq!(late.time(), 9.99e10 + 600.0);
}
