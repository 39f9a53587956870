//! The integrated truss along Y: lattice segments, what sits inside them, the drums of the alpha joints.

use glam::{DVec3, dvec3};

use crate::material::Material;
use crate::mesh::Mesh;

/// A box lattice along Y.
struct Lattice {
    /// Middle of the first frame [m].
    start: DVec3,
    /// Signed length of a bay along Y [m].
    bay: f64,
    /// Number of bays.
    bays: u32,
    /// Distance between the middles of two longerons [m].
    width: f64,
}

impl Lattice {
    /// Middle of longeron `corner` (counted around the section) at frame `frame`.
    fn corner(&self, frame: u32, corner: u32) -> DVec3 {
        let (x, z) = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)][(corner % 4) as usize];
        let half = self.width / 2.0;
        self.start + dvec3(x * half, self.bay * f64::from(frame), z * half)
    }

    /// Four longerons, a square frame at each end of a bay, a diagonal in each face of a bay. Members of different
    /// width keep their faces apart where they cross.
    fn build(&self, mesh: &mut Mesh) {
        let material = Material::AluminiumTruss;
        for side in 0..4 {
            mesh.strut(material, self.corner(0, side), self.corner(self.bays, side), 0.24);
            for frame in 0..=self.bays {
                mesh.strut(material, self.corner(frame, side), self.corner(frame, side + 1), 0.16);
            }
            for bay in 0..self.bays {
                // Neighbouring bays lean opposite ways.
                let (near, far) = if bay % 2 == 0 { (side, side + 1) } else { (side + 1, side) };
                mesh.strut(material, self.corner(bay, near), self.corner(bay + 1, far), 0.11);
            }
        }
    }
}

/// The fixed truss between the alpha joints: 48 m, with its equipment and the fixed half of each drum.
/// The origin is the middle of the truss.
pub fn central() -> Mesh {
    let mut mesh = Mesh::default();
    Lattice { start: dvec3(0.0, -24.0, 0.0), bay: 4.0, bays: 12, width: 4.0 }.build(&mut mesh);
    for side in [-1.0, 1.0] {
        let boxes = [
            (Material::MliBlanket, dvec3(0.3, 6.0, 0.2), dvec3(2.4, 2.6, 2.2)),
            (Material::WhitePaint, dvec3(-0.4, 10.0, 0.0), dvec3(2.0, 3.0, 2.6)),
            (Material::MliBlanket, dvec3(0.0, 14.0, 0.4), dvec3(2.8, 2.2, 2.0)),
            (Material::AnodizedAluminium, dvec3(0.5, 18.2, -0.3), dvec3(1.8, 2.0, 2.4)),
            (Material::MliBlanket, dvec3(0.0, 22.0, 0.0), dvec3(2.4, 2.6, 2.4)),
        ];
        for (material, centre, size) in boxes {
            mesh.cuboid(material, centre * dvec3(1.0, side, 1.0), size);
        }
        let face = dvec3(0.0, 23.9 * side, 0.0);
        mesh.cylinder(Material::AnodizedAluminium, face, DVec3::Y * side, 1.7, 1.05);
    }
    // The tank assembly above the middle of the truss.
    for x in [-1.0, 1.0] {
        mesh.cylinder(Material::WhitePaint, dvec3(x, -1.6, -0.3), DVec3::Y, 0.8, 3.2);
    }
    mesh
}

/// The turning truss outboard of an alpha joint: 24 m, with the battery boxes and the fixed halves of the beta joints.
/// The origin is the alpha joint; `side` is -1 for port, 1 for starboard.
pub fn outboard(side: f64, beta_stations: [f64; 2], beta_offset: f64) -> Mesh {
    let mut mesh = Mesh::default();
    Lattice { start: dvec3(0.0, 1.0 * side, 0.0), bay: 3.0 * side, bays: 8, width: 3.0 }.build(&mut mesh);
    mesh.cylinder(Material::AnodizedAluminium, dvec3(0.0, 0.05 * side, 0.0), DVec3::Y * side, 1.5, 1.05);
    for station in beta_stations {
        let centre = dvec3(0.0, station * side, 0.0);
        mesh.cuboid(Material::MliBlanket, centre, dvec3(1.9, 1.8, 1.7));
        mesh.cuboid(Material::WhitePaint, centre + dvec3(0.0, -2.6 * side, -0.9), dvec3(2.4, 2.0, 0.9));
        mesh.cuboid(Material::AnodizedAluminium, centre + dvec3(0.0, -2.6 * side, 0.7), dvec3(2.2, 1.8, 1.1));
        for end in [-1.0, 1.0] {
            let root = centre + DVec3::X * (0.9 * end);
            mesh.cylinder(Material::AnodizedAluminium, root, DVec3::X * end, 0.55, beta_offset - 0.95);
        }
    }
    mesh
}
