//! View factors and exchange areas between groups of patches, such as parts, to the planet and to space.

use std::collections::BTreeMap;

use super::sky::PlanetFromPatch;
use super::step::Exchange;
use crate::environment::StepLoad;
use crate::environment::view_factor::{ApparentRadius, plate_view_factor};

/// Where light goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum To {
    /// A group.
    Group(usize),
    /// The planet.
    Planet,
    /// Space beside the planet.
    Space,
}

/// A view factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewFactor {
    /// Group that sends.
    pub from: usize,
    /// Where the light goes.
    pub to: To,
    /// Its share.
    pub factor: f64,
    /// Standard error of this share, as for independent rays.
    pub error: f64,
}

/// View factors between groups. `group` holds the group of each patch. The load may hold a planet; without one everything beside the craft is space.
pub fn view_factors(exchange: &Exchange, group: &[usize], load: &StepLoad) -> Vec<ViewFactor> {
    let factors = &exchange.factors;
    let mut areas = BTreeMap::new();
    // Shared area and its variance.
    let mut sums: BTreeMap<(usize, To), [f64; 2]> = BTreeMap::new();
    for (patch, properties) in exchange.patches.iter().enumerate() {
        let from = group[patch];
        *areas.entry(from).or_insert(0.0) += properties.area;
        let mut add = |to: To, area: f64, variance: f64| {
            let sum = sums.entry((from, to)).or_default();
            sum[0] += area;
            sum[1] += variance;
        };
        for (to, area) in factors.shared.row(patch) {
            add(To::Group(group[*to as usize]), *area, factors.variance(patch, *to));
        }
        let mut space = factors.space[patch];
        if let Some(planet) = &load.planet {
            let normal = load.joint_from_body(properties.joint).transpose() * properties.normal;
            let open = plate_view_factor(normal.dot(planet.nadir), ApparentRadius::new(planet.distance_ratio));
            let planet_share =
                PlanetFromPatch::new(planet, load, properties.joint).seen(exchange.sky_of(patch)).planet_ir;
            // By the noise of the rays the planet may take more than the whole open sky.
            let area = (properties.area * open * planet_share).min(space);
            let variance = properties.area * properties.area * factors.of_share(area / properties.area);
            add(To::Planet, area, variance);
            space -= area;
        }
        add(To::Space, space, factors.variance_to_space(patch));
    }
    let factors_between = sums.into_iter().map(|((from, to), [area, variance])| {
        let whole = areas[&from];
        ViewFactor { from, to, factor: area / whole, error: variance.sqrt() / whole }
    });
    factors_between.collect()
}

/// Radiative exchange areas [m2] between groups, all reflections of infrared counted: emissivity times area times Gebhart's factor. Each pair stands
/// once. Areas to space include the planet, because they cover the whole sky.
pub(crate) fn radiative_areas(exchange: &Exchange, group: &[usize]) -> Vec<(usize, To, f64)> {
    let mut sums: BTreeMap<(usize, To), f64> = BTreeMap::new();
    for (patch, properties) in exchange.patches.iter().enumerate() {
        let (from, emissivity) = (group[patch], properties.optics.emissivity);
        for (other, area) in exchange.infrared.between.row(patch) {
            let to = group[*other as usize];
            if from < to {
                let emissivities = emissivity * exchange.patches[*other as usize].optics.emissivity;
                *sums.entry((from, To::Group(to))).or_default() += emissivities * area;
            }
        }
        *sums.entry((from, To::Space)).or_default() += emissivity * exchange.infrared.space[patch];
    }
    sums.into_iter().map(|((from, to), area)| (from, to, area)).collect()
}
