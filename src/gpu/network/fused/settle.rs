//! Puts nodes of a small network into balance: the arithmetic ones, or all.

use super::{Fused, ITERATIONS, RESULT_HEAD, Unknowns, state};
use crate::gpu::error::GpuError;
use crate::gpu::resource::Resource;
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
        self.copy_state()?;
        for _ in 0..SUBMISSIONS {
            let (settled, worst) = self.settle_once(unknowns, t as f32)?;
            if worst >= f32::INFINITY.to_bits() {
                // Newton's method may pass through hot states, not through what is no number.
                let tried: &[[f32; 2]] = self.resources.read(state(!self.odd), 0, self.tables.nodes.len());
                if tried.iter().flatten().any(|x| !x.is_finite()) {
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
    fn settle_once(&mut self, unknowns: Unknowns, time: f32) -> Result<(bool, u32), GpuError> {
        let variant = FusedVariant { kind: FusedKind::Settle, lanes: self.lanes };
        let mut planned = self.describe(unknowns, self.lanes);
        planned.time = time;
        planned.count = ITERATIONS;
        if unknowns == Unknowns::Free {
            planned.lone = 0;
        }
        self.plan_next(planned)?;
        self.submit(variant, unknowns, 1)?;
        let head: &[u32] = self.resources.read(Resource::SmallResult, 0, RESULT_HEAD);
        self.counts.iterations += u64::from(head[2]);
        Ok((head[0] == 1, head[1]))
    }
}
