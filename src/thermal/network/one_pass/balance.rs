//! Nodes that store no heat, in the one pass: their temperature balances their loads with their neighbours at every step.

const ITERATIONS: u32 = 12;

/// Heat into a node at its temperature [W], and the part of it that depends on the temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Balance {
    /// Heat into the node [W].
    pub(crate) into: f64,
    /// Sum of its linear conductances [W/K].
    pub(crate) conductance: f64,
    /// Sum of its exchange areas, space included, times the Stefan-Boltzmann constant [W/K4].
    pub(crate) emission: f64,
}

/// Change of a temperature [K] to the balance, into - conductance d - emission ((T + d)^4 - T^4) = 0, by Newton's method. From above it does not overshoot, so
/// it starts where one of the two terms alone takes all heat. Twin: `balancing_change` of `glsl/one_pass.comp`.
pub(crate) fn balancing_change(balance: Balance, temperature: f64) -> f64 {
    let Balance { into, conductance, emission } = balance;
    let most = (into + conductance * temperature + emission * temperature.powi(4)).max(0.0);
    let by_conduction = if conductance > 0.0 { most / conductance } else { f64::INFINITY };
    let by_radiation = if emission > 0.0 { (most / emission).sqrt().sqrt() } else { f64::INFINITY };
    let mut change = by_conduction.min(by_radiation) - temperature;
    for _ in 0..ITERATIONS {
        let next = temperature + change;
        let radiated = change * (next + temperature) * (next * next + temperature * temperature);
        let slope = (conductance + 4.0 * emission * next.powi(3)).max(1e-30);
        change += ((into - conductance * change - emission * radiated) / slope).max(-0.75 * next);
    }
    change
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_kind_of_exchange_balances_in_closed_form() {
        // 5 W over 2 W/K warm by 2.5 K. 3e-8 W/K4 at 300 K need 243 W, and 486 W are those of 300 2^(1/4) K.
        let linear = Balance { into: 5.0, conductance: 2.0, emission: 0.0 };
        assert!((balancing_change(linear, 290.0) - 2.5).abs() < 1e-12);
        let radiative = Balance { into: 243.0, conductance: 0.0, emission: 3e-8 };
        assert!((balancing_change(radiative, 300.0) - 300.0 * (2f64.sqrt().sqrt() - 1.0)).abs() < 1e-10);
    }

    #[test]
    fn both_kinds_balance() {
        for (into, temperature) in [(400.0, 3.0), (-40.0, 290.0), (3.0, 290.0), (9000.0, 100.0)] {
            let balance = Balance { into, conductance: 0.7, emission: 2e-8 };
            let change = balancing_change(balance, temperature);
            let reached: f64 = temperature + change;
            let left = into - 0.7 * change - 2e-8 * (reached.powi(4) - f64::powi(temperature, 4));
            assert!(left.abs() < 1e-9 * (1.0 + into.abs()), "{into} W at {temperature} K leaves {left} W");
        }
    }
}
