//! The state of a network in one pass between two steps.

use super::{HALVINGS_AT_MOST, Halving, OnePassNetwork, ThermostatState, Told};
use crate::saved::{Saved, SavedError};

impl OnePassNetwork {
    pub(crate) fn save(&self) -> Saved {
        let mut saved = Saved::default();
        for (name, values) in self.lists() {
            saved.put(name, values);
        }
        saved.put("step", &[self.plan.step()]);
        let Halving { count, since, exceeded, most, .. } = self.halving;
        saved.put("counts", &[self.age, count, since, exceeded, most]);
        saved.put("told", &self.told.map(|told| [told.squares, told.most]));
        saved.put("told_counts", &self.told.map(|told| [told.count, told.node as u64]));
        saved.put_flags("on", &self.states.iter().flat_map(|state| [state.on, state.armed]).collect::<Vec<_>>());
        saved.put("duties", &self.states.iter().map(|state| state.duty).collect::<Vec<_>>());
        saved
    }

    pub(crate) fn restore(&mut self, saved: &Saved) -> Result<(), SavedError> {
        let nodes = self.temperatures.len();
        for (name, values) in self.lists_mut() {
            *values = saved.list_of(name, nodes)?;
        }
        let [step] = saved.array("step")?;
        (self.plan, _) = self.plans.over(step, 1);
        self.gains = self.heaters.iter().map(|one| one.gain(&self.plan)).collect();
        let halving = &mut self.halving;
        [self.age, halving.count, halving.since, halving.exceeded, halving.most] = saved.array("counts")?;
        halving.count = halving.count.min(HALVINGS_AT_MOST);
        let told: [[f64; 2]; 2] = saved.array("told")?;
        let counts: [[u64; 2]; 2] = saved.array("told_counts")?;
        for (figure, ([squares, most], [count, node])) in self.told.iter_mut().zip(told.into_iter().zip(counts)) {
            *figure = Told { squares, count, most, node: node as usize };
        }
        let duties: Vec<f64> = saved.list_of("duties", self.states.len())?;
        let on = saved.flags("on")?;
        for ((state, duty), flags) in self.states.iter_mut().zip(duties).zip(on.chunks(2)) {
            *state = ThermostatState { on: flags.first() == Some(&true), armed: flags.get(1) == Some(&true), duty };
        }
        Ok(())
    }

    fn lists(&self) -> [(&'static str, &Vec<f64>); 7] {
        [
            ("temperatures", &self.temperatures),
            ("last", &self.last),
            ("coupling", &self.coupling),
            ("error", &self.error),
            ("weak", &self.weak),
            ("trend", &self.trend),
            ("coupled", &self.coupled),
        ]
    }

    fn lists_mut(&mut self) -> [(&'static str, &mut Vec<f64>); 7] {
        [
            ("temperatures", &mut self.temperatures),
            ("last", &mut self.last),
            ("coupling", &mut self.coupling),
            ("error", &mut self.error),
            ("weak", &mut self.weak),
            ("trend", &mut self.trend),
            ("coupled", &mut self.coupled),
        ]
    }
}
