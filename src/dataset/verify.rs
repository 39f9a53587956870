//! Checks a data set: its checksums, whether its labels agree with each other and with its images, and whether some images come out again.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde_json::{Map, Value as Json};

use super::error::DatasetError;
use super::index;
use super::orbit::OrbitRun;
use super::orbit_files::{Encoded, ORBIT, encode_image};
use super::orbit_folder::CHECKSUMS;
use super::random::{CubeSampling, RandomPlan, RandomStream};
use super::scene_values::SceneText;
use super::spec::Spec;
use super::split::split_of;
use super::store::{HOME, REPORT, entries};
use super::sums;
use super::whole::{INDEX, SPEC, read_json};
use crate::labels::image::OPENCV_PIXEL;
use crate::labels::places;
use crate::labels::silhouette::Solids;
use crate::output::OutputError;
use crate::output::gray::read_png;
use crate::output::guarded::{Access, GuardedFolder};
use crate::simulation::target::Target;

const MOST_FAULTS: usize = 1000;
/// Largest distance between a key point and its projection [px], for the rounding of numbers in text.
const PIXEL_SLACK: f64 = 1e-6;

/// The result of a verification.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Verified {
    /// Files whose checksum was computed.
    pub files: usize,
    /// Images whose labels were checked.
    pub images: usize,
    /// Images that were rendered again.
    pub rendered: usize,
    /// The faults, in words.
    pub faults: Vec<String>,
}

impl Verified {
    fn fault(&mut self, fault: String) {
        if self.faults.len() < MOST_FAULTS {
            self.faults.push(fault);
        }
    }
}

/// Computes the checksums of all files again. Returns the paths that the list names.
///
/// # Errors
/// The folder holds no whole data set.
pub fn checksums(root: &Path, verified: &mut Verified) -> Result<BTreeSet<String>, DatasetError> {
    let set = open(root)?;
    let list = set.read_text(CHECKSUMS).map_err(|error| DatasetError::None {
        folder: root.to_path_buf(),
        reason: format!("{CHECKSUMS} can not be read ({error}); the process that makes the last orbit writes it"),
    })?;
    let lines = match sums::lines(&list) {
        Ok(lines) => lines,
        Err(fault) => {
            verified.fault(format!("{CHECKSUMS}: {fault}"));
            // The other lines may tell which files are damaged.
            list.lines().filter_map(|line| line.split_once("  ")).collect()
        }
    };
    let faults = sums::faults_of_files(&set, &lines).into_iter().chain(sums::faults_of_lists(&set, &lines));
    faults.for_each(|fault| verified.fault(fault));
    verified.files = lines.len();
    let known: BTreeSet<String> = lines.iter().map(|(_, name)| (*name).to_owned()).collect();
    let folders: BTreeSet<&str> =
        known.iter().filter_map(|name| name.rsplit_once('/')).map(|(folder, _)| folder).collect();
    let mut there = Vec::new();
    walk(root, root, &mut there)?;
    for name in there {
        let is_list = name == CHECKSUMS
            || name
                .strip_suffix(CHECKSUMS)
                .and_then(|name| name.strip_suffix('/'))
                .is_some_and(|name| folders.contains(name));
        let is_report = name.starts_with(REPORT) && !name.contains('/');
        if root.join(&name).is_symlink() {
            verified.fault(format!("{name} is a link"));
        } else if !known.contains(&name) && !is_list && !is_report {
            verified.fault(format!("{name} is in no list of checksums"));
        }
    }
    Ok(known)
}

/// The files below a folder, without isotherm's own records.
fn walk(root: &Path, folder: &Path, paths: &mut Vec<String>) -> Result<(), OutputError> {
    for path in entries(folder)? {
        let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().into_owned();
        if path.is_symlink() || !path.is_dir() {
            paths.push(name);
        } else if name != HOME {
            walk(root, &path, paths)?;
        }
    }
    Ok(())
}

/// Checks that the labels of all images agree with each other and with their maps.
///
/// # Errors
/// A signal, or a file of an orbit that can not be read.
pub fn labels(root: &Path, spec: &Spec, stop: &AtomicBool, verified: &mut Verified) -> Result<(), DatasetError> {
    let set = open(root)?;
    let mut rows = 0;
    for orbit in 0..spec.orbits() {
        if stop.load(Ordering::Relaxed) {
            return Err(DatasetError::StoppedBefore);
        }
        let folder = places::orbit(split_of(spec, orbit), orbit as u32);
        let read = |name: &str| read_json(&set, &format!("{folder}/{name}"));
        let [stated, cameras, poses] = [read(ORBIT)?, read("scene_camera.json")?, read("scene_gt.json")?];
        let images: Vec<&Map<String, Json>> = stated
            .get("images")
            .and_then(Json::as_array)
            .map(|rows| rows.iter().filter_map(Json::as_object).collect())
            .unwrap_or_default();
        rows += images.len();
        let faults: Vec<String> = images
            .par_iter()
            .flat_map_iter(|row| {
                let name = row.get("number").and_then(Json::as_u64).unwrap_or_default();
                let faults = image_faults((&set, &folder), row, [&cameras, &poses], name);
                faults.into_iter().map(move |fault| format!("orbit {orbit}, image {name}: {fault}")).collect::<Vec<_>>()
            })
            .collect();
        verified.images += images.len();
        faults.into_iter().for_each(|fault| verified.fault(fault));
    }
    if rows as u64 != spec.samples {
        verified.fault(format!("the orbits have {rows} images, and the SPEC asks for {}", spec.samples));
    }
    let file = set.file(INDEX, Access::Read).map_err(|error| OutputError::Read(root.join(INDEX), error))?;
    match index::rows_in(file) {
        Ok(count) if count == rows => {}
        Ok(count) => verified.fault(format!("{INDEX} has {count} rows for {rows} images")),
        Err(error) => verified.fault(format!("{INDEX} is no Parquet file: {error}")),
    }
    Ok(())
}

/// The disagreements in the labels of an image, in words.
fn image_faults(
    (set, folder): (&GuardedFolder, &str),
    row: &Map<String, Json>,
    [cameras, poses]: [&Json; 2],
    number: u64,
) -> Vec<String> {
    let mut faults = Vec::new();
    let key = number.to_string();
    let label = match read_json(set, &format!("{folder}/label/{number:06}.json")) {
        Ok(label) => label,
        Err(error) => return vec![error.to_string()],
    };
    let numbers = |value: Option<&Json>| -> Vec<f64> {
        value.and_then(Json::as_array).map(|all| all.iter().filter_map(Json::as_f64).collect()).unwrap_or_default()
    };
    let turn = numbers(label.pointer("/camera_from_body/R"));
    let matrix = numbers(label.pointer("/camera/matrix"));
    if turn.len() != 9 || matrix.len() != 9 {
        return vec!["its label has no pose or no camera".to_owned()];
    }
    for (a, b) in (0..3).flat_map(|a| (0..=a).map(move |b| (a, b))) {
        let product: f64 = (0..3).map(|k| turn[3 * a + k] * turn[3 * b + k]).sum();
        if (product - f64::from(u8::from(a == b))).abs() > 1e-9 {
            faults.push("its rotation is none".to_owned());
            break;
        }
    }
    let pinhole = label.pointer("/camera/distortion/model").and_then(Json::as_str) == Some("none");
    for point in label.get("key_points").and_then(Json::as_array).into_iter().flatten().filter(|_| pinhole) {
        let (place, pixel) = (numbers(point.get("camera_m")), numbers(point.get("pixel")));
        if let ([x, y, z], [u, v]) = (&place[..], &pixel[..]) {
            let across = matrix[0] * x / z + matrix[1] * y / z + matrix[2] - u;
            let down = matrix[4] * y / z + matrix[5] - v;
            if across.abs().max(down.abs()) > PIXEL_SLACK {
                faults.push(format!("a key point is {:.3e} px from its projection", across.abs().max(down.abs())));
            }
        }
    }
    // The pixels of BOP have their centres at +0.5.
    let centred = [0.0, 0.0, OPENCV_PIXEL, 0.0, 0.0, OPENCV_PIXEL, 0.0, 0.0, 0.0];
    let bop = numbers(cameras.get(&key).and_then(|camera| camera.get("cam_K")));
    let slips = bop.iter().zip(&matrix).zip(centred).map(|((bop, ours), less)| (bop + less - ours).abs());
    if bop.len() != centred.len() || slips.fold(0.0, f64::max) > PIXEL_SLACK {
        faults.push("scene_camera.json has another camera matrix".to_owned());
    }
    let pose = poses.get(&key).and_then(|poses| poses.get(0));
    let body = pose.filter(|pose| numbers(pose.get("cam_R_m2c")) == turn);
    let has_joints = label.get("joints").and_then(Json::as_array).is_some_and(|joints| !joints.is_empty());
    if pose.is_none() || (body.is_none() && !has_joints) {
        faults.push("scene_gt.json has another rotation".to_owned());
    }
    let read = |what: &str| -> Result<Vec<u16>, String> {
        let path = format!("{folder}/{what}/{number:06}.png");
        let bytes = set.read(&path).map_err(|error| format!("{path} can not be read: {error}"))?;
        let (_, values) = read_png(&bytes).map_err(|error| format!("{path}: {error}"))?;
        Ok(values.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect())
    };
    match (read("part"), read("depth"), read("temperature")) {
        (Ok(parts), Ok(depths), Ok(temperatures)) => {
            let shown = parts.iter().filter(|part| **part != 0).count() as u64;
            if row.get("visible_pixels").and_then(Json::as_u64) != Some(shown) {
                faults.push(format!("its map of parts shows {shown} pixels, and the index has another number"));
            }
            let alike =
                |map: &[u16]| map.len() == parts.len() && map.iter().zip(&parts).all(|(a, b)| (*a == 0) == (*b == 0));
            if !alike(&depths) || !alike(&temperatures) {
                faults.push("its maps of parts, depth and temperature show other pixels".to_owned());
            }
        }
        (parts, depths, temperatures) => {
            faults.extend([parts.err(), depths.err(), temperatures.err()].into_iter().flatten());
        }
    }
    faults
}

/// The images to render again: some that the number `draw` picks.
pub fn picked(spec: &Spec, count: u64, draw: u64) -> BTreeMap<u64, BTreeSet<u64>> {
    let plan = RandomPlan { seed: draw, sampling: CubeSampling::Random, counts: [1, 1], names: Default::default() };
    let mut orbits: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for number in 0..count.min(spec.samples) {
        let image = plan.place(RandomStream::Image, "verify", number, spec.samples);
        orbits.entry(image / spec.poses_per_orbit).or_default().insert(image);
    }
    orbits
}

/// Renders images again and compares all their files.
///
/// # Errors
/// A signal, or a call that fails.
pub fn again(
    root: &Path,
    (spec, scenes, target): (&Spec, &SceneText, &Target),
    images: &BTreeMap<u64, BTreeSet<u64>>,
    stop: &AtomicBool,
    verified: &mut Verified,
) -> Result<(), DatasetError> {
    let set = open(root)?;
    for (orbit, wanted) in images {
        let mut run = OrbitRun::new(spec, scenes, target, *orbit)?;
        let solids = Solids::new(&run.craft);
        let mut encoded = Vec::new();
        let outcome = run.run(&|image| wanted.contains(&image), stop, &mut |craft, simulation, image, labelled| {
            encoded.push(encode_image(spec, (craft, &solids, simulation), image, labelled)?);
            Ok(())
        })?;
        if outcome.stopped {
            return Err(DatasetError::StoppedBefore);
        }
        verified.rendered += encoded.len();
        for (path, bytes) in encoded.iter().flat_map(Encoded::files) {
            if set.read(path).ok().as_deref() != Some(bytes) {
                verified.fault(format!("{path} comes out otherwise when it is rendered again"));
            }
        }
    }
    Ok(())
}

/// The copy of the SPEC in a data set.
///
/// # Errors
/// It can not be read.
pub(crate) fn copy_of_spec(root: &Path) -> Result<Spec, DatasetError> {
    let path = root.join(SPEC);
    let text = open(root)?.read_text(SPEC).map_err(|error| OutputError::Read(path.clone(), error))?;
    Ok(Spec::parse(&text, &path)?)
}

/// The folder of a data set, held open. No link in it is followed.
fn open(root: &Path) -> Result<GuardedFolder, OutputError> {
    GuardedFolder::open(root).map_err(|error| OutputError::Read(root.to_path_buf(), error))
}
