//! Converts a network file to an ESATAN TMD file.

use std::collections::HashSet;

use glam::DVec3;

use super::NetworkFile;
use crate::scene::tmd::{Conductors, Tmd, TmdNode};
use crate::thermal::network::schedule::HeatTable;
use crate::thermal::network::{Network, NodeKind};

/// Number of the node of space, as ESATAN's users write it.
const SPACE: i64 = 99_999;

/// Temperatures of all nodes of a network over time.
#[derive(Debug, Clone, Copy)]
pub struct TmdSolution<'a> {
    /// Times [s], ascending.
    pub times: &'a [f64],
    /// Temperatures of all nodes at each time [K].
    pub rows: &'a [Vec<f64>],
}

impl TmdSolution<'_> {
    /// Temperature of a node at a time [K], linear between its times and held beyond them.
    fn at(&self, node: usize, time: f64) -> f64 {
        let next = self.times.partition_point(|known| *known < time);
        match (next.checked_sub(1), self.times.get(next)) {
            (Some(last), Some(to)) => {
                let (from, before, after) = (self.times[last], self.rows[last][node], self.rows[next][node]);
                before + (after - before) * (time - from) / (to - from)
            }
            (Some(last), None) => self.rows[last][node],
            (None, _) => self.rows[0][node],
        }
    }
}

/// The TMD of a network, and notes about the differences. Without a solution all temperatures are start temperatures.
pub fn tmd(file: &NetworkFile, description: &str, solved: Option<TmdSolution>) -> (Tmd, Vec<String>) {
    let network = &file.network;
    let heat = file.schedule.heat_of_nodes(network.len());
    let mut notes = Vec::new();
    let times = list_times(file, solved, &heat, &mut notes);
    if solved.is_none() {
        notes.push("All temperatures are those of the start: --series FILE.csv gives those of a solution.".to_owned());
    }
    let numbers = numbers(&file.labels);
    let everywhen = |value: f64| vec![value; times.len()];
    let node = |number: i64, label: &str, kind: char| TmdNode {
        number,
        name: number.to_string(),
        label: label.to_owned(),
        kind,
        position: DVec3::ZERO,
        temperatures: Vec::new(),
        capacitances: everywhen(0.0),
        loads: [0; 5].map(|_| everywhen(0.0)),
    };
    let mut nodes = Vec::with_capacity(network.len() + 1);
    for (at, label) in file.labels.iter().enumerate() {
        let kind = if network.kinds[at] == NodeKind::Boundary { 'B' } else { 'D' };
        let mut node = node(numbers[at], label, kind);
        node.temperatures = match solved {
            Some(solved) => times.iter().map(|time| solved.at(at, *time)).collect(),
            None => everywhen(network.temperatures[at]),
        };
        if network.kinds[at] == NodeKind::Diffusive {
            node.capacitances = everywhen(network.capacitances[at]);
        }
        if let Some(table) = &heat[at] {
            node.loads[2] = times.iter().map(|time| table.after(*time).0).collect();
        }
        nodes.push(node);
    }
    let mut linear = Conductors::default();
    for conductor in &network.linear {
        linear.nodes.push(conductor.nodes);
        linear.values.push(conductor.conductance);
    }
    let radiative = list_radiative(network, nodes.len() as u32);
    if radiative.values.len() > network.radiative.len() {
        let number = if numbers.contains(&SPACE) { numbers.iter().max().map_or(1, |most| most + 1) } else { SPACE };
        let mut space = node(number, "SPACE", 'B');
        space.temperatures = everywhen(network.space_temperature);
        nodes.push(space);
        notes.push(format!("Space is boundary node {number}, and each emissive_area a GR to it."));
    }
    if numbers.iter().zip(&file.labels).any(|(number, label)| number.to_string() != *label) {
        notes.push("Nodes have numbers in a TMD. A label that is no number stands beside one.".to_owned());
    }
    for thermostat in &file.schedule.thermostats {
        notes.push(format!(
            "The thermostat of '{}', {} W from {} to {} K, is left out: a TMD holds none.",
            file.labels[thermostat.node as usize], thermostat.power, thermostat.on_below, thermostat.off_above
        ));
    }
    (Tmd { description: description.to_owned(), times, nodes, linear, radiative, notes: Vec::new() }, notes)
}

/// Times of the solution, or of the network's schedule, and of every bend and jump of the heat.
fn list_times(
    file: &NetworkFile,
    solved: Option<TmdSolution>,
    heat: &[Option<HeatTable>],
    notes: &mut Vec<String>,
) -> Vec<f64> {
    let asked = &file.schedule.times;
    let mut times = match solved {
        Some(solved) => solved.times.to_vec(),
        None if asked.is_empty() => vec![0.0],
        None => asked.clone(),
    };
    let (count, first) = (times.len(), times[0]);
    for table in heat.iter().flatten() {
        for time in table.times.iter().copied().filter(|time| *time > first) {
            if table.before(time) != table.after(time).0 {
                times.push(time.next_down());
            }
            times.push(time);
        }
    }
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    if times.len() > count {
        notes.push(format!(
            "{} times are added where the heat bends or jumps; a jump takes place within the last digit of its time.",
            times.len() - count
        ));
    }
    times
}

/// The radiative conductors, with a conductor to the node `space` for every area that emits there.
fn list_radiative(network: &Network, space: u32) -> Conductors {
    let mut radiative = Conductors::default();
    for conductor in &network.radiative {
        radiative.nodes.push(conductor.nodes);
        radiative.values.push(conductor.exchange_area);
    }
    let open = |at: &usize| network.emissive_areas[*at] > 0.0 && network.kinds[*at] != NodeKind::Boundary;
    for at in (0..network.len()).filter(open) {
        radiative.nodes.push([at as u32, space]);
        radiative.values.push(network.emissive_areas[at]);
    }
    radiative
}

/// A number for each label: its own where it is one, otherwise the next that is free.
fn numbers(labels: &[String]) -> Vec<i64> {
    let number = |label: &String| {
        let number: i64 = label.parse().ok()?;
        ((1..=i64::from(i32::MAX)).contains(&number) && number.to_string() == *label).then_some(number)
    };
    let taken: HashSet<i64> = labels.iter().filter_map(number).collect();
    let mut free = (1..).filter(|number| !taken.contains(number));
    labels.iter().map(|label| number(label).or_else(|| free.next()).unwrap_or_default()).collect()
}
