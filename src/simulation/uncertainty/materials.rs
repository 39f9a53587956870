//! What a surface emits, stores and conducts, as the carried errors need it.

use crate::scene::Time;
use crate::thermal::material::{Material, Response};
use crate::thermal::memory::{capacity, emissivity_to_all_sides};

/// What a place remembers of its past.
#[derive(Debug, Clone, Copy)]
pub(super) enum Memory {
    /// Heat capacity [J m-2 K-1]. 0 follows its load at once.
    Capacity(f64),
    /// Mean time of a transition to its target [s].
    Time(f64),
}

impl Memory {
    /// Step of a length [s] over the time constant, for a slope [W m-2 K-1].
    pub(super) fn rate(self, length: f64, slope: f64) -> f64 {
        let time = match self {
            Self::Capacity(capacity) => capacity / slope,
            Self::Time(time) => time,
        };
        if time > 0.0 { length / time } else { f64::INFINITY }
    }
}

/// Values of a material.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfaceConstants {
    /// Sum of the emissivities of the faces, and of a blanket to what lies below it.
    pub(super) emissivity: f64,
    pub(super) memory: Memory,
    /// Conductivity times thickness [W/K]. 0 outside a network.
    pub(super) conductance: f64,
}

impl SurfaceConstants {
    pub(super) fn of(material: &Material, time: &Time) -> Self {
        let bulk = &material.bulk;
        let memory = match (&material.response, capacity(material)) {
            // A quadratic curve reaches its target in the mean after a third of its time.
            (Response::Transition(curve), _) => {
                let both = curve.heating.duration() + curve.cooling.duration();
                Memory::Time(0.5 * both * time.step / 3.0)
            }
            (_, capacity) => Memory::Capacity(capacity.unwrap_or(0.0)),
        };
        let conducts = matches!(material.response, Response::Network);
        let sheet = bulk.conductivity.unwrap_or(0.0) * bulk.thickness.unwrap_or(0.0);
        Self { emissivity: emissivity_to_all_sides(material), memory, conductance: if conducts { sheet } else { 0.0 } }
    }
}
