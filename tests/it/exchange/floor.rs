//! A floor beside a hot wall: temperatures along its middle against the closed form of the view factor.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3};
use isotherm::internals::{
    CraftLight, Exchange, ExchangeSettings, NodeViews, Patches, STEFAN_BOLTZMANN, Scenery, StepLoad,
};

use super::shapes::{Shapes, grey};
use crate::device::dark;

const WALL: f64 = 500.0;
const SIZE: f64 = 4.0;
const HEIGHT: f64 = 2.0;
const CELLS: usize = 40;

/// View factor from a small face to a rectangle in a plane at right angles, above the face's plane: Howell, A Catalog of Radiation Heat Transfer Configuration
/// Factors, B-4. The face lies at `distance` from the plane, before a lower corner of the rectangle.
fn to_corner(width: f64, height: f64, distance: f64) -> f64 {
    let (x, y) = (height / width, distance / width);
    let root = x.hypot(y);
    ((1.0 / y).atan() - y / root * (1.0 / root).atan()) / TAU
}

/// Temperature of a black floor in balance with the wall, in the middle between the sides [K].
fn truth(distance: f64) -> f64 {
    (2.0 * to_corner(0.5 * SIZE, HEIGHT, distance)).powf(0.25) * WALL
}

/// Poses of a floor and of its wall, which lies in the floor's plane in the file's pose and stands up.
fn upright() -> Vec<DAffine3> {
    vec![DAffine3::IDENTITY, DAffine3::from_rotation_y(0.25 * TAU)]
}

/// Differences from the truth along the middle: rms and largest [K]; the largest step from node to node over the truth's there; and the number of patches. Patches
/// are at most `coarse` times the default, and are split where `split` has the poses for which they are. The wall stands up by its joint where `turns`.
fn off(coarse: f64, split: Option<&[Vec<DAffine3>]>, turns: bool, settings: &ExchangeSettings) -> ([f64; 3], usize) {
    let mut shapes = Shapes::default();
    shapes.plate(DVec3::ZERO, SIZE * DVec3::X, SIZE * DVec3::Y, CELLS, grey(1.0, 1.0));
    let up = if turns { -DVec3::X } else { DVec3::Z };
    shapes.plate(DVec3::ZERO, SIZE * DVec3::Y, HEIGHT * up, CELLS, grey(1.0, 1.0));
    let poses = if turns { upright() } else { Vec::new() };
    for (joint, part) in shapes.surface.joints.iter_mut().zip(&shapes.surface.parts).filter(|_| turns) {
        *joint = *part;
    }
    let (surface, materials) = (&shapes.surface, &shapes.materials);
    let edge = coarse * (surface.areas.iter().sum::<f64>() / 250.0).sqrt();
    let patches = match split {
        Some(others) => Patches::resolved(surface, materials, edge, &NodeViews::new(surface, materials, others)),
        None => Patches::new(surface, materials, edge, &[]),
    };
    let exchange = Exchange::cast(surface, &patches, &Scenery::new(surface, &poses), settings);
    let count = exchange.patches.len();
    let light = CraftLight { reflected: vec![[0.0; 2]; count], sunlight: vec![0.0; count], ..CraftLight::default() };
    let space = StepLoad { background_temperature: 0.0, ..dark(0.0) };
    let sent = exchange.sent(&space, &light, |node| if surface.parts[node] == 1 { WALL } else { 0.0 });
    let absorbed = exchange.absorbed(&sent, &light);
    let on_nodes = exchange.of_nodes(&absorbed, &exchange.seen(&space));
    let given: f64 = (0..count).map(|patch| exchange.infrared.space[patch] * sent[patch]).sum();
    let taken: f64 = exchange.patches.iter().zip(&absorbed).map(|(patch, flux)| patch.area * flux).sum();
    let all: f64 = exchange.patches.iter().zip(&sent).map(|(patch, flux)| patch.area * flux).sum();
    assert!(((given + taken) / all - 1.0).abs() < 1e-12, "the heat that is sent arrives");
    let middle = |node: &usize| surface.parts[*node] == 0 && (surface.positions[*node].y - 0.5 * SIZE).abs() < 1e-9;
    let cell = SIZE / CELLS as f64;
    let mut rows: Vec<(f64, f64, f64)> = (0..surface.positions.len())
        .filter(middle)
        .map(|node| {
            // The nodes at the ends have half a cell.
            let x = surface.positions[node].x.clamp(0.25 * cell, SIZE - 0.25 * cell);
            let flux = on_nodes[node][0].absorbed;
            (x, (flux / STEFAN_BOLTZMANN).powf(0.25), truth(x))
        })
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rms = (rows.iter().map(|(_, found, truth)| (found - truth).powi(2)).sum::<f64>() / rows.len() as f64).sqrt();
    let most = rows.iter().map(|(_, found, truth)| (found - truth).abs()).fold(0.0, f64::max);
    let step = |pair: &[(f64, f64, f64)]| ((pair[1].1 - pair[0].1) - (pair[1].2 - pair[0].2)).abs();
    ([rms, most, rows.windows(2).map(step).fold(0.0, f64::max)], count)
}

#[test]
fn a_floor_beside_a_hot_wall_is_as_warm_as_the_closed_form_says() {
    assert!((to_corner(1e6, 1e9, 1e-3) - 0.25).abs() < 1e-6 && (truth(1e-9) / WALL - 0.5f64.powf(0.25)).abs() < 1e-6);
    let settings = ExchangeSettings::default();
    let ([rms, most, step], count) = off(1.0, Some(&[]), false, &settings);
    println!("{count} patches: {rms:.2} K rms, {most:.2} K at most, steps {step:.2} K off");
    assert!(rms < 1.5 && most < 4.0, "{rms} K rms, {most} K at most");
    // Patches that are not split make steps, and few rays make noise.
    let ([rms, most, _], count) = off(1.4, None, false, &settings);
    println!("whole, {count} patches: {rms:.2} K rms, {most:.2} K at most");
    assert!(rms > 2.5 && most > 4.5, "{rms} K rms, {most} K at most");
    let ([noisy, ..], _) = off(1.0, Some(&[]), false, &ExchangeSettings { rays: 64, ..settings });
    println!("with 64 rays: {noisy:.2} K rms");
    assert!(noisy > 2.0, "{noisy}");
}

#[test]
fn a_floor_whose_wall_rises_by_a_joint_is_as_warm_as_the_closed_form_says() {
    let settings = ExchangeSettings::default();
    let ([rms, most, _], count) = off(1.0, Some(&[upright()]), true, &settings);
    println!("{count} patches: {rms:.2} K rms, {most:.2} K at most");
    assert!(rms < 1.5 && most < 4.0, "{rms} K rms, {most} K at most");
    // In the file's pose the floor sees nothing, so its patches are large.
    let ([coarse, most, _], count) = off(1.4, Some(&[]), true, &settings);
    println!("for the file's pose alone, {count} patches: {coarse:.2} K rms, {most:.2} K at most");
    assert!(coarse > 2.0 * rms, "{coarse} K rms, {most} K at most");
}
