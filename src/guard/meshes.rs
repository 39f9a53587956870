//! Meshes whose nodes lie too far apart to show shadows or to conduct heat along a part, and sheets that are drawn twice.

use std::collections::HashMap;

use super::finding::{Finding, named, short};
use super::materials::MaterialFacts;
use super::shapes::{PartShape, corners, parts};
use crate::model::nodes::GROUP;
use crate::simulation::prepare::Prepared;
use crate::thermal::material::{Response, Sides};

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
    findings.extend(find_doubled_sheets(prepared, shapes));
    findings
}

/// Finds parts of a network that have one face of a sheet twice in one place. Two faces that look apart are the two sides of a body, unless each stands for both sides.
fn find_doubled_sheets(prepared: &Prepared, shapes: &[PartShape]) -> Option<Finding> {
    let doubled_area = |shape: &PartShape| {
        let mut seen: HashMap<_, usize> = HashMap::new();
        let mut doubled = 0.0;
        for triangle in &shape.triangles {
            let slot = prepared.triangles[*triangle as usize][0] as usize;
            let number = prepared.nodes.group_material[slot / GROUP];
            let material = &prepared.materials[number as usize];
            if material.response != Response::Network {
                continue;
            }
            let [a, b, c] = corners(prepared, *triangle);
            // The corners from the least on, so that only the way round tells two faces of one place apart.
            let mut ring = [a, b, c].map(|at| (at + 0.0).to_array().map(f64::to_bits));
            let least = (0..3).min_by_key(|corner| ring[*corner]).unwrap_or(0);
            ring.rotate_left(least);
            if matches!(material.sides, Sides::Both { .. }) {
                ring.sort_unstable();
            }
            let times = seen.entry((number, ring)).or_default();
            *times += 1;
            if *times > 1 {
                doubled += 0.5 * (b - a).cross(c - a).length();
            }
        }
        doubled
    };
    let areas = shapes.iter().map(|shape| (shape, doubled_area(shape)));
    let doubled: Vec<(&PartShape, f64)> = areas.filter(|(_, area)| *area > 0.0).collect();
    let about: Vec<&PartShape> = doubled.iter().map(|(shape, _)| *shape).collect();
    (!doubled.is_empty()).then(|| Finding {
        check: "mesh",
        about: named("part", &parts(prepared, &about)),
        message: format!(
            "{} m2 are drawn twice in one place: each of the two sheets stores, conducts and radiates",
            short(doubled.iter().map(|(_, area)| area).sum())
        ),
        remedy: "remove one of the two from the model".to_owned(),
    })
}
