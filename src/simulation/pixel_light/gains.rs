//! The sunlight and the emission of a place of foil, where a pixel shows another temperature than its nodes: for the budget and the uncertainty of the pixel.

use std::collections::HashMap;

use super::PastLight;
use super::disc::SunShape;
use super::place::{Places, interpolate};
use super::surface::FoilTriangle;

/// Difference from the temperature between nodes from which on a pixel has light of its own [K]. Less is rounding.
const ROUNDING: f64 = 0.02;

/// By how much more the temperature of a place of foil changes than its nodes show, for a change by all of a value [K].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OwnDerivatives {
    /// By the sunlight that it absorbs.
    pub(crate) sunlight: f64,
    /// By the emission of its faces.
    pub(crate) emission: f64,
    pub(crate) capacity: f64,
    /// Whether the Sun stands on the back of the surface.
    pub(crate) behind: bool,
}

/// The triangles of foil by the slots of their nodes.
pub(crate) struct FoilGains<'a> {
    past: &'a PastLight,
    triangles: HashMap<[usize; 3], &'a FoilTriangle>,
}

impl<'a> FoilGains<'a> {
    pub(crate) fn new(past: &'a PastLight) -> Self {
        let surface = &past.scene.surface;
        let slots = |triangle: &FoilTriangle| triangle.nodes.map(|node| surface.nodes[node].slot as usize);
        Self { past, triangles: surface.triangles.iter().map(|triangle| (slots(triangle), triangle)).collect() }
    }

    /// The derivatives of a place between three nodes, whose temperatures [K] count with radiation between surfaces. `None` where the place is no foil, or where its nodes show its light.
    pub(crate) fn derivatives(&self, slots: [usize; 3], weights: [f64; 3], kelvin: [f64; 3]) -> Option<OwnDerivatives> {
        let triangle = *self.triangles.get(&slots)?;
        let PastLight { scene, moments, quarters, begins } = self.past;
        let (lit, now) = (self.past.known(triangle), moments.last()?);
        if lit.is_empty() {
            return None;
        }
        let places = Places::new((&scene.surface, &scene.trees), (moments, quarters, *begins), (triangle, &lit));
        let of_nodes = places.of_nodes(self.past.needs_temperatures().then_some(kelvin))?;
        let nodes = triangle.nodes.map(|node| &scene.surface.nodes[node]);
        let place = interpolate(nodes.map(|node| node.position), weights);
        let [sunlight, emission, capacity] = places.derivatives(place, weights, of_nodes)?;
        let behind = triangle.both_sides && now.is_behind(nodes[0].joint, triangle.normal);
        Some(OwnDerivatives { sunlight, emission, capacity, behind })
    }

    /// What a place between three nodes takes of the Sun, and what it gains by emission, at a temperature of its own [K], over the area of one face [W/m2]. `emitted` are the
    /// gains of the nodes by emission. `None` where the place is no foil, or has the temperature between its nodes.
    pub(crate) fn of_place(
        &self,
        slots: [usize; 3],
        weights: [f64; 3],
        (kelvin, emitted): (f64, [f64; 3]),
    ) -> Option<[f64; 2]> {
        let triangle = *self.triangles.get(&slots)?;
        let (surface, now) = (&self.past.scene.surface, self.past.moments.last()?);
        let nodes = triangle.nodes.map(|node| &surface.nodes[node]);
        let foil = surface.foils[nodes[0].material as usize]?;
        let shown = emitted.map(|gain| (now.space - gain / foil.faces).max(0.0).sqrt().sqrt());
        if (interpolate(shown, weights) - kelvin).abs() < ROUNDING {
            return None;
        }
        let place = (interpolate(nodes.map(|node| node.position), weights), nodes[0].joint);
        let sides = (triangle.normal, triangle.both_sides);
        let lit = now.sun_share(&self.past.scene.trees, place, sides, SunShape::Disc);
        let open = interpolate(triangle.nodes.map(|node| f64::from(now.nodes[node].open)), weights);
        Some([lit * open, foil.faces * (now.space - kelvin.powi(4))])
    }
}
