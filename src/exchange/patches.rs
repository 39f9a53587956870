//! Patches: nodes gathered by joint, part, material, side, direction of the normal and place. Faces inside other parts are gathered by themselves.
//!
//! A node belongs to one patch on each face that exchanges heat. The surface of a node is the part of its triangles that is nearest to it. Rays start there,
//! and a ray that ends there ends on its patch.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use super::slopes::Slopes;
use crate::thermal::material::{Gloss, Material, Optics, Sides};
use crate::thermal::memory::cooling;

pub(crate) const NONE: u32 = u32::MAX;

/// Bins of a normal along each axis of a face of the cube around it. With three, the axes of the body lie in the middle of a bin.
const BINS: f64 = 3.0;

/// Share of a cell by which places on a grid are moved, so that rounding does not part nodes that lie in one of its planes.
const OFF_GRID: f64 = 0.01;

/// The nodes and triangles of a craft in the file's pose.
#[derive(Debug, Clone, Default)]
pub struct PatchSurface {
    /// Positions of the nodes [m].
    pub positions: Vec<DVec3>,
    /// Unit outward normals of the nodes.
    pub normals: Vec<DVec3>,
    /// Areas over which the nodes exchange heat [m2].
    pub areas: Vec<f64>,
    /// Part of each node.
    pub parts: Vec<u32>,
    /// Material of each node.
    pub materials: Vec<u32>,
    /// Joint of each node; 0 is the body.
    pub joints: Vec<u32>,
    /// Nodes of the triangles. Their order turns to the left around the outward normal.
    pub triangles: Vec<[u32; 3]>,
}

/// A patch.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Joint; 0 is the body.
    pub(crate) joint: u32,
    /// Part.
    pub part: u32,
    pub(crate) material: u32,
    /// Whether it is the face against the normals.
    pub(crate) back: bool,
    /// Whether it lies inside another part, in the file's pose.
    pub(crate) buried: bool,
    /// Absorptivity and emissivity of this face.
    pub optics: Optics,
    /// How this face mirrors.
    pub gloss: Gloss,
    /// How fast its material cools ([`crate::thermal::memory::cooling`]) [1/(s K3)].
    pub(crate) cooling: f64,
    /// Area [m2].
    pub area: f64,
    /// Unit normal away from this face, mean over the nodes, in the file's pose.
    pub normal: DVec3,
    /// Mean place [m].
    pub centre: DVec3,
    /// Nodes, as places in [`Patches::nodes`].
    pub(crate) nodes: std::ops::Range<usize>,
    /// Corners of triangles, as places in [`Patches::corners`].
    pub(crate) corners: std::ops::Range<usize>,
}

/// A corner of a triangle, on whose surface rays of a patch start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    /// Number of the triangle times three, plus the corner's number.
    pub(crate) corner: u32,
    /// Share of the rays of the patch that start here or at a corner before.
    pub(crate) up_to: f64,
}

/// All patches of a craft, joint by joint.
#[derive(Debug, Clone, Default)]
pub struct Patches {
    /// The patches.
    pub all: Arc<Vec<Patch>>,
    /// Nodes of the patches, each with its share of the patch's area.
    pub(crate) nodes: Arc<Vec<(u32, f64)>>,
    pub(crate) corners: Vec<Corner>,
    /// Patches of the front and of the back of each node, or [`NONE`].
    pub(crate) of_node: Arc<Vec<[u32; 2]>>,
    /// How fluxes differ within patches.
    pub(crate) slopes: Arc<Slopes>,
}

impl Patches {
    /// Gathers nodes into patches of about `edge` [m]. `buried` says of the front and the back of each node whether they lie inside another part; it is empty where none
    /// does.
    pub fn new(surface: &PatchSurface, materials: &[Material], edge: f64, buried: &[[bool; 2]]) -> Self {
        Self::of(surface, materials, Self::gathered(surface, materials, edge, buried))
    }

    /// The nodes of each patch of about `edge` [m].
    pub(super) fn gathered(
        surface: &PatchSurface,
        materials: &[Material],
        edge: f64,
        buried: &[[bool; 2]],
    ) -> Vec<Gathered> {
        let corners_of_node = surface.corners_of_nodes();
        let low = surface
            .triangles
            .iter()
            .flatten()
            .fold(DVec3::INFINITY, |low, node| low.min(surface.positions[*node as usize]));
        let mut gathered: BTreeMap<Key, Vec<u32>> = BTreeMap::new();
        for (node, corners) in corners_of_node.iter().enumerate() {
            if corners.is_empty() || surface.areas[node] <= 0.0 {
                continue;
            }
            let cell = ((surface.positions[node] - low) / edge + OFF_GRID).floor().to_array().map(|place| place as i64);
            let (part, material) = (surface.parts[node], surface.materials[node]);
            let both = matches!(materials[material as usize].sides, Sides::Both { .. });
            for back in [false, true].into_iter().take(if both { 2 } else { 1 }) {
                let facing = bin(surface.normals[node]);
                let buried = buried.get(node).is_some_and(|faces| faces[usize::from(back)]);
                let key = Key { joint: surface.joints[node], part, material, back, buried, facing, cell };
                gathered.entry(key).or_default().push(node as u32);
            }
        }
        gathered.into_iter().map(|(key, nodes)| Gathered { key, nodes }).collect()
    }

    /// The patches of gathered nodes.
    pub(super) fn of(surface: &PatchSurface, materials: &[Material], gathered: Vec<Gathered>) -> Self {
        let corners_of_node = surface.corners_of_nodes();
        let mut patches = Self { of_node: Arc::new(vec![[NONE; 2]; surface.positions.len()]), ..Self::default() };
        for Gathered { key, nodes } in gathered {
            patches.push(&key, &nodes, surface, &corners_of_node, materials);
        }
        patches
    }

    fn push(
        &mut self,
        key: &Key,
        nodes: &[u32],
        surface: &PatchSurface,
        corners_of_node: &[Vec<u32>],
        materials: &[Material],
    ) {
        let material = &materials[key.material as usize];
        let area: f64 = nodes.iter().map(|node| surface.areas[*node as usize]).sum();
        let mean = |vector: &dyn Fn(usize) -> DVec3| -> DVec3 {
            nodes.iter().map(|node| vector(*node as usize) * (surface.areas[*node as usize] / area)).sum()
        };
        let outward = mean(&|node| surface.normals[node]).normalize_or(surface.normals[nodes[0] as usize]);
        let (first_node, first_corner) = (self.nodes.len(), self.corners.len());
        Arc::make_mut(&mut self.nodes).extend(nodes.iter().map(|node| (*node, surface.areas[*node as usize] / area)));
        let of_node = Arc::make_mut(&mut self.of_node);
        for node in nodes {
            of_node[*node as usize][usize::from(key.back)] = self.all.len() as u32;
        }
        let corners = nodes.iter().flat_map(|node| corners_of_node[*node as usize].iter());
        let whole: f64 = corners.clone().map(|corner| surface.area_of(*corner as usize / 3)).sum();
        let mut before = 0.0;
        for corner in corners {
            before += surface.area_of(*corner as usize / 3) / whole;
            self.corners.push(Corner { corner: *corner, up_to: before });
        }
        let patch = Patch {
            joint: key.joint,
            part: key.part,
            material: key.material,
            back: key.back,
            buried: key.buried,
            optics: if key.back { material.back() } else { material.front },
            gloss: material.gloss[usize::from(key.back)],
            cooling: cooling(material),
            area,
            normal: if key.back { -outward } else { outward },
            centre: mean(&|node| surface.positions[node]),
            nodes: first_node..self.nodes.len(),
            corners: first_corner..self.corners.len(),
        };
        Arc::make_mut(&mut self.all).push(patch);
    }
}

impl PatchSurface {
    /// Corners of triangles with an area at each node: number of the triangle times three, plus the corner's number.
    fn corners_of_nodes(&self) -> Vec<Vec<u32>> {
        let mut corners: Vec<Vec<u32>> = vec![Vec::new(); self.positions.len()];
        for (number, triangle) in self.triangles.iter().enumerate() {
            if self.area_of(number) > 0.0 {
                (0..3).for_each(|k| corners[triangle[k] as usize].push((3 * number + k) as u32));
            }
        }
        corners
    }

    /// Area of a triangle [m2].
    pub(crate) fn area_of(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.triangles[triangle].map(|node| self.positions[node as usize]);
        0.5 * (b - a).cross(c - a).length()
    }
}

/// The nodes of a patch, and what they share.
#[derive(Debug, Clone)]
pub(super) struct Gathered {
    pub(super) key: Key,
    pub(super) nodes: Vec<u32>,
}

/// Properties that all nodes of a patch share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    joint: u32,
    part: u32,
    material: u32,
    back: bool,
    buried: bool,
    facing: [i8; 3],
    cell: [i64; 3],
}

impl Key {
    /// Whether the patch lies inside another part.
    pub(super) fn is_buried(&self) -> bool {
        self.buried
    }

    /// 0 for a front, 1 for a back.
    pub(super) fn side(&self) -> usize {
        usize::from(self.back)
    }
}

/// Bin of a unit normal: the face of the cube that it leaves, and the cell of this face.
pub(super) fn bin(normal: DVec3) -> [i8; 3] {
    // Rounding must not part nodes whose normals lie between two faces.
    let size = normal.abs() * DVec3::new(1.0, 1.0 - 1e-6, 1.0 - 2e-6);
    let face = if size.x >= size.y.max(size.z) {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let scaled = normal / normal[face].abs().max(f64::MIN_POSITIVE);
    let cell = |at: f64| ((at + 1.0) * 0.5 * BINS + 1e-6).floor().clamp(0.0, BINS - 1.0) as i8;
    [(2 * face) as i8 + i8::from(normal[face] < 0.0), cell(scaled[(face + 1) % 3]), cell(scaled[(face + 2) % 3])]
}
