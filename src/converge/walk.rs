//! Takes a variant of a scene through its steps and images, and measures its cost.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::ConvergeError;
use super::pixels::ShownImage;
use crate::compare::walk;
use crate::scene::Draw;
use crate::simulation::engine::{Engine, EngineError, Order};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::simulation::{is_drawn, start, submit_image};

/// Most pixels of a run that are kept for comparison. Of more images an even share is drawn.
const MOST_PIXELS: usize = 1 << 22;
/// Steps of a pilot, after one that casts rays and compiles pipelines.
const PILOT_STEPS: u32 = 3;
/// Ticks of `/proc/self/stat` in a second, which Linux fixes for programs.
const TICKS: f64 = 100.0;

/// A run of a variant.
#[derive(Debug, Clone, Default)]
pub(crate) struct VariantRun {
    pub(crate) images: Vec<ShownImage>,
    pub(crate) cost: VariantCost,
}

/// Cost of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct VariantCost {
    /// Mean wall time of a step [ms], without images and warm-up.
    pub(crate) step_ms: f64,
    pub(crate) steps: u32,
    /// Wall time of the whole run [s].
    pub(crate) wall_s: f64,
    /// Processor time of the whole run over all threads [s], where the system tells.
    pub(crate) cpu_s: Option<f64>,
    pub(crate) nodes: usize,
    /// Steps of the warm-up that were taken.
    pub(crate) warm_up: u64,
}

impl VariantCost {
    /// Wall time of all steps [ms].
    pub(crate) fn stepping_ms(&self) -> f64 {
        self.step_ms * f64::from(self.steps)
    }
}

/// The numbers of the images that are compared: at most [`MOST_PIXELS`], spread evenly.
pub(crate) fn kept_images(prepared: &Prepared) -> Vec<usize> {
    let Some(camera) = &prepared.scene.camera else { return Vec::new() };
    let time = &prepared.scene.time;
    let count = match &time.draw {
        Draw::Times(times) => times.len(),
        draw => (0..=time.steps).filter(|step| is_drawn(draw, *step)).count(),
    };
    let most = (MOST_PIXELS / (camera.width as usize * camera.height as usize).max(1)).clamp(1, count.max(1));
    if most >= count {
        return (0..count).collect();
    }
    (0..most).map(|i| (2 * i + 1) * count / (2 * most)).collect()
}

/// Runs a variant. `began` is when its preparation began. `stepped` is called for every step.
///
/// # Errors
/// A call that fails, or Ctrl-C.
pub(crate) fn run(
    prepared: &Prepared,
    target: &Target,
    kept: &[usize],
    (began, cpu_began): (Instant, Option<f64>),
    stop: &AtomicBool,
    stepped: &mut dyn FnMut(),
) -> Result<VariantRun, ConvergeError> {
    let time = &prepared.scene.time;
    let mut engine = target.engine(prepared, prepared.scene.camera.as_ref()).map_err(EngineError::from)?;
    let periodic = start(prepared, &mut *engine, None, stop, &mut || {
        if time.periodic.is_none() {
            stepped();
        }
    })?;
    let mut images = ImagesOfRun { prepared, kept, next: 0, shown: Vec::new() };
    let mut step_ms = 0.0;
    for step in 0..=time.steps {
        if stop.load(Ordering::Relaxed) {
            return Err(ConvergeError::Stopped);
        }
        let between = time.draw.in_step(step, time.step);
        if step > 0 {
            step_ms += walk::advance_keeping(prepared, &mut *engine, step, !between.is_empty())?;
            stepped();
        } else if !between.is_empty() {
            engine.submit(None, Order { keep: true, ..Order::default() })?;
            engine.deliver()?;
        }
        images.draw(&mut *engine, step, between)?;
    }
    let orbit_steps = prepared.scene.orbit.period() / time.warm_up_step;
    let warm_up = match periodic {
        Some(periodic) => (f64::from(periodic.orbits) * orbit_steps).round() as u64,
        None => u64::from(prepared.warm_up_steps()),
    };
    let cost = VariantCost {
        step_ms: step_ms / f64::from(time.steps.max(1)),
        steps: time.steps,
        wall_s: began.elapsed().as_secs_f64(),
        cpu_s: cpu_seconds().zip(cpu_began).map(|(now, before)| now - before),
        nodes: prepared.nodes.count,
        warm_up,
    };
    Ok(VariantRun { images: images.shown, cost })
}

/// The images of a run under way.
struct ImagesOfRun<'a> {
    prepared: &'a Prepared,
    kept: &'a [usize],
    /// Number of the next image.
    next: usize,
    shown: Vec<ShownImage>,
}

impl ImagesOfRun<'_> {
    /// Draws the kept images of a step: at its end, or `between` steps.
    fn draw(&mut self, engine: &mut dyn Engine, step: u32, between: Vec<(u32, f64)>) -> Result<(), EngineError> {
        let time = &self.prepared.scene.time;
        if is_drawn(&time.draw, step) && self.wanted() {
            let image = walk::draw(self.prepared, engine, f64::from(step) * time.step)?.1;
            self.shown.extend(image.map(|image| (image.temperature, image.part)));
        }
        for image in between {
            if self.wanted() {
                submit_image(self.prepared, engine, step, image)?;
                let image = engine.deliver()?.image;
                self.shown.extend(image.map(|image| (image.temperature, image.part)));
            }
        }
        Ok(())
    }

    fn wanted(&mut self) -> bool {
        self.next += 1;
        self.kept.binary_search(&(self.next - 1)).is_ok()
    }
}

/// Measures a few steps and an image of a variant. Returns how long its whole run will take [s], with a warm-up of `warm_up` steps of the variant, its
/// preparation included.
///
/// # Errors
/// A call that fails.
pub(crate) fn pilot(
    prepared: &Prepared,
    target: &Target,
    images: usize,
    began: Instant,
    warm_up: f64,
) -> Result<f64, ConvergeError> {
    let time = &prepared.scene.time;
    let mut engine = target.engine(prepared, prepared.scene.camera.as_ref()).map_err(EngineError::from)?;
    engine.settle(&prepared.loads.step_load(0.0, time.step), 0.0)?;
    walk::advance(prepared, &mut *engine, 1)?;
    let start_s = began.elapsed().as_secs_f64();
    let last = PILOT_STEPS.min(time.steps.saturating_sub(1));
    let mut step_ms = 0.0;
    for step in 0..last {
        step_ms += walk::advance(prepared, &mut *engine, step + 2)?;
    }
    step_ms /= f64::from(last.max(1));
    let drawn = match &time.draw {
        Draw::Times(times) => {
            engine.submit(None, Order { keep: true, ..Order::default() })?;
            engine.deliver()?;
            let drawing = Instant::now();
            submit_image(prepared, &mut *engine, 0, (0, times.first().copied().unwrap_or(0.0)))?;
            engine.deliver()?;
            drawing.elapsed().as_secs_f64() * 1e3
        }
        _ => walk::draw(prepared, &mut *engine, time.step * f64::from(last + 1))?.0,
    };
    Ok(start_s + ((warm_up + f64::from(time.steps)) * step_ms + images as f64 * drawn) / 1e3)
}

/// Processor time of this process over all its threads [s]. `None` where the system does not tell.
pub(crate) fn cpu_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program is in parentheses and may hold spaces.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / TICKS)
}
