//! Several targets in a scene, and an attitude that is drawn over modes.

use std::collections::BTreeSet;

use isotherm::internals::{Attitude, read_png};
use serde_json::Value;

use super::Workshop;

const TARGETS: (&str, &str) = (
    "[[key_point]]\nname = \"tip\"",
    "[[target]]\nname = \"chaser\"\nmatch = [\"wing_*\"]\n\n[[target]]\nname = \"client\"\nmatch = [\"mast\"]\n\n[[key_point]]\nname = \"tip\"",
);

const ATTITUDE: (&str, &str) = (
    "[each_orbit.orbit]",
    "[each_orbit]\nattitude = { choice = [\n  { mode = \"inertial\", quaternion = { rotation = \"uniform\" } },\n  { mode = \"sun\", sun_axis = \"+Z\", \
     north_axis = { choice = [\"+X\", \"+Y\"] } },\n  { mode = \"spin\", quaternion = { rotation = \"uniform\" }, spin_axis = [0, 0, 1], rate_deg = { uniform = \
     [0.1, 1] } },\n  { mode = \"nadir\" },\n], weights = [1, 1, 1, 1] }\n\n[each_orbit.orbit]",
);

/// Each mode of a choice is drawn, with its own values, and the keys of the scene's mode stay only with that mode.
#[test]
fn an_attitude_is_drawn_over_its_modes() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 80"), ATTITUDE]);
    let (spec, scenes) = workshop.spec();
    let mut modes = BTreeSet::new();
    let mut rates = BTreeSet::new();
    for orbit in 0..40 {
        let made = scenes.of_orbit(&spec, orbit).expect("a scene");
        let drawn = &made.values.drawn["attitude"];
        let mode = drawn["mode"].as_str().expect("a mode");
        match made.scene.attitude {
            Attitude::Nadir { nadir_axis, .. } => {
                assert_eq!(mode, "nadir");
                assert_eq!(nadir_axis, glam::DVec3::Z, "the scene's own key");
            }
            Attitude::Inertial { inertial_from_body } => {
                assert_eq!(mode, "inertial");
                assert!((drawn["quaternion"][0].as_f64().expect("a number") - inertial_from_body.w).abs() < 1e-12);
            }
            Attitude::Sun { .. } => assert_eq!(mode, "sun"),
            Attitude::Spin { rate, .. } => {
                assert!((0.1..1.0).contains(&rate.to_degrees()), "{rate}");
                rates.insert(rate.to_bits());
            }
            other => panic!("{other:?}"),
        }
        modes.insert(mode.to_owned());
    }
    assert_eq!(modes.len(), 4, "{modes:?}");
    assert!(rates.len() > 1, "each orbit has a rate of its own");
    // A key that no mode of the choice has is refused with the choice, and a value at the end of a choice with the scene's words.
    for (from, to, part) in [
        ("rate_deg", "rate", "no key 'rate'"),
        ("sun_axis = \"+Z\"", "sun_axis = \"+X\"", "parallel"),
        ("{ mode = \"nadir\" }", "{ mode = \"nadir\", sun_axis = \"+Z\" }", "belongs to mode = 'sun'"),
    ] {
        let broken = ATTITUDE.1.replace(from, to);
        let workshop = Workshop::new(&[(ATTITUDE.0, &broken)]);
        let told = workshop
            .load()
            .map(|_| ())
            .and_then(|()| workshop.make("set", (0, 1), isotherm::internals::Begin::Fresh).map(|_| ()));
        let message = told.expect_err("it is refused").to_string();
        assert!(message.contains(part), "{message}");
    }
}

/// Boxes, masks, classes and instances of two targets against the map of parts, in each format.
#[test]
fn each_target_has_its_labels() {
    let workshop = Workshop::new(&[("samples = 6", "samples = 2"), ("in_view = 0.6", "in_view = 0.9"), TARGETS]);
    workshop.whole("set");
    let tree = workshop.tree("set");
    let text = |name: &str| std::str::from_utf8(&tree[name]).expect("text");
    let json = |name: &str| serde_json::from_str::<Value>(text(name)).expect("JSON");
    let folder = tree.keys().find_map(|name| name.strip_suffix("/scene_gt.json")).expect("an orbit").to_owned();
    let split = folder.split('/').next().expect("a split").to_owned();
    let coco = json(&format!("coco/{split}.json"));
    let named = |list: &Value| -> Vec<(u64, String)> {
        let one =
            |item: &Value| (item["id"].as_u64().expect("an id"), item["name"].as_str().expect("a name").to_owned());
        list.as_array().expect("a list").iter().map(one).collect()
    };
    let categories = named(&coco["categories"]);
    assert_eq!(categories[..2], [(1, "chaser".to_owned()), (2, "client".to_owned())]);
    assert_eq!(categories.len(), 2 + 4);
    assert_eq!(
        [&coco["categories"][0]["keypoints"], &coco["categories"][1]["keypoints"]],
        [&serde_json::json!(["tip"]), &serde_json::json!([])]
    );
    let ids: BTreeSet<u64> =
        coco["annotations"].as_array().expect("a list").iter().filter_map(|one| one["id"].as_u64()).collect();
    assert_eq!(
        ids.len(),
        coco["annotations"].as_array().expect("a list").len(),
        "each annotation has an id of its own"
    );
    let parts_of = [["wing_port", "wing_starboard"].as_slice(), &["mast"]];
    let mut compared = 0;
    for number in 0..2_u64 {
        let at = |what: &str, ending: &str| format!("{folder}/{what}/{number:06}.{ending}");
        let (size, parts) = read_png(&tree[&at("part", "png")]).expect("a PNG");
        let (_, instances) = read_png(&tree[&at("instance", "png")]).expect("a PNG");
        let label = json(&at("label", "json"));
        let info = &json(&format!("{folder}/scene_gt_info.json"))[number.to_string()];
        let yolo: Vec<&str> = text(&at("gray8", "txt")).lines().collect();
        let kitti: Vec<&str> = text(&at("kitti", "txt")).lines().collect();
        let part_of_pixel: Vec<u16> = parts.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
        let mut lines = 0;
        for (target, names) in parts_of.iter().enumerate() {
            let values: Vec<u64> = categories[2..]
                .iter()
                .filter(|(_, name)| names.contains(&name.as_str()))
                .map(|(id, _)| id - 2)
                .collect();
            let mask: Vec<bool> = part_of_pixel.iter().map(|part| values.contains(&u64::from(*part))).collect();
            assert!(
                mask.iter().zip(&instances).all(|(set, id)| *set == (usize::from(*id) == target + 1)),
                "instance {target}"
            );
            let count = mask.iter().filter(|set| **set).count() as u64;
            assert_eq!(label["targets"][target]["pixels"], count);
            assert_eq!(info[target]["px_count_visib"], count);
            let (_, visible) =
                read_png(&tree[&format!("{folder}/mask_visib/{number:06}_{target:06}.png")]).expect("a PNG");
            assert!(visible.iter().zip(&mask).all(|(byte, set)| (*byte == 255) == *set));
            let annotation = coco["annotations"]
                .as_array()
                .expect("a list")
                .iter()
                .find(|one| one["image_id"] == label["sample"] && one["category_id"] == target + 1);
            assert_eq!(annotation.is_some(), count > 0);
            let Some(annotation) = annotation else { continue };
            assert_eq!(
                (annotation["area"].as_u64(), &annotation["bbox"]),
                (Some(count), &label["targets"][target]["bbox"])
            );
            let numbers =
                |text: &str| text.split(' ').map(|word| word.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>();
            let (fields, type_of) = (numbers(yolo[lines]), kitti[lines].split(' ').next());
            assert_eq!((fields[0], fields.len()), (target as f64, 8), "a target without key points has zeros");
            let pixels: Vec<usize> = (0..mask.len()).filter(|at| mask[*at]).collect();
            let columns: Vec<f64> = pixels.iter().map(|at| (at % size[0] as usize) as f64).collect();
            let [low, high] = columns.iter().fold([f64::MAX, 0.0], |[low, high], x| [low.min(*x), x.max(high)]);
            assert!((fields[1] - 0.5 * (low + high + 1.0) / f64::from(size[0])).abs() < 1e-9, "{fields:?}");
            assert_eq!((type_of, numbers(kitti[lines])[4]), (Some(["chaser", "client"][target]), low));
            lines += 1;
            compared += 1;
        }
        assert_eq!((yolo.len(), kitti.len()), (lines, lines));
        // The hull belongs to no target.
        assert!(part_of_pixel.iter().zip(&instances).any(|(part, id)| *part != 0 && *id == 0));
    }
    assert!(compared >= 3, "{compared}");
    let members: Vec<String> = tar::Archive::new(&tree[&format!("{folder}/webdataset.tar")][..])
        .entries()
        .expect("a tar")
        .map(|entry| entry.expect("an entry").path().expect("a name").to_string_lossy().into_owned())
        .collect();
    assert!(members.iter().any(|name| name.ends_with(".instance.png")), "{members:?}");
    assert!(text("README.txt").contains(" 1  chaser\n 2  client\n") && text("yolo.yaml").contains("  1: \"client\"\n"));
    assert_eq!(json("models/models_info.json").as_object().expect("objects").len(), 2);
}
