//! Neighbours in the network that nothing joins.

use super::finding::{Finding, short};
use crate::scene::{CONTACT_DISTANCE, LISTED_DISTANCE, NEIGHBOUR_CONDUCTANCE, NeighbourContacts};
use crate::simulation::prepare::Prepared;
use crate::thermal::shell::{ApartBy, Neighbours};

/// Most pairs that a warning names.
pub(super) const NAMED: usize = 3;
/// Most pairs that the warning of a report names.
pub(crate) const NAMED_IN_REPORT: usize = 12;

/// Two neighbours without contact, by name.
#[derive(Debug, Clone, serde::Serialize)]
pub(crate) struct NeighbourFacts {
    /// Part and material of both.
    pub(crate) between: [[String; 2]; 2],
    pub(crate) apart_by: ApartBy,
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
            apart_by: pair.apart_by,
            area_m2: pair.area,
            length_m: pair.length,
            conductance_w_k: pair.conductance,
            remaining: pair.remaining,
        }
    }

    /// Both names, with what tells them apart.
    pub(crate) fn names(&self) -> String {
        let [[part, material], [other, other_material]] = &self.between;
        if part == other && material == other_material {
            format!("'{part}' ({material}) with itself")
        } else if part == other {
            format!("'{material}' and '{other_material}' of '{part}'")
        } else if material == other_material {
            format!("'{part}' and '{other}'")
        } else {
            format!("'{part}' ({material}) and '{other}' ({other_material})")
        }
    }

    /// Why nothing joins them.
    pub(crate) fn reason(&self) -> String {
        match self.apart_by {
            ApartBy::NoContact => "no contact".to_owned(),
            ApartBy::Gap => format!("a gap below {} mm", 1e3 * LISTED_DISTANCE),
            ApartBy::Response => "one is outside the network".to_owned(),
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
pub(crate) fn check(prepared: &Prepared, facts: &[NeighbourFacts], most: usize) -> Vec<Finding> {
    let named = |apart_by: ApartBy| {
        let pairs: Vec<&NeighbourFacts> = facts.iter().filter(|pair| pair.apart_by == apart_by).collect();
        (!pairs.is_empty()).then(|| in_words(&pairs, most))
    };
    let finding = |about: &str, message: String, remedy: String| Finding {
        check: "contacts",
        about: about.to_owned(),
        message,
        remedy,
    };
    let touching = |pairs: String| {
        finding(
            "network.contacts",
            format!(
                "neighbours touch, but no [[contact]] joins them, so they are isolated. With {NEIGHBOUR_CONDUCTANCE} W/(m2 K) {pairs}"
            ),
            "state contacts = \"auto\" in [network] to join all that touches, or \"stated\" if they are isolated"
                .to_owned(),
        )
    };
    let near = |pairs: String| {
        finding(
            "network.contact_distance",
            format!(
                "neighbours lie more than {CONTACT_DISTANCE} m and at most {LISTED_DISTANCE} m apart, so they are isolated. \
                 With {NEIGHBOUR_CONDUCTANCE} W/(m2 K) {pairs}"
            ),
            format!(
                "if they touch, state contacts = \"auto\" in [network] with a contact_distance that covers the gap; if not, \
                 contact_distance = {CONTACT_DISTANCE} or contacts = \"stated\""
            ),
        )
    };
    match prepared.scene.network.neighbours {
        NeighbourContacts::Unstated => {
            let touch = named(ApartBy::NoContact).map(touching);
            touch.into_iter().chain(named(ApartBy::Gap).map(near)).collect()
        }
        NeighbourContacts::Auto { distance: None, .. } => named(ApartBy::Gap).map(near).into_iter().collect(),
        NeighbourContacts::Auto { .. } | NeighbourContacts::Stated => Vec::new(),
    }
}

/// Some pairs in words: at most `most`, and where the rest is listed.
fn in_words(facts: &[&NeighbourFacts], most: usize) -> String {
    let pairs = facts.iter().take(most).map(|pair| {
        let left = 100.0 * pair.remaining;
        format!("{} over {} would keep {left:.1} % of their difference in temperature", pair.names(), pair.extent())
    });
    let pairs = pairs.collect::<Vec<_>>().join("; ");
    match facts.len().saturating_sub(most) {
        0 => pairs,
        1 => format!("{pairs}; and there is 1 more pair, which isotherm check lists"),
        more => format!("{pairs}; and there are {more} more pairs, which isotherm check lists"),
    }
}
