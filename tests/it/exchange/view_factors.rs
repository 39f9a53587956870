//! View factors with known answers.
//!
//! Formulae: Howell, Menguc, Daun, Siegel, "Thermal Radiation Heat Transfer", 7th edition, appendix C, and Howell's catalogue of configuration factors.

use std::f64::consts::PI;

use glam::DVec3;
use isotherm::internals::{Exchange, ExchangeSettings, Patches, Scenery, To, ViewFactor, view_factors};

use super::shapes::{Shapes, grey};
use crate::device::dark;

/// The exchange of shapes in patches of a size.
pub fn exchange(shapes: &Shapes, patch_edge: f64, rays: u32) -> Exchange {
    let settings = ExchangeSettings {
        rays,
        patch_edge: Some(patch_edge),
        bounces: None,
        redraw_angle: 0.0,
        specular_sunlight: false,
        hold: Some(0.0),
    };
    let patches = Patches::new(&shapes.surface, &shapes.materials, patch_edge, &[]);
    Exchange::cast(&shapes.surface, &patches, &Scenery::new(&shapes.surface, &[]), &settings)
}

/// View factors between the parts of shapes.
fn between_parts(shapes: &Shapes, patch_edge: f64, rays: u32) -> Vec<ViewFactor> {
    let exchange = exchange(shapes, patch_edge, rays);
    let parts: Vec<usize> = exchange.patches.iter().map(|patch| patch.part as usize).collect();
    view_factors(&exchange, &parts, &dark(0.0))
}

fn of(found: &[ViewFactor], from: usize, to: To) -> (f64, f64) {
    let row = found.iter().find(|row| row.from == from && row.to == to);
    row.map_or((0.0, 0.0), |row| (row.factor, row.error))
}

/// Fails unless a view factor is within three standard errors and 1e-3 of its answer.
fn assert_is(what: &str, found: &[ViewFactor], from: usize, to: usize, answer: f64) {
    let (factor, error) = of(found, from, To::Group(to));
    println!("{what}: {factor:.6} +- {error:.1e}, exact {answer:.6}, off {:.1e}", factor - answer);
    assert!((factor - answer).abs() < (3.0 * error).min(1e-3), "{what}: {factor} +- {error} against {answer}");
    let sum: f64 = found.iter().filter(|row| row.from == from).map(|row| row.factor).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{what}: the row sums to {sum}");
}

fn plain() -> isotherm::internals::Material {
    grey(0.5, 0.5)
}

/// Parallel equal rectangles, C-11.
fn parallel(a: f64, b: f64, distance: f64) -> f64 {
    let (x, y) = (a / distance, b / distance);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    2.0 / (PI * x * y)
        * ((p * p * q * q / (1.0 + x * x + y * y)).ln() / 2.0 + x * q * (x / q).atan() + y * p * (y / p).atan()
            - x * x.atan()
            - y * y.atan())
}

/// Rectangles of one length at right angles with a common edge, C-14.
fn perpendicular(length: f64, height: f64, width: f64) -> f64 {
    let (h, w) = (height / length, width / length);
    let (h2, w2) = (h * h, w * w);
    let root = (h2 + w2).sqrt();
    let logs = (1.0 + w2) * (1.0 + h2) / (1.0 + w2 + h2);
    let second = (w2 * (1.0 + w2 + h2) / ((1.0 + w2) * (w2 + h2))).powf(w2);
    let third = (h2 * (1.0 + h2 + w2) / ((1.0 + h2) * (h2 + w2))).powf(h2);
    (w * (1.0 / w).atan() + h * (1.0 / h).atan() - root * (1.0 / root).atan() + 0.25 * (logs * second * third).ln())
        / (PI * w)
}

/// View factor between two parallelograms that do not touch, by midpoints of `n`^4 pieces and one step of Richardson.
fn by_quadrature(a: [DVec3; 3], b: [DVec3; 3]) -> f64 {
    let with = |n: usize| {
        let points = |[corner, right, up]: [DVec3; 3]| {
            (0..n * n).map(move |i| {
                let [u, v] = [i % n, i / n].map(|i| (i as f64 + 0.5) / n as f64);
                corner + u * right + v * up
            })
        };
        let [na, nb] = [a, b].map(|[_, right, up]| right.cross(up));
        let mut sum = 0.0;
        for p in points(a) {
            for q in points(b) {
                let r = q - p;
                sum += (r.dot(na).max(0.0) * (-r.dot(nb)).max(0.0)) / (PI * r.length_squared().powi(2));
            }
        }
        sum / (na.length() * (n * n * n * n) as f64)
    };
    (4.0 * with(32) - with(16)) / 3.0
}

#[test]
fn parallel_rectangles() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y, 12, plain());
    shapes.plate(DVec3::Z * 0.8, DVec3::Y, DVec3::X * 2.0, 12, plain());
    let found = between_parts(&shapes, 0.5, 4096);
    assert!((parallel(1.0, 1.0, 1.0) - 0.199825).abs() < 1e-6);
    assert_is("parallel", &found, 0, 1, parallel(2.0, 1.0, 0.8));
    // A gap of one per cent more is another answer.
    let (factor, error) = of(&found, 0, To::Group(1));
    assert!((factor - parallel(2.0, 1.0, 0.84)).abs() > (3.0 * error).min(1e-3));
}

#[test]
fn perpendicular_rectangles() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X, DVec3::Y, 12, plain());
    shapes.plate(DVec3::ZERO, DVec3::Y, DVec3::Z * 0.5, 12, plain());
    let found = between_parts(&shapes, 0.25, 4096);
    assert!((perpendicular(1.0, 1.0, 1.0) - 0.200044).abs() < 1e-6);
    assert_is("perpendicular", &found, 0, 1, perpendicular(1.0, 0.5, 1.0));
}

#[test]
fn inclined_rectangles() {
    let (sine, cosine) = 50f64.to_radians().sin_cos();
    let a = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let along = DVec3::new(cosine, 0.0, sine);
    let b = [DVec3::new(0.15, 0.2, 0.0) + 0.3 * along, DVec3::Y, along];
    let mut shapes = Shapes::default();
    shapes.plate(a[0], a[1], a[2], 12, plain()).plate(b[0], b[1], b[2], 12, plain());
    assert_is("inclined", &between_parts(&shapes, 0.25, 4096), 0, 1, by_quadrature(a, b));
}

#[test]
fn coaxial_discs() {
    let mut shapes = Shapes::default();
    shapes.disc(0.0, 1.0, true, plain()).disc(0.7, 0.6, false, plain());
    let (r1, r2) = (1.0 / 0.7, 0.6 / 0.7);
    let x: f64 = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
    let exact = 0.5 * (x - (x * x - 4.0 * (r2 / r1) * (r2 / r1)).sqrt());
    assert_is("discs", &between_parts(&shapes, 0.4, 4096), 0, 1, exact);
}

#[test]
fn concentric_spheres() {
    let mut shapes = Shapes::default();
    shapes.sphere(0.5, true, plain()).sphere(1.0, false, plain());
    let found = between_parts(&shapes, 0.5, 4096);
    assert_is("from the inner sphere", &found, 0, 1, 1.0);
    assert_is("from the outer sphere", &found, 1, 0, 0.25);
    assert_is("the outer sphere sees itself", &found, 1, 1, 0.75);
}

/// C-92 and C-93: from the outer cylinder to the inner one.
#[test]
fn concentric_cylinders() {
    let (r, h): (f64, f64) = (2.0, 3.0);
    let mut shapes = Shapes::default();
    shapes.cylinder(0.5, 0.5 * h, true, plain()).cylinder(0.5 * r, 0.5 * h, false, plain());
    let (a, b) = (h * h + r * r - 1.0, h * h - r * r + 1.0);
    let arcs = (b / (r * a)).acos() * ((a + 2.0).powi(2) - 4.0 * r * r).sqrt() + b * (1.0 / r).asin() - 0.5 * PI * a;
    let exact = ((b / a).acos() - arcs / (2.0 * h)) / PI;
    assert_is("from the outer cylinder", &between_parts(&shapes, 0.4, 4096), 1, 0, (1.0 - exact) / r);
}

#[test]
fn a_sphere_over_a_plate() {
    let (radius, distance): (f64, f64) = (1.2, 0.9);
    let mut shapes = Shapes::default();
    shapes.sphere(0.5, true, plain()).disc(-distance, radius, true, plain());
    let ratio = radius / distance;
    let exact = 0.5 * (1.0 - 1.0 / (1.0 + ratio * ratio).sqrt());
    assert_is("sphere over a disc", &between_parts(&shapes, 0.4, 4096), 0, 1, exact);
}

#[test]
fn the_inside_of_a_cube() {
    let mut shapes = Shapes::default();
    shapes.room(DVec3::ONE, 6, |_| plain());
    let found = between_parts(&shapes, 0.34, 4096);
    for from in 0..6 {
        for to in (0..6).filter(|to| *to != from) {
            let exact = if from / 2 == to / 2 { 0.199825 } else { 0.200044 };
            assert_is(&format!("wall {from} to {to}"), &found, from, to, exact);
        }
        assert!(of(&found, from, To::Space).0.abs() < 1e-12, "a cube has no way out");
    }
}

#[test]
fn errors_fall_with_the_rays() {
    let mut shapes = Shapes::default();
    shapes.room(DVec3::ONE, 6, |_| plain());
    let error = |rays: u32| {
        let found = between_parts(&shapes, 0.34, rays);
        let off = |from: usize, to: usize| {
            let exact = if from / 2 == to / 2 { 0.199825 } else { 0.200044 };
            of(&found, from, To::Group(to)).0 - exact
        };
        let all: f64 = (0..36).filter(|i| i / 6 != i % 6).map(|i| off(i / 6, i % 6).powi(2)).sum();
        (all / 30.0).sqrt()
    };
    let errors = [64, 256, 1024, 4096].map(error);
    println!("rms error at 64, 256, 1024 and 4096 rays: {errors:?}");
    // Independent rays would gain a factor of 8.
    assert!(errors[3] < errors[0] / 8.0, "{errors:?}");
}

#[test]
fn rows_are_reciprocal_and_closed() {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y, 12, plain());
    shapes.plate(DVec3::new(0.3, 0.1, 0.4), DVec3::Y, DVec3::X * 0.5, 12, plain());
    shapes.sphere(0.2, true, plain());
    let exchange = exchange(&shapes, 0.3, 64);
    let factors = &exchange.factors;
    for (i, area) in factors.areas.iter().enumerate() {
        let row: f64 = factors.shared.row(i).iter().map(|(_, shared)| shared).sum();
        assert!((row + factors.space[i] - area).abs() < 1e-12 * area);
        factors.shared.row(i).iter().for_each(|(j, shared)| {
            assert!((factors.shared.at(*j as usize, i as u32) - shared).abs() < 1e-12 * area);
        });
    }
    let correction = factors.correction;
    assert!(correction.rms > 1e-4 && correction.rms < 0.05 && correction.unclosed < 1e-9, "{correction:?}");
}
