//! Light in pixels: the edge of a shadow on foil lies where geometry says, whatever the mesh.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use isotherm::internals::{STEFAN_BOLTZMANN, read_exr};
use isotherm::package::find_image_sigma;
use isotherm::{Image, Pose, Simulation, Target};

use super::budget::{LIT, scene, squares, sunlight};
use super::craft::never;
use super::program::run;

const CAPACITY: f64 = 400.0;
const EMISSIVITY: f64 = 0.8;
const START: f64 = 300.0;
/// Effective emittance of a blanket to the structure below it.
const BELOW: f64 = 0.3;

/// Temperature of foil [K] after the ten steps of a minute, with shares of the sunlight and of the radiation of a black body at the start. Steps of a tenth of a second.
fn foil(sun: f64, black: f64) -> f64 {
    foil_of(EMISSIVITY, sun, black)
}

/// The same with another emissivity.
fn foil_of(emissivity: f64, sun: f64, black: f64) -> f64 {
    let emitted = |t: f64| emissivity * STEFAN_BOLTZMANN * t.powi(4);
    let rate = |t: f64| (sun * sunlight() + black * emitted(START) - emitted(t)) / CAPACITY;
    (0..6000).fold(START, |kelvin, _| kelvin + 0.1 * rate(kelvin + 0.05 * rate(kelvin)))
}

fn skin(response: &str) -> String {
    format!(
        "emissivity = {EMISSIVITY}\nheat_capacity_per_area = {CAPACITY}\nthickness = 0.0001\nconductivity = 0\nsides = \"outside\"\nresponse = \"{response}\"\n"
    )
}

/// A floor of foil, and a plate of foil 1 m above it whose shadow covers the floor's half of x > 0 under a Sun 45 deg above +x.
fn image(response: &str, edge: f64, key: &str, device: &str) -> Image {
    let all = [("floor", [0.0; 3], true), ("plate", [2.0, 0.0, 1.0], true)];
    draw(&skin(response), edge, key, device, &skin(response), &all)
}

/// The same floor over a structure that stays as warm as it began.
fn image_over_structure(key: &str, device: &str) -> Image {
    let below = format!(
        "over = {{ effective_emittance = {BELOW}, thickness = 1, density = 1e4, specific_heat = 1e4, conductivity = 0 }}\n"
    );
    let all = [("floor", [0.0; 3], true), ("plate", [2.0, 0.0, 1.0], true)];
    draw(&(skin("network") + &below), 1.0, key, device, &skin("network"), &all)
}

/// The same floor below black tiles, 8 m above it, that stay as warm as they began and face it. Their shadow covers the floor's half of x < 0.
fn image_below_tiles(key: &str, device: &str) -> Image {
    let tile = "emissivity = 1\nheat_capacity_per_area = 1e8\nsides = \"outside\"\nresponse = \"radiative\"\n";
    let place = |tile: u8| [f32::from(tile % 8) * 2.0 - 7.0, f32::from(tile / 8) * 2.0 - 7.0, 8.0];
    let tiles = (0..64).map(|tile| ("plate", place(tile), false));
    let all: Vec<_> = std::iter::once(("floor", [0.0; 3], true)).chain(tiles).collect();
    draw(&skin("network"), 1.0, &format!("{key}[exchange]\n"), device, tile, &all)
}

/// View factor of a place on the floor to these tiles (Howell's catalogue, B-3).
fn share_of_tiles(place: DVec3) -> f64 {
    let corner = |x: f64, y: f64| {
        let [along, across] = [x, y].map(|side| side.hypot(1.0));
        (x / along * (y / along).atan() + y / across * (x / across).atan()) / TAU
    };
    let sides = |at: f64| [(8.0 - at) / 8.0, (8.0 + at) / 8.0];
    sides(place.x).into_iter().flat_map(|x| sides(place.y).map(|y| corner(x, y))).sum()
}

/// Draws a floor of foil and squares of another material.
fn draw(foil: &str, edge: f64, key: &str, device: &str, plate: &str, all: &[(&str, [f32; 3], bool)]) -> Image {
    let rest = format!("[initial]\ntemperature = {START}\n[shadows]\n{key}[network]\ncontacts = \"stated\"\n");
    let text = scene(&[("floor", foil), ("plate", plate)], LIT, &rest);
    let text = text
        .replace("max_edge = 0.5", &format!("max_edge = {edge}"))
        .replace("budget = true\n", "budget = true\nerror = true\n");
    let text = if foil.contains("network") { text } else { text.replace("[network]\ncontacts = \"stated\"\n", "") };
    // Below the tiles.
    let text = if key.contains("[exchange]") {
        text.replace("position = [-5, -1, 5]", "position = [-5, -1, 3]")
    } else {
        text
    };
    let folder = squares(&text, all);
    let device: &[&str] = if device == "cpu" { &["--device", "cpu"] } else { &[] };
    let ran = run(folder.0.path(), &[&["run", "scene.toml", "-o", "out"], device].concat());
    assert_eq!(ran.code, 0, "{}", ran.err);
    read_exr(&folder.path("out/frames/step_000010.exr")).expect("an image").0
}

/// Places of the floor's pixels, their temperatures and stated errors [K], and the width of a pixel there [m].
fn floor(image: &Image) -> Vec<(DVec3, [f64; 2], f64)> {
    let body_from_camera = image.camera_from_body.inverse();
    let width = image.camera.width as usize;
    let pixels = (0..image.part.len()).filter(|pixel| image.part[*pixel] == 1).map(|pixel| {
        let at = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        let depth = f64::from(image.depth[pixel]);
        let ray = image.camera.lens.unproject(at).expect("a ray").extend(1.0);
        let place = body_from_camera.transform_point3(depth * ray);
        // A pixel that is seen at 45 deg or so.
        let size = 1.5 * depth / image.camera.lens.focal[0];
        (place, [image.temperature[pixel], image.error[pixel]].map(f64::from), size)
    });
    pixels.collect()
}

/// Whether a pixel is its width away from the edge of the shadow, and away from the floor's rim, where the plate's other edges begin to hide the Sun.
fn is_inside((place, _, width): &(DVec3, [f64; 2], f64)) -> bool {
    place.x.abs() > *width && place.y.abs() < 0.98
}

/// Pixels more than their width away from the edge that are wrong by more than 1 K, and the share of all pixels that lie within twice of their stated error.
fn wrong(image: &Image) -> (usize, f64) {
    wrong_beside(image, |place| foil(if place.x < 0.0 { 1.0 } else { 0.0 }, 0.0))
}

/// The same with the temperature of a place [K].
fn wrong_beside(image: &Image, truth: impl Fn(DVec3) -> f64) -> (usize, f64) {
    let all = floor(image);
    let [lit, dark] = [1.0, 0.0].map(|sun| foil(sun, 0.0));
    assert!(all.len() > 200 && lit - dark > 100.0, "{} pixels, {lit} and {dark} K", all.len());
    let off = |(place, [kelvin, _], _): &(DVec3, [f64; 2], f64)| (kelvin - truth(*place)).abs();
    let wrong = all.iter().filter(|pixel| is_inside(pixel) && off(pixel) > 1.0).count();
    let within = all.iter().filter(|pixel| off(pixel) <= 2.0 * pixel.1[1] + 0.05).count();
    (wrong, within as f64 / all.len() as f64)
}

/// How far the budgets of pixels more than their width away from the edge are from the light that falls there and the emission at their temperature [W/m2].
fn budget_off(image: &Image) -> f64 {
    let budgets = image.budget.iter().zip(&image.part).filter(|(_, part)| **part == 1).map(|(budget, _)| budget);
    let off = |((place, [kelvin, _], width), budget): ((DVec3, [f64; 2], f64), &[f32; 8])| {
        let sun = if place.x < 0.0 { sunlight() } else { 0.0 };
        let emitted = -EMISSIVITY * STEFAN_BOLTZMANN * kelvin.powi(4);
        let [sun, emitted] =
            [(sun, budget[0]), (emitted, budget[7])].map(|(known, own)| (f64::from(own) - known).abs());
        let sum: f64 = budget.iter().map(|gain| f64::from(*gain)).sum();
        if is_inside(&(place, [kelvin, 0.0], width)) { sun.max(emitted).max(sum.abs()) } else { 0.0 }
    };
    floor(image).into_iter().zip(budgets).map(off).fold(0.0, f64::max)
}

#[test]
fn the_edge_of_a_shadow_on_foil_lies_where_geometry_says_at_any_mesh() {
    for (response, edge) in [("radiative", 0.5), ("radiative", 4.0), ("network", 0.7)] {
        let [reference, device] = ["cpu", "gpu"].map(|device| image(response, edge, "", device));
        for image in [&reference, &device] {
            let (wrong, within) = wrong(image);
            assert!(wrong == 0 && within > 0.9, "{response}, {edge} m: {wrong} pixels are wrong, {within} are within");
            let off = budget_off(image);
            assert!(off < 1.0, "{response}, {edge} m: budgets are {off} W/m2 off");
        }
        let differs = |(a, b): (&f32, &f32)| (a - b).abs() > 0.02;
        let apart = reference.temperature.iter().zip(&device.temperature).filter(|pair| differs(*pair)).count();
        assert!(apart < 4, "{response}, {edge} m: {apart} pixels differ between the reference and the device");
    }
    let nodes = image("radiative", 0.5, "in_pixels = false\n", "gpu");
    let (wrong, off) = (wrong(&nodes).0, budget_off(&nodes));
    assert!(wrong > 30 && off > 100.0, "nodes alone put the edge into {wrong} pixels, and budgets are {off} W/m2 off");
}

/// The edge of the plate is 2^(1/2) m from its shadow's edge, which lies at 45 deg to the light. The Sun's disc blurs it over 2 x 9.3 mm, and the share of the disc
/// beyond a chord at c radii from its middle is (acos c - c sqrt(1 - c^2)) / pi.
#[test]
fn the_edge_of_a_shadow_is_as_wide_as_the_disc_of_the_sun() {
    let rest = format!("[initial]\ntemperature = {START}\n[shadows]\n");
    let skins = ["floor", "plate"].map(|name| (name, skin("radiative")));
    let text = scene(&skins.each_ref().map(|(name, own)| (*name, own.as_str())), LIT, &rest);
    let near = text.replace("fov_deg = 45", "fov_deg = 0.6");
    let folder = squares(&near, &[("floor", [0.0; 3], true), ("plate", [2.0, 0.0, 1.0], true)]);
    let half = 2.0 * 695_700.0 / 149_597_870.7;
    for device in [&["--device", "cpu"][..], &[]] {
        let ran = run(folder.0.path(), &[&["run", "scene.toml", "-o", "out", "--force"], device].concat());
        assert_eq!(ran.code, 0, "{}", ran.err);
        let mut image = read_exr(&folder.path("out/frames/step_000010.exr")).expect("an image").0;
        image.error = vec![0.0; image.part.len()];
        let (mut off, mut by_middle, mut partly) = (0f64, 0f64, 0);
        for (place, [kelvin, _], _) in floor(&image) {
            let chord = (place.x / half).clamp(-1.0, 1.0);
            let share = (chord.acos() - chord * (1.0 - chord * chord).sqrt()) / PI;
            partly += usize::from(share > 0.05 && share < 0.95);
            off = off.max((kelvin - foil(share, 0.0)).abs());
            by_middle = by_middle.max((kelvin - foil(if chord < 0.0 { 1.0 } else { 0.0 }, 0.0)).abs());
        }
        assert!(partly > 200, "{partly} pixels");
        assert!(off < 12.0 && by_middle > 80.0, "{off} K off, and {by_middle} K from the shadow of a point");
    }
}

/// The uncertainty of a frame of a simulation by absorptivity and emissivity, which are known to 10 %.
#[test]
fn uncertainty_beside_the_edge_of_a_shadow_is_that_of_the_place() {
    let asks = ["absorptivity", "emissivity"]
        .map(|kind| format!("[[uncertainty.parameter]]\nvary = \"{kind}\"\nmaterial = \"floor\"\npercent = 10\n"));
    // 95 % of the values lie within 10 %, so the deviation is 5 %.
    let known = |sun: f64| {
        let by = |of: &dyn Fn(f64) -> f64| (of(1.01) - of(0.99)) / 0.02;
        0.05 * by(&|share| foil(share * sun, 0.0)).hypot(by(&|share| foil_of(share * EMISSIVITY, sun, 0.0)))
    };
    let wrong = |key: &str| {
        let rest = format!("[initial]\ntemperature = {START}\n[shadows]\n{key}[uncertainty]\n{}", asks.concat());
        let skins = ["floor", "plate"].map(|name| (name, skin("radiative")));
        let text = scene(&skins.each_ref().map(|(name, own)| (*name, own.as_str())), LIT, &rest);
        let text = text.replace("[output]\nbudget = true\n", "");
        let folder = squares(&text, &[("floor", [0.0; 3], true), ("plate", [2.0, 0.0, 1.0], true)]);
        let mut simulation = Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene");
        let draw = find_image_sigma(&simulation, 600.0, &never()).expect("an uncertainty");
        simulation.step_to(600.0).expect("it steps");
        let camera = simulation.camera().expect("a camera").clone();
        let mut image = simulation.image(&camera, &Pose::OfCamera).expect("an image");
        draw(&simulation, &mut image);
        image.error = vec![0.0; image.part.len()];
        let sigmas = image.sigma.temperature.iter().zip(&image.part).filter(|(_, part)| **part == 1);
        let off = |(pixel, sigma): &((DVec3, [f64; 2], f64), f64)| {
            let known = known(if pixel.0.x < 0.0 { 1.0 } else { 0.0 });
            is_inside(pixel) && (sigma - known).abs() > 0.1 + 0.02 * known
        };
        let all: Vec<_> = floor(&image).into_iter().zip(sigmas.map(|(sigma, _)| f64::from(*sigma))).collect();
        assert!(all.len() > 200, "{} pixels", all.len());
        all.iter().filter(|pixel| off(pixel)).count()
    };
    assert_eq!(wrong(""), 0);
    let nodes = wrong("in_pixels = false\n");
    assert!(nodes > 30, "nodes alone are wrong in {nodes} pixels");
}

/// A structure that is warmer than the light on its blanket would make it.
#[test]
fn a_blanket_over_a_warm_structure_has_sharp_shadows_too() {
    // C dT/dt = q + BELOW sigma (START^4 - T^4) - EMISSIVITY sigma T^4: a surface that emits to both sides, and receives from one.
    let below = |place: DVec3| {
        let share = BELOW / (EMISSIVITY + BELOW);
        foil_of(EMISSIVITY + BELOW, if place.x < 0.0 { 1.0 } else { 0.0 }, share)
    };
    for device in ["cpu", "gpu"] {
        let (wrong, _) = wrong_beside(&image_over_structure("", device), below);
        assert!(wrong == 0, "{device}: {wrong} pixels are wrong");
    }
    let (nodes, _) = wrong_beside(&image_over_structure("in_pixels = false\n", "gpu"), below);
    assert!(nodes > 30, "nodes alone put the edge into {nodes} pixels");
}

#[test]
fn foil_before_a_warm_plate_has_sharp_shadows_too() {
    let below = |place: DVec3| foil(if place.x < 0.0 { 0.0 } else { 1.0 }, share_of_tiles(place));
    for device in ["cpu", "gpu"] {
        let (wrong, within) = wrong_beside(&image_below_tiles("", device), below);
        assert!(wrong == 0 && within > 0.9, "{device}: {wrong} pixels are wrong, {within} are within");
    }
    let (nodes, _) = wrong_beside(&image_below_tiles("in_pixels = false\n", "gpu"), below);
    assert!(nodes > 30, "nodes alone put the edge into {nodes} pixels");
}
