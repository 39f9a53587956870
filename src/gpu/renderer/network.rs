//! Steps, sets and reads the thermal network of a scene that its frames step in one pass.

use super::Renderer;
use crate::gpu::effects::network::heaters::{self, LOGGED};
use crate::gpu::effects::network::{
    COUPLINGS, HEATERS, LOG, MEAN_EVEN, MEMORY, POWERS, STATES, SWITCHES, TOLD, WEIGHTS,
};
use crate::gpu::error::GpuError;
use crate::gpu::request::Heating;
use crate::model::nodes::GROUP;
use crate::thermal::network::control::Switch;
use crate::thermal::network::one_pass::{Estimate, Halving, HalvingCourse, Told};

impl Renderer {
    /// Prepares the steps of the network over `steps` steps of the scene: whether they are halved, their weights, and the
    /// power of heaters.
    pub(super) fn renew_network(&mut self, steps: f64, heating: Option<Heating<'_>>) -> Result<(), GpuError> {
        if self.scene.network.as_mut().is_some_and(|network| network.halvings.is_due()) {
            self.slots.wait()?;
            let recent = self.recent()?;
            let Some(network) = &mut self.scene.network else { return Ok(()) };
            network.halvings.now.take(recent.estimate());
            (network.told, network.told_steps) = (network.told.and(recent), 0);
            let nothing = vec![[0.0f32; 4]; network.tables.shape.estimated() as usize];
            self.resources.upload(&mut self.once, &TOLD, &nothing)?;
            self.resources.free_staging();
        }
        let Some(network) = &mut self.scene.network else { return Ok(()) };
        if network.prepare(steps) {
            // Frames in flight may still read the old weights.
            self.slots.wait()?;
            self.upload_plan()?;
            self.resources.free_staging();
        }
        let Some(network) = self.scene.network.as_ref().filter(|network| !network.tables.heaters.is_empty()) else {
            return Ok(());
        };
        let length = steps * network.tables.step;
        let slot = self.slots.free()?;
        self.read_log(slot);
        let Heating { start, powers } = heating.unwrap_or(Heating { start: 0.0, powers: &[] });
        let powers: Vec<f32> = powers.iter().map(|power| *power as f32).collect();
        self.resources.write(&POWERS, slot, &powers)?;
        self.scene.network.iter_mut().for_each(|network| network.unread[slot] = Some([start, length]));
        Ok(())
    }

    /// Brings the weights and the heaters of the present plan to the device.
    pub(super) fn upload_plan(&mut self) -> Result<(), GpuError> {
        let Some(network) = &self.scene.network else { return Ok(()) };
        self.resources.upload(&mut self.once, &WEIGHTS, &network.tables.weights(&network.plan))?;
        self.resources.upload(&mut self.once, &HEATERS, &network.tables.heater_words(&network.plan))
    }

    /// The estimated error that the device keeps. No frame is in flight.
    fn recent(&mut self) -> Result<Told, GpuError> {
        let Some(network) = &self.scene.network else { return Ok(Told::default()) };
        let groups = network.tables.shape.estimated() as usize;
        if groups == 0 {
            return Ok(network.told(&[]));
        }
        let kept: Vec<[f32; 4]> = self.resources.download(&mut self.once, &TOLD, groups)?;
        Ok(network.told(&kept))
    }

    /// How often the step of the network is halved. `None` where the frames do not step it.
    pub(crate) fn halving(&self) -> Option<Halving> {
        self.scene.network.as_ref().map(|network| network.halvings.now)
    }

    /// Takes another course of halvings from the next frame on. Returns the course so far.
    pub(crate) fn take_halving_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        self.scene.network.as_mut().map(|network| network.halvings.take_course(course)).unwrap_or_default()
    }

    /// Leaves the network to the host from now on. No frame is in flight.
    pub(crate) fn end_network(&mut self) {
        self.scene.network = None;
    }

    /// Estimated error of all steps of the network so far, and how often its step is halved. `None` where the frames do not step it.
    ///
    /// # Errors
    /// A call that fails.
    pub fn network_estimate(&mut self) -> Result<Option<(Estimate, Halving)>, GpuError> {
        self.wait()?;
        let recent = self.recent()?;
        Ok(self.scene.network.as_ref().map(|network| (network.told.and(recent).estimate(), network.halvings.now)))
    }

    /// Reads the log of the heaters that the last frame of a slot left. The frame is complete.
    pub(super) fn read_log(&mut self, slot: usize) {
        let Some(network) = &mut self.scene.network else { return };
        let Some([start, length]) = network.unread[slot].take() else { return };
        let heaters = &network.tables.heaters;
        let log = self.resources.read(&LOG, slot, LOGGED * heaters.len());
        let switches = heaters::switches(heaters, log, &network.on, start, length);
        for switch in &switches {
            network.on[switch.thermostat] = switch.on;
        }
        network.switches.extend(switches);
    }

    /// The switches of thermostats since the last call, in frames that are collected.
    pub(crate) fn take_switches(&mut self) -> Vec<Switch> {
        self.scene.network.as_mut().map(|network| std::mem::take(&mut network.switches)).unwrap_or_default()
    }

    /// Temperatures of the network's nodes [K]. `None` where the frames do not step them.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, GpuError> {
        self.wait()?;
        let Some(network) = &self.scene.network else { return Ok(None) };
        let groups = network.tables.shape.groups() as usize;
        let states: Vec<[[f32; GROUP]; 2]> = self.resources.download(&mut self.once, &STATES, groups)?;
        let of = |slot: &u32| {
            let [base, rest] = states[*slot as usize / GROUP].map(|values| f64::from(values[*slot as usize % GROUP]));
            base + rest
        };
        Ok(Some(network.tables.slot_of_node.iter().map(of).collect()))
    }

    /// Replaces the temperatures of the network's nodes [K] and the states of its thermostats. The drawn nodes take the temperatures after the next step.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn set_network(&mut self, temperatures: &[f64], on: &[bool]) -> Result<(), GpuError> {
        self.wait()?;
        let Some(network) = &mut self.scene.network else { return Ok(()) };
        (network.odd, network.age, network.on) = (false, 0, on.to_vec());
        let memory = vec![[[0.0f32; 4]; 4]; network.tables.shape.estimated() as usize];
        let switches = heaters::states(&network.tables.heaters, on);
        let pairs = temperatures.iter().map(|temperature| split(*temperature));
        let bases = network.tables.in_slots(pairs.clone().map(|[base, _]| base));
        let rests = network.tables.in_slots(pairs.map(|[_, rest]| rest));
        let means: Vec<f32> = bases.iter().zip(&rests).map(|(base, rest)| base + rest).collect();
        let groups = bases.chunks(GROUP).zip(rests.chunks(GROUP));
        let states_of_nodes: Vec<f32> = groups.flat_map(|(bases, rests)| [bases, rests].concat()).collect();
        let nothing = vec![0.0f32; GROUP * network.tables.shape.in_blocks() as usize];
        self.resources.upload(&mut self.once, &MEAN_EVEN, &means)?;
        self.resources.upload(&mut self.once, &STATES, &states_of_nodes)?;
        self.resources.upload(&mut self.once, &COUPLINGS, &nothing)?;
        self.resources.upload(&mut self.once, &MEMORY, &memory)?;
        self.resources.upload(&mut self.once, &SWITCHES, &switches)?;
        self.resources.free_staging();
        Ok(())
    }
}

/// Splits a temperature into base and rest [K]. The base is a multiple of 1/256 K.
fn split(temperature: f64) -> [f32; 2] {
    let base = (temperature * 256.0).round() / 256.0;
    [base as f32, (temperature - base) as f32]
}
