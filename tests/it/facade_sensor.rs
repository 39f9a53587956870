//! `Simulation::set_sensor`: its images are those of a scene that has had the sensor from the beginning.

use isotherm::{Image, Pose, Scene, Simulation, Target};

use super::craft::{Folder, SCENE};
use super::device::context;

const SENSOR: &str = "[sensor]\nseed = 3\nnetd = 0.05\nrange = [150, 400]\npoint_spread = \"gaussian\"\nsigma = 0.7\noffset_pattern = 0.2\nbits = 14\n";

/// The scene with another line in its sensor.
fn folder(from: &str, to: &str) -> Folder {
    assert!(SENSOR.contains(from));
    Folder::new(&format!("{SCENE}\n{}", SENSOR.replace(from, to)))
}

fn image_at(simulation: &mut Simulation, time: f64) -> Image {
    simulation.step_to(time).expect("it steps");
    let camera = simulation.camera().expect("a camera").clone();
    simulation.image(&camera, &Pose::OfCamera).expect("an image")
}

#[test]
fn another_sensor_gives_the_images_of_a_scene_that_has_it() {
    for target in [Target::Device(context()), Target::Reference] {
        let load = |folder: &Folder| Simulation::load(&folder.path("scene.toml"), &target).expect("a scene");
        let mut changed = load(&folder("seed = 3", "seed = 3"));
        let before = image_at(&mut changed, 600.0);
        for (from, to) in [
            ("seed = 3", "seed = 4"),
            ("netd = 0.05", "netd = 0.4"),
            ("range = [150, 400]", "range = [100, 420]"),
            ("sigma = 0.7", "sigma = 2.5"),
            ("bits = 14", "bits = 8"),
            ("offset_pattern = 0.2", "gain_pattern = 0.1"),
            // Other passes.
            ("offset_pattern = 0.2\n", "stray_share = 0.1\nstray_radius = 20\n"),
            ("netd = 0.05", "netd = 0"),
            ("bits = 14", "vignetting = \"cos4\"\ntransmission = 0.9\nhousing_temperature = 310"),
        ] {
            let folder = folder(from, to);
            let sensor = Scene::load(&folder.path("scene.toml")).expect("a scene").sensor.expect("a sensor");
            changed.set_sensor(sensor).expect("a sensor");
            let mut own = load(&folder);
            let (found, expected) = (image_at(&mut changed, 600.0), image_at(&mut own, 600.0));
            assert!(found == expected, "{to} on {}", changed.device_name());
            assert!(found.digital_numbers != before.digital_numbers, "{to} on {}", changed.device_name());
            assert!(found.radiance == before.radiance, "{to} on {}", changed.device_name());
        }
    }
}

#[test]
fn a_scene_without_a_sensor_takes_none() {
    let folder = folder("seed = 3", "seed = 3");
    let sensor = Scene::load(&folder.path("scene.toml")).expect("a scene").sensor.expect("a sensor");
    let mut without = Simulation::load(&Folder::new(SCENE).path("scene.toml"), &Target::Reference).expect("a scene");
    assert!(without.set_sensor(sensor).expect_err("an error").to_string().contains("which has none"));
}
