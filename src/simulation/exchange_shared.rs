//! What the engines of a craft and the checks beside them share of radiation between surfaces: rays, the exchange of a pose, and rows between two poses.

use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use glam::DAffine3;

use super::exchange_poses::{FindingPair, RowsBetween};
use crate::exchange::bundles::SkyBundles;
use crate::exchange::jointed_rays::JointedRays;
use crate::exchange::packed::PackedExchange;
use crate::exchange::step::Exchange;
use crate::gpu::host_heap::give_back_freed_memory;

/// Size of a packed exchange [B] from which freed memory is given back, which takes milliseconds.
const LARGE: usize = 1 << 19;
/// Findings between two times.
const FINDINGS: usize = 4;

/// Poses of the joints, each with its exchange as long as anybody uses it. A copy begins with none, because the patches of a copied craft may be changed.
#[derive(Debug, Default)]
pub(super) struct ExchangesInUse(Mutex<Vec<(Vec<DAffine3>, Weak<PackedExchange>)>>);

impl Clone for ExchangesInUse {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// What the rays of a craft with joints have in common in all poses. A copy begins without.
#[derive(Debug, Default)]
pub(super) struct RaysOfCraft(pub(super) OnceLock<Option<(JointedRays, SkyBundles)>>);

impl Clone for RaysOfCraft {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// The rows that an engine uses, and the poses between which they lie, for the check beside it. A copy begins without.
#[derive(Debug, Default)]
pub(super) struct SharedRows(Mutex<Option<(RowsBetween, Weak<FindingPair<Exchange>>)>>);

impl Clone for SharedRows {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl ExchangesInUse {
    /// The exchange for poses, which is made where nobody uses it.
    pub(super) fn get_or_make(&self, poses: &[DAffine3], make: impl FnOnce() -> PackedExchange) -> Arc<PackedExchange> {
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let in_use = known().iter().find(|(own, _)| own == poses).and_then(|(_, exchange)| exchange.upgrade());
        in_use.unwrap_or_else(|| {
            let exchange = Arc::new(make());
            let mut known = known();
            known.retain(|(_, exchange)| exchange.strong_count() > 0);
            // Finding takes many times the memory of what is found.
            if exchange.bytes() > LARGE && known.len().is_multiple_of(FINDINGS) {
                give_back_freed_memory();
            }
            known.push((poses.to_vec(), Arc::downgrade(&exchange)));
            exchange
        })
    }
}

impl SharedRows {
    pub(super) fn share(&self, rows: Option<RowsBetween>, held: Option<&Arc<FindingPair<Exchange>>>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = rows.zip(held.map(Arc::downgrade));
    }

    /// The rows between these poses, while an engine uses them.
    pub(super) fn get(&self, rows: &RowsBetween) -> Option<Arc<Exchange>> {
        let held = {
            let shared = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            shared.as_ref().filter(|(own, _)| own == rows)?.1.upgrade()?
        };
        Some(Arc::clone(held.mean()))
    }
}
