//! The exchange of a craft between two poses of its joints: a mean of what was found for both.
//!
//! View factors and exchange areas change smoothly with the angle of a joint, but where something comes into view. A mean of two findings at an angle d misses
//! them by d^2 / 8 times their second derivative, which three findings tell ([`Exchange::bends`]). A mean of symmetric closed rows is symmetric and closed.

use std::sync::Arc;

use rayon::prelude::*;

use super::directions::evenness;
use super::factors::{Correction, Factors};
use super::for_light::{LightAreas, late};
use super::reflected::Areas;
use super::sky::mean_sky;
use super::sparse::Sparse;
use super::step::Exchange;

/// Change of what a patch sees of the parts of the craft, over all it sees, after which rows are made anew: of the patch that changes most, and of all, rms over
/// area. Rows are those of the middle, so half of it is missed: 0.008 of the light of a black body at 400 K changes a thin sheet at 300 K by 1.9 K in balance.
const HELD: [f64; 2] = [0.016, 0.008];
/// Bounds of the share of the way between two findings for which rows are held.
const SHARES: [f64; 2] = [1.0 / 16.0, 0.5];
/// Standard deviations of the noise of rays below which a distance from a straight line does not count.
const NOISE: f64 = 3.0;

impl Exchange {
    /// The exchange at a share of the way to another pose of the same craft, without view factors between patches: no step asks for them.
    pub(crate) fn at(&self, other: &Self, share: f64) -> Self {
        let ends = [&self.for_light, &other.for_light].map(Arc::clone);
        let for_light = late(move || {
            let [from, to] = &ends;
            LightAreas { sunlight: from.sunlight.at(&to.sunlight, share), sky: mean_sky([&from.sky, &to.sky], share) }
        });
        Self {
            patches: Arc::clone(&self.patches),
            nodes: Arc::clone(&self.nodes),
            of_node: Arc::clone(&self.of_node),
            slopes: Arc::clone(&self.slopes),
            factors: self.factors.at(&other.factors, share),
            infrared: self.infrared.at(&other.infrared, share),
            for_light,
            directions: Arc::clone(&self.directions),
            ..*self
        }
    }

    /// The same exchange with the view factors at a share of the way between two poses.
    pub(crate) fn with_factors_between(&self, [from, to]: [&Self; 2], share: f64) -> Self {
        let shared = from.factors.shared.combined(&to.factors.shared, |_, _, a, b| a + share * (b - a));
        Self { factors: Factors { shared, ..self.factors.clone() }, ..self.clone() }
    }

    /// Share of the way to another pose for which rows may be held.
    pub(crate) fn share_to_hold(&self, other: &Self) -> f64 {
        let parts = self.parts();
        let change = |number: usize| -> f64 {
            let seen = [self, other].map(|exchange| exchange.seen_parts(number, parts));
            0.5 * seen[0].iter().zip(&seen[1]).map(|(a, b)| (a - b).abs()).sum::<f64>()
        };
        self.over_held(change).recip().clamp(SHARES[0], SHARES[1])
    }

    /// Whether a mean of this and the `after` finding misses the pose in their middle by more than rows may change while they are held. `before` is the pose on the other
    /// side of this one, and `ratio` the angle to the one after over the angle to it.
    pub(crate) fn bends(&self, [before, after]: [&Self; 2], ratio: f64) -> bool {
        let middle = 0.25 / (1.0 + ratio.recip());
        let (even, parts) = (evenness(self.factors.rays), self.parts());
        let off = |number: usize| -> f64 {
            let seen = [before, self, after].map(|exchange| exchange.seen_parts(number, parts));
            let off = |part: usize| {
                let [a, b, c] = [0, 1, 2].map(|pose: usize| seen[pose][part]);
                let share = ((a + b + c) / 3.0).clamp(0.0, 1.0);
                let noise = even * self.factors.of_share(share).sqrt() * (1.0 + ratio).hypot(ratio).hypot(1.0);
                middle * (((c - b) - ratio * (b - a)).abs() - NOISE * noise).max(0.0)
            };
            0.5 * (0..seen[0].len()).map(off).sum::<f64>()
        };
        self.over_held(off) > 1.0
    }

    fn parts(&self) -> usize {
        self.patches.iter().map(|patch| patch.part as usize + 1).max().unwrap_or(0)
    }

    /// Shares of the parts, then of space, in what arrives at a patch.
    fn seen_parts(&self, number: usize, parts: usize) -> Vec<f64> {
        let area = self.patches[number].area;
        let mut seen = vec![0.0; parts + 1];
        for (from, shared) in self.infrared.between.row(number) {
            let patch = &self.patches[*from as usize];
            seen[patch.part as usize] += patch.optics.emissivity * shared / area;
        }
        seen[parts] = self.infrared.space[number] / area;
        seen
    }

    /// Changes of what patches see, over the change by which rows are made anew.
    fn over_held(&self, change: impl Fn(usize) -> f64 + Sync + Send) -> f64 {
        let changes: Vec<f64> = (0..self.patches.len()).into_par_iter().map(change).collect();
        let largest = changes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let areas = &self.factors.areas;
        let squares: f64 = changes.iter().zip(areas).map(|(change, area)| area * change * change).sum();
        let rms = (squares / areas.iter().sum::<f64>()).sqrt();
        (largest / HELD[0]).max(rms / HELD[1])
    }
}

impl Factors {
    fn at(&self, other: &Self, share: f64) -> Self {
        let mean = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect() };
        let Correction { rms, largest, unclosed } = other.correction;
        let own = self.correction;
        Self {
            areas: self.areas.clone(),
            shared: Sparse::default(),
            space: mean(&self.space, &other.space),
            inside: mean(&self.inside, &other.inside),
            correction: Correction {
                rms: own.rms.max(rms),
                largest: own.largest.max(largest),
                unclosed: own.unclosed.max(unclosed),
            },
            rays: self.rays,
        }
    }
}

impl Areas {
    fn at(&self, other: &Self, share: f64) -> Self {
        let between = self.between.combined(&other.between, |_, _, a, b| a + share * (b - a));
        let space = self.space.iter().zip(&other.space).map(|(a, b)| a + share * (b - a)).collect();
        Self { between, space, returned: self.returned.max(other.returned) }
    }
}
