//! The craft of a data set as a mesh of named parts, some of which hang on joints.

use glam::{DAffine3, DVec3, Vec3};

/// The craft, with all joints as they are in the model's file. Positions are in the body frame [m].
///
/// A link is a set of parts that move as one: link 0 is the body, and link i holds the parts that hang on joint i directly.
#[derive(Debug, Clone, PartialEq)]
pub struct Craft {
    /// Name of the scene.
    pub(crate) name: String,
    /// Names of the parts, each once. A pixel of the first has the value 1.
    pub(crate) parts: Vec<String>,
    /// Names of the materials. A pixel of the first has the value 1.
    pub(crate) materials: Vec<String>,
    /// Names of the links: `body`, then the names of the joints.
    pub links: Vec<String>,
    pub(crate) link_of_part: Vec<u32>,
    /// Vertex positions [m].
    pub(crate) positions: Vec<DVec3>,
    /// Unit outward normals of the vertices.
    pub(crate) normals: Vec<Vec3>,
    /// Part of each vertex. A triangle has the part of its first vertex.
    pub(crate) vertex_part: Vec<u32>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The key points.
    pub key_points: Vec<KeyPoint>,
    /// The symmetries of its objects, one for each object that has any.
    pub(crate) symmetries: Vec<Symmetries>,
}

/// A named point of the craft.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPoint {
    /// Its name.
    pub name: String,
    /// The link that carries it: 0 is the body, `i + 1` is joint `i`.
    pub(crate) link: u32,
    /// Place in the body frame with all joints as they are in the model's file [m].
    pub position: DVec3,
}

/// Turns after which a rigid object looks the same.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Symmetries {
    /// The link that is the object.
    pub(crate) link: u32,
    /// Turns by a share of the circle, with all that follow from them and without the identity [m].
    pub(crate) discrete: Vec<DAffine3>,
    /// Unit vector along the axis about which any turn leaves it as it is, and a point of the axis [m].
    pub(crate) continuous: Option<[DVec3; 2]>,
}

/// A rigid object of BOP: one link of the craft.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BopObject {
    /// Number from 1.
    pub id: u32,
    pub(crate) link: u32,
    pub(crate) name: String,
}

impl Craft {
    pub(crate) fn link_of_vertex(&self, vertex: u32) -> u32 {
        self.link_of_part[self.vertex_part[vertex as usize] as usize]
    }

    /// The rigid objects: the body, and then each joint on which something hangs directly. Without joints, the craft is the only object.
    pub(crate) fn objects(&self) -> Vec<BopObject> {
        let mut has = vec![false; self.links.len()];
        for triangle in &self.triangles {
            has[self.link_of_vertex(triangle[0]) as usize] = true;
        }
        let with = (0..self.links.len()).filter(|link| has[*link]);
        let whole = self.links.len() == 1;
        with.enumerate()
            .map(|(number, link)| BopObject {
                id: number as u32 + 1,
                link: link as u32,
                name: if whole { self.name.clone() } else { self.links[link].clone() },
            })
            .collect()
    }

    pub(crate) fn triangles_of(&self, link: u32) -> Vec<[u32; 3]> {
        self.triangles.iter().copied().filter(|triangle| self.link_of_vertex(triangle[0]) == link).collect()
    }
}
