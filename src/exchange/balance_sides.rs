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

/// Rounds of the fitting. What is left is closed with the rows.
const ROUNDS: usize = 30;
/// Bounds of a factor: a pair that one direction saw and the other did not is not made away with.
const FACTORS: [f64; 2] = [0.05, 20.0];

/// Number of the side of each patch: joint, part, face, and direction of the normal.
fn sides_of(patches: &[Patch]) -> Vec<u32> {
    let mut sides = BTreeMap::new();
    let number = |patch: &Patch| {
        let next = sides.len() as u32;
        *sides.entry((patch.joint, patch.part, patch.back, patch.buried, bin(patch.normal))).or_insert(next)
    };
    patches.iter().map(number).collect()
}

/// Areas that a patch shares with sides: the side, and the area [m2] or a factor, sorted by side.
type Sided = Vec<(u32, f64)>;

fn of(row: &Sided, side: u32) -> f64 {
    row.binary_search_by_key(&side, |entry| entry.0).map_or(1.0, |place| row[place].1)
}

/// Sums by the side of the column.
fn summed(row: impl Iterator<Item = (u32, f64)>, sides: &[u32]) -> Sided {
    let mut sums = BTreeMap::new();
    row.for_each(|(j, value)| *sums.entry(sides[j as usize]).or_insert(0.0) += value);
    sums.into_iter().collect()
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
            let at = |row: &Sided| row.binary_search_by_key(side, |entry| entry.0).map_or(0.0, |place| row[place].1);
            let share = at(&own);
            let own_variance = (even * here).powi(2) * (share * (1.0 - share)).max(1.0 / count) / count;
            let told_variance = at(&variance).max((here / count).powi(2));
            let weight = own_variance / (own_variance + told_variance);
            (*side, (1.0 - weight) * share * here + weight * at(&told))
        };
        whole.iter().map(wants).collect()
    };
    let wanted: Vec<Sided> = (0..patches.len()).into_par_iter().map(wanted).collect();
    let mut factors: Vec<Sided> = wanted.iter().map(|row| row.iter().map(|(side, _)| (*side, 1.0)).collect()).collect();
    for _ in 0..ROUNDS {
        let next = |i: usize| -> Sided {
            let scaled = shared.row(i).iter().map(|(j, area)| (*j, area * of(&factors[*j as usize], sides[i])));
            let now = summed(scaled, &sides);
            let renew = |place: usize| {
                let ((side, wanted), now, factor) = (wanted[i][place], now[place].1, factors[i][place].1);
                let right = if now > 0.0 { wanted / now } else { factor };
                (side, (factor * right).sqrt().clamp(FACTORS[0], FACTORS[1]))
            };
            (0..now.len()).map(renew).collect()
        };
        factors = (0..patches.len()).into_par_iter().map(next).collect();
    }
    for i in 0..patches.len() {
        let run = shared.first[i] as usize..shared.first[i + 1] as usize;
        for (j, area) in &mut shared.entries[run] {
            *area *= of(&factors[i], sides[*j as usize]) * of(&factors[*j as usize], sides[i]);
        }
    }
}
