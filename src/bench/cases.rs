//! The four networks of docs/numerics.md 3: the paper's cube, a thin sheet, a sheet with slivers, and a blanket over a
//! structure.
//!
//! Meshes become networks as in a scene ([`Shell`]). The loads come from the paper's cube (`paper/cube.rs`): an orbit of 6017 s in 360 frames with
//! planet shadow, infrared and albedo at 772 km. Each frame has its mean load. docs/numerics.md gives the cells and the stiffness of its cases.
//! Outlines and some loads are chosen here.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::environment::sky::SkyError;
use crate::paper::cube::{
    ALTITUDES, ALUMINIUM, Cube, EDGE, Loads, MLI, Panel, SOLAR_CONSTANTS, SPACE, STEP, STEPS, THICKNESS,
};
use crate::thermal::material::Optics;
use crate::thermal::network::Network;
use crate::thermal::shell::{Sheet, Shell, ShellError, ShellMaterial, ShellSurface};

/// A network and its heat in every frame.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkCase {
    /// Short name, for files.
    pub key: &'static str,
    /// Description for readers.
    pub(crate) title: String,
    /// The network at its initial temperatures.
    pub network: Network,
    /// Heat of every node [W] in each frame, constant within a frame.
    pub(crate) frames: Vec<Vec<f64>>,
    /// Length of a frame [s].
    pub(crate) frame: f64,
    /// Stiffness of the case in docs/numerics.md 3.
    pub(crate) published_stiffness: f64,
}

/// The sizes of the cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Cells along an edge of the cube.
    pub cube: usize,
    /// Cells of 1 cm along an edge of the sheet.
    pub sheet: usize,
    /// Cells of 2 cm along an edge of the structure.
    pub blanket: usize,
    /// Frames of the orbit.
    pub frames: std::ops::Range<usize>,
}

impl Size {
    /// One orbit. The sheets and the structure have 900 to 968 nodes, the cube 2402.
    pub(crate) fn whole() -> Self {
        Self { cube: 20, sheet: 29, blanket: 21, frames: 0..STEPS }
    }

    /// The same meshes for a few frames around the entry into the planet's shadow, at step 97.
    pub(crate) fn quick() -> Self {
        Self { frames: 80..120, ..Self::whole() }
    }
}

/// Thickness of the aluminium [m].
const SKIN: f64 = 1e-3;
/// White paint on both faces of the sheet, with typical published values.
const PAINT: Optics = Optics { absorptivity: 0.25, emissivity: 0.85 };
/// Effective emittance between blanket and structure. Published values for MLI are 0.01 to 0.03.
const EFFECTIVE_EMITTANCE: f64 = 0.02;
/// Widths of the two slivers [m]. The node between them has the published stiffness.
const SLIVERS: [f64; 2] = [2e-4, 4e-4];
/// Peak flux of the spot of reflected sunlight [W/m2]. The spot goes round once an orbit.
const SPOT: f64 = 400.0;
/// Radius of the spot (its standard deviation) [m], and radius of its path as a share of the sheet's edge.
const SPOT_RADIUS: f64 = 0.03;
const SPOT_ORBIT: f64 = 0.3;
/// Heat of the boxes on a quarter of the structure [W/m2].
const DISSIPATION: f64 = 60.0;
/// Initial temperatures [K], near the mean of each case.
const CUBE_START: f64 = 257.0;
const SHEET_START: f64 = 270.0;

/// Builds all four cases.
pub fn all_cases(size: &Size) -> Result<Vec<NetworkCase>, CaseError> {
    Ok(vec![cube(size)?, sheet(size, false)?, sheet(size, true)?, blanket(size)?])
}

/// An error in building a case.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The orbit.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// The mesh.
    #[error(transparent)]
    Shell(#[from] ShellError),
}

/// The paper's conducting cube in aluminium.
pub(crate) fn cube(size: &Size) -> Result<NetworkCase, CaseError> {
    let mut mesh = Mesh::default();
    let at: Vec<f64> = (0..=size.cube).map(|cell| EDGE * (cell as f64 / size.cube as f64 - 0.5)).collect();
    for (face, [normal, u, v]) in AXES.iter().enumerate() {
        mesh.grid(&at, &at, |x, y| 0.5 * EDGE * *normal + x * *u + y * *v, face);
    }
    let bulk = sheet_of(ALUMINIUM, THICKNESS);
    let material =
        ShellMaterial { outer: bulk, emissivity: ALUMINIUM.optics.emissivity, both_sides: false, over: None };
    let shell = mesh.shell(material)?;
    let flux = orbit(ALUMINIUM)?;
    let frames = frames(size, &shell, |frame, vertex| flux[frame][mesh.faces[vertex]]);
    let title = format!("the paper's cube in aluminium, conducting, {0} x {0} cells a face", size.cube);
    Ok(case("cube", title, shell, frames, CUBE_START, 2.2))
}

/// A white sheet of 1 mm aluminium in 1 cm cells. The two faces of the sheet are zenith and nadir faces in the orbit, with a moving spot of reflected
/// sunlight. `slivers` adds two rows of slivers.
pub(crate) fn sheet(size: &Size, slivers: bool) -> Result<NetworkCase, CaseError> {
    let edge = 0.01 * size.sheet as f64;
    let even: Vec<f64> = (0..=size.sheet).map(|cell| 0.01 * cell as f64).collect();
    let mut uneven = even.clone();
    if slivers {
        let middle = size.sheet / 2;
        uneven.splice(middle + 1..middle + 1, [even[middle] + SLIVERS[0], even[middle] + SLIVERS[0] + SLIVERS[1]]);
    }
    let mut mesh = Mesh::default();
    mesh.grid(&uneven, &even, |x, y| DVec3::new(x, y, 0.0), 0);
    let material = ShellMaterial {
        outer: sheet_of(ALUMINIUM, SKIN),
        emissivity: 2.0 * PAINT.emissivity,
        both_sides: true,
        over: None,
    };
    let shell = mesh.shell(material)?;
    let flux = orbit(Panel { optics: PAINT, ..ALUMINIUM })?;
    let frames = frames(size, &shell, |frame, vertex| {
        let faces = &flux[frame];
        faces[4] + faces[5] + spot(mesh.positions[vertex], frame, edge)
    });
    let cells = format!("1 mm aluminium sheet, {0} x {0} cells of 1 cm", size.sheet);
    Ok(if slivers {
        let [thin, thick] = SLIVERS.map(|width| 1e3 * width);
        let title = format!("{cells}, two rows of slivers {thin} and {thick} mm wide, not merged");
        case("slivers", title, shell, frames, SHEET_START, 3.6e4)
    } else {
        case("sheet", cells, shell, frames, SHEET_START, 55.0)
    })
}

/// The paper's MLI without heat capacity over 1 mm of aluminium in 2 cm cells, with boxes on a quarter of it.
pub(crate) fn blanket(size: &Size) -> Result<NetworkCase, CaseError> {
    let at: Vec<f64> = (0..=size.blanket).map(|cell| 0.02 * cell as f64).collect();
    let edge = 0.02 * size.blanket as f64;
    let mut mesh = Mesh::default();
    mesh.grid(&at, &at, |x, y| DVec3::new(x, y, 0.0), 0);
    let material = ShellMaterial {
        outer: Sheet::default(),
        emissivity: MLI.optics.emissivity,
        both_sides: false,
        over: Some((sheet_of(ALUMINIUM, SKIN), EFFECTIVE_EMITTANCE)),
    };
    let shell = mesh.shell(material)?;
    let flux = orbit(MLI)?;
    let mut frames = frames(size, &shell, |frame, _| flux[frame][4]);
    for (vertex, node) in shell.structure_of_vertex.iter().enumerate() {
        let position = mesh.positions[vertex];
        if position.x < 0.5 * edge && position.y < 0.5 * edge {
            let heat = DISSIPATION * shell.load_areas[vertex];
            frames.iter_mut().for_each(|frame| frame[*node as usize] += heat);
        }
    }
    let title = format!("MLI blanket (C = 0) over 1 mm of aluminium, {0} x {0} cells of 2 cm", size.blanket);
    Ok(case("blanket", title, shell, frames, SHEET_START, 14.0))
}

impl NetworkCase {
    /// Frame length over the longest stable forward Euler step. The temperature [K] is above all in the case.
    pub(crate) fn stiffness(&self) -> f64 {
        0.5 * self.frame * self.network.fastest_rate(&vec![400.0; self.network.len()])
    }
}

/// Outward normal of every face, in the order of [`crate::paper::cube::FACES`], and the two directions along it.
const AXES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::NEG_X, DVec3::Z, DVec3::Y],
    [DVec3::Y, DVec3::Z, DVec3::X],
    [DVec3::NEG_Y, DVec3::X, DVec3::Z],
    [DVec3::Z, DVec3::X, DVec3::Y],
    [DVec3::NEG_Z, DVec3::Y, DVec3::X],
];

/// A triangulated surface with one part and one material.
#[derive(Default)]
struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Face of each vertex.
    faces: Vec<usize>,
}

impl Mesh {
    /// Adds a grid of rectangles with two triangles each.
    fn grid(&mut self, xs: &[f64], ys: &[f64], place: impl Fn(f64, f64) -> DVec3, face: usize) {
        let first = self.positions.len() as u32;
        for y in ys {
            self.positions.extend(xs.iter().map(|x| place(*x, *y)));
            self.faces.extend(xs.iter().map(|_| face));
        }
        let row = xs.len() as u32;
        for j in 0..ys.len() as u32 - 1 {
            for i in 0..row - 1 {
                let a = first + j * row + i;
                self.triangles.extend([[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
            }
        }
    }

    fn shell(&self, material: ShellMaterial) -> Result<Shell, ShellError> {
        let zeros = vec![0; self.positions.len()];
        let surface =
            ShellSurface { positions: &self.positions, triangles: &self.triangles, parts: &zeros, materials: &zeros };
        // Merging is off, because it would remove the slivers.
        Shell::new(&surface, &[Some(material)], &[], None, f64::INFINITY, SPACE)
    }
}

fn sheet_of(panel: Panel, thickness: f64) -> Sheet {
    Sheet { capacitance: panel.heat_capacity * thickness, conductance: panel.conductivity * thickness, thickness }
}

/// Flux absorbed by the faces of a body in the paper's orbit [W/m2] in each frame.
fn orbit(panel: Panel) -> Result<Vec<[f64; 6]>, SkyError> {
    let [solar_constant, _] = SOLAR_CONSTANTS;
    let [_, altitude] = ALTITUDES;
    Cube { panel, conducting: true, loads: Loads::All, solar_constant, altitude }.absorbed()
}

/// Flux of the spot at a position [W/m2].
fn spot(position: DVec3, frame: usize, edge: f64) -> f64 {
    let angle = TAU * frame as f64 / STEPS as f64;
    let centre = 0.5 * edge * DVec3::ONE + SPOT_ORBIT * edge * DVec3::new(angle.cos(), angle.sin(), 0.0);
    let distance = (position - centre).truncate().length() / SPOT_RADIUS;
    SPOT * (-0.5 * distance * distance).exp()
}

/// Heat of every node in each frame [W], from the flux at each vertex [W/m2].
fn frames(size: &Size, shell: &Shell, flux: impl Fn(usize, usize) -> f64) -> Vec<Vec<f64>> {
    let one = |frame: usize| {
        let mut heat = vec![0.0; shell.network.len()];
        shell.gather(|vertex| flux(frame, vertex), &mut heat);
        heat
    };
    size.frames.clone().map(one).collect()
}

fn case(
    key: &'static str,
    title: String,
    shell: Shell,
    frames: Vec<Vec<f64>>,
    start: f64,
    published_stiffness: f64,
) -> NetworkCase {
    let mut network = shell.network;
    network.temperatures = vec![start; network.len()];
    NetworkCase { key, title, network, frames, frame: STEP, published_stiffness }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::NodeKind;

    #[test]
    fn the_stiffness_is_that_of_the_table() {
        for case in all_cases(&Size { frames: 0..1, ..Size::whole() }).unwrap() {
            let ratio = case.stiffness() / case.published_stiffness;
            // docs/numerics.md 3 gives two digits. The slivers only approximate it.
            assert!((0.9..1.1).contains(&ratio), "{}: {} of {}", case.key, case.stiffness(), case.published_stiffness);
        }
    }

    #[test]
    fn areas_capacitances_and_heat_are_those_of_the_bodies() {
        let cases = all_cases(&Size { frames: 0..1, ..Size::whole() }).unwrap();
        let [cube, sheet, slivers, blanket] = &cases[..] else { panic!("four cases") };
        // 20 x 20 cells a face share edges and corners, so there are 6 n^2 + 2 nodes.
        assert_eq!(cube.network.len(), 6 * 400 + 2);
        let stored = |case: &NetworkCase| case.network.capacitances.iter().sum::<f64>();
        let capacity = ALUMINIUM.heat_capacity;
        assert!((stored(cube) / (6.0 * THICKNESS * capacity) - 1.0).abs() < 1e-9);
        for sheet in [sheet, slivers] {
            assert!((stored(sheet) / (0.29 * 0.29 * SKIN * capacity) - 1.0).abs() < 1e-9);
        }
        assert!((stored(blanket) / (0.42 * 0.42 * SKIN * capacity) - 1.0).abs() < 1e-9);
        assert_eq!(blanket.network.kinds.iter().filter(|kind| **kind == NodeKind::Arithmetic).count(), 22 * 22);
        let flux = orbit(ALUMINIUM).unwrap();
        let heat: f64 = cube.frames[0].iter().sum();
        assert!((heat / flux[0].iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}
