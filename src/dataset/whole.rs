//! The files of the whole set, made by whichever process finds that all orbits are there.
//!
//! The contents follow from the orbits' files, the SPEC and the scene alone, so any process may make these files.

use std::collections::BTreeMap;

use serde_json::{Value as Json, json};

use super::error::DatasetError;
use super::index;
use super::orbit_files::ORBIT;
use super::orbit_folder::{CHECKSUMS, sum_of};
use super::spec::{ImageKind, Spec};
use super::split::split_of;
use super::store::Store;
use super::sums::fault_of_whole;
use crate::labels::craft::Craft;
use crate::labels::hugging_face::{CardFiles, card};
use crate::labels::image::Split;
use crate::labels::{bop, coco, places, speed, yolo};
use crate::output::OutputError;
use crate::output::guarded::GuardedFolder;

/// The copy of the SPEC.
pub(crate) const SPEC: &str = "spec.toml";
/// The copy of the scene file.
pub(crate) const SCENE: &str = "scene.toml";
pub(crate) const INDEX: &str = "index.parquet";
/// Counts of images and rejections.
pub(crate) const SUMMARY: &str = "dataset.json";

/// Whether all orbits are there.
pub(crate) fn is_complete(spec: &Spec, store: &Store) -> bool {
    (0..spec.orbits()).all(|orbit| store.has(split_of(spec, orbit), orbit as u32))
}

/// Writes the files of the whole set, the list of checksums last.
///
/// # Errors
/// An orbit's file that can not be read, or a full disk.
pub(crate) fn finish(
    spec: &Spec,
    store: &Store,
    craft: &Craft,
    files: &[(String, Vec<u8>)],
) -> Result<(), DatasetError> {
    store.alone(|| {
        if store.is_finished()? {
            return match fault_of_whole(store.guarded()) {
                None => Ok(()),
                Some(fault) => {
                    let first =
                        format!("{fault}; remove {CHECKSUMS}, and --resume makes the files of the whole set again");
                    Err(DatasetError::Damaged { folder: store.root().to_path_buf(), count: 1, first })
                }
            };
        }
        let mut sums = BTreeMap::new();
        let mut put = |name: &str, bytes: &[u8]| {
            sums.insert(name.to_owned(), sum_of(bytes));
            store.write(name, bytes)
        };
        let (mut rows, mut rejected, mut counts) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
        for orbit in 0..spec.orbits() {
            let split = split_of(spec, orbit);
            let Json::Object(mut read) = orbit_file(store.guarded(), split, orbit as u32)? else { continue };
            if let Some(Json::Object(all)) = read.get("rejected") {
                for (reason, count) in all {
                    *rejected.entry(reason.clone()).or_insert(0) += count.as_u64().unwrap_or_default();
                }
            }
            if let Some(Json::Array(images)) = read.remove("images") {
                *counts.entry(split.name()).or_insert(0) += images.len();
                rows.extend(
                    images.into_iter().filter_map(|row| if let Json::Object(row) = row { Some(row) } else { None }),
                );
            }
        }
        put(INDEX, &index::encode(&rows)?)?;
        for (name, text) in of_loaders(spec, store.guarded(), craft, &counts) {
            put(&name, text.as_bytes())?;
        }
        let summary = json!({
            "samples": spec.samples, "orbits": spec.orbits(), "poses_per_orbit": spec.poses_per_orbit,
            "images": counts, "rejected": rejected,
        });
        put(SUMMARY, format!("{summary:#}\n").as_bytes())?;
        put(SPEC, spec.text.as_bytes())?;
        for (name, bytes) in files {
            put(name, bytes)?;
        }
        for split in Split::ALL {
            let lines = |key: &'static str| lines_of(spec, store.guarded(), split, key);
            let list: String = speed::file(lines("speed")).collect();
            put(&places::speed(split), list.as_bytes())?;
            let list: String = coco::file(craft, split, lines("coco_image"), lines("coco_annotations")).collect();
            put(&places::coco(split), list.as_bytes())?;
            if split == Split::Test {
                put(places::BOP_TARGETS, bop::targets(lines("bop_targets")).as_bytes())?;
            }
        }
        let mut list = String::new();
        for orbit in 0..spec.orbits() {
            let path = format!("{}/{CHECKSUMS}", places::orbit(split_of(spec, orbit), orbit as u32));
            let read = store.guarded().read_text(&path);
            list += &read.map_err(|error| OutputError::Read(store.root().join(path), error))?;
        }
        list.extend(sums.iter().map(|(name, sum)| format!("{sum}  {name}\n")));
        let mut lines: Vec<&str> = list.lines().collect();
        lines.sort_unstable_by_key(|line| line.split_once("  ").map(|(_, path)| path));
        store.write(CHECKSUMS, format!("{}\n", lines.join("\n")).as_bytes())
    })
}

/// The files that tell other programs' loaders where images lie: the card of Hugging Face, YOLO's lists, and the images without the craft.
fn of_loaders(
    spec: &Spec,
    set: &GuardedFolder,
    craft: &Craft,
    counts: &BTreeMap<&str, usize>,
) -> Vec<(String, String)> {
    let filled = |split| Some((split, *counts.get(Split::name(split)).filter(|count| **count > 0)?));
    let filled: Vec<(Split, usize)> = Split::ALL.into_iter().filter_map(filled).collect();
    let kinds = CardFiles {
        numbers: spec.images.contains(&ImageKind::Numbers),
        webdataset: spec.webdataset,
        instances: !craft.targets.is_empty(),
    };
    let mut files = vec![(places::CARD.to_owned(), card(&craft.name, &filled, kinds))];
    if kinds.numbers {
        let splits: Vec<Split> = filled.iter().map(|(split, _)| *split).collect();
        files.push((places::YOLO_DATA.to_owned(), yolo::data(craft, &splits)));
        files.extend(splits.into_iter().map(|split| {
            let list: String = lines_of(spec, set, split, "yolo").map(|line| line + "\n").collect();
            (places::yolo(split), list)
        }));
    }
    let negatives = Split::ALL.map(|split| {
        let paths: Vec<String> = lines_of(spec, set, split, "negative").collect();
        (split.name().to_owned(), json!(paths))
    });
    files.push((places::NEGATIVES.to_owned(), format!("{:#}\n", Json::Object(negatives.into_iter().collect()))));
    files
}

/// The file of an orbit from which the files of the whole set are made.
///
/// # Errors
/// It can not be read.
pub(crate) fn orbit_file(set: &GuardedFolder, split: Split, orbit: u32) -> Result<Json, DatasetError> {
    read_json(set, &format!("{}/{ORBIT}", places::orbit(split, orbit)))
}

/// A JSON file of a data set.
///
/// # Errors
/// It can not be read.
pub(crate) fn read_json(set: &GuardedFolder, path: &str) -> Result<Json, DatasetError> {
    let failed = |error| OutputError::Read(set.root().join(path), error);
    let text = set.read_text(path).map_err(failed)?;
    Ok(serde_json::from_str(&text).map_err(|error| failed(error.into()))?)
}

/// The lines of a list of a split, one orbit after the other.
fn lines_of<'a>(
    spec: &'a Spec,
    set: &'a GuardedFolder,
    split: Split,
    key: &'static str,
) -> impl Iterator<Item = String> + 'a {
    let orbits = (0..spec.orbits()).filter(move |orbit| split_of(spec, *orbit) == split);
    orbits.flat_map(move |orbit| {
        // Each of these files was read before.
        let read = orbit_file(set, split, orbit as u32).unwrap_or_default();
        let images = read.get("lines").and_then(Json::as_array).cloned().unwrap_or_default();
        let each = images.into_iter().flat_map(move |image| match image.get(key) {
            Some(Json::String(line)) => vec![line.clone()],
            Some(Json::Array(lines)) => lines.iter().filter_map(|line| line.as_str().map(str::to_owned)).collect(),
            _ => Vec::new(),
        });
        each.collect::<Vec<_>>()
    })
}
