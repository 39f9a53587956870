//! Heaters of a network in one pass: their table, and the reading of their logs.

use crate::thermal::network::control::Switch;
use crate::thermal::network::one_pass::{OnePassHeater, OnePassPlan};

/// Words of the log of a heater: its switches in a frame, and the times of the first ones.
pub(crate) const LOGGED: usize = 16;
/// Sensor of a heater without a thermostat.
const NO_SENSOR: u32 = u32::MAX;

/// Two words of each heater for a plan. `slot` gives the place of a node, and `first` is the place of the first heater's power.
pub(crate) fn words(
    heaters: &[OnePassHeater],
    plan: &OnePassPlan,
    slot: impl Fn(u32) -> u32,
    first: u32,
) -> Vec<[u32; 4]> {
    let words = |(number, heater): (usize, &OnePassHeater)| {
        let place = first + number as u32;
        let Some(one) = &heater.thermostat else { return [[NO_SENSOR, place, 0, 0], [0; 4]] };
        let [low, high, gain] =
            [one.on_below, one.off_above - one.on_below, heater.gain(plan)].map(|value| value as f32);
        [[slot(one.sensor), place, 0, 0], [low.to_bits(), high.to_bits(), gain.to_bits(), 0]]
    };
    heaters.iter().enumerate().flat_map(words).collect()
}

/// State of each heater before the first step, as the device keeps it: four numbers each. `on` tells which thermostats are on.
pub(crate) fn states(heaters: &[OnePassHeater], on: &[bool]) -> Vec<[f32; 4]> {
    let mut on = on.iter();
    let of = |heater: &OnePassHeater| match &heater.thermostat {
        Some(one) => *on.next().unwrap_or(&one.initially_on),
        None => true,
    };
    heaters.iter().map(of).map(|on| [f32::from(u8::from(on)), 0.0, 0.0, 0.0]).collect()
}

/// The switches in the log of a frame from `start` [s] of `length` [s]. `on` are the states of the thermostats before it. Switches whose times did not fit
/// into the log have the time of the end.
pub(crate) fn switches(heaters: &[OnePassHeater], log: &[u32], on: &[bool], start: f64, length: f64) -> Vec<Switch> {
    let logs = log.chunks(LOGGED).zip(heaters).filter(|(_, heater)| heater.thermostat.is_some());
    let mut switches = Vec::new();
    for (thermostat, ((log, _), mut on)) in logs.zip(on.iter().copied()).enumerate() {
        for number in 1..=log[0] as usize {
            on = !on;
            let since = log.get(number).map_or(length, |bits| f64::from(f32::from_bits(*bits)));
            switches.push(Switch { time: start + since, thermostat, on });
        }
    }
    switches.sort_by(|a, b| a.time.total_cmp(&b.time));
    switches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::network::schedule::Thermostat;

    #[test]
    fn a_log_is_read_in_the_order_of_time() {
        let thermostat =
            |sensor| Thermostat { node: 0, sensor, power: 1.0, on_below: 1.0, off_above: 2.0, initially_on: false };
        let heater = |thermostat| OnePassHeater { shares: Vec::new(), thermostat };
        let heaters = [heater(Some(thermostat(0))), heater(None), heater(Some(thermostat(3)))];
        let mut log = vec![0; 3 * LOGGED];
        log[..3].copy_from_slice(&[2, 4.0f32.to_bits(), 12.0f32.to_bits()]);
        log[2 * LOGGED..2 * LOGGED + 2].copy_from_slice(&[1, 6.5f32.to_bits()]);
        let switch = |time, thermostat, on| Switch { time, thermostat, on };
        let expected = [switch(104.0, 0, true), switch(106.5, 1, false), switch(112.0, 0, false)];
        assert_eq!(switches(&heaters, &log, &[false, true], 100.0, 15.0), expected);
        log[0] = 40;
        let many = switches(&heaters, &log, &[false, true], 100.0, 15.0);
        assert_eq!((many.len(), many.last().map(|last| last.time)), (41, Some(115.0)));
        let on: Vec<f32> = states(&heaters, &[true, false]).into_iter().map(|[on, ..]| on).collect();
        assert_eq!(on, [1.0, 1.0, 0.0]);
    }
}
