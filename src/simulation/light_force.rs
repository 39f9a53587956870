//! Force and torque of the light that a craft takes, reflects and emits: photon pressure.
//!
//! Light of the flux E from the direction d brings the force -E A d / c. A face reflects what it does not absorb as a Lambertian surface, and emits as one: a flux M
//! leaves with the recoil -(2/3) M A n / c, which is the mean of the cosine over the hemisphere (docs/telemetry.md). Emission is counted above the emission of a black
//! body at the background's temperature, whose light presses on a closed surface from all sides alike.
//!
//! No face sees the light of another: light between parts of one craft moves the craft only where it leaves in another direction.

use std::iter::Sum;
use std::ops::Add;

use glam::DVec3;
use rayon::prelude::*;

use super::budget::{lit_nodes, load_before};
use super::engine::{Engine, EngineError, SurfaceState};
use super::parts::Passing;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::planet_light::{PlanetGlow, PlanetLight};
use crate::model::nodes::GROUP;
use crate::thermal::balance::Incident;
use crate::thermal::material::{Material, Optics, Sides};
use crate::thermal::network::radiated;
use crate::thermal::planck::LIGHT_SPEED;

/// Mean cosine of the light that leaves a Lambertian surface.
const LAMBERTIAN: f64 = 2.0 / 3.0;

/// Force [N] and torque [N m] in the body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LightPush {
    pub(crate) force: DVec3,
    pub(crate) torque: DVec3,
}

impl LightPush {
    /// A force at a lever from the point of reference [m].
    fn at(lever: DVec3, force: DVec3) -> Self {
        Self { force, torque: lever.cross(force) }
    }
}

impl Add for LightPush {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { force: self.force + other.force, torque: self.torque + other.torque }
    }
}

/// Pushes of light by its cause. Sunlight, albedo and planet infrared have the recoil of their reflected share.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LightForce {
    pub(crate) sun: LightPush,
    pub(crate) albedo: LightPush,
    pub(crate) planet: LightPush,
    pub(crate) emitted: LightPush,
}

impl LightForce {
    /// All causes together.
    pub(crate) fn all(&self) -> LightPush {
        self.sun + self.albedo + self.planet + self.emitted
    }
}

impl Sum for LightForce {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::default(), |a, b| Self {
            sun: a.sun + b.sun,
            albedo: a.albedo + b.albedo,
            planet: a.planet + b.planet,
            emitted: a.emitted + b.emitted,
        })
    }
}

/// A node under light.
struct PressedNode<'a> {
    material: &'a Material,
    /// From the point of reference [m].
    lever: DVec3,
    /// Area [m2] that takes light, and the normal of its front.
    area: f64,
    normal: DVec3,
    /// The sum of its areas as vectors along their normals [m2]. A closed surface has the sum 0.
    outward: DVec3,
    on_faces: [Incident; 2],
    temperature: f64,
}

/// The sky of a step.
struct PressingSky {
    /// Unit vector to the Sun.
    sun: DVec3,
    planet: Option<PlanetLight>,
    background: f64,
}

impl PressedNode<'_> {
    /// The push on a face; `side` is 1 for the front and -1 for the back.
    fn push_on(&self, face: usize, optics: Optics, sky: &PressingSky) -> LightForce {
        let side = if face == 0 { 1.0 } else { -1.0 };
        let Incident { solar, albedo, planet_ir } = self.on_faces[face];
        let Optics { absorptivity, emissivity } = optics;
        let recoil = |flux: f64| -LAMBERTIAN * flux * side * self.outward;
        let lit = |flux: f64, reflected: f64, from: &dyn Fn() -> DVec3| {
            if flux == 0.0 {
                return LightPush::default();
            }
            LightPush::at(self.lever, (recoil(reflected * flux) - flux * self.area * from()) / LIGHT_SPEED)
        };
        let disc = |glow| {
            let mean = |planet: &PlanetLight| planet.mean_direction(side * self.normal, glow);
            sky.planet.as_ref().map_or(DVec3::ZERO, mean)
        };
        let emitted = recoil(-emissivity * radiated(sky.background, self.temperature)) / LIGHT_SPEED;
        LightForce {
            sun: lit(solar, 1.0 - absorptivity, &|| sky.sun),
            albedo: lit(albedo, 1.0 - absorptivity, &|| disc(PlanetGlow::Albedo)),
            planet: lit(planet_ir, 1.0 - emissivity, &|| disc(PlanetGlow::Infrared)),
            emitted: LightPush::at(self.lever, emitted),
        }
    }

    fn push(&self, sky: &PressingSky) -> LightForce {
        let front = self.push_on(0, self.material.front, sky);
        match self.material.sides {
            Sides::Outside => front,
            Sides::Both { back } => [front, self.push_on(1, back, sky)].into_iter().sum(),
        }
    }
}

/// Force and torque of light at a time [s], about a point of the body frame [m]. The light is the light of the last step; temperatures are the present ones.
///
/// # Errors
/// A call that fails.
pub(crate) fn light_force(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    last: Option<Passing>,
    time: f64,
    about: DVec3,
) -> Result<LightForce, EngineError> {
    let load = load_before(prepared, last, time);
    let state = engine.surfaces()?;
    let (slots, lit) = lit_nodes(prepared, &load, &state);
    let place = places(prepared, &load);
    let outward = outward_areas(prepared, &place);
    let sun: DVec3 = load.sun.iter().map(|sample| sample.flux * sample.direction).sum();
    let sky = PressingSky {
        sun: sun.normalize_or_zero(),
        planet: load.planet.as_ref().map(PlanetLight::new),
        background: load.background_temperature,
    };
    let nodes: Vec<PressedNode> = slots
        .iter()
        .zip(lit.on_faces(&load))
        .map(|(slot, (on_faces, normal))| PressedNode {
            material: &prepared.materials[prepared.nodes.group_material[slot / GROUP] as usize],
            lever: place[*slot] - about,
            area: prepared.light_area(*slot),
            normal,
            outward: outward[*slot],
            on_faces,
            temperature: temperature(prepared, &state, *slot),
        })
        .collect();
    let pushes: Vec<LightForce> = nodes.par_iter().map(|node| node.push(&sky)).collect();
    Ok(pushes.into_iter().sum())
}

fn temperature(prepared: &Prepared, state: &SurfaceState, slot: usize) -> f64 {
    let network = prepared.network.as_ref().filter(|network| network.has(slot));
    network.map_or(state.temperatures[slot], |network| state.network[network.node_of(slot)])
}

/// Place of each node in the body frame [m], with the joints as the load has them.
fn places(prepared: &Prepared, load: &StepLoad) -> Vec<DVec3> {
    let nodes = &prepared.nodes;
    let place = |slot: usize| {
        let position = nodes.positions[slot].as_dvec3();
        let joint = if load.joints.is_empty() { None } else { load.joints.get(nodes.joint(slot) as usize) };
        joint.map_or(position, |pose| pose.transform_point3(position))
    };
    (0..nodes.positions.len()).map(place).collect()
}

/// The third of each triangle that belongs to a node, as vectors along the normals of the triangles [m2], on the side of the node's front.
fn outward_areas(prepared: &Prepared, place: &[DVec3]) -> Vec<DVec3> {
    let nodes = &prepared.nodes;
    let mut sums = vec![DVec3::ZERO; nodes.positions.len()];
    for triangle in &prepared.triangles {
        let [a, b, c] = triangle.map(|node| node as usize);
        let third = (place[b] - place[a]).cross(place[c] - place[a]) / 6.0;
        // A model may wind a triangle against its normals. The file's pose tells it, because normals stand in that pose.
        let [p, q, r] = [a, b, c].map(|node| nodes.positions[node].as_dvec3());
        let normals: DVec3 = [a, b, c].iter().map(|node| nodes.normals[*node].as_dvec3()).sum();
        let third = if (q - p).cross(r - p).dot(normals) < 0.0 { -third } else { third };
        [a, b, c].into_iter().for_each(|node| sums[node] += third);
    }
    sums
}
