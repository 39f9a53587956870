//! The scene graph: nodes of the default scene and their transforms.

use glam::{DMat4, DQuat, DVec3};

use super::document::{Document, GltfNode};
use super::error::label;
use super::{ModelFault, SceneNode};
use crate::text::plain;

/// Largest error of a rotation's length. The glTF validator uses it, and quantized rotations stay within it.
const UNIT_TOLERANCE: f64 = 0.00769;
/// Largest error of a matrix's last row, which must be (0, 0, 0, 1).
const AFFINE_TOLERANCE: f64 = 1e-6;

/// A node of the default scene with a mesh.
pub(super) struct Instance {
    pub(crate) node: usize,
    /// Index in [`Graph::nodes`].
    pub(crate) place: usize,
    /// Index of the mesh, in range.
    pub(crate) mesh: usize,
    /// Number of the copy, where the node states copies of its mesh.
    pub(crate) copy: Option<usize>,
    pub(crate) body_from_part: DMat4,
}

pub(super) struct Graph {
    /// All nodes, parents before children.
    pub(crate) nodes: Vec<SceneNode>,
    /// Nodes with a mesh, parents before children, in file order.
    pub(crate) instances: Vec<Instance>,
}

/// Walks the default scene and checks it. The walk is not recursive, because a chain of a million nodes is legal.
pub(super) fn walk(document: &Document) -> Result<Graph, ModelFault> {
    check_tree(document)?;
    let Some(scene) = document.scenes.get(document.default_scene) else {
        return Err(if document.scenes.is_empty() {
            ModelFault::NothingToDraw("the file has no scene".to_owned())
        } else {
            ModelFault::element(
                "scene",
                format!("{} is asked for, the file has {}", document.default_scene, document.scenes.len()),
            )
        });
    };
    let mut stack: Vec<(usize, Option<usize>)> = scene.nodes.iter().rev().map(|root| (*root, None)).collect();
    let mut graph = Graph { nodes: Vec::new(), instances: Vec::new() };
    while let Some((index, parent)) = stack.pop() {
        let body_from_parent = parent.map_or(DMat4::IDENTITY, |place| graph.nodes[place].body_from_node);
        let node = &document.nodes[index];
        let fail = |problem: String| ModelFault::element(document.node_label(index), problem);
        let body_from_part = body_from_parent * local_transform(node).map_err(fail)?;
        if !body_from_part.is_finite() {
            return Err(fail("its transform, with those above it, is not finite".to_owned()));
        }
        let place = graph.nodes.len();
        graph.nodes.push(SceneNode {
            index,
            name: match &node.name {
                Some(name) if !name.is_empty() => plain(name).into_owned(),
                _ => format!("node_{index}"),
            },
            parent,
            body_from_parent,
            body_from_node: body_from_part,
            rest: node.matrix.is_none().then(|| own_translation_and_rotation(node)),
        });
        if let Some(mesh) = node.mesh {
            if mesh >= document.meshes.len() {
                return Err(fail(format!("refers to mesh {mesh}, the file has {}", document.meshes.len())));
            }
            graph.instances.push(Instance { node: index, place, mesh, copy: None, body_from_part });
        }
        stack.extend(node.children.iter().rev().map(|child| (*child, Some(place))));
    }
    Ok(graph)
}

/// Checks that the nodes form a forest, and that the default scene lists its roots once.
fn check_tree(document: &Document) -> Result<(), ModelFault> {
    let nodes = &document.nodes;
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let fail = |problem: String| Err(ModelFault::element(document.node_label(index), problem));
        for child in &node.children {
            match parents.get_mut(*child) {
                None => return fail(format!("has child {child}, the file has {} nodes", nodes.len())),
                Some(Some(other)) => {
                    let other = document.node_label(*other);
                    return fail(format!("has child {child}, which is a child of {other} already"));
                }
                Some(parent) => *parent = Some(index),
            }
        }
    }

    // Each node has one parent. If the walk upwards does not end, the node is on or below a cycle.
    let mut ends = vec![false; nodes.len()];
    let mut path = Vec::new();
    for start in 0..nodes.len() {
        let mut next = Some(start);
        while let Some(index) = next.filter(|index| !ends[*index]) {
            if path.len() == nodes.len() {
                return Err(ModelFault::element(
                    document.node_label(index),
                    "is its own ancestor: the nodes form a cycle",
                ));
            }
            path.push(index);
            next = parents[index];
        }
        for index in path.drain(..) {
            ends[index] = true;
        }
    }

    let Some(scene) = document.scenes.get(document.default_scene) else {
        return Ok(());
    };
    let mut listed = vec![false; nodes.len()];
    for root in &scene.nodes {
        let fail = |problem: String| {
            Err(ModelFault::element(label("scene", document.default_scene, scene.name.as_deref()), problem))
        };
        match listed.get_mut(*root) {
            None => return fail(format!("has root node {root}, the file has {} nodes", nodes.len())),
            Some(true) => return fail(format!("lists node {root} twice")),
            Some(visited) => *visited = true,
        }
        if let Some(parent) = parents[*root] {
            return fail(format!("has root node {root}, which is a child of {}", document.node_label(parent)));
        }
    }
    Ok(())
}

fn own_translation_and_rotation(node: &GltfNode) -> (DVec3, DQuat) {
    let rotation = node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    (node.translation.map_or(DVec3::ZERO, DVec3::from_array), rotation.normalize())
}

/// Translation x rotation x scale. A part that is not stated does nothing.
pub(super) fn transform(
    scale: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    translation: Option<[f64; 3]>,
) -> Result<DMat4, String> {
    let rotation = rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let length = rotation.length();
    if !length.is_finite() || (length - 1.0).abs() > UNIT_TOLERANCE {
        return Err(format!("its rotation is a quaternion of length {length}, not of length 1"));
    }
    let scale = scale.map_or(DVec3::ONE, DVec3::from_array);
    let translation = translation.map_or(DVec3::ZERO, DVec3::from_array);
    Ok(DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}

/// A node's own transform: its matrix, or translation x rotation x scale (glTF 2.0, 3.5.3).
fn local_transform(node: &GltfNode) -> Result<DMat4, String> {
    let Some(matrix) = node.matrix else {
        return transform(node.scale, node.rotation, node.translation);
    };
    if node.scale.is_some() || node.translation.is_some() || node.rotation.is_some() {
        return Err("has a matrix and also a translation, rotation or scale".to_owned());
    }
    let matrix = DMat4::from_cols_array(&matrix);
    let bottom = matrix.row(3) - glam::DVec4::W;
    if bottom.abs().max_element() > AFFINE_TOLERANCE {
        return Err(format!("its matrix has the last row {}, not (0, 0, 0, 1)", matrix.row(3)));
    }
    Ok(matrix)
}
