//! Brings the model to the density of nodes that the scene asks for, within the memory that the host has.

use super::prepare_error::Stage;
use crate::host;
use crate::model::{Merged, Model, ModelError};
use crate::scene::Scene;

/// Host memory that building a scene takes at its peak for each node, as `measure -- --build` finds it, and a half more.
const HOST_BYTES_A_NODE: usize = 300;

/// The same of a scene with a thermal network.
const HOST_BYTES_A_NETWORK_NODE: usize = 400;

/// Merges what is shorter than the scene's shortest edges; says what that did, where there are any.
///
/// # Errors
/// A length that is none.
pub(super) fn merge(scene: &Scene, model: Model) -> Result<(Model, Option<Merged>), ModelError> {
    let shortest = scene.density.min_edges(&model);
    if shortest.iter().all(|edge| *edge == 0.0) {
        return Ok((model, None));
    }
    model.merge_short_edges(&shortest).map(|(model, merged)| (model, Some(merged)))
}

/// Splits what is longer than the scene's longest edges.
///
/// # Errors
/// More nodes than fit into the memory of the host.
pub(super) fn split(
    scene: &Scene,
    model: Model,
    network: bool,
    progress: &mut dyn FnMut(Stage),
) -> Result<Model, ModelError> {
    let longest = scene.density.max_edges(&model);
    if longest.iter().all(|edge| edge.is_infinite()) {
        return Ok(model);
    }
    model.subdivide_parts(&longest, node_limit(network), &mut |vertices| progress(Stage::Splitting(vertices)))
}

/// What merging did, in words.
pub(super) fn describe(merged: &Merged) -> String {
    let [before, after] = merged.area_m2;
    let change = |[before, after]: [f64; 2]| 100.0 * (after - before) / before;
    let most = match &merged.most_changed {
        Some((part, areas)) => format!(", most of part '{part}' ({:+.3} %)", change(*areas)),
        None => String::new(),
    };
    format!(
        "Edges below min_edge: {} places were merged into neighbours and {} triangles vanished; the area went from \
         {before:.4} to {after:.4} m2 ({:+.4} %){most}.",
        merged.places,
        merged.triangles,
        change(merged.area_m2)
    )
}

/// Nodes that fit into the memory that the host has free, so that subdivision ends in an error and not in swapping.
fn node_limit(network: bool) -> usize {
    let bytes_a_node = if network { HOST_BYTES_A_NETWORK_NODE } else { HOST_BYTES_A_NODE };
    // Where the system does not tell, 32-bit indices are the limit.
    host::free_memory().map_or(u32::MAX as usize, |bytes| bytes as usize / bytes_a_node)
}
