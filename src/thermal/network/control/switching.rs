//! Thermostats during an integration: reads sensors, locates switches inside a sub-step, and switches.

use super::{Control, ControlError, PlannedTry, Switch};
use crate::thermal::network::rkl2::stages_for;
use crate::thermal::network::stepper::StepMethod;
use crate::thermal::network::switches::{SWITCH_TIME, crossed, straight_crossing};

impl<W: FnMut(f64) -> bool> Control<'_, W> {
    pub(super) fn sense(&self) -> Vec<f64> {
        if self.schedule.thermostats.is_empty() {
            return Vec::new();
        }
        let temperatures = self.stepper.temperatures();
        self.schedule.thermostats.iter().map(|thermostat| temperatures[thermostat.sensor as usize]).collect()
    }

    /// Sets the heat anew. Repeats this with switched thermostats while arithmetic sensors jump over a threshold.
    pub(super) fn set_heat(&mut self, time: f64) -> Result<(), ControlError> {
        loop {
            self.put_heat(time)?;
            let after = self.sense();
            let before = std::mem::replace(&mut self.thermostats.sensed, after);
            let at = crossed(&self.schedule.thermostats, &self.thermostats.on, &before, &self.thermostats.sensed);
            if at.is_empty() {
                return Ok(());
            }
            self.switch(&at)?;
        }
    }

    fn switch(&mut self, at: &[usize]) -> Result<(), ControlError> {
        let time = self.now();
        for &thermostat in at {
            self.thermostats.on[thermostat] = !self.thermostats.on[thermostat];
            let switch = Switch { time, thermostat, on: self.thermostats.on[thermostat] };
            self.series.switches.push(switch);
            if let Some((switches, within)) = self.thermostats.paces[thermostat].take(time) {
                return Err(ControlError::Chatter { time, thermostat, switches, within });
            }
        }
        Ok(())
    }

    /// Finds the first switch in the coming sub-step and takes it. The sensors are at `after` at the end of the sub-step.
    pub(super) fn locate(&mut self, plan: PlannedTry, after: Vec<f64>) -> Result<(), ControlError> {
        let thermostats = &self.schedule.thermostats;
        let t = self.heat.since;
        let (mut low, mut high) = (0.0, plan.step);
        let (mut before, mut after) = (self.thermostats.sensed.clone(), after);
        let mut last_was_high = None;
        let mut tries = 0;
        let mut at_high = false;
        loop {
            let narrow = high - low <= SWITCH_TIME || high - low <= 1e-13 * (self.heat.since + high);
            if narrow && at_high {
                break;
            }
            let at = crossed(thermostats, &self.thermostats.on, &before, &after);
            let straight = straight_crossing(thermostats, &self.thermostats.on, &at, &before, &after);
            let width = high - low;
            // A straight line can leave one end fixed. Every second time on one side the try goes beyond the line, and every fourth time to the middle.
            let nudge = 0.4 * SWITCH_TIME / width;
            let share = match last_was_high {
                _ if narrow => 1.0,
                _ if tries % 4 == 3 => 0.5,
                Some(true) => straight - nudge.max(0.02 * straight.min(1.0 - straight)),
                _ => straight + nudge.max(0.02 * straight.min(1.0 - straight)),
            };
            let trial = if narrow { high } else { low + width * share.clamp(0.001, 0.999) };
            let method = self.method_for(plan.method, trial);
            let attempt = self.stepper.attempt(method, t, trial, 1);
            tries += 1;
            let is_high =
                !crossed(thermostats, &self.thermostats.on, &self.thermostats.sensed, &attempt.sensed).is_empty();
            at_high = is_high || narrow;
            if is_high || narrow {
                (high, after) = (trial, attempt.sensed);
            } else {
                (low, before) = (trial, attempt.sensed);
            }
            last_was_high = Some(is_high);
        }
        let at = crossed(thermostats, &self.thermostats.on, &self.thermostats.sensed, &after);
        let plan = PlannedTry { method: self.method_for(plan.method, high), step: high, count: 1 };
        self.thermostats.sensed = after;
        self.keep(plan, self.heat.since + high);
        self.switch(&at)?;
        self.set_heat(self.now())
    }

    /// The method, with the number of stages for a shorter sub-step.
    fn method_for(&self, method: StepMethod, step: f64) -> StepMethod {
        match method {
            StepMethod::Rkl2 { .. } => StepMethod::Rkl2 { stages: stages_for(step * self.rate) },
            StepMethod::Euler | StepMethod::TrBdf2 => method,
        }
    }
}
