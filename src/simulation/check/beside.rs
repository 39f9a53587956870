//! A value that a thread of its own works on while others go on.

use std::panic::resume_unwind;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use crate::trace::{Trace, Track, span};

/// A value, and the thread that works on it.
#[derive(Debug)]
pub(super) struct Beside<T> {
    value: Arc<Mutex<T>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Beside<T> {
    pub(super) fn new(value: T) -> Self {
        Self { value: Arc::new(Mutex::new(value)), thread: None }
    }

    /// The value, once all work on it is done.
    pub(super) fn here(&mut self) -> MutexGuard<'_, T> {
        if let Some(thread) = self.thread.take() {
            let _waits = span("waiting for the check");
            thread.join().unwrap_or_else(|panic| resume_unwind(panic));
        }
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets a thread work on the value, after the work before. Where the system has no thread left, the work is done here.
    pub(super) fn work(&mut self, work: impl FnOnce(&mut T) + Send + 'static) {
        drop(self.here());
        let (value, trace) = (Arc::clone(&self.value), Trace::here());
        let work = Arc::new(Mutex::new(Some(work)));
        let begin = {
            let (value, work) = (Arc::clone(&value), Arc::clone(&work));
            move || {
                let _checks = trace.enter(Track::Check);
                do_work(&value, &work);
            }
        };
        match Builder::new().name("check".to_owned()).spawn(begin) {
            Ok(thread) => self.thread = Some(thread),
            Err(_) => do_work(&value, &work),
        }
    }
}

fn do_work<T>(value: &Mutex<T>, work: &Mutex<Option<impl FnOnce(&mut T)>>) {
    let work = work.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(work) = work {
        work(&mut value.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl<T> Drop for Beside<T> {
    fn drop(&mut self) {
        // A panic of the thread has nobody left to go to.
        drop(self.thread.take().map(JoinHandle::join));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn works_follow_each_other_and_a_panic_arrives() {
        let mut list = Beside::new(Vec::new());
        for number in 0..9 {
            list.work(move |list| list.push(number));
        }
        assert_eq!(*list.here(), (0..9).collect::<Vec<_>>());
        list.work(|_| resume_unwind(Box::new("on purpose")));
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| drop(list.here())));
        assert!(panicked.is_err_and(|panic| panic.downcast_ref::<&str>() == Some(&"on purpose")));
    }
}
