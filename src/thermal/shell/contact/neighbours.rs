//! Neighbours: parts and materials of a network that touch. Those without a stated contact are joined, or listed.

use std::collections::{BTreeMap, HashMap};

use super::super::merge::summed;
use super::super::{Neighbours, ShellMaterial, ShellSurface};
use super::edges::edge_touches;
use super::faces::Faces;
use super::side::{ContactGroups, ContactSide, Group};
use super::{Contact, touches};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::LinearConductor;

/// Temperature at which radiation is compared with conduction [K].
const AT: f64 = 300.0;

/// What is done with neighbours that no contact joins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NeighbourRule<'a> {
    /// Greatest distance between the surfaces [m]. Faces that look away from each other also touch where their sheets fill the gap.
    pub(crate) distance: f64,
    /// Conductance of each square metre in contact [W/(m2 K)].
    pub(crate) per_area: f64,
    /// Whether they are joined, unless a joint lies between them.
    pub(crate) join: bool,
    /// Joint of each part.
    pub(crate) joints: &'a [u32],
}

/// Neighbours without contact, and the conductors of the pairs that the rule joins, with their number.
pub(crate) struct Touching {
    pub(crate) apart: Vec<Neighbours>,
    pub(crate) joined: usize,
    pub(crate) conductors: Vec<LinearConductor>,
}

impl Contact {
    /// Whether the contact names a pair of parts and materials.
    fn names(&self, groups: &ContactGroups) -> bool {
        let has = |side: usize, [part, material]: Group| {
            let selection = &self.between[side];
            selection.parts[part as usize] && selection.materials[material as usize]
        };
        [[0, 1], [1, 0]].into_iter().any(|[a, b]| has(a, groups[0]) && has(b, groups[1]))
    }
}

/// The neighbours that none of the contacts names.
pub(crate) fn touching(
    surface: &ShellSurface,
    materials: &[Option<ShellMaterial>],
    node: &[u32],
    contacts: &[Contact],
    rule: &NeighbourRule,
) -> Touching {
    let mut touching = Touching { apart: Vec::new(), joined: 0, conductors: Vec::new() };
    let side = ContactSide::new(surface, materials, node, |_| true);
    let areas = side.areas_of_groups();
    if areas.len() < 2 {
        return touching;
    }
    let sides = [&side, &side];
    let faces = Faces { sides, distance: rule.distance, back_to_back: true }.find();
    let edges = edge_touches(sides, rule.distance, &faces.met);
    let along: HashMap<ContactGroups, f64> = edges.iter().fold(HashMap::new(), |mut along, touch| {
        *along.entry(touch.owners).or_default() += touch.area;
        along
    });
    let mut pairs: BTreeMap<ContactGroups, Vec<([u32; 2], f64)>> = BTreeMap::new();
    for touch in touches(faces, edges) {
        let [a, b] = touch.nodes;
        pairs.entry(touch.owners).or_default().push(([a.min(b), a.max(b)], touch.area));
    }
    let material = |group: Group| materials[group[1] as usize].unwrap_or_default();
    let radiation = |group: Group| {
        4.0 * material(group).emissivity * STEFAN_BOLTZMANN * AT.powi(3) * areas.get(&group).unwrap_or(&0.0)
    };
    for (groups, shares) in pairs {
        let area: f64 = shares.iter().map(|(_, area)| area).sum();
        if area <= 0.0 || contacts.iter().any(|contact| contact.names(&groups)) {
            continue;
        }
        if rule.join && rule.joints[groups[0][0] as usize] == rule.joints[groups[1][0] as usize] {
            let conductor =
                |(nodes, area): ([u32; 2], f64)| LinearConductor { nodes, conductance: rule.per_area * area };
            touching.conductors.extend(summed(shares).into_iter().map(conductor));
            touching.joined += 1;
            continue;
        }
        let thickness = groups.map(|group| material(group).inner().thickness);
        let conductance = rule.per_area * area;
        touching.apart.push(Neighbours {
            groups,
            area,
            length: along.get(&groups).map(|area| area / thickness[0].min(thickness[1])),
            conductance,
            // In balance two nodes with the radiative conductances g and h, joined by G, keep 1 / (1 + G (1/g + 1/h)) of their difference.
            remaining: 1.0 / (1.0 + conductance * groups.map(|group| 1.0 / radiation(group)).iter().sum::<f64>()),
        });
    }
    touching.apart.sort_by(|a, b| a.remaining.total_cmp(&b.remaining));
    touching
}
