//! The corners of a node that face the Sun, and their lit shares.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3, Vec3Swizzles};

use super::lit_surface::{FLAT, LitNode, LitSurface, on_side_of};
use super::occluder::{Line, lit_share};
use super::outline::{Face, Region};
use super::points::{DiscPoints, fractions, shifts};
use super::sunward::{Above, Hiding, Sunward};

/// A joint under the Sun.
pub(super) struct JointView {
    /// Unit vector to the Sun in the frame of the joint.
    pub(super) sun: DVec3,
    /// Takes the frame of the joint into the coordinates of the Sun.
    pub(super) placed: DAffine3,
}

/// The corners of a node that face the Sun, and memory of the work on them.
#[derive(Default)]
pub(super) struct FacingCorners {
    /// Area of the node [m2].
    pub(super) area: f64,
    pub(super) corners: Vec<FacingCorner>,
    /// Points around the corners, in the coordinates of the Sun [m].
    points: Vec<DVec3>,
    faces: Vec<Face>,
    /// Triangles that hide a part of the corners.
    hiding: Vec<Hiding>,
    /// Hidden parts of a line.
    hidden: Vec<[f64; 2]>,
    /// Parts of a line that lie in corners: the number of the corner, and the ends.
    chords: Vec<(usize, [DVec2; 2])>,
}

/// The light of a corner of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct CornerLight {
    /// Share of the corner that is lit.
    pub(crate) share: f32,
}

impl CornerLight {
    /// A corner that nothing hides from the Sun.
    pub(crate) const UNHIDDEN: Self = Self { share: 1.0 };

    /// Standard deviation of the light at a point of the corner, over the light of a lit point. The noise of the lines is smaller.
    pub(crate) fn spread(self) -> f64 {
        let share = f64::from(self.share);
        (share * (1.0 - share)).max(0.0).sqrt()
    }
}

/// A corner that the Sun may light.
pub(super) struct FacingCorner {
    /// Number of its triangle times three, plus its place there.
    number: u32,
    /// Which corner of its triangle it is.
    place: usize,
    /// The triangle in the coordinates of the Sun [m].
    placed: [DVec3; 3],
    face: Face,
    /// Area [m2].
    area: f64,
    /// Unit normal on the side of the Sun, in the frame of the joint.
    side: DVec3,
    /// Cosine between the Sun and the corner's normal, which is on the side of the node's.
    cosine: f64,
    /// Number of its face among the faces of the node.
    of_face: usize,
    /// Length of the lines across it as the Sun sees them, and the lit part of that [m].
    lines: f64,
    lit: f64,
}

impl FacingCorners {
    /// Finds the corners of a node that face the Sun. The corners of a flat node lie in its plane.
    pub(super) fn find(
        &mut self,
        surface: &LitSurface,
        node: &LitNode,
        corners: &[u32],
        is_flat: bool,
        view: &JointView,
    ) {
        self.area = 0.0;
        self.corners.clear();
        for &number in corners {
            let positions = surface.placed(number);
            let twice = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
            let length = twice.length();
            let place = number as usize % 3;
            let area = node.division.area(positions, place);
            self.area += area;
            let normal =
                if is_flat { node.normal } else { on_side_of(node.normal, twice / length.max(f64::MIN_POSITIVE)) };
            let cosine = normal.dot(view.sun);
            if cosine > 0.0 || (cosine < 0.0 && node.both_sides) {
                let side = normal * cosine.signum();
                let placed = positions.map(|at| view.placed.transform_point3(at));
                let face = Face { at: placed[0], side: view.placed.matrix3 * side, back: cosine < 0.0 };
                let of_face = 0;
                self.corners.push(FacingCorner {
                    number,
                    place,
                    placed,
                    face,
                    area,
                    side,
                    cosine,
                    of_face,
                    lines: 1.0,
                    lit: 1.0,
                });
            }
        }
    }

    /// Finds the lit shares of a node's corners, by lines across them where a triangle hides a part.
    pub(super) fn cast(
        &mut self,
        surface: &LitSurface,
        node: &LitNode,
        sunward: &Sunward,
        among: Option<(&[Hiding], bool)>,
    ) {
        let start = surface.start();
        let Self { corners, points, faces, hiding, .. } = self;
        points.clear();
        faces.clear();
        for corner in corners.iter_mut() {
            points.extend(node.division.outline(corner.placed, corner.place));
            if faces.last().is_none_or(|last| last.side.dot(corner.face.side) < FLAT) {
                faces.push(corner.face);
            }
            corner.of_face = faces.len() - 1;
        }
        let region = Region::new(points);
        let above = match among {
            Some((among, is_flat)) => {
                sunward.above_among(among, &region, if is_flat { &[] } else { faces }, start, hiding)
            }
            None => sunward.above(&region, faces, start, hiding),
        };
        match above {
            Above::Nothing => {}
            Above::Cover => corners.iter_mut().for_each(|corner| corner.lit = 0.0),
            Above::Some => self.cast_lines(surface, shifts(node.vertex), sunward),
        }
    }

    /// Casts parallel lines in a direction and from a place of the node's own, at even distances over all corners.
    fn cast_lines(&mut self, surface: &LitSurface, shifts: [u32; 4], sunward: &Sunward) {
        let Self { corners, points, faces, hiding, hidden, chords, .. } = self;
        let [turned, first, ..] = fractions(shifts, 0);
        let across = DVec2::from_angle(TAU * turned);
        let along = across.perp();
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for point in points.iter_mut() {
            let at = point.truncate();
            *point = DVec3::new(across.dot(at), along.dot(at), point.z);
            (low, high) = (low.min(point.x), high.max(point.x));
        }
        let lines = surface.lines(corners.iter().map(|corner| corner.area).sum());
        corners.iter_mut().for_each(|corner| (corner.lines, corner.lit) = (0.0, 0.0));
        let mut disc = DiscPoints::new(shifts);
        for (of_face, face) in faces.iter().enumerate() {
            for line in 0..lines {
                let place = low + (f64::from(line) + first) / f64::from(lines) * (high - low);
                chords.clear();
                for (number, outline) in points.as_chunks().0.iter().enumerate() {
                    if corners[number].of_face == of_face
                        && let Some(ends) = chord(outline, place)
                    {
                        chords.push((number, ends));
                    }
                }
                let Some([begin, end]) = chords.iter().map(|(_, ends)| *ends).reduce(around) else { continue };
                let point = |at: DVec2| (place * across + at.x * along).extend(at.y);
                let line = Line::new([point(begin), point(end)], disc.next(), face, surface.start());
                sunward.find_hidden(&line, hiding, hidden);
                let length = end.x - begin.x;
                for (number, ends) in chords.iter() {
                    let shares = ends.map(|at| (at.x - begin.x) / length);
                    corners[*number].lines += ends[1].x - ends[0].x;
                    corners[*number].lit += length * lit_share(shares, hidden);
                }
            }
        }
    }

    /// Lit shares of the corners. A corner without a line is lit as the others are.
    fn shares(&self) -> impl Iterator<Item = (&FacingCorner, f64)> {
        let [lit, lines] =
            self.corners.iter().fold([0.0; 2], |[lit, all], corner| [lit + corner.lit, all + corner.lines]);
        self.corners.iter().map(move |corner| {
            let has_lines = corner.lines > 0.0;
            (corner, if has_lines { corner.lit / corner.lines } else { lit / lines.max(f64::MIN_POSITIVE) })
        })
    }

    /// Light of each corner, with its number.
    pub(super) fn lights(&self) -> Vec<(u32, CornerLight)> {
        self.shares().map(|(corner, share)| (corner.number, CornerLight { share: share as f32 })).collect()
    }

    /// Lit area vector of the corners over the node's area, and the share of the light on the front.
    pub(super) fn sum(&self) -> (DVec3, f64) {
        let (mut vector, mut on_front, mut all) = (DVec3::ZERO, 0.0, 0.0);
        for (corner, share) in self.shares() {
            let lit = corner.area * share;
            vector += lit * corner.side;
            all += lit * corner.cosine.abs();
            on_front += lit * corner.cosine.max(0.0);
        }
        (vector / self.area, if all > 0.0 { on_front / all } else { 1.0 })
    }
}

/// The part of a line in a quadrangle: the coordinates along the line and to the Sun of its ends, in the order along the line. The first coordinate of a corner
/// of the quadrangle is across the line.
fn chord(outline: &[DVec3; 4], place: f64) -> Option<[DVec2; 2]> {
    let mut ends = [DVec2::ZERO; 2];
    let mut count = 0;
    for k in 0..4 {
        let (from, to) = (outline[k], outline[(k + 1) % 4]);
        if (from.x < place) != (to.x < place) && count < 2 {
            ends[count] = from.yz().lerp(to.yz(), (place - from.x) / (to.x - from.x));
            count += 1;
        }
    }
    let [one, other] = ends;
    (count == 2 && one.x != other.x).then_some(if one.x < other.x { ends } else { [other, one] })
}

/// The part of a line around two parts.
fn around([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> [DVec2; 2] {
    [if a.x < c.x { a } else { c }, if b.x > d.x { b } else { d }]
}
