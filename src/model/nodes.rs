//! The order of thermal nodes on the device: each kind of response has a contiguous range of groups of four nodes.
//!
//! Each vertex is a node. Nodes are sorted by kind (`RangeKind`), then joint, material, part and vertex. Each run of
//! one material and part is padded to whole *groups* of four, so an invocation handles four nodes of one material and
//! part. Each range is padded to whole workgroups, so its buffers can be bound separately. A padding node has area 0, a
//! zero normal and no vertex.
//!
//! Material and part indices thus cost one byte each per node. A binding of 128 MiB, which every device allows, holds a
//! range of 33 million nodes.

use glam::Vec3;
use rayon::prelude::*;

use crate::model::Model;
use crate::thermal::balance::emissivity_sum;
use crate::thermal::material::{Domain, Material, Response, Retarget, Sides};
use crate::thermal::reference::ReferenceNode;

/// Nodes of an invocation.
pub const GROUP: usize = 4;
/// Ranges are padded to a multiple of this number of groups, which is a workgroup of 64 invocations.
pub(crate) const RANGE_GROUPS: usize = 64;
/// `vertex_of_node` of a padding node.
pub const PADDING: u32 = u32::MAX;

/// Response of a range's nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RangeResponse {
    /// Immediate response without a state.
    Instant,
    /// Transition with thermal inertia.
    Transition {
        /// Rule for a moving target.
        retarget: Retarget,
        /// Quantity that moves.
        domain: Domain,
        /// Whether the curve is not a power of the remaining time.
        shaped: bool,
    },
    /// Energy balance of the node by itself.
    Radiative {
        /// Whether there is a structure below.
        over: bool,
        /// Whether the outside is fast compared with the step.
        fast: bool,
    },
    /// Thermal network. The range computes the absorbed flux for it.
    Network,
    /// Temperatures of another program, which the host writes.
    Given,
}

/// Properties that all nodes of a range share. They select the pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RangeKind {
    /// Response.
    pub(crate) response: RangeResponse,
    /// Whether the back exchanges heat too.
    pub(crate) both_sides: bool,
}

impl RangeKind {
    /// Kind of the nodes with material `index`.
    pub(crate) fn of(materials: &[Material], index: usize) -> Self {
        let material = &materials[index];
        let response = match material.response {
            Response::Instant => RangeResponse::Instant,
            Response::Transition(ref transition) => RangeResponse::Transition {
                retarget: transition.retarget,
                domain: transition.domain,
                shaped: !transition.is_power(),
            },
            Response::Radiative(plate) => {
                RangeResponse::Radiative { over: plate.over.is_some(), fast: plate.is_fast(emissivity_sum(material)) }
            }
            Response::Network => RangeResponse::Network,
            Response::Given => RangeResponse::Given,
        };
        Self { response, both_sides: matches!(material.sides, Sides::Both { .. }) }
    }

    /// Sort key: response, then sides, then rule.
    fn rank(self) -> (u8, bool, bool, bool, bool) {
        match self.response {
            RangeResponse::Instant => (0, self.both_sides, false, false, false),
            RangeResponse::Transition { retarget, domain, shaped } => {
                (1, self.both_sides, retarget == Retarget::Restart, domain == Domain::FourthPower, shaped)
            }
            RangeResponse::Radiative { over, fast } => (2, self.both_sides, over, fast, false),
            RangeResponse::Network => (3, self.both_sides, false, false, false),
            RangeResponse::Given => (4, self.both_sides, false, false, false),
        }
    }
}

impl std::fmt::Display for RangeKind {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.response {
            RangeResponse::Instant => write!(out, "instant")?,
            RangeResponse::Transition { retarget, domain, shaped } => {
                let rule = if retarget == Retarget::Merge { "merge" } else { "restart" };
                let curve = if shaped { "shaped" } else { "power" };
                let moved = if domain == Domain::FourthPower { " of T4" } else { "" };
                write!(out, "transition{moved} ({rule}, {curve})")?;
            }
            RangeResponse::Radiative { over, fast } => {
                let curve = if fast { "fast" } else { "slow" };
                write!(out, "radiative ({curve}{})", if over { ", over a structure" } else { "" })?;
            }
            RangeResponse::Network => write!(out, "network")?,
            RangeResponse::Given => write!(out, "given by a file")?,
        }
        write!(out, "{}", if self.both_sides { ", both sides" } else { "" })
    }
}

/// Consecutive groups of one kind and joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NodeRange {
    /// Kind.
    pub(crate) kind: RangeKind,
    /// Joint of the nodes; 0 is the body.
    pub(crate) joint: u32,
    /// First group.
    pub(crate) first_group: usize,
    /// Number of groups.
    pub(crate) groups: usize,
    /// Number of nodes without padding.
    pub(crate) nodes: usize,
}

/// All nodes of a model in device order. Arrays of nodes have `4 * groups` entries, with padding.
#[derive(Debug, Clone, PartialEq)]
pub struct Nodes {
    /// Number of nodes without padding, one for each vertex.
    pub count: usize,
    /// Number of groups of four.
    pub(crate) groups: usize,
    /// Vertex of each node, or `PADDING`.
    pub vertex_of_node: Vec<u32>,
    /// Node of each vertex.
    pub node_of_vertex: Vec<u32>,
    /// Material index of each group.
    pub group_material: Vec<u32>,
    /// Part index of each group.
    pub group_part: Vec<u32>,
    /// Ranges in order, which cover all groups.
    pub(crate) ranges: Vec<NodeRange>,
    /// Unit outward normals; zero for padding.
    pub normals: Vec<Vec3>,
    /// Positions in the body frame [m]; zero for padding.
    pub positions: Vec<Vec3>,
    /// Areas [m2]; 0 for padding.
    pub areas: Vec<f64>,
}

impl Nodes {
    /// Places of the nodes without padding, each with its vertex. What padding holds is nobody's value.
    pub(crate) fn real(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.vertex_of_node.iter().copied().enumerate().filter(|(_, vertex)| *vertex != PADDING)
    }

    /// Orders the vertices of a model without joints. `node_areas` [m2] has one entry for each vertex.
    #[cfg(test)]
    pub(crate) fn new(model: &Model, node_areas: &[f64], materials: &[Material]) -> Self {
        Self::with_joints(model, node_areas, materials, &vec![0; model.parts.len()])
    }

    /// Orders the vertices of a model with joints. `part_joint` is the joint of each part; 0 is the body.
    pub(crate) fn with_joints(model: &Model, node_areas: &[f64], materials: &[Material], part_joint: &[u32]) -> Self {
        let order = sorted_vertices(model, materials, part_joint);
        let mut nodes = Self {
            count: order.len(),
            groups: 0,
            vertex_of_node: Vec::with_capacity(order.len() + order.len() / 64),
            node_of_vertex: vec![0; order.len()],
            group_material: Vec::new(),
            group_part: Vec::new(),
            ranges: Vec::new(),
            normals: Vec::new(),
            positions: Vec::new(),
            areas: Vec::new(),
        };
        let run_of = |&vertex: &u32| (model.vertex_material[vertex as usize], model.vertex_part[vertex as usize]);
        for run in order.chunk_by(|a, b| run_of(a) == run_of(b)) {
            let (material, part) = run_of(&run[0]);
            let kind = (RangeKind::of(materials, material as usize), part_joint[part as usize]);
            nodes.push_run(run, kind, material, part);
        }
        nodes.close_range();
        nodes.normals = gather(&nodes.vertex_of_node, |vertex| model.normals[vertex]);
        nodes.positions = gather(&nodes.vertex_of_node, |vertex| model.positions[vertex].as_vec3());
        nodes.areas = gather(&nodes.vertex_of_node, |vertex| node_areas[vertex]);
        nodes
    }

    /// Appends the vertices of one material and part with their padding.
    fn push_run(&mut self, vertices: &[u32], (kind, joint): (RangeKind, u32), material: u32, part: u32) {
        if self.ranges.last().is_some_and(|range| (range.kind, range.joint) != (kind, joint)) {
            self.close_range();
        }
        for &vertex in vertices {
            self.node_of_vertex[vertex as usize] = self.vertex_of_node.len() as u32;
            self.vertex_of_node.push(vertex);
        }
        let groups = vertices.len().div_ceil(GROUP);
        self.vertex_of_node.resize((self.groups + groups) * GROUP, PADDING);
        self.group_material.resize(self.groups + groups, material);
        self.group_part.resize(self.groups + groups, part);
        match self.ranges.last_mut() {
            Some(range) if (range.kind, range.joint) == (kind, joint) => {
                range.groups += groups;
                range.nodes += vertices.len();
            }
            _ => self.ranges.push(NodeRange { kind, joint, first_group: self.groups, groups, nodes: vertices.len() }),
        }
        self.groups += groups;
    }

    /// Kinds of nodes in order, with the number of nodes of each.
    pub(crate) fn by_kind(&self) -> Vec<(RangeKind, usize)> {
        let mut kinds: Vec<(RangeKind, usize)> = Vec::new();
        for range in &self.ranges {
            match kinds.last_mut() {
                Some((kind, nodes)) if *kind == range.kind => *nodes += range.nodes,
                _ => kinds.push((range.kind, range.nodes)),
            }
        }
        kinds
    }

    /// Joint of a node or padding node; 0 is the body.
    pub fn joint(&self, slot: usize) -> u32 {
        let place = self.ranges.partition_point(|range| range.first_group <= slot / GROUP);
        place.checked_sub(1).map_or(0, |place| self.ranges[place].joint)
    }

    /// A node in the form of the f64 reference.
    pub fn reference_node(&self, slot: usize) -> ReferenceNode {
        ReferenceNode { normal: self.normals[slot].as_dvec3(), material: self.group_material[slot / GROUP] }
    }

    /// Pads the last range to whole workgroups with copies of its last group.
    fn close_range(&mut self) {
        let Some(range) = self.ranges.last_mut() else { return };
        let padding = range.groups.next_multiple_of(RANGE_GROUPS) - range.groups;
        range.groups += padding;
        self.groups += padding;
        self.vertex_of_node.resize(self.groups * GROUP, PADDING);
        let last = |of_group: &[u32]| of_group.last().copied().unwrap_or_default();
        self.group_material.resize(self.groups, last(&self.group_material));
        self.group_part.resize(self.groups, last(&self.group_part));
    }
}

/// Vertices sorted by kind, joint, material, part and index. Two stable counting sorts do this: first by part, then by
/// pair of joint and material in order of kind.
fn sorted_vertices(model: &Model, materials: &[Material], part_joint: &[u32]) -> Vec<u32> {
    let joints = part_joint.iter().max().map_or(1, |last| *last as usize + 1);
    // All pairs of joint and material. The stable sort keeps a joint's pairs together within a kind.
    let mut by_kind: Vec<usize> = (0..joints * materials.len()).collect();
    by_kind.sort_by_key(|pair| RangeKind::of(materials, pair % materials.len()).rank());
    let mut place = vec![0_u32; by_kind.len()];
    for (rank, &pair) in by_kind.iter().enumerate() {
        place[pair] = rank as u32;
    }
    let vertices: Vec<u32> = (0..model.positions.len() as u32).collect();
    let by_part = counting_sort(&vertices, model.parts.len(), |vertex| model.vertex_part[vertex]);
    counting_sort(&by_part, place.len(), |vertex| {
        let joint = part_joint[model.vertex_part[vertex] as usize] as usize;
        place[joint * materials.len() + model.vertex_material[vertex] as usize]
    })
}

/// Stable counting sort of vertices by a key below `keys`.
fn counting_sort(vertices: &[u32], keys: usize, key: impl Fn(usize) -> u32) -> Vec<u32> {
    let mut next = vec![0_usize; keys + 1];
    for &vertex in vertices {
        next[key(vertex as usize) as usize + 1] += 1;
    }
    for k in 0..keys {
        next[k + 1] += next[k];
    }
    let mut sorted = vec![0; vertices.len()];
    for &vertex in vertices {
        let slot = &mut next[key(vertex as usize) as usize];
        sorted[*slot] = vertex;
        *slot += 1;
    }
    sorted
}

/// Gathers a value for every node. Padding gets the default (zero).
fn gather<T: Default + Send>(vertex_of_node: &[u32], value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let of_node = |&vertex: &u32| {
        if vertex == PADDING { T::default() } else { value(vertex as usize) }
    };
    vertex_of_node.par_iter().map(of_node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Part;
    use crate::thermal::material::{Bulk, Function, Optics, Profile, Transition};
    use glam::{DMat4, DVec3};

    fn material(name: &str, sides: Sides, response: Response) -> Material {
        let front = Optics { absorptivity: 0.5, emissivity: 0.8 };
        Material {
            gloss: Default::default(),
            in_band: Default::default(),
            name: name.into(),
            front,
            sides,
            bulk: Bulk::default(),
            response,
            transition: None,
            ranges: [None; 2],
            source: "test".into(),
        }
    }

    fn transition(retarget: Retarget) -> Response {
        let profile = Profile { function: Function::Linear, t_max_steps: 9.0 };
        let domain = Domain::Temperature;
        Response::Transition(Transition { heating: profile.clone(), cooling: profile, retarget, domain })
    }

    /// Four materials of four kinds in another order than the kinds, over two parts.
    fn model() -> (Model, Vec<f64>, Vec<Material>) {
        let both = Sides::Both { back: Optics { absorptivity: 0.1, emissivity: 0.2 } };
        let materials = vec![
            material("restart", Sides::Outside, transition(Retarget::Restart)),
            material("merge", both, transition(Retarget::Merge)),
            material("instant", Sides::Outside, Response::Instant),
            material("merge outside", Sides::Outside, transition(Retarget::Merge)),
        ];
        let vertices = 101;
        let part = |name: &str| Part { name: name.into(), body_from_part: DMat4::IDENTITY };
        let model = Model {
            parts: vec![part("a"), part("b")],
            positions: (0..vertices).map(|i| DVec3::splat(f64::from(i))).collect(),
            normals: (0..vertices).map(|i| if i % 2 == 0 { Vec3::X } else { Vec3::Y }).collect(),
            vertex_part: (0..vertices).map(|i| (i / 7 % 2) as u32).collect(),
            vertex_material: (0..vertices).map(|i| (i * i % 4 + i % 3) as u32 % 4).collect(),
            ..Model::default()
        };
        let areas = (0..vertices).map(|i| 1.0 + f64::from(i)).collect();
        (model, areas, materials)
    }

    #[test]
    fn every_vertex_is_one_node_and_keeps_its_values() {
        let (model, areas, materials) = model();
        let nodes = Nodes::new(&model, &areas, &materials);
        assert_eq!(nodes.count, 101);
        assert_eq!(nodes.vertex_of_node.len(), GROUP * nodes.groups);
        let mut real: Vec<(usize, u32)> = nodes.real().collect();
        real.sort_unstable_by_key(|(_, vertex)| *vertex);
        let expected = nodes.node_of_vertex.iter().zip(0..).map(|(node, vertex)| (*node as usize, vertex));
        assert_eq!(real, expected.collect::<Vec<_>>());
        for (vertex, &node) in nodes.node_of_vertex.iter().enumerate() {
            let (node, group) = (node as usize, node as usize / GROUP);
            assert_eq!(nodes.vertex_of_node[node] as usize, vertex);
            assert_eq!(nodes.group_material[group], model.vertex_material[vertex]);
            assert_eq!(nodes.group_part[group], model.vertex_part[vertex]);
            assert_eq!(nodes.normals[node], model.normals[vertex]);
            assert_eq!(nodes.positions[node], model.positions[vertex].as_vec3());
        }
        assert_eq!(nodes.areas.iter().sum::<f64>(), areas.iter().sum::<f64>());
        for (node, _) in nodes.vertex_of_node.iter().enumerate().filter(|(_, v)| **v == PADDING) {
            assert_eq!((nodes.areas[node], nodes.normals[node]), (0.0, Vec3::ZERO));
        }
    }

    #[test]
    fn ranges_are_contiguous_and_sorted() {
        let (model, areas, materials) = model();
        let nodes = Nodes::new(&model, &areas, &materials);
        let kind = |response, both_sides| RangeKind { response, both_sides };
        let moved = |retarget| RangeResponse::Transition { retarget, domain: Domain::Temperature, shaped: false };
        let kinds: Vec<_> = nodes.ranges.iter().map(|range| range.kind).collect();
        let expected = [
            kind(RangeResponse::Instant, false),
            kind(moved(Retarget::Merge), false),
            kind(moved(Retarget::Restart), false),
            kind(moved(Retarget::Merge), true),
        ];
        assert_eq!(kinds, expected);
        let mut group = 0;
        for range in &nodes.ranges {
            assert_eq!(range.first_group, group);
            group += range.groups;
            let members = &nodes.vertex_of_node[range.first_group * GROUP..group * GROUP];
            assert_eq!(members.iter().filter(|&&v| v != PADDING).count(), range.nodes);
            for &material in &nodes.group_material[range.first_group..group] {
                assert_eq!(RangeKind::of(&materials, material as usize), range.kind);
            }
        }
        assert_eq!(group, nodes.groups);
        let key = |group: usize| (nodes.group_material[group], nodes.group_part[group]);
        let runs: Vec<_> = (0..nodes.groups).map(key).collect();
        let distinct: std::collections::BTreeSet<_> = runs.iter().collect();
        assert_eq!(runs.chunk_by(|a, b| a == b).count(), distinct.len(), "a run lies in one piece");
        for pair in nodes.vertex_of_node.windows(2).enumerate().filter(|(i, _)| i % GROUP != GROUP - 1) {
            assert!(pair.1[0] < pair.1[1] || pair.1[1] == PADDING, "vertices ascend within a group, padding last");
        }
    }

    #[test]
    fn a_model_without_vertices_has_no_ranges() {
        let (_, _, materials) = model();
        let nodes = Nodes::new(&Model::default(), &[], &materials);
        assert_eq!((nodes.groups, nodes.ranges.len()), (0, 0));
    }
}
