//! Outlines of triangles and of parts of the surface, as the Sun sees them: which of them cannot shade each other.

use glam::{DVec2, DVec3, Vec4};

use super::SUN_ANGULAR_RADIUS;

/// Growth of outlines as a share of the coordinates, several units in the last place of f32.
const GROWTH: f64 = 1e-6;

/// The outline (u, v) of something, grown by its distance to z = 0 times the radius of the Sun's disc, and its end in z. Two outlines that do not touch
/// cannot shade each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outline {
    /// Lower u and v, then the upper ones with the opposite sign.
    pub(super) sides: Vec4,
    /// Largest z.
    pub(super) top: f32,
}

/// A part of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region<'a> {
    /// Points around it [m].
    pub(super) points: &'a [DVec3],
    pub(super) low: DVec3,
    pub(super) high: DVec3,
    pub(super) sides: Vec4,
    pub(super) bottom: f32,
}

/// A face that receives light: a point on it, the unit normal on the side of the Sun, and whether that side is its back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) at: DVec3,
    pub(super) side: DVec3,
    pub(super) back: bool,
}

impl Outline {
    pub(super) fn of([a, b, c]: &[DVec3; 3]) -> Self {
        let [low, high] = [a.min(*b).min(*c), a.max(*b).max(*c)];
        let grown = SUN_ANGULAR_RADIUS * high.z + growth(low, high);
        let [low, top] = [low - grown, high];
        let high = high + grown;
        let sides = Vec4::new(low.x as f32, low.y as f32, -high.x as f32, -high.y as f32);
        Self { sides, top: (top.z + growth(low, high)) as f32 }
    }

    pub(super) fn around(self, other: Self) -> Self {
        Self { sides: self.sides.min(other.sides), top: self.top.max(other.top) }
    }

    pub(super) fn may_shade(&self, region: &Region<'_>) -> bool {
        self.top >= region.bottom && self.sides.cmple(region.sides).all()
    }
}

pub(super) fn growth(low: DVec3, high: DVec3) -> f64 {
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

impl Face {
    /// Direction (u, v, 1) of the normal.
    pub(super) fn normal_direction(&self) -> DVec2 {
        self.side.truncate() / self.side.z
    }
}
