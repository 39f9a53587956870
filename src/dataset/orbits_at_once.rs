//! Makes orbits of a data set, several at once where the craft is small.
//!
//! Steps of a small craft are short, so a device and the host wait for each other most of the time. Another orbit fills that time. Orbits share nothing that
//! one of them changes, so their files are the same in any order.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread::{available_parallelism, scope};
use std::time::Instant;

use super::error::DatasetError;
use super::orbit::OrbitRun;
use super::orbit_files::{Encoded, encode_image, write};
use super::order::{DatasetOrder, DatasetSummary, place};
use super::store::Store;
use super::sums::fault_of_orbit;
use crate::labels::places;
use crate::labels::silhouette::Solids;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::target::Target;

/// Most nodes of a craft of which several orbits are made at once. With more, a step keeps all processors busy, and each orbit takes memory.
const SMALL: usize = 20_000;
/// Most orbits at once.
const MOST: usize = 4;

/// How many of some orbits of a craft are made at once.
pub(super) fn orbits_at_once(nodes: usize, orbits: usize) -> usize {
    let processors = available_parallelism().map_or(1, usize::from);
    if nodes > SMALL { 1 } else { processors.min(MOST).min(orbits).max(1) }
}

/// Orbits that several threads make.
pub(super) struct Orbits<'a, 'b, I> {
    pub(super) order: &'b DatasetOrder<'a>,
    pub(super) store: &'b Store,
    /// The orbits that no thread has begun.
    pub(super) left: Mutex<I>,
    /// The first orbit, which was prepared to see whether the craft is valid.
    pub(super) first: Mutex<Option<OrbitRun<'a>>>,
}

/// A number of images, and whether they were kept from before.
type Images = (u64, bool);

impl<I: Iterator<Item = u64> + Send> Orbits<'_, '_, I> {
    /// Makes them all, `at_once` at once.
    ///
    /// # Errors
    /// An orbit that fails. No orbit is begun after it.
    pub(super) fn make(
        &self,
        at_once: usize,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(u64, bool),
    ) -> Result<DatasetSummary, DatasetError> {
        let failed = AtomicBool::new(false);
        let results = scope(|threads| {
            let (tell, told) = channel();
            let begin = |thread: usize| {
                let (tell, failed) = (tell.clone(), &failed);
                threads.spawn(move || {
                    let made = self.make_some(thread > 0, (stop, failed), &tell);
                    failed.fetch_or(made.is_err(), Ordering::Relaxed);
                    made
                })
            };
            let threads: Vec<_> = (0..at_once).map(begin).collect();
            drop(tell);
            for (images, kept) in told {
                progress(images, kept);
            }
            let ended = |thread: std::thread::ScopedJoinHandle<'_, _>| match thread.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            };
            threads.into_iter().map(ended).collect::<Vec<Result<DatasetSummary, DatasetError>>>()
        });
        results.into_iter().try_fold(DatasetSummary::default(), |mut whole, made| {
            whole.add(made?);
            Ok(whole)
        })
    }

    /// Makes orbits on a device of its own or on the first thread's, one after the other, until none is left, another thread fails or a signal comes.
    fn make_some(
        &self,
        opens: bool,
        (stop, failed): (&AtomicBool, &AtomicBool),
        tell: &Sender<Images>,
    ) -> Result<DatasetSummary, DatasetError> {
        let target = self.order.target;
        let target = if opens { target.for_another_thread().map_err(SimulationError::from)? } else { target.clone() };
        let mut made = DatasetSummary::default();
        while !failed.load(Ordering::Relaxed) {
            let Some(orbit) = self.left.lock().unwrap_or_else(PoisonError::into_inner).next() else { break };
            self.make_one(orbit, &target, (stop, tell), &mut made)?;
        }
        Ok(made)
    }

    fn make_one(
        &self,
        orbit: u64,
        target: &Target,
        (stop, tell): (&AtomicBool, &Sender<Images>),
        made: &mut DatasetSummary,
    ) -> Result<(), DatasetError> {
        let DatasetOrder { spec, scenes, root, .. } = *self.order;
        let (split, number) = place(spec, orbit);
        let images = spec.images_of(orbit);
        let count = images.end - images.start;
        // The receiver lives as long as the threads.
        let say = |images: Images| _ = tell.send(images);
        let prepared = {
            let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
            first.take_if(|first| first.number() == orbit)
        };
        if self.store.has(split, number) {
            check_kept(self.store, &places::orbit(split, number))?;
            made.kept += 1;
            say((count, true));
            return Ok(());
        }
        let mut run = match prepared {
            Some(run) => run,
            None => OrbitRun::new(spec, scenes, target, orbit)?,
        };
        let solids = Solids::new(&run.craft);
        let mut folder = self.store.begin(split, number)?;
        let mut encoded: Vec<Encoded> = Vec::new();
        let outcome = run.run(&|_| true, stop, &mut |craft, simulation, image, labelled| {
            let began = Instant::now();
            let image = encode_image(spec, (craft, &solids, simulation), image, labelled)?;
            encoded.push(image.write(&mut folder)?);
            made.seconds_of_files += began.elapsed().as_secs_f64();
            say((1, false));
            Ok(())
        })?;
        if outcome.stopped {
            return Err(DatasetError::Stopped(root.to_path_buf()));
        }
        let began = Instant::now();
        write(&mut folder, spec, &run, &outcome, encoded)?;
        made.seconds_of_files += began.elapsed().as_secs_f64();
        made.images += count;
        made.orbits += 1;
        made.bytes += folder.bytes;
        self.store.commit(folder)?;
        made.count(outcome.rejections);
        if stop.load(Ordering::Relaxed) {
            return Err(DatasetError::Stopped(root.to_path_buf()));
        }
        Ok(())
    }
}

/// Checks an orbit that was there before.
fn check_kept(store: &Store, place: &str) -> Result<(), DatasetError> {
    match fault_of_orbit(store.guarded(), place) {
        None => Ok(()),
        Some(fault) => {
            let first = format!("{fault}; remove {place}, and --resume makes this orbit again");
            Err(DatasetError::Damaged { folder: store.root().to_path_buf(), count: 1, first })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_crafts_have_one_orbit_at_once_and_no_thread_is_idle() {
        let processors = available_parallelism().map_or(1, usize::from);
        assert_eq!(orbits_at_once(SMALL, 100), processors.min(MOST));
        assert_eq!([orbits_at_once(SMALL + 1, 100), orbits_at_once(10, 1), orbits_at_once(10, 0)], [1; 3]);
    }
}
