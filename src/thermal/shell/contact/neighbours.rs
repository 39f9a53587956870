//! Neighbours: parts and materials of a network that touch. Those without a stated contact are joined, or listed.

use std::collections::{BTreeMap, HashMap};

use super::super::merge::summed;
use super::super::{ApartBy, NO_NODE, Neighbours, ShellMaterial, ShellSurface};
use super::edges::edge_touches;
use super::faces::Faces;
use super::side::{ContactGroups, ContactSide, Group};
use super::{Contact, touches};
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::LinearConductor;

/// Temperature at which radiation is compared with conduction [K].
const AT: f64 = 300.0;

/// An area of contact below this share of the smaller surface is rounding.
const ROUNDING: f64 = 1e-9;

/// What is done with neighbours that no contact joins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NeighbourRule<'a> {
    /// Greatest distance between surfaces that touch [m]. They also touch where their sheets fill the gap.
    pub(crate) distance: f64,
    /// Greatest distance between surfaces that are listed as neighbours [m].
    pub(crate) listed_distance: f64,
    /// Conductance of each square metre in contact [W/(m2 K)].
    pub(crate) per_area: f64,
    /// Whether they are joined, unless a joint lies between them.
    pub(crate) join: bool,
    /// Joint of each part.
    pub(crate) joints: &'a [u32],
    /// All materials, those outside the network too.
    pub(crate) all: &'a [ShellMaterial],
}

/// Neighbours without contact, and the conductors of the pairs that the rule joins, with their number.
#[derive(Default)]
pub(crate) struct Touching {
    pub(crate) apart: Vec<Neighbours>,
    pub(crate) joined: usize,
    pub(crate) conductors: Vec<LinearConductor>,
}

/// Pairs that lie within a distance of each other.
struct Pairs {
    /// Areas of each pair's nodes [m2].
    shares: BTreeMap<ContactGroups, Vec<([u32; 2], f64)>>,
    /// Area of pairs that touch along edges alone [m2].
    along: HashMap<ContactGroups, f64>,
    /// Area of each part and material [m2].
    areas: HashMap<Group, f64>,
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

impl NeighbourRule<'_> {
    fn has_joint_between(&self, [a, b]: &ContactGroups) -> bool {
        self.joints[a[0] as usize] != self.joints[b[0] as usize]
    }
}

impl Pairs {
    fn within(distance: f64, side: &ContactSide, conducts: impl Fn(Group) -> bool) -> Self {
        let (sides, pieces) = ([side, side], side.pieces(conducts));
        let faces = Faces { sides, distance, pieces: Some(&pieces) }.find();
        let edges = edge_touches(sides, distance, &faces.met);
        let along = edges.iter().fold(HashMap::new(), |mut along, touch| {
            *along.entry(touch.owners).or_default() += touch.area;
            along
        });
        let mut shares: BTreeMap<ContactGroups, Vec<([u32; 2], f64)>> = BTreeMap::new();
        for touch in touches(faces, edges).filter(|touch| touch.nodes[0] != touch.nodes[1]) {
            let [a, b] = touch.nodes;
            shares.entry(touch.owners).or_default().push(([a.min(b), a.max(b)], touch.area));
        }
        let areas = side.areas_of_groups();
        shares.retain(|groups, shares| {
            let whole = groups.map(|group| areas.get(&group).copied().unwrap_or(0.0));
            shares.iter().map(|(_, area)| area).sum::<f64>() > ROUNDING * whole[0].min(whole[1])
        });
        Self { shares, along, areas }
    }

    /// A pair that nothing joins.
    fn apart(&self, groups: &ContactGroups, apart_by: ApartBy, rule: &NeighbourRule) -> Neighbours {
        let material = |group: Group| rule.all[group[1] as usize];
        let radiation = |group: Group| {
            4.0 * material(group).emissivity * STEFAN_BOLTZMANN * AT.powi(3) * self.areas.get(&group).unwrap_or(&0.0)
        };
        let area: f64 = self.shares[groups].iter().map(|(_, area)| area).sum();
        let thickness = groups.map(|group| material(group).inner().thickness);
        let conductance = rule.per_area * area;
        Neighbours {
            groups: *groups,
            apart_by,
            area,
            length: self.along.get(groups).map(|area| area / thickness[0].min(thickness[1])),
            conductance,
            // In balance two nodes with the radiative conductances g and h, joined by G, keep 1 / (1 + G (1/g + 1/h)) of their difference.
            remaining: 1.0 / (1.0 + conductance * groups.map(|group| 1.0 / radiation(group)).iter().sum::<f64>()),
        }
    }
}

/// The neighbours that none of the contacts names. Those that touch are joined where the rule says so. Others are told.
pub(crate) fn touching(
    surface: &ShellSurface,
    materials: &[Option<ShellMaterial>],
    node: &[u32],
    contacts: &[Contact],
    rule: &NeighbourRule,
) -> Touching {
    let mut touching = Touching::default();
    let side = ContactSide::new(surface, materials, node, |_| true);
    let pairs = Pairs::within(rule.distance, &side, |group| rule.all[group[1] as usize].inner().conductance > 0.0);
    let is_named = |groups: &ContactGroups| contacts.iter().any(|contact| contact.names(groups));
    for (groups, shares) in pairs.shares.iter().filter(|(groups, _)| !is_named(groups)) {
        if rule.join && !rule.has_joint_between(groups) {
            let conductor =
                |(nodes, area): ([u32; 2], f64)| LinearConductor { nodes, conductance: rule.per_area * area };
            touching.conductors.extend(summed(shares.clone()).into_iter().map(conductor));
            touching.joined += 1;
        } else {
            touching.apart.push(pairs.apart(groups, ApartBy::NoContact, rule));
        }
    }
    if rule.listed_distance > rule.distance {
        let listed = listed(surface, materials, node, rule, &pairs);
        touching.apart.extend(listed.into_iter().filter(|pair| !is_named(&pair.groups)));
    }
    touching.apart.sort_by(|a, b| a.remaining.total_cmp(&b.remaining));
    touching
}

/// Pairs that are told and never joined: with a gap between them, or with one of them outside the network.
fn listed(
    surface: &ShellSurface,
    materials: &[Option<ShellMaterial>],
    node: &[u32],
    rule: &NeighbourRule,
    touching: &Pairs,
) -> Vec<Neighbours> {
    let all: Vec<Option<ShellMaterial>> = rule.all.iter().copied().map(Some).collect();
    let of_network = node.iter().filter(|node| **node != NO_NODE).max().map_or(0, |last| *last + 1);
    let numbers = node.iter().zip(of_network..).map(|(node, other)| if *node == NO_NODE { other } else { *node });
    let numbers: Vec<u32> = numbers.collect();
    let side = ContactSide::new(surface, &all, &numbers, |_| true);
    let pairs = Pairs::within(rule.listed_distance, &side, |_| false);
    let why = |groups: &ContactGroups| match groups.map(|[_, material]| materials[material as usize].is_some()) {
        [true, true] => {
            (!touching.shares.contains_key(groups) && !rule.has_joint_between(groups)).then_some(ApartBy::Gap)
        }
        [false, false] => None,
        _ => Some(ApartBy::Response),
    };
    pairs.shares.keys().filter_map(|groups| Some(pairs.apart(groups, why(groups)?, rule))).collect()
}
