//! Finds probable mistakes in a scene that can run: a camera that sees nothing, a model in millimetres, a thickness in the wrong
//! unit.
//!
//! Nothing is stepped and no device is used. Each finding names its subject and gives advice.

use glam::DVec3;

use crate::simulation::facade::Simulation;
use crate::simulation::prepare::Prepared;
use finding::{CheckEffort, Finding};
use materials::MaterialFacts;
use neighbours::NeighbourFacts;
use shapes::PartShape;
use view::Sight;

pub(crate) mod finding;
pub(crate) mod identity;
pub(crate) mod materials;
mod meshes;
pub(crate) mod neighbours;
mod settings;
mod shapes;
mod view;

/// The facts that the checks look at, and their findings.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Checked {
    /// Lower and upper corner of the box around the craft, in the body frame and the file's pose [m].
    pub(crate) bounds_m: [[f64; 3]; 2],
    /// The craft in the images. `None` where the scene draws none.
    pub(crate) sight: Option<Sight>,
    pub(crate) materials: Vec<MaterialFacts>,
    /// Neighbours in the network without contact, the closest first.
    pub(crate) neighbours: Vec<NeighbourFacts>,
    /// The probable mistakes.
    pub findings: Vec<Finding>,
}

impl Checked {
    /// Size of the craft along the body axes [m].
    pub(crate) fn size_m(&self) -> [f64; 3] {
        let [low, high] = self.bounds_m;
        [0, 1, 2].map(|axis| high[axis] - low[axis])
    }
}

/// Lower and upper corner of the box around the craft, in the body frame and the file's pose [m].
pub(crate) fn bounds(prepared: &Prepared) -> [DVec3; 2] {
    let corners = prepared.triangles.iter().flatten().map(|node| prepared.nodes.positions[*node as usize].as_dvec3());
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    corners.fold(none, |[low, high], corner| [low.min(corner), high.max(corner)])
}

/// Whether a place in the body frame and the file's pose [m] lies off the craft.
pub(crate) fn is_off_craft(prepared: &Prepared, place: DVec3) -> bool {
    settings::is_beside(place, bounds(prepared))
}

/// Checks a scene.
pub fn check(prepared: &Prepared, effort: CheckEffort) -> Checked {
    let shapes = shapes::of(prepared);
    let [low, high] = box_around(&shapes);
    let (sight, mut findings) = view::check(prepared, &shapes, effort);
    findings.extend(prepared.model.idle_patterns.iter().map(|(section, message)| Finding {
        check: "names",
        about: (*section).to_owned(),
        message: message.clone(),
        remedy: "correct the pattern, or leave it out".to_owned(),
    }));
    let materials = materials::facts(prepared);
    findings.extend(shapes::check(prepared, &shapes, high - low));
    findings.extend(materials::check(prepared, &shapes, &materials));
    findings.extend(meshes::check(prepared, &shapes, &materials, (high - low).max_element()));
    findings.extend(settings::check(prepared, &materials, [low, high]));
    let neighbours = neighbours::facts(prepared);
    findings.extend(neighbours::check(prepared, &neighbours, neighbours::NAMED));
    Checked { bounds_m: [low.to_array(), high.to_array()], sight, materials, neighbours, findings }
}

fn box_around(shapes: &[PartShape]) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    shapes.iter().fold(none, |[low, high], shape| [low.min(shape.low), high.max(shape.high)])
}

/// Names of probes and places in the body frame [m] that lie off the craft.
pub(crate) fn probes_off<'a>(prepared: &Prepared, probes: impl Iterator<Item = (&'a str, DVec3)>) -> Option<Finding> {
    settings::find_off(probes, box_around(&shapes::of(prepared)))
}

/// Names of key points and places in the body frame [m] that lie off the craft.
pub(crate) fn key_points_off<'a>(
    prepared: &Prepared,
    points: impl Iterator<Item = (&'a str, DVec3)>,
) -> Option<Finding> {
    settings::find_beside(("key point", "lies off the craft"), points, box_around(&shapes::of(prepared)))
}

/// The warnings of a scene, and the probable mistakes in it.
pub(crate) fn warnings(prepared: &Prepared, effort: CheckEffort) -> Vec<String> {
    let findings = check(prepared, effort).findings;
    prepared.warnings.iter().cloned().chain(findings.iter().map(Finding::to_string)).collect()
}

impl Simulation {
    /// Remarks about the scene, and what is probably wrong in it, as `isotherm check` tells them.
    pub fn warnings(&self) -> Vec<String> {
        warnings(self.prepared(), CheckEffort::BRIEF)
    }
}
