//! Puts nodes of a small network into balance: the arithmetic ones, or all.

use super::{Fused, ITERATIONS, RESULT_HEAD, Unknowns};
use crate::gpu::error::GpuError;
use crate::gpu::variant::{FusedKind, FusedVariant};

/// Submissions before a balance is given up.
const SUBMISSIONS: usize = 20;

impl Fused {
    /// Balances the arithmetic nodes.
    ///
    /// # Errors
    /// A call that fails.
    pub fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        self.settle(t, Unknowns::Arithmetic)
    }

    /// Balances all nodes. `None` where they take too many products.
    ///
    /// # Errors
    /// A call that fails.
    pub fn steady(&mut self, t: f64) -> Result<Option<bool>, GpuError> {
        if !self.knows(Unknowns::Free)? {
            return Ok(None);
        }
        self.settle(t, Unknowns::Free).map(Some)
    }

    fn has_arithmetic(&self) -> bool {
        !self.tables.lone.is_empty() || !self.tables.coupled.is_empty()
    }

    /// Balances in place, where it converges.
    fn settle(&mut self, t: f64, unknowns: Unknowns) -> Result<bool, GpuError> {
        if unknowns == Unknowns::Arithmetic && !self.has_arithmetic() {
            return Ok(true);
        }
        let start: Vec<[f32; 2]> = self.state().to_vec();
        let state = 1 - self.kept;
        self.states[state].write(&start);
        for _ in 0..SUBMISSIONS {
            let (settled, worst) = self.settle_once(unknowns, t as f32, state)?;
            if worst >= f32::INFINITY.to_bits() {
                // Newton's method may pass through hot states, not through what is no number.
                let lost = self.states[state].read::<[f32; 2]>(start.len()).iter().flatten().any(|x| !x.is_finite());
                if lost {
                    return Ok(false);
                }
            } else if settled {
                self.keep();
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// One dispatch of Newton's method on a state.
    fn settle_once(&mut self, unknowns: Unknowns, time: f32, state: usize) -> Result<(bool, u32), GpuError> {
        let variant = FusedVariant { kind: FusedKind::Settle, lanes: self.lanes };
        self.make_kernel(variant, unknowns)?;
        let mut planned = self.describe(unknowns, self.lanes);
        planned.time = time;
        planned.count = ITERATIONS;
        if unknowns == Unknowns::Free {
            planned.lone = 0;
        }
        if let Some(system) = self.systems.get_mut(&unknowns) {
            system.attempts[0].write(&[planned]);
        }
        self.result.write(&[0u32, 0, 0, 0]);
        self.submit((variant, unknowns), state, 1)?;
        let head: &[u32] = self.result.read(RESULT_HEAD);
        self.counts.iterations += u64::from(head[2]);
        Ok((head[0] == 1, head[1]))
    }
}
