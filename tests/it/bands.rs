//! Several bands of one camera: radiances against closed forms, the same pixels in every band, the ratio of two bands, and what is refused.

use std::f64::consts::PI;

use isotherm::internals::{Band, Prepared, StepResult, band_radiance_exact, read_exr, run, start};
use isotherm::{EngineError, Image, Target};
use serde_json::json;

use super::bounces::{Corners, material, save_quads};
use super::craft::{Folder, never, scene_with};
use super::device::{assert_silent, context};
use super::model::make::Maker;
use super::program::{isotherm, refusal, succeed};
use super::reflections::{apart, by_reference, on_device};

/// Sine of the Sun's radius at 1 AU (IAU 2015: 695,700 km over 149,597,870.7 km), and its temperature [K].
const SUN_SINE: f64 = 695_700.0 / 149_597_870.7;
const SUN: f64 = 5772.0;

const MID: Band = Band { lower: 3e-6, upper: 5e-6 };
const LONG: Band = Band { lower: 8e-6, upper: 14e-6 };
const VISIBLE: Band = Band { lower: 0.4e-6, upper: 0.8e-6 };

const SQUARE: Corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];

/// A plate that faces the Sun and the camera. `sections` stand before the camera.
fn plate(temperature: f64, finish: &str, sections: &str) -> String {
    format!(
        "[model]\npath = \"made.glb\"\n[time]\nstep = 1\nsteps = 1\ndraw_steps = [0]\n[orbit]\naltitude = 408e3\n\
         [attitude]\nmode = \"sun\"\nsun_axis = \"+Z\"\nnorth_axis = \"+Y\"\n[environment]\nplanet_radius = 6371e3\nbackground_temperature = 0\n\
         solar_constant = 1361\n[initial]\ntemperature = {temperature}\n{finish}{sections}\n[camera]\nframe = \"body\"\nnear = 0.01\n\
         width = 9\nheight = 9\nfov_deg = 1\nposition = [1, 0, 3]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\n"
    )
}

fn plate_folder(scene: &str) -> Folder {
    let folder = Folder::new("");
    save_quads(&folder, &[("plate", SQUARE)]);
    folder.write("scene.toml", scene);
    folder
}

/// The images of a run.
fn images(prepared: &Prepared, device: bool) -> Vec<Image> {
    let context = context();
    let target = if device { Target::Device(context.clone()) } else { Target::Reference };
    let mut engine = target.engine(prepared, prepared.scene.camera.as_ref()).expect("a small scene");
    start(prepared, &mut *engine, None, &never(), &mut || ()).expect("a start");
    let mut seen = Vec::new();
    let mut take = |result: StepResult| {
        seen.extend(result.delivered.image);
        Ok::<_, EngineError>(())
    };
    assert!(run(prepared, &mut *engine, None, &never(), &mut take).expect("a run"));
    drop(engine);
    assert_silent(&context);
    seen
}

/// The first image of a run.
pub fn seen(prepared: &Prepared, device: bool) -> Image {
    images(prepared, device).swap_remove(0)
}

/// The plate's model with a base colour.
fn save_coloured(folder: &Folder, [red, green, blue]: [f64; 3]) {
    let mut maker = Maker::new();
    maker.json["nodes"] = json!([]);
    maker.json["scenes"][0]["nodes"] = json!([0]);
    let factor = json!([red, green, blue, 1]);
    maker.push("materials", json!({"name": "plate", "pbrMetallicRoughness": {"baseColorFactor": factor}}));
    let positions = maker.floats(&SQUARE);
    let indices = maker.accessor(&[0u8, 1, 2, 0, 2, 3], json!({"componentType": 5121, "count": 6, "type": "SCALAR"}));
    let attributes = json!({ "POSITION": positions });
    let mesh = maker.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
    maker.push("nodes", json!({"name": "plate", "mesh": mesh}));
    maker.save(folder.0.path());
}

fn middle(values: &[f32]) -> f64 {
    f64::from(values[4 * 9 + 4])
}

fn is_near(found: f64, expected: f64, tolerance: f64) -> bool {
    (found / expected - 1.0).abs() < tolerance
}

const THREE: &str = "[[band]]\nname = \"long\"\nband_um = [8, 14]\n[[band]]\nname = \"mid\"\nband_um = [3, 5]\n\
                     [[band]]\nname = \"curve\"\nresponse = \"curve.csv\"\n";
const CURVE: &str = "wavelength_um,response\n7,0\n9,0.6\n10,1.2\n13,0.1\n";

/// A plate in the dark: emissivity times Planck's law in each band, and scipy's integral for the response (tests/oracle/bands.py).
#[test]
fn each_band_has_the_radiance_of_its_wavelengths() {
    let scene = plate(300.0, &material("plate", 0.8, ""), THREE).replace("solar_constant = 1361\n", "");
    let folder = plate_folder(&scene);
    folder.write("curve.csv", CURVE);
    let prepared = folder.prepared();
    let expected =
        [0.8 * band_radiance_exact(LONG, 300.0), 0.8 * band_radiance_exact(MID, 300.0), 0.8 * 27.494_093_025_193_31];
    for device in [true, false] {
        let image = seen(&prepared, device);
        for (band, expected) in image.bands.images.iter().zip(expected) {
            let found = middle(&band.radiance);
            println!("{found:.6} for {expected:.6}");
            assert!(is_near(found, expected, 3e-6), "{found} for {expected}");
            assert!(!is_near(found, 1.001 * expected, 3e-4));
        }
        assert_eq!(image.bands.images.len(), 3);
        assert_eq!(image.bands.images[0].radiance, image.radiance, "L is the first band");
    }
}

/// Bands of the craft in orbit, and each of them alone: the same pixels, bit for bit.
#[test]
fn a_band_among_others_is_the_band_alone() {
    let light = "reflections = \"environment\"\nbackground = \"planet\"\nplanet_temperature = 255";
    let with = |bands: &str| scene_with(&[("[radiance]\nband_um = [8, 14]", &format!("[radiance]\n{light}\n{bands}"))]);
    let all = Folder::new(&with("[[band]]\nname = \"a\"\nband_um = [8, 14]\n[[band]]\nname = \"b\"\nband_um = [3, 5]"))
        .prepared();
    let both = seen(&all, true);
    for (place, band) in ["[8, 14]", "[3, 5]"].iter().enumerate() {
        let alone = on_device(&Folder::new(&with(&format!("band_um = {band}"))).prepared());
        assert_eq!(both.bands.images[place].radiance, alone.radiance, "{band}");
        assert_eq!((&both.temperature, &both.part, &both.depth), (&alone.temperature, &alone.part, &alone.depth));
    }
    assert_ne!(both.bands.images[0].radiance, both.bands.images[1].radiance);
    let twin = by_reference(&Folder::new(&with("band_um = [3, 5]")).prepared());
    let of_twin = seen(&all, false).bands.images.swap_remove(1).radiance;
    let ([sky, surface], _) = apart(&Image { radiance: of_twin, ..twin.clone() }, &twin, 1e-4);
    assert_eq!([sky, surface], [0.0, 0.0], "the reference draws the band alone too");
}

/// In sunlight a plate shows albedo E / pi: by its glTF colour, by `1 - absorptivity` without one, and by a law over wavelengths before both.
#[test]
fn the_visible_albedo_is_that_of_the_colour() {
    let sections = "[radiance]\nreflections = \"traced\"\n[[band]]\nname = \"long\"\nband_um = [8, 14]\n[[band]]\nname = \"visible\"\nband_um = [0.4, 0.8]\n";
    let law = "emissivity_by_wavelength = { wavelength_um = [0.3, 1], emissivity = [0.45, 0.45] }";
    let far_law = "emissivity_by_wavelength = { wavelength_um = [7, 15], emissivity = [0.8, 0.8] }";
    for (colour, finish, albedo) in
        [(Some([0.6, 0.6, 0.6]), "", 0.6), (None, "", 0.9), (None, far_law, 0.9), (Some([0.6, 0.6, 0.6]), law, 0.55)]
    {
        // A law that does not reach into the long band leaves it to `emissivity`.
        let folder = plate_folder(&plate(300.0, &material("plate", 0.8, finish), sections));
        if let Some(colour) = colour {
            save_coloured(&folder, colour);
        }
        let prepared = folder.prepared();
        let image = seen(&prepared, true);
        let sunlight = PI * SUN_SINE * SUN_SINE * band_radiance_exact(VISIBLE, SUN);
        let (found, expected) = (middle(&image.bands.images[1].radiance), albedo * sunlight / PI);
        println!("{colour:?} {finish}: {found:.4} for {expected:.4}");
        assert!(is_near(found, expected, 2e-4), "{colour:?} {finish}: {found} for {expected}");
        let thermal = middle(&image.bands.images[0].radiance);
        let own = 0.8 * band_radiance_exact(LONG, 300.0) + 0.2 * SUN_SINE * SUN_SINE * band_radiance_exact(LONG, SUN);
        assert!(is_near(thermal, own, 2e-3), "{thermal} for {own}");
        let told = prepared.scene.assumptions.iter().any(|text| text.contains("'plate' reflect"));
        assert_eq!(told, finish != law, "{:?}", prepared.scene.assumptions);
    }
}

/// A red plate is darker in a blue band.
#[test]
fn a_colour_weighs_its_wavelengths() {
    let bands = "[radiance]\nreflections = \"traced\"\n[[band]]\nname = \"blue\"\nband_um = [0.4, 0.45]\n[[band]]\nname = \"red\"\nband_um = [0.65, 0.7]\n";
    let folder = plate_folder(&plate(300.0, &material("plate", 0.8, ""), bands));
    save_coloured(&folder, [0.8, 0.4, 0.1]);
    let image = seen(&folder.prepared(), true);
    let sunlight = |lower: f64, upper: f64| SUN_SINE * SUN_SINE * band_radiance_exact(Band { lower, upper }, SUN);
    for (band, expected) in
        image.bands.images.iter().zip([0.1 * sunlight(0.4e-6, 0.45e-6), 0.8 * sunlight(0.65e-6, 0.7e-6)])
    {
        let shown = middle(&band.radiance);
        assert!(is_near(shown, expected, 1e-3), "{shown} for {expected}");
    }
}

const RATIO: &str = "[[band]]\nname = \"a\"\nband_um = [8, 9.5]\nnoise = 0.02\n[[band]]\nname = \"b\"\nband_um = [11, 13]\nnoise = 0.03\n\
                     [output]\nratio = [\"a\", \"b\"]\n";

/// A grey plate: its temperature whatever its emissivity, and the error that draws of the noise give.
#[test]
fn the_ratio_of_two_bands_tells_the_temperature_of_a_grey_plate() {
    let bands = [Band { lower: 8e-6, upper: 9.5e-6 }, Band { lower: 11e-6, upper: 13e-6 }];
    for (temperature, emissivity) in [(300.0, 1.0), (300.0, 0.3), (220.0, 0.8)] {
        let scene =
            plate(temperature, &material("plate", emissivity, ""), RATIO).replace("solar_constant = 1361\n", "");
        let folder = plate_folder(&scene);
        let image = seen(&folder.prepared(), true);
        let ratio = image.bands.ratio.expect("a ratio");
        let (found, error) = (middle(&ratio.temperature), middle(&ratio.error));
        assert!((found - temperature).abs() < 2e-3, "{found} for {temperature} K");
        // Differences of exact radiances over 1 mK stand for the slope of the ratio.
        let ln_ratio = |t: f64| (band_radiance_exact(bands[0], t) / band_radiance_exact(bands[1], t)).ln();
        let slope = (ln_ratio(temperature + 1e-3) - ln_ratio(temperature - 1e-3)) / 2e-3;
        let radiances = bands.map(|band| emissivity * band_radiance_exact(band, temperature));
        let expected = (0.02 / radiances[0]).hypot(0.03 / radiances[1]) / slope;
        println!("{temperature} K, {emissivity}: {found:.5} +- {error:.5} K, expected {expected:.5} K");
        assert!(is_near(error, expected, 1e-3) && !is_near(1.1 * error, expected, 1e-3), "{error} for {expected}");
    }
}

/// The sensor of a band states its noise: netd kelvins at its temperature.
#[test]
fn the_error_of_a_ratio_follows_from_the_sensors() {
    let sensor = |seed: u32| format!("[band.sensor]\nseed = {seed}\nnetd = 0.05\nrange = [200, 400]\n");
    let bands = RATIO.replace("noise = 0.02\n", &sensor(1)).replace("noise = 0.03\n", &sensor(2));
    let scene = plate(300.0, &material("plate", 1.0, ""), &bands).replace("solar_constant = 1361\n", "");
    let image = seen(&plate_folder(&scene).prepared(), true);
    let error = middle(&image.bands.ratio.expect("a ratio").error);
    let relative = |lower: f64, upper: f64| {
        let at = |t: f64| band_radiance_exact(Band { lower, upper }, t).ln();
        (at(300.001) - at(299.999)) / 2e-3
    };
    let (a, b) = (relative(8e-6, 9.5e-6), relative(11e-6, 13e-6));
    let expected = 0.05 * a.hypot(b) / (a - b);
    assert!(is_near(error, expected, 1e-3), "{error} for {expected}");
    assert!(image.bands.images.iter().all(|band| band.digital_numbers.is_some()), "each band has its sensor");
}

/// The commands write all channels, and files for each sensor.
#[test]
fn run_and_render_write_every_band() {
    let sections = "[[band]]\nname = \"thermal\"\nband_um = [8, 14]\n[band.sensor]\nnetd = 0.1\nrange = [150, 450]\n\
                    [[band]]\nname = \"visible\"\nband_um = [0.4, 0.8]\n[band.sensor]\nradiance_noise = 0.5\nradiance_range = [0, 300]\n";
    let scene = scene_with(&[
        ("[radiance]\nband_um = [8, 14]", &format!("[radiance]\nreflections = \"traced\"\n{sections}")),
        ("steps = 12", "steps = 4"),
    ]);
    let folder = Folder::new(&scene);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out"]);
    succeed(folder.0.path(), &["render", "scene.toml", "--time", "240", "-o", "one.exr"]);
    let (one, header) = read_exr(&folder.path("one.exr")).expect("a frame");
    let (last, _) = read_exr(&folder.path("out/frames/step_000004.exr")).expect("a frame");
    let told = header
        .bands
        .iter()
        .map(|(name, band)| (name.as_str(), [band.lower, band.upper].map(|end| (1e9 * end).round())));
    assert_eq!(told.collect::<Vec<_>>(), [("thermal", [8000.0, 14000.0]), ("visible", [400.0, 800.0])]);
    assert_eq!(one.bands, last.bands);
    assert_eq!(one.bands.images[0].radiance, one.radiance);
    let bright = one.bands.images[1].radiance.iter().copied().fold(0.0, f32::max);
    assert!((10.0..300.0).contains(&bright), "sunlight on the craft: {bright}");
    for name in [
        "step_000004_dn.png",
        "step_000004_visible_dn.png",
        "step_000004_visible.json",
        "step_000004_visible_display.png",
    ] {
        assert!(folder.path(&format!("out/frames/{name}")).exists(), "{name}");
    }
    assert!(folder.path("one_visible_dn.png").exists() && folder.path("one_dn.png").exists());
}

/// A sensor of a further band alone: the report, the video and the log take its files.
#[test]
fn a_run_shows_the_sensor_of_a_further_band() {
    let sections = "[[band]]\nname = \"thermal\"\nband_um = [8, 14]\n[[band]]\nname = \"visible\"\nband_um = [0.4, 0.8]\n\
                    [band.sensor]\nradiance_noise = 0.5\nradiance_range = [0, 300]\n[output]\nvideo = \"apng\"\n";
    let scene = scene_with(&[("[radiance]\nband_um = [8, 14]", sections), ("steps = 12", "steps = 4")]);
    let folder = Folder::new(&scene);
    succeed(folder.0.path(), &["run", "scene.toml", "-o", "out", "--mcap", "log.mcap"]);
    assert!(folder.path("out/frames/step_000004_visible_display.png").exists());
    assert!(!folder.path("out/frames/step_000004_display.png").exists());
    let report = std::fs::read_to_string(folder.path("out/report.html")).expect("a report");
    assert!(report.contains("display at t = "));
}

/// Images between steps, and a run that is resumed, show the bands of the same temperatures.
#[test]
fn images_between_steps_have_all_bands() {
    let bands = "[[band]]\nname = \"a\"\nband_um = [8, 14]\n[[band]]\nname = \"b\"\nband_um = [8, 14]";
    let scene = scene_with(&[
        ("[radiance]\nband_um = [8, 14]", bands),
        ("draw_every = 4", "images = [0, 30, 100, 185]"),
        ("steps = 12", "steps = 4"),
    ]);
    let prepared = Folder::new(&scene).prepared();
    let all = images(&prepared, true);
    assert_eq!(all.len(), 4);
    for image in all {
        let [a, b] = [0, 1].map(|place| &image.bands.images[place].radiance);
        let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.max(1.0)).fold(0.0, f32::max);
        assert!(b.iter().any(|radiance| *radiance > 10.0), "the craft is in view");
        assert!(worst < 2e-5, "{} s: {worst}", image.time);
    }
}

/// The six filters of TIRI: their middles are public, their widths are not.
#[test]
fn the_filters_of_tiri_are_a_preset() {
    let bands = "[[band]]\npreset = \"tiri\"\nwidth_um = 0.5\n";
    let scene = plate(300.0, &material("plate", 1.0, ""), bands).replace("solar_constant = 1361\n", "");
    let prepared = plate_folder(&scene).prepared();
    let names: Vec<&str> = prepared.scene.bands.iter().map(|band| band.name.as_str()).collect();
    assert_eq!(names, ["tiri_7_8", "tiri_8_6", "tiri_9_6", "tiri_10_6", "tiri_11_6", "tiri_13_1"]);
    let image = seen(&prepared, true);
    for (band, centre) in image.bands.images.iter().zip([7.8, 8.6, 9.6, 10.6, 11.6, 13.1]) {
        let ends = Band { lower: (centre - 0.25) * 1e-6, upper: (centre + 0.25) * 1e-6 };
        assert!(is_near(middle(&band.radiance), band_radiance_exact(ends, 300.0), 1e-5));
    }
}

/// What is wrong ends in exit code 2, with the key.
#[test]
fn wrong_bands_are_refused() {
    let band = |keys: &str| format!("[[band]]\nname = \"a\"\n{keys}\n");
    let curve = |rows: &str| format!("wavelength_um,response\n{rows}");
    let preset = "[camera]\npreset = \"tiri\"\n";
    let cases: [(String, &str, &str); 21] = [
        ("[radiance]\nreflections = \"traced\"\nbounces = 0\n".to_owned(), "", "radiance.bounces"),
        (band("response = \"curve.csv\""), &curve("9,1\n8,1\n"), "row 2: wavelengths must rise, found 8 um after 9 um"),
        (band("response = \"curve.csv\""), &curve("8,1\n9,-1\n"), "row 2: a response must not be below 0, found -1"),
        (band("response = \"curve.csv\""), &curve(""), "has 0 rows"),
        (band("response = \"curve.csv\""), &curve("8,1\n"), "needs at least two"),
        (band("response = \"curve.csv\""), &curve("8,0\n9,0\n"), "0 at all wavelengths"),
        (band("response = \"curve.csv\""), "wavelength,response\n8,1\n9,1\n", "has no column 'wavelength_um'"),
        (band("response = \"curve.csv\""), &curve("8,x\n9,1\n"), "'x' is not a number"),
        (band("response = \"curve.csv\"\nband_um = [8, 14]"), &curve("8,1\n9,1\n"), "band_um"),
        (band(""), "", "band_um: is missing"),
        (band("band_um = [14, 8]"), "", "must run from low to high"),
        (band("band_um = [8, 14]").repeat(2), "", "'a' is the name of another band"),
        (
            format!("{0}{1}", band("band_um = [8, 14]"), band("band_um = [3, 5]").replace("\"a\"", "\"A\"")),
            "",
            "'A' is the name of another band in other case, and names files",
        ),
        ("[[band]]\nname = \"a.b\"\nband_um = [8, 14]\n".to_owned(), "", "names a channel and files"),
        (format!("[radiance]\nband_um = [8, 14]\n{}", band("band_um = [8, 14]")), "", "stands beside [[band]]"),
        (
            "[[band]]\npreset = \"tiri\"\n".to_owned(),
            "",
            "the full width of each filter [um]; that of Hera TIRI is unknown",
        ),
        (
            format!(
                "[sensor]\nnetd = 0\nrange = [200, 400]\n{}[band.sensor]\nnetd = 0\nrange = [200, 400]\n",
                band("band_um = [8, 14]")
            ),
            "",
            "stands beside [sensor]",
        ),
        (
            format!("{}[band.sensor]\nnetd = 0.05\nradiance_range = [0, 200]\n", band("band_um = [0.4, 0.8]")),
            "",
            "state radiance_noise [W/(m2 sr)] instead",
        ),
        (
            format!("{}[output]\nratio = [\"a\", \"a\"]\n", band("band_um = [8, 14]\nnoise = 1")),
            "",
            "tells no temperature",
        ),
        (
            format!("{}[output]\nratio = [\"a\", \"c\"]\n", band("band_um = [8, 14]\nnoise = 1")),
            "",
            "names 'c', which is no [[band]]",
        ),
        (format!("{}[output]\nratio = [\"a\", \"a\"]\n", band("band_um = [8, 14]")), "", "needs the noise of band 'a'"),
    ];
    for (sections, file, expected) in &cases {
        let scene = plate(300.0, &material("plate", 0.8, ""), sections);
        let folder = plate_folder(&scene);
        folder.write("curve.csv", file);
        let (code, message) =
            refusal(&isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out"]).output().expect("it starts"));
        assert_eq!(code, Some(2), "{message}");
        assert!(message.contains(expected), "'{expected}' is not in: {message}");
    }
    // The figures of a preset hold in its band alone, wherever the sensor is stated.
    let sensors = [("", "[band.sensor]\nnetd = 0.1\n"), ("[sensor]\nnetd = 0.1\n", "")];
    let ends = [("[10, 20]", "the sensor of Hera TIRI sees 8 to 14 um"), ("[3, 5]", "sensor.range")];
    for ((of_first, of_band), (ends, expected)) in sensors.into_iter().flat_map(|one| ends.map(|end| (one, end))) {
        let sections = format!("{of_first}{}{of_band}", band(&format!("band_um = {ends}")));
        let scene = plate(300.0, &material("plate", 0.8, ""), &sections);
        let scene = scene.replace("[camera]\n", preset).replace("width = 9\nheight = 9\n", "");
        let folder = plate_folder(&scene);
        let (code, message) =
            refusal(&isotherm(folder.0.path(), &["run", "scene.toml", "-o", "out"]).output().expect("it starts"));
        assert!(code == Some(2) && message.contains(expected), "{sections}: {message}");
    }
}
