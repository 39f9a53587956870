//! `[output]`: which files each image has beside its EXR and the picture of its surface temperatures, and the video of a run.

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::thermal::sensor::Sensor;

/// A file of each image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ImageFile {
    /// Digital numbers as PNG.
    NumbersPng,
    /// Digital numbers as TIFF.
    NumbersTiff,
    /// Digital numbers as FITS.
    NumbersFits,
    /// Brightness temperatures of the radiometric output as PNG.
    KelvinPng,
    /// Brightness temperatures of the radiometric output as TIFF.
    KelvinTiff,
    /// Which pixels tell no temperature.
    MaskPng,
    /// The 8 bits of a display.
    DisplayPng,
    /// Apparent brightness temperature in false colour.
    ApparentPng,
}

const FILES: [(&str, ImageFile); 8] = [
    ("dn.png", ImageFile::NumbersPng),
    ("dn.tiff", ImageFile::NumbersTiff),
    ("dn.fits", ImageFile::NumbersFits),
    ("kelvin.png", ImageFile::KelvinPng),
    ("kelvin.tiff", ImageFile::KelvinTiff),
    ("mask.png", ImageFile::MaskPng),
    ("display.png", ImageFile::DisplayPng),
    ("apparent.png", ImageFile::ApparentPng),
];

impl ImageFile {
    /// End of its name, such as `dn.png`.
    pub(crate) fn ending(self) -> &'static str {
        FILES.iter().find(|(_, file)| *file == self).map_or("", |(ending, _)| ending)
    }

    fn needs(self) -> Option<&'static str> {
        match self {
            Self::ApparentPng => None,
            Self::KelvinPng | Self::KelvinTiff => Some("sensor.kelvin_per_count"),
            _ => Some("a section [sensor]"),
        }
    }
}

/// A video of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Video {
    /// Animated PNG.
    Apng,
    /// MP4 by `ffmpeg`.
    Mp4,
}

/// Files of images, and the video.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageFiles {
    /// Files of each image.
    pub files: Vec<ImageFile>,
    /// Video of the run.
    pub video: Option<Video>,
    /// Images a second in the video.
    pub video_rate: f64,
    /// Whether the EXR frames state the error of every pixel's temperature.
    pub error: bool,
    /// Whether the EXR frames state the budget of every pixel.
    pub budget: bool,
    /// Whether the false colours of all images of a run have one range.
    pub one_colour_range: bool,
}

/// Whether images state the error of every pixel. `given` tells that the temperatures come from a file.
fn error(section: Option<&Section>, given: bool) -> Result<bool, SceneError> {
    let Some(section) = section else { return Ok(false) };
    match section.boolean("error")? {
        Some(true) if given => Err(section.clash(
            "error",
            &["temperatures.*"],
            "is the error of temperatures that this program computes, and these come from a file",
        )),
        stated => Ok(stated.unwrap_or(false)),
    }
}

/// Whether all images of a run have one range of false colours.
fn one_colour_range(section: Option<&Section>) -> Result<bool, SceneError> {
    let Some(section) = section else { return Ok(false) };
    let stated = section.boolean("one_colour_range")?;
    if stated.is_some() && section.has("colour_range") {
        return Err(section.clash(
            "one_colour_range",
            &["colour_range"],
            "says where the range of the colours comes from, and output.colour_range states it",
        ));
    }
    Ok(stated.unwrap_or(false))
}

/// Reads these keys of `[output]`. A sensor writes its digital numbers and the display, and temperatures where it counts them.
/// `given` tells that the temperatures come from a file.
pub(super) fn read(section: Option<&Section>, sensor: Option<&Sensor>, given: bool) -> Result<ImageFiles, SceneError> {
    let stated = section.map(|section| section.strings("files")).transpose()?.flatten();
    let files = match (section, stated) {
        (Some(section), Some(words)) => {
            let mut files = Vec::new();
            for word in &words {
                let file = super::choice::choose(word, &FILES).map_err(|message| section.error("files", message))?;
                let counts = sensor.is_some_and(|sensor| sensor.kelvin_per_count.is_some());
                match file.needs() {
                    Some(needs) if sensor.is_none() || (needs.contains("count") && !counts) => {
                        return Err(section.clash(
                            "files",
                            &["sensor.*"],
                            format!("'{word}' needs {needs}, which is missing"),
                        ));
                    }
                    _ => files.push(file),
                }
            }
            files.sort_unstable();
            files.dedup();
            files
        }
        _ => match sensor {
            None => Vec::new(),
            Some(sensor) => {
                let kelvin = sensor.kelvin_per_count.map(|_| ImageFile::KelvinPng);
                let always = [ImageFile::NumbersPng, ImageFile::MaskPng, ImageFile::DisplayPng, ImageFile::ApparentPng];
                let mut files: Vec<ImageFile> = always.into_iter().chain(kelvin).collect();
                files.sort_unstable();
                files
            }
        },
    };
    let video = section
        .map(|section| section.choice("video", &[("apng", Video::Apng), ("mp4", Video::Mp4)]))
        .transpose()?
        .flatten();
    let rate =
        section.map(|section| section.number("video_rate", Quantity::within(0.1, 120.0, "1/s"))).transpose()?.flatten();
    let mut files = files;
    if video.is_some() && !files.contains(&ImageFile::DisplayPng) {
        files.push(ImageFile::DisplayPng);
    }
    if let (Some(section), Some(_), None) = (section, rate, video) {
        return Err(section.clash("video_rate", &["video"], "needs video, which is missing"));
    }
    if let (Some(section), Some(_), None) = (section, video, sensor) {
        return Err(section.clash(
            "video",
            &["sensor.*"],
            "shows what a sensor displays: it needs a section [sensor], which is missing",
        ));
    }
    let budget = section.map(|section| section.boolean("budget")).transpose()?.flatten().unwrap_or(false);
    let one_colour_range = one_colour_range(section)?;
    let (video_rate, error) = (rate.unwrap_or(10.0), error(section, given)?);
    Ok(ImageFiles { files, video, video_rate, error, budget, one_colour_range })
}
