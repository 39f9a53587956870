//! A materials table: named entries of values. Each group of values states its source.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::SceneError;
use super::faults::Faults;
use super::file::{SourceFile, read_text, unreadable};
use super::keys::TABLE_ENTRY;
use super::material_record::MaterialRecord;
use super::section::Section;
use super::values::Values;
use crate::files::{self, Reach};
use crate::misspelt::suggestion;
use crate::text::plain;

/// The table of this repository.
const SHIPPED: &str = include_str!("../../models/materials.toml");

#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct TableEntry {
    pub(super) values: Values,
    pub(super) record: MaterialRecord,
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
                Some(section) => {
                    let values = Values::read(&section, step)?;
                    let record = MaterialRecord::read(&section, &shown, &values)?;
                    TableEntry { values, record }
                }
                // The entry is wrong and no longer read.
                None => TableEntry::default(),
            };
            entries.insert(shown, entry);
        }
        Ok(Self { entries, file_name: Some(file_name) })
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// What the entries state, in the order of their names.
    fn into_records(self) -> Vec<MaterialRecord> {
        self.entries.into_values().map(|entry| entry.record).collect()
    }

    /// The combined values of the named entries and their descriptions. An earlier entry has priority. The error is a
    /// message about the first unknown name.
    pub(super) fn combine(&self, names: &[String]) -> Result<(Values, String), String> {
        let entries = names.iter().map(|name| self.get(name)).collect::<Result<Vec<_>, _>>()?;
        let values = entries.iter().fold(Values::default(), |values, entry| values.or(&entry.values));
        let file_name = self.file_name.as_deref().unwrap_or_default();
        let descriptions: Vec<String> =
            entries.iter().map(|entry| format!("{file_name} {}", entry.record.describe())).collect();
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

/// The entries of the table at `path`, or of the table of this repository.
///
/// # Errors
/// The file cannot be read, or an entry is wrong, as in a scene that names the table.
pub(crate) fn read_material_records(path: Option<&Path>) -> Result<Vec<MaterialRecord>, SceneError> {
    let Some(path) = path else {
        let path = Path::new("materials.toml");
        let table = MaterialTable::parse(SHIPPED, path, &Reach::Anywhere, 1.0, &Faults::default())?;
        return Ok(table.into_records());
    };
    let text = files::read_text_or_pipe(path).map_err(|fault| unreadable(path, &fault))?;
    Ok(MaterialTable::parse(&text, path, &Reach::of(path), 1.0, &Faults::default())?.into_records())
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
            // Henninger, NASA RP-1121.
            ("chemglaze_black_paint_z306", 0.96, 0.91),
            ("zerlauts_z_93_white_paint", 0.17, 0.92),
            ("kapton_film_aluminium_backing_5_mil", 0.46, 0.86),
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
