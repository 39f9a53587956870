//! Long work that Ctrl-C ends.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use isotherm::package::{Stopped, until};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::error::faulty;

/// Time between two looks whether Ctrl-C was pressed.
pub const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Does work on a thread of its own, while this thread, which has released the interpreter, looks for signals. The work gets the flag that a signal sets.
///
/// # Errors
/// The error of a signal, or of a fault of this program.
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
        worker.join()
    });
    match (signal, worked) {
        (Some(signal), _) => Err(signal),
        (None, Ok(Ok(worked))) => Ok(worked),
        (None, Ok(Err(Stopped))) => Err(PyKeyboardInterrupt::new_err(())),
        (None, Err(panic)) => Err(fault(&*panic)),
    }
}

/// Does work on this thread. A panic of it becomes an error.
///
/// # Errors
/// The error of the work, or a fault of this program.
pub fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(fault(&*panic)))
}

fn fault(panic: &(dyn Any + Send)) -> PyErr {
    Python::try_attach(|py| faulty(py, panic)).unwrap_or_else(|| PyKeyboardInterrupt::new_err(()))
}

/// The error of a signal that Python has not handled yet, such as that of Ctrl-C.
pub fn look_for_signals() -> PyResult<()> {
    // A path to the method alone would be of one lifetime. An interpreter at its exit takes no thread, and work for it ends.
    #[allow(clippy::redundant_closure_for_method_calls)]
    let looked = Python::try_attach(|py| py.check_signals());
    looked.unwrap_or_else(|| Err(PyKeyboardInterrupt::new_err(())))
}
