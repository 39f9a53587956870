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
    /// The targets. Without any the craft as a whole is the only target.
    pub(crate) targets: Vec<LabelTarget>,
}

/// A named point of the craft.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPoint {
    /// Its name.
    pub name: String,
    /// The part on which it lies.
    pub(crate) part: u32,
    /// The link that carries it: 0 is the body, `i + 1` is joint `i`.
    pub(crate) link: u32,
    /// Place in the body frame with all joints as they are in the model's file [m].
    pub position: DVec3,
}

/// Turns after which a rigid object looks the same.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Symmetries {
    /// Number of the object.
    pub(crate) object: u32,
    /// Turns by a share of the circle, with all that follow from them and without the identity [m].
    pub(crate) discrete: Vec<DAffine3>,
    /// Unit vector along the axis about which any turn leaves it as it is, and a point of the axis [m].
    pub(crate) continuous: Option<[DVec3; 2]>,
}

/// A target of the labels: a set of parts, which need not hang together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LabelTarget {
    pub(crate) name: String,
    /// Whether each part of the craft belongs to it.
    pub(crate) parts: Vec<bool>,
}

/// A rigid object of BOP: what belongs to a target on one link of the craft.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BopObject {
    /// Number from 1.
    pub id: u32,
    /// Place of its target among the targets.
    pub(crate) target: usize,
    pub(crate) link: u32,
    pub(crate) name: String,
}

impl Craft {
    pub(crate) fn link_of_vertex(&self, vertex: u32) -> u32 {
        self.link_of_part[self.vertex_part[vertex as usize] as usize]
    }

    /// Names of the targets.
    pub(crate) fn target_names(&self) -> Vec<&str> {
        match &self.targets[..] {
            [] => vec![&self.name],
            targets => targets.iter().map(|target| target.name.as_str()).collect(),
        }
    }

    /// Place of the target to which a part belongs. `None` for a part of no target.
    pub(crate) fn target_of_part(&self, part: u32) -> Option<usize> {
        match &self.targets[..] {
            [] => Some(0),
            targets => targets.iter().position(|target| target.parts.get(part as usize) == Some(&true)),
        }
    }

    pub(crate) fn target_of_vertex(&self, vertex: u32) -> Option<usize> {
        self.target_of_part(self.vertex_part[vertex as usize])
    }

    /// Place of the target that a pixel shows, from the number of its part.
    pub(crate) fn target_of_pixel(&self, part: u32) -> Option<usize> {
        self.target_of_part(part.checked_sub(1)?)
    }

    /// The pixels that show a target.
    pub(crate) fn mask_of(&self, target: usize, parts: &[u32]) -> Vec<bool> {
        parts.iter().map(|part| self.target_of_pixel(*part) == Some(target)).collect()
    }

    /// The rigid objects of each target: its body, and then each joint on which a part of it hangs directly. Without joints, a target is one object.
    pub(crate) fn objects(&self) -> Vec<BopObject> {
        let names = self.target_names();
        let mut has = vec![vec![false; self.links.len()]; names.len()];
        for triangle in &self.triangles {
            if let Some(target) = self.target_of_vertex(triangle[0]) {
                has[target][self.link_of_vertex(triangle[0]) as usize] = true;
            }
        }
        let mut objects = Vec::new();
        for (target, has) in has.iter().enumerate() {
            let is_rigid =
                self.links.len() == 1 || (!self.targets.is_empty() && has.iter().filter(|has| **has).count() == 1);
            for link in (0..has.len()).filter(|link| has[*link]) {
                let name = match (is_rigid, self.targets.is_empty()) {
                    (true, _) => names[target].to_owned(),
                    (false, true) => self.links[link].clone(),
                    (false, false) => format!("{}/{}", names[target], self.links[link]),
                };
                objects.push(BopObject { id: objects.len() as u32 + 1, target, link: link as u32, name });
            }
        }
        objects
    }

    /// Whether a vertex belongs to an object.
    pub(crate) fn is_of(&self, object: &BopObject, vertex: u32) -> bool {
        self.link_of_vertex(vertex) == object.link && self.target_of_vertex(vertex) == Some(object.target)
    }

    pub(crate) fn triangles_of(&self, object: &BopObject) -> Vec<[u32; 3]> {
        self.triangles.iter().copied().filter(|triangle| self.is_of(object, triangle[0])).collect()
    }
}
