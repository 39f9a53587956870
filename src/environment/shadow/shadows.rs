//! Shadows of a scene in f64: which nodes, what is in the way, and what was found last.

use glam::DVec3;
use rayon::prelude::*;

use super::{DepthMap, Occluders, Redraw};
use crate::environment::TickLoad;

/// How the visibility of the Sun is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// From the depth of the parts as seen from the Sun.
    Depth,
    /// By rays to the Sun's disc.
    Exact,
}

/// What casts shadows on a set of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Shadows {
    /// Positions [m] and unit normals of the nodes.
    nodes: Vec<[DVec3; 2]>,
    method: Method,
    casting: Casting,
    redraw: Redraw,
}

/// What is in the way.
#[derive(Debug, Clone, PartialEq)]
enum Casting {
    /// In a tree, for rays and for few nodes.
    Tree(Occluders),
    /// Positions [m] and triangles, to be drawn.
    Triangles(Vec<DVec3>, Vec<[u32; 3]>),
}

/// Nodes up to which a depth map is not drawn: they ask for 16 texels each.
const FEW: usize = 4096;

impl Shadows {
    /// Of triangles of positions [m] on nodes (positions [m] and unit normals).
    pub fn new(
        nodes: Vec<[DVec3; 2]>,
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        redraw: Redraw,
        method: Method,
    ) -> Self {
        let casting = if method == Method::Exact || nodes.len() <= FEW {
            Casting::Tree(Occluders::new(&positions, &triangles))
        } else {
            Casting::Triangles(positions, triangles)
        };
        Self { nodes, method, casting, redraw }
    }

    /// Share of the Sun that each node sees, where a load asks to find it anew.
    pub fn visibility(&mut self, load: &TickLoad) -> Option<Vec<f64>> {
        let view = self.redraw.view(load)?;
        let nodes = self.nodes.par_iter();
        let map = match &self.casting {
            Casting::Tree(occluders) if self.method == Method::Exact => {
                let seen = |[place, normal]: &[DVec3; 2]| occluders.solar_visibility(*place, *normal, view.sun);
                return Some(nodes.map(seen).collect());
            }
            Casting::Tree(occluders) => DepthMap::traced(view, occluders),
            Casting::Triangles(positions, triangles) => DepthMap::new(view, positions, triangles),
        };
        Some(nodes.map(|[place, normal]| map.solar_visibility(*place, *normal)).collect())
    }
}
