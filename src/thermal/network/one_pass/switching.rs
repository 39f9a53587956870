//! Thermostats of the one pass: which share of a step a heater is on, and when in the step it switches.
//!
//! The sensor is expected to change at a constant rate while the heater keeps its state: by its last change, less the heater's part in that change,
//! plus the heater's part now. Twin: `duty` of `glsl/one_pass_heaters.comp`.

use crate::thermal::network::schedule::Thermostat;

/// Switches in a step beyond which a thermostat chatters.
pub(crate) const SWITCHES_AT_MOST: u32 = 1000;

#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct ThermostatState {
    pub(crate) on: bool,
    /// Whether the sensor has been on the near side of the threshold since the last switch. Only then can it cross the threshold.
    pub(crate) armed: bool,
    /// Share of the last step that the heater was on.
    pub(crate) duty: f64,
}

/// The sensor of a thermostat at the start of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sensed {
    /// Temperature [K].
    pub(crate) here: f64,
    /// Change in the last step [K]. `None` where the last step had another length.
    pub(crate) last: Option<f64>,
    /// Change in a step by the heater [K].
    pub(crate) gain: f64,
}

impl ThermostatState {
    pub(crate) fn new(thermostat: Option<&Thermostat>) -> Self {
        Self { on: thermostat.is_none_or(|one| one.initially_on), ..Self::default() }
    }

    /// Share of a step that the heater is on. Calls `switched` with the place of each switch in the step, from 0 to 1.
    pub(crate) fn duty(&mut self, thermostat: &Thermostat, sensed: Sensed, mut switched: impl FnMut(f64)) -> f64 {
        let free = sensed.last.map(|last| last - sensed.gain * self.duty);
        let (mut here, mut place, mut duty, mut count) = (sensed.here, 0.0, 0.0, 0);
        loop {
            let past = thermostat.past(self.on, here);
            self.armed |= past <= 0.0;
            let mut reached = (self.armed && past > 0.0).then_some(place);
            if past <= 0.0 {
                let rate = free.map_or(0.0, |free| free + if self.on { sensed.gain } else { 0.0 });
                let toward = if self.on { rate } else { -rate };
                if toward > 0.0 && -past < toward * (1.0 - place) {
                    reached = Some(place - past / toward);
                    here = if self.on { thermostat.off_above } else { thermostat.on_below };
                }
            }
            let end = reached.filter(|_| count < SWITCHES_AT_MOST).unwrap_or(1.0);
            if self.on {
                duty += end - place;
            }
            if reached.is_none() || count == SWITCHES_AT_MOST {
                break;
            }
            (self.on, self.armed, place, count) = (!self.on, false, end, count + 1);
            switched(place);
        }
        self.duty = duty;
        duty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thermostat() -> Thermostat {
        Thermostat { node: 0, sensor: 0, power: 1.0, on_below: 280.0, off_above: 290.0, initially_on: false }
    }

    fn run(on: bool, here: f64, last: f64, gain: f64) -> (f64, Vec<f64>, bool) {
        let mut state = ThermostatState { on, armed: false, duty: if on { 1.0 } else { 0.0 } };
        let mut at = Vec::new();
        let duty = state.duty(&thermostat(), Sensed { here, last: Some(last), gain }, |place| at.push(place));
        (duty, at, state.on)
    }

    /// The expected values are those of straight lines.
    #[test]
    fn crossings_are_found_on_straight_lines() {
        // From 281 K it falls by 4 K a step: 280 K after a quarter, from where it is on.
        assert_eq!(run(false, 281.0, -4.0, 2.0), (0.75, vec![0.25], true));
        // From 289.5 K it rises by 1 K a step.
        assert_eq!(run(true, 289.5, 1.0, 2.0), (0.5, vec![0.5], false));
        assert_eq!(run(false, 281.0, -0.9, 2.0), (0.0, vec![], false));
        assert_eq!(run(true, 281.0, -9.0, 2.0), (1.0, vec![], true), "below the band a heater stays on");
        // A heater that lifts the sensor by 50 K a step against a loss of 30: on at 1/30, 10 K later off, and on again after another 10 K.
        let (duty, at, on) = run(false, 281.0, -30.0, 50.0);
        let expected = [1.0 / 30.0, 1.0 / 30.0 + 0.5, 1.0 / 30.0 + 0.5 + 1.0 / 3.0];
        assert_eq!(at.len(), 3);
        for (at, expected) in at.iter().zip(expected) {
            assert!((at - expected).abs() < 1e-12, "{at} {expected}");
        }
        assert!(on && (duty - (0.5 + 1.0 - expected[2])).abs() < 1e-12, "{duty}");
    }

    /// A threshold that was passed without a crossing switches nothing; one that was missed is made up for at the start of the step.
    #[test]
    fn only_a_sensor_that_was_inside_switches() {
        assert_eq!(run(true, 295.0, 1.0, 2.0), (1.0, vec![], true));
        let mut state = ThermostatState { on: true, armed: true, duty: 1.0 };
        let mut at = Vec::new();
        let sensed = Sensed { here: 291.0, last: Some(2.0), gain: 1.0 };
        assert_eq!(state.duty(&thermostat(), sensed, |place| at.push(place)), 0.0);
        assert_eq!((at, state.on), (vec![0.0], false));
    }

    #[test]
    fn a_step_without_a_past_tests_its_start_only() {
        let mut state = ThermostatState { on: false, armed: true, duty: 0.0 };
        let sensed = |here| Sensed { here, last: None, gain: 5.0 };
        assert_eq!(state.duty(&thermostat(), sensed(280.1), |_| ()), 0.0);
        assert_eq!(state.duty(&thermostat(), sensed(279.9), |_| ()), 1.0);
    }
}
