//! Text files: names, numbered lines for errors, and numbers.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::super::error::SceneError;
use super::super::file::read_text;

pub(in crate::scene) struct FileLine<'a> {
    pub(in crate::scene) path: &'a Path,
    pub(in crate::scene) line: usize,
}

impl FileLine<'_> {
    pub(in crate::scene) fn error(&self, key: &str, message: impl ToString) -> SceneError {
        SceneError::Value {
            path: self.path.to_path_buf(),
            line: self.line,
            key: key.to_owned(),
            message: message.to_string(),
        }
    }
}

/// File name without the folder.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Replaces the single carriage returns of old Macintosh files by line feeds.
pub(in crate::scene) fn one_line_end(text: &str) -> Cow<'_, str> {
    if text.contains('\r') && !text.contains('\n') { Cow::Owned(text.replace('\r', "\n")) } else { Cow::Borrowed(text) }
}

/// Reads a file that a scene names, and adds its path to `files`.
pub(in crate::scene) fn read_file(path: PathBuf, files: &mut Vec<PathBuf>) -> Result<String, SceneError> {
    let text = read_text(&path)?;
    if !files.contains(&path) {
        files.push(path);
    }
    Ok(text)
}

/// Parses a number. Fortran writes the exponent with a D.
pub(in crate::scene) fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let number = match text.find(['D', 'd']) {
        Some(at) if at > 0 => format!("{}E{}", &text[..at], &text[at + 1..]).parse::<f64>(),
        _ => text.parse::<f64>(),
    };
    number.ok().filter(|number| number.is_finite())
}
