//! Builds a thermal network from a triangulated surface: nodes, capacitances and linear conductances of shells (docs/numerics.md 3).
//!
//! Where a material conducts, coincident vertices of one part and material are one node. Elsewhere every drawn vertex is its own node. A node's area
//! is the sum over the corners of drawn triangles there: capacity, emission, load and contact all take it. The conductances are cotangent weights of
//! an intrinsic Delaunay triangulation. A layered material has two nodes at a place: the visible outer node, and the node of the structure below it.

use glam::DVec3;

use super::balance::emissivity_sum;
use super::material::{Material, Sides};
use super::network::Network;

mod areas;
mod assemble;
mod conductance;
mod contact;
mod intrinsic;
mod merge;
#[cfg(test)]
mod tests;
mod weld;

pub(crate) use contact::{Contact, ContactConductance, NeighbourRule, Selection};

pub(crate) const NO_NODE: u32 = u32::MAX;

/// Pairs of nodes that exchange heat faster than this [1/s] are merged, unless the scene gives another rate (docs/numerics.md 3).
pub(crate) const MERGE_RATE: f64 = 60.0;

/// Thickness of a sheet outside the network whose material states none [m].
const UNSTATED_THICKNESS: f64 = 1e-3;

/// The surface from which a network is made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShellSurface<'a> {
    /// Positions of the drawn vertices [m].
    pub positions: &'a [DVec3],
    /// Vertices of the triangles.
    pub triangles: &'a [[u32; 3]],
    pub(crate) parts: &'a [u32],
    pub(crate) materials: &'a [u32],
}

/// One conducting, heat-storing sheet.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Sheet {
    /// Capacitance per area: thickness x density x specific heat [J/(m2 K)]. 0 makes arithmetic nodes.
    pub(crate) capacitance: f64,
    /// Conductivity x thickness [W/K]. 0 is an insulator.
    pub(crate) conductance: f64,
    /// Thickness [m].
    pub(crate) thickness: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ShellMaterial {
    pub(crate) outer: Sheet,
    /// Sum of the emissivities of the faces that see space.
    pub(crate) emissivity: f64,
    /// Whether both faces do. The drawn surface then is the middle of the sheet.
    pub(crate) both_sides: bool,
    /// The structure below, and the effective emittance between the two sheets.
    pub(crate) over: Option<(Sheet, f64)>,
}

/// An error of a surface or a contact.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShellError {
    /// A value of a material is missing.
    #[error("material '{material}': response = 'network' needs {key}: state it in its rule or in the table's entry")]
    Lacks {
        /// Name of the material.
        material: String,
        /// Name of the missing value.
        key: String,
    },
    /// A contact whose sides are too far apart.
    #[error("contact {contact}: nothing of one side lies within {distance} m of the other side")]
    Apart {
        /// The contact, as the scene describes it.
        contact: String,
        /// Greatest distance of a contact [m].
        distance: f64,
    },
    /// A contact with a conductance per area but without area.
    #[error("contact {contact}: the two sides touch only at points, without a contact area: state a conductance [W/K]")]
    NoArea {
        /// The contact, as the scene describes it.
        contact: String,
    },
    /// A contact with an empty side.
    #[error("contact {contact}: {side} has no nodes in the network: only materials with response = 'network' conduct")]
    NotInNetwork {
        /// The contact, as the scene describes it.
        contact: String,
        /// The side without nodes.
        side: String,
    },
}

/// Why nothing joins two neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ApartBy {
    /// They touch, and no contact joins them.
    NoContact,
    /// There is a gap between them, wider than that of surfaces that touch.
    Gap,
    /// One of them is not in the network.
    Response,
}

/// Two neighbours without contact.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Neighbours {
    /// Part and material of both.
    pub(crate) groups: [[u32; 2]; 2],
    pub(crate) apart_by: ApartBy,
    /// Area in contact [m2]. Along edges: the length times the thinner thickness.
    pub(crate) area: f64,
    /// Length in contact [m], where they touch along edges alone.
    pub(crate) length: Option<f64>,
    /// Conductance that the rule would give [W/K].
    pub(crate) conductance: f64,
    /// Share of a difference in temperature that this conductance would leave, between both in balance with space at 300 K.
    pub(crate) remaining: f64,
}

/// Report of a network for the user.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShellSummary {
    /// Number of drawn vertices in the network.
    pub(crate) vertices: usize,
    pub(crate) merged: usize,
    /// Rate above which pairs were merged [1/s].
    pub(crate) merge_rate: f64,
    /// Number of edges flipped by the Delaunay triangulation.
    pub(crate) flips: usize,
    /// Number of edges that could not be flipped because more than two triangles meet there, or two with opposite winding.
    pub(crate) non_manifold: usize,
    /// Number of triangles too flat to conduct.
    pub(crate) degenerate: usize,
    /// Number of pairs of nodes for each contact.
    pub contacts: Vec<(String, usize, f64)>,
    /// Pairs of parts and materials that touch without contact.
    pub(crate) neighbours: Vec<Neighbours>,
}

/// A network, and its relation to the drawn vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shell {
    pub(crate) network: Network,
    /// Node of each drawn vertex, or `NO_NODE`.
    pub(crate) node_of_vertex: Vec<u32>,
    /// Node of the structure behind each drawn vertex, or the vertex's own node where there is no layer.
    pub(crate) structure_of_vertex: Vec<u32>,
    /// Area over which the flux at a drawn vertex heats its node [m2]. 0 outside the network.
    pub(crate) load_areas: Vec<f64>,
    /// Report for the user.
    pub summary: ShellSummary,
}

impl ShellMaterial {
    /// The shell of a material.
    ///
    /// # Errors
    /// [`ShellError::Lacks`] where a value is missing that the network needs.
    pub(crate) fn of(material: &Material) -> Result<Self, ShellError> {
        let bulk = &material.bulk;
        let lacks = |key: &str| {
            let unit = match key {
                "thickness" => "m",
                "density" => "kg/m3",
                _ => "J/(kg K)",
            };
            ShellError::Lacks { material: material.name.clone(), key: format!("{key} [{unit}]") }
        };
        let capacitance = bulk.capacity_per_area().map_err(lacks)?;
        let conductivity = bulk.conductivity.unwrap_or(0.0);
        let thickness = match bulk.thickness {
            None if conductivity <= 0.0 => 0.0,
            thickness => thickness.ok_or_else(|| lacks("thickness"))?,
        };
        let outer = Sheet { capacitance, conductance: thickness * conductivity, thickness };
        let over = bulk.over.map(|over| {
            let (capacitance, thickness) = (over.capacity_per_area(), over.thickness);
            (Sheet { capacitance, conductance: thickness * over.conductivity, thickness }, over.effective_emittance)
        });
        Ok(Self { outer, over, ..Self::outside(material) })
    }

    /// A material outside the network, which neighbours are told of.
    pub(crate) fn outside(material: &Material) -> Self {
        let thickness = material.bulk.thickness.unwrap_or(UNSTATED_THICKNESS);
        Self {
            outer: Sheet { thickness, ..Sheet::default() },
            emissivity: emissivity_sum(material),
            both_sides: matches!(material.sides, Sides::Both { .. }),
            over: None,
        }
    }

    /// The sheet that contacts act on: the structure where there is one below.
    fn inner(&self) -> Sheet {
        self.over.map_or(self.outer, |(below, _)| below)
    }

    /// Depth of the sheet behind and before the drawn surface [m].
    fn filled(&self) -> [f64; 2] {
        let thickness = self.inner().thickness;
        if self.both_sides { [0.5 * thickness; 2] } else { [thickness, 0.0] }
    }

    /// Whether coincident vertices share a node in either layer.
    fn welds(&self) -> bool {
        self.outer.conductance > 0.0 || self.over.is_some_and(|(below, _)| below.conductance > 0.0)
    }
}

impl Shell {
    /// Adds to `heat` the heat of every node [W] from the absorbed flux of every drawn vertex [W/m2].
    pub(crate) fn gather(&self, absorbed: impl Fn(usize) -> f64, heat: &mut [f64]) {
        for (vertex, (node, area)) in self.node_of_vertex.iter().zip(&self.load_areas).enumerate() {
            if *node != NO_NODE {
                heat[*node as usize] += area * absorbed(vertex);
            }
        }
    }
}
