//! Unfinished files: a signal that ends the process at once removes them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file that is unfinished as long as this lives.
#[derive(Debug)]
pub(super) struct Unfinished(PathBuf);

impl Unfinished {
    /// Notes the path of an unfinished file.
    pub(crate) fn new(path: &Path) -> Self {
        unfinished().push(path.to_path_buf());
        Self(path.to_path_buf())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

/// Removes all unfinished files of this process. Call it right before the process ends.
pub(crate) fn remove_unfinished() {
    for path in unfinished().drain(..) {
        // The file may have been renamed in this moment, and then it is finished.
        let _ = fs::remove_file(path);
    }
}
