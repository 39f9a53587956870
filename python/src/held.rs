//! A value that one thread at a time works with, and which thread that is.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{self, ThreadId};

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

    /// Waits until no other thread holds it. A thread that holds it already would wait for ever.
    pub fn take(&self) -> Taken<'_, T> {
        let value = self.value.lock().unwrap_or_else(PoisonError::into_inner);
        set(&self.holder, Some(thread::current().id()));
        Taken { value, holder: &self.holder }
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
