//! The order in which a device has the nodes of a network.
//!
//! Nodes come in groups of four, which one invocation handles. A unit is a block of nodes that conduct to each other, filled to whole groups with nodes that
//! have no block. Two blocks of two nodes make one unit. Units of like matrices stand beside each other, because these share their weights. Nodes without
//! conductors that are drawn once keep the groups of the drawn nodes. The other nodes are sorted by the length of their rows within windows. Nodes that
//! radiate to each other stand apart, because only they pay for it.

use std::collections::BTreeMap;

use super::sections::{OnePassKind, SECTIONS, Section};
use crate::model::nodes::GROUP;
use crate::thermal::network::one_pass::{Large, OnePassHeater, OnePassPlan};

/// A place without a node.
pub(super) const NONE: u32 = u32::MAX;
/// Nodes of a window, within which nodes outside blocks are sorted. It is small enough to keep neighbours close.
const WINDOW: usize = 512;
/// Set in the place of a source that is no drawn node.
pub(super) const UNDRAWN: u32 = 1 << 31;
/// A source without area, for a node that has fewer than others of its group.
pub(super) const NO_SOURCE: (u32, f32) = (UNDRAWN, 0.0);
/// Where drawn nodes heat a network: the network's node of each drawn node, or `NO_NODE`, and the area [m2].
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrawnNodes<'a> {
    /// Node of the network.
    pub(crate) nodes: &'a [u32],
    /// Area over which its flux heats the node [m2].
    pub(crate) areas: &'a [f64],
}

/// Blocks that share a run of groups.
pub(super) struct Unit {
    /// Matrices, and whether two blocks have them.
    pub(super) kind: (u32, bool),
    /// Nodes of the groups.
    pub(super) nodes: Vec<u32>,
    /// Whether some of them radiate to other nodes.
    pub(super) radiates: bool,
    /// Whether some of them are fast.
    pub(super) fast: bool,
    /// Whether they are in large blocks.
    pub(super) large: bool,
}

/// The nodes of a network in the order of a device.
pub(super) struct DeviceOrder {
    /// Node of each place, or `NONE`.
    pub(super) node_of_slot: Vec<u32>,
    /// Group after the last one of each of the [`SECTIONS`].
    pub(super) ends: [u32; SECTIONS.len()],
    /// Numbers of the groups of drawn nodes that are alone, in their order.
    pub(super) drawn_groups: Vec<u32>,
    /// Blocks with their matrices.
    pub(super) units: Vec<Unit>,
}

impl DeviceOrder {
    pub(super) fn new(plan: &OnePassPlan, drawn: DrawnNodes<'_>, sources: &[Vec<(u32, f32)>]) -> Self {
        let count = plan.network().len();
        let radiates: Vec<bool> =
            (0..count).map(|node| plan.weak_of(node).iter().any(|link| link.exchange_area > 0.0)).collect();
        let mut free: Vec<bool> = (0..count).map(|node| !plan.is_massless(node)).collect();
        plan.blocks().iter().flat_map(|block| &block.nodes).for_each(|node| free[*node as usize] = false);
        large_nodes(plan).iter().for_each(|node| free[*node as usize] = false);
        let alone = alone(plan, drawn, sources, &mut free);
        let mut singles: Vec<u32> = (0..count as u32).filter(|node| free[*node as usize]).collect();
        let is = |node: &u32| (radiates[*node as usize], plan.is_fast(*node as usize));
        let units = units(plan, &mut singles, is);
        let mut order = Self {
            node_of_slot: Vec::with_capacity(count),
            ends: [0; SECTIONS.len()],
            drawn_groups: Vec::new(),
            units,
        };
        for (number, section) in SECTIONS.into_iter().enumerate() {
            let Section { kind, radiative, fast, .. } = section;
            match kind {
                OnePassKind::Drive | OnePassKind::Conduct => order.take_units(section),
                OnePassKind::Advance => {
                    let nodes = singles.iter().copied().filter(|node| is(node) == (radiative, fast));
                    order.node_of_slot.extend(sorted_in_windows(plan, sources, nodes.collect()));
                }
                OnePassKind::Alone => {
                    let is_fast = |node: &u32| *node != NONE && plan.is_fast(*node as usize);
                    let groups = alone.iter().filter(|(nodes, _)| fast == nodes.iter().any(is_fast));
                    for (nodes, group) in groups {
                        order.node_of_slot.extend(nodes);
                        order.drawn_groups.push(*group);
                    }
                }
                OnePassKind::Balance => {
                    order.node_of_slot.extend((0..count as u32).filter(|node| plan.is_massless(*node as usize)));
                }
            }
            order.node_of_slot.resize(order.node_of_slot.len().next_multiple_of(GROUP), NONE);
            order.ends[number] = (order.node_of_slot.len() / GROUP) as u32;
        }
        order
    }

    fn take_units(&mut self, Section { radiative, fast, large, .. }: Section) {
        let units = self.units.iter().filter(|unit| (unit.radiates, unit.fast, unit.large) == (radiative, fast, large));
        self.node_of_slot.extend(units.flat_map(|unit| unit.nodes.iter().copied()));
    }
}

/// Nodes sorted by the length of their rows, the longest first, within windows.
fn sorted_in_windows(plan: &OnePassPlan, sources: &[Vec<(u32, f32)>], mut nodes: Vec<u32>) -> Vec<u32> {
    for window in nodes.chunks_mut(WINDOW) {
        let lengths = |node: u32| (plan.weak_of(node as usize).len(), sources[node as usize].len());
        window.sort_by_key(|node| std::cmp::Reverse(lengths(*node)));
    }
    nodes
}

/// Drawn nodes and heaters that heat each of `count` nodes: place among the drawn temperatures, and area [m2] or share. The power of a heater stands behind the
/// temperatures of the drawn nodes.
pub(super) fn sources(
    count: usize,
    drawn: DrawnNodes<'_>,
    heaters: &[OnePassHeater],
    first_power: u32,
) -> Vec<Vec<(u32, f32)>> {
    let mut sources = vec![Vec::new(); count];
    for (slot, (node, area)) in drawn.nodes.iter().zip(drawn.areas).enumerate() {
        // Drawn nodes outside the network heat nothing.
        if let Some(sources) = sources.get_mut(*node as usize) {
            sources.push((slot as u32, *area as f32));
        }
    }
    for (number, heater) in heaters.iter().enumerate() {
        for (node, share) in &heater.shares {
            sources[*node as usize].push(((first_power + number as u32) | UNDRAWN, *share as f32));
        }
    }
    sources
}

/// Groups of drawn nodes whose nodes are theirs alone and have no conductors: the nodes, and the number of the group. These nodes are no longer `free`.
fn alone(
    plan: &OnePassPlan,
    drawn: DrawnNodes<'_>,
    sources: &[Vec<(u32, f32)>],
    free: &mut [bool],
) -> Vec<([u32; GROUP], u32)> {
    let mut groups = Vec::new();
    for (number, group) in drawn.nodes.chunks(GROUP).enumerate() {
        let is_alone = |node: &u32| match sources.get(*node as usize) {
            Some(sources) => {
                let own = matches!(sources[..], [(at, _)] if at < UNDRAWN);
                free[*node as usize] && own && plan.weak_of(*node as usize).is_empty()
            }
            None => true,
        };
        let is_node = |node: u32| (node as usize) < sources.len();
        if let Ok(group) = <[u32; GROUP]>::try_from(group)
            && group.iter().any(|node| is_node(*node))
            && group.iter().all(is_alone)
        {
            group.iter().filter(|node| is_node(**node)).for_each(|node| free[*node as usize] = false);
            groups.push((group.map(|node| if is_node(node) { node } else { NONE }), number as u32));
        }
    }
    groups
}

/// Nodes of the large blocks of a plan.
fn large_nodes(plan: &OnePassPlan) -> &[u32] {
    plan.large().map_or(&[], Large::nodes)
}

/// The units of a plan, filled from slow `singles` that do not radiate to others. `is` tells whether a node does, and whether it is fast.
fn units(plan: &OnePassPlan, singles: &mut Vec<u32>, is: impl Fn(&u32) -> (bool, bool)) -> Vec<Unit> {
    let mut of_kind: BTreeMap<(usize, u32), Vec<&[u32]>> = BTreeMap::new();
    for block in plan.blocks() {
        of_kind.entry((block.nodes.len(), block.conduction)).or_default().push(&block.nodes);
    }
    let (mut fill, others): (Vec<u32>, Vec<u32>) = singles.iter().partition(|node| is(node) == (false, false));
    let mut units = Vec::new();
    for ((size, conduction), blocks) in of_kind {
        // Two pairs are one group.
        let at_once = if 2 * size == GROUP { 2 } else { 1 };
        for some in blocks.chunks(at_once) {
            let mut nodes = some.concat();
            let radiates = nodes.iter().any(|node| is(node).0);
            let fast = nodes.iter().any(|node| is(node).1);
            while nodes.len() % GROUP > 0 {
                nodes.push(fill.pop().unwrap_or(NONE));
            }
            units.push(Unit { kind: (conduction, some.len() == 2), nodes, radiates, fast, large: false });
        }
    }
    // Nodes of large blocks find each other by links, so the nodes of a section may stand together.
    for (radiates, fast) in [(false, false), (false, true), (true, false), (true, true)] {
        let own = large_nodes(plan).iter().copied().filter(|node| is(node) == (radiates, fast));
        let mut nodes: Vec<u32> = own.collect();
        nodes.resize(nodes.len().next_multiple_of(GROUP), NONE);
        units.push(Unit { kind: (0, false), nodes, radiates, fast, large: true });
    }
    *singles = others;
    singles.append(&mut fill);
    // Invocations that run together have loops of one length.
    units.sort_by_key(|unit| (unit.nodes.len(), unit.kind));
    units
}
