//! Thin triangles of flat faces: the border is split first, and few vertices lie inside.

use isotherm::internals::Model;
use serde_json::json;

use super::density::load;
use super::make::Maker;
use super::subdivision::{longest_edge, open_edges};
use super::{check_promises, volume};

/// A model of one part for each list of triangles.
fn parts(of: &[Vec<[f32; 3]>]) -> Model {
    parts_with(of, |_| None)
}

/// The same with the normals of places, where they have one.
fn parts_with(of: &[Vec<[f32; 3]>], normal: impl Fn([f32; 3]) -> Option<[f32; 3]>) -> Model {
    let mut maker = Maker::new();
    for corners in of {
        let positions = maker.floats(corners);
        let normals: Vec<[f32; 3]> = corners.iter().filter_map(|corner| normal(*corner)).collect();
        let attributes = match normals.len() == corners.len() {
            true => json!({"POSITION": positions, "NORMAL": maker.floats(&normals)}),
            false => json!({"POSITION": positions}),
        };
        maker.primitive(json!({"attributes": attributes}));
    }
    let node = |mesh: usize| json!({"name": format!("part_{mesh}"), "mesh": mesh, "rotation": [0.1, 0.7, 0.1, 0.7]});
    maker.json["nodes"] = (0..of.len()).map(node).collect();
    maker.json["scenes"][0]["nodes"] = (0..of.len()).collect();
    load(&maker)
}

/// A rectangle in the plane z = 0, as two triangles.
fn rectangle([width, height]: [f32; 2]) -> Vec<[f32; 3]> {
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [width, 0.0, 0.0], [width, height, 0.0], [0.0, height, 0.0]];
    vec![a, b, c, a, c, d]
}

/// A flat prism, closed, whose lids are ellipses of 6 x 2 m cut into a fan from a corner.
fn prism(facets: usize) -> Vec<[f32; 3]> {
    let at = |facet: usize, z: f32| {
        let angle = std::f64::consts::TAU * (facet % facets) as f64 / facets as f64;
        [3.0 * angle.cos() as f32, angle.sin() as f32, z]
    };
    let mut corners = Vec::new();
    for facet in 0..facets {
        let [a, b, c, d] = [at(facet, 0.0), at(facet + 1, 0.0), at(facet + 1, 0.05), at(facet, 0.05)];
        corners.extend([a, b, c, a, c, d]);
    }
    for facet in 1..facets - 1 {
        corners.extend([at(0, 0.0), at(facet + 1, 0.0), at(facet, 0.0)]);
        corners.extend([at(0, 0.05), at(facet, 0.05), at(facet + 1, 0.05)]);
    }
    corners
}

fn split(model: Model, edges: &[f64]) -> Model {
    let after = model.subdivide_parts(edges, usize::MAX, &mut |_| {}).unwrap();
    check_promises(&after);
    after
}

/// A strip of 8 m by 0.1 m has 65 places on each long side at 0.2 m, because 8 m is halved six times to 0.125 m, and none inside: the diagonal of a cell has 0.16 m.
#[test]
fn a_strip_has_no_vertices_inside() {
    let strip = split(parts(&[rectangle([8.0, 0.1])]), &[0.2]);
    assert_eq!((strip.positions.len(), strip.triangles.len()), (130, 128));
    assert!(longest_edge(&strip) <= 0.2);
    // A square is halved at once, into 32 x 32 cells.
    assert_eq!(split(parts(&[rectangle([4.0, 4.0])]), &[0.2]).positions.len(), 33 * 33);
}

/// Equilateral triangles with edges of 0.1 m have 2 / sqrt(3) / 0.01 vertices a square metre. Halving keeps the shape of a fan's triangles, and made 5.9 times as many of the first. Here they are 2.4. They would be 3.6 if pieces of a thin triangle were halved as soon as they are wide.
#[test]
fn a_fan_has_few_vertices_inside() {
    for facets in [8, 12, 31] {
        let before = parts(&[prism(facets)]);
        let after = split(before.clone(), &[0.1]);
        let fewest = before.area() * 2.0 / 3f64.sqrt() / 0.01;
        let ratio = after.positions.len() as f64 / fewest;
        println!("{facets} facets: {} vertices, {ratio:.2} of the fewest", after.positions.len());
        assert!(ratio > 1.0 && ratio < 3.0, "{facets}: {ratio}");
        assert!(longest_edge(&after) <= 0.1);
        assert_eq!(open_edges(&after), 0);
        assert!((after.area() / before.area() - 1.0).abs() < 1e-9);
        assert!((volume(&after) / volume(&before) - 1.0).abs() < 1e-9);
    }
}

/// A wall stands on the diagonal of a strip. Nodes of both conduct where they share places, so the diagonal stays an edge of both.
#[test]
fn an_edge_with_three_triangles_stays() {
    let [a, c] = [[0.0, 0.0, 0.0], [8.0, 0.1, 0.0]];
    let wall = vec![a, c, [8.0, 0.1, 1.0], a, [8.0, 0.1, 1.0], [0.0, 0.0, 1.0]];
    let after = split(parts(&[rectangle([8.0, 0.1]), wall]), &[0.2, 0.2]);
    let bits = |vertex: u32| (after.positions[vertex as usize] + 0.0).to_array().map(f64::to_bits);
    let edges = |part: u32| -> Vec<_> {
        let own = after.triangles.iter().filter(|triangle| after.vertex_part[triangle[0] as usize] == part);
        let edges = own.flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        edges.map(|[a, b]| (bits(a).min(bits(b)), bits(a).max(bits(b)))).collect()
    };
    let [strip, wall] = [0, 1].map(edges);
    let shared = wall.iter().filter(|edge| strip.contains(edge)).count();
    assert_eq!(shared, 64, "the foot of the wall, 8 m in 64 pieces");
}

/// A tube of facets that are as flat as rounding allows beside a craft of 100 m. The part far away sets that size.
#[test]
fn a_round_body_stays_round() {
    let facets = 2000;
    let at = |facet: usize, z: f32| {
        let angle = std::f64::consts::TAU * (facet % facets) as f64 / facets as f64;
        [0.16 * angle.cos() as f32, 0.16 * angle.sin() as f32, z]
    };
    let facet = |facet: usize| {
        let [a, b, c, d] = [at(facet, 0.0), at(facet + 1, 0.0), at(facet + 1, 5.0), at(facet, 5.0)];
        [a, b, c, a, c, d]
    };
    let far = vec![[100.0, 0.0, 0.0], [100.0, 1.0, 0.0], [100.0, 0.0, 1.0]];
    let outwards = |[x, y, _]: [f32; 3]| (x.hypot(y) < 1.0).then(|| [x / x.hypot(y), y / x.hypot(y), 0.0]);
    let before = parts_with(&[(0..facets).flat_map(facet).collect(), far], outwards);
    assert_eq!(before.positions.len(), 2 * facets + 3, "facets share their vertices");
    let after = split(before.clone(), &[0.5, f64::INFINITY]);
    let change = after.area() / before.area() - 1.0;
    // 1e-3 where flips cross facets that were not compared.
    assert!(change.abs() < 1e-9, "{change:e}");
}

/// A ring of 64 thin quadrilaterals whose inner circle is 0.01 m wide: short borders of the file ask for nothing, and a part far away changes nothing.
#[test]
fn short_borders_of_the_file_ask_for_nothing() {
    let at = |segment: usize, radius: f64| {
        let angle = std::f64::consts::TAU * (segment % 64) as f64 / 64.0;
        [(radius * angle.cos()) as f32, (radius * angle.sin()) as f32, 0.0]
    };
    let segment = |segment: usize| {
        let [a, b, c, d] = [at(segment, 0.01), at(segment, 0.4), at(segment + 1, 0.4), at(segment + 1, 0.01)];
        [a, b, c, a, c, d]
    };
    let ring: Vec<[f32; 3]> = (0..64).flat_map(segment).collect();
    let alone = split(parts(std::slice::from_ref(&ring)), &[0.3]);
    // A circle of vertices on each rim and one between them.
    assert_eq!(alone.positions.len(), 3 * 64);
    let far = vec![[100.0, 0.0, 0.0], [100.0, 9.0, 0.0], [100.0, 0.0, 9.0]];
    let both = split(parts(&[ring, far]), &[1.0, 0.5]);
    let triangles = both.triangles.iter().filter(|triangle| both.vertex_part[triangle[0] as usize] == 0).count();
    assert_eq!(triangles, 128, "nothing of the ring is longer than 1 m");
}
