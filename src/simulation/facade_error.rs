//! Errors of a simulation that is driven from outside.

use std::path::Path;

use super::engine_error::EngineError;
use super::pose::CameraError;
use super::prepare_error::PrepareError;
use crate::environment::joints::JointError;
use crate::environment::placements::PlaceError;
use crate::environment::scene_time::TimeError;
use crate::environment::sky::SkyError;
use crate::gpu::error::GpuError;
use crate::scene::SceneError;
use crate::thermal::misfit::Misfit;

/// Why a simulation does not do what it is asked.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// The scene can not be used.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The device can not be used.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A step or an image failed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A place of the craft can not be used.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// A joint can not be set.
    #[error(transparent)]
    Joint(#[from] JointError),
    /// A heater that the scene does not have.
    #[error("there is no heater '{name}'; {}", told(known))]
    NoHeater {
        /// The name.
        name: String,
        /// Names of the scene's heaters.
        known: Vec<String>,
    },
    /// A heater whose power can not be set, or not to this.
    #[error("the heater '{name}' can not have {power} W: {reason}")]
    HeaterPower {
        /// The heater.
        name: String,
        /// The power [W].
        power: f64,
        /// Why not.
        reason: &'static str,
    },
    /// Camera or pose can not be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Orbit or attitude do not cover a time.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// A number that is no time, or a time that is too many steps away.
    #[error(transparent)]
    NoTime(#[from] TimeError),
    /// A time that lies before the present one.
    #[error("the simulation is at {now} s and can not step to {time} s")]
    Time {
        /// The time that was asked for [s].
        time: f64,
        /// The present time [s].
        now: f64,
    },
    /// The saved state belongs to another craft.
    #[error("the saved state is of another craft: {0}")]
    State(String),
    /// The saved state does not fit a simulation.
    #[error("this is no saved state of a simulation: {0}")]
    NoState(Misfit),
    /// Measurements that no fit explains.
    #[error("{0}")]
    Fit(String),
    /// A number of an image is not finite.
    #[error("at {time} s the {what} of pixel ({x}, {y}) is not finite")]
    NotFinite {
        /// Time of the image [s].
        time: f64,
        /// Radiance, temperature or depth.
        what: &'static str,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
}

fn told(heaters: &[String]) -> String {
    match heaters {
        [] => "the scene has no [[heater]]".to_owned(),
        known => format!("there are: {}", known.join("; ")),
    }
}

impl From<SceneError> for SimulationError {
    fn from(error: SceneError) -> Self {
        Self::Prepare(error.into())
    }
}

impl SimulationError {
    /// The file that the error is about, its line (from 1), and the key in it, as far as they are known.
    pub fn place(&self) -> (Option<&Path>, Option<usize>, Option<&str>) {
        match self {
            Self::Prepare(error) => error.place(),
            _ => (None, None, None),
        }
    }

    /// Whether the user can mend it: a scene, a value or a call, not a device that failed.
    pub fn is_of_the_user(&self) -> bool {
        match self {
            Self::Gpu(error) | Self::Engine(EngineError::Gpu(error)) => {
                !matches!(error, GpuError::Call { .. } | GpuError::Allocation { .. })
            }
            Self::NotFinite { .. } | Self::Engine(EngineError::NoTemperature { .. }) => false,
            _ => true,
        }
    }
}
