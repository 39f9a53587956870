//! The f64 reference as an engine: the twins of the device functions, and a rasteriser in f64.

mod drawing;

use std::collections::VecDeque;
use std::sync::Arc;

use self::drawing::Drawing;
use super::energy::{absorbed_heat, heat_tables};
use super::engine::{Delivered, Engine, EngineError, EngineStep, Order, SurfaceState};
use super::engine_state::{EngineState, ReferenceEngineState};
use super::exchange::ExchangeTwin;
use super::exchange_poses::RowsBetween;
use super::given::GivenTemperatures;
use super::network::NetworkRun;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::shadow::LitAreas;
use crate::gpu::effects::heat::tables::HeatTables;
use crate::model::nodes::PADDING;
use crate::scene::Camera;
use crate::thermal::between::between;
use crate::thermal::incident::{IncidentFunction, incident};
use crate::thermal::misfit::{Misfit, part};
use crate::thermal::received::FaceLoad;
use crate::thermal::reference::Reference;
use crate::thermal::sensor::twin::SensorTwin;
use crate::trace::span;

/// The f64 reference of all nodes, and its rasteriser.
pub struct ReferenceEngine {
    reference: Reference<IncidentFunction>,
    light: Option<LitAreas>,
    exchange: Option<ExchangeTwin>,
    node_of_slot: Vec<u32>,
    slots: usize,
    /// Temperatures before the last step, where images lie between steps [K].
    earlier: Vec<f64>,
    network: Option<NetworkRun>,
    /// Temperatures of a file.
    given: Option<Arc<GivenTemperatures>>,
    heat: HeatTables,
    steps: u64,
    drawing: Drawing,
    delivered: VecDeque<Delivered>,
}

impl ReferenceEngine {
    /// The scene on the reference. Images are drawn where `camera` is given.
    pub fn new(prepared: &Prepared, camera: Option<&Camera>) -> Self {
        let nodes = &prepared.nodes;
        let slots = nodes.vertex_of_node.len();
        let node_of_slot: Vec<u32> =
            (0..slots as u32).filter(|slot| nodes.vertex_of_node[*slot as usize] != PADDING).collect();
        let drawn = || node_of_slot.iter().map(|slot| *slot as usize);
        let joints = if prepared.joints() > 1 { prepared.joints_of(drawn()) } else { Vec::new() };
        let reference_nodes = drawn().map(|slot| nodes.reference_node(slot)).collect();
        Self {
            reference: Reference::new(reference_nodes, prepared.materials.clone(), incident as IncidentFunction)
                .with_joints(joints),
            light: prepared.lit_areas(drawn()),
            exchange: prepared
                .exchange
                .as_ref()
                .map(|craft| ExchangeTwin::new(craft, &prepared.loads.joints_at(0.0).1)),
            slots,
            earlier: Vec::new(),
            node_of_slot,
            network: prepared.network.as_ref().map(NetworkRun::reference),
            given: prepared.given.clone(),
            heat: heat_tables(prepared),
            steps: 0,
            drawing: Drawing::new(prepared, camera),
            delivered: VecDeque::new(),
        }
    }

    /// Heat of the network's nodes under a load [W], without that of heaters and of other surfaces. Empty without a network.
    pub(crate) fn network_heat(&mut self, load: &StepLoad) -> Vec<f64> {
        self.reference.find_light(&mut self.light, load);
        self.heat(load)
    }

    /// Heat of the network's nodes [W]. Empty without a network.
    fn heat(&self, load: &StepLoad) -> Vec<f64> {
        let Some(network) = &self.network else { return Vec::new() };
        let flux = self.flux(load);
        network.scene().heat(|slot| flux[slot])
    }

    /// Flux that every node of the device absorbs [W/m2].
    fn flux(&self, load: &StepLoad) -> Vec<f64> {
        let mut of_slot = vec![0.0; self.slots];
        for (slot, absorbed) in self.node_of_slot.iter().zip(self.reference.absorbed(load)) {
            of_slot[*slot as usize] = absorbed;
        }
        of_slot
    }

    /// Finds what nodes receive from the craft in a step.
    fn exchange(&mut self, load: &StepLoad, steps: f64) {
        let Some(exchange) = &mut self.exchange else { return };
        let mut temperatures = vec![0.0; self.slots];
        for (slot, temperature) in self.node_of_slot.iter().zip(self.reference.temperatures()) {
            temperatures[*slot as usize] = *temperature;
        }
        let lit = self.reference.lit().of_slots(self.node_of_slot.iter().map(|slot| *slot as usize), self.slots);
        let received = exchange.received(load, steps, |slot| temperatures[slot], &lit);
        self.reference.receive(self.node_of_slot.iter().map(|slot| received[*slot as usize]).collect());
    }

    /// Temperatures of all nodes in device order [K], 0 for padding.
    fn temperatures(&self) -> Vec<f64> {
        let mut temperatures = vec![0.0; self.slots];
        for (slot, temperature) in self.node_of_slot.iter().zip(self.reference.temperatures()) {
            temperatures[*slot as usize] = *temperature;
        }
        temperatures
    }

    /// Takes the temperatures of a file at a time [s].
    fn take_given(&mut self, time: f64) {
        let Some(given) = &self.given else { return };
        let temperatures = given.at(time);
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            self.reference.set_temperature(node, temperatures[*slot as usize]);
        }
    }

    fn take_network(&mut self) {
        let Some(network) = &self.network else { return };
        let temperatures = network.temperatures();
        let mut of_slot = vec![f64::NAN; self.slots];
        network.scene().scatter(&temperatures, |slot, temperature| of_slot[slot] = temperature);
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            if !of_slot[*slot as usize].is_nan() {
                self.reference.set_temperature(node, of_slot[*slot as usize]);
            }
        }
    }

    /// Advances by a step. Returns the heat that each run of nodes absorbed [W], where it was asked for.
    fn advance(&mut self, step: &EngineStep<'_>, absorbed: bool) -> Result<Option<Vec<f64>>, EngineError> {
        self.steps += 1;
        self.reference.find_light(&mut self.light, step.load);
        self.exchange(step.load, step.steps);
        self.reference.step(step.load, step.steps);
        let absorbed = absorbed.then(|| {
            let _absorbs = span("finding absorbed heat in f64");
            let flux = self.flux(step.load);
            absorbed_heat(&self.heat, |slot| flux[slot])
        });
        if let Some(network) = &mut self.network {
            network.step_begins();
        }
        let heat = self.heat(step.load);
        if let Some(network) = &mut self.network {
            network.step(heat, step.start, step.length)?;
        }
        self.take_network();
        self.take_given(step.start + step.length);
        if let Some(network) = &mut self.network {
            network.step_ends();
        }
        Ok(absorbed)
    }
}

impl Engine for ReferenceEngine {
    fn device_name(&self) -> String {
        "cpu (f64 reference)".to_owned()
    }

    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError> {
        self.reference.find_light(&mut self.light, load);
        self.reference.receive(Vec::new());
        self.reference.settle(load);
        self.take_given(time);
        let heat = self.heat(load);
        match &mut self.network {
            Some(network) => network.settle(heat, time)?,
            None => return Ok(()),
        }
        self.take_network();
        Ok(())
    }

    fn settle_at(&mut self, temperature: f64, _nodes: usize) -> Result<(), EngineError> {
        self.reference.settle_at(temperature);
        if let Some(network) = &mut self.network {
            network.settle_at(temperature);
        }
        Ok(())
    }

    fn take_camera(&mut self, camera: &Camera) -> bool {
        self.drawing.take_camera(camera)
    }

    fn take_sensor(&mut self, prepared: &Prepared) -> Result<bool, EngineError> {
        let sensors = self.drawing.sensor.as_mut().zip(prepared.scene.sensor.as_ref());
        Ok(sensors.map(|(own, sensor)| own.take(sensor)).is_some())
    }

    fn submit(&mut self, step: Option<EngineStep<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        if order.keep {
            self.earlier = self.temperatures();
        }
        let absorbed = match &step {
            Some(step) => self.advance(step, order.absorbed)?,
            None => None,
        };
        let mut temperatures = self.temperatures();
        if let Some(share) = order.between {
            let pairs = self.earlier.iter().zip(temperatures);
            temperatures = pairs.map(|(earlier, later)| between(*earlier, later, share)).collect();
        }
        let image = {
            let _draws = span("drawing in f64");
            self.drawing.image(&order, &temperatures)
        };
        let temperatures = order.temperatures.then(|| temperatures.iter().map(|t| *t as f32).collect());
        self.delivered.push_back(Delivered { image, temperatures, absorbed });
        Ok(())
    }

    fn deliver(&mut self) -> Result<Delivered, EngineError> {
        Ok(self.delivered.pop_front().unwrap_or_default())
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn save(&mut self) -> Result<EngineState, EngineError> {
        Ok(EngineState::Reference(Box::new(ReferenceEngineState {
            steps: self.steps,
            nodes: self.reference.save(),
            light: self.light.as_ref().and_then(|light| light.redraw.found_for.clone()),
            exchange: self.exchange.as_ref().map(ExchangeTwin::save),
            network: self.network.as_ref().map(NetworkRun::save),
            sensor: self.drawing.sensor.as_ref().map(SensorTwin::save),
        })))
    }

    fn restore(&mut self, saved: &EngineState, most_times: usize) -> Result<(), EngineError> {
        let EngineState::Reference(saved) = saved.of_craft() else {
            return Err(Misfit::Absent("the f64 reference".to_owned()).into());
        };
        self.reference.restore(&saved.nodes)?;
        if let Some(light) = &mut self.light {
            light.redraw.found_for.clone_from(&saved.light);
        }
        match &mut self.exchange {
            Some(exchange) => exchange.restore(part("radiation between surfaces", &saved.exchange)?)?,
            None => self.reference.receive(Vec::new()),
        }
        if let Some(network) = &mut self.network {
            network.restore(part("a network", &saved.network)?, most_times)?;
        }
        if let Some(sensor) = &mut self.drawing.sensor {
            sensor.restore(saved.sensor.as_ref())?;
        }
        self.steps = saved.steps;
        Ok(())
    }

    fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        let exchange = self.exchange.as_ref().and_then(ExchangeTwin::exchange);
        exchange.map(|exchange| exchange.exchanged_infrared(black)).unwrap_or_default()
    }

    fn exchange_rows(&self) -> Option<RowsBetween> {
        self.exchange.as_ref().and_then(ExchangeTwin::rows)
    }

    fn show(&mut self, temperatures: &[f32]) -> Result<(), EngineError> {
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            self.reference.set_temperature(node, f64::from(temperatures[*slot as usize]));
        }
        Ok(())
    }

    fn surfaces(&mut self) -> Result<SurfaceState, EngineError> {
        let has_light = self.light.as_ref().is_some_and(|light| light.redraw.found_for.is_some());
        let slots = || self.node_of_slot.iter().map(|slot| *slot as usize);
        let mut received = Vec::new();
        if !self.reference.received().is_empty() {
            received.resize(self.slots, [FaceLoad::NOTHING; 2]);
            slots().zip(self.reference.received()).for_each(|(slot, faces)| received[slot] = *faces);
        }
        Ok(SurfaceState {
            temperatures: self.temperatures(),
            lit: has_light.then(|| self.reference.lit().of_slots(slots(), self.slots)),
            received,
            network: self.network.as_ref().map(NetworkRun::temperatures).unwrap_or_default(),
            structures: self.structures()?,
        })
    }

    fn structures(&mut self) -> Result<Vec<f64>, EngineError> {
        Ok(self.reference.structures().flatten().collect())
    }

    fn set_structures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        let own: Vec<usize> =
            self.reference.structures().enumerate().filter_map(|(node, own)| own.map(|_| node)).collect();
        own.iter().zip(temperatures).for_each(|(node, temperature)| self.reference.set_structure(*node, *temperature));
        Ok(())
    }

    fn network(&self) -> Option<&NetworkRun> {
        self.network.as_ref()
    }

    fn network_mut(&mut self) -> Option<&mut NetworkRun> {
        self.network.as_mut()
    }
}
