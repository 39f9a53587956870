//! Convex polygons in a plane: the part on one side of a line, and the rest beside another polygon.

use glam::DVec2;

/// Share of a polygon's area below which the remains of a cut are rounding.
const ROUNDING: f64 = 1e-12;

/// A line, or the half-plane where `at` is not negative.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfPlane {
    /// Gradient of the value.
    pub(super) slope: DVec2,
    pub(super) origin: f64,
}

/// A convex polygon, counter-clockwise.
#[derive(Debug, Clone)]
pub(super) struct Polygon {
    /// Its corners. Fewer than three are nothing.
    pub(super) corners: Vec<DVec2>,
}

impl HalfPlane {
    /// The line through two points, with its half-plane to the left.
    pub(super) fn through(from: DVec2, to: DVec2) -> Self {
        let slope = (to - from).perp();
        Self { slope, origin: -slope.dot(from) }
    }

    pub(super) fn at(&self, point: DVec2) -> f64 {
        self.slope.dot(point) + self.origin
    }

    pub(super) fn reversed(self) -> Self {
        Self { slope: -self.slope, origin: -self.origin }
    }

    /// The half-plane where this value is at least `least`.
    pub(super) fn above(self, least: f64) -> Self {
        Self { origin: self.origin - least, ..self }
    }
}

impl Polygon {
    pub(super) fn area(&self) -> f64 {
        let Some(first) = self.corners.first() else { return 0.0 };
        let doubled: f64 = self.corners.windows(2).map(|pair| (pair[0] - first).perp_dot(pair[1] - first)).sum();
        (0.5 * doubled).max(0.0)
    }

    /// The lines of its sides, which it lies to the left of.
    pub(super) fn sides(&self) -> Vec<HalfPlane> {
        let next = |at: usize| self.corners[(at + 1) % self.corners.len()];
        (0..self.corners.len()).map(|at| HalfPlane::through(self.corners[at], next(at))).collect()
    }

    /// The part in a half-plane.
    pub(super) fn clipped(&self, line: &HalfPlane) -> Self {
        let count = self.corners.len();
        let mut corners = Vec::with_capacity(count + 1);
        for at in 0..count {
            let [here, next] = [self.corners[at], self.corners[(at + 1) % count]];
            let [value, ahead] = [line.at(here), line.at(next)];
            if value >= 0.0 {
                corners.push(here);
            }
            if (value > 0.0 && ahead < 0.0) || (value < 0.0 && ahead > 0.0) {
                corners.push(here + (next - here) * (value / (value - ahead)));
            }
        }
        Self { corners }
    }

    /// The part in all half-planes.
    pub(super) fn within(&self, lines: &[HalfPlane]) -> Self {
        lines.iter().fold(self.clone(), |left, line| if left.corners.is_empty() { left } else { left.clipped(line) })
    }

    /// The part outside the common part of some half-planes.
    pub(super) fn without(self, lines: &[HalfPlane]) -> Vec<Self> {
        let least = ROUNDING * self.area();
        if self.within(lines).area() <= least {
            return vec![self];
        }
        let mut outside = Vec::new();
        let mut rest = self;
        for line in lines {
            let beyond = rest.clipped(&line.reversed());
            if beyond.area() > least {
                outside.push(beyond);
            }
            rest = rest.clipped(line);
        }
        outside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Polygon {
        Polygon { corners: [[low, low], [high, low], [high, high], [low, high]].map(DVec2::from_array).to_vec() }
    }

    #[test]
    fn squares_are_cut_as_by_hand() {
        let whole = square(0.0, 2.0);
        assert_eq!(whole.area(), 4.0);
        assert_eq!(whole.within(&square(1.0, 3.0).sides()).area(), 1.0);
        assert_eq!(whole.within(&square(2.0, 3.0).sides()).area(), 0.0, "they touch at a corner");
        let slanted = HalfPlane::through(DVec2::new(0.0, 1.0), DVec2::new(1.0, 2.0));
        assert!((whole.clipped(&slanted).area() - 0.5).abs() < 1e-15);
        assert!((whole.clipped(&slanted.reversed()).area() - 3.5).abs() < 1e-15);
    }

    #[test]
    fn a_hole_leaves_its_frame() {
        let frame = square(0.0, 3.0).without(&square(1.0, 2.0).sides());
        assert_eq!(frame.len(), 4);
        assert!((frame.iter().map(Polygon::area).sum::<f64>() - 8.0).abs() < 1e-14);
        assert!(frame.iter().all(|part| part.within(&square(1.0, 2.0).sides()).area() < 1e-15));
        assert_eq!(square(0.0, 1.0).without(&square(1.0, 2.0).sides()).len(), 1, "what only touches takes nothing");
        assert!(square(1.0, 2.0).without(&square(0.0, 3.0).sides()).is_empty());
    }
}
