//! The finer image from which a device makes that of a camera with distortion or with several samples of a pixel.
//!
//! Through a distorting lens it is a pinhole image of the rectangle that holds all rays, with at least two texels along each side of a pixel at every place.
//! Every lookup takes one texel, so a sample is off by at most a quarter of a pixel along each axis.

use glam::DVec2;
use rayon::prelude::*;

use crate::gpu::sampling::Sampling;
use crate::lens::Lens;
use crate::scene::Camera;

/// Numbers of samples of a texel that every device has, as a sum of powers of two.
pub const ALWAYS: u32 = 1 + 4;

/// Texels along each side of a pixel through a distorting lens, at least.
const FINER: u32 = 2;

/// How the image of a camera is made, with the numbers of samples of a texel that a device has. `None` where it is drawn directly.
pub fn sampling(camera: &Camera, counts: u32) -> Option<Sampling> {
    let size = [camera.width, camera.height];
    if camera.lens.is_pinhole() {
        if camera.samples == 1 {
            return None;
        }
        let (lookups, each) = split(camera.samples, camera.samples, counts);
        let scaled = |values: [f64; 2]| [0, 1].map(|axis| values[axis] * f64::from(lookups[axis]));
        return Some(Sampling {
            source: [0, 1].map(|axis| size[axis] * lookups[axis]),
            focal: scaled(camera.lens.focal),
            centre: scaled(camera.lens.centre),
            lookups,
            each,
            map: Vec::new(),
        });
    }
    let (lookups, each) = split(camera.samples, camera.samples / (FINER * FINER), counts);
    // A scene is refused where its lens has no field.
    let field = camera.lens.field(size).ok()?;
    let focal = lookups.map(|lookups| field.finest * f64::from(lookups.max(FINER)));
    // A border of one texel.
    let centre = [0, 1].map(|axis| 1.0 - field.low[axis] * focal[axis]);
    let source = [0, 1].map(|axis| ((field.high - field.low)[axis] * focal[axis]).ceil() as u32 + 2);
    let place = |ray: DVec2| [0, 1].map(|axis| (ray[axis] * focal[axis] + centre[axis]) as f32);
    let map = corners(&camera.lens, size).into_iter().map(place).collect();
    Some(Sampling { source, focal, centre, lookups, each, map })
}

/// Lookups along each side of a pixel, and samples of a texel: at most `most`, and a number that the device has.
fn split(samples: u32, most: u32, counts: u32) -> ([u32; 2], u32) {
    let each = [16, 8, 4, 2].into_iter().find(|each| *each <= most && counts & each != 0).unwrap_or(1);
    let lookups = match samples / each {
        0 | 1 => [1, 1],
        2 => [2, 1],
        4 => [2, 2],
        8 => [4, 2],
        _ => [4, 4],
    };
    (lookups, each)
}

/// Rays at the corners of the pixels, row after row.
fn corners(lens: &Lens, [width, height]: [u32; 2]) -> Vec<DVec2> {
    let row = |row: u32| {
        let mut near = None;
        let ray = |column: u32| {
            let pixel = DVec2::new(f64::from(column), f64::from(row));
            near = near.and_then(|ray| lens.unproject_from(ray, pixel)).or_else(|| lens.unproject(pixel));
            near.unwrap_or(DVec2::ZERO)
        };
        (0..=width).map(ray).collect::<Vec<_>>()
    };
    (0..=height).into_par_iter().flat_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn samples_of_a_texel_and_lookups_make_up_those_of_a_pixel() {
        for (samples, most, counts, expected) in [
            (4, 4, 1 + 4, ([1, 1], 4)),
            (8, 8, 1 + 4, ([2, 1], 4)),
            (16, 16, 1 + 4, ([2, 2], 4)),
            (16, 16, 1 + 2 + 4 + 8 + 16, ([1, 1], 16)),
            (16, 16, 1, ([4, 4], 1)),
            (8, 8, 1, ([4, 2], 1)),
            (1, 0, 1 + 4, ([1, 1], 1)),
            (4, 1, 1 + 4, ([2, 2], 1)),
            (8, 2, 1 + 4, ([4, 2], 1)),
            (16, 4, 1 + 4, ([2, 2], 4)),
        ] {
            let (lookups, each) = split(samples, most, counts);
            assert_eq!((lookups, each), expected, "{samples} samples, {most} at most, of {counts:b}");
            assert_eq!(lookups[0] * lookups[1] * each, samples);
        }
    }
}
