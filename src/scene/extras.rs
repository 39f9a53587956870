//! Thermal values in the `extras` of a glTF material: flat `isotherm_` keys, as Blender writes custom properties.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use serde_json::Value;

use crate::files::Reach;
use crate::model::ModelMaterial;

use super::choice::choose;
use super::error::SceneError;
use super::keys::{EXTRAS, unknown_key};
use super::quantity::Quantity;
use super::value_source::ValueSource;

/// The values of one material. With a `group` (`back_`, `heating_`, `cooling_`) only the keys with that prefix.
pub(super) struct Extras<'a> {
    model: &'a Path,
    reach: &'a Reach,
    material: &'a str,
    values: &'a BTreeMap<String, Value>,
    group: String,
    /// Whether a number was too small for its unit and counts as 0.
    has_small: Rc<Cell<bool>>,
}

impl<'a> Extras<'a> {
    /// The `isotherm_` extras of a material of the file `model`, which may name the files of `reach`. `None` if it has none.
    pub(super) fn open(
        model: &'a Path,
        reach: &'a Reach,
        material: &'a ModelMaterial,
    ) -> Result<Option<Self>, SceneError> {
        let extras = Self {
            model,
            reach,
            material: &material.name,
            values: &material.extras,
            group: String::new(),
            has_small: Rc::default(),
        };
        match material.extras.keys().find(|key| !EXTRAS.contains(&key.as_str())) {
            Some(key) => Err(extras.error(key, unknown_key(key, EXTRAS))),
            None => Ok((!material.extras.is_empty()).then_some(extras)),
        }
    }

    pub(super) fn string(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        match self.get(key) {
            None => Ok(None),
            Some(Value::String(text)) if !text.trim().is_empty() => Ok(Some(text)),
            Some(value) => Err(self.error(key, format!("expected a string, found {value}"))),
        }
    }

    /// Whether a number was too small for its unit and counts as 0.
    pub(super) fn has_small(&self) -> bool {
        self.has_small.get()
    }

    fn get(&self, key: &str) -> Option<&'a Value> {
        self.values.get(&format!("{}{key}", self.group))
    }
}

impl ValueSource for Extras<'_> {
    fn number(&self, key: &str, quantity: Quantity) -> Result<Option<f64>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let number = value
            .as_f64()
            .ok_or_else(|| self.error(key, format!("expected {}, found {value}", quantity.expected())))?;
        let checked = quantity.check(number).map_err(|message| self.error(key, message))?;
        if checked != number {
            self.has_small.set(true);
        }
        Ok(Some(checked))
    }

    fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError> {
        let Some(word) = self.string(key)? else {
            return Ok(None);
        };
        choose(word, choices).map(Some).map_err(|message| self.error(key, message))
    }

    fn text(&self, key: &str) -> Result<Option<&str>, SceneError> {
        self.string(key)
    }

    fn list(&self, key: &str) -> Result<Option<Vec<f64>>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let numbers = value.as_array().and_then(|array| array.iter().map(Value::as_f64).collect());
        numbers.map(Some).ok_or_else(|| self.error(key, format!("expected an array of numbers, found {value}")))
    }

    fn path(&self, key: &str) -> Result<Option<PathBuf>, SceneError> {
        let folder = self.model.parent().unwrap_or(Path::new(""));
        let Some(path) = self.string(key)?.map(|path| folder.join(path)) else { return Ok(None) };
        let refused = |fault| self.error(key, format!("{}: cannot be read: {fault}", path.display()));
        self.reach.admit(&path).map_err(refused)?;
        Ok(Some(path))
    }

    fn group(&self, key: &str, _known: &[&str]) -> Result<Option<Self>, SceneError> {
        let group = format!("{}{key}_", self.group);
        let present = self.values.keys().any(|name| name.starts_with(&group));
        Ok(present.then(|| Self { group, has_small: Rc::clone(&self.has_small), ..*self }))
    }

    fn clash(&self, key: &str, _others: &[&str], message: String) -> SceneError {
        self.error(key, message)
    }

    fn missing(&self, key: &str, what: &str) -> SceneError {
        self.error(key, format!("is missing: {what}"))
    }

    fn error(&self, key: &str, message: String) -> SceneError {
        SceneError::Extras {
            model: self.model.to_path_buf(),
            material: self.material.to_string(),
            key: format!("{}{key}", self.group),
            message,
        }
    }
}
