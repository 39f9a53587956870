//! Converts an ESATAN TMD file to a network file.

use super::NetworkFile;
use crate::scene::quantity::Quantity;
use crate::scene::tmd::{Conductors, Tmd};
use crate::thermal::network::schedule::{HeatTable, Schedule};
use crate::thermal::network::{LinearConductor, Network, NodeKind, RadiativeConductor};

const NAMED: usize = 10;

/// A network, and notes about differences from the TMD file.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedTmd {
    /// The network.
    pub file: NetworkFile,
    /// Label of each node in the TMD file.
    pub comments: Vec<String>,
    /// One sentence for each assumption and omission.
    pub notes: Vec<String>,
}

/// The network of a TMD file, with times that begin at 0.
///
/// # Errors
/// A message if no node is active, or if a label is in use.
pub fn network(tmd: &Tmd) -> Result<ImportedTmd, String> {
    let mut notes = tmd.notes.clone();
    let start = tmd.times[0];
    if start != 0.0 {
        notes.push(format!("Its times begin at {start} s, which is time 0 here."));
    }
    let times: Vec<f64> = tmd.times.iter().map(|time| time - start).collect();
    let mut number = vec![None; tmd.nodes.len()];
    let (mut labels, mut comments, mut network, mut heat) = (Vec::new(), Vec::new(), Network::default(), Vec::new());
    let (mut inactive, mut moving, mut storing, mut tiny) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut most = [0.0_f64; 5];
    for (place, node) in tmd.nodes.iter().enumerate() {
        if node.kind == 'X' {
            inactive.push(format!("{} ({})", node.name, node.label));
            continue;
        }
        let mut capacitance = node.capacitances[0];
        if capacitance > 0.0 && node.kind != 'B' && Quantity::non_negative("J/K").check(capacitance) == Ok(0.0) {
            tiny.push(format!("{} ({capacitance} J/K)", node.name));
            capacitance = 0.0;
        }
        if capacitance < 0.0 {
            return Err(format!("node {} has the capacitance {capacitance} J/K, which is below 0", node.name));
        }
        let kind = match node.kind {
            'B' => NodeKind::Boundary,
            _ if capacitance == 0.0 => NodeKind::Arithmetic,
            'A' => return Err(format!("node {} is of type A and stores {capacitance} J/K", node.name)),
            _ => NodeKind::Diffusive,
        };
        let changes = |values: &[f64]| values.iter().any(|value| *value != values[0]);
        if kind == NodeKind::Boundary && changes(&node.temperatures) {
            moving.push(node.name.clone());
        }
        if kind != NodeKind::Boundary && changes(&node.capacitances) {
            storing.push(node.name.clone());
        }
        for (most, load) in most.iter_mut().zip(&node.loads) {
            *most = load.iter().fold(*most, |most, watts| most.max(watts.abs()));
        }
        number[place] = Some(labels.len() as u32);
        if let Some(table) = heat_of(&times, &node.loads) {
            heat.push((labels.len() as u32, table));
        }
        labels.push(node.name.clone());
        comments.push(node.label.clone());
        network.kinds.push(kind);
        network.capacitances.push(if kind == NodeKind::Diffusive { capacitance } else { 0.0 });
        network.emissive_areas.push(0.0);
        network.temperatures.push(node.temperatures[0]);
    }
    if labels.is_empty() {
        return Err("no node is active".to_owned());
    }
    for (nodes, what) in [
        (inactive, "inactive nodes (type X) are left out"),
        (tiny, "nodes store too little heat for a network file, so they are arithmetic"),
        (moving, "boundary nodes change their temperature over time: a network file keeps that of the first time"),
        (storing, "nodes change their capacitance over time: that of the first time is taken"),
    ] {
        if !nodes.is_empty() {
            notes.push(format!("{} {what}: {}.", nodes.len(), listed(&nodes)));
        }
    }
    let names = ["QA", "QE", "QI", "QR", "QS"].into_iter().zip(most);
    let given: Vec<String> = names.map(|(name, most)| format!("{name} up to {most} W")).collect();
    notes.push(format!("The heat of a node is the sum of its five loads, linear between times: {}.", given.join(", ")));
    for (end, value) in joined(&tmd.linear, &number, "GL", &mut notes) {
        network.linear.push(LinearConductor { nodes: end, conductance: value });
    }
    for (end, value) in joined(&tmd.radiative, &number, "GR", &mut notes) {
        network.radiative.push(RadiativeConductor { nodes: end, exchange_area: value });
    }
    let schedule = Schedule { heat, times: times.clone(), ..Schedule::default() };
    let file = NetworkFile { labels, network, schedule, times, assumptions: Vec::new() };
    Ok(ImportedTmd { file, comments, notes })
}

/// The conductors between active nodes, with a note of the others.
fn joined(
    conductors: &Conductors,
    number: &[Option<u32>],
    kind: &str,
    notes: &mut Vec<String>,
) -> Vec<([u32; 2], f64)> {
    let mut kept = Vec::with_capacity(conductors.nodes.len());
    let (mut idle, mut loops) = (0, 0);
    for (ends, value) in conductors.nodes.iter().zip(&conductors.values) {
        match ends.map(|end| number[end as usize]) {
            [Some(a), Some(b)] if a == b => loops += 1,
            [Some(a), Some(b)] => kept.push(([a, b], *value)),
            _ => idle += 1,
        }
    }
    for (count, what) in [(idle, "end at an inactive node"), (loops, "join a node to itself")] {
        if count > 0 {
            notes.push(format!("{count} {kind} {what} and are left out."));
        }
    }
    if conductors.changing > 0 {
        notes.push(format!(
            "{} of {} {kind} change over time, by up to {:.3} of their value: a network file keeps those of the first time.",
            conductors.changing,
            conductors.values.len(),
            conductors.change
        ));
    }
    kept
}

/// The sum of the loads over time. `None` if there is none at any time.
fn heat_of(times: &[f64], loads: &[Vec<f64>; 5]) -> Option<HeatTable> {
    let powers: Vec<f64> = (0..times.len()).map(|time| loads.iter().map(|load| load[time]).sum()).collect();
    if powers.iter().all(|power| *power == powers[0]) {
        return (powers[0] != 0.0).then(|| HeatTable::constant(powers[0]));
    }
    // The middle of three equal powers says nothing.
    let last = powers.len() - 1;
    let tells = |at: &usize| *at == 0 || *at == last || powers[at - 1] != powers[*at] || powers[*at] != powers[at + 1];
    let kept: Vec<usize> = (0..powers.len()).filter(tells).collect();
    Some(HeatTable {
        times: kept.iter().map(|at| times[*at]).collect(),
        powers: kept.iter().map(|at| powers[*at]).collect(),
    })
}

fn listed(names: &[String]) -> String {
    let more = names.len().saturating_sub(NAMED);
    let first = names[..names.len() - more].join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}
