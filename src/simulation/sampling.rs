//! How a device makes the image of a camera with distortion, with several samples of a pixel, or with a rolling shutter.
//!
//! Through a distorting lens it draws a pinhole image of the rectangle that holds all rays, with at least two texels along each side of a pixel at every
//! place. A pixel shows the texel at its centre, which is off by at most a quarter of a pixel along each axis. Where that needs more texels than every device
//! binds, one texel along each side of a pixel must do, and it is off by at most a half. The mean over several samples is made from a
//! second draw, of the radiance alone. Without distortion the samples of a pixel are draws of the image, each moved by a part of a pixel.

use glam::DVec2;
use rayon::prelude::*;

use crate::gpu::effects::image::sampling::{Mean, RowOf, Sampling};
use crate::gpu::layout;
use crate::lens::{Distortion, Lens};
use crate::scene::Camera;
use crate::thermal::sensor::spread::FINENESS;

/// Numbers of samples of a texel that nearly every device has, as a sum of powers of two.
pub(crate) const ALWAYS: u32 = 1 + 4;

/// Texels along each side of a pixel through a distorting lens, at least.
const FINER: u32 = 2;

/// Most texels with more than one along each side of a pixel: as many as every device binds at once (Vulkan: `maxStorageBufferRange` of 128 MiB), at
/// 16 bytes each.
const MOST_TEXELS: f64 = (1 << 23) as f64;

/// How the image of a camera is made, with the numbers of samples of a texel that a device has. `distant` tells whether the craft may be far away, and `fine`
/// whether a point spread reads the texels in the pixels. `None` where the image is simply drawn.
pub fn sampling(camera: &Camera, counts: u32, distant: bool, fine: bool) -> Option<Sampling> {
    let (samples, counts) = if fine { ((FINENESS * FINENESS) as u32, 1) } else { (camera.samples, counts) };
    let size = [camera.width, camera.height];
    let (shutter, exposed) = (shutter(camera), camera.exposure.is_mean());
    if camera.lens.is_pinhole() {
        let lookups = [FINENESS as u32; 2];
        let mean = fine.then(|| Mean { size: [0, 1].map(|axis| size[axis] * lookups[axis]), lookups, each: 1 });
        let gathered = if fine { 1 } else { samples };
        let Lens { focal, centre, .. } = camera.lens;
        let map = Vec::new();
        let sampling = Sampling { drawn: size, focal, centre, map, mean, gathered, shutter, distant, fine, exposed };
        return (fine || gathered > 1 || shutter.is_some() || distant || exposed).then_some(sampling);
    }
    let (lookups, each) = split(samples, samples / (FINER * FINER), counts);
    // A scene is refused where its lens has no field.
    let field = camera.lens.field(size).ok()?;
    let finest = lookups.map(|lookups| field.finest * f64::from(lookups.max(FINER)));
    // A border of one texel.
    let side = |focal: [f64; 2], axis: usize| ((field.high - field.low)[axis] * focal[axis]).ceil() as u32 + 2;
    let fits = f64::from(side(finest, 0)) * f64::from(side(finest, 1)) <= MOST_TEXELS;
    let focal = if fits { finest } else { [field.finest; 2] };
    let centre = [0, 1].map(|axis| 1.0 - field.low[axis] * focal[axis]);
    let drawn = [side(focal, 0), side(focal, 1)];
    let place = |ray: DVec2| [0, 1].map(|axis| (ray[axis] * focal[axis] + centre[axis]) as f32);
    let map = corners(&camera.lens, size).into_iter().map(place).collect();
    let mean = (samples > 1).then_some(Mean { size: drawn, lookups, each });
    Some(Sampling { drawn, focal, centre, map, mean, gathered: 1, shutter, distant: false, fine, exposed })
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

/// The rows of a rolling shutter, without poses. `None` if all rows see one pose.
fn shutter(camera: &Camera) -> Option<(RowOf, layout::Shutter)> {
    if camera.line_time == 0.0 || camera.height == 1 {
        return None;
    }
    let float = |numbers: [f64; 4]| numbers.map(|number| number as f32);
    let lens = &camera.lens;
    let (row_of, numbers) = match lens.distortion {
        Distortion::None => (RowOf::Pinhole, [[0.0; 4]; 3]),
        Distortion::BrownConrady([k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4]) => {
            (RowOf::Brown, [[k1, k2, p1, p2], [k3, k4, k5, k6], [s1, s2, s3, s4]])
        }
        Distortion::Fisheye(numbers) => (RowOf::Fisheye, [numbers, [0.0; 4], [0.0; 4]]),
    };
    // Without distortion a point far outside the frame still has a row.
    let field = match lens.distortion {
        Distortion::None => [-1e9, -1e9, 1e9, 1e9],
        _ => {
            let field = lens.field([camera.width, camera.height]).ok()?;
            [field.low.x, field.low.y, field.high.x, field.high.y]
        }
    };
    let [first_numbers, second_numbers, third_numbers] = numbers.map(float);
    // From the centre of the first row to the centre of the last.
    let rows = f64::from(camera.height - 1);
    let shutter = layout::Shutter {
        field: float(field),
        first_numbers,
        second_numbers,
        third_numbers,
        row_scale: (lens.focal[1] / rows) as f32,
        row_offset: ((lens.centre[1] - 0.5) / rows) as f32,
        ..layout::Shutter::default()
    };
    Some((row_of, shutter))
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
