//! Rays beside obvhs alone, which meets its own triangles in f32.

use std::time::Instant;

use obvhs::triangle::Triangle;

use super::*;

const TRIANGLES: usize = 4_000;
const RAYS: usize = 40_000;

/// Numbers from -1 to 1 (Knuth's generator).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Triangle and distance where a ray ends.
type End = Option<(usize, f64)>;

/// The ends of rays, and how many a second one thread follows.
fn ends(rays: &[[DVec3; 2]], mut first: impl FnMut(&[DVec3; 2]) -> End) -> (Vec<End>, f64) {
    let began = Instant::now();
    let ends = rays.iter().map(&mut first).collect();
    (ends, rays.len() as f64 / began.elapsed().as_secs_f64())
}

/// Share of rays with the same end.
fn same(one: &[End], other: &[End]) -> f64 {
    let is_same = |(one, other): &(&End, &End)| match (one, other) {
        (Some((a, near)), Some((b, far))) => a == b && (near - far).abs() < 1e-4,
        (one, other) => one.is_none() && other.is_none(),
    };
    one.iter().zip(other).filter(is_same).count() as f64 / one.len() as f64
}

/// Prints the rays a second of both: `cargo test --release --lib rays_end_where -- --nocapture`.
#[test]
fn rays_end_where_obvhs_alone_ends_them() {
    let mut number = numbers();
    let mut place = |size: f64| DVec3::new(number(), number(), number()) * size;
    let mut positions = Vec::new();
    for _ in 0..TRIANGLES {
        let corner = place(1.0);
        positions.extend([corner, corner + place(0.1), corner + place(0.1)]);
    }
    let corners: Vec<[u32; 3]> =
        (0..TRIANGLES as u32).map(|number| [3 * number, 3 * number + 1, 3 * number + 2]).collect();
    let occluders = Occluders::new(&positions, &corners);
    let rays: Vec<[DVec3; 2]> = (0..RAYS).map(|_| [place(1.0), place(1.0).normalize()]).collect();
    let (ours, rate) =
        ends(&rays, |[from, direction]| occluders.first(*from, *direction).map(|hit| (hit.triangle, hit.distance)));

    let triangles: Vec<Triangle> = occluders
        .boxes
        .primitive_indices
        .iter()
        .map(|number| {
            let [v0, v1, v2] = [0, 1, 2].map(|corner| positions[3 * *number as usize + corner].as_vec3a());
            Triangle { v0, v1, v2 }
        })
        .collect();
    let alone = |[from, direction]: &[DVec3; 2]| {
        let (ray, mut hit) = (Ray::new_inf(from.as_vec3a(), direction.as_vec3a()), RayHit::none());
        let is_hit = occluders.boxes.ray_traverse(ray, &mut hit, |ray, place| triangles[place].intersect(ray));
        is_hit.then(|| (occluders.boxes.primitive_indices[hit.primitive_id as usize] as usize, f64::from(hit.t)))
    };
    let (theirs, alone_rate) = ends(&rays, alone);
    println!(
        "{:.2} M rays/s, obvhs alone {:.2} M rays/s: {:.2} times",
        rate * 1e-6,
        alone_rate * 1e-6,
        rate / alone_rate
    );
    assert!(ours.iter().flatten().count() > RAYS / 10, "rays meet triangles");
    // f32 decides otherwise at edges.
    assert!(same(&ours, &theirs) > 0.998, "{}", same(&ours, &theirs));
    let (moved, _) = ends(&rays, |[from, direction]| {
        occluders.first(*from + DVec3::splat(0.01), *direction).map(|hit| (hit.triangle, hit.distance))
    });
    assert!(same(&moved, &theirs) < 0.9, "the comparison sees rays that begin elsewhere");
}

/// Rays along an axis end on a plate, whatever the signs of the components that are 0 or rounding.
#[test]
fn rays_along_an_axis_end_on_a_plate() {
    for axis in 0..3 {
        let turned = |[x, y, z]: [f64; 3]| {
            let mut at = [0.0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (z, x, y);
            DVec3::from(at)
        };
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for cell in 0..36u32 {
            let corner = |x: u32, y: u32| turned([0.2 * f64::from(cell % 6 + x), 0.3 * f64::from(cell / 6 + y), 1.0]);
            positions.extend([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|one: [u32; 3]| one.map(|node| node + 4 * cell)));
        }
        let occluders = Occluders::new(&positions, &triangles);
        let near_zero = [0.0, -0.0, 1e-17, -1e-17, 1e-45, -1e-45, 1e-300, -1e-300];
        for (x, y) in near_zero.into_iter().flat_map(|x| near_zero.map(|y| (x, y))) {
            for (side, lift) in [(1.0, 1e-4), (-1.0, 1e-4), (1.0, 2.0), (-1.0, 2.0)] {
                let ray = [turned([0.33, 0.41, 1.0 + side * lift]), turned([x, y, -side])];
                let found = occluders.first(ray[0], ray[1]).map(|hit| hit.distance);
                assert!(found.is_some_and(|distance| (distance - lift).abs() < 1e-9), "{ray:?}: {found:?}");
            }
        }
    }
}
