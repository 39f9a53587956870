//! The interface of the places that state thermal values: TOML sections and glTF `extras`.

use std::path::PathBuf;

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;

/// A place that states values under the keys of a material.
pub(super) trait ValueSource: Sized {
    fn number(&self, key: &str, quantity: Quantity) -> Result<Option<f64>, SceneError>;
    fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError>;
    fn text(&self, key: &str) -> Result<Option<&str>, SceneError>;
    fn list(&self, key: &str) -> Result<Option<Vec<f64>>, SceneError>;
    /// A path, relative to the folder of the file.
    fn path(&self, key: &str) -> Result<Option<PathBuf>, SceneError>;
    /// The group of values under `key`: `back`, `heating` or `cooling`.
    fn group(&self, key: &str, known: &[&str]) -> Result<Option<Self>, SceneError>;
    fn error(&self, key: &str, message: String) -> SceneError;
    /// An error that depends on other keys too, as [`Section::clash`] names them.
    fn clash(&self, key: &str, others: &[&str], message: String) -> SceneError;
    fn missing(&self, key: &str, what: &str) -> SceneError;
}

impl ValueSource for Section<'_> {
    fn number(&self, key: &str, quantity: Quantity) -> Result<Option<f64>, SceneError> {
        self.number(key, quantity)
    }

    fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError> {
        self.choice(key, choices)
    }

    fn text(&self, key: &str) -> Result<Option<&str>, SceneError> {
        self.string(key)
    }

    fn list(&self, key: &str) -> Result<Option<Vec<f64>>, SceneError> {
        self.list(key, Quantity::any(""))
    }

    fn path(&self, key: &str) -> Result<Option<PathBuf>, SceneError> {
        self.path(key)
    }

    fn group(&self, key: &str, known: &[&str]) -> Result<Option<Self>, SceneError> {
        self.table(key, known)
    }

    fn error(&self, key: &str, message: String) -> SceneError {
        self.error(key, message)
    }

    fn clash(&self, key: &str, others: &[&str], message: String) -> SceneError {
        self.clash(key, others, message)
    }

    fn missing(&self, key: &str, what: &str) -> SceneError {
        self.missing(key, &[], what)
    }
}
