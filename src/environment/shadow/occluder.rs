//! A triangle that may hide the Sun, and the part of a line on a face from which it does.

use glam::{DVec2, DVec3, Vec4};

use super::SUN_ANGULAR_RADIUS;
use super::outline::{Face, Outline, Region, growth};

/// Share of a line that is rounding.
const ROUNDING: f64 = 1e-9;

/// A triangle in the coordinates of the Sun.
#[derive(Debug, Clone, Copy)]
pub(super) struct Occluder {
    corners: [DVec3; 3],
    /// Normal [m2], around which the corners turn to the left.
    normal: DVec3,
}

impl Occluder {
    pub(super) fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        Self { corners, normal: (b - a).cross(c - a) }
    }

    pub(super) fn outline(&self) -> Outline {
        Outline::of(&self.corners)
    }

    /// Whether the Sun sees the side around which the corners turn to the left.
    pub(super) fn is_front(&self) -> bool {
        self.normal.z > 0.0
    }

    /// Whether no point of the Sun's disc sees that side.
    pub(super) fn turns_away(&self) -> bool {
        self.normal.z < 0.0 && self.normal.z.powi(2) > SUN_ANGULAR_RADIUS.powi(2) * self.normal.length_squared()
    }

    /// How the outline of the triangle, grown by the Sun's disc, lies to the outline of a region.
    pub(super) fn reaches(&self, top: f32, region: &Region<'_>) -> Reach {
        let [low, high] = [region.low.truncate(), region.high.truncate()];
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let grown = SUN_ANGULAR_RADIUS * (f64::from(top) - region.low.z).max(0.0) + growth(region.low, region.high);
        let turn = if self.is_front() { 1.0 } else { -1.0 };
        let corners = self.corners.map(DVec3::truncate);
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
    pub(super) fn heights(&self, face: &Face) -> [f64; 3] {
        self.corners.map(|corner| (corner - face.at).dot(face.side))
    }

    /// Whether the triangle may hide the Sun from a face: a part of it lies over the face, or it lies on the back of the face.
    pub(super) fn is_above(&self, face: &Face, start: f64) -> bool {
        self.heights(face).iter().any(|height| *height > start) || self.lies_on(face, start)
    }

    /// Whether the triangle lies on the back of a face and looks to the Sun, so that it has the light in place of the face.
    pub(super) fn lies_on(&self, face: &Face, start: f64) -> bool {
        face.back && self.is_front() && self.heights(face).iter().all(|height| height.abs() <= start)
    }

    /// Whether all of a region lies below the triangle.
    pub(super) fn is_over(&self, region: &Region<'_>, start: f64) -> bool {
        let normal = if self.is_front() { self.normal } else { -self.normal };
        let reach = start * (normal.x.abs() + normal.y.abs() + normal.z);
        region.points.iter().all(|point| normal.dot(*point - self.corners[0]) + reach < 0.0)
    }

    /// The part of a line from which the triangle hides the Sun, in shares of its length.
    pub(super) fn hides(&self, line: &Line) -> Option<[f64; 2]> {
        // What lies on the face is seen along the normal.
        let lies = self.lies_on(&line.face, line.above);
        let sight = if lies { Sight::new(line.along, line.face.normal_direction()) } else { line.sight };
        let from = self.corners.map(|corner| corner - line.start);
        let beside = from.map(|from| from.dot(sight.beside));
        let [a, b, c] = beside.map(|beside| beside > 0.0);
        if a == b && b == c {
            return None;
        }
        // Two edges cross the line, both from the corner that is alone on its side. There: the share of the line, and the height over it.
        let at = from.map(|from| {
            let share = from.dot(sight.shares);
            DVec2::new(share, from.z - share * line.along.z)
        });
        let alone = if b == c { 0 } else { 1 + usize::from(a == b) };
        let crossing = |other: usize| at[alone].lerp(at[other], beside[alone] / (beside[alone] - beside[other]));
        let [first, last] = [crossing((alone + 1) % 3), crossing((alone + 2) % 3)];
        let [mut first, mut last] = if first.x < last.x { [first, last] } else { [last, first] };
        if !lies {
            if first.y < 0.0 && last.y < 0.0 {
                return None;
            }
            let level = || first.x + first.y / (first.y - last.y) * (last.x - first.x);
            if first.y < 0.0 {
                first.x = level();
            } else if last.y < 0.0 {
                last.x = level();
            }
        }
        let part = [first.x.max(0.0), last.x.min(1.0)];
        (part[0] < part[1]).then_some(part)
    }
}

/// How the places around a line lie as a point of the Sun's disc sees them: products with the way from the first end of the line.
#[derive(Debug, Clone, Copy)]
struct Sight {
    /// Distance to the side of the line, times a length.
    beside: DVec3,
    /// Distance along the line, in shares of its length.
    shares: DVec3,
}

impl Sight {
    /// The sight of a line from its first end to its last, along the direction (u, v, 1).
    fn new(along: DVec3, direction: DVec2) -> Self {
        let along = along.truncate() - along.z * direction;
        let tilted = |over: DVec2| over.extend(-over.dot(direction));
        Self { beside: tilted(along.perp()), shares: tilted(along / along.length_squared()) }
    }
}

/// A line on a face, seen along a direction to the Sun.
#[derive(Debug)]
pub(super) struct Line {
    start: DVec3,
    /// From the first end to the last.
    along: DVec3,
    sight: Sight,
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
        let along = other - one;
        let sight = Sight::new(along, direction.truncate());
        Self { start: points[0], along, sight, face: *face, above: start, sides, bottom }
    }

    /// Whether a triangle of this outline may hide the Sun from the line.
    pub(super) fn may_be_under(&self, outline: &Outline) -> bool {
        outline.top >= self.bottom && outline.sides.cmple(self.sides).all()
    }
}

/// What none of the hidden parts of a line covers of a part of it, in shares of its length. Hidden parts are in their order.
pub(super) fn lit_share([from, to]: [f64; 2], hidden: &[[f64; 2]]) -> f64 {
    let (mut lit, mut end) = (0.0, from);
    for [first, last] in hidden {
        lit += (first.min(to) - end).max(0.0);
        end = end.max(*last);
    }
    lit += (to - end).max(0.0);
    if lit > ROUNDING * (to - from) { lit } else { 0.0 }
}

/// How the outline of a triangle lies to the outline of a region.
pub(super) enum Reach {
    Misses,
    Touches,
    Covers,
}
