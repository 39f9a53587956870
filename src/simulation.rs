//! The loop of a run after its warm-up: step, draw and collect.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DAffine3;

mod bands;
pub(crate) mod budget;
mod camera_pose;
pub(crate) mod check;
pub(crate) mod corner_image;
pub(crate) mod density;
pub(crate) mod device_data;
pub(crate) mod device_engine;
pub(crate) mod distant;
mod emissivity;
pub(crate) mod energy;
pub(crate) mod engine;
mod engine_error;
pub(crate) mod engine_state;
pub(crate) mod exchange;
mod exchange_device;
mod exchange_poses;
mod exchange_shared;
pub(crate) mod facade;
pub(crate) mod facade_error;
pub(crate) mod forecast;
pub(crate) mod forward;
pub(crate) mod given;
pub(crate) mod host_memory;
pub(crate) mod image;
pub(crate) mod joints;
pub(crate) mod keep;
pub(crate) mod kept_casts;
mod light;
pub(crate) mod light_force;
pub(crate) mod network;
pub(crate) mod network_file;
pub(crate) mod orbit_end;
pub(crate) mod orbits;
pub(crate) mod parts;
pub(crate) mod periodic;
pub(crate) mod pixel_light;
pub(crate) mod pose;
pub(crate) mod prepare;
pub(crate) mod prepare_error;
mod prepare_names;
mod prepare_steps;
pub(crate) mod reference_engine;
pub(crate) mod sampling;
pub(crate) mod state;
mod structures;
pub(crate) mod surroundings;
pub(crate) mod target;
pub(crate) mod thermal_state;
pub(crate) mod traced;
pub(crate) mod uncertainty;
pub(crate) mod viewpoint;
mod visible;
pub(crate) mod warm_up;

use crate::scene::Draw;
use crate::thermal::budget::Budget;
use crate::trace::span;
use budget::{between_budgets, draw_budgets, node_budgets};
pub(crate) use camera_pose::pose_of;
pub use camera_pose::{moments, pose_at};
use check::{Check, SampleEnd};
use engine::{Delivered, Engine, EngineError, EngineStep, ImageMoments, Order};
use forward::forward;
use parts::Passing;
use prepare::Prepared;
use surroundings::surroundings_at;
pub use warm_up::start;

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
    /// Budget of every node in device order at the end of a step [W/m2]. `None` where the scene does not ask for it.
    pub budgets: Option<Arc<Vec<Budget>>>,
}

/// What takes the results of a run.
pub(crate) trait Consumer<E> {
    /// Takes the results of a step, in order.
    ///
    /// # Errors
    /// An error that ends the run.
    fn take(&mut self, result: StepResult) -> Result<(), E>;

    /// Whether the state is to be saved before a step. The run asks this between two steps.
    fn wants_state(&self, _next: u32) -> bool {
        false
    }

    /// Takes the state between two steps. All results of the steps before were taken.
    ///
    /// # Errors
    /// An error that ends the run.
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
/// A call that fails, or the error of `consumer`.
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
pub(crate) fn run_from<E: From<EngineError>>(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    mut check: Option<&mut Check>,
    first: u32,
    stop: &AtomicBool,
    consumer: &mut dyn Consumer<E>,
) -> Result<bool, E> {
    let time = &prepared.scene.time;
    let mut pending = Pending::default();
    let mut budgets = StepBudgets::asked(prepared, engine, first)?;
    let (mut next, mut complete) = (first, true);
    for step in first..=time.steps {
        if stop.load(Ordering::Relaxed) {
            complete = false;
            break;
        }
        if step > first && consumer.wants_state(step) {
            pending.hand_over(engine, check.as_deref_mut(), consumer)?;
            consumer.save(step, engine, check.as_deref_mut())?;
        }
        next = step.saturating_add(1);
        for (place, drawn) in step_parts(prepared, step) {
            let mut submitted = submit_part(prepared, engine, check.as_deref_mut(), place, !drawn.is_empty())?;
            if let Some(budgets) = &mut budgets {
                budgets.end_part(prepared, engine, &mut submitted)?;
            }
            pending.replace(submitted, engine, check.as_deref_mut(), consumer)?;
            for image in drawn {
                let mut image = submit_image(prepared, engine, place, image)?;
                if let Some(budgets) = &budgets {
                    budgets.draw_between(prepared, engine, &mut image)?;
                }
                pending.replace(image, engine, check.as_deref_mut(), consumer)?;
            }
        }
    }
    pending.hand_over(engine, check.as_deref_mut(), consumer)?;
    consumer.save(next, engine, check)?;
    Ok(complete)
}

/// A part of a step.
#[derive(Clone, Copy)]
pub(crate) struct StepPart {
    step: u32,
    /// Its length is 0 in the initial state.
    pub(crate) passing: Passing,
    /// Whether the step ends with it.
    ends: bool,
}

impl StepPart {
    /// Share of the part that has passed at a time [s].
    fn share(&self, time: f64) -> f64 {
        let Passing { start, end, .. } = self.passing;
        if end > start { ((time - start) / (end - start)).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// The parts of a step in order, each with the number and the time [s] of the images in its interval.
pub(crate) fn step_parts(prepared: &Prepared, step: u32) -> Vec<(StepPart, Vec<(u32, f64)>)> {
    let time = &prepared.scene.time;
    let now = f64::from(step) * time.step;
    let parts = match step {
        0 => vec![Passing { start: now, end: now, steps: 0.0 }],
        _ => Passing { start: now - time.step, end: now, steps: 1.0 }.parts(&prepared.loads),
    };
    let count = parts.len();
    let mut images = time.draw.in_step(step, time.step).into_iter().peekable();
    let with_images = |(number, passing): (usize, Passing)| {
        let ends = number + 1 == count;
        let drawn = std::iter::from_fn(|| images.next_if(|(_, time)| ends || *time <= passing.end)).collect();
        (StepPart { step, passing, ends }, drawn)
    };
    parts.into_iter().enumerate().map(with_images).collect()
}

/// Submits a part of a step, and the image at the end of the step. `keep` keeps the temperatures before the part.
fn submit_part(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    check: Option<&mut Check>,
    place: StepPart,
    keep: bool,
) -> Result<Waiting, EngineError> {
    let StepPart { step, passing: Passing { start, end, steps }, ends } = place;
    let finds = span("finding the loads");
    let load = (step > 0).then(|| prepared.loads.step_load(start, end));
    drop(finds);
    let poses = span("posing the image");
    let pose = (ends && is_drawn(&prepared.scene.time.draw, step)).then(|| pose_at(prepared, end)).flatten();
    let advance = load.as_ref().map(|load| EngineStep { load, steps, start, length: end - start });
    let joints = pose.map(|_| prepared.loads.joints_at(end).1).unwrap_or_default();
    let moments = moments(prepared, end, None);
    let moments = moments.as_ref().filter(|_| pose.is_some()).map(|moments| ImageMoments(moments));
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, end, &pose));
    let past = pose.and_then(|_| prepared.past_light(end));
    drop(poses);
    let order = Order {
        pose,
        joints: &joints,
        moments,
        keep,
        between: None,
        temperatures: ends,
        absorbed: true,
        time: end,
        number: None,
        surroundings,
        past: past.as_ref(),
    };
    engine.submit(advance, order)?;
    let reference = check.map(|check| match &load {
        Some(load) => check.step(load, steps, start, end - start, engine.exchange_rows().as_ref()),
        None => check.present(),
    });
    Ok(Waiting { place, image: None, time: end, pose, reference, delivered: None, budgets: None })
}

/// Work that was submitted and not yet delivered.
pub(crate) struct Waiting {
    place: StepPart,
    image: Option<u32>,
    time: f64,
    pose: Option<DAffine3>,
    /// Temperatures of the reference at the end of a step.
    reference: Option<SampleEnd>,
    /// The results, where a budget needed them at once.
    delivered: Option<Delivered>,
    budgets: Option<Arc<Vec<Budget>>>,
}

/// The budgets at both ends of the part of a step that was submitted last. Each part is delivered before the next is submitted, because a budget reads the state of the engine.
struct StepBudgets {
    before: Arc<Vec<Budget>>,
    after: Arc<Vec<Budget>>,
}

impl StepBudgets {
    /// The budgets before the step `first`, where the scene asks for budgets.
    fn asked(prepared: &Prepared, engine: &mut dyn Engine, first: u32) -> Result<Option<Self>, EngineError> {
        if !prepared.scene.images.budget {
            return Ok(None);
        }
        let last = first.checked_sub(1).and_then(|step| Some(step_parts(prepared, step).last()?.0.passing));
        let time = last.map_or(0.0, |last| last.end);
        let now = Arc::new(node_budgets(prepared, engine, last.filter(|last| last.steps > 0.0), time)?);
        Ok(Some(Self { before: Arc::clone(&now), after: now }))
    }

    /// Takes the end of a part that was submitted.
    fn end_part(
        &mut self,
        prepared: &Prepared,
        engine: &mut dyn Engine,
        part: &mut Waiting,
    ) -> Result<(), EngineError> {
        let mut delivered = engine.deliver()?;
        let last = Some(part.place.passing).filter(|passing| passing.steps > 0.0);
        let now = Arc::new(node_budgets(prepared, engine, last, part.time)?);
        self.before = std::mem::replace(&mut self.after, Arc::clone(&now));
        if let Some(image) = &mut delivered.image {
            draw_budgets(prepared, &now, image, None);
        }
        (part.delivered, part.budgets) = (Some(delivered), Some(now));
        Ok(())
    }

    /// States the budgets of an image at its own time in the part.
    fn draw_between(
        &self,
        prepared: &Prepared,
        engine: &mut dyn Engine,
        waiting: &mut Waiting,
    ) -> Result<(), EngineError> {
        let mut delivered = engine.deliver()?;
        if let Some(image) = &mut delivered.image {
            let budgets = between_budgets(&self.before, &self.after, waiting.place.share(waiting.time));
            draw_budgets(prepared, &budgets, image, waiting.image);
        }
        waiting.delivered = Some(delivered);
        Ok(())
    }
}

/// What was submitted last, and the heat that the parts of its step have absorbed so far.
#[derive(Default)]
struct Pending {
    waiting: Option<Waiting>,
    /// Heat of each run of nodes, as its mean over the step [W].
    absorbed: Vec<f64>,
}

impl Pending {
    /// Delivers the work that waits, after `next` was submitted.
    fn replace<E: From<EngineError>>(
        &mut self,
        next: Waiting,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
        consumer: &mut dyn Consumer<E>,
    ) -> Result<(), E> {
        self.hand_over(engine, check, consumer)?;
        self.waiting = Some(next);
        Ok(())
    }

    /// Delivers the work that waits, where there is any.
    fn hand_over<E: From<EngineError>>(
        &mut self,
        engine: &mut dyn Engine,
        check: Option<&mut Check>,
        consumer: &mut dyn Consumer<E>,
    ) -> Result<(), E> {
        let Some(waiting) = self.waiting.take() else { return Ok(()) };
        let Waiting { place: StepPart { step, passing: part, ends }, image, time, pose, reference, .. } = waiting;
        let mut delivered = match waiting.delivered {
            Some(delivered) => delivered,
            None => engine.deliver()?,
        };
        if image.is_none() && part.steps > 0.0 && part.steps < 1.0 {
            let heat = delivered.absorbed.take().unwrap_or_default();
            self.absorbed.resize(heat.len(), 0.0);
            self.absorbed.iter_mut().zip(heat).for_each(|(sum, heat)| *sum += part.steps * heat);
            if !ends {
                return Ok(());
            }
            delivered.absorbed = Some(std::mem::take(&mut self.absorbed));
        }
        if let (Some(check), Some(reference), Some(device)) = (check, reference, &delivered.temperatures) {
            check.compare(step, time, &reference, device);
        }
        consumer.take(StepResult { step, image, time, pose, delivered, budgets: waiting.budgets })
    }
}

/// Submits an image at its own time [s], in the interval of a part that was submitted before.
///
/// # Errors
/// A call that fails.
pub(crate) fn submit_image(
    prepared: &Prepared,
    engine: &mut dyn Engine,
    place: StepPart,
    (number, time): (u32, f64),
) -> Result<Waiting, EngineError> {
    let pose = pose_of(prepared, time, Some(number));
    let joints = prepared.loads.joints_at(time).1;
    let moments = moments(prepared, time, Some(number));
    let moments = moments.as_ref().map(|moments| ImageMoments(moments));
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, time, &pose));
    let past = pose.and_then(|_| prepared.past_light(time));
    let order = Order {
        pose,
        joints: &joints,
        moments,
        past: past.as_ref(),
        between: Some(place.share(time)),
        surroundings,
        time,
        number: Some(number),
        ..Order::default()
    };
    engine.submit(None, order)?;
    Ok(Waiting { place, image: Some(number), time, pose, reference: None, delivered: None, budgets: None })
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
    let last = (rest > 1e-9).then_some(Passing { start: whole * length, end: time, steps: rest });
    if !forward(prepared, engine, None, passing.chain(last), stop, progress)? {
        return Ok(None);
    }
    let pose = pose_at(prepared, time);
    let joints = prepared.loads.joints_at(time).1;
    let moments = moments(prepared, time, None);
    let moments = moments.as_ref().map(|moments| ImageMoments(moments));
    let surroundings = pose.and_then(|pose| surroundings_at(prepared, time, &pose));
    let past = pose.and_then(|_| prepared.past_light(time));
    let past = past.as_ref();
    engine.submit(None, Order { pose, joints: &joints, moments, surroundings, past, time, ..Order::default() })?;
    let delivered = engine.deliver()?;
    Ok(Some(StepResult { step: whole as u32, image: None, time, pose, delivered, budgets: None }))
}

pub(crate) fn is_drawn(draw: &Draw, step: u32) -> bool {
    match draw {
        Draw::None | Draw::Times(_) => false,
        Draw::Every(n) => step.is_multiple_of(*n),
        Draw::Steps(steps) => steps.binary_search(&step).is_ok(),
    }
}
