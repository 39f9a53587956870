//! Compares the device's transition with a hand-written rayon loop: same nodes, loads and functions, in alternating
//! steps. Also measures the errors of both against the f64 twin.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use isotherm::internals;
use isotherm::internals::{
    ALTITUDES, ALUMINIUM, Bulk, Context, Cube, Curve, Domain, Function, IncidentFunction, Loads, Material, Optics,
    Profile, Reference, ReferenceNode, Renderer, Request, Response, Retarget, SOLAR_CONSTANTS, STEP, STEPS, SceneData,
    Shapes, Sides, StepKind, StepLoad, StepRange, ThermalVariant, Transition, incident,
};

use super::clock::Clock;
use super::rayon_loop::{Load, Nodes, Surface, has_avx2};
use super::{AnyError, Differences};

/// Duration of a transition [steps]. It exceeds every run, so no transition ends.
const T_MAX: f64 = 1000.0;
const OPTICS: Optics = Optics { absorptivity: 0.3, emissivity: 0.8 };
/// Number of unmeasured steps that compile the passes.
const WARM_UP: usize = 3;
/// Number of nodes whose errors are measured through one orbit.
const CHECKED: usize = 4096;
/// Step whose load gives the constant target. It is in the planet's shadow, so the target differs from that of step 0.
const COMMANDED: usize = 150;

/// A kind of work.
struct Work {
    name: &'static str,
    /// 1 is linear, 2 is quadratic.
    power: u32,
    loads: Loads,
    /// Whether the target moves in every step.
    moving: bool,
}

const WORKS: [Work; 4] = [
    Work { name: "quadratic, constant target", power: 2, loads: Loads::Sun, moving: false },
    Work { name: "quadratic, moving target: Sun", power: 2, loads: Loads::Sun, moving: true },
    Work { name: "linear, moving target: Sun", power: 1, loads: Loads::Sun, moving: true },
    Work { name: "quadratic, moving target: Sun, infrared, albedo", power: 2, loads: Loads::All, moving: true },
];

impl Work {
    /// The loads of the first steps of the paper's orbit, after the first load.
    fn steps(&self, count: usize) -> Result<Vec<StepLoad>, AnyError> {
        let [solar_constant, _] = SOLAR_CONSTANTS;
        let [_, altitude] = ALTITUDES;
        let orbit = Cube { panel: ALUMINIUM, conducting: false, loads: self.loads, solar_constant, altitude };
        let loads = orbit.sky_loads()?;
        let load = |step: usize| {
            let step = if self.moving || step == 0 { step } else { COMMANDED };
            loads.step_load(step as f64 * STEP, (step + 1) as f64 * STEP)
        };
        Ok((0..=count).map(load).collect())
    }

    fn variant(&self) -> ThermalVariant {
        let planet = self.loads == Loads::All;
        ThermalVariant {
            sun: true,
            planet_ir: planet,
            albedo: planet,
            ..ThermalVariant::bare(StepKind::Merge, Curve::Power)
        }
    }

    fn surface(&self) -> Surface {
        Surface { absorptivity: OPTICS.absorptivity as f32, emissivity: OPTICS.emissivity as f32, t_max: T_MAX as f32 }
    }

    /// The load for the loop in a step. It is `None` if the targets stay.
    fn hand_load<'a>(&self, step: usize, load: &'a Load) -> Option<&'a Load> {
        (self.moving || step <= 1).then_some(load)
    }

    fn renderer(&self, context: &Arc<Context>, normals: &[Vec3], start: &StepLoad) -> Result<Renderer, AnyError> {
        let groups = normals.len() / 4;
        let [absorptivity, emissivity] = [OPTICS.absorptivity as f32, OPTICS.emissivity as f32];
        let material = internals::DeviceMaterial {
            absorptivity,
            emissivity,
            back_absorptivity: absorptivity,
            back_emissivity: emissivity,
            heating_function: self.power as f32,
            heating_t_max: T_MAX as f32,
            cooling_function: self.power as f32,
            cooling_t_max: T_MAX as f32,
            ..internals::DeviceMaterial::default()
        };
        let shapes = Shapes::default();
        let data = SceneData {
            ranges: vec![StepRange { variant: self.variant(), groups: (0, groups as u32), joint: 0 }],
            group_material: &vec![0; groups],
            normals,
            materials: &[material],
            ..SceneData::empty(&shapes)
        };
        let mut renderer = Renderer::new(context, &data)?;
        renderer.settle(start)?;
        Ok(renderer)
    }

    fn twin(&self, normals: &[Vec3]) -> Reference<IncidentFunction> {
        let function = if self.power == 1 { Function::Linear } else { Function::Quadratic };
        let profile = Profile { function, t_max_steps: T_MAX };
        let (retarget, domain) = (Retarget::Merge, Domain::Temperature);
        let transition = Transition { heating: profile.clone(), cooling: profile, retarget, domain };
        let material = Material {
            ranges: Default::default(),
            gloss: Default::default(),
            in_band: Default::default(),
            name: String::new(),
            front: OPTICS,
            sides: Sides::Outside,
            bulk: Bulk::default(),
            response: Response::Transition(transition),
            transition: None,
            source: String::new(),
        };
        let node = |normal: &Vec3| ReferenceNode { normal: normal.as_dvec3(), material: 0 };
        Reference::new(normals.iter().map(node).collect(), vec![material], incident)
    }
}

/// Directions evenly spread over the sphere (Fibonacci lattice), as in `isotherm bench`.
fn directions(nodes: usize) -> Vec<Vec3> {
    const POINTS: usize = 65_536;
    let direction = |i: usize| {
        let z = 1.0 - (2.0 * (i % POINTS) as f64 + 1.0) / POINTS as f64;
        let angle = (i % POINTS) as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z).as_vec3()
    };
    (0..nodes).map(direction).collect()
}

/// Measures every kind of work at every number of nodes.
pub fn measure(context: &Arc<Context>, sizes: &[usize], steps: usize) -> Result<Value, AnyError> {
    let mut rows = Vec::new();
    for work in &WORKS {
        let errors = errors(context, work)?;
        for size in sizes {
            let mut row = timed(context, work, size.next_multiple_of(256), steps)?;
            row["error_k"].clone_from(&errors);
            rows.push(row);
        }
    }
    Ok(json!({ "threads": rayon::current_num_threads(), "avx2": has_avx2(), "rows": rows }))
}

/// Time of each step [ms] of the device and the loops in turn: wall and processor time.
fn timed(context: &Arc<Context>, work: &Work, nodes: usize, steps: usize) -> Result<Value, AnyError> {
    let normals = directions(nodes);
    let loads = work.steps(steps + WARM_UP)?;
    let mut renderer = work.renderer(context, &normals, &loads[0])?;
    let surface = work.surface();
    let mut plain = Nodes::settled(&normals, &Load::new(&loads[0]), &surface);
    let mut wide = plain.clone();
    let mut device = Vec::new();
    let mut clocks = [Vec::new(), Vec::new(), Vec::new()];
    for (step, load) in loads.iter().enumerate().skip(1) {
        let before = step_ms(&renderer);
        let clock = Clock::start();
        let submitted = renderer.submit(Request::step(load, 1.0))?;
        renderer.collect(submitted)?;
        let on_device = clock.stop();
        let single = Load::new(load);
        let single = work.hand_load(step, &single);
        let by_hand = |nodes: &mut Nodes, avx2: bool| {
            let clock = Clock::start();
            nodes.step(single, &surface, work.power, avx2);
            clock.stop()
        };
        let times = [on_device, by_hand(&mut plain, false), by_hand(&mut wide, true)];
        if step > WARM_UP {
            device.push(step_ms(&renderer) - before);
            clocks.iter_mut().zip(times).for_each(|(clock, time)| clock.push(time));
        }
    }
    let [on_device, plain, wide] = clocks.map(|times| json!(times));
    Ok(json!({
        "work": work.name, "nodes": nodes, "device_ms": device,
        "clock_ms": { "device": on_device, "rayon": plain, "rayon_avx2": wide },
    }))
}

/// Device time of all thermal passes so far [ms].
fn step_ms(renderer: &Renderer) -> f64 {
    let steps = renderer.pass_times().iter().filter(|(name, _)| name.starts_with("thermal_step"));
    steps.flat_map(|(_, samples)| samples.iter()).sum()
}

/// Errors of device and loops against the f64 twin [K], over all steps of one orbit.
fn errors(context: &Arc<Context>, work: &Work) -> Result<Value, AnyError> {
    let normals: Vec<Vec3> = directions(65_536).into_iter().step_by(65_536 / CHECKED).collect();
    let loads = work.steps(STEPS)?;
    let mut renderer = work.renderer(context, &normals, &loads[0])?;
    let surface = work.surface();
    let mut plain = Nodes::settled(&normals, &Load::new(&loads[0]), &surface);
    let mut wide = plain.clone();
    let mut twin = work.twin(&normals);
    twin.settle(&loads[0]);
    let mut far = [Differences::default(), Differences::default(), Differences::default()];
    for (step, load) in loads.iter().enumerate().skip(1) {
        let submitted = renderer.submit(Request::step(load, 1.0).and_temperatures())?;
        let collected = renderer.collect(submitted)?.temperatures.ok_or("no temperatures")?;
        let single = Load::new(load);
        let single = work.hand_load(step, &single);
        plain.step(single, &surface, work.power, false);
        wide.step(single, &surface, work.power, true);
        twin.step(load, 1.0);
        for (far, temperatures) in far.iter_mut().zip([collected, &plain.temperature, &wide.temperature]) {
            far.add(temperatures.iter().map(|kelvin| f64::from(*kelvin)), twin.temperatures());
        }
    }
    let [device, plain, wide] = far.map(|far| far.json());
    Ok(json!({ "device": device, "rayon": plain, "rayon_avx2": wide }))
}
