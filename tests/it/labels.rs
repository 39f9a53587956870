//! Labels of images that a simulation took, in f64: poses, masks and key points against the pixels.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};
use isotherm::internals::{
    Craft, ImageIdentity, ImageLabels, LabelledImage, Solids, Split, Visibility, chosen, craft, fixed, labelled, made,
    orbit, seen,
};
use isotherm::{CameraFrame, Pose, Simulation, Target};
use serde_json::Value;

use super::craft::{Folder, glb_of_box, scene_with};

/// A wing that is turned, and a mast that is drawn in.
const JOINTS: &str = "[[joint]]\npart = \"wing_starboard\"\nmode = \"fixed\"\naxis = \"+Y\"\nangle_deg = 50\n\
                      [[joint]]\npart = \"mast\"\nkind = \"translation\"\nmode = \"fixed\"\naxis = \"-Z\"\ndistance = 0.7\n";

fn simulation(folder: &Folder) -> Simulation {
    Simulation::load(&folder.path("scene.toml"), &Target::Reference).expect("a scene that can run")
}

/// An image of the craft from a point of the body frame [m].
fn image(simulation: &mut Simulation, from: DVec3, at: DVec3, number: u32) -> LabelledImage {
    let camera = simulation.camera().expect("a camera").clone();
    let pose = Pose::look_at(CameraFrame::Body, from, at, DVec3::NEG_Z).expect("a pose");
    let image = simulation.image(&camera, &pose).expect("an image");
    let place = ImageIdentity {
        sample: u64::from(number),
        orbit: 1,
        number,
        split: Split::Test,
        bits: 16,
        sensor: Vec::new(),
        drawn: Vec::new(),
    };
    labelled(place, simulation.prepared(), image)
}

fn craft_of(simulation: &Simulation) -> Craft {
    let mut craft = craft(simulation.prepared());
    craft.key_points = chosen(&craft, 12);
    craft
}

fn views() -> impl Iterator<Item = DVec3> {
    (0..6).map(|number| {
        let angle = TAU * (f64::from(number) + 0.3) / 6.0;
        DVec3::new(11.0 * angle.cos(), 11.0 * angle.sin(), 7.0 * (2.0 * angle + 0.4).sin())
    })
}

fn text<'a>(made: &'a ImageLabels, ending: &str) -> &'a str {
    let label = made.labels.iter().find(|label| label.ending.as_deref() == Some(ending)).expect("a label");
    std::str::from_utf8(&label.bytes).expect("text")
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// `rleFrString` of `maskApi.c`, and then `rleDecode`: pixels in rows.
fn decoded(segmentation: &Value) -> Vec<bool> {
    let mut bytes = segmentation["counts"].as_str().expect("a string").bytes();
    let mut runs: Vec<i64> = Vec::new();
    while let Some(byte) = bytes.next() {
        let (mut value, mut shift, mut group) = (0_i64, 0, i64::from(byte) - 48);
        loop {
            value |= (group & 0x1f) << shift;
            shift += 5;
            if group & 0x20 == 0 {
                break;
            }
            group = i64::from(bytes.next().expect("another group")) - 48;
        }
        if group & 0x10 != 0 {
            value |= -1 << shift;
        }
        runs.push(value + if runs.len() > 2 { runs[runs.len() - 2] } else { 0 });
    }
    let [height, width] = [0, 1].map(|axis| segmentation["size"][axis].as_u64().expect("a size") as usize);
    let columns: Vec<bool> =
        runs.iter().enumerate().flat_map(|(place, run)| std::iter::repeat_n(place % 2 == 1, *run as usize)).collect();
    assert_eq!(columns.len(), width * height);
    (0..width * height).map(|at| columns[at % width * height + at / width]).collect()
}

#[test]
fn masks_of_coco_are_the_parts_of_the_image() {
    let folder = Folder::new(&scene_with(&[]));
    let mut simulation = simulation(&folder);
    let craft = craft_of(&simulation);
    let solids = Solids::new(&craft);
    for (number, from) in views().enumerate() {
        let image = image(&mut simulation, from, DVec3::ZERO, number as u32);
        let made = made(&craft, &solids, &image).expect("labels");
        let mut parts = vec![0; image.pixels()];
        for annotation in made.lines.coco.annotations.iter().map(|line| json(line)) {
            let (mask, category) =
                (decoded(&annotation["segmentation"]), annotation["category_id"].as_u64().expect("a number"));
            assert_eq!(mask.iter().filter(|set| **set).count() as u64, annotation["area"].as_u64().expect("a number"));
            if category == 1 {
                assert!(mask.iter().zip(&image.channels.part).all(|(set, part)| *set == (*part != 0)), "the craft");
                continue;
            }
            for (part, _) in parts.iter_mut().zip(mask).filter(|(_, set)| *set) {
                assert_eq!(std::mem::replace(part, category as u32 - 1), 0, "two parts in one pixel");
            }
        }
        assert_eq!(parts, image.channels.part);
    }
}

/// Image in both masks over pixels in any.
fn overlap(a: &[bool], b: &[bool]) -> f64 {
    let pairs = || a.iter().zip(b);
    let any = pairs().filter(|(a, b)| **a || **b).count();
    pairs().filter(|(a, b)| **a && **b).count() as f64 / any.max(1) as f64
}

#[test]
fn silhouettes_by_pose_are_the_masks_of_the_image() {
    let folder = Folder::new(&format!("{}\n{JOINTS}", scene_with(&[])));
    let mut simulation = simulation(&folder);
    let craft = craft_of(&simulation);
    assert_eq!(craft.links, ["body", "wing_starboard", "mast"]);
    let solids = Solids::new(&craft);
    assert_eq!(solids.objects().iter().map(|object| object.id).collect::<Vec<_>>(), [1, 2, 3]);
    let (mut hidden, mut least) = (0, 1.0_f64);
    for (number, from) in views().enumerate() {
        let image = image(&mut simulation, from, DVec3::ZERO, number as u32);
        let silhouettes = solids.silhouettes(&image);
        let mut any = vec![false; image.pixels()];
        for silhouette in &silhouettes {
            // A pixel on an edge may fall to either side by rounding.
            let outside =
                silhouette.visible.iter().zip(&silhouette.full).filter(|(visible, full)| **visible && !**full);
            assert!(outside.count() <= 1);
            hidden += silhouette.full.iter().filter(|set| **set).count()
                - silhouette.visible.iter().filter(|set| **set).count();
            any.iter_mut().zip(&silhouette.full).for_each(|(any, full)| *any |= *full);
        }
        let shown: Vec<bool> = image.channels.part.iter().map(|part| *part != 0).collect();
        assert!(overlap(&any, &shown) > 0.999, "view {number}: {}", overlap(&any, &shown));
        // With the joints as in the file, the silhouettes are others.
        let mut still = image.clone();
        still.links = vec![DAffine3::IDENTITY; 3];
        least = least.min(overlap(&solids.silhouettes(&still)[1].full, &silhouettes[1].full));
    }
    assert!(hidden > 100, "no part hides another: {hidden} pixels");
    assert!(least < 0.9, "the joint does not show: {least}");
}

#[test]
fn a_craft_beyond_the_frame_is_counted_there_too() {
    let folder = Folder::new(&scene_with(&[]));
    let mut simulation = simulation(&folder);
    let craft = craft_of(&simulation);
    let solids = Solids::new(&craft);
    assert_eq!(solids.objects().len(), 1);
    let from = DVec3::new(9.0, 8.0, -7.0);
    let whole = image(&mut simulation, 2.0 * from, DVec3::ZERO, 0);
    let inside = solids.silhouettes(&whole).remove(0);
    assert_eq!(inside.full, inside.visible);
    assert_eq!(inside.count, inside.visible.iter().filter(|set| **set).count() as u64);
    // The same camera turned away by half a frame.
    let mut moved = whole.clone();
    let by = f64::from(whole.width / 2);
    let cut = image_turned(&mut moved, by);
    let beyond = solids.silhouettes(&cut).remove(0);
    assert!(beyond.visible.iter().filter(|set| **set).count() < beyond.count as usize);
    assert_eq!(beyond.count, inside.count);
    let [a, b] = [inside.bounds, beyond.bounds].map(|bounds| bounds.expect("a box").bop());
    assert_eq!([a[0] - by as i64, a[1], a[2], a[3]], b);
}

/// The image whose principal point is moved to the left, with the pixels moved along.
fn image_turned(image: &mut LabelledImage, by: f64) -> LabelledImage {
    image.lens.centre[0] -= by;
    let (width, by) = (image.width as usize, by as usize);
    for row in image.channels.part.chunks_mut(width) {
        row.rotate_left(by);
        row[width - by..].fill(0);
    }
    image.clone()
}

#[test]
fn depth_and_pose_put_each_pixel_on_the_box() {
    let folder = Folder::new(&scene_with(&[]));
    glb_of_box().save(folder.0.path());
    folder.write("scene.toml", &box_scene());
    let mut simulation = simulation(&folder);
    let craft = craft_of(&simulation);
    for (number, from) in views().enumerate() {
        let image = image(&mut simulation, 0.5 * from, DVec3::ZERO, number as u32);
        let entry = json(&isotherm::internals::entry(&image));
        let turn: Vec<f64> = serde_json::from_value(entry["q_vbs2tango_true"].clone()).expect("four numbers");
        let origin: [f64; 3] = serde_json::from_value(entry["r_Vo2To_vbs_true"].clone()).expect("three numbers");
        let turn = glam::DQuat::from_xyzw(turn[1], turn[2], turn[3], turn[0]);
        let k = image.camera_matrix();
        // Distance of the places of the pixels from the surface of the box, in pixels.
        let worst = |turn: glam::DQuat, shift: f64| {
            let places = (0..image.pixels()).filter(|at| image.channels.part[*at] != 0).map(|at| {
                let [x, y] = [at % image.width as usize, at / image.width as usize].map(|at| at as f64 + shift);
                let depth = f64::from(image.channels.depth[at]);
                let ray = DVec3::new((x - k[2]) / k[0], (y - k[5]) / k[4], 1.0);
                let place = turn.inverse() * (ray * depth - DVec3::from(origin));
                (place.abs().max_element() - 1.0).abs() * k[0] / depth
            });
            places.fold(0.0, f64::max)
        };
        assert!(worst(turn, 0.0) < 0.001, "view {number}: {} px", worst(turn, 0.0));
        assert!(worst(turn, 0.5) > 0.1, "half a pixel shows");
        assert!(worst(turn.inverse(), 0.0) > 1.0, "the other way round shows");

        // A corner of a convex body is seen if one of its three faces looks at the camera.
        let eye = image.camera_from_body.inverse().translation;
        for (point, seen) in craft.key_points.iter().zip(seen(&craft.key_points, &image)) {
            let corner = point.position.abs().min_element() > 0.999;
            if !corner {
                continue;
            }
            let visible = (0..3).any(|axis| (eye[axis] - point.position[axis]) * point.position[axis] > 0.0);
            let expected = if visible { Visibility::Visible } else { Visibility::Hidden };
            assert_eq!(seen.visibility, expected, "view {number}, {} at {}", point.name, point.position);
            // Where it appears, a pixel of the craft is near.
            let at = seen.pixel.expect("before the camera");
            if visible {
                let near = (0..image.pixels()).filter(|at| image.channels.part[*at] != 0).map(|pixel| {
                    let centre =
                        DVec2::new((pixel % image.width as usize) as f64, (pixel / image.width as usize) as f64);
                    ((at - centre).abs() - 0.5).max(DVec2::ZERO).length()
                });
                assert!(near.fold(f64::INFINITY, f64::min) < 0.5, "{} at {at}", point.name);
            }
        }
    }
    let corners = craft.key_points.iter().filter(|point| point.position.abs().min_element() > 0.999);
    assert_eq!(corners.count(), 8, "the first key points are the corners");
}

/// The scene of the craft for its box alone.
fn box_scene() -> String {
    let scene = scene_with(&[]);
    let (kept, _) = scene.split_once("[[probe]]").expect("a probe");
    let (head, rest) = kept.split_once("[[material]]\nmatch = \"cells\"").expect("cells");
    let (_, tail) = rest.split_once("[radiance]").expect("a band");
    format!("{head}[radiance]{tail}")
}

#[test]
fn an_orbit_has_its_lists_and_a_data_set_its_models() {
    let folder = Folder::new(&format!("{}\n{JOINTS}", scene_with(&[])));
    let mut simulation = simulation(&folder);
    let craft = craft_of(&simulation);
    let solids = Solids::new(&craft);
    let images: Vec<LabelledImage> =
        views().enumerate().map(|(number, from)| image(&mut simulation, from, DVec3::ZERO, number as u32)).collect();
    let labels: Vec<ImageLabels> = images.iter().map(|image| made(&craft, &solids, image).expect("labels")).collect();
    let lines: Vec<_> = labels.iter().map(|made| made.lines.clone()).collect();
    let files = orbit(Split::Test, 1, &lines);
    let names: Vec<&str> = files.iter().map(|(path, _)| path.as_str()).collect();
    assert_eq!(names, ["test/000001/scene_camera.json", "test/000001/scene_gt.json", "test/000001/scene_gt_info.json"]);
    for (path, bytes) in &files {
        let list = json(std::str::from_utf8(bytes).expect("text"));
        assert_eq!(list.as_object().map(serde_json::Map::len), Some(6), "{path}");
    }
    // What an image has in the lists is what it has in the tar, and lines survive a file.
    assert_eq!(json(text(&labels[2], "gt.json")), json(std::str::from_utf8(&files[1].1).expect("text"))["2"]);
    let kept = serde_json::to_string(&lines[2]).expect("it can be kept");
    assert_eq!(serde_json::from_str::<isotherm::internals::ImageLines>(&kept).expect("it can be read"), lines[2]);
    // The same image has the same bytes.
    assert_eq!(made(&craft, &solids, &images[2]).expect("labels"), labels[2]);

    let fixed = fixed(&craft, &solids, &images[0]);
    let names: Vec<&str> = fixed.iter().map(|(path, _)| path.as_str()).collect();
    assert_eq!(
        names,
        [
            "models/obj_000001.ply",
            "models/obj_000002.ply",
            "models/obj_000003.ply",
            "models/craft.ply",
            "models/models_info.json",
            "camera.json",
            "speed/camera.json",
            "speed/keypoints.json",
            "README.txt"
        ]
    );
    let conventions = std::str::from_utf8(&fixed[8].1).expect("text");
    assert!(conventions.contains("     3  mast\n") && conventions.contains("    2              3  "), "{conventions}");
}
