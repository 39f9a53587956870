//! Weights of the stages of each integration method, rounded to f32 (docs/numerics.md, section 3).

use crate::thermal::network::rkl2;
use crate::thermal::network::stepper::StepMethod;
use crate::thermal::network::tr_bdf2::{DIAGONAL, GAMMA};

/// One stage of RKL2: change = mu x previous change + nu x change before that + mu_step x previous rate + gamma_step x
/// start rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage {
    /// Weight of the previous stage.
    pub(super) mu: f32,
    /// Weight of the stage before the previous one.
    pub(super) nu: f32,
    /// Weight of the rate at the previous stage [s].
    pub(super) mu_step: f32,
    /// Weight of the rate at the start of the sub-step [s].
    pub(super) gamma_step: f32,
    /// Time since the start of the sub-step [s].
    pub(super) time: f32,
}

/// Weights of `count` stages for a sub-step of `step` [s]. One stage is forward Euler.
pub(super) fn device_stages(count: u32, step: f64) -> Vec<Stage> {
    if count == 1 {
        let step = step as f32;
        return vec![Stage { mu: 0.0, nu: 0.0, mu_step: 0.0, gamma_step: step, time: step }];
    }
    let mut stages: Vec<Stage> = rkl2::coefficients(count)
        .iter()
        .map(|stage| Stage {
            mu: stage.mu as f32,
            nu: stage.nu as f32,
            mu_step: (stage.mu_rate * step) as f32,
            gamma_step: (stage.gamma_rate * step) as f32,
            time: (stage.time * step) as f32,
        })
        .collect();
    // The first stage uses only the rate at the start.
    stages[0] = Stage { gamma_step: stages[0].mu_step, mu_step: 0.0, ..stages[0] };
    stages
}

/// Weights in the error estimate of a sub-step: of the rates at the end and at the start [s], and of the change.
pub(super) fn error_weights(method: StepMethod, step: f64) -> [f32; 3] {
    match method {
        StepMethod::Euler => [0.5 * step, -0.5 * step, 0.0].map(|weight| weight as f32),
        StepMethod::Rkl2 { stages } => {
            let factor = rkl2::error_factor(stages);
            [6.0 * factor * step, 6.0 * factor * step, -12.0 * factor].map(|weight| weight as f32)
        }
        StepMethod::TrBdf2 => [0.0; 3],
    }
}

/// Weights in the right-hand sides of TR-BDF2, times alpha h: first stage, second stage, error estimate. Each has
/// weights of the heat at present and at the start, and of the heat stored by the change and by the first stage's
/// change.
///
/// gamma = 2 - sqrt 2 and alpha = gamma / 2. The first stage has the weight 1 / (gamma (2 - gamma)) in the second. The
/// estimate is 2 k / alpha times the embedded one, k = (-3 gamma^2 + 4 gamma - 2) / (12 (2 - gamma)) (Hosea & Shampine
/// 1996).
pub(super) fn implicit_weights() -> [[f32; 4]; 3] {
    let first = 1.0 / (GAMMA * (2.0 - GAMMA));
    let estimate = 2.0 / DIAGONAL * (-3.0 * GAMMA * GAMMA + 4.0 * GAMMA - 2.0) / (12.0 * (2.0 - GAMMA));
    let middle = 1.0 / (GAMMA * (1.0 - GAMMA));
    let embedded = [0.0, 1.0 / GAMMA + middle, 1.0 / (1.0 - GAMMA), -middle - first / (1.0 - GAMMA)];
    [[1.0, 1.0, -1.0, 0.0], [1.0, 0.0, -1.0, first], embedded.map(|weight| estimate * weight)]
        .map(|weights| weights.map(|weight| weight as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 / (gamma (2 - gamma)) and the sum of both weights of the change, worked out by hand for gamma = 2 - sqrt 2.
    #[test]
    fn the_weights_of_tr_bdf2_are_those_of_its_paper() {
        let [_, second, estimate] = implicit_weights();
        assert!((second[3] - 1.207_106_8).abs() < 1e-6, "{}", second[3]);
        assert!((estimate[2] * (1.0 - GAMMA as f32) + 0.276_142_4).abs() < 1e-6, "{}", estimate[2]);
    }
}
