//! A place of foil, stepped through the past twice: with its own light, and with the light that its nodes show.

use std::ops::{Add, Mul};
use std::sync::Arc;

use glam::DVec3;

use super::disc::SunShape;
use super::moments::{Moment, NodeLight, Quarters, SunRays};
use super::surface::{Foil, FoilSurface, FoilTriangle};
use crate::environment::shadow::JointTrees;

/// Moments between two that are alike, at most, without a ray of their own, where they lie long ago.
const APART: usize = 4;
/// Time constants before an image of which every moment has a ray of its own. The shadow of a thin strut comes and goes between two moments that are alike, and what it left of
/// moments before has faded to a seventh.
const LOOKED_AT: f64 = 4.0;
/// Difference of the shares of two moments from which rays look for its time.
const CHANGES: f64 = 0.25;
/// Most trials of a flux that brings a node to its temperature.
const TRIALS: usize = 6;
/// Least change of what a node emits in the end, over a change of what it takes, by which a next trial is chosen.
const LEAST_SLOPE: f64 = 0.1;
/// Share by which a value is varied for a derivative.
const VARIED: f64 = 0.01;
/// Distance from its temperature at which it is there [K].
const CLOSE: f64 = 1e-3;

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

/// A node of a triangle after the past.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeEnd {
    kelvin: f64,
    /// What it takes besides the light that is known [W/m2].
    other: f64,
}

/// A value between corners with weights.
pub(super) fn interpolate<T: Mul<f64, Output = T> + Add<Output = T>>(corners: [T; 3], [a, b, c]: [f64; 3]) -> T {
    let [first, second, third] = corners;
    first * a + second * b + third * c
}

/// The places of a triangle.
pub(super) struct Places<'a> {
    surface: &'a FoilSurface,
    trees: &'a JointTrees,
    /// The oldest first.
    moments: &'a [Arc<Moment>],
    /// Sun and joints between each moment and the next.
    quarters: &'a [Quarters],
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
        (surface, trees): (&'a FoilSurface, &'a JointTrees),
        (moments, quarters, begins): (&'a [Arc<Moment>], &'a [Quarters], Beginning),
        (triangle, known): (&'a FoilTriangle, &'a [Option<bool>]),
    ) -> Self {
        let places = Self { surface, trees, moments, quarters, begins, triangle, known, mean: 0.0 };
        Self { mean: places.mean(), ..places }
    }

    /// The nodes by the light that each takes. With their temperatures [K] they take what else brings them there. `None` where the triangle is no foil.
    pub(super) fn of_nodes(&self, temperatures: Option<[f64; 3]>) -> Option<[NodeEnd; 3]> {
        let foil = self.foil()?;
        Some([0, 1, 2].map(|corner| {
            let shown = |moment: &Arc<Moment>| f64::from(moment.nodes[self.triangle.nodes[corner]].shown);
            let fluxes: Vec<f64> = self.moments.iter().map(shown).collect();
            self.node_at(&foil, &fluxes, temperatures.map(|all| all[corner]))
        }))
    }

    /// A node that takes fluxes, and with a temperature [K] what else brings it there in the mean over the past. By secants.
    fn node_at(&self, foil: &Foil, fluxes: &[f64], temperature: Option<f64>) -> NodeEnd {
        let end = |other: f64| NodeEnd { kelvin: self.after_past(foil, fluxes, other), other };
        let mut now = end(0.0);
        let Some(own) = temperature else { return now };
        let lacks = |of: &NodeEnd| (foil.faces + foil.below) * (own.powi(4) - of.kelvin.powi(4));
        let mut step = lacks(&now);
        for _ in 0..TRIALS {
            if (now.kelvin - own).abs() < CLOSE || !step.is_finite() {
                break;
            }
            let next = end(now.other + step);
            let slope = (lacks(&now) - lacks(&next)) / step;
            (now, step) = (next, lacks(&next) / slope.max(LEAST_SLOPE));
        }
        now
    }

    /// How much warmer a place (in the frame of its joint) is than its nodes show [K], and the share of the Sun that it sees in the end.
    pub(super) fn change(&self, place: DVec3, weights: [f64; 3], of_nodes: [NodeEnd; 3], shape: SunShape) -> [f64; 2] {
        let Some(foil) = self.foil() else { return [0.0; 2] };
        let (lit, now) = self.lit_at(place, shape);
        let fluxes: Vec<f64> = self.absorbed(&lit, weights).into_iter().map(|[sun, planet]| sun + planet).collect();
        let between = |value: fn(&NodeEnd) -> f64| interpolate(of_nodes.map(|node| value(&node)), weights);
        let kelvin = self.after_past(&foil, &fluxes, between(|node| node.other)) - between(|node| node.kelvin);
        [kelvin, now]
    }

    /// By how much more a place changes than its nodes show, for a change by all of its sunlight, of the emission of its faces, and of its capacity [K].
    pub(super) fn derivatives(&self, place: DVec3, weights: [f64; 3], of_nodes: [NodeEnd; 3]) -> Option<[f64; 3]> {
        let foil = self.foil()?;
        let absorbed = self.absorbed(&self.lit_at(place, SunShape::Disc).0, weights);
        let change = |foil: &Foil, sunlight: f64| {
            let fluxes: Vec<f64> = absorbed.iter().map(|[sun, planet]| sunlight * sun + planet).collect();
            let node = |corner: usize| {
                let of = |moment: &Arc<Moment>| {
                    let NodeLight { shown, planet, .. } = moment.nodes[self.triangle.nodes[corner]];
                    sunlight * f64::from(shown - planet) + f64::from(planet)
                };
                let fluxes: Vec<f64> = self.moments.iter().map(of).collect();
                self.after_past(foil, &fluxes, of_nodes[corner].other)
            };
            let other = interpolate(of_nodes.map(|node| node.other), weights);
            self.after_past(foil, &fluxes, other) - interpolate([0, 1, 2].map(node), weights)
        };
        let central = |of: &dyn Fn(f64) -> f64| (of(1.0 + VARIED) - of(1.0 - VARIED)) / (2.0 * VARIED);
        Some([
            central(&|factor| change(&foil, factor)),
            central(&|factor| change(&Foil { faces: factor * foil.faces, ..foil }, 1.0)),
            central(&|factor| change(&Foil { capacity: factor * foil.capacity, ..foil }, 1.0)),
        ])
    }

    /// Share of the Sun's disc that a place (in the frame of its joint) sees in the end.
    pub(super) fn share_now(&self, place: DVec3) -> f64 {
        let FoilTriangle { normal, both_sides, .. } = self.triangle;
        let sides = (*normal, *both_sides);
        let share = |now: &Arc<Moment>| now.sun_share(self.trees, (place, self.joint()), sides, SunShape::Disc);
        self.moments.last().map_or(0.0, share)
    }

    /// Share of the Sun that a place (in the frame of its joint) sees in the mean over each moment, and in the middle of the last one.
    fn lit_at(&self, place: DVec3, shape: SunShape) -> (Vec<f64>, f64) {
        let FoilTriangle { normal, both_sides, .. } = self.triangle;
        let (place, sides) = ((place, self.joint()), (*normal, *both_sides));
        let middles = self.lit(|moment| self.moments[moment].sun_share(self.trees, place, sides, shape));
        let now = middles.last().copied().unwrap_or(0.0);
        (self.means(&middles, |rays| rays.share(self.trees, place, sides, shape)), now)
    }

    /// Means over moments of shares that are known in their middles. Between two recent ones that differ, rays find the quarter of the way in which the share changes.
    fn means(&self, middles: &[f64], rays: impl Fn(&SunRays) -> f64) -> Vec<f64> {
        let mut means = middles.to_vec();
        for (number, pair) in middles.windows(2).enumerate().skip(self.first_recent()) {
            let change = pair[1] - pair[0];
            let Some(quarters) = self.quarters[number].as_ref().filter(|_| change.abs() >= CHANGES) else { continue };
            let is_past = |place: usize| (rays(&quarters[place]) - pair[0]).abs() > 0.5 * change.abs();
            let by_half = is_past(1);
            let at = match (by_half, is_past(if by_half { 0 } else { 2 })) {
                (true, true) => 0.125,
                (true, false) => 0.375,
                (false, true) => 0.625,
                (false, false) => 0.875,
            };
            // The way has the last half of this moment, and the first half of the next.
            let [own, next] = [number, number + 1].map(|number| self.moments[number].length);
            let [before, after] = [at, 1.0 - at].map(|share| share * 0.5 * (own + next));
            means[number] += change * (0.5 - before / own).max(0.0);
            means[number + 1] -= change * (0.5 - after / next).max(0.0);
        }
        means
    }

    /// Absorbed light of Sun and planet at each moment, of a place that sees these shares of the Sun [W/m2].
    fn absorbed(&self, lit: &[f64], weights: [f64; 3]) -> Vec<[f64; 2]> {
        let mix = |moment: &Moment, value: fn(&NodeLight) -> f32| {
            interpolate(self.triangle.nodes.map(|node| f64::from(value(&moment.nodes[node]))), weights)
        };
        let absorbed = |(moment, lit): (&Arc<Moment>, &f64)| {
            [lit * mix(moment, |node| node.open), mix(moment, |node| node.planet)]
        };
        self.moments.iter().zip(lit).map(absorbed).collect()
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

    /// Temperature after the past under absorbed fluxes without space, and another that was even [K]. All places of a triangle began alike where nothing says how. The structure below a
    /// blanket is slow: it has the temperature of balance with the mean flux, and gives back what it receives there.
    fn after_past(&self, foil: &Foil, fluxes: &[f64], other: f64) -> f64 {
        let mean = self.mean + other;
        let space = |moment: usize| foil.faces * self.moments[moment].space;
        let given = foil.below * Foil { below: 0.0, ..*foil }.balance(mean + space(0)).powi(4);
        let start = match self.begins {
            Beginning::Temperature(kelvin) => kelvin,
            Beginning::Balance => foil.balance(fluxes[0] + other + space(0) + given),
            Beginning::Past => foil.balance(mean + space(0) + given),
        };
        let moments = self.moments.iter().enumerate().filter(|(_, moment)| moment.length > 0.0);
        moments.fold(start, |kelvin, (number, moment)| {
            foil.after(kelvin, fluxes[number] + other + space(number) + given, moment.length)
        })
    }

    /// The first moment of the last [`LOOKED_AT`] time constants.
    fn first_recent(&self) -> usize {
        let constant = self.foil().map_or(0.0, |foil| foil.time_constant());
        let mut age = 0.0;
        let is_old = |moment: &usize| {
            age += self.moments[*moment].length;
            age > LOOKED_AT * constant
        };
        (0..self.moments.len()).rev().find(is_old).map_or(0, |moment| moment + 1)
    }

    /// Share of the Sun at each moment. Rays look at every recent moment, at a few before, and between those that differ for the change.
    fn lit(&self, rays: impl Fn(usize) -> f64) -> Vec<f64> {
        let known = |moment: usize| self.known[moment].map(|lit| f64::from(u8::from(lit)));
        let look = |moment: usize| known(moment).unwrap_or_else(|| rays(moment));
        let last = self.known.len() - 1;
        let recent = self.first_recent();
        let mut lit = vec![0.0; last + 1];
        (lit[0], lit[last]) = (look(0), look(last));
        let mut between = vec![[0, last]];
        while let Some([low, high]) = between.pop() {
            if high - low < 2 {
                continue;
            }
            let is_known = || (low + 1..high).filter_map(known).any(|share| share != lit[low]);
            if lit[low] == lit[high] && high <= recent && high - low <= APART && !is_known() {
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
