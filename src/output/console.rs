//! Standard output and standard error: messages for people, and the bytes that a command was asked for.
//!
//! A message never ends the program. If nobody reads it, the work goes on. The first failure of standard output is kept for [`finish`].

use std::fmt::Arguments;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::waiting::Patient;
use crate::text::{plain_lines, unsigned_zeros};

/// Why the first line was lost that standard output should have taken.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Whether standard output carries a file. Messages then go to standard error.
static CARRIES_A_FILE: AtomicBool = AtomicBool::new(false);

/// Writes a message to standard error, as [`write_message`] does.
macro_rules! say {
    ($($message:tt)*) => { $crate::output::console::write_message(format_args!($($message)*)) };
}

/// Writes lines of a command's answer to standard output, as [`write_answer`] does.
macro_rules! answer {
    ($($line:tt)*) => { $crate::output::console::write_answer(format_args!($($line)*)) };
}

pub(crate) use {answer, say};

/// Writes a message to standard error. Hidden characters are escaped, and every further line is indented, so that no name in it looks like a message.
/// A failure is ignored: there is no place left to tell it.
pub(crate) fn write_message(message: Arguments) {
    let text = shown(message);
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// Writes lines of the answer to standard output, or to standard error while standard output carries a file. Hidden characters are escaped. The first
/// failure is kept for [`finish`].
pub(crate) fn write_answer(lines: Arguments) {
    let text = format!("{}\n", unsigned_zeros(&plain_lines(&lines.to_string())));
    if CARRIES_A_FILE.load(Ordering::Relaxed) {
        let _ = io::stderr().lock().write_all(text.as_bytes());
    } else if let Err(error) = Patient(io::stdout().lock()).write_all(text.as_bytes()) {
        lose(error);
    }
}

/// Keeps a failure of standard output for [`finish`], if it is the first.
pub(crate) fn lose(error: io::Error) {
    lost().get_or_insert(error);
}

/// Flushes standard output, and says whether anything was lost.
///
/// # Errors
/// The first failure of standard output.
pub(crate) fn finish() -> io::Result<()> {
    let flushed = io::stdout().lock().flush();
    lost().take().map_or(flushed, Err)
}

/// States that standard output carries a file. Answers go to standard error from here on.
pub(crate) fn claim() {
    CARRIES_A_FILE.store(true, Ordering::Relaxed);
}

/// Standard output for the bytes of a file.
pub(crate) fn standard_output() -> impl Write {
    io::stdout().lock()
}

/// Whether a person sees standard output directly.
pub(crate) fn is_seen() -> bool {
    io::stdout().is_terminal()
}

/// Whether a person sees the messages directly.
pub(crate) fn messages_are_seen() -> bool {
    io::stderr().is_terminal()
}

fn lost() -> MutexGuard<'static, Option<io::Error>> {
    LOST.lock().unwrap_or_else(PoisonError::into_inner)
}

fn shown(message: Arguments) -> String {
    let message = message.to_string();
    format!("{}\n", unsigned_zeros(&plain_lines(&message)).replace('\n', "\n  "))
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn no_name_looks_like_a_message() {
        let name = "a\x1b[2K\r\nerror: all is well\u{202e}";
        assert_eq!(
            shown(format_args!("warning: '{name}'")),
            "warning: 'a\\u{1b}[2K\\r\n  error: all is well\\u{202e}'\n"
        );
    }
}
