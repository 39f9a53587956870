//! A glTF file as the simulation uses it: parts, materials, vertices and triangles in the body frame.

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
mod faces;
mod format;
mod graph;
mod hanging;
mod instances;
mod load;
mod measure;
mod meshopt;
mod meshopt_filter;
pub(crate) mod nodes;
mod primitive;
mod snap;
mod subdivide;
mod summary;
mod weld;

pub(crate) use collapse::MergeSummary;
pub use error::ModelError;
pub(crate) use error::ModelFault;

/// A glTF material. Thermal values come from the scene's rules or from `extras`.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelMaterial {
    /// glTF name, `material_N` for an unnamed material, or `default` for primitives without one.
    pub name: String,
    /// `extras` whose key starts with `isotherm_`, without the prefix.
    pub extras: BTreeMap<String, serde_json::Value>,
    /// Base colour: linear red, green and blue, each 0 to 1. `None` where the file states none.
    pub colour: Option<[f64; 3]>,
}

/// An instance of a mesh: a glTF node with triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of the glTF node, or `node_N`. Copies of its mesh by EXT_mesh_gpu_instancing are `NAME[0]`, `NAME[1]` and so on. A repeated name gets a suffix
    /// like `#2`.
    pub name: String,
    /// Transform of the node, or of the copy, in the default scene.
    pub body_from_part: DMat4,
}

/// A glTF node of the default scene, with or without a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneNode {
    /// Index in the file.
    pub(crate) index: usize,
    /// Name, or `node_N`. Names may repeat.
    pub(crate) name: String,
    /// Index of the parent in [`Model::tree`]. `None` for a root.
    pub(crate) parent: Option<usize>,
    /// Transform from the parent's frame to the body frame.
    pub(crate) body_from_parent: DMat4,
    /// Transform from the node's frame to the body frame.
    pub(crate) body_from_node: DMat4,
    /// Translation [m] and rotation (quaternion x, y, z, w). `None` if it has a matrix.
    pub(crate) rest: Option<(DVec3, DQuat)>,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct NodeMotion {
    pub(crate) node: usize,
    /// Rotation keys (x, y, z, w), if any.
    pub(crate) rotation: Option<Keys<4>>,
    /// Translation keys [m], if any.
    pub(crate) translation: Option<Keys<3>>,
    /// Another animated property, which joints do not support.
    pub(crate) other: Option<String>,
}

/// One animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// glTF name, or `animation_N`.
    pub(crate) name: String,
    /// Time of its last key [s].
    pub(crate) duration: f64,
    pub(crate) nodes: Vec<NodeMotion>,
}

/// A part of the file that was left out, and the reason.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Skipped {
    /// The part: `2 triangles of part B0_ISS_FGB1`.
    pub what: String,
    /// The reason: `zero area`.
    pub why: String,
}

/// The triangles of the default scene in the body frame. A vertex belongs to one part and one material.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// The file.
    pub source: PathBuf,
    /// Number of glTF nodes in the default scene, including nodes without mesh.
    pub gltf_nodes: usize,
    /// Nodes of the default scene, parents before children.
    pub tree: Vec<SceneNode>,
    /// Index in `tree` of each part.
    pub part_nodes: Vec<usize>,
    /// Animations of the file. An unusable one is a message.
    pub animations: Vec<Result<Animation, String>>,
    /// Used materials, in order of first use.
    pub materials: Vec<ModelMaterial>,
    /// Parts in traversal order.
    pub parts: Vec<Part>,
    /// Vertex positions in the body frame [m].
    pub positions: Vec<DVec3>,
    /// Unit outward normal of each vertex.
    pub normals: Vec<Vec3>,
    /// Index into `parts` of each vertex.
    pub vertex_part: Vec<u32>,
    /// Index into `materials` of each vertex.
    pub vertex_material: Vec<u32>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Parts of the file that were left out.
    pub skipped: Vec<Skipped>,
    /// Remarks for the user: `normals computed for part X`.
    pub notes: Vec<String>,
}
