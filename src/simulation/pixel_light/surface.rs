//! The surfaces that store little and do not conduct: their nodes, their triangles, and the balance of a place of them.

use std::sync::Arc;

use glam::DVec3;

use crate::model::nodes::{GROUP, Nodes};
use crate::simulation::network::SceneNetwork;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::balance::emissivity_sum;
use crate::thermal::material::{Material, Response, Sides};
use crate::thermal::memory::{capacity, emissivity_to_all_sides};

/// Longest time constant of such a surface, at [`USUAL`] [s].
const SLOWEST: f64 = 300.0;
/// Longest way over which heat spreads in a surface that counts as one without conduction, at 300 K [m].
const SPREAD: f64 = 0.01;
/// Temperature at which time constants are told [K].
const USUAL: f64 = 300.0;
/// Lowest temperature of a place [K].
const COLDEST: f64 = 3.0;
/// Parts in which an interval is stepped.
const PARTS: u32 = 2;

/// A surface that stores little and does not conduct.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foil {
    /// Sum of the emissivities of the faces times the Stefan-Boltzmann constant [W m-2 K-4].
    pub(super) faces: f64,
    /// The same of a blanket to what lies below it.
    pub(super) below: f64,
    /// Heat capacity [J m-2 K-1].
    pub(super) capacity: f64,
}

impl Foil {
    /// The foil of a material. `None` for a slow one, and for a response that is no balance.
    fn of(material: &Material) -> Option<Self> {
        if matches!(material.response, Response::Transition(_) | Response::Given) {
            return None;
        }
        let faces = emissivity_sum(material) * STEFAN_BOLTZMANN;
        let below = emissivity_to_all_sides(material) * STEFAN_BOLTZMANN - faces;
        let foil = Self { faces, below, capacity: capacity(material)? };
        let conducts = matches!(material.response, Response::Network);
        let sheet = material.bulk.conductivity.unwrap_or(0.0) * material.bulk.thickness.unwrap_or(0.0);
        let spreads = conducts && (sheet / foil.slope(USUAL)).sqrt() > SPREAD;
        (faces > 0.0 && !spreads && foil.time_constant() <= SLOWEST).then_some(foil)
    }

    /// Slope of what it emits [W m-2 K-1].
    fn slope(&self, kelvin: f64) -> f64 {
        4.0 * (self.faces + self.below) * kelvin.powi(3)
    }

    /// Time constant at a usual temperature [s].
    pub(super) fn time_constant(&self) -> f64 {
        self.capacity / self.slope(USUAL)
    }

    /// Temperature of balance with a flux [K].
    pub(super) fn balance(&self, flux: f64) -> f64 {
        (flux.max(0.0) / (self.faces + self.below)).sqrt().sqrt().max(COLDEST)
    }

    /// Temperature after a time [s] under a flux [K], by steps that are exact for a constant slope.
    pub(super) fn after(&self, mut kelvin: f64, flux: f64, length: f64) -> f64 {
        if self.capacity == 0.0 {
            return self.balance(flux);
        }
        let length = length / f64::from(PARTS);
        let step = |kelvin: f64, slope: f64| {
            let net = flux - (self.faces + self.below) * kelvin.powi(4);
            kelvin + net / slope * -(-slope * length / self.capacity).exp_m1()
        };
        for _ in 0..PARTS {
            let guess = step(kelvin, self.slope(kelvin)).max(COLDEST);
            // Between both ends the secant of T^4 has this slope.
            let secant = (self.faces + self.below) * (kelvin * kelvin + guess * guess) * (kelvin + guess);
            kelvin = step(kelvin, secant).max(COLDEST);
        }
        kelvin
    }
}

/// The surfaces of a scene that are foil.
pub(super) struct FoilSurface {
    /// The foil of each material.
    pub(super) foils: Vec<Option<Foil>>,
    pub(super) nodes: Vec<FoilNode>,
    pub(super) triangles: Vec<FoilTriangle>,
    network: Option<Arc<SceneNetwork>>,
    slots: usize,
}

/// A node of foil.
pub(super) struct FoilNode {
    pub(super) slot: u32,
    pub(super) joint: u32,
    pub(super) material: u32,
    pub(super) normal: DVec3,
    pub(super) position: DVec3,
}

/// A triangle of foil.
pub(super) struct FoilTriangle {
    /// Places of its nodes among the nodes of foil.
    pub(super) nodes: [usize; 3],
    pub(super) part: u32,
    /// Unit normal on the side of its nodes' normals, in the frame of the joint.
    pub(super) normal: DVec3,
    pub(super) both_sides: bool,
}

impl FoilSurface {
    /// The foil of a scene. `order` are the slots of the nodes in the order of their light. `None` without foil.
    pub(super) fn new(
        (nodes, triangles): (&Nodes, &[[u32; 3]]),
        materials: &[Material],
        order: impl Iterator<Item = usize>,
        network: Option<&Arc<SceneNetwork>>,
    ) -> Option<Self> {
        let foils: Vec<Option<Foil>> = materials.iter().map(Foil::of).collect();
        let material = |slot: usize| nodes.group_material[slot / GROUP];
        let mut place = vec![usize::MAX; nodes.positions.len()];
        let mut of_foil = Vec::new();
        // In the order of the light.
        for slot in order.filter(|slot| foils[material(*slot) as usize].is_some()) {
            place[slot] = of_foil.len();
            of_foil.push(FoilNode {
                slot: slot as u32,
                joint: nodes.joint(slot),
                material: material(slot),
                normal: nodes.normals[slot].as_dvec3(),
                position: nodes.positions[slot].as_dvec3(),
            });
        }
        let triangle = |triangle: &[u32; 3]| {
            let own = triangle.map(|node| place[node as usize]);
            let [a, b, c] = triangle.map(|node| nodes.positions[node as usize].as_dvec3());
            let normal = (b - a).cross(c - a).try_normalize().filter(|_| own.iter().all(|node| *node != usize::MAX))?;
            let material = &materials[material(triangle[0] as usize) as usize];
            let is_along = normal.dot(of_foil[own[0]].normal) >= 0.0;
            Some(FoilTriangle {
                nodes: own,
                part: nodes.group_part[triangle[0] as usize / GROUP],
                normal: if is_along { normal } else { -normal },
                both_sides: matches!(material.sides, Sides::Both { .. }),
            })
        };
        let triangles: Vec<FoilTriangle> = triangles.iter().filter_map(triangle).collect();
        let surface =
            Self { foils, nodes: of_foil, triangles, network: network.cloned(), slots: nodes.positions.len() };
        (!surface.triangles.is_empty()).then_some(surface)
    }

    /// Gives nodes that are one node of the network the mean of their values.
    pub(super) fn share(&self, values: &mut [f32]) {
        let Some(network) = &self.network else { return };
        let mut own = vec![0.0; self.slots];
        let mut counted = vec![0.0; self.slots];
        for (node, value) in self.nodes.iter().zip(&*values) {
            own[node.slot as usize] = f64::from(*value);
            counted[node.slot as usize] = 1.0;
        }
        let (heat, area) = (network.heat(|slot| own[slot]), network.heat(|slot| counted[slot]));
        let mean: Vec<f64> = heat.iter().zip(area).map(|(heat, area)| heat / area).collect();
        network.scatter(&mean, |slot, mean| own[slot] = if mean.is_finite() { mean } else { own[slot] });
        for (node, value) in self.nodes.iter().zip(values) {
            *value = own[node.slot as usize] as f32;
        }
    }
}
