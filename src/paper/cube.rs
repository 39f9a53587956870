//! The paper's hollow cube in its orbit: panels as nodes of a thermal network, and the heat of every step.
//!
//! Panels of 1 m x 1 m x 0.1 m, a node each, radiate from their outer face only; neighbours conduct from middle to
//! middle, half a metre in either panel, through the panel's section: GL = k A / L with A = 1 m x 0.1 m and L = 1 m,
//! 20 W/K in aluminium. Circular orbit of 6017 s in 360 steps, beta 0, nadir-pointing; orbit noon at step 340 places
//! the start 20 degrees after noon. Materials as the paper gives them.

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
/// Period of the orbit that the paper states [s].
pub const PERIOD: f64 = 6017.0;
/// Length of a step [s].
pub const STEP: f64 = PERIOD / STEPS as f64;
/// Altitude that the paper states [m], and the one that its period means (docs/numerics.md 2).
pub const ALTITUDES: [f64; 2] = [224e3, 772e3];
/// Solar constants of docs/numerics.md 2 [W/m2]; the paper states none.
pub const SOLAR_CONSTANTS: [f64; 2] = [1361.0, 1367.0];
/// Equatorial radius [m], that of docs/numerics.md 2.
pub const PLANET_RADIUS: f64 = 6_378_137.0;
/// Radiative temperature of space [K].
pub const SPACE: f64 = 2.7;
/// Exitance and Bond albedo of the planet: [W/m2] and 1 (docs/numerics.md 2).
const PLANET: (f64, f64) = (237.0, 0.3);
/// Edge of a panel [m].
pub const EDGE: f64 = 1.0;
/// Thickness of a panel [m].
pub const THICKNESS: f64 = 0.1;

/// Faces in the order of the nodes: +Z to the zenith, +X along the velocity, Y along the orbit normal, where with
/// beta 0 the Sun never stands.
pub const FACES: [&str; 6] = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"];
/// Number of the face that looks along the orbit normal.
pub const SIDE: usize = 2;
/// Number of the face that looks to the zenith.
pub const ZENITH: usize = 4;

const NORMALS: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// What the panels are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Absorptivity and emissivity of the outer face.
    pub optics: Optics,
    /// k [W m-1 K-1].
    pub conductivity: f64,
    /// rho c [J m-3 K-1]; 0 for panels that store no heat.
    pub heat_capacity: f64,
}

/// Aluminium 6061.
pub const ALUMINIUM: Panel = Panel {
    optics: Optics { absorptivity: 0.18, emissivity: 0.21 },
    conductivity: 200.0,
    heat_capacity: 2700.0 * 900.0,
};

/// Goldized MLI.
pub const MLI: Panel =
    Panel { optics: Optics { absorptivity: 0.19, emissivity: 0.02 }, conductivity: 0.01, heat_capacity: 0.0 };

/// What the panels receive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loads {
    /// The Sun, as though the planet cast no shadow.
    Sun,
    /// The Sun, behind the planet for a part of the orbit.
    SunAndShadow,
    /// Sun with shadow, infrared and albedo of the planet.
    All,
    /// All but the albedo.
    AllButAlbedo,
}

/// A cube in an orbit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// What it is made of.
    pub panel: Panel,
    /// Whether panels conduct, besides radiating.
    pub conducting: bool,
    /// What it receives.
    pub loads: Loads,
    /// Solar constant [W/m2].
    pub solar_constant: f64,
    /// Altitude [m].
    pub altitude: f64,
}

impl fmt::Display for Case {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let material = if self.panel == MLI { "MLI" } else { "Al" };
        let conducting = if self.conducting { " and conducting" } else { "" };
        write!(out, "{material}, radiating{conducting}")
    }
}

/// The cube's panels through an orbit that repeats itself: the temperatures [K] of the faces at steps 0 to [`STEPS`].
pub type Orbit = Vec<[f64; 6]>;

/// What a solver is given: a network and the heat of every node [W] in steps 0 to `STEPS - 1`. Step n lasts from
/// (n - 1/2) to (n + 1/2) times `STEP`, and its heat is constant. Step `STEPS` is step 0 of the next orbit.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The panels.
    pub network: Network,
    /// Heat of every face [W] at every step.
    pub heat: Vec<[f64; 6]>,
}

impl Problem {
    /// Heat of a face as pairs of times [s] and powers [W] of a line from 0 to [`PERIOD`] that jumps between steps.
    pub fn table(&self, face: usize) -> Vec<[f64; 2]> {
        let power = |step: usize| self.heat[step % self.heat.len()][face];
        let jumps = (0..self.heat.len()).flat_map(|step| {
            let time = (step as f64 + 0.5) * STEP;
            [[time, power(step)], [time, power(step + 1)]]
        });
        let ends = ([0.0, power(0)], [PERIOD, power(0)]);
        std::iter::once(ends.0).chain(jumps).chain([ends.1]).collect()
    }
}

impl Case {
    /// The network and its heat.
    pub fn problem(&self) -> Result<Problem, SkyError> {
        let heat = self.absorbed()?.into_iter().map(|faces| faces.map(|flux| EDGE * EDGE * flux)).collect();
        Ok(Problem { network: self.network(), heat })
    }

    /// The flux that every face absorbs [W/m2], its mean over each of the [`STEPS`] steps, in whose middle the time
    /// `index * STEP` lies.
    pub fn absorbed(&self) -> Result<Vec<[f64; 6]>, SkyError> {
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

    /// Steps at which half of the Sun is hidden by the planet and seen again; `None` without a shadow.
    pub fn shadow(&self) -> Result<Option<[f64; 2]>, SkyError> {
        let contacts = self.sky_loads()?.sky_model().contacts(0.0, PERIOD);
        Ok(match contacts[..] {
            [penumbra, umbra, umbra_end, penumbra_end] => {
                Some([0.5 * (penumbra + umbra) / STEP, 0.5 * (umbra_end + penumbra_end) / STEP])
            }
            _ => None,
        })
    }

    /// How the period and the altitude disagree; both are used as given.
    pub fn period_disagreement(&self) -> Option<PeriodDisagreement> {
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

/// Where the search for the periodic state begins [K].
const START: f64 = 270.0;

/// The lowest and the highest temperature of a face, and the steps at which the curve through its neighbours has them
/// (the vertex of a parabola), in [0, [`STEPS`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Lowest [K].
    pub lowest: f64,
    /// Highest [K].
    pub highest: f64,
    /// Step of the lowest.
    pub lowest_step: f64,
    /// Step of the highest.
    pub highest_step: f64,
}

impl Extremes {
    /// Of a face; NaN where the orbit is empty.
    pub fn of(orbit: &Orbit, face: usize) -> Self {
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
    pub fn rise(&self) -> f64 {
        (self.highest_step - self.lowest_step).rem_euclid(STEPS as f64)
    }

    /// Steps from the highest to the lowest.
    pub fn fall(&self) -> f64 {
        STEPS as f64 - self.rise()
    }
}

/// Where the parabola through a value and its neighbours, the series being periodic, turns: in (-1, 1) from the value.
fn vertex(series: &[f64], at: usize) -> f64 {
    let count = series.len();
    let [before, here, after] = [at + count - 1, at, at + 1].map(|index| series[index % count]);
    let curvature = before - 2.0 * here + after;
    if curvature == 0.0 { 0.0 } else { 0.5 * (before - after) / curvature }
}

/// Mean of a face over an orbit [K].
pub fn mean(orbit: &Orbit, face: usize) -> f64 {
    orbit.iter().take(STEPS).map(|faces| faces[face]).sum::<f64>() / orbit.len().min(STEPS) as f64
}
