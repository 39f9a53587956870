//! Runge-Kutta-Legendre of order 2 (Meyer, Balsara & Aslam, J. Comput. Phys. 257, 2014, 594) in delta form.

use super::system::{System, SystemState, in_range};

/// Coefficients of a stage. The stage is mu D(j-1) + nu D(j-2) + h (mu_rate F(j-1) + gamma_rate F(0)) above the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rkl2Stage {
    /// Factor of the stage before.
    pub(crate) mu: f64,
    /// Factor of the second stage before.
    pub(crate) nu: f64,
    /// Factor of the rate of the stage before.
    pub(crate) mu_rate: f64,
    /// Factor of the rate at the start.
    pub(crate) gamma_rate: f64,
    /// Time of the stage as a share of the sub-step.
    pub(crate) time: f64,
}

/// Stability limit of `stages` for the product of sub-step and fastest rate: (s^2 + s - 2) / 2.
pub(crate) fn stable_product(stages: u32) -> f64 {
    let s = f64::from(stages);
    0.5 * (s * s + s - 2.0)
}

/// The least odd number of stages, at least 3, that is stable for this product of sub-step and fastest rate.
pub(crate) fn stages_for(product: f64) -> u32 {
    let least = (0.5 * ((9.0 + 8.0 * product.max(0.0)).sqrt() - 1.0)).ceil();
    let stages = least.clamp(3.0, 1e9) as u32 | 1;
    if stable_product(stages) < product { stages + 2 } else { stages }
}

/// The stages from number 1 on (equations 16 and 17 of the paper).
pub(crate) fn coefficients(stages: u32) -> Vec<Rkl2Stage> {
    let width = 2.0 / stable_product(stages);
    let b = |j: f64| if j < 2.0 { 1.0 / 3.0 } else { (j * j + j - 2.0) / (2.0 * j * (j + 1.0)) };
    let mu_rate = b(1.0) * width;
    let mut list = vec![Rkl2Stage { mu: 0.0, nu: 0.0, mu_rate, gamma_rate: 0.0, time: mu_rate }];
    for stage in 2..=stages {
        let j = f64::from(stage);
        let mu = (2.0 * j - 1.0) / j * b(j) / b(j - 1.0);
        let nu = -(j - 1.0) / j * b(j) / b(j - 2.0);
        let mu_rate = mu * width;
        let gamma_rate = -(1.0 - b(j - 1.0)) * mu_rate;
        let before = |back: usize| list.len().checked_sub(back).map_or(0.0, |at| list[at].time);
        let time = mu * before(1) + nu * before(2) + mu_rate + gamma_rate;
        list.push(Rkl2Stage { mu, nu, mu_rate, gamma_rate, time });
    }
    list
}

/// Factor of 12 (y - y') + 6 h (F + F') in the error estimate. For y' = z y / h that sum is z^3 y (Sommeijer, Shampine & Verwer, J. Comput. Appl. Math. 88,
/// 1998, 316). The error of the method is this times 1/6 minus its own coefficient (s^2 + s - 6) / (9 (s^2 + s - 2)), which is the third derivative of its
/// stability polynomial over 6.
pub(crate) fn error_factor(stages: u32) -> f64 {
    let stable = stable_product(stages);
    1.0 / 6.0 - (stable - 2.0) / (9.0 * stable)
}

/// Takes a sub-step. Returns the estimate of its error [K], or `None` where it fails.
///
/// The estimate omits arithmetic nodes, because they follow the average of their neighbours.
pub(super) fn step(system: &mut System, t: f64, step: f64, stages: u32, state: &mut SystemState) -> Option<f64> {
    let start = state.temperatures.clone();
    let first = state.rates.clone();
    let size = start.len();
    let (mut older, mut newer) = (vec![0.0; size], vec![0.0; size]);
    for stage in coefficients(stages) {
        let before = older.iter_mut().zip(&mut newer).zip(state.rates.iter().zip(&first));
        for ((temperature, start), ((older, newer), (rate, first))) in
            state.temperatures.iter_mut().zip(&start).zip(before)
        {
            let delta =
                stage.mu * *newer + stage.nu * *older + step * (stage.mu_rate * *rate + stage.gamma_rate * *first);
            *older = *newer;
            *newer = delta;
            // An arithmetic node keeps the temperature of the stage before, where the search for its balance starts.
            *temperature = if delta != 0.0 { start + delta } else { *temperature };
        }
        let time = t + stage.time * step;
        if !in_range(&state.temperatures) || !system.balance(time, &mut state.temperatures) {
            return None;
        }
        system.rate(time, &state.temperatures, &mut state.rates);
    }
    let factor = error_factor(stages);
    let error = |node: usize| factor * (6.0 * step * (first[node] + state.rates[node]) - 12.0 * newer[node]);
    Some((0..size).map(|node| error(node).abs()).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The time of a stage is (j^2 + j - 2) / (s^2 + s - 2) from the second on, and 1 at the last (Meyer et al., equation 15).
    #[test]
    fn stages_are_at_their_times() {
        for stages in [3, 5, 7, 31] {
            let list = coefficients(stages);
            for (index, stage) in list.iter().enumerate().skip(1) {
                let (j, s) = (index as f64 + 1.0, f64::from(stages));
                assert!((stage.time - (j * j + j - 2.0) / (s * s + s - 2.0)).abs() < 1e-12, "{stages} {j}");
            }
        }
    }

    #[test]
    fn stages_cover_the_product() {
        for product in [0.0, 4.9, 5.0, 5.1, 14.0, 14.1, 500.0, 1e6] {
            let stages = stages_for(product);
            assert!(stages % 2 == 1 && stages >= 3 && stable_product(stages) >= product, "{product} {stages}");
            assert!(stages == 3 || stable_product(stages - 2) < product, "{product} {stages}");
        }
    }
}
