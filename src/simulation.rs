//! The loop of a run: settle, warm up, then step, draw and collect.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DAffine3;

pub mod check;
pub mod density;
pub mod device_data;
pub mod device_engine;
pub mod distant;
mod emissivity;
pub mod energy;
pub mod engine;
mod engine_error;
pub mod exchange;
mod exchange_device;
mod exchange_poses;
pub mod facade;
pub mod facade_error;
pub mod forecast;
pub mod forward;
pub mod given;
pub mod image;
pub mod joints;
pub mod keep;
pub mod network;
pub mod network_file;
pub mod periodic;
pub mod pose;
pub mod prepare;
pub mod prepare_error;
mod prepare_names;
mod prepare_steps;
pub mod reference_engine;
pub mod sampling;
pub mod state;
mod structures;
pub mod surroundings;
pub mod target;
pub mod thermal_state;
pub mod traced;
pub mod viewpoint;

use crate::gpu::layout::FUSED_STEPS;
use crate::saved::{Saved, SavedError};
use crate::scene::{Draw, Initial};
use crate::trace::Track;
use check::Check;
use engine::{Delivered, Engine, EngineError, Moment, Order, Rows, Step};
use forward::{Passing, forward};
use keep::{Keep, KeepNothing};
use periodic::Periodic;
use prepare::Prepared;
use state::restore;
use surroundings::surroundings_at;
use viewpoint::camera_from_body;

/// The results of a step.
pub struct StepResult {
    /// Number of the step; 0 is the initial state. An image at its own time lies in the interval of this step.
    pub step: u32,
    /// Number of an image at its own time. `None` at the end of a step.
    pub image: Option<u32>,
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
        check.begin_halves();
    }
    Ok(went)
}

/// Time at which a step of the warm-up begins [s].
fn warm_up_time(prepared: &Prepared, number: u32) -> f64 {
    prepared.scene.time.warm_up_step * (f64::from(number) - f64::from(prepared.warm_up_steps()))
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
    let length = prepared.scene.time.warm_up_step / prepared.scene.time.step;
    let mut done = first;
    while done < steps {
        let end = done.saturating_add(at_once).min(steps);
        let passing = (done..end).map(|number| Passing { start: time(number), end: time(number + 1), steps: length });
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
    // What was submitted last, and is still on the device.
    let mut waiting: Option<Waiting> = None;
    let trace = engine.trace();
    let (mut next, mut complete) = (first, true);
    for step in first..=time.steps {
        if stop.load(Ordering::Relaxed) {
            complete = false;
            break;
        }
        if step > first && consumer.wants_state(step) {
            if let Some(last) = waiting.take() {
                hand_over(engine, check.as_deref_mut(), last, consumer)?;
            }
            consumer.save(step, engine, check.as_deref_mut())?;
        }
        next = step.saturating_add(1);
        let now = f64::from(step) * time.step;
        let prepares = trace.span(Track::Host, "loads of the step");
        let load = (step > 0).then(|| prepared.loads.step_load(now - time.step, now));
        drop(prepares);
        let images = time.draw.in_step(step, time.step);
        let pose = is_drawn(&time.draw, step).then(|| pose_at(prepared, now)).flatten();
        let advance = load.as_ref().map(|load| Step { load, steps: 1.0, start: now - time.step, length: time.step });
        let joints = pose.map(|_| prepared.loads.joints_at(now).1).unwrap_or_default();
        let moments = moments(prepared, now, None);
        let rows = moments.as_ref().filter(|_| pose.is_some()).map(|moments| Rows(moments));
        let surroundings = pose.and_then(|pose| surroundings_at(prepared, now, &pose));
        let order = Order {
            pose,
            joints: &joints,
            rows,
            keep: !images.is_empty(),
            between: None,
            temperatures: true,
            absorbed: true,
            time: now,
            surroundings,
        };
        engine.submit(advance, order)?;
        let reference = check.as_deref_mut().map(|check| {
            let _checks = trace.span(Track::Host, "f64 reference of the sample");
            if let Some(load) = &load {
                check.step(load, 1.0, now - time.step, time.step, engine.exchange_poses());
            }
            check.temperatures()
        });
        if let Some(last) = waiting.replace(Waiting { step, image: None, time: now, pose, reference }) {
            hand_over(engine, check.as_deref_mut(), last, consumer)?;
        }
        for image in images {
            let image = submit_image(prepared, engine, step, image)?;
            if let Some(last) = waiting.replace(image) {
                hand_over(engine, check.as_deref_mut(), last, consumer)?;
            }
        }
    }
    if let Some(last) = waiting {
        hand_over(engine, check.as_deref_mut(), last, consumer)?;
    }
    consumer.save(next, engine, check)?;
    Ok(complete)
}

/// Work that was submitted and not yet delivered.
struct Waiting {
    step: u32,
    image: Option<u32>,
    time: f64,
    pose: Option<DAffine3>,
    /// Temperatures of the reference at the end of a step.
    reference: Option<Vec<f64>>,
}

/// Submits an image at its own time [s], in the interval of a step that was submitted before.
fn submit_image(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    step: u32,
    (number, time): (u32, f64),
) -> Result<Waiting, EngineError> {
    let passed = time / prepared.scene.time.step - (f64::from(step) - 1.0);
    let share = if step == 0 { 1.0 } else { passed.clamp(0.0, 1.0) };
    let pose = pose_of(prepared, time, Some(number));
    let joints = prepared.loads.joints_at(time).1;
    let moments = moments(prepared, time, Some(number));
    let rows = moments.as_ref().map(|moments| Rows(moments));
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, time, &pose));
    let order = Order { pose, joints: &joints, rows, between: Some(share), surroundings, time, ..Order::default() };
    engine.submit(None, order)?;
    Ok(Waiting { step, image: Some(number), time, pose, reference: None })
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
    let moments = moments(prepared, time, None);
    let rows = moments.as_ref().map(|moments| Rows(moments));
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, time, &pose));
    engine.submit(advance, Order { pose, joints: &joints, rows, surroundings, time, ..Order::default() })?;
    let delivered = engine.deliver()?;
    Ok(Some(StepResult { step: whole as u32, image: None, time, pose, delivered }))
}

fn hand_over<E: From<EngineError>>(
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    Waiting { step, image, time, pose, reference }: Waiting,
    consumer: &mut dyn Consumer<E>,
) -> Result<(), E> {
    let delivered = engine.deliver()?;
    if let (Some(check), Some(reference), Some(device)) = (check, reference, &delivered.temperatures) {
        check.compare(step, time, &reference, device);
    }
    consumer.take(StepResult { step, image, time, pose, delivered })
}

/// Pose of the camera at a time [s]; `None` where the scene has no camera, or its path has no pose then.
pub fn pose_at(prepared: &Prepared, time: f64) -> Option<DAffine3> {
    pose_of(prepared, time, None)
}

/// The same for an image at its own time.
pub fn pose_of(prepared: &Prepared, time: f64, image: Option<u32>) -> Option<DAffine3> {
    let camera = prepared.scene.camera.as_ref()?.at(time, image).ok()?;
    Some(camera_from_body(&camera, &prepared.loads.sky_model().sky(time)))
}

/// Moments of the rows of an image at a time [s], with its number where it has its own time; `None` where all rows see one pose.
pub fn moments(prepared: &Prepared, time: f64, image: Option<u32>) -> Option<impl Fn(f64) -> Moment + '_> {
    let line_time = prepared.scene.camera.as_ref()?.line_time;
    let moment = move |row: f64| {
        let at = time + row * line_time;
        Moment { pose: pose_of(prepared, at, image).unwrap_or_default(), joints: prepared.loads.joints_at(at).1 }
    };
    (line_time > 0.0).then_some(moment)
}

/// Whether a step is drawn.
pub fn is_drawn(draw: &Draw, step: u32) -> bool {
    match draw {
        Draw::None | Draw::Times(_) => false,
        Draw::Every(n) => step.is_multiple_of(*n),
        Draw::Steps(steps) => steps.binary_search(&step).is_ok(),
    }
}
