//! The saved state of an engine.

use super::exchange::ExchangeTwinState;
use super::exchange_poses::PosedState;
use super::network::NetworkRunState;
use crate::environment::shadow::LightAndPoses;
use crate::gpu::renderer::RendererState;
use crate::thermal::reference::ReferenceState;
use crate::thermal::sensor::twin::SensorState;

/// The saved state of an engine.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub enum EngineState {
    /// Of a device.
    Device(Box<DeviceEngineState>),
    /// Of the f64 reference.
    Reference(Box<ReferenceEngineState>),
    /// An engine with several bands: the state of the craft, and one of each further band whose sensor lags.
    Bands(Box<EngineState>, Vec<Option<EngineState>>),
}

impl EngineState {
    /// Forgets what belongs to one run only: measured times, counts of work, and triangles culled for its camera.
    pub(crate) fn forget_run(&mut self) {
        match self {
            Self::Device(state) => state.forget_run(),
            Self::Reference(state) => state.forget_run(),
            Self::Bands(craft, bands) => {
                craft.forget_run();
                bands.iter_mut().flatten().for_each(Self::forget_run);
            }
        }
    }

    /// The state without further bands.
    pub(crate) fn of_craft(&self) -> &Self {
        match self {
            Self::Bands(craft, _) => craft,
            one => one,
        }
    }

    /// Takes the sensor of another state of the same kind of engine: as a whole where `all` is set or this state has none, otherwise only a signal of
    /// another image.
    pub(crate) fn take_sensor(&mut self, other: Self, all: bool) {
        match (self, other) {
            (Self::Device(own), Self::Device(mut other)) => {
                take_sensor(own.scene.sensor_mut(), other.scene.sensor_mut().take(), all);
            }
            (Self::Reference(own), Self::Reference(other)) => take_sensor(&mut own.sensor, other.sensor, all),
            (Self::Bands(own, bands), Self::Bands(other, others)) => {
                own.take_sensor(*other, all);
                for (own, other) in bands.iter_mut().zip(others) {
                    if let (Some(own), Some(other)) = (own, other) {
                        own.take_sensor(other, all);
                    }
                }
            }
            _ => {}
        }
    }
}

fn take_sensor<T>(own: &mut Option<SensorState<T>>, other: Option<SensorState<T>>, all: bool) {
    match (own, other) {
        (Some(own), Some(other)) if !all => {
            if own.signal.len() != other.signal.len() {
                own.signal = other.signal;
            }
        }
        (own, other @ Some(_)) => *own = other,
        (_, None) => {}
    }
}

/// The saved state of a scene on a device.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct DeviceEngineState {
    pub(crate) steps: u64,
    pub(crate) scene: RendererState,
    pub(crate) exchange: Option<PosedState>,
    pub(crate) network: Option<NetworkRunState>,
}

impl DeviceEngineState {
    /// Forgets what belongs to one run only.
    pub(crate) fn forget_run(&mut self) {
        self.steps = 0;
        self.scene.forget_run();
        self.network.iter_mut().for_each(NetworkRunState::forget_run);
    }
}

/// The saved state of the reference.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct ReferenceEngineState {
    pub(crate) steps: u64,
    pub(crate) nodes: ReferenceState,
    pub(crate) light: Option<LightAndPoses>,
    pub(crate) exchange: Option<ExchangeTwinState>,
    pub(crate) network: Option<NetworkRunState>,
    pub(crate) sensor: Option<SensorState<f64>>,
}

impl ReferenceEngineState {
    /// Forgets what belongs to one run only.
    pub(crate) fn forget_run(&mut self) {
        self.steps = 0;
        self.network.iter_mut().for_each(NetworkRunState::forget_run);
    }
}
