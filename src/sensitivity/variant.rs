//! A run of the scene with some values changed: temperatures of parts and probes at every step, and of the pixels of its images.

use std::sync::atomic::AtomicBool;

use super::SensitivityError;
use crate::output::frame::FrameHeader;
use crate::output::frame_maker::FrameMaker;
use crate::output::tables::NodeGroups;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;
use crate::simulation::state::BetweenSteps;
use crate::simulation::target::Target;
use crate::simulation::warm_up::{start, start_near};
use crate::simulation::{StepResult, run};

/// The results of a run.
pub(crate) struct VariantRun {
    /// Time of each step [s].
    pub(crate) times: Vec<f64>,
    /// Temperatures of parts and probes at each step [K]. A part without area has none.
    pub(crate) rows: Vec<Vec<Option<f64>>>,
    /// Images, with what stands in the header of their files.
    pub(crate) images: Vec<(Image, FrameHeader)>,
    /// Temperatures of all nodes in the order of the device [K], with their steps.
    pub(crate) nodes: Vec<(u32, Vec<f32>)>,
}

/// What all runs share.
pub(crate) struct VariantWalk<'a> {
    pub(crate) target: &'a Target,
    /// Numbers of the images that are kept.
    pub(crate) kept: &'a [usize],
    /// The temperatures of nodes are kept of each multiple of this step, and of the last one.
    pub(crate) nodes_every: Option<u32>,
    pub(crate) stop: &'a AtomicBool,
    /// Is called for each step, and for each orbit of a periodic warm-up.
    pub(crate) stepped: &'a dyn Fn(),
    /// Tells the user a warning.
    pub(crate) warned: &'a dyn Fn(String),
}

impl VariantWalk<'_> {
    /// The engine of a scene at time 0. A periodic state is sought from `near`, where that is known and fits: a network may take another plan with other values.
    pub(crate) fn begin(
        &self,
        prepared: &Prepared,
        near: Option<&BetweenSteps>,
    ) -> Result<Box<dyn Engine>, SensitivityError> {
        let camera = prepared.scene.camera.as_ref().filter(|_| !self.kept.is_empty());
        let make = || self.target.engine(prepared, camera).map_err(EngineError::from);
        let mut told = || (self.stepped)();
        let mut engine = make()?;
        let periodic = match near {
            Some(near) if near.restore(&mut *engine, None).is_ok() => {
                start_near(prepared, &mut *engine, near, self.stop, &mut told)?
            }
            near => {
                if near.is_some() {
                    engine = make()?;
                }
                start(prepared, &mut *engine, None, self.stop, &mut told)?
            }
        };
        self.check_stop()?;
        periodic.and_then(|periodic| periodic.warning("")).into_iter().for_each(self.warned);
        Ok(engine)
    }

    /// Takes an engine at time 0 through the run.
    pub(crate) fn run(&self, prepared: &Prepared, engine: &mut dyn Engine) -> Result<VariantRun, SensitivityError> {
        let groups = NodeGroups::new(prepared)?;
        let maker = FrameMaker::new(prepared, &engine.device_name());
        let mut ran = VariantRun { times: Vec::new(), rows: Vec::new(), images: Vec::new(), nodes: Vec::new() };
        let steps = prepared.scene.time.steps;
        let is_kept = |step: u32| self.nodes_every.is_some_and(|every| step.is_multiple_of(every) || step == steps);
        let mut number = 0;
        let mut take = |mut result: StepResult| {
            if let Some(temperatures) = result.delivered.temperatures.take() {
                let row = groups.row(result.time, &temperatures, &prepared.probes)?;
                let parts = row.parts.iter().map(|part| part.map(|part| part.mean));
                ran.rows.push(parts.chain(row.probes.iter().map(|probe| Some(f64::from(*probe)))).collect());
                ran.times.push(result.time);
                if is_kept(result.step) {
                    ran.nodes.push((result.step, temperatures));
                }
            }
            if result.delivered.image.is_some() {
                if self.kept.binary_search(&number).is_ok() {
                    ran.images.extend(maker.frame(result)?);
                }
                number += 1;
            }
            (self.stepped)();
            Ok::<_, SensitivityError>(())
        };
        run(prepared, engine, None, self.stop, &mut take)?;
        self.check_stop()?;
        Ok(ran)
    }

    fn check_stop(&self) -> Result<(), SensitivityError> {
        if self.stop.load(std::sync::atomic::Ordering::Relaxed) { Err(SensitivityError::Stopped) } else { Ok(()) }
    }
}
