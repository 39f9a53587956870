//! Detects thermostat switches from sensor values at the ends of sub-steps, and thermostats that switch too fast.

use super::schedule::Thermostat;

/// Accuracy of a switching time [s].
pub(super) const SWITCH_TIME: f64 = 1e-7;

/// Excess of an extremum over its neighbours [K] below which no crossing is searched for.
const NOISE: f64 = 1e-6;
/// Factor on the extremum of a parabola through three values, beyond which the sensor is not expected.
const MARGIN: f64 = 1.5;

/// Number of switches of one thermostat, each within [`SWITCH_TIME`] of the one before, at which the run fails.
const MOST_AT_ONCE: u32 = 6;
/// A thermostat that switches more than this often within [`CHATTER_TIME`] chatters: its band can not hold, and the run fails. No heater switches ten times
/// a second, and every switch costs some tries, so that such a run would not end in any useful time.
const CHATTER_SWITCHES: u32 = 1000;
/// See [`CHATTER_SWITCHES`] [s].
const CHATTER_TIME: f64 = 100.0;

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// Time of the last switch [s], and the number of switches before it that are each within [`SWITCH_TIME`] of the next.
    last: f64,
    close: u32,
    /// Time of the switch from which switches are counted [s], and their number after it.
    first: f64,
    count: u32,
}

impl Pace {
    /// Takes a switch at a time [s]. Returns the number of switches and the time [s] that they took, where the thermostat chatters.
    pub(super) fn take(&mut self, time: f64) -> Option<(u32, f64)> {
        self.close = if time - self.last <= SWITCH_TIME { self.close + 1 } else { 0 };
        self.last = time;
        if self.close > MOST_AT_ONCE {
            return Some((self.close, f64::from(self.close) * SWITCH_TIME));
        }
        if self.count == 0 {
            self.first = time;
        }
        self.count += 1;
        if self.count <= CHATTER_SWITCHES {
            return None;
        }
        let (switches, within) = (self.count - 1, time - self.first);
        // The last switch of one count is the first of the next.
        (self.first, self.count) = (time, 1);
        (within <= CHATTER_TIME).then_some((switches, within))
    }
}

/// Sensor values at the start and at the end of every sub-step of a try: one row for each time, one column for each thermostat.
pub(super) struct SensorTrace<'a> {
    pub(super) start: &'a [f64],
    pub(super) rest: &'a [f64],
}

impl SensorTrace<'_> {
    /// Number of rows, including the start.
    pub(super) fn rows(&self) -> usize {
        1 + self.rest.len() / self.start.len().max(1)
    }

    /// The values of one row [K].
    pub(super) fn row(&self, row: usize) -> &[f64] {
        let width = self.start.len();
        if row == 0 { self.start } else { &self.rest[(row - 1) * width..row * width] }
    }

    /// The first row at whose end a thermostat has crossed its threshold since the row before.
    pub(super) fn first_crossing(&self, thermostats: &[Thermostat], on: &[bool]) -> Option<usize> {
        (1..self.rows()).find(|row| !crossed(thermostats, on, self.row(row - 1), self.row(*row)).is_empty())
    }

    /// Whether a sensor may have crossed its threshold and returned between two of the first `rows` rows.
    pub(super) fn may_hide_crossing(&self, thermostats: &[Thermostat], on: &[bool], rows: usize) -> bool {
        (2..rows).any(|last| {
            thermostats.iter().zip(on).enumerate().any(|(column, (thermostat, on))| {
                let past = |row: usize| thermostat.past(*on, self.row(row)[column]);
                let [a, b, c] = [past(last - 2), past(last - 1), past(last)];
                // Only a sensor that has been between the thresholds can cross one.
                if a > 0.0 || b > 0.0 || c > 0.0 {
                    return false;
                }
                // The parabola through the values at -1, 0 and 1 is b + slope x + curve x^2.
                let (slope, curve) = (0.5 * (c - a), 0.5 * (a + c) - b);
                if curve >= 0.0 || slope.abs() > -2.0 * curve {
                    return false;
                }
                let excess = b - 0.25 * slope * slope / curve - a.max(b).max(c);
                excess > NOISE && a.max(b).max(c) + MARGIN * excess > 0.0
            })
        })
    }
}

/// The thermostats whose sensors cross their switching threshold between `before` and `after` [K].
pub(super) fn crossed(thermostats: &[Thermostat], on: &[bool], before: &[f64], after: &[f64]) -> Vec<usize> {
    (0..thermostats.len())
        .filter(|at| {
            let past = |sensed: &[f64]| thermostats[*at].past(on[*at], sensed[*at]);
            past(before) <= 0.0 && past(after) > 0.0
        })
        .collect()
}

/// Position in (0, 1) of the first crossing by the thermostats `at`, on straight lines from `before` to `after`.
pub(super) fn straight_crossing(
    thermostats: &[Thermostat],
    on: &[bool],
    at: &[usize],
    before: &[f64],
    after: &[f64],
) -> f64 {
    at.iter()
        .map(|at| {
            let [a, b] = [before, after].map(|sensed| thermostats[*at].past(on[*at], sensed[*at]));
            -a / (b - a)
        })
        .fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heater() -> Vec<Thermostat> {
        vec![Thermostat { node: 0, sensor: 0, power: 1.0, on_below: 280.0, off_above: 290.0, initially_on: false }]
    }

    #[test]
    fn only_a_crossing_in_the_right_direction_counts() {
        for (on, before, after, expected) in [
            (false, 281.0, 279.0, true),
            (false, 279.0, 278.0, false),
            (false, 279.0, 281.0, false),
            (true, 289.0, 291.0, true),
            (true, 291.0, 292.0, false),
            (true, 281.0, 279.0, false),
        ] {
            let computed = !crossed(&heater(), &[on], &[before], &[after]).is_empty();
            assert_eq!(computed, expected, "{on} {before} {after}");
        }
        assert_eq!(straight_crossing(&heater(), &[false], &[0], &[281.0], &[277.0]), 0.25);
    }

    #[test]
    fn a_dip_between_two_values_is_suspected() {
        let hides = |values: [f64; 3]| {
            SensorTrace { start: &values[..1], rest: &values[1..] }.may_hide_crossing(&heater(), &[false], 3)
        };
        assert!(hides([280.4, 280.01, 280.1]));
        assert!(!hides([282.0, 281.0, 281.1]), "the dip stays above the threshold");
        assert!(!hides([280.4, 280.2, 280.1]), "no dip");
    }
}
