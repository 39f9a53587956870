//! The state of a network in one pass between two steps.

use super::{Halving, OnePassNetwork, ThermostatState, Told};
use crate::thermal::misfit::{Misfit, check_length};

/// The saved state of a network in one pass.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct OnePassState {
    /// The lists of `OnePassNetwork::lists`.
    lists: [Vec<f64>; 7],
    /// Length of the last step [s].
    step: f64,
    age: u32,
    halving: Halving,
    told: [Told; 2],
    states: Vec<ThermostatState>,
}

impl OnePassNetwork {
    pub(crate) fn save(&self) -> OnePassState {
        let Self { age, told, .. } = *self;
        let halving = self.halvings.now;
        let lists = self.clone().lists().map(std::mem::take);
        OnePassState { lists, step: self.plan.step(), age, halving, told, states: self.states.clone() }
    }

    /// Takes a saved state.
    ///
    /// # Errors
    /// A state of another network.
    pub(crate) fn restore(&mut self, saved: &OnePassState) -> Result<(), Misfit> {
        let nodes = self.temperatures.len();
        for (values, saved) in self.lists().into_iter().zip(&saved.lists) {
            check_length("a network's nodes", saved, nodes)?;
            values.clone_from(saved);
        }
        check_length("heaters", &saved.states, self.states.len())?;
        self.states.clone_from(&saved.states);
        (self.plan, _) = self.plans.over(saved.step, 1);
        self.gains = self.heaters.iter().map(|one| one.gain(&self.plan)).collect();
        (self.age, self.told) = (saved.age, saved.told);
        self.halvings.now = self.halvings.now.with_decisions_of(saved.halving);
        Ok(())
    }

    fn lists(&mut self) -> [&mut Vec<f64>; 7] {
        let Self { temperatures, last, coupling, error, weak, trend, coupled, .. } = self;
        [temperatures, last, coupling, error, weak, trend, coupled]
    }
}
