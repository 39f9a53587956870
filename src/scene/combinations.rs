//! Settings of images that cannot be combined yet.

use super::error::SceneError;
use super::section::Section;
use super::{Background, Camera, Reflections, Surrounded};

/// Refuses surroundings that the images of a camera cannot show.
pub(super) fn check_camera(
    surrounded: &Surrounded,
    camera: &Camera,
    section: Option<&Section>,
    output: Option<&Section>,
) -> Result<(), SceneError> {
    let keys = [
        ("reflections", surrounded.reflections != Reflections::Off),
        ("background", surrounded.background != Background::Off),
    ];
    let shown = keys.into_iter().find(|(_, shown)| *shown);
    if camera.line_time > 0.0
        && let (Some(section), Some((key, _))) = (section, shown)
    {
        let message = "cannot be combined with camera.line_time: each row of a rolling shutter sees its surroundings from \
                       another pose, and that is not there yet";
        return Err(section.clash(key, &["camera.line_time"], message));
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
