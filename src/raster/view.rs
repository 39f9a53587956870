//! The camera of an image, and the rays that the samples of its pixels see.

use glam::{DAffine3, DVec2};

use crate::lens::{Distortion, Lens};

/// A camera with OpenCV axes: +X right, +Y down, +Z forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RasterView {
    /// Rigid motion that takes body positions into camera axes.
    pub(crate) camera_from_body: DAffine3,
    /// Width in pixels.
    pub(crate) width: u32,
    /// Height in pixels.
    pub(crate) height: u32,
    /// Which ray a place in the image sees.
    pub(crate) lens: Lens,
    /// Samples of a pixel: 1, 4, 8 or 16.
    pub(crate) samples: u32,
    /// Distance of the near plane [m], > 0.
    pub(crate) near: f64,
}

impl RasterView {
    /// The view of an image with so many texels along each side of a pixel, each with one sample.
    pub(crate) fn finer(&self, fineness: usize) -> Self {
        let by = fineness as f64;
        let [focal, centre] = [self.lens.focal, self.lens.centre].map(|pair| pair.map(|value| value * by));
        let lens = Lens { focal, centre, skew: self.lens.skew * by, ..self.lens };
        let [width, height] = [self.width, self.height].map(|side| side * fineness as u32);
        Self { width, height, lens, samples: 1, ..*self }
    }
}

/// The places of the samples in a pixel, from its upper left corner: the centre, and as many around it as a camera states, by their distance from it. Their
/// mean is the centre. A search lowered the largest error of the flux of an endless strip of 0.1 pixels, in the mean over 16 shifts by a sixteenth, over all its
/// places and all slopes p/q of whole pixels with p^2 + q^2 <= 130. There the samples of all pixels lie on lines that are 1 / sqrt(p^2 + q^2) pixels apart.
pub(crate) fn places(samples: u32) -> &'static [[f64; 2]] {
    const ONE: [[f64; 2]; 1] = [[0.5; 2]];
    const FOUR: [[f64; 2]; 5] = of_1024([[512, 512], [327, 804], [697, 208], [277, 150], [747, 886]]);
    const EIGHT: [[f64; 2]; 9] = of_1024([
        [512, 512],
        [295, 594],
        [729, 430],
        [632, 762],
        [392, 262],
        [455, 926],
        [569, 98],
        [30, 848],
        [994, 176],
    ]);
    const SIXTEEN: [[f64; 2]; 17] = of_1024([
        [512, 512],
        [597, 662],
        [427, 362],
        [344, 724],
        [680, 300],
        [805, 569],
        [219, 455],
        [462, 128],
        [562, 896],
        [291, 112],
        [733, 912],
        [768, 104],
        [256, 920],
        [9, 364],
        [1015, 660],
        [70, 860],
        [954, 164],
    ]);
    match samples {
        0..=1 => &ONE,
        2..=4 => &FOUR,
        5..=8 => &EIGHT,
        _ => &SIXTEEN,
    }
}

/// Places in parts of a 1024th of a pixel.
const fn of_1024<const COUNT: usize>(parts: [[u16; 2]; COUNT]) -> [[f64; 2]; COUNT] {
    let mut places = [[0.0; 2]; COUNT];
    let mut at = 0;
    while at < COUNT {
        places[at] = [parts[at][0] as f64 / 1024.0, parts[at][1] as f64 / 1024.0];
        at += 1;
    }
    places
}

/// Samples along the width and height of a pixel at which reflections of the craft are traced through a lens with distortion, like the pixels of a finer
/// image.
pub(super) fn grid(samples: u32) -> [u32; 2] {
    match samples {
        0..=1 => [1, 1],
        2..=4 => [2, 2],
        5..=8 => [4, 2],
        _ => [4, 4],
    }
}

/// The centres of the texels of a grid in a pixel.
pub(super) fn centres([across, down]: [u32; 2]) -> Vec<[f64; 2]> {
    let place = |number: u32| [(number % across, across), (number / across, down)];
    let share = |(at, count): (u32, u32)| (f64::from(at) + 0.5) / f64::from(count);
    (0..across * down).map(|number| place(number).map(share)).collect()
}

/// The rays of places in the pixels of a row, pixel after pixel. Where the lens has none, the ray is no number and meets nothing.
pub(super) fn rays_of_row(view: &RasterView, row: u32, places: &[[f64; 2]]) -> Vec<DVec2> {
    let mut near = None;
    let pixels = (0..view.width)
        .flat_map(|column| places.iter().map(move |[x, y]| DVec2::new(f64::from(column) + x, f64::from(row) + y)));
    let ray = |pixel| {
        near = match near {
            Some(ray) if view.lens.distortion != Distortion::None => view.lens.unproject_from(ray, pixel),
            _ => None,
        }
        .or_else(|| view.lens.unproject(pixel));
        near.unwrap_or(DVec2::NAN)
    };
    pixels.map(ray).collect()
}
