//! The small sections: `[initial]`, `[[probe]]` and `[output]`.

use glam::DVec3;

use super::choice::choose;
use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::point;

/// The state at the start: time 0, or the start of the warm-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Initial {
    /// The balance temperature under the mean load of the first step.
    Balance,
    /// One temperature for all nodes [K].
    Temperature(f64),
}

/// A point. The series records the temperature of its nearest node.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Column name.
    pub name: String,
    /// Position in the body frame [m].
    pub position: DVec3,
    /// The part that the node must belong to, if given.
    pub part: Option<String>,
}

/// Reads `[initial]`. The default is the balance under the load at the start.
pub(super) fn initial(section: Option<&Section>, assumptions: &mut Vec<String>) -> Result<Initial, SceneError> {
    let stated = match section {
        Some(section) => section.number("temperature", Quantity::within(0.0, 1e6, "K"))?,
        None => None,
    };
    Ok(stated.map(Initial::Temperature).unwrap_or_else(|| {
        let sentence = "Every node starts at the balance temperature of the first load \
             (initial.temperature is absent).";
        assumptions.push(sentence.to_string());
        Initial::Balance
    }))
}

/// Reads every `[[probe]]`. The names must differ, because they become column names.
pub(super) fn probes(sections: &[Section]) -> Result<Vec<Probe>, SceneError> {
    let mut probes: Vec<Probe> = Vec::with_capacity(sections.len());
    for section in sections {
        let name = section.required("name", section.name("name")?, "the name of the probe's column")?;
        if probes.iter().any(|probe| probe.name == name) {
            return Err(section.error("name", format!("'{name}' is the name of another probe")));
        }
        let position = section.required("position", point(section, "position")?, "[x, y, z] in the body frame [m]")?;
        let part = section.name("part")?;
        probes.push(Probe { name, position, part });
    }
    Ok(probes)
}

/// Whether a run keeps its energy balance: yes, unless the file says otherwise.
pub(super) fn energy_balance(section: Option<&Section>) -> Result<bool, SceneError> {
    Ok(section.map_or(Ok(None), |section| section.boolean("energy_balance"))?.unwrap_or(true))
}

pub(super) fn colour_range(section: Option<&Section>) -> Result<Option<[f64; 2]>, SceneError> {
    let Some(section) = section else {
        return Ok(None);
    };
    let range = section.numbers::<2>("colour_range", Quantity::non_negative("K"))?;
    match range {
        Some([lower, upper]) if lower >= upper => {
            Err(section.error("colour_range", format!("must run from low to high, found {lower} to {upper} K")))
        }
        range => Ok(range),
    }
}

/// Reads `output.channels`: whether the frames show the emitted and the reflected radiance apart.
pub(super) fn channels(section: Option<&Section>, reflects: bool) -> Result<bool, SceneError> {
    let Some((section, words)) = section.and_then(|section| Some((section, section.strings("channels").transpose()?)))
    else {
        return Ok(false);
    };
    for word in words? {
        choose(&word, &[("emitted", ()), ("reflected", ())]).map_err(|message| section.error("channels", message))?;
    }
    if !reflects {
        let message = "tells what is emitted from what is reflected, and nothing is: state radiance.reflections";
        return Err(section.clash("channels", &["radiance.reflections"], message));
    }
    Ok(true)
}
