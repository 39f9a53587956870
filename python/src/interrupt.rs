//! Long work that Ctrl-C ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use isotherm::internals::{Stopped, until};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// Time between two looks whether Ctrl-C was pressed.
pub const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Does work on a thread of its own, while this thread, which has released the interpreter, looks for signals. The work gets the flag that a signal sets.
///
/// # Errors
/// The error of a signal.
pub fn interruptible<T: Send>(work: impl FnOnce(&Arc<AtomicBool>) -> T + Send) -> PyResult<T> {
    let stop = Arc::default();
    let (sender, done) = channel();
    let mut signal = None;
    let worked = std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let worked = until(&stop, || work(&stop));
            // The other end waits for as long as this thread lives.
            let _ = sender.send(());
            worked
        });
        while done.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) && !worker.is_finished() {
            if signal.is_none() {
                signal = look_for_signals().err();
                stop.store(signal.is_some(), Ordering::Relaxed);
            }
        }
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    match (signal, worked) {
        (Some(signal), _) => Err(signal),
        (None, Ok(worked)) => Ok(worked),
        (None, Err(Stopped)) => Err(PyKeyboardInterrupt::new_err(())),
    }
}

/// The error of a signal that Python has not handled yet, such as that of Ctrl-C.
pub fn look_for_signals() -> PyResult<()> {
    // A path to the method alone would be of one lifetime.
    #[allow(clippy::redundant_closure_for_method_calls)]
    Python::attach(|py| py.check_signals())
}
