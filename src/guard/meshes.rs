//! Meshes whose nodes lie too far apart to show shadows, or to conduct heat along a part.

use super::finding::{Finding, named, short};
use super::materials::MaterialFacts;
use super::shapes::{PartShape, parts};
use crate::simulation::prepare::Prepared;

/// Edge of triangles as a share of the craft, above which shadows have no shape.
const SHADOWED: f64 = 1.0 / 8.0;
/// Edge as a share of its part, above which a part has few nodes along it.
const FEW_NODES: f64 = 0.3;

/// Checks how far the nodes of each part lie apart. `extent` is the size of the craft [m].
pub(super) fn check(prepared: &Prepared, shapes: &[PartShape], facts: &[MaterialFacts], extent: f64) -> Vec<Finding> {
    let mut findings = Vec::new();
    let longest = |shapes: &[&PartShape]| shapes.iter().map(|shape| shape.edge).fold(0.0, f64::max);
    let coarse: Vec<&PartShape> = shapes.iter().filter(|shape| shape.edge > SHADOWED * extent).collect();
    if prepared.scene.shadows.is_some() && prepared.scene.environment.solar_constant.is_some() && !coarse.is_empty() {
        findings.push(Finding {
            check: "mesh",
            about: named("part", &parts(prepared, &coarse)),
            message: format!(
                "edges of {} m are too coarse for shadows: a node has the mean light of its cell, and the craft measures {} m",
                short(longest(&coarse)),
                short(extent)
            ),
            remedy: format!("state model.max_edge = {}, or a [[part]] with a max_edge", short(extent / 20.0)),
        });
    }
    let lengths: Vec<Option<f64>> = facts.iter().map(|fact| fact.conduction_length_m).collect();
    let length = |shape: &PartShape| {
        let lengths = shape.materials.keys().filter_map(|material| lengths[*material as usize]);
        lengths.filter(|length| *length > 0.0).reduce(f64::max)
    };
    // Who states edges shorter than the craft has chosen them. Where the file's own triangles are used, nobody has.
    let density = &prepared.scene.density;
    let chosen = |shape: &PartShape| {
        let edges = density.parts.iter().find(|rule| rule.matches(&prepared.parts[shape.part as usize]));
        let of_model = density.model.max.filter(|_| !density.is_chosen);
        edges.map_or(of_model, |rule| rule.edges.max).is_some_and(|edge| edge < extent)
    };
    let coarse: Vec<&PartShape> = shapes
        .iter()
        .filter(|shape| length(shape).is_some_and(|length| shape.edge > length))
        .filter(|shape| shape.edge > FEW_NODES * shape.extent() && !chosen(shape))
        .collect();
    if let Some(length) = coarse.iter().filter_map(|shape| length(shape)).reduce(f64::min) {
        findings.push(Finding {
            check: "mesh",
            about: named("part", &parts(prepared, &coarse)),
            message: format!(
                "edges of {} m are too coarse for conduction, which evens temperatures out over {} m",
                short(longest(&coarse)),
                short(length)
            ),
            remedy: format!(
                "state model.max_edge = {} where gradients matter, or a [[part]] with a max_edge",
                short(length)
            ),
        });
    }
    findings
}
