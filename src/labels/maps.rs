//! Images of labels: depth, parts, temperatures and masks as PNG, and the digital numbers.

use glam::DVec2;

use super::craft::Craft;
use super::image::LabelledImage;
use crate::output::OutputError;
use crate::output::gray::{png_8, png_16};

/// The finest step of a map of temperatures [K].
pub(crate) const TEMPERATURE_STEP: f64 = 0.01;
/// The finest step of a map of depths [mm].
pub(crate) const DEPTH_STEP: f64 = 0.1;

/// A map of 16 bits and the step of its values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Map {
    pub(crate) png: Vec<u8>,
    /// The quantity that a value of 1 stands for, in its unit.
    pub(crate) step: f64,
}

/// The first of `finest` times 1, 2, 5, 10, 20, 50 and so on of which 65535 reach a value.
pub(crate) fn step_for(greatest: f64, finest: f64) -> f64 {
    let tens = (0..300).map(|power| 10_f64.powi(power));
    let mut steps = tens.flat_map(|ten| [1.0, 2.0, 5.0].map(|digit| digit * ten * finest));
    steps.find(|step| (greatest / step).round() <= f64::from(u16::MAX)).unwrap_or(f64::INFINITY)
}

/// Values at the finest step that holds all of them. A pixel of the craft is at least 1, every other pixel is 0.
fn map(
    image: &LabelledImage,
    what: &str,
    values: impl Iterator<Item = f64> + Clone,
    finest: f64,
) -> Result<Map, OutputError> {
    let greatest = values.clone().fold(0.0, f64::max);
    if !greatest.is_finite() {
        return Err(OutputError::NotFinite {
            what: format!("sample {}: the {what}", image.identity.sample),
            value: greatest,
        });
    }
    let step = step_for(greatest, finest);
    let count = |(value, part): (f64, &u32)| if *part == 0 { 0 } else { (value / step).round().max(1.0) as u16 };
    let counts: Vec<u16> = values.zip(&image.channels.part).map(count).collect();
    Ok(Map { png: png_16([image.width, image.height], &counts, &[])?, step })
}

/// Distances along the camera's +Z, with a step in millimetres from [`DEPTH_STEP`] on: the `depth_scale` of BOP.
///
/// # Errors
/// A depth that is not finite, or an image that PNG can not hold.
pub(crate) fn depth(image: &LabelledImage) -> Result<Map, OutputError> {
    map(image, "depth", image.channels.depth.iter().map(|depth| 1e3 * f64::from(*depth)), DEPTH_STEP)
}

/// Surface temperatures, with a step in kelvin from [`TEMPERATURE_STEP`] on.
///
/// # Errors
/// As [`depth`].
pub(crate) fn temperature(image: &LabelledImage) -> Result<Map, OutputError> {
    map(image, "temperature", image.channels.temperature.iter().map(|kelvin| f64::from(*kelvin)), TEMPERATURE_STEP)
}

/// Index of the part + 1.
///
/// # Errors
/// More parts than 16 bits can count.
pub(crate) fn part(image: &LabelledImage) -> Result<Vec<u8>, OutputError> {
    let short = |part: &u32| {
        u16::try_from(*part).map_err(|_| {
            OutputError::Encode("map of parts".to_owned(), format!("part {part} does not fit into 16 bits"))
        })
    };
    let parts: Vec<u16> = image.channels.part.iter().map(short).collect::<Result<_, _>>()?;
    png_16([image.width, image.height], &parts, &[])
}

/// Pixels that have the planet behind their centre. `None` with a rolling shutter: its rows see the planet from different poses.
pub(crate) fn planet(image: &LabelledImage) -> Option<Vec<bool>> {
    let least = image.planet_radius.cos();
    let shows = |at: usize| {
        let [column, row] = [at % image.width as usize, at / image.width as usize].map(|place| place as f64 + 0.5);
        let ray = image.lens.unproject(DVec2::new(column, row));
        image.channels.part[at] == 0 && ray.is_some_and(|ray| ray.extend(1.0).normalize().dot(image.planet) > least)
    };
    (image.line_time == 0.0).then(|| (0..image.pixels()).map(shows).collect())
}

/// Number of the target in each pixel, from 1.
///
/// # Errors
/// An image that PNG can not hold.
pub(crate) fn instance(craft: &Craft, image: &LabelledImage) -> Result<Vec<u8>, OutputError> {
    let number = |part: &u32| craft.target_of_pixel(*part).map_or(0, |target| target as u8 + 1);
    let bytes: Vec<u8> = image.channels.part.iter().map(number).collect();
    png_8([image.width, image.height], &bytes, &[])
}

/// 255 where a mask is set.
///
/// # Errors
/// An image that PNG can not hold.
pub(crate) fn mask(image: &LabelledImage, mask: &[bool]) -> Result<Vec<u8>, OutputError> {
    let bytes: Vec<u8> = mask.iter().map(|set| if *set { 255 } else { 0 }).collect();
    png_8([image.width, image.height], &bytes, &[])
}

/// The digital numbers as they are, with 8 bits or with 16. `None` without a sensor.
///
/// # Errors
/// A digital number that its bits can not hold.
pub(crate) fn digital_numbers(image: &LabelledImage) -> Result<Option<Vec<u8>>, OutputError> {
    let numbers = image.channels.digital_numbers.as_deref();
    numbers.map(|numbers| numbers_of(image, numbers, image.identity.bits)).transpose()
}

/// The digital numbers of a sensor of these bits.
///
/// # Errors
/// A digital number that its bits can not hold.
pub(crate) fn numbers_of(image: &LabelledImage, numbers: &[u16], bits: u32) -> Result<Vec<u8>, OutputError> {
    let size = [image.width, image.height];
    if let Some(high) = numbers.iter().find(|number| u32::from(**number) >> bits.min(16) != 0) {
        let reason = format!("digital number {high} of sample {} has more than {bits} bits", image.identity.sample);
        return Err(OutputError::Encode("PNG image".to_owned(), reason));
    }
    match bits {
        8 => png_8(size, &numbers.iter().map(|number| *number as u8).collect::<Vec<_>>(), &[]),
        _ => png_16(size, numbers, &[]),
    }
}

/// The upper 8 bits of the digital numbers, for loaders that cut 16 bits to 8. `None` without a sensor.
///
/// # Errors
/// An image that PNG can not hold.
pub(crate) fn upper_bits(image: &LabelledImage) -> Result<Option<Vec<u8>>, OutputError> {
    let Some(numbers) = &image.channels.digital_numbers else { return Ok(None) };
    let bytes: Vec<u8> =
        numbers.iter().map(|number| (number >> (image.identity.bits.clamp(8, 16) - 8)) as u8).collect();
    Ok(Some(png_8([image.width, image.height], &bytes, &[])?))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::image::tests::small;
    use super::*;

    /// The numbers of a grey PNG.
    fn numbers(bytes: &[u8]) -> Vec<u16> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(info.color_type, png::ColorType::Grayscale);
        match info.bit_depth {
            png::BitDepth::Eight => pixels.into_iter().map(u16::from).collect(),
            _ => pixels.chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect(),
        }
    }

    #[test]
    fn maps_hold_their_values_at_their_steps() {
        let mut image = small();
        let depth = super::depth(&image).expect("a map");
        assert_eq!((depth.step, numbers(&depth.png)), (0.1, vec![0, 0, 30000, 0, 0, 20000, 20000, 0, 0, 0, 0, 0]));
        let temperature = super::temperature(&image).expect("a map");
        assert_eq!(temperature.step, 0.01);
        assert_eq!(numbers(&temperature.png)[..7], [0, 0, 30000, 0, 0, 28000, 28000]);
        assert_eq!(numbers(&part(&image).expect("a map"))[..7], [0, 0, 2, 0, 0, 1, 1]);
        let seen: Vec<bool> = image.channels.part.iter().map(|part| *part != 0).collect();
        assert_eq!(numbers(&mask(&image, &seen).expect("a mask"))[..7], [0, 0, 255, 0, 0, 255, 255]);
        // A kilometre needs another step, and what is seen is never 0.
        image.channels.depth[2] = 1000.0;
        image.channels.depth[5] = 0.001;
        let far = super::depth(&image).expect("a map");
        assert_eq!((far.step, numbers(&far.png)[2], numbers(&far.png)[5]), (20.0, 50000, 1));
        image.channels.depth[2] = f32::INFINITY;
        let error = super::depth(&image).unwrap_err().to_string();
        assert!(error.starts_with("sample 7: the depth is inf"), "{error}");
    }

    /// A disc of known size in the upper left corner, behind the craft.
    #[test]
    fn the_planet_is_masked_where_no_surface_is() {
        let mut image = small();
        // The lens has focal lengths of 10 and 20 px and its centre at (2, 1.5). The ray of pixel (0, 0) is (-0.15, -0.05).
        image.planet = DVec3::new(-0.15, -0.05, 1.0).normalize();
        image.planet_radius = 0.08;
        let mask = planet(&image).expect("a global shutter");
        // By hand, in rays: (0, 0) at distance 0, (0, 1) 0.05, (1, 0) 0.1, (1, 1) 0.112.
        let set: Vec<usize> = (0..12).filter(|at| mask[*at]).collect();
        assert_eq!(set, [0, 4]);
        image.planet_radius = 0.105;
        assert_eq!(planet(&image).expect("a mask").iter().filter(|set| **set).count(), 4);
        image.channels.part[0] = 1;
        assert!(!planet(&image).expect("a mask")[0], "a surface hides the planet");
        image.line_time = 1e-5;
        assert_eq!(planet(&image), None);
    }

    #[test]
    fn digital_numbers_are_kept_as_they_are() {
        let mut image = small();
        let bytes = digital_numbers(&image).expect("a PNG").expect("a sensor");
        assert_eq!(numbers(&bytes), [5; 12]);
        image.channels.digital_numbers = Some(vec![256; 12]);
        image.identity.bits = 8;
        let error = digital_numbers(&image).unwrap_err().to_string();
        assert!(error.contains("digital number 256 of sample 7 has more than 8 bits"), "{error}");
        image.channels.digital_numbers = None;
        assert_eq!(digital_numbers(&image).expect("nothing"), None);
    }

    #[test]
    fn a_step_is_the_finest_that_reaches_the_greatest_value() {
        assert_eq!(step_for(655.35, 0.01), 0.01);
        assert_eq!(step_for(655.36, 0.01), 0.02);
        assert_eq!(step_for(1400.0, 0.01), 0.05);
        assert_eq!(step_for(0.0, 0.1), 0.1);
        assert_eq!(step_for(6553.5 * 60.0, 0.1), 10.0);
    }
}
