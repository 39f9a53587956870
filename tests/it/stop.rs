//! Long work ends once nobody waits for it: preparing a scene, rays between surfaces, an image. Each would go on for minutes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use isotherm::internals::{Prepared, Stopped, until};
use isotherm::{Pose, Scene, Simulation, Target};

use super::craft::{Folder, scene_with};
use super::program::isotherm;
use super::run_stopped::interrupted;

/// Some 240 million rays.
const MANY_RAYS: (&str, &str) = ("[radiance]", "[exchange]\npatch_edge = 0.1\nrays = 60000\n[radiance]");

/// Work whose flag another thread sets after some time.
fn cut<T>(work: impl FnOnce() -> T) -> Result<T, Stopped> {
    let flag: Arc<AtomicBool> = Arc::default();
    let setter = Arc::clone(&flag);
    let setting = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(500));
        setter.store(true, Ordering::Relaxed);
    });
    let worked = until(&flag, work);
    setting.join().expect("no panic");
    worked
}

#[test]
fn a_scene_is_prepared_only_as_long_as_somebody_waits() {
    let folder = Folder::new(&scene_with(&[("max_edge = 0.7", "max_edge = 0.004")]));
    assert!(cut(|| Prepared::new(&folder.path("scene.toml"), &mut |_| ())).is_err());
}

#[test]
fn rays_are_cast_only_as_long_as_somebody_waits() {
    let folder = Folder::new(&scene_with(&[MANY_RAYS]));
    let scene = Scene::load(&folder.path("scene.toml")).expect("a scene");
    assert!(cut(|| Simulation::from_scene(scene, &Target::Reference)).is_err());
}

#[test]
fn an_image_is_drawn_only_as_long_as_somebody_waits_and_the_next_one_comes() {
    let large = [("width = 96", "width = 2048"), ("height = 72", "height = 2048\nsamples = 16")];
    let folder = Folder::new(&scene_with(&large));
    let mut simulation = Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene");
    simulation.step_to(60.0).expect("a step");
    let large = simulation.camera().expect("a camera").clone();
    assert_eq!(cut(|| simulation.image(&large, &Pose::OfCamera).is_ok()), Err(Stopped));
    let mut small = large;
    (small.width, small.height, small.samples) = (32, 32, 1);
    let mut undisturbed = Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene");
    undisturbed.step_to(60.0).expect("a step");
    let image = |simulation: &mut Simulation| simulation.image(&small, &Pose::OfCamera).expect("an image");
    assert_eq!(image(&mut simulation), image(&mut undisturbed));
}

#[cfg(unix)]
#[test]
fn control_c_ends_a_run_that_still_casts_its_rays() {
    let folder = Folder::new(&scene_with(&[MANY_RAYS]));
    let mut command = isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    command.stderr(std::fs::File::create(folder.path("said")).expect("a file"));
    let said = || std::fs::read_to_string(folder.path("said")).unwrap_or_default();
    let output = interrupted(command, "INT", || said().contains("forecast: "));
    assert_eq!(output.status.code(), Some(1), "{}", said());
    assert!(said().contains("error: stopped; nothing was written"), "{}", said());
}
