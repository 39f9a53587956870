//! What a place of foil takes of the Sun and emits, where a pixel shows another temperature than its nodes: for the budget of the pixel.

use std::collections::HashMap;

use super::PastLight;
use super::place::interpolate;
use super::surface::FoilTriangle;

/// Difference from the temperature between nodes from which on a pixel has light of its own [K]. Less is rounding.
const ROUNDING: f64 = 0.02;

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
        let is_lit = now.sees_sun(&self.past.scene.trees, place, triangle.normal, triangle.both_sides);
        let open = interpolate(triangle.nodes.map(|node| f64::from(now.nodes[node].open)), weights);
        Some([if is_lit { open } else { 0.0 }, foil.faces * (now.space - kelvin.powi(4))])
    }
}
