//! A craft that spans few pixels: a crop of the image around it is drawn with many texels in a pixel, and each pixel takes their mean.
//!
//! So the craft keeps its radiant intensity, the sum of radiance times solid angle, however small it is.

use glam::{DAffine3, DVec2, DVec3};

use super::surface::Pixel;
use super::view::RasterView;
use crate::lens::Distortion;

/// Pixels along either axis that such a craft spans less than: a craft of so many is within 1 % with one sample of a pixel too, also where a part of it is as
/// thin as a hundredth of it. In a smaller image it is a share of its lesser side, or the least.
const MOST_SPAN: f64 = 192.0;
const LEAST_SPAN: f64 = 16.0;
/// This share with one sample of a pixel, which 2 x 2 texels or more replace, and with several samples, which 4 x 4 or more replace.
const SHARES: [f64; 2] = [0.375, 0.25];
/// Most texels of a crop along either axis, where all may lie in one pixel. An invocation has no more turns than the square of it.
const TEXELS: f64 = 256.0;
/// Most texels along either axis of a crop with [`PIXEL_TEXELS`] along the side of a pixel.
const MOST_TEXELS: f64 = 512.0;
const PIXEL_TEXELS: f64 = 8.0;
/// Places in a pixel along each axis at which its sky is seen, with several samples.
pub(crate) const SKY_LOOKUPS: u32 = 4;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crop {
    /// Upper left corner [px].
    pub(crate) corner: DVec2,
    /// Texels along the side of a pixel.
    pub(crate) scale: f64,
    /// Width and height [texels].
    pub(crate) size: [u32; 2],
}

impl Crop {
    /// The crop around boxes that hold the craft, each with its motion into the body frame. `most` is the most texels along each axis. `None` for a craft that is
    /// near, and through a distorting lens.
    pub(crate) fn around(view: &RasterView, boxes: &[(DAffine3, [DVec3; 2])], most: [u32; 2]) -> Option<Self> {
        if view.lens.distortion != Distortion::None || view.lens.skew != 0.0 {
            return None;
        }
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (motion, ends) in boxes {
            for corner in 0..8usize {
                let at = |axis: usize| ends[corner >> axis & 1][axis];
                let point = view.camera_from_body * *motion;
                let point = point.transform_point3(DVec3::new(at(0), at(1), at(2)));
                if point.z < view.near {
                    return None;
                }
                let pixel = DVec2::from(view.lens.focal) * point.truncate() / point.z + DVec2::from(view.lens.centre);
                (low, high) = (low.min(pixel), high.max(pixel));
            }
        }
        let span = high - low;
        let most = most.map(f64::from);
        let share = SHARES[usize::from(view.samples > 1)];
        let distant = (share * most[0].min(most[1])).clamp(LEAST_SPAN, MOST_SPAN);
        if !span.is_finite() || span.max_element() >= distant {
            return None;
        }
        let texels = (PIXEL_TEXELS * span.max_element()).clamp(TEXELS, MOST_TEXELS);
        let most = most.map(|most| most.min(texels));
        // A border of a hundredth, so that rounding leaves nothing outside.
        let border = 0.01 * span.max_element().max(1e-9);
        let (low, span) = (low - border, span + 2.0 * border);
        let scale = (most[0] / span.x).min(most[1] / span.y);
        let size = [0, 1].map(|axis| ((span[axis] * scale).ceil() as u32).clamp(1, most[axis] as u32));
        Some(Self { corner: low, scale, size })
    }

    pub(crate) fn view(&self, view: &RasterView) -> RasterView {
        let mut lens = view.lens;
        lens.focal = lens.focal.map(|focal| focal * self.scale);
        lens.centre = [0, 1].map(|axis| (lens.centre[axis] - self.corner[axis]) * self.scale);
        RasterView { lens, width: self.size[0], height: self.size[1], samples: 1, ..*view }
    }

    /// The same crop for an image with so many texels along each side of a pixel.
    pub(crate) fn finer(&self, fineness: usize) -> Self {
        let fineness = fineness as f64;
        Self { corner: self.corner * fineness, scale: self.scale / fineness, ..*self }
    }

    /// Texels that a row or column of pixels overlaps, each with the share of its side in it.
    fn overlaps(&self, pixel: usize, axis: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let size = f64::from(self.size[axis]);
        let [low, high] = [0.0, 1.0].map(|end| (pixel as f64 + end - self.corner[axis]) * self.scale);
        let [low, high] = [low, high].map(|end| end.clamp(0.0, size));
        let share = move |texel: usize| (high.min(texel as f64 + 1.0) - low.max(texel as f64)).max(0.0);
        (low as usize..high.ceil() as usize).map(move |texel| (texel, share(texel)))
    }
}

/// Puts the texels of a crop into the pixels of an image of the sky, `width` pixels wide.
pub(crate) fn gather(sky: &mut [Pixel], width: usize, crop: &Crop, texels: &[Pixel]) {
    let share = 1.0 / (crop.scale * crop.scale);
    for (row, pixels) in sky.chunks_mut(width.max(1)).enumerate() {
        let down = crop.overlaps(row, 1);
        if down.clone().next().is_none() {
            continue;
        }
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let across = crop.overlaps(column, 0);
            let centre = (DVec2::new(column as f64 + 0.5, row as f64 + 0.5) - crop.corner) * crop.scale;
            let (mut sum, mut nearest) = ([0.0; 3], f64::INFINITY);
            let mut shown = None;
            for ((y, high), (x, wide)) in down.clone().flat_map(|y| across.clone().map(move |x| (y, x))) {
                let weight = high * wide;
                let texel = &texels[y * crop.size[0] as usize + x];
                if texel.part == 0 {
                    continue;
                }
                sum = [sum[0] + weight * texel.radiance, sum[1] + weight * texel.reflected, sum[2] + weight];
                let distance = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - centre).length_squared();
                if distance < nearest {
                    (nearest, shown) = (distance, Some(texel));
                }
            }
            let Some(shown) = shown else { continue };
            let coverage = (share * sum[2]).min(1.0);
            *pixel = Pixel {
                radiance: share * sum[0] + (1.0 - coverage) * pixel.radiance,
                reflected: share * sum[1],
                coverage,
                ..*shown
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::Lens;

    #[test]
    fn a_crop_holds_the_craft_and_ends_where_it_is_near() {
        let lens = Lens::pinhole([100.0, 90.0], [40.2, 30.3]);
        let view = RasterView {
            camera_from_body: DAffine3::IDENTITY,
            width: 80,
            height: 60,
            lens,
            samples: 4,
            near: 0.1,
            first_row: 0,
        };
        let at = |z: f64| [(DAffine3::IDENTITY, [DVec3::new(-1.0, 2.0, z - 1.0), DVec3::new(1.0, 3.0, z + 1.0)])];
        let crop = Crop::around(&view, &at(100.0), [80, 60]).expect("2 pixels");
        for corner in [DVec3::new(-1.0, 2.0, 99.0), DVec3::new(1.0, 3.0, 101.0)] {
            let seen = crop.view(&view).lens;
            let place = DVec2::from(seen.focal) * corner.truncate() / corner.z + DVec2::from(seen.centre);
            let size = DVec2::new(f64::from(crop.size[0]), f64::from(crop.size[1]));
            assert!(place.cmpgt(DVec2::ZERO).all() && place.cmplt(size).all(), "{place} in {size}");
        }
        assert!(crop.size[0] <= 80 && crop.size[1] <= 60 && crop.scale > 20.0, "{crop:?}");
        // 2 pixels have as many texels as fit an invocation, and 100 pixels have 5 along the side of each.
        let of = |z: f64| {
            Crop::around(&RasterView { lens: Lens::pinhole([1000.0; 2], [40.0; 2]), ..view }, &at(z), [4096; 2])
        };
        let texels = [1000.0, 22.0].map(|z| of(z).map(|crop| crop.size[0].max(crop.size[1])));
        assert_eq!(texels, [Some(256), Some(512)]);
        assert_eq!(Crop::around(&view, &at(12.0), [80, 60]), None, "18 pixels");
        assert!(Crop::around(&view, &at(12.0), [80, 80]).is_some(), "below a quarter of the image");
        let single = RasterView { samples: 1, ..view };
        assert!(Crop::around(&single, &at(12.0), [80, 60]).is_some(), "below three eighths of the image");
        assert_eq!(Crop::around(&view, &at(0.5), [80, 60]), None, "behind the camera");
        let mut shares = vec![0.0; crop.size[0] as usize];
        (0..80).flat_map(|pixel| crop.overlaps(pixel, 0)).for_each(|(texel, share)| shares[texel] += share);
        assert!(shares.iter().all(|share: &f64| (share - 1.0).abs() < 1e-9), "each texel once: {shares:?}");
    }
}
