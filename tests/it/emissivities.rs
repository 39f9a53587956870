//! Emissivity by angle and wavelength, and planets that are not uniform: the device against f64, and exact answers.

use isotherm::internals::{Band, DeviceData, Prepared, band_radiance_exact, fresnel_reflectivity};
use isotherm::{Image, internals};

use super::craft::{Folder, scene_with};
use super::reflections::{apart, by_reference, isothermal, on_device, shining};

/// Laws of the three materials: a dielectric, a measured one over angle and wavelength, and one over wavelength alone.
const LAWS: [(&str, &str); 3] = [
    ("roughness = 0.2", "roughness = 0.2\nemissivity_by_angle = { law = 'fresnel', n = 5, k = 9 }"),
    (
        "specular = 0.9",
        "specular = 0.9\nemissivity_by_angle = { law = 'table', angle_deg = [0, 30, 60, 80, 90], emissivity = [0.5, 0.52, 0.6, 0.9, 0.1] }\n\
         emissivity_by_wavelength = { wavelength_um = [7, 9, 10, 15], emissivity = [0.2, 0.35, 0.1, 0.3] }",
    ),
    (
        "[[probe]]",
        "[[material]]\nmatch = 'nothing'\nabsorptivity = 0.5\nemissivity = 0.5\nresponse = 'instant'\n[[probe]]",
    ),
];

fn with_laws(changes: &[(&str, &str)]) -> String {
    let mut all = LAWS.to_vec();
    all.extend(changes);
    shining(&all)
}

/// The laws without reflections and without a sky.
fn only_emitting(law: &str) -> String {
    scene_with(&[("emissivity = 0.83", &format!("emissivity = 0.83\n{law}"))])
}

fn check(name: &str, found: &Image, expected: &Image, wrong: &Image, tolerance: f64) {
    let ([sky, surface], worst) = apart(found, expected, tolerance);
    println!("{name}: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}");
    assert!(sky < 0.005 && surface < 0.01, "{name}: {sky} of the sky and {surface} of the surfaces differ");
    let ([_, surface], _) = apart(found, wrong, tolerance);
    assert!(surface > 0.05, "{name}: another value must show in {surface} of the surfaces");
}

#[test]
fn the_device_follows_the_laws_as_the_reference() {
    let four = [("fov_deg = 45", "fov_deg = 45\nsamples = 4"), ("channels = [\"emitted\", \"reflected\"]", "")];
    for (name, changes) in [("one sample", &[][..]), ("four samples", &four[..])] {
        let (scene, other) = (with_laws(changes), with_laws(changes).replace("n = 5", "n = 4").replace("0.35", "0.3"));
        let [found, wrong] = [&scene, &other].map(|scene| Folder::new(scene).prepared());
        check(name, &on_device(&found), &by_reference(&found), &by_reference(&wrong), 1e-4);
    }
    let law = "emissivity_by_angle = { law = 'fresnel', n = 1.5, k = 0.1 }";
    let [found, wrong] = [law, &law.replace("1.5", "1.6")].map(|law| Folder::new(&only_emitting(law)).prepared());
    check("emission alone", &on_device(&found), &by_reference(&found), &by_reference(&wrong), 1e-4);
}

/// The box seen from above: one face along its normal and, from the side, at 60 deg.
#[test]
fn a_face_emits_as_its_law_says() {
    let band = Band { lower: 8e-6, upper: 14e-6 };
    for (angle, cosine) in [(0.0_f64, 1.0), (60.0, 0.5)] {
        let (sin, cos) = angle.to_radians().sin_cos();
        let camera = format!("position = [{}, 0.0, {}]", 1e4 * sin, -1e4 * cos - 1.0);
        let scene = only_emitting("emissivity_by_angle = { law = 'fresnel', n = 1.5, k = 0.1 }");
        let scene = scene
            .replace("position = [6.5, 5, -7.5]", &camera)
            .replace("look_at = [0, 0, 0]\nup = [0, 0, -1]", "look_at = [-0.4, 0.3, -1]\nup = [0, 1, 0]")
            .replace("fov_deg = 45", "fov_deg = 0.01")
            .replace("[[probe]]", "[initial]\ntemperature = 300\n[[probe]]");
        let prepared = Folder::new(&scene).prepared();
        let expected = (1.0 - fresnel_reflectivity(1.5, 0.1, cosine)) * band_radiance_exact(band, 300.0);
        for found in [on_device(&prepared), by_reference(&prepared)] {
            let centre = 36 * 96 + 48;
            let radiance = f64::from(found.radiance[centre]);
            assert_eq!(found.material[centre], 1, "the skin at {angle} deg");
            assert!((radiance / expected - 1.0).abs() < 2e-4, "{angle} deg: {radiance} against {expected}");
            assert!((radiance / (0.83 * band_radiance_exact(band, 300.0)) - 1.0).abs() > 0.02, "not the thermal one");
        }
    }
}

#[test]
fn laws_and_maps_look_black_in_an_isothermal_cavity() {
    let black = band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, 287.0);
    let worst = |planet: &str| {
        let scene = LAWS.iter().fold(isothermal("287", "287"), |scene, (from, to)| scene.replacen(from, to, 1));
        let folder = Folder::new(&scene.replace("planet_temperature = 287", planet));
        write_map(&folder, |_, _| 107);
        let found = on_device(&folder.prepared());
        let radiances = found.radiance.iter().map(|radiance| f64::from(*radiance));
        radiances.map(|radiance| (radiance / black - 1.0).abs()).fold(0.0, f64::max)
    };
    for planet in [
        "planet_temperature = 287",
        "planet_day_night = { day = 287, night = 287, law = 'cosine' }",
        &map("scale = 1, offset = 180"),
    ] {
        assert!(worst(planet) < 3e-5, "{planet}: {:e}", worst(planet));
    }
    assert!(worst(&map("scale = 1, offset = 180.1")) > 1e-3, "a warmer planet must show");
}

/// A map in the folder of a scene: value at a column and row of 64 x 32.
fn write_map(folder: &Folder, value: impl Fn(usize, usize) -> u8) {
    let file = std::fs::File::create(folder.path("map.png")).expect("a file");
    let mut encoder = png::Encoder::new(file, 64, 32);
    encoder.set_color(png::ColorType::Grayscale);
    let values: Vec<u8> = (0..2048).map(|cell| value(cell % 64, cell / 64)).collect();
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&values)).expect("a picture");
}

fn map(keys: &str) -> String {
    format!("planet_map = {{ file = 'map.png', {keys} }}")
}

/// Warm and cold stripes along both axes.
fn stripes(column: usize, row: usize) -> u8 {
    (90.0 + 40.0 * (0.4 * column as f64).sin() + 40.0 * (0.5 * row as f64).sin()) as u8
}

/// A scene with a planet of this kind, and its folder with a map.
fn under(planet: &str, changes: &[(&str, &str)]) -> Prepared {
    let shown = format!("background = \"planet\"\n{planet}");
    let mut all = vec![("background = \"planet\"", shown.as_str())];
    all.extend(changes);
    let folder = Folder::new(&shining(&all));
    write_map(&folder, stripes);
    folder.prepared()
}

#[test]
fn the_device_sees_a_planet_with_a_map_as_the_reference() {
    let turned = "scale = 0.6, offset = 200, pole = [0, 0.6, 0.8], longitude_deg = 20, period = 90000";
    let day_night = "planet_day_night = { day = 310, night = 220, law = 'cosine' }".to_owned();
    for (name, planet, other) in [
        ("a map", map("scale = 0.6, offset = 200"), map("scale = 0.6, offset = 205")),
        ("a turned map", map(turned), map(&turned.replace("20, p", "28, p"))),
        ("day and night", day_night.clone(), day_night.replace("310", "315")),
        (
            "a terminator",
            day_night.replace("cosine", "step"),
            day_night.replace("cosine", "step").replace("310", "315"),
        ),
    ] {
        for (kind, changes) in [
            ("a smooth mirror", &[("roughness = 0.2", "roughness = 0")][..]),
            ("a rough one at 2000 km", &[("altitude = 408e3", "altitude = 2e6"), LAWS[0], LAWS[1]][..]),
        ] {
            let (prepared, wrong) = (under(&planet, changes), under(&other, changes));
            // A terminator is half a degree wide, and f32 is off by 1e-4 of that at the limb.
            let tolerance = if name == "a terminator" { 1e-3 } else { 3e-4 };
            check(
                &format!("{name}, {kind}"),
                &on_device(&prepared),
                &by_reference(&prepared),
                &by_reference(&wrong),
                tolerance,
            );
        }
    }
}

/// Behind the craft the planet shows the temperature of the place that the ray meets, and the craft hides it.
#[test]
fn a_map_shows_behind_the_craft_and_not_through_it() {
    let uniform = by_reference(&under("planet_temperature = 250", &[]));
    let mapped = on_device(&under(&map("scale = 0.6, offset = 200"), &[]));
    let of = |pixels: &Image, seen: bool| -> Vec<f64> {
        let shown = pixels.radiance.iter().zip(&pixels.part);
        shown.filter(|(_, part)| (**part == 0) == seen).map(|(radiance, _)| f64::from(*radiance)).collect()
    };
    let plain = on_device(&under("planet_temperature = 250", &[]));
    assert_eq!((&mapped.part, &mapped.material), (&plain.part, &plain.material));
    let spread = |radiances: &[f64]| {
        let lit = radiances.iter().copied().filter(|radiance| *radiance > 1.0);
        lit.clone().fold(0.0, f64::max) - lit.fold(f64::INFINITY, f64::min)
    };
    assert!(spread(&of(&uniform, true)) < 1e-3 && spread(&of(&mapped, true)) > 5.0);
}

#[test]
fn an_exr_and_a_png_give_the_same_planet() {
    use exr::prelude::{SpecificChannels, WritableImage as _};
    let folder = Folder::new(&shining(&[(
        "background = \"planet\"",
        "background = \"planet\"\nplanet_map = { file = 'map.exr' }",
    )]));
    let kelvin = |place: exr::prelude::Vec2<usize>| (200.0 + 0.6 * f32::from(stripes(place.x(), place.y())),);
    let channels = SpecificChannels::build().with_channel::<f32>("T").with_pixel_fn(kelvin);
    let image = exr::prelude::Image::from_channels((64, 32), channels);
    image.write().to_file(folder.path("map.exr")).expect("an image");
    let (found, expected) =
        (by_reference(&folder.prepared()), by_reference(&under(&map("scale = 0.6, offset = 200"), &[])));
    let (differences, _) = apart(&found, &expected, 1e-5);
    assert_eq!(differences, [0.0; 2]);
}

#[test]
fn laws_and_maps_are_absent_where_a_scene_has_none() {
    let resources =
        [&internals::EMISSIVITIES, &internals::PLANET_VIEW, &internals::PLANET_MAP, &internals::PLANET_MEANS];
    let planned = |prepared: &Prepared| {
        let data = DeviceData::new(prepared);
        let plan = data.scene_data(prepared, prepared.scene.camera.as_ref()).plan();
        resources.map(|resource| plan.iter().any(|planned| planned.resource == resource))
    };
    assert_eq!(planned(&under("planet_temperature = 250", &[])), [false; 4]);
    assert_eq!(planned(&Folder::new(&with_laws(&[])).prepared()), [true, false, false, false]);
    assert_eq!(planned(&under(&map("scale = 0.6, offset = 200"), &[])), [false, true, true, true]);
    let sky = [("reflections = \"environment\"\n", ""), ("channels = [\"emitted\", \"reflected\"]", "")];
    assert_eq!(planned(&under(&map("scale = 0.6, offset = 200"), &sky)), [false, true, true, false]);
}

/// Drawn slopes show where a mirror is smooth, alike on the device and in f64, and heat nothing.
#[test]
fn drawn_slopes_are_those_of_the_seed() {
    let scene = |seed: &str, slope: &str| {
        let drawn = format!("roughness = 0\nnormal_slope_variance = 0.01{slope}{seed}");
        Folder::new(&shining(&[("roughness = 0.2", &drawn), ("max_edge = 0.7", "max_edge = 0.2")])).prepared()
    };
    let drawn = "\nnormal_slope = 'drawn'\n";
    let (found, other) = (scene("normal_seed = 5", drawn), scene("normal_seed = 6", drawn));
    let image = on_device(&found);
    check("drawn slopes", &image, &by_reference(&found), &by_reference(&other), 1e-3);
    // As much light as where the waves are averaged.
    let averaged = on_device(&scene("", ""));
    let mean = |pixels: &Image| {
        let skin = pixels.material.iter().zip(&pixels.reflected).filter(|(material, _)| **material == 1);
        let values: Vec<f64> = skin.map(|(_, reflected)| f64::from(*reflected)).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    println!("reflected: drawn {:.3}, averaged {:.3}", mean(&image), mean(&averaged));
    assert!((mean(&image) / mean(&averaged) - 1.0).abs() < 0.05);
    let temperatures = |pixels: &Image| pixels.temperature.clone();
    assert_eq!(temperatures(&image), temperatures(&averaged));
}

/// What only the model, the band or the pixels of a file can tell.
#[test]
fn what_cannot_be_is_refused_when_the_scene_is_prepared() {
    let refused = |scene: &str, expected: &str| {
        let folder = Folder::new(scene);
        write_map(&folder, stripes);
        let message = match Prepared::new(&folder.path("scene.toml"), &mut |_| ()) {
            Ok(_) => panic!("a refusal: {expected}"),
            Err(error) => error.to_string(),
        };
        assert!(message.contains(expected), "expected {expected}\n found {message}");
    };
    let law = |law: &str| only_emitting(law);
    refused(
        &law("emissivity_by_wavelength = { wavelength_um = [8, 12], emissivity = [0.5, 0.6] }"),
        "material 'skin': emissivity_by_wavelength runs from 8 to 12 um and must cover the band, 8 to 14 um",
    );
    refused(
        &law("emissivity_by_angle = { law = 'table', angle_deg = [0, 90], emissivity = [0.5, 1] }\n\
              emissivity_by_wavelength = { wavelength_um = [8, 14], emissivity = [0.6, 0.6] }"),
        "material 'skin': emissivity_by_angle and emissivity_by_wavelength together exceed 1",
    );
    let shown = |planet: &str| shining(&[("background = \"planet\"", &format!("background = \"planet\"\n{planet}"))]);
    refused(&shown(&map("scale = -3, offset = 100")), "radiance.planet_map.file: ");
    refused(&shown("planet_map = { file = 'made.glb' }"), "is neither a PNG nor an EXR that can be read");
    let prepared = Folder::new(&law("emissivity_by_angle = { law = 'fresnel', n = 20, k = 40 }")).prepared();
    let told = "material 'skin': the mean of emissivity_by_angle over the hemisphere is 0.0";
    assert!(prepared.warnings.iter().any(|warning| warning.contains(told)), "{:?}", prepared.warnings);
}
