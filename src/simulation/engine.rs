//! Who computes, as a run sees it: an engine takes steps and leaves images and temperatures.

use glam::DAffine3;

pub use super::engine_error::EngineError;
use super::network::{NetworkRun, StepCost};
use crate::environment::StepLoad;
use crate::gpu::timing::PassTimes;
use crate::trace::Trace;

/// One step as an engine takes it.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// Mean load of the step.
    pub load: &'a StepLoad,
    /// Its length in steps.
    pub steps: f64,
    /// When it starts [s].
    pub start: f64,
    /// Its length [s].
    pub length: f64,
}

/// What a step is asked to leave.
#[derive(Debug, Clone, Copy, Default)]
pub struct Order<'a> {
    /// Pose of the camera, where an image is wanted.
    pub pose: Option<DAffine3>,
    /// Poses of the body and of the joints in the image; empty where nothing moves.
    pub joints: &'a [DAffine3],
    /// Whether all temperatures are wanted.
    pub temperatures: bool,
}

/// Pixels of an image, row after row from the top.
#[derive(Debug, Clone, Default)]
pub struct Pixels {
    /// Radiance [W m-2 sr-1], temperature [K], depth [m]; 0 where nothing is.
    pub radiance_temperature_depth: Vec<[f32; 3]>,
    /// Part and material, each plus 1; 0 where nothing is.
    pub identity: Vec<[u32; 2]>,
}

/// What a step left.
#[derive(Debug, Clone, Default)]
pub struct Delivered {
    /// The image, where one was ordered.
    pub pixels: Option<Pixels>,
    /// Temperatures of all nodes in device order, padding included [K].
    pub temperatures: Option<Vec<f32>>,
}

/// A scene on a Vulkan device or on the f64 reference.
pub trait Engine {
    /// Keeps when what is done from now on; the reference has host spans only.
    fn record(&mut self, trace: Trace);

    /// Where that is kept.
    fn trace(&self) -> Trace;

    /// Name of the device, or `cpu`.
    fn device_name(&self) -> String;

    /// Settles every node at the balance temperature of a load, and networks at their steady state at a time [s].
    ///
    /// # Errors
    /// A call that fails, or no steady state.
    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError>;

    /// Settles every node at a temperature [K].
    ///
    /// # Errors
    /// A call that fails.
    fn settle_at(&mut self, temperature: f64, nodes: usize) -> Result<(), EngineError>;

    /// Gives a step (or, without one, the present state) to the engine; at most two may be under way.
    ///
    /// # Errors
    /// A call that fails, or temperatures of a network that cannot be found.
    fn submit(&mut self, step: Option<Step<'_>>, order: Order<'_>) -> Result<(), EngineError>;

    /// What the oldest step under way leaves; empty where none is.
    ///
    /// # Errors
    /// A lost device.
    fn deliver(&mut self) -> Result<Delivered, EngineError>;

    /// Lets steps pass that leave nothing but the state; on a device many in one dispatch where nodes do not interact and
    /// nothing moves.
    ///
    /// # Errors
    /// As for `submit`.
    fn forward(&mut self, passing: &[Step<'_>]) -> Result<(), EngineError> {
        self.pass_singly(passing)
    }

    /// The same, each step by itself.
    ///
    /// # Errors
    /// As for `submit`.
    fn pass_singly(&mut self, passing: &[Step<'_>]) -> Result<(), EngineError> {
        for step in passing {
            self.submit(Some(*step), Order::default())?;
            self.deliver()?;
        }
        Ok(())
    }

    /// Waits until all that was given to the engine is done.
    ///
    /// # Errors
    /// A lost device.
    fn wait(&mut self) -> Result<(), EngineError> {
        Ok(())
    }

    /// Steps so far, those of a warm-up included.
    fn steps(&self) -> u64;

    /// Those of them that passed in dispatches of many.
    fn fused_steps(&self) -> u64 {
        0
    }

    /// Bytes on the device, as they were allocated, that follow the number of nodes; what only the host reads is not counted.
    /// `None` for the reference.
    fn device_bytes(&self) -> Option<u64> {
        None
    }

    /// Device milliseconds of every pass so far; `None` for the reference.
    fn pass_times(&self) -> Option<&PassTimes> {
        None
    }

    /// The network under way, where the scene has one.
    fn network(&self) -> Option<&NetworkRun>;

    /// The same, to be changed.
    fn network_mut(&mut self) -> Option<&mut NetworkRun>;

    /// Cost of the network in every step so far; empty where the scene has none.
    fn network_costs(&self) -> &[StepCost] {
        self.network().map_or(&[], NetworkRun::costs)
    }

    /// From now on the network's steps may err by ten times its tolerance, or no longer.
    fn set_coarse(&mut self, coarse: bool) {
        if let Some(network) = self.network_mut() {
            network.set_coarse(coarse);
        }
    }

    /// Temperatures of the network's nodes [K], where the scene has a network.
    ///
    /// # Errors
    /// A call that fails.
    fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, EngineError> {
        self.network_mut().map(NetworkRun::temperatures).transpose()
    }

    /// Replaces the temperatures of the network's nodes [K]; they show after the next step.
    ///
    /// # Errors
    /// A call that fails.
    fn set_network_temperatures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        self.network_mut().map_or(Ok(()), |network| network.set_temperatures(temperatures))
    }

    /// How the network was integrated, in words; empty where the scene has none.
    fn network_description(&self) -> Vec<(String, String)> {
        self.network().map(NetworkRun::description).unwrap_or_default()
    }
}
