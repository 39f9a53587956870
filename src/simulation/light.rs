//! The surface of a scene that the Sun lights, and how its light is found.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use super::network::SceneNetwork;
use super::pixel_light::PixelLight;
use crate::environment::shadow::corner::Division;
use crate::environment::shadow::{Caster, KeptLight, LitAreas, LitNode, LitSurface, Redraw};
use crate::environment::step::StepLoads;
use crate::gpu::effects::image::runs::TriangleRun;
use crate::gpu::effects::thermal::variant::LightBy;
use crate::model::nodes::{GROUP, Nodes};
use crate::scene::Scene;
use crate::thermal::material::{Material, Response, Sides};

/// Default distance between two samples of light on a surface, as a share of the diagonal of the craft.
const SAMPLE_SPACING: f64 = 1.0 / 400.0;

/// The surface that the Sun lights, and how its light is found.
#[derive(Clone)]
pub(crate) struct SceneLight {
    surface: Arc<LitSurface>,
    pub(super) by: LightBy,
    redraw: Redraw,
    kept: Arc<KeptLight>,
    /// Foil whose pixels have light of their own, where the scene has any.
    pub(super) in_pixels: Option<Arc<PixelLight>>,
}

impl SceneLight {
    /// The light of a scene. `casters` are the triangles of the model before it was split, and the run of each joint; empty without shadows.
    pub(super) fn new(
        scene: &Scene,
        nodes: &Nodes,
        triangles: &[[u32; 3]],
        casters: (&[[u32; 3]], &[TriangleRun]),
        materials: &[Material],
    ) -> Self {
        let positions: Vec<DVec3> = nodes.positions.iter().map(|position| position.as_dvec3()).collect();
        let settings = scene.shadows.unwrap_or_default();
        let run = |run: &TriangleRun| {
            let triangles = &casters.0[run.triangles.0 as usize..run.triangles.1 as usize];
            let outwards: Vec<_> = triangles.iter().map(|triangle| turned_left(nodes, *triangle)).collect();
            Caster::new(run.joint, &positions, &outwards)
        };
        let casters: Vec<_> = match scene.shadows {
            Some(_) => casters.1.iter().map(run).collect(),
            None => Vec::new(),
        };
        let bounds = joint_bounds(nodes);
        let size = bounds.iter().map(|(_, bounds)| *bounds).reduce(|[low, high], [l, h]| [low.min(l), high.max(h)]);
        let size = size.map_or(0.0, |[low, high]| low.distance(high));
        let surface = LitSurface {
            positions,
            triangles: triangles.to_vec(),
            casters,
            spacing: settings.spacing.unwrap_or(SAMPLE_SPACING * size),
            times: 1,
        };
        let mut light = Self {
            surface: Arc::new(surface),
            by: LightBy::Normal,
            redraw: Redraw { bounds, angle: settings.redraw_angle, found_for: None },
            kept: Arc::default(),
            in_pixels: None,
        };
        if scene.environment.solar_constant.is_some_and(|flux| flux > 0.0) {
            let all = || nodes.real().map(|(slot, _)| lit_node(nodes, materials, slot)).collect();
            let flat = || LitAreas::new(Arc::clone(&light.surface), all(), light.redraw.clone()).are_flat();
            light.by = match scene.shadows {
                Some(_) => LightBy::Rays,
                None if flat() => LightBy::Normal,
                None => LightBy::Area,
            };
        }
        light
    }

    /// The same with foil whose pixels have light of their own.
    pub(super) fn with_pixels(
        self,
        scene: &Scene,
        craft: (&Nodes, &[[u32; 3]], &[Material]),
        network: Option<&Arc<SceneNetwork>>,
        loads: &StepLoads,
    ) -> Self {
        let (nodes, _, materials) = craft;
        let lit = self.lit_areas(nodes, materials, nodes.real().map(|(slot, _)| slot));
        let in_pixels = lit.and_then(|lit| PixelLight::of(scene, craft, lit, network, loads));
        Self { in_pixels: in_pixels.map(Arc::new), ..self }
    }

    /// Largest distance between two samples of light on a surface [m].
    pub(crate) fn spacing(&self) -> f64 {
        self.surface.spacing
    }

    /// Finds the lit areas of some nodes. `None` where there is no Sun, or where normals tell the light.
    pub(super) fn lit_areas(
        &self,
        nodes: &Nodes,
        materials: &[Material],
        slots: impl Iterator<Item = usize>,
    ) -> Option<LitAreas> {
        (self.by != LightBy::Normal).then(|| {
            let lit = slots.map(|slot| lit_node(nodes, materials, slot)).collect();
            LitAreas::new(Arc::clone(&self.surface), lit, self.redraw.clone()).keeping(&self.kept)
        })
    }
}

/// A triangle whose corners turn to the left around the side of its nodes' normals.
fn turned_left(nodes: &Nodes, triangle: [u32; 3]) -> [u32; 3] {
    let [a, b, c] = triangle.map(|node| nodes.positions[node as usize].as_dvec3());
    let normal: DVec3 = triangle.iter().map(|node| nodes.normals[*node as usize].as_dvec3()).sum();
    let [first, second, third] = triangle;
    if (b - a).cross(c - a).dot(normal) < 0.0 { [first, third, second] } else { triangle }
}

fn lit_node(nodes: &Nodes, materials: &[Material], slot: usize) -> LitNode {
    let material = &materials[nodes.group_material[slot / GROUP] as usize];
    LitNode {
        number: slot as u32,
        vertex: nodes.vertex_of_node[slot],
        normal: nodes.normals[slot].as_dvec3(),
        both_sides: matches!(material.sides, Sides::Both { .. }),
        joint: nodes.joint(slot),
        division: division(material),
    }
}

/// How triangles of a material are divided between their corners. A network has the areas of its nodes from `Division::Nearest`.
pub(super) fn division(material: &Material) -> Division {
    if material.response == Response::Network { Division::Nearest } else { Division::Thirds }
}

/// Box around the nodes of each joint in the file's pose: lower and upper corner [m].
fn joint_bounds(nodes: &Nodes) -> Vec<(u32, [DVec3; 2])> {
    let mut bounds: BTreeMap<u32, [DVec3; 2]> = BTreeMap::new();
    for (slot, _) in nodes.real() {
        let at = nodes.positions[slot].as_dvec3();
        let [low, high] = bounds.entry(nodes.joint(slot)).or_insert([at, at]);
        (*low, *high) = (low.min(at), high.max(at));
    }
    bounds.into_iter().collect()
}
