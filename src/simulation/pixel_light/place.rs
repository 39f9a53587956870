//! A place of foil, stepped through the past twice: with its own light, and with the light that its nodes show.

use std::ops::{Add, Mul};
use std::sync::Arc;

use glam::DVec3;

use super::moments::{Moment, NodeLight};
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
    surface: &'a FoilSurface,
    /// The oldest first.
    moments: &'a [Arc<Moment>],
    begins: Beginning,
    triangle: &'a FoilTriangle,
    /// Whether it is lit at each moment, `None` where a ray has to tell.
    known: &'a [Option<bool>],
    /// Mean of what its nodes take over the past [W/m2].
    mean: f64,
}

impl<'a> Places<'a> {
    /// The places of a triangle that is lit as is known at each moment.
    pub(super) fn new(
        surface: &'a FoilSurface,
        (moments, begins): (&'a [Arc<Moment>], Beginning),
        (triangle, known): (&'a FoilTriangle, &'a [Option<bool>]),
    ) -> Self {
        let places = Self { surface, moments, begins, triangle, known, mean: 0.0 };
        Self { mean: places.mean(), ..places }
    }

    /// Temperatures of the nodes by the light that each takes [K]. `None` where the triangle is no foil.
    pub(super) fn of_nodes(&self) -> Option<[f64; 3]> {
        let foil = self.foil()?;
        Some(self.triangle.nodes.map(|node| {
            let shown = |moment: &Arc<Moment>| f64::from(moment.nodes[node].shown);
            let fluxes: Vec<f64> = self.moments.iter().map(shown).collect();
            self.after_past(&foil, &fluxes)
        }))
    }

    /// How much warmer a place (in the frame of its joint) is than its nodes show, which have these temperatures [K].
    pub(super) fn change(&self, place: DVec3, weights: [f64; 3], of_nodes: [f64; 3]) -> f64 {
        let Some(foil) = self.foil() else { return 0.0 };
        let moments = self.moments;
        let lit = self.lit(|moment| {
            let FoilTriangle { normal, both_sides, .. } = self.triangle;
            moments[moment].sees_sun(place, self.joint(), *normal, *both_sides)
        });
        let mix = |moment: &Moment, value: fn(&NodeLight) -> f32| {
            interpolate(self.triangle.nodes.map(|node| f64::from(value(&moment.nodes[node]))), weights)
        };
        let absorbed = |(moment, lit): (&Arc<Moment>, &bool)| {
            mix(moment, |node| node.planet) + if *lit { mix(moment, |node| node.open) } else { 0.0 }
        };
        let fluxes: Vec<f64> = moments.iter().zip(&lit).map(absorbed).collect();
        self.after_past(&foil, &fluxes) - interpolate(of_nodes, weights)
    }

    fn foil(&self) -> Option<Foil> {
        self.surface.foils[self.surface.nodes[self.triangle.nodes[0]].material as usize]
    }

    fn joint(&self) -> u32 {
        self.surface.nodes[self.triangle.nodes[0]].joint
    }

    /// Mean of what the nodes take over the past [W/m2].
    fn mean(&self) -> f64 {
        let shown = |moment: &Arc<Moment>| self.triangle.nodes.map(|node| f64::from(moment.nodes[node].shown));
        let shown = |moment: &Arc<Moment>| shown(moment).iter().sum::<f64>() / 3.0;
        let length: f64 = self.moments.iter().map(|moment| moment.length).sum();
        if length == 0.0 {
            return shown(&self.moments[0]);
        }
        self.moments.iter().map(|moment| moment.length * shown(moment)).sum::<f64>() / length
    }

    /// Temperature after the past under absorbed fluxes without space [K]. All places of a triangle began alike where nothing says how. The structure below a
    /// blanket is slow: it has the temperature of balance with the mean flux, and gives back what it receives there.
    fn after_past(&self, foil: &Foil, fluxes: &[f64]) -> f64 {
        let mean = self.mean;
        let space = |moment: usize| foil.faces * self.moments[moment].space;
        let given = foil.below * Foil { below: 0.0, ..*foil }.balance(mean + space(0)).powi(4);
        let start = match self.begins {
            Beginning::Temperature(kelvin) => kelvin,
            Beginning::Balance => foil.balance(fluxes[0] + space(0) + given),
            Beginning::Past => foil.balance(mean + space(0) + given),
        };
        let moments = self.moments.iter().enumerate().filter(|(_, moment)| moment.length > 0.0);
        moments.fold(start, |kelvin, (number, moment)| {
            foil.after(kelvin, fluxes[number] + space(number) + given, moment.length)
        })
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
