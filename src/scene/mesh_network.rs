//! `[network]`, `[[contact]]` and `[[heater]]`: settings, contacts and heaters of the thermal network.

use wildmatch::WildMatch;

use super::error::SceneError;
use super::network::node::heat_table;
use super::quantity::Quantity;
use super::section::Section;
use super::view::Probe;
use crate::thermal::network::control::Integrator;
use crate::thermal::network::schedule::HeatTable;
use crate::thermal::shell::{ContactConductance, MERGE_RATE};

/// Default largest distance between surfaces in contact [m].
pub(crate) const CONTACT_DISTANCE: f64 = 1e-3;
/// Distance up to which neighbours are told although they do not touch [m].
pub(crate) const LISTED_DISTANCE: f64 = 5e-3;
/// Default conductance of neighbours [W/(m2 K)]. An assumption: of the order of bolted metal without filler in vacuum.
pub(crate) const NEIGHBOUR_CONDUCTANCE: f64 = 300.0;

/// What happens to parts and materials that touch without a `[[contact]]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum NeighbourContacts {
    /// The scene says nothing: they stay apart, and a warning lists them.
    Unstated,
    /// The scene says that only stated contacts count.
    Stated,
    /// They are joined.
    Auto {
        /// Conductance per area [W/(m2 K)].
        per_area: f64,
        /// Largest distance between surfaces that touch [m], where the scene states one.
        distance: Option<f64>,
    },
}

/// How a network is built and integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkSettings {
    /// The integration methods.
    pub integrator: Integrator,
    /// Target error [K]. `None` is the default of the integrator.
    pub tolerance: Option<f64>,
    /// Nodes that exchange heat faster than this are merged [1/s].
    pub(crate) merge_rate: f64,
    pub(crate) neighbours: NeighbourContacts,
}

/// Patterns (`*`, `?`) on names of parts or materials.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum OwnerPatterns {
    Parts(String),
    Materials(String),
}

/// A contact between two groups of surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactRule {
    pub(crate) between: [OwnerPatterns; 2],
    /// Largest distance between surfaces in contact [m].
    pub(crate) distance: f64,
    pub(crate) conductance: ContactConductance,
}

/// A heater, whose power is spread over the area of its parts.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshHeater {
    /// Patterns on names of parts.
    pub(crate) parts: Vec<String>,
    /// Power over scene time. With a thermostat it acts only while the heater is on.
    pub(crate) power: HeatTable,
    pub(crate) thermostat: Option<HeaterThermostat>,
}

/// A thermostat with hysteresis, whose sensor is the structure at a probe.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeaterThermostat {
    pub(crate) probe: usize,
    /// Temperature below which it switches on [K].
    pub(crate) on_below: f64,
    /// Temperature above which it switches off [K].
    pub(crate) off_above: f64,
    pub(crate) initially_on: bool,
}

impl OwnerPatterns {
    pub(crate) fn pattern(&self) -> &str {
        match self {
            Self::Parts(pattern) | Self::Materials(pattern) => pattern,
        }
    }

    pub(crate) fn fits(&self, part: &str, material: &str) -> bool {
        match self {
            Self::Parts(pattern) => WildMatch::new(pattern).matches(part),
            Self::Materials(pattern) => WildMatch::new(pattern).matches(material),
        }
    }
}

pub(super) fn settings(
    section: Option<&Section>,
    assumptions: &mut Vec<String>,
) -> Result<NetworkSettings, SceneError> {
    let all = [Integrator::Default, Integrator::Cheap, Integrator::Accurate, Integrator::OnePass];
    let names = all.map(|integrator| integrator.to_string());
    let choices: Vec<(&str, Integrator)> = names.iter().map(String::as_str).zip(all).collect();
    let Some(section) = section else {
        let integrator = Integrator::Default;
        let neighbours = NeighbourContacts::Unstated;
        return Ok(NetworkSettings { integrator, tolerance: None, merge_rate: MERGE_RATE, neighbours });
    };
    let integrator = section.choice("integrator", &choices)?.unwrap_or(Integrator::Default);
    let tolerance = section.number("tolerance", Quantity::within(1e-9, 10.0, "K"))?;
    let merge_rate = section.number("merge_rate", Quantity::positive("1/s"))?.unwrap_or(MERGE_RATE);
    let neighbours = neighbours(section, assumptions)?;
    Ok(NetworkSettings { integrator, tolerance, merge_rate, neighbours })
}

fn neighbours(section: &Section, assumptions: &mut Vec<String>) -> Result<NeighbourContacts, SceneError> {
    const PER_AREA: &str = "contact_conductance_per_area";
    const DISTANCE: &str = "contact_distance";
    let choices = [("auto", true), ("stated", false)];
    let per_area = section.number(PER_AREA, Quantity::positive("W/(m2 K)"))?;
    let distance = section.number(DISTANCE, Quantity::positive("m"))?;
    let auto = section.choice("contacts", &choices)?;
    let unused = [(PER_AREA, per_area), (DISTANCE, distance)].into_iter().find(|(_, value)| value.is_some());
    if let Some((key, _)) = unused.filter(|_| auto != Some(true)) {
        return Err(section.clash(key, &["contacts"], "needs contacts = \"auto\""));
    }
    match auto {
        Some(true) => {
            let within = distance.unwrap_or(CONTACT_DISTANCE);
            let per_area = per_area.unwrap_or_else(|| {
                assumptions.push(format!(
                    "Neighbours conduct {NEIGHBOUR_CONDUCTANCE} W/(m2 K) where they touch within {within} m \
                     (network.{PER_AREA} is absent)."
                ));
                NEIGHBOUR_CONDUCTANCE
            });
            Ok(NeighbourContacts::Auto { per_area, distance })
        }
        Some(false) => Ok(NeighbourContacts::Stated),
        None => Ok(NeighbourContacts::Unstated),
    }
}

pub(super) fn contacts(sections: &[Section], assumptions: &mut Vec<String>) -> Result<Vec<ContactRule>, SceneError> {
    sections.iter().map(|section| contact(section, assumptions)).collect()
}

fn contact(section: &Section, assumptions: &mut Vec<String>) -> Result<ContactRule, SceneError> {
    section.exclusive("between", "between_materials")?;
    let materials = section.has("between_materials");
    let key = if materials { "between_materials" } else { "between" };
    let names = section.required(key, section.strings(key)?, "the names of two parts, or of two glTF materials")?;
    let Ok([first, second]) = <[String; 2]>::try_from(names) else {
        return Err(section.error(key, "must name two, as [\"a\", \"b\"]"));
    };
    let owners = |name| if materials { OwnerPatterns::Materials(name) } else { OwnerPatterns::Parts(name) };
    section.exclusive("conductance", "conductance_per_area")?;
    let total = section.number("conductance", Quantity::positive("W/K"))?;
    let per_area = section.number("conductance_per_area", Quantity::positive("W/(m2 K)"))?;
    let conductance = match (total, per_area) {
        (Some(total), _) => ContactConductance::Total(total),
        (None, Some(per_area)) => ContactConductance::PerArea(per_area),
        (None, None) => {
            let message = "conductance [W/K] of the whole contact, or conductance_per_area [W/(m2 K)]";
            return Err(section.missing("conductance", &["conductance_per_area"], message));
        }
    };
    let distance = section.number("distance", Quantity::positive("m"))?.unwrap_or_else(|| {
        assumptions.push(format!(
            "Surfaces of '{first}' and '{second}' are in contact where they lie within {CONTACT_DISTANCE} m \
             (contact.distance is absent)."
        ));
        CONTACT_DISTANCE
    });
    Ok(ContactRule { between: [owners(first), owners(second)], distance, conductance })
}

pub(super) fn heaters(sections: &[Section], probes: &[Probe]) -> Result<Vec<MeshHeater>, SceneError> {
    sections.iter().map(|section| heater(section, probes)).collect()
}

fn heater(section: &Section, probes: &[Probe]) -> Result<MeshHeater, SceneError> {
    let parts = section.required("part", section.strings("part")?, "the names of the parts that are heated")?;
    let power = heat_table(section, "power")?;
    let power = section.required("power", power, "the heat [W]: a number, or { time = [..], power = [..] }")?;
    let on_below = section.number("on_below", Quantity::non_negative("K"))?;
    let off_above = section.number("off_above", Quantity::non_negative("K"))?;
    let initially_on = section.boolean("initially_on")?;
    let Some(name) = section.name("probe")? else {
        for key in ["on_below", "off_above", "initially_on"] {
            if section.has(key) {
                return Err(section.clash(
                    key,
                    &["probe"],
                    "needs 'probe', the name of the [[probe]] that the thermostat senses",
                ));
            }
        }
        return Ok(MeshHeater { parts, power, thermostat: None });
    };
    let Some(probe) = probes.iter().position(|probe| probe.name == name) else {
        let known = probes.iter().map(|probe| format!("'{}'", probe.name)).collect::<Vec<_>>().join(", ");
        return Err(section.clash(
            "probe",
            &["probe.*"],
            format!("there is no [[probe]] '{name}'; there are: {known}"),
        ));
    };
    let on_below = section.required("on_below", on_below, "the temperature below which the heater goes on [K]")?;
    let off_above = section.required("off_above", off_above, "the temperature above which it goes off [K]")?;
    if on_below >= off_above {
        return Err(section.clash(
            "off_above",
            &["on_below"],
            format!("must be above on_below, {on_below} K, found {off_above} K"),
        ));
    }
    if power.times.len() > 1 {
        return Err(section.clash(
            "power",
            &["probe"],
            "of a thermostat must be a number: it is switched, not scheduled",
        ));
    }
    let thermostat = HeaterThermostat { probe, on_below, off_above, initially_on: initially_on.unwrap_or(false) };
    Ok(MeshHeater { parts, power, thermostat: Some(thermostat) })
}
