//! Times at which the program waits for another one, which must read a pipe. A signal may end it there, because no step comes to an end.

use std::io::{self, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

static WAITS: Mutex<Waits> = Mutex::new(Waits { next: 0, begun: Vec::new() });

struct Waits {
    next: u64,
    begun: Vec<(u64, Instant)>,
}

fn waits() -> MutexGuard<'static, Waits> {
    WAITS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The program waits as long as this lives.
#[derive(Debug)]
pub(super) struct Waiting(u64);

impl Waiting {
    pub(crate) fn begin() -> Self {
        let mut waits = waits();
        let number = waits.next;
        waits.next += 1;
        waits.begun.push((number, Instant::now()));
        Self(number)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        waits().begun.retain(|(number, _)| *number != self.0);
    }
}

/// How long the program has waited by now. `None` while it does not wait.
pub(crate) fn waited() -> Option<Duration> {
    waits().begun.iter().map(|(_, begun)| begun.elapsed()).max()
}

/// A writer to another program.
pub(super) struct Patient<W>(pub(super) W);

impl<W: Write> Write for Patient<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let _waiting = Waiting::begin();
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        let _waiting = Waiting::begin();
        self.0.flush()
    }
}
