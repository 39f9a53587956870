//! A glTF file as the simulation uses it: parts, materials, vertices and triangles in one body frame.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::{DMat4, DQuat, DVec3, Vec3};

use crate::environment::joints::keys::Keys;

mod accessor;
mod alike;
mod animation;
mod buffer;
mod collapse;
mod container;
mod document;
mod error;
mod graph;
mod load;
mod measure;
mod primitive;
mod subdivide;
mod summary;
mod weld;

pub use collapse::Merged;
pub use error::{Fault, ModelError};
pub use summary::{ModelSummary, Share};

/// A material named by the file; its thermal values come from the scene's rules or from `extras`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelMaterial {
    /// glTF name, or `material_N` where the file gives none, or `default` for primitives without material.
    pub name: String,
    /// `extras` entries whose key starts with `isotherm_`, prefix removed.
    pub extras: BTreeMap<String, serde_json::Value>,
}

/// An instance of a mesh in the scene graph: a glTF node that carries triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of the glTF node, or `node_N`; made unique with a suffix `#2` where repeated.
    pub name: String,
    /// Transform of the node in the default scene.
    pub body_from_part: DMat4,
}

/// A glTF node of the default scene, with or without a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneNode {
    /// Index in the file.
    pub index: usize,
    /// Name, or `node_N` where the file gives none; not made unique.
    pub name: String,
    /// Place of the node above it in [`Model::tree`]; `None` of a root.
    pub parent: Option<usize>,
    /// From the parent's frame to the body's.
    pub body_from_parent: DMat4,
    /// From the node's own frame to the body's.
    pub body_from_node: DMat4,
    /// Translation [m] and rotation (quaternion x, y, z, w) of its own transform; `None` where it has a matrix.
    pub rest: Option<(DVec3, DQuat)>,
}

/// How one node moves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NodeMotion {
    /// Index of the node in the file.
    pub node: usize,
    /// Its rotation (x, y, z, w), where that is animated.
    pub rotation: Option<Keys<4>>,
    /// Its translation [m], where that is animated.
    pub translation: Option<Keys<3>>,
    /// What else is animated, which no joint can follow.
    pub other: Option<String>,
}

/// One animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// glTF name, or `animation_N` where the file gives none.
    pub name: String,
    /// Time of its last key [s].
    pub duration: f64,
    /// The nodes that it moves.
    pub nodes: Vec<NodeMotion>,
}

/// Something in the file that was left out, and why.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Skipped {
    /// What it was: `2 triangles of part B0_ISS_FGB1`.
    pub what: String,
    /// Why: `zero area`.
    pub why: String,
}

/// Triangles of the default scene after node transforms. A vertex belongs to one part and one material.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// The file.
    pub source: PathBuf,
    /// glTF nodes in the default scene, transform-only nodes included.
    pub gltf_nodes: usize,
    /// The default scene's nodes, each after the one above it.
    pub tree: Vec<SceneNode>,
    /// Place in `tree` of each part.
    pub part_nodes: Vec<usize>,
    /// Animations of the file, each with what keeps it from being used, where something does.
    pub animations: Vec<Result<Animation, String>>,
    /// Materials in use, in order of first use.
    pub materials: Vec<ModelMaterial>,
    /// Parts in traversal order.
    pub parts: Vec<Part>,
    /// Vertex positions in the body frame [m].
    pub positions: Vec<DVec3>,
    /// Unit outward normals, one a vertex.
    pub normals: Vec<Vec3>,
    /// Index into `parts`, one a vertex.
    pub vertex_part: Vec<u32>,
    /// Index into `materials`, one a vertex.
    pub vertex_material: Vec<u32>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// What was left out.
    pub skipped: Vec<Skipped>,
    /// Remarks a user should see: `normals computed for part X`.
    pub notes: Vec<String>,
}
