//! Runs a scene's network step by step.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use super::SceneNetwork;
use super::failure::{failure, unfinished};
use super::given::HeaterHeat;
use super::left::OnePassExit;
use crate::gpu::samples::Samples;
use crate::simulation::engine_error::EngineError;
use crate::thermal::network::control::{ControlError, IntegrationSettings, Leg, MethodUse, Switch, integrate_leg};
use crate::thermal::network::islands::Islands;
use crate::thermal::network::one_pass::{Estimate, Halving, HalvingCourse, OnePassNetwork, SWITCHES_AT_MOST};
use crate::thermal::network::reference::ReferenceStepper;
use crate::trace::span;

/// Cost of a step of a network, including the transfers of loads and temperatures.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StepCost {
    /// Wall-clock time [ms].
    pub wall_ms: f64,
}

/// Most switches in steps of one pass that are kept.
pub(crate) const LOCATED_AT_MOST: usize = 64;

const COARSE: f64 = 10.0;
/// Tolerance of the reference as a share of the scene's tolerance.
const TIGHT: f64 = 0.1;

/// What the steps of a network change, apart from its temperatures. A saved state keeps this.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct NetworkCourse {
    /// States of the thermostats.
    pub(super) on: Vec<bool>,
    /// Length of the next sub-step [s].
    pub(super) step: f64,
    /// The same of the sets of islands.
    pub(super) island_steps: Vec<f64>,
    pub(super) uses: [Option<MethodUse>; 3],
    pub(super) rejected: u64,
    pub(super) switches: u64,
    pub(super) given: HeaterHeat,
    /// Where the network left the one pass.
    pub(super) left: Option<OnePassExit>,
    pub(super) costs: Samples<StepCost>,
}

/// The state of a scene's network during a run.
pub struct NetworkRun {
    pub(super) scene: Arc<SceneNetwork>,
    pub(super) worker: ReferenceStepper,
    /// The network in islands, where these take sub-steps of their own in place of the worker.
    pub(super) islands: Option<Islands>,
    pub(super) settings: IntegrationSettings,
    pub(super) course: NetworkCourse,
    located: VecDeque<Switch>,
    /// The estimated error of the steps in the frames of a device, and how often they are halved.
    pub(super) told: Option<(Estimate, Halving)>,
    /// The network in one pass in f64, where the processor steps it so.
    pub(super) one_pass: Option<OnePassNetwork>,
    /// Whether the frames of a device step the network.
    pub(super) in_frames: bool,
    /// Start of the step under way.
    began: Instant,
}

impl NetworkRun {
    /// A network that the processor integrates in f64.
    pub(crate) fn reference(scene: &Arc<SceneNetwork>) -> Self {
        let one_pass = scene.plan().map(|plan| OnePassNetwork::new(plan, scene.heaters(), scene.settings.tolerance));
        Self { one_pass, ..Self::new(scene) }
    }

    /// A network that the processor integrates in f64 at a tenth of the tolerance and never in one pass, as the reference for errors of sub-steps.
    pub(crate) fn tight(scene: &Arc<SceneNetwork>) -> Self {
        let mut run = Self { one_pass: None, ..Self::reference(scene) };
        run.settings.tolerance *= TIGHT;
        let heated =
            scene.heated.iter().filter_map(|heated| Some((heated.thermostat.as_ref()?.sensor, &heated.shares[..])));
        run.islands = Some(Islands::new(scene.network(), &heated.collect::<Vec<_>>()));
        run
    }

    /// A network beside a device, whose frames step it in one pass where it fits. Otherwise the processor integrates it in f64.
    pub(crate) fn beside_device(scene: &Arc<SceneNetwork>) -> Self {
        Self { in_frames: scene.plan().is_some(), ..Self::new(scene) }
    }

    fn new(scene: &Arc<SceneNetwork>) -> Self {
        Self {
            course: NetworkCourse {
                on: scene.thermostats().iter().map(|thermostat| thermostat.initially_on).collect(),
                step: f64::INFINITY,
                island_steps: Vec::new(),
                uses: [None; 3],
                rejected: 0,
                switches: 0,
                given: HeaterHeat::default(),
                left: None,
                costs: Samples::default(),
            },
            settings: scene.settings,
            scene: Arc::clone(scene),
            worker: ReferenceStepper::new(scene.network().clone(), &scene.sensors()),
            islands: None,
            located: VecDeque::new(),
            told: None,
            one_pass: None,
            in_frames: false,
            began: Instant::now(),
        }
    }

    /// Whether the frames of a device step the network. The temperatures of the network then come from the frames.
    pub(crate) fn is_in_frames(&self) -> bool {
        self.in_frames
    }

    /// Begins a step. The work until `step_ends` is its cost.
    pub(crate) fn step_begins(&mut self) {
        self.began = Instant::now();
    }

    /// Ends a step. See `step_begins`.
    pub(crate) fn step_ends(&mut self) {
        self.course.costs.push(StepCost { wall_ms: self.began.elapsed().as_secs_f64() * 1e3 });
    }

    /// Begins to count the heat of the heaters at time 0.
    pub(crate) fn count_heat(&mut self) {
        self.course.given = HeaterHeat::at(0.0, &self.scene.heaters_on(&self.course.on));
    }

    /// Heat that every heater has given from time 0 until a time [J].
    pub(crate) fn given(&self, time: f64) -> Vec<f64> {
        (0..self.scene.heated.len())
            .map(|heater| self.course.given.until(heater, &self.scene.heated[heater].power, time))
            .collect()
    }

    /// Counts the heat of a heater at its switch.
    fn count_switch(&mut self, switch: &Switch) {
        if let Some(heater) = self.scene.heater_of(switch.thermostat) {
            self.course.given.switch(heater, &self.scene.heated[heater].power, switch.time, switch.on);
        }
    }

    /// Cost of every step so far.
    pub fn costs(&self) -> &[StepCost] {
        &self.course.costs
    }

    /// Forgets the costs of the steps so far, and bounds how many are kept.
    pub(crate) fn keep_few_costs(&mut self, most: usize) {
        self.course.costs = Samples::at_most(most);
    }

    /// Sets whether steps may err by ten times the tolerance.
    pub(crate) fn set_coarse(&mut self, coarse: bool) {
        self.settings.tolerance = self.scene.settings.tolerance * if coarse { COARSE } else { 1.0 };
    }

    pub(crate) fn on(&self) -> &[bool] {
        &self.course.on
    }

    /// Starts from temperatures [K] and states of the thermostats.
    pub(crate) fn start_from(&mut self, temperatures: &[f64], on: &[bool]) {
        self.course.on = on.to_vec();
        self.set_temperatures(temperatures);
    }

    /// The scene's network.
    pub fn scene(&self) -> &Arc<SceneNetwork> {
        &self.scene
    }

    /// Starts with every node at a temperature [K]. Arithmetic nodes balance at the first step.
    pub(crate) fn settle_at(&mut self, temperature: f64) {
        self.course.on = self.scene.thermostats().iter().map(|one| one.begins_on(temperature)).collect();
        self.set_temperatures(&vec![temperature; self.scene.network().len()]);
    }

    /// One step from `start` [s] of `length` [s] under a constant heat of every node [W].
    ///
    /// # Errors
    /// Temperatures that cannot be found.
    pub(crate) fn step(&mut self, heat: Vec<f64>, start: f64, length: f64) -> Result<(), EngineError> {
        let _steps = span("stepping the network");
        if let Some(one_pass) = &mut self.one_pass {
            let switches = one_pass.advance(&heat, &self.scene.heater_powers(start, length), start, length);
            self.course.on = one_pass.on();
            self.take_switches(&switches)?;
            let Some(one_pass) = &self.one_pass else { return Ok(()) };
            if let Some(node) = one_pass.temperatures().iter().position(|temperature| !temperature.is_finite()) {
                return Err(failure(start, &format!("node {node} has no temperature")));
            }
            if self.gives_up(*one_pass.halving()) {
                let (temperatures, estimate) = (one_pass.temperatures().to_vec(), one_pass.estimate());
                self.change_over(&temperatures, estimate, start + length);
            }
            return Ok(());
        }
        let schedule = self.scene.schedule(heat, &self.course.on, start, length);
        let (horizon, settings) = (self.scene.horizon.max(length), &self.settings);
        let done = match &mut self.islands {
            Some(islands) => islands.integrate(&schedule, settings, horizon, &mut self.course.island_steps),
            None => {
                let leg = Leg { horizon, step: self.course.step, tight_switches: false };
                let network = self.scene.network();
                let (series, ended) = integrate_leg(&mut self.worker, network, &schedule, settings, leg, |_| true);
                ended.map(|()| series)
            }
        };
        let series = done.map_err(|error| match error {
            ControlError::Chatter { time, thermostat, switches, within } => {
                let why = schedule.thermostats[thermostat].chatter(switches, within);
                failure(start + time, &format!("the {} {why}", self.scene.thermostat_name(thermostat)))
            }
            other => failure(start, &unfinished(&other)),
        })?;
        self.course.step = series.first_step.unwrap_or(series.step);
        self.course.on = series.on;
        self.course.rejected += series.rejected;
        self.course.switches += series.switches.len() as u64;
        for switch in &series.switches {
            self.count_switch(&Switch { time: start + switch.time, ..*switch });
        }
        self.course.uses = MethodUse::sums(self.course.uses, series.uses);
        Ok(())
    }

    /// Takes the switches of a step in one pass.
    ///
    /// # Errors
    /// A thermostat whose band can not hold.
    pub(crate) fn take_switches(&mut self, switches: &[Switch]) -> Result<(), EngineError> {
        self.course.switches += switches.len() as u64;
        for switch in switches {
            self.course.on[switch.thermostat] = switch.on;
            self.count_switch(switch);
            if self.located.len() == LOCATED_AT_MOST {
                self.located.pop_front();
            }
            self.located.push_back(*switch);
        }
        for (number, thermostat) in self.scene.thermostats().into_iter().enumerate() {
            let mut own = switches.iter().filter(|switch| switch.thermostat == number);
            let (first, count) = (own.next().map_or(0.0, |first| first.time), 1 + own.clone().count() as u32);
            if count >= SWITCHES_AT_MOST {
                let why = thermostat.chatter(count, own.next_back().map_or(0.0, |last| last.time - first));
                return Err(failure(first, &format!("the {} {why}", self.scene.thermostat_name(number))));
            }
        }
        Ok(())
    }

    /// Takes the estimated error of the steps in the frames of a device, and how often they are halved.
    pub(crate) fn take_estimate(&mut self, told: Option<(Estimate, Halving)>) {
        self.told = told;
    }

    /// The last switches of thermostats in steps of one pass, at most `LOCATED_AT_MOST`.
    pub fn located(&self) -> impl Iterator<Item = &Switch> {
        self.located.iter()
    }

    /// Takes another course of halvings from the next step on. Returns the course so far.
    pub(crate) fn take_halving_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        self.one_pass.as_mut().map(|one_pass| one_pass.take_course(course)).unwrap_or_default()
    }

    /// Temperatures of the nodes [K].
    pub(crate) fn temperatures(&self) -> Vec<f64> {
        match (&self.one_pass, &self.islands) {
            (Some(one_pass), _) => one_pass.temperatures().to_vec(),
            (None, Some(islands)) => islands.temperatures(),
            (None, None) => self.worker.temperatures(),
        }
    }

    /// Replaces the temperatures of the nodes [K].
    pub(crate) fn set_temperatures(&mut self, temperatures: &[f64]) {
        self.course.step = f64::INFINITY;
        self.course.island_steps.clear();
        if let Some(islands) = &mut self.islands {
            islands.set_temperatures(temperatures);
        }
        if let Some(one_pass) = &mut self.one_pass {
            one_pass.set_temperatures(temperatures);
            one_pass.set_on(&self.course.on);
        }
        self.worker.set_temperatures(temperatures);
    }
}
