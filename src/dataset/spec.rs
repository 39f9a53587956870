//! A SPEC file, checked: which scene, how many images, and how everything is drawn.
//!
//! `docs/datasets.md` describes every key.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::camera_rule::CameraRule;
use super::distribution::Distribution;
use super::life::Life;
use super::random::{CubeSampling, RandomPlan};
use super::reader::{SpecFile, SpecTable};
use super::scene_sections::{SENSOR, each_image, each_orbit, refuse_twice};
use super::season::Season;
use super::symmetry_rule::symmetries;
use super::time_rule::TimeRule;
use crate::files::{self, Reach};
use crate::labels::label_target::StatedTarget;
use crate::labels::symmetry::Symmetry;
use crate::misspelt::suggestion;
use crate::scene::SceneError;

/// Keys of the root.
pub(crate) const KEYS: &[&str] = &[
    "scene",
    "samples",
    "poses_per_orbit",
    "seed",
    "sampling",
    "attempts",
    "images",
    "webdataset",
    "split",
    "object",
    "each_orbit",
    "each_image",
    "season",
    "life",
    "time",
    "camera",
    "reject",
    "key_point",
    "symmetry",
    "target",
];
/// Keys of `[split]`.
pub(crate) const SPLIT: &[&str] = &["train", "val", "test"];
/// Keys of `[reject]`.
pub(crate) const REJECT: &[&str] = &["in_view", "visible_pixels", "clearance", "sun", "planet"];
/// Keys of `[[key_point]]`.
pub(crate) const KEY_POINT: &[&str] = &["name", "position", "part"];

/// Keys of `[[target]]`.
pub(crate) const TARGET: &[&str] = &["name", "match"];

/// Most targets: their numbers stand in images of 8 bits.
const MOST_TARGETS: usize = 255;

/// Most images of a data set.
const MOST_SAMPLES: u64 = 1_000_000_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ImageKind {
    /// Digital numbers of the sensor as PNG.
    Numbers,
    /// Radiance, temperature, depth, part and material as EXR.
    Radiance,
}

/// Conditions that an image must meet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reject {
    /// Least share of the craft's points that lie in the frame.
    pub(crate) in_view: f64,
    /// Least number of pixels that show the craft.
    pub(crate) visible_pixels: u64,
    /// Least distance from the camera to the craft's points [m].
    pub(crate) clearance: f64,
    /// Whether an image with the Sun in it is rejected.
    pub(crate) sun: bool,
    /// Whether an image with the planet in it is rejected.
    pub(crate) planet: bool,
}

/// A point of the craft.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SpecKeyPoint {
    /// Its name.
    pub name: String,
    /// Place in the file's pose, body frame [m].
    pub position: DVec3,
    /// The part with which it moves. `None` for the body.
    pub(crate) part: Option<String>,
}

/// A SPEC.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    pub(crate) path: PathBuf,
    pub(crate) text: String,
    /// The scene file.
    pub scene: PathBuf,
    /// Number of images.
    pub(crate) samples: u64,
    /// Images of an orbit.
    pub(crate) poses_per_orbit: u64,
    /// The numbers that are drawn.
    pub(crate) plan: RandomPlan,
    /// Most attempts at an image.
    pub(crate) attempts: u32,
    /// Image files, sorted.
    pub(crate) images: Vec<ImageKind>,
    /// Whether each orbit has a tar with its images and labels.
    pub(crate) webdataset: bool,
    /// Shares of train, val and test.
    pub(crate) split: [f64; 3],
    pub(crate) labels: LabelRules,
    pub(crate) drawn: DrawnRules,
    /// The rules by which the camera is placed. Each image follows one rule.
    pub(crate) cameras: Vec<CameraRule>,
    pub(crate) reject: Reject,
}

/// The values that are drawn for each orbit and for each image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DrawnRules {
    /// Values of the scene file that are drawn for each orbit, by section.
    pub(crate) each_orbit: Vec<(String, Distribution)>,
    /// Values of the scene's `[sensor]` that are drawn for each image.
    pub(crate) each_image: Option<Distribution>,
    /// Day of the year and plane of the orbit.
    pub(crate) season: Option<Season>,
    /// Age of the surfaces.
    pub(crate) life: Option<Life>,
    pub(crate) time: TimeRule,
}

/// The facts that labels state of the craft.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LabelRules {
    /// Name of the craft in the labels. `None` takes the name of the scene.
    pub(crate) object: Option<String>,
    pub(crate) key_points: Vec<SpecKeyPoint>,
    /// Symmetries of the craft's geometry.
    pub(crate) symmetries: Vec<Symmetry>,
    /// Sets of parts that are craft of their own.
    pub(crate) targets: Vec<StatedTarget>,
}

impl Spec {
    /// Reads and checks a SPEC file.
    ///
    /// # Errors
    /// The first thing that is wrong, with file, line and key.
    pub fn load(path: &Path, reach: &Reach) -> Result<Self, SceneError> {
        let unreadable =
            |fault: files::FileFault| SceneError::Unreadable { path: path.to_path_buf(), reason: fault.to_string() };
        let spec = Self::parse(&files::read_text(path).map_err(unreadable)?, path)?;
        match reach.admit(&spec.scene) {
            Ok(()) => Ok(spec),
            Err(fault) => Err(SceneError::Unreadable { path: spec.scene, reason: fault.to_string() }),
        }
    }

    /// Checks the text of a SPEC file as if it lay at `path`. The scene file need not be there.
    ///
    /// # Errors
    /// As for [`Spec::load`].
    pub(crate) fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        let file = SpecFile { path, text };
        let parsed = file.parse()?;
        let keys = parsed.get_ref();
        if !keys.contains_key("scene") && keys.contains_key("model") {
            let message =
                "this file is a scene: a SPEC names one by scene = \"FILE.toml\" (docs/datasets.md)".to_owned();
            return Err(SceneError::Value { path: path.to_path_buf(), line: 1, key: "scene".to_owned(), message });
        }
        let root = SpecTable::root(&file, &parsed, KEYS)?;
        let scene = root.required("scene", root.path("scene")?, "the scene file")?;
        let samples = root.whole("samples", 1..=MOST_SAMPLES)?;
        let samples = root.required("samples", samples, "the number of images")?;
        let poses = root.whole("poses_per_orbit", 1..=100_000)?;
        let poses_per_orbit =
            root.required("poses_per_orbit", poses, "the images that share the thermal run of an orbit")?;
        let each_orbit = each_orbit(&root)?;
        let each_image = each_image(&root)?;
        let season = Season::read(&root)?;
        let life = Life::read(&root)?;
        refuse_twice(&root, &each_orbit, each_image.as_ref(), season.is_some(), life.as_ref())?;
        let time = TimeRule::read(&root)?;
        let cameras = CameraRule::read(&root)?;
        let mut of_orbit: Vec<String> = each_orbit.iter().flat_map(|(section, drawn)| drawn.names(section)).collect();
        of_orbit.extend(season.iter().flat_map(Season::names));
        of_orbit.extend(life.iter().flat_map(Life::names));
        let mut of_image = time.names();
        of_image.extend(CameraRule::names(&cameras));
        of_image.extend(each_image.iter().flat_map(|drawn| drawn.names(SENSOR)));
        let samplings = [
            ("random", CubeSampling::Random),
            ("latin_hypercube", CubeSampling::LatinHypercube),
            ("sobol", CubeSampling::Sobol),
        ];
        let plan = RandomPlan {
            seed: root.whole("seed", 0..=i64::MAX as u64)?.unwrap_or(0),
            sampling: root.choice("sampling", &samplings)?.unwrap_or(CubeSampling::Random),
            counts: [samples.div_ceil(poses_per_orbit), samples],
            names: [of_orbit, of_image],
        };
        let attempts = root.whole("attempts", 1..=1_000_000)?.unwrap_or(100) as u32;
        let images = images(&root)?;
        let webdataset = root.boolean("webdataset")?.unwrap_or(true);
        let split = split(&root)?;
        let object = root.text("object")?.map(str::to_owned);
        let reject = reject(&root)?;
        Ok(Self {
            path: path.to_path_buf(),
            text: text.to_owned(),
            scene,
            samples,
            poses_per_orbit,
            plan,
            attempts,
            images,
            webdataset,
            split,
            drawn: DrawnRules { each_orbit, each_image, season, life, time },
            cameras,
            reject,
            labels: LabelRules {
                object,
                key_points: key_points(&root)?,
                symmetries: symmetries(&root)?,
                targets: targets(&root)?,
            },
        })
    }

    /// Number of orbits.
    pub fn orbits(&self) -> u64 {
        self.plan.counts[0]
    }

    pub(crate) fn images_of(&self, orbit: u64) -> std::ops::Range<u64> {
        let first = orbit * self.poses_per_orbit;
        first..(first + self.poses_per_orbit).min(self.samples)
    }
}

fn images(root: &SpecTable) -> Result<Vec<ImageKind>, SceneError> {
    let known = [("numbers", ImageKind::Numbers), ("radiance", ImageKind::Radiance)];
    let words = root.texts("images")?;
    let mut images = Vec::new();
    for word in root.required("images", words, "the image files: numbers, radiance or both")? {
        let kind = known.iter().find(|(name, _)| *name == word);
        let message =
            || format!("'{word}' is no kind of image{}", suggestion(word, known.iter().map(|(name, _)| *name)));
        images.push(kind.ok_or_else(|| root.error("images", &message()))?.1);
    }
    images.sort_unstable();
    images.dedup();
    if images.is_empty() {
        return Err(root.error("images", "must not be empty"));
    }
    Ok(images)
}

fn split(root: &SpecTable) -> Result<[f64; 3], SceneError> {
    let Some(table) = root.table("split", SPLIT)? else { return Ok([1.0, 0.0, 0.0]) };
    let mut shares = [0.0; 3];
    for (share, key) in shares.iter_mut().zip(SPLIT) {
        *share = table.number(key, 0.0..=1.0)?.unwrap_or(0.0);
    }
    let sum: f64 = shares.iter().sum();
    if (sum - 1.0).abs() > 1e-9 {
        return Err(root.error("split", &format!("the shares of train, val and test must add up to 1, found {sum}")));
    }
    Ok(shares)
}

fn reject(root: &SpecTable) -> Result<Reject, SceneError> {
    let mut reject = Reject { in_view: 0.5, visible_pixels: 1, clearance: 0.0, sun: true, planet: false };
    let Some(table) = root.table("reject", REJECT)? else { return Ok(reject) };
    reject.in_view = table.number("in_view", 0.0..=1.0)?.unwrap_or(reject.in_view);
    reject.visible_pixels = table.whole("visible_pixels", 0..=1 << 28)?.unwrap_or(reject.visible_pixels);
    reject.clearance = table.number("clearance", 0.0..=1e9)?.unwrap_or(reject.clearance);
    let words = [("reject", true), ("keep", false)];
    reject.sun = table.choice("sun", &words)?.unwrap_or(reject.sun);
    reject.planet = table.choice("planet", &words)?.unwrap_or(reject.planet);
    Ok(reject)
}

fn targets(root: &SpecTable) -> Result<Vec<StatedTarget>, SceneError> {
    let mut targets: Vec<StatedTarget> = Vec::new();
    for table in root.tables("target", TARGET)? {
        let name = table.required("name", table.text("name")?, "a name")?.to_owned();
        if targets.iter().any(|target| target.name == name) {
            return Err(table.error("name", &format!("'{name}' is the name of another target")));
        }
        if targets.len() == MOST_TARGETS {
            return Err(table.error("name", &format!("there are more than {MOST_TARGETS} targets")));
        }
        let patterns = table.required("match", table.texts("match")?, "an array of names of parts, with * and ?")?;
        targets.push(StatedTarget { name, patterns: patterns.into_iter().map(str::to_owned).collect() });
    }
    Ok(targets)
}

fn key_points(root: &SpecTable) -> Result<Vec<SpecKeyPoint>, SceneError> {
    let mut points: Vec<SpecKeyPoint> = Vec::new();
    for table in root.tables("key_point", KEY_POINT)? {
        let name = table.required("name", table.text("name")?, "a name")?.to_owned();
        if points.iter().any(|point| point.name == name) {
            return Err(table.error("name", &format!("'{name}' is the name of another key point")));
        }
        let position =
            table.required("position", table.numbers::<3>("position")?, "[x, y, z] in the body frame [m]")?;
        let part = table.text("part")?.map(str::to_owned);
        points.push(SpecKeyPoint { name, position: DVec3::from(position), part });
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::super::{camera_rule, life, season, symmetry_rule, time_rule};
    use super::*;

    const REFERENCE: &str = include_str!("../../docs/datasets.md");

    #[test]
    fn the_reference_explains_every_key() {
        let lists = [
            KEYS,
            SPLIT,
            REJECT,
            KEY_POINT,
            TARGET,
            camera_rule::CAMERA,
            life::LIFE,
            life::LIFE_MATERIAL,
            life::OPTICS,
            season::SEASON,
            symmetry_rule::SYMMETRY,
            time_rule::TIME,
        ];
        for key in lists.iter().flat_map(|list| list.iter()) {
            let forms = [format!("`{key}`"), format!("[{key}]"), format!(".{key}]]")];
            assert!(forms.iter().any(|form| REFERENCE.contains(form)), "docs/datasets.md is silent on {key}");
        }
        assert!(!REFERENCE.contains("`nonsense`"));
    }

    #[test]
    fn the_examples_are_valid() {
        for name in ["cubesat", "station"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("models/{name}_dataset.toml"));
            let spec = Spec::load(&path, &Reach::of(&path)).unwrap();
            assert_eq!(spec.samples, 1000);
        }
    }
}
