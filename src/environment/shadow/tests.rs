//! Shadows against closed forms, and the shadow map against rays.

use std::f64::consts::PI;

use super::*;

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

/// Points of the plate, evenly spread, each with its share of the area.
fn points() -> impl Iterator<Item = DVec3> {
    let place = |i: i32| (f64::from(i) + 0.5) / 32.0;
    (-64..64).flat_map(move |i| (-64..64).map(move |j| DVec3::new(place(i), place(j), 0.0)))
}

fn bounds(positions: &[DVec3]) -> [DVec3; 2] {
    positions.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)])
}

/// The shadow of a disc on a parallel plate has the area of the disc for every direction of the Sun: 2.0106 m2 for 0.8 m.
#[test]
fn a_disc_casts_its_own_area() {
    let (positions, triangles) = disc_over_plate(256);
    let exact = Occluders::new(&positions, &triangles);
    for sun in [DVec3::Z, DVec3::new(0.3, -0.1, 1.0), DVec3::new(-0.4, 0.35, 0.9)] {
        let sun = sun.normalize();
        let map = DepthMap::new(SunProjection::new(sun, bounds(&positions), 1024), &positions, &triangles);
        let shaded = |visibility: &dyn Fn(DVec3) -> f64| points().map(|p| 1.0 - visibility(p)).sum::<f64>() / 1024.0;
        let by_map = shaded(&|p| map.solar_visibility(p, DVec3::Z));
        let by_rays = shaded(&|p| exact.solar_visibility(p, DVec3::Z, sun));
        let area = PI * 0.64;
        assert!((by_map / area - 1.0).abs() < 0.01, "{sun}: {by_map} m2 by the map, {area} m2");
        assert!((by_rays / area - 1.0).abs() < 0.005, "{sun}: {by_rays} m2 by rays, {area} m2");
    }
}

/// The penumbra of an edge 2 m above is as wide as the Sun's disc: 2 x 2 m x tan(0.2665 deg) = 18.6 mm.
#[test]
fn the_edge_of_an_exact_shadow_is_as_wide_as_the_sun() {
    let (positions, triangles) = disc_over_plate(4096);
    let exact = Occluders::new(&positions, &triangles);
    let at = |x: f64| exact.solar_visibility(DVec3::new(x, 0.0, 0.0), DVec3::Z, DVec3::Z);
    let half = 2.0 * SUN_ANGULAR_RADIUS;
    assert_eq!(at(0.8 - 1.05 * half), 0.0);
    assert_eq!(at(0.8 + 1.05 * half), 1.0);
    assert!((at(0.8) - 0.5).abs() <= 1.0 / SUN_RAYS as f64);
    assert!(at(0.8 - 0.5 * half) > 0.0 && at(0.8 + 0.5 * half) < 1.0);
}

#[test]
fn a_moving_edge_makes_no_jump() {
    let (positions, triangles) = disc_over_plate(64);
    let node = DVec3::new(0.5, 0.2, 0.0);
    let mut last: Option<f64> = None;
    let mut seen = [false; 2];
    for step in 0..400 {
        let sun = DVec3::new(0.001 * f64::from(step), 0.0, 1.0).normalize();
        let map = DepthMap::new(SunProjection::new(sun, bounds(&positions), 256), &positions, &triangles);
        let visibility = map.solar_visibility(node, DVec3::Z);
        // A thousandth of a radian moves the shadow by 2 mm, a ninth of a texel of 18 mm. As the map moves with the Sun, up to one of three columns of
        // texels changes.
        if let Some(last) = last {
            assert!((visibility - last).abs() < 0.34, "step {step}: from {last} to {visibility}");
        }
        seen[usize::from(visibility > 0.99)] = true;
        last = Some(visibility);
    }
    assert!(seen[0] && seen[1], "the edge must pass over the node");
}

/// A convex body never shadows its sunlit side, at any angle. Its night side is not tested.
#[test]
fn a_convex_body_has_no_shadow_of_its_own() {
    let box_corner = |i: u32| DVec3::new(f64::from(i & 1) * 2.0 - 1.0, f64::from(i >> 1 & 1) * 3.0, f64::from(i >> 2));
    let positions: Vec<DVec3> = (0..8).map(box_corner).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let exact = Occluders::new(&positions, &triangles);
    for sun in [[1.0, 0.2, 0.3], [0.02, 1.0, 0.5], [0.7, -0.7, 0.1], [0.3, 0.1, -1.0]] {
        let sun = DVec3::from_array(sun).normalize();
        let map = DepthMap::new(SunProjection::new(sun, bounds(&positions), 256), &positions, &triangles);
        for face in faces {
            let [a, b, _, d] = face.map(|corner| positions[corner as usize]);
            let normal = (b - a).cross(d - a).normalize();
            if normal.dot(sun) <= 0.0 {
                continue;
            }
            for i in 0..=20 {
                for j in 0..=20 {
                    let node = a + (b - a) * (f64::from(i) / 20.0) + (d - a) * (f64::from(j) / 20.0);
                    assert_eq!(exact.solar_visibility(node, normal, sun), 1.0, "{node} by rays, sun {sun}");
                    let by_map = map.solar_visibility(node, normal);
                    assert!(by_map > 0.999, "{node}, normal {normal}, sun {sun}: {by_map} by the map");
                }
            }
        }
    }
}

/// The traced map equals the drawn map, except at texels with an edge through their centre.
#[test]
fn a_map_that_is_traced_is_the_one_that_is_drawn() {
    let (positions, triangles) = disc_over_plate(64);
    let exact = Occluders::new(&positions, &triangles);
    let view = SunProjection::new(DVec3::new(0.3, -0.1, 1.0).normalize(), bounds(&positions), 256);
    let (drawn, traced) = (DepthMap::new(view, &positions, &triangles), DepthMap::traced(view, &exact));
    let seen = |map: &DepthMap| points().map(|p| map.solar_visibility(p, DVec3::Z)).collect::<Vec<_>>();
    let apart = seen(&drawn).iter().zip(seen(&traced)).filter(|(a, b)| (*a - b).abs() > 1e-9).count();
    assert!(apart <= 8, "{apart} of 16384 nodes");
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
    let tree = Occluders::new(&positions, &triangles);
    let all = Occluders {
        tree: Tree {
            nodes: vec![crate::environment::shadow::tree::TreeNode {
                skip: 1,
                first: 0,
                count: 300,
                ..tree.tree.nodes[0]
            }],
            order: tree.tree.order.clone(),
        },
        ..tree.clone()
    };
    let mut hidden = 0;
    for _ in 0..2000 {
        let (from, direction) = (point(12.0), point(1.0).normalize());
        assert_eq!(tree.is_hidden(from, direction), all.is_hidden(from, direction));
        hidden += usize::from(tree.is_hidden(from, direction));
    }
    assert!((200..1800).contains(&hidden), "{hidden} of 2000 rays are hidden");
}

/// A plate under another. Whether the map sees the gap between them depends on the gap alone, and not on the direction of the Sun.
#[test]
fn the_map_lets_light_through_gaps_narrower_than_its_lift_from_everywhere() {
    let plate = |z: f64, half: f64| {
        [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| DVec3::new(x, y, z))
    };
    // An eighth of a texel of a view that is as wide as the diagonal.
    let lift = 0.125 * (100.0 * 2f64.sqrt()) / (2048.0 - 6.0);
    for sun in [DVec3::Z, DVec3::new(0.8, -0.3, 0.5).normalize(), DVec3::new(-0.6, 0.7, 0.2).normalize()] {
        let computed = |gap: f64| {
            let positions: Vec<DVec3> = [plate(0.0, 50.0), plate(gap, 50.0)].concat();
            let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
            let view = SunProjection::new(sun, bounds(&positions), 2048);
            let exact = Occluders::new(&positions, &triangles);
            let map = DepthMap::traced(view, &exact);
            let node = DVec3::new(3.0, 4.0, 0.0);
            (map.solar_visibility(node, DVec3::Z), exact.solar_visibility(node, DVec3::Z, sun))
        };
        assert_eq!(computed(0.9 * lift), (1.0, 0.0), "sun {sun}: a gap of {:.1} mm", 900.0 * lift);
        assert_eq!(computed(1.1 * lift), (0.0, 0.0), "sun {sun}: a gap of {:.1} mm", 1100.0 * lift);
    }
}

/// A craft that joints have made large keeps half of the lift in texels, because rounding is in texels.
#[test]
fn a_craft_that_has_grown_keeps_a_lift_above_rounding() {
    let view = |size: f64| {
        SunProjection::around(DVec3::Z, depth_map::corners_of([DVec3::ZERO, DVec3::splat(size)]), 256, 10.0)
    };
    let lifts = [5.0, 10.0, 100.0].map(|size| view(size).lift);
    assert_eq!(lifts[0], lifts[1]);
    assert!(
        (lifts[0] - 0.125 * 10.0 / 250.0).abs() < 1e-12 && (lifts[2] - 0.0625 * view(100.0).texel).abs() < 1e-12,
        "{lifts:?}"
    );
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
            let tree = Tree::new(&positions, &triangles);
            assert_eq!(tree.nodes.len(), tree_boxes(count as usize), "{count} triangles over {spread} m");
            let mut order = tree.order.clone();
            order.sort_unstable();
            assert!(order.iter().copied().eq(0..count), "each triangle once");
        }
    }
}

#[test]
fn nothing_is_found_anew_at_an_angle_of_0_unless_something_moves() {
    use glam::{DAffine3, DQuat};

    use crate::environment::{StepLoad, SunSample};

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
    let redraw = Redraw { bounds: vec![box_of(0), box_of(1)], resolution: 64, angle: 0.0, found_for: None };
    for i in 1..200 {
        let sun = DQuat::from_rotation_x(0.1 * f64::from(i)) * DVec3::new(0.3, 0.4, 0.9).normalize();
        let pose = turned(0.03 * f64::from(i));
        let mut redraw = redraw.clone();
        assert!(redraw.view(&load(sun, pose)).is_some(), "the first time");
        assert!(redraw.view(&load(sun, pose)).is_none(), "{i}: nothing has moved");
        // A change in the last digit of a direction and of a pose.
        let rounded = DQuat::from_axis_angle(DVec3::Y, 3e-16) * sun;
        assert!(redraw.view(&load(rounded, pose)).is_none(), "{i}: rounding is no motion");
        assert!(redraw.view(&load(sun, turned(0.03 * f64::from(i) + 1e-15))).is_none(), "{i}: nor of a joint");
        assert!(redraw.view(&load(DQuat::from_axis_angle(DVec3::Y, 1e-7) * sun, pose)).is_some(), "{i}: the Sun moves");
        assert!(redraw.view(&load(sun, pose)).is_some());
        assert!(redraw.view(&load(sun, turned(0.03 * f64::from(i) + 1e-7))).is_some(), "{i}: a joint moves");
    }
}

/// A tree that is fitted to moved triangles finds what a new tree finds.
#[test]
fn a_fitted_tree_finds_what_a_new_one_finds() {
    let (mut positions, triangles) = disc_over_plate(64);
    let mut fitted = Occluders::new(&positions, &triangles);
    let still = fitted.clone();
    let turn = glam::DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
    for position in positions.iter_mut().skip(4) {
        *position = turn * *position + DVec3::new(0.5, -0.2, 0.4);
    }
    fitted.refit(&positions, &triangles);
    let fresh = Occluders::new(&positions, &triangles);
    let (mut hits, mut changed) = (0, 0);
    for point in points().step_by(7) {
        let from = point + DVec3::new(0.01, 0.02, 5.0);
        let direction = DVec3::new(0.1, 0.05, -1.0).normalize();
        let of = |occluders: &Occluders| occluders.first(from, direction).map(|hit| occluders.tree.order[hit.triangle]);
        assert_eq!(of(&fitted), of(&fresh));
        hits += usize::from(of(&fresh) > Some(1));
        changed += usize::from(of(&fresh) != of(&still));
    }
    assert!(hits > 100 && changed > 100, "{hits} rays meet the disc, {changed} otherwise than before");
    assert_eq!(fitted.start, fresh.start);
}
