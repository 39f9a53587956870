//! Messages of sessions for people, and the log of every request.

use std::fs::{File, OpenOptions};
use std::io::{Write, stderr};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use super::error::ServerError;
use crate::output::console::say;
use crate::text::plain;

/// Most messages of all sessions. Whoever floods the server must not flood its terminal.
const MOST_MESSAGES: u32 = 1000;
/// Most characters of a message or of a line of the log.
const LONGEST: usize = 400;

/// Where a log goes.
enum LogTarget {
    Nowhere,
    StandardError,
    File(Mutex<File>),
}

/// The log of a server.
pub struct Log {
    place: LogTarget,
    told: AtomicU32,
}

impl Log {
    /// A log at the end of a file, on standard error (`-`), or none.
    ///
    /// # Errors
    /// The file can not be opened.
    pub fn open(path: Option<&Path>) -> Result<Self, ServerError> {
        let place = match path {
            None => LogTarget::Nowhere,
            Some(path) if path == Path::new("-") => LogTarget::StandardError,
            Some(path) => {
                let opened = OpenOptions::new().append(true).create(true).open(path);
                LogTarget::File(Mutex::new(opened.map_err(|error| ServerError::Log(path.to_path_buf(), error))?))
            }
        };
        Ok(Self { place, told: AtomicU32::new(0) })
    }

    /// Writes a line for a request. A disk that is full does not end the server.
    pub(crate) fn request(&self, client: &str, request: &str) {
        let line = format!("{client} {}\n", short(request));
        match &self.place {
            LogTarget::Nowhere => {}
            LogTarget::StandardError => drop(stderr().lock().write_all(line.as_bytes())),
            LogTarget::File(file) => {
                drop(file.lock().unwrap_or_else(PoisonError::into_inner).write_all(line.as_bytes()));
            }
        }
    }

    /// Tells people, and the log.
    pub(crate) fn tell(&self, client: &str, message: &str) {
        self.request(client, &format!("! {message}"));
        match self.told.fetch_add(1, Ordering::Relaxed) {
            told if told < MOST_MESSAGES => say!("{client}: {}", short(message)),
            MOST_MESSAGES => say!("no more messages of sessions are shown; --log has them all"),
            // The counter stays beyond the limit.
            _ => self.told.store(MOST_MESSAGES + 1, Ordering::Relaxed),
        }
    }
}

/// The beginning of a text on one line.
fn short(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        None => plain(text).into_owned(),
        Some((end, _)) => format!("{} ...", plain(&text[..end])),
    }
}
