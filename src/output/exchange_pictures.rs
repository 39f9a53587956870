//! Pictures of the view of patches: a fish-eye view from one patch, and the open sky of every surface.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::OutputError;
use super::canvas::{Canvas, Rgb};
use super::colour::ColourScale;
use crate::exchange::cast::{INSIDE, SPACE, Scenery, end_of};
use crate::exchange::directions::basis;
use crate::exchange::step::Exchange;
use crate::simulation::exchange::ExchangeCraft;

/// Width and height [px].
const SIZE: u32 = 720;
/// Space.
const BLACK: Rgb = [0, 0, 0];
const BESIDE: Rgb = [40, 40, 40];
/// The inner face of a skin.
const WRONG: Rgb = [255, 0, 255];

/// The view of a patch over its hemisphere from its middle: the distance from the middle of the picture is the angle from the normal. Each part has a
/// colour; space is black.
///
/// # Errors
/// No PNG can be written.
pub(crate) fn fish_eye(craft: &ExchangeCraft, poses: &[DAffine3], patch: usize) -> Result<Vec<u8>, OutputError> {
    let scenery = Scenery::new(&craft.surface, poses);
    let shown = &craft.patches.all[patch];
    let pose = poses.get(shown.joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
    let normal = pose.matrix3 * shown.normal;
    let from = pose.transform_point3(shown.centre) + 10.0 * scenery.occluders.start * normal;
    let [right, up] = basis(normal);
    let pixel = |x: f64, y: f64| {
        let angle = x.hypot(y) * FRAC_PI_2;
        if angle >= FRAC_PI_2 {
            return BESIDE;
        }
        let across = (x * right + y * up).normalize_or_zero();
        let direction = angle.cos() * normal + angle.sin() * across;
        match end_of(&craft.surface, &craft.patches, &scenery.occluders, [from, direction]) {
            SPACE => BLACK,
            INSIDE => WRONG,
            seen => colour_of(craft.patches.all[seen as usize].part),
        }
    };
    draw(pixel)
}

/// The view factor to space and planet of every surface, as seen from the side with the direction (1, -1, -1): black is 0, the brightest colour is 1.
///
/// # Errors
/// No PNG can be written.
pub(crate) fn open_sky(craft: &ExchangeCraft, poses: &[DAffine3], exchange: &Exchange) -> Result<Vec<u8>, OutputError> {
    let scenery = Scenery::new(&craft.surface, poses);
    let scale = ColourScale::new([0.0, 1.0]);
    let towards = DVec3::new(1.0, -1.0, -1.0).normalize();
    let right = DVec3::Z.cross(towards).normalize();
    let up = towards.cross(right);
    let [low, high] = scenery.occluders.bounds;
    let (middle, reach) = (0.5 * (low + high), 0.5 * (high - low).length());
    let pixel = |x: f64, y: f64| {
        let from = middle + reach * (x * right + y * up + 2.0 * towards);
        match end_of(&craft.surface, &craft.patches, &scenery.occluders, [from, -towards]) {
            SPACE => BESIDE,
            INSIDE => WRONG,
            seen => scale.colour(exchange.factors.to_space(seen as usize) as f32),
        }
    };
    draw(pixel)
}

/// Draws a square of pixels from their places, each between -1 and 1.
fn draw(pixel: impl Fn(f64, f64) -> Rgb + Sync) -> Result<Vec<u8>, OutputError> {
    let place = |number: u32| (f64::from(number) + 0.5) / f64::from(SIZE) * 2.0 - 1.0;
    let pixels = (0..SIZE * SIZE).into_par_iter().map(|number| pixel(place(number % SIZE), -place(number / SIZE)));
    Canvas::from_pixels(SIZE, SIZE, pixels.collect()).png()
}

/// A colour for a part. Neighbouring numbers have hues far apart.
fn colour_of(part: u32) -> Rgb {
    let hue = 6.0 * (f64::from(part) * 0.618_034).fract();
    let level = |shift: f64| ((hue + shift).rem_euclid(6.0) - 3.0).abs().clamp(1.0, 2.0) - 1.0;
    [0.0, 4.0, 2.0].map(|shift| (70.0 + 180.0 * level(shift)) as u8)
}
