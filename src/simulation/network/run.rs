//! Runs a scene's network: steady state, then integration step by step.

use std::sync::Arc;
use std::time::Instant;

use super::SceneNetwork;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::memory::Buffer;
use crate::gpu::network::NetworkStepper;
use crate::simulation::engine_error::EngineError;
use crate::simulation::stepper::AnyStepper;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::control::{ControlError, Leg, Settings, Use, integrate_leg};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::steady::{SteadyError, steady};
use crate::thermal::network::stepper::Stepper;

/// Cost of a step of a network, including the transfers of loads and temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepCost {
    /// Wall-clock time [ms].
    pub wall_ms: f64,
    /// Device time of the network's submissions [ms]. `None` where the processor integrates.
    pub device_ms: Option<f64>,
}

const COARSE: f64 = 10.0;
/// Tolerance of the reference as a share of the scene's tolerance.
const TIGHT: f64 = 0.1;

/// The state of a scene's network during a run.
pub struct NetworkRun {
    scene: Arc<SceneNetwork>,
    worker: AnyStepper,
    settings: Settings,
    on: Vec<bool>,
    step: f64,
    uses: [Option<Use>; 3],
    rejected: u64,
    switches: u64,
    /// Why the device does not integrate although it was asked to.
    refused: Option<String>,
    costs: Vec<StepCost>,
    /// Start of the step under way, and the device's clock at that time [ms].
    began: (Instant, Option<f64>),
}

impl NetworkRun {
    /// A network that the processor integrates in f64.
    pub fn reference(scene: &Arc<SceneNetwork>) -> Self {
        Self::new(scene, AnyStepper::reference(scene.network(), &scene.sensors()))
    }

    /// A network that the processor integrates in f64 at a tenth of the tolerance, as the reference for errors of sub-steps.
    pub fn tight(scene: &Arc<SceneNetwork>) -> Self {
        let mut run = Self::reference(scene);
        run.settings.tolerance *= TIGHT;
        run
    }

    /// A network on a device, which also uses free buffers of the scene. The processor integrates in f64 where the device does not take the network.
    ///
    /// # Errors
    /// A call that fails.
    pub fn on_device(
        context: &Arc<Context>,
        scene: &Arc<SceneNetwork>,
        spare: Vec<Arc<Buffer>>,
    ) -> Result<Self, GpuError> {
        match NetworkStepper::beside(context, scene.network(), &scene.sensors(), spare) {
            Ok(stepper) => Ok(Self::new(scene, AnyStepper::Device(Box::new(stepper)))),
            Err(GpuError::UnsupportedNetwork { reason }) => {
                Ok(Self { refused: Some(reason), ..Self::reference(scene) })
            }
            Err(error) => Err(error),
        }
    }

    fn new(scene: &Arc<SceneNetwork>, worker: AnyStepper) -> Self {
        Self {
            on: scene.thermostats().iter().map(|thermostat| thermostat.initially_on).collect(),
            settings: Settings { floor: worker.floor(), ..scene.settings },
            scene: Arc::clone(scene),
            worker,
            step: f64::INFINITY,
            uses: [None; 3],
            rejected: 0,
            switches: 0,
            refused: None,
            costs: Vec::new(),
            began: (Instant::now(), None),
        }
    }

    /// Begins a step. The work until `step_ends` is its cost.
    pub fn step_begins(&mut self) {
        self.began = (Instant::now(), self.worker.device_ms());
    }

    /// Ends a step. See `step_begins`.
    pub fn step_ends(&mut self) {
        let (wall, device) = self.began;
        let device_ms = self.worker.device_ms().map(|now| now - device.unwrap_or(0.0));
        self.costs.push(StepCost { wall_ms: wall.elapsed().as_secs_f64() * 1e3, device_ms });
    }

    /// Whether free buffers of the scene were written since the last call.
    pub fn wrote_spare(&mut self) -> bool {
        match &mut self.worker {
            AnyStepper::Device(stepper) => stepper.wrote_spare(),
            AnyStepper::Reference(_) => false,
        }
    }

    /// Allocated device memory in addition to the scene's [bytes]. `None` for a small network, and where the processor integrates.
    pub fn device_bytes(&self) -> Option<u64> {
        self.worker.device()?.device_bytes()
    }

    /// Cost of every step so far.
    pub fn costs(&self) -> &[StepCost] {
        &self.costs
    }

    /// Sets whether steps may err by ten times the tolerance.
    pub fn set_coarse(&mut self, coarse: bool) {
        self.settings.tolerance = self.scene.settings.tolerance * if coarse { COARSE } else { 1.0 };
    }

    /// States of the thermostats.
    pub fn on(&self) -> &[bool] {
        &self.on
    }

    /// Starts from temperatures [K] and states of the thermostats.
    ///
    /// # Errors
    /// A call that fails.
    pub fn start_from(&mut self, temperatures: &[f64], on: &[bool]) -> Result<(), EngineError> {
        self.on = on.to_vec();
        self.set_temperatures(temperatures)
    }

    /// The scene's network.
    pub fn scene(&self) -> &Arc<SceneNetwork> {
        &self.scene
    }

    /// The steady state under the heat of every node [W] at a time [s].
    ///
    /// # Errors
    /// A call that fails, or no steady state.
    pub fn settle(&mut self, heat: Vec<f64>, time: f64) -> Result<(), EngineError> {
        // The search begins at the balance of each node alone.
        let network = self.scene.network();
        let space = network.space_temperature.powi(4);
        let guess = |(heat, area): (&f64, &f64)| (heat.max(0.0) / (STEFAN_BOLTZMANN * area) + space).sqrt().sqrt();
        let emitted: f64 = network.emissive_areas.iter().sum();
        let common = guess((&heat.iter().sum::<f64>(), &emitted)).clamp(3.0, 2000.0);
        self.settle_at(common)?;
        let schedule = self.scene.schedule(heat, &self.on, time, 0.0);
        let network = self.scene.network();
        let found = match steady(&mut self.worker, network, &schedule) {
            // The device steps a large network but does not solve it as a whole.
            Err(SteadyError::Stepper(GpuError::UnsupportedNetwork { .. })) => {
                let mut stepper = ReferenceStepper::new(network.clone(), &self.scene.sensors());
                let Ok(()) = stepper.set_temperatures(&vec![common; network.len()]);
                steady(&mut stepper, network, &schedule).map_err(|error| failure(time, &unsteady(&error)))?
            }
            Err(SteadyError::Stepper(error)) => return Err(error.into()),
            found => found.map_err(|error| failure(time, &unsteady(&error)))?,
        };
        self.worker.set_temperatures(&found.temperatures)?;
        self.on = found.on;
        Ok(())
    }

    /// Sets every node to a temperature [K]. Arithmetic nodes balance at the first step.
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle_at(&mut self, temperature: f64) -> Result<(), EngineError> {
        self.step = f64::INFINITY;
        Ok(self.worker.set_temperatures(&vec![temperature; self.scene.network().len()])?)
    }

    /// One step from `start` [s] of `length` [s] under a constant heat of every node [W].
    ///
    /// # Errors
    /// A call that fails, or temperatures that cannot be found.
    pub fn step(&mut self, heat: Vec<f64>, start: f64, length: f64) -> Result<(), EngineError> {
        let schedule = self.scene.schedule(heat, &self.on, start, length);
        let leg = Leg { horizon: self.scene.horizon.max(length), step: self.step, tight_switches: false };
        let series = integrate_leg(&mut self.worker, self.scene.network(), &schedule, &self.settings, leg, |_| true)
            .map_err(|error| match error {
                ControlError::Stepper(error) => error.into(),
                other => failure(start, &unfinished(&other)),
            })?;
        self.step = series.first_step.unwrap_or(series.step);
        self.on = series.on;
        self.rejected += series.rejected;
        self.switches += series.switches.len() as u64;
        for (sum, new) in self.uses.iter_mut().zip(series.uses) {
            *sum = match (*sum, new) {
                (Some(a), Some(b)) => Some(Use {
                    sub_steps: a.sub_steps + b.sub_steps,
                    time: a.time + b.time,
                    range: [a.range[0].min(b.range[0]), a.range[1].max(b.range[1])],
                    stages: [a.stages[0].min(b.stages[0]), a.stages[1].max(b.stages[1])],
                }),
                (a, b) => a.or(b),
            };
        }
        Ok(())
    }

    /// Temperatures of the nodes [K].
    ///
    /// # Errors
    /// A call that fails.
    pub fn temperatures(&mut self) -> Result<Vec<f64>, EngineError> {
        Ok(self.worker.temperatures()?)
    }

    /// Replaces the temperatures of the nodes [K].
    ///
    /// # Errors
    /// A call that fails.
    pub fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        self.step = f64::INFINITY;
        Ok(self.worker.set_temperatures(temperatures)?)
    }

    /// The work so far in words, as pairs of name and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let worker = match (&self.worker, &self.refused) {
            (AnyStepper::Device(_), _) => "on the device, f32 with carried residual".to_owned(),
            (AnyStepper::Reference(_), None) => "f64 on the processor".to_owned(),
            (AnyStepper::Reference(_), Some(reason)) => {
                format!("f64 on the processor, because of the device: {reason}")
            }
        };
        let mut lines = vec![("integrated".to_owned(), worker)];
        for (name, used) in ["Euler with residual", "RKL2", "TR-BDF2"].iter().zip(&self.uses) {
            if let Some(used) = used {
                let [short, long] = used.range;
                let [fewest, most] = used.stages;
                lines.push((
                    (*name).to_owned(),
                    format!("{} sub-steps of {short:.3} to {long:.3} s, {fewest} to {most} stages", used.sub_steps),
                ));
            }
        }
        let counts = self.worker.counts();
        lines.push(("sub-steps taken back".to_owned(), self.rejected.to_string()));
        lines.push(("stages".to_owned(), counts.stages.to_string()));
        lines.push(("dispatches".to_owned(), counts.dispatches.to_string()));
        if !self.on.is_empty() {
            lines.push(("switches of thermostats".to_owned(), self.switches.to_string()));
        }
        lines
    }
}

fn failure(time: f64, reason: &str) -> EngineError {
    EngineError::Network { time, reason: reason.to_owned() }
}

fn unsteady<E>(error: &SteadyError<E>) -> String {
    match error {
        SteadyError::Stepper(_) => "the stepper failed".to_owned(),
        SteadyError::Closed { node } => format!("the heat of node {node} has no path to a boundary or to space"),
        SteadyError::NotFound { node } => format!(
            "no steady state was found (node {node} is furthest from it): state initial.temperature to start elsewhere"
        ),
        SteadyError::Cycles { thermostat } => format!(
            "no steady state: thermostat {thermostat} has none, on or off; state initial.temperature to start elsewhere"
        ),
    }
}

/// The cause of an integration error, in words.
pub(crate) fn unfinished<E>(error: &ControlError<E>) -> String {
    match error {
        ControlError::Stepper(_) => "the stepper failed".to_owned(),
        ControlError::Unbalanced { node, .. } => format!("the arithmetic nodes do not balance, worst at node {node}"),
        ControlError::NoStep { node, temperature, .. } => {
            format!("no sub-step is short enough; node {node} is at {temperature} K")
        }
        ControlError::Stiff { nodes: [a, b], conductance, .. } => {
            format!("no sub-step is short enough; nodes {a} and {b} have a GL of {conductance:e} W/K")
        }
        ControlError::TooHot { node, temperature, .. } => {
            format!("node {node} is hotter than the device holds, {temperature} K")
        }
        ControlError::Chatter { thermostat, .. } => format!("thermostat {thermostat} switches without end"),
        ControlError::Stopped => "it was stopped".to_owned(),
    }
}
