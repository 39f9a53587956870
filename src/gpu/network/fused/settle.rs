//! Balancing of a small network's nodes: the arithmetic ones, or all.

use super::{Fused, ITERATIONS, RESULT_HEAD, Unknowns, state};
use crate::gpu::error::GpuError;
use crate::gpu::resource::Resource;
use crate::gpu::variant::{FusedKind, FusedVariant};

/// Most submissions of a balance.
const SUBMISSIONS: usize = 20;

impl Fused {
    /// Balances the arithmetic nodes. Returns whether they converged.
    pub fn balance(&mut self, t: f64) -> Result<bool, GpuError> {
        self.settle(t, Unknowns::Arithmetic)
    }

    /// Balances all nodes. Returns whether they converged; `None` if they need too many products.
    pub fn steady(&mut self, t: f64) -> Result<Option<bool>, GpuError> {
        if !self.knows(Unknowns::Free)? {
            return Ok(None);
        }
        self.settle(t, Unknowns::Free).map(Some)
    }

    fn has_arithmetic(&self) -> bool {
        !self.tables.lone.is_empty() || !self.tables.coupled.is_empty()
    }

    /// Balances nodes, and accepts the result if it converges.
    fn settle(&mut self, t: f64, unknowns: Unknowns) -> Result<bool, GpuError> {
        if unknowns == Unknowns::Arithmetic && !self.has_arithmetic() {
            return Ok(true);
        }
        self.copy_state()?;
        for _ in 0..SUBMISSIONS {
            let (settled, worst) = self.settle_once(unknowns, t as f32)?;
            if worst >= f32::INFINITY.to_bits() {
                // Newton's method may pass through high temperatures, but all must be finite.
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

    /// One dispatch of Newton's method.
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
