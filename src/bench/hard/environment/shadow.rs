//! Hard case: the shadow edge of a disc that leaves a plate as the Sun sets.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use crate::bench::hard::case::{CaseScale, HardCase};
use crate::environment::shadow::{Caster, LitArea, LitAreas, LitNode, LitSurface, Redraw};
use crate::environment::{StepLoad, SunSample};

/// Edge of the plate, height of the disc above it, and radius of the disc [m].
const EDGE: f64 = 4.0;
const HEIGHT: f64 = 2.0;
const RADIUS: f64 = 0.8;
/// Nodes along an edge of the plate, and number of disc corners.
const NODES: usize = 65;
const CORNERS: usize = 256;
/// Turn of the Sun after which light is found anew [rad].
const REDRAW: f64 = 1e-3;

/// Positions of the plate nodes, the disc centre and the disc corners [m].
fn positions() -> Vec<DVec3> {
    let place = |i: usize| EDGE * (i as f64 / (NODES - 1) as f64 - 0.5);
    let plate = (0..NODES).flat_map(|i| (0..NODES).map(move |j| DVec3::new(place(i), place(j), 0.0)));
    let corner = |i: usize| {
        let (sine, cosine) = (2.0 * PI * i as f64 / CORNERS as f64).sin_cos();
        DVec3::new(RADIUS * cosine, RADIUS * sine, HEIGHT)
    };
    plate.chain([DVec3::new(0.0, 0.0, HEIGHT)]).chain((0..CORNERS).map(corner)).collect()
}

/// Triangles of the plate.
fn plate() -> Vec<[u32; 3]> {
    let node = |i: usize, j: usize| (i * NODES + j) as u32;
    let cells = (0..NODES - 1).flat_map(|i| (0..NODES - 1).map(move |j| (i, j)));
    let halves = |(i, j)| {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    cells.flat_map(halves).collect()
}

/// Triangles of the disc.
fn disc() -> Vec<[u32; 3]> {
    let centre = (NODES * NODES) as u32;
    let corner = |i: usize| centre + 1 + (i % CORNERS) as u32;
    (0..CORNERS).map(|i| [centre, corner(i), corner(i + 1)]).collect()
}

/// Shifts of the shadow along X [m], from the middle of the plate until it has left.
fn shifts(scale: CaseScale) -> Vec<f64> {
    let count = scale.of(8, 15, 30);
    (0..=count).map(|step| (0.5 * EDGE + RADIUS) * f64::from(step) / f64::from(count)).collect()
}

fn load(shift: f64) -> StepLoad {
    let direction = DVec3::new(-shift, 0.0, HEIGHT).normalize();
    StepLoad {
        start: 0.0,
        sun: vec![SunSample { direction, flux: 1361.0 }],
        planet: None,
        albedo: None,
        background_temperature: 2.7,
        joints: Vec::new(),
    }
}

/// Shadow area that remains on the plate [m2].
fn area(shift: f64) -> f64 {
    // The part beyond the edge is a segment of the disc.
    let inside = ((0.5 * EDGE - shift) / RADIUS).clamp(-1.0, 1.0);
    RADIUS * RADIUS * (PI - inside.acos() + inside * (1.0 - inside * inside).sqrt())
}

fn bounds() -> [DVec3; 2] {
    [DVec3::new(-0.5 * EDGE, -0.5 * EDGE, 0.0), DVec3::new(0.5 * EDGE, 0.5 * EDGE, HEIGHT)]
}

/// The plate below the disc.
fn light(angle: f64) -> LitAreas {
    let positions = positions();
    let casters = vec![Caster::new(0, &positions, &disc())];
    let nodes = (0..(NODES * NODES) as u32).map(LitNode::on_plate).collect();
    let surface = LitSurface { positions, triangles: plate(), casters, spacing: 0.02, times: 1 };
    LitAreas::new(Arc::new(surface), nodes, Redraw { bounds: vec![(0, bounds())], angle, found_for: None })
}

/// Area of the shadow on a node [m2].
fn shaded(node: usize, lit: &LitArea) -> f64 {
    let is_end = |place: usize| place == 0 || place == NODES - 1;
    let halves = i32::from(is_end(node / NODES)) + i32::from(is_end(node % NODES));
    // Corners of a triangulated grid: opposite corners of the plate have one or two thirds of a quarter.
    let corner = match (node < NODES, node.is_multiple_of(NODES)) {
        _ if halves < 2 => 0.5f64.powi(halves),
        (first, second) if first == second => 1.0 / 3.0,
        _ => 1.0 / 6.0,
    };
    corner * (EDGE / (NODES - 1) as f64).powi(2) * (1.0 - lit.vector.z)
}

/// Largest error over all shifts, in percent of the whole shadow.
fn error(scale: CaseScale, angle: f64) -> f64 {
    let mut light = light(angle);
    let mut last = Vec::new();
    let of_shift = |shift: f64| {
        if let Some(found) = light.find(&load(shift)) {
            last = found;
        }
        let shaded: f64 = last.iter().enumerate().map(|(node, lit)| shaded(node, lit)).sum();
        100.0 * (shaded - area(shift)).abs() / (PI * RADIUS * RADIUS)
    };
    shifts(scale).into_iter().map(of_shift).fold(0.0, f64::max)
}

/// The case. The host finds the light of every device.
pub(crate) fn cases() -> Vec<HardCase> {
    let case = HardCase::new(
        "moving shadow edge".to_owned(),
        "a disc 2 m above a plate of 65 x 65 nodes, whose shadow moves off its edge; area of the part of a disc",
        "% of the shadow",
        (1.0, "docs/numerics.md 6, lit area"),
    )
    .remedy("light is found again when the Sun has moved by more than a stated angle", "found once")
    .measured(move |_, scale| Ok(error(scale, REDRAW)), move |_| error(CaseScale::Small, PI));
    vec![case]
}
