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

use std::sync::LazyLock;

use rayon::prelude::*;

use super::balance_sides::{Sided, fit_sides};
use super::factors::Factors;
use super::late_light::LateLight;
use super::scaling::{Rows, conjugate_gradients, product};
use super::sparse::{Sparse, SparseRow};
use super::words::{MOST as WORDS, rounded};
use crate::stop::Watch;

/// Area over that of the smaller patch below which pairs that do not see each other directly stand for others.
const THIN: f64 = 0.006;
/// Pairs of a side that are expected to stand for others, below which this side is balanced only together with others: sides of which no pair is kept can be given nothing,
/// and the light of a patch would go elsewhere.
const STANDING: f64 = 8.0;
/// Part of the area of a side that pairs which stand for others may have in any case: the rest is kept for sure.
const SURE: f64 = 0.5;
/// Rounds in which kept entries are scaled to the right sums of their rows.
const ROUNDS: usize = 100;
/// Error of such a sum, over the sum, that is left to the diagonal.
const RIGHT: f64 = 1e-9;
/// Error of shares with all reflections, over the shares.
const SOLVED: f64 = 1e-14;
/// Share of the light of a row below which reflections are no longer followed. The rest goes where the light before it went.
const FAINT: f64 = 3e-4;
/// Share of the light of a row below which entries are reflected together.
const CRUMB: f64 = 5e-4;
const MOST: u32 = 20_000;
/// Reflections after which light is followed by groups of patches.
const LATE: u32 = 8;
/// Share of the light of a row that must be left then. Less is soon followed to its end.
const MUCH: f64 = 0.02;
/// Patches that are looked at together for light that has reached them.
const BLOCK: usize = 64;
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
    let light = LightRows::new(&factors.shared);
    let late_light = LazyLock::new(|| LateLight::new(factors, sides, absorptivities));
    // Where the number of reflections is bounded, all of them are followed.
    let late = || if bounces.is_none() { late_light.as_ref() } else { None };
    let (rows, wanted): (Vec<SparseRow>, Vec<Sided>) = (0..areas.len())
        .into_par_iter()
        .map_init(
            || ReflectionRoom::new(sides),
            |room, patch| {
                if watch.is_over() {
                    return Default::default();
                }
                room.follow(factors, &light, absorptivities, (bounces, &late), patch);
                room.thinned(factors, sides, patch)
            },
        )
        .unzip();
    watch.look();
    let space: Vec<f64> = lost.iter().zip(areas).map(|(share, area)| share * area).collect();
    let mut between = symmetric(&Sparse::from_rows(rows));
    fit_sides(&mut between, sides, &wanted);
    let wanted: Vec<f64> = given.iter().zip(areas).map(|(share, area)| share * area).collect();
    scale(&mut between, &wanted, absorptivities);
    Areas::closed(between, space, areas, absorptivities)
}

impl Areas {
    /// Exchange areas rounded as the device keeps them, each row closed by its diagonal.
    pub(super) fn closed(mut between: Sparse, space: Vec<f64>, areas: &[f64], absorptivities: &[f64]) -> Self {
        let close = |(i, row): (usize, &mut [(u32, f64)])| {
            round(row, i, areas, absorptivities);
            let taken: f64 = row.iter().map(|(j, shared)| shared * absorptivities[*j as usize]).sum();
            let missing = areas[i] - space[i] - taken;
            match row.iter_mut().find(|(j, _)| *j as usize == i) {
                Some((_, diagonal)) if absorptivities[i] > MIRROR => {
                    *diagonal += missing / absorptivities[i];
                    missing.abs() / areas[i]
                }
                _ => 0.0,
            }
        };
        let returned = between.rows_mut().into_par_iter().enumerate().map(close).reduce(|| 0.0, f64::max);
        Self { between, space, returned }
    }
}

/// Shares of the light of each patch that the craft absorbs and that reach space, with at most `bounces` reflections.
fn shares(factors: &Factors, absorptivities: &[f64], bounces: Option<u32>) -> [Vec<f64>; 2] {
    match bounces {
        Some(bounces) => shares_of(factors, absorptivities, bounces),
        None => all_shares(factors, absorptivities),
    }
}

/// The same with all reflections. With reflectivities r the share x that reaches space solves A_i x_i = space_i + sum over j of S_ij r_j x_j, a symmetric system in
/// the patches that reflect. Rows are closed, so the craft absorbs the rest.
fn all_shares(factors: &Factors, absorptivities: &[f64]) -> [Vec<f64>; 2] {
    let Factors { areas, shared, space, .. } = factors;
    let reflected = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(absorptivities).map(|(value, taken)| (1.0 - taken) * value).collect()
    };
    let diagonal = reflected(areas);
    let times = |way: &[f64]| {
        let arrives = reflected(&product(shared, &reflected(way)));
        way.iter().zip(&diagonal).zip(arrives).map(|((way, diagonal), arrives)| diagonal * way - arrives).collect()
    };
    let reflecting = conjugate_gradients(&diagonal, times, &reflected(space), SOLVED, MOST as usize);
    let arrives = product(shared, &reflected(&reflecting));
    let lost = (0..areas.len()).map(|i| ((space[i] + arrives[i]) / areas[i]).clamp(0.0, 1.0));
    let lost: Vec<f64> = lost.collect();
    [lost.iter().map(|lost| 1.0 - lost).collect(), lost]
}

/// The same with at most `bounces` reflections.
fn shares_of(factors: &Factors, absorptivities: &[f64], bounces: u32) -> [Vec<f64>; 2] {
    let mut now = vec![[0.0; 2]; factors.areas.len()];
    for _ in 0..=bounces.min(MOST) {
        // Shares of the light of a ray that ends on each patch.
        let of_ray =
            |(shares, taken): (&[f64; 2], &f64)| [taken + (1.0 - taken) * shares[0], (1.0 - taken) * shares[1]];
        let ends: Vec<[f64; 2]> = now.iter().zip(absorptivities).map(of_ray).collect();
        let mean_over_rays = |i: usize| {
            let mut sum = [0.0, factors.space[i]];
            for (j, shared) in factors.shared.row(i) {
                let [absorbed, lost] = ends[*j as usize];
                sum[0] += shared * absorbed;
                sum[1] += shared * lost;
            }
            sum.map(|sum| sum / factors.areas[i])
        };
        let next: Vec<[f64; 2]> = (0..now.len()).into_par_iter().map(mean_over_rays).collect();
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
    let rows = Rows { shared: kept, weights: absorptivities, rest: &vec![0.0; wanted.len()], wanted };
    let factor = rows.factors(RIGHT, ROUNDS);
    for i in 0..wanted.len() {
        let run = kept.first[i] as usize..kept.first[i + 1] as usize;
        kept.entries[run].iter_mut().for_each(|(j, area)| *area *= factor[i] * factor[*j as usize]);
    }
}

/// Rounds the entries of a row as the device keeps them. A patch that takes no light can not make up for rounding, so its entries keep all bits of an f32.
fn round(row: &mut [(u32, f64)], i: usize, areas: &[f64], absorptivities: &[f64]) {
    for (j, area) in row.iter_mut().filter(|(j, _)| *j as usize != i) {
        let j = *j as usize;
        let mirror = absorptivities[i].min(absorptivities[j]) <= MIRROR;
        *area = if mirror { rounded(*area, 0.0, WORDS) } else { rounded(*area, FINE * areas[i].min(areas[j]), 2) };
    }
}

/// The mean of a matrix and its transposed one. Each row has a diagonal entry.
fn symmetric(rows: &Sparse) -> Sparse {
    let mean = rows.combined(&rows.transposed(), |_, _, there, back| 0.5 * (there + back));
    let row = |i: usize| {
        let mut row = mean.row(i).to_vec();
        if let Err(place) = row.binary_search_by_key(&(i as u32), |entry| entry.0) {
            row.insert(place, (i as u32, 0.0));
        }
        row
    };
    Sparse::from_rows((0..mean.len()).map(row).collect())
}

/// A number from 0 to 1 that belongs to a pair of patches, the same for both (Appleby's finalizer of MurmurHash3). Millions of pairs are asked, and 64 bits take fewer
/// products than the hash of the device, which has 32.
fn lot(i: u32, j: u32) -> f64 {
    let mut word = u64::from(i.min(j)) << 32 | u64::from(i.max(j));
    word = (word ^ (word >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    word = (word ^ (word >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    (word >> 32) as f64 * 2f64.powi(-32)
}

/// Shared areas [m2] in half the memory, which is read for each patch anew, and the blocks of patches that each row reaches, as bits.
struct LightRows {
    entries: Vec<(u32, f32)>,
    blocks: Vec<u64>,
    /// Words of blocks of a row.
    words: usize,
}

impl LightRows {
    fn new(shared: &Sparse) -> Self {
        let words = shared.len().div_ceil(64 * BLOCK);
        let mut blocks = vec![0u64; words * shared.len()];
        for (row, blocks) in blocks.chunks_mut(words.max(1)).enumerate() {
            for (column, _) in shared.row(row) {
                let block = *column as usize / BLOCK;
                blocks[block / 64] |= 1 << (block % 64);
            }
        }
        let entries = shared.entries.iter().map(|(column, area)| (*column, *area as f32)).collect();
        Self { entries, blocks, words }
    }

    /// Blocks that a row reaches.
    fn blocks_of(&self, row: usize) -> &[u64] {
        &self.blocks[row * self.words..(row + 1) * self.words]
    }
}

/// Light on patches, and the blocks of patches that any has reached, as bits.
#[derive(Debug, Default)]
struct Spread {
    light: Vec<f64>,
    reached: Vec<u64>,
}

impl Spread {
    fn new(patches: usize) -> Self {
        Self { light: vec![0.0; patches], reached: vec![0; patches.div_ceil(64 * BLOCK)] }
    }

    #[inline(always)]
    fn add(&mut self, patch: usize, light: f64) {
        self.light[patch] += light;
        self.reached[patch / BLOCK / 64] |= 1 << (patch / BLOCK % 64);
    }

    /// Adds a share of a row.
    fn add_row(&mut self, rows: &LightRows, row: usize, entries: std::ops::Range<usize>, share: f64) {
        for (patch, area) in &rows.entries[entries] {
            self.light[*patch as usize] += share * f64::from(*area);
        }
        self.reach(rows.blocks_of(row));
    }

    /// Notes that light has reached blocks.
    fn reach(&mut self, blocks: &[u64]) {
        self.reached.iter_mut().zip(blocks).for_each(|(reached, blocks)| *reached |= blocks);
    }

    /// Moves the patches with light to `all`, which is emptied first, and takes their light away. Whether a patch has light is hard to foresee, so each is written
    /// and the next one takes the place of a dark one.
    fn drain(&mut self, all: &mut SparseRow) {
        let mut count = 0;
        for (word, reached) in self.reached.iter_mut().enumerate() {
            let mut left = std::mem::take(reached);
            while left != 0 {
                let first = (64 * word + left.trailing_zeros() as usize) * BLOCK;
                left &= left - 1;
                let end = self.light.len().min(first + BLOCK);
                let block = &mut self.light[first..end];
                if all.len() < count + BLOCK {
                    all.resize(count + 8 * BLOCK, (0, 0.0));
                }
                let mut lit = 0;
                let room = &mut all[count..count + BLOCK];
                for (patch, light) in (first as u32..).zip(block.iter()) {
                    room[lit % BLOCK] = (patch, *light);
                    lit += usize::from(*light != 0.0);
                }
                block.fill(0.0);
                count += lit;
            }
        }
        all.truncate(count);
    }
}

/// Room for the light of one patch after another.
struct ReflectionRoom {
    /// All light that has arrived.
    arrived: Spread,
    /// Light on its way.
    next: Spread,
    /// The patches that it has reached.
    row: SparseRow,
    /// What patches reflect.
    sent: SparseRow,
    of_sides: Spread,
    /// For each side the area of pairs for which others stand, and how many are expected to stand for them.
    thin: Vec<[f64; 2]>,
}

impl ReflectionRoom {
    fn new(sides: &[u32]) -> Self {
        let count = sides.iter().max().map_or(0, |side| *side as usize + 1);
        let [arrived, next] = [0; 2].map(|_| Spread::new(sides.len()));
        let (of_sides, thin) = (Spread::new(count), vec![[0.0; 2]; count]);
        Self { arrived, next, row: Vec::new(), sent: Vec::new(), of_sides, thin }
    }

    /// Follows the light of a patch through its reflections.
    fn follow<'l>(
        &mut self,
        factors: &Factors,
        rows: &LightRows,
        taken: &[f64],
        (bounces, late): (Option<u32>, &impl Fn() -> Option<&'l LateLight>),
        patch: usize,
    ) {
        let [faint, crumb] = [FAINT, CRUMB].map(|share| share * factors.areas[patch]);
        self.row.clear();
        self.row.extend_from_slice(factors.shared.row(patch));
        self.arrived.reach(rows.blocks_of(patch));
        for bounce in 0..=bounces.unwrap_or(MOST).min(MOST) {
            // The first crumbs count as half of one that goes on, so that light moves forwards as often as backwards.
            let (mut left, mut gathered, mut due, mut last) = (0.0, 0.0, 0.5 * crumb, 0);
            self.sent.clear();
            for (j, light) in &self.row {
                self.arrived.light[*j as usize] += *light;
                let reflected = light * (1.0 - taken[*j as usize]);
                if reflected <= 0.0 {
                    continue;
                }
                (left, gathered, last) = (left + reflected, gathered + reflected, *j);
                if gathered >= due {
                    self.sent.push((*j, gathered));
                    (gathered, due) = (0.0, crumb);
                }
            }
            if left <= faint || bounces == Some(bounce) {
                break;
            }
            if bounce == LATE
                && left > MUCH * factors.areas[patch]
                && let Some(late) = late()
            {
                self.row.iter_mut().for_each(|(j, light)| *light *= 1.0 - taken[*j as usize]);
                late.arriving(&self.row).into_iter().enumerate().for_each(|(j, light)| self.arrived.add(j, light));
                break;
            }
            if gathered > 0.0 {
                self.sent.push((last, gathered));
            }
            for (j, light) in &self.sent {
                let row = *j as usize;
                let entries = factors.shared.first[row] as usize..factors.shared.first[row + 1] as usize;
                self.next.add_row(rows, row, entries, light / factors.areas[row]);
            }
            self.arrived.reach(&self.next.reached);
            self.next.drain(&mut self.row);
        }
    }

    /// What has arrived from a patch, and its sums by side, or of several sides where few pairs stand for many. Of the pairs that do not see each other and share little, few stand for all of them.
    fn thinned(&mut self, factors: &Factors, sides: &[u32], patch: usize) -> (SparseRow, Sided) {
        self.arrived.drain(&mut self.row);
        let mut direct = factors.shared.row(patch).iter().map(|entry| entry.0).peekable();
        let mut kept = Vec::with_capacity(2 * direct.len() + 1);
        let here = factors.areas[patch];
        for (j, area) in &self.row {
            self.of_sides.add(sides[*j as usize] as usize, *area);
            while direct.peek().is_some_and(|next| next < j) {
                direct.next();
            }
            let sees = *j as usize == patch || direct.peek() == Some(j);
            let least = THIN * here.min(factors.areas[*j as usize]);
            if sees || *area >= least {
                kept.push((*j, *area));
                continue;
            }
            let thin = &mut self.thin[sides[*j as usize] as usize];
            *thin = [thin[0] + *area, thin[1] + *area / least];
            if lot(patch as u32, *j) * least < *area {
                kept.push((*j, least));
            }
        }
        let mut all = Vec::new();
        self.of_sides.drain(&mut all);
        let mut of_sides = Sided::default();
        for (side, area) in all {
            let [thin, standing] = std::mem::take(&mut self.thin[side as usize]);
            if standing >= STANDING || thin <= SURE * area {
                of_sides.sides.push((side, area));
            } else {
                of_sides.others += area;
            }
        }
        (kept, of_sides)
    }
}
