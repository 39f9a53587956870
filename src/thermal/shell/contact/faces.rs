//! Areas of contact between triangles: where two surfaces lie over each other within the contact's distance, corner by corner.
//!
//! Two triangles are compared in their contact plane, midway between their own planes. There the area of contact is the common part of both where the
//! gap is small enough. Each node owns a part of its triangle around its corner. A pair of nodes gets the area that lies in the parts of both.
//! Surfaces in layers touch only where nothing of either side lies between them.

use std::collections::HashSet;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::polygon::{HalfPlane, Polygon};
use super::side::{ContactGroups, ContactSide, NO_PIECE, owners};

/// Cosine of the largest angle between two triangles in contact: 45 deg. A steeper triangle touches along an edge.
const STEEPEST: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Gaps closer than this share of the contact's distance are the same.
const SAME_GAP: f64 = 1e-6;

/// An overlap above this share of the smaller triangle is a contact of faces. Below it may be the rounding of two that lie side by side.
const CLEAR: f64 = 1e-3;

/// Area of contact of two nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    pub(super) nodes: [u32; 2],
    pub(super) owners: ContactGroups,
    /// Area [m2].
    pub(super) area: f64,
}

/// The areas of a contact, and the surfaces that meet in it.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// The areas of contact. A pair of nodes may occur many times.
    pub(super) touches: Vec<Touch>,
    /// Parts and materials whose faces lie over each other beyond doubt, be it with others between.
    pub(super) met: HashSet<ContactGroups>,
}

/// The contact plane of two triangles.
struct ContactPlane {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
    normal: DVec3,
}

impl ContactPlane {
    /// The plane between two planes with these unit normals. `None` where they are too steep against each other.
    fn between(origin: DVec3, first: DVec3, second: DVec3) -> Option<Self> {
        let cosine = first.dot(second);
        if cosine.abs() < STEEPEST {
            return None;
        }
        let normal = (first + second * cosine.signum()).normalize_or_zero();
        let (x, y) = normal.any_orthonormal_pair();
        Some(Self { origin, x, y, normal })
    }

    fn flat(&self, point: DVec3) -> DVec2 {
        let from = point - self.origin;
        DVec2::new(from.dot(self.x), from.dot(self.y))
    }

    /// A triangle in this plane, counter-clockwise.
    fn polygon(&self, corners: [DVec3; 3], normal: DVec3) -> Polygon {
        let mut corners = corners.map(|corner| self.flat(corner));
        if normal.dot(self.normal) < 0.0 {
            corners.swap(1, 2);
        }
        Polygon { corners: corners.to_vec() }
    }

    /// Height of the plane through a point over this plane [m].
    fn height(&self, point: DVec3, normal: DVec3) -> HalfPlane {
        let up = normal.dot(self.normal);
        let slope = DVec2::new(normal.dot(self.x), normal.dot(self.y)) / -up;
        HalfPlane { slope, origin: (point - self.origin).dot(self.normal) - slope.dot(self.flat(point)) }
    }

    /// The value (p - point) . towards where the point p has this height.
    fn along(&self, point: DVec3, towards: DVec3, height: &HalfPlane) -> HalfPlane {
        let up = towards.dot(self.normal);
        HalfPlane {
            slope: DVec2::new(towards.dot(self.x), towards.dot(self.y)) + height.slope * up,
            origin: (self.origin - point).dot(towards) + height.origin * up,
        }
    }

    fn raised(&self, point: DVec2, height: &HalfPlane) -> DVec3 {
        self.origin + self.x * point.x + self.y * point.y + self.normal * height.at(point)
    }
}

/// The difference of two heights [m].
fn gap(from: &HalfPlane, to: &HalfPlane) -> HalfPlane {
    HalfPlane { slope: to.slope - from.slope, origin: to.origin - from.origin }
}

/// Two sides of a contact, and its greatest distance [m].
pub(super) struct Faces<'a> {
    pub(super) sides: [&'a ContactSide; 2],
    pub(super) distance: f64,
    /// The piece of each triangle, where neighbours are sought. Both sides are then the same, surfaces also touch where their sheets fill the gap, as the
    /// two skins of a panel do, and a part and material touches itself in other pieces and through a slab.
    pub(super) pieces: Option<&'a [u32]>,
}

impl Faces<'_> {
    /// The areas of contact of all pairs of triangles.
    pub(super) fn find(&self) -> Found {
        let [first, second] = self.sides;
        let thickest = second.thickness.iter().copied().fold(0.0, f64::max);
        let of_triangle = |mut contacts: Found, a: usize| {
            let [p, q, r] = first.corners[a];
            let reach = self.reach(first.thickness[a] + thickest);
            let [low, high] = [p.min(q).min(r) - reach, p.max(q).max(r) + reach];
            second.near(low, high, |b| {
                if self.are_pair(a, b) {
                    self.touch(a, b, &mut contacts);
                }
            });
            contacts
        };
        let both = |mut contacts: Found, more: Found| {
            contacts.touches.extend(more.touches);
            contacts.met.extend(more.met);
            contacts
        };
        (0..first.corners.len()).into_par_iter().fold(Found::default, of_triangle).reduce(Found::default, both)
    }

    /// Greatest distance between surfaces whose sheets fill this gap [m].
    fn reach(&self, filled: f64) -> f64 {
        if self.pieces.is_some() { self.distance.max(filled * (1.0 + SAME_GAP)) } else { self.distance }
    }

    /// Whether two triangles can be in contact. Where both belong to both sides, one order counts.
    fn are_pair(&self, a: usize, b: usize) -> bool {
        let [first, second] = self.sides;
        let twice = || first.has(second.numbers[b]) && second.has(first.numbers[a]);
        let once = first.numbers[a] < second.numbers[b] || !twice();
        once && (first.groups[a] != second.groups[b] || self.are_own_pair(a, b))
    }

    /// Whether two triangles of one part and material can be in contact. One piece conducts along its mesh, and only through a slab between faces that
    /// look away from each other.
    fn are_own_pair(&self, a: usize, b: usize) -> bool {
        let [first, second] = self.sides;
        self.pieces.is_some_and(|pieces| pieces[a] != NO_PIECE && pieces[b] != NO_PIECE)
            && (!self.is_one_piece(a, b)
                || first.normals[a].dot(second.normals[b]) < -STEEPEST
                    && first.nodes[a].iter().all(|node| !second.nodes[b].contains(node)))
    }

    fn is_one_piece(&self, a: usize, b: usize) -> bool {
        self.pieces.is_some_and(|pieces| pieces[a] == pieces[b] && pieces[a] != NO_PIECE)
    }

    /// Greatest gaps below and above the first of two triangles within which they touch [m]. The frame's normal is along the first one.
    fn limits(&self, a: usize, b: usize) -> [f64; 2] {
        let [first, second] = self.sides;
        let [below, above] = first.filled[a];
        // Behind a face that looks the same way lies what the other turns to this one.
        let turned = first.normals[a].dot(second.normals[b]) < 0.0;
        let [behind, before] = second.filled[b];
        let [up, down] = if turned { [behind, before] } else { [before, behind] };
        // Faces of one piece that look at each other have a slit between them.
        let above = if self.is_one_piece(a, b) { -SAME_GAP * self.distance } else { self.reach(above + down) };
        [self.reach(below + up), above]
    }

    /// Adds the areas of contact of two triangles.
    fn touch(&self, a: usize, b: usize, contacts: &mut Found) {
        let [first, second] = self.sides;
        let normals = [first.normals[a], second.normals[b]];
        let corners = [first.corners[a], second.corners[b]];
        let Some(frame) = ContactPlane::between(corners[0][0], normals[0], normals[1]) else { return };
        let [lower, upper] = [0, 1].map(|side| frame.height(corners[side][0], normals[side]));
        let apart = gap(&lower, &upper);
        let flat = [0, 1].map(|side| frame.polygon(corners[side], normals[side]));
        let common = flat[0].within(&flat[1].sides());
        let [below, above] = self.limits(a, b);
        let common = common.within(&[apart.above(-below), apart.reversed().above(-above)]);
        if common.area() <= 0.0 {
            return;
        }
        let owners = owners(first.groups[a], second.groups[b]);
        if common.area() > CLEAR * flat[0].area().min(flat[1].area()) {
            contacts.met.insert(owners);
        }
        let same = SAME_GAP * self.distance;
        let is_above = common.corners.iter().all(|corner| apart.at(*corner) >= -same);
        let is_below = common.corners.iter().all(|corner| apart.at(*corner) <= same);
        // The second lies on one side of the first, or crosses it.
        let halves = match (is_above, is_below) {
            (true, _) => vec![(common, 1.0)],
            (_, true) => vec![(common, -1.0)],
            _ => vec![(common.clipped(&apart), 1.0), (common.clipped(&apart.reversed()), -1.0)],
        };
        for (half, sign) in halves {
            for open in self.open(&frame, [a, b], [&lower, &upper], half, sign) {
                self.share(&frame, [a, b], [&lower, &upper], &open, |nodes, area| {
                    contacts.touches.push(Touch { nodes, owners, area });
                });
            }
        }
    }

    /// The pieces of the common part of two triangles with nothing of either side between. `sign` says on which side of the first triangle the second
    /// lies.
    fn open(
        &self,
        frame: &ContactPlane,
        pair: [usize; 2],
        heights: [&HalfPlane; 2],
        common: Polygon,
        sign: f64,
    ) -> Vec<Polygon> {
        let same = SAME_GAP * self.distance;
        let corners = || common.corners.iter().flat_map(|corner| heights.map(|height| frame.raised(*corner, height)));
        let low = corners().fold(DVec3::INFINITY, DVec3::min) - same;
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max) + same;
        let mut open = vec![common];
        for side in [0, 1] {
            let (here, other) = (self.sides[1 - side], self.sides[side]);
            let [seen_from, beyond] = [pair[1 - side], pair[side]];
            // Gaps count from the triangle of the other side.
            let base = heights[1 - side];
            let sign = if side == 1 { sign } else { -sign };
            let toward = |line: HalfPlane| if sign < 0.0 { line.reversed() } else { line };
            let full = toward(gap(base, heights[side]));
            let (group, number) = (here.groups[seen_from], here.numbers[seen_from]);
            let is_own_pair = other.groups[beyond] == group;
            other.near(low, high, |layer| {
                let is_own = other.groups[layer] == group;
                if layer == beyond || other.numbers[layer] == number || is_own && !is_own_pair {
                    return;
                }
                let normal = other.normals[layer];
                if normal.dot(here.normals[seen_from]).abs() < STEEPEST || normal.dot(frame.normal).abs() < STEEPEST {
                    return;
                }
                let height = frame.height(other.corners[layer][0], normal);
                let here = toward(gap(base, &height));
                let earlier = other.numbers[layer] < other.numbers[beyond];
                let nearer = gap(&here, &full).above(if earlier { -same } else { same });
                let mut lines = frame.polygon(other.corners[layer], normal).sides();
                lines.extend([here.above(if is_own { same } else { -same }), nearer]);
                open = std::mem::take(&mut open).into_iter().flat_map(|part| part.without(&lines)).collect();
            });
        }
        open
    }

    /// Calls a function with the pairs of nodes in whose corners' parts a polygon lies, and the area of each [m2].
    fn share(
        &self,
        frame: &ContactPlane,
        [a, b]: [usize; 2],
        heights: [&HalfPlane; 2],
        polygon: &Polygon,
        mut add: impl FnMut([u32; 2], f64),
    ) {
        let [first, second] = self.sides;
        for (corner, part) in self.parts(frame, 0, a, heights[0], polygon) {
            for (other, part) in self.parts(frame, 1, b, heights[1], &part) {
                add([first.nodes[a][corner], second.nodes[b][other]], part.area());
            }
        }
    }

    /// The parts of a polygon that lie in the parts of a triangle's corners.
    fn parts(
        &self,
        frame: &ContactPlane,
        side: usize,
        triangle: usize,
        height: &HalfPlane,
        polygon: &Polygon,
    ) -> impl Iterator<Item = (usize, Polygon)> {
        let dividers = self.sides[side].dividers(triangle);
        (0..3).filter_map(move |corner| {
            let mut part = polygon.clone();
            for divider in dividers.clone().filter(|divider| divider.corners.contains(&corner)) {
                let line = frame.along(divider.point, divider.towards, height);
                part = part.clipped(&if divider.corners[1] == corner { line } else { line.reversed() });
            }
            (part.area() > 0.0).then_some((corner, part))
        })
    }
}
