//! The arguments of the process as text. They need not be UTF-8.

use crate::text::is_hidden;

/// The command line, with the program's name.
pub(super) fn command_line() -> String {
    std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// Whether the command line holds characters that must not be shown as they are.
pub(super) fn hold_hidden() -> bool {
    command_line().contains(is_hidden)
}
