//! The loop of a run: settle, warm up, then step, draw and collect.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DAffine3;

pub mod check;
pub mod density;
pub mod device_data;
pub mod device_engine;
pub mod engine;
mod engine_error;
pub mod forecast;
pub mod forward;
pub mod joints;
pub mod keep;
pub mod network;
pub mod periodic;
pub mod prepare;
pub mod prepare_error;
mod prepare_steps;
pub mod reference_engine;
pub mod state;
pub mod stepper;
pub mod surroundings;
pub mod target;
pub mod viewpoint;

use crate::gpu::layout::FUSED_STEPS;
use crate::saved::{Saved, SavedError};
use crate::scene::{Draw, Initial};
use crate::trace::Track;
use check::Check;
use engine::{Delivered, Engine, EngineError, Order, Step};
use forward::{Passing, forward};
use keep::{Keep, KeepNothing};
use periodic::Periodic;
use prepare::Prepared;
use state::restore;
use surroundings::surroundings_at;
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

/// Steps of a warm-up after which its state may be saved, a multiple of those of a dispatch. Steps of a network take longer.
const WARM_UP_STEPS: [u32; 2] = [4 * FUSED_STEPS as u32, 4];

/// Brings the engine, and the check where there is one, to the state at time 0. Returns the result of a periodic warm-up.
///
/// # Errors
/// A call that fails.
pub fn start(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Option<Periodic>, EngineError> {
    start_from(prepared, engine, check, None, stop, progress, &mut KeepNothing)
}

/// The same from a state that `keep` took in an earlier part of the run. `keep` takes states on the way, the last one where `stop` ends the warm-up.
///
/// # Errors
/// A call that fails, or what `keep` returns.
pub fn start_from<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    earlier: Option<&Saved>,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
    keep: &mut dyn Keep<E>,
) -> Result<Option<Periodic>, E> {
    let first = match earlier {
        Some(saved) => restore(saved, engine, check.as_deref_mut())?,
        None => {
            settle(prepared, engine, check.as_deref_mut())?;
            0
        }
    };
    let went = match prepared.scene.time.periodic {
        Some(tolerance) => {
            let lost = |error: SavedError| E::from(error.into());
            let own = earlier.map(|saved| periodic::Way::of(&saved.part("own"))).transpose().map_err(lost)?;
            periodic::warm_up(prepared, engine, check.as_deref_mut(), tolerance, own, stop, progress, keep)?
        }
        None => {
            (0..first).for_each(|_| progress());
            warm_up(prepared, engine, check.as_deref_mut(), first, stop, progress, keep)?;
            None
        }
    };
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

/// Time at which a step of the warm-up begins [s].
fn warm_up_time(prepared: &Prepared, number: u32) -> f64 {
    prepared.scene.time.step * (f64::from(number) - f64::from(prepared.warm_up_steps()))
}

/// Brings every node to the scene's initial state.
fn settle(prepared: &Prepared, engine: &mut dyn Engine, check: Option<&mut Check>) -> Result<(), EngineError> {
    match prepared.scene.initial {
        Initial::Balance => {
            let [from, to] = [0, 1].map(|number| warm_up_time(prepared, number));
            let load = prepared.loads.step_load(from, to);
            engine.settle(&load, from)?;
            if let Some(check) = check {
                check.settle(&load, from);
            }
        }
        Initial::Temperature(temperature) => {
            engine.settle_at(temperature, prepared.nodes.vertex_of_node.len())?;
            if let Some(check) = check {
                check.settle_at(temperature);
            }
        }
    }
    Ok(())
}

/// Steps a warm-up of a fixed number of steps, from `first` on.
fn warm_up<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    first: u32,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
    keep: &mut dyn Keep<E>,
) -> Result<(), E> {
    let steps = prepared.warm_up_steps();
    let at_once = WARM_UP_STEPS[usize::from(prepared.network.is_some())];
    let time = |number| warm_up_time(prepared, number);
    let mut done = first;
    while done < steps {
        let end = done.saturating_add(at_once).min(steps);
        let passing = (done..end).map(|number| Passing { start: time(number), end: time(number + 1), steps: 1.0 });
        let mut count = 0;
        let mut told = || {
            count += 1;
            progress();
        };
        let went = forward(prepared, engine, check.as_deref_mut(), passing, stop, &mut told)?;
        done += count;
        if !went || (done < steps && keep.wants(done)) {
            engine.wait()?;
            keep.take(done, Saved::default(), engine, check.as_deref_mut())?;
            keep.save()?;
        }
        if !went {
            return Ok(());
        }
    }
    Ok(())
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
        let surroundings = pose.and_then(|pose| surroundings_at(prepared, now, &pose));
        engine.submit(advance, Order { pose, joints: &joints, temperatures: true, surroundings })?;
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
    let joints = prepared.loads.joints_at(time).1;
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, time, &pose));
    engine.submit(advance, Order { pose, joints: &joints, temperatures: false, surroundings })?;
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
