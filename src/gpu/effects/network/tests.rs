//! The tables of a network in one pass: who writes which drawn node.

use super::super::order::UNDRAWN;
use super::*;
use crate::thermal::network::{LinearConductor, Network, NodeKind};

#[test]
fn each_drawn_node_is_written_by_one_node() {
    let count = 9;
    let link = |at: u32| LinearConductor { nodes: [at, at + 1], conductance: 1.0 };
    let network = Network {
        space_temperature: 2.7,
        kinds: vec![NodeKind::Diffusive; count],
        capacitances: vec![1000.0; count],
        emissive_areas: vec![0.5; count],
        temperatures: vec![280.0; count],
        linear: (0..count as u32 - 1).map(link).collect(),
        ..Network::default()
    };
    let plan = OnePassPlan::new(&network, 1.0, &vec![400.0; count]).expect("a network for one pass");
    // Nodes of a group with one, three, no and two drawn nodes. The others are padding.
    let nodes = [NONE, 0, 1, 1, 3, 1, 3, NONE, 4, 5, 6, 7, 8, 8, NONE, NONE];
    let areas = nodes.map(|node| if node == NONE { 0.0 } else { 0.25 });
    let tables = OnePassTables::new(&plan, 1.0, DrawnNodes { nodes: &nodes, areas: &areas }, Vec::new(), 0.01);
    let mut written: Vec<(u32, f32)> = Vec::new();
    for row in &tables.rows {
        for pair in tables.sources[row[2] as usize..row[3] as usize].chunks(2) {
            written.extend(pair[0].into_iter().zip(pair[1].map(f32::from_bits)).filter(|(at, _)| *at < UNDRAWN));
        }
    }
    written.sort_by_key(|(at, _)| *at);
    let real = (0..).zip(nodes).filter(|(_, node)| *node != NONE);
    assert_eq!(written, real.map(|(at, _)| (at, 0.25)).collect::<Vec<_>>());
}
