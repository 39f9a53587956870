//! The corners of a node that face the Sun, and their lit shares.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};

use super::lit_surface::{FLAT, LitNode, LitSurface, outline};
use super::points::{fractions, point_of_disc, shifts};
use super::sunward::{Above, Face, Line, Occluder, Region, Sunward, above_among};

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
    hiding: Vec<Occluder>,
    /// Hidden parts of a line.
    hidden: Vec<[f64; 2]>,
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
    /// Length of the lines across it, and the lit part of that.
    lines: f64,
    lit: f64,
}

impl FacingCorners {
    /// Finds the corners of a node that face the Sun.
    pub(super) fn find(&mut self, surface: &LitSurface, node: &LitNode, corners: &[u32], view: &JointView) {
        self.area = 0.0;
        self.corners.clear();
        for &number in corners {
            let corner = surface.corner(number, node.normal);
            self.area += corner.area;
            let cosine = corner.normal.dot(view.sun);
            if cosine > 0.0 || (cosine < 0.0 && node.both_sides) {
                let side = corner.normal * cosine.signum();
                let placed = surface.placed(number).map(|at| view.placed.transform_point3(at));
                let face = Face { at: placed[0], side: view.placed.matrix3 * side, back: cosine < 0.0 };
                let place = number as usize % 3;
                self.corners.push(FacingCorner {
                    number,
                    place,
                    placed,
                    face,
                    area: corner.area,
                    side,
                    cosine,
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
        vertex: u32,
        sunward: &Sunward,
        over_group: Option<&[Occluder]>,
    ) {
        let start = surface.start();
        let Self { corners, points, faces, hiding, hidden, .. } = self;
        points.clear();
        faces.clear();
        for corner in corners.iter() {
            points.extend(outline(corner.placed, corner.place));
            if faces.last().is_none_or(|last| last.side.dot(corner.face.side) < FLAT) {
                faces.push(corner.face);
            }
        }
        let region = Region::new(points);
        let above = match over_group {
            Some(occluders) => above_among(occluders, &region, faces, start, hiding),
            None => sunward.above(&region, faces, start, hiding),
        };
        match above {
            Above::Nothing => return,
            Above::Cover => return corners.iter_mut().for_each(|corner| corner.lit = 0.0),
            Above::Some => {}
        }
        let facing: f64 = corners.iter().map(|corner| corner.area).sum();
        // Parallel lines in a direction and from a place of the node's own, at even distances over all corners.
        let shifts = shifts(vertex);
        let [turned, first, ..] = fractions(shifts, 0);
        let across = DVec2::from_angle(TAU * turned);
        let [low, high] = points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            let at = across.dot(point.truncate());
            [low.min(at), high.max(at)]
        });
        let lines = f64::from(surface.lines(facing));
        let place = |line: f64| low + (line + first) / lines * (high - low);
        let mut number = 0;
        for (corner, outline) in corners.iter_mut().zip(points.chunks_exact(4)) {
            let at = [0, 1, 2, 3].map(|k| across.dot(outline[k].truncate()));
            let number_at = |end: f64| (end - low) / (high - low) * lines - first;
            let begin = number_at(at.iter().copied().fold(f64::INFINITY, f64::min)).ceil() as u32;
            let end = number_at(at.iter().copied().fold(f64::NEG_INFINITY, f64::max)).ceil() as u32;
            (corner.lines, corner.lit) = (0.0, 0.0);
            for ends in (begin..end).filter_map(|line| chord(outline, at, place(f64::from(line)))) {
                let length = (ends[1] - ends[0]).length();
                corner.lines += length;
                number += 1;
                corner.lit +=
                    length * Line::new(ends, point_of_disc(shifts, number), &corner.face, start).lit(hiding, hidden);
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

/// The part of a line in a quadrangle, whose corners have these coordinates across the line.
fn chord(outline: &[DVec3], at: [f64; 4], place: f64) -> Option<[DVec3; 2]> {
    let mut ends = [DVec3::ZERO; 2];
    let mut count = 0;
    for k in 0..4 {
        let (from, to) = (at[k], at[(k + 1) % 4]);
        if (from < place) != (to < place) && count < 2 {
            ends[count] = outline[k].lerp(outline[(k + 1) % 4], (place - from) / (to - from));
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}
