//! Settings of images that cannot be combined yet.

use super::error::SceneError;
use super::keys;
use super::section::Section;
use super::{Camera, ImageFiles, Reflections, Surrounded};
use crate::environment::Attitude;
use crate::thermal::sensor::Sensor;
use crate::thermal::sensor::spread::FINENESS;

/// Whether the rays of reflections would meet a craft whose joints have moved since the first row.
pub(crate) fn rays_follow_no_joints(surrounded: &Surrounded, camera: &Camera, jointed: bool) -> bool {
    camera.line_time > 0.0 && jointed && surrounded.reflections == Reflections::Traced
}

/// Refuses surroundings that the images of a camera cannot show.
pub(super) fn check_camera(
    surrounded: &Surrounded,
    camera: &Camera,
    section: Option<&Section>,
    output: Option<&Section>,
    jointed: bool,
) -> Result<(), SceneError> {
    if rays_follow_no_joints(surrounded, camera, jointed)
        && let Some(section) = section
    {
        let message = "'traced' cannot be combined with camera.line_time and [[joint]]: rays meet the craft as its joints \
                       stand at the time of the image, and rows see them later";
        return Err(section.clash("reflections", &["camera.line_time"], message));
    }
    if camera.samples > 1
        && surrounded.channels
        && let Some(output) = output
    {
        let message = "cannot be combined with camera.samples above 1: the mean over the samples is that of the whole \
                       radiance";
        return Err(output.clash("channels", &["camera.samples"], message));
    }
    Ok(())
}

/// Refuses what depends on directions in the body where the loads of a craft that tumbles have none.
pub(super) fn check_tumble(
    root: &Section,
    attitude: &Attitude,
    images: &ImageFiles,
    surrounded: &Surrounded,
) -> Result<(), SceneError> {
    if *attitude != Attitude::Tumble {
        return Ok(());
    }
    let needs = [
        ("shadows", root.has("shadows")),
        ("exchange", root.has("exchange")),
        ("joint", root.has("joint")),
        ("radiance", surrounded.reflections != Reflections::Off),
        ("output", images.error || images.budget),
    ];
    match needs.into_iter().find(|(_, stated)| *stated) {
        None => Ok(()),
        Some((key, _)) => {
            let what = match key {
                "radiance" => "reflections need",
                "output" => "error and budget need",
                _ => "needs",
            };
            let message = format!(
                "{what} the direction of the light, and attitude.mode = 'tumble' has means over all orientations"
            );
            Err(root.clash(key, &["attitude.mode"], message))
        }
    }
}

/// The camera with one sample of a pixel where `output.channels` needs it and the scene states none.
pub(super) fn with_usual_samples(camera: Camera, channels: bool, root: &Section<'_>) -> Result<Camera, SceneError> {
    let stated = root.table("camera", keys::CAMERA)?.is_some_and(|section| section.has("samples"));
    Ok(if channels && !stated { Camera { samples: 1, ..camera } } else { camera })
}

/// The camera with the samples of a pixel that a point spread reads.
pub(super) fn with_samples(
    camera: Option<Camera>,
    sensor: Option<&Sensor>,
    channels: bool,
    (root, assumptions): (&Section<'_>, &mut Vec<String>),
) -> Result<Option<Camera>, SceneError> {
    if sensor.is_none_or(|sensor| sensor.spread.is_none()) {
        return Ok(camera);
    }
    if channels {
        let message = "cannot be combined with output.channels: a point spread needs several samples of a pixel";
        let section = root.table("sensor", keys::SENSOR)?;
        let (section, key) = section.as_ref().map_or((root, "band"), |section| (section, "point_spread"));
        return Err(section.clash(key, &["output.channels"], message));
    }
    let samples = (FINENESS * FINENESS) as u32;
    if camera.as_ref().is_some_and(|camera| camera.samples != samples) {
        assumptions.push(format!("A pixel has {samples} samples, which sensor.point_spread reads (camera.samples)."));
    }
    Ok(camera.map(|camera| Camera { samples, ..camera }))
}
