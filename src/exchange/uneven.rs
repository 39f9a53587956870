//! By how much what a patch absorbs is off because others send unevenly. Rows take the light of a patch as even over it. A shadow or a gradient makes it differ.
//!
//! The light of a sender is L(x) = mean + d(x), where x is the way from its centre. Its moment m is the mean of d(x) x over the patch. A receiver sees the sender with the view
//! factor F, and gets F (mean + g . m) to the first order. Here g is the gradient over the sender of the logarithm of cos cos / r2. Along a flat sender that is
//! n / (n . r) - 4 r / r2, with the normal n of the receiver and the way r from it to the centre of the sender. A sender counts as flat: the turn of its normal is left out, so light
//! that differs over a tube is told too small.
//!
//! A receiver beside a sender, as at the foot of a wall, sees little of it, and hardly the mean. There the first order says nothing, and light of its own, brighter or darker than the mean by the
//! standard deviation over the sender, is uncertain. Light that differs within the cell of a node counts too, as where a box covers part of the floor.

use glam::DVec3;
use rayon::prelude::*;

use super::patches::Patch;
use super::step::Exchange;
use crate::environment::StepLoad;
use crate::environment::load::solar_flux;
use crate::environment::shadow::Lit;
use crate::thermal::STEFAN_BOLTZMANN;

/// Distance of patches that are beside each other, over the sum of the sides of squares as large as they are.
const BESIDE: f64 = 1.0;

/// How the light that a patch sends differs over it.
#[derive(Debug, Clone, Copy, Default)]
struct Moment {
    /// Mean of the difference times the way from the centre [W/m], body frame.
    vector: DVec3,
    /// Largest difference [W/m2].
    largest: f64,
    /// Standard deviation [W/m2].
    deviation: f64,
}

/// Errors of the light that a patch absorbs, because others send unevenly [W/m2].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Unevenness {
    /// Lack of light, with its sign, by patches that are away from it.
    pub(crate) missed: f64,
    /// Uncertainty by patches beside it.
    pub(crate) beside: f64,
}

/// Temperatures that patches send with.
pub(crate) struct SentFrom<T, S> {
    /// Temperature of a node [K].
    pub(crate) temperature: T,
    /// Standard deviation of the temperature within the cell of a node [K].
    pub(crate) spread: S,
}

impl Moment {
    /// Adds the variance of the light within the cells of nodes.
    fn within(mut self, variance: f64) -> Self {
        self.deviation = self.deviation.hypot(variance.max(0.0).sqrt());
        self
    }

    /// The moment of light [W/m2] on shares of a patch, each with its way from the centre [m].
    fn of(light: &[(f64, f64)], ways: impl Iterator<Item = DVec3>) -> Self {
        let mean: f64 = light.iter().map(|(share, light)| share * light).sum();
        let mut moment = Self::default();
        for ((share, light), way) in light.iter().zip(ways) {
            moment.vector += share * (light - mean) * way;
            moment.largest = moment.largest.max((light - mean).abs());
            moment.deviation += share * (light - mean).powi(2);
        }
        moment.deviation = moment.deviation.sqrt();
        moment
    }

    /// Light that a receiver misses, over its view factor to the patch [W/m2]. `way` leads from the receiver to the centre of the patch, `normal` is the receiver's.
    fn seen(&self, normal: DVec3, way: DVec3) -> f64 {
        let cosine = normal.dot(way);
        if cosine <= 0.0 || self.largest == 0.0 {
            return 0.0;
        }
        let tilt = normal.dot(self.vector) / cosine - 4.0 * way.dot(self.vector) / way.length_squared();
        tilt.clamp(-self.largest, self.largest)
    }
}

impl Exchange {
    /// Errors of each patch because others send their light as if it were even over them. `lit` has the lit area of each node.
    /// With `mirrors` the specular share of sunlight goes elsewhere.
    pub(crate) fn unevenness(
        &self,
        load: &StepLoad,
        lit: &Lit,
        sent_from: &SentFrom<impl Fn(usize) -> f64 + Sync, impl Fn(usize) -> f64 + Sync>,
        mirrors: bool,
    ) -> Vec<Unevenness> {
        let moments: Vec<[Moment; 2]> =
            self.patches.par_iter().map(|patch| self.moments(patch, load, lit, sent_from, mirrors)).collect();
        let place = |patch: &Patch| {
            load.joints.get(patch.joint as usize).map_or(patch.centre, |pose| pose.transform_point3(patch.centre))
        };
        let places: Vec<DVec3> = self.patches.iter().map(place).collect();
        let of_patch = |(number, patch): (usize, &Patch)| {
            let normal = load.joint_from_body(patch.joint).transpose() * patch.normal;
            let mut uneven = Unevenness::default();
            for (other, area) in self.factors.shared.row(number) {
                let (of_other, way) = (&moments[*other as usize], places[*other as usize] - places[number]);
                let view = area / patch.area;
                let absorbed = |[infrared, sunlight]: [f64; 2]| {
                    view * (patch.optics.emissivity * infrared + patch.optics.absorptivity * sunlight)
                };
                uneven.missed += absorbed(of_other.each_ref().map(|moment| moment.seen(normal, way)));
                let apart = BESIDE * (patch.area.sqrt() + self.patches[*other as usize].area.sqrt());
                if way.length() < apart {
                    uneven.beside += absorbed(of_other.each_ref().map(|moment| moment.deviation));
                }
            }
            uneven
        };
        self.patches.par_iter().enumerate().map(of_patch).collect()
    }

    /// Moments of emission and of reflected sunlight.
    fn moments(
        &self,
        patch: &Patch,
        load: &StepLoad,
        lit: &Lit,
        SentFrom { temperature, spread }: &SentFrom<impl Fn(usize) -> f64, impl Fn(usize) -> f64>,
        mirrors: bool,
    ) -> [Moment; 2] {
        let body_from_joint = load.joint_from_body(patch.joint).transpose();
        let nodes = &self.nodes[patch.nodes.clone()];
        let of = |light: &dyn Fn(usize) -> f64| {
            let light: Vec<(f64, f64)> = nodes.iter().map(|(node, share)| (*share, light(*node as usize))).collect();
            // Without ways each patch is one node.
            let ways = self.slopes.ways.get(patch.nodes.clone()).unwrap_or_default();
            let ways = ways.iter().map(|way| body_from_joint * way.as_dvec3());
            Moment::of(&light, ways.chain(std::iter::repeat(DVec3::ZERO)))
        };
        let emitted = |node: usize| patch.optics.emissivity * STEFAN_BOLTZMANN * temperature(node).powi(4);
        let diffuse = (1.0 - patch.optics.absorptivity) * if mirrors { 1.0 - patch.gloss.specular } else { 1.0 };
        let sunlight = |node: usize| {
            let Some(area) = lit.areas.get(node) else { return 0.0 };
            solar_flux(load, body_from_joint * area.on_face(patch.back))
        };
        let variance =
            |of: &dyn Fn(usize) -> f64| nodes.iter().map(|(node, share)| share * of(*node as usize)).sum::<f64>();
        let spread = |node: usize| {
            let slope = 4.0 * patch.optics.emissivity * STEFAN_BOLTZMANN * temperature(node).powi(3);
            (slope * spread(node)).powi(2)
        };
        // A place has all of the sunlight or none.
        let open = solar_flux(load, body_from_joint * patch.normal);
        let edge = |node: usize| diffuse * diffuse * sunlight(node) * (open - sunlight(node)).max(0.0);
        [of(&emitted).within(variance(&spread)), of(&|node| diffuse * sunlight(node)).within(variance(&edge))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 1 m along the x and y axes in places, each with the share of its area.
    fn square() -> Vec<(f64, DVec3)> {
        let at = |k: u32| (f64::from(k) + 0.5) / 40.0 - 0.5;
        (0..40).flat_map(|x| (0..40).map(move |y| (1.0 / 1600.0, DVec3::new(at(x), at(y), 0.0)))).collect()
    }

    /// Mean of light by the share of each place in the view factor from a place with a normal, less the mean over the square.
    fn off(light: impl Fn(DVec3) -> f64, place: DVec3, normal: DVec3) -> f64 {
        let (mut all, mut seen, mut mean) = (0.0, 0.0, 0.0);
        for (share, at) in square() {
            let way = at - place;
            let kernel = normal.dot(way).max(0.0) * place.z / way.length_squared().powi(2);
            (all, seen, mean) = (all + kernel, seen + kernel * light(at), mean + share * light(at));
        }
        seen / all - mean
    }

    #[test]
    fn a_square_that_is_lit_on_one_side_is_seen_from_beside() {
        let half = |at: DVec3| if at.x > 0.0 { 600.0 } else { 100.0 };
        let even = |at: DVec3| 300.0 + 200.0 * at.x - 100.0 * at.y;
        let places = [
            (DVec3::new(1.5, 0.3, 1.5), -DVec3::Z),
            (DVec3::new(-2.0, 0.5, 1.0), DVec3::X),
            (DVec3::new(0.2, 0.1, 2.5), DVec3::new(0.3, 0.0, -1.0).normalize()),
        ];
        for (place, normal) in places {
            for light in [&half as &dyn Fn(DVec3) -> f64, &even] {
                let of: Vec<(f64, f64)> = square().iter().map(|(share, at)| (*share, light(*at))).collect();
                let moment = Moment::of(&of, square().into_iter().map(|(_, at)| at));
                let [told, truth] = [moment.seen(normal, -place), off(light, place, normal)];
                println!("{told:.1} W/m2 told, {truth:.1} by quadrature");
                assert!((told - truth).abs() < 0.2 * truth.abs(), "from {place}: {told} and {truth}");
            }
        }
    }

    #[test]
    fn light_within_cells_adds_to_the_deviation() {
        let halves = [(0.5, 100.0), (0.5, 700.0)];
        let moment = Moment::of(&halves, [DVec3::X, -DVec3::X].into_iter());
        assert_eq!((moment.deviation, moment.within(160_000.0).deviation), (300.0, 500.0));
    }

    #[test]
    fn an_even_square_and_a_place_behind_miss_nothing() {
        let of: Vec<(f64, f64)> = square().iter().map(|(share, _)| (*share, 200.0)).collect();
        let even = Moment::of(&of, square().into_iter().map(|(_, at)| at));
        assert!(even.seen(-DVec3::Z, -DVec3::new(1.5, 0.3, 1.5)).abs() < 1e-9);
        let tilted = Moment { vector: DVec3::X, largest: 5.0, deviation: 1.0 };
        assert_eq!(tilted.seen(DVec3::Z, -DVec3::new(1.5, 0.3, 1.5)), 0.0);
        assert_eq!(tilted.seen(-DVec3::Z, -DVec3::new(0.01, 0.0, 0.01)), 5.0);
    }
}
