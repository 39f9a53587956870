//! The rasteriser against closed forms of a plate.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use super::{EMPTY, Pixel, RasterSurface, RasterView, rasterise};
use crate::lens::{Distortion, Lens};
use crate::thermal::planck::{Band, band_radiance_exact};

const EMISSIVITIES: [[f64; 2]; 2] = [[0.9, 0.4], [0.5, 0.1]];

fn radiance(t: f64) -> f64 {
    band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, t)
}

/// Looks along -Z of the body (front faces have a normal towards +Z) from (0, 0, height), turned by `tilt` about X.
fn view(height: f64, tilt: f64) -> RasterView {
    let down = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let camera_from_body = DAffine3::from_quat(DQuat::from_rotation_x(tilt))
        * DAffine3::from_mat3(down)
        * DAffine3::from_translation(DVec3::new(0.0, 0.0, -height));
    let lens = Lens::pinhole([70.0, 72.0], [39.3, 30.8]);
    RasterView { camera_from_body, width: 80, height: 60, lens, samples: 1, near: 0.1, first_row: 0 }
}

/// A square of 20 m at z = 0 whose temperature is linear in x and y.
struct Plate {
    positions: Vec<DVec3>,
    temperatures: Vec<f64>,
}

const PLATE_TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const BACK_TRIANGLES: [[u32; 3]; 2] = [[0, 2, 1], [0, 3, 2]];

fn field(p: DVec3) -> f64 {
    250.0 + 11.0 * p.x - 4.0 * p.y
}

fn plate() -> Plate {
    let corners = [(-10.0, -10.0), (10.0, -10.0), (10.0, 10.0), (-10.0, 10.0)];
    let positions: Vec<DVec3> = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
    let temperatures = positions.iter().map(|&p| field(p)).collect();
    Plate { positions, temperatures }
}

fn draw(plate: &Plate, triangles: &[[u32; 3]], view: &RasterView) -> Vec<Pixel> {
    let vertices = plate.positions.len();
    let (parts, materials) = (vec![4; vertices], vec![1; vertices]);
    let surface = RasterSurface {
        positions: &plate.positions,
        triangles,
        temperatures: &plate.temperatures,
        vertex_part: &parts,
        vertex_material: &materials,
        emissivities: &EMISSIVITIES,
        around: None,
    };
    rasterise(&surface, view, radiance)
}

/// Point where a pixel's ray meets the plane z = 0 of the body, and its camera depth, without the rasteriser.
fn meet(view: &RasterView, index: usize) -> (DVec3, f64) {
    let (column, row) = (index % view.width as usize, index / view.width as usize);
    let ray = view.lens.unproject(DVec2::new(column as f64 + 0.5, row as f64 + 0.5)).expect("a ray").extend(1.0);
    let body_from_camera = view.camera_from_body.inverse();
    let (origin, direction) = (body_from_camera.transform_point3(DVec3::ZERO), body_from_camera.transform_vector3(ray));
    let depth = -origin.z / direction.z;
    (origin + depth * direction, depth)
}

#[test]
fn plate_with_a_gradient_agrees_with_the_closed_form() {
    let bent = Distortion::BrownConrady([-0.2, 0.04, 1e-3, -2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for (height, tilt, distortion) in [
        (9.0, 0.0, Distortion::None),
        (6.0, 0.6, Distortion::None),
        (30.0, 0.2, Distortion::None),
        (0.5, 1.3, Distortion::None),
        (9.0, 0.3, bent),
        (6.0, 0.6, Distortion::Fisheye([-0.01, 0.0, 0.002, 0.0])),
    ] {
        let mut view = view(height, tilt);
        view.lens.distortion = distortion;
        let pixels = draw(&plate(), &PLATE_TRIANGLES, &view);
        let mut covered = 0;
        for (index, pixel) in pixels.iter().enumerate() {
            let (point, depth) = meet(&view, index);
            let edge = 10.0 - point.x.abs().max(point.y.abs());
            if depth < view.near || edge < -1e-9 {
                assert_eq!(*pixel, EMPTY);
            } else if edge > 1e-9 {
                covered += 1;
                let (t, l) = (field(point), 0.5 * radiance(field(point)));
                assert!((pixel.temperature - t).abs() < 1e-9, "{} against {t} K", pixel.temperature);
                assert!((pixel.radiance - l).abs() < 1e-9 * l, "{} against {l}", pixel.radiance);
                assert!((pixel.depth - depth).abs() < 1e-9);
                assert_eq!((pixel.part, pixel.material), (5, 2));
                let beside = field(point + DVec3::new(1e-6, 0.0, 0.0));
                assert!((pixel.temperature - beside).abs() > 1e-9);
            }
        }
        assert!(covered > 500, "{height} m, {tilt} rad: {covered} pixels");
    }
}

#[test]
fn the_back_has_its_own_emissivity() {
    let view = view(9.0, 0.3);
    let (front, back) = (draw(&plate(), &PLATE_TRIANGLES, &view), draw(&plate(), &BACK_TRIANGLES, &view));
    let mut seen = 0;
    for (front, back) in front.iter().zip(&back).filter(|(front, _)| front.part > 0) {
        seen += 1;
        assert!((back.radiance / front.radiance - 0.1 / 0.5).abs() < 1e-12);
    }
    assert!(seen > 500);
}

#[test]
fn the_nearest_wins_in_any_order() {
    let mut plate = plate();
    let nearer = plate.positions.iter().map(|p| DVec3::new(0.2 * p.x, 0.2 * p.y, 1.0)).collect::<Vec<_>>();
    plate.positions.extend(nearer);
    plate.temperatures.extend([400.0; 4]);
    let mut triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let view = view(9.0, 0.0);
    let one = draw(&plate, &triangles, &view);
    triangles.reverse();
    assert_eq!(one, draw(&plate, &triangles, &view));
    let centre = one[30 * 80 + 39];
    assert!((centre.temperature - 400.0).abs() < 1e-9 && (centre.depth - 8.0).abs() < 1e-12, "{centre:?}");
    assert!(one.iter().any(|pixel| (pixel.depth - 9.0).abs() < 1e-12), "and the plate shows beside it");
}

/// A plate whose edges cross pixels at an angle.
#[test]
fn the_mean_of_the_samples_is_that_of_the_area() {
    for samples in [4, 8, 16] {
        let mut view = RasterView { samples, ..view(40.0, 0.0) };
        view.camera_from_body = DAffine3::from_quat(DQuat::from_rotation_z(0.3)) * view.camera_from_body;
        let mut plate = plate();
        plate.temperatures = vec![300.0; 4];
        let pixels = draw(&plate, &PLATE_TRIANGLES, &view);
        let covered: f64 = pixels.iter().map(|pixel| pixel.coverage).sum();
        let radiant: f64 = pixels.iter().map(|pixel| pixel.radiance).sum();
        // 20 m at a distance of 40 m.
        let exact = 400.0 * 70.0 * 72.0 / 40.0f64.powi(2);
        // A border of about 90 pixels, each off by about 0.1 at random.
        assert!((covered / exact - 1.0).abs() < 3e-3, "{samples} samples: {covered} of {exact} px");
        assert!((radiant / (covered * 0.5 * radiance(300.0)) - 1.0).abs() < 1e-12);
        let border = pixels.iter().filter(|pixel| pixel.coverage > 0.0 && pixel.coverage < 1.0).count();
        assert!(border > 80, "{border} pixels are covered in part");
    }
}

#[test]
fn nothing_behind_the_camera_is_drawn() {
    let view =
        RasterView { camera_from_body: DAffine3::from_translation(DVec3::new(0.0, 0.0, -3.0)), ..view(1.0, 0.0) };
    assert!(draw(&plate(), &PLATE_TRIANGLES, &view).iter().all(|pixel| *pixel == EMPTY));
    let hidden = RasterView { near: 9.5, ..self::view(9.0, 0.0) };
    assert!(draw(&plate(), &PLATE_TRIANGLES, &hidden).iter().all(|pixel| *pixel == EMPTY));
}
