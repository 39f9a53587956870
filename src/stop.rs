//! Ends long work for which nobody waits any more.
//!
//! [`until`] does work until a flag is set. Long loops below look at the flag ([`Watch`]) and then unwind to `until`, so nobody can use a result that is
//! half made, and the functions between need not say that they may end. A step of a scene is never cut ([`whole`]), so that the state stays one between two
//! steps.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    /// The flag of the work that this thread does.
    static FLAG: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Work that was stopped before it was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

/// Does work until it is done or `flag` is set. What the work was changing may then be half changed.
///
/// # Errors
/// The flag was set before the work was done.
pub fn until<T>(flag: &Arc<AtomicBool>, work: impl FnOnce() -> T) -> Result<T, Stopped> {
    let _entered = Entered::new(Some(Arc::clone(flag)));
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| match payload.downcast::<Stopped>() {
        Ok(stopped) => *stopped,
        Err(panic) => resume_unwind(panic),
    })
}

/// Does work that goes to its end whether a flag is set or not.
pub(crate) fn whole<T>(work: impl FnOnce() -> T) -> T {
    let _entered = Entered::new(None);
    work()
}

/// Does two works at once, both for whoever waits for the work of this thread.
pub(crate) fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    let [of_a, of_b] = [0; 2].map(|_| FLAG.with_borrow(Clone::clone));
    rayon::join(
        move || {
            let _entered = Entered::new(of_a);
            a()
        },
        move || {
            let _entered = Entered::new(of_b);
            b()
        },
    )
}

/// The flag of a thread, until the flag from before comes back.
struct Entered(Option<Arc<AtomicBool>>);

impl Entered {
    fn new(flag: Option<Arc<AtomicBool>>) -> Self {
        Self(FLAG.replace(flag))
    }
}

impl Drop for Entered {
    fn drop(&mut self) {
        FLAG.set(self.0.take());
    }
}

/// The flag of the work under way, for its loops on any thread.
pub(crate) struct Watch(Option<Arc<AtomicBool>>);

impl Watch {
    /// The flag of the work that this thread does.
    pub(crate) fn begin() -> Self {
        Self(FLAG.with_borrow(Clone::clone))
    }

    /// Whether nobody waits for the work any more. A loop on many threads asks this, makes its other rounds empty, and looks after its end: a thread that
    /// unwinds would not end the rounds of the others.
    pub(crate) fn is_over(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Ends the work where its flag is set. Call it in each round of a long loop, and hold no lock meanwhile.
    pub(crate) fn look(&self) {
        if self.is_over() {
            // No message of a panic is printed.
            resume_unwind(Box::new(Stopped));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use rayon::prelude::*;

    use super::*;

    /// Sets the flag in a round of a loop. Returns whether the loop went to its end.
    fn cut(flag: &Arc<AtomicBool>, by: impl Fn(&dyn Fn(usize))) -> Result<(), Stopped> {
        until(flag, || {
            let watch = Watch::begin();
            by(&|round| {
                flag.fetch_or(round == 7, Ordering::Relaxed);
                watch.look();
            });
        })
    }

    #[test]
    fn a_loop_ends_once_its_flag_is_set_and_no_other_does() {
        let flag = Arc::default();
        assert_eq!(cut(&flag, |round| (0..7).for_each(round)), Ok(()));
        assert_eq!(cut(&flag, |round| (0..usize::MAX).for_each(round)), Err(Stopped));
        // The flag is still set, but nobody works for it here.
        Watch::begin().look();
        assert_eq!(until(&flag, || whole(|| Watch::begin().look())), Ok(()));
        assert_eq!(until(&flag, || until(&Arc::default(), || Watch::begin().look())), Ok(Ok(())));
        assert_eq!(until(&flag, || Watch::begin().look()), Err(Stopped));
    }

    #[test]
    fn a_loop_on_many_threads_ends_too() {
        let flag = Arc::default();
        let stopped = until(&flag, || {
            let (watch, rounds) = (Watch::begin(), AtomicUsize::new(0));
            // Each round would go on for ever.
            (0..10_000).into_par_iter().for_each(|round| {
                while !watch.is_over() {
                    flag.fetch_or(rounds.fetch_add(1, Ordering::Relaxed) + round > 20_000, Ordering::Relaxed);
                }
            });
            watch.look();
        });
        assert_eq!(stopped, Err(Stopped));
    }

    #[test]
    fn a_panic_goes_on_as_one() {
        let panicked = catch_unwind(|| until(&Arc::default(), || panic!("on purpose")));
        assert!(panicked.is_err_and(|panic| panic.downcast_ref::<&str>() == Some(&"on purpose")));
    }
}
