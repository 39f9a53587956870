//! Deployed parts: array wings and radiators. All are sheets that exchange heat on both faces.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use crate::material::Material;
use crate::mesh::Mesh;

/// Length of an array blanket [m].
pub const BLANKET_LENGTH: f64 = 32.5;
/// Width of an array blanket [m]; a wing has two, one on each side of its mast.
pub const BLANKET_WIDTH: f64 = 5.35;
/// Distance from the mast's axis to a blanket [m].
const BLANKET_GAP: f64 = 0.55;
/// Distance from the beta joint to the blankets [m].
const BLANKET_START: f64 = 2.5;

/// An array wing along X from its beta joint at the origin; `end` is 1 for forward, -1 for aft. The cells face -Z.
pub fn wing(end: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let along = DVec3::X * end;
    mesh.cylinder(Material::AnodizedAluminium, along * 0.05, along, 0.45, 2.3);
    let tip = BLANKET_START + BLANKET_LENGTH;
    mast(&mut mesh, along * 2.2, along, tip - 2.1);
    // The boxes that the blankets unfold from and the bar that pulls them out.
    for (from, to, depth) in [(2.1, BLANKET_START, 0.36), (tip, tip + 0.3, 0.2)] {
        let size = dvec3(to - from, 2.0 * (BLANKET_GAP + BLANKET_WIDTH) + 0.1, depth);
        mesh.cuboid(Material::MliBlanket, along * ((from + to) / 2.0), size);
    }
    for side in [-1.0, 1.0] {
        let inner = BLANKET_GAP * side;
        let outer = (BLANKET_GAP + BLANKET_WIDTH) * side;
        // length x width is -Z: along +X the width runs towards -Y, along -X towards +Y.
        let (start, stop) = if end * side > 0.0 { (outer, inner) } else { (inner, outer) };
        let corner = dvec3(BLANKET_START * end, start, 0.0);
        let width = DVec3::Y * (stop - start);
        mesh.sheet(Material::SolarCells, corner, along * BLANKET_LENGTH, width, 13, 0.0);
    }
    mesh
}

/// A three-sided lattice mast: three longerons and a lacing that winds around them.
fn mast(mesh: &mut Mesh, start: DVec3, along: DVec3, length: f64) {
    let bays = 7;
    let corner = |bay: u32, side: u32| {
        let (sine, cosine) = (TAU * f64::from(side % 3) / 3.0).sin_cos();
        start + along * (length * f64::from(bay) / f64::from(bays)) + dvec3(0.0, 0.36 * sine, 0.36 * cosine)
    };
    for side in 0..3 {
        mesh.strut(Material::ArrayMast, corner(0, side), corner(bays, side), 0.07);
        for bay in 0..bays {
            mesh.strut(Material::ArrayMast, corner(bay, side), corner(bay + 1, side + 1), 0.045);
        }
    }
}

/// A group of three central radiators that run aft from a joint at the origin, side by side along the unit vector
/// `across`.
pub fn central_radiator(across: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.cylinder(Material::AnodizedAluminium, DVec3::X * -0.05, DVec3::NEG_X, 0.6, 1.0);
    let beam = [DVec3::X * 0.25, across * 5.1, DVec3::X.cross(across) * 0.25];
    mesh.block(Material::AnodizedAluminium, DVec3::X * -1.2, beam);
    for place in [-1.0, 0.0, 1.0] {
        let corner = DVec3::X * -1.5 + across * (3.6 * place - 1.6);
        let length = DVec3::X * -20.0;
        mesh.sheet(Material::RadiatorPanel, corner, length, across * 3.2, 8, 0.1);
        // The scissor arm behind the panels.
        let arm = DVec3::X.cross(across) * 0.2 + across * (3.6 * place);
        mesh.strut(Material::AnodizedAluminium, arm + DVec3::X * -1.3, arm + DVec3::X * -21.4, 0.12);
    }
    mesh
}

/// A photovoltaic radiator that hangs along +Z from its joint at the origin, faces towards +X and -X.
pub fn photovoltaic_radiator() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.cylinder(Material::AnodizedAluminium, DVec3::Z * 0.05, DVec3::Z, 0.4, 0.7);
    mesh.cuboid(Material::AnodizedAluminium, DVec3::Z * 0.9, dvec3(0.5, 3.3, 0.5));
    mesh.sheet(Material::RadiatorPanel, dvec3(0.0, 1.7, 1.2), DVec3::Z * 12.4, DVec3::Y * -3.4, 7, 0.1);
    let arm = DVec3::X * 0.2;
    mesh.strut(Material::AnodizedAluminium, arm + DVec3::Z * 1.0, arm + DVec3::Z * 13.5, 0.1);
    mesh
}
