//! The pressurised part: modules, adapters, cupola, the visiting capsule.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};

use crate::material::Material::{AnodizedAluminium, BlackPaint, MliBlanket, SilveredTeflon, WhitePaint, WindowGlass};
use crate::mesh::{Band, Lathe, Mesh};

/// Radius of a berthing port [m].
const PORT: f64 = 0.8;
/// Length of a port ring [m].
const RING: f64 = 0.4;
/// Length of the end cone behind it [m].
const CONE: f64 = 0.9;
/// How far the debris shield stands off the end cones [m].
const SHIELD: f64 = 0.1;

/// A module along `axis` (unit) from the outer face of its first port at `origin`: port, cone, shield, cone, port [m].
pub fn pressurised(origin: DVec3, axis: DVec3, length: f64, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let near = RING + CONE;
    let far = length - near;
    mesh.turn(
        &Lathe::round(origin, axis, 24),
        0.0,
        &[
            Band(AnodizedAluminium, 0.0, PORT),
            Band(AnodizedAluminium, RING, PORT),
            Band(MliBlanket, near, radius - SHIELD),
            Band(WhitePaint, near, radius),
            Band(WhitePaint, far, radius),
            Band(WhitePaint, far, radius - SHIELD),
            Band(MliBlanket, length - RING, PORT),
            Band(AnodizedAluminium, length, PORT),
            Band(AnodizedAluminium, length, 0.0),
        ],
    );
    mesh
}

/// A laboratory: a module with the round windows and the equipment row that face nadir (+Z).
pub fn laboratory(origin: DVec3, axis: DVec3, length: f64, radius: f64) -> Mesh {
    let mut mesh = pressurised(origin, axis, length, radius);
    let middle = origin + axis * (length / 2.0);
    let window = middle + DVec3::Z * (radius - 0.1);
    mesh.cylinder(AnodizedAluminium, window, DVec3::Z, 0.5, 0.2);
    mesh.cylinder(WindowGlass, window + DVec3::Z * 0.12, DVec3::Z, 0.36, 0.12);
    for place in [-0.28, 0.28] {
        let size = DVec3::ONE * 0.5 + axis.abs() * 0.7;
        mesh.cuboid(MliBlanket, middle + axis * (length * place) + DVec3::Z * radius, size);
    }
    mesh
}

/// A tunnel of two diameters with a docking ring and a black target at its far end.
pub fn adapter(origin: DVec3, axis: DVec3, length: f64) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.turn(
        &Lathe::round(origin, axis, 24),
        0.0,
        &[
            Band(AnodizedAluminium, 0.0, 1.15),
            Band(AnodizedAluminium, 0.3, 1.15),
            Band(MliBlanket, length - 0.4, 0.8),
            Band(AnodizedAluminium, length - 0.4, 0.9),
            Band(AnodizedAluminium, length, 0.9),
            Band(AnodizedAluminium, length, 0.6),
            Band(BlackPaint, length, 0.0),
        ],
    );
    mesh
}

/// The service module, aft along -X from `origin`: a narrow compartment, then the wide one with its engines.
pub fn service(origin: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.turn(
        &Lathe::round(origin, DVec3::NEG_X, 24),
        0.0,
        &[
            Band(AnodizedAluminium, 0.0, PORT),
            Band(MliBlanket, 0.6, 1.45),
            Band(WhitePaint, 4.6, 1.45),
            Band(MliBlanket, 5.4, 2.05),
            Band(WhitePaint, 11.6, 2.05),
            Band(MliBlanket, 12.4, 1.7),
            Band(BlackPaint, 12.4, 0.0),
        ],
    );
    for (y, z) in [(-0.9, 0.0), (0.9, 0.0)] {
        let nozzle = Lathe::round(origin + dvec3(-12.3, y, z), DVec3::NEG_X, 16);
        let bands = [Band(BlackPaint, 0.0, 0.2), Band(BlackPaint, 0.6, 0.45), Band(BlackPaint, 0.6, 0.0)];
        mesh.turn(&nozzle, 0.0, &bands);
    }
    mesh
}

/// The spherical node between storage and service module [m].
pub fn sphere(centre: DVec3, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let arcs = 10;
    let profile: Vec<Band> = (1..=arcs)
        .map(|arc| {
            let angle = PI * f64::from(arc) / f64::from(arcs);
            // The sine of pi is not quite 0, and a profile must end on its axis.
            let height = if arc == arcs { 0.0 } else { radius * angle.sin() };
            Band(MliBlanket, -radius * angle.cos(), height)
        })
        .collect();
    mesh.turn(&Lathe::round(centre, DVec3::X, 24), -radius, &profile);
    mesh
}

/// Seven panes that look to nadir from `origin` along +Z: six at the sides, one below.
pub fn cupola(origin: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.turn(
        &Lathe { origin, axis: DVec3::Z, segments: 6, faceted: true },
        0.0,
        &[
            Band(AnodizedAluminium, 0.0, 1.5),
            Band(WhitePaint, 0.6, 1.5),
            Band(AnodizedAluminium, 0.75, 1.42),
            Band(WindowGlass, 1.35, 0.95),
            Band(AnodizedAluminium, 1.45, 0.85),
            Band(AnodizedAluminium, 1.45, 0.65),
            Band(WindowGlass, 1.45, 0.0),
        ],
    );
    mesh
}

/// A crew capsule docked by its nose at `origin`, its trunk forward (+X).
pub fn capsule(origin: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.turn(
        &Lathe::round(origin, DVec3::X, 24),
        0.0,
        &[
            Band(AnodizedAluminium, 0.0, 0.7),
            Band(AnodizedAluminium, 0.35, 0.7),
            Band(WhitePaint, 2.7, 1.85),
            Band(BlackPaint, 3.0, 1.75),
            Band(SilveredTeflon, 6.0, 1.75),
            Band(BlackPaint, 6.0, 0.0),
        ],
    );
    mesh
}
