//! A value that one thread at a time works with, and which thread that is.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

/// Pauses between two tries.
const SHORTEST: Duration = Duration::from_micros(50);
const LONGEST: Duration = Duration::from_millis(5);
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// A value behind a lock.
pub struct Held<T> {
    value: Mutex<T>,
    holder: Mutex<Option<ThreadId>>,
}

/// The value in the hands of a thread.
pub struct Taken<'a, T> {
    value: MutexGuard<'a, T>,
    holder: &'a Mutex<Option<ThreadId>>,
}

fn set(holder: &Mutex<Option<ThreadId>>, thread: Option<ThreadId>) {
    *holder.lock().unwrap_or_else(PoisonError::into_inner) = thread;
}

impl<T> Held<T> {
    /// A value that nobody holds.
    pub fn new(value: T) -> Self {
        Self { value: Mutex::new(value), holder: Mutex::new(None) }
    }

    /// Waits until no other thread holds it. A thread that holds it already would wait for ever. `look` is called about ten times a second.
    ///
    /// # Errors
    /// An error of `look` ends the wait.
    pub fn take<E>(&self, mut look: impl FnMut() -> Result<(), E>) -> Result<Taken<'_, T>, E> {
        let mut looked = Instant::now();
        let mut pause = SHORTEST;
        let value = loop {
            match self.value.try_lock() {
                Ok(value) => break value,
                Err(TryLockError::Poisoned(poisoned)) => break poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => {}
            }
            if looked.elapsed() >= LOOK_EVERY {
                looked = Instant::now();
                look()?;
            }
            thread::sleep(pause);
            pause = (pause * 2).min(LONGEST);
        };
        set(&self.holder, Some(thread::current().id()));
        Ok(Taken { value, holder: &self.holder })
    }

    /// Takes the value out of the world without an end of it: nobody waits for its threads.
    pub fn forget(&mut self)
    where
        T: Default,
    {
        let value = self.value.get_mut().unwrap_or_else(PoisonError::into_inner);
        std::mem::forget(std::mem::take(value));
    }

    /// Whether this thread holds it.
    pub fn is_held_here(&self) -> bool {
        *self.holder.lock().unwrap_or_else(PoisonError::into_inner) == Some(thread::current().id())
    }
}

impl<T> Drop for Taken<'_, T> {
    fn drop(&mut self) {
        set(self.holder, None);
    }
}

impl<T> Deref for Taken<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Taken<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_ends_with_an_error_of_its_look_and_with_the_other_thread() {
        let held = Held::new(1);
        let mut taken = held.take(|| Ok::<_, ()>(())).expect("free");
        thread::scope(|scope| {
            assert_eq!(scope.spawn(|| held.take(|| Err("Ctrl-C")).err()).join().expect("no panic"), Some("Ctrl-C"));
            let patient = scope.spawn(|| held.take(|| Ok::<_, ()>(())).map(|taken| *taken));
            *taken = 2;
            drop(taken);
            assert_eq!(patient.join().expect("no panic"), Ok(2));
        });
    }
}
