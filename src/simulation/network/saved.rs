//! Saves a scene's network between two steps, and goes on from there.

use super::NetworkRun;
use super::run::NetworkCourse;
use crate::gpu::samples::Samples;
use crate::thermal::misfit::{Misfit, check_length, part};
use crate::thermal::network::one_pass::{OnePassNetwork, OnePassState};
use crate::thermal::network::stepper::WorkCounts;

/// The saved state of a network.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct NetworkRunState {
    /// Temperatures of the nodes [K].
    temperatures: Vec<f64>,
    counts: WorkCounts,
    one_pass: Option<OnePassState>,
    course: NetworkCourse,
}

impl NetworkRunState {
    /// Forgets the costs of the steps.
    pub(crate) fn forget_run(&mut self) {
        self.course.costs = Samples::default();
    }
}

impl NetworkRun {
    /// The state between two steps.
    pub(crate) fn save(&self) -> NetworkRunState {
        NetworkRunState {
            temperatures: self.temperatures(),
            counts: self.worker.counts(),
            one_pass: self.one_pass.as_ref().map(OnePassNetwork::save),
            course: self.course.clone(),
        }
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of another network.
    pub(crate) fn restore(&mut self, saved: &NetworkRunState, most_costs: usize) -> Result<(), Misfit> {
        check_length("thermostats", &saved.course.on, self.course.on.len())?;
        if let Some(left) = saved.course.left {
            self.leave(left);
        }
        check_length("a network's nodes", &saved.temperatures, self.scene.network().len())?;
        self.worker.set_temperatures(&saved.temperatures);
        if let Some(islands) = &mut self.islands {
            islands.set_temperatures(&saved.temperatures);
        }
        self.worker.set_counts(saved.counts);
        if let Some(one_pass) = &mut self.one_pass {
            one_pass.restore(part("a network in one pass", &saved.one_pass)?)?;
        }
        self.course.clone_from(&saved.course);
        self.course.costs.bound(most_costs);
        Ok(())
    }
}
