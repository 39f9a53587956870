//! A thermal network that is stepped in one pass within a scene's frames: its tables in the device's order.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::heaters;
use super::order::{DeviceOrder, DrawnNodes, NO_SOURCE, NONE, Unit, sources};
use super::sections::{OnePassKind, OnePassShape, SECTIONS, Section};
use crate::model::nodes::GROUP;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::one_pass::{Conduction, ExchangeLink, OnePassHeater, OnePassPlan};

/// Weights of four nodes in a tile: four columns of drives and four of temperatures.
const COLUMNS: usize = 8;

/// Places of a group.
const PLACES: [usize; GROUP] = [0, 1, 2, 3];

/// The tables of a network.
#[derive(Debug, Clone)]
pub struct OnePassTables {
    /// The plan of the scene's step.
    pub(crate) plan: Arc<OnePassPlan>,
    /// Length of a step of the scene [s].
    pub(crate) step: f64,
    /// What the frame lists depend on.
    pub(crate) shape: OnePassShape,
    /// Place of each node.
    pub(crate) slot_of_node: Vec<u32>,
    /// 1 / C and emission of each group.
    pub(super) nodes: Vec<[f32; 4]>,
    /// Range of the links and of the sources of each group.
    pub(super) rows: Vec<[u32; 4]>,
    /// Neighbours and conductances.
    pub(super) links: Vec<[u32; 4]>,
    /// Drawn nodes and areas.
    pub(super) sources: Vec<[u32; 4]>,
    /// Range of the unit of each group in blocks, its first weight, and the factors of its nodes. In large blocks, range of the links inside.
    pub(super) units: Vec<[u32; 4]>,
    /// Kinds of units with matrices, in the order of their weights.
    kinds: Vec<(u32, bool)>,
    /// Columns of groups that each row of groups of a kind exchanges heat with.
    bands: Vec<Vec<[usize; 2]>>,
    weights: usize,
    /// Estimated error above which the step is halved [K].
    pub(crate) tolerance: f64,
    /// Heaters.
    pub(crate) heaters: Vec<OnePassHeater>,
    /// Place of the first heater's power among the temperatures of drawn nodes.
    first_power: u32,
}

impl OnePassTables {
    /// The tables of a plan.
    pub(crate) fn new(
        plan: &Arc<OnePassPlan>,
        step: f64,
        drawn: DrawnNodes<'_>,
        heaters: Vec<OnePassHeater>,
        tolerance: f64,
    ) -> Self {
        let count = plan.network().len();
        let first_power = drawn.nodes.len() as u32;
        let sources = sources(count, drawn, &heaters, first_power);
        let order = DeviceOrder::new(plan, drawn, &sources);
        let mut slot_of_node = vec![0; count];
        for (slot, node) in order.node_of_slot.iter().enumerate().filter(|(_, node)| **node != NONE) {
            slot_of_node[*node as usize] = slot as u32;
        }
        let shape = OnePassShape { ends: order.ends, heaters: heaters.len() as u32 };
        let (plan, nothing) = (Arc::clone(plan), Vec::new);
        let mut tables = Self {
            plan,
            step,
            shape,
            slot_of_node,
            nodes: Vec::with_capacity(2 * shape.groups() as usize),
            rows: Vec::with_capacity(shape.groups() as usize),
            links: nothing(),
            sources: nothing(),
            units: nothing(),
            kinds: Vec::new(),
            bands: Vec::new(),
            weights: 0,
            tolerance,
            heaters,
            first_power,
        };
        let mut drawn_groups = order.drawn_groups.iter();
        for (section, end) in SECTIONS.iter().zip(order.ends) {
            for group in order.node_of_slot[GROUP * tables.rows.len()..GROUP * end as usize].chunks(GROUP) {
                match section.kind {
                    OnePassKind::Alone => tables.take_alone(group, &sources, drawn_groups.next().map_or(0, |at| *at)),
                    _ => tables.take_group(group, &sources, section.radiative),
                }
            }
        }
        tables.take_units(&order.units);
        // An empty table also needs a buffer to bind.
        for table in [&mut tables.links, &mut tables.sources] {
            table.resize(table.len().max(1), [0; 4]);
        }
        tables
    }

    fn take_nodes(&mut self, group: &[u32]) {
        let plan = Arc::clone(&self.plan);
        let network = plan.network();
        let of_node = |value: &dyn Fn(usize) -> f64| {
            PLACES.map(|place| if group[place] == NONE { 0.0 } else { value(group[place] as usize) as f32 })
        };
        let inverse = |node: usize| if plan.is_massless(node) { 0.0 } else { 1.0 / network.capacitances[node] };
        self.nodes.push(of_node(&inverse));
        self.nodes.push(of_node(&|node| STEFAN_BOLTZMANN * network.emissive_areas[node]));
    }

    /// Takes nodes without conductors that form a group of drawn nodes.
    fn take_alone(&mut self, group: &[u32], sources: &[Vec<(u32, f32)>], drawn: u32) {
        self.take_nodes(group);
        let area = |place: usize| if group[place] == NONE { 0.0 } else { sources[group[place] as usize][0].1 };
        self.rows.push([0, 0, self.sources.len() as u32, drawn]);
        self.sources.push(PLACES.map(|place| area(place).to_bits()));
    }

    /// Takes nodes with their links and sources.
    fn take_group(&mut self, group: &[u32], sources: &[Vec<(u32, f32)>], radiative: bool) {
        self.take_nodes(group);
        let plan = Arc::clone(&self.plan);
        let begin = [self.links.len(), self.sources.len()];
        let links = |place: usize| if group[place] == NONE { &[][..] } else { plan.weak_of(group[place] as usize) };
        let sources = |place: usize| if group[place] == NONE { &[][..] } else { &sources[group[place] as usize][..] };
        self.take_links(group, links, radiative);
        for at in 0..PLACES.map(|place| sources(place).len()).into_iter().max().unwrap_or(0) {
            let source = |place: usize| sources(place).get(at).copied().unwrap_or(NO_SOURCE);
            self.sources.push(PLACES.map(|place| source(place).0));
            self.sources.push(PLACES.map(|place| source(place).1.to_bits()));
        }
        let end = [self.links.len(), self.sources.len()];
        self.rows.push([begin[0], end[0], begin[1], end[1]].map(|at| at as u32));
    }

    fn take_units(&mut self, units: &[Unit]) {
        let plan = Arc::clone(&self.plan);
        let network = plan.network();
        let mut factors = vec![0.0f32; network.len()];
        for block in plan.blocks() {
            for node in &block.nodes {
                factors[*node as usize] = (block.capacitance / network.capacitances[*node as usize]) as f32;
            }
        }
        let mut known = BTreeMap::new();
        let mut first = 0;
        let blocks = SECTIONS.into_iter().filter(|section| section.kind == OnePassKind::Drive);
        let of = |section: Section| {
            let Section { radiative, fast, large, .. } = section;
            units.iter().filter(move |unit| (unit.radiates, unit.fast, unit.large) == (radiative, fast, large))
        };
        for unit in blocks.flat_map(of) {
            let groups = unit.nodes.len() / GROUP;
            if unit.large {
                unit.nodes.chunks(GROUP).for_each(|group| self.take_strong(group));
                first += groups;
                continue;
            }
            let (number, mut weight) = *known.entry(unit.kind).or_insert_with(|| {
                let (conduction, twice) = unit.kind;
                let bands = bands(&plan.conductions()[conduction as usize], twice);
                let begin = self.weights;
                self.weights += bands.iter().map(|[from, to]| COLUMNS * (to - from)).sum::<usize>();
                self.kinds.push(unit.kind);
                self.bands.push(bands);
                (self.kinds.len() - 1, begin)
            });
            for (nodes, [from, to]) in unit.nodes.chunks(GROUP).zip(&self.bands[number]) {
                self.units.push([first + from, first + to, weight, 0].map(|at| at as u32));
                let factor = |place: usize| if nodes[place] == NONE { 0.0 } else { factors[nodes[place] as usize] };
                self.units.push(PLACES.map(|place| factor(place).to_bits()));
                weight += COLUMNS * (to - from);
            }
            first += groups;
        }
    }

    /// Takes the links of a group inside its large blocks.
    fn take_strong(&mut self, group: &[u32]) {
        let plan = Arc::clone(&self.plan);
        let links = |place: usize| match plan.large() {
            Some(large) if group[place] != NONE => large.links_of(group[place] as usize),
            _ => &[],
        };
        let begin = self.links.len();
        self.take_links(group, links, false);
        self.units.push([begin, self.links.len(), 0, 0].map(|at| at as u32));
        self.units.push([0; 4]);
    }

    /// Takes the links of four nodes: the neighbours, the conductances, and if `radiative` the radiative conductances. All rows have the length of the longest.
    fn take_links<'a>(&mut self, group: &[u32], links: impl Fn(usize) -> &'a [ExchangeLink], radiative: bool) {
        let itself = |place: usize| if group[place] == NONE { 0 } else { self.slot_of_node[group[place] as usize] };
        for at in 0..PLACES.map(|place| links(place).len()).into_iter().max().unwrap_or(0) {
            let link = |place: usize| links(place).get(at);
            let slot = |place| link(place).map_or(itself(place), |link| self.slot_of_node[link.neighbour as usize]);
            let bits = |value: f64| (value as f32).to_bits();
            let conductance = |place| bits(link(place).map_or(0.0, |link| link.conductance));
            let exchange = |place| bits(link(place).map_or(0.0, |link| STEFAN_BOLTZMANN * link.exchange_area));
            let words = [PLACES.map(slot), PLACES.map(conductance), PLACES.map(exchange)];
            self.links.extend(&words[..if radiative { 3 } else { 2 }]);
        }
    }

    /// Weights of all kinds of units for a plan of any length of step.
    pub(crate) fn weights(&self, plan: &OnePassPlan) -> Vec<[f32; 4]> {
        let mut weights = Vec::with_capacity(self.weights);
        for ((conduction, twice), bands) in self.kinds.iter().zip(&self.bands) {
            let conduction = &plan.conductions()[*conduction as usize];
            let size = conduction.size();
            let count = if *twice { 2 } else { 1 };
            // Places of different blocks, and filled places, exchange nothing.
            let at = |row: usize, column: usize| {
                let joined = row / size == column / size && row / size < count;
                if joined { conduction.at(row % size, column % size) } else { [0.0; 2] }
            };
            let tiles =
                bands.iter().enumerate().flat_map(|(row, [from, to])| (*from..*to).map(move |column| (row, column)));
            for (row, column) in tiles.map(|(row, column)| (GROUP * row, GROUP * column)) {
                for matrix in [0, 1] {
                    let value = |row, column| at(row, column)[matrix] as f32;
                    weights.extend((0..GROUP).map(|k| PLACES.map(|place| value(row + place, column + k))));
                }
            }
        }
        weights
    }

    /// The table of the heaters for a plan of any length of step.
    pub(crate) fn heater_words(&self, plan: &OnePassPlan) -> Vec<[u32; 4]> {
        heaters::words(&self.heaters, plan, |node| self.slot_of_node[node as usize], self.first_power)
    }

    /// Number of weights of all kinds of units.
    pub(super) fn weight_count(&self) -> usize {
        self.weights
    }

    /// Values of the nodes in the order of the device.
    pub(crate) fn in_slots(&self, values: impl Iterator<Item = f32>) -> Vec<f32> {
        let mut slots = vec![0.0; GROUP * self.shape.groups() as usize];
        for (slot, value) in self.slot_of_node.iter().zip(values) {
            slots[*slot as usize] = value;
        }
        slots
    }
}

/// First column of groups that each row of groups of a unit exchanges heat with, and the one after the last. `twice`: the unit is two blocks.
fn bands(conduction: &Conduction, twice: bool) -> Vec<[usize; 2]> {
    if twice {
        // Two pairs are one group.
        return vec![[0, 1]];
    }
    let rows: Vec<usize> = (0..conduction.size()).collect();
    let band = |rows: &[usize]| {
        let columns = rows.iter().map(|row| conduction.columns(*row)).filter(|[first, end]| first < end);
        let whole = columns.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        whole.map_or([0, 0], |[first, end]| [first / GROUP, end.div_ceil(GROUP)])
    };
    rows.chunks(GROUP).map(band).collect()
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
