//! Push constants of the passes over a network: times and weights.

use crate::gpu::layout::NetworkPass;
use crate::gpu::network::frame::AT_START;
use crate::gpu::network::solve_frame::GRADIENTS;
use crate::gpu::network::weights::{Stage, device_stages, error_weights, implicit_weights};
use crate::gpu::pass::NetworkWork;
use crate::gpu::wide_variant::WideKind;
use crate::thermal::network::stepper::StepMethod;
use crate::thermal::network::tr_bdf2::{DIAGONAL, GAMMA};

/// Squared tolerance of conjugate gradients, relative to the first residual. It is for balances, where Newton's method
/// corrects the remaining error, and for error estimates.
const BALANCE_ACCURACY: f32 = 1e-12;
const ESTIMATE_ACCURACY: f32 = 1e-6;

/// Relative temperature change at which Newton's method stops, and the number of iterations after which four times as
/// much counts as rounding. The method converges quadratically, so the remaining error is 1e-10 of the temperature. If
/// nodes radiate to each other, the matrix is approximate and each iteration leaves a share of the error.
const NEWTON: (f32, f32) = (5e-6, 6.0);
const NEWTON_RADIATIVE: (f32, f32) = (3e-7, 16.0);

/// Times and weights of an attempt.
#[derive(Clone)]
pub(super) struct Constants {
    stages: Vec<Stage>,
    error: [f32; 3],
    implicit: [[f32; 4]; 3],
    method: StepMethod,
    /// Whether nodes radiate to each other.
    pub(super) radiative: bool,
    /// Start of the first sub-step [s], and length of a sub-step [s].
    pub(super) time: f64,
    step: f64,
}

impl Constants {
    /// Constants of sub-steps of `step` [s] from `time` [s].
    pub(super) fn new(method: StepMethod, time: f64, step: f64) -> Self {
        let stages = match method {
            StepMethod::Rkl2 { stages } => stages,
            StepMethod::Euler | StepMethod::TrBdf2 => 1,
        };
        Self {
            stages: device_stages(stages, step),
            error: error_weights(method, step),
            implicit: implicit_weights(),
            method,
            radiative: false,
            time,
            step,
        }
    }

    /// Constants of passes without times and weights.
    pub(super) fn none() -> Self {
        Self::balance(0.0)
    }

    /// Constants of a balance at a time [s].
    pub(super) fn balance(time: f64) -> Self {
        Self::new(StepMethod::Euler, time, 0.0)
    }

    /// Evaluations of all exchanges in a sub-step, without those of solvers.
    pub(super) fn stages_of_method(&self) -> u64 {
        if self.method == StepMethod::TrBdf2 { 2 } else { self.stages.len() as u64 }
    }

    /// Push constants of a pass. Each kernel uses its own part of the weights.
    pub(super) fn of(&self, work: NetworkWork, sensors: usize, space_temperature: f32) -> NetworkPass {
        let NetworkWork { kind, count, .. } = work;
        let start = self.time + f64::from(work.sub_step) * self.step;
        let after = if self.step == 0.0 || work.stage == AT_START { 0.0 } else { self.after(kind, work.stage) };
        let said = NetworkPass {
            count,
            sensed_at: work.sub_step * sensors as u32,
            mode: work.mode,
            time: (start + after) as f32,
            space_temperature,
            ..NetworkPass::default()
        };
        match kind {
            WideKind::Last => {
                let [at_end, at_start, change] = self.error;
                NetworkPass { mu: change, mu_step: at_end, gamma_step: at_start, ..said }
            }
            WideKind::Residual | WideKind::Estimate | WideKind::Middle => {
                let [mu, nu, mu_step, gamma_step] = self.implicit[work.stage as usize];
                let inverse_step = (1.0 / (DIAGONAL * self.step)) as f32;
                NetworkPass { mu, nu, mu_step, gamma_step, inverse_step, ..said }
            }
            WideKind::Scalars if work.mode == GRADIENTS => {
                let estimates = self.method == StepMethod::TrBdf2 && work.stage == 2;
                NetworkPass { accuracy: if estimates { ESTIMATE_ACCURACY } else { BALANCE_ACCURACY }, ..said }
            }
            WideKind::Scalars => {
                let (accuracy, mu) = if self.radiative { NEWTON_RADIATIVE } else { NEWTON };
                NetworkPass { accuracy, mu, ..said }
            }
            _ => {
                let stage = self.stages[(work.stage as usize).min(self.stages.len() - 1)];
                let Stage { mu, nu, mu_step, gamma_step, .. } = stage;
                NetworkPass { mu, nu, mu_step, gamma_step, ..said }
            }
        }
    }

    /// Time since the start of the sub-step at which a pass evaluates the heat [s].
    fn after(&self, kind: WideKind, stage: u32) -> f64 {
        match kind {
            WideKind::Start => 0.0,
            WideKind::Residual | WideKind::Estimate | WideKind::Middle if stage == 0 => GAMMA * self.step,
            WideKind::Residual | WideKind::Estimate | WideKind::Middle => self.step,
            // A stage evaluates the rates of the previous stage, at the time of that stage.
            WideKind::Stage => f64::from(self.stages[stage as usize - 1].time),
            _ => f64::from(self.stages[(stage as usize).min(self.stages.len() - 1)].time),
        }
    }
}
