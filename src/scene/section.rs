//! Typed access to one section of a TOML file. Every error names file, line and key.

use std::fmt::Display;
use std::ops::Range;
use std::path::PathBuf;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::choice::choose;
use super::error::SceneError;
use super::faults::{FaultKind, Instead, KeyPlace};
use super::file::SourceFile;
use super::keys::unknown_key;
use super::quantity::Quantity;
use super::valid_scene;
use crate::misspelt::nearest;
use crate::text::plain;

/// A table of the file. All its keys are known.
#[derive(Debug, Clone)]
pub(super) struct Section<'a> {
    file: &'a SourceFile<'a>,
    /// Prefix of keys in messages, empty for the root.
    name: String,
    table: &'a DeTable<'a>,
    /// Position of the section. Errors about missing keys point to it.
    span: Range<usize>,
    one_of_several: bool,
}

impl<'a> Section<'a> {
    pub(super) fn root(
        file: &'a SourceFile<'a>,
        table: &'a Spanned<DeTable<'a>>,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        let section = Self { file, name: String::new(), table: table.get_ref(), span: 0..0, one_of_several: false };
        section.open(known)
    }

    /// The section, if all its keys are known.
    fn open(self, known: &[&str]) -> Result<Self, SceneError> {
        let word = |key: &&Spanned<_>| -> String { AsRef::<str>::as_ref(key.get_ref()).to_owned() };
        let unknown = self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        let unknown = unknown.filter(|key| self.instead(&word(key)).is_none());
        // The table is sorted by name, but the message must name the first key in the file.
        match unknown.min_by_key(|key| key.span().start) {
            Some(key) => {
                let word = key.get_ref().as_ref();
                let meant = nearest(word, known.iter().copied()).filter(|meant| !self.table.contains_key(*meant));
                let error = self.file.value_error(&key.span(), self.key_name(word), unknown_key(word, known));
                self.note(word, FaultKind::Unknown, &[], meant, &error);
                Err(error)
            }
            None => Ok(self),
        }
    }

    fn place(&self, key: &str) -> KeyPlace {
        KeyPlace {
            path: self.file.path().to_path_buf(),
            section: self.name.clone(),
            start: self.span.start,
            key: key.to_owned(),
        }
    }

    fn instead(&self, key: &str) -> Option<Instead> {
        if self.file.faults.is_empty() { None } else { self.file.faults.instead(&self.place(key)) }
    }

    /// Whether a valid value stands in place of a wrong one.
    pub(super) fn stands_in(&self, key: &str) -> bool {
        self.instead(key) == Some(Instead::Valid)
    }

    pub(super) fn is_wrong(&self, key: &str) -> bool {
        self.instead(key).is_some()
    }

    fn note(&self, key: &str, kind: FaultKind, others: &[&str], meant: Option<&str>, error: &SceneError) {
        let meant = meant.map(str::to_owned);
        self.file.faults.note(self.place(key), kind, others, self.one_of_several, meant, error.to_string());
    }

    fn fault(&self, key: &str, kind: FaultKind, others: &[&str], span: &Range<usize>, message: String) -> SceneError {
        let error = self.file.value_error(span, self.key_name(key), message);
        self.note(key, kind, others, None, &error);
        error
    }

    pub(super) fn line(&self) -> usize {
        self.file.line(&self.span)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        match self.instead(key) {
            None => self.table.contains_key(key),
            Some(Instead::Nothing) => false,
            Some(_) => true,
        }
    }

    fn key_name(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_string() } else { format!("{}.{key}", self.name) }
    }

    fn get(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        match self.instead(key) {
            None => self.table.get(key),
            Some(Instead::Of(misspelt)) => self.table.get(misspelt.as_str()),
            Some(Instead::Valid | Instead::Nothing) => None,
        }
    }

    /// Where an error about a key points to: the value, or the header if the key is missing.
    fn span_of(&self, key: &str) -> Range<usize> {
        self.table.get(key).map_or_else(|| self.span.clone(), Spanned::span)
    }

    /// An error about the value of a key, regardless of other keys.
    pub(super) fn error(&self, key: &str, message: impl Display) -> SceneError {
        self.clash(key, &[], message)
    }

    /// An error about a key that depends on other keys too. A name without a section is one of this section. `section.*` are all keys of another one.
    pub(super) fn clash(&self, key: &str, others: &[&str], message: impl Display) -> SceneError {
        self.fault(key, FaultKind::Other, others, &self.span_of(key), message.to_string())
    }

    /// An error in a file that `key` names. The error may depend on other keys too.
    pub(super) fn blame<T>(&self, key: &str, others: &[&str], result: Result<T, SceneError>) -> Result<T, SceneError> {
        result.inspect_err(|error| self.note(key, FaultKind::Other, others, None, error))
    }

    /// An error about a key that is missing. `what` describes it.
    pub(super) fn missing(&self, key: &str, others: &[&str], what: &str) -> SceneError {
        self.fault(key, FaultKind::Missing, others, &self.span_of(key), format!("is missing: {what}"))
    }

    /// The value of a mandatory key. `what` describes it in the message.
    pub(super) fn required<T>(&self, key: &str, value: Option<T>, what: &str) -> Result<T, SceneError> {
        value.ok_or_else(|| self.missing(key, &[], what))
    }

    pub(super) fn exclusive(&self, key: &str, other: &str) -> Result<(), SceneError> {
        if self.has(key) && self.has(other) {
            return Err(self.clash(other, &[key], format!("cannot be combined with '{key}': state one of the two")));
        }
        Ok(())
    }

    /// A number in its range, which may be written as an integer.
    pub(super) fn number(&self, key: &str, quantity: Quantity) -> Result<Option<f64>, SceneError> {
        if self.stands_in(key) {
            let [valid] = quantity.valid();
            let known = [("altitude", 4e5), ("fov_deg", 30.0)];
            return Ok(Some(known.iter().find(|(name, _)| *name == key).map_or(valid, |(_, value)| *value)));
        }
        self.get(key).map(|value| self.number_of(key, value, quantity)).transpose()
    }

    fn number_of(&self, key: &str, value: &Spanned<DeValue>, quantity: Quantity) -> Result<f64, SceneError> {
        let number = as_number(value.get_ref()).ok_or_else(|| self.type_error(key, value, &quantity.expected()))?;
        let checked = quantity.check(number);
        let checked = checked.map_err(|message| self.fault(key, FaultKind::Number, &[], &value.span(), message))?;
        self.tell_small(number, checked, |message| {
            self.file.value_error(&value.span(), self.key_name(key), message).to_string()
        });
        Ok(checked)
    }

    /// Notes a number that counts as 0 after its check, to be told once. `placed` adds the place to the message.
    pub(super) fn tell_small(&self, number: f64, checked: f64, placed: impl FnOnce(String) -> String) {
        if number != checked {
            let text = || placed(format!("{number:e} is too small for its unit and counts as 0"));
            self.file.faults.note_small(text);
        }
    }

    pub(super) fn whole(&self, key: &str, range: std::ops::RangeInclusive<u32>) -> Result<Option<u32>, SceneError> {
        if self.stands_in(key) {
            return Ok(Some(*range.start().max(&1)));
        }
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
                self.fault(key, FaultKind::Number, &[], &value.span(), message)
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
        if self.stands_in(key) {
            return Ok(Some(quantity.valid()));
        }
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
        if self.stands_in(key) {
            return Ok(Some(false));
        }
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        value.get_ref().as_bool().map(Some).ok_or_else(|| self.type_error(key, value, "true or false"))
    }

    /// The file that `key` names, a regular file that this file may name.
    pub(super) fn path(&self, key: &str) -> Result<Option<PathBuf>, SceneError> {
        if self.name == "model" && (self.stands_in(key) || self.span.start == usize::MAX) {
            return Ok(Some(self.file.path().to_path_buf()));
        }
        let Some(name) = self.string(key)? else { return Ok(None) };
        self.file.resolve(name).map(Some).map_err(|error| self.error(key, error))
    }

    pub(super) fn string(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        self.get(key).map(|value| self.string_of(key, value, "a string")).transpose()
    }

    /// A string that names something. Characters that must not be shown are escaped, as in the names of a model.
    pub(super) fn name(&self, key: &str) -> Result<Option<String>, SceneError> {
        if self.stands_in(key) {
            return Ok(Some(format!("{key} at {}", self.span.start)));
        }
        Ok(self.string(key)?.map(|name| plain(name).into_owned()))
    }

    fn string_of(&self, key: &str, value: &'a Spanned<DeValue<'a>>, expected: &str) -> Result<&'a str, SceneError> {
        match value.get_ref() {
            DeValue::String(text) if !text.trim().is_empty() => Ok(text.as_ref()),
            DeValue::String(_) => {
                Err(self.fault(key, FaultKind::Other, &[], &value.span(), "must not be empty".to_string()))
            }
            _ => Err(self.type_error(key, value, expected)),
        }
    }

    /// A name, or a non-empty array of names, as [`Section::name`] reads them.
    pub(super) fn strings(&self, key: &str) -> Result<Option<Vec<String>>, SceneError> {
        if self.stands_in(key) {
            return Ok(Some(vec!["*".to_owned()]));
        }
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

    pub(super) fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError> {
        if self.stands_in(key) {
            let stated = self.table.get(key).and_then(|value| value.get_ref().as_str()).unwrap_or_default();
            let near = nearest(stated, choices.iter().map(|(name, _)| *name));
            let chosen = choices.iter().find(|(name, _)| Some(*name) == near).or(choices.first());
            return Ok(chosen.map(|(_, value)| *value));
        }
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

    pub(super) fn required_table(&self, name: &str, known: &[&str]) -> Result<Self, SceneError> {
        self.required(name, self.table(name, known)?, &format!("a scene needs a section [{name}]"))
    }

    /// A table: `[key]` in the root, `key = { .. }` elsewhere.
    pub(super) fn table(&self, key: &str, known: &[&str]) -> Result<Option<Section<'a>>, SceneError> {
        if self.stands_in(key) {
            return Ok(self.valid(key));
        }
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let DeValue::Table(table) = value.get_ref() else {
            let shape = if self.name.is_empty() { format!("one section [{key}]") } else { format!("{key} = {{ .. }}") };
            return Err(self.type_error(key, value, &shape));
        };
        self.child(key, table, value.span(), false).map(|section| section.open(known)).transpose()
    }

    /// A section below this one. Where reading gave up on a section, the section of a valid scene stands in for it, or none.
    fn child(&self, key: &str, table: &'a DeTable<'a>, span: Range<usize>, one_of_several: bool) -> Option<Self> {
        let section = Self { file: self.file, name: self.key_name(key), table, span, one_of_several };
        if self.file.faults.is_empty() || !self.file.faults.gave_up(&section.place("")) {
            return Some(section);
        }
        self.valid(key)
    }

    /// A section of a valid scene.
    fn valid(&self, key: &str) -> Option<Self> {
        let table = valid_scene::section(key).filter(|_| self.name.is_empty())?;
        // No place of the file has this start.
        let span = usize::MAX..usize::MAX;
        Some(Self { file: self.file, name: self.key_name(key), table, span, one_of_several: false })
    }

    pub(super) fn tables(&self, key: &str, known: &[&str]) -> Result<Vec<Section<'a>>, SceneError> {
        let Some(value) = self.get(key) else {
            return Ok(Vec::new());
        };
        let shape = format!("sections [[{key}]] in double brackets");
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.type_error(key, value, &shape));
        };
        let open = |item: &'a Spanned<DeValue<'a>>| match item.get_ref() {
            DeValue::Table(table) => {
                self.child(key, table, item.span(), true).map(|section| section.open(known)).transpose()
            }
            _ => Err(self.type_error(key, item, &shape)),
        };
        array.iter().filter_map(|item| open(item).transpose()).collect()
    }

    fn type_error(&self, key: &str, value: &Spanned<DeValue>, expected: &str) -> SceneError {
        let message = format!("expected {expected}, found {}", describe(value.get_ref()));
        let number = expected.contains("number");
        self.fault(key, if number { FaultKind::Number } else { FaultKind::Other }, &[], &value.span(), message)
    }
}

/// A number that may be written as an integer.
pub(crate) fn as_number(value: &DeValue) -> Option<f64> {
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
