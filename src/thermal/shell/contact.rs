//! Contacts: given conductances between parts or materials whose surfaces lie close.
//!
//! A contact is made of areas: how much of the surface of one node lies against the surface of another. The two meshes need not match, and the sum
//! does not depend on them.

use std::collections::HashSet;

use super::merge::summed;
use super::{ShellError, ShellMaterial, ShellSurface};
use crate::thermal::network::LinearConductor;

mod edges;
mod faces;
mod neighbours;
mod polygon;
mod side;
#[cfg(test)]
mod tests;

use edges::{edge_touches, point_touches};
use faces::{Faces, Found, Touch};
pub(crate) use neighbours::{NeighbourRule, touching};
use side::ContactSide;

/// A selection of vertices by part and by material. A vertex must fit both.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Selection {
    pub(crate) name: String,
    pub(crate) parts: Vec<bool>,
    pub(crate) materials: Vec<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ContactConductance {
    /// Total conductance [W/K].
    Total(f64),
    /// Conductance per contact area [W/(m2 K)].
    PerArea(f64),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contact {
    pub(crate) name: String,
    pub(crate) between: [Selection; 2],
    /// Greatest distance between the surfaces [m].
    pub(crate) distance: f64,
    pub(crate) conductance: ContactConductance,
}

impl Selection {
    fn has(&self, surface: &ShellSurface, vertex: u32) -> bool {
        let vertex = vertex as usize;
        self.parts[surface.parts[vertex] as usize] && self.materials[surface.materials[vertex] as usize]
    }
}

impl Contact {
    /// Adds the conductors of the contact. `node` is the node of every vertex.
    pub(super) fn conductors(
        &self,
        surface: &ShellSurface,
        materials: &[Option<ShellMaterial>],
        node: &[u32],
    ) -> Result<Vec<LinearConductor>, ShellError> {
        let side =
            |selection: &Selection| ContactSide::new(surface, materials, node, |vertex| selection.has(surface, vertex));
        let sides = self.between.each_ref().map(side);
        for (selection, side) in self.between.iter().zip(&sides) {
            if side.corners.is_empty() {
                return Err(ShellError::NotInNetwork { contact: self.name.clone(), side: selection.name.clone() });
            }
        }
        let ordered = |([a, b], area): ([u32; 2], f64)| ([a.min(b), a.max(b)], area);
        let shares = summed(self.areas(sides.each_ref()).into_iter().map(ordered).collect());
        let area: f64 = shares.iter().map(|(_, area)| area).sum();
        let of = |nodes: [u32; 2], conductance: f64| LinearConductor { nodes, conductance };
        if area > 0.0 {
            let per_area = match self.conductance {
                ContactConductance::PerArea(conductance) => conductance,
                ContactConductance::Total(conductance) => conductance / area,
            };
            return Ok(shares.into_iter().map(|(nodes, area)| of(nodes, per_area * area)).collect());
        }
        let points = point_touches(sides.each_ref(), self.distance);
        if points.is_empty() {
            return Err(ShellError::Apart { contact: self.name.clone(), distance: self.distance });
        }
        let ContactConductance::Total(conductance) = self.conductance else {
            return Err(ShellError::NoArea { contact: self.name.clone() });
        };
        let share = conductance / points.len() as f64;
        Ok(points.into_iter().map(|nodes| of(nodes, share)).collect())
    }

    /// Areas of contact of pairs of nodes [m2]: of faces, or of edges between parts and materials whose faces do not meet.
    fn areas(&self, sides: [&ContactSide; 2]) -> Vec<([u32; 2], f64)> {
        // The larger side is scanned, so that a plate of two triangles does not hold the work of all threads.
        let turned = sides[0].corners.len() < sides[1].corners.len();
        let sides = if turned { [sides[1], sides[0]] } else { sides };
        let faces = Faces { sides, distance: self.distance, pieces: None }.find();
        let edges = edge_touches(sides, self.distance, &faces.met);
        touches(faces, edges).map(|touch| (touch.nodes, touch.area)).collect()
    }
}

/// Contacts of faces, and contacts along edges in place of them where there are any.
fn touches(faces: Found, edges: Vec<Touch>) -> impl Iterator<Item = Touch> {
    let along: HashSet<_> = edges.iter().map(|touch| touch.owners).collect();
    faces.touches.into_iter().filter(move |touch| !along.contains(&touch.owners)).chain(edges)
}
