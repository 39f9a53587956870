//! Pictures of whole models: the device against the f64 rasteriser, and against a stored picture in tests/golden/.

use std::path::{Path, PathBuf};

use isotherm::Image;
use isotherm::internals::{
    DeviceEngine, Engine, FrameMaker, Prepared, ReferenceEngine, StepResult, read_exr, start, still, write_exr,
};

use super::craft::{Folder, SCENE, never, prepared};
use super::device::{Worst, assert_silent, context, corner_grid};

/// The picture of a scene at a time [s], by an engine.
fn picture(prepared: &Prepared, engine: &mut dyn Engine, time: f64) -> StepResult {
    start(prepared, engine, None, &never(), &mut || ()).expect("the engine starts");
    let still = still(prepared, engine, time, &never(), &mut || ()).expect("the engine steps");
    still.expect("nobody stopped it")
}

/// The difference of two pictures of one scene.
struct Apart {
    /// Image with different parts or materials.
    labels: usize,
    /// Those whose neighbours are all equal: they are not at an edge, except of something thinner than a pixel.
    inside: usize,
    /// Image with another face of the same label, more than a kelvin apart.
    faces: usize,
    /// Image with a surface.
    shown: usize,
    radiance: Worst,
    temperature: Worst,
    depth: Worst,
}

fn compare(found: &Image, expected: &Image, width: usize) -> Apart {
    let none = Worst::none;
    let mut apart =
        Apart { labels: 0, inside: 0, faces: 0, shown: 0, radiance: none(), temperature: none(), depth: none() };
    let label = |index: usize| (index < expected.part.len()).then(|| expected.labels(index));
    for index in 0..expected.part.len() {
        apart.shown += usize::from(expected.part[index] > 0);
        if found.labels(index) != expected.labels(index) {
            apart.labels += 1;
            let beside = [index.wrapping_sub(1), index + 1, index.wrapping_sub(width), index + width];
            apart.inside += usize::from(beside.iter().all(|beside| label(*beside) == label(index)));
            continue;
        }
        if expected.part[index] == 0 {
            assert_eq!(found.values(index), [0.0; 3], "pixel {index} shows nothing");
            continue;
        }
        let name = || format!("pixel ({}, {}), labels {:?}", index % width, index / width, expected.labels(index));
        let values = |pixels: &Image| pixels.values(index).map(f64::from);
        let ([radiance, temperature, depth], expected) = (values(found), values(expected));
        if (temperature - expected[1]).abs() > 1.0 {
            apart.faces += 1;
            continue;
        }
        // Below 11 K the radiance is 0 in f32.
        let share = if expected[0] == 0.0 { 1.0 + radiance } else { radiance / expected[0] };
        apart.radiance.see(share, 1.0, name);
        apart.temperature.see(temperature, expected[1], name);
        apart.depth.see(depth / expected[2], 1.0, name);
    }
    apart
}

/// Only a few labels differ, and only at edges.
fn check_labels(apart: &Apart, grid: f64, what: &str) {
    let sentence = format!(
        "{what}: {} of {} labels differ, {} inside, {} faces",
        apart.labels, apart.shown, apart.inside, apart.faces
    );
    let few = |count: usize, most: f64| (count as f64) < grid * most * apart.shown as f64;
    assert!(few(apart.labels + apart.faces, 0.005) && few(apart.inside, 0.0005), "{sentence}");
    println!("{sentence}");
}

/// Allowed depth error of a face. On a wide corner grid a slanted face moves along the line of sight.
fn slant(grid: f64) -> f64 {
    if grid > 1.0 { 1e-3 } else { 1e-5 }
}

/// Compares temperatures with a tolerance [K], and everything else.
fn check_against_rasteriser(prepared: &Prepared, what: &str, tolerance: f64) {
    let context = context();
    let camera = prepared.scene.camera.as_ref().expect("a camera");
    let time = 4.0 * prepared.scene.time.step;
    let mut device = DeviceEngine::new(&context, prepared, Some(camera)).expect("a small scene");
    let mut reference = ReferenceEngine::new(prepared, Some(camera));
    let [found, expected] = [&mut device as &mut dyn Engine, &mut reference]
        .map(|engine| picture(prepared, engine, time).delivered.image.expect("a picture"));
    let apart = compare(&found, &expected, camera.width as usize);
    assert!(apart.shown > 1000, "{} pixels show something", apart.shown);
    let grid = corner_grid(&context);
    let tolerance = grid * tolerance;
    check_labels(&apart, grid, what);
    apart.temperature.within(tolerance, "K", &format!("{what}, temperature"));
    // A kelvin is 1.7 % of the radiance at 300 K, and 5 % at 180 K.
    apart.radiance.within(2e-5 + 0.05 * tolerance, "relative", &format!("{what}, radiance"));
    apart.depth.within(slant(grid), "relative", &format!("{what}, depth"));
    let other = picture(prepared, &mut device, time + 10.0).delivered.image.expect("a picture");
    let wrong = compare(&other, &expected, camera.width as usize);
    assert!(wrong.temperature.difference > 5.0 * tolerance, "ten seconds later must show: {:?}", wrong.temperature);
    assert_silent(&context);
}

#[test]
fn the_craft_on_the_device_and_by_the_rasteriser() {
    check_against_rasteriser(&Folder::new(SCENE).prepared(), "craft", 2e-3);
}

#[test]
fn the_station_on_the_device_and_by_the_rasteriser() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let text = std::fs::read_to_string(models.join("station_transition.toml")).expect("models/station_transition.toml");
    // The original triangles, a small picture and no warm-up, because only pixels are compared.
    let changed = text
        .replace("max_edge = 1.0\n", "")
        .replace("warm_up_orbits = 1\n", "")
        .replace("width = 1024", "width = 192\nsamples = 1")
        .replace("height = 768", "height = 144");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("station.toml");
    std::fs::write(&path, changed).expect("the folder can be written");
    std::fs::copy(models.join("station.glb"), folder.path().join("station.glb")).expect("models/station.glb");
    // Some triangles span 100 K over a few pixels. A thousandth of a pixel then gives this difference.
    check_against_rasteriser(&prepared(&path), "station", 1e-2);
}

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/craft.exr")
}

/// The craft 240 s into its scene against the stored picture. After an intended change, look at the new picture and
/// store it with `ISOTHERM_KEEP_PICTURES=1 cargo test --test it golden`.
#[test]
fn the_golden_picture() {
    let context = context();
    let prepared = Folder::new(SCENE).prepared();
    let camera = prepared.scene.camera.clone().expect("a camera");
    let mut engine = DeviceEngine::new(&context, &prepared, Some(&camera)).expect("a small scene");
    let result = picture(&prepared, &mut engine, 240.0);
    let found = result.delivered.image.clone().expect("a picture");
    if std::env::var_os("ISOTHERM_KEEP_PICTURES").is_some_and(|value| value == "1") {
        let maker = FrameMaker::new(&prepared, &engine.device_name());
        let (frame, header) = maker.frame(result).expect("finite").expect("a picture");
        write_exr(&golden(), &frame, &header).expect("tests/golden can be written");
    }
    let (kept, header) = read_exr(&golden()).expect("the golden picture");
    assert_eq!((&kept.camera, header.parts.len(), kept.time), (&camera, 4, 240.0));
    let apart = compare(&found, &kept, camera.width as usize);
    let grid = corner_grid(&context);
    check_labels(&apart, grid, "golden picture");
    apart.radiance.within(1e-4 * grid, "relative", "radiance against the golden picture");
    apart.depth.within(slant(grid), "relative", "depth against the golden picture");
    let later = picture(&prepared, &mut engine, 242.0).delivered.image.expect("a picture");
    let wrong = compare(&later, &kept, camera.width as usize);
    assert!(wrong.radiance.difference > 1e-4 * grid, "two seconds later must show: {:?}", wrong.radiance);
}

/// A radiance that is not finite is told with its step, pixel, part and node. The camera looks at the craft, so the middle of the image shows it.
#[test]
fn a_pixel_that_is_not_finite_names_its_node() {
    let prepared = Folder::new(SCENE).prepared();
    let camera = prepared.scene.camera.clone().expect("a camera");
    let mut engine = ReferenceEngine::new(&prepared, Some(&camera));
    let mut result = picture(&prepared, &mut engine, 240.0);
    let pixels = result.delivered.image.as_mut().expect("a picture");
    let pixel = (0..pixels.part.len()).find(|pixel| pixels.part[*pixel] != 0).expect("a surface");
    pixels.radiance[pixel] = f32::NAN;
    let part = prepared.parts[pixels.part[pixel] as usize - 1].clone();
    let maker = FrameMaker::new(&prepared, "cpu");
    let error = maker.frame(result).expect_err("a NaN").to_string();
    let (x, y) = (pixel % camera.width as usize, pixel / camera.width as usize);
    let said = format!("the radiance in pixel ({x}, {y}) of part {part}, node ");
    let (_, rest) = error.split_once(&said).unwrap_or_else(|| panic!("{error} lacks {said}"));
    let node: usize = rest.split(' ').next().and_then(|node| node.parse().ok()).expect("a number");
    let group = prepared.nodes.group_part[node / 4] as usize;
    assert!(prepared.parts[group] == part && rest.contains("is NaN"), "{error}");
}
