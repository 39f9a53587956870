//! Reflections of the craft in its own faces, by rays against its triangles. Twin: `glsl/traced.glsl`.
//!
//! The analytic reflection of the surroundings stays, and a ray that meets the craft puts the light of the craft in the place of the sky behind it.
//! So a face that sees nothing of the craft has no noise. A ray takes the direction of a smooth mirror, or one drawn from the lobe of a rough mirror,
//! or one drawn with the cosine.

use glam::{DAffine3, DVec3};

use crate::environment::shadow::{LARGEST_TREE, Occluders};
use crate::exchange::directions::{basis, cosine_direction};
use crate::thermal::lobe::{LEAST_VIEW, facet_reflection, masking};
use crate::thermal::sensor::noise::pcg4d;
use crate::thermal::surroundings::{
    BandReflector, Looks, Surroundings, dimmed, emissivity, kept_share, reflected_radiance, sky_radiance,
};

/// Reflections that are followed. Surfaces beyond the last one count as black.
pub(crate) const REFLECTIONS: u32 = 2;
/// Most boxes of the tree of the craft on a device, whose invocations walk it once for each reflection.
pub(crate) const LARGEST_REFLECTED: usize = LARGEST_TREE / REFLECTIONS as usize;
/// Most draws of a direction of a rough mirror. The mirror direction stands in where all are refused.
const LOBE_DRAWS: u32 = 6;

/// Triangles of the craft as placed by its joints, and the rays against them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TracedTriangles<'a> {
    /// The triangles, body frame.
    pub(crate) occluders: &'a Occluders,
    /// Nodes of the corners of each triangle in the order of the tree, and its material.
    pub(crate) corners: &'a [[u32; 4]],
    /// Word of the time, so that each image has rays of its own.
    pub(crate) word: u32,
}

#[derive(Clone, Copy)]
pub(crate) struct ReflectedCraft<'a> {
    pub(crate) traced: &'a TracedTriangles<'a>,
    /// In the axes of the camera.
    pub(crate) surroundings: &'a Surroundings,
    pub(crate) reflectors: &'a [[BandReflector; 2]],
    pub(crate) looks: &'a Looks<'a>,
    /// Temperatures of the nodes [K].
    pub(crate) temperatures: &'a [f64],
    /// Radiance of a blackbody at a temperature [K].
    pub(crate) radiance: &'a dyn Fn(f64) -> f64,
}

/// The surface that a sample shows, in the axes of the camera.
pub(crate) struct TracedSample<'a> {
    pub(crate) reflector: &'a BandReflector,
    /// Unit normal.
    pub(crate) normal: DVec3,
    /// Unit vector to the camera.
    pub(crate) to_camera: DVec3,
    /// Place [m].
    pub(crate) place: DVec3,
    /// Place in the image, or in the finer one of several samples [1/16 texel].
    pub(crate) pixel: [u32; 2],
}

/// Four numbers in (0, 1) of a draw for a place in the image.
fn numbers(pixel: [u32; 2], draw: u32, word: u32) -> [f64; 4] {
    pcg4d([pixel[0], pixel[1], draw, word]).map(|word| (f64::from(word >> 8) + 0.5) / f64::from(1 << 24))
}

/// A direction from which a face reflects light to `seen`, and whether the face acted as a smooth mirror.
fn reflected_from(
    (reflector, looks): (&BandReflector, &Looks),
    (normal, seen): (DVec3, DVec3),
    draw: impl Fn(u32) -> [f64; 4],
) -> (DVec3, bool) {
    let [kind, u, v, _] = draw(0);
    if kind >= reflector.specular {
        return (cosine_direction(normal, [u, v]), false);
    }
    let view = normal.dot(seen).max(0.0);
    let mirror = 2.0 * view * normal - seen;
    let Some(lobe) = reflector.lobe.and_then(|lobe| looks.lobes.get(lobe)) else { return (mirror, true) };
    let along = seen - normal.dot(seen) * normal;
    let x = if along.length() > 1e-4 { along.normalize() } else { basis(normal)[0] };
    let y = normal.cross(x);
    let drawn = (0..LOBE_DRAWS).map(&draw).find_map(|[_, u, v, accepts]| {
        let light = facet_reflection(lobe.roughness, view.max(LEAST_VIEW), [u, v]);
        let share = if light.z > 0.0 { masking(light.z, lobe.roughness) } else { 0.0 };
        (accepts < share).then_some(light.x * x + light.y * y + light.z * normal)
    });
    (drawn.unwrap_or(mirror), false)
}

/// Radiance of the craft in a reflection, less the radiance of the surroundings that it hides [W m-2 sr-1].
pub(crate) fn traced_radiance(craft: &ReflectedCraft, camera_from_body: &DAffine3, sample: &TracedSample) -> f64 {
    let ReflectedCraft { traced, surroundings, looks, .. } = *craft;
    let occluders = traced.occluders;
    let body_from_camera = camera_from_body.inverse();
    let start = body_from_camera.transform_point3(sample.place + occluders.start * (sample.normal + sample.to_camera));
    let mut sum = 0.0;
    let (mut reflector, mut normal, mut to_viewer) = (sample.reflector, sample.normal, sample.to_camera);
    let (mut from, mut weight) = (start, 1.0);
    for reflection in 0..REFLECTIONS {
        let draw = |draw| numbers(sample.pixel, 8 * reflection + draw, traced.word);
        let (direction, smooth) = reflected_from((reflector, looks), (normal, to_viewer), draw);
        let direction_in_body = body_from_camera.matrix3 * direction;
        let Some(hit) = occluders.first(from, direction_in_body) else { break };
        let [a, b, c, material] = traced.corners[hit.triangle];
        let [a, b, c] = [a, b, c].map(|node| craft.temperatures[node as usize]);
        let temperature = (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c;
        let cosine = normal.dot(to_viewer).max(0.0);
        let mut open = dimmed(surroundings, reflector, looks, cosine);
        if !smooth {
            // No ray of a rough surface stands for sunlight, so the Sun counts as space here.
            open.sun_radiance = open.space_radiance;
        }
        let kept = weight * kept_share(reflector, looks, temperature, cosine);
        sum -= weight * sky_radiance(&open, looks, direction);
        let [corner, first, second] = occluders.triangles[hit.triangle];
        let outward = first.cross(second).normalize_or_zero();
        let met = if hit.outside { outward } else { -outward };
        reflector = &craft.reflectors[material as usize][usize::from(!hit.outside)];
        normal = camera_from_body.matrix3 * met;
        to_viewer = -direction;
        let mut light = (craft.radiance)(temperature);
        if reflection + 1 < REFLECTIONS {
            light = emissivity(reflector, looks, temperature, normal.dot(to_viewer).max(0.0)) * light
                + reflected_radiance(surroundings, reflector, looks, normal, to_viewer);
        }
        sum += kept * light;
        weight = kept;
        from = corner + hit.u * first + hit.v * second + occluders.start * (met - direction_in_body);
    }
    sum
}
