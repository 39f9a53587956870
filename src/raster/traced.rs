//! Reflections of the craft in its own faces, by paths of rays against its triangles. Twin: `glsl/traced.glsl`.
//!
//! The analytic reflection of the surroundings stays, and a ray that meets the craft puts the light of the craft in the place of the sky behind it.
//! So a face that sees nothing of the craft has no noise. A face that sees nothing but the craft counts as surrounded by its own temperature instead.
//! A ray takes the direction of a smooth mirror, or one drawn from the lobe of a rough mirror, or one drawn with the cosine. A path ends on a surface
//! that counts with its emission and what it reflects of its surroundings.

use glam::{DAffine3, DVec3};

use crate::environment::shadow::{Hit, LARGEST_TREE, Occluders};
use crate::exchange::directions::{basis, cosine_direction};
use crate::scene::{Bounces, MOST_BOUNCES};
use crate::thermal::lobe::{LEAST_VIEW, facet_reflection, masking};
use crate::thermal::sensor::noise::pcg4d;
use crate::thermal::surroundings::{
    BandReflector, Looks, Surroundings, dimmed, kept_share, reflected_radiance, reflected_sunlight, sky_radiance,
};

/// Most boxes of the tree of the craft on a device. An invocation walks the tree up to twice, and its loops end with [`LARGEST_TREE`] turns.
pub(crate) const LARGEST_REFLECTED: usize = LARGEST_TREE / 2;
/// Rays of a path after which chance ends it.
const ROULETTE: u32 = 32;
/// Share of the light below which a path ends.
const FAINT: f64 = 0.01;

/// Draws of a direction of a rough mirror.
const LOBE_DRAWS: u32 = 6;
/// Draws that belong to a surface of a path. The last one is for the Sun and for chance.
const DRAWS: u32 = 8;
/// Heights over the plane of a triangle at which a ray may start, in distances between its start and its own surface.
const OWN_LIFTS: f64 = 2.5;

/// When a path of light ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PathEnd {
    /// Rays at most. Without any, rays only look for the Sun.
    pub(crate) bounces: u32,
    /// Rays after which chance ends it.
    pub(crate) roulette: u32,
    /// Share of the light below which it ends.
    pub(crate) least: f64,
}

impl PathEnd {
    /// No path: only what hides the Sun is looked for.
    pub(crate) const AT_ONCE: Self = Self { bounces: 0, roulette: u32::MAX, least: 0.0 };

    /// The ends of paths on surfaces that reflect at most this share of their light.
    pub(crate) fn new(bounces: Bounces, reflectivity: f64) -> Self {
        match bounces {
            Bounces::UntilFaint => {
                let faint = (FAINT.ln() / reflectivity.clamp(0.0, 1.0).ln()).ceil();
                let bounces = if faint >= 1.0 { faint.min(f64::from(MOST_BOUNCES)) as u32 } else { 1 };
                let bounces = if reflectivity < 1.0 { bounces } else { MOST_BOUNCES };
                Self { bounces, roulette: ROULETTE, least: FAINT }
            }
            Bounces::All => Self { bounces: MOST_BOUNCES, roulette: ROULETTE, least: 0.0 },
            Bounces::Most(bounces) => Self { bounces, roulette: u32::MAX, least: 0.0 },
        }
    }
}

/// Triangles of the craft as placed by its joints, and the rays against them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TracedTriangles<'a> {
    /// The triangles, body frame.
    pub(crate) occluders: &'a Occluders,
    /// Nodes of the corners of each triangle.
    pub(crate) corners: &'a [[u32; 3]],
    /// Materials and sides of the nodes.
    pub(crate) nodes: &'a [TracedNode],
    /// Word of the time, so that each image has rays of its own.
    pub(crate) word: u32,
    pub(crate) end: PathEnd,
}

/// Material of a node, and whether its front and its back see nothing but the craft.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TracedNode {
    pub(crate) material: u32,
    pub(crate) enclosed: [bool; 2],
    /// Whether the material is the skin of a body, whose back nobody sees.
    pub(crate) is_skin: bool,
}

/// Cosine of the angle at which a skin is seen edge-on: 84 deg. A device rounds corners, so there it may show the back of a facet at the rim of a body.
const EDGE_ON: f64 = 0.1;

impl TracedNode {
    /// One word for the device: the material times 8; plus 1 where the front is enclosed; plus 2 where the back is; plus 4 for a skin.
    pub(crate) fn word(self) -> u32 {
        8 * self.material + u32::from(self.enclosed[0]) + 2 * u32::from(self.enclosed[1]) + 4 * u32::from(self.is_skin)
    }

    /// The face of which a sample is, and its normal: the front of a skin whose back shows at its rim.
    fn shown(self, sample: &TracedSample) -> (usize, DVec3) {
        let at_rim = self.is_skin && sample.face == 1 && sample.normal.dot(sample.to_camera) < EDGE_ON;
        if at_rim { (0, -sample.normal) } else { (sample.face, sample.normal) }
    }
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
pub(crate) struct TracedSample {
    /// Node of the first corner of its triangle.
    pub(crate) node: u32,
    /// 0 for the front, 1 for the back.
    pub(crate) face: usize,
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

/// A direction from which a face reflects light.
struct Drawn {
    direction: DVec3,
    /// 0 where facets hide every direction that was drawn.
    weight: f64,
    /// Whether the face acted as a smooth mirror.
    mirror: bool,
}

/// A direction from which a face reflects light to `seen`.
fn reflected_from(
    (reflector, looks): (&BandReflector, &Looks),
    (normal, seen): (DVec3, DVec3),
    draw: impl Fn(u32) -> [f64; 4],
) -> Drawn {
    let [kind, u, v, _] = draw(0);
    if kind >= reflector.specular {
        return Drawn { direction: cosine_direction(normal, [u, v]), weight: 1.0, mirror: false };
    }
    let view = normal.dot(seen).max(0.0);
    let Some(lobe) = reflector.lobe.and_then(|lobe| looks.lobes.get(lobe)) else {
        return Drawn { direction: 2.0 * view * normal - seen, weight: 1.0, mirror: true };
    };
    let along = seen - normal.dot(seen) * normal;
    let x = if along.length() > 1e-4 { along.normalize() } else { -basis(normal)[0] };
    let y = normal.cross(x);
    let steep = view.max(LEAST_VIEW);
    // The first draw that no facet hides. Where all are hidden no light comes, and the others weigh more.
    let light = (0..LOBE_DRAWS).map(&draw).find_map(|[_, u, v, accepts]| {
        let light = facet_reflection(lobe.roughness, steep, [u, v]);
        let share = if light.z > 0.0 { masking(light.z, lobe.roughness) } else { 0.0 };
        (accepts < share).then_some(light.x * x + light.y * y + light.z * normal)
    });
    let weight = 1.0 / (1.0 - (1.0 - lobe.sum(steep)).powi(LOBE_DRAWS as i32));
    Drawn { direction: light.unwrap_or(normal), weight: light.map_or(0.0, |_| weight), mirror: false }
}

/// A point of the Sun's disc for two numbers in (0, 1).
fn sun_point(around: &Surroundings, [u, v]: [f64; 2]) -> DVec3 {
    let [x, y] = basis(around.sun);
    let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
    (around.sun + around.sun_disc.sin * u.sqrt() * (cosine * x + sine * y)).normalize()
}

/// A surface on the way of the light, in the axes of the camera.
struct Vertex<'a> {
    reflector: &'a BandReflector,
    enclosed: bool,
    normal: DVec3,
    seen: DVec3,
    /// Start of its rays, body frame.
    from: DVec3,
    temperature: f64,
    /// Distance between the start of its rays and the surface, where that is the one in the image. 0 for others [m].
    lift: f64,
}

impl ReflectedCraft<'_> {
    fn vertex(&self, node: u32, face: usize) -> (&BandReflector, bool) {
        let TracedNode { material, enclosed, .. } = self.traced.nodes[node as usize];
        (&self.reflectors[material as usize][face], enclosed[face])
    }

    /// Share of the light of a surface at a temperature [K] that a vertex reflects.
    fn kept(&self, vertex: &Vertex, temperature: f64) -> f64 {
        kept_share(vertex.reflector, self.looks, temperature, vertex.normal.dot(vertex.seen).max(0.0))
    }

    /// Light that a vertex reflects where everything has its own temperature.
    fn cavity_light(&self, vertex: &Vertex) -> f64 {
        self.kept(vertex, vertex.temperature) * (self.radiance)(vertex.temperature)
    }

    /// Light of the surroundings that a vertex reflects.
    fn of_surroundings(&self, vertex: &Vertex) -> f64 {
        reflected_radiance(self.surroundings, vertex.reflector, self.looks, vertex.normal, vertex.seen)
    }

    /// The first triangle that a ray of a vertex meets, if that is another surface. Interpolated normals lean beyond the plane of a triangle.
    fn first(&self, vertex: &Vertex, body_from_camera: &DAffine3, direction: DVec3) -> Option<Hit> {
        let occluders = self.traced.occluders;
        let is_another = |hit: &Hit| {
            let [corner, first, second] = occluders.triangles[hit.triangle];
            let normal = first.cross(second).normalize_or_zero();
            // Across an edge lies another surface.
            let alike = (body_from_camera.matrix3 * vertex.normal).dot(normal).abs();
            (vertex.from - corner).dot(normal).abs() >= OWN_LIFTS * vertex.lift || alike <= 0.5
        };
        occluders.first(vertex.from, body_from_camera.matrix3 * direction).filter(is_another)
    }

    /// Sunlight that the surroundings of a vertex hold and the craft hides, or that an enclosed vertex has beyond its surroundings.
    fn change_of_sunlight(&self, vertex: &Vertex, body_from_camera: &DAffine3, at: [f64; 2]) -> f64 {
        let sunlight = reflected_sunlight(self.surroundings, vertex.reflector, self.looks, vertex.normal, vertex.seen);
        if sunlight <= 0.0 {
            return 0.0;
        }
        let hidden = self.first(vertex, body_from_camera, sun_point(self.surroundings, at)).is_some();
        (f64::from(u8::from(vertex.enclosed)) - f64::from(u8::from(hidden))) * sunlight
    }
}

/// Radiance of the craft in a reflection, less the radiance of the surroundings that it hides [W m-2 sr-1].
pub(crate) fn traced_radiance(craft: &ReflectedCraft, camera_from_body: &DAffine3, sample: &TracedSample) -> f64 {
    let ReflectedCraft { traced, surroundings, looks, .. } = *craft;
    let occluders = traced.occluders;
    let body_from_camera = camera_from_body.inverse();
    let (face, normal) = traced.nodes[sample.node as usize].shown(sample);
    let start = body_from_camera.transform_point3(sample.place + occluders.start * (normal + sample.to_camera));
    let (reflector, enclosed) = craft.vertex(sample.node, face);
    let mut here = Vertex {
        reflector,
        enclosed,
        normal,
        seen: sample.to_camera,
        from: start,
        temperature: craft.temperatures[sample.node as usize],
        lift: occluders.start,
    };
    let mut sum = if enclosed { craft.cavity_light(&here) - craft.of_surroundings(&here) } else { 0.0 };
    let mut weight = 1.0;
    let mut last = traced.end.bounces == 0;
    for number in 0..=traced.end.bounces {
        let draw = |draw| numbers(sample.pixel, DRAWS * number + draw, traced.word);
        let [u, v, chance, _] = draw(DRAWS - 1);
        sum += weight * craft.change_of_sunlight(&here, &body_from_camera, [u, v]);
        // Chance lets a path go on with the probability of its weight.
        let by_chance = number >= traced.end.roulette;
        if last || by_chance && chance >= weight {
            break;
        }
        let drawn = reflected_from((here.reflector, looks), (here.normal, here.seen), draw);
        weight = drawn.weight * if by_chance { weight.max(1.0) } else { weight };
        let direction = body_from_camera.matrix3 * drawn.direction;
        let cosine = here.normal.dot(here.seen).max(0.0);
        let mut open = dimmed(surroundings, here.reflector, looks, cosine);
        if !drawn.mirror {
            // Sunlight on a rough surface has a ray of its own.
            open.sun_radiance = open.space_radiance;
        }
        let sky = sky_radiance(&open, looks, drawn.direction);
        let counted = if here.enclosed { craft.cavity_light(&here) } else { sky };
        if weight <= 0.0 {
            break;
        }
        let Some(hit) = craft.first(&here, &body_from_camera, drawn.direction) else {
            sum += weight * (sky - counted);
            break;
        };
        let nodes = traced.corners[hit.triangle];
        let [a, b, c] = nodes.map(|node| craft.temperatures[node as usize]);
        let temperature = (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c;
        let [corner, first, second] = occluders.triangles[hit.triangle];
        let outward = first.cross(second).normalize_or_zero();
        let met = if hit.outside { outward } else { -outward };
        let (reflector, enclosed) = craft.vertex(nodes[0], usize::from(!hit.outside));
        let kept = craft.kept(&here, temperature);
        let there = Vertex {
            reflector,
            enclosed,
            normal: camera_from_body.matrix3 * met,
            seen: -drawn.direction,
            from: corner + hit.u * first + hit.v * second + occluders.start * (met - direction),
            temperature,
            lift: 0.0,
        };
        let black = (craft.radiance)(temperature);
        let light = if enclosed {
            black
        } else {
            (1.0 - craft.kept(&there, temperature)) * black + craft.of_surroundings(&there)
        };
        sum += weight * (kept * light - counted);
        weight *= kept;
        last = number + 1 >= traced.end.bounces || weight < traced.end.least;
        here = there;
    }
    sum
}
