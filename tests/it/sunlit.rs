//! Images in bands where the Sun counts: shade of the craft on itself, and the day side of the planet, against closed forms.

use std::f64::consts::PI;

use isotherm::Image;
use isotherm::internals::{Band, Prepared, band_radiance_exact};
use serde_json::{Value, json};

use super::bounces::{material, save_quads};
use super::craft::Folder;
use super::model::make::Maker;
use super::reflections::{by_reference, on_device};

/// Sine of the Sun's radius at 1 AU (IAU 2015: 695,700 km over 149,597,870.7 km), and its temperature [K].
const SUN_SINE: f64 = 695_700.0 / 149_597_870.7;
const SUN: f64 = 5772.0;

/// Irradiance of a blackbody Sun in a band [W/m2].
fn sunlight(band: Band) -> f64 {
    PI * SUN_SINE * SUN_SINE * band_radiance_exact(band, SUN)
}

/// A plate of 2 x 2 m that faces the Sun, under a blocker of 1 x 1 m a metre above it. Everything has the temperature of its surroundings.
fn shaded_plate(radiance: &str, sections: &str, finish: &str, target: f64) -> Prepared {
    let folder = Folder::new("");
    let square = |size: f32, z: f32| [[-size, -size, z], [size, -size, z], [size, size, z], [-size, size, z]];
    save_quads(&folder, &[("plate", square(1.0, 0.0)), ("blocker", square(0.5, 1.0))]);
    // The blocker is black, so that no sunlight comes over its underside.
    let [plate, black] = [material("plate", 0.2, finish), material("blocker", 1.0, "")];
    let scene = format!(
        "[model]\npath = \"made.glb\"\n[time]\nstep = 1\nsteps = 1\ndraw_steps = [0]\n[orbit]\naltitude = 408e3\n\
         [attitude]\nmode = \"sun\"\nsun_axis = \"+Z\"\nnorth_axis = \"+Y\"\n[environment]\nplanet_radius = 6371e3\nbackground_temperature = 300\nsolar_constant = 1361\n\
         [initial]\ntemperature = 300\n{black}{plate}[radiance]\nplanet_temperature = 300\n{radiance}\n{sections}\n[camera]\nframe = \"body\"\nnear = 0.01\n\
         width = 9\nheight = 9\nfov_deg = 1\nposition = [3, 0, 0.6]\nlook_at = [{target}, 0, 0]\nup = [0, 0, 1]\n"
    );
    folder.write("scene.toml", &scene);
    folder.prepared()
}

const MID: &str = "band_um = [3, 5]";
const VISIBLE: &str = "band_um = [0.4, 0.8]";

fn middle(image: &Image) -> f64 {
    f64::from(image.radiance[4 * 9 + 4])
}

/// In the shade of a blocker a plate shows its own temperature, because everything has that one. In sunlight it also reflects E / pi.
#[test]
fn a_blocker_shades_a_plate_in_the_image() {
    for band_um in [MID, VISIBLE] {
        for (reflections, sections) in [("traced", ""), ("environment", "[shadows]")] {
            let radiance = format!("{band_um}\nreflections = \"{reflections}\"");
            for device in [true, false] {
                let shown = |target: f64| {
                    let prepared = shaded_plate(&radiance, sections, "", target);
                    let image = if device { on_device(&prepared) } else { by_reference(&prepared) };
                    (middle(&image), prepared.scene.band)
                };
                let ((shade, band), (lit, _)) = (shown(0.0), shown(0.9));
                let own = band_radiance_exact(band, 300.0);
                let sun = 0.8 * sunlight(band) / PI;
                println!(
                    "{band}, {reflections}: {shade:.4} for {own:.4} in shade, {lit:.4} for {:.4} in sunlight",
                    own + sun
                );
                assert!((shade - own).abs() < 1e-4 * (own + sun), "{reflections}: {shade} for {own}");
                assert!((lit / (own + sun) - 1.0).abs() < 1e-4, "{reflections}: {lit} for {}", own + sun);
            }
        }
    }
    let open = shaded_plate(&format!("{MID}\nreflections = \"environment\""), "", "", 0.0);
    let own = band_radiance_exact(open.scene.band, 300.0);
    assert!(middle(&on_device(&open)) > 2.0 * own, "without shadows the plate is lit");
    assert!(open.scene.assumptions.iter().any(|text| text.contains("shades nothing")), "and that is told");
}

/// The glint of a rough mirror is in the shade too.
#[test]
fn a_blocker_shades_a_glint() {
    let finish = "specular = 1\nroughness = 0.5";
    let shown = |reflections: &str, target: f64| {
        let prepared = shaded_plate(&format!("{MID}\nreflections = \"{reflections}\""), "", finish, target);
        (middle(&on_device(&prepared)), band_radiance_exact(prepared.scene.band, 300.0))
    };
    let (shade, own) = shown("traced", 0.0);
    let (glint, _) = shown("environment", 0.0);
    println!("{shade:.4} for {own:.4} in shade, {glint:.4} without it");
    assert!((shade / own - 1.0).abs() < 0.02 && glint > 1.1 * own, "{shade}, {glint} and {own}");
}

/// A craft before the Earth at a phase of its orbit, whose camera looks down past it. Phase 0 is noon.
fn above_earth(phase: f64, band_um: &str, radiance: &str, camera: &str) -> Prepared {
    earth_folder(phase, band_um, radiance, camera).prepared()
}

/// The folder of such a craft.
fn earth_folder(phase: f64, band_um: &str, radiance: &str, camera: &str) -> Folder {
    let folder = Folder::new("");
    save_quads(&folder, &[("plate", [[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]])]);
    let scene = format!(
        "[model]\npath = \"made.glb\"\n[time]\nstep = 1\nsteps = 1\ndraw_steps = [0]\n[orbit]\naltitude = 408e3\nbeta_deg = 0\n\
         phase_deg = {phase}\n[attitude]\nmode = \"nadir\"\nnadir_axis = \"-Z\"\nforward_axis = \"+X\"\n[environment]\nplanet_radius = 6371e3\n\
         background_temperature = 0\nsolar_constant = 1361\nalbedo = 0.3\n[initial]\ntemperature = 1\n[[material]]\nmatch = \"*\"\n\
         absorptivity = 0.2\nemissivity = 0.2\nsides = \"outside\"\nresponse = \"instant\"\n[radiance]\n{band_um}\nbackground = \"planet\"\n\
         planet_temperature = 254.3\n{radiance}\n[camera]\nframe = \"body\"\nnear = 0.01\nwidth = 9\nheight = 9\n{camera}\n"
    );
    folder.write("scene.toml", &scene);
    folder
}

const DOWN: &str = "fov_deg = 0.1\nposition = [5, 0, 0]\nlook_at = [5, 0, -10]\nup = [1, 0, 0]";

/// The point below the craft reflects albedo E cos z / pi by day, and nothing at night. NUMERICS.md 5 has 2.08 beside 0.27 W/m2/sr in 3 to 5 um.
#[test]
fn the_day_side_of_the_planet_reflects_sunlight() {
    for band_um in [MID, VISIBLE] {
        for phase in [0.0_f64, 40.0, 80.0, 95.0, 180.0] {
            let prepared = above_earth(phase, band_um, "", DOWN);
            let band = prepared.scene.band;
            let (own, sun) = (band_radiance_exact(band, 254.3), 0.3 * sunlight(band) / PI);
            let expected = own + sun * phase.to_radians().cos().max(0.0);
            for image in [on_device(&prepared), by_reference(&prepared)] {
                let found = middle(&image);
                println!("{band}, {phase} deg: {found:.4} for {expected:.4}");
                assert!((found - expected).abs() < 2e-3 * sun + 1e-5 * own, "{phase}: {found} for {expected}");
            }
            let mid = (band.upper - 5e-6).abs() < 1e-9;
            assert!(!mid || (sun / 2.08 - 1.0).abs() < 0.02 && (own / 0.27 - 1.0).abs() < 0.02, "{sun} and {own}");
        }
    }
    let dark = above_earth(0.0, MID, "planet_albedo = 0", DOWN);
    let own = band_radiance_exact(dark.scene.band, 254.3);
    assert!((middle(&on_device(&dark)) / own - 1.0).abs() < 1e-4);
    let far = above_earth(0.0, "band_um = [8, 14]", "", DOWN);
    let own = band_radiance_exact(far.scene.band, 254.3);
    assert!(
        (middle(&on_device(&far)) / own - 1.0).abs() < 1e-4,
        "no albedo of the heat balance in the thermal infrared"
    );
}

/// A map of albedos with 0.7 east of orbit noon and 0.1 west of it: the point below the craft reflects its own, in a band by itself and among others.
#[test]
fn the_day_side_has_the_albedo_of_its_place() {
    let map =
        "planet_albedo_map = { file = \"albedo.png\", scale = 0.01, offset = 0, pole = [0, 0, 1], longitude_deg = 0 }";
    for (phase, albedo) in [(40.0_f64, 0.7), (-40.0, 0.1), (180.0, 0.7)] {
        let shown = |band_um: &str, bands: &str| {
            let folder = earth_folder(phase, band_um, &format!("{map}\n{bands}"), DOWN);
            let file = std::fs::File::create(folder.path("albedo.png")).expect("a file");
            let mut encoder = png::Encoder::new(file, 8, 4);
            encoder.set_color(png::ColorType::Grayscale);
            let values: Vec<u8> = (0..32).map(|cell| if cell % 8 < 4 { 10 } else { 70 }).collect();
            encoder.write_header().and_then(|mut writer| writer.write_image_data(&values)).expect("a picture");
            folder.prepared()
        };
        let alone = shown(MID, "");
        let band = alone.scene.band;
        let (own, sun) = (band_radiance_exact(band, 254.3), sunlight(band) / PI);
        let expected = own + albedo * sun * phase.to_radians().cos().max(0.0);
        for image in [on_device(&alone), by_reference(&alone)] {
            let found = middle(&image);
            println!("{phase} deg: {found:.4} for {expected:.4}");
            assert!((found - expected).abs() < 2e-3 * sun, "{phase}: {found} for {expected}");
        }
        let both =
            shown("", "[[band]]\nname = \"long\"\nband_um = [8, 14]\n[[band]]\nname = \"mid\"\nband_um = [3, 5]");
        let image = super::bands::seen(&both, true);
        let found = f64::from(image.bands.images[1].radiance[4 * 9 + 4]);
        assert!((found - expected).abs() < 2e-3 * sun, "{phase}, among others: {found} for {expected}");
        let long = Band { lower: 8e-6, upper: 14e-6 };
        assert!((middle(&image) / band_radiance_exact(long, 254.3) - 1.0).abs() < 1e-4, "no sunlight in the long band");
    }
}

/// A diffuse plate over the Earth reflects the radiance of the disc weighted by the cosine, summed here over directions.
#[test]
fn a_diffuse_plate_reflects_the_day_side() {
    let camera = "fov_deg = 1\nposition = [0, 0, -9]\nlook_at = [0, 0, 0]\nup = [1, 0, 0]";
    for phase in [0.0_f64, 60.0, 90.0] {
        let prepared = above_earth(phase, MID, "reflections = \"environment\"", camera);
        let band = prepared.scene.band;
        let (own, sun) = (band_radiance_exact(band, 254.3), 0.3 * sunlight(band) / PI);
        // Nadir is +Z here, and the Sun stands at an angle of pi - phase from it.
        let (distance, steps) = (6_779.0 / 6_371.0_f64, 1000);
        let sun_at = [-phase.to_radians().sin(), -phase.to_radians().cos()];
        let limb = (1.0 / distance).asin();
        let mut sum = 0.0;
        for row in 0..steps {
            let angle = (row as f64 + 0.5) / f64::from(steps) * limb;
            let (sine, cosine) = angle.sin_cos();
            let reach = distance * cosine - (1.0 - distance * distance * sine * sine).max(0.0).sqrt();
            for column in 0..90 {
                let azimuth = (f64::from(column) + 0.5) / 90.0 * 2.0 * PI;
                let point = [reach * sine * azimuth.cos(), reach * cosine - distance];
                let height = (point[0] * sun_at[0] + point[1] * sun_at[1]).max(0.0);
                sum += (own + sun * height) * sine * cosine * limb / f64::from(steps) * 2.0 * PI / 90.0;
            }
        }
        let expected = 0.8 * sum / PI;
        for image in [on_device(&prepared), by_reference(&prepared)] {
            let found = middle(&image);
            println!("{phase} deg: {found:.4} for {expected:.4}");
            assert!((found / expected - 1.0).abs() < 0.01, "{phase}: {found} for {expected}");
        }
    }
}

/// Mean radiances of blocks of pixels by Mitsuba over that of the Sun (`tools/peer_bench/sunlit_mitsuba.py`, with its command).
const MITSUBA: &str = include_str!("../../tools/oracle/data/sunlit.json");

/// The mean radiance of each block of 16 x 16 pixels of an image of 64 x 48.
fn blocks(image: &Image) -> Vec<f64> {
    let of_block = |block: usize| {
        let (down, across) = (block / 4 * 16, block % 4 * 16);
        let rows = (down..down + 16).map(|row| &image.radiance[64 * row + across..64 * row + across + 16]);
        rows.flatten().map(|value| f64::from(*value)).sum::<f64>() / 256.0
    };
    (0..12).map(of_block).collect()
}

/// A sphere of radius 1 with the normals of one, about Z.
fn save_sphere(folder: &Folder) {
    let (rings, sectors) = (48u16, 96u16);
    let place = |ring: u16, sector: u16| {
        let (sine, cosine) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        let (y, x) = (2.0 * PI * f64::from(sector) / f64::from(sectors)).sin_cos();
        [(sine * x) as f32, (sine * y) as f32, cosine as f32]
    };
    let places: Vec<[f32; 3]> = (0..=rings).flat_map(|ring| (0..sectors).map(move |at| place(ring, at))).collect();
    let quad = |ring: u16, sector: u16| {
        let next = (sector + 1) % sectors;
        let [a, b, c, d] =
            [(0, sector), (1, sector), (1, next), (0, next)].map(|(down, at)| (ring + down) * sectors + at);
        [a, b, c, a, c, d]
    };
    let indices: Vec<u16> = (0..rings).flat_map(|ring| (0..sectors).flat_map(move |at| quad(ring, at))).collect();
    let mut maker = Maker::new();
    maker.push("materials", json!({ "name": "plate" }));
    let [positions, normals] = [maker.floats(&places), maker.floats(&places)];
    let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
    let count = indices.len();
    let indices = maker.accessor(&bytes, json!({"componentType": 5123, "count": count, "type": "SCALAR"}));
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    maker.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
    maker.save(folder.0.path());
}

/// The scenes of the script, in a band.
fn like_mitsuba(name: &str, band_um: &str, shown: &str) -> Prepared {
    let image = "width = 64\nheight = 48\nup = [0, 0, 1]";
    if name == "earth" {
        let camera = "fov_deg = 60\nposition = [5, 0, 0]\nlook_at = [6.43, 0, -1]\nup = [0, 0, 1]";
        let folder = earth_folder(80.0, band_um, shown, camera);
        let scene = std::fs::read_to_string(folder.path("scene.toml")).expect("a scene");
        let scene = scene.replace("width = 9\nheight = 9", "width = 64\nheight = 48");
        folder.write("scene.toml", &scene.replace("planet_temperature = 254.3", "planet_temperature = 1"));
        return folder.prepared();
    }
    let folder = Folder::new("");
    let square = |size: f32, z: f32| [[-size, -size, z], [size, -size, z], [size, size, z], [-size, size, z]];
    let (sun, camera) = if name == "plate" {
        save_quads(&folder, &[("plate", square(1.0, 0.0)), ("blocker", square(0.5, 1.0))]);
        ("[0.3, 0.2, 1]", "fov_deg = 50\nposition = [2.5, -2.5, 2.2]")
    } else {
        save_sphere(&folder);
        ("[1, 0, 0]", "fov_deg = 25\nposition = [3, -5, 0]")
    };
    let materials = [material("plate", 0.2, ""), material("blocker", 1.0, "")];
    let used = if name == "plate" { materials.concat() } else { materials[0].clone() };
    folder.write(
        "scene.toml",
        &format!(
            "[model]\npath = \"made.glb\"\n[time]\nstep = 1\nsteps = 1\ndraw_steps = [0]\n[orbit]\naltitude = 408e3\n[attitude]\nmode = \"sun\"\n\
             sun_axis = {sun}\nnorth_axis = \"+Y\"\n[environment]\nplanet_radius = 6371e3\nbackground_temperature = 0\nsolar_constant = 1361\n\
             [initial]\ntemperature = 1\n{used}[radiance]\nplanet_temperature = 1\n{band_um}\nreflections = \"traced\"\n{shown}\n\
             [camera]\nframe = \"body\"\nnear = 0.01\nlook_at = [0, 0, 0]\n{camera}\n{image}\n"
        ),
    );
    folder.prepared()
}

/// A plate behind a blocker, a sphere with its terminator, and the day side of the Earth up to its limb, against Mitsuba with a Sun of the same solid angle.
#[test]
fn mitsuba_sees_the_same_sunlight() {
    let truth: Value = serde_json::from_str(MITSUBA).expect("JSON");
    for name in ["plate", "sphere", "earth"] {
        let truth: Vec<f64> = serde_json::from_value(truth[name].clone()).expect("numbers");
        let most = truth.iter().copied().fold(0.0, f64::max);
        let off = |image: &Image, band: Band| {
            let sun = band_radiance_exact(band, SUN);
            let apart = blocks(image).into_iter().zip(&truth).map(|(found, truth)| (found / sun - truth).abs());
            apart.fold(0.0, f64::max) / most
        };
        for band_um in [MID, VISIBLE] {
            let prepared = like_mitsuba(name, band_um, "");
            let band = prepared.scene.band;
            let [device, reference] = [on_device(&prepared), by_reference(&prepared)].map(|image| off(&image, band));
            println!("{name}, {band}: device {device:.4}, f64 {reference:.4} of the brightest block");
            assert!(device < 0.02 && reference < 0.02, "{name}: {device} and {reference}");
        }
    }
    let dark = like_mitsuba("earth", MID, "planet_albedo = 0.29");
    let truth: Vec<f64> = serde_json::from_value(truth["earth"].clone()).expect("numbers");
    let found = blocks(&on_device(&dark))[9] / band_radiance_exact(dark.scene.band, SUN);
    assert!((found / truth[9] - 1.0).abs() > 0.02, "another albedo must show: {found} for {}", truth[9]);
}
