//! False colour: maps values to colours that a reader can map back.

use super::canvas::{Canvas, Rgb};
use super::ticks::{round_range, union};
use crate::simulation::image::Image;

/// Colour of pixels without a surface: a bluish grey outside the colour map.
pub(crate) const BACKGROUND: Rgb = [58, 64, 72];

/// Colour of NaN: a magenta outside every map, so that nobody overlooks it.
pub(crate) const NOT_A_NUMBER: Rgb = [255, 0, 255];

/// A colour map over a range of values. Lightness rises from the lower to the upper end, so the order of temperatures
/// shows in print and to the colour-blind. The map is inferno (van der Walt and Smith, 2015).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    /// Value of the darkest colour.
    pub(crate) lower: f64,
    /// Value of the lightest colour, above `lower`.
    pub(crate) upper: f64,
}

impl ColourScale {
    pub(crate) fn new([lower, upper]: [f64; 2]) -> Self {
        Self { lower, upper }
    }

    /// A scale with round ends that covers these temperature ranges [K]. One scale for a whole run makes its pictures
    /// comparable. Without ranges it is 0 to 1.
    pub fn covering(ranges: impl IntoIterator<Item = [f32; 2]>) -> Self {
        let all = ranges.into_iter().reduce(union);
        Self::new(all.map_or([0.0, 1.0], |[lower, upper]| round_range(f64::from(lower), f64::from(upper))))
    }

    /// A scale with round ends that fits one image: all but the coldest and the hottest two hundredth of its temperatures [K].
    pub(crate) fn fitting(frame: &Image) -> Self {
        let shown = frame.temperature.iter().zip(&frame.part).filter(|(value, part)| **part != 0 && value.is_finite());
        let mut values: Vec<f32> = shown.map(|(value, _)| *value).collect();
        values.sort_unstable_by(f32::total_cmp);
        let beyond = values.len() / 200;
        let ends = values.get(beyond).zip(values.get((values.len().max(1) - 1).saturating_sub(beyond)));
        Self::covering(ends.map(|(lower, upper)| [*lower, *upper]))
    }

    /// Colour of a value. Values beyond an end have the colour of that end, which pictures mark
    /// ([`ColourScale::exceeded_by`]).
    pub(crate) fn colour(&self, value: f32) -> Rgb {
        if value.is_nan() {
            return NOT_A_NUMBER;
        }
        let share = ((f64::from(value) - self.lower) / (self.upper - self.lower)).clamp(0.0, 1.0);
        let colour = colorous::INFERNO.eval_continuous(share);
        [colour.r, colour.g, colour.b]
    }

    /// Whether the frame has values below the lower end, and above the upper end.
    pub(crate) fn exceeded_by(&self, frame: &Image) -> [bool; 2] {
        frame.range().map_or([false; 2], |[least, greatest]| {
            // The ends are f64 and the values f32. A value equal to an end must not exceed it.
            [least < self.lower as f32, greatest > self.upper as f32]
        })
    }

    pub(crate) fn image(&self, frame: &Image) -> Canvas {
        let values = frame.temperature.iter().zip(&frame.part);
        let colours = values.map(|(&value, &part)| if part == 0 { BACKGROUND } else { self.colour(value) });
        Canvas::from_pixels(frame.camera.width, frame.camera.height, colours.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::frame::tests::sphere;

    /// Relative luminance (WCAG 2.1 definition).
    fn luminance(colour: Rgb) -> f64 {
        let linear = colour.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn the_map_is_inferno() {
        let scale = ColourScale::new([200.0, 400.0]);
        // matplotlib 3.8 `inferno`, entries 0, 128 and 255 of 256: (0,0,4), (188,55,84) to 1 level, (252,255,164).
        assert_eq!(scale.colour(200.0), [0, 0, 4]);
        assert_eq!(scale.colour(400.0), [252, 255, 164]);
        let middle = scale.colour(300.0);
        assert!(middle.iter().zip([188, 55, 84]).all(|(a, b)| a.abs_diff(b) <= 2), "{middle:?}");
        assert!(!scale.colour(310.0).iter().zip([188, 55, 84]).all(|(a, b)| a.abs_diff(b) <= 2));
    }

    #[test]
    fn hotter_is_never_darker() {
        let scale = ColourScale::new([0.0, 255.0]);
        let light: Vec<f64> = (0..=255).map(|i| luminance(scale.colour(i as f32))).collect();
        assert!(light.windows(2).all(|pair| pair[1] > pair[0] - 2e-3));
        assert!(light[255] > light[0] + 0.8);
    }

    #[test]
    fn background_and_not_a_number_are_no_colours_of_the_map() {
        let scale = ColourScale::new([0.0, 1000.0]);
        assert_eq!(scale.colour(f32::NAN), NOT_A_NUMBER);
        for i in 0..=1000 {
            let colour = scale.colour(i as f32);
            for special in [BACKGROUND, NOT_A_NUMBER] {
                let distance: u32 = colour.iter().zip(special).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
                assert!(distance > 35, "{i}: {colour:?} is close to {special:?}");
            }
        }
    }

    #[test]
    fn values_beyond_the_scale_are_told() {
        let frame = sphere(32, 32, 0);
        let [least, greatest] = frame.range().unwrap().map(f64::from);
        let exceeded = |range| ColourScale::new(range).exceeded_by(&frame);
        assert_eq!(exceeded([least, greatest]), [false, false]);
        assert_eq!(exceeded([least + 1.0, greatest]), [true, false]);
        assert_eq!(exceeded([least, greatest - 1.0]), [false, true]);
        let scale = ColourScale::new([200.0, 300.0]);
        assert_eq!(scale.colour(100.0), scale.colour(200.0));
        assert_eq!(scale.colour(f32::INFINITY), scale.colour(300.0));
    }

    /// A cold craft with one hot pixel: the colours fit the craft, and the scale tells that a value lies beyond.
    #[test]
    fn a_scale_fits_its_image() {
        let mut frame = sphere(64, 64, 0);
        let shown: Vec<usize> = (0..frame.part.len()).filter(|pixel| frame.part[*pixel] != 0).collect();
        for (number, pixel) in shown.iter().enumerate() {
            frame.temperature[*pixel] = 180.0 + 10.0 * number as f32 / shown.len() as f32;
        }
        frame.temperature[shown[0]] = 390.0;
        let scale = ColourScale::fitting(&frame);
        assert!(scale.lower >= 179.0 && scale.upper <= 191.0, "{scale:?}");
        assert_eq!(scale.exceeded_by(&frame), [false, true]);
        assert!(ColourScale::covering(frame.range()).upper > 350.0, "a scale that covers it is nearly all dark");
        frame.part.fill(0);
        assert_eq!(ColourScale::fitting(&frame), ColourScale::covering([]));
    }

    #[test]
    fn one_scale_holds_all_frames_of_a_run() {
        let frames = [sphere(32, 32, 0), sphere(32, 32, 60)];
        let scale = ColourScale::covering(frames.iter().filter_map(Image::range));
        assert!(frames.iter().all(|frame| scale.exceeded_by(frame) == [false, false]));
        let mut empty = sphere(8, 8, 0);
        empty.part.fill(0);
        assert_eq!(ColourScale::covering(empty.range()).upper, 1.0);
        assert_eq!(ColourScale::new([200.0, 400.0]).image(&empty), Canvas::new(8, 8, BACKGROUND));
    }
}
