//! A craft that spans few pixels keeps its radiant intensity.

use isotherm::internals::DeviceData;
use isotherm::{Image, internals};
use serde_json::json;

use super::craft::{Folder, scene_with};
use super::model::make::Maker;
use super::reflections::{apart, by_reference, on_device, shining};

/// Greatest extent of the craft across the line of sight [m], and the focal length of its camera [px].
const SPAN: f64 = 9.2;
const FOCAL: f64 = 115.882;
const SIZE: [f64; 2] = [320.0, 256.0];

/// Changes that put the camera so far away that the craft spans `pixels`. It looks past the craft by `aside` of the distance.
fn far(pixels: f64, aside: f64, lens: &str) -> Vec<(&'static str, String)> {
    let towards = [6.5, 5.0, -7.5].map(|part| part / 11.113);
    let distance = SPAN * FOCAL / pixels;
    let place = towards.map(|part| part * distance);
    vec![
        ("position = [6.5, 5, -7.5]", format!("position = {place:?}")),
        ("look_at = [0, 0, 0]", format!("look_at = [{}, 0, {}]", aside * distance, 0.4 * aside * distance)),
        // The edges of the craft do not lie along the axes of the image, along which all texels round alike.
        ("up = [0, 0, -1]", "up = [0.3, 0.6, -0.5]".to_owned()),
        ("fov_deg = 45", format!("focal_px = {FOCAL}\n{lens}")),
    ]
}

fn changed(changes: &[(&'static str, String)], make: impl Fn(&[(&str, &str)]) -> String) -> String {
    make(&changes.iter().map(|(from, to)| (*from, to.as_str())).collect::<Vec<_>>())
}

/// Radiance times solid angle over the image, in units of a pixel on the axis.
fn intensity(pixels: &Image, [width, height]: [f64; 2], focal: f64) -> f64 {
    let of_pixel = |(index, radiance): (usize, &f32)| {
        let (x, y) = (index as f64 % width, (index as f64 / width).floor());
        let off = ((x + 0.5 - 0.5 * width).powi(2) + (y + 0.5 - 0.5 * height).powi(2)) / (focal * focal);
        // The solid angle of a pixel falls with the third power of the cosine.
        f64::from(*radiance) * (1.0 + off).powf(-1.5)
    };
    pixels.radiance.iter().enumerate().map(of_pixel).sum()
}

/// The same from the same place through a lens so long that the craft spans hundreds of pixels.
fn exact(pixels: f64) -> f64 {
    let (focal, width, height) = (FOCAL * 400.0 / pixels, 600.0, 600.0);
    let mut changes = far(pixels, 0.0, "");
    changes.truncate(3);
    changes.push(("fov_deg = 45", format!("focal_px = {focal}\nsamples = 4")));
    changes.push(("width = 96\nheight = 72", "width = 600\nheight = 600".to_owned()));
    let found = by_reference(&Folder::new(&changed(&changes, scene_with)).prepared());
    assert!(found.part.iter().filter(|part| **part > 0).count() > 10_000, "the craft fills the image");
    intensity(&found, [width, height], focal) * (FOCAL / focal).powi(2)
}

#[test]
fn a_distant_craft_keeps_its_radiant_intensity() {
    for pixels in [0.05, 0.2, 0.7, 1.0, 1.6, 3.0] {
        let expected = exact(pixels);
        for aside in [0.0, 0.17] {
            for samples in [1, 4] {
                let mut changes = far(pixels, aside, &format!("samples = {samples}"));
                changes.push(("width = 96\nheight = 72", "width = 320\nheight = 256".to_owned()));
                let prepared = Folder::new(&changed(&changes, scene_with)).prepared();
                let found = [on_device(&prepared), by_reference(&prepared)];
                let off = found.each_ref().map(|found| intensity(found, SIZE, FOCAL) / expected - 1.0);
                println!("{pixels} px, {aside} aside, {samples} samples: device {:+.2e}, f64 {:+.2e}", off[0], off[1]);
                assert!(off.iter().all(|off| off.abs() < 0.01), "{pixels} px, {samples} samples: {off:?}");
                let shown = found[0].part.iter().filter(|part| **part > 0).count();
                assert!((1..=40).contains(&shown), "{shown} pixels show it");
                if samples > 1 {
                    let covered: f32 = found[0].coverage.iter().sum();
                    assert!(f64::from(covered) < pixels * pixels && covered > 0.0, "{covered} pixels are covered");
                }
            }
        }
    }
}

/// A craft with a rod as thin as a hundredth of it, a panel of two faces and a box, before the switch and after it, with one sample of a pixel.
#[test]
fn a_craft_with_thin_parts_goes_on_across_the_switch() {
    let folder = |camera: &str| {
        let folder = Folder::new(&thin_scene(camera));
        thin_craft().save(folder.0.path());
        folder.prepared()
    };
    let of = |pixels: f64, focal: f64, [width, height]: [f64; 2], samples: u32| {
        let distance = 2000.0 * 3.0 / pixels;
        let place = [0.3, 0.4, 0.75_f64.sqrt()].map(|part| part * distance);
        let camera = format!(
            "width = {width}\nheight = {height}\nfocal_px = {focal}\nposition = {place:?}\nsamples = {samples}"
        );
        let image = by_reference(&folder(&camera));
        intensity(&image, [width, height], focal) * (distance / focal).powi(2)
    };
    // The box around the craft is 192 pixels wide where the craft is about 166.
    let all = [100.0, 117.0, 132.0, 148.0, 164.0, 168.0, 172.0].map(|pixels| {
        let exact = of(pixels, 2000.0 * 700.0 / pixels, [900.0, 900.0], 4);
        of(pixels, 2000.0, [640.0, 512.0], 1) / exact - 1.0
    });
    println!("{all:+.4?}");
    assert!(all.iter().all(|off| off.abs() < 0.01), "{all:?}");
}

/// The image goes on across the switch to the crop, with one sample of a pixel too. Without the crop, 16 pixels are not enough.
#[test]
fn the_image_goes_on_across_the_switch() {
    let off = |pixels: f64, samples: u32, lens: &str| {
        let lens = format!("samples = {samples}{lens}");
        let mut changes = far(pixels, 0.0, &lens);
        changes.push(("width = 96\nheight = 72", "width = 320\nheight = 256".to_owned()));
        let image = by_reference(&Folder::new(&changed(&changes, scene_with)).prepared());
        intensity(&image, SIZE, FOCAL) / exact(pixels) - 1.0
    };
    for samples in [1, 4] {
        // The boxes of the craft span less than `SPAN` here: the switch lies between 70 and 90.
        let all = [50.0, 60.0, 70.0, 90.0, 100.0, 110.0].map(|pixels| off(pixels, samples, ""));
        println!("{samples} samples: {all:+.4?}");
        let [low, high] = [f64::min, f64::max].map(|pick| all.into_iter().reduce(pick).unwrap_or_default());
        assert!(high - low < 0.01 && high.max(-low) < 0.01, "{samples} samples: {all:?}");
    }
    let near = [14.0, 15.0, 16.0, 17.0].map(|pixels| off(pixels, 1, "\ndistortion = [1e-9, 0, 0, 0, 0]").abs());
    println!("without a crop: {near:.4?}");
    assert!(near.iter().any(|off| *off > 0.01), "{near:?}");
}

/// With reflections, a planet behind, and the reflected part apart.
#[test]
fn a_distant_craft_is_seen_before_the_planet_as_by_the_reference() {
    for pixels in [0.3, 2.0, 9.0] {
        let scene = |warmer: bool| {
            let planet = if warmer { "\nplanet_temperature = 265" } else { "" };
            let mut changes = far(pixels, 0.1, "");
            changes.push(("background = \"planet\"", format!("background = \"planet\"{planet}")));
            Folder::new(&changed(&changes, shining)).prepared()
        };
        let (prepared, wrong) = (scene(false), scene(true));
        let (found, expected, wrong) = (on_device(&prepared), by_reference(&prepared), by_reference(&wrong));
        let ([sky, surface], worst) = apart(&found, &expected, 2e-3);
        println!("{pixels} px: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}");
        assert!(sky < 0.005 && surface <= 0.07, "{pixels} px: {sky} and {surface}");
        let ([sky, _], _) = apart(&found, &wrong, 2e-3);
        assert!(sky > 0.05, "a warmer planet must show");
        let reflected = |pixels: &Image| pixels.reflected.iter().map(|value| f64::from(*value)).sum::<f64>();
        assert!((reflected(&found) / reflected(&expected) - 1.0).abs() < 0.005 && reflected(&found) > 0.0);
    }
}

/// A box, a panel and a rod of 3 m in all.
fn thin_craft() -> Maker {
    let mut maker = Maker::new();
    maker.push("materials", json!({ "name": "skin" }));
    let mut corners: Vec<[f32; 3]> = Vec::new();
    let mut face = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| corners.extend([a, b, c, a, c, d]);
    for (low, high) in [([-0.15; 3], [0.15; 3]), ([-1.6, 0.085, -0.015], [-0.2, 0.115, 0.015])] {
        let at = |x: usize, y: usize, z: usize| [[low, high][x][0], [low, high][y][1], [low, high][z][2]];
        face(at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0));
        face(at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1));
        face(at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1));
        face(at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0));
        face(at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0));
        face(at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1));
    }
    face([0.4, -0.2, -0.1], [2.0, -0.2, -0.1], [2.0, 0.2, 0.1], [0.4, 0.2, 0.1]);
    let positions = maker.floats(&corners);
    maker.primitive(json!({"attributes": {"POSITION": positions}, "material": 0}));
    maker
}

/// The thin craft at 300 K before these keys of a camera.
fn thin_scene(camera: &str) -> String {
    format!(
        "name = \"thin\"\n[model]\npath = \"made.glb\"\nmax_edge = \"file\"\n[time]\nstep = 1\nsteps = 1\ndraw_steps = [0]\n[orbit]\naltitude = 408e3\n\
         [attitude]\nmode = \"nadir\"\nnadir_axis = \"-Z\"\nforward_axis = \"+X\"\n[environment]\nplanet_radius = 6371e3\nbackground_temperature = 0\n\
         [[material]]\nmatch = \"skin\"\nabsorptivity = 0.5\nemissivity = 0.9\nsides = \"outside\"\nresponse = \"instant\"\n[initial]\ntemperature = 300\n\
         [camera]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nnear = 0.001\n{camera}\n"
    )
}

#[test]
fn a_craft_that_is_near_has_no_crop() {
    let planned = |scene: &str| {
        let prepared = Folder::new(scene).prepared();
        let data = DeviceData::new(&prepared);
        let plan = data.scene_data(&prepared, prepared.scene.camera.as_ref()).plan();
        [&internals::DISTANT, &internals::IMAGE_RADIANCE]
            .map(|wanted| plan.iter().any(|planned| planned.resource == wanted))
    };
    let of = |pixels: f64, lens: &str| changed(&far(pixels, 0.0, lens), scene_with);
    assert_eq!(planned(&scene_with(&[])), [false; 2]);
    assert_eq!(planned(&of(40.0, "")), [false; 2]);
    assert_eq!(planned(&of(10.0, "")), [true; 2]);
    assert_eq!(planned(&of(10.0, "line_time = 1e-4")), [false; 2]);
    assert_eq!(planned(&of(10.0, "distortion = [1e-9, 0, 0, 0, 0]")), [false, true]);
}
