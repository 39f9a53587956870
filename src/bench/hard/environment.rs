//! Hard cases of the environment: eclipses in steps of all lengths, a tumbling craft, and a moving shadow edge.

use std::sync::Arc;

use glam::{DQuat, DVec3, Vec3};

use super::case::{CaseScale, HardCase, apart, worst_of};
use super::way::integrated;
use crate::environment::StepLoad;
use crate::environment::load::solar_flux;
use crate::environment::sky::SkyModel;
use crate::environment::step::StepLoads;
use crate::environment::{Attitude, CircularOrbit, Environment};
use crate::gpu::context::Context;
use crate::gpu::effects::thermal::variant::StepRange;
use crate::gpu::effects::thermal::variant::{Curve, StepKind, ThermalVariant};
use crate::gpu::layout;
use crate::gpu::renderer::Renderer;
use crate::gpu::scene_data::{NODES_PER_WORKGROUP, SceneData};
use crate::gpu::shapes::Shapes;
use crate::paper::cube::{ALTITUDES, PERIOD, PLANET_RADIUS, SPACE};
use crate::simulation::network::unfinished;
use crate::simulation::target::Target;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::control::Integrator;
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::{Network, NodeKind};

pub(crate) mod shadow;

/// Solar constant [W/m2].
const SUN: f64 = 1361.0;
/// Values of the thin array of docs/numerics.md 3: capacitance [J/m2K], front absorptivity, emissivity of both faces.
const CAPACITANCE: f64 = 1350.0;
const ABSORPTIVITY: f64 = 0.9;
const EMISSIVITY: f64 = 0.85;
/// Error of the thin array in frames of 16.7 s with mean fluxes [K] (docs/numerics.md 3).
const THIN_ARRAY: f64 = 0.30;
const FRAME: f64 = 16.7;
/// Length of reference steps [s].
const FINE: f64 = 2e-3;

/// Plates that absorb sunlight on one face and radiate from both.
struct Plates {
    loads: StepLoads,
    normals: Vec<DVec3>,
    start: Vec<f64>,
    /// Start of the first step, and length of all steps [s].
    from: f64,
    step: f64,
    steps: usize,
}

fn sky(attitude: &Attitude, eclipse: bool) -> Result<StepLoads, String> {
    let orbit = CircularOrbit { altitude: ALTITUDES[1], period: PERIOD, beta: 0.0, phase: 0.0 };
    let environment = Environment {
        solar_constant: Some(SUN),
        albedo: None,
        planet_ir: None,
        planet_radius: PLANET_RADIUS,
        eclipse,
        background_temperature: Some(SPACE),
    };
    StepLoads::new(&orbit, attitude, &environment).map_err(|error| error.to_string())
}

/// dT/dt of a plate that absorbs a flux [K/s].
fn rate(flux: f64, t: f64) -> f64 {
    (flux - 2.0 * EMISSIVITY * STEFAN_BOLTZMANN * (t.powi(4) - SPACE.powi(4))) / CAPACITANCE
}

impl Plates {
    fn load(&self, step: usize) -> StepLoad {
        let start = self.from + self.step * step as f64;
        self.loads.step_load(start, start + self.step)
    }

    /// Reference temperatures [K] at the ends of steps, from short fourth-order Runge-Kutta steps under the exact flux.
    fn truth(&self) -> Vec<Vec<f64>> {
        let sky = self.loads.sky_model();
        let flux = |time: f64, normal: DVec3| {
            ABSORPTIVITY * SUN * sky.lit_fraction(time) * sky.sun_direction(time).dot(normal).max(0.0)
        };
        let count = (self.step / FINE).ceil().max(4.0);
        let h = self.step / count;
        let mut now = self.start.clone();
        let mut rows = Vec::new();
        for number in 0..self.steps {
            for step in 0..count as usize {
                let t = self.from + self.step * number as f64 + h * step as f64;
                for (now, normal) in now.iter_mut().zip(&self.normals) {
                    let [a, b, c] = [0.0, 0.5, 1.0].map(|share| flux(t + share * h, *normal));
                    let k1 = rate(a, *now);
                    let k2 = rate(b, *now + 0.5 * h * k1);
                    let k3 = rate(b, *now + 0.5 * h * k2);
                    let k4 = rate(c, *now + h * k3);
                    *now += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                }
            }
            rows.push(now.clone());
        }
        rows
    }

    /// Absorbed flux of every step [W/m2], as a target computes it.
    fn absorbed(&self, target: &Target) -> Result<Vec<Vec<f64>>, String> {
        match target {
            Target::Device(context) => self.absorbed_on(context),
            Target::Reference => Ok((0..self.steps)
                .map(|step| {
                    let load = self.load(step);
                    self.normals.iter().map(|normal| ABSORPTIVITY * solar_flux(&load, *normal)).collect()
                })
                .collect()),
        }
    }

    fn absorbed_on(&self, context: &Arc<Context>) -> Result<Vec<Vec<f64>>, String> {
        let failed = |error: crate::gpu::error::GpuError| error.to_string();
        let nodes = self.normals.len().next_multiple_of(NODES_PER_WORKGROUP);
        let mut normals: Vec<Vec3> = self.normals.iter().map(|normal| normal.as_vec3()).collect();
        normals.resize(nodes, Vec3::ZERO);
        // Only the front counts, because the back's absorbed sunlight is not part of the case.
        let device = Loose { kind: StepKind::Absorb, normals, positions: vec![Vec3::ZERO; nodes] };
        let mut renderer = Renderer::new(context, &device.data(&Shapes::default())).map_err(failed)?;
        (0..self.steps)
            .map(|step| {
                let absorbed = renderer.absorbed(&self.load(step), None).map_err(failed)?;
                Ok(absorbed[..self.normals.len()].iter().map(|flux| f64::from(*flux)).collect())
            })
            .collect()
    }

    /// Temperatures [K] at the ends of steps under the given fluxes.
    fn integrate(&self, fluxes: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, String> {
        let count = self.normals.len();
        let network = Network {
            space_temperature: SPACE,
            kinds: vec![NodeKind::Diffusive; count],
            capacitances: vec![CAPACITANCE; count],
            emissive_areas: vec![2.0 * EMISSIVITY; count],
            temperatures: self.start.clone(),
            ..Network::default()
        };
        let table = |node: usize| {
            let edges = (0..self.steps).flat_map(|step| {
                let at = |edge: usize| self.step * edge as f64;
                [(at(step), fluxes[step][node]), (at(step + 1), fluxes[step][node])]
            });
            let (times, powers) = edges.unzip();
            (node as u32, HeatTable { times, powers })
        };
        let schedule = Schedule {
            heat: (0..count).map(table).collect(),
            times: (1..=self.steps).map(|step| self.step * step as f64).collect(),
            ..Schedule::default()
        };
        let series = integrated(&network, &schedule, Integrator::Default);
        Ok(series.map_err(|error| unfinished(&error))?.rows)
    }

    fn error(&self, target: &Target) -> Result<f64, String> {
        let temperatures = self.integrate(&self.absorbed(target)?)?;
        Ok(self.apart(&temperatures))
    }

    fn apart(&self, computed: &[Vec<f64>]) -> f64 {
        computed.iter().zip(self.truth()).fold(0.0, |worst, (a, b)| worst_of(worst, apart(a, &b)))
    }

    /// The error with the flux at the middle of each step and a point Sun.
    fn with_flux_of_the_middle(&self, lit: impl Fn(&SkyModel, f64) -> bool) -> f64 {
        let sky = self.loads.sky_model();
        let flux = |step: usize, normal: &DVec3| {
            let time = self.from + self.step * (step as f64 + 0.5);
            let sun = if lit(sky, time) { SUN } else { 0.0 };
            ABSORPTIVITY * sun * sky.sun_direction(time).dot(*normal).max(0.0)
        };
        let fluxes: Vec<Vec<f64>> =
            (0..self.steps).map(|step| self.normals.iter().map(|normal| flux(step, normal)).collect()).collect();
        self.integrate(&fluxes).map_or(f64::INFINITY, |temperatures| self.apart(&temperatures))
    }
}

/// Nodes of one material without a surface.
struct Loose {
    kind: StepKind,
    normals: Vec<Vec3>,
    positions: Vec<Vec3>,
}

const MATERIAL: layout::Material = layout::Material {
    absorptivity: ABSORPTIVITY as f32,
    emissivity: EMISSIVITY as f32,
    back_absorptivity: ABSORPTIVITY as f32,
    back_emissivity: EMISSIVITY as f32,
    heating_function: 1.0,
    heating_t_max: 0.0,
    cooling_function: 1.0,
    cooling_t_max: 0.0,
    share: 0.0,
    emission: 0.0,
    own_emission: 0.0,
    exchange: 0.0,
    structure_share: 0.0,
    parts: 0.0,
};
/// Material and part of each group, with enough entries for any case.
static ZEROS: [u32; 8192] = [0; 8192];

impl Loose {
    fn data<'a>(&'a self, shapes: &'a Shapes) -> SceneData<'a> {
        let groups = self.normals.len() / 4;
        let variant = ThermalVariant { sun: true, ..ThermalVariant::bare(self.kind, Curve::Power) };
        SceneData {
            ranges: vec![StepRange { variant, groups: (0, groups as u32), joint: 0 }],
            group_material: &ZEROS[..groups],
            group_part: &ZEROS[..groups],
            normals: &self.normals,
            positions: &self.positions,
            materials: &[MATERIAL],
            band_table: &[0.0],
            ..SceneData::empty(shapes)
        }
    }
}

/// Entry into and exit from an eclipse, in steps of a given length [s]. No contact coincides with the end of a step.
fn eclipses(step: f64, scale: CaseScale) -> Result<Vec<Plates>, String> {
    let loads = sky(&Attitude::Sun { sun_axis: DVec3::Z, north_axis: DVec3::X }, true)?;
    let [entry, umbra, end, exit] = loads.sky_model().contacts(0.0, PERIOD)[..] else {
        return Err("the orbit has no eclipse".to_owned());
    };
    let lit = (ABSORPTIVITY * SUN / (2.0 * EMISSIVITY * STEFAN_BOLTZMANN) + SPACE.powi(4)).sqrt().sqrt();
    let window = |[first, last]: [f64; 2], start: f64| {
        // In tests the shortest steps cover a part of the penumbra only.
        let middle = 0.5 * (first + last);
        let half = if step < 0.05 && scale == CaseScale::Small { 1.0 } else { 0.5 * (last - first) + 1.0 + 2.0 * step };
        let steps = (2.0 * half / step).ceil() as usize;
        Plates {
            loads: loads.clone(),
            normals: vec![DVec3::Z],
            start: vec![start],
            from: middle - half - 0.37 * step,
            step,
            steps: steps + 1,
        }
    };
    Ok(vec![window([entry, umbra], lit), window([end, exit], 180.0)])
}

/// Whether the centre of the Sun is above the planet's limb.
fn middle_is_lit(sky: &SkyModel, time: f64) -> bool {
    sky.lit_fraction(time) > 0.5
}

fn eclipse(step: f64) -> HardCase {
    let scaled = THIN_ARRAY * (step / FRAME).powi(2);
    let (limit, source) = if step == FRAME {
        (THIN_ARRAY, "docs/numerics.md 3, thin array in frames of 16.7 s".to_owned())
    } else if scaled > 20e-3 {
        (scaled, format!("docs/numerics.md 3, 0.30 K in frames of 16.7 s, times ({step} / 16.7)^2"))
    } else {
        (20e-3, "docs/numerics.md 6, default".to_owned())
    };
    let what = "a thin array (1350 J/m2K) that looks at the Sun into and out of umbra; steps of 2 ms in f64";
    HardCase::new(format!("eclipse in steps of {step} s"), what, "K", (limit, source))
        .remedy(
            "a step's sunlight is its mean, the penumbra cut at its contacts",
            "the flux of the step's middle, the Sun a point",
        )
        .measured(
            move |target, scale| {
                eclipses(step, scale)?.iter().try_fold(0.0, |worst, one| Ok(worst_of(worst, one.error(target)?)))
            },
            move |scale| {
                let Ok(windows) = eclipses(step, scale) else { return f64::INFINITY };
                windows.iter().map(|one| one.with_flux_of_the_middle(middle_is_lit)).fold(0.0, worst_of)
            },
        )
}

/// Plates in six directions on a craft that turns about a skew axis, in full sunlight.
fn tumbling(degrees: f64, scale: CaseScale) -> Result<Plates, String> {
    let inertial_from_body = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, -0.4);
    let axis = DVec3::new(0.4, 0.7, 0.59).normalize();
    let attitude = Attitude::Spin { inertial_from_body, axis, rate: degrees.to_radians() };
    let normals = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]).collect();
    let steps = scale.of(24, 60, 360);
    Ok(Plates { loads: sky(&attitude, false)?, normals, start: vec![250.0; 6], from: 0.0, step: FRAME, steps })
}

fn tumble(degrees: f64) -> HardCase {
    let turns = degrees / 360.0 * FRAME;
    let what =
        format!("six thin plates (1350 J/m2K) that turn {turns:.2} times in a step of 16.7 s; steps of 2 ms in f64");
    let limit = (THIN_ARRAY, "docs/numerics.md 3, thin array in frames of 16.7 s");
    HardCase::new(format!("tumbling craft, {degrees} deg/s"), what, "K", limit)
        .remedy(
            "a step's sunlight is up to eight vectors, each from the middle of a stretch of it, of a turn where it is longer",
            "the flux of the step's middle",
        )
        .measured(
            move |target, scale| tumbling(degrees, scale)?.error(target),
            move |scale| {
                tumbling(degrees, scale).map_or(f64::INFINITY, |plates| plates.with_flux_of_the_middle(|_, _| true))
            },
        )
}

pub(crate) fn cases() -> Vec<HardCase> {
    let mut cases: Vec<HardCase> = [0.01, 0.1, 1.0, 16.7, 60.0].map(eclipse).into();
    cases.extend([6.0, 36.0].map(tumble));
    cases
}
