//! Works on two threads, whose results are taken one after the other.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use crate::converge::RunNews;

/// A run of a large craft leaves a part of its processors idle, which a second run takes.
const THREADS: usize = 2;

enum Told<T, E> {
    News(RunNews),
    Ended(usize, Result<T, E>),
}

/// Does works 0 to `count` - 1. `take` gets their results in the order of their numbers, and `news` what they say, both on this thread.
///
/// # Errors
/// The first error of a work. No other work begins after it.
pub(super) fn do_side_by_side<T: Send, E: Send>(
    count: usize,
    news: &dyn Fn(RunNews),
    work: impl Fn(usize, &dyn Fn(RunNews)) -> Result<T, E> + Sync,
    mut take: impl FnMut(usize, T),
) -> Result<(), E> {
    let (next, mut all) = (AtomicUsize::new(0), Ok(()));
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..THREADS.min(count) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            // The receiver lives until all senders are gone.
            scope.spawn(move || {
                let tell = |told| sender.send(told).unwrap_or_default();
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= count {
                        break;
                    }
                    let ended = work(number, &|said| tell(Told::News(said)));
                    if ended.is_err() {
                        next.store(count, Ordering::Relaxed);
                    }
                    tell(Told::Ended(number, ended));
                }
            });
        }
        drop(sender);
        let (mut waiting, mut taken) = (BTreeMap::new(), 0);
        for told in receiver {
            match told {
                Told::News(said) => news(said),
                Told::Ended(number, Ok(result)) => {
                    waiting.insert(number, result);
                    while let Some(result) = waiting.remove(&taken) {
                        take(taken, result);
                        taken += 1;
                    }
                }
                Told::Ended(_, Err(error)) if all.is_ok() => all = Err(error),
                Told::Ended(..) => {}
            }
        }
    });
    all
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::time::Duration;

    use super::*;

    #[test]
    fn results_come_in_order_and_an_error_ends_the_works() {
        let (said, taken) = (RefCell::new(0), RefCell::new(Vec::new()));
        let news = |_| *said.borrow_mut() += 1;
        let work = |bad: usize| {
            move |number: usize, tell: &dyn Fn(RunNews)| {
                tell(RunNews::Stepped);
                // The first works end last.
                thread::sleep(Duration::from_millis(if number == 0 { 20 } else { 0 }));
                if number == bad { Err(number) } else { Ok(number * number) }
            }
        };
        let take = |number: usize, result: usize| taken.borrow_mut().push((number, result));
        assert_eq!(do_side_by_side(5, &news, work(9), take), Ok(()));
        assert_eq!(*taken.borrow(), [(0, 0), (1, 1), (2, 4), (3, 9), (4, 16)]);
        assert_eq!(*said.borrow(), 5);
        assert_eq!(do_side_by_side(500, &news, work(3), |_, _| ()), Err(3));
        assert!(*said.borrow() < 20, "{said:?}");
        assert_eq!(do_side_by_side(0, &news, work(9), |_, _| ()), Ok(()));
    }
}
