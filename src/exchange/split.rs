//! Splits patches over which what they see changes, so that a patch resolves what it receives.
//!
//! A patch receives one flux. Beside a hot wall this flux falls from node to node, and a patch of several nodes would make steps of it. Rays from every node,
//! few of them, tell which surfaces it sees: flat sides of parts, and space. A patch is halved where its halves see them differently, by more than the noise
//! of these rays explains, and so are its halves; along the same axis those count as different by half as much at least, along others by as much, because noise hides small differences. The greatest difference comes first, so the number of patches stays bounded. Faces that lie inside other parts
//! are found by the same rays, and stay whole. Where joints turn, nodes see the craft in other poses too, and patches are fine enough for each of them.

use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::balance_sides::sides_of;
use super::cast::{INSIDE, SPACE, Scenery, cast_rays};
use super::directions::evenness;
use super::echoes::{Echo, echoes, spread};
use super::hold::together;
use super::patches::{Gathered, NONE, PatchSurface, Patches, bin};
use super::slopes::Slopes;
use super::sparse::SparseRow;
use super::step::MOST_PATCHES;
use crate::thermal::material::Material;

/// Rays of all nodes together.
const RAYS: usize = 1 << 21;
/// Bounds of the rays of a face of a node.
const RAYS_OF_FACE: [usize; 2] = [16, 1024];
/// Difference of what two halves see, over the root of the share that is of the craft, up to which a patch stays whole. On a floor beside a wall at 500 K it is 3 K
/// at most wherever the floor warms by the wall alone.
const DIFFERENCE: f64 = 0.004;
/// Least root of a share of the craft.
const LEAST_WARMED: f64 = 0.05;
/// Part of the difference between two halves that the halves of each may still have, where the noise of rays hides it: light that changes evenly.
const CARRIED: f64 = 0.5;
/// Noise of what halves see, over that of rays that are spread as evenly as [`evenness`] says. Flat sides seen from a flat side have few edges.
const EVEN: f64 = 0.7;
/// Patches up to which a craft is split.
const MOST: usize = 3000;
/// Difference, as for [`DIFFERENCE`], from which on halves are parted whatever the number of patches. Two layers of a wall differ by more.
const GROSS: f64 = 0.7;

/// Size of patches [m] of which each has the nodes of a single place.
const ONE_PLACE: f64 = 1e-6;

/// What the faces of nodes see, in the file's pose and in others.
#[derive(Debug, Clone, Default)]
pub struct NodeViews {
    /// The file's pose is the first.
    poses: Vec<PoseViews>,
    /// How fast surfaces that see each other act on each other, over the third power of temperature [1/(s K3)]. One in a hundred of the area may be faster.
    pub(crate) together: f64,
}

/// What the faces of nodes see in a pose.
#[derive(Debug, Clone, Default)]
struct PoseViews {
    /// Shares of surfaces in the view of the front and the back of each node: space is the first, [`INNER`] are inner faces, and flat sides follow.
    seen: Vec<[SparseRow; 2]>,
    /// How light comes back to the front and the back of each node.
    echoes: Vec<[Echo; 2]>,
    /// Number of surfaces.
    surfaces: usize,
    /// Rays of a face.
    rays: usize,
}

/// Number of inner faces among surfaces.
const INNER: u32 = 1;

impl NodeViews {
    /// Casts rays from all nodes, in the file's pose and in other poses of the body and its joints.
    pub fn new(surface: &PatchSurface, materials: &[Material], others: &[Vec<DAffine3>]) -> Self {
        let faces = Patches::new(surface, materials, ONE_PLACE, &[]);
        let count = faces.all.len();
        let rays = (RAYS / count.max(1)).clamp(RAYS_OF_FACE[0], RAYS_OF_FACE[1]);
        let mut sides = BTreeMap::new();
        let side_of: Vec<u32> = (faces.all.iter())
            .map(|patch| {
                let next = INNER + 1 + sides.len() as u32;
                *sides.entry((patch.joint, patch.part, patch.back, bin(patch.normal))).or_insert(next)
            })
            .collect();
        let surfaces = sides.len() + INNER as usize + 1;
        let cooling_and_area: Vec<[f64; 2]> = faces.all.iter().map(|face| [face.cooling, face.area]).collect();
        let views = |poses: &[DAffine3]| {
            let scenery = Scenery::new(surface, poses);
            let ends = cast_rays(surface, &faces, &scenery, rays as u32, 0..count as u32);
            let back = echoes(surface, &faces, &scenery, &ends, rays);
            let echo = |face: &u32| back.get(*face as usize).copied().unwrap_or_default();
            let echoes = faces.of_node.iter().map(|faces| faces.each_ref().map(echo)).collect();
            let row = |ends: &[u32]| -> SparseRow {
                let side = |end: &u32| match *end {
                    SPACE => 0,
                    INSIDE => INNER,
                    face => side_of[face as usize],
                };
                let mut sides: Vec<u32> = ends.iter().map(side).collect();
                sides.sort_unstable();
                sides.chunk_by(|a, b| a == b).map(|run| (run[0], run.len() as f64 / rays as f64)).collect()
            };
            let rows: Vec<SparseRow> = ends.par_chunks(rays).map(row).collect();
            let of_face = |face: &u32| if *face == NONE { SparseRow::new() } else { rows[*face as usize].clone() };
            let seen = faces.of_node.iter().map(|faces| [of_face(&faces[0]), of_face(&faces[1])]).collect();
            (PoseViews { seen, echoes, surfaces, rays }, together(&cooling_and_area, &ends, rays))
        };
        let poses = std::iter::once(&[][..]).chain(others.iter().map(Vec::as_slice));
        let (poses, together): (_, Vec<f64>) = poses.map(views).unzip();
        Self { poses, together: together.into_iter().fold(0.0, f64::max) }
    }

    /// Whether the front and the back of each node see mostly inner faces, in the file's pose.
    pub fn buried(&self) -> Vec<[bool; 2]> {
        let inside = |row: &SparseRow| row.iter().any(|(side, share)| *side == INNER && *share > 0.5);
        let of_file = self.poses.first().map_or(&[][..], |first| &first.seen);
        of_file.iter().map(|[front, back]| [inside(front), inside(back)]).collect()
    }

    /// Splits gathered nodes until what they see differs little within each patch, or until there are enough.
    fn split(&self, surface: &PatchSurface, gathered: Vec<Gathered>) -> Vec<Gathered> {
        let mut all: Vec<Option<Gathered>> = gathered.into_iter().map(Some).collect();
        let found: Vec<Option<Halves>> =
            all.par_iter().map(|one| self.halves(surface, one.as_ref()?, [0.0; 3])).collect();
        let mut heap: BinaryHeap<Queued> = (found.into_iter().enumerate())
            .filter_map(|(place, halves)| Some(Queued { place, halves: halves? }))
            .collect();
        let (mut count, most) = (all.len(), (2 * all.len()).min(MOST_PATCHES));
        while let Some(Queued { place, halves }) = heap.pop()
            && (count < MOST || halves.differ > GROSS && count < most)
        {
            let Some(whole) = all[place].take() else { continue };
            let Halves { nodes, axis, mut along, .. } = halves;
            along[axis] *= CARRIED;
            for nodes in nodes {
                let half = Gathered { nodes, ..whole };
                let next = self.halves(surface, &half, along);
                heap.extend(next.map(|halves| Queued { place: all.len(), halves }));
                all.push(Some(half));
            }
            count += 1;
        }
        let mut split: Vec<Gathered> = all.into_iter().flatten().collect();
        split.sort_by(|a, b| (&a.key, &a.nodes).cmp(&(&b.key, &b.nodes)));
        split
    }

    /// The halves of nodes that differ most in what they see, if by more than they may. Along each axis they count as different by `least` at least.
    fn halves(&self, surface: &PatchSurface, whole: &Gathered, least: [f64; 3]) -> Option<Halves> {
        if whole.nodes.len() < 2 || whole.key.is_buried() {
            return None;
        }
        let places = || whole.nodes.iter().map(|node| surface.positions[*node as usize]);
        let low = places().fold(DVec3::INFINITY, DVec3::min);
        let high = places().fold(DVec3::NEG_INFINITY, DVec3::max);
        let along = |axis: usize| {
            let middle = 0.5 * (low[axis] + high[axis]);
            if high[axis] - low[axis] <= 1e-3 * (high - low).max_element() {
                return None;
            }
            let (first, second): (Vec<u32>, Vec<u32>) =
                whole.nodes.iter().partition(|node| surface.positions[**node as usize][axis] < middle);
            let nodes = [first, second];
            let side = whole.key.side();
            let differ =
                |pose: &PoseViews| pose.differ([&nodes[0], &nodes[1]].map(|half| pose.mean(surface, half, side)));
            Some((self.poses.iter().map(differ).fold(least[axis], f64::max), nodes))
        };
        let mut pairs = [0, 1, 2].map(along);
        let differ = [0, 1, 2].map(|axis: usize| pairs[axis].as_ref().map_or(0.0, |pair| pair.0));
        let extent = high - low;
        let axis = (0..3).max_by(|a, b| differ[*a].total_cmp(&differ[*b]).then(extent[*a].total_cmp(&extent[*b])))?;
        let (most, nodes) = pairs[axis].take()?;
        (most > DIFFERENCE).then_some(Halves { differ: most, axis, along: differ, nodes })
    }
}

impl PoseViews {
    /// Shares of all surfaces in the view of nodes, mean over their areas, and the number of their rays.
    fn mean(&self, surface: &PatchSurface, nodes: &[u32], side: usize) -> (Vec<f64>, f64) {
        let whole: f64 = nodes.iter().map(|node| surface.areas[*node as usize]).sum();
        let mut sum = vec![0.0; self.surfaces];
        for node in nodes {
            let weight = surface.areas[*node as usize] / whole;
            for (seen, share) in &self.seen[*node as usize][side] {
                sum[*seen as usize] += weight * share;
            }
        }
        (sum, (nodes.len() * self.rays) as f64)
    }

    /// Half the sum of the differences of two views, beyond their standard deviations, over the root of what they see of the craft: a cold surface tells small
    /// differences.
    fn differ(&self, [(one, rays), (other, other_rays)]: [(Vec<f64>, f64); 2]) -> f64 {
        let even = EVEN * evenness(self.rays as u32);
        let differ = |(a, b): (&f64, &f64)| {
            let mean = 0.5 * (a + b);
            let noise = even * (mean * (1.0 - mean).max(0.0) * (1.0 / rays + 1.0 / other_rays)).sqrt();
            ((a - b).abs() - noise).max(0.0)
        };
        let of_craft = |view: &[f64]| view[1..].iter().sum::<f64>();
        let warmed = 0.5 * (of_craft(&one) + of_craft(&other));
        0.5 * one.iter().zip(&other).map(differ).sum::<f64>() / warmed.sqrt().max(LEAST_WARMED)
    }
}

impl Patches {
    /// Gathers nodes into patches of at most about `edge` [m], and splits those over which the view of the nodes changes. Fluxes differ from node to node within these.
    pub fn resolved(surface: &PatchSurface, materials: &[Material], edge: f64, views: &NodeViews) -> Self {
        let gathered = Self::gathered(surface, materials, edge, &views.buried());
        let mut patches = Self::of(surface, materials, views.split(surface, gathered)).with_slopes(surface);
        let of_poses = views.poses.iter().map(|pose| spread(&patches, &pose.echoes));
        let most = of_poses.max_by(|a, b| a.iter().sum::<f64>().total_cmp(&b.iter().sum())).unwrap_or_default();
        Arc::make_mut(&mut patches.slopes).spread = most;
        patches
    }

    /// The same patches, with fluxes that differ from node to node.
    pub(crate) fn with_slopes(self, surface: &PatchSurface) -> Self {
        let placed = self.all.iter().zip(sides_of(&self.all));
        let placed: Vec<_> = placed.map(|(patch, side)| (side, patch.centre, patch.nodes.clone())).collect();
        Self { slopes: Arc::new(Slopes::new(&placed, &self.nodes, &surface.positions)), ..self }
    }
}

/// A patch in two halves, and how much they differ.
struct Halves {
    differ: f64,
    /// Axis that the halves part.
    axis: usize,
    /// Differences of halves along each axis.
    along: [f64; 3],
    nodes: [Vec<u32>; 2],
}

/// A patch that waits to be halved. The greatest difference comes first, of equal ones the first patch.
struct Queued {
    place: usize,
    halves: Halves,
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.halves.differ.total_cmp(&other.halves.differ).then(other.place.cmp(&self.place))
    }
}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Queued {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Queued {}
