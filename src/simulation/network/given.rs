//! The heat that the heaters of a scene's network have given.

use crate::thermal::network::schedule::HeatTable;

/// Heat that each heater has given [J], and since when it is on [s]. NaN where it is off.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct HeaterHeat {
    joules: Vec<f64>,
    since: Vec<f64>,
}

impl HeaterHeat {
    /// Heaters that have given nothing at a time [s].
    pub(crate) fn at(time: f64, on: &[bool]) -> Self {
        let since = on.iter().map(|on| if *on { time } else { f64::NAN }).collect();
        Self { joules: vec![0.0; on.len()], since }
    }

    /// Takes a switch of a heater with a power over time.
    pub(crate) fn switch(&mut self, heater: usize, power: &HeatTable, time: f64, on: bool) {
        if heater >= self.joules.len() {
            return;
        }
        self.joules[heater] = self.until(heater, power, time);
        self.since[heater] = if on { time } else { f64::NAN };
    }

    /// Heat of a heater until a time [J].
    pub(crate) fn until(&self, heater: usize, power: &HeatTable, time: f64) -> f64 {
        let (Some(since), Some(joules)) = (self.since.get(heater).copied(), self.joules.get(heater)) else {
            return 0.0;
        };
        let on = if time > since { (time - since) * power.mean(since, time) } else { 0.0 };
        joules + on
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_is_the_power_over_the_time_that_it_is_on() {
        let power = HeatTable::constant(10.0);
        let mut given = HeaterHeat::at(0.0, &[true, false]);
        assert_eq!(given.until(0, &power, 5.0), 50.0);
        given.switch(0, &power, 5.0, false);
        given.switch(0, &power, 7.0, true);
        assert_eq!([given.until(0, &power, 8.0), given.until(1, &power, 8.0)], [60.0, 0.0]);
    }
}
