//! The infrared that patches send while it is held. Twin: `glsl/exchange_send.comp`.
//!
//! Infrared is held from one finding to the next. Emission of its start would arrive late by half of this time, so a patch sends what it will emit in the
//! middle: its emission, and half of the change since the last finding. A patch that forgets its past within the time swings back and forth, and its last change
//! tells nothing of the next. With k times over its time constant of radiation the change counts by min(1, 1 / (e^k - 1)), the share of
//! the last change that goes on.

use rayon::prelude::*;

use super::patches::Patch;
use super::step::{CraftLight, Exchange};
use crate::environment::StepLoad;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::misfit::{Misfit, check_length};

/// Times over a time constant beyond which nothing of a change goes on.
const FORGOTTEN: f64 = 80.0;

/// The emission of the last finding.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Lead {
    /// Emission of each patch above that of space [W/m2].
    emitted: Vec<f64>,
}

impl Lead {
    /// Infrared that leaves each patch at first while it is held [W/m2]: emission above the emission of space, and reflected infrared of the planet. `temperature` gives
    /// the temperature of a node [K]. The last infrared was held for a time [s]; 0 where none came before.
    pub(crate) fn sent(
        &mut self,
        exchange: &Exchange,
        load: &StepLoad,
        light: &CraftLight,
        temperature: impl Fn(usize) -> f64 + Sync,
        held: f64,
    ) -> Vec<f64> {
        let emitted = exchange.emitted(load, temperature);
        let goes_on = held > 0.0 && self.emitted.len() == emitted.len();
        let space = load.background_temperature.powi(4);
        let sent = |(number, patch): (usize, &Patch)| {
            let now = emitted[number];
            let change = if goes_on { now - self.emitted[number] } else { 0.0 };
            let fourth = || now / (patch.optics.emissivity * STEFAN_BOLTZMANN) + space;
            let going_on = if change == 0.0 { 0.0 } else { going_on(patch.cooling, fourth(), held) };
            now + 0.5 * going_on * change + light.reflected[number][0]
        };
        let sent = exchange.patches.par_iter().enumerate().map(sent).collect();
        self.emitted = emitted;
        sent
    }

    /// Checks a saved emission of this number of patches.
    ///
    /// # Errors
    /// Another number of them.
    pub(crate) fn check_patches(&self, patches: usize) -> Result<(), Misfit> {
        if self.emitted.is_empty() { Ok(()) } else { check_length("emission of patches", &self.emitted, patches) }
    }
}

/// Share of the last change that goes on while infrared is held for a time [s]. The fourth power of the temperature is in K4.
fn going_on(cooling: f64, fourth: f64, held: f64) -> f64 {
    let squared = fourth.max(0.0).sqrt();
    let times = (held * cooling * squared * squared.sqrt()).min(FORGOTTEN);
    times.exp_m1().recip().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest departure of two black plates from their mean at the end of 400 times for which infrared is held, over the first. Each sees nothing but the other, which lies as far
    /// on the other side of the mean, and moves towards what it receives: x' = (received - x) / time constant, exactly.
    fn apart(times: f64, share: impl Fn(f64) -> f64) -> f64 {
        let kept = (-times).exp();
        let (mut before, mut now) = (1.0f64, 1.0f64);
        for _ in 0..400 {
            let received = -(now + 0.5 * share(times) * (now - before));
            (before, now) = (now, kept * now + (1.0 - kept) * received);
        }
        now.abs()
    }

    #[test]
    fn facing_plates_settle_however_long_infrared_is_held() {
        // 4 eps sigma T3 / C = 1 1/s at 1 K.
        let share = |times: f64| going_on(1.0, 1.0, times);
        for times in [1e-2, 0.1, 0.5, 0.7, 1.0, 2.0, 3.0, 5.0, 10.0, 40.0] {
            assert!(apart(times, share) <= 1.0, "{times}: {}", apart(times, share));
        }
        // The whole change would swing ever further.
        assert!(apart(5.0, |_| 1.0) > 1e3);
    }

    #[test]
    fn a_slow_plate_sends_the_middle_of_the_time() {
        assert_eq!(going_on(1e-6, 1.0, 60.0), 1.0);
        // At the logarithm of 2 the change begins to die.
        assert!((going_on(1.0, 1.0, 2f64.ln()) - 1.0).abs() < 1e-12);
        assert!((going_on(1.0, 16.0, 0.25) - 1.0 / 2f64.exp_m1()).abs() < 1e-12, "T3 is 8 at a fourth power of 16");
        assert!(going_on(f64::INFINITY, 1.0, 1.0) < 1e-30);
    }
}
