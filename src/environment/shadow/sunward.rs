//! The craft as the Sun sees it: which triangles may hide the Sun from a node, and which part of a line they hide.
//!
//! All rays to the Sun are parallel within its disc. In coordinates (u, v, z), with z towards the Sun, a triangle can hide the Sun only from places that lie
//! below it and within its outline, grown by the radius of the disc times the distance. A tree of boxes in these coordinates finds the triangles that a node
//! may have above it. Most nodes have none and need no line; the lines of the others try a few triangles and need no tree.

use glam::{DAffine3, DVec2, DVec3, Vec4};

use super::SUN_ANGULAR_RADIUS;
use super::rays::{around, edges_of, start_over};
use super::tree::Tree;

/// Growth of outlines as a share of the coordinates, several units in the last place of f32.
const GROWTH: f64 = 1e-6;

/// Share of a line that is rounding.
const ROUNDING: f64 = 1e-9;

/// The outline (u, v) of something, grown by its distance to z = 0 times the radius of the Sun's disc, and its end in z. Two outlines that do not touch
/// cannot shade each other.
#[derive(Debug, Clone, Copy)]
struct Outline {
    /// Lower u and v, then the upper ones with the opposite sign.
    sides: Vec4,
    /// Largest z.
    top: f32,
}

/// A box of the tree, in the order of a walk.
#[derive(Debug, Clone, Copy)]
struct OutlineBox {
    outline: Outline,
    /// The next box where this one is passed over.
    skip: u32,
    /// First triangle of a leaf, and the number of its triangles. 0 for an inner box.
    first: u32,
    count: u32,
}

/// Triangles of one joint that cast shadows.
#[derive(Debug, Clone)]
pub(crate) struct Caster {
    joint: u32,
    /// Corner and edges of each triangle [m], in the order of the tree.
    triangles: Vec<[DVec3; 3]>,
    tree: Tree,
    /// Distance between the start of a ray and its surface [m].
    pub(super) start: f64,
}

impl Caster {
    /// The triangles of a joint. Their corners turn to the left around the outside.
    pub(crate) fn new(joint: u32, positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let all = edges_of(positions, triangles);
        let bounds: Vec<[DVec3; 2]> = all.iter().map(around).collect();
        let start = start_over(&bounds);
        let tree = Tree::new(bounds);
        let triangles = tree.order.iter().map(|number| all[*number as usize]).collect();
        Self { joint, triangles, tree, start }
    }
}

/// A triangle in the coordinates of the Sun: a corner and two edges [m].
#[derive(Debug, Clone, Copy)]
pub(super) struct Occluder {
    corner: DVec3,
    edges: [DVec3; 2],
    outline: Outline,
    /// Whether the Sun sees the side around which the corners turn to the left.
    front: bool,
}

/// All triangles that may hide the Sun, as the Sun sees them.
#[derive(Debug)]
pub(super) struct Sunward {
    boxes: Vec<OutlineBox>,
    occluders: Vec<Occluder>,
}

/// A part of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region<'a> {
    /// Points around it [m].
    points: &'a [DVec3],
    low: DVec3,
    high: DVec3,
    sides: Vec4,
    bottom: f32,
}

/// A face that receives light: a point on it, the unit normal on the side of the Sun, and whether that side is its back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) at: DVec3,
    pub(super) side: DVec3,
    pub(super) back: bool,
}

/// Takes a frame into the coordinates (u, v, z) of a Sun in this direction of the same frame.
pub(super) fn axes(sun: DVec3) -> DAffine3 {
    let (u, v) = sun.any_orthonormal_pair();
    let rows = glam::DMat3::from_cols(u, v, sun).transpose();
    DAffine3::from_mat3(rows)
}

impl Outline {
    fn new(low: DVec3, high: DVec3) -> Self {
        let grown = SUN_ANGULAR_RADIUS * high.z + growth(low, high);
        let [low, top] = [low - grown, high];
        let high = high + grown;
        let sides = Vec4::new(low.x as f32, low.y as f32, -high.x as f32, -high.y as f32);
        Self { sides, top: (top.z + growth(low, high)) as f32 }
    }

    fn around(self, other: Self) -> Self {
        Self { sides: self.sides.min(other.sides), top: self.top.max(other.top) }
    }

    fn may_shade(&self, region: &Region<'_>) -> bool {
        self.top >= region.bottom && self.sides.cmple(region.sides).all()
    }
}

fn growth(low: DVec3, high: DVec3) -> f64 {
    GROWTH * low.abs().max(high.abs()).max_element()
}

impl<'a> Region<'a> {
    /// The region that some points surround [m].
    pub(super) fn new(points: &'a [DVec3]) -> Self {
        let [low, high] = points
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(*point), high.max(*point)]);
        let grown = SUN_ANGULAR_RADIUS * low.z - growth(low, high);
        let [low_side, high_side] = [low + grown, high - grown];
        let sides = Vec4::new(high_side.x as f32, high_side.y as f32, -low_side.x as f32, -low_side.y as f32);
        Self { points, low, high, sides, bottom: (low.z - growth(low, high)) as f32 }
    }
}

impl Occluder {
    fn new([corner, first, second]: [DVec3; 3]) -> Self {
        let [b, c] = [corner + first, corner + second];
        let outline = Outline::new(corner.min(b).min(c), corner.max(b).max(c));
        Self { corner, edges: [first, second], outline, front: first.truncate().perp_dot(second.truncate()) > 0.0 }
    }

    fn corners(&self) -> [DVec3; 3] {
        [self.corner, self.corner + self.edges[0], self.corner + self.edges[1]]
    }

    /// How the outline of the triangle, grown by the Sun's disc, lies to the outline of a region.
    fn reaches(&self, region: &Region<'_>) -> Reach {
        let [low, high] = [region.low.truncate(), region.high.truncate()];
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let grown = SUN_ANGULAR_RADIUS * (f64::from(self.outline.top) - region.low.z).max(0.0)
            + growth(region.low, region.high);
        let turn = if self.front { 1.0 } else { -1.0 };
        let corners = self.corners().map(DVec3::truncate);
        let mut covers = true;
        for k in 0..3 {
            let edge = turn * (corners[(k + 1) % 3] - corners[k]);
            let inwards = DVec2::new(-edge.y, edge.x);
            let distance = inwards.dot(middle - corners[k]);
            let size = inwards.abs().dot(half + grown);
            if distance < -size {
                return Reach::Misses;
            }
            covers &= distance > size;
        }
        if covers { Reach::Covers } else { Reach::Touches }
    }

    /// Heights of the corners over a face.
    fn heights(&self, face: &Face) -> [f64; 3] {
        self.corners().map(|corner| (corner - face.at).dot(face.side))
    }

    /// Whether the triangle may hide the Sun from a face: a part of it lies over the face, or it lies on the back of the face.
    fn is_above(&self, face: &Face, start: f64) -> bool {
        self.heights(face).iter().any(|height| *height > start) || self.lies_on(face, start)
    }

    /// Whether the triangle lies on the back of a face and looks to the Sun, so that it has the light in place of the face.
    fn lies_on(&self, face: &Face, start: f64) -> bool {
        face.back && self.front && self.heights(face).iter().all(|height| height.abs() <= start)
    }

    /// Whether all of a region lies below the triangle.
    fn is_over(&self, region: &Region<'_>, start: f64) -> bool {
        let normal = self.edges[0].cross(self.edges[1]);
        let normal = if normal.z < 0.0 { -normal } else { normal };
        let reach = start * (normal.x.abs() + normal.y.abs() + normal.z);
        region.points.iter().all(|point| normal.dot(*point - self.corner) + reach < 0.0)
    }

    /// The part of a line from which the triangle hides the Sun, in shares of its length.
    fn hides(&self, line: &Line) -> Option<[f64; 2]> {
        // What lies on the face is seen along the normal.
        let lies = self.lies_on(&line.face, line.above);
        let direction = if lies { line.face.side.truncate() / line.face.side.z } else { line.direction };
        // Corners as the line sees them: the first end at 0, and the direction to the Sun along z.
        let along = line.along.truncate() - line.along.z * direction;
        let [a, b, c] = self.corners().map(|corner| {
            let at = corner - line.start;
            (at.truncate() - at.z * direction, at.z)
        });
        // Twice the areas of the triangles between an end and two corners, at both ends. Their signs are one within the triangle.
        let turn = |at: [DVec2; 3]| [at[1].perp_dot(at[2]), at[2].perp_dot(at[0]), at[0].perp_dot(at[1])];
        let at_start = turn([a.0, b.0, c.0]);
        let at_end = turn([a.0 - along, b.0 - along, c.0 - along]);
        let twice = at_start[0] + at_start[1] + at_start[2];
        if twice == 0.0 {
            return None;
        }
        // Height of the triangle over the line, times twice its area. The line rises, too.
        let over = |weights: [f64; 3]| weights[0] * a.1 + weights[1] * b.1 + weights[2] * c.1;
        let heights = [over(at_start), over(at_end) - twice * line.along.z];
        let mut part = [0.0f64, 1.0];
        for k in 0..if lies { 3 } else { 4 } {
            let [first, last] = if k < 3 { [at_start[k], at_end[k]] } else { heights };
            let [first, last] = [first * twice, last * twice];
            if first < 0.0 && last < 0.0 {
                return None;
            }
            if first < 0.0 {
                part[0] = part[0].max(first / (first - last));
            } else if last < 0.0 {
                part[1] = part[1].min(first / (first - last));
            }
        }
        (part[0] < part[1]).then_some(part)
    }
}

/// A line on a face, seen along a direction to the Sun.
#[derive(Debug)]
pub(super) struct Line {
    start: DVec3,
    /// The direction (u, v, 1) to the Sun.
    direction: DVec2,
    /// From the first end to the last.
    along: DVec3,
    face: Face,
    /// Its height over the face [m].
    above: f64,
    sides: Vec4,
    bottom: f32,
}

impl Line {
    /// The line between two points of a face, which is `start` above the face.
    pub(super) fn new([one, other]: [DVec3; 2], direction: DVec3, face: &Face, start: f64) -> Self {
        let off = start * face.side;
        let points = [one + off, other + off, one - off, other - off];
        // A triangle that lies on the face may be below the line.
        let Region { sides, bottom, .. } = Region::new(&points[..if face.back { 4 } else { 2 }]);
        let direction = direction.truncate();
        Self { start: points[0], direction, along: other - one, face: *face, above: start, sides, bottom }
    }

    /// Share of the line that nothing hides. A triangle that hides all of it is tried first for the next line.
    pub(super) fn lit(&self, hiding: &mut [Occluder], hidden: &mut Vec<[f64; 2]>) -> f64 {
        hidden.clear();
        for place in 0..hiding.len() {
            let outline = hiding[place].outline;
            if outline.top < self.bottom || !outline.sides.cmple(self.sides).all() {
                continue;
            }
            match hiding[place].hides(self) {
                Some([0.0, 1.0]) => {
                    hiding.swap(0, place);
                    return 0.0;
                }
                Some(part) => hidden.push(part),
                None => {}
            }
        }
        hidden.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let (mut lit, mut end) = (0.0, 0.0f64);
        for [first, last] in hidden.iter() {
            lit += (first - end).max(0.0);
            end = end.max(*last);
        }
        lit += 1.0 - end;
        if lit > ROUNDING { lit } else { 0.0 }
    }
}

enum Reach {
    Misses,
    Touches,
    Covers,
}

/// What lies between a region and the Sun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Above {
    Nothing,
    /// One triangle over all of it.
    Cover,
    /// The triangles of the list.
    Some,
}

impl Sunward {
    /// The casters, which `placed` takes from their joint to the coordinates of the Sun.
    pub(super) fn new(casters: &[Caster], placed: impl Fn(u32) -> DAffine3) -> Self {
        let mut all = Self { boxes: Vec::new(), occluders: Vec::new() };
        for Caster { joint, triangles, tree, .. } in casters {
            let placed = placed(*joint);
            let [first_box, first_occluder] = [all.boxes.len(), all.occluders.len()];
            all.occluders.extend(triangles.iter().map(|[corner, first, second]| {
                let edges = [first, second].map(|edge| placed.matrix3 * *edge);
                Occluder::new([placed.transform_point3(*corner), edges[0], edges[1]])
            }));
            let empty = Outline { sides: Vec4::INFINITY, top: f32::NEG_INFINITY };
            all.boxes.extend(tree.nodes.iter().map(|node| OutlineBox {
                outline: empty,
                skip: node.skip + first_box as u32,
                first: node.first + first_occluder as u32,
                count: node.count,
            }));
            for place in (first_box..all.boxes.len()).rev() {
                let OutlineBox { first, count, .. } = all.boxes[place];
                all.boxes[place].outline = if count > 0 {
                    let occluders = &all.occluders[first as usize..(first + count) as usize];
                    occluders.iter().fold(empty, |around, occluder| around.around(occluder.outline))
                } else {
                    let second = all.boxes[place + 1].skip as usize;
                    all.boxes[place + 1].outline.around(all.boxes[second].outline)
                };
            }
        }
        all
    }

    /// Finds the triangles that may hide the Sun from faces in a region.
    pub(super) fn above(&self, region: &Region<'_>, faces: &[Face], start: f64, list: &mut Vec<Occluder>) -> Above {
        list.clear();
        let mut place = 0;
        while let Some(at) = self.boxes.get(place) {
            if !at.outline.may_shade(region) {
                place = at.skip as usize;
                continue;
            }
            let leaf = &self.occluders[at.first as usize..(at.first + at.count) as usize];
            if sift(leaf, region, faces, start, list) {
                return Above::Cover;
            }
            place += 1;
        }
        if list.is_empty() { Above::Nothing } else { Above::Some }
    }
}

/// The same among the triangles above a region around this one.
pub(super) fn above_among(
    occluders: &[Occluder],
    region: &Region<'_>,
    faces: &[Face],
    start: f64,
    list: &mut Vec<Occluder>,
) -> Above {
    list.clear();
    if sift(occluders, region, faces, start, list) {
        return Above::Cover;
    }
    if list.is_empty() { Above::Nothing } else { Above::Some }
}

/// Adds the triangles that may hide the Sun from faces in a region to a list. Returns whether one lies over all of it.
fn sift(occluders: &[Occluder], region: &Region<'_>, faces: &[Face], start: f64, list: &mut Vec<Occluder>) -> bool {
    for occluder in occluders {
        if !occluder.outline.may_shade(region) || !faces.iter().any(|face| occluder.is_above(face, start)) {
            continue;
        }
        match occluder.reaches(region) {
            Reach::Misses => {}
            Reach::Covers if occluder.is_over(region, start) => return true,
            _ => list.push(*occluder),
        }
    }
    false
}
