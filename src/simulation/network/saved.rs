//! Saves a scene's network between two steps, and goes on from there.

use super::{NetworkRun, StepCost};
use crate::gpu::samples::Samples;
use crate::saved::Saved;
use crate::simulation::engine_error::EngineError;
use crate::thermal::network::control::Use;

impl NetworkRun {
    /// The state between two steps.
    pub fn save(&self) -> Saved {
        let mut saved = Saved::default();
        saved.put_all("worker", self.worker.save());
        if let Some(one_pass) = &self.one_pass {
            saved.put_all("one_pass", one_pass.save());
        }
        self.save_left(&mut saved);
        saved.put("step", &[self.step]);
        saved.put_flags("on", &self.on);
        for (number, used) in self.uses.iter().enumerate() {
            if let Some(Use { sub_steps, time, range, stages }) = used {
                saved.put(format!("use.{number}"), &[*sub_steps, u64::from(stages[0]), u64::from(stages[1])]);
                saved.put(format!("use_times.{number}"), &[*time, range[0], range[1]]);
            }
        }
        saved.put_all("given", self.given.save());
        saved.put("counts", &[self.rejected, self.switches]);
        saved.put("costs", &self.costs.iter().map(|cost| cost.wall_ms).collect::<Vec<_>>());
        saved.put("cost_counts", &[self.costs.count(), self.costs.every()]);
        saved
    }

    /// Takes what `save` gave.
    ///
    /// # Errors
    /// A state of another network.
    pub fn restore(&mut self, saved: &Saved, most_costs: usize) -> Result<(), EngineError> {
        self.restore_left(saved)?;
        self.worker.restore(&saved.part("worker"))?;
        if let Some(one_pass) = &mut self.one_pass {
            one_pass.restore(&saved.part("one_pass"))?;
        }
        [self.step] = saved.array("step")?;
        self.on = saved.flags("on")?;
        for (number, used) in self.uses.iter_mut().enumerate() {
            *used = None;
            if saved.has(&format!("use.{number}")) {
                let [sub_steps, fewest, most] = saved.array::<u64, 3>(&format!("use.{number}"))?;
                let [time, short, long] = saved.array(&format!("use_times.{number}"))?;
                *used = Some(Use { sub_steps, time, range: [short, long], stages: [fewest as u32, most as u32] });
            }
        }
        self.given.restore(&saved.part("given"))?;
        [self.rejected, self.switches] = saved.array("counts")?;
        let costs: Vec<f64> = saved.list("costs")?;
        let cost = |wall_ms| StepCost { wall_ms };
        let [count, every] = saved.array("cost_counts")?;
        self.costs = Samples::again(costs.into_iter().map(cost).collect(), most_costs, every, count);
        Ok(())
    }
}
