//! Bounds on the work that a scene asks for, checked where the values are read, before anything is stepped.

use super::error::SceneError;
use super::section::Section;
use super::{Camera, Draw, Time};
use crate::environment::Orbit;
use crate::environment::scene_time::SceneTime;

/// Most steps of a run or of a warm-up: a hundred days at 100 Hz, rounded up.
pub(crate) const MOST_STEPS: f64 = 1e9;
/// Most orbits of a run. Each has its eclipses, which are found and drawn.
pub(crate) const MOST_ORBITS: f64 = 1e6;
/// Most bytes of images, before compression.
const MOST_IMAGE_BYTES: f64 = 1e13;
/// Bytes of a pixel: radiance, temperature, depth, part and material.
const PIXEL_BYTES: f64 = 20.0;

/// Why a time is too late for a scene with this step and orbit. `None` if it is not.
pub(crate) fn too_late(time: f64, step: f64, orbit: &Orbit) -> Option<String> {
    if let Err(error) = SceneTime::new(time) {
        return Some(error.to_string());
    }
    let (steps, orbits) = (time / step, time / orbit.period());
    if steps > MOST_STEPS {
        return Some(format!("{time} s are {steps:.3e} steps of {step} s; the limit is {MOST_STEPS:e} steps"));
    }
    (orbits > MOST_ORBITS).then(|| format!("{time} s are {orbits:.3e} orbits; the limit is {MOST_ORBITS:e} orbits"))
}

pub(super) fn check_steps(section: &Section, time: &Time, orbit: &Orbit) -> Result<(), SceneError> {
    let end = f64::from(time.steps) * time.step;
    if let Some(reason) = too_late(end, time.step, orbit) {
        return Err(section.clash(
            "steps",
            &["step", "orbit.*", "environment.planet_radius"],
            format!("asks for too much work: {reason}"),
        ));
    }
    // A periodic warm-up may end with its second orbit, but nobody knows before.
    let orbits = warm_up_orbits(time);
    if orbits > 0.0
        && let Some(reason) = too_late(orbits * orbit.period(), time.warm_up_step, orbit)
    {
        let key = ["warm_up_orbits", "warm_up_step"].into_iter().find(|key| section.has(key)).unwrap_or("step");
        let others = ["warm_up", "warm_up_orbits", "warm_up_step", "step", "orbit.*", "environment.planet_radius"];
        return Err(section.clash(key, &others, format!("asks for too much work: a warm-up of {reason}")));
    }
    Ok(())
}

/// Most orbits of the warm-up. A periodic one has whole orbits.
fn warm_up_orbits(time: &Time) -> f64 {
    if time.periodic.is_some() { time.warm_up_orbits.ceil() } else { time.warm_up_orbits }
}

/// Most steps of the warm-up. A periodic one begins each orbit anew, and may be done earlier.
pub(crate) fn warm_up_steps(time: &Time, orbit: &Orbit) -> f64 {
    let orbits = warm_up_orbits(time);
    if orbits == 0.0 {
        return 0.0;
    }
    let each = orbit.period() / time.warm_up_step;
    if time.periodic.is_some() { orbits * each.ceil() } else { (orbits * each).round() }
}

/// Why a camera has too many images. `None` if it has not.
pub(crate) fn too_many_images(time: &Time, camera: &Camera) -> Option<String> {
    let (images, width, height) = (images(time), camera.width, camera.height);
    let bytes = images as f64 * f64::from(width) * f64::from(height) * PIXEL_BYTES;
    (bytes > MOST_IMAGE_BYTES).then(|| {
        format!("{images} images of {width} x {height} pixels are {bytes:.1e} bytes; the limit is {MOST_IMAGE_BYTES:e}")
    })
}

pub(super) fn check_images(section: &Section, time: &Time, camera: Option<&Camera>) -> Result<(), SceneError> {
    let Some(reason) = camera.and_then(|camera| too_many_images(time, camera)) else { return Ok(()) };
    let key = ["draw_steps", "images"].into_iter().find(|key| section.has(key)).unwrap_or("draw_every");
    let message = format!("asks for too much work: {reason}");
    Err(section.clash(key, &["steps", "step", "draw_every", "draw_steps", "images", "camera.*"], message))
}

/// Number of images that the steps of a run draw.
pub(crate) fn images(time: &Time) -> u64 {
    match &time.draw {
        Draw::None => 0,
        Draw::Every(stride) => u64::from(time.steps / stride) + 1,
        Draw::Steps(steps) => steps.len() as u64,
        Draw::Times(times) => times.len() as u64,
    }
}

/// Time [s] of one of the images of a run, with its number where it has its own time. `None` beyond the last one.
pub(crate) fn image_time(time: &Time, number: u64) -> Option<(f64, Option<u32>)> {
    let of_step = |step: u64| (step as f64 * time.step, None);
    match &time.draw {
        Draw::None => None,
        Draw::Every(stride) => {
            Some(number * u64::from(*stride)).filter(|step| *step <= u64::from(time.steps)).map(of_step)
        }
        Draw::Steps(steps) => steps.get(number as usize).map(|step| of_step(u64::from(*step))),
        Draw::Times(times) => times.get(number as usize).map(|time| (*time, Some(number as u32))),
    }
}

/// Times of the images of a run [s].
pub(crate) fn image_times(time: &Time) -> Box<dyn Iterator<Item = f64> + '_> {
    let of_step = |step: u32| f64::from(step) * time.step;
    match &time.draw {
        Draw::None => Box::new(std::iter::empty()),
        Draw::Every(stride) => Box::new((0..=time.steps).step_by(*stride as usize).map(of_step)),
        Draw::Steps(steps) => Box::new(steps.iter().map(move |step| of_step(*step))),
        Draw::Times(times) => Box::new(times.iter().copied()),
    }
}
