//! The loop of a run: settle, warm up, then step, draw and collect.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DAffine3;

pub mod check;
pub mod density;
pub mod device_data;
pub mod device_engine;
pub mod engine;
mod engine_error;
pub mod forward;
pub mod joints;
pub mod network;
pub mod periodic;
pub mod prepare;
pub mod prepare_error;
mod prepare_steps;
pub mod reference_engine;
pub mod state;
pub mod stepper;
pub mod target;
pub mod viewpoint;

use crate::scene::{Draw, Initial};
use crate::trace::Track;
use check::Check;
use engine::{Delivered, Engine, EngineError, Order, Step};
use forward::{Passing, forward};
use periodic::Periodic;
use prepare::Prepared;
use viewpoint::camera_from_body;

/// The results of a step.
pub struct StepResult {
    /// Number of the step; 0 is the initial state.
    pub step: u32,
    /// Time since the start [s].
    pub time: f64,
    /// Pose of the camera, where the step was drawn.
    pub pose: Option<DAffine3>,
    /// Image and temperatures.
    pub delivered: Delivered,
}

/// Brings the engine, and the check where there is one, to the state at time 0. Returns the result of a periodic warm-up.
///
/// # Errors
/// A call that fails.
pub fn start(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<Periodic>, EngineError> {
    let went = warm_up(prepared, engine, check.as_deref_mut(), stop, progress)?;
    if let Some(check) = check {
        if let Some(temperatures) = engine.network_temperatures()?
            && let Some(network) = engine.network()
        {
            check.start_network(&temperatures, network.on());
        }
        check.begin_halves()?;
    }
    Ok(went)
}

fn warm_up(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<Periodic>, EngineError> {
    let step = prepared.scene.time.step;
    let steps = prepared.warm_up_steps();
    let time = |number: u32| step * (f64::from(number) - f64::from(steps));
    match prepared.scene.initial {
        Initial::Balance => {
            let load = prepared.loads.step_load(time(0), time(1));
            engine.settle(&load, time(0))?;
            if let Some(check) = check.as_deref_mut() {
                check.settle(&load, time(0));
            }
        }
        Initial::Temperature(temperature) => {
            engine.settle_at(temperature, prepared.nodes.vertex_of_node.len())?;
            if let Some(check) = check.as_deref_mut() {
                check.settle_at(temperature);
            }
        }
    }
    if let Some(tolerance) = prepared.scene.time.periodic {
        return periodic::warm_up(prepared, engine, check, tolerance, stop, progress);
    }
    let passing = (0..steps).map(|number| Passing { start: time(number), end: time(number + 1), steps: 1.0 });
    forward(prepared, engine, check, passing, stop, progress)?;
    Ok(None)
}

/// What takes the results of a run.
pub trait Consumer<E> {
    /// Takes the results of a step, in order.
    ///
    /// # Errors
    /// What ends the run.
    fn take(&mut self, result: StepResult) -> Result<(), E>;

    /// Whether the state is to be saved before a step. It is asked between two steps.
    fn wants_state(&self, _next: u32) -> bool {
        false
    }

    /// Takes the state between two steps. All results of the steps before were taken.
    ///
    /// # Errors
    /// What ends the run.
    fn save(&mut self, _next: u32, _engine: &mut dyn Engine, _check: Option<&mut Check>) -> Result<(), E> {
        Ok(())
    }
}

/// A function that takes the results, and no state.
struct Only<'a, E>(&'a mut dyn FnMut(StepResult) -> Result<(), E>);

impl<E> Consumer<E> for Only<'_, E> {
    fn take(&mut self, result: StepResult) -> Result<(), E> {
        self.0(result)
    }
}

/// Runs all steps of the scene from time 0. Results are handed over in order while the next step is computed. `stop` ends the run after the step under way.
/// Returns whether all steps were made.
///
/// # Errors
/// A call that fails, or what `consume` returns.
pub fn run<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    stop: &AtomicBool,
    consume: &mut dyn FnMut(StepResult) -> Result<(), E>,
) -> Result<bool, E> {
    run_from(prepared, engine, check, 0, stop, &mut Only(consume))
}

/// Runs the steps from `first` on, with the engine and the check in the state before that step. The state is offered for saving where `consumer` wants it,
/// and at the end.
///
/// # Errors
/// As [`run`].
pub fn run_from<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    first: u32,
    stop: &AtomicBool,
    consumer: &mut dyn Consumer<E>,
) -> Result<bool, E> {
    let time = &prepared.scene.time;
    // The last step, which is still on the device, with the temperatures of the reference at that step.
    let mut waiting: Option<(u32, Option<DAffine3>, Option<Vec<f64>>)> = None;
    let trace = engine.trace();
    let (mut next, mut complete) = (first, true);
    for step in first..=time.steps {
        if stop.load(Ordering::Relaxed) {
            complete = false;
            break;
        }
        if step > first && consumer.wants_state(step) {
            if let Some(last) = waiting.take() {
                hand_over(prepared, engine, check.as_deref_mut(), last, consumer)?;
            }
            consumer.save(step, engine, check.as_deref_mut())?;
        }
        next = step.saturating_add(1);
        let now = f64::from(step) * time.step;
        let prepares = trace.span(Track::Host, "loads of the step");
        let load = (step > 0).then(|| prepared.loads.step_load(now - time.step, now));
        drop(prepares);
        let pose = is_drawn(&time.draw, step).then(|| pose_at(prepared, now)).flatten();
        let advance = load.as_ref().map(|load| Step { load, steps: 1.0, start: now - time.step, length: time.step });
        let joints = pose.map(|_| prepared.loads.joints_at(now).1).unwrap_or_default();
        engine.submit(advance, Order { pose, joints: &joints, temperatures: true })?;
        let reference = check.as_deref_mut().map(|check| {
            let _checks = trace.span(Track::Host, "f64 reference of the sample");
            if let Some(load) = &load {
                check.step(load, 1.0, now - time.step, time.step);
            }
            check.temperatures()
        });
        if let Some(last) = waiting.replace((step, pose, reference)) {
            hand_over(prepared, engine, check.as_deref_mut(), last, consumer)?;
        }
    }
    if let Some(last) = waiting {
        hand_over(prepared, engine, check.as_deref_mut(), last, consumer)?;
    }
    consumer.save(next, engine, check)?;
    Ok(complete)
}

/// Advances the state from time 0 to `time` [s] without results on the way, and returns the image there.
///
/// # Errors
/// A call that fails.
pub fn still(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    time: f64,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<StepResult>, EngineError> {
    let length = prepared.scene.time.step;
    // The rounding of time / step must not add a step of length zero.
    let whole = (time / length + 1e-9).floor();
    let rest = (time / length - whole).max(0.0);
    let passing = (0..whole as u64).map(|number| {
        let start = number as f64 * length;
        Passing { start, end: start + length, steps: 1.0 }
    });
    if !forward(prepared, engine, None, passing, stop, progress)? {
        return Ok(None);
    }
    let load = (rest > 1e-9).then(|| prepared.loads.step_load(whole * length, time));
    let pose = pose_at(prepared, time);
    let advance = load.as_ref().map(|load| Step { load, steps: rest, start: whole * length, length: rest * length });
    engine.submit(advance, Order { pose, joints: &prepared.loads.joints_at(time).1, temperatures: false })?;
    let delivered = engine.deliver()?;
    Ok(Some(StepResult { step: whole as u32, time, pose, delivered }))
}

fn hand_over<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    (step, pose, reference): (u32, Option<DAffine3>, Option<Vec<f64>>),
    consumer: &mut dyn Consumer<E>,
) -> Result<(), E> {
    let time = f64::from(step) * prepared.scene.time.step;
    let delivered = engine.deliver()?;
    if let (Some(check), Some(reference), Some(device)) = (check, reference, &delivered.temperatures) {
        check.compare(step, time, &reference, device);
    }
    consumer.take(StepResult { step, time, pose, delivered })
}

/// Pose of the camera at a time [s]; `None` where the scene has none.
pub fn pose_at(prepared: &Prepared, time: f64) -> Option<DAffine3> {
    let camera = prepared.scene.camera.as_ref()?;
    Some(camera_from_body(camera, &prepared.loads.sky_model().sky(time)))
}

/// Whether a step is drawn.
pub fn is_drawn(draw: &Draw, step: u32) -> bool {
    match draw {
        Draw::None => false,
        Draw::Every(n) => step.is_multiple_of(*n),
        Draw::Steps(steps) => steps.binary_search(&step).is_ok(),
    }
}
