//! The files of a sensor: digital numbers and temperatures as PNG, TIFF and FITS, the display, and a JSON with all that a reader needs.

use std::borrow::Cow;

use serde_json::{Value as Json, json};

use super::OutputError;
use super::fits::{Value, fits_16};
use super::folder::Folder;
use super::gray::{png_8, png_16};
use super::tiff::tiff_16;
use crate::scene::{Camera, ImageFile, Scene};
use crate::simulation::image::Image;
use crate::thermal::radiance::RadianceTable;
use crate::thermal::sensor::noise::{NoiseStream, random_words};
use crate::thermal::sensor::reading::SensorConstants;
use crate::thermal::sensor::spread::FINENESS;
use crate::thermal::sensor::twin::stuck;
use crate::thermal::sensor::{Sensor, Vignetting};

/// The number 0, at the lower end of the range or below.
const LOW: u8 = 1;
/// The largest number, at the upper end of the range or beyond.
const HIGH: u8 = 2;
/// A bad pixel.
const BAD: u8 = 4;

/// What the values of a mask say.
fn flags() -> Json {
    json!({"0": "a temperature", "below the range": LOW, "beyond the range": HIGH, "bad pixel": BAD})
}

/// The scene of each band that has a sensor, with the place of the band. A scene without `[[band]]` is its own.
pub(crate) fn sensed_scenes(scene: &Scene) -> Vec<(usize, Cow<'_, Scene>)> {
    let further = (1..scene.bands.len()).map(|band| (band, Cow::Owned(scene.in_band(band))));
    let all = [(0, Cow::Borrowed(scene))].into_iter().chain(further);
    all.filter(|(_, scene)| scene.sensor.is_some()).collect()
}

/// The stem of the files of the first band with a sensor, for the stem of an image. `None` without a sensor.
pub(crate) fn first_sensed(scene: &Scene, stem: &str) -> Option<String> {
    if scene.sensor.is_some() {
        return Some(stem.to_owned());
    }
    let further = scene.bands.iter().skip(1).find(|band| band.sensor.is_some())?;
    Some(of_further(stem, &further.name))
}

/// The stem of the files of a further band.
fn of_further(stem: &str, band: &str) -> String {
    format!("{stem}_{band}")
}

pub(crate) struct SensorFiles<'a> {
    /// Place of the band among all.
    band: usize,
    scene: &'a Scene,
    sensor: &'a Sensor,
    camera: &'a Camera,
    constants: SensorConstants,
    /// Pixels that always read 0, and pixels that always read the largest number.
    bad: [Vec<[u32; 2]>; 2],
}

impl<'a> SensorFiles<'a> {
    /// The files of all sensors.
    pub(crate) fn all(scenes: &'a [(usize, Cow<'a, Scene>)]) -> Vec<Self> {
        scenes.iter().filter_map(|(band, scene)| Some(Self { band: *band, ..Self::new(scene)? })).collect()
    }

    /// The name of a file of the band. Files of the first band do not have its name.
    pub(crate) fn stem(&self, stem: &str) -> String {
        match self.band {
            0 => stem.to_owned(),
            _ => of_further(stem, &self.scene.bands[0].name),
        }
    }

    /// The files of a scene. `None` without a sensor.
    fn new(scene: &'a Scene) -> Option<Self> {
        let (sensor, camera) = scene.sensor.as_ref().zip(scene.camera.as_ref())?;
        let constants = SensorConstants::new(sensor, &RadianceTable::new(scene.passband()));
        let mut bad = [Vec::new(), Vec::new()];
        if sensor.detector.bad_pixels > 0.0 {
            let groups = camera.width.div_ceil(4);
            for (x, y) in (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y))) {
                let word =
                    random_words(sensor.detector.serial, 0, NoiseStream::Bad, y * groups + x / 4)[x as usize % 4];
                if let Some(most) = stuck(word, sensor.detector.bad_pixels) {
                    bad[usize::from(most)].push([x, y]);
                }
            }
        }
        Some(Self { band: 0, scene, sensor, camera, constants, bad })
    }

    /// Digital numbers and counts of the band.
    fn read<'i>(&self, image: &'i Image) -> (&'i Option<Vec<u16>>, &'i Option<Vec<u16>>) {
        let further = image.bands.images.get(self.band).filter(|_| self.band > 0);
        further.map_or((&image.digital_numbers, &image.counts), |band| (&band.digital_numbers, &band.counts))
    }

    /// Whether the craft is in the image, and all its pixels are at an end of the range.
    pub(super) fn is_at_end(&self, image: &Image) -> bool {
        let ends = [0, self.constants.most as u16];
        let numbers = self.read(image).0.iter().flatten();
        let mut of_craft = numbers.zip(&image.part).filter(|(_, part)| **part > 0).peekable();
        of_craft.peek().is_some() && of_craft.all(|(number, _)| ends.contains(number))
    }

    /// Ends of the names and contents of the files of an image. The name of an image's JSON ends with `.json`, other names end with `_dn.png` and so
    /// on.
    ///
    /// # Errors
    /// An image that can not be encoded.
    pub(crate) fn of(&self, stem: &str, image: &Image, step: u32) -> Result<Vec<(String, Vec<u8>)>, OutputError> {
        let size = image.size();
        let (numbers, counts) = self.read(image);
        let Some(numbers) = numbers else { return Ok(Vec::new()) };
        let no_counts = || vec![0; numbers.len()];
        let counts = counts.as_ref().map_or_else(|| Cow::Owned(no_counts()), Cow::Borrowed);
        let most = self.constants.most as u16;
        let of_numbers = self.scale_of_numbers();
        let of_counts = json!({"kelvin": "scale x value", "scale": self.sensor.kelvin_per_count.unwrap_or(0.0), "offset": 0.0, "none": 0});
        let text = |json: &Json| [("isotherm", json.to_string())];
        let mut files = Vec::new();
        for file in &self.scene.images.files {
            let bytes = match file {
                ImageFile::NumbersPng if self.sensor.bits == 8 => {
                    let bytes: Vec<u8> = numbers.iter().map(|number| *number as u8).collect();
                    png_8(size, &bytes, &text(&of_numbers))?
                }
                ImageFile::NumbersPng => png_16(size, numbers, &text(&of_numbers))?,
                ImageFile::NumbersTiff => tiff_16(size, numbers, &of_numbers.to_string()),
                ImageFile::NumbersFits => self.fits(image, step, numbers),
                ImageFile::KelvinPng | ImageFile::KelvinTiff if self.sensor.kelvin_per_count.is_none() => continue,
                ImageFile::KelvinPng => png_16(size, &counts, &text(&of_counts))?,
                ImageFile::KelvinTiff => tiff_16(size, &counts, &of_counts.to_string()),
                ImageFile::MaskPng => png_8(size, &self.flags(size, numbers), &text(&flags()))?,
                ImageFile::DisplayPng => {
                    png_8(size, &self.sensor.gain_control.display(numbers, most, self.constants.grain()), &[])?
                }
                // This picture is drawn with the others, on one scale for the whole run.
                ImageFile::ApparentPng => continue,
            };
            files.push((format!("_{}", file.ending()), bytes));
        }
        let names: Vec<String> = files.iter().map(|(ending, _)| format!("{stem}{ending}")).collect();
        let json = format!("{:#}\n", self.description(image, step, &names));
        files.push((".json".to_owned(), json.into_bytes()));
        Ok(files)
    }

    /// Writes the files of an image beside its EXR.
    ///
    /// # Errors
    /// An image that can not be encoded, or a full disk.
    pub(super) fn write(&self, folder: &Folder, stem: &str, image: &Image, step: u32) -> Result<(), OutputError> {
        let stem = &self.stem(stem);
        for (ending, bytes) in self.of(stem, image, step)? {
            folder.write_bytes(&format!("frames/{stem}{ending}"), &bytes)?;
        }
        Ok(())
    }

    /// Which pixels tell no temperature, as sums of the numbers that [`flags`] explains.
    fn flags(&self, [width, _]: [u32; 2], numbers: &[u16]) -> Vec<u8> {
        let most = self.constants.most as u16;
        let at_end = |number: &u16| u8::from(*number == 0) * LOW + u8::from(*number >= most) * HIGH;
        let mut flags: Vec<u8> = numbers.iter().map(at_end).collect();
        for [x, y] in self.bad.iter().flatten() {
            flags[(y * width + x) as usize] |= BAD;
        }
        flags
    }

    /// How a reader gets the signal from digital numbers.
    fn scale_of_numbers(&self) -> Json {
        json!({
            "signal": "(value - offset) / scale",
            "unit": "W m-2 sr-1",
            "scale": self.constants.scale,
            "offset": self.constants.offset,
        })
    }

    fn fits(&self, image: &Image, step: u32, numbers: &[u16]) -> Vec<u8> {
        let constants = &self.constants;
        let cards = [
            ("BUNIT", Value::Text("adu".to_owned()), "digital numbers"),
            ("DNSCALE", Value::Real(constants.scale), "signal = (value - DNOFFSET) / DNSCALE"),
            ("DNOFFSET", Value::Real(constants.offset), "signal in W m-2 sr-1"),
            ("TRANSMIT", Value::Real(constants.transmitted), "share of the radiance in the signal"),
            ("LENS", Value::Real(constants.emitted), "signal of the lens [W m-2 sr-1]"),
            ("BANDLOW", Value::Real(self.scene.band.micrometres()[0]), "shortest wavelength [um]"),
            ("BANDHIGH", Value::Real(self.scene.band.micrometres()[1]), "longest wavelength [um]"),
            ("STEP", Value::Integer(step.into()), "step of the scene"),
            ("TIME", Value::Real(image.time), "time of the scene [s]"),
            ("OBJECT", Value::Text(self.scene.name.clone()), "scene"),
            ("ORIGIN", Value::Text(format!("isotherm {}", env!("CARGO_PKG_VERSION"))), ""),
        ];
        fits_16(image.size(), numbers, &cards)
    }

    /// All that a reader needs.
    fn description(&self, image: &Image, step: u32, files: &[String]) -> Json {
        let (sensor, constants, camera) = (self.sensor, &self.constants, self.camera);
        json!({
            "isotherm": "sensor",
            "version": 1,
            "scene": self.scene.name,
            "camera": self.scene.preset.map(|preset| json!({"name": preset.name, "source": preset.source})),
            "step": step,
            "time_s": image.time,
            "size_px": image.size(),
            "files": files,
            "band_um": self.scene.band.micrometres(),
            "seed": sensor.seed,
            "serial": sensor.detector.serial,
            "digital_numbers": {
                "bits": sensor.bits,
                "most": constants.most,
                "range_K": sensor.range,
                "signal": "(value - offset) / scale",
                "signal_unit": "W m-2 sr-1",
                "scale": constants.scale,
                "offset": constants.offset,
            },
            "optics": {
                "signal": "v (transmission radiance + lens) + (1 - v) housing, with the share v of vignetting",
                "transmission": constants.transmitted,
                "lens": constants.emitted,
                "housing": constants.housing,
                "lens_temperature_K": sensor.optics.lens,
                "housing_temperature_K": sensor.optics.housing,
            },
            "vignetting": match &sensor.vignetting {
                None => Json::Null,
                Some(Vignetting::Cos4) => json!({"cos4": {"focal_px": camera.lens.focal, "centre_px": camera.lens.centre,
                    "share": "1 / (1 + ((x + 0.5 - cx) / fx)^2 + ((y + 0.5 - cy) / fy)^2)^2"}}),
                Some(Vignetting::Map(map)) => json!({"map": map.chunks(image.camera.width as usize).collect::<Vec<_>>()}),
            },
            "kelvin": sensor.kelvin_per_count.map(|kelvin| json!({"temperature_K": "scale x value", "scale": kelvin, "offset": 0.0, "none": 0})),
            "noise": sensor.noise.map(|netd| json!({
                "netd_K": netd.kelvin,
                "temperature_K": netd.temperature,
                "netd_f_number": netd.stated_f_number,
                "f_number": netd.f_number,
                "netd_at_f_number_K": netd.at_f_number(),
                "signal": constants.noise,
            })),
            "pattern": sensor.pattern.map(|pattern| json!({
                "offset_K": pattern.offset,
                "offset_signal": constants.offset_pattern,
                "gain": pattern.gain,
                "gain_level_signal": constants.level,
                "drift_K_per_s": pattern.drift,
                "drift_signal_per_s": constants.drift,
                "shutter_interval_s": pattern.interval,
                "shutter_temperature_K": pattern.shutter,
                "since_shutter_s": sensor.exposure(image.time, None).age,
            })),
            "bad_pixels": {"share": sensor.detector.bad_pixels, "zero_px": self.bad[0], "most_px": self.bad[1]},
            "mask": flags(),
            "time_constant_s": sensor.time_constant,
            "point_spread": sensor.spread.as_ref().map(|spread| json!({
                "radius_px": spread.radius,
                "texels_per_px": FINENESS,
                "rows": spread.terms.iter().map(|term| &term.row).collect::<Vec<_>>(),
                "columns": spread.terms.iter().map(|term| &term.column).collect::<Vec<_>>(),
                "weight": "sum over terms of columns[term][y] rows[term][x], centred on the pixel",
            })),
            "stray": sensor.halo.map(|halo| json!({"share": halo.share, "radius_px": halo.radius})),
        })
    }
}
