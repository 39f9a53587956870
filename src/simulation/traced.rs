//! Reflections of the craft itself: its triangles in a tree that follows the joints, and the faces that see nothing but the craft.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::prepare::Prepared;
use crate::environment::shadow::{Jointed, LARGEST_TREE, Occluders, Tree};
use crate::exchange::directions::{cosine_direction, fractions};
use crate::gpu::layout::{self, ShadowBox, ShadowTriangle};
use crate::gpu::renderer;
use crate::model::nodes::GROUP;
use crate::raster::traced::{self, PathEnd, TracedNode};
use crate::scene::Reflections;
use crate::thermal::material::Sides;

/// Most rays that an invocation follows in a dispatch. With the texels of a dispatch they keep it short of a desktop's watchdog.
const RAYS_AT_ONCE: u32 = 8;

/// The triangles of a craft whose surfaces reflect each other.
pub(crate) struct TracedCraft {
    surface: Jointed,
    occluders: Occluders,
    /// Their tree on the device.
    tree: Tree,
    /// Poses of the joints that the tree was made for.
    poses: Vec<DAffine3>,
    nodes: Vec<TracedNode>,
    end: PathEnd,
    /// Walks through the tree from a surface of a path: one along the path, and one to the Sun where it shines.
    walks: u32,
    /// Nodes of the corners of each triangle in the order of the tree, and the word of the first of them.
    pub(crate) corners_in_tree: Vec<[u32; 4]>,
    /// Words of all nodes for the device.
    pub(crate) words: Vec<u32>,
    boxes: Vec<ShadowBox>,
    triangles: Vec<ShadowTriangle>,
    version: u64,
}

/// The triangles that reflections may meet. Triangles without area only fill up runs.
pub(crate) fn reflected(prepared: &Prepared) -> impl Iterator<Item = [u32; 3]> {
    prepared.triangles.iter().copied().filter(|[a, b, c]| a != b && b != c && c != a)
}

/// Rays that must all meet the craft where a face counts as enclosed.
const ENCLOSING_RAYS: u32 = 64;

/// Whether front and back of each triangle see nothing but the craft.
fn enclosed(occluders: &Occluders) -> Vec<[bool; 2]> {
    let sides = |number: usize| {
        let [corner, first, second] = occluders.triangles[number];
        let outward = first.cross(second).normalize_or_zero();
        [outward, -outward].map(|normal| {
            (0..ENCLOSING_RAYS).all(|ray| {
                let [s, t, u, v] = fractions(number as u32, ray);
                let root = s.sqrt();
                let place = corner + root * (1.0 - t) * first + root * t * second;
                occluders.is_hidden(place + occluders.start * normal, cosine_direction(normal, [u, v]))
            })
        })
    };
    (0..occluders.triangles.len()).into_par_iter().map(sides).collect()
}

/// Materials of the nodes. A side of a node is enclosed where the triangles at it are, as the joints place them at the start.
fn traced_nodes(prepared: &Prepared, surface: &Jointed, sides: &[[bool; 2]]) -> Vec<TracedNode> {
    let nodes = &prepared.nodes;
    let with_material = |node: usize| {
        let material = nodes.group_material[node / GROUP];
        let is_skin = prepared.materials[material as usize].sides == Sides::Outside;
        TracedNode { material, enclosed: [true; 2], is_skin }
    };
    let mut traced: Vec<TracedNode> = (0..nodes.positions.len()).map(with_material).collect();
    for (triangle, sides) in surface.triangles.iter().zip(sides) {
        for node in triangle {
            let all = &mut traced[*node as usize].enclosed;
            *all = [all[0] && sides[0], all[1] && sides[1]];
        }
    }
    traced
}

impl TracedCraft {
    /// The craft at the start of a scene, whose surfaces reflect at most a share of their light.
    pub(crate) fn new(prepared: &Prepared, reflectivity: f64, sun: bool) -> Self {
        let nodes = &prepared.nodes;
        let joints = match prepared.joints() {
            0 | 1 => Vec::new(),
            _ => prepared.joints_of(0..nodes.positions.len()),
        };
        let positions: Vec<DVec3> = nodes.positions.iter().map(|position| position.as_dvec3()).collect();
        let surface = Jointed { positions, triangles: reflected(prepared).collect(), joints };
        let poses = prepared.loads.joints_at(0.0).1;
        let occluders = surface.occluders(&poses);
        let settings = &prepared.scene.surrounded;
        let follows = settings.reflections == Reflections::Traced;
        let end = if follows { PathEnd::new(settings.bounces, reflectivity) } else { PathEnd::AT_ONCE };
        // Without paths all that is reflected is the surroundings.
        let sides = if follows { enclosed(&occluders) } else { vec![[false; 2]; surface.triangles.len()] };
        let traced = traced_nodes(prepared, &surface, &sides);
        let words: Vec<u32> = traced.iter().map(|node| node.word()).collect();
        let tree = occluders.tree();
        let with_word = |number: &u32| {
            let [a, b, c] = surface.triangles[*number as usize];
            [a, b, c, words[a as usize]]
        };
        let corners_in_tree = tree.order.iter().map(with_word).collect();
        let (boxes, triangles) = layout::shadow_tree(&tree, &occluders);
        let walks = if sun { 2 } else { 1 };
        Self {
            surface,
            occluders,
            tree,
            poses,
            nodes: traced,
            end,
            walks,
            corners_in_tree,
            words,
            boxes,
            triangles,
            version: 0,
        }
    }

    pub(crate) fn boxes(&self) -> usize {
        self.boxes.len()
    }

    /// Surfaces of a path at most. From the last one a ray only looks for the Sun.
    fn vertices(&self) -> u32 {
        self.end.bounces + self.walks - 1
    }

    /// Surfaces that a dispatch follows. The loops of an invocation end after so many turns as a tree may have boxes.
    fn vertices_at_once(&self) -> u32 {
        let walks = LARGEST_TREE / self.boxes.len().max(1);
        ((walks as u32).min(RAYS_AT_ONCE) / self.walks).clamp(1, self.vertices())
    }

    /// Dispatches that follow the paths of an image.
    pub(crate) fn dispatches(&self) -> u32 {
        self.vertices().div_ceil(self.vertices_at_once())
    }

    /// Fits the tree to the poses of the joints.
    pub(crate) fn follow(&mut self, joints: &[DAffine3]) {
        if self.surface.joints.is_empty() || self.poses == joints {
            return;
        }
        self.poses = joints.to_vec();
        self.occluders = self.surface.occluders(joints);
        self.tree.refit(&self.occluders.boxes_of_triangles());
        (self.boxes, self.triangles) = layout::shadow_tree(&self.tree, &self.occluders);
        self.version += 1;
    }

    /// The values of an image at a time [s], for the device.
    pub(crate) fn told(&self, time: f64) -> renderer::TracedTree<'_> {
        let settings = layout::Tracing {
            boxes: self.boxes.len() as u32,
            word: word(time),
            start: self.occluders.start as f32,
            width: 0,
            texels: 0,
            surface_width: 0,
            bounces: self.end.bounces,
            vertices: self.vertices_at_once(),
            roulette: self.end.roulette,
            least: self.end.least as f32,
        };
        renderer::TracedTree { settings, boxes: &self.boxes, triangles: &self.triangles, version: self.version }
    }

    /// The same for the rasteriser in f64.
    pub(crate) fn seen(&self, time: f64) -> traced::TracedTriangles<'_> {
        traced::TracedTriangles {
            occluders: &self.occluders,
            corners: &self.surface.triangles,
            nodes: &self.nodes,
            word: word(time),
            end: self.end,
        }
    }
}

/// Word of a time [s]: its microseconds.
fn word(time: f64) -> u32 {
    (time * 1e6).round() as i64 as u32
}
