//! Contacts without a common face: along an edge, or at points.
//!
//! Along an edge the area of contact is the length that lies within the contact's distance of the other side, times the thinner of the two thicknesses. The
//! length of each edge is found exactly. Which nodes share it is found at points along it.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;
use rayon::prelude::*;

use super::faces::Touch;
use super::side::{ContactGroups, ContactSide, Group, owners};

/// An edge lies along the other side if it comes nearer or goes away by at most this share of its length there.
const ALONG: f64 = 0.25;
/// Points of an edge at which the node of the other side is looked up.
const POINTS: usize = 32;
/// Halvings that find where an edge leaves the other side's reach.
const HALVINGS: usize = 60;
/// Relative difference below which both directions of a contact are equally long.
const EQUAL: f64 = 1e-6;

/// An edge in contact with a part and material of the other side.
struct Seam {
    owners: ContactGroups,
    /// Whether the edge belongs to the lower of its owners.
    of_lower: bool,
    /// Length in contact [m].
    length: f64,
    /// Area of pairs of nodes [m2].
    shares: Vec<([u32; 2], f64)>,
}

/// Areas of contact along edges, for the parts and materials that are not among those `met`, whose faces meet.
pub(super) fn edge_touches(sides: [&ContactSide; 2], distance: f64, met: &HashSet<ContactGroups>) -> Vec<Touch> {
    let [first, second] = sides.map(|side| side.groups.iter().copied().collect::<HashSet<Group>>());
    let mut pairs = first.iter().flat_map(|a| second.iter().map(|b| owners(*a, *b)));
    if pairs.all(|owners| owners[0] == owners[1] || met.contains(&owners)) {
        return Vec::new();
    }
    let mut all = seams(sides, distance, met);
    // Where a part is on both sides, its edges have been seen.
    let counted: HashSet<_> = all.iter().map(|seam| (seam.owners, seam.of_lower)).collect();
    let back = seams([sides[1], sides[0]], distance, met);
    all.extend(back.into_iter().filter(|seam| !counted.contains(&(seam.owners, seam.of_lower))));

    let mut lengths: HashMap<ContactGroups, [f64; 2]> = HashMap::new();
    for seam in &all {
        lengths.entry(seam.owners).or_default()[usize::from(seam.of_lower)] += seam.length;
    }
    // A seam in the middle of a face is an edge of one side only. Where both sides have edges, both count half.
    let weight = |seam: &Seam| {
        let [other, upper] = lengths[&seam.owners];
        let [here, other] = if seam.of_lower { [upper, other] } else { [other, upper] };
        if (here - other).abs() <= EQUAL * here.max(other) { 0.5 } else { f64::from(u8::from(here > other)) }
    };
    let touches = all.iter().flat_map(|seam| {
        let (owners, weight) = (seam.owners, weight(seam));
        seam.shares.iter().map(move |(nodes, area)| Touch { nodes: *nodes, owners, area: weight * area })
    });
    touches.filter(|touch| touch.area > 0.0).collect()
}

/// The pairs of nodes of two sides that lie within a distance of each other's triangles, the lower node first.
pub(super) fn point_touches(sides: [&ContactSide; 2], distance: f64) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    for [from, to] in [sides, [sides[1], sides[0]]] {
        let mut visited = HashSet::new();
        for (triangle, group) in from.groups.iter().enumerate() {
            for (point, node) in from.corners[triangle].into_iter().zip(from.nodes[triangle]) {
                if !visited.insert(node) {
                    continue;
                }
                let near = candidates(to, *group, point, point, distance);
                let other = nearest(to, &near, point).filter(|(least, _)| *least <= distance);
                pairs.extend(other.map(|(_, other)| [node.min(other), node.max(other)]).filter(|[a, b]| a != b));
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Edges of one side that lie along the other.
fn seams([from, to]: [&ContactSide; 2], distance: f64, met: &HashSet<ContactGroups>) -> Vec<Seam> {
    // The first triangle of each edge, and how many have it.
    let mut edges: BTreeMap<[u32; 2], (usize, [usize; 2], u32)> = BTreeMap::new();
    for triangle in 0..from.corners.len() {
        for (first, second) in [(0, 1), (1, 2), (2, 0)] {
            let [a, b] = [from.nodes[triangle][first], from.nodes[triangle][second]];
            if a != b {
                edges.entry([a.min(b), a.max(b)]).or_insert((triangle, [first, second], 0)).2 += 1;
            }
        }
    }
    edges
        .into_values()
        .collect::<Vec<_>>()
        .into_par_iter()
        .flat_map_iter(|(triangle, ends, count)| {
            let points = ends.map(|corner| from.corners[triangle][corner]);
            let nodes = ends.map(|corner| from.nodes[triangle][corner]);
            let group = from.groups[triangle];
            let across = 3 - ends[0] - ends[1];
            let tip = (from.corners[triangle][across], from.nodes[triangle][across]);
            // Along a border each point belongs to the nearest corner of its triangle, as the triangle conducts (`shell/conductance.rs`).
            let node_at = move |along: f64| {
                let point = points[0].lerp(points[1], along);
                let end = usize::from(along > 0.5);
                if count == 1 && point.distance(tip.0) < point.distance(points[end]) { tip.1 } else { nodes[end] }
            };
            let mut of_group: BTreeMap<Group, Vec<usize>> = BTreeMap::new();
            for other in candidates(to, group, points[0], points[1], distance) {
                of_group.entry(to.groups[other]).or_default().push(other);
            }
            of_group.retain(|other, _| !met.contains(&owners(group, *other)));
            let seam = move |(other, near): (Group, Vec<usize>)| {
                let thickness = from.thickness[triangle].min(to.thickness[near[0]]);
                let pieces = pieces(to, &near, points, distance);
                let share: f64 = pieces.iter().map(|[start, end]| end - start).sum();
                if share <= 0.0 {
                    return None;
                }
                let length = share * points[0].distance(points[1]);
                let at = |index: usize| {
                    // The point that has this share of all pieces behind it.
                    let mut behind = share * (index as f64 + 0.5) / POINTS as f64;
                    let piece = pieces.iter().find(|[start, end]| {
                        let inside = behind <= end - start;
                        behind -= if inside { 0.0 } else { end - start };
                        inside
                    });
                    piece.map_or(1.0, |[start, _]| start + behind)
                };
                let share = |index: usize| {
                    let along = at(index);
                    let (_, other) = nearest(to, &near, points[0].lerp(points[1], along))?;
                    Some(([node_at(along), other], length * thickness / POINTS as f64))
                };
                let shares = (0..POINTS).filter_map(share).collect();
                Some(Seam { owners: owners(group, other), of_lower: group < other, length, shares })
            };
            of_group.into_iter().filter_map(seam).collect::<Vec<_>>()
        })
        .collect()
}

/// Triangles of a side near an edge, without the edge's own part and material.
fn candidates(to: &ContactSide, group: Group, start: DVec3, end: DVec3, distance: f64) -> Vec<usize> {
    let mut near = Vec::new();
    to.near(start.min(end) - distance, start.max(end) + distance, |triangle| {
        if to.groups[triangle] != group {
            near.push(triangle);
        }
    });
    near
}

/// The pieces of an edge that lie along some triangles, as shares of its length.
fn pieces(to: &ContactSide, near: &[usize], [start, end]: [DVec3; 2], distance: f64) -> Vec<[f64; 2]> {
    let length = start.distance(end);
    let away = |triangle: usize, along: f64| from_triangle(start.lerp(end, along), to.corners[triangle]).0;
    let mut reaches: Vec<[f64; 2]> = near
        .iter()
        .filter_map(|triangle| {
            // The distance from a triangle is a convex function of the place on the edge.
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..HALVINGS {
                let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
                if away(*triangle, left) <= away(*triangle, right) { high = right } else { low = left }
            }
            // A minimum at an end is approached, not reached.
            let nearest = [0.0, 0.5 * (low + high), 1.0]
                .into_iter()
                .min_by(|a, b| away(*triangle, *a).total_cmp(&away(*triangle, *b)))?;
            if away(*triangle, nearest) > distance {
                return None;
            }
            let limit = |outside: f64| {
                if away(*triangle, outside) <= distance {
                    return outside;
                }
                let (mut inside, mut outside) = (nearest, outside);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (inside + outside);
                    if away(*triangle, middle) <= distance { inside = middle } else { outside = middle }
                }
                inside
            };
            Some([limit(0.0), limit(1.0)])
        })
        .collect();
    reaches.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut pieces: Vec<[f64; 2]> = Vec::new();
    for [start, end] in reaches {
        match pieces.last_mut() {
            Some(last) if start <= last[1] => last[1] = last[1].max(end),
            _ => pieces.push([start, end]),
        }
    }
    // A piece that only pokes into the reach of the other side does not lie along it.
    pieces.retain(|piece| {
        let least = |along: f64| near.iter().map(|triangle| away(*triangle, along)).fold(f64::INFINITY, f64::min);
        let values = (0..=8).map(|at| least(piece[0] + (piece[1] - piece[0]) * f64::from(at) / 8.0));
        let [low, high] = values.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], v| [low.min(v), high.max(v)]);
        high - low <= ALONG * (piece[1] - piece[0]) * length
    });
    pieces
}

/// The nearest of some triangles: its distance [m], and the node in whose part the nearest point lies.
fn nearest(to: &ContactSide, near: &[usize], point: DVec3) -> Option<(f64, u32)> {
    let mut best: Option<(f64, usize, DVec3)> = None;
    for triangle in near {
        let (distance, place) = from_triangle(point, to.corners[*triangle]);
        if best.is_none_or(|(least, ..)| distance < least) {
            best = Some((distance, *triangle, place));
        }
    }
    best.map(|(distance, triangle, place)| (distance, to.nodes[triangle][to.corner_at(triangle, place)]))
}

/// Distance of a point from a triangle [m], and the nearest point of it.
fn from_triangle(point: DVec3, corners: [DVec3; 3]) -> (f64, DVec3) {
    let weights = nearest_point(point, corners);
    let place = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
    (place.distance(point), place)
}

/// Barycentric coordinates of the point of a triangle nearest to a point (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
fn nearest_point(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let [d1, d2] = [ab.dot(point - a), ac.dot(point - a)];
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let [d3, d4] = [ab.dot(point - b), ac.dot(point - b)];
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let [d5, d6] = [ab.dot(point - c), ac.dot(point - c)];
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    let [along, beyond] = [d4 - d3, d5 - d6];
    if va <= 0.0 && along >= 0.0 && beyond >= 0.0 && along + beyond > 0.0 {
        let w = along / (along + beyond);
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    if sum > 0.0 { [va / sum, vb / sum, vc / sum] } else { [1.0, 0.0, 0.0] }
}
