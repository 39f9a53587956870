//! Coefficients of RKL2 in f64, as the device reads them.

use crate::gpu::layout::NetworkStage;

/// The stages of a sub-step of `step` [s]. RKL2 in delta form: Meyer, Balsara & Aslam, J. Comput. Phys. 257 (2014) 594,
/// equations 16 to 18; the time of a stage follows from its own recursion. One stage is forward Euler.
pub fn stages(count: u32, step: f64) -> Vec<NetworkStage> {
    let euler = NetworkStage { mu: 0.0, nu: 0.0, mu_step: 0.0, gamma_step: step as f32, time: step as f32 };
    if count < 2 {
        return vec![euler];
    }
    let s = f64::from(count);
    let w1 = 4.0 / (s * s + s - 2.0);
    let b = |j: f64| if j < 2.0 { 1.0 / 3.0 } else { (j * j + j - 2.0) / (2.0 * j * (j + 1.0)) };
    let first = b(1.0) * w1;
    let mut times = [0.0, first];
    let mut stages = vec![NetworkStage {
        gamma_step: (first * step) as f32,
        time: (first * step) as f32,
        ..euler
    }];
    for j in (2..=count).map(f64::from) {
        let mu = (2.0 * j - 1.0) / j * b(j) / b(j - 1.0);
        let nu = -(j - 1.0) / j * b(j) / b(j - 2.0);
        let mu_rate = mu * w1;
        let gamma_rate = -(1.0 - b(j - 1.0)) * mu_rate;
        let time = mu * times[1] + nu * times[0] + mu_rate + gamma_rate;
        times = [times[1], time];
        stages.push(NetworkStage {
            mu: mu as f32,
            nu: nu as f32,
            mu_step: (mu_rate * step) as f32,
            gamma_step: (gamma_rate * step) as f32,
            time: (time * step) as f32,
        });
    }
    stages
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_stage_ends_the_sub_step() {
        for count in [1, 3, 5, 21, 75] {
            let stages = stages(count, 2.0);
            assert_eq!(stages.len(), count as usize);
            let end = stages.last().map_or(0.0, |stage| stage.time);
            assert!((end - 2.0).abs() < 1e-6, "{count} stages end at {end}");
            // A wrong weight is seen.
            let mut wrong = stages[0].time;
            wrong += 1e-3;
            assert!((wrong - stages[0].time).abs() > 1e-6);
        }
    }

    /// T' = -T: the numerical solution of one sub-step, whose error must fall with the third power.
    #[test]
    fn a_sub_step_is_of_order_two() {
        let error = |step: f64| {
            let (mut last, mut before) = (0.0f64, 0.0f64);
            for stage in stages(5, step) {
                let [mu, nu, mu_step, gamma_step] =
                    [stage.mu, stage.nu, stage.mu_step, stage.gamma_step].map(f64::from);
                let next = mu * last + nu * before - mu_step * (1.0 + last) - gamma_step;
                (before, last) = (last, next);
            }
            (last - (-step).exp_m1()).abs()
        };
        let order = (error(0.4) / error(0.2)).log2();
        assert!((2.7..3.5).contains(&order), "local order {order}");
    }
}
