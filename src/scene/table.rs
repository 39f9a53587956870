//! A materials table: named entries of values. Each group of values states its source.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::SceneError;
use super::faults::{Faults, OWN_SECTION};
use super::file::{SourceFile, read_text};
use super::keys::{TABLE_ENTRY, suggestion};
use super::section::Section;
use super::values::Values;
use crate::files::Reach;
use crate::text::plain;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct TableEntry {
    pub(super) values: Values,
    /// `materials.toml white_silicone_paint (finish; optics: source; bulk: source)`.
    pub(super) description: String,
}

/// The entries of a table by name, empty if the scene names no table.
#[derive(Debug, Clone, Default)]
pub(super) struct MaterialTable {
    entries: BTreeMap<String, TableEntry>,
    /// File name for messages. `None` if the scene names no table.
    file_name: Option<String>,
}

impl MaterialTable {
    /// Reads and checks every entry of the table, even unused ones. `step` [s] turns a `t_max` in seconds into steps.
    pub(super) fn read(path: &Path, reach: &Reach, step: f64, faults: &Faults) -> Result<Self, SceneError> {
        Self::parse(&read_text(path)?, path, reach, step, faults)
    }

    /// Checks the text of a table as if it lay at `path`.
    pub(super) fn parse(
        text: &str,
        path: &Path,
        reach: &Reach,
        step: f64,
        faults: &Faults,
    ) -> Result<Self, SceneError> {
        let file = SourceFile::new(path, text, reach, faults);
        let table = file.parse()?;
        let names: Vec<&str> = table.get_ref().keys().map(|name| name.get_ref().as_ref()).collect();
        let root = Section::root(&file, &table, &names)?;
        let file_name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let mut entries = BTreeMap::new();
        for name in names {
            let shown = plain(name).into_owned();
            let entry = match root.table(name, TABLE_ENTRY)? {
                Some(section) => entry(&section, &shown, &file_name, step)?,
                // The entry is wrong and no longer read.
                None => TableEntry { values: Values::default(), description: String::new() },
            };
            entries.insert(shown, entry);
        }
        Ok(Self { entries, file_name: Some(file_name) })
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// The combined values of the named entries and their descriptions. An earlier entry has priority. The error is a
    /// message about the first unknown name.
    pub(super) fn combine(&self, names: &[String]) -> Result<(Values, String), String> {
        let entries = names.iter().map(|name| self.get(name)).collect::<Result<Vec<_>, _>>()?;
        let values = entries.iter().fold(Values::default(), |values, entry| values.or(&entry.values));
        let descriptions: Vec<&str> = entries.iter().map(|entry| entry.description.as_str()).collect();
        Ok((values, descriptions.join("; ")))
    }

    /// The entry with this name, or a message that lists the known entries.
    pub(super) fn get(&self, name: &str) -> Result<&TableEntry, String> {
        let Some(file_name) = &self.file_name else {
            return Err(format!("'{name}' is an entry of a table, but materials.table is missing"));
        };
        self.entries.get(name).ok_or_else(|| {
            let near = suggestion(name, self.entries.keys().map(String::as_str));
            format!("{file_name} has no entry '{name}'{near}")
        })
    }
}

fn entry(section: &Section, name: &str, file_name: &str, step: f64) -> Result<TableEntry, SceneError> {
    let values = Values::read(section, step)?;
    let finish = section.string("finish")?;
    let mut description =
        vec![section.required("finish", finish, "which surface the values were measured on")?.to_string()];
    for (stated, key, what) in [
        (values.states_front(), "optics_source", "optics"),
        (values.states_back(), "back_source", "back"),
        (values.states_bulk(), "bulk_source", "bulk"),
    ] {
        let source = section.string(key)?;
        if stated {
            let source = section.required(key, source, "where these values come from")?;
            description.push(format!("{what}: {source}"));
        } else if source.is_some() {
            return Err(section.clash(key, &[OWN_SECTION], "is the source of values that the entry does not hold"));
        }
    }
    section.string("note")?;
    Ok(TableEntry { values, description: format!("{file_name} {name} ({})", description.join("; ")) })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::thermal::material::Optics;

    use super::{Faults, MaterialTable};
    use crate::files::Reach;

    /// The table of this repository. Its values come from the sources that it names.
    #[test]
    fn the_table_of_models_is_read_and_holds_its_sources_values() {
        let table = MaterialTable::read(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("models/materials.toml"),
            &Reach::Anywhere,
            1.0,
            &Faults::default(),
        )
        .unwrap();
        for (name, absorptivity, emissivity) in [
            // Fortescue, Swinerd & Stark, table 11.3.
            ("white_silicone_paint", 0.26, 0.83),
            ("goldized_kapton", 0.25, 0.02),
            ("solar_cell_gaas", 0.88, 0.80),
            // Vural et al. 2023.
            ("paper_aluminium_6061", 0.18, 0.21),
            ("paper_goldized_mli", 0.19, 0.02),
        ] {
            let entry = table.get(name).unwrap();
            let settled = entry.values.clone().or(&instant());
            assert_eq!(settled.complete(1.0).unwrap().front, Optics { absorptivity, emissivity }, "{name}");
        }
        assert!(table.get("white_silicon_paint").unwrap_err().contains("did you mean 'white_silicone_paint'?"));
    }

    fn instant() -> super::Values {
        let text = "x = { finish = 'none', response = 'instant' }";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.toml");
        std::fs::write(&path, text).unwrap();
        MaterialTable::read(&path, &Reach::Anywhere, 1.0, &Faults::default()).unwrap().get("x").unwrap().values.clone()
    }
}
