//! Intrinsic Delaunay triangulation: a surface given by its edge lengths, and the edge flips that make it Delaunay.
//!
//! Flips do not change the surface: an edge may bend over a crease, but lengths and areas stay (Fisher, Springborn, Schroeder & Bobenko, Computing 81,
//! 2007). On a Delaunay triangulation every inner cotangent weight is positive.

use glam::DVec3;
use rayon::prelude::*;

/// No half-edge.
pub(super) const NO_NODE: u32 = u32::MAX;

/// Tolerance of the Delaunay condition, in units of the edge's square. A square has two equal diagonals.
const BALANCED: f64 = 1e-10;

/// Flips per half-edge at which flipping ends, because rounding prevents convergence. Good meshes need less than one.
const MOST_FLIPS: usize = 50;

/// Triangle `f` has half-edges `3 f`, `3 f + 1`, `3 f + 2`. Two triangles may share more than one edge.
#[derive(Debug, Clone)]
pub(super) struct Intrinsic {
    /// Node where a half-edge starts.
    pub(super) tail: Vec<u32>,
    /// Length [m].
    pub(super) length: Vec<f64>,
    /// The opposite half-edge (twin), or `NO_NODE`.
    twin: Vec<u32>,
    /// Number of edges that are not flipped because more than two triangles meet, or two with opposite winding.
    pub(super) non_manifold: usize,
    pub(super) flips: usize,
}

fn ordered(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

fn ends_of(tail: &[u32], half_edge: u32) -> [u32; 2] {
    ordered(tail[half_edge as usize], tail[next(half_edge as usize)])
}

/// Makes twins of two half-edges with opposite directions.
fn join(tail: &[u32], twin: &mut [u32], sides: &[u32]) -> bool {
    let [a, b] = sides else { return false };
    let [a, b] = [*a as usize, *b as usize];
    if tail[a] == tail[b] {
        return false;
    }
    twin[a] = b as u32;
    twin[b] = a as u32;
    true
}

pub(super) fn next(half_edge: usize) -> usize {
    if half_edge % 3 == 2 { half_edge - 2 } else { half_edge + 1 }
}

pub(super) fn previous(half_edge: usize) -> usize {
    if half_edge.is_multiple_of(3) { half_edge + 2 } else { half_edge - 1 }
}

impl Intrinsic {
    /// The surface of `triangles` of drawn vertices. `node` is the node of each vertex. The three nodes of a triangle must differ.
    pub(super) fn new(triangles: &[[u32; 3]], positions: &[DVec3], node: impl Fn(u32) -> u32 + Sync) -> Self {
        let count = 3 * triangles.len();
        let tail: Vec<u32> = (0..count).into_par_iter().map(|at| node(triangles[at / 3][at % 3])).collect();
        let length = |at: usize| {
            let corner = |corner: usize| positions[triangles[at / 3][corner % 3] as usize];
            corner(at % 3).distance(corner(at % 3 + 1))
        };
        let length = (0..count).into_par_iter().map(length).collect();
        let mut surface = Self { twin: vec![NO_NODE; tail.len()], tail, length, non_manifold: 0, flips: 0 };
        surface.glue(triangles);
        surface
    }

    /// Finds twins, first between triangles that share drawn vertices, then between triangles that share nodes. The two faces of a sheet then stay
    /// separate.
    fn glue(&mut self, triangles: &[[u32; 3]]) {
        let drawn = |half_edge: u32| {
            let (triangle, corner) = (&triangles[half_edge as usize / 3], half_edge as usize % 3);
            ordered(triangle[corner], triangle[(corner + 1) % 3])
        };
        let (starts, mut sides) = self.by_lower_node();
        let Self { tail, twin, non_manifold, .. } = self;
        let ends = |half_edge: u32| ends_of(tail, half_edge);
        let mut left = Vec::new();
        for range in starts.windows(2) {
            let sides = &mut sides[range[0] as usize..range[1] as usize];
            sides.sort_unstable_by_key(|half_edge| (ends(*half_edge), drawn(*half_edge), *half_edge));
            for edge in sides.chunk_by(|a, b| ends(*a) == ends(*b)) {
                left.clear();
                for drawn in edge.chunk_by(|a, b| drawn(*a) == drawn(*b)) {
                    if !join(tail, twin, drawn) {
                        left.extend_from_slice(drawn);
                    }
                }
                if !join(tail, twin, &left) && left.len() > 1 {
                    *non_manifold += 1;
                }
            }
        }
    }

    /// Half-edges sorted by the lower of their nodes (counting sort), and the start of each node's half-edges.
    pub(super) fn by_lower_node(&self) -> (Vec<u32>, Vec<u32>) {
        let lower = |half_edge: usize| self.ends(half_edge as u32)[0] as usize;
        let nodes = self.tail.iter().max().map_or(0, |last| *last as usize + 1);
        let mut starts = vec![0u32; nodes + 2];
        for half_edge in 0..self.tail.len() {
            starts[lower(half_edge) + 2] += 1;
        }
        for node in 2..starts.len() {
            starts[node] += starts[node - 1];
        }
        // The counter of a node ends at the start of the next node.
        let mut sorted = vec![0u32; self.tail.len()];
        for half_edge in 0..self.tail.len() {
            let next = &mut starts[lower(half_edge) + 1];
            sorted[*next as usize] = half_edge as u32;
            *next += 1;
        }
        starts.pop();
        (starts, sorted)
    }

    /// The nodes of a half-edge, the lower first.
    pub(super) fn ends(&self, half_edge: u32) -> [u32; 2] {
        ends_of(&self.tail, half_edge)
    }

    pub(super) fn faces(&self) -> usize {
        self.tail.len() / 3
    }

    /// Area of a triangle [m2] by Kahan's form of Heron's formula, which is exact for needles. 0 where the lengths form no triangle.
    pub(super) fn area(&self, face: usize) -> f64 {
        let mut sides = [self.length[3 * face], self.length[3 * face + 1], self.length[3 * face + 2]];
        sides.sort_unstable_by(f64::total_cmp);
        let [c, b, a] = sides;
        let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
        0.25 * product.max(0.0).sqrt()
    }

    /// a^2 + b^2 - c^2 for the half-edge c: the cotangent of its opposite angle times four areas [m2].
    pub(super) fn opening(&self, half_edge: usize) -> f64 {
        let [a, b, c] = [next(half_edge), previous(half_edge), half_edge].map(|side| self.length[side]);
        // The difference of squares is a product, because a and c nearly agree in a needle.
        if a > b { b * b + (a - c) * (a + c) } else { a * a + (b - c) * (b + c) }
    }

    /// Flips edges until the two angles opposite to each edge sum to at most 180 deg.
    pub(super) fn make_delaunay(&mut self) {
        let mut waiting: Vec<u32> = (0..self.tail.len() as u32).filter(|h| self.twin[*h as usize] != NO_NODE).collect();
        waiting.retain(|h| *h < self.twin[*h as usize]);
        let most = self.tail.len() * MOST_FLIPS;
        while let Some(half_edge) = waiting.pop() {
            let half_edge = half_edge as usize;
            if self.flips < most && self.is_bad(half_edge) {
                let outer = self.flip(half_edge);
                self.flips += 1;
                waiting.extend(outer.into_iter().filter(|h| self.twin[*h as usize] != NO_NODE));
            }
        }
    }

    /// Frees the memory that only flips need.
    pub(super) fn forget_twins(&mut self) {
        self.twin = Vec::new();
    }

    /// Whether an edge has a negative cotangent sum and can be flipped.
    fn is_bad(&self, half_edge: usize) -> bool {
        let twin = self.twin[half_edge] as usize;
        if self.twin[half_edge] == NO_NODE || half_edge / 3 == twin / 3 {
            return false;
        }
        let areas = [self.area(half_edge / 3), self.area(twin / 3)];
        let sum = self.opening(half_edge) * areas[1] + self.opening(twin) * areas[0];
        sum < -BALANCED * self.length[half_edge] * self.length[half_edge] * (areas[0] + areas[1])
    }

    /// Flips the common edge of two triangles a-b-c and b-a-d to d-c. Returns the four outer half-edges.
    fn flip(&mut self, half_edge: usize) -> [u32; 4] {
        let twin = self.twin[half_edge] as usize;
        let (first, second) = (half_edge / 3, twin / 3);
        let base = self.length[half_edge];
        // Both triangles in a plane, with the edge along x: a at 0, b at `base`, c above and d below.
        let apex = |length_to_a: f64, length_to_b: f64| {
            0.5 * (base + (length_to_a - length_to_b) * (length_to_a + length_to_b) / base)
        };
        let c = apex(self.length[previous(half_edge)], self.length[next(half_edge)]);
        let d = apex(self.length[next(twin)], self.length[previous(twin)]);
        let height = 2.0 * (self.area(first) + self.area(second)) / base;
        let length = (c - d).hypot(height);

        let moved = [previous(half_edge), next(twin), previous(twin), next(half_edge)];
        let places = [3 * first + 1, 3 * first + 2, 3 * second + 1, 3 * second + 2];
        let old = moved.map(|h| (self.tail[h], self.length[h], self.twin[h]));
        for ((tail, length, twin), place) in old.into_iter().zip(places) {
            self.tail[place] = tail;
            self.length[place] = length;
            // A triangle may be joined to itself, or twice to its neighbour.
            let twin = moved.iter().position(|h| *h as u32 == twin).map_or(twin, |moved| places[moved] as u32);
            self.twin[place] = twin;
            if twin != NO_NODE {
                self.twin[twin as usize] = place as u32;
            }
        }
        let (c, d) = (old[0].0, old[2].0);
        let (down, up) = (3 * first, 3 * second);
        (self.tail[down], self.tail[up]) = (d, c);
        (self.length[down], self.length[up]) = (length, length);
        (self.twin[down], self.twin[up]) = (up as u32, down as u32);
        places.map(|place| place as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles on the edge 0-1, with apexes at the given heights above and below its middle.
    fn kite(height: f64) -> Intrinsic {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0), DVec3::new(0.5, -height, 0.0)];
        Intrinsic::new(&[[0, 1, 2], [1, 0, 3]], &positions, |vertex| vertex)
    }

    #[test]
    fn a_flat_kite_is_flipped_and_keeps_its_area() {
        let mut flat = kite(0.1);
        let area = |surface: &Intrinsic| (0..surface.faces()).map(|face| surface.area(face)).sum::<f64>();
        let before = area(&flat);
        flat.make_delaunay();
        assert_eq!(flat.flips, 1);
        assert!((area(&flat) - before).abs() < 1e-15 && (flat.length[0] - 0.2).abs() < 1e-15);
        assert_eq!([flat.tail[0], flat.tail[1], flat.tail[2]], [3, 2, 0]);
        let mut steep = kite(0.6);
        steep.make_delaunay();
        assert_eq!(steep.flips, 0, "and a steep one is left alone");
    }

    #[test]
    fn a_cap_of_no_area_gives_its_corner_to_the_neighbour() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.5, -0.7, 0.0)];
        let mut surface = Intrinsic::new(&[[0, 1, 2], [1, 0, 3]], &positions, |vertex| vertex);
        surface.make_delaunay();
        assert_eq!(surface.flips, 1);
        assert!((0..2).all(|face| (surface.area(face) - 0.175).abs() < 1e-15));
    }

    #[test]
    fn the_faces_of_a_sheet_are_glued_apart() {
        // Vertices 4 to 7 are the back of 0 to 3.
        let positions: Vec<DVec3> =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0)).repeat(2);
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
        let sheet = Intrinsic::new(&triangles, &positions, |vertex| vertex % 4);
        assert_eq!(sheet.non_manifold, 0);
        assert!((0..12).all(|half_edge| sheet.twin[half_edge] != NO_NODE));
        assert_eq!(sheet.twin[2] / 3, 1, "the diagonal of the front belongs to the front");
        let fan = Intrinsic::new(
            &[[0, 1, 2], [1, 0, 3], [0, 1, 4]],
            &[DVec3::ZERO, DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z],
            |v| v,
        );
        assert_eq!(fan.non_manifold, 1);
        assert!(fan.twin.iter().all(|twin| *twin == NO_NODE));
    }
}
