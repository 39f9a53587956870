//! Reflected surroundings and the sky behind the craft: the device against the f64 rasteriser, and exact answers.

use isotherm::internals::{
    Band, Camera, DeviceData, DeviceEngine, Engine, Prepared, ReferenceEngine, StepResult, band_radiance_exact, run,
    start, still,
};
use isotherm::{EngineError, Image, internals};

use super::craft::{Folder, never, scene_with};
use super::device::{assert_silent, context};

/// A scene with reflections, a sky and the two parts of the radiance. The skin is a rough mirror in part, the cells are
/// a smooth one, and the mast is diffuse.
pub fn shining(changes: &[(&str, &str)]) -> String {
    let mut all = vec![
        ("band_um = [8, 14]", "band_um = [8, 14]\nreflections = \"environment\"\nbackground = \"planet\""),
        ("emissivity = 0.83", "emissivity = 0.13\nspecular = 0.7\nroughness = 0.2"),
        ("emissivity = 0.82", "emissivity = 0.32\nspecular = 0.9"),
        ("[[probe]]", "[output]\nchannels = [\"emitted\", \"reflected\"]\n[[probe]]"),
    ];
    all.extend(changes);
    scene_with(&all)
}

fn pixels(prepared: &Prepared, engine: &mut dyn Engine) -> Image {
    start(prepared, engine, None, &never(), &mut || ()).expect("the engine starts");
    let drawn = still(prepared, engine, 0.0, &never(), &mut || ()).expect("the engine draws");
    drawn.expect("nobody stopped it").delivered.image.expect("a picture")
}

fn camera(prepared: &Prepared) -> &Camera {
    prepared.scene.camera.as_ref().expect("a camera")
}

pub fn on_device(prepared: &Prepared) -> Image {
    let context = context();
    let mut engine = DeviceEngine::new(&context, prepared, Some(camera(prepared))).expect("a small scene");
    let found = pixels(prepared, &mut engine);
    drop(engine);
    assert_silent(&context);
    found
}

pub fn by_reference(prepared: &Prepared) -> Image {
    pixels(prepared, &mut ReferenceEngine::new(prepared, Some(camera(prepared))))
}

/// Shares of the pixels that differ by more than a tolerance, of the sky and of surfaces with the same labels; and the
/// largest difference of the others, relative to the radiance.
pub fn apart(found: &Image, expected: &Image, tolerance: f64) -> ([f64; 2], f64) {
    let (mut count, mut far, mut worst) = ([0.0_f64; 2], [0.0_f64; 2], 0.0_f64);
    for index in 0..expected.part.len() {
        let label = expected.labels(index);
        if found.labels(index) != label {
            continue;
        }
        let kind = usize::from(label[0] > 0);
        let [found, expected] = [found, expected].map(|pixels| f64::from(pixels.radiance[index]));
        let difference = (found - expected).abs() / expected.max(1e-3);
        count[kind] += 1.0;
        if difference > tolerance {
            far[kind] += 1.0;
        } else {
            worst = worst.max(difference);
        }
    }
    ([far[0] / count[0].max(1.0), far[1] / count[1].max(1.0)], worst)
}

#[test]
fn the_device_reflects_as_the_reference() {
    let cases: [(&str, &[(&str, &str)]); 4] = [
        ("rough, smooth and diffuse", &[]),
        ("a smooth mirror", &[("roughness = 0.2", "roughness = 0")]),
        ("very rough", &[("roughness = 0.2", "roughness = 0.1\nnormal_slope_variance = 0.3")]),
        (
            "higher, without a Sun",
            &[("altitude = 408e3", "altitude = 2e6"), ("solar_constant = 1361\nalbedo = 0.3", "")],
        ),
    ];
    for (name, changes) in cases {
        let prepared = Folder::new(&shining(changes)).prepared();
        let (found, expected) = (on_device(&prepared), by_reference(&prepared));
        let ([sky, surface], worst) = apart(&found, &expected, 1e-4);
        println!("{name}: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}");
        assert!(sky < 0.005 && surface < 0.01, "{name}: {sky} of the sky and {surface} of the surfaces differ");
        for (index, reflected) in found.reflected.iter().enumerate() {
            let all = found.radiance[index];
            assert!(found.part[index] == 0 || (0.0..=all).contains(reflected), "{name}, pixel {index}");
        }
        let warmer = [("background = \"planet\"", "background = \"planet\"\nplanet_temperature = 257")];
        let wrong = by_reference(&Folder::new(&shining(&[changes, &warmer].concat())).prepared());
        let ([sky, surface], _) = apart(&found, &wrong, 1e-4);
        assert!(sky > 0.05, "{name}: a warmer planet must show behind the craft: {sky}");
        assert!(surface > 0.05, "{name}: a warmer planet must show in {surface} of the surfaces");
    }
}

/// The differences of two images where they have the same labels, as shares of the pixels of sky and surfaces.
fn check(name: &str, found: &Image, expected: &Image, wrong: &Image, tolerance: f64, [most_sky, most]: [f64; 2]) {
    let ([sky, surface], worst) = apart(found, expected, tolerance);
    println!("{name}: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}");
    assert!(sky <= most_sky && surface <= most, "{name}: {sky} of the sky and {surface} of the surfaces differ");
    let ([sky, surface], _) = apart(found, wrong, tolerance);
    assert!(sky > 0.05 && surface > 0.05, "{name}: a warmer planet must show in {sky} and {surface}");
}

const NO_CHANNELS: (&str, &str) = ("[output]\nchannels = [\"emitted\", \"reflected\"]\n", "");
const WARMER: (&str, &str) = ("background = \"planet\"", "background = \"planet\"\nplanet_temperature = 260");

/// The device takes the samples of the reference, and a quarter of a thousandth of them lies at an edge that f32 rounds. Through a
/// lens a pixel shows a texel whose centre is up to a quarter of a pixel away.
#[test]
fn reflections_and_the_sky_have_lenses_and_several_samples() {
    let distorted =
        "fx = 116.1\nfy = 115.3\ncx = 47.1\ncy = 36.8\nskew = 0.4\ndistortion = [-0.31, 0.12, 0.0011, -0.0007, -0.021]";
    let four = format!("{distorted}\nsamples = 4");
    for (name, lens, channels, tolerance, most) in [
        ("four samples", "fov_deg = 45\nsamples = 4", false, 1e-4, [0.001, 0.00125]),
        ("sixteen samples", "fov_deg = 45\nsamples = 16", false, 1e-4, [0.001, 0.00425]),
        ("a lens", distorted, true, 2e-3, [0.001, 0.01]),
        ("a lens with four samples", &four, false, 0.02, [0.03, 0.15]),
    ] {
        let mut changes = vec![("fov_deg = 45", lens)];
        changes.extend((!channels).then_some(NO_CHANNELS));
        let prepared = Folder::new(&shining(&changes)).prepared();
        let (found, expected) = (on_device(&prepared), by_reference(&prepared));
        changes.push(WARMER);
        let wrong = by_reference(&Folder::new(&shining(&changes)).prepared());
        check(name, &found, &expected, &wrong, tolerance, most);
        assert_eq!((found.reflected.is_empty(), expected.reflected.is_empty()), (!channels, !channels));
        for (pixel, coverage) in found.coverage.iter().enumerate().filter(|(_, coverage)| **coverage == 0.0) {
            let [radiance, ..] = found.values(pixel);
            assert!(radiance >= 0.0 && found.labels(pixel) == [0, 0], "{name}: {radiance}, {coverage}");
        }
    }
}

/// The images of a run, by the device or in f64.
pub fn images_of(prepared: &Prepared, device: bool) -> Vec<Image> {
    let context = context();
    let mut engine: Box<dyn Engine> = if device {
        Box::new(DeviceEngine::new(&context, prepared, prepared.scene.camera.as_ref()).expect("a small scene"))
    } else {
        Box::new(ReferenceEngine::new(prepared, prepared.scene.camera.as_ref()))
    };
    start(prepared, engine.as_mut(), None, &never(), &mut || ()).expect("a start");
    let mut found = Vec::new();
    let mut take = |result: StepResult| {
        found.extend(result.delivered.image);
        Ok::<_, EngineError>(())
    };
    assert!(run(prepared, engine.as_mut(), None, &never(), &mut take).expect("a run"));
    drop(engine);
    assert_silent(&context);
    found
}

/// A camera on a path, with images at their own times.
#[test]
fn images_between_steps_show_the_surroundings_of_their_time_and_pose() {
    let camera = "path = 'path.csv'\nframe = 'body'\nlook_at = [0, 0, 0]\nup = [0, 0, -1]";
    let images = |changes: &[(&str, &str)], device: bool| {
        let mut all = vec![
            ("draw_every = 4", "images = [15, 119.9, 700.5]"),
            ("frame = \"body\"\nposition = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]", camera),
        ];
        all.extend(changes);
        let folder = Folder::new("");
        folder.write("path.csv", "time,x,y,z\n0,12,0,-5\n400,8,8,-5\n800,0,12,-5\n");
        folder.write("scene.toml", &shining(&all));
        images_of(&folder.prepared(), device)
    };
    let (found, expected, wrong) = (images(&[], true), images(&[], false), images(&[WARMER], false));
    assert_eq!((found.len(), expected.len()), (3, 3));
    for (number, ((found, expected), wrong)) in found.iter().zip(&expected).zip(&wrong).enumerate() {
        check(&format!("image {number}"), found, expected, wrong, 1e-3, [0.005, 0.01]);
    }
    let ([_, surface], _) = apart(&found[0], &found[2], 1e-3);
    assert!(surface > 0.05, "another place of the camera must show in {surface} of the surfaces");
}

/// The temperature of everything, without a Sun.
pub fn isothermal(temperature: &str, planet: &str) -> String {
    let start = format!("[initial]\ntemperature = {temperature}\n[[probe]]");
    let planet = format!("background = \"planet\"\nplanet_temperature = {planet}");
    shining(&[
        ("solar_constant = 1361\nalbedo = 0.3", ""),
        ("background_temperature = 2.7", &format!("background_temperature = {temperature}")),
        ("background = \"planet\"", &planet),
        ("[[probe]]", &start),
    ])
}

#[test]
fn everything_looks_black_in_an_isothermal_cavity() {
    let black = band_radiance_exact(Band { lower: 8e-6, upper: 14e-6 }, 287.0);
    let worst = |scene: &str| {
        let found = on_device(&Folder::new(scene).prepared());
        let radiances = found.radiance.iter().map(|radiance| f64::from(*radiance));
        radiances.map(|radiance| (radiance / black - 1.0).abs()).fold(0.0, f64::max)
    };
    let found = worst(&isothermal("287", "287"));
    assert!(found < 3e-5, "{found:e}");
    assert!(worst(&isothermal("287", "287.1")) > 1e-3, "a warmer planet must show");
}

/// The foil of emissivity 0.02 at 400 K that faces an Earth of 255 K: 3.5 + 24.3 W/m2/sr, which is 261 K.
#[test]
fn foil_before_the_earth() {
    let scene = shining(&[
        ("emissivity = 0.13\nspecular = 0.7\nroughness = 0.2", "emissivity = 0.02\nspecular = 1"),
        ("background = \"planet\"", "background = \"planet\"\nplanet_temperature = 255"),
        ("solar_constant = 1361\nalbedo = 0.3", ""),
        ("[[probe]]", "[initial]\ntemperature = 400\n[[probe]]"),
        ("position = [6.5, 5, -7.5]", "position = [0.1, 0.1, 9]"),
        ("look_at = [0, 0, 0]\nup = [0, 0, -1]", "look_at = [0, 0, 0]\nup = [1, 0, 0]"),
    ]);
    let prepared = Folder::new(&scene).prepared();
    for found in [on_device(&prepared), by_reference(&prepared)] {
        let centre = 36 * 96 + 48;
        assert_eq!(found.labels(centre), [1, 1]);
        let (all, reflected) = (found.radiance[centre], found.reflected[centre]);
        println!("emitted {:.3}, reflected {reflected:.3} W/m2/sr", all - reflected);
        assert!((all - reflected - 3.5).abs() < 0.05 && (reflected - 24.3).abs() < 0.05);
        let of = |temperature| band_radiance_exact(prepared.scene.band, temperature) as f32;
        assert!(of(260.5) < all && all < of(261.5), "it looks as warm as 261 K");
        assert!(of(262.0) > all, "and not as 262 K");
    }
}

/// Across a narrow image of the limb no more pixels differ from f64 than a tenth of a pixel's width covers.
#[test]
fn the_limb_is_within_a_tenth_of_a_pixel() {
    for (altitude, tilt) in [("408e3", 70.02), ("35.786e6", 8.7), ("4e8", 0.9)] {
        // The camera is before the craft and looks away from it, so that only the sky is seen.
        let (sine, cosine) = f64::to_radians(tilt).sin_cos();
        let look = format!("look_at = [{}, 0, {}]\nup = [0, 0, -1]", 20.0 + 100.0 * sine, 100.0 * cosine);
        let scene = |altitude: &str| {
            let altitude = format!("altitude = {altitude}\n");
            shining(&[
                ("altitude = 408e3\n", &altitude),
                ("fov_deg = 45", "fov_deg = 1"),
                ("width = 96", "width = 200"),
                ("position = [6.5, 5, -7.5]", "position = [20, 0, 0]"),
                ("look_at = [0, 0, 0]\nup = [0, 0, -1]", &look),
            ])
        };
        let prepared = Folder::new(&scene(altitude)).prepared();
        let (found, expected) = (on_device(&prepared), by_reference(&prepared));
        let share = |pixels: &Image| {
            let bright = pixels.radiance.iter().filter(|radiance| **radiance > 1.0).count();
            bright as f64 / pixels.part.len() as f64
        };
        assert!((0.05..0.95).contains(&share(&expected)), "{altitude}: the limb is in the image: {}", share(&expected));
        let ([sky, _], _) = apart(&found, &expected, 1e-4);
        // The limb crosses the image from side to side, 200 of its 14,400 pixels.
        assert!(sky * 14_400.0 <= 20.0, "{altitude}: {} pixels differ", sky * 14_400.0);
        println!("limb at {altitude} m: {} pixels differ", sky * 14_400.0);
    }
}

#[test]
fn what_no_pixel_shows_has_no_buffer() {
    let resources = [&internals::SURROUNDINGS, &internals::REFLECTORS, &internals::LOBES];
    let planned = |scene: &str| {
        let prepared = Folder::new(scene).prepared();
        let data = DeviceData::new(&prepared);
        let plan = data.scene_data(&prepared, prepared.scene.camera.as_ref()).plan();
        resources.map(|resource| plan.iter().any(|planned| planned.resource == resource))
    };
    assert_eq!(planned(&scene_with(&[])), [false; 3]);
    assert_eq!(planned(&shining(&[])), [true; 3]);
    assert_eq!(planned(&shining(&[("roughness = 0.2", "")])), [true, true, false]);
    let sky = scene_with(&[("band_um = [8, 14]", "band_um = [8, 14]\nbackground = \"space\"")]);
    assert_eq!(planned(&sky), [true, false, false]);
}
