//! An exchange in the least memory, for the many poses of a joint that turns. Nothing is lost.
//!
//! Rows are symmetric, so half of them is kept. Exchange areas are rounded for the device and fit an f32, all but the diagonal.

use std::sync::Arc;

use rayon::prelude::*;

use super::factors::{Correction, Factors};
use super::patches::Patch;
use super::reflected::Areas;
use super::sky::{open_parts, with_open_parts};
use super::sparse::Sparse;
use super::step::Exchange;
use crate::stop::both;

/// The entries of a symmetric matrix on and above its diagonal. A column fits 16 bits ([`super::step::MOST_PATCHES`]).
#[derive(Debug, Clone, Default)]
struct HalfRows {
    first: Vec<u32>,
    columns: Vec<u16>,
    values: Vec<f32>,
    /// Places and values of entries that an f32 does not hold.
    rests: Vec<(u32, f64)>,
    /// All values, in place of both, where an f32 holds less than half of them.
    doubles: Vec<f64>,
}

impl HalfRows {
    fn new(whole: &Sparse) -> Self {
        let mut half = Self { first: vec![0], ..Self::default() };
        for row in 0..whole.len() {
            let entries = whole.row(row);
            for (column, value) in &entries[entries.partition_point(|(column, _)| (*column as usize) < row)..] {
                let single = *value as f32;
                if f64::from(single) != *value {
                    half.rests.push((half.values.len() as u32, *value));
                }
                half.columns.push(*column as u16);
                half.values.push(single);
                half.doubles.push(*value);
            }
            half.first.push(half.columns.len() as u32);
        }
        if 2 * half.rests.len() > half.values.len() {
            (half.values, half.rests) = Default::default();
        } else {
            half.doubles = Vec::new();
        }
        half.columns.shrink_to_fit();
        half.values.shrink_to_fit();
        half.rests.shrink_to_fit();
        half.doubles.shrink_to_fit();
        half
    }

    fn whole(&self) -> Sparse {
        let rows = self.first.len() - 1;
        let of_row = |row: usize| self.first[row] as usize..self.first[row + 1] as usize;
        let mut first = vec![0u32; rows + 1];
        for row in 0..rows {
            for column in self.columns[of_row(row)].iter().map(|column| usize::from(*column)) {
                first[row + 1] += 1;
                first[column + 1] += u32::from(column != row);
            }
        }
        (0..rows).for_each(|row| first[row + 1] += first[row]);
        let mut next = first.clone();
        let mut entries = vec![(0, 0.0); first[rows] as usize];
        let mut rests = self.rests.iter().copied().peekable();
        for row in 0..rows {
            for place in of_row(row) {
                let column = usize::from(self.columns[place]);
                let rest = rests.next_if(|(own, _)| *own as usize == place).map(|(_, value)| value);
                let exact = rest.or_else(|| self.doubles.get(place).copied());
                let value = exact.unwrap_or_else(|| f64::from(self.values[place]));
                let mut put = |row: usize, column: usize| {
                    entries[next[row] as usize] = (column as u32, value);
                    next[row] += 1;
                };
                put(row, column);
                if column != row {
                    put(column, row);
                }
            }
        }
        Sparse { first, entries }
    }

    fn bytes(&self) -> usize {
        let values = 4 * self.values.len() + 16 * self.rests.len() + 8 * self.doubles.len();
        4 * self.first.len() + 2 * self.columns.len() + values
    }
}

/// An exchange in the least memory.
#[derive(Debug, Clone)]
pub(crate) struct PackedExchange {
    patches: Arc<Vec<Patch>>,
    nodes: Arc<Vec<(u32, f64)>>,
    of_node: Arc<Vec<[u32; 2]>>,
    /// View factors, exchange areas of infrared and of sunlight.
    rows: Arc<[HalfRows; 3]>,
    /// What each of the three gives to space [m2].
    space: [Vec<f64>; 3],
    returned: [f64; 2],
    inside: Vec<f64>,
    correction: Correction,
    rays: u32,
    /// Open parts of two bundles in a byte.
    open: Vec<u8>,
    directions: Arc<Vec<u32>>,
    bundles: usize,
}

impl PackedExchange {
    pub(crate) fn new(exchange: Exchange) -> Self {
        let Exchange { patches, nodes, of_node, factors, infrared, sunlight, sky, directions, bundles } = exchange;
        Self {
            patches,
            nodes,
            of_node,
            rows: Arc::new([&factors.shared, &infrared.between, &sunlight.between].map(HalfRows::new)),
            space: [factors.space, infrared.space, sunlight.space],
            returned: [infrared.returned, sunlight.returned],
            inside: factors.inside,
            correction: factors.correction,
            rays: factors.rays,
            open: sky
                .chunks(2)
                .map(|two| two.iter().rev().fold(0, |byte, word| byte << 4 | open_parts(*word)))
                .collect(),
            directions,
            bundles,
        }
    }

    /// The exchange that was packed.
    pub(crate) fn unpack(&self) -> Exchange {
        let (shared, mut exchange) = both(|| self.rows[0].whole(), || self.unpack_rows());
        exchange.factors.shared = shared;
        exchange
    }

    /// The same without view factors between patches: no step asks for them.
    pub(crate) fn unpack_rows(&self) -> Exchange {
        let [_, infrared, sunlight] = &*self.rows;
        let (infrared, sunlight) = both(|| infrared.whole(), || sunlight.whole());
        let [space, infrared_space, sunlight_space] = self.space.clone();
        let open =
            |(place, word): (usize, &u32)| with_open_parts(*word, self.open[place / 2] >> (4 * (place % 2)) & 15);
        let sky = self.directions.par_iter().enumerate().map(open);
        Exchange {
            patches: Arc::clone(&self.patches),
            nodes: Arc::clone(&self.nodes),
            of_node: Arc::clone(&self.of_node),
            factors: Factors {
                areas: self.patches.iter().map(|patch| patch.area).collect(),
                shared: Sparse::default(),
                space,
                rays: self.rays,
                correction: self.correction,
                inside: self.inside.clone(),
            },
            infrared: Areas { between: infrared, space: infrared_space, returned: self.returned[0] },
            sunlight: Areas { between: sunlight, space: sunlight_space, returned: self.returned[1] },
            sky: sky.collect(),
            directions: Arc::clone(&self.directions),
            bundles: self.bundles,
        }
    }

    /// The same exchange of patches that store another heat.
    pub(crate) fn with_patches(&self, patches: &Arc<Vec<Patch>>) -> Self {
        Self { patches: Arc::clone(patches), ..self.clone() }
    }

    /// Memory, without what every pose shares [B].
    pub(crate) fn bytes(&self) -> usize {
        let space: usize = self.space.iter().map(Vec::len).sum();
        self.rows.iter().map(HalfRows::bytes).sum::<usize>() + 8 * (space + self.inside.len()) + self.open.len()
    }
}
