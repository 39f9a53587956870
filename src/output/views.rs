//! Images of one scene under three responses at one step, in numbers.

use super::OutputError;
use super::frame::check_channels;
use super::ticks::union;

/// The camera's view at one step under each response.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Views {
    pub(crate) step: u32,
    /// The time in words.
    pub(crate) caption: String,
    /// Width in pixels.
    pub(crate) width: u32,
    /// Height in pixels.
    pub(crate) height: u32,
    /// Surface temperatures [K] under each response. The last response is the reference.
    pub(crate) temperatures: [Vec<f32>; 3],
    /// Index of the part + 1 at each pixel, 0 without a surface.
    pub(crate) part: Vec<u32>,
}

impl Views {
    /// Whether a surface is at a pixel.
    pub(super) fn hit(&self, pixel: usize) -> bool {
        self.part[pixel] != 0
    }

    /// A response minus the reference [K], at each pixel with a surface.
    pub(super) fn differences(&self, response: usize) -> impl Iterator<Item = f32> + '_ {
        let pixels = (0..self.part.len()).filter(|pixel| self.hit(*pixel));
        pixels.map(move |pixel| self.temperatures[response][pixel] - self.temperatures[2][pixel])
    }

    /// Root mean square of the differences of a response [K]. `None` if no surface is in view.
    pub(crate) fn rms(&self, response: usize) -> Option<f64> {
        let (count, squares) = self
            .differences(response)
            .fold((0u64, 0.0), |(count, sum), d| (count + 1, sum + f64::from(d) * f64::from(d)));
        (count > 0).then(|| (squares / count as f64).sqrt())
    }

    /// Refuses channels of a wrong length.
    pub(super) fn check(&self) -> Result<(), OutputError> {
        let [a, b, c] = self.temperatures.each_ref().map(|temperatures| ("T", temperatures.len()));
        check_channels([self.width, self.height], &[a, b, c, ("part", self.part.len())])
    }
}

/// The part of the images with surfaces and a small margin: left, top, width and height [px].
pub(super) fn crop(views: &[Views]) -> [u32; 4] {
    let Some(first) = views.first() else { return [0, 0, 1, 1] };
    let mut ends: Option<[u32; 4]> = None;
    for view in views {
        for pixel in (0..view.part.len()).filter(|pixel| view.hit(*pixel)) {
            let (x, y) = (pixel as u32 % view.width, pixel as u32 / view.width);
            let [left, top, right, bottom] = ends.unwrap_or([x, y, x, y]);
            ends = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
    }
    let Some([left, top, right, bottom]) = ends else { return [0, 0, first.width, first.height] };
    let room = (right - left).max(bottom - top) / 40 + 1;
    let (left, top) = (left.saturating_sub(room), top.saturating_sub(room));
    let (right, bottom) = ((right + 1 + room).min(first.width), (bottom + 1 + room).min(first.height));
    [left, top, right - left, bottom - top]
}

/// Smallest and largest temperature in view [K].
pub(super) fn temperature_range(view: &Views) -> Option<[f32; 2]> {
    let pixels = (0..view.part.len()).filter(|pixel| view.hit(*pixel));
    let all = pixels.flat_map(|pixel| [0, 1, 2].map(|response| view.temperatures[response][pixel]));
    all.filter(|t| t.is_finite()).map(|t| [t, t]).reduce(union)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::output::frame::tests::sphere;

    /// A sphere, once warmer and once colder than the reference [K].
    pub(in super::super) fn views(offset: f32) -> Views {
        let frame = sphere(80, 60, 0);
        let shifted = |by: f32| frame.temperature.iter().map(|t| t + by).collect::<Vec<f32>>();
        Views {
            step: 3,
            caption: "step 3".into(),
            width: 80,
            height: 60,
            temperatures: [shifted(offset), shifted(-2.0), shifted(0.0)],
            part: frame.part,
        }
    }
}
