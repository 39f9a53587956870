//! Which triangles belong to closed bodies, whose faces that turn away from the Sun cast no shadow of their own.
//!
//! A line from a place outside a closed body to the Sun leaves the body as often as it enters it. A line from a place inside leaves it once more. The faces
//! that turn to the Sun therefore cast the whole shadow.

use std::collections::HashMap;

use glam::DVec3;

/// For each triangle, whether it belongs to a closed body whose corners turn to the left around the outside. Faces that touch at an edge are one body; each
/// edge of a closed one is passed as often in one direction as in the other.
pub(super) fn in_closed_bodies(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<bool> {
    // Vertices at one place are one.
    let mut places = HashMap::new();
    let mut place = |node: u32| {
        let next = places.len() as u32;
        // 0 added: -0 and 0 are one place.
        let bits = (positions[node as usize] + 0.0).to_array().map(f64::to_bits);
        *places.entry(bits).or_insert(next)
    };
    let welded: Vec<[u32; 3]> = triangles.iter().map(|triangle| triangle.map(&mut place)).collect();
    let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]].into_iter().filter(|[from, to]| from != to);
    let mut bodies = Bodies((0..places.len() as u32).collect());
    let mut passes: HashMap<[u32; 2], i32> = HashMap::new();
    for [from, to] in welded.iter().copied().flat_map(edges) {
        bodies.join(from, to);
        *passes.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
    }
    bodies.flatten();
    let mut is_open = vec![false; places.len()];
    for ([from, _], _) in passes.into_iter().filter(|(_, passes)| *passes != 0) {
        is_open[bodies.of(from) as usize] = true;
    }
    let mut volumes = vec![0.0; places.len()];
    for (triangle, welded) in triangles.iter().zip(&welded) {
        let [a, b, c] = triangle.map(|node| positions[node as usize] - positions[triangles[0][0] as usize]);
        volumes[bodies.of(welded[0]) as usize] += a.cross(b).dot(c);
    }
    let is_closed = |[place, ..]: &[u32; 3]| {
        let body = bodies.of(*place) as usize;
        !is_open[body] && volumes[body] > 0.0
    };
    welded.iter().map(is_closed).collect()
}

/// Places that edges join; each names another of its body, and the last of them itself.
struct Bodies(Vec<u32>);

impl Bodies {
    fn of(&self, mut place: u32) -> u32 {
        while self.0[place as usize] != place {
            place = self.0[place as usize];
        }
        place
    }

    /// Lets each place name the last of its body, which is never behind it.
    fn flatten(&mut self) {
        for place in 0..self.0.len() {
            self.0[place] = self.0[self.0[place] as usize];
        }
    }

    fn join(&mut self, one: u32, other: u32) {
        let [one, other] = [self.of(one), self.of(other)];
        let body = one.min(other);
        for place in [one, other] {
            self.0[place as usize] = body;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron whose faces have vertices of their own.
    fn tetrahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let positions = faces.as_flattened().iter().map(|corner| corners[*corner as usize]).collect();
        (positions, (0..4).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect())
    }

    #[test]
    fn only_a_body_without_an_open_edge_and_with_its_normals_outwards_is_closed() {
        let (mut positions, mut triangles) = tetrahedron();
        assert_eq!(in_closed_bodies(&positions, &triangles), [true; 4]);
        assert_eq!(in_closed_bodies(&positions, &triangles[..3]), [false; 3], "a face is missing");
        let turned: Vec<[u32; 3]> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        assert_eq!(in_closed_bodies(&positions, &turned), [false; 4], "normals point inwards");
        let one_turned = [triangles[0], triangles[1], triangles[2], turned[3]];
        assert_eq!(in_closed_bodies(&positions, &one_turned), [false; 4], "one normal points inwards");
        // A sheet beside it stays open, and leaves it closed.
        positions.extend([DVec3::splat(2.0), DVec3::splat(2.0) + DVec3::X, DVec3::splat(2.0) + DVec3::Y]);
        triangles.push([12, 13, 14]);
        assert_eq!(in_closed_bodies(&positions, &triangles), [true, true, true, true, false]);
    }
}
