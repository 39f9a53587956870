//! Neighbours in the network that nothing joins.

use super::finding::{Finding, short};
use crate::scene::{NEIGHBOUR_CONDUCTANCE, NeighbourContacts};
use crate::simulation::prepare::Prepared;
use crate::thermal::shell::Neighbours;

/// Most pairs that a warning names.
pub(super) const NAMED: usize = 3;
/// Most pairs that the warning of a report names.
pub(crate) const NAMED_IN_REPORT: usize = 12;

/// Two neighbours without contact, by name.
#[derive(Debug, Clone, serde::Serialize)]
pub(crate) struct NeighbourFacts {
    /// Part and material of both.
    pub(crate) between: [[String; 2]; 2],
    /// Area in contact [m2]. Along edges: the length times the thinner thickness.
    pub(crate) area_m2: f64,
    /// Length in contact [m], where they touch along edges alone.
    pub(crate) length_m: Option<f64>,
    /// Conductance of 300 W/(m2 K), or of the network's own conductance per area [W/K].
    pub(crate) conductance_w_k: f64,
    /// Share of a difference in temperature that it would leave.
    pub(crate) remaining: f64,
}

impl NeighbourFacts {
    fn new(prepared: &Prepared, pair: &Neighbours) -> Self {
        let name = |[part, material]: [u32; 2]| {
            [prepared.parts[part as usize].clone(), prepared.materials[material as usize].name.clone()]
        };
        Self {
            between: pair.groups.map(name),
            area_m2: pair.area,
            length_m: pair.length,
            conductance_w_k: pair.conductance,
            remaining: pair.remaining,
        }
    }

    /// Both names, with what tells them apart.
    pub(crate) fn names(&self) -> String {
        let [[part, material], [other, other_material]] = &self.between;
        if part == other {
            format!("'{material}' and '{other_material}' of '{part}'")
        } else if material == other_material {
            format!("'{part}' and '{other}'")
        } else {
            format!("'{part}' ({material}) and '{other}' ({other_material})")
        }
    }

    /// The length or the area in contact.
    pub(crate) fn extent(&self) -> String {
        self.length_m.map_or_else(|| format!("{} m2", short(self.area_m2)), |length| format!("{} m", short(length)))
    }
}

pub(super) fn facts(prepared: &Prepared) -> Vec<NeighbourFacts> {
    let neighbours = prepared.network.iter().flat_map(|network| &network.shell.summary.neighbours);
    neighbours.map(|pair| NeighbourFacts::new(prepared, pair)).collect()
}

/// Warns of neighbours where the scene says nothing of them, and names at most `most` pairs.
pub(crate) fn check(prepared: &Prepared, facts: &[NeighbourFacts], most: usize) -> Option<Finding> {
    if facts.is_empty() || prepared.scene.network.neighbours != NeighbourContacts::Unstated {
        return None;
    }
    let pairs = facts.iter().take(most).map(|pair| {
        let left = 100.0 * pair.remaining;
        format!("{} over {} would keep {left:.1} % of their difference in temperature", pair.names(), pair.extent())
    });
    let pairs: Vec<String> = pairs.collect();
    let more = facts.len().saturating_sub(most);
    let more = match more {
        0 => String::new(),
        1 => "; and there is 1 more pair".to_owned(),
        more => format!("; and there are {more} more pairs"),
    };
    Some(Finding {
        check: "contacts",
        about: "network.contacts".to_owned(),
        message: format!(
            "neighbours touch, but no [[contact]] joins them, so they are isolated. With {NEIGHBOUR_CONDUCTANCE} W/(m2 K) {}{more}",
            pairs.join("; ")
        ),
        remedy: "state contacts = \"auto\" in [network] to join all that touches, or \"stated\" if they are isolated; isotherm check lists all"
            .to_owned(),
    })
}
