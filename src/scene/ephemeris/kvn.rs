//! The lines of a CCSDS message in keyword-value notation. OEM and AEM share them.

use std::path::Path;

use super::super::error::SceneError;
use super::text::FileLine;

#[derive(Debug, Clone, PartialEq)]
pub(super) enum KvnLine<'a> {
    /// A keyword alone, like `META_START`.
    Mark(&'a str),
    /// `KEY = value`.
    Pair(&'a str, &'a str),
    /// Anything else is a line of data.
    Data(&'a str),
}

/// The lines with their numbers, without comments and empty lines.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, KvnLine<'_>)> {
    text.lines().enumerate().filter_map(said).map(|(number, line)| {
        let line = match line.split_once('=') {
            Some((key, value)) => KvnLine::Pair(key.trim(), value.trim()),
            None if line.ends_with("_START") || line.ends_with("_STOP") => KvnLine::Mark(line),
            None => KvnLine::Data(line),
        };
        (number, line)
    })
}

/// A line that is neither empty nor a comment, with its number from 1.
fn said((index, line): (usize, &str)) -> Option<(usize, &str)> {
    let line = line.trim_start_matches('\u{feff}').trim();
    let comment = line == "COMMENT" || line.starts_with("COMMENT ") || line.starts_with("COMMENT\t");
    (!line.is_empty() && !comment).then_some((index + 1, line))
}

/// Whether a text is a message. The check ignores the first line.
pub(super) fn is_message(text: &str) -> bool {
    let known = |line: KvnLine| match line {
        KvnLine::Pair(key, _) => {
            key.starts_with("CCSDS_") || matches!(key, "CREATION_DATE" | "ORIGINATOR" | "OBJECT_NAME")
        }
        KvnLine::Mark(mark) => mark == "META_START",
        KvnLine::Data(_) => false,
    };
    lines(text).next().is_some_and(|(_, line)| known(line))
}

/// Checks the first line of a message: `CCSDS_OEM_VERS = 2.0`.
pub(super) fn check_version(path: &Path, text: &str, key: &str) -> Result<(), SceneError> {
    match lines(text).next() {
        Some((_, KvnLine::Pair(first, _))) if first == key => Ok(()),
        Some((line, _)) => {
            Err(FileLine { path, line }.error(key, "must be the first line of the message, apart from comments"))
        }
        None => Err(FileLine { path, line: 1 }.error(key, "is missing: the file is empty")),
    }
}
