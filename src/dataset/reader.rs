//! Reads the tables of a SPEC file. Every error names file, line and key.

use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::distribution::Distribution;
use super::distribution_reader::read;
use super::toml_value::shown;
use crate::misspelt::suggestion;
use crate::scene::SceneError;
use crate::scene::keys::unknown_key;
use crate::scene::section::as_number as number;
use crate::text::{plain, plain_lines};

/// Path and text of a SPEC file.
pub(super) struct SpecFile<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
}

pub(super) struct SpecTable<'a> {
    file: &'a SpecFile<'a>,
    name: String,
    table: &'a DeTable<'a>,
    start: usize,
}

impl<'a> SpecFile<'a> {
    pub(crate) fn parse(&self) -> Result<Spanned<DeTable<'a>>, SceneError> {
        DeTable::parse(self.text).map_err(|error| SceneError::Syntax {
            path: self.path.to_path_buf(),
            line: self.line(error.span().unwrap_or(0..0).start),
            message: error.message().to_owned(),
        })
    }

    fn line(&self, at: usize) -> usize {
        1 + self.text.as_bytes()[..at.min(self.text.len())].iter().filter(|byte| **byte == b'\n').count()
    }

    fn error(&self, at: usize, key: &str, message: &str) -> SceneError {
        let (key, message) = (plain(key).into_owned(), plain_lines(message).into_owned());
        SceneError::Value { path: self.path.to_path_buf(), line: self.line(at), key, message }
    }
}

impl<'a> SpecTable<'a> {
    pub(crate) fn root(
        file: &'a SpecFile<'a>,
        table: &'a Spanned<DeTable<'a>>,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        Self { file, name: String::new(), table: table.get_ref(), start: 0 }.of(known)
    }

    /// The table, if all its keys are known.
    fn of(self, known: &[&str]) -> Result<Self, SceneError> {
        let strangers = self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        match strangers.min_by_key(|key| key.span().start) {
            None => Ok(self),
            Some(key) => {
                let word: &str = key.get_ref().as_ref();
                Err(self.file.error(key.span().start, &self.key(word), &unknown(word, known)))
            }
        }
    }

    fn key(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// An error about the value of a key, or about the table where the key is missing.
    pub(crate) fn error(&self, key: &str, message: &str) -> SceneError {
        let at = self.table.get(key).map_or(self.start, |value| value.span().start);
        self.file.error(at, &self.key(key), message)
    }

    /// An error about a key of a table, or of a list of tables, under a key.
    pub(crate) fn error_within(&self, key: &str, inner: &str, message: &str) -> SceneError {
        fn place(value: &DeValue, inner: &str) -> Option<usize> {
            match value {
                DeValue::Table(table) => table.get_key_value(inner).map(|(key, _)| key.span().start),
                DeValue::Array(items) => items.iter().find_map(|item| place(item.get_ref(), inner)),
                _ => None,
            }
        }
        let at = self.table.get(key).and_then(|value| place(value.get_ref(), inner)).unwrap_or(self.start);
        self.file.error(at, &format!("{}.{inner}", self.key(key)), message)
    }

    fn found<T>(
        &self,
        key: &str,
        expected: &str,
        take: impl FnOnce(&'a DeValue<'a>) -> Option<T>,
    ) -> Result<Option<T>, SceneError> {
        let Some(value) = self.table.get(key) else { return Ok(None) };
        let wrong = || self.error(key, &format!("expected {expected}, found {}", shown(value.get_ref())));
        take(value.get_ref()).map(Some).ok_or_else(wrong)
    }

    /// Whether a key holds one table, not a list of them.
    pub(crate) fn is_table(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(|value| value.get_ref().is_table())
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    pub(crate) fn required<T>(&self, key: &str, value: Option<T>, what: &str) -> Result<T, SceneError> {
        value.ok_or_else(|| self.error(key, &format!("is missing: {what}")))
    }

    pub(crate) fn boolean(&self, key: &str) -> Result<Option<bool>, SceneError> {
        self.found(key, "true or false", DeValue::as_bool)
    }

    pub(crate) fn text(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        self.found(key, "a text that is not empty", |value| value.as_str().filter(|text| !text.trim().is_empty()))
    }

    pub(crate) fn texts(&self, key: &str) -> Result<Option<Vec<&'a str>>, SceneError> {
        let each = |value: &'a DeValue<'a>| value.as_array()?.iter().map(|item| item.get_ref().as_str()).collect();
        self.found(key, "an array of texts", each)
    }

    pub(crate) fn whole(&self, key: &str, range: std::ops::RangeInclusive<u64>) -> Result<Option<u64>, SceneError> {
        let expected = format!("a whole number from {} to {}", range.start(), range.end());
        self.found(key, &expected, |value| {
            let DeValue::Integer(integer) = value else { return None };
            let number = i128::from_str_radix(integer.as_str(), integer.radix()).ok()?;
            u64::try_from(number).ok().filter(|number| range.contains(number))
        })
    }

    pub(crate) fn number(&self, key: &str, range: std::ops::RangeInclusive<f64>) -> Result<Option<f64>, SceneError> {
        let expected = format!("a number from {} to {}", range.start(), range.end());
        self.found(key, &expected, |value| number(value).filter(|number| range.contains(number)))
    }

    pub(crate) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, SceneError> {
        let expected = format!("an array of {N} finite numbers");
        self.found(key, &expected, |value| {
            let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(|item| number(item.get_ref())).collect();
            numbers?.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|number| number.is_finite()))
        })
    }

    /// One of the words of `choices`.
    pub(crate) fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError> {
        let Some(word) = self.text(key)? else { return Ok(None) };
        let known = choices.iter().map(|(word, _)| *word);
        let message = || format!("'{word}' is none of its words{}", suggestion(word, known.clone()));
        let choice = choices.iter().find(|(known, _)| *known == word);
        choice.map(|(_, value)| Some(*value)).ok_or_else(|| self.error(key, &message()))
    }

    pub(crate) fn table(&self, key: &str, known: &[&str]) -> Result<Option<Self>, SceneError> {
        let Some(table) = self.found(key, &format!("a section [{}]", self.key(key)), DeValue::as_table)? else {
            return Ok(None);
        };
        let start = self.table.get(key).map_or(0, |value| value.span().start);
        Self { file: self.file, name: self.key(key), table, start }.of(known).map(Some)
    }

    /// The tables of `[[key]]`.
    pub(crate) fn tables(&self, key: &str, known: &[&str]) -> Result<Vec<Self>, SceneError> {
        let expected = format!("sections [[{}]] in double brackets", self.key(key));
        let tables = self.found(key, &expected, |value| {
            let each = value.as_array()?.iter().map(|item| Some((item.get_ref().as_table()?, item.span().start)));
            each.collect::<Option<Vec<_>>>()
        })?;
        let open = |(table, start)| Self { file: self.file, name: self.key(key), table, start }.of(known);
        tables.into_iter().flatten().map(open).collect()
    }

    /// A value that is drawn: a distribution, a constant, or a list or table of them.
    pub(crate) fn drawn(&self, key: &str) -> Result<Option<Distribution>, SceneError> {
        let Some(value) = self.table.get(key) else { return Ok(None) };
        self.drawn_value(key, value).map(Some)
    }

    /// All values of the table, by their keys in the order of the file.
    pub(crate) fn all_drawn(&self) -> Result<Vec<(String, Distribution)>, SceneError> {
        let mut keys: Vec<_> = self.table.iter().collect();
        keys.sort_by_key(|(key, _)| key.span().start);
        let entry = |(key, value): (&Spanned<_>, &'a Spanned<DeValue<'a>>)| {
            let key: &str = AsRef::<str>::as_ref(key.get_ref());
            Ok((key.to_owned(), self.drawn_value(key, value)?))
        };
        keys.into_iter().map(entry).collect()
    }

    /// A table with any keys, because another file defines the keys.
    pub(crate) fn open_table(&self, key: &str) -> Result<Option<Self>, SceneError> {
        let table = self.found(key, &format!("a section [{}]", self.key(key)), DeValue::as_table)?;
        let start = self.table.get(key).map_or(0, |value| value.span().start);
        Ok(table.map(|table| Self { file: self.file, name: self.key(key), table, start }))
    }

    fn drawn_value(&self, key: &str, value: &'a Spanned<DeValue<'a>>) -> Result<Distribution, SceneError> {
        let fault =
            |(place, message): (std::ops::Range<usize>, String)| self.file.error(place.start, &self.key(key), &message);
        read(value).map_err(fault)
    }

    /// A number that is drawn, all of whose values lie in a range.
    pub(crate) fn drawn_number(
        &self,
        key: &str,
        range: std::ops::RangeInclusive<f64>,
        unit: &str,
    ) -> Result<Option<Distribution>, SceneError> {
        let Some(drawn) = self.drawn(key)? else { return Ok(None) };
        let Some([low, high]) = drawn.range() else {
            let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
            let stated = self.table.get(key).map(|value| shown(value.get_ref())).unwrap_or_default();
            return Err(
                self.error(key, &format!("must be a number or a distribution of numbers{unit}, found {stated}"))
            );
        };
        if !(range.contains(&low) && range.contains(&high)) {
            let [from, to] = [range.start(), range.end()];
            let message = format!("may be {low} to {high}, and must lie within {from} to {to} {unit}");
            return Err(self.error(key, message.trim_end()));
        }
        Ok(Some(drawn))
    }

    /// A path from the folder of the file.
    pub(crate) fn path(&self, key: &str) -> Result<Option<PathBuf>, SceneError> {
        let home = self.file.path.parent().unwrap_or(Path::new(""));
        Ok(self.text(key)?.map(|path| home.join(path)))
    }
}

/// The message for an unknown key. A key of the scene belongs in `[each_orbit]`.
fn unknown(word: &str, known: &[&str]) -> String {
    let message = unknown_key(word, known);
    match message.split_once("belongs in [") {
        Some((_, section)) => format!(
            "unknown key; known here: {}; a key of the scene's [{section} stands in [each_orbit]",
            known.join(", ")
        ),
        None => message,
    }
}
