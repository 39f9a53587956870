//! What an image adds to the temperatures of its triangles, pixel by pixel, and the pixels that a triangle covers.

use glam::{DVec2, DVec3};

use super::triangle::bounds;
use super::view::{RasterView, places};

/// Changes of the temperature in the pixels of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelChanges {
    /// The width of the image [px]; then for each pixel, row after row, what is added to its temperature [K], and the index of the part + 1 for which that
    /// holds, or 0.
    pub(crate) values: Vec<[f32; 2]>,
}

impl PixelChanges {
    /// No change in any pixel of an image.
    pub(crate) fn none(width: u32, height: u32) -> Self {
        let mut values = vec![[0.0; 2]; 1 + width as usize * height as usize];
        values[0] = [width as f32, 0.0];
        Self { values }
    }

    /// What is added to the temperature of a part (index + 1) in a pixel [K].
    pub(crate) fn of(&self, pixel: usize, part: u32) -> f32 {
        let [kelvin, of_part] = self.values[1 + pixel];
        if of_part == part as f32 { kelvin } else { 0.0 }
    }

    /// Whether no pixel changes.
    pub(crate) fn is_empty(&self) -> bool {
        self.values[1..].iter().all(|[_, part]| *part == 0.0)
    }
}

/// Weight of a corner by which a sample beside the centre may lie outside a triangle that shows it: a device rounds corners to a share of a pixel.
const OUTSIDE: f64 = 1e-3;

/// A place in a pixel that a triangle covers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoveredPlace {
    /// Number of the pixel, row after row.
    pub(crate) pixel: usize,
    /// Number of the sample, in the order of [`places`].
    pub(crate) sample: usize,
    /// Weights of the corners there.
    pub(crate) weights: [f64; 3],
    /// Distance along the camera's axis [m].
    pub(crate) depth: f64,
}

/// Looks at the places of samples that a triangle (corners in camera axes) covers in the image of a lens without distortion, pixel after pixel, in each until `look`
/// returns `true`.
pub(crate) fn visit_covered(view: &RasterView, [a, b, c]: [DVec3; 3], mut look: impl FnMut(&CoveredPlace) -> bool) {
    let volume = a.dot((b - a).cross(c - a));
    let rays = bounds(view.near, [a, b, c]);
    if volume == 0.0 || rays.low.cmpgt(rays.high).any() {
        return;
    }
    let places = places(view.samples);
    let planes = [b.cross(c - b), c.cross(a - c), a.cross(b - a)].map(|plane| plane / volume);
    let corners = [rays.low, rays.high].map(|ray| view.lens.project(ray));
    let within = |axis: usize, size: u32| {
        let [low, high] = [0, 1].map(|end: usize| corners[end][axis].clamp(-1.0, f64::from(size) + 1.0));
        let aside = if places.len() > 1 { 0.0 } else { 0.5 };
        (low - 1.0 + aside).ceil().max(0.0) as u32..((high - aside).floor() + 1.0).clamp(0.0, f64::from(size)) as u32
    };
    for row in within(1, view.height) {
        for column in within(0, view.width) {
            let pixel = (row * view.width + column) as usize;
            for (sample, [x, y]) in places.iter().enumerate() {
                let at = DVec2::new(f64::from(column) + x, f64::from(row) + y);
                let Some(ray) = view.lens.unproject(at) else { continue };
                let weights = planes.map(|plane| plane.dot(ray.extend(1.0)));
                let depth = 1.0 / weights.iter().sum::<f64>();
                let least = if sample == 0 { 0.0 } else { -OUTSIDE / depth.abs() };
                let is_covered = weights.iter().all(|weight| *weight >= least) && depth >= view.near;
                if is_covered && look(&CoveredPlace { pixel, sample, weights: weights.map(|w| w * depth), depth }) {
                    break;
                }
            }
        }
    }
}
