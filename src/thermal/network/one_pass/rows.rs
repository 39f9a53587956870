//! Exchanges of heat sorted by node.

use crate::thermal::network::{LinearConductor, RadiativeConductor};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExchangeLink {
    pub(crate) neighbour: u32,
    /// Linear conductance [W/K].
    pub(crate) conductance: f64,
    /// Radiative conductance [m2].
    pub(crate) exchange_area: f64,
}

/// The exchanges of each node. Each is in the rows of both its ends, and parallel ones are one.
#[derive(Debug)]
pub(crate) struct ExchangeRows {
    /// First exchange of each node, and one number at the end.
    starts: Vec<u32>,
    links: Vec<ExchangeLink>,
}

impl ExchangeRows {
    pub(crate) fn new<'a>(
        count: usize,
        linear: impl Iterator<Item = &'a LinearConductor>,
        radiative: &[RadiativeConductor],
    ) -> Self {
        let linear = linear.filter(|one| one.conductance > 0.0).map(|one| (one.nodes, one.conductance, 0.0));
        let radiative = radiative.iter().map(|one| (one.nodes, 0.0, one.exchange_area));
        let mut rows = vec![Vec::new(); count];
        for ([a, b], conductance, exchange_area) in linear.chain(radiative).filter(|([a, b], ..)| a != b) {
            for (node, neighbour) in [(a, b), (b, a)] {
                rows[node as usize].push(ExchangeLink { neighbour, conductance, exchange_area });
            }
        }
        for row in &mut rows {
            row.sort_by_key(|link| link.neighbour);
            row.dedup_by(|next, kept| {
                let same = next.neighbour == kept.neighbour;
                if same {
                    kept.conductance += next.conductance;
                    kept.exchange_area += next.exchange_area;
                }
                same
            });
        }
        let mut starts = vec![0];
        starts.extend(rows.iter().scan(0, |end, row| {
            *end += row.len() as u32;
            Some(*end)
        }));
        Self { starts, links: rows.into_iter().flatten().collect() }
    }

    pub(crate) fn of(&self, node: usize) -> &[ExchangeLink] {
        &self.links[self.starts[node] as usize..self.starts[node + 1] as usize]
    }
}
