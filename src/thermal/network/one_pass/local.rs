//! The local step of the one pass: a node under constant power that radiates, dT/dt = (power - emission T^4) / C, over a step.
//!
//! Classical Runge-Kutta steps on the change of the temperature. Differences of fourth powers are products, so nothing cancels.

/// Share of a node's time constant that a Runge-Kutta step spans at most.
pub const SHARE: f64 = 0.175;

/// Change of a temperature [K] over a step. `start` is the change at the rate of the start [K], and `emission` [1/K3] the change that the emission at 1 K
/// causes. A step is `count` steps of Runge-Kutta.
pub fn local_change(temperature: f64, start: f64, emission: f64, count: u32) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

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
    }
}
