//! Data sets: the same bytes however they are made, what verification finds, and errors.

mod draws;
mod each_image;
mod errors;
mod kills;
mod loaders;
mod made;
mod symmetries;
mod targets;
mod verify;
mod views;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use isotherm::internals::{Begin, DatasetOrder, DatasetSummary, SceneText, Shard, Spec, make};
use isotherm::{DatasetError, Reach, Target};

use super::craft;

/// Six images of the small craft on three orbits.
const SPEC: &str = include_str!("dataset/spec.toml");

/// A folder with the small craft, its scene and a SPEC.
struct Workshop(craft::Folder);

impl Workshop {
    /// The SPEC with lines replaced; every `from` must be there.
    fn new(changes: &[(&str, &str)]) -> Self {
        let scene = craft::scene_with(&[("width = 96", "width = 48"), ("height = 72", "height = 36")]);
        let workshop = Self(craft::Folder::new(&scene));
        workshop.change(changes);
        workshop
    }

    fn change(&self, changes: &[(&str, &str)]) -> PathBuf {
        let text = changes.iter().fold(SPEC.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "the SPEC has no '{from}'");
            text.replace(from, to)
        });
        self.0.write("spec.toml", &text)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path(name)
    }

    fn spec(&self) -> (Spec, SceneText) {
        self.load().expect("a SPEC and a scene")
    }

    fn load(&self) -> Result<(Spec, SceneText), DatasetError> {
        let path = self.path("spec.toml");
        let spec = Spec::load(&path, &Reach::of(&path))?;
        let scenes = SceneText::load(&spec.scene, Reach::of(&spec.scene))?;
        Ok((spec, scenes))
    }

    /// Makes a shard with the reference.
    fn make(&self, folder: &str, shard: (u64, u64), begin: Begin) -> Result<DatasetSummary, DatasetError> {
        let (spec, scenes) = self.load()?;
        let root = self.path(folder);
        let (index, of) = shard;
        let order = DatasetOrder {
            spec: &spec,
            scenes: &scenes,
            target: &Target::Reference,
            root: &root,
            shard: Shard { index, shards: of },
            begin,
            allows_outside: false,
            warn: &|_| (),
            assume: &|_| (),
        };
        make(&order, &AtomicBool::new(false), &mut |_, _| ())
    }

    /// Makes the whole data set with the reference.
    fn whole(&self, folder: &str) -> DatasetSummary {
        let made = self.make(folder, (0, 1), Begin::Fresh).expect("a data set");
        assert!(made.complete);
        made
    }

    fn tree(&self, folder: &str) -> BTreeMap<String, Vec<u8>> {
        tree(&self.path(folder))
    }
}

/// The files of a data set by their paths, without records of the processes.
fn tree(root: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(root: &Path, folder: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(root).expect("a path inside").to_string_lossy().into_owned();
            if path.is_dir() && name != ".isotherm" {
                walk(root, &path, found);
            } else if path.is_file() && !name.starts_with("report-") {
                found.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(root, root, &mut found);
    found
}

/// Names of files that differ.
fn differing(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) -> Vec<String> {
    let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
    names.filter(|name| a.get(*name) != b.get(*name)).cloned().collect()
}
