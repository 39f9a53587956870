//! The local step of a node: it radiates under constant power, dT/dt = power - emission T^4, over a step.
//!
//! A slow node takes two classical Runge-Kutta steps on the change of its temperature. Differences of fourth powers are products, so nothing cancels. A fast
//! node takes the closed form: with x = T / Te and Te the temperature of balance, artanh(d / (1 - x0 x1)) + atan(d / (1 + x0 x1)) = 2 emission Te^3 for the
//! change d of x, which holds below and above the balance.

/// Share of a node's time constant that a Runge-Kutta step spans at most.
pub(crate) const SHARE: f64 = 0.175;
pub(crate) const SLOW_STEPS: u32 = 2;
/// Share of the emission at the start below which a power has no closed form here: the temperature of balance is too far away.
const WEAK: f64 = 1.0 / 1296.0;
/// Newton iterations of the closed form, which leave 1e-5 K at three time constants and 4e-4 K at eleven.
const ITERATIONS: u32 = 4;
/// artanh beyond which a node is in balance.
const IN_BALANCE: f64 = 9.0;

/// Change of a temperature [K] over a step. `start` is the change at the rate of the start [K], and `emission` [1/K3] the change that the emission at 1 K
/// causes. A step is `count` steps of Runge-Kutta.
pub(crate) fn local_change(temperature: f64, start: f64, emission: f64, count: u32) -> f64 {
    let share = 1.0 / f64::from(count);
    let rate = |change: f64| {
        let reached = temperature + change;
        let radiated = change * (reached + temperature) * (reached * reached + temperature * temperature);
        share * (start - emission * radiated)
    };
    let mut change = 0.0;
    for _ in 0..count {
        let a = rate(change);
        let b = rate(change + 0.5 * a);
        let c = rate(change + 0.5 * b);
        let d = rate(change + c);
        change += (a + 2.0 * (b + c) + d) / 6.0;
    }
    change
}

/// Like [`local_change`] for a fast node, in closed form. Where hardly any power is left, it takes `count` Runge-Kutta steps.
pub(crate) fn fast_change(temperature: f64, start: f64, emission: f64, count: u32) -> f64 {
    let emitted = emission * temperature.powi(4);
    let power = start + emitted;
    if power <= WEAK * emitted || power <= 0.0 {
        return local_change(temperature, start, emission, count);
    }
    closed_change(temperature, start, power, emission)
}

/// Like [`local_change`], in closed form. `power` [K] is the change that the power alone would cause, and is above 0.
fn closed_change(temperature: f64, start: f64, power: f64, emission: f64) -> f64 {
    let balance = (power / emission).sqrt().sqrt();
    let from = temperature / balance;
    // 1 - x0^2, which does not cancel.
    let distance = start / (power * (1.0 + from * from));
    let goal = 2.0 * emission * balance.powi(3);
    let change = |reached: f64| {
        let ratio = reached.clamp(0.0, IN_BALANCE).tanh();
        distance * ratio / (1.0 + from * ratio)
    };
    let mut reached = 0.5 * goal * (1.0 + from * from);
    for _ in 0..ITERATIONS {
        reached = reached.clamp(0.0, IN_BALANCE);
        let moved = change(reached);
        let to = from + moved;
        reached -= 0.5 * (1.0 + to * to) * (reached + (moved / (1.0 + from * to)).atan() - goal);
    }
    balance * change(reached)
}

/// A node whose power is weak cools almost freely until it is so many times as hot as its balance.
const NEAR: f64 = 5.0;

/// Like [`local_change`], for any power that is not negative, and any step. `power` [K] is the change that the power alone would cause. A node that
/// is far hotter than its balance first cools freely, T = (T0^-3 + 3 k t)^(-1/3), with its power as a perturbation of first order, and takes the
/// closed form for the rest of the step.
pub(crate) fn whole_change(temperature: f64, start: f64, power: f64, emission: f64) -> f64 {
    let emitted = emission * temperature.powi(4);
    if power > WEAK * emitted {
        return closed_change(temperature, start, power, emission);
    }
    if emitted <= 0.0 {
        return 0.0;
    }
    let steep = emission * temperature.powi(3);
    let balance = (power / emission).sqrt().sqrt();
    let near = (temperature / (NEAR * balance)).min(FARTHEST);
    // Lengths of time times k T0^3.
    let taken = steep.min((near.powi(3) - 1.0) / 3.0);
    let cooled = 1.0 + 3.0 * taken;
    let share = cooled.powf(-1.0 / 3.0);
    let fallen = temperature * (1.0 - cooled) / (cooled * (share * share + share + 1.0));
    let first = fallen + power / (7.0 * steep) * (cooled - share.powi(4));
    let left = 1.0 - taken / steep;
    if left <= 0.0 {
        return first;
    }
    let here = temperature + first;
    first + closed_change(here, left * (power - emission * here.powi(4)), left * power, left * emission)
}

/// Most times that a node is taken to be as hot as `NEAR` balances.
const FARTHEST: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    /// Cooling far above the balance, without power at all, and over steps of up to a hundred thousand time constants.
    #[test]
    fn any_step_is_exact() {
        for (temperature, balance) in
            [(400.0, 0.0), (400.0, 2.7), (690.0, 100.0), (300.0, 51.0), (2.7, 690.0), (300.0, 299.9), (20.0, 80.0)]
        {
            for slope in [1e-3, 0.1, 0.35, 3.0, 11.0, 40.0] {
                let emission = slope / (4.0 * f64::max(temperature, balance).powi(3));
                let power = emission * f64::powi(balance, 4);
                let start = power - emission * f64::powi(temperature, 4);
                let exact = local_change(temperature, start, emission, 40_000);
                let computed = whole_change(temperature, start, power, emission);
                assert!((computed - exact).abs() < 7e-4, "{slope}, {temperature} to {balance} K: {computed} {exact}");
            }
            if balance < 50.0 {
                continue;
            }
            let emission = 1e5 / (4.0 * f64::max(temperature, balance).powi(3));
            let power = emission * f64::powi(balance, 4);
            let start = power - emission * f64::powi(temperature, 4);
            let found = temperature + whole_change(temperature, start, power, emission);
            assert!((found - balance).abs() < 7e-4, "{temperature} to {balance} K: {found}");
        }
        assert_eq!(whole_change(0.0, 0.0, 0.0, 1e-9), 0.0);
    }

    /// A node that only radiates cools as (T0^-3 + 3 k t)^(-1/3).
    #[test]
    fn free_cooling_is_exact() {
        for temperature in [30.0, 290.0, 600.0] {
            for slope in [1e-3, 0.1, 2.0 * SHARE] {
                let emission = slope / (4.0 * f64::powi(temperature, 3));
                let change = local_change(temperature, -emission * temperature.powi(4), emission, 2);
                let exact = (temperature.powi(-3) + 3.0 * emission).powf(-1.0 / 3.0) - temperature;
                assert!((change - exact).abs() < 2e-6 * temperature, "{temperature} {slope}: {change} {exact}");
            }
        }
    }

    #[test]
    fn more_steps_take_a_faster_node() {
        let (temperature, slope) = (400.0f64, 3.0);
        let emission = slope / (4.0 * temperature.powi(3));
        let count = (slope / SHARE).ceil() as u32;
        let change = local_change(temperature, -emission * temperature.powi(4), emission, count);
        let exact = (temperature.powi(-3) + 3.0 * emission).powf(-1.0 / 3.0) - temperature;
        assert!((change - exact).abs() < 1e-3, "{change} {exact}");
        let few = local_change(temperature, -emission * temperature.powi(4), emission, 2);
        assert!((few - exact).abs() > 0.1, "two steps would be too few: {few} {exact}");
        let fast = fast_change(temperature, -emission * temperature.powi(4), emission, count);
        assert_eq!(fast, change, "without power there is no balance to use");
    }

    /// The closed form against many Runge-Kutta steps: heating from a hundredth of the balance, cooling from five times it, and near it.
    #[test]
    fn the_closed_form_is_exact_for_fast_nodes() {
        for (slope, error) in [(0.01, 2e-9), (0.35, 1e-9), (3.0, 2e-5), (11.0, 5e-4)] {
            for (temperature, balance) in [(3.0, 300.0), (100.0, 330.0), (299.0, 300.0), (301.0, 300.0), (400.0, 80.0)]
            {
                let emission = slope / (4.0 * f64::max(temperature, balance).powi(3));
                let start = emission * (balance.powi(4) - f64::powi(temperature, 4));
                let exact = local_change(temperature, start, emission, 4000);
                let computed = fast_change(temperature, start, emission, 1);
                assert!((computed - exact).abs() < error, "{slope}, {temperature} to {balance} K: {computed} {exact}");
            }
        }
        // Far beyond its time constant a node is in balance, whatever it starts from.
        for temperature in [10.0, 290.0, 900.0] {
            let start = 1e-5 * (300f64.powi(4) - f64::powi(temperature, 4));
            assert!((temperature + fast_change(temperature, start, 1e-5, 1) - 300.0).abs() < 1e-4);
        }
    }
}
