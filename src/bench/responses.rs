//! Measures the cost of a node under each response with the device's clock.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::environment::StepLoad;
use crate::environment::sky::SkyError;
use crate::gpu::context::Context;
use crate::gpu::effects::thermal::variant::StepRange;
use crate::gpu::effects::thermal::variant::{Curve, StepKind, ThermalVariant};
use crate::gpu::error::GpuError;
use crate::gpu::frame::{Frame, Wanted};
use crate::gpu::layout;
use crate::gpu::layout::FUSED_STEPS;
use crate::gpu::renderer::{Renderer, Request};
use crate::gpu::scene_data::SceneData;
use crate::gpu::shapes::{self, Shapes};
use crate::output::report::PassTime;
use crate::output::statistics::Percentiles;
use crate::paper::cube::{ALTITUDES, ALUMINIUM, Cube, Loads, SOLAR_CONSTANTS, STEP};
use crate::thermal::function::{Function, FunctionError};
use crate::thermal::material::{Below, Domain, Profile, Radiative, Retarget, Transition};

/// Cost of a node under one response.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ResponseRow {
    /// The response and its function.
    pub(crate) response: String,
    pub(crate) nodes: usize,
    /// Time of a step [ns a node].
    pub(crate) ns_a_node: Option<Percentiles>,
    /// Bytes that a node reads and writes in a step. Each array counts once.
    pub(crate) bytes_a_node: f64,
    /// Bandwidth [GB/s].
    pub(crate) gigabytes_per_second: Option<f64>,
    /// Share of the copy bandwidth from the same run.
    pub(crate) share_of_copy: Option<f64>,
    /// The reason if there is no time.
    pub(crate) failed: Option<String>,
}

/// An error that prevents the measurement.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ResponseError {
    #[error(transparent)]
    Sky(#[from] SkyError),
    #[error(transparent)]
    Function(#[from] FunctionError),
}

/// Duration of a transition [steps], longer than the measured steps, so that no transition ends.
const T_MAX_STEPS: f64 = 1000.0;
/// The user-defined function.
const EXPRESSION: &str = "s*s*(3.0-2.0*s)";
/// Number of measured dispatches of many steps. As many come before, unmeasured.
const FUSED_REPETITIONS: u32 = 4;

/// Times of the thermal pass at one number of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedPass {
    /// Time of every compiled variant that ran [ms].
    pub times: Vec<PassTime>,
    /// Sum over the variants [ms].
    pub(crate) samples: Vec<f64>,
    /// Device memory that grows with the nodes [bytes per node].
    pub bytes_a_node: f64,
    /// Bytes that a node reads and writes in a step. Each array counts once.
    pub(crate) moved_a_node: f64,
}

/// Runs a variant on nodes with normals in all directions: once unmeasured, once measured. The steps run one by one, or
/// many in a dispatch. Times and bytes are for one step.
///
/// # Errors
/// More nodes than the device holds, or a device error.
pub fn time_pass(
    context: &Arc<Context>,
    variant: ThermalVariant,
    power: f32,
    shapes: &Shapes,
    nodes: usize,
    steps: &[StepLoad],
    fuses: bool,
) -> Result<TimedPass, GpuError> {
    let normals: Vec<Vec3> = (0..nodes).map(fibonacci_direction).collect();
    let groups = nodes / 4;
    let material = layout::Material {
        absorptivity: 0.3,
        emissivity: 0.8,
        back_absorptivity: 0.3,
        back_emissivity: 0.8,
        heating_function: power,
        heating_t_max: T_MAX_STEPS as f32,
        cooling_function: power,
        cooling_t_max: T_MAX_STEPS as f32,
        ..plate_material(variant)
    };
    let data = SceneData {
        ranges: vec![StepRange { variant, groups: (0, groups as u32), joint: 0 }],
        group_material: &vec![0; groups],
        normals: &normals,
        materials: &[material],
        ..SceneData::empty(shapes)
    };
    let plan = data.plan();
    let bytes: u64 = plan.iter().filter(|planned| planned.resource.grows_with_nodes()).map(|p| p.bytes).sum();
    let at_once = if fuses { FUSED_STEPS as f64 } else { 1.0 };
    let frame = Frame::step(&data.ranges, Wanted::default());
    let size = |resource| plan.iter().find(|planned| planned.resource == resource).map_or(0, |planned| planned.bytes);
    let mut moved = 0;
    for pass in frame.passes() {
        let touched = pass.accesses()?.into_iter().filter(|access| access.range.is_some());
        moved += touched.map(|access| size(access.resource)).sum::<u64>();
    }
    let mut renderer = Renderer::new(context, &data)?;
    if let Some(first) = steps.first() {
        renderer.settle(first)?;
    }
    if fuses {
        let loads: Vec<(&StepLoad, f64)> = steps.iter().cycle().take(FUSED_STEPS).map(|load| (load, 1.0)).collect();
        (0..2 * FUSED_REPETITIONS).try_for_each(|_| renderer.forward(&loads))?;
        renderer.wait()?;
    } else {
        for load in steps.iter().chain(steps) {
            let submitted = renderer.submit(Request::step(load, 1.0))?;
            renderer.collect(submitted)?;
        }
    }
    let of_step = if fuses { "forward thermal_step" } else { "thermal_step" };
    let passes = || renderer.pass_times().iter().filter(|(name, _)| name.starts_with(of_step));
    let later = |samples: &[f64]| samples[samples.len() / 2..].iter().map(|ms| ms / at_once).collect::<Vec<_>>();
    Ok(TimedPass {
        times: passes().filter_map(|(name, samples)| PassTime::from_samples(name, &later(samples))).collect(),
        samples: passes().flat_map(|(_, samples)| later(samples)).collect(),
        bytes_a_node: bytes as f64 / nodes as f64,
        moved_a_node: moved as f64 / nodes as f64 / at_once,
    })
}

/// The values of a plate: 2 kg/m2 of aluminium and, over a structure of 20 kg/m2, a blanket.
fn plate_material(variant: ThermalVariant) -> layout::Material {
    let mut material = layout::Material::default();
    if let StepKind::Radiative { over, .. } = variant.kind {
        let below = Below { capacity: 18_000.0, effective_emittance: 0.02 };
        let (over, capacity) = (over.then_some(below), 1800.0);
        material.set_plate(&Radiative { capacity, over, step: STEP, hottest: 330.0 }, 0.8);
    }
    material
}

/// Directions spread evenly over the sphere (Fibonacci lattice).
fn fibonacci_direction(i: usize) -> Vec3 {
    const POINTS: f64 = 65_536.0;
    let z = 1.0 - (2.0 * (i % 65_536) as f64 + 1.0) / POINTS;
    let angle = (i % 65_536) as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let radius = (1.0 - z * z).sqrt();
    DVec3::new(radius * angle.cos(), radius * angle.sin(), z).as_vec3()
}

/// A response to measure.
struct Subject {
    name: &'static str,
    variant: ThermalVariant,
    power: f32,
    shapes: Shapes,
    fuses: bool,
}

fn subjects() -> Result<Vec<Subject>, FunctionError> {
    let loaded = |kind, curve| ThermalVariant {
        sun: kind != StepKind::Advance,
        planet_ir: kind != StepKind::Advance,
        albedo: kind != StepKind::Advance,
        ..ThermalVariant::bare(kind, curve)
    };
    let profile = Profile { function: Function::expression(EXPRESSION)?, t_max_steps: T_MAX_STEPS };
    let (retarget, domain) = (Retarget::Merge, Domain::Temperature);
    let shaped = Transition { heating: profile.clone(), cooling: profile, retarget, domain };
    let (kind, curve) = shapes::curve(&shaped);
    let plain = |name, kind, power| Subject {
        name,
        variant: loaded(kind, Curve::Power),
        power,
        shapes: Shapes::default(),
        fuses: false,
    };
    Ok(vec![
        plain("instant", StepKind::Instant, 2.0),
        plain("transition, constant target", StepKind::Advance, 2.0),
        plain("transition, linear", StepKind::Merge, 1.0),
        plain("transition, quadratic", StepKind::Merge, 2.0),
        Subject {
            name: "transition, s*s*(3-2*s)",
            variant: loaded(kind, curve),
            power: 0.0,
            shapes: Shapes::one(&shaped),
            fuses: false,
        },
        plain("radiative", StepKind::Radiative { over: false, fast: false }, 0.0),
        plain("radiative, fast", StepKind::Radiative { over: false, fast: true }, 0.0),
        plain("radiative, over a structure", StepKind::Radiative { over: true, fast: false }, 0.0),
        plain("radiative, fast, over a structure", StepKind::Radiative { over: true, fast: true }, 0.0),
        Subject { fuses: true, ..plain("transition, quadratic, 32 steps a dispatch", StepKind::Merge, 2.0) },
    ])
}

/// Measures every response at every number of nodes. Each does `steps` in full sunlight with planet infrared and
/// albedo. `bandwidth` [GB/s] is the bandwidth of a copy in the same run. If a size does not fit, its row says so.
pub(crate) fn measure(
    context: &Arc<Context>,
    sizes: &[usize],
    steps: u32,
    bandwidth: Option<f64>,
) -> Result<Vec<ResponseRow>, ResponseError> {
    let [solar_constant, _] = SOLAR_CONSTANTS;
    let [_, altitude] = ALTITUDES;
    let orbit = Cube { panel: ALUMINIUM, conducting: false, loads: Loads::All, solar_constant, altitude };
    let loads = orbit.sky_loads()?;
    let steps: Vec<StepLoad> =
        (0..steps).map(|step| loads.step_load(f64::from(step) * STEP, f64::from(step + 1) * STEP)).collect();
    let mut rows = Vec::new();
    for one in subjects()? {
        for size in sizes {
            let nodes = size.next_multiple_of(256);
            let row = ResponseRow { response: one.name.to_owned(), nodes, ..ResponseRow::default() };
            rows.push(match time_pass(context, one.variant, one.power, &one.shapes, nodes, &steps, one.fuses) {
                Ok(pass) => filled(row, &pass.samples, pass.moved_a_node, bandwidth),
                Err(error) => ResponseRow { failed: Some(error.to_string()), ..row },
            });
        }
    }
    Ok(rows)
}

/// Fills in a row from its times [ms for a step of all nodes].
fn filled(row: ResponseRow, samples_ms: &[f64], moved: f64, bandwidth: Option<f64>) -> ResponseRow {
    let Some(time) = Percentiles::of(samples_ms) else {
        return ResponseRow { failed: Some("the device has no timestamps".to_owned()), ..row };
    };
    let time = time.scaled(1e6 / row.nodes as f64);
    let rate = moved / time.median;
    ResponseRow {
        ns_a_node: Some(time),
        bytes_a_node: moved,
        gigabytes_per_second: Some(rate),
        share_of_copy: bandwidth.map(|bandwidth| rate / bandwidth),
        ..row
    }
}
