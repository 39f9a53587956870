//! The paper's hollow cube in orbit: panels as nodes of a thermal network, and the heat of every step.
//!
//! Each panel of 1 m x 1 m x 0.1 m is a node that radiates from its outer face only. Neighbours conduct between their
//! middles, half a metre in either panel: GL = k A / L with A = 1 m x 0.1 m and L = 1 m, which is 20 W/K in aluminium.
//! The circular orbit takes 6017 s in 360 steps, with beta 0 and a nadir-pointing cube. Orbit noon is at step 340, so
//! the start is 20 degrees after noon. The paper gives the materials.

use std::fmt;

use glam::DVec3;

use crate::environment::load::{exact_albedo_flux, planet_ir_flux, solar_flux};
use crate::environment::orbit::{PeriodDisagreement, period_disagreement};
use crate::environment::sky::SkyError;
use crate::environment::step::StepLoads;
use crate::environment::{Attitude, CircularOrbit, Environment};
use crate::thermal::balance::{Incident, absorbed_by_face};
use crate::thermal::material::Optics;
use crate::thermal::network::{LinearConductor, Network, NodeKind};

/// Steps of an orbit.
pub const STEPS: usize = 360;
/// Orbit period in the paper [s].
pub(crate) const PERIOD: f64 = 6017.0;
/// Length of a step [s].
pub const STEP: f64 = PERIOD / STEPS as f64;
/// Altitude in the paper, and the altitude that fits its period (docs/numerics.md 2) [m].
pub const ALTITUDES: [f64; 2] = [224e3, 772e3];
/// Solar constants of docs/numerics.md 2 [W/m2]. The paper states none.
pub const SOLAR_CONSTANTS: [f64; 2] = [1361.0, 1367.0];
/// Equatorial radius of docs/numerics.md 2 [m].
pub(crate) const PLANET_RADIUS: f64 = 6_378_137.0;
/// Radiative temperature of space [K].
pub(crate) const SPACE: f64 = 2.7;
/// Infrared exitance [W/m2] and Bond albedo of the planet (docs/numerics.md 2).
const PLANET: (f64, f64) = (237.0, 0.3);
/// Edge of a panel [m].
pub(crate) const EDGE: f64 = 1.0;
/// Thickness of a panel [m].
pub(crate) const THICKNESS: f64 = 0.1;

/// Faces in node order. +Z points to the zenith, +X along the velocity, and Y along the orbit normal, where the Sun
/// never stands.
pub(crate) const FACES: [&str; 6] = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"];
/// Index of the face along the orbit normal.
pub(crate) const SIDE: usize = 2;
/// Index of the zenith face.
pub(crate) const ZENITH: usize = 4;

const NORMALS: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// Material properties of the panels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Absorptivity and emissivity of the outer face.
    pub(crate) optics: Optics,
    /// Conductivity k [W m-1 K-1].
    pub(crate) conductivity: f64,
    /// Volumetric heat capacity rho c [J m-3 K-1]. The value is 0 for panels that store no heat.
    pub(crate) heat_capacity: f64,
}

/// Aluminium 6061.
pub const ALUMINIUM: Panel = Panel {
    optics: Optics { absorptivity: 0.18, emissivity: 0.21 },
    conductivity: 200.0,
    heat_capacity: 2700.0 * 900.0,
};

/// Goldized MLI.
pub(crate) const MLI: Panel =
    Panel { optics: Optics { absorptivity: 0.19, emissivity: 0.02 }, conductivity: 0.01, heat_capacity: 0.0 };

/// The loads on the panels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loads {
    /// The Sun without the planet's shadow.
    Sun,
    /// The Sun with the planet's shadow.
    SunAndShadow,
    /// Sun with shadow, planet infrared and albedo.
    All,
    /// All but the albedo.
    AllButAlbedo,
}

/// A cube in an orbit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cube {
    /// Material properties of the panels.
    pub panel: Panel,
    /// Whether the panels conduct heat to each other.
    pub conducting: bool,
    /// Loads on the cube.
    pub loads: Loads,
    /// Solar constant [W/m2].
    pub solar_constant: f64,
    /// Altitude [m].
    pub altitude: f64,
}

impl fmt::Display for Cube {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let material = if self.panel == MLI { "MLI" } else { "Al" };
        let conducting = if self.conducting { " and conducting" } else { "" };
        write!(out, "{material}, radiating{conducting}")
    }
}

/// Temperatures of the faces [K] at steps 0 to [`STEPS`] of a periodic orbit.
pub(crate) type FaceOrbit = Vec<[f64; 6]>;

/// The input of a solver: a network and the heat of every node [W] in steps 0 to `STEPS - 1`. Step n lasts from (n -
/// 1/2) to (n + 1/2) times `STEP` with constant heat. Step `STEPS` is step 0 of the next orbit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CubeProblem {
    /// The panels.
    pub(crate) network: Network,
    /// Heat of every face [W] at every step.
    pub(crate) heat: Vec<[f64; 6]>,
}

impl CubeProblem {
    /// Heat of a face as pairs of time [s] and power [W] from 0 to [`PERIOD`]. The power jumps between steps.
    pub(crate) fn table(&self, face: usize) -> Vec<[f64; 2]> {
        let power = |step: usize| self.heat[step % self.heat.len()][face];
        let jumps = (0..self.heat.len()).flat_map(|step| {
            let time = (step as f64 + 0.5) * STEP;
            [[time, power(step)], [time, power(step + 1)]]
        });
        let ends = ([0.0, power(0)], [PERIOD, power(0)]);
        std::iter::once(ends.0).chain(jumps).chain([ends.1]).collect()
    }
}

impl Cube {
    /// The network and its heat.
    pub(crate) fn problem(&self) -> Result<CubeProblem, SkyError> {
        let heat = self.absorbed()?.into_iter().map(|faces| faces.map(|flux| EDGE * EDGE * flux)).collect();
        Ok(CubeProblem { network: self.network(), heat })
    }

    /// Mean absorbed flux of every face in each of the [`STEPS`] steps [W/m2]. Time `index * STEP` is the middle of the
    /// step.
    pub(crate) fn absorbed(&self) -> Result<Vec<[f64; 6]>, SkyError> {
        let loads = self.sky_loads()?;
        let flux = |step: usize| {
            let middle = step as f64 * STEP;
            let load = loads.step_load(middle - 0.5 * STEP, middle + 0.5 * STEP);
            NORMALS.map(|normal| {
                let incident = Incident {
                    solar: solar_flux(&load, normal),
                    albedo: exact_albedo_flux(&load, normal),
                    planet_ir: planet_ir_flux(&load, normal),
                };
                absorbed_by_face(self.panel.optics, incident)
            })
        };
        Ok((0..STEPS).map(flux).collect())
    }

    /// Steps at which the planet covers and uncovers half of the Sun. `None` without shadow.
    pub(crate) fn shadow(&self) -> Result<Option<[f64; 2]>, SkyError> {
        let contacts = self.sky_loads()?.sky_model().contacts(0.0, PERIOD);
        Ok(match contacts[..] {
            [penumbra, umbra, umbra_end, penumbra_end] => {
                Some([0.5 * (penumbra + umbra) / STEP, 0.5 * (umbra_end + penumbra_end) / STEP])
            }
            _ => None,
        })
    }

    /// The disagreement between period and altitude. Both are used as given.
    pub(crate) fn period_disagreement(&self) -> Option<PeriodDisagreement> {
        period_disagreement(&self.orbit(), PLANET_RADIUS)
    }

    fn network(&self) -> Network {
        let Panel { optics, conductivity, heat_capacity } = self.panel;
        let capacitance = heat_capacity * EDGE * EDGE * THICKNESS;
        let kind = if capacitance > 0.0 { NodeKind::Diffusive } else { NodeKind::Arithmetic };
        let conductance = conductivity * (EDGE * THICKNESS) / EDGE;
        let pairs = (0..6u32).flat_map(|a| (a + 1..6).map(move |b| [a, b]));
        let adjacent = pairs.filter(|[a, b]| a / 2 != b / 2 && self.conducting);
        Network {
            space_temperature: SPACE,
            kinds: vec![kind; 6],
            capacitances: vec![capacitance; 6],
            emissive_areas: vec![optics.emissivity * EDGE * EDGE; 6],
            temperatures: vec![START; 6],
            linear: adjacent.map(|nodes| LinearConductor { nodes, conductance }).collect(),
            radiative: Vec::new(),
        }
    }

    fn orbit(&self) -> CircularOrbit {
        CircularOrbit { altitude: self.altitude, period: PERIOD, beta: 0.0, phase: 20f64.to_radians() }
    }

    /// The loads of its orbit.
    pub fn sky_loads(&self) -> Result<StepLoads, SkyError> {
        let (planet_ir, albedo) = match self.loads {
            Loads::Sun | Loads::SunAndShadow => (None, None),
            Loads::All => (Some(PLANET.0), Some(PLANET.1)),
            Loads::AllButAlbedo => (Some(PLANET.0), None),
        };
        let environment = Environment {
            solar_constant: Some(self.solar_constant),
            albedo,
            planet_ir,
            planet_radius: PLANET_RADIUS,
            eclipse: self.loads != Loads::Sun,
            background_temperature: Some(SPACE),
        };
        let attitude = Attitude::Nadir { nadir_axis: DVec3::NEG_Z, forward_axis: DVec3::X };
        StepLoads::new(&self.orbit(), &attitude, &environment)
    }
}

/// Start of the search for the periodic state [K].
const START: f64 = 270.0;

/// Lowest and highest temperature of a face and their steps in [0, [`STEPS`]). The step is the vertex of a parabola
/// through neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremes {
    /// Lowest [K].
    pub(crate) lowest: f64,
    /// Highest [K].
    pub(crate) highest: f64,
    pub(crate) lowest_step: f64,
    pub(crate) highest_step: f64,
}

impl Extremes {
    /// Extremes of a face. NaN for an empty orbit.
    pub(crate) fn of(orbit: &FaceOrbit, face: usize) -> Self {
        let series: Vec<f64> = orbit.iter().take(STEPS).map(|faces| faces[face]).collect();
        let extreme = |sign: f64| {
            let best = (0..series.len()).max_by(|a, b| (sign * series[*a]).total_cmp(&(sign * series[*b])));
            best.map_or((f64::NAN, f64::NAN), |at| (series[at], at as f64 + vertex(&series, at)))
        };
        let ((lowest, lowest_step), (highest, highest_step)) = (extreme(-1.0), extreme(1.0));
        let steps = STEPS as f64;
        let [lowest_step, highest_step] = [lowest_step, highest_step].map(|step| step.rem_euclid(steps));
        Self { lowest, highest, lowest_step, highest_step }
    }

    /// Steps from the lowest to the highest.
    pub(crate) fn rise(&self) -> f64 {
        (self.highest_step - self.lowest_step).rem_euclid(STEPS as f64)
    }

    /// Steps from the highest to the lowest.
    pub(crate) fn fall(&self) -> f64 {
        STEPS as f64 - self.rise()
    }
}

/// Vertex of the parabola through a value and its neighbours in a periodic series: an offset in (-1, 1).
fn vertex(series: &[f64], at: usize) -> f64 {
    let count = series.len();
    let [before, here, after] = [at + count - 1, at, at + 1].map(|index| series[index % count]);
    let curvature = before - 2.0 * here + after;
    if curvature == 0.0 { 0.0 } else { 0.5 * (before - after) / curvature }
}

/// Mean temperature of a face over an orbit [K].
pub(crate) fn mean(orbit: &FaceOrbit, face: usize) -> f64 {
    orbit.iter().take(STEPS).map(|faces| faces[face]).sum::<f64>() / orbit.len().min(STEPS) as f64
}
