//! Typed access to one section of a TOML file. Every error names file, line and key.

use std::fmt::Display;
use std::ops::Range;
use std::path::PathBuf;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::SceneError;
use super::file::SourceFile;
use super::keys::{suggestion, unknown_key};
use super::quantity::Quantity;
use crate::text::plain;

/// A table of the file. All its keys are known.
#[derive(Debug)]
pub(super) struct Section<'a> {
    file: &'a SourceFile<'a>,
    /// Prefix of keys in messages. It is empty for the root.
    name: String,
    table: &'a DeTable<'a>,
    /// Position of the section. Errors about missing keys point to it.
    span: Range<usize>,
}

impl<'a> Section<'a> {
    /// The root table.
    pub(super) fn root(
        file: &'a SourceFile<'a>,
        table: &'a Spanned<DeTable<'a>>,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        Self::open(file, String::new(), table.get_ref(), 0..0, known)
    }

    fn open(
        file: &'a SourceFile<'a>,
        name: String,
        table: &'a DeTable<'a>,
        span: Range<usize>,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        let section = Self { file, name, table, span };
        let unknown = section.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        // The table is sorted by name, but the message must name the first key in the file.
        match unknown.min_by_key(|key| key.span().start) {
            Some(key) => {
                let word = key.get_ref().as_ref();
                Err(file.value_error(&key.span(), section.key_name(word), unknown_key(word, known)))
            }
            None => Ok(section),
        }
    }

    pub(super) fn line(&self) -> usize {
        self.file.line(&self.span)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    fn key_name(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_string() } else { format!("{}.{key}", self.name) }
    }

    fn get(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.table.get(key)
    }

    /// An error about a key. It points to the value, or to the header if the key is missing.
    pub(super) fn error(&self, key: &str, message: impl Display) -> SceneError {
        let span = self.get(key).map_or_else(|| self.span.clone(), Spanned::span);
        self.file.value_error(&span, self.key_name(key), message.to_string())
    }

    /// The value of a mandatory key. `what` describes it in the message.
    pub(super) fn required<T>(&self, key: &str, value: Option<T>, what: &str) -> Result<T, SceneError> {
        value.ok_or_else(|| self.error(key, format!("is missing: {what}")))
    }

    /// Refuses two keys that exclude each other.
    pub(super) fn exclusive(&self, key: &str, other: &str) -> Result<(), SceneError> {
        if self.has(key) && self.has(other) {
            return Err(self.error(other, format!("cannot be combined with '{key}': state one of the two")));
        }
        Ok(())
    }

    /// A number in its range, which may be written as an integer.
    pub(super) fn number(&self, key: &str, quantity: Quantity) -> Result<Option<f64>, SceneError> {
        self.get(key).map(|value| self.number_of(key, value, quantity)).transpose()
    }

    fn number_of(&self, key: &str, value: &Spanned<DeValue>, quantity: Quantity) -> Result<f64, SceneError> {
        let number = as_number(value.get_ref()).ok_or_else(|| self.type_error(key, value, &quantity.expected()))?;
        quantity.check(number).map_err(|message| self.file.value_error(&value.span(), self.key_name(key), message))
    }

    pub(super) fn whole(&self, key: &str, range: std::ops::RangeInclusive<u32>) -> Result<Option<u32>, SceneError> {
        self.get(key).map(|value| self.whole_of(key, value, &range)).transpose()
    }

    fn whole_of(
        &self,
        key: &str,
        value: &Spanned<DeValue>,
        range: &std::ops::RangeInclusive<u32>,
    ) -> Result<u32, SceneError> {
        let DeValue::Integer(integer) = value.get_ref() else {
            return Err(self.type_error(key, value, "a whole number"));
        };
        i128::from_str_radix(integer.as_str(), integer.radix())
            .ok()
            .and_then(|number| u32::try_from(number).ok())
            .filter(|number| range.contains(number))
            .ok_or_else(|| {
                let message =
                    format!("must be a whole number from {} to {}, found {integer}", range.start(), range.end());
                self.file.value_error(&value.span(), self.key_name(key), message)
            })
    }

    pub(super) fn wholes(
        &self,
        key: &str,
        range: std::ops::RangeInclusive<u32>,
    ) -> Result<Option<Vec<u32>>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.type_error(key, value, "an array of whole numbers"));
        };
        array.iter().map(|item| self.whole_of(key, item, &range)).collect::<Result<_, _>>().map(Some)
    }

    /// An array of numbers of any length, each in its range.
    pub(super) fn list(&self, key: &str, quantity: Quantity) -> Result<Option<Vec<f64>>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.type_error(key, value, "an array of numbers"));
        };
        array.iter().map(|item| self.number_of(key, item, quantity)).collect::<Result<_, _>>().map(Some)
    }

    pub(super) fn numbers<const N: usize>(
        &self,
        key: &str,
        quantity: Quantity,
    ) -> Result<Option<[f64; N]>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let expected = format!("an array of {N} numbers");
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.type_error(key, value, &expected));
        };
        if array.len() != N {
            return Err(self.error(key, format!("expected {expected}, found {}", array.len())));
        }
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(array.iter()) {
            *number = self.number_of(key, item, quantity)?;
        }
        Ok(Some(numbers))
    }

    pub(super) fn boolean(&self, key: &str) -> Result<Option<bool>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        value.get_ref().as_bool().map(Some).ok_or_else(|| self.type_error(key, value, "true or false"))
    }

    /// The file that `key` names. It is a regular file that this file may name.
    pub(super) fn path(&self, key: &str) -> Result<Option<PathBuf>, SceneError> {
        let Some(name) = self.string(key)? else { return Ok(None) };
        self.file.resolve(name).map(Some).map_err(|error| self.error(key, error))
    }

    pub(super) fn string(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        self.get(key).map(|value| self.string_of(key, value, "a string")).transpose()
    }

    /// A string that names something. Characters that must not be shown are escaped, as in the names of a model.
    pub(super) fn name(&self, key: &str) -> Result<Option<String>, SceneError> {
        Ok(self.string(key)?.map(|name| plain(name).into_owned()))
    }

    fn string_of(&self, key: &str, value: &'a Spanned<DeValue<'a>>, expected: &str) -> Result<&'a str, SceneError> {
        match value.get_ref() {
            DeValue::String(text) if !text.trim().is_empty() => Ok(text.as_ref()),
            DeValue::String(_) => {
                Err(self.file.value_error(&value.span(), self.key_name(key), "must not be empty".to_string()))
            }
            _ => Err(self.type_error(key, value, expected)),
        }
    }

    /// A name, or a non-empty array of names, as [`Section::name`] reads them.
    pub(super) fn strings(&self, key: &str) -> Result<Option<Vec<String>>, SceneError> {
        let expected = "a string or an array of strings";
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let items = match value.get_ref() {
            DeValue::Array(array) if array.is_empty() => {
                return Err(self.error(key, "must not be empty"));
            }
            DeValue::Array(array) => array.iter().collect(),
            _ => vec![value],
        };
        items
            .into_iter()
            .map(|item| self.string_of(key, item, expected).map(|name| plain(name).into_owned()))
            .collect::<Result<_, _>>()
            .map(Some)
    }

    /// One of the words of `choices`.
    pub(super) fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError> {
        let Some(word) = self.string(key)? else {
            return Ok(None);
        };
        choose(word, choices).map(Some).map_err(|message| self.error(key, message))
    }

    pub(super) fn is_array(&self, key: &str) -> bool {
        self.get(key).is_some_and(|value| value.get_ref().is_array())
    }

    pub(super) fn is_table(&self, key: &str) -> bool {
        self.get(key).is_some_and(|value| value.get_ref().is_table())
    }

    /// A mandatory table.
    pub(super) fn required_table(&self, name: &str, known: &[&str]) -> Result<Self, SceneError> {
        self.required(name, self.table(name, known)?, &format!("a scene needs a section [{name}]"))
    }

    /// A table: `[key]` in the root, `key = { .. }` elsewhere.
    pub(super) fn table(&self, key: &str, known: &[&str]) -> Result<Option<Section<'a>>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let DeValue::Table(table) = value.get_ref() else {
            let shape = if self.name.is_empty() { format!("one section [{key}]") } else { format!("{key} = {{ .. }}") };
            return Err(self.type_error(key, value, &shape));
        };
        Self::open(self.file, self.key_name(key), table, value.span(), known).map(Some)
    }

    /// All tables of an array of tables `[[key]]`.
    pub(super) fn tables(&self, key: &str, known: &[&str]) -> Result<Vec<Section<'a>>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(Vec::new());
        };
        let shape = format!("sections [[{key}]] in double brackets");
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.type_error(key, value, &shape));
        };
        let open = |item: &'a Spanned<DeValue<'a>>| match item.get_ref() {
            DeValue::Table(table) => Self::open(self.file, self.key_name(key), table, item.span(), known),
            _ => Err(self.type_error(key, item, &shape)),
        };
        array.iter().map(open).collect()
    }

    fn type_error(&self, key: &str, value: &Spanned<DeValue>, expected: &str) -> SceneError {
        let message = format!("expected {expected}, found {}", describe(value.get_ref()));
        self.file.value_error(&value.span(), self.key_name(key), message)
    }
}

/// The value of `word` in `choices`, or a message with the choices and the most similar one.
pub(super) fn choose<T: Copy>(word: &str, choices: &[(&str, T)]) -> Result<T, String> {
    let known = choices.iter().map(|(name, _)| *name);
    choices.iter().find(|(name, _)| *name == word).map(|(_, value)| *value).ok_or_else(|| {
        format!("'{}' is not one of {}{}", plain(word), list(known.clone()), nearest_suffix(word, known))
    })
}

fn nearest_suffix<'k>(word: &str, known: impl IntoIterator<Item = &'k str> + Clone) -> String {
    let text = suggestion(word, known);
    // The message already lists the known words.
    if text.starts_with("; did") { text } else { String::new() }
}

pub(super) fn list<'k>(words: impl IntoIterator<Item = &'k str>) -> String {
    words.into_iter().map(|word| format!("'{word}'")).collect::<Vec<_>>().join(", ")
}

fn as_number(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            i128::from_str_radix(integer.as_str(), integer.radix()).ok().map(|number| number as f64)
        }
        _ => None,
    }
}

fn describe(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("the string \"{}\"", plain(text)),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(boolean) => boolean.to_string(),
        DeValue::Datetime(_) => "a date".to_string(),
        DeValue::Array(_) => "an array".to_string(),
        DeValue::Table(_) => "a table".to_string(),
    }
}
