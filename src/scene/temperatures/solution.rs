//! Temperatures of nodes over time, from any kind of file.

use glam::DVec3;

use crate::scene::tmd::Tmd;

/// Highest temperature [K].
pub(super) const HOTTEST: f64 = 1e6;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SolvedNode {
    /// Name. Empty for a point of a mesh.
    pub(crate) name: String,
    /// Another name, which several nodes may share. May be empty.
    pub(crate) label: String,
    /// Place in the body frame [m], if the file states it.
    pub(crate) place: Option<DVec3>,
}

/// Temperatures of nodes over time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solution {
    pub(crate) nodes: Vec<SolvedNode>,
    /// Times [s], ascending.
    pub(crate) times: Vec<f64>,
    /// Temperatures [K] of all nodes at the first time, then of all nodes at the next.
    pub(crate) temperatures: Vec<f64>,
    /// One sentence for each thing that the file lacks or that is left out.
    pub(crate) notes: Vec<String>,
}

impl Solution {
    /// The temperatures of a TMD file, without its inactive nodes.
    pub(super) fn of_tmd(tmd: &Tmd) -> Self {
        let active = || tmd.nodes.iter().filter(|node| node.kind != 'X');
        // A file without coordinates has zeros.
        let placed = active().any(|node| node.position != DVec3::ZERO);
        let nodes: Vec<SolvedNode> = active()
            .map(|node| SolvedNode {
                name: node.name.clone(),
                label: node.label.clone(),
                place: placed.then_some(node.position),
            })
            .collect();
        let at = |time: usize| active().map(move |node| node.temperatures[time]);
        let temperatures = (0..tmd.times.len()).flat_map(at).collect();
        let idle: Vec<String> = tmd
            .nodes
            .iter()
            .filter(|node| node.kind == 'X')
            .map(|node| format!("{} ({})", node.name, node.label))
            .collect();
        let mut notes = Vec::new();
        if !idle.is_empty() {
            notes.push(format!("Inactive nodes are left out: {}.", idle.join(", ")));
        }
        Self { nodes, times: tmd.times.clone(), temperatures, notes }
    }

    pub(super) fn any() -> Self {
        let node = SolvedNode { name: String::new(), label: String::new(), place: Some(DVec3::ZERO) };
        Self { nodes: vec![node], times: vec![0.0], temperatures: vec![0.0], notes: Vec::new() }
    }

    pub(crate) fn has_places(&self) -> bool {
        self.nodes.iter().all(|node| node.place.is_some())
    }

    /// Temperatures of all nodes at a time of the file [K], linear between its times.
    pub(crate) fn at(&self, time: f64) -> Vec<f64> {
        let count = self.nodes.len();
        let row = |at: usize| &self.temperatures[at * count..(at + 1) * count];
        let next = self.times.partition_point(|known| *known < time);
        if next == 0 {
            return row(0).to_vec();
        }
        if next == self.times.len() {
            return row(next - 1).to_vec();
        }
        let share = (time - self.times[next - 1]) / (self.times[next] - self.times[next - 1]);
        row(next - 1).iter().zip(row(next)).map(|(before, after)| before + share * (after - before)).collect()
    }

    /// The longest stretch between two times [s].
    pub(crate) fn longest(&self) -> f64 {
        self.times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    }
}
