//! Light in pixels: the edge of a shadow on foil lies where geometry says, whatever the mesh.

use glam::{DVec2, DVec3};
use isotherm::Image;
use isotherm::internals::{STEFAN_BOLTZMANN, read_exr};

use super::budget::{LIT, scene, squares, sunlight};
use super::program::run;

const CAPACITY: f64 = 400.0;
const EMISSIVITY: f64 = 0.8;
const START: f64 = 300.0;

/// Temperature of foil [K] after the ten steps of a minute, with a share of the sunlight. Steps of a tenth of a second.
fn foil(share: f64) -> f64 {
    let rate = |t: f64| (share * sunlight() - EMISSIVITY * STEFAN_BOLTZMANN * t.powi(4)) / CAPACITY;
    (0..6000).fold(START, |kelvin, _| kelvin + 0.1 * rate(kelvin + 0.05 * rate(kelvin)))
}

/// A floor of foil, and a plate 1 m above it whose shadow covers the floor's half of x > 0 under a Sun 45 deg above +x.
fn image(response: &str, edge: f64, key: &str, device: &str) -> Image {
    let own = format!(
        "emissivity = {EMISSIVITY}\nheat_capacity_per_area = {CAPACITY}\nthickness = 0.0001\nconductivity = 0\nsides = \"outside\"\nresponse = \"{response}\"\n"
    );
    let rest = format!("[initial]\ntemperature = {START}\n[shadows]\n{key}[network]\ncontacts = \"stated\"\n");
    let text = scene(&[("floor", &own), ("plate", &own)], LIT, &rest);
    let text =
        text.replace("max_edge = 0.5", &format!("max_edge = {edge}")).replace("budget = true\n", "error = true\n");
    let text = if response == "network" { text } else { text.replace("[network]\ncontacts = \"stated\"\n", "") };
    let folder = squares(&text, &[("floor", [0.0; 3], true), ("plate", [2.0, 0.0, 1.0], true)]);
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
    // Rims of the floor are left out: the centre of their pixels shows something else, and takes no change.
    pixels.filter(|(place, ..)| place.z.abs() < 1e-3).collect()
}

/// Pixels more than their width away from the edge that are wrong by more than 1 K, and the share of all pixels that lie within twice of their stated error.
fn wrong(image: &Image) -> (usize, f64) {
    let [lit, dark] = [1.0, 0.0].map(foil);
    let all = floor(image);
    assert!(all.len() > 200 && lit - dark > 100.0, "{} pixels, {lit} and {dark} K", all.len());
    let off =
        |(place, [kelvin, _], _): &(DVec3, [f64; 2], f64)| (kelvin - if place.x < 0.0 { lit } else { dark }).abs();
    let wrong = all.iter().filter(|pixel| pixel.0.x.abs() > pixel.2 && off(pixel) > 1.0).count();
    let within = all.iter().filter(|pixel| off(pixel) <= 2.0 * pixel.1[1] + 0.05).count();
    (wrong, within as f64 / all.len() as f64)
}

#[test]
fn the_edge_of_a_shadow_on_foil_lies_where_geometry_says_at_any_mesh() {
    for (response, edge) in [("radiative", 0.5), ("radiative", 4.0), ("network", 0.7)] {
        let [reference, device] = ["cpu", "gpu"].map(|device| image(response, edge, "", device));
        for image in [&reference, &device] {
            let (wrong, within) = wrong(image);
            assert!(wrong == 0 && within > 0.9, "{response}, {edge} m: {wrong} pixels are wrong, {within} are within");
        }
        let differs = |(a, b): (&f32, &f32)| (a - b).abs() > 0.02;
        let apart = reference.temperature.iter().zip(&device.temperature).filter(|pair| differs(*pair)).count();
        assert!(apart < 4, "{response}, {edge} m: {apart} pixels differ between the reference and the device");
    }
    let (wrong, _) = wrong(&image("radiative", 0.5, "in_pixels = false\n", "gpu"));
    assert!(wrong > 30, "nodes alone put the edge into {wrong} pixels");
}
