//! Shadow map: the depth of the parts as seen from the Sun, and the visibility that a node reads from it. Twin of the device's passes.
//!
//! The filter compares each of its 16 texels with the plane of the node's own surface, which is lifted a little against rounding. An occluder nearer to
//! the surface than this lift casts no shadow. The lift is therefore the same length in every view: an eighth of a texel of the largest view, 6 mm at
//! 2048 texels on a craft with a diagonal of 100 m. If it followed the texel of each view, it would pass the gap between two layers as the Sun turns, and the
//! rear layer would light up in one step. The device copies the depth to a buffer first, which lavapipe reads faster than an image.

use glam::{DAffine3, DVec3};

use super::{Occluders, lit_side};

/// Empty texels around the craft, so that a filter at its silhouette stays inside the map.
const MARGIN: f64 = 3.0;
/// Distance by which a node is lifted off its surface before it is looked up, in texels of the largest view. Rounding needs a third of it: a rasteriser moves
/// corners by at most 1/32 texel each way, which moves a surface by at most 0.045 texels along its normal. The rest is for normals that are smoothed over an
/// edge.
const LIFT: f64 = 0.125;
/// The least distance in texels of the present view. This limit is for a craft that joints have made twice as large as it is in its file.
const LEAST_LIFT: f64 = 0.0625;
/// Least cosine of incidence from which a surface's slope is computed. Surfaces at flatter incidence receive almost nothing.
const LEAST_COSINE: f64 = 0.01;

/// Parallel projection of the craft from the Sun: texels from body coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunProjection {
    /// Unit vector to the Sun, body frame.
    pub sun: DVec3,
    /// Unit vector along rows, to the right.
    pub right: DVec3,
    /// Unit vector along columns, downwards. right x down points away from the Sun.
    pub down: DVec3,
    /// Coordinates of the map's corner along `right`, `down` and away from the Sun [m].
    pub corner: DVec3,
    /// Side of a texel [m].
    pub texel: f64,
    /// Texels each way.
    pub resolution: u32,
    /// Distance between depth 0 and depth 1 [m].
    pub range: f64,
    /// Distance by which a node is lifted off its surface before it is looked up [m].
    pub lift: f64,
}

impl SunProjection {
    /// A view that contains all corners of a box (lower and upper corner [m]).
    #[cfg(test)]
    pub(crate) fn new(sun: DVec3, bounds: [DVec3; 2], resolution: u32) -> Self {
        Self::around(sun, corners_of(bounds), resolution, bounds[0].distance(bounds[1]))
    }

    /// A view that contains all points [m]. `size` is the size of the craft [m], the same in all of its views.
    pub(crate) fn around(sun: DVec3, points: impl Iterator<Item = DVec3>, resolution: u32, size: f64) -> Self {
        let away = -sun;
        let right = away.any_orthonormal_vector();
        let down = away.cross(right);
        let mut least = DVec3::INFINITY;
        let mut most = DVec3::NEG_INFINITY;
        for point in points {
            let in_view = DVec3::new(point.dot(right), point.dot(down), point.dot(away));
            least = least.min(in_view);
            most = most.max(in_view);
        }
        let extent = most - least;
        let side = extent.x.max(extent.y).max(f64::MIN_POSITIVE);
        let texels = f64::from(resolution) - 2.0 * MARGIN;
        let texel = side / texels;
        let margin = MARGIN * texel;
        // Some depth in front and behind, so that a flat craft has a range as well.
        let reach = 0.01 * side + extent.z;
        let corner = DVec3::new(least.x - margin, least.y - margin, least.z - 0.01 * side);
        let lift = (LIFT * size / texels).max(LEAST_LIFT * texel);
        Self { sun, right, down, corner, texel, resolution, range: reach + 0.01 * side, lift }
    }

    /// This view in the frame in which the nodes of a joint do not move.
    pub(crate) fn in_joint(&self, body_from_joint: &DAffine3) -> Self {
        let (turn, shift) = (body_from_joint.matrix3.transpose(), body_from_joint.translation);
        let along = DVec3::new(shift.dot(self.right), shift.dot(self.down), -shift.dot(self.sun));
        Self {
            sun: turn * self.sun,
            right: turn * self.right,
            down: turn * self.down,
            corner: self.corner - along,
            ..*self
        }
    }

    /// Column, row (in texels, the first texel's centre at 0.5) and depth (0 to 1) of a point [m].
    pub(crate) fn texel_from_body(&self, point: DVec3) -> DVec3 {
        DVec3::new(
            (point.dot(self.right) - self.corner.x) / self.texel,
            (point.dot(self.down) - self.corner.y) / self.texel,
            (-point.dot(self.sun) - self.corner.z) / self.range,
        )
    }

    /// This projection as the rows of a matrix: three factors and an offset.
    pub(crate) fn rows(&self) -> [[f64; 4]; 3] {
        let row = |axis: DVec3, corner: f64, unit: f64| {
            let axis = axis / unit;
            [axis.x, axis.y, axis.z, -corner / unit]
        };
        [
            row(self.right, self.corner.x, self.texel),
            row(self.down, self.corner.y, self.texel),
            row(-self.sun, self.corner.z, self.range),
        ]
    }

    /// Point at which the light through a texel's centre enters the view [m].
    fn source(&self, column: f64, row: f64) -> DVec3 {
        let along = |axis: DVec3, corner: f64, texels: f64| axis * (corner + texels * self.texel);
        along(self.right, self.corner.x, column + 0.5) + along(self.down, self.corner.y, row + 0.5)
            - self.sun * self.corner.z
    }

    /// Depth that corresponds to the side of a texel.
    pub(crate) fn texel_depth(&self) -> f64 {
        self.texel / self.range
    }
}

/// Depth of the nearest surface at the centre of each texel. 1 where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap<'a> {
    view: SunProjection,
    depths: Depths<'a>,
}

#[derive(Debug, Clone, PartialEq)]
enum Depths<'a> {
    /// All texels, row after row.
    Drawn(Vec<f64>),
    /// Texels are traced one by one, because few nodes read only a small part of a map.
    Traced(&'a Occluders),
}

impl<'a> DepthMap<'a> {
    /// A map for few nodes, which traces the texels that they read instead of drawing all.
    pub fn traced(view: SunProjection, occluders: &'a Occluders) -> Self {
        Self { view, depths: Depths::Traced(occluders) }
    }

    /// Draws triangles with positions [m]. A texel holds the depth at its centre, as on the device.
    pub(crate) fn new(view: SunProjection, positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let side = view.resolution as usize;
        let mut depths = vec![1.0f64; side * side];
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| view.texel_from_body(positions[corner as usize]));
            let area = (b - a).truncate().perp_dot((c - a).truncate());
            if area == 0.0 {
                continue;
            }
            let bound = |low: f64, high: f64| {
                let first = (low - 0.5).ceil().max(0.0) as usize;
                first..((high - 0.5).floor() + 1.0).clamp(0.0, side as f64) as usize
            };
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            for row in bound(low.y, high.y) {
                for column in bound(low.x, high.x) {
                    let centre = glam::DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                    let weight = |from: DVec3, to: DVec3| {
                        (to.truncate() - from.truncate()).perp_dot(centre - from.truncate()) / area
                    };
                    let (of_c, of_a, of_b) = (weight(a, b), weight(b, c), weight(c, a));
                    if of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0 {
                        let depth = of_a * a.z + of_b * b.z + of_c * c.z;
                        let texel = &mut depths[row * side + column];
                        *texel = texel.min(depth);
                    }
                }
            }
        }
        Self { view, depths: Depths::Drawn(depths) }
    }

    /// Share of the Sun that a node sees, 0 to 1, at a position [m] with a unit normal. Either side of the surface may be lit.
    ///
    /// Each of 4 x 4 texels tests whether something is in front of the node's own surface, taken as a plane. A plane never shadows itself, even in
    /// grazing light. The weights make a box of three texels around the node, so that the result follows a moving edge without a jump.
    pub fn solar_visibility(&self, position: DVec3, normal: DVec3) -> f64 {
        let view = &self.view;
        let side = lit_side(normal, view.sun);
        let at = view.texel_from_body(position + side * view.lift);
        let cosine = side.dot(view.sun).max(LEAST_COSINE);
        let slope = |along: DVec3| side.dot(along) / cosine * view.texel_depth();
        let (across, along) = (slope(view.right), slope(view.down));
        let first = [(at.x - 0.5).floor(), (at.y - 0.5).floor()];
        let [fx, fy] = [at.x - 0.5 - first[0], at.y - 0.5 - first[1]];
        let weights = |f: f64| [1.0 - f, 1.0, 1.0, f];
        let mut lit = 0.0;
        for (i, wy) in (-1..=2).zip(weights(fy)) {
            for (j, wx) in (-1..=2).zip(weights(fx)) {
                let (column, row) = (first[0] + f64::from(j), first[1] + f64::from(i));
                let depth = at.z + across * (column + 0.5 - at.x) + along * (row + 0.5 - at.y);
                // Beside the craft the plane of a surface in grazing light passes behind the far end of the map, where nothing is.
                if self.depth(column, row) >= depth.min(1.0) {
                    lit += wx * wy;
                }
            }
        }
        lit / 9.0
    }

    fn depth(&self, column: f64, row: f64) -> f64 {
        let side = f64::from(self.view.resolution);
        if !(0.0..side).contains(&column) || !(0.0..side).contains(&row) {
            return 1.0;
        }
        match &self.depths {
            Depths::Drawn(depths) => depths[row as usize * self.view.resolution as usize + column as usize],
            Depths::Traced(occluders) => {
                let hit = occluders.nearest(self.view.source(column, row), -self.view.sun);
                hit.map_or(1.0, |distance| distance / self.view.range)
            }
        }
    }
}

pub(super) fn corners_of([low, high]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8u32).map(move |corner| {
        let at = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(at(0), at(1), at(2))
    })
}
