//! A place of foil, stepped through the past twice: with its own light, and with the light that its nodes show.

use std::array;
use std::ops::{Add, Mul};
use std::sync::Arc;

use glam::DVec3;

use super::moments::Moment;
use super::surface::{Foil, FoilSurface, FoilTriangle};

/// Moments between two that are alike, at most, without a ray of their own.
const APART: usize = 4;

/// How the nodes began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Beginning {
    /// With a past of the same kind.
    Past,
    /// In balance.
    Balance,
    /// At a temperature [K].
    Temperature(f64),
}

/// A value between corners with weights.
pub(super) fn interpolate<T: Mul<f64, Output = T> + Add<Output = T>>(corners: [T; 3], [a, b, c]: [f64; 3]) -> T {
    let [first, second, third] = corners;
    first * a + second * b + third * c
}

/// The places of a triangle.
pub(super) struct Places<'a> {
    pub(super) surface: &'a FoilSurface,
    /// The oldest first.
    pub(super) moments: &'a [Arc<Moment>],
    pub(super) begins: Beginning,
    pub(super) triangle: &'a FoilTriangle,
    /// Whether it is lit at each moment, `None` where a ray has to tell.
    pub(super) known: &'a [Option<bool>],
}

impl Places<'_> {
    /// How much warmer a place (in the frame of its joint) is than its nodes show [K].
    pub(super) fn change(&self, place: DVec3, weights: [f64; 3]) -> f64 {
        let (surface, moments) = (self.surface, self.moments);
        let node = &surface.nodes[self.triangle.nodes[0]];
        let Some(foil) = &surface.foils[node.material as usize] else { return 0.0 };
        let lit = self.lit(|moment| {
            let FoilTriangle { normal, both_sides, .. } = self.triangle;
            moments[moment].sees_sun(place, node.joint, *normal, *both_sides)
        });
        let fluxes = |moment: usize| {
            let of = self.triangle.nodes.map(|node| moments[moment].nodes[node]);
            let mix = |values: [f32; 3]| interpolate(values.map(f64::from), weights);
            let space = foil.faces * moments[moment].space;
            let sun = if lit[moment] { mix(of.map(|node| node.open)) } else { 0.0 };
            [sun + mix(of.map(|node| node.planet)) + space, mix(of.map(|node| node.shown)) + space]
        };
        let fluxes: Vec<[f64; 2]> = (0..moments.len()).map(fluxes).collect();
        let length: f64 = moments.iter().map(|moment| moment.length).sum();
        let mean = match length > 0.0 {
            true => moments.iter().zip(&fluxes).map(|(moment, [_, shown])| moment.length * shown).sum::<f64>() / length,
            false => fluxes[0][1],
        };
        // The structure below is slow: it has the mean temperature, and gives back what it receives there.
        let free = Foil { below: 0.0, ..*foil };
        let given = foil.below * free.balance(mean).powi(4);
        let mut kelvin: [f64; 2] = match self.begins {
            Beginning::Temperature(kelvin) => [kelvin; 2],
            Beginning::Balance => fluxes[0].map(|flux| foil.balance(flux + given)),
            Beginning::Past => [foil.balance(mean + given); 2],
        };
        for (moment, fluxes) in moments.iter().zip(&fluxes).filter(|(moment, _)| moment.length > 0.0) {
            kelvin = array::from_fn(|which| foil.after(kelvin[which], fluxes[which] + given, moment.length));
        }
        kelvin[0] - kelvin[1]
    }

    /// Whether a place is lit at each moment. Rays look at a few moments, and between those that differ for the change.
    fn lit(&self, ray: impl Fn(usize) -> bool) -> Vec<bool> {
        let look = |moment: usize| self.known[moment].unwrap_or_else(|| ray(moment));
        let last = self.known.len() - 1;
        let mut lit = vec![false; last + 1];
        (lit[0], lit[last]) = (look(0), look(last));
        let mut between = vec![[0, last]];
        while let Some([low, high]) = between.pop() {
            if high - low < 2 {
                continue;
            }
            let is_known = || self.known[low + 1..high].iter().any(|known| *known == Some(!lit[low]));
            if lit[low] == lit[high] && high - low <= APART && !is_known() {
                let value = lit[low];
                lit[low + 1..high].fill(value);
                continue;
            }
            let middle = low.midpoint(high);
            lit[middle] = look(middle);
            between.extend([[low, middle], [middle, high]]);
        }
        lit
    }
}
