//! Makes a shard of a data set, and the files of the whole set where all orbits are there.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use serde_json::{Map, Value as Json, json};

use super::error::DatasetError;
use super::orbit::OrbitRun;
use super::orbit_folder::sum_of;
use super::orbits_at_once::{Orbits, orbits_at_once};
use super::order::{DatasetOrder, DatasetSummary, Shard, place};
use super::scene_values::SceneText;
use super::spec::Spec;
use super::split::empty_splits;
use super::store::{REPORT, Store};
use super::whole::{SCENE, finish, is_complete};
use crate::files;
use crate::host;
use crate::labels::made::fixed;
use crate::labels::silhouette::Solids;
use crate::output::OutputError;
use crate::scene::Scene;
use crate::scene::scene_hash;
use crate::simulation::target::Target;

/// The identity of a data set: versions, device, and checksums of the SPEC and of all files. `scene` is the scene of the first orbit, and `files` are
/// the files that any orbit may take.
///
/// # Errors
/// A file of the scene that can not be read.
fn identity(
    spec: &Spec,
    scene: &Scene,
    files: &BTreeSet<PathBuf>,
    target: &Target,
    allows_outside: bool,
) -> Result<Json, DatasetError> {
    let read = |path: &std::path::PathBuf| {
        std::fs::read(path).map_err(|error| DatasetError::Output(OutputError::Read(path.clone(), error)))
    };
    let others = files.iter().filter(|file| !scene.files.contains(file));
    let contents = scene.files.iter().chain(others).map(read).collect::<Result<Vec<_>, _>>()?;
    let slices: Vec<&[u8]> = contents.iter().map(Vec::as_slice).collect();
    let absolute = std::path::absolute(&spec.path).unwrap_or_else(|_| spec.path.clone());
    Ok(json!({
        "isotherm": "dataset",
        "version": env!("CARGO_PKG_VERSION"),
        "device": target.name(),
        "spec": absolute.display().to_string(),
        "spec_sha256": sum_of(spec.text.as_bytes()),
        "scene_sha256": scene_hash(&slices),
        "allow_outside": allows_outside,
    }))
}

/// Makes the orbits of a shard. `progress` is called with a number of images, and whether they were kept from before.
///
/// # Errors
/// The first thing that can not be done. Orbits that are whole by then stay.
pub fn make(
    order: &DatasetOrder,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(u64, bool),
) -> Result<DatasetSummary, DatasetError> {
    let DatasetOrder { spec, scenes, target, root, shard, begin, allows_outside, warn, assume } = *order;
    let began = Instant::now();
    let files = scenes.check_ends(spec)?;
    let scene = scenes.of_orbit(spec, 0)?.scene;
    let identity = identity(spec, &scene, &files, target, allows_outside)?;
    // A fault of the craft ends the command before a folder is made.
    let first = match shard.orbits(spec).next() {
        Some(first) => Some(OrbitRun::new(spec, scenes, target, first)?),
        None => None,
    };
    if let Some(first) = &first {
        first.check_symmetries()?;
        warnings(spec, scenes).iter().for_each(|warning| warn(warning));
        first.warnings().iter().for_each(|warning| warn(warning));
        first.assumptions().iter().for_each(|assumption| assume(assumption));
    }
    let store = Store::open(root, &identity, begin, &mut shard.orbits(spec).map(|orbit| place(spec, orbit)))?;
    let at_once = first.as_ref().map_or(1, |first| orbits_at_once(first.nodes(), shard.orbits(spec).count()));
    let orbits = Orbits { order, store: &store, left: Mutex::new(shard.orbits(spec)), first: Mutex::new(first) };
    let mut made = orbits.make(at_once, stop, progress)?;
    if is_complete(spec, &store) {
        let unreadable =
            |fault: files::FileFault| OutputError::Read(spec.scene.clone(), std::io::Error::other(fault.to_string()));
        let scene = files::read_text(&spec.scene).map_err(unreadable)?;
        let first = OrbitRun::new(spec, scenes, target, 0)?;
        let solids = Solids::new(&first.craft);
        let mut fixed = fixed(&first.craft, &solids, &first.blank()?);
        fixed.push((SCENE.to_owned(), scene.into_bytes()));
        finish(spec, &store, &first.craft, &fixed)?;
        made.complete = true;
    }
    made.seconds = began.elapsed().as_secs_f64();
    report(&store, shard, (target, at_once), &made)?;
    Ok(made)
}

/// What readers of the files and of a split will miss.
fn warnings(spec: &Spec, scenes: &SceneText) -> Vec<String> {
    let distorted = scenes.has_distortion().then(|| {
        "the camera has distortion, for which BOP has no place: its readers draw with cam_K alone, and their masks lie \
         beside those of the set; COCO, SPEED+ and the labels state it"
            .to_owned()
    });
    let empty = empty_splits(spec).into_iter().map(|split| {
        format!(
            "no orbit is left for {}: {} orbits are too few for its share; lower poses_per_orbit",
            split.name(),
            spec.orbits()
        )
    });
    distorted.into_iter().chain(empty).collect()
}

/// Writes the report of a process, which holds times and is under no checksum.
fn report(
    store: &Store,
    shard: Shard,
    (target, at_once): (&Target, usize),
    made: &DatasetSummary,
) -> Result<(), DatasetError> {
    let rejected: Map<String, Json> =
        made.rejections.iter().map(|(reason, count)| (reason.words().to_owned(), json!(count))).collect();
    let report = json!({
        "shard": shard.index,
        "shards": shard.shards,
        "device": target.name(),
        "images": made.images,
        "orbits": made.orbits,
        "orbits_kept": made.kept,
        "orbits_at_once": at_once,
        "seconds": made.seconds,
        "seconds_of_files": made.seconds_of_files,
        "images_an_hour": made.images_an_hour(),
        "bytes": made.bytes,
        "bytes_an_image": made.bytes_an_image(),
        "peak_memory_bytes": host::peak_memory(),
        "rejected": rejected,
        "complete": made.complete,
    });
    store.write(&format!("{REPORT}{}-of-{}.json", shard.index, shard.shards), format!("{report:#}\n").as_bytes())
}
