//! Light that was found, kept for its Sun and poses: orbits of a warm-up, the check beside a run and the run itself come back to both.
//!
//! Equal moments of two orbits differ by rounding, so directions and poses are rounded to a grid before light is found for them. Light that is kept and
//! light that is found again then have the same bits.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine3, DVec3};

use super::lit_surface::LitNode;
use super::sunlit::LitArea;

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
    /// The oldest first.
    order: VecDeque<(usize, Bits)>,
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

    /// The light of the nodes for a Sun and poses, found where it is not kept.
    pub(super) fn get_or_find(
        &self,
        nodes: &[LitNode],
        place: &SunAndPoses,
        find: impl FnOnce() -> Vec<LitArea>,
    ) -> Vec<LitArea> {
        let kept = || self.all.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (self.number, bits(place));
        let known = kept().light.get(&key).cloned();
        if let Some(packed) = known {
            return packed.unpack(nodes);
        }
        let lit = find();
        kept().keep(key, PackedLight::new(nodes, &lit));
        lit
    }
}

impl Kept {
    fn keep(&mut self, key: (usize, Bits), packed: PackedLight) {
        self.bytes += packed.bytes();
        if self.light.insert(key.clone(), Arc::new(packed)).is_none() {
            self.order.push_back(key);
        }
        while self.bytes > MEMORY
            && let Some(oldest) = self.order.pop_front()
        {
            self.bytes -= self.light.remove(&oldest).map_or(0, |packed| packed.bytes());
        }
    }
}

/// A node is dark, wholly lit on its front, wholly on its back, or in part: two bits.
const DARK: u8 = 0;
const FRONT: u8 = 1;
const BACK: u8 = 2;
const PART: u8 = 3;

/// Lit areas without loss. Most nodes are dark or wholly lit.
#[derive(Debug)]
struct PackedLight {
    /// Four nodes a byte.
    kinds: Vec<u8>,
    parts: Vec<LitArea>,
}

/// A node that is wholly lit on its front, or on its back.
fn whole(node: &LitNode, kind: u8) -> LitArea {
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
    fn new(nodes: &[LitNode], lit: &[LitArea]) -> Self {
        let mut packed = Self { kinds: vec![0; lit.len().div_ceil(4)], parts: Vec::new() };
        for (place, (node, area)) in nodes.iter().zip(lit).enumerate() {
            let kind = [DARK, FRONT, BACK].into_iter().find(|kind| same(&whole(node, *kind), area)).unwrap_or(PART);
            packed.kinds[place / 4] |= kind << (2 * (place % 4));
            packed.parts.extend((kind == PART).then_some(*area));
        }
        packed.parts.shrink_to_fit();
        packed
    }

    fn unpack(&self, nodes: &[LitNode]) -> Vec<LitArea> {
        let mut parts = self.parts.iter();
        let area = |(place, node): (usize, &LitNode)| match self.kinds[place / 4] >> (2 * (place % 4)) & 3 {
            PART => parts.next().copied().unwrap_or(LitArea::DARK),
            kind => whole(node, kind),
        };
        nodes.iter().enumerate().map(area).collect()
    }

    fn bytes(&self) -> usize {
        self.kinds.len() + self.parts.len() * size_of::<LitArea>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(count: u32) -> Vec<LitNode> {
        let normal = |k: u32| DVec3::new(f64::from(k).sin(), f64::from(k).cos(), 0.3).normalize();
        (0..count)
            .map(|number| LitNode { number, vertex: number, normal: normal(number), both_sides: true, joint: 0 })
            .collect()
    }

    fn lit(nodes: &[LitNode]) -> Vec<LitArea> {
        let area = |node: &LitNode| match node.number % 5 {
            kind @ 0..3 => whole(node, kind as u8),
            3 => LitArea { vector: 0.3 * node.normal, front: 0.7 },
            // Differs from darkness in a sign alone.
            _ => LitArea { vector: -DVec3::ZERO, front: 1.0 },
        };
        nodes.iter().map(area).collect()
    }

    #[test]
    fn kept_light_has_the_same_bits_and_is_found_once() {
        let (all, nodes) = (Arc::new(KeptLight::default()), nodes(23));
        let set = KeptSet::new(&all, &nodes);
        let sun = DVec3::new(0.2, -0.7, 0.5).normalize();
        let pose = DAffine3::from_axis_angle(sun, 0.3);
        let mut count = 0;
        let mut found = |sun: DVec3, turn: f64| {
            let poses = [DAffine3::IDENTITY, DAffine3::from_axis_angle(DVec3::Z, turn) * pose];
            set.get_or_find(&nodes, &on_grid(sun, &poses), || {
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
    }

    #[test]
    fn the_oldest_light_makes_room() {
        let mut kept = Kept::default();
        let parts = MEMORY / size_of::<LitArea>() / 4;
        for place in 0..9 {
            kept.keep((0, vec![place]), PackedLight { kinds: vec![0; 8], parts: vec![LitArea::DARK; parts] });
        }
        assert!(kept.bytes <= MEMORY && kept.light.len() == 3 && kept.light.contains_key(&(0, vec![8])));
    }
}
