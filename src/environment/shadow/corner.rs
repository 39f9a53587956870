//! The part of a triangle that belongs to each of its corners, so that the light on a node is of the area that the node stands for.

use glam::DVec3;

/// How a triangle is divided between its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Division {
    /// Each corner has a third, as a value that is linear between nodes has in a mean over pixels.
    Thirds,
    /// A corner has the points that lie nearer to it than to the other two, as the nodes of a network do: its mixed Voronoi area. In an obtuse triangle half the
    /// area belongs to the obtuse corner and a quarter to each of the others (Meyer, Desbrun, Schroeder & Barr, Visualization and Mathematics III, 2003, section 3.3).
    Nearest,
}

impl Division {
    /// Area of a corner's part [m2].
    pub(crate) fn area(self, triangle: [DVec3; 3], corner: usize) -> f64 {
        match self {
            Self::Thirds => (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).length() / 6.0,
            Self::Nearest => corner_areas(triangle)[corner],
        }
    }

    /// Outline of a corner's part [m]: the corner, the middle of an edge, the place where the parts meet, and the middle of the other edge.
    pub(crate) fn outline(self, triangle: [DVec3; 3], corner: usize) -> [DVec3; 4] {
        let [own, second, third] = [0, 1, 2].map(|k| triangle[(corner + k) % 3]);
        let meet = match self {
            Self::Thirds => (own + second + third) / 3.0,
            Self::Nearest => meeting(triangle),
        };
        [own, 0.5 * (own + second), meet, 0.5 * (own + third)]
    }
}

/// The place where the parts of [`Division::Nearest`] meet: the centre of the circle through the corners, or the middle of the side opposite to an obtuse one [m].
fn meeting(triangle: [DVec3; 3]) -> DVec3 {
    let dots = corner_dots(triangle);
    if let Some(wide) = dots.iter().position(|dot| *dot < 0.0) {
        return 0.5 * (triangle[(wide + 1) % 3] + triangle[(wide + 2) % 3]);
    }
    let weight = |k: usize| dots[k] * triangle[(k + 1) % 3].distance_squared(triangle[(k + 2) % 3]);
    let weights = [0, 1, 2].map(weight);
    let all: f64 = weights.iter().sum();
    // A triangle without area has no such circle.
    if all > 0.0 { (0..3).map(|k| weights[k] / all * triangle[k]).sum() } else { triangle[0] }
}

/// The three corners' shares of a triangle's area [m2], which sum to the area.
pub(crate) fn corner_areas(corners: [DVec3; 3]) -> [f64; 3] {
    let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    if area <= 0.0 {
        return [0.0; 3];
    }
    let dots = corner_dots(corners);
    if dots.iter().any(|dot| *dot < 0.0) {
        return dots.map(|dot| if dot < 0.0 { 0.5 * area } else { 0.25 * area });
    }
    // The cotangent of a corner's angle is its product over two areas.
    [0, 1, 2].map(|corner| {
        let [next, last] = [(corner + 1) % 3, (corner + 2) % 3];
        let [out, back] = [next, last].map(|other| corners[corner].distance_squared(corners[other]));
        (out * dots[last] + back * dots[next]) / (16.0 * area)
    })
}

/// The product of the two edges at each corner [m2], negative at an obtuse one.
pub(crate) fn corner_dots(corners: [DVec3; 3]) -> [f64; 3] {
    [0, 1, 2].map(|corner| {
        let [next, last] = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
        (next - corners[corner]).dot(last - corners[corner])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_share_a_triangle_by_hand() {
        let [a, b] = [DVec3::ZERO, DVec3::X];
        let near = |computed: [f64; 3], expected: [f64; 3]| {
            computed.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-15)
        };
        let third = 0.75_f64.sqrt() / 6.0;
        assert!(near(corner_areas([a, b, DVec3::new(0.5, 0.75_f64.sqrt(), 0.0)]), [third; 3]), "equilateral");
        assert!(near(corner_areas([a, b, DVec3::Y]), [0.25, 0.125, 0.125]), "half a square");
        assert!(near(corner_areas([a, b, DVec3::new(0.5, 0.1, 0.0)]), [0.0125, 0.0125, 0.025]), "obtuse");
        assert_eq!(corner_areas([a, b, 0.5 * b]), [0.0; 3]);
        // Isosceles, base 1 and height 1: the circumcentre is 3/8 above the base, so each end of the base has a triangle of 1/2 x 3/8 / 2 and one of
        // half the side, sqrt(5)/4, times the distance of its middle from the circumcentre, sqrt(5)/8 / 2, over 2: 3/32 + 5/64.
        let found = corner_areas([a, b, DVec3::new(0.5, 1.0, 0.0)]);
        assert!(near(found, [11.0 / 64.0, 11.0 / 64.0, 10.0 / 64.0]), "{found:?}");
    }

    #[test]
    fn an_outline_has_the_area_of_its_part() {
        let [a, b] = [DVec3::ZERO, DVec3::X];
        for top in [DVec3::new(0.5, 0.75, 0.2), DVec3::Y, DVec3::new(0.3, 0.1, 0.0), DVec3::new(-0.4, 0.3, 0.1)] {
            for corner in 0..3 {
                for division in [Division::Thirds, Division::Nearest] {
                    let outline = division.outline([a, b, top], corner);
                    let twice: DVec3 = (0..4).map(|k| outline[k].cross(outline[(k + 1) % 4])).sum();
                    let (found, stated) = (0.5 * twice.length(), division.area([a, b, top], corner));
                    assert!((found - stated).abs() < 1e-15, "{top}, {corner}, {division:?}: {found} {stated}");
                }
            }
        }
    }
}
