//! What each pass of a submission says: times and weights.

use crate::gpu::layout::{NetworkPass, NetworkStage};
use crate::gpu::network::frame::AT_START;
use crate::gpu::network::solve_frame::GRADIENTS;
use crate::gpu::network::weights::{device_stages, error_weights, implicit_weights};
use crate::gpu::pass::NetworkWork;
use crate::gpu::wide_variant::WideKind;
use crate::thermal::network::stepper::Method;
use crate::thermal::network::tr_bdf2::{DIAGONAL, GAMMA};

/// Share of the first residual's norm at which conjugate gradients stop, squared: for a balance, whose next iteration sees
/// what is left, and for the estimate of an error.
const BALANCE_ACCURACY: f32 = 1e-12;
const ESTIMATE_ACCURACY: f32 = 1e-6;

/// Relative change of a temperature at which Newton's method stops, and iterations from which on four times as much is
/// rounding. It converges quadratically, and what is left after the last step is 1e-10 of the temperature; where nodes radiate
/// to each other the matrix is not quite that of the balances, and each step leaves a share of it.
const NEWTON: (f32, f32) = (5e-6, 6.0);
const NEWTON_RADIATIVE: (f32, f32) = (3e-7, 16.0);

/// Times and weights of a try.
#[derive(Clone)]
pub(super) struct Constants {
    stages: Vec<NetworkStage>,
    error: [f32; 3],
    implicit: [[f32; 4]; 3],
    method: Method,
    /// Whether nodes radiate to each other.
    pub(super) radiative: bool,
    /// Start of the first sub-step [s], and the length of one.
    pub(super) time: f64,
    step: f64,
}

impl Constants {
    /// Of sub-steps of `step` [s] from `time` [s] on.
    pub(super) fn new(method: Method, time: f64, step: f64) -> Self {
        let stages = match method {
            Method::Rkl2 { stages } => stages,
            Method::Euler | Method::TrBdf2 => 1,
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

    /// Of passes that need none.
    pub(super) fn none() -> Self {
        Self::balance(0.0)
    }

    /// Of a balance at a time [s].
    pub(super) fn balance(time: f64) -> Self {
        Self::new(Method::Euler, time, 0.0)
    }

    /// Evaluations of all exchanges in a sub-step, solvers left out.
    pub(super) fn stages_of_method(&self) -> u64 {
        if self.method == Method::TrBdf2 { 2 } else { self.stages.len() as u64 }
    }

    /// What a pass says: its kernel knows which of the weights it has.
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
                let estimates = self.method == Method::TrBdf2 && work.stage == 2;
                NetworkPass { accuracy: if estimates { ESTIMATE_ACCURACY } else { BALANCE_ACCURACY }, ..said }
            }
            WideKind::Scalars => {
                let (accuracy, mu) = if self.radiative { NEWTON_RADIATIVE } else { NEWTON };
                NetworkPass { accuracy, mu, ..said }
            }
            _ => {
                let stage = self.stages[(work.stage as usize).min(self.stages.len() - 1)];
                let NetworkStage { mu, nu, mu_step, gamma_step, .. } = stage;
                NetworkPass { mu, nu, mu_step, gamma_step, ..said }
            }
        }
    }

    /// Time [s] since the start of the sub-step at which a pass evaluates heat.
    fn after(&self, kind: WideKind, stage: u32) -> f64 {
        match kind {
            WideKind::Start => 0.0,
            WideKind::Residual | WideKind::Estimate | WideKind::Middle if stage == 0 => GAMMA * self.step,
            WideKind::Residual | WideKind::Estimate | WideKind::Middle => self.step,
            // A stage evaluates what the one before it left, at the time of that one.
            WideKind::Stage => f64::from(self.stages[stage as usize - 1].time),
            _ => f64::from(self.stages[(stage as usize).min(self.stages.len() - 1)].time),
        }
    }
}
