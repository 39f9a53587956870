//! Steps, sets and reads the thermal network of a scene that its frames step in one pass.

use std::sync::Arc;

use super::Renderer;
use crate::gpu::error::GpuError;
use crate::gpu::frame::Frame;
use crate::gpu::nodes::GROUP;
use crate::gpu::resource::Resource;

impl Renderer {
    /// Whether network nodes are stepped within the frames.
    pub(super) fn steps_network(&self) -> bool {
        self.one_pass.is_some()
    }

    /// The passes that step the network over `steps` steps of the scene. `heat` is the heat of every node in addition to that of the drawn nodes [W].
    pub(super) fn network_frame(&mut self, steps: f64, heat: Option<&[f64]>) -> Result<Frame, GpuError> {
        let Some(network) = &mut self.one_pass else { return Ok(Frame::default()) };
        let (plan, count) = network.plans.over(steps * network.tables.step);
        if !Arc::ptr_eq(&plan, &network.plan) {
            // Frames in flight may still read the old weights.
            self.slots.wait()?;
            self.resources.upload(&mut self.once, Resource::OnePassWeights, &network.tables.weights(&plan))?;
            self.resources.free_staging();
            (network.plan, network.started) = (plan, false);
        }
        if let Some(heat) = heat {
            let slot = self.slots.free()?;
            let heat = network.tables.in_slots(heat.iter().map(|heat| *heat as f32));
            self.resources.write(Resource::OnePassHeat, slot, &heat)?;
        }
        let (frame, odd) = network.tables.shape.steps(count, !network.started, network.odd);
        (network.odd, network.started) = (odd, true);
        Ok(frame)
    }

    /// Temperatures of the network's nodes [K]. `None` where the frames do not step them.
    ///
    /// # Errors
    /// A call that fails.
    pub fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, GpuError> {
        self.wait()?;
        let Some(network) = &self.one_pass else { return Ok(None) };
        let count = GROUP * network.tables.shape.groups() as usize;
        let mean = if network.odd { Resource::OnePassMeanOdd } else { Resource::OnePassMeanEven };
        let means: Vec<[f32; 2]> = self.resources.download(&mut self.once, mean, count)?;
        let rests: Vec<f32> = self.resources.download(&mut self.once, Resource::OnePassRests, count)?;
        let of = |slot: &u32| f64::from(means[*slot as usize][0]) + f64::from(rests[*slot as usize]);
        Ok(Some(network.tables.slot_of_node.iter().map(of).collect()))
    }

    /// Replaces the temperatures of the network's nodes [K]. The drawn nodes take them after the next step.
    ///
    /// # Errors
    /// A call that fails.
    pub fn set_network_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        self.wait()?;
        let Some(network) = &mut self.one_pass else { return Ok(()) };
        (network.odd, network.started) = (false, false);
        let pairs = temperatures.iter().map(|temperature| crate::gpu::network::split(*temperature));
        let bases = network.tables.in_slots(pairs.clone().map(|[base, _]| base));
        let rests = network.tables.in_slots(pairs.map(|[_, rest]| rest));
        let means: Vec<[f32; 2]> = bases.iter().zip(&rests).map(|(base, rest)| [*base, *rest]).collect();
        let nothing = vec![0.0f32; GROUP * network.tables.shape.in_blocks() as usize];
        self.resources.upload(&mut self.once, Resource::OnePassMeanEven, &means)?;
        self.resources.upload(&mut self.once, Resource::OnePassRests, &rests)?;
        self.resources.upload(&mut self.once, Resource::OnePassCouplings, &nothing)?;
        self.resources.free_staging();
        Ok(())
    }
}
