//! Lit areas against closed forms, and rays against a search of all triangles.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec2, DVec3};

use super::*;
use crate::environment::shadow::corner::Division;
use crate::environment::{StepLoad, SunSample};

/// A mesh of quadrangles in cells of nodes, each part with nodes of its own.
#[derive(Default)]
struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    nodes: Vec<LitNode>,
    areas: Vec<f64>,
}

impl Mesh {
    /// Adds a quadrangle from a corner along two edges [m], in `cells` each way.
    fn quad(&mut self, corner: DVec3, edges: [DVec3; 2], cells: [u32; 2], (both_sides, joint): (bool, u32)) {
        let first = self.positions.len() as u32;
        let normal = edges[0].cross(edges[1]).normalize();
        for i in 0..=cells[0] {
            for j in 0..=cells[1] {
                let [u, v] = [f64::from(i) / f64::from(cells[0]), f64::from(j) / f64::from(cells[1])];
                let number = self.positions.len() as u32;
                self.nodes.push(LitNode { normal, both_sides, joint, ..LitNode::on_plate(number) });
                self.positions.push(corner + u * edges[0] + v * edges[1]);
                self.areas.push(0.0);
            }
        }
        let at = |i: u32, j: u32| first + i * (cells[1] + 1) + j;
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                for triangle in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = triangle.map(|node| self.positions[node as usize]);
                    triangle.iter().for_each(|node| self.areas[*node as usize] += (q - p).cross(r - p).length() / 6.0);
                    self.triangles.push(triangle);
                }
            }
        }
    }

    /// Adds a closed box between two corners [m].
    fn solid(&mut self, low: DVec3, high: DVec3, cells: u32, how: (bool, u32)) {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * (high - low));
        for (corner, edges) in
            [(low, [y, x]), (low, [x, z]), (low, [z, y]), (high, [-x, -y]), (high, [-z, -x]), (high, [-y, -z])]
        {
            self.quad(corner, edges, [cells; 2], how);
        }
    }

    fn light(&self, spacing: f64) -> LitAreas {
        let joints: std::collections::BTreeSet<u32> = self.nodes.iter().map(|node| node.joint).collect();
        let of_joint = |joint: u32| {
            let own = self.triangles.iter().filter(|triangle| self.nodes[triangle[0] as usize].joint == joint);
            Caster::new(joint, &self.positions, &own.copied().collect::<Vec<_>>())
        };
        let casters = joints.into_iter().map(of_joint).collect();
        let surface = LitSurface {
            positions: self.positions.clone(),
            triangles: self.triangles.clone(),
            casters,
            spacing,
            times: 1,
        };
        let redraw = Redraw { bounds: Vec::new(), angle: 0.0, found_for: None };
        LitAreas::new(Arc::new(surface), self.nodes.clone(), redraw)
    }

    /// Sunlit area of the nodes as the Sun sees it [m2].
    fn lit_area(&self, lit: &[LitArea], sun: DVec3) -> f64 {
        self.areas.iter().zip(lit).map(|(area, lit)| area * lit.vector.dot(sun)).sum()
    }
}

/// A sheet that abuts a box 0.3 m proud of it is lit to its end, on any mesh (NUMERICS 1: 51 K with light at vertices). The box hides a part of the Sun's disc
/// within 1.4 mm: of a strip of width w the share 2/(3 pi) x 0.3 m x 4.65e-3 / w, because 2/(3 pi) is the mean of max(0, x) over the unit disc.
#[test]
fn a_sheet_beside_a_box_is_lit_to_its_end() {
    for cells in [1, 2, 7, 40] {
        let mut mesh = Mesh::default();
        mesh.quad(DVec3::ZERO, [DVec3::X * 4.0, DVec3::Y], [cells, 1], (false, 0));
        let sheet = mesh.positions.len();
        mesh.solid(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(0.0, 2.0, 0.3), 1, (false, 0));
        let lit = mesh.light(0.05).under(DVec3::Z, &[]);
        let penumbra = 2.0 / (3.0 * PI) * 0.3 * SUN_ANGULAR_RADIUS / (2.0 / f64::from(cells));
        let least = lit[..sheet].iter().map(|lit| lit.vector.z).fold(1.0, f64::min);
        assert!((least - 1.0).abs() < penumbra + 0.02, "{cells} cells: {least}");
        // The Sun behind the box by 45 deg: 0.3 m of 4 m are dark.
        let sun = DVec3::new(-1.0, 0.0, 1.0).normalize();
        let lit = mesh.light(0.02).under(sun, &[]);
        let share: f64 = (0..sheet).map(|node| mesh.areas[node] * lit[node].vector.z).sum::<f64>() / 4.0;
        assert!((share - 3.7 / 4.0).abs() < 0.004, "{cells} cells: {share} is lit");
    }
}

/// The lit area of a craft is the area of its silhouette from the Sun.
#[test]
fn the_lit_area_is_the_silhouette() {
    let mut mesh = Mesh::default();
    mesh.solid(DVec3::splat(-0.5), DVec3::splat(0.5), 3, (false, 0));
    mesh.solid(DVec3::new(0.5, -0.2, -0.2), DVec3::new(2.5, 0.2, 0.2), 4, (false, 0));
    mesh.quad(DVec3::new(1.0, -2.0, 0.1), [DVec3::X * 0.8, DVec3::new(0.0, 4.0, 0.7)], [2, 9], (true, 0));
    let light = mesh.light(0.02);
    let mut vertices_apart = 0.0f64;
    for sun in [[0.3, 0.4, 0.8], [-0.9, 0.1, 0.2], [0.2, -0.3, -0.9], [0.05, 0.99, -0.1]] {
        let sun = DVec3::from_array(sun).normalize();
        let lit = mesh.lit_area(&light.under(sun, &[]), sun);
        let silhouette = silhouette(&mesh, sun);
        assert!((lit / silhouette - 1.0).abs() < 4e-3, "{sun}: {lit} m2 of {silhouette} m2");
        // With the light at vertices: a lit vertex lights its whole cell.
        let by_vertices: f64 = (mesh.nodes.iter().zip(&mesh.areas))
            .map(|(node, area)| {
                let cosine = node.normal.dot(sun);
                let side = node.normal * cosine.signum();
                let from = mesh.positions[node.number as usize] + 1e-4 * side;
                let hidden = mesh.triangles.iter().any(|triangle| meets(&mesh, triangle, from, sun));
                if hidden || (cosine < 0.0 && !node.both_sides) { 0.0 } else { area * cosine.abs() }
            })
            .sum();
        vertices_apart = vertices_apart.max((by_vertices / silhouette - 1.0).abs());
    }
    assert!(vertices_apart > 0.02, "vertices would do: {vertices_apart}");
}

/// Area of the projections of all triangles along the Sun, by the centres of a grid [m2].
fn silhouette(mesh: &Mesh, sun: DVec3) -> f64 {
    const STEP: f64 = 0.004;
    let (x, y) = sun.any_orthonormal_pair();
    let side = 1600i32;
    let mut covered = vec![false; (side * side) as usize];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|node| {
            let at = mesh.positions[node as usize];
            DVec2::new(at.dot(x), at.dot(y)) / STEP + 0.5 * f64::from(side)
        });
        let twice = (b - a).perp_dot(c - a);
        let (low, high) = (a.min(b).min(c).floor(), a.max(b).max(c).ceil());
        for row in low.y as i32..=high.y as i32 {
            for column in low.x as i32..=high.x as i32 {
                let at = DVec2::new(f64::from(column), f64::from(row));
                let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).perp_dot(at - *p) * twice >= 0.0);
                covered[(row * side + column) as usize] |= inside;
            }
        }
    }
    covered.iter().filter(|covered| **covered).count() as f64 * STEP * STEP
}

fn meets(mesh: &Mesh, triangle: &[u32; 3], from: DVec3, direction: DVec3) -> bool {
    let [a, b, c] = triangle.map(|node| mesh.positions[node as usize]);
    let normal = (b - a).cross(c - a);
    let distance = normal.dot(a - from) / normal.dot(direction);
    let at = from + distance * direction;
    distance > 0.0 && [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(at - *p).dot(normal) >= 0.0)
}

/// No face of a thin closed slab whose sides both absorb is lit from inside, at any mesh (hot dots of 10 to 27 K before).
#[test]
fn no_light_leaks_into_a_thin_slab() {
    for cells in [1, 5, 16] {
        let mut mesh = Mesh::default();
        mesh.solid(DVec3::ZERO, DVec3::new(4.0, 3.0, 0.05), cells, (true, 0));
        let sun = DVec3::new(0.3, 0.2, 0.9).normalize();
        for (node, lit) in mesh.nodes.iter().zip(mesh.light(0.02).under(sun, &[])) {
            let expected = if node.normal.dot(sun) > 0.0 { node.normal } else { DVec3::ZERO };
            assert!(
                (lit.vector - expected).length() < 1e-12 && lit.front == 1.0,
                "{cells} cells, {}: {lit:?}",
                node.normal
            );
        }
    }
}

/// A sheet of two faces back to back, of which each receives light on both sides, is lit once: on the face that looks to the Sun.
#[test]
fn faces_back_to_back_are_lit_once() {
    for cells in [1, 4] {
        let mut mesh = Mesh::default();
        mesh.quad(DVec3::ZERO, [DVec3::X * 3.0, DVec3::Y * 2.0], [cells; 2], (true, 0));
        let first = mesh.positions.len();
        // Other cells, so that no triangle has the corners of another.
        mesh.quad(DVec3::ZERO, [DVec3::Y * 2.0, DVec3::X * 3.0], [cells + 1; 2], (true, 0));
        for (sun, lit) in [([0.3, 0.2, 0.9], 0..first), ([0.3, 0.2, -0.9], first..mesh.positions.len())] {
            let sun = DVec3::from_array(sun).normalize();
            for (node, area) in mesh.light(0.05).under(sun, &[]).iter().enumerate() {
                let expected = if lit.contains(&node) { mesh.nodes[node].normal } else { DVec3::ZERO };
                assert!((area.vector - expected).length() < 1e-12 && area.front == 1.0, "node {node}: {area:?}");
            }
        }
        // A single face has the light on either side.
        let sun = DVec3::new(0.3, 0.2, -0.9).normalize();
        let mut single = Mesh::default();
        single.quad(DVec3::ZERO, [DVec3::X * 3.0, DVec3::Y * 2.0], [cells; 2], (true, 0));
        assert!(single.light(0.05).under(sun, &[]).iter().all(|lit| lit.vector == DVec3::NEG_Z && lit.front == 0.0));
    }
}

/// The shadow of a disc on a parallel plate has the area of the disc for every direction of the Sun: 2.0106 m2 for 0.8 m.
#[test]
fn a_disc_casts_its_own_area() {
    let mut mesh = Mesh::default();
    mesh.quad(DVec3::new(-2.0, -2.0, 0.0), [DVec3::X * 4.0, DVec3::Y * 4.0], [16; 2], (false, 0));
    let plate = mesh.positions.len();
    let (disc, triangles) = disc_over_plate(256);
    mesh.triangles.extend(triangles[2..].iter().map(|triangle| triangle.map(|node| node + plate as u32 - 4)));
    mesh.positions.extend(&disc[4..]);
    mesh.nodes.extend((plate as u32..mesh.positions.len() as u32).map(LitNode::on_plate));
    let light = mesh.light(0.01);
    for sun in [DVec3::Z, DVec3::new(0.3, -0.1, 1.0), DVec3::new(-0.4, 0.35, 0.9)] {
        let lit = light.under(sun.normalize(), &[]);
        let shaded: f64 = (0..plate).map(|node| mesh.areas[node] * (1.0 - lit[node].vector.z)).sum();
        assert!((shaded / (PI * 0.64) - 1.0).abs() < 0.005, "{sun}: {shaded} m2");
    }
}

/// A screen hides a quarter of a plate of two triangles. The light of the plate's nodes over the areas of their corners is three quarters, whichever quarter is dark and however the triangles are divided.
#[test]
fn a_plate_of_two_triangles_loses_what_a_screen_hides() {
    let mut mixed = 0.0_f64;
    for edges in [[DVec3::X * 2.0, DVec3::Y], [DVec3::X * 2.0, DVec3::new(0.7, 1.0, 0.0)]] {
        for (quarter, division) in (0..4).flat_map(|k| [Division::Thirds, Division::Nearest].map(|of| (k, of))) {
            let mut mesh = Mesh::default();
            mesh.quad(DVec3::ZERO, edges, [1, 1], (false, 0));
            let corner = 0.5 * (f64::from(quarter % 2) * edges[0] + f64::from(quarter / 2) * edges[1]);
            mesh.quad(corner + 0.3 * DVec3::Z, edges.map(|edge| 0.5 * edge), [1, 1], (false, 0));
            mesh.nodes.iter_mut().for_each(|node| node.division = division);
            let lit = mesh.light(0.001).under(DVec3::Z, &[]);
            let sum = |division: Division| {
                let part = |corner: usize| {
                    let triangle = mesh.triangles[corner / 3].map(|node| mesh.positions[node as usize]);
                    division.area(triangle, corner % 3) * lit[mesh.triangles[corner / 3][corner % 3] as usize].vector.z
                };
                (0..6).map(part).sum::<f64>() / 2.0
            };
            assert!((sum(division) - 0.75).abs() < 0.002, "quarter {quarter}, {division:?}: {}", sum(division));
            mixed = mixed.max((sum(Division::Nearest) - 0.75).abs());
        }
    }
    assert!(mixed > 0.05, "light on thirds over other areas must be wrong: {mixed}");
}

/// The penumbra of an edge 2 m above is as wide as the Sun's disc, 18.6 mm, and its profile is the disc's: half a radius inside the edge of the shadow the
/// share of a disc beyond a chord is 0.1955 (Rightarrow: 1/3 - sqrt(3)/(4 pi)).
#[test]
fn a_penumbra_is_as_wide_as_the_sun() {
    let radius = 2.0 * SUN_ANGULAR_RADIUS;
    for (offset, expected) in [(-1.05, 0.0), (-0.5, 1.0 / 3.0 - 3f64.sqrt() / (4.0 * PI)), (0.0, 0.5), (1.05, 1.0)] {
        let mut mesh = Mesh::default();
        // A cell much narrower than the penumbra.
        mesh.quad(DVec3::new(offset * radius - 1e-5, 0.0, 0.0), [DVec3::X * 2e-5, DVec3::Y], [1, 1], (false, 0));
        mesh.quad(DVec3::new(-3.0, -3.0, 2.0), [DVec3::X * 3.0, DVec3::Y * 9.0], [1, 1], (false, 0));
        let light = mesh.light(0.000_001);
        // The cell alone: lines this close over the whole screen would be millions.
        let cell = LitAreas::new(light.surface, mesh.nodes[..4].to_vec(), light.redraw);
        let share = mesh.lit_area(&cell.under(DVec3::Z, &[]), DVec3::Z) / mesh.areas[..4].iter().sum::<f64>();
        assert!((share - expected).abs() < 0.01, "{offset} radii: {share} against {expected}");
    }
}

/// The faces of a prism share nodes at their edges. Each face gets the light of its own normal, not of the mean normal at the edge.
#[test]
fn a_shared_node_has_the_light_of_each_face() {
    let roof = [DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 0.0)];
    let positions: Vec<DVec3> = roof.iter().flat_map(|at| [*at, *at + DVec3::Y]).collect();
    let triangles = vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
    let normals = [DVec3::new(-1.0, 0.0, 1.0).normalize(), DVec3::Z, DVec3::new(1.0, 0.0, 1.0).normalize()];
    let node = |number: u32| LitNode { normal: normals[number as usize / 2], ..LitNode::on_plate(number) };
    let surface = LitSurface { positions, triangles, casters: Vec::new(), spacing: 1.0, times: 1 };
    let redraw = Redraw { bounds: Vec::new(), angle: 0.0, found_for: None };
    let light = LitAreas::new(Arc::new(surface), (0..6).map(node).collect(), redraw);
    assert!(!light.are_flat());
    // The Sun stands in the plane of the left face: only the right one is lit, by the cosine 1.
    let sun = DVec3::new(1.0, 0.0, 1.0).normalize();
    let lit = light.under(sun, &[]);
    // Of the three triangles at an end of the ridge, two are of the right face at one end and one at the other.
    let expected = [0.0, 0.0, 2.0 / 3.0, 1.0 / 3.0, 1.0, 1.0];
    for (node, lit) in lit.iter().enumerate() {
        assert!((lit.vector.dot(sun) - expected[node]).abs() < 1e-12, "node {node}: {lit:?}");
    }
}

/// Casters on a joint shade as if they stood in the file where the joint has put them.
#[test]
fn a_joint_moves_the_shadow() {
    let pose = DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.4), DVec3::new(0.3, 0.1, 0.2));
    let build = |moved: bool, joint: u32| {
        let mut mesh = Mesh::default();
        mesh.quad(DVec3::new(-2.0, -2.0, 0.0), [DVec3::X * 4.0, DVec3::Y * 4.0], [8; 2], (true, 0));
        let own = mesh.positions.len();
        mesh.solid(DVec3::new(-0.5, -0.4, 0.5), DVec3::new(0.5, 0.4, 1.0), 2, (false, joint));
        if moved {
            for node in own..mesh.positions.len() {
                mesh.positions[node] = pose.transform_point3(mesh.positions[node]);
                mesh.nodes[node].normal = pose.matrix3 * mesh.nodes[node].normal;
            }
        }
        mesh
    };
    let sun = DVec3::new(0.2, -0.3, 0.8).normalize();
    let by_joint = build(false, 1).light(0.05).under(sun, &[DAffine3::IDENTITY, pose]);
    let in_file = build(true, 0).light(0.05).under(sun, &[]);
    let still = build(false, 1).light(0.05).under(sun, &[]);
    let apart = |a: &[LitArea], b: &[LitArea], turn: bool| {
        let pairs = a.iter().zip(b).enumerate();
        let differences = pairs.map(|(node, (a, b))| {
            let vector = if turn && node >= 81 { pose.matrix3 * a.vector } else { a.vector };
            (vector - b.vector).length()
        });
        differences.fold(0.0, f64::max)
    };
    // A ray at an edge may fall on either side of it by rounding.
    assert!(apart(&by_joint, &in_file, true) < 0.06, "{}", apart(&by_joint, &in_file, true));
    assert!(apart(&still, &in_file, true) > 0.3, "the joint has moved");
}

/// A plate of 4 m by 4 m at z = 0 and, above it, a disc of `segments` triangles at height 2 with a radius of 0.8 m.
fn disc_over_plate(segments: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let mut positions = vec![corner(-2.0, -2.0), corner(2.0, -2.0), corner(2.0, 2.0), corner(-2.0, 2.0)];
    let mut triangles = vec![[0, 1, 2], [0, 2, 3]];
    positions.push(DVec3::new(0.0, 0.0, 2.0));
    for i in 0..segments {
        let (sine, cosine) = (2.0 * PI * f64::from(i) / f64::from(segments)).sin_cos();
        positions.push(DVec3::new(0.8 * cosine, 0.8 * sine, 2.0));
        triangles.push([4, 5 + i, 5 + (i + 1) % segments]);
    }
    (positions, triangles)
}

#[test]
fn a_tree_finds_what_a_search_of_all_triangles_finds() {
    // A cloud of triangles from a fixed sequence.
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64 - 0.5
    };
    let mut point = |size: f64| DVec3::new(random(), random(), random()) * size;
    let mut positions = Vec::new();
    for _ in 0..300 {
        let at = point(10.0);
        positions.extend([at + point(1.5), at + point(1.5), at + point(1.5)]);
    }
    let triangles: Vec<[u32; 3]> = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let occluders = Occluders::new(&positions, &triangles);
    let mut hidden = 0;
    for _ in 0..2000 {
        let (from, direction) = (point(12.0), point(1.0).normalize());
        let nearest = (0..).zip(&triangles).filter_map(|(number, triangle)| {
            let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
            let normal = (b - a).cross(c - a);
            let distance = normal.dot(a - from) / normal.dot(direction);
            let at = from + distance * direction;
            let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(at - *p).dot(normal) >= 0.0);
            (distance > 0.0 && inside).then_some((distance, number))
        });
        let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0));
        let first = occluders.first(from, direction);
        assert_eq!(first.map(|hit| hit.triangle), nearest.map(|nearest| nearest.1));
        assert!(first.is_none_or(|hit| nearest.is_some_and(|nearest| (hit.distance - nearest.0).abs() < 1e-9)));
        assert_eq!(occluders.is_hidden(from, direction), nearest.is_some());
        hidden += usize::from(nearest.is_some());
    }
    assert!((200..1800).contains(&hidden), "{hidden} of 2000 rays are hidden");
}

#[test]
fn a_tree_has_as_many_boxes_wherever_its_triangles_are() {
    let mut turned = 1.0;
    for count in [1, 4, 5, 8, 9, 1003] {
        for spread in [0.0, 1.0, 1e3] {
            let mut positions = Vec::new();
            for number in 0..count {
                turned = (turned * 1.618_033_988_7) % 7.0;
                let at = DVec3::new(turned, f64::from(number % 13), (3.0 * turned) % 1.7) * spread;
                positions.extend([at, at + DVec3::X, at + DVec3::Y]);
            }
            let triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let tree = Occluders::new(&positions, &triangles).tree();
            assert_eq!(tree.nodes.len(), tree_boxes(count as usize), "{count} triangles over {spread} m");
            let mut order = tree.order.clone();
            order.sort_unstable();
            assert!(order.iter().copied().eq(0..count), "each triangle once");
        }
    }
}

#[test]
fn nothing_is_found_anew_at_an_angle_of_0_unless_something_moves() {
    let load = |sun: DVec3, pose: DAffine3| StepLoad {
        start: 0.0,
        sun: [SunSample { direction: sun, flux: 1361.0 }].into_iter().collect(),
        planet: None,
        albedo: None,
        background_temperature: 0.0,
        joints: vec![DAffine3::IDENTITY, pose],
    };
    let turned = |angle: f64| DAffine3::from_quat(DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle));
    let box_of = |joint| (joint, [DVec3::new(-1.0, -2.0, 3.0), DVec3::new(5.0, 1.0, 4.0)]);
    let redraw = Redraw { bounds: vec![box_of(0), box_of(1)], angle: 0.0, found_for: None };
    for i in 1..200 {
        let sun = DQuat::from_rotation_x(0.1 * f64::from(i)) * DVec3::new(0.3, 0.4, 0.9).normalize();
        let pose = turned(0.03 * f64::from(i));
        let mut redraw = redraw.clone();
        assert!(redraw.due(&load(sun, pose)).is_some(), "the first time");
        assert!(redraw.due(&load(sun, pose)).is_none(), "{i}: nothing has moved");
        // A change in the last digit of a direction and of a pose.
        let rounded = DQuat::from_axis_angle(DVec3::Y, 3e-16) * sun;
        assert!(redraw.due(&load(rounded, pose)).is_none(), "{i}: rounding is no motion");
        assert!(redraw.due(&load(sun, turned(0.03 * f64::from(i) + 1e-15))).is_none(), "{i}: nor of a joint");
        assert!(redraw.due(&load(DQuat::from_axis_angle(DVec3::Y, 1e-7) * sun, pose)).is_some(), "{i}: the Sun moves");
        assert!(redraw.due(&load(sun, pose)).is_some());
        assert!(redraw.due(&load(sun, turned(0.03 * f64::from(i) + 1e-7))).is_some(), "{i}: a joint moves");
    }
}

/// The boxes of a tree that is fitted to moved triangles are around them, and the order of the triangles stays.
#[test]
fn a_fitted_tree_is_around_its_triangles() {
    let (mut positions, triangles) = disc_over_plate(64);
    let still = Occluders::new(&positions, &triangles).tree();
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
    for position in positions.iter_mut().skip(4) {
        *position = turn * *position + DVec3::new(0.5, -0.2, 0.4);
    }
    let moved = Occluders::new(&positions, &triangles);
    let mut fitted = still.clone();
    fitted.refit(&moved.boxes_of_triangles());
    assert_eq!(fitted.order, still.order);
    assert_eq!([fitted.nodes[0].low, fitted.nodes[0].high], moved.bounds);
    let boxes = moved.boxes_of_triangles();
    for node in fitted.nodes.iter().filter(|node| node.count > 0) {
        for number in &fitted.order[node.first as usize..(node.first + node.count) as usize] {
            let [low, high] = boxes[*number as usize];
            assert!(node.low.cmple(low).all() && node.high.cmpge(high).all());
        }
    }
}
