//! An exchange in the least memory, for the many poses of a joint that turns. Nothing is lost.
//!
//! Rows are symmetric, so half of them is kept. Exchange areas are rounded for the device and fit an f32, all but the diagonal.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bundles::SkyBundles;
use super::factors::{Correction, Factors};
use super::for_light::{LightAreas, late};
use super::patches::{Patch, Patches};
use super::reflected::Areas;
use super::sky::{PARTS, open_parts, with_open_parts};
use super::slopes::Slopes;
use super::sparse::Sparse;
use super::step::Exchange;
use crate::stop::both;
use crate::trace::span;

/// The entries of a symmetric matrix on and above its diagonal. A column fits 16 bits ([`super::step::MOST_PATCHES`]).
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct HalfRows {
    first: Vec<u32>,
    columns: Vec<u16>,
    /// Upper halves of values as f32.
    upper: Vec<u16>,
    /// Lower halves that are not 0, and bits that tell which values have one.
    lower: Vec<u16>,
    has_lower: Vec<u64>,
    /// Places and values of entries that an f32 does not hold.
    rests: Vec<(u32, f64)>,
    /// All values, in place of these, where an f32 holds less than half of them.
    doubles: Vec<f64>,
}

impl HalfRows {
    fn new(whole: &Sparse) -> Self {
        let mut half = Self { first: vec![0], ..Self::default() };
        for row in 0..whole.len() {
            let entries = whole.row(row);
            for (column, value) in &entries[entries.partition_point(|(column, _)| (*column as usize) < row)..] {
                let (place, single) = (half.columns.len(), *value as f32);
                if f64::from(single) != *value {
                    half.rests.push((place as u32, *value));
                }
                let bits = if f64::from(single) == *value { single.to_bits() } else { 0 };
                half.columns.push(*column as u16);
                half.upper.push((bits >> 16) as u16);
                half.has_lower.resize(place / 64 + 1, 0);
                if bits as u16 != 0 {
                    half.has_lower[place / 64] |= 1 << (place % 64);
                    half.lower.push(bits as u16);
                }
                half.doubles.push(*value);
            }
            half.first.push(half.columns.len() as u32);
        }
        if 2 * half.rests.len() > half.columns.len() {
            (half.upper, half.lower, half.has_lower, half.rests) = Default::default();
        } else {
            half.doubles = Vec::new();
        }
        half.columns.shrink_to_fit();
        half.upper.shrink_to_fit();
        half.lower.shrink_to_fit();
        half.has_lower.shrink_to_fit();
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
        let mut lower = self.lower.iter().copied();
        let mut single = |place: usize| {
            let has_lower = self.has_lower[place / 64] >> (place % 64) & 1 == 1;
            let low = if has_lower { lower.next().unwrap_or_default() } else { 0 };
            f64::from(f32::from_bits(u32::from(self.upper[place]) << 16 | u32::from(low)))
        };
        for row in 0..rows {
            for place in of_row(row) {
                let column = usize::from(self.columns[place]);
                let rest = rests.next_if(|(own, _)| *own as usize == place).map(|(_, value)| value);
                let exact = rest.or_else(|| self.doubles.get(place).copied());
                let value = exact.unwrap_or_else(|| single(place));
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

    /// Whether these are the rows of so many patches: lengths, orders and numbers are as [`Self::whole`] takes them.
    fn is_whole(&self, patches: usize) -> bool {
        let Self { first, columns, upper, lower, has_lower, rests, doubles } = self;
        let entries = columns.len();
        let rows = first.len() == patches + 1
            && first[0] == 0
            && first[patches] as usize == entries
            && entries <= u32::MAX as usize / 2
            && first.is_sorted();
        let of_row = |row: usize| {
            let own = &columns[first[row] as usize..first[row + 1] as usize];
            own.iter().all(|column| (row..patches).contains(&usize::from(*column))) && own.is_sorted_by(|a, b| a < b)
        };
        let lows: usize = has_lower.iter().map(|bits| bits.count_ones() as usize).sum();
        let singles = upper.len() == entries && has_lower.len() == entries.div_ceil(64) && lower.len() == lows;
        let places = rests.is_sorted_by(|a, b| a.0 < b.0) && rests.iter().all(|(place, _)| (*place as usize) < entries);
        let none = upper.is_empty() && lower.is_empty() && has_lower.is_empty() && rests.is_empty();
        let values = if doubles.is_empty() { singles && places } else { none && doubles.len() == entries };
        rows && values && (0..patches).all(of_row)
    }

    fn bytes(&self) -> usize {
        let halves = self.columns.len() + self.upper.len() + self.lower.len();
        let wide = self.has_lower.len() + 2 * self.rests.len() + self.doubles.len();
        4 * self.first.len() + 2 * halves + 8 * wide
    }
}

/// The finding of rays and reflections in a pose, without the parts that all poses share.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct PoseFinding {
    /// View factors, exchange areas of infrared and of sunlight.
    rows: [HalfRows; 3],
    /// What each of the three gives to space [m2].
    space: [Vec<f64>; 3],
    returned: [f64; 2],
    inside: Vec<f64>,
    correction: Correction,
    rays: u32,
    /// Open parts of two bundles in a byte.
    open: Vec<u8>,
}

impl PoseFinding {
    /// Whether it is a finding of so many patches, with so many rays and bundles each.
    fn is_whole(&self, patches: usize, rays: u32, bundles: usize) -> bool {
        let words = patches * bundles;
        self.rays == rays
            && self.rows.iter().all(|rows| rows.is_whole(patches))
            && self.space.iter().chain([&self.inside]).all(|values| values.len() == patches)
            && self.open.len() == words.div_ceil(2)
            && self.open.iter().all(|two| u32::from(two & 15) <= PARTS && u32::from(two >> 4) <= PARTS)
    }
}

/// An exchange in the least memory.
#[derive(Debug, Clone)]
pub(crate) struct PackedExchange {
    patches: Arc<Vec<Patch>>,
    nodes: Arc<Vec<(u32, f64)>>,
    of_node: Arc<Vec<[u32; 2]>>,
    slopes: Arc<Slopes>,
    directions: Arc<Vec<u32>>,
    bundles: usize,
    found: Arc<PoseFinding>,
}

impl PackedExchange {
    pub(crate) fn new(exchange: Exchange) -> Self {
        let _packs = span("packing the exchange");
        let Exchange { patches, nodes, of_node, slopes, factors, infrared, for_light, directions, bundles } = exchange;
        let LightAreas { sunlight, sky } = &**for_light;
        let found = PoseFinding {
            rows: [&factors.shared, &infrared.between, &sunlight.between].map(HalfRows::new),
            space: [factors.space, infrared.space, sunlight.space.clone()],
            returned: [infrared.returned, sunlight.returned],
            inside: factors.inside,
            correction: factors.correction,
            rays: factors.rays,
            open: sky
                .chunks(2)
                .map(|two| two.iter().rev().fold(0, |byte, word| byte << 4 | open_parts(*word)))
                .collect(),
        };
        Self { patches, nodes, of_node, slopes, directions, bundles, found: Arc::new(found) }
    }

    /// The exchange of patches with a finding that a file kept. `None` where it is none of so many patches, rays and bundles.
    pub(crate) fn of_kept(found: &Arc<PoseFinding>, patches: &Patches, rays: u32, sky: &SkyBundles) -> Option<Self> {
        let bundles = sky.of_patch();
        found.is_whole(patches.all.len(), rays, bundles).then(|| Self {
            patches: Arc::clone(&patches.all),
            nodes: Arc::clone(&patches.nodes),
            of_node: Arc::clone(&patches.of_node),
            slopes: Arc::clone(&patches.slopes),
            directions: Arc::clone(&sky.words),
            bundles,
            found: Arc::clone(found),
        })
    }

    /// The finding of the pose, for a file.
    pub(crate) fn found(&self) -> &Arc<PoseFinding> {
        &self.found
    }

    /// The exchange that was packed.
    pub(crate) fn unpack(self: &Arc<Self>) -> Exchange {
        let (shared, mut exchange) = both(|| self.found.rows[0].whole(), || self.unpack_rows());
        exchange.factors.shared = shared;
        exchange
    }

    /// The same without view factors between patches: no step asks for them.
    pub(crate) fn unpack_rows(self: &Arc<Self>) -> Exchange {
        let (own, found) = (Arc::clone(self), &self.found);
        Exchange {
            patches: Arc::clone(&self.patches),
            nodes: Arc::clone(&self.nodes),
            of_node: Arc::clone(&self.of_node),
            slopes: Arc::clone(&self.slopes),
            factors: Factors {
                areas: self.patches.iter().map(|patch| patch.area).collect(),
                shared: Sparse::default(),
                space: found.space[0].clone(),
                rays: found.rays,
                correction: found.correction,
                inside: found.inside.clone(),
            },
            infrared: self.areas(0),
            for_light: late(move || {
                let open = |(place, word): (usize, &u32)| {
                    with_open_parts(*word, own.found.open[place / 2] >> (4 * (place % 2)) & 15)
                };
                LightAreas { sunlight: own.areas(1), sky: own.directions.par_iter().enumerate().map(open).collect() }
            }),
            directions: Arc::clone(&self.directions),
            bundles: self.bundles,
        }
    }

    /// Exchange areas of infrared or of sunlight.
    fn areas(&self, kind: usize) -> Areas {
        let PoseFinding { rows, space, returned, .. } = &*self.found;
        Areas { between: rows[1 + kind].whole(), space: space[1 + kind].clone(), returned: returned[kind] }
    }

    /// The same exchange of patches that store another heat.
    pub(crate) fn with_patches(&self, patches: &Arc<Vec<Patch>>) -> Self {
        Self { patches: Arc::clone(patches), ..self.clone() }
    }

    /// Memory, without what every pose shares [B].
    pub(crate) fn bytes(&self) -> usize {
        let PoseFinding { rows, space, inside, open, .. } = &*self.found;
        let space: usize = space.iter().map(Vec::len).sum();
        rows.iter().map(HalfRows::bytes).sum::<usize>() + 8 * (space + inside.len()) + open.len()
    }
}

#[cfg(test)]
mod tests;
