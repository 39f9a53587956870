//! A TOML file with its text, so that errors can state a line.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::DeTable;

use super::error::SceneError;
use super::faults::Faults;
use crate::files::{self, FileFault, Reach};
use crate::text::{plain, plain_lines};

#[derive(Debug)]
pub(super) struct SourceFile<'a> {
    path: &'a Path,
    text: &'a str,
    reach: &'a Reach,
    pub(super) faults: &'a Faults,
}

impl<'a> SourceFile<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str, reach: &'a Reach, faults: &'a Faults) -> Self {
        Self { path, text, reach, faults }
    }

    pub(super) fn path(&self) -> &'a Path {
        self.path
    }

    /// The root table, with the byte range of every key and value.
    pub(super) fn parse(&self) -> Result<Spanned<DeTable<'a>>, SceneError> {
        DeTable::parse(self.text).map_err(|error| SceneError::Syntax {
            path: self.path.to_path_buf(),
            line: self.line(&error.span().unwrap_or(0..0)),
            message: error.message().to_string(),
        })
    }

    /// Line number of the start of a byte range, from 1.
    pub(super) fn line(&self, span: &Range<usize>) -> usize {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }

    pub(super) fn value_error(&self, span: &Range<usize>, key: String, message: String) -> SceneError {
        let (key, message) = (plain(&key).into_owned(), plain_lines(&message).into_owned());
        SceneError::Value { path: self.path.to_path_buf(), line: self.line(span), key, message }
    }

    /// Resolves a path in this file to a regular file that it may name. A relative path starts at the file's folder.
    pub(super) fn resolve(&self, path: &str) -> Result<PathBuf, SceneError> {
        let path = self.path.parent().unwrap_or(Path::new("")).join(path);
        self.reach.admit(&path).map(|()| path.clone()).map_err(|fault| unreadable(&path, &fault))
    }
}

pub(super) fn read_text(path: &Path) -> Result<String, SceneError> {
    files::read_text(path).map_err(|fault| unreadable(path, &fault))
}

pub(super) fn unreadable(path: &Path, fault: &FileFault) -> SceneError {
    SceneError::Unreadable { path: path.to_path_buf(), reason: fault.to_string() }
}
