//! What a data set holds for the loaders of others: 8 bits beside 16, YOLO, KITTI, the card of Hugging Face, and images without the craft apart.

use std::collections::BTreeMap;

use isotherm::internals::read_png;
use serde_json::Value;

use super::Workshop;

fn text<'a>(tree: &'a BTreeMap<String, Vec<u8>>, name: &str) -> &'a str {
    let bytes = tree.get(name).unwrap_or_else(|| panic!("{name} is missing: {:?}", tree.keys()));
    std::str::from_utf8(bytes).expect("text")
}

#[test]
fn loaders_find_their_files() {
    let workshop = Workshop::new(&[
        ("split = { train = 0.34, val = 0.33, test = 0.33 }", "split = { train = 0.67, val = 0.33 }"),
        ("pointing_px = { normal = [0, 4] }", "pointing_px = { choice = [0, 500] }"),
        ("in_view = 0.6", "in_view = 0\nvisible_pixels = 0"),
    ]);
    workshop.whole("set");
    let tree = workshop.tree("set");
    let negatives: Value = serde_json::from_str(text(&tree, "negatives.json")).expect("JSON");
    let mut empty = 0;
    for split in ["train", "val"] {
        let listed: Vec<&str> = text(&tree, &format!("yolo_{split}.txt")).lines().collect();
        let away = negatives[split].as_array().expect("a list");
        let long = if split == "val" { "validation" } else { split };
        let poses: Value = serde_json::from_str(text(&tree, &format!("speed/{long}.json"))).expect("JSON");
        assert_eq!(poses.as_array().expect("a list").len(), listed.len() - away.len(), "{split}");
        for picture in listed {
            let picture = picture.strip_prefix("./").expect("a path from the list");
            let (folder, number) = (picture.split("/gray8/").next().expect("an orbit"), &picture[picture.len() - 10..]);
            let (size, eight) = read_png(&tree[picture]).expect("a PNG");
            let (_, numbers) = read_png(&tree[&format!("{folder}/gray/{number}")]).expect("a PNG");
            let label: Value =
                serde_json::from_str(text(&tree, &format!("{folder}/label/{}", number.replace("png", "json"))))
                    .expect("JSON");
            let bits = label["bits"].as_u64().expect("bits") as u32;
            let numbers: Vec<u16> = match bits {
                8 => numbers.iter().map(|byte| u16::from(*byte)).collect(),
                _ => numbers.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect(),
            };
            assert!(
                numbers.iter().zip(&eight).all(|(number, byte)| number >> (bits - 8) == u16::from(*byte)),
                "{picture}"
            );
            let is_away = away.iter().any(|path| *path == format!("{folder}/gray/{number}"));
            let (_, parts) = read_png(&tree[&format!("{folder}/part/{number}")]).expect("a PNG");
            assert_eq!(parts.iter().all(|byte| *byte == 0), is_away, "{picture}");
            let yolo = text(&tree, &picture.replace("png", "txt"));
            let kitti = text(&tree, &format!("{folder}/kitti/{}", number.replace("png", "txt")));
            assert_eq!([yolo.is_empty(), kitti.is_empty()], [is_away; 2], "{picture}");
            empty += usize::from(is_away);
            if is_away {
                continue;
            }
            // The box of YOLO and of KITTI is the box of the map of parts.
            let fields = |text: &str, from: usize| -> Vec<f64> {
                text.split_whitespace().skip(from).map(|field| field.parse().expect("a number")).collect()
            };
            let [width, height] = size.map(f64::from);
            let set = || (0..parts.len() / 2).filter(|at| parts[2 * at..2 * at + 2] != [0, 0]);
            let columns = || set().map(|at| (at % size[0] as usize) as f64);
            let rows = || set().map(|at| (at / size[0] as usize) as f64);
            let [left, top] = [columns().fold(f64::INFINITY, f64::min), rows().fold(f64::INFINITY, f64::min)];
            let [right, bottom] = [columns().fold(0.0, f64::max), rows().fold(0.0, f64::max)];
            let yolo = fields(yolo, 1);
            assert!((width * (yolo[0] - 0.5 * yolo[2]) - left).abs() < 1e-9, "{picture}");
            assert!((height * (yolo[1] + 0.5 * yolo[3]) - (bottom + 1.0)).abs() < 1e-9, "{picture}");
            assert_eq!(yolo.len(), 4 + 3 * 2, "two key points");
            assert_eq!(fields(kitti, 4)[..4], [left, top, right, bottom], "{picture}");
            for (number, point) in label["key_points"].as_array().expect("a list").iter().enumerate() {
                let strict = point["visibility_strict"].as_u64().expect("a number");
                assert!(strict <= point["visibility"].as_u64().expect("a number"));
                if yolo[4 + 3 * number + 2] > 0.0 {
                    let x = point["pixel"][0].as_f64().expect("a number");
                    assert!((width * yolo[4 + 3 * number] - 0.5 - x).abs() < 1e-9, "{picture}");
                }
            }
        }
    }
    assert!((1..6).contains(&empty), "{empty} of 6 images show nothing");
    let card = text(&tree, "README.md");
    assert!(card.contains("path: \"train/*/gray8/*.png\"") && !card.contains("split: test"), "{card}");
    assert!(text(&tree, "yolo.yaml").contains("val: yolo_val.txt"));
}
