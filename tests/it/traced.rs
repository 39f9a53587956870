//! Reflections of the craft itself: the device against f64 and exact answers.

use isotherm::internals::{DeviceData, Prepared, band_radiance_exact};
use isotherm::{Image, internals};
use serde_json::json;

use super::craft::{Folder, glb_of_box, scene_with};
use super::model::make::Maker;
use super::reflections::{apart, by_reference, images_of, on_device, shining};

const TRACED: (&str, &str) = ("reflections = \"environment\"", "reflections = \"traced\"");

/// The craft with reflections of itself.
fn traced(changes: &[(&str, &str)]) -> String {
    shining(&[&[TRACED], changes].concat())
}

#[test]
fn the_device_traces_as_the_reference() {
    let cases: [(&str, &[(&str, &str)]); 4] = [
        ("rough, smooth and diffuse", &[]),
        ("smooth mirrors", &[("roughness = 0.2", "roughness = 0")]),
        ("very rough", &[("roughness = 0.2", "roughness = 0.9")]),
        (
            "laws of emissivity and a map",
            &[
                ("roughness = 0.2", "roughness = 0.2\nemissivity_by_angle = { law = \"fresnel\", n = 1.4, k = 2.0 }"),
                (
                    "background = \"planet\"",
                    "background = \"planet\"\nplanet_day_night = { day = 300, night = 240, law = \"cosine\" }",
                ),
            ],
        ),
    ];
    for (name, changes) in cases {
        let prepared = Folder::new(&traced(changes)).prepared();
        let (found, expected) = (on_device(&prepared), by_reference(&prepared));
        let ([sky, surface], worst) = apart(&found, &expected, 1e-4);
        let ([_, changed], _) =
            apart(&found, &by_reference(&Folder::new(&traced(&[changes, &WARM].concat())).prepared()), 1e-4);
        println!("{name}: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}; warmer {changed:.3}");
        assert!(sky < 0.005 && surface < 0.02, "{name}: {sky} of the sky and {surface} of the surfaces differ");
        assert!(changed > 0.2, "{name}: warmer space must show in {changed} of the surfaces");
        let mut plain = prepared;
        plain.scene.surrounded.reflections = isotherm::internals::Reflections::Environment;
        let ([_, without], _) = apart(&found, &by_reference(&plain), 1e-4);
        println!("{name}: the craft shows in {without:.3} of the surfaces");
        assert!(without > 0.03, "{name}: the craft must show in {without} of the surfaces");
    }
}

const WARM: [(&str, &str); 1] = [("background_temperature = 2.7", "background_temperature = 120")];

/// The tree follows the joints from image to image.
#[test]
fn reflections_follow_the_joints() {
    let joint = "[[joint]]\npart = 'wing_*'\nmode = 'schedule'\naxis = '+Y'\nschedule = { time = [0, 720], angle_deg = [0, 60] }\n[[probe]]";
    let scene = traced(&[("[[probe]]", joint), ("roughness = 0.2", "roughness = 0")]);
    let prepared = Folder::new(&scene).prepared();
    let (found, expected) = (images_of(&prepared, true), images_of(&prepared, false));
    assert!(found.len() >= 3 && found.len() == expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        let ([_, surface], worst) = apart(found, expected, 1e-3);
        println!("{surface:.4} of the surfaces, else {worst:.1e}");
        assert!(surface < 0.02, "{surface} of the surfaces differ");
    }
    let ([_, moved], _) = apart(&found[0], &expected[2], 1e-3);
    assert!(moved > 0.05, "another pose must show in {moved} of the surfaces");
}

/// The inside of a closed box at one temperature. Space and planet differ from it, and nothing of them arrives.
fn cavity(changes: &[(&str, &str)]) -> Prepared {
    let folder = Folder::new("");
    glb_of_box().save(folder.0.path());
    let mut all = vec![
        ("solar_constant = 1361\nalbedo = 0.3", ""),
        (
            "[[probe]]\nname = \"tip\"\nposition = [0, 5.5, 0]\npart = \"wing_starboard\"",
            "[initial]\ntemperature = 287",
        ),
        ("position = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]", "position = [0.6, 0.5, -0.7]\nlook_at = [-0.9, -0.8, 0.9]"),
        ("near = 0.5", "near = 0.01"),
        ("fov_deg = 45", "fov_deg = 100"),
        ("\nbackground = \"planet\"", "\nbackground = \"planet\"\nplanet_temperature = 2.7"),
    ];
    all.extend(changes);
    folder.write("scene.toml", &traced(&all));
    folder.prepared()
}

/// Radiance of the pixels over that of a blackbody at 287 K: the largest difference from 1, and the mean.
fn over_black(pixels: &Image, prepared: &Prepared) -> (f64, f64) {
    let black = band_radiance_exact(prepared.scene.band, 287.0);
    let shares = pixels.radiance.iter().map(|radiance| f64::from(*radiance) / black);
    assert!(pixels.part.iter().all(|part| *part > 0), "the box is closed");
    let (mut worst, mut sum) = (0.0_f64, 0.0);
    for share in shares {
        worst = worst.max((share - 1.0).abs());
        sum += share;
    }
    (worst, sum / pixels.part.len() as f64)
}

#[test]
fn a_closed_isothermal_cavity_looks_black_whatever_its_walls() {
    let rough = "emissivity = 0.13\nspecular = 0.7\nroughness = 0.2";
    for (name, finish) in [
        ("rough in part", rough),
        ("a smooth mirror", "emissivity = 0.02\nspecular = 1"),
        ("diffuse", "emissivity = 0.3"),
        (
            "by angle",
            "emissivity = 0.5\nspecular = 1\nroughness = 0.4\nemissivity_by_angle = { law = \"fresnel\", n = 1.4, k = 2.0 }",
        ),
    ] {
        let prepared = cavity(&[(rough, finish)]);
        for (found, most) in [(on_device(&prepared), 3e-5), (by_reference(&prepared), 1e-6)] {
            let (worst, _) = over_black(&found, &prepared);
            println!("{name}: {worst:.1e}");
            assert!(worst < most, "{name}: {worst:e}");
        }
        let mut open = prepared;
        open.scene.surrounded.reflections = isotherm::internals::Reflections::Environment;
        let (_, mean) = over_black(&on_device(&open), &open);
        assert!(mean < 0.8, "{name}: without the craft its reflections are dark: {mean}");
    }
    // A planet outside: its light is taken away again, in the mean over the rays.
    let prepared = cavity(&[("planet_temperature = 2.7", "planet_temperature = 255")]);
    let (worst, mean) = over_black(&on_device(&prepared), &prepared);
    println!("before a planet: {mean:.5} in the mean, {worst:.2} at most");
    assert!((mean - 1.0).abs() < 5e-3, "{mean}");
}

/// Each texel of several samples has rays of its own, as in the reference. Through a lens a pixel shows a texel near its centre.
#[test]
fn several_samples_and_lenses_are_traced_too() {
    let rough = "emissivity = 0.13\nspecular = 0.7\nroughness = 0.2";
    let no_channels = ("[output]\nchannels = [\"emitted\", \"reflected\"]\n", "");
    let lens = "fov_deg = 100\ndistortion = [-0.1, 0.01, 0, 0, 0]";
    for (name, camera) in [
        ("four samples", "fov_deg = 100\nsamples = 4".to_owned()),
        ("sixteen samples", "fov_deg = 100\nsamples = 16".to_owned()),
        ("a lens", lens.to_owned()),
        ("a lens with four samples", format!("{lens}\nsamples = 4")),
    ] {
        let prepared = cavity(&[("fov_deg = 100", &camera), no_channels, (rough, rough)]);
        for found in [on_device(&prepared), by_reference(&prepared)] {
            let (worst, _) = over_black(&found, &prepared);
            let black = band_radiance_exact(prepared.scene.band, 287.0);
            let leaks = found.radiance.iter().filter(|value| (f64::from(**value) / black - 1.0).abs() > 3e-5).count();
            println!("{name}: {worst:.1e}, {leaks} pixels");
            // A device rounds corners to 1/256 of a pixel. Of a wall that is seen almost edge-on, one sample of 17 may begin its path behind it.
            let allowed = if name == "sixteen samples" { (2, 5e-3) } else { (0, 3e-5) };
            assert!(leaks <= allowed.0 && worst < allowed.1, "{name}: {worst:e} and {leaks} pixels");
        }
    }
    let prepared = Folder::new(&traced(&[("fov_deg = 45", "fov_deg = 45\nsamples = 4"), no_channels])).prepared();
    let (found, expected) = (on_device(&prepared), by_reference(&prepared));
    let ([sky, surface], worst) = apart(&found, &expected, 1e-3);
    println!("four samples: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}");
    assert!(sky < 0.005 && surface < 0.05, "{sky} of the sky and {surface} of the surfaces differ");
    let mut plain = prepared;
    plain.scene.surrounded.reflections = isotherm::internals::Reflections::Environment;
    let ([_, without], _) = apart(&found, &by_reference(&plain), 1e-3);
    assert!(without > 0.05, "the craft must show in {without} of the surfaces");
}

/// The image of a craft that is far away is made from a crop, whose texels have rays too.
#[test]
fn a_distant_craft_reflects_itself_too() {
    let far = ("position = [6.5, 5, -7.5]", "position = [65, 50, -75]");
    let prepared = Folder::new(&traced(&[far])).prepared();
    let (found, expected) = (on_device(&prepared), by_reference(&prepared));
    let shown = found.part.iter().filter(|part| **part > 0).count();
    let ([sky, surface], worst) = apart(&found, &expected, 2e-3);
    println!("{shown} pixels: {sky:.4} of the sky, {surface:.4} of the surfaces, else {worst:.1e}");
    assert!((10..200).contains(&shown) && sky < 0.005 && surface <= 0.07, "{sky} and {surface} of {shown}");
    let mut plain = prepared;
    plain.scene.surrounded.reflections = isotherm::internals::Reflections::Environment;
    let ([_, without], _) = apart(&found, &by_reference(&plain), 2e-3);
    assert!(without > 0.1, "the craft must show in {without} of the surfaces");
}

/// A floor at z = 0 and a wall at x = 0 on it, each 2 m wide, with materials of the same names.
fn floor_and_wall() -> Folder {
    let mut maker = Maker::cube();
    for name in ["floor", "wall"] {
        maker.push("materials", json!({ "name": name }));
    }
    let strip = |maker: &mut Maker, corners: [[f32; 3]; 4], material: usize| {
        let positions = maker.floats(&corners);
        let indices =
            maker.accessor(&[0u8, 1, 2, 0, 2, 3], json!({"componentType": 5121, "count": 6, "type": "SCALAR"}));
        maker.primitive(json!({"attributes": { "POSITION": positions }, "indices": indices, "material": material}))
    };
    let floor = strip(&mut maker, [[0.0, -1.0, 0.0], [2.0, -1.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]], 0);
    let wall = strip(&mut maker, [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 2.0], [0.0, -1.0, 2.0]], 1);
    maker.json["nodes"] = json!([{"name": "floor", "mesh": floor}, {"name": "wall", "mesh": wall}]);
    maker.json["scenes"][0]["nodes"] = json!([0, 1]);
    let folder = Folder::new("");
    maker.save(folder.0.path());
    folder
}

/// Floor and wall at 330 K with these emissivities and finishes, before a planet at a temperature, seen by a camera.
fn of_plates(folder: &Folder, planet: &str, camera: &[(&str, &str)], materials: [(&str, f64, f64); 2]) -> Prepared {
    let planet = format!("\nbackground = \"planet\"\nplanet_temperature = {planet}");
    let mut changes = vec![
        ("solar_constant = 1361\nalbedo = 0.3", ""),
        (
            "[[probe]]\nname = \"tip\"\nposition = [0, 5.5, 0]\npart = \"wing_starboard\"",
            "[initial]\ntemperature = 330",
        ),
        ("\nbackground = \"planet\"", &planet),
    ];
    changes.extend(camera);
    let mut scene = traced(&changes);
    let stated = scene.find("[[material]]").expect("materials")..scene.find("[radiance]").expect("a section");
    let of = |(name, emissivity, specular): (&str, f64, f64)| {
        format!(
            "[[material]]\nmatch = '{name}'\nabsorptivity = 0.2\nemissivity = {emissivity}\nspecular = {specular}\nsides = \
             'outside'\nresponse = 'instant'\n"
        )
    };
    scene.replace_range(stated, &materials.map(of).concat());
    folder.write("scene.toml", &scene);
    folder.prepared()
}

/// The camera straight above the middle of the floor, which fills the image.
const ABOVE: [(&str, &str); 3] = [
    (
        "position = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]",
        "position = [1, 0, 9]\nlook_at = [1, 0, 0]\nup = [0, 1, 0]",
    ),
    ("fov_deg = 45", "fov_deg = 10"),
    ("width = 96\nheight = 72", "width = 384\nheight = 288"),
];

/// A floor beside a warm black wall, before cold space: a diffuse one reflects the view factor of the wall, and a mirror reflects what is above it, which is
/// nothing. The view factor of an element to a rectangle at a right angle is configuration B-4 of Howell's catalogue.
#[test]
fn a_diffuse_floor_shows_the_view_factor_of_a_warm_wall() {
    let folder = floor_and_wall();
    let half_factor = |along: f64, beside: f64| {
        let (x, y) = (2.0 / beside, along / beside);
        let root = (x * x + y * y).sqrt();
        ((1.0 / y).atan() - y / root * (1.0 / root).atan()) / (2.0 * std::f64::consts::PI)
    };
    let scale = 9.0 * 5f64.to_radians().tan() / 192.0;
    let of_row = |column: usize, row: usize| {
        let (x, y) = (1.0 + scale * (column as f64 + 0.5 - 192.0), scale * (row as f64 + 0.5 - 144.0));
        half_factor(x, 1.0 - y) + half_factor(x, 1.0 + y)
    };
    let shares = |prepared: &Prepared, found: &Image, emissivity: f64| {
        let black = band_radiance_exact(prepared.scene.band, 330.0);
        let share = |radiance: &f32| (f64::from(*radiance) / black - emissivity) / (1.0 - emissivity);
        found.radiance.iter().map(share).collect::<Vec<_>>()
    };
    let prepared = of_plates(&folder, "2.7", &ABOVE, [("floor", 0.2, 0.0), ("wall", 1.0, 0.0)]);
    for found in [on_device(&prepared), by_reference(&prepared)] {
        let shares = shares(&prepared, &found, 0.2);
        // Halves of the image, left and right: 55,296 rays each, so the mean has an error of 0.002 at most.
        for half in [0..192, 192..384] {
            let (mut sum, mut exact, mut count) = (0.0, 0.0, 0.0);
            for row in 0..288 {
                for column in half.clone() {
                    sum += shares[row * 384 + column];
                    exact += of_row(column, row);
                    count += 1.0;
                }
            }
            println!("columns {half:?}: {:.4} against {:.4}", sum / count, exact / count);
            assert!((sum - exact).abs() / count < 0.006, "{} against {}", sum / count, exact / count);
            assert!(exact / count > 0.03, "the wall must show");
        }
    }
    let prepared = of_plates(&folder, "2.7", &ABOVE, [("floor", 0.2, 1.0), ("wall", 1.0, 0.0)]);
    let mirrored = shares(&prepared, &on_device(&prepared), 0.2);
    assert!(mirrored.iter().all(|share| share.abs() < 1e-5), "a mirror reflects what is above it");
}

/// A mirror beside a warm wall shows the wall: e1 B + (1 - e1) B where its ray meets a black wall.
#[test]
fn a_mirror_shows_the_warm_wall_beside_it() {
    let folder = floor_and_wall();
    let view =
        [("position = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]", "position = [8.4, 0.1, 8]\nlook_at = [0.4, 0.1, 0]")];
    let centre = 36 * 96 + 48;
    for emissivity in [0.02, 0.3, 0.9] {
        let prepared = of_plates(&folder, "255", &view, [("floor", emissivity, 1.0), ("wall", 1.0, 0.0)]);
        let exact = band_radiance_exact(prepared.scene.band, 330.0);
        for found in [on_device(&prepared), by_reference(&prepared)] {
            let shown = f64::from(found.radiance[centre]);
            println!("emissivity {emissivity}: {shown:.5} against {exact:.5} W/m2/sr");
            assert!((shown / exact - 1.0).abs() < 3e-6, "{shown} against {exact}");
        }
        let mut open = prepared;
        open.scene.surrounded.reflections = isotherm::internals::Reflections::Environment;
        let shown = f64::from(on_device(&open).radiance[centre]);
        assert!((shown / exact - 1.0).abs() > 0.01, "without the wall it is darker: {shown}");
    }
}

/// Two smooth mirrors at a right angle send light back to where it came from: e1 B + (1 - e1) (e2 B + (1 - e2) P), with the
/// planet P behind the camera.
#[test]
fn a_corner_of_mirrors_shows_the_planet_behind_the_camera() {
    let folder = floor_and_wall();
    let view =
        [("position = [6.5, 5, -7.5]\nlook_at = [0, 0, 0]", "position = [8.4, 0.1, 8]\nlook_at = [0.4, 0.1, 0]")];
    let shown = |floor: f64, wall: f64| of_plates(&folder, "255", &view, [("floor", floor, 1.0), ("wall", wall, 1.0)]);
    let prepared = shown(0.1, 0.5);
    let of = |temperature| band_radiance_exact(prepared.scene.band, temperature);
    let exact = 0.1 * of(330.0) + 0.9 * (0.5 * of(330.0) + 0.5 * of(255.0));
    let centre = 36 * 96 + 48;
    for found in [on_device(&prepared), by_reference(&prepared)] {
        let shown = f64::from(found.radiance[centre]);
        println!("{shown:.5} against {exact:.5} W/m2/sr");
        assert!((shown / exact - 1.0).abs() < 2e-6, "{shown} against {exact}");
    }
    let warmer = on_device(&shown(0.1, 0.502)).radiance[centre];
    assert!((f64::from(warmer) / exact - 1.0).abs() > 5e-4, "another emissivity of the wall must show: {warmer}");
}

#[test]
fn without_rays_there_is_no_tree() {
    let resources = [
        &internals::TRACING,
        &internals::TRACE_BOXES,
        &internals::TRACE_TRIANGLES,
        &internals::TRACE_CORNERS,
        &internals::SURFACE_IMAGE,
        &internals::SURFACE,
    ];
    let planned = |scene: &str| {
        let prepared = Folder::new(scene).prepared();
        let data = DeviceData::new(&prepared);
        let plan = data.scene_data(&prepared, prepared.scene.camera.as_ref()).plan();
        resources.map(|resource| plan.iter().any(|planned| planned.resource == resource))
    };
    assert_eq!(planned(&scene_with(&[])), [false; 6]);
    assert_eq!(planned(&shining(&[])), [false; 6]);
    assert_eq!(planned(&traced(&[])), [true; 6]);
}
