//! A run of the scene with some values changed: temperatures of parts and probes at every step, and of the pixels of its images.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::SensitivityError;
use crate::output::frame::FrameHeader;
use crate::output::frame_maker::FrameMaker;
use crate::output::tables::NodeGroups;
use crate::simulation::engine::{Engine, EngineError};
use crate::simulation::image::Image;
use crate::simulation::orbit_end::{BaseOrbit, Displacement, with_halvings};
use crate::simulation::prepare::Prepared;
use crate::simulation::state::BetweenSteps;
use crate::simulation::target::Target;
use crate::simulation::warm_up::{pass_base_orbit, start, start_beside, start_near};
use crate::simulation::{StepResult, run};
use crate::thermal::network::one_pass::HalvingCourse;

/// Share of a period by which a run may miss it and be an orbit.
const AN_ORBIT: f64 = 1e-4;

/// Change over an orbit below which the warm-up of a run ends [K].
pub(crate) const TOLERANCE: f64 = 2e-4;

/// The results of a run.
#[derive(Default)]
pub(crate) struct VariantRun {
    /// Time of each step [s].
    pub(crate) times: Vec<f64>,
    /// Temperatures of parts and probes at each step [K]. A part without area has none.
    pub(crate) rows: Vec<Vec<Option<f64>>>,
    /// Images, with what stands in the header of their files.
    pub(crate) images: Vec<(Image, FrameHeader)>,
    /// Temperatures of all nodes in the order of the device [K], with their steps.
    pub(crate) nodes: Vec<(u32, Vec<f32>)>,
    /// Mean temperatures of all nodes over the steps after the first [K].
    mean: Vec<f64>,
    /// Largest change of a node by the last orbit of the warm-up, beyond the change in the scene as it is [K]. Of a run that settles itself, also how far its
    /// start is from the periodic state, by the next move of the warm-up.
    pub(crate) unsettled: f64,
}

impl VariantRun {
    /// The run with a value up by a step: the parabola through the scene as it is and the runs with the value down by a step and by two. The central
    /// difference with it is the difference to one side of second order.
    pub(super) fn beyond(base: &Self, near: &Self, far: &Self) -> Self {
        let at = |base: f64, near: f64, far: f64| 3.0 * (base - near) + far;
        let all = |base: &[f32], near: &[f32], far: &[f32]| -> Vec<f32> {
            let each = base.iter().zip(near).zip(far);
            each.map(|((base, near), far)| at((*base).into(), (*near).into(), (*far).into()) as f32).collect()
        };
        let row = |((base, near), far): ((&Vec<Option<f64>>, &Vec<_>), &Vec<_>)| {
            let each = base.iter().zip(near).zip(far);
            each.map(|((base, near), far): ((_, &Option<f64>), &Option<f64>)| Some(at((*base)?, (*near)?, (*far)?)))
                .collect()
        };
        let mut images = near.images.clone();
        for (i, (image, _)) in images.iter_mut().enumerate() {
            let [base, far] = [base, far].map(|run| &run.images[i].0);
            image.temperature = all(&base.temperature, &image.temperature, &far.temperature);
            image.radiance = all(&base.radiance, &image.radiance, &far.radiance);
        }
        let nodes = base.nodes.iter().zip(&near.nodes).zip(&far.nodes);
        Self {
            times: near.times.clone(),
            rows: base.rows.iter().zip(&near.rows).zip(&far.rows).map(row).collect(),
            images,
            nodes: nodes.map(|(((step, base), (_, near)), (_, far))| (*step, all(base, near, far))).collect(),
            mean: Vec::new(),
            unsettled: 3.0 * near.unsettled + far.unsettled,
        }
    }
}

/// What all runs share.
pub(crate) struct VariantWalk<'a> {
    /// Name of the run in warnings.
    pub(crate) name: &'a str,
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

/// The scene as it is, beside which scenes with other values are run.
pub(super) struct BaseRun {
    pub(super) run: VariantRun,
    /// An orbit at its periodic state, where the scene asks for it: its run, where that is an orbit.
    orbit: Option<BaseOrbit>,
    /// Halvings of the steps of a run that is no orbit.
    halvings: Arc<[u32]>,
}

impl VariantWalk<'_> {
    /// Runs the scene as it is. The engine keeps its view factors, which runs of the same geometry share.
    ///
    /// # Errors
    /// A run that fails, or Ctrl-C.
    pub(super) fn run_base(&self, prepared: &Prepared) -> Result<(BaseRun, Box<dyn Engine>), SensitivityError> {
        let mut engine = self.begin(prepared, None)?;
        let time = &prepared.scene.time;
        let off = f64::from(time.steps) * time.step / prepared.scene.orbit.period() - 1.0;
        if time.periodic.is_some() && off.abs() <= AN_ORBIT {
            let mut run = VariantRun::default();
            let mut pass = |engine: &mut dyn Engine| self.pass(prepared, engine, &mut run);
            let orbit = Some(BaseOrbit::of_run(prepared, &mut *engine, &mut pass)?);
            return Ok((BaseRun { run, orbit, halvings: Arc::default() }, engine));
        }
        let orbit = match time.periodic {
            Some(_) => pass_base_orbit(prepared, &mut *engine, self.stop)?,
            None => None,
        };
        self.check_stop()?;
        let (run, halvings) = with_halvings(&mut *engine, |engine| self.run(prepared, engine))?;
        Ok((BaseRun { run, orbit, halvings }, engine))
    }

    /// The run, which is an orbit. Returns the mean temperatures of the nodes [K].
    fn pass(
        &self,
        prepared: &Prepared,
        engine: &mut dyn Engine,
        run: &mut VariantRun,
    ) -> Result<Vec<f64>, SensitivityError> {
        *run = self.run(prepared, engine)?;
        Ok(std::mem::take(&mut run.mean))
    }

    /// Runs a scene with other values beside the scene as it is. `shift` is how far another such run is from that scene, and the share of that at which this one
    /// begins to settle. Where the run of that scene is an orbit, the run settles itself. Returns also how far it is from that scene.
    ///
    /// # Errors
    /// A run that fails, or Ctrl-C.
    pub(super) fn run_beside(
        &self,
        base: Option<&BaseRun>,
        shift: Option<(&Displacement, f64)>,
        prepared: &Prepared,
    ) -> Result<(VariantRun, Option<Displacement>), SensitivityError> {
        let alone = || {
            let mut engine = self.begin(prepared, None)?;
            Ok((self.run(prepared, &mut *engine)?, None))
        };
        let Some((base, orbit)) = base.and_then(|base| Some((base, base.orbit.as_ref()?))) else { return alone() };
        let camera = prepared.scene.camera.as_ref().filter(|_| !self.kept.is_empty());
        let mut engine = self.target.engine(prepared, camera).map_err(EngineError::from)?;
        let (mut run, mut began) = (VariantRun::default(), None);
        let mut pass = |engine: &mut dyn Engine| {
            began = Some(orbit.displacement(engine)?);
            self.pass(prepared, engine, &mut run)
        };
        let went = start_beside(prepared, &mut *engine, (orbit, shift), (TOLERANCE, self.stop), &mut pass)?;
        self.check_stop()?;
        let Some(periodic) = went else { return alone() };
        let warning = periodic.warning_beside(&format!(" of {}", self.name), prepared.scene.time.warm_up_orbits);
        warning.into_iter().for_each(self.warned);
        let settled = orbit.displacement(&mut *engine)?;
        let unsettled = began.map_or(0.0, |began| began.distance(&settled)).max(periodic.change);
        if run.rows.is_empty() {
            engine.take_halving_course(HalvingCourse::Followed(Arc::clone(&base.halvings), 0));
            run = self.run(prepared, &mut *engine)?;
        }
        Ok((VariantRun { unsettled, ..run }, Some(settled)))
    }

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
        periodic.and_then(|periodic| periodic.warning(&format!(" of {}", self.name))).into_iter().for_each(self.warned);
        Ok(engine)
    }

    /// Takes an engine at time 0 through the run.
    pub(crate) fn run(&self, prepared: &Prepared, engine: &mut dyn Engine) -> Result<VariantRun, SensitivityError> {
        let groups = NodeGroups::new(prepared)?;
        let maker = FrameMaker::new(prepared, &engine.device_name());
        let mut ran = VariantRun::default();
        let steps = prepared.scene.time.steps;
        let is_kept = |step: u32| self.nodes_every.is_some_and(|every| step.is_multiple_of(every) || step == steps);
        let mut number = 0;
        let mut take = |mut result: StepResult| {
            if let Some(temperatures) = result.delivered.temperatures.take() {
                if result.step > 0 {
                    ran.mean.resize(temperatures.len(), 0.0);
                    let add = |(mean, kelvin): (&mut f64, &f32)| *mean += f64::from(*kelvin) / f64::from(steps);
                    ran.mean.iter_mut().zip(&temperatures).for_each(add);
                }
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
