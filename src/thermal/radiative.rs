//! The response `radiative`: a plate by itself, C dT/dt = absorbed - emissivity sigma (T^4 - T_background^4), without conduction. The solution is
//! exact for a constant load and any step.
//!
//! Under an outside there may be a structure that exchanges heat with it by radiation. The structure is held at its temperature plus half of its last change.
//! The outside is stepped exactly. Its own balance gives the mean of its T^4, and with it the heat into the structure (docs/numerics.md 1a). Twin:
//! `glsl/radiative.glsl`.

use super::STEFAN_BOLTZMANN;
use super::balance::emissivity_sum;
use super::local_step::{SHARE, SLOW_STEPS, local_change, whole_change};
use super::material::{Material, Radiative, Response};

/// Change by a flux of 1 W/m2 in a step [K m2/W] of an outside that stores no heat. Such an outside is in balance in f64 and in f32.
const BALANCED: f64 = 1e12;

/// Largest share of the distance to the outside that a structure goes in one part of a step.
const STRUCTURE_SHARE: f64 = 0.05;

/// Most parts of a step for a structure that stores little heat.
pub(crate) const PARTS_AT_MOST: u32 = 64;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PlateState {
    /// Temperature of the outside [K].
    pub(crate) outside: f64,
    /// Temperature of the structure [K]. At the start of a run the outside has the same.
    pub(crate) structure: f64,
    /// Last change of the structure, for a whole step [K].
    pub(crate) trend: f64,
}

impl PlateState {
    /// A plate at rest at a temperature [K].
    pub(crate) fn settled(temperature: f64) -> Self {
        Self { outside: temperature, structure: temperature, trend: 0.0 }
    }
}

/// Absorption and emission of a plate during a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlateLoad {
    /// Absorbed flux of both faces [W/m2].
    pub(crate) absorbed: f64,
    /// Sum of the emissivities of the faces.
    pub(crate) emissivity: f64,
    /// Temperature of space [K].
    pub(crate) background: f64,
}

impl Radiative {
    /// Change of the outside by a flux of 1 W/m2 in a step [K m2/W].
    pub(crate) fn share(&self) -> f64 {
        (self.step / self.capacity).min(BALANCED)
    }

    /// Change of the structure by a flux of 1 W/m2 in a step [K m2/W]. 0 without a structure.
    pub(crate) fn structure_share(&self) -> f64 {
        self.over.map_or(0.0, |over| self.step / over.capacity)
    }

    /// Conductance by radiation between outside and structure [W/(m2 K4)].
    pub(crate) fn exchange(&self) -> f64 {
        self.over.map_or(0.0, |over| STEFAN_BOLTZMANN * over.effective_emittance)
    }

    /// Whether two Runge-Kutta steps do not do for a step of the outside.
    pub fn is_fast(&self, emissivity: f64) -> bool {
        let emission = STEFAN_BOLTZMANN * emissivity + self.exchange();
        // An infinite or unknown temperature is fast.
        let slow = 4.0 * emission * self.hottest.powi(3) * self.share() <= f64::from(SLOW_STEPS) * SHARE;
        !slow
    }

    /// Parts of a step in which the structure is held.
    pub(crate) fn parts(&self) -> u32 {
        let rate = 4.0 * self.exchange() * self.hottest.powi(3) * self.structure_share();
        (rate / STRUCTURE_SHARE).ceil().max(1.0) as u32
    }
}

/// Time in which a node of a material by itself forgets its load at a temperature [K], by radiation [s]. `None` where the node stores no heat or follows
/// a rule of its own.
pub(crate) fn time_constant(material: &Material, temperature: f64) -> Option<f64> {
    let (capacity, below) = match &material.response {
        Response::Radiative(plate) => (plate.capacity, plate.over.map_or(0.0, |over| over.effective_emittance)),
        Response::Network => {
            let bulk = &material.bulk;
            (bulk.capacity_per_area().ok()?, bulk.over.map_or(0.0, |over| over.effective_emittance))
        }
        Response::Instant | Response::Transition(_) | Response::Given => return None,
    };
    let emission = STEFAN_BOLTZMANN * (emissivity_sum(material) + below);
    (capacity > 0.0).then(|| capacity / (4.0 * emission * temperature.powi(3)))
}

pub(crate) fn radiative_step(state: PlateState, load: PlateLoad, steps: f64, plate: &Radiative) -> PlateState {
    let parts = plate.parts();
    let length = steps / f64::from(parts);
    let (share, exchange) = (length * plate.share(), plate.exchange());
    let outward = STEFAN_BOLTZMANN * load.emissivity;
    let fast = plate.is_fast(load.emissivity);
    let mut state = state;
    for _ in 0..parts {
        let held = (state.structure + 0.5 * length * state.trend).powi(4);
        let into = load.absorbed + outward * load.background.powi(4) + exchange * held;
        let emission = outward + exchange;
        let start = share * (into - emission * state.outside.powi(4));
        let change = if fast {
            whole_change(state.outside, start, share * into, share * emission)
        } else {
            local_change(state.outside, start, share * emission, SLOW_STEPS)
        };
        // The outside has emitted the heat that it did not store.
        let mean = state.outside.powi(4) + (start - change) / (share * emission);
        let moved = length * plate.structure_share() * exchange * (mean - held);
        state.outside += change;
        state.structure += moved;
        state.trend = moved / length;
    }
    state
}

#[cfg(test)]
mod tests;
