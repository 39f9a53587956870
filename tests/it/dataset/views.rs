//! Where cameras are, what they see, and when.

use std::sync::atomic::AtomicBool;

use glam::DVec3;
use isotherm::Target;
use isotherm::internals::{LabelledImage, OrbitRun, Reason, Rejections, preview};

use super::Workshop;

/// All images of a data set, and what was rejected.
fn images(workshop: &Workshop) -> (Vec<LabelledImage>, Rejections) {
    let (spec, scenes) = workshop.spec();
    let (mut images, mut rejections) = (Vec::new(), Rejections::new());
    for orbit in 0..spec.orbits() {
        let mut run = OrbitRun::new(&spec, &scenes, &Target::Reference, orbit).expect("an orbit");
        let outcome = run.run(&|_| true, &AtomicBool::new(false), &mut |_, _, _, image| {
            images.push(image);
            Ok(())
        });
        for (reason, count) in outcome.expect("images").rejections {
            *rejections.entry(reason).or_default() += count;
        }
    }
    (images, rejections)
}

/// Place of the camera in body axes [m].
fn camera(image: &LabelledImage) -> DVec3 {
    image.camera_from_body.inverse().translation
}

const SHELL: &str = "kind = \"shell\"\ndistance = { log_uniform = [9, 40] }";

#[test]
fn a_cone_a_corridor_and_the_pointing_are_where_the_spec_says() {
    let point = ("pointing_px = { normal = [0, 4] }", "pointing_px = 5");
    let cone = "kind = \"cone\"\naxis = [1, 0, 0]\nhalf_angle_deg = 20\nlook_at = [0, 1, 0]\ndistance = 20";
    let (seen, _) = images(&Workshop::new(&[(SHELL, cone), point]));
    assert_eq!(seen.len(), 6);
    let mut greatest: f64 = 0.0;
    for image in &seen {
        let from_target = camera(image) - DVec3::Y;
        assert!((from_target.length() - 20.0).abs() < 1e-9);
        greatest = greatest.max(from_target.angle_between(DVec3::X).to_degrees());
        // The target appears 5 px right of and below the principal point, whatever the roll.
        let pixel = image.project(image.camera_from_body.transform_point3(DVec3::Y)).expect("before the camera");
        let [_, _, cx, _, _, cy, ..] = image.camera_matrix();
        assert!((pixel.x - cx - 5.0).abs() < 1e-9 && (pixel.y - cy - 5.0).abs() < 1e-9, "{pixel}");
    }
    assert!(greatest <= 20.0 && greatest > 5.0, "{greatest}");

    // Behind the craft in a frame that nadir pointing makes that of the body.
    let corridor = "kind = \"corridor\"\nframe = \"orbit\"\naxis = [-1, 0, 0]\ndistance = { uniform = [15, 30] }\nacross = { uniform = [-1, 1] }";
    let (seen, _) = images(&Workshop::new(&[(SHELL, corridor)]));
    for place in seen.iter().map(camera) {
        assert!((15.0..=30.0).contains(&-place.x) && place.y.abs() <= 1.0 && place.z.abs() <= 1.0, "{place}");
    }
    assert!(seen.iter().any(|image| camera(image).y.abs() > 0.1));
}

#[test]
fn images_are_taken_in_the_light_that_is_asked_for() {
    let orbits = "orbits = { uniform = [0, 0.1] }";
    for (time, share) in [
        ("orbits = { uniform = [0, 0.2] }\nlight = \"shadow\"", 0.0),
        ("orbits = { uniform = [0, 0.2] }\nlight = \"lit\"", 1.0),
        ("after_exit = { uniform = [1, 100] }", 1.0),
        ("after_entry = { uniform = [30, 100] }", 0.0),
    ] {
        // The eclipse of this orbit begins 0.1 periods after the start.
        let phase = ("phase_deg = { uniform = [0, 360] }", "phase_deg = 75");
        let small = [("samples = 6", "samples = 3"), ("poses_per_orbit = 2", "poses_per_orbit = 3")];
        let (seen, rejected) = images(&Workshop::new(&[(orbits, time), phase, small[0], small[1]]));
        assert!(seen.iter().all(|image| image.lit == share), "{time}");
        let of_light = rejected.get(&Reason::Light).copied().unwrap_or(0);
        assert!(of_light == 0 || time.contains("light"), "{time}: {of_light}");
        assert!(seen.windows(2).all(|pair| pair[0].time <= pair[1].time), "in the order of time");
    }
}

#[test]
fn the_sun_the_planet_and_a_near_craft_are_kept_out() {
    let wide = ("[reject]\nin_view = 0.6", "[reject]\nin_view = 0.6\nplanet = \"reject\"\nclearance = 12");
    let (seen, rejected) = images(&Workshop::new(&[wide, ("attempts = 50", "attempts = 500")]));
    for image in &seen {
        let from_axis = image.planet.angle_between(DVec3::Z);
        assert!(from_axis > image.planet_radius, "the axis of the camera misses the planet");
        assert!(camera(image).length() >= 12.0);
    }
    assert!(rejected.contains_key(&Reason::PlanetInView) && rejected.contains_key(&Reason::TooClose), "{rejected:?}");

    // A camera that looks along the Sun's direction: beta is 20 deg, and the craft is over the terminator at the start.
    let sun = "kind = \"cone\"\nframe = \"inertial\"\naxis = [-0.9397, 0, -0.342]\nhalf_angle_deg = 30\ndistance = 20";
    let early = ("orbits = { uniform = [0, 0.1] }", "orbits = 0");
    let phase = ("phase_deg = { uniform = [0, 360] }", "phase_deg = 270");
    let (_, rejected) = images(&Workshop::new(&[(SHELL, sun), early, phase]));
    assert!(rejected.contains_key(&Reason::SunInView), "{rejected:?}");
    let kept = ("[reject]\nin_view = 0.6", "[reject]\nin_view = 0.6\nsun = \"keep\"");
    let (_, rejected) = images(&Workshop::new(&[(SHELL, sun), early, phase, kept]));
    assert!(!rejected.contains_key(&Reason::SunInView), "{rejected:?}");
}

#[test]
fn a_preview_shows_samples_with_boxes_and_axes() {
    let workshop = Workshop::new(&[]);
    let (spec, scenes) = workshop.spec();
    let mut told = 0;
    let sheet =
        preview(&spec, &scenes, &Target::Reference, &AtomicBool::new(false), &mut || told += 1).expect("a sheet");
    assert_eq!((sheet.samples, told), (6, 6));
    let has = |colour: [u8; 3]| {
        let rows = 0..sheet.canvas.height();
        rows.flat_map(|y| (0..sheet.canvas.width()).map(move |x| (x, y)))
            .any(|(x, y)| sheet.canvas.get(x, y) == Some(colour))
    };
    for colour in [[90, 220, 255], [255, 70, 70], [70, 255, 70], [80, 255, 120], [72, 105, 160]] {
        assert!(has(colour), "{colour:?}");
    }
    assert!(!has([1, 2, 3]));
}
