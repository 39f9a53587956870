//! What an image adds to the temperatures of its triangles, pixel by pixel, and the pixels that a triangle covers.

use glam::{DVec2, DVec3};

use super::triangle::bounds;
use super::view::RasterView;

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

/// A pixel whose centre a triangle covers.
pub(crate) struct CoveredPixel {
    /// Its number, row after row.
    pub(crate) pixel: usize,
    /// Weights of the corners there.
    pub(crate) weights: [f64; 3],
    /// Distance along the camera's axis [m].
    pub(crate) depth: f64,
}

/// The pixels whose centres a triangle (corners in camera axes) covers in the image of a lens without distortion.
pub(crate) fn covered(view: &RasterView, [a, b, c]: [DVec3; 3]) -> Vec<CoveredPixel> {
    let volume = a.dot((b - a).cross(c - a));
    let rays = bounds(view.near, [a, b, c]);
    if volume == 0.0 || rays.low.cmpgt(rays.high).any() {
        return Vec::new();
    }
    let planes = [b.cross(c - b), c.cross(a - c), a.cross(b - a)].map(|plane| plane / volume);
    let corners = [rays.low, rays.high].map(|ray| view.lens.project(ray));
    let within = |axis: usize, size: u32| {
        let [low, high] = [0, 1].map(|end: usize| corners[end][axis].clamp(-1.0, f64::from(size) + 1.0));
        (low - 0.5).ceil().max(0.0) as u32..((high - 0.5).floor() + 1.0).clamp(0.0, f64::from(size)) as u32
    };
    let mut pixels = Vec::new();
    for row in within(1, view.height) {
        for column in within(0, view.width) {
            let centre = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
            let Some(ray) = view.lens.unproject(centre) else { continue };
            let weights = planes.map(|plane| plane.dot(ray.extend(1.0)));
            let depth = 1.0 / weights.iter().sum::<f64>();
            if weights.iter().all(|weight| *weight >= 0.0) && depth >= view.near {
                let pixel = (row * view.width + column) as usize;
                pixels.push(CoveredPixel { pixel, weights: weights.map(|weight| weight * depth), depth });
            }
        }
    }
    pixels
}
