//! Light that was found, kept for its Sun and poses: orbits of a warm-up, the check beside a run and the run itself come back to both.
//!
//! Equal moments of two orbits differ by rounding, so directions and poses are rounded to a grid before light is found for them. Light that is kept and
//! light that is found again then have the same bits. The first light stays where memory ends: moments come back in turn, so the oldest is the next
//! that is asked for.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::lit_corners::FacingCorners;
use super::lit_surface::LitNode;
use super::sunlit::LitArea;
use crate::trace::span;

/// Steps of the grid in a unit: half of one turns the Sun by at most 1e-9 rad.
const GRID: f64 = (1u64 << 30) as f64;
/// Most memory for kept light [B].
const MEMORY: usize = 64 << 20;

/// The direction of the Sun, and the poses of the joints.
pub(super) type SunAndPoses = (DVec3, Vec<DAffine3>);

/// The nearest Sun and poses of the grid.
pub(super) fn on_grid(sun: DVec3, poses: &[DAffine3]) -> SunAndPoses {
    let near = |value: DVec3| (value * GRID).round() / GRID;
    let pose = |pose: &DAffine3| {
        DAffine3::from_cols(
            near(pose.matrix3.x_axis),
            near(pose.matrix3.y_axis),
            near(pose.matrix3.z_axis),
            near(pose.translation),
        )
    };
    (near(sun).normalize_or(sun), poses.iter().map(pose).collect())
}

/// Bits of a Sun and of poses.
type Bits = Vec<u64>;

fn bits((sun, poses): &SunAndPoses) -> Bits {
    let of_poses = poses.iter().flat_map(DAffine3::to_cols_array);
    // Both zeros are one place of the grid.
    sun.to_array().into_iter().chain(of_poses).map(|value| (value + 0.0).to_bits()).collect()
}

/// Kept light of sets of nodes of one surface.
#[derive(Debug, Default)]
pub(crate) struct KeptLight(Mutex<Kept>);

#[derive(Debug, Default)]
struct Kept {
    /// Numbers of the nodes of each set.
    sets: Vec<Arc<[u32]>>,
    light: HashMap<(usize, Bits), Arc<PackedLight>>,
    bytes: usize,
}

/// A set of nodes among those whose light is kept.
#[derive(Debug, Clone)]
pub(super) struct KeptSet {
    all: Arc<KeptLight>,
    number: usize,
}

impl KeptSet {
    /// The set of these nodes.
    pub(super) fn new(all: &Arc<KeptLight>, nodes: &[LitNode]) -> Self {
        let mut kept = all.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |set: &Arc<[u32]>| set.iter().copied().eq(nodes.iter().map(|node| node.number));
        let number = kept.sets.iter().position(is_same).unwrap_or_else(|| {
            kept.sets.push(nodes.iter().map(|node| node.number).collect());
            kept.sets.len() - 1
        });
        Self { all: Arc::clone(all), number }
    }

    /// The light of the nodes for a Sun and poses, found where it is not kept. `open` is the light of a node by its place where nothing hides it.
    pub(super) fn get_or_find(
        &self,
        nodes: &[LitNode],
        place: &SunAndPoses,
        open: impl Fn(&mut FacingCorners, usize) -> LitArea + Sync,
        find: impl FnOnce() -> Vec<LitArea>,
    ) -> Vec<LitArea> {
        let kept = || self.all.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (self.number, bits(place));
        let known = kept().light.get(&key).cloned();
        if let Some(packed) = known {
            let _takes = span("taking kept light");
            return packed.unpack(nodes, open);
        }
        let lit = find();
        if kept().bytes < MEMORY {
            let packed = PackedLight::new(nodes, &lit, open);
            kept().keep(key, packed);
        }
        lit
    }
}

impl Kept {
    fn keep(&mut self, key: (usize, Bits), packed: PackedLight) {
        let bytes = packed.bytes();
        if self.bytes + bytes <= MEMORY && self.light.insert(key, Arc::new(packed)).is_none() {
            self.bytes += bytes;
        }
    }
}

/// Kinds of light, four bits each: none, the whole light of a plane on its front or its back, the light of a node that nothing hides, and any other, on the front, on the back,
/// or on both.
const DARK: u8 = 0;
const FRONT: u8 = 1;
const BACK: u8 = 2;
const OPEN: u8 = 3;
const PART: u8 = 4;
const PART_BACK: u8 = 5;
const MIXED: u8 = 6;
/// Nodes that one thread packs together.
const CHUNK: usize = 256;

/// Lit areas without loss. Most nodes are dark, or nothing hides them.
#[derive(Debug)]
struct PackedLight {
    /// Two nodes a byte.
    kinds: Vec<u8>,
    /// Vectors of any other light. Where it is [`MIXED`], its share on the front follows.
    parts: Vec<f64>,
    /// First of these parts in each chunk.
    first: Vec<u32>,
}

/// The light of these kinds on a node in a plane.
fn plane(node: &LitNode, kind: u8) -> LitArea {
    match kind {
        FRONT => LitArea { vector: node.normal, front: 1.0 },
        BACK => LitArea { vector: -node.normal, front: 0.0 },
        _ => LitArea::DARK,
    }
}

/// Whether two lit areas have the same bits.
fn same(a: &LitArea, b: &LitArea) -> bool {
    let bits = |area: &LitArea| [area.vector.x, area.vector.y, area.vector.z, area.front].map(f64::to_bits);
    bits(a) == bits(b)
}

impl PackedLight {
    fn new(nodes: &[LitNode], lit: &[LitArea], open: impl Fn(&mut FacingCorners, usize) -> LitArea + Sync) -> Self {
        let chunk = |corners: &mut FacingCorners, (chunk, lit): (usize, &[LitArea])| {
            let (mut kinds, mut parts) = (vec![0u8; lit.len().div_ceil(2)], Vec::<f64>::new());
            for (k, area) in lit.iter().enumerate() {
                let node = CHUNK * chunk + k;
                let in_plane = [DARK, FRONT, BACK].into_iter().find(|kind| same(&plane(&nodes[node], *kind), area));
                let mut is_open = || same(&open(corners, node), area);
                let kind = in_plane.unwrap_or_else(|| match area.front {
                    _ if is_open() => OPEN,
                    1.0 => PART,
                    front if front.to_bits() == 0 => PART_BACK,
                    _ => MIXED,
                });
                kinds[k / 2] |= kind << (4 * (k % 2));
                parts.extend((kind >= PART).then(|| area.vector.to_array()).iter().flatten());
                parts.extend((kind == MIXED).then_some(area.front));
            }
            (kinds, parts)
        };
        let chunks: Vec<_> = lit.par_chunks(CHUNK).enumerate().map_init(FacingCorners::default, chunk).collect();
        let mut packed = Self { kinds: Vec::new(), parts: Vec::new(), first: Vec::new() };
        for (kinds, parts) in chunks {
            packed.first.push(packed.parts.len() as u32);
            packed.kinds.extend(kinds);
            packed.parts.extend(parts);
        }
        packed.kinds.shrink_to_fit();
        packed.parts.shrink_to_fit();
        packed
    }

    fn unpack(&self, nodes: &[LitNode], open: impl Fn(&mut FacingCorners, usize) -> LitArea + Sync) -> Vec<LitArea> {
        let mut lit = vec![LitArea::DARK; nodes.len()];
        let chunk = |corners: &mut FacingCorners, (chunk, lit): (usize, &mut [LitArea])| {
            let mut parts = self.parts[self.first[chunk] as usize..].iter().copied();
            let mut next = || parts.next().unwrap_or_default();
            for (k, area) in lit.iter_mut().enumerate() {
                let node = CHUNK * chunk + k;
                *area = match self.kinds[node / 2] >> (4 * (node % 2)) & 15 {
                    OPEN => open(corners, node),
                    kind @ PART.. => LitArea {
                        vector: DVec3::new(next(), next(), next()),
                        front: if kind == MIXED { next() } else { f64::from(u8::from(kind == PART)) },
                    },
                    kind => plane(&nodes[node], kind),
                };
            }
        };
        lit.par_chunks_mut(CHUNK).enumerate().for_each_init(FacingCorners::default, chunk);
        lit
    }

    fn bytes(&self) -> usize {
        self.kinds.len() + 4 * self.first.len() + 8 * self.parts.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(count: u32) -> Vec<LitNode> {
        let normal = |k: u32| DVec3::new(f64::from(k).sin(), f64::from(k).cos(), 0.3).normalize();
        (0..count)
            .map(|number| LitNode { normal: normal(number), both_sides: true, ..LitNode::on_plate(number) })
            .collect()
    }

    fn lit(nodes: &[LitNode]) -> Vec<LitArea> {
        let area = |node: &LitNode| match node.number % 7 {
            kind @ 0..3 => plane(node, kind as u8),
            3 => LitArea { vector: 0.3 * node.normal, front: 0.7 },
            4 => open(node),
            5 => LitArea { vector: -0.2 * node.normal, front: 0.0 },
            // Differs from darkness in a sign alone.
            _ => LitArea { vector: -DVec3::ZERO, front: 1.0 },
        };
        nodes.iter().map(area).collect()
    }

    fn open(node: &LitNode) -> LitArea {
        LitArea { vector: 0.9 * node.normal, front: 1.0 }
    }

    #[test]
    fn kept_light_has_the_same_bits_and_is_found_once() {
        let (all, nodes) = (Arc::new(KeptLight::default()), nodes(CHUNK as u32 + 23));
        let set = KeptSet::new(&all, &nodes);
        let sun = DVec3::new(0.2, -0.7, 0.5).normalize();
        let pose = DAffine3::from_axis_angle(sun, 0.3);
        let mut count = 0;
        let mut found = |sun: DVec3, turn: f64| {
            let poses = [DAffine3::IDENTITY, DAffine3::from_axis_angle(DVec3::Z, turn) * pose];
            let is_open = |_: &mut FacingCorners, node: usize| open(&nodes[node]);
            set.get_or_find(&nodes, &on_grid(sun, &poses), is_open, || {
                count += 1;
                lit(&nodes)
            })
        };
        let first = found(sun, 0.0);
        // The same moment of another orbit, then another Sun and another pose.
        for (sun, turn) in [(sun, 0.0), (sun * (1.0 + 1e-15), 1e-16), (sun + 1e-8 * DVec3::Y, 0.0), (sun, 1e-8)] {
            assert!(found(sun, turn).iter().zip(&first).all(|(a, b)| same(a, b)));
        }
        assert_eq!(count, 3);
        // Other nodes have light of their own.
        let others = KeptSet::new(&all, &nodes[1..]);
        assert_eq!((others.number, KeptSet::new(&all, &nodes).number), (1, 0));
        // Three of seven nodes take the memory of a vector, one of them of a share too.
        let numbers = [3, 3, 3, 3, 5, 5, 5, 6, 6, 6];
        let count = |number: &u32| nodes.iter().filter(|node| node.number % 7 == *number).count();
        let bytes = PackedLight::new(&nodes, &first, |_, node| open(&nodes[node])).bytes();
        assert_eq!(bytes, nodes.len().div_ceil(2) + 8 + 8 * numbers.iter().map(count).sum::<usize>());
    }

    #[test]
    fn the_first_light_stays() {
        let mut kept = Kept::default();
        let parts = MEMORY / 8 / 4;
        for place in 0..9 {
            kept.keep((0, vec![place]), PackedLight { kinds: vec![0; 8], parts: vec![0.0; parts], first: vec![0] });
        }
        assert!(kept.bytes <= MEMORY && kept.light.len() == 3 && kept.light.contains_key(&(0, vec![0])));
    }
}
