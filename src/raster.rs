//! Rasteriser in f64: the reference of the graphics pass for every pixel of a radiance image.
//!
//! For the ray d = (x, y, 1) of a pixel in camera axes it solves w_a a + w_b b + w_c c = d (Olano & Greer 1997, homogeneous rasterisation). The ray meets
//! the triangle where all weights are positive. The camera depth is z = 1 / (w_a + w_b + w_c), and the barycentric coordinates are z w. This interpolates
//! in perspective without dividing by the depth of a vertex. A triangle may therefore cross the camera's plane, and the near plane is a test of z alone.
//! Every sample of a pixel has its own ray, through the distortion of the lens.

pub(crate) mod changes;
pub(crate) mod distant;
mod light;
mod surface;
#[cfg(test)]
mod tests;
pub(crate) mod traced;
mod triangle;
mod view;

use glam::DVec2;
use rayon::prelude::*;

use changes::PixelChanges;
use light::SampleLight;
pub use surface::Pixel;
pub use surface::RasterSurface;
pub(crate) use surface::{EMPTY, SurfaceSurroundings};
use triangle::{Projected, RayBounds, draw, project};
pub(crate) use view::{RasterView, places};
use view::{centres, grid, rays_of_row};

use crate::stop::Watch;

/// The centre of a pixel.
const CENTRE: [f64; 2] = [0.5, 0.5];
/// Pixels of a row that are tried together.
const BLOCK: usize = 16;

/// Draws both faces of a surface with a depth test, rows from the top. `radiance` gives the blackbody radiance in the band [W m-2 sr-1] at a temperature
/// [K].
pub fn rasterise(surface: &RasterSurface, view: &RasterView, radiance: impl Fn(f64) -> f64 + Sync) -> Vec<Pixel> {
    rasterise_changed(surface, view, None, radiance)
}

/// The same with changes of the temperature in pixels.
pub(crate) fn rasterise_changed(
    surface: &RasterSurface,
    view: &RasterView,
    changes: Option<&PixelChanges>,
    radiance: impl Fn(f64) -> f64 + Sync,
) -> Vec<Pixel> {
    let traced = surface.around.as_ref().and_then(|around| around.traced);
    let gathered = view.lens.is_pinhole();
    let pattern = if traced.is_some() && !gathered {
        SamplePattern::centres_of(grid(view.samples))
    } else {
        SamplePattern { places: places(view.samples).to_vec(), texels: [1; 2], gathered }
    };
    draw_pixels(surface, (view, changes), (pattern, &mut []), radiance)
}

/// Where the samples of a pixel lie.
struct SamplePattern {
    places: Vec<[f64; 2]>,
    /// Texels along the width and height of a pixel, by which the rays of reflections are drawn.
    texels: [u32; 2],
    /// Whether a pixel whose centre shows nothing shows the surface of the first sample that has one.
    gathered: bool,
}

impl SamplePattern {
    /// The centres of the texels of a grid in a pixel.
    fn centres_of(texels: [u32; 2]) -> Self {
        Self { places: centres(texels), texels, gathered: false }
    }
}

/// The same from the texels of a finer image with `fineness` texels along each side of a pixel, and the radiance of these texels, row after row.
pub(crate) fn rasterise_finely(
    surface: &RasterSurface,
    view: &RasterView,
    fineness: usize,
    radiance: impl Fn(f64) -> f64 + Sync,
) -> (Vec<Pixel>, Vec<f64>) {
    let mut texels = vec![0.0; view.width as usize * view.height as usize * fineness * fineness];
    let pattern = SamplePattern::centres_of([fineness as u32; 2]);
    let pixels = draw_pixels(surface, (view, None), (pattern, &mut texels), radiance);
    (pixels, texels)
}

/// Draws with samples at these places of a pixel, and writes the radiance of each sample where it is wanted. The samples are then texels of a square grid.
fn draw_pixels(
    surface: &RasterSurface,
    (view, changes): (&RasterView, Option<&PixelChanges>),
    (pattern, texels): (SamplePattern, &mut [f64]),
    radiance: impl Fn(f64) -> f64 + Sync,
) -> Vec<Pixel> {
    let projected: Vec<Projected> =
        surface.triangles.par_iter().filter_map(|&triangle| project(surface, view, triangle)).collect();
    let mut pixels = vec![EMPTY; view.width as usize * view.height as usize];
    let SamplePattern { mut places, texels: of_pixel, gathered } = pattern;
    let counted = places.len();
    // Identity and temperature are taken at the centre.
    let central = places.iter().position(|place| *place == CENTRE).unwrap_or(counted);
    places.extend((central == counted).then_some(CENTRE));
    let each = places.len();
    let watch = Watch::begin();
    let (width, fineness) = (view.width.max(1) as usize, counted.isqrt());
    let mut unwanted = vec![0.0; view.height as usize];
    let (texels, of_row) = if texels.is_empty() { (&mut unwanted[..], 1) } else { (texels, width * counted) };
    let rows = pixels.par_chunks_mut(width).zip(texels.par_chunks_mut(of_row));
    rows.enumerate().for_each(|(row, (pixels, texels))| {
        if watch.is_over() {
            return;
        }
        let rays = rays_of_row(view, row as u32, &places);
        let around = |rays: &[DVec2]| rays.iter().fold(RayBounds::NONE, |bounds, ray| bounds.with(*ray));
        let blocks: Vec<RayBounds> = rays.chunks(BLOCK * each).map(around).collect();
        let whole = blocks.iter().fold(RayBounds::NONE, |all, block| all.with(block.low).with(block.high));
        let mut samples = vec![EMPTY; rays.len()];
        let mut shown = vec![None; rays.len()];
        for triangle in projected.iter().filter(|triangle| triangle.rays.meets(&whole)) {
            let drawn = samples.chunks_mut(BLOCK * each).zip(shown.chunks_mut(BLOCK * each));
            let drawn = rays.chunks(BLOCK * each).zip(drawn).zip(&blocks);
            for ((rays, (samples, shown)), _) in drawn.filter(|(_, block)| triangle.rays.meets(block)) {
                draw(triangle, view.near, rays, samples, shown);
            }
        }
        let light = SampleLight { surface, view, texels: of_pixel, radiance: &radiance };
        let drawn = samples.chunks_mut(each).zip(shown.chunks(each)).zip(rays.chunks(each));
        for (column, (pixel, ((samples, shown), rays))) in pixels.iter_mut().zip(drawn).enumerate() {
            let pixel_number = row * width + column;
            for sample in samples.iter_mut().filter(|sample| sample.part > 0) {
                sample.temperature += changes.map_or(0.0, |all| f64::from(all.of(pixel_number, sample.part)));
            }
            for (((sample, shown), ray), place) in samples[..counted].iter_mut().zip(shown).zip(rays).zip(&places) {
                light.shine(
                    sample,
                    *shown,
                    *ray,
                    [column as f64 + place[0], f64::from(view.first_row) + row as f64 + place[1]],
                );
            }
            if of_row > 1 {
                for (number, sample) in samples[..counted].iter().enumerate() {
                    texels[(number / fineness * width + column) * fineness + number % fineness] = sample.radiance;
                }
            }
            let mean = |value: fn(&Pixel) -> f64| samples[..counted].iter().map(value).sum::<f64>() / counted as f64;
            let first = samples[..counted].iter().find(|sample| gathered && sample.part > 0);
            *pixel = Pixel {
                radiance: mean(|sample| sample.radiance),
                reflected: mean(|sample| sample.reflected),
                coverage: mean(|sample| sample.coverage),
                ..*first.unwrap_or(&samples[central])
            };
        }
    });
    watch.look();
    pixels
}
