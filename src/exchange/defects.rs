//! Finds defects of a surface that mislead rays: open edges, edges of more than two triangles, faces that coincide or overlap, bodies with inward normals, and
//! nodes without area.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::overlaps::lie_in_others;
use super::patches::PatchSurface;
use crate::thermal::material::{Material, Sides};
use crate::thermal::network::connection::root;

/// Counts of the defects. None of them is mended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Defects {
    /// Edges of a single triangle of a material that exchanges heat outside only. Rays see its inner face through the hole.
    pub open_edges: usize,
    /// Edges of more than two triangles of such materials.
    pub crowded_edges: usize,
    /// Triangles that lie exactly on another, whichever way they face. Rays between the two meet nothing.
    pub coincident: usize,
    /// Triangles that lie in the face of another surface, but not exactly on one of its triangles, and are seen from the same side.
    pub overlapping: usize,
    /// Closed bodies of such materials whose normals look inwards.
    pub inward: usize,
    /// Triangles without area. No ray starts there and none ends there.
    pub without_area: usize,
}

impl Defects {
    /// The defects of a surface.
    pub fn of(surface: &PatchSurface, materials: &[Material]) -> Self {
        let mut defects = Self::default();
        let welded = welded(surface);
        let mut triangles = Vec::new();
        for (number, corners) in surface.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|node| welded[node as usize]);
            if a == b || b == c || c == a || surface.area_of(number) == 0.0 {
                defects.without_area += 1;
                continue;
            }
            let material = &materials[surface.materials[corners[0] as usize] as usize];
            triangles.push(([a, b, c], matches!(material.sides, Sides::Outside)));
        }
        let mut faces: HashMap<[u32; 3], usize> = HashMap::new();
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        for (corners, single) in &triangles {
            let mut face = *corners;
            face.sort_unstable();
            *faces.entry(face).or_default() += 1;
            for k in (0..3).filter(|_| *single) {
                let [from, to] = [corners[k], corners[(k + 1) % 3]];
                *edges.entry([from.min(to), from.max(to)]).or_default() += 1;
            }
        }
        defects.coincident = faces.values().map(|count| count - 1).sum();
        defects.open_edges = edges.values().filter(|count| **count == 1).count();
        defects.crowded_edges = edges.values().filter(|count| **count > 2).count();
        let face = |triangle: usize| {
            let mut face = surface.triangles[triangle].map(|node| welded[node as usize]);
            face.sort_unstable();
            face
        };
        let single = |triangle: usize| {
            let node = surface.triangles[triangle][0] as usize;
            matches!(materials[surface.materials[node] as usize].sides, Sides::Outside)
        };
        let lie = lie_in_others(surface, single, |one, other| face(one) == face(other));
        defects.overlapping = lie.into_iter().filter(|lies| *lies).count();
        defects.inward = inward(surface, &welded, &triangles, &edges);
        defects
    }

    /// Messages for the user, one for each kind of defect that occurs.
    pub fn warnings(&self) -> Vec<String> {
        let told = [
            (
                self.open_edges,
                ["open edge", "open edges"],
                "on skins that exchange heat outside only; rays that pass there meet inner faces, and their light comes back to its own patch",
            ),
            (
                self.crowded_edges,
                ["edge", "edges"],
                "of more than two triangles, on skins that exchange heat outside only; what is inside and what outside is not clear there",
            ),
            (
                self.coincident,
                ["triangle", "triangles"],
                "exactly on another; the two see past each other, and rays that start on one may meet the inner face of the other",
            ),
            (self.overlapping, ["triangle", "triangles"], OVERLAPPING),
            (
                self.inward,
                ["closed body", "closed bodies"],
                "with normals that look inwards; heat goes to what is inside, and none to space",
            ),
            (self.without_area, ["triangle", "triangles"], "without area; no ray starts or ends there"),
        ];
        in_words("exchange", &told)
    }

    /// Messages for the user about a surface that casts shadows, one for each kind of defect that occurs.
    pub(crate) fn of_shadows(&self) -> Vec<String> {
        let told = [
            (
                self.open_edges,
                ["open edge", "open edges"],
                "on skins that take light outside only; sunlight that passes there meets inner faces, which take none",
            ),
            (
                self.coincident,
                ["triangle", "triangles"],
                "exactly on another; which of the two hides the other is not clear",
            ),
            (self.overlapping, ["triangle", "triangles"], OVERLAPPING),
            (
                self.inward,
                ["closed body", "closed bodies"],
                "with normals that look inwards; the side that the Sun meets takes no light",
            ),
        ];
        in_words("shadows", &told)
    }
}

const OVERLAPPING: &str = "in the face of another surface; rays start behind one of the two, and images show now one, now the other. Move one of them by some millimetres";

fn in_words(section: &str, told: &[(usize, [&str; 2], &str)]) -> Vec<String> {
    let some = told.iter().filter(|(count, ..)| *count > 0);
    let one = |(count, [one, several], what): &(usize, [&str; 2], &str)| {
        format!("[{section}]: {count} {} {what}.", if *count == 1 { one } else { several })
    };
    some.map(one).collect()
}

/// Number of the place of each node.
fn welded(surface: &PatchSurface) -> Vec<u32> {
    let mut places: HashMap<[u32; 3], u32> = HashMap::new();
    let place = |position: &DVec3| {
        // -0 and 0 are one place.
        let key = (position.as_vec3() + Vec3::ZERO).to_array().map(f32::to_bits);
        let next = places.len() as u32;
        *places.entry(key).or_insert(next)
    };
    surface.positions.iter().map(place).collect()
}

/// Closed bodies of one-sided triangles with a negative volume.
fn inward(
    surface: &PatchSurface,
    welded: &[u32],
    triangles: &[([u32; 3], bool)],
    edges: &HashMap<[u32; 2], usize>,
) -> usize {
    let count = welded.iter().max().map_or(0, |most| *most as usize + 1);
    let mut at = vec![DVec3::ZERO; count];
    welded.iter().zip(&surface.positions).for_each(|(place, position)| at[*place as usize] = *position);
    let mut parent: Vec<u32> = (0..count as u32).collect();
    for ([a, b, c], _) in triangles.iter().filter(|(_, single)| *single) {
        for other in [b, c] {
            let (one, other) = (root(&mut parent, *a), root(&mut parent, *other));
            parent[one as usize] = other;
        }
    }
    // Volume of a body, and whether every edge has two triangles.
    let mut bodies: HashMap<u32, (f64, bool)> = HashMap::new();
    for ([a, b, c], _) in triangles.iter().filter(|(_, single)| *single) {
        let body = bodies.entry(root(&mut parent, *a)).or_insert((0.0, true));
        let [p, q, r] = [a, b, c].map(|place| at[*place as usize]);
        body.0 += p.dot(q.cross(r)) / 6.0;
        body.1 &=
            [[a, b], [b, c], [c, a]].iter().all(|[from, to]| edges.get(&[**from.min(to), **from.max(to)]) == Some(&2));
    }
    bodies.values().filter(|(volume, closed)| *closed && *volume < 0.0).count()
}
