//! Gives every patch the share of each side of the craft that its own rays tell.
//!
//! Rays of a patch are spread evenly, so the share of them that meets a whole side of a part (all its patches that face one way) is much more exact than of independent
//! rays. Rays of the many patches of that side are spread evenly for each of them alone, so what they tell together of one patch has the noise of independent rays.
//! The mean of both directions, which makes view factors reciprocal, would bring that noise into every row. So shared areas S_ij are scaled by a factor for i and the side
//! of j, and one for j and the side of i, until each patch shares the right area with each side. S stays symmetric (iterative proportional fitting: Deming and Stephan
//! 1940, Annals of Mathematical Statistics 11).

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::directions::evenness;
use super::patches::{Patch, bin};
use super::sparse::Sparse;
use crate::stop::Watch;

/// Rounds of the fitting. What is left is closed with the rows.
const ROUNDS: usize = 30;
/// Bounds of a factor: a pair that one direction saw and the other did not is not made away with.
const FACTORS: [f64; 2] = [0.05, 20.0];

/// Number of the side of each patch: joint, part, face, and direction of the normal.
pub(super) fn sides_of(patches: &[Patch]) -> Vec<u32> {
    let mut sides = BTreeMap::new();
    let number = |patch: &Patch| {
        let next = sides.len() as u32;
        *sides.entry((patch.joint, patch.part, patch.back, patch.buried, bin(patch.normal))).or_insert(next)
    };
    patches.iter().map(number).collect()
}

/// Areas that a patch shares with sides: the side, and the area [m2], sorted by side.
pub(super) type Sided = Vec<(u32, f64)>;

fn at(row: &Sided, side: u32) -> f64 {
    row.binary_search_by_key(&side, |entry| entry.0).map_or(0.0, |place| row[place].1)
}

/// Sums by the side of the column.
fn summed(row: impl Iterator<Item = (u32, f64)>, sides: &[u32]) -> Sided {
    let mut sums: Sided = row.map(|(j, value)| (sides[j as usize], value)).collect();
    sums.sort_by_key(|entry| entry.0);
    sums.dedup_by(|next, sum| {
        let same = next.0 == sum.0;
        sum.1 += if same { next.1 } else { 0.0 };
        same
    });
    sums
}

/// Scales `shared` areas [m2] to what the rays of each patch tell of sides. `cast` has the shares of `rays` rays of each row.
pub(super) fn balance_sides(patches: &[Patch], cast: &Sparse, shared: &mut Sparse, rays: u32) {
    let sides = sides_of(patches);
    let area = |patch: u32| patches[patch as usize].area;
    let back = cast.transposed();
    let (count, even) = (f64::from(rays), evenness(rays));
    // The wanted area: a mean of what both directions tell, with weights inverse to their variances.
    let wanted = |i: usize| -> Sided {
        let here = patches[i].area;
        let own = summed(cast.row(i).iter().copied(), &sides);
        let told = summed(back.row(i).iter().map(|(j, share)| (*j, share * area(*j))), &sides);
        let variance = summed(back.row(i).iter().map(|(j, share)| (*j, share * area(*j).powi(2) / count)), &sides);
        let whole = summed(shared.row(i).iter().copied(), &sides);
        let wants = |(side, _): &(u32, f64)| {
            let share = at(&own, *side);
            let own_variance = (even * here).powi(2) * (share * (1.0 - share)).max(1.0 / count) / count;
            let told_variance = at(&variance, *side).max((here / count).powi(2));
            let weight = own_variance / (own_variance + told_variance);
            (*side, (1.0 - weight) * share * here + weight * at(&told, *side))
        };
        whole.iter().map(wants).collect()
    };
    let wanted: Vec<Sided> = (0..patches.len()).into_par_iter().map(wanted).collect();
    fit_sides(shared, &sides, &wanted);
}

/// Rows whose factors one thread renews together.
const CHUNK: usize = 64;

/// Scales areas, whose places and values are symmetric, until each row shares the wanted area with each side that it has entries of.
pub(super) fn fit_sides(shared: &mut Sparse, sides: &[u32], wanted: &[Sided]) {
    let count = shared.len();
    // The sides of each row, one row after the other, and the areas that it wants of them.
    let mut first = vec![0];
    let mut of_rows: Vec<u32> = Vec::new();
    let mut right: Vec<f64> = Vec::new();
    for (row, wanted) in wanted.iter().enumerate() {
        let mut of_row: Vec<u32> = shared.row(row).iter().map(|(j, _)| sides[*j as usize]).collect();
        of_row.sort_unstable();
        of_row.dedup();
        right.extend(of_row.iter().map(|side| at(wanted, *side)));
        of_rows.extend(of_row);
        first.push(of_rows.len());
    }
    // For each entry the place of its own factor and of the factor of its mirror image.
    let mut places = vec![[0u32; 2]; shared.entries.len()];
    let mut of_side = vec![0; sides.iter().max().map_or(0, |side| *side as usize + 1)];
    for row in 0..count {
        (first[row]..)
            .zip(&of_rows[first[row]..first[row + 1]])
            .for_each(|(at, side)| of_side[*side as usize] = at as u32);
        for entry in shared.first[row] as usize..shared.first[row + 1] as usize {
            places[entry][0] = of_side[sides[shared.entries[entry].0 as usize] as usize];
        }
    }
    // Rows are in their order, so the mirror images of a column are met one after the other.
    let mut next = shared.first.clone();
    for row in 0..count {
        for entry in shared.first[row] as usize..shared.first[row + 1] as usize {
            let image = &mut next[shared.entries[entry].0 as usize];
            places[entry][1] = places[*image as usize][0];
            *image += 1;
        }
    }
    let mut factors = vec![1.0; of_rows.len()];
    let watch = Watch::begin();
    for _ in 0..ROUNDS {
        watch.look();
        let next = |chunk: usize| -> Vec<f64> {
            let rows = chunk * CHUNK..count.min((chunk + 1) * CHUNK);
            let (start, end) = (first[rows.start], first[rows.end]);
            let entries = shared.first[rows.start] as usize..shared.first[rows.end] as usize;
            let mut now = vec![0.0; end - start];
            for ((_, area), [own, mirrored]) in shared.entries[entries.clone()].iter().zip(&places[entries]) {
                now[*own as usize - start] += area * factors[*mirrored as usize];
            }
            for ((now, factor), right) in now.iter_mut().zip(&factors[start..end]).zip(&right[start..end]) {
                let wanted: f64 = if *now > 0.0 { right / *now } else { *factor };
                *now = (factor * wanted).sqrt().clamp(FACTORS[0], FACTORS[1]);
            }
            now
        };
        let chunks: Vec<Vec<f64>> = (0..count.div_ceil(CHUNK)).into_par_iter().map(next).collect();
        factors = chunks.concat();
    }
    for ((_, area), [own, mirrored]) in shared.entries.iter_mut().zip(&places) {
        *area *= factors[*own as usize] * factors[*mirrored as usize];
    }
}
