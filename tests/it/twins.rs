//! Loads and balance on the device against their f64 twins.

use std::f64::consts::PI;

use glam::DVec3;
use isotherm::internals::{
    AlbedoField, MAX_SUN_SAMPLES, Material, Optics, PlanetLoad, Response, STEFAN_BOLTZMANN, Sides, StepLoad,
    albedo_flux, commanded_temperature, exact_albedo_flux, incident, planet_ir_flux, solar_flux,
};

use super::device::{
    ALL, LooseNodes, Present, Worst, assert_silent, black, context, dark, material, planet, settled, sunlight,
};
use super::random::Random;

/// Orbit radii over Earth's radius: lowest orbits, ISS, the paper's orbit, geostationary, and the Moon.
const RATIOS: [f64; 6] = [1.0157, 1.0352, 1.0640, 1.1212, 6.617, 60.3];

fn directions(count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Random(seed);
    // Includes the axes, where components vanish and plates lie along the tangents of their loads.
    let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    axes.into_iter().chain(std::iter::repeat_with(|| random.direction())).take(count).collect()
}

/// Largest difference between the flux on black plates and a twin [W/m2].
fn flux_difference(present: Present, load: &StepLoad, twin: impl Fn(DVec3) -> f64, plates: &[DVec3]) -> Worst {
    let context = context();
    let nodes = LooseNodes::new(present, vec![black()], plates);
    let device: Vec<f64> = settled(&nodes, &mut nodes.renderer(&context, &[]), load)
        .iter()
        .map(|temperature| STEFAN_BOLTZMANN * temperature.powi(4))
        .collect();
    assert_silent(&context);
    let twins: Vec<f64> = nodes.reference_nodes().iter().map(|node| twin(node.normal)).collect();
    Worst::of(&device, &twins, |index| format!("node {index}, normal {}", plates[index]))
}

#[test]
fn solar_flux_agrees() {
    let sun = Present { sun: true, ..Present::default() };
    let mut random = Random(1);
    let plates = directions(2000, 2);
    for count in [0, 1, 4, MAX_SUN_SAMPLES] {
        let samples: Vec<_> = (0..count).map(|_| (random.direction(), 1361.0 / count as f64)).collect();
        let load = StepLoad { sun: sunlight(samples.clone()), ..dark(0.0) };
        let worst = flux_difference(sun, &load, |normal| solar_flux(&load, normal), &plates);
        // A flux comes from an f32 temperature, so its relative error is 2.4e-7.
        worst.within(1e-3, "W/m2", &format!("solar flux of {count} samples"));
        if count > 0 {
            let brighter = samples.into_iter().map(|(direction, flux)| (direction, flux * (1.0 + 2e-6)));
            let brighter = StepLoad { sun: sunlight(brighter), ..dark(0.0) };
            let worse = flux_difference(sun, &load, |normal| solar_flux(&brighter, normal), &plates);
            assert!(worse.difference > 1e-3, "two millionths more light must show: {worse:?}");
        }
    }
}

#[test]
fn plate_view_factor_agrees() {
    let infrared = Present { planet_ir: true, ..Present::default() };
    for ratio in RATIOS {
        let nadir = DVec3::new(0.6, 0.48, -0.64);
        // An exitance of 1 W/m2 makes the flux equal the view factor. Tilts are dense near both tangencies.
        let load = |ratio| StepLoad { planet: Some(planet(nadir, DVec3::Z, ratio, 1.0, 0.0)), ..dark(0.0) };
        let side = nadir.any_orthonormal_vector();
        let limb = (1.0 / ratio).asin();
        let tilts = (0..2000).map(|step| PI * f64::from(step) / 1999.0);
        let tangencies = [PI / 2.0 - limb, PI / 2.0 + limb];
        let close = tangencies.into_iter().flat_map(|at| (-100..=100).map(move |step| at + 1e-5 * f64::from(step)));
        let plates: Vec<DVec3> = tilts.chain(close).map(|tilt| nadir * tilt.cos() + side * tilt.sin()).collect();
        let difference = |wrong: f64| {
            let twin = load(ratio * wrong);
            flux_difference(infrared, &load(ratio), |normal| planet_ir_flux(&twin, normal), &plates)
        };
        let worst = difference(1.0);
        worst.within(6e-7, "(share of the half-space)", &format!("view factor at {ratio} radii"));
        if ratio < 10.0 {
            assert!(difference(1.0 + 1e-4).difference > 6e-7, "a ten-thousandth of a radius must show");
        }
    }
}

/// A planet with albedo. The Sun has an angle from the zenith below the craft.
fn reflecting(field: &AlbedoField, ratio: f64, sun_zenith: f64) -> Option<StepLoad> {
    let nadir = DVec3::new(-0.36, 0.48, 0.8);
    let planet = PlanetLoad { albedo_flux: 0.3 * 1361.0, ..planet(nadir, DVec3::X, ratio, 0.0, sun_zenith) };
    Some(StepLoad { planet: Some(planet), albedo: Some(field.table(sun_zenith)?), ..dark(0.0) })
}

#[test]
#[ignore = "long: tools/test --all"]
fn albedo_flux_agrees() {
    let albedo = Present { sun: true, albedo: true, planet_ir: false };
    let plates = directions(3000, 3);
    for ratio in [1.0352, 1.0640, 6.617] {
        let field = AlbedoField::new(ratio);
        for degrees in [0.0_f64, 40.0, 75.0, 89.0, 95.0] {
            let load = reflecting(&field, ratio, degrees.to_radians()).expect("the planet is lit");
            let what = format!("albedo at {ratio} radii, Sun {degrees} deg from the zenith");
            let worst = flux_difference(albedo, &load, |normal| albedo_flux(&load, normal), &plates);
            worst.within(4e-4, "W/m2", &format!("{what}, against the table in f64"));
            let worst = flux_difference(albedo, &load, |normal| exact_albedo_flux(&load, normal), &plates);
            worst.within(0.1, "W/m2", &format!("{what}, against the integral"));
            let mut turned = load.clone();
            let planet = turned.planet.as_mut().expect("the planet is there");
            planet.sunward = -planet.sunward;
            let wrong = flux_difference(albedo, &load, |normal| albedo_flux(&turned, normal), &plates);
            assert!(degrees == 0.0 || wrong.difference > 0.1, "{what}: light from the wrong side must show");
        }
    }
}

/// Materials with many optics, one- and two-sided.
fn materials(count: usize, seed: u64) -> Vec<Material> {
    let mut random = Random(seed);
    let mut materials = Vec::new();
    for index in 0..count {
        let mut optics = || Optics { absorptivity: random.between(0.0, 1.0), emissivity: random.between(0.02, 1.0) };
        let (front, back) = (optics(), optics());
        let sides = if index % 2 == 0 { Sides::Outside } else { Sides::Both { back } };
        materials.push(material(front.absorptivity, front.emissivity, sides, Response::Instant));
    }
    // The paper's goldized MLI is the hottest material. Another one absorbs no sunlight.
    materials.push(material(0.19, 0.02, Sides::Outside, Response::Instant));
    materials.push(material(0.0, 0.9, Sides::Outside, Response::Instant));
    materials
}

/// Below this temperature [K] the balance is ill-conditioned, so radiated fluxes are compared. See `simulation::check`.
const COLD: f64 = 85.0;

#[test]
fn balance_temperature_agrees() {
    let context = context();
    let plates = directions(400, 5);
    let nodes = LooseNodes::new(ALL, materials(12, 6), &plates);
    let mut renderer = nodes.renderer(&context, &[]);
    let mut random = Random(7);
    let (mut worst, mut worst_flux, mut perturbed) = (Worst::none(), Worst::none(), Worst::none());
    for ratio in [1.0352, 1.0640, 1.1212] {
        let field = AlbedoField::new(ratio);
        for degrees in [0.0_f64, 60.0, 91.0, 150.0] {
            let samples = (0..4).map(|_| (random.direction(), random.between(0.0, 400.0)));
            let mut load = reflecting(&field, ratio, degrees.to_radians()).unwrap_or_else(|| dark(0.0));
            load.sun = sunlight(samples.collect::<Vec<_>>());
            load.background_temperature = 2.7;
            let night = planet(DVec3::new(-0.36, 0.48, 0.8), DVec3::X, ratio, 0.0, degrees.to_radians());
            load.planet = Some(PlanetLoad { planet_ir: 237.0, ..load.planet.unwrap_or(night) });
            let device = settled(&nodes, &mut renderer, &load);
            for (index, node) in nodes.reference_nodes().iter().enumerate() {
                let of = |load| commanded_temperature(&incident, node, &nodes.materials[node.material as usize], load);
                let twin = of(&load);
                let name = || {
                    format!(
                        "node {index}, {}, normal {}, {ratio} radii, Sun at {degrees} deg",
                        nodes.materials[node.material as usize].name, node.normal
                    )
                };
                if twin < COLD {
                    let flux = |t: f64| STEFAN_BOLTZMANN * t.powi(4);
                    worst_flux.see(flux(device[index]), flux(twin), name);
                } else {
                    worst.see(device[index], twin, name);
                    let mut other = load.clone();
                    other.planet.as_mut().expect("the planet is there").planet_ir *= 1.000_05;
                    perturbed.see(device[index], of(&other), String::new);
                }
            }
        }
    }
    worst.within(2e-3, "K", "balance temperature");
    worst_flux.within(1e-4, "W/m2", "balance below 85 K, as radiated flux");
    assert!(perturbed.difference > 2e-3, "20 mK of the planet's temperature must show: {perturbed:?}");
    assert_silent(&context);
}
