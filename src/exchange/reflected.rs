//! Exchange areas: the light that one patch receives from another, with all diffuse reflections on the way.
//!
//! With J_j the light that patch j emits or reflects at first [W/m2], the light that arrives at i, all reflections counted, is (sum over j of H_ij
//! J_j) / A_i. H = S + S (r/A) S + S (r/A) S (r/A) S + ..., where S are the shared areas and r the reflectivities. H is symmetric. Gebhart's factor,
//! the share of the emission of j that i absorbs, is a_i H_ij / A_j, where a = 1 - r (Gebhart 1961, Int. J. Heat Mass Transfer 3).
//!
//! How much of its light a patch gives to the craft and to space follows from vectors alone, with all reflections. Rows follow the light: crumbs of it
//! are reflected together, by the one at which they make a share that counts. Of the many pairs that see each other by reflection alone and share little, a hash chooses a few
//! that stand for all: a pair is kept with the probability that its area is of a stated one, which it takes (Russian roulette, so a row is right in the mean). Factors for
//! patches and sides then give each patch the light of each side of the craft that the whole rows had ([`super::balance_sides`]): light that a wall throws back to the floor
//! must not count as light of the wall. One factor for each patch scales the entries to the right sums. Where a scene bounds the number of reflections, the light of
//! further reflections returns to its own patch. Rows stay symmetric and closed, so that an isothermal box keeps its temperature. Entries are rounded
//! to 8 bits, large ones to 16, and the rest goes to the diagonal.

use rayon::prelude::*;

use super::balance_sides::{Sided, fit_sides, summed};
use super::factors::Factors;
use super::sparse::{Sparse, SparseRow};
use super::words::{MOST as WORDS, rounded};
use crate::stop::Watch;
use crate::thermal::sensor::noise::pcg4d;

/// Area over that of the smaller patch below which pairs that do not see each other directly stand for others.
const THIN: f64 = 0.006;
/// Second word of the hash of a pair, so that it differs from other uses of the same hash.
const SALT: u32 = 0x9a12;
/// Rounds in which kept entries are scaled to the right sums of their rows.
const ROUNDS: usize = 100;
/// Share of the light of a row below which reflections are no longer followed. The rest goes where the light before it went.
const FAINT: f64 = 3e-4;
/// Share of the light of a row below which entries are reflected together.
const CRUMB: f64 = 2e-3;
const MOST: u32 = 20_000;
/// Share of all patches, as its inverse, that light must reach for a look at all of them.
const SCANNED: usize = 16;
/// Part of the area of the smaller patch below which a rounding error of an entry is left to the diagonal.
const FINE: f64 = 1e-4;
/// Absorptivity up to which the diagonal can not make up for light that is left out.
const MIRROR: f64 = 1e-6;

/// Exchange areas.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Areas {
    /// H_ij [m2], symmetric.
    pub(crate) between: Sparse,
    /// Area times the share of the light of a patch that reaches space [m2].
    pub space: Vec<f64>,
    /// Largest share of the light of a patch that returns to it in place of further reflections.
    pub(crate) returned: f64,
}

/// Exchange areas of patches on these sides of the craft, with these absorptivities, with at most `bounces` reflections, or all.
pub(crate) fn exchange_areas(factors: &Factors, sides: &[u32], absorptivities: &[f64], bounces: Option<u32>) -> Areas {
    let areas = &factors.areas;
    let [given, lost] = shares(factors, absorptivities, bounces);
    let watch = Watch::begin();
    let rows: Vec<SparseRow> = (0..areas.len())
        .into_par_iter()
        .map_init(
            || ReflectionRoom::new(areas.len()),
            |rows, patch| match watch.is_over() {
                true => SparseRow::new(),
                false => rows.follow(factors, absorptivities, bounces, patch),
            },
        )
        .collect();
    watch.look();
    let space: Vec<f64> = lost.iter().zip(areas).map(|(share, area)| share * area).collect();
    let between_rows = Sparse::from_rows(rows);
    let mean = between_rows.combined(&between_rows.transposed(), |_, _, there, back| 0.5 * (there + back));
    let mut between = thinned(&mean, &factors.shared, areas);
    let of_sides = |row: usize| summed(mean.row(row).iter().copied(), sides);
    let wanted: Vec<Sided> = (0..areas.len()).into_par_iter().map(of_sides).collect();
    fit_sides(&mut between, sides, &wanted);
    let wanted: Vec<f64> = given.iter().zip(areas).map(|(share, area)| share * area).collect();
    scale(&mut between, &wanted, absorptivities);
    Areas::closed(between, space, areas, absorptivities)
}

impl Areas {
    /// Exchange areas rounded as the device keeps them, each row closed by its diagonal.
    pub(super) fn closed(mut between: Sparse, space: Vec<f64>, areas: &[f64], absorptivities: &[f64]) -> Self {
        round(&mut between, areas, absorptivities);
        let mut returned = 0.0f64;
        for (i, area) in areas.iter().enumerate() {
            let (first, end) = (between.first[i] as usize, between.first[i + 1] as usize);
            let entries = &mut between.entries[first..end];
            let taken: f64 = entries.iter().map(|(j, shared)| shared * absorptivities[*j as usize]).sum();
            let missing = area - space[i] - taken;
            if absorptivities[i] > MIRROR
                && let Some((_, diagonal)) = entries.iter_mut().find(|(j, _)| *j as usize == i)
            {
                *diagonal += missing / absorptivities[i];
                returned = returned.max(missing.abs() / area);
            }
        }
        Self { between, space, returned }
    }
}

/// Shares of the light of each patch that the craft absorbs and that reach space, with at most `bounces` reflections.
fn shares(factors: &Factors, absorptivities: &[f64], bounces: Option<u32>) -> [Vec<f64>; 2] {
    let mean_over_rays = |value: &(dyn Fn(usize) -> f64 + Sync), i: usize| -> f64 {
        factors.shared.row(i).iter().map(|(j, shared)| shared * value(*j as usize)).sum::<f64>() / factors.areas[i]
    };
    let patches = 0..factors.areas.len();
    let at_first = |i: usize| [mean_over_rays(&|j| absorptivities[j], i), factors.to_space(i)];
    let first: Vec<[f64; 2]> = patches.clone().into_par_iter().map(at_first).collect();
    let mut now = first.clone();
    for _ in 0..bounces.unwrap_or(MOST).min(MOST) {
        let later = |i: usize| {
            let reflected = |kind: usize| mean_over_rays(&|j| (1.0 - absorptivities[j]) * now[j][kind], i);
            [first[i][0] + reflected(0), first[i][1] + reflected(1)]
        };
        let next: Vec<[f64; 2]> = patches.clone().into_par_iter().map(later).collect();
        let change = next.iter().zip(&now).map(|(a, b)| (a[0] - b[0]).max(a[1] - b[1])).fold(0.0, f64::max);
        now = next;
        if change < 1e-14 {
            break;
        }
    }
    [0, 1].map(|kind| now.iter().map(|shares| shares[kind]).collect())
}

/// Scales entries so that each row gives the `wanted` area to the craft [m2].
fn scale(kept: &mut Sparse, wanted: &[f64], absorptivities: &[f64]) {
    let carried = |rows: &Sparse, factor: &[f64], i: usize| -> f64 {
        let term = |(j, area): &(u32, f64)| area * factor[*j as usize] * absorptivities[*j as usize];
        factor[i] * rows.row(i).iter().map(term).sum::<f64>()
    };
    let mut factor = vec![1.0; wanted.len()];
    for _ in 0..ROUNDS {
        let now: Vec<f64> = (0..wanted.len()).into_par_iter().map(|i| carried(kept, &factor, i)).collect();
        for i in (0..wanted.len()).filter(|i| now[*i] > 0.0) {
            factor[i] *= (wanted[i] / now[i]).sqrt();
        }
    }
    for i in 0..wanted.len() {
        let run = kept.first[i] as usize..kept.first[i + 1] as usize;
        kept.entries[run].iter_mut().for_each(|(j, area)| *area *= factor[i] * factor[*j as usize]);
    }
}

/// Rounds entries as the device keeps them. A patch that takes no light can not make up for rounding, so its entries keep all bits of an f32.
fn round(kept: &mut Sparse, areas: &[f64], absorptivities: &[f64]) {
    for i in 0..areas.len() {
        let run = kept.first[i] as usize..kept.first[i + 1] as usize;
        for (j, area) in kept.entries[run].iter_mut().filter(|(j, _)| *j as usize != i) {
            let j = *j as usize;
            let mirror = absorptivities[i].min(absorptivities[j]) <= MIRROR;
            *area = if mirror { rounded(*area, 0.0, WORDS) } else { rounded(*area, FINE * areas[i].min(areas[j]), 2) };
        }
    }
}

/// Lets few pairs that do not see each other and share little stand for all of them. The diagonal stays.
fn thinned(all: &Sparse, shared: &Sparse, areas: &[f64]) -> Sparse {
    let sees = |i: usize, j: u32| j as usize == i || shared.row(i).binary_search_by_key(&j, |entry| entry.0).is_ok();
    let kept = |i: usize, (j, area): (u32, f64)| {
        let least = THIN * areas[i].min(areas[j as usize]);
        if area >= least || sees(i, j) {
            return Some((j, area));
        }
        let [number, ..] = pcg4d([j.min(i as u32), j.max(i as u32), SALT, 0]);
        (f64::from(number) * 2f64.powi(-32) * least < area).then_some((j, least))
    };
    let row = |i: usize| {
        let mut row: SparseRow = all.row(i).iter().filter_map(|entry| kept(i, *entry)).collect();
        if let Err(place) = row.binary_search_by_key(&(i as u32), |entry| entry.0) {
            row.insert(place, (i as u32, 0.0));
        }
        row
    };
    Sparse::from_rows((0..areas.len()).into_par_iter().map(row).collect())
}

struct ReflectionRoom {
    sum: Vec<f64>,
    next: Vec<f64>,
    touched: Vec<u32>,
    reached: Vec<u32>,
}

impl ReflectionRoom {
    fn new(patches: usize) -> Self {
        Self { sum: vec![0.0; patches], next: vec![0.0; patches], touched: Vec::new(), reached: Vec::new() }
    }

    fn follow(&mut self, factors: &Factors, taken: &[f64], bounces: Option<u32>, patch: usize) -> SparseRow {
        let faint = FAINT * factors.areas[patch];
        let mut light: SparseRow = factors.shared.row(patch).to_vec();
        for bounce in 0..=bounces.unwrap_or(MOST).min(MOST) {
            for (j, area) in &light {
                if self.sum[*j as usize] == 0.0 {
                    self.touched.push(*j);
                }
                self.sum[*j as usize] += area;
            }
            let reflected = |(j, area): &(u32, f64)| area * (1.0 - taken[*j as usize]);
            let mut left = light.iter().map(reflected).sum::<f64>();
            if left <= faint || bounces == Some(bounce) {
                break;
            }
            // The first crumbs count as half of one that goes on, so that light moves forwards as often as backwards.
            let mut gathered = 0.0;
            let mut due = 0.5 * CRUMB * factors.areas[patch];
            for (j, area) in light.iter().map(|entry| (entry.0 as usize, reflected(entry))) {
                gathered += area;
                left -= area;
                if gathered < due && left > faint {
                    continue;
                }
                due = CRUMB * factors.areas[patch];
                let area = std::mem::take(&mut gathered);
                let share = area / factors.areas[j];
                for (k, shared) in factors.shared.row(j) {
                    if self.next[*k as usize] == 0.0 {
                        self.reached.push(*k);
                    }
                    self.next[*k as usize] += share * shared;
                }
            }
            // Where many patches are reached, a look at all of them takes less time than to sort them.
            if SCANNED * self.reached.len() > self.next.len() {
                self.reached.clear();
                self.reached.extend((0..self.next.len() as u32).filter(|k| self.next[*k as usize] != 0.0));
            } else {
                self.reached.sort_unstable();
                self.reached.dedup();
            }
            let next = &mut self.next;
            light = self.reached.drain(..).map(|k| (k, std::mem::take(&mut next[k as usize]))).collect();
        }
        self.touched.sort_unstable();
        self.touched.dedup();
        let sum = &mut self.sum;
        self.touched.drain(..).map(|j| (j, std::mem::take(&mut sum[j as usize]))).collect()
    }
}
