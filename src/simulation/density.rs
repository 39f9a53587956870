//! Node density: merges and splits edges as the scene asks, or as light needs them, within the host's free memory.

use super::prepare_error::PrepareStage;
use crate::host;
use crate::model::{MergeSummary, Model, ModelError};
use crate::scene::{Edges, Scene};

/// Peak host memory for each node while a scene is built [bytes]: the value from `measure -- --build` and a half more.
pub(super) const HOST_BYTES_A_NODE: usize = 300;

/// Peak host memory for each node of a scene with a thermal network [bytes].
const HOST_BYTES_A_NETWORK_NODE: usize = 400;

/// Nothing that flies is longer than this [m]. The International Space Station has 109 m.
pub(crate) const LONGEST_CRAFT: f64 = 200.0;

/// Few craft are longer than this [m]: stations and sails.
const LONG_CRAFT: f64 = 50.0;

/// Nodes from which a craft that is longer is refused, or from which a long one is told, before its edges are split.
const MOST_NODES_OF_WRONG_UNIT: f64 = 1e6;

/// Longest edge over the root of the craft's area where a scene states none and its surfaces shade or warm each other: some 5,000 nodes.
const EDGE_OF_ROOT: f64 = 1.0 / 40.0;

/// Chooses the longest edge of a scene that states none [m], where the light on a surface depends on its place.
pub(super) fn choose(scene: &mut Scene, model: &Model) {
    let has_light = scene.shadows.is_some() || scene.exchange.is_some();
    let area: f64 = (0..model.triangles.len()).map(|triangle| model.triangle_area(triangle)).sum();
    let open = model.parts.iter().any(|part| scene.density.of(part).max.is_none());
    if !has_light || !open || scene.temperatures.is_some() || area == 0.0 {
        return;
    }
    let edge = EDGE_OF_ROOT * area.sqrt();
    let digits = 10f64.powf(1.0 - edge.log10().floor());
    let edge = ((edge * digits).round() / digits).max(scene.density.model.min.unwrap_or(0.0));
    scene.assumptions.push(format!(
        "Edges longer than {edge} m are split, because surfaces shade or warm each other (model.max_edge is absent; \"file\" keeps the file's triangles)."
    ));
    scene.density.model.max = Some(edge);
    scene.density.is_chosen = true;
    // A part that merges longer edges has none that is shorter.
    for Edges { max, min } in scene.density.parts.iter_mut().map(|rule| &mut rule.edges) {
        *max = max.or(min.filter(|min| *min > edge));
    }
}

/// Merges edges below the scene's shortest edge length. Returns the merged edges, where the scene has such lengths.
///
/// # Errors
/// A length that is not valid.
pub(super) fn merge(scene: &Scene, model: Model) -> Result<(Model, Option<MergeSummary>), ModelError> {
    let shortest = scene.density.min_edges(&model);
    if shortest.iter().all(|edge| *edge == 0.0) {
        return Ok((model, None));
    }
    model.merge_short_edges(&shortest).map(|(model, merged)| (model, Some(merged)))
}

/// Splits edges above the scene's longest edge length.
///
/// # Errors
/// More nodes than fit into the memory of the host.
pub(super) fn split(
    scene: &Scene,
    model: Model,
    network: bool,
    progress: &mut dyn FnMut(PrepareStage),
) -> Result<Model, ModelError> {
    let longest = scene.density.max_edges(&model);
    if longest.iter().all(|edge| edge.is_infinite()) {
        return Ok(model);
    }
    // Nobody stated an edge that was chosen, and it makes few nodes.
    if !scene.density.is_chosen {
        refuse_wrong_unit(&model, &longest, progress)?;
    }
    model.subdivide_parts(&longest, node_limit(network), &mut |vertices| progress(PrepareStage::Splitting(vertices)))
}

/// Refuses a craft that is longer than any, and tells of a long one, where its edges would make millions of nodes, before they are made.
fn refuse_wrong_unit(model: &Model, longest: &[f64], progress: &mut dyn FnMut(PrepareStage)) -> Result<(), ModelError> {
    let place = |vertex: u32| model.positions[vertex as usize];
    let extent = model.extent();
    // An equilateral triangle has the largest area, sqrt(3)/4 of the square of its edge, and a mesh has half as many vertices as triangles.
    let fewest = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(place);
        let edge = longest[model.vertex_part[triangle[0] as usize] as usize];
        0.5 * (0.5 * (b - a).cross(c - a).length() / (3f64.sqrt() / 4.0 * edge * edge)).max(1.0)
    };
    let nodes: f64 = if extent > LONG_CRAFT { model.triangles.iter().map(fewest).sum() } else { 0.0 };
    if nodes > MOST_NODES_OF_WRONG_UNIT && extent <= LONGEST_CRAFT {
        progress(PrepareStage::Long { metres: extent as u32, nodes: nodes as usize });
    } else if nodes > MOST_NODES_OF_WRONG_UNIT {
        let edge = longest.iter().copied().fold(f64::INFINITY, f64::min);
        return Err(ModelError::WrongUnit { path: model.source.clone(), extent, edge, nodes });
    }
    Ok(())
}

/// The result of merging, in words.
pub(super) fn describe(merged: &MergeSummary) -> String {
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

/// Nodes that fit into the memory that the process may still take. With this bound subdivision ends in an error instead of swapping.
fn node_limit(network: bool) -> usize {
    let bytes_a_node = if network { HOST_BYTES_A_NETWORK_NODE } else { HOST_BYTES_A_NODE };
    // Where the free memory is unknown, 32-bit indices are the limit.
    host::memory_left().map_or(u32::MAX as usize, |bytes| bytes as usize / bytes_a_node)
}
