//! The contents of pixels: a plate with known temperatures against the closed form, orientation, faces, ids, near
//! plane.

use glam::{DAffine3, DVec3};
use isotherm::internals::{Band, Camera, Material, Optics, Response, Sides, band_radiance_exact};
use isotherm::{Image, Lens};

use super::device::{Worst, assert_silent, context, corner_grid, material};
use super::quads::{Quads, camera, looking};

/// An emissivity of 0.8 outside, and 0.3 on the back if there is one.
fn paint() -> Material {
    material(0.5, 0.8, Sides::Outside, Response::Instant)
}

fn sheet() -> Material {
    let back = Optics { absorptivity: 0.2, emissivity: 0.3 };
    material(0.5, 0.8, Sides::Both { back }, Response::Instant)
}

/// A plate of 20 m in the body's plane z = 0 that faces -z, with a temperature for each position.
fn plate(temperature: impl Fn(DVec3) -> f64) -> Quads {
    let mut quads = Quads::new(vec![paint(), sheet()]);
    quads.add(Quads::square(DVec3::ZERO, DVec3::Y, DVec3::X, 10.0), 6, 1, temperature);
    quads
}

/// Poses that see the plate's front: straight, slanted, and close with the horizon in view.
fn poses() -> [DAffine3; 3] {
    [
        looking(DVec3::new(0.0, 0.0, -12.0), DVec3::ZERO, DVec3::Y),
        looking(DVec3::new(5.0, -7.0, -9.0), DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.2, 1.0, 0.0)),
        looking(DVec3::new(-9.0, 1.0, -1.0), DVec3::new(9.0, 0.0, 0.0), DVec3::Z),
    ]
}

fn small_camera() -> Camera {
    Camera { lens: Lens::pinhole([70.0, 66.0], [49.3, 38.1]), ..camera(100, 76, 70.0) }
}

/// The point where a pixel's ray meets the body's plane z = 0, and its camera depth.
fn meet(camera: &Camera, pose: &DAffine3, index: usize) -> (DVec3, f64) {
    let (column, row) = (index % camera.width as usize, index / camera.width as usize);
    let across = |pixel: usize, axis: usize| (pixel as f64 + 0.5 - camera.lens.centre[axis]) / camera.lens.focal[axis];
    let ray = DVec3::new(across(column, 0), across(row, 1), 1.0);
    let body_from_camera = pose.inverse();
    let origin = body_from_camera.translation;
    let direction = body_from_camera.transform_vector3(ray);
    let depth = -origin.z / direction.z;
    (origin + depth * direction, depth)
}

/// Visits every pixel well inside the plate, with its position and depth.
fn each_pixel(camera: &Camera, pose: &DAffine3, image: &Image, mut visit: impl FnMut(usize, DVec3, f64)) {
    let mut seen = 0;
    for index in 0..image.part.len() {
        let labels = image.labels(index);
        let (point, depth) = meet(camera, pose, index);
        // A pixel at the edge may be on either side.
        let margin = 2.0 * depth / camera.lens.focal[0] / (pose.matrix3.row(2).z.abs().max(0.05));
        let inside = 10.0 - point.x.abs().max(point.y.abs());
        if depth > camera.near * 1.01 && inside > margin {
            assert_eq!(labels, [7, 2], "pixel {index} shows part and material, each plus 1");
            visit(index, point, depth);
            seen += 1;
        } else if depth < 0.0 || inside < -margin {
            assert_eq!(image.values(index), [0.0; 3], "pixel {index} shows nothing");
            assert_eq!(labels, [0, 0]);
        }
    }
    assert!(seen > 500, "{seen} pixels");
}

#[test]
#[ignore = "long: tools/test --all"]
fn radiance_of_a_plate_at_one_temperature() {
    let context = context();
    for [lower, upper] in [[8.0, 14.0], [3.0, 5.0], [1.0, 50.0], [10.3, 11.3]] {
        let band = Band { lower: lower * 1e-6, upper: upper * 1e-6 };
        let [mut worst, mut warmer, mut of_shown, mut shown] = [(); 4].map(|()| Worst::none());
        for temperature in [40.0_f32, 100.0, 180.0, 267.0, 300.0, 420.5, 1000.0] {
            let mut plate = plate(|_| f64::from(temperature));
            plate.band = band;
            let exact = |temperature: f64| 0.8 * band_radiance_exact(band, temperature);
            for (number, pose) in poses().into_iter().enumerate() {
                let image = plate.draw(&context, &small_camera(), &pose);
                each_pixel(&small_camera(), &pose, &image, |index, _, _| {
                    let [radiance, found, _] = image.values(index).map(f64::from);
                    let temperature = f64::from(temperature);
                    let name = || format!("pixel {index} of pose {number}, {temperature} K");
                    shown.see(found / temperature, 1.0, name);
                    of_shown.see(radiance / exact(found), 1.0, name);
                    worst.see(radiance / exact(temperature), 1.0, name);
                    warmer.see(radiance / exact(temperature * (1.0 + 2e-5)), 1.0, name);
                });
            }
        }
        worst.within(2e-5, "relative", &format!("radiance of a plate in {lower} to {upper} um"));
        of_shown.within(2e-5, "relative", "radiance of the temperature shown");
        shown.within(2e-6, "relative", "temperature shown");
        assert!(warmer.difference > 2e-5, "6 mK at 300 K must show");
    }
    assert_silent(&context);
}

fn gradient(point: DVec3) -> f64 {
    290.0 + 6.0 * point.x - 4.0 * point.y
}

#[test]
fn temperature_and_depth_of_a_plate_with_a_gradient() {
    let context = context();
    let plate = plate(gradient);
    let (mut temperature, mut radiance, mut depth, mut beside) =
        (Worst::none(), Worst::none(), Worst::none(), Worst::none());
    for (number, pose) in poses().into_iter().enumerate() {
        let image = plate.draw(&context, &small_camera(), &pose);
        each_pixel(&small_camera(), &pose, &image, |index, point, exact_depth| {
            let [shown_radiance, shown, shown_depth] = image.values(index).map(f64::from);
            let name = || format!("pixel {index} of pose {number}, {point} m");
            // A device rounds vertices to a grid of 1/256 of a pixel or wider. The temperature may shift by as much.
            let pixel = corner_grid(&context) * exact_depth / 70.0 / pose.matrix3.row(2).z.abs();
            let allowed = 7.2 * pixel / 128.0;
            temperature.see(shown / allowed, gradient(point) / allowed, name);
            beside.see(shown / allowed, gradient(point + DVec3::X * pixel * 0.05) / allowed, name);
            depth.see(shown_depth / exact_depth, 1.0, name);
            radiance.see(shown_radiance / (0.8 * band_radiance_exact(plate.band, shown)), 1.0, name);
        });
    }
    temperature.within(1.0, "of two steps of the grid", "temperature of a gradient");
    radiance.within(2e-5, "relative", "radiance of the temperature shown");
    depth.within(1e-3 * corner_grid(&context), "relative", "depth");
    assert!(beside.difference > 1.0, "thirteen steps of the grid must show: {beside:?}");
}

#[test]
fn a_hot_place_appears_where_opencv_has_it() {
    // The camera at the body's origin with the body's axes: +X right, +Y down, +Z forward.
    let camera = camera(80, 60, 60.0);
    let pose = DAffine3::IDENTITY;
    let context = context();
    for (place, column, row) in [
        (DVec3::new(3.0, 0.0, 10.0), 58, 30),
        (DVec3::new(0.0, 2.0, 10.0), 40, 42),
        (DVec3::new(-3.0, -2.0, 10.0), 22, 18),
    ] {
        let mut quads = Quads::new(vec![paint()]);
        quads.add(Quads::square(DVec3::Z * 11.0, DVec3::Y, DVec3::X, 30.0), 0, 0, |_| 200.0);
        quads.add(Quads::square(place, DVec3::Y, DVec3::X, 0.5), 1, 0, |_| 400.0);
        let image = quads.draw(&context, &camera, &pose);
        let hot: Vec<usize> = (0..image.part.len()).filter(|index| image.part[*index] == 2).collect();
        let mean =
            |of: fn(usize) -> usize| hot.iter().map(|index| of(*index) as f64 + 0.5).sum::<f64>() / hot.len() as f64;
        // u = centre + focal x / z, as OpenCV projects.
        let centre = (mean(|index| index % 80), mean(|index| index / 80));
        assert!((centre.0 - f64::from(column)).abs() < 0.6 && (centre.1 - f64::from(row)).abs() < 0.6, "{centre:?}");
        assert!(hot.iter().all(|index| image.temperature[*index] == 400.0));
        assert!(hot.len() > 20 && hot.len() < 60, "{} pixels", hot.len());
    }
}

#[test]
fn each_face_has_its_emissivity() {
    let context = context();
    let camera = camera(40, 30, 30.0);
    let blackbody = band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, 300.0);
    let pose = |z: f64| looking(DVec3::new(0.0, 0.0, z), DVec3::ZERO, DVec3::Y);
    for (material, front, back) in [(0, 0.8, 0.8), (1, 0.8, 0.3)] {
        let mut quads = Quads::new(vec![paint(), sheet()]);
        quads.add(Quads::square(DVec3::ZERO, DVec3::Y, DVec3::X, 10.0), 0, material, |_| 300.0);
        for (z, emissivity) in [(-8.0, front), (8.0, back)] {
            let image = quads.draw(&context, &camera, &pose(z));
            let centre = f64::from(image.radiance[15 * 40 + 20]);
            assert!((centre / (emissivity * blackbody) - 1.0).abs() < 2e-5, "from {z} m: {centre}");
        }
    }
}

#[test]
fn the_near_plane_cuts_and_nothing_behind_is_drawn() {
    let context = context();
    let near = |near: f64| Camera { near, ..camera(40, 30, 30.0) };
    let mut quads = Quads::new(vec![paint()]);
    quads.add(Quads::square(DVec3::Z * 2.0, DVec3::Y, DVec3::X, 0.5), 0, 0, |_| 300.0);
    quads.add(Quads::square(DVec3::Z * 5.0, DVec3::Y, DVec3::X, 20.0), 1, 0, |_| 250.0);
    let centre = |camera: &Camera, pose: &DAffine3| {
        let image = quads.draw(&context, camera, pose);
        (image.part[15 * 40 + 20], image.depth[15 * 40 + 20])
    };
    let ahead = DAffine3::IDENTITY;
    assert_eq!(centre(&near(0.1), &ahead).0, 1, "the nearer square hides the farther");
    assert_eq!(centre(&near(1.99), &ahead), (1, 2.0));
    assert_eq!(centre(&near(2.01), &ahead), (2, 5.0), "before the near plane nothing is drawn");
    assert_eq!(centre(&near(5.01), &ahead), (0, 0.0));
    let behind = looking(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y);
    assert_eq!(centre(&near(0.1), &behind), (0, 0.0));
}
