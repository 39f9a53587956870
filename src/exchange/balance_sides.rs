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

/// Areas that a patch shares with sides of the craft.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Sided {
    /// Sides by themselves, and the area of each [m2], sorted by side.
    pub(super) sides: Vec<(u32, f64)>,
    /// Area of all other sides together [m2].
    pub(super) others: f64,
}

/// The number that stands for all sides that a patch has not by themselves.
const OTHERS: u32 = u32::MAX;

impl Sided {
    fn place(&self, side: u32) -> Option<usize> {
        self.sides.binary_search_by_key(&side, |entry| entry.0).ok()
    }

    /// A side, where it is by itself, or [`OTHERS`].
    fn class(&self, side: u32) -> u32 {
        self.place(side).map_or(OTHERS, |_| side)
    }

    /// Area shared with a class [m2].
    fn at(&self, class: u32) -> f64 {
        self.place(class).map_or(self.others, |place| self.sides[place].1)
    }
}

/// Sums of a row by side, and the sides that its shared areas have entries of.
struct SideSums {
    /// Shares of the rays of the row's own patch, areas [m2] that rays of others tell, and variances [m4] of these areas: as the own rays expect them, and by the rays of others.
    sums: Vec<[f64; 4]>,
    met: Vec<bool>,
    order: Vec<u32>,
}

impl SideSums {
    fn new(sides: &[u32]) -> Self {
        let count = sides.iter().max().map_or(0, |side| *side as usize + 1);
        Self { sums: vec![[0.0; 4]; count], met: vec![false; count], order: Vec::new() }
    }
}

/// Scales `shared` areas [m2] to what the rays of each patch tell of sides. `cast` has the shares of `rays` rays of each row.
pub(super) fn balance_sides(patches: &[Patch], cast: &Sparse, shared: &mut Sparse, rays: u32) {
    let sides = sides_of(patches);
    let area = |patch: u32| patches[patch as usize].area;
    let back = cast.transposed();
    let (count, even) = (f64::from(rays), evenness(rays));
    // The wanted area: a mean of what both directions tell, with weights inverse to their variances.
    let wanted = |room: &mut SideSums, i: usize| -> Sided {
        let here = patches[i].area;
        let SideSums { sums, met, order } = room;
        order.clear();
        for (j, _) in shared.row(i) {
            let side = sides[*j as usize];
            if !std::mem::replace(&mut met[side as usize], true) {
                sums[side as usize] = [0.0; 4];
                order.push(side);
            }
        }
        order.sort_unstable();
        for (j, share) in cast.row(i) {
            let [own, _, variance, _] = &mut sums[sides[*j as usize] as usize];
            *own += share;
            *variance += share * here * area(*j) / count;
        }
        for (j, share) in back.row(i) {
            let [_, told, _, met_variance] = &mut sums[sides[*j as usize] as usize];
            *told += share * area(*j);
            *met_variance += share * area(*j).powi(2) / count;
        }
        let wants = |side: &u32| {
            met[*side as usize] = false;
            let [share, told, expected, met_variance] = sums[*side as usize];
            let own_variance = (even * here).powi(2) * (share * (1.0 - share)).max(1.0 / count) / count;
            let told_variance = met_variance.max(expected).max((here / count).powi(2));
            let weight = own_variance / (own_variance + told_variance);
            (*side, (1.0 - weight) * share * here + weight * told)
        };
        Sided { sides: order.iter().map(wants).collect(), others: 0.0 }
    };
    let patches = (0..patches.len()).into_par_iter();
    let wanted: Vec<Sided> = patches.map_init(|| SideSums::new(&sides), wanted).collect();
    fit_sides(shared, &sides, &wanted);
}

/// Factors that one thread renews together.
const CHUNK: usize = 1024;

/// The areas that factors of `shared` want [m2], and for each entry the place of its own factor and of the factor of its mirror image. Each row has a factor for each class of sides.
fn factor_places(shared: &Sparse, sides: &[u32], wanted: &[Sided]) -> (Vec<f64>, Vec<[u32; 2]>) {
    let count = shared.len();
    // The classes of sides of each row, one row after the other, and the areas that it wants of them.
    let mut first = vec![0];
    let mut of_rows: Vec<u32> = Vec::new();
    let mut right: Vec<f64> = Vec::new();
    let others = sides.iter().max().map_or(0, |side| *side as usize + 1);
    let place = |class: u32| if class == OTHERS { others } else { class as usize };
    let mut of_class = vec![usize::MAX; others + 1];
    for (row, wanted) in wanted.iter().enumerate() {
        let own = shared.row(row).iter().map(|(j, _)| wanted.class(sides[*j as usize]));
        let is_first = |class: &u32| std::mem::replace(&mut of_class[place(*class)], row) != row;
        let mut of_row: Vec<u32> = own.filter(is_first).collect();
        of_row.sort_unstable();
        right.extend(of_row.iter().map(|class| wanted.at(*class)));
        of_rows.extend(of_row);
        first.push(of_rows.len());
    }
    let mut places = vec![[0u32; 2]; shared.entries.len()];
    for row in 0..count {
        let of_row = first[row]..first[row + 1];
        of_row.clone().zip(&of_rows[of_row]).for_each(|(at, class)| of_class[place(*class)] = at);
        for entry in shared.first[row] as usize..shared.first[row + 1] as usize {
            let class = wanted[row].class(sides[shared.entries[entry].0 as usize]);
            places[entry][0] = of_class[place(class)] as u32;
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
    (right, places)
}

/// Scales areas, whose places and values are symmetric, until each row shares the wanted area with each side that it has entries of, and with all other sides together.
pub(super) fn fit_sides(shared: &mut Sparse, sides: &[u32], wanted: &[Sided]) {
    let (right, places) = factor_places(shared, sides, wanted);
    // The entries of each factor, one factor after the other.
    let mut starts = vec![0u32; right.len() + 1];
    places.iter().for_each(|[own, _]| starts[*own as usize + 1] += 1);
    (0..right.len()).for_each(|own| starts[own + 1] += starts[own]);
    let mut next = starts.clone();
    let (mut areas, mut mirrors) = (vec![0.0; places.len()], vec![0u32; places.len()]);
    for ((_, area), [own, mirrored]) in shared.entries.iter().zip(&places) {
        let at = &mut next[*own as usize];
        (areas[*at as usize], mirrors[*at as usize]) = (*area, *mirrored);
        *at += 1;
    }
    let mut factors = vec![1.0; right.len()];
    let watch = Watch::begin();
    for _ in 0..ROUNDS {
        watch.look();
        let renew = |(chunk, renewed): (usize, &mut [f64])| {
            for (own, renewed) in (chunk * CHUNK..).zip(renewed) {
                let mut now = 0.0;
                for at in starts[own] as usize..starts[own + 1] as usize {
                    now += areas[at] * factors[mirrors[at] as usize];
                }
                let wanted: f64 = if now > 0.0 { right[own] / now } else { factors[own] };
                *renewed = (factors[own] * wanted).sqrt().clamp(FACTORS[0], FACTORS[1]);
            }
        };
        let mut all = vec![0.0; factors.len()];
        all.par_chunks_mut(CHUNK).enumerate().for_each(renew);
        factors = all;
    }
    for ((_, area), [own, mirrored]) in shared.entries.iter_mut().zip(&places) {
        *area *= factors[*own as usize] * factors[*mirrored as usize];
    }
}
