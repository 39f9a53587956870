//! An entry of a materials table as people read it: values, sources, and how they were obtained.

use super::error::SceneError;
use super::faults::OWN_SECTION;
use super::quantity::Quantity;
use super::section::Section;
use super::values::{SHARE, StatedOptics, Values};
use crate::text::plain;
use crate::thermal::material::Bulk;

/// An entry of a materials table without its response.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct MaterialRecord {
    pub(crate) name: String,
    pub(crate) finish: String,
    pub(crate) outside: StatedOptics,
    pub(crate) back: StatedOptics,
    /// Sides that exchange heat.
    pub(crate) sides: Option<&'static str>,
    /// Optics of the outside after the exposure that `eol` names.
    pub(crate) aged: StatedOptics,
    pub(crate) eol: Option<String>,
    /// Temperatures [K] in which the material may be used, as its source says.
    pub(crate) temperature_range: Option<[f64; 2]>,
    pub(crate) measured: Option<String>,
    pub(crate) bulk: Bulk,
    pub(crate) optics_source: Option<String>,
    pub(crate) back_source: Option<String>,
    pub(crate) bulk_source: Option<String>,
    pub(crate) note: Option<String>,
}

impl MaterialRecord {
    /// Reads what an entry states beside its thermal `values`.
    ///
    /// # Errors
    /// A source is missing or belongs to nothing, or a value of the end of life has no exposure, or none of the beginning.
    pub(super) fn read(section: &Section, name: &str, values: &Values) -> Result<Self, SceneError> {
        let text = |key: &str| Ok::<_, SceneError>(section.string(key)?.map(|text| plain(text).into_owned()));
        let source = |key: &str, stated: bool| {
            let source = text(key)?;
            if stated {
                return section.required(key, source, "where these values come from").map(Some);
            }
            match source {
                Some(_) => {
                    Err(section.clash(key, &[OWN_SECTION], "is the source of values that the entry does not hold"))
                }
                None => Ok(None),
            }
        };
        let finish = section.required("finish", text("finish")?, "which surface the values were measured on")?;
        let outside = values.stated_front();
        let aged = aged(section, outside)?;
        Ok(Self {
            name: name.to_owned(),
            finish,
            outside,
            back: values.stated_back(),
            sides: values.stated_sides(),
            aged,
            eol: eol(section, aged, text("eol")?)?,
            temperature_range: temperature_range(section)?,
            measured: text("measured")?,
            bulk: values.bulk(),
            optics_source: source("optics_source", values.states_front())?,
            back_source: source("back_source", values.states_back())?,
            bulk_source: source("bulk_source", values.states_bulk())?,
            note: text("note")?,
        })
    }

    /// The sources that the entry names, each with the values that come from it.
    pub(crate) fn sources(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let sources = [("optics", &self.optics_source), ("back", &self.back_source), ("bulk", &self.bulk_source)];
        sources.into_iter().filter_map(|(part, source)| Some((part, source.as_deref()?)))
    }

    /// `white_silicone_paint (finish; optics: source; bulk: source)`.
    pub(super) fn describe(&self) -> String {
        let sources = self.sources().map(|(part, source)| format!("; {part}: {source}")).collect::<String>();
        format!("{} ({}{sources})", self.name, self.finish)
    }
}

/// Optics of the end of life, each beside one of the beginning.
fn aged(section: &Section, outside: StatedOptics) -> Result<StatedOptics, SceneError> {
    let value = |key: &str, first: Option<f64>| {
        let value = section.number(key, SHARE)?;
        match (value, first) {
            (Some(_), None) => {
                let start = key.trim_end_matches("_eol");
                Err(section.clash(
                    key,
                    &[start],
                    format!("needs the value of the beginning of life: state '{start}' too"),
                ))
            }
            _ => Ok(value),
        }
    };
    Ok(StatedOptics {
        absorptivity: value("absorptivity_eol", outside.absorptivity)?,
        emissivity: value("emissivity_eol", outside.emissivity)?,
    })
}

/// The exposure after which the optics were `aged`.
fn eol(section: &Section, aged: StatedOptics, exposure: Option<String>) -> Result<Option<String>, SceneError> {
    if aged == StatedOptics::default() {
        return match exposure {
            Some(_) => {
                let values = ["absorptivity_eol", "emissivity_eol"];
                Err(section.clash("eol", &values, "describes values that the entry does not hold"))
            }
            None => Ok(None),
        };
    }
    section.required("eol", exposure, "what the surface had been through").map(Some)
}

fn temperature_range(section: &Section) -> Result<Option<[f64; 2]>, SceneError> {
    let key = "temperature_range";
    let range = section.numbers::<2>(key, Quantity::non_negative("K"))?;
    match range {
        Some([low, high]) if low >= high && !section.stands_in(key) => {
            Err(section.error(key, format!("must rise, found {low} and {high} K")))
        }
        _ => Ok(range),
    }
}
