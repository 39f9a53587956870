//! What the engines of a craft and the checks beside them share of radiation between surfaces: rays, the exchange of a pose, and rows between two poses.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};

use glam::DAffine3;

use super::exchange_poses::{FindingPair, MEMORY, MOST, RowsBetween};
use crate::exchange::bundles::SkyBundles;
use crate::exchange::jointed_rays::JointedRays;
use crate::exchange::packed::PackedExchange;
use crate::exchange::step::Exchange;
use crate::gpu::host_heap::give_back_freed_memory;

/// Size of a packed exchange [B] from which freed memory is given back, which takes milliseconds.
const LARGE: usize = 1 << 19;
/// Findings between two times.
const FINDINGS: usize = 4;

/// Poses of the joints, each with its exchange as long as anybody uses it, and the last ones for longer. A copy begins with none, because the patches of a copied craft may
/// be changed.
#[derive(Debug, Default)]
pub(super) struct ExchangesInUse(Mutex<KnownExchanges>);

#[derive(Debug, Default)]
struct KnownExchanges {
    all: Vec<(Vec<DAffine3>, Weak<PackedExchange>)>,
    /// The last ones, the latest at the end. So a restored state and a second engine find them again.
    held: VecDeque<Arc<PackedExchange>>,
    /// Exchanges that were ever added.
    added: u64,
}

impl Clone for ExchangesInUse {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// What the rays of a craft have in common in all poses. A copy begins without.
#[derive(Debug, Default)]
pub(super) struct RaysOfCraft {
    /// `None` where one tree around the whole craft serves.
    pub(super) jointed: OnceLock<Option<JointedRays>>,
    pub(super) bundles: OnceLock<SkyBundles>,
}

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
    fn known(&self) -> MutexGuard<'_, KnownExchanges> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The exchange for poses, which is made where nobody has it.
    pub(super) fn get_or_make(&self, poses: &[DAffine3], make: impl FnOnce() -> PackedExchange) -> Arc<PackedExchange> {
        let known = self.known().get(poses);
        known.unwrap_or_else(|| {
            let exchange = Arc::new(make());
            self.known().add(poses, &exchange);
            exchange
        })
    }

    /// Adds the exchange of poses, unless it is known.
    pub(super) fn add(&self, poses: &[DAffine3], exchange: PackedExchange) {
        let mut known = self.known();
        if known.get(poses).is_none() {
            known.add(poses, &Arc::new(exchange));
        }
    }

    /// The latest poses whose exchanges fit the memory, with these, in the order in which they were added.
    pub(super) fn latest(&self) -> Vec<(Vec<DAffine3>, Arc<PackedExchange>)> {
        let known = self.known();
        let alive = known.all.iter().rev().filter_map(|(poses, exchange)| Some((poses.clone(), exchange.upgrade()?)));
        let mut bytes = 0;
        let fits = |(_, exchange): &(_, Arc<PackedExchange>)| {
            bytes += exchange.bytes();
            bytes <= MEMORY
        };
        let mut latest: Vec<_> = alive.take(MOST).take_while(fits).collect();
        latest.reverse();
        latest
    }

    /// Exchanges that were ever added.
    pub(super) fn added(&self) -> u64 {
        self.known().added
    }
}

impl KnownExchanges {
    fn get(&self, poses: &[DAffine3]) -> Option<Arc<PackedExchange>> {
        self.all.iter().find(|(own, _)| own == poses).and_then(|(_, exchange)| exchange.upgrade())
    }

    fn add(&mut self, poses: &[DAffine3], exchange: &Arc<PackedExchange>) {
        self.all.retain(|(_, exchange)| exchange.strong_count() > 0);
        // Finding takes many times the memory of what is found.
        if exchange.bytes() > LARGE && self.all.len().is_multiple_of(FINDINGS) {
            give_back_freed_memory();
        }
        self.all.push((poses.to_vec(), Arc::downgrade(exchange)));
        self.held.push_back(Arc::clone(exchange));
        self.added += 1;
        while self.held.len() > MOST || self.bytes() > MEMORY {
            if self.held.pop_front().is_none() {
                return;
            }
        }
    }

    /// Memory of all that is held here or in use [B].
    fn bytes(&self) -> usize {
        self.all.iter().filter_map(|(_, exchange)| exchange.upgrade()).map(|exchange| exchange.bytes()).sum()
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
