//! Elimination order of a small linear system, in levels of independent pivots.
//!
//! The matrix of Newton's method for a network is column diagonally dominant with a positive diagonal. The elimination
//! thus needs no pivot search (Golub & Van Loan, Matrix Computations, 4th ed., 4.1), and its pattern is known in
//! advance.

use std::collections::{BTreeMap, BTreeSet};

use super::tables::Tables;
use crate::gpu::layout::NetworkAttempt;

/// Marks a neighbour that is not an unknown.
const NONE: u32 = u32::MAX;
/// Most products of an elimination. A network that needs more is not small.
const TERMS_AT_MOST: usize = 150_000;
/// Marks an entry of the right-hand side until the number of matrix entries is known.
const RIGHT: u32 = 1 << 31;

/// Tables for glsl/network_elimination.glsl.
pub struct Schedule {
    /// All tables in sequence.
    pub words: Vec<u32>,
    /// Number of values in the matrix and the right-hand side.
    pub values: usize,
    /// Start of each table.
    at: NetworkAttempt,
    /// Number of terms of each target, by level.
    terms: Vec<Vec<u32>>,
    /// Number of entries right of each pivot, by level.
    uppers: Vec<Vec<u32>>,
    nodes: Vec<u32>,
}

/// Operations of one level.
struct Level {
    /// Matrix entries to change, each with the products to subtract: left entry, pivot and upper entry.
    targets: BTreeMap<u32, Vec<[u32; 3]>>,
    /// Pivots, each with the entries to its right and their unknowns.
    pivots: Vec<(u32, Vec<[u32; 2]>)>,
}

impl Schedule {
    /// Orders the elimination of some nodes; `None` if it needs too many products.
    pub fn new(tables: &Tables, nodes: &[u32]) -> Option<Self> {
        let number: BTreeMap<u32, u32> = nodes.iter().zip(0..).map(|(node, number)| (*node, number)).collect();
        let mut entries: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut beside: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); nodes.len()];
        let mut link_entries = vec![NONE; tables.links.len()];
        let mut last = nodes.len() as u32;
        for (here, node) in (0..).zip(nodes) {
            for link in tables.row(*node as usize) {
                if let Some(there) = number.get(&tables.links[link].neighbour) {
                    entries.insert((here, *there), last);
                    beside[here as usize].insert(*there);
                    link_entries[link] = last;
                    last += 1;
                }
            }
        }
        let fill_begin = last;
        let mut left: BTreeSet<u32> = (0..nodes.len() as u32).collect();
        let mut levels = Vec::new();
        let mut terms = 0;
        while !left.is_empty() {
            let level = next_level(&mut left, &mut beside, &mut entries, &mut last);
            terms += level.targets.values().map(Vec::len).sum::<usize>();
            if terms > TERMS_AT_MOST {
                return None;
            }
            levels.push(level);
        }
        Some(Self::laid_out(nodes, &link_entries, &levels, fill_begin, last))
    }

    fn laid_out(nodes: &[u32], link_entries: &[u32], levels: &[Level], fill_begin: u32, fill_end: u32) -> Self {
        let entry = |entry: u32| if entry & RIGHT == 0 { entry } else { fill_end + (entry ^ RIGHT) };
        let (mut starts, mut targets, mut terms) = (Vec::new(), Vec::new(), Vec::new());
        let (mut pivots, mut uppers) = (Vec::new(), Vec::new());
        for level in levels {
            starts.extend([targets.len() as u32 / 2, pivots.len() as u32 / 2]);
            for (target, products) in &level.targets {
                targets.extend([entry(*target), terms.len() as u32 / 3]);
                terms.extend(products.iter().flatten().map(|word| entry(*word)));
            }
            for (unknown, right_of_it) in &level.pivots {
                pivots.extend([*unknown, uppers.len() as u32 / 2]);
                uppers.extend(right_of_it.iter().flatten());
            }
        }
        starts.extend([targets.len() as u32 / 2, pivots.len() as u32 / 2]);
        targets.extend([0, terms.len() as u32 / 3]);
        pivots.extend([0, uppers.len() as u32 / 2]);
        let mut words = Vec::new();
        let mut append = |list: &[u32]| {
            let at = words.len() as u32;
            words.extend_from_slice(list);
            at
        };
        let at = NetworkAttempt {
            unknowns: nodes.len() as u32,
            levels: levels.len() as u32,
            nodes_at: append(nodes),
            entries_at: append(link_entries),
            levels_at: append(&starts),
            targets_at: append(&targets),
            terms_at: append(&terms),
            pivots_at: append(&pivots),
            uppers_at: append(&uppers),
            fill_begin,
            fill_end,
            right_at: fill_end,
            ..bytemuck::Zeroable::zeroed()
        };
        let lengths = |level: &Level| level.targets.values().map(|terms| terms.len() as u32).collect();
        let right = |level: &Level| level.pivots.iter().map(|(_, uppers)| uppers.len() as u32).collect();
        Self {
            words,
            values: fill_end as usize + nodes.len(),
            at,
            terms: levels.iter().map(lengths).collect(),
            uppers: levels.iter().map(right).collect(),
            nodes: nodes.to_vec(),
        }
    }

    /// Writes the start of each table, and the loop iterations of one Newton iteration.
    pub fn describe(&self, attempt: &mut NetworkAttempt, tables: &Tables, lanes: u32) {
        let chunks = |level: &[u32]| -> u32 {
            level.chunks(lanes as usize).map(|chunk| 2 + chunk.iter().max().copied().unwrap_or(0)).sum::<u32>() + 1
        };
        let by_level: u32 = self.terms.iter().chain(&self.uppers).map(|level| chunks(level)).sum();
        let fill = (self.at.fill_end - self.at.fill_begin).div_ceil(lanes);
        let update = (self.nodes.len() as u32).div_ceil(lanes);
        *attempt = NetworkAttempt {
            nodes: attempt.nodes,
            sensors: attempt.sensors,
            lone: attempt.lone,
            space_temperature: attempt.space_temperature,
            loops_iteration: tables.loops(&self.nodes, lanes) + by_level + fill + update + 8,
            ..self.at
        };
    }
}

/// Chooses nodes of nearly the smallest degree that are not neighbours of each other, and eliminates them.
fn next_level(
    left: &mut BTreeSet<u32>,
    beside: &mut [BTreeSet<u32>],
    entries: &mut BTreeMap<(u32, u32), u32>,
    last: &mut u32,
) -> Level {
    let mut by_degree: Vec<u32> = left.iter().copied().collect();
    by_degree.sort_by_key(|node| beside[*node as usize].len());
    let least = by_degree.first().map_or(0, |node| beside[*node as usize].len());
    let mut chosen = BTreeSet::new();
    for node in by_degree {
        let neighbours = &beside[node as usize];
        if neighbours.len() <= least + 1 && neighbours.is_disjoint(&chosen) {
            chosen.insert(node);
        }
    }
    let mut level = Level { targets: BTreeMap::new(), pivots: Vec::new() };
    for pivot in chosen {
        left.remove(&pivot);
        let neighbours = std::mem::take(&mut beside[pivot as usize]);
        for here in &neighbours {
            beside[*here as usize].remove(&pivot);
            let factor = entries[&(*here, pivot)];
            let right = level.targets.entry(RIGHT | here).or_default();
            right.push([factor, pivot, RIGHT | pivot]);
            for there in &neighbours {
                let target = if here == there {
                    *here
                } else {
                    beside[*here as usize].insert(*there);
                    *entries.entry((*here, *there)).or_insert_with(|| {
                        *last += 1;
                        *last - 1
                    })
                };
                level.targets.entry(target).or_default().push([factor, pivot, entries[&(pivot, *there)]]);
            }
        }
        let uppers = neighbours.iter().map(|there| [entries[&(pivot, *there)], *there]).collect();
        level.pivots.push((pivot, uppers));
    }
    level
}
