//! The light of Sun and planet that corners of triangles and nodes absorb in a step.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::environment::StepLoad;
use crate::environment::load::solar_flux;
use crate::environment::shadow::CornerLight;
use crate::model::nodes::GROUP;
use crate::simulation::light::division;
use crate::simulation::prepare::Prepared;
use crate::thermal::balance::{Incident, absorbed_flux};
use crate::thermal::incident::incident;
use crate::thermal::material::{Material, Sides};

/// Cosine between the normals of a corner and of its node above which both see the same planet.
const FLAT: f64 = 1.0 - 1e-7;

/// The corners and nodes of a craft as light meets them.
pub(super) struct AbsorbingSurface<'a> {
    pub(super) prepared: &'a Prepared,
    pub(super) corners: Vec<AbsorbingCorner>,
    /// Sum of the areas of the corners of each node [m2].
    pub(super) areas: Vec<f64>,
}

/// A corner of a triangle.
pub(super) struct AbsorbingCorner {
    /// Unit normal on the side of its node's normal, in the frame of the joint.
    normal: DVec3,
    /// Area [m2].
    pub(super) area: f64,
    /// Whether its node has the same normal.
    is_flat: bool,
}

/// Absorbed light in a step [W/m2].
#[derive(Clone)]
pub(super) struct Absorbed {
    pub(super) corners: Vec<CornerFlux>,
    pub(super) nodes: Vec<f64>,
    /// Direct sunlight on nodes, as part of the whole.
    pub(super) solar: Vec<f64>,
}

/// Absorbed light on a corner [W/m2].
#[derive(Clone, Copy, Default)]
pub(super) struct CornerFlux {
    /// Of Sun and planet.
    pub(super) absorbed: f64,
    /// Of the Sun, as part of the whole.
    solar: f64,
    /// Of the Sun, if all of the corner were lit.
    pub(super) if_lit: f64,
}

impl<'a> AbsorbingSurface<'a> {
    pub(super) fn new(prepared: &'a Prepared) -> Self {
        let nodes = &prepared.nodes;
        let corner = |number: usize| {
            let triangle = prepared.triangles[number / 3].map(|node| node as usize);
            let [a, b, c] = triangle.map(|node| nodes.positions[node].as_dvec3());
            let twice = (b - a).cross(c - a);
            let of_face = twice.normalize_or_zero();
            let cosine = of_face.dot(nodes.normals[triangle[number % 3]].as_dvec3());
            let normal = if cosine >= 0.0 { of_face } else { -of_face };
            let material = &prepared.materials[nodes.group_material[triangle[0] / GROUP] as usize];
            let area = division(material).area([a, b, c], number % 3);
            AbsorbingCorner { normal, area, is_flat: cosine.abs() > FLAT }
        };
        let corners: Vec<AbsorbingCorner> = (0..3 * prepared.triangles.len()).into_par_iter().map(corner).collect();
        let mut areas = vec![0.0; nodes.vertex_of_node.len()];
        for (node, corner) in prepared.triangles.as_flattened().iter().zip(&corners) {
            areas[*node as usize] += corner.area;
        }
        Self { prepared, corners, areas }
    }

    fn material(&self, node: usize) -> &Material {
        &self.prepared.materials[self.prepared.nodes.group_material[node / GROUP] as usize]
    }

    /// The light that corners and nodes absorb, where corners are lit so.
    pub(super) fn absorbed(&self, load: &StepLoad, lights: &[CornerLight]) -> Absorbed {
        let nodes = &self.prepared.nodes;
        let joints = load.joints.len().max(1);
        let frames: Vec<DMat3> = (0..joints as u32).map(|joint| load.joint_from_body(joint).transpose()).collect();
        let frame = |node: usize| frames[(nodes.joint(node) as usize).min(joints - 1)];
        let planet = |node: usize, normal: DVec3| by_planet(load, self.material(node), frame(node) * normal);
        let of_nodes: Vec<f64> = (0..self.areas.len())
            .into_par_iter()
            .map(|node| if self.areas[node] > 0.0 { planet(node, nodes.normals[node].as_dvec3()) } else { 0.0 })
            .collect();
        let on_corner = |(number, node): (usize, &u32)| {
            let (corner, node) = (&self.corners[number], *node as usize);
            if corner.area == 0.0 {
                return CornerFlux::default();
            }
            let if_lit = by_sun(load, self.material(node), frame(node) * corner.normal);
            let solar = f64::from(lights[number].share) * if_lit;
            let by_planet = if corner.is_flat { of_nodes[node] } else { planet(node, corner.normal) };
            CornerFlux { absorbed: solar + by_planet, solar, if_lit }
        };
        let triangles = self.prepared.triangles.as_flattened();
        let corners: Vec<CornerFlux> = triangles.par_iter().enumerate().map(on_corner).collect();
        let mut sums = vec![0.0; self.areas.len()];
        for ((node, flux), corner) in triangles.iter().zip(&corners).zip(&self.corners) {
            sums[*node as usize] += corner.area * flux.solar;
        }
        let mean = |(sum, area): (&f64, &f64)| if *area > 0.0 { sum / area } else { 0.0 };
        let solar: Vec<f64> = sums.iter().zip(&self.areas).map(mean).collect();
        let nodes = solar.iter().zip(of_nodes).map(|(solar, planet)| solar + planet).collect();
        Absorbed { corners, nodes, solar }
    }
}

/// Sunlight that a surface with a normal (body frame) absorbs [W/m2].
fn by_sun(load: &StepLoad, material: &Material, normal: DVec3) -> f64 {
    let back = match material.sides {
        Sides::Outside => 0.0,
        Sides::Both { back } => back.absorptivity * solar_flux(load, -normal),
    };
    material.front.absorptivity * solar_flux(load, normal) + back
}

/// Light of the planet that a surface with a normal (body frame) absorbs [W/m2].
fn by_planet(load: &StepLoad, material: &Material, normal: DVec3) -> f64 {
    if load.planet.is_none() {
        return 0.0;
    }
    let on = |normal: DVec3| Incident { solar: 0.0, ..incident(load, normal) };
    absorbed_flux(material, on(normal), || on(-normal))
}
