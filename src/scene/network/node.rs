//! `[[node]]` of a network file.

use crate::scene::error::SceneError;
use crate::scene::quantity::Quantity;
use crate::scene::section::Section;
use crate::thermal::network::NodeKind;
use crate::thermal::network::schedule::HeatTable;

pub(super) const KEYS: &[&str] = &["label", "kind", "capacitance", "emissive_area", "temperature", "heat"];
/// `heat = { .. }`.
pub(in crate::scene) const HEAT: &[&str] = &["time", "power"];
/// Start of the search for the balance of an arithmetic node [K], without effect on the result.
const FIRST_GUESS: f64 = 300.0;

/// A node in the words of the file.
pub(super) struct FileNode {
    pub(super) label: String,
    pub(super) kind: NodeKind,
    pub(super) capacitance: f64,
    /// `None` if the file does not state it.
    pub(super) emissive_area: Option<f64>,
    pub(super) temperature: f64,
    pub(super) heat: Option<HeatTable>,
}

pub(super) fn read(section: &Section) -> Result<FileNode, SceneError> {
    let label = section.name("label")?;
    let label = section.required("label", label, "the name of the node")?;
    if label == "time" {
        return Err(section.error("label", "'time' is the first column of the series: choose another name"));
    }
    let kinds =
        [("diffusive", NodeKind::Diffusive), ("arithmetic", NodeKind::Arithmetic), ("boundary", NodeKind::Boundary)];
    let kind = section.choice("kind", &kinds)?;
    let kind = section.required("kind", kind, "\"diffusive\", \"arithmetic\" or \"boundary\"")?;
    let emissive_area = section.number("emissive_area", Quantity::non_negative("m2"))?;
    let temperature = section.number("temperature", Quantity::non_negative("K"))?;
    let temperature = match kind {
        NodeKind::Arithmetic => temperature.unwrap_or(FIRST_GUESS),
        NodeKind::Diffusive => section.required("temperature", temperature, "the temperature at time 0 [K]")?,
        NodeKind::Boundary => section.required("temperature", temperature, "the temperature that it keeps [K]")?,
    };
    let capacitance = capacitance(section, kind)?;
    Ok(FileNode { label, kind, capacitance, emissive_area, temperature, heat: heat(section)? })
}

fn capacitance(section: &Section, kind: NodeKind) -> Result<f64, SceneError> {
    let capacitance = section.number("capacitance", Quantity::non_negative("J/K"))?;
    match kind {
        NodeKind::Diffusive => {
            let capacitance = section.required("capacitance", capacitance, "the heat capacity [J/K]")?;
            if capacitance == 0.0 {
                let message = "must be above 0 [J/K]: a node that stores no heat is of kind \"arithmetic\"";
                return Err(section.error("capacitance", message));
            }
            Ok(capacitance)
        }
        NodeKind::Arithmetic if capacitance.is_some_and(|capacitance| capacitance > 0.0) => {
            Err(section.error("capacitance", "must be 0 or absent: an arithmetic node stores no heat"))
        }
        // A boundary stores unlimited heat.
        NodeKind::Arithmetic | NodeKind::Boundary => Ok(0.0),
    }
}

fn heat(section: &Section) -> Result<Option<HeatTable>, SceneError> {
    heat_table(section, "heat")
}

/// Heat under a key: one number, or times with powers.
pub(in crate::scene) fn heat_table(section: &Section, key: &str) -> Result<Option<HeatTable>, SceneError> {
    if !section.has(key) {
        return Ok(None);
    }
    if !section.is_table(key) {
        return Ok(section.number(key, Quantity::any("W"))?.map(HeatTable::constant));
    }
    let Some(table) = section.table(key, HEAT)? else { return Ok(None) };
    let times = table.required("time", table.list("time", Quantity::any("s"))?, "the times of the table [s]")?;
    let powers = table.required("power", table.list("power", Quantity::any("W"))?, "the heat at each time [W]")?;
    if times.is_empty() {
        return Err(table.error("time", "must not be empty"));
    }
    if times.len() != powers.len() {
        let message = format!("must have a value for each of the {} times, found {}", times.len(), powers.len());
        return Err(table.error("power", message));
    }
    if let Some(pair) = times.windows(2).find(|pair| pair[0] > pair[1]) {
        return Err(table.error("time", format!("must not descend, but {} follows {}", pair[1], pair[0])));
    }
    if let Some(three) = times.windows(3).find(|three| three[0] == three[2]) {
        let message = format!("{} stands three times: a jump is a time that stands twice", three[0]);
        return Err(table.error("time", message));
    }
    Ok(Some(HeatTable { times, powers }))
}
