//! Light that surfaces send to each other many times: images against closed forms and Mitsuba.

use isotherm::Image;
use isotherm::internals::{Prepared, band_radiance_exact};
use serde_json::json;

use super::craft::{Folder, glb_of_box};
use super::model::make::Maker;
use super::reflections::{by_reference, on_device};

/// Corners of a quadrilateral, its front to the left of them.
pub type Corners = [[f32; 3]; 4];

/// Quadrilaterals as parts with the materials of the same names.
pub fn save_quads(folder: &Folder, quads: &[(&str, Corners)]) {
    let mut maker = Maker::new();
    maker.json["nodes"] = json!([]);
    maker.json["scenes"][0]["nodes"] = json!([]);
    for (index, (name, corners)) in quads.iter().enumerate() {
        maker.push("materials", json!({ "name": name }));
        let positions = maker.floats(corners);
        let fields = json!({"componentType": 5121, "count": 6, "type": "SCALAR"});
        let indices = maker.accessor(&[0u8, 1, 2, 0, 2, 3], fields);
        let attributes = json!({ "POSITION": positions });
        let mesh = maker.primitive(json!({"attributes": attributes, "indices": indices, "material": index}));
        maker.push("nodes", json!({"name": name, "mesh": mesh}));
        maker.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(index));
    }
    maker.save(folder.0.path());
}

/// A scene of a folder's model at one temperature. `radiance` and `camera` are lines of their sections.
fn scene(temperature: f64, materials: &str, radiance: &str, camera: &str) -> String {
    format!(
        "[model]\npath = \"made.glb\"\n[time]\nstep = 1\nsteps = 1\ndraw_steps = [0]\n[orbit]\naltitude = 408e3\n\
         [attitude]\nmode = \"nadir\"\nnadir_axis = \"-Z\"\nforward_axis = \"+X\"\n[environment]\nplanet_radius = 6371e3\n\
         background_temperature = 0\n[initial]\ntemperature = {temperature}\n{materials}\n[radiance]\nband_um = [8, 14]\n\
         {radiance}\n[camera]\nframe = \"body\"\nnear = 0.01\n{camera}\n"
    )
}

pub fn material(name: &str, emissivity: f64, finish: &str) -> String {
    format!(
        "[[material]]\nmatch = \"{name}\"\nabsorptivity = 0.1\nemissivity = {emissivity}\nsides = \"outside\"\nresponse = \"instant\"\n\
         {finish}\n"
    )
}

const FINISHES: [&str; 3] = ["", "specular = 1\nroughness = 0.2", "specular = 1\nroughness = 0"];

/// Two plates of 8 x 1.5 m that meet at the Y axis, at half an opening to both sides of +Z [deg].
fn groove(opening: f64) -> [(&'static str, Corners); 2] {
    let (sine, cosine) = (opening / 2.0).to_radians().sin_cos();
    let (x, z) = ((1.5 * sine) as f32, (1.5 * cosine) as f32);
    let plate = |x: f32, y: f32| [[0.0, -y, 0.0], [0.0, y, 0.0], [x, y, z], [x, -y, z]];
    [("left", plate(-x, 4.0)), ("right", plate(x, -4.0))]
}

const GROOVE_CAMERA: &str =
    "width = 96\nheight = 72\nfov_deg = 20\nposition = [0.6, 0.35, 4.5]\nlook_at = [0, 0, 0.7]\nup = [1, 0, 0]";

/// A groove of foil at 300 K before cold space.
fn groove_of(opening: f64, finish: &str, radiance: &str, samples: u32) -> Prepared {
    let folder = Folder::new("");
    save_quads(&folder, &groove(opening));
    let materials = ["left", "right"].map(|name| material(name, 0.05, finish)).concat();
    let radiance = format!("reflections = \"traced\"\n{radiance}");
    let camera = format!("{GROOVE_CAMERA}\nsamples = {samples}");
    folder.write("scene.toml", &scene(300.0, &materials, &radiance, &camera));
    folder.prepared()
}

/// Mean radiance of the pixels that show the craft, over that of a blackbody.
fn mean_share(prepared: &Prepared, image: &Image, temperature: f64) -> f64 {
    let black = band_radiance_exact(prepared.scene.band, temperature);
    let shown: Vec<f64> = (0..image.part.len())
        .filter(|index| image.part[*index] > 0)
        .map(|index| f64::from(image.radiance[index]) / black)
        .collect();
    shown.iter().sum::<f64>() / shown.len() as f64
}

/// A groove of smooth mirrors by unfolding: a ray that meets n faces of emissivity e shows 1 - (1 - e)^n of a blackbody.
#[test]
fn a_groove_of_smooth_mirrors_shows_all_its_reflections() {
    for opening in [60.0_f64, 30.0] {
        let prepared = groove_of(opening, FINISHES[2], "", 1);
        let black = band_radiance_exact(prepared.scene.band, 300.0);
        let faces = groove_hits(opening);
        for image in [on_device(&prepared), by_reference(&prepared)] {
            let (mut off, mut shown, mut sum, mut exact) = (0, 0, 0.0, 0.0);
            for (index, hits) in faces.iter().enumerate().filter(|(index, _)| image.part[*index] > 0) {
                let expected = 1.0 - 0.95_f64.powi(*hits);
                let share = f64::from(image.radiance[index]) / black;
                shown += 1;
                off += i32::from((share / expected - 1.0).abs() > 1e-4);
                sum += share;
                exact += expected;
            }
            println!(
                "{opening} deg: {:.4} for {:.4}, {off} of {shown} pixels differ",
                sum / f64::from(shown),
                exact / f64::from(shown)
            );
            assert!(shown > 4000 && off * 50 < shown, "{opening}: {off} of {shown} pixels");
            assert!((sum / exact - 1.0).abs() < 2e-3, "{opening}: {sum} for {exact}");
        }
        let one = groove_of(opening, FINISHES[2], "bounces = 1", 1);
        let short = mean_share(&one, &on_device(&one), 300.0);
        assert!(short < 0.0976, "one reflection shows two faces at most: {short}");
    }
}

/// Faces that the rays of the pixels meet in a groove of smooth mirrors.
fn groove_hits(opening: f64) -> Vec<i32> {
    use glam::DVec3;
    let (eye, target) = (DVec3::new(0.6, 0.35, 4.5), DVec3::new(0.0, 0.0, 0.7));
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::X).normalize();
    let down = forward.cross(right);
    let (sine, cosine) = (opening / 2.0).to_radians().sin_cos();
    let scale = 10f64.to_radians().tan() / 48.0;
    let of_pixel = |index: usize| {
        let (x, y) = ((index % 96) as f64 + 0.5 - 48.0, (index / 96) as f64 + 0.5 - 36.0);
        let mut direction = (forward + scale * (x * right + y * down)).normalize();
        let (mut from, mut hits, mut last) = (eye, 0, 0.0);
        loop {
            let meets = |side: f64| {
                let along = DVec3::new(side * sine, 0.0, cosine);
                let normal = DVec3::new(-side * cosine, 0.0, sine);
                let distance = -from.dot(normal) / direction.dot(normal);
                let place = from + distance * direction;
                let inside = (0.0..1.5).contains(&place.dot(along)) && place.y.abs() < 4.0;
                (side != last && distance > 0.0 && inside).then_some((distance, side, place, normal))
            };
            let nearest = [-1.0, 1.0].into_iter().filter_map(meets).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, side, place, normal)) = nearest else { return hits };
            (from, last, hits) = (place, side, hits + 1);
            direction -= 2.0 * direction.dot(normal) * normal;
        }
    };
    (0..96 * 72).map(of_pixel).collect()
}

/// Means over the pixels, of Mitsuba 3.9.1 with all bounces and lobes divided by their sums:
/// `python -m peer_bench.bounces_mitsuba`, which says why. Mitsuba's own lobe of roughness 0.2 loses light: 0.1165 and 0.0873.
#[test]
fn grooves_and_corners_are_as_bright_as_in_mitsuba() {
    let mean = |opening: f64, finish: &str, radiance: &str, device: bool| {
        let prepared = groove_of(opening, finish, radiance, 16);
        let image = if device { on_device(&prepared) } else { by_reference(&prepared) };
        mean_share(&prepared, &image, 300.0)
    };
    for (opening, finish, expected) in [(60.0, 0, 0.1108), (60.0, 1, 0.1262), (90.0, 0, 0.0769), (90.0, 1, 0.0905)] {
        for device in [true, false] {
            let found = mean(opening, FINISHES[finish], "", device);
            println!("{opening} deg, finish {finish}: {found:.4} for {expected}");
            assert!((found / expected - 1.0).abs() < 0.01, "{opening}, {finish}: {found} for {expected}");
        }
    }
    // Paths that chance ends have the same mean. One reflection does not.
    let all = mean(60.0, FINISHES[1], "bounces = \"all\"", true);
    assert!((all / 0.1262 - 1.0).abs() < 0.01, "{all}");
    let few = mean(60.0, FINISHES[1], "bounces = 1", true);
    assert!(few < 0.1, "one reflection is too few: {few}");
}

/// A craft of many triangles needs several dispatches for its paths. The same groove with fine facets is as bright.
#[test]
fn paths_go_on_in_the_next_dispatch() {
    let folder = Folder::new("");
    save_quads(&folder, &groove(60.0));
    let materials = ["left", "right"].map(|name| material(name, 0.05, FINISHES[1])).concat();
    let whole = scene(300.0, &materials, "reflections = \"traced\"", GROOVE_CAMERA);
    folder.write("scene.toml", &whole.replace("path = \"made.glb\"", "path = \"made.glb\"\nmax_edge = 0.12"));
    let prepared = folder.prepared();
    assert!(prepared.triangles.len() > 3000, "{} triangles", prepared.triangles.len());
    for image in [on_device(&prepared), by_reference(&prepared)] {
        let found = mean_share(&prepared, &image, 300.0);
        println!("{found:.4} with {} triangles", prepared.triangles.len());
        assert!((found / 0.1262 - 1.0).abs() < 0.01, "{found}");
    }
}

/// Rough foil that faces a small warm box above it: the place where a mirror would show the box is hardly brighter than one beside it, 1.01 times at
/// roughness 1 and 1.06 at 0.6 in Mitsuba.
#[test]
fn rough_foil_shows_no_ghost_of_a_warm_box() {
    let square = |size: f32, z: f32| [[-size, -size, z], [size, -size, z], [size, size, z], [-size, size, z]];
    let folder = Folder::new("");
    let mut below = square(0.15, 3.0);
    below.reverse();
    save_quads(&folder, &[("box", below), ("foil", square(4.0, 0.0))]);
    // Share of a blackbody at the temperature of the box that foil shows about a place. The mirror shows the box about (0.6, 0, 0).
    let share = |roughness: f64, place: [f64; 2], device: bool| {
        let [x, y] = place;
        let camera = format!(
            "width = 128\nheight = 128\nfov_deg = 2.4\nsamples = 16\nposition = [1.2, 0, 3]\nlook_at = [{x}, {y}, 0]\nup = [0, 1, 0]"
        );
        let rough = format!("specular = 1\nroughness = {roughness}");
        let materials = material("box", 1.0, "") + &material("foil", 1e-3, &rough);
        folder.write("scene.toml", &scene(500.0, &materials, "reflections = \"traced\"", &camera));
        let prepared = folder.prepared();
        let image = if device { on_device(&prepared) } else { by_reference(&prepared) };
        mean_share(&prepared, &image, 500.0) - 1e-3
    };
    for (roughness, device) in [(1.0, true), (1.0, false), (0.6, true)] {
        let [at, beside] = [[0.6, 0.0], [0.6, 0.25]].map(|place| share(roughness, place, device));
        println!("roughness {roughness}: {at:.5} at the image of the box, {beside:.5} beside it");
        assert!(beside > 5e-4 && (0.75..1.3).contains(&(at / beside)), "{roughness}: {at} and {beside}");
    }
    let [at, beside] = [[0.6, 0.0], [0.6, 0.25]].map(|place| share(0.02, place, true));
    assert!(at > 20.0 * beside.max(1e-4), "a mirror must show the box: {at} and {beside}");
}

/// The inside of a closed box at one temperature before a planet at another shows neither its light nor noise.
#[test]
fn a_planet_outside_a_closed_box_adds_no_noise() {
    let folder = Folder::new("");
    glb_of_box().save(folder.0.path());
    let camera = "width = 96\nheight = 72\nfov_deg = 100\nposition = [0.6, 0.5, -0.7]\nlook_at = [-0.9, -0.8, 0.9]\nup = [0, 0, -1]";
    for finish in ["", "specular = 1", "specular = 1\nroughness = 0.2", "specular = 0.7\nroughness = 1"] {
        let radiance = "reflections = \"traced\"\nbackground = \"planet\"\nplanet_temperature = 255";
        folder.write("scene.toml", &scene(287.0, &material("skin", 0.05, finish), radiance, camera));
        let prepared = folder.prepared();
        let black = band_radiance_exact(prepared.scene.band, 287.0);
        for image in [on_device(&prepared), by_reference(&prepared)] {
            let off = image.radiance.iter().map(|radiance| (f64::from(*radiance) / black - 1.0).abs());
            let worst = off.fold(0.0, f64::max);
            println!("{finish:?}: {worst:.1e}");
            assert!(worst < 1e-3, "{finish}: {worst}");
        }
    }
}

/// A convex body meets none of its own faces: rays change nothing, also where normals lean beyond the facets.
#[test]
fn a_convex_body_looks_the_same_with_and_without_rays() {
    let folder = Folder::new("");
    save_ball(&folder);
    // Where a device rounds the corners of a facet that is seen edge-on, it may show its back. That happens in a few of these views.
    let views = ["[3, 2, 4]", "[4, 3, 1]", "[-1, 4.2, 2.3]", "[2.2, -4.1, 1.4]"];
    let finishes = ["", "specular = 1", "specular = 1\nroughness = 0.3"];
    for (view, finish) in views.into_iter().flat_map(|view| finishes.map(|finish| (view, finish))) {
        let camera =
            format!("width = 320\nheight = 240\nfov_deg = 25\nposition = {view}\nlook_at = [0, 0, 0]\nup = [0, 1, 0]");
        let image = |reflections: &str| {
            let radiance =
                format!("reflections = \"{reflections}\"\nbackground = \"planet\"\nplanet_temperature = 255");
            let text = scene(250.0, &material("ball", 0.1, finish), &radiance, &camera);
            let sun = "background_temperature = 0\nsolar_constant = 1361";
            folder.write("scene.toml", &text.replace("background_temperature = 0", sun));
            let prepared = folder.prepared();
            [on_device(&prepared), by_reference(&prepared)]
        };
        for (with, without) in image("traced").iter().zip(&image("environment")) {
            let pairs = with.radiance.iter().zip(&without.radiance);
            let off = pairs.filter(|(one, other)| (*one / *other - 1.0).abs() > 1e-5).count();
            println!("{finish:?} from {view}: {off} pixels differ");
            assert!(off == 0, "{finish:?} from {view}: {off} pixels differ");
        }
    }
}

/// A ball of radius 1 with the normals of a ball, in coarse facets.
fn save_ball(folder: &Folder) {
    let (rows, columns) = (16, 32);
    let mut points: Vec<[f32; 3]> = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let (polar, azimuth) =
                (std::f32::consts::PI * row as f32 / 16.0, std::f32::consts::TAU * column as f32 / 32.0);
            points.push([polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()]);
        }
    }
    let mut indices: Vec<u16> = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let at = |down: usize, across: usize| ((row + down) * (columns + 1) + column + across) as u16;
            let (a, b, c, d) = (at(0, 0), at(1, 0), at(1, 1), at(0, 1));
            indices.extend(
                [[a, b, c], [a, c, d]]
                    .iter()
                    .zip([row + 1 < rows, row > 0])
                    .filter(|(_, has)| *has)
                    .flat_map(|(corners, _)| *corners),
            );
        }
    }
    let mut maker = Maker::new();
    maker.push("materials", json!({ "name": "ball" }));
    let positions = maker.floats(&points);
    let normals = maker.floats(&points);
    let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
    let fields = json!({"componentType": 5123, "count": indices.len(), "type": "SCALAR"});
    let indices = maker.accessor(&bytes, fields);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    maker.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
    maker.save(folder.0.path());
}
