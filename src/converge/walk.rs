//! Takes a variant of a scene through its steps and images, and measures its cost.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::ConvergeError;
use super::pixels::SurfaceImage;
use crate::compare::walk;
use crate::host::processor_seconds;
use crate::scene::{Draw, Initial, Scene};
use crate::simulation::engine::{Engine, EngineError, Order};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::simulation::{StepPart, is_drawn, start, step_parts, submit_image};

/// Most pixels of a run that are kept for comparison. Of more images an even share is drawn.
const MOST_PIXELS: usize = 1 << 23;
/// Steps of a pilot, after one that casts the first rays and compiles pipelines.
const PILOT_STEPS: u32 = 12;

/// A run of a variant.
pub(crate) struct VariantRun {
    pub(crate) images: Vec<SurfaceImage>,
    pub(crate) cost: VariantCost,
    /// Orbits of a periodic warm-up.
    pub(crate) orbits: Option<f64>,
}

/// Cost of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct VariantCost {
    /// Mean wall time of a step [ms], without images and warm-up.
    pub(crate) step_ms: f64,
    /// Mean processor time of a step over all threads [ms], where the system tells.
    pub(crate) processor_ms: Option<f64>,
    pub(crate) steps: u32,
    pub(crate) nodes: usize,
    /// Wall time of the whole run [s].
    pub(crate) wall_s: f64,
}

impl VariantCost {
    /// Wall time of all steps [ms].
    pub(crate) fn stepping_ms(&self) -> f64 {
        self.step_ms * f64::from(self.steps)
    }
}

/// Expected wall time of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    /// Preparation, first rays, steps and images [s].
    pub(crate) run_s: f64,
    /// A whole orbit of the warm-up, or the warm-up where the number of its steps is known [s].
    pub(crate) warm_up_s: f64,
}

/// Numbers of the images that are compared, spread evenly: at most [`MOST_PIXELS`] of them together, with `times` numbers for each.
pub(crate) fn kept_images(scene: &Scene, times: usize) -> Vec<usize> {
    let Some(camera) = &scene.camera else { return Vec::new() };
    let count = match &scene.time.draw {
        Draw::Times(times) => times.len(),
        draw => (0..=scene.time.steps).filter(|step| is_drawn(draw, *step)).count(),
    };
    let pixels = camera.width as usize * camera.height as usize;
    let most = (MOST_PIXELS / (times * pixels).max(1)).clamp(1, count.max(1));
    if most >= count {
        return (0..count).collect();
    }
    (0..most).map(|i| (2 * i + 1) * count / (2 * most)).collect()
}

/// A prepared variant, and the images of it that are compared.
pub(crate) struct VariantWalk<'a> {
    pub(crate) prepared: &'a Prepared,
    pub(crate) target: &'a Target,
    pub(crate) kept: &'a [usize],
    pub(crate) stop: &'a AtomicBool,
}

impl VariantWalk<'_> {
    /// Runs the variant. `began` is when its preparation began. `stepped` is called for every step, and not in a periodic warm-up.
    ///
    /// # Errors
    /// A call that fails, or Ctrl-C.
    pub(crate) fn run(&self, began: Instant, stepped: &dyn Fn()) -> Result<VariantRun, ConvergeError> {
        let Self { prepared, kept, .. } = *self;
        let time = &prepared.scene.time;
        let mut engine = self.engine()?;
        let periodic = start(prepared, &mut *engine, None, self.stop, &mut || {
            if time.periodic.is_none() {
                stepped();
            }
        })?;
        let mut images = Vec::new();
        let (mut number, mut step_ms, mut processor_s) = (0, 0.0, Some(0.0));
        for step in 0..=time.steps {
            self.check_stop()?;
            for (part, between) in step_parts(prepared, step) {
                if step > 0 {
                    let before = processor_seconds();
                    step_ms += walk::advance_part(prepared, &mut *engine, part.passing, !between.is_empty())?;
                    let passed = processor_seconds().zip(before).map(|(now, before)| now - before);
                    processor_s = processor_s.zip(passed).map(|(sum, passed)| sum + passed);
                } else if !between.is_empty() {
                    engine.submit(None, Order { keep: true, ..Order::default() })?;
                    engine.deliver()?;
                }
                for image in between {
                    if kept.binary_search(&number).is_ok() {
                        images.extend(self.draw(&mut *engine, step, Some((part, image)))?);
                    }
                    number += 1;
                }
            }
            if step > 0 {
                stepped();
            }
            if is_drawn(&time.draw, step) {
                if kept.binary_search(&number).is_ok() {
                    images.extend(self.draw(&mut *engine, step, None)?);
                }
                number += 1;
            }
        }
        let steps = f64::from(time.steps.max(1));
        let cost = VariantCost {
            step_ms: step_ms / steps,
            processor_ms: processor_s.map(|seconds| seconds * 1e3 / steps),
            steps: time.steps,
            nodes: prepared.nodes.count,
            wall_s: began.elapsed().as_secs_f64(),
        };
        Ok(VariantRun { images, cost, orbits: periodic.map(|periodic| f64::from(periodic.orbits)) })
    }

    /// Measures a few steps and an image. `began` is when the preparation of the variant began.
    ///
    /// # Errors
    /// A call that fails, or Ctrl-C.
    pub(crate) fn pilot(&self, began: Instant) -> Result<Expected, ConvergeError> {
        let prepared = self.prepared;
        let time = &prepared.scene.time;
        let mut engine = self.engine()?;
        match prepared.scene.initial {
            Initial::Balance => engine.settle(&prepared.loads.step_load(0.0, time.step), 0.0)?,
            Initial::Temperature(kelvin) => engine.settle_at(kelvin, prepared.nodes.vertex_of_node.len())?,
        }
        walk::advance(prepared, &mut *engine, 1)?;
        let start_s = began.elapsed().as_secs_f64();
        let drawing = Instant::now();
        self.draw(&mut *engine, 1, None)?;
        let image_s = drawing.elapsed().as_secs_f64();
        let last = PILOT_STEPS.min(time.steps.saturating_sub(1));
        let mut step_s = 0.0;
        for step in 0..last {
            self.check_stop()?;
            step_s += walk::advance(prepared, &mut *engine, step + 2)? / 1e3 / f64::from(last);
        }
        let warm_up = match time.periodic {
            Some(_) => prepared.scene.orbit.period() / time.warm_up_step,
            None => f64::from(prepared.warm_up_steps()),
        };
        let run_s = start_s + step_s * f64::from(time.steps) + image_s * self.kept.len() as f64;
        Ok(Expected { run_s, warm_up_s: warm_up * step_s })
    }

    fn engine(&self) -> Result<Box<dyn Engine>, EngineError> {
        Ok(self.target.engine(self.prepared, self.prepared.scene.camera.as_ref())?)
    }

    fn check_stop(&self) -> Result<(), ConvergeError> {
        if self.stop.load(Ordering::Relaxed) { Err(ConvergeError::Stopped) } else { Ok(()) }
    }

    /// Draws an image at the end of a step, or at its own time.
    fn draw(
        &self,
        engine: &mut dyn Engine,
        step: u32,
        image: Option<(StepPart, (u32, f64))>,
    ) -> Result<Option<SurfaceImage>, EngineError> {
        let image = match image {
            None => walk::draw(self.prepared, engine, f64::from(step) * self.prepared.scene.time.step)?.1,
            Some((part, image)) => {
                submit_image(self.prepared, engine, part, image)?;
                engine.deliver()?.image
            }
        };
        Ok(image.map(|image| (image.temperature, image.part)))
    }
}
