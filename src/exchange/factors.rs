//! View factors from the ends of rays, made reciprocal and closed.
//!
//! The share f_ij of the rays of patch i that end on j estimates its view factor. Both f_ij and f_ji estimate the shared area S_ij = A_i F_ij = A_j F_ji [m2].
//! Their mean with weights inverse to their variances is (f_ij + f_ji) A_i A_j / (A_i + A_j). Each patch then gets the share of each side of the craft that its
//! own rays tell ([`super::balance_sides`]). Then one factor d_i for each patch closes the rows: S_ij becomes
//! d_i S_ij d_j and the area A_i F_i,space becomes d_i times itself, so that each row sums to A_i. Rays that end on the inner face of a skin count as
//! light that comes back to their own patch.

use rayon::prelude::*;

use super::balance_sides::balance_sides;
use super::cast::{INSIDE, SPACE};
use super::patches::Patch;
use super::scaling::Rows;
use super::sparse::{Sparse, SparseRow};

/// Most rounds in which rows are closed. The diagonal takes the rest.
const ROUNDS: usize = 2000;
/// Error of a row that counts as closed, over its area.
const CLOSED: f64 = 1e-13;

/// Share of rays to inner faces above which a patch lies inside another part.
const BURIED: f64 = 0.95;

/// View factors as areas.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Factors {
    /// Areas of the patches [m2].
    pub areas: Vec<f64>,
    /// Shared areas [m2], symmetric.
    pub shared: Sparse,
    /// Area times view factor to space [m2].
    pub space: Vec<f64>,
    pub(crate) rays: u32,
    /// Changes that made the view factors reciprocal and closed.
    pub correction: Correction,
    /// Share of the rays of each patch that ended on the inner face of a skin.
    pub inside: Vec<f64>,
}

/// Changes of view factors.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Correction {
    /// Root mean square over the view factors above 0.
    pub rms: f64,
    pub(crate) largest: f64,
    /// Largest error of a row that no factors close, over its area. The diagonal takes this error.
    pub unclosed: f64,
}

impl Factors {
    /// View factors from the ends of `rays` rays of each patch.
    pub(crate) fn new(patches: &[Patch], ends: &[u32], rays: u32) -> Self {
        let areas: Vec<f64> = patches.iter().map(|patch| patch.area).collect();
        let share = 1.0 / f64::from(rays);
        let counted: Vec<(SparseRow, f64, u32)> = ends
            .par_chunks(rays as usize)
            .enumerate()
            .map(|(patch, ends)| {
                let mut ends: Vec<u32> = ends.to_vec();
                let inside = ends.iter().filter(|end| **end == INSIDE).count() as u32;
                ends.iter_mut().filter(|end| **end == INSIDE).for_each(|end| *end = patch as u32);
                ends.sort_unstable();
                let runs = ends.chunk_by(|a, b| a == b).map(|run| (run[0], run.len() as f64 * share));
                let (space, row): (Vec<_>, Vec<_>) = runs.partition(|(end, _)| *end == SPACE);
                (row, space.first().map_or(0.0, |(_, share)| *share), inside)
            })
            .collect();
        let inside = counted.iter().map(|row| f64::from(row.2) * share).collect();
        let space: Vec<f64> = counted.iter().zip(&areas).map(|(row, area)| row.1 * area).collect();
        let cast = Sparse::from_rows(counted.into_iter().map(|row| row.0).collect());
        let mut shared = cast.combined(&cast.transposed(), |row, column, there, back| {
            let (here, other) = (areas[row], areas[column as usize]);
            // In this order both halves of the matrix have the same bits.
            (there + back) * (here * other / (here + other))
        });
        balance_sides(patches, &cast, &mut shared, rays);
        let mut closed = space.clone();
        let unclosed = close(&areas, &mut shared, &mut closed);
        let correction = Correction { unclosed, ..changes(&areas, [&cast, &shared], [&space, &closed]) };
        Self { areas, shared, space: closed, rays, correction, inside }
    }

    /// Share of the light of all patches, by area, that meets the inner face of a skin.
    pub fn inside_share(&self) -> f64 {
        let met: f64 = self.inside.iter().zip(&self.areas).map(|(share, area)| share * area).sum();
        met / self.areas.iter().sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Patches that see little but inner faces, because they lie inside other parts, and their area [m2].
    pub fn buried(&self) -> (usize, f64) {
        let buried = self.inside.iter().zip(&self.areas).filter(|(share, _)| **share > BURIED);
        buried.fold((0, 0.0), |(count, all), (_, area)| (count + 1, all + area))
    }

    /// View factor from a patch to space.
    pub fn to_space(&self, from: usize) -> f64 {
        self.space[from] / self.areas[from]
    }

    /// Variance of a shared area [m4] as for independent rays, at least the variance of a single ray.
    pub(crate) fn variance(&self, from: usize, to: u32) -> f64 {
        let (here, other) = (self.areas[from], self.areas[to as usize]);
        let shared = self.shared.at(from, to);
        let weight = here * other / (here + other);
        weight * weight * (self.of_share(shared / here) + self.of_share(shared / other))
    }

    /// Variance of the area that a patch shares with space [m4], as for independent rays.
    pub(crate) fn variance_to_space(&self, from: usize) -> f64 {
        self.areas[from] * self.areas[from] * self.of_share(self.to_space(from))
    }

    pub(crate) fn of_share(&self, share: f64) -> f64 {
        let rays = f64::from(self.rays);
        (share * (1.0 - share)).max(1.0 / rays) / rays
    }
}

/// Closes the rows. Returns the largest error that is left for the diagonal, over the area of its row.
fn close(areas: &[f64], shared: &mut Sparse, space: &mut [f64]) -> f64 {
    let rows = Rows { shared, weights: &vec![1.0; areas.len()], rest: space, wanted: areas };
    let factor = rows.factors(CLOSED, ROUNDS);
    let mut worst = 0.0f64;
    for i in 0..areas.len() {
        let run = shared.first[i] as usize..shared.first[i + 1] as usize;
        shared.entries[run.clone()].iter_mut().for_each(|(j, area)| *area *= factor[i] * factor[*j as usize]);
        space[i] *= factor[i];
        let missing = areas[i] - space[i] - shared.entries[run.clone()].iter().map(|(_, area)| area).sum::<f64>();
        worst = worst.max(missing.abs() / areas[i]);
        // Every row has a diagonal entry where it is not closed to rounding.
        if let Some((_, diagonal)) = shared.entries[run].iter_mut().find(|(j, _)| *j as usize == i) {
            *diagonal += missing;
        } else {
            space[i] += missing;
        }
    }
    worst
}

/// Changes from view factors that were found to shared areas.
fn changes(areas: &[f64], [found, shared]: [&Sparse; 2], [space, closed]: [&[f64]; 2]) -> Correction {
    let (mut sum, mut count, mut largest) = (0.0, 0usize, 0.0f64);
    let mut take = |change: f64| {
        sum += change * change;
        count += 1;
        largest = largest.max(change.abs());
    };
    for (i, area) in areas.iter().enumerate() {
        take((closed[i] - space[i]) / area);
        // Entries are sorted by column, so both rows are walked together.
        let mut cast = found.row(i).iter().peekable();
        for (j, shared) in shared.row(i) {
            while cast.next_if(|(column, _)| column < j).is_some() {}
            take(shared / area - cast.next_if(|(column, _)| column == j).map_or(0.0, |(_, share)| *share));
        }
    }
    Correction { rms: (sum / count.max(1) as f64).sqrt(), largest, unclosed: 0.0 }
}
