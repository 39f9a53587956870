//! The file of a fit: parameters with their priors, the places of sensors, the measured images, and how misfits count.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use hifitime::{Epoch, TimeScale};

use super::ephemeris::LENGTH_TOLERANCE;
use super::epoch::parse_epoch;
use super::error::SceneError;
use super::faults::Faults;
use super::file::{SourceFile, unreadable};
use super::parameters::{Parameter, ROOT, parameters_of};
use super::quantity::Quantity;
use super::section::Section;
use super::vector::point;
use crate::files::{self, Reach};

const SENSOR: &[&str] = &["name", "part", "probe", "position", "node", "sigma"];
const IMAGE: &[&str] = &["file", "time", "utc", "pose", "sigma", "mask", "shows", "scale"];
const FIT: &[&str] = &["loss", "loss_scale", "hold_out", "hold_out_share"];

/// Standard deviations beyond which a residual counts less.
const LOSS_SCALE: f64 = 3.0;

/// How the square of a residual counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loss {
    /// In full.
    Square,
    /// Linear in the residual beyond the scale (Huber 1964).
    Huber,
    /// Smoothly linear beyond the scale.
    SoftL1,
    /// As a logarithm beyond the scale.
    Cauchy,
}

/// Times that are kept out of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum HoldOut {
    /// From one time to another [s].
    Between([f64; 2]),
    /// The last share of the measured time.
    Share(f64),
}

/// The place of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum SensorPlace {
    /// The mean of a part of a scene.
    Part(String),
    /// A probe of a scene.
    Probe(String),
    /// The node that is nearest to a place in the body frame [m].
    Position(DVec3),
    /// A node of a network file.
    Node(String),
}

/// The place of the sensor of some rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SensorRule {
    pub(crate) name: String,
    pub(crate) place: SensorPlace,
    /// Standard deviation where a row states none [K].
    pub(crate) sigma: Option<f64>,
    pub(crate) line: usize,
}

/// Measured images, by the pattern of their names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ImageRule {
    pub(crate) pattern: String,
    /// Time of the image: seconds of the scene, or a date.
    pub(crate) time: Option<Result<f64, Epoch>>,
    /// Position [m] and rotation of camera axes, in the frame of the scene's camera.
    pub(crate) pose: Option<(DVec3, DQuat)>,
    /// Standard deviation of a pixel [K].
    pub(crate) sigma: f64,
    /// An image of the same size that is 0 where a pixel does not count.
    pub(crate) mask: Option<PathBuf>,
    /// Whether the image shows temperatures of surfaces instead of brightness temperatures.
    pub(crate) surface: bool,
    /// Temperature of a count [K].
    pub(crate) scale: Option<f64>,
    pub(crate) line: usize,
}

/// A file of a fit.
#[derive(Debug, Clone)]
pub(crate) struct FitInput {
    pub(crate) path: PathBuf,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) sensors: Vec<SensorRule>,
    pub(crate) images: Vec<ImageRule>,
    pub(crate) loss: Loss,
    pub(crate) loss_scale: f64,
    pub(crate) hold_out: Option<HoldOut>,
}

impl FitInput {
    /// Reads the file at `path`, which may name the files of `reach`.
    ///
    /// # Errors
    /// A file that cannot be read, and the first wrong value with file, line and key.
    pub(crate) fn load(path: &Path, reach: &Reach) -> Result<Self, SceneError> {
        let text = files::read_text(path).map_err(|fault| unreadable(path, &fault))?;
        let faults = Faults::default();
        let file = SourceFile::new(path, &text, reach, &faults);
        let table = file.parse()?;
        let root = Section::root(&file, &table, ROOT)?;
        let parameters = parameters_of(&root, path)?;
        let mut sensors: Vec<SensorRule> = Vec::new();
        for section in &root.tables("sensor", SENSOR)? {
            let rule = sensor(section)?;
            if sensors.iter().any(|other| other.name == rule.name) {
                return Err(section.error("name", format!("'{}' is the name of an earlier sensor", rule.name)));
            }
            sensors.push(rule);
        }
        let images = root.tables("image", IMAGE)?.iter().map(image).collect::<Result<_, _>>()?;
        let fit = root.table("fit", FIT)?;
        let losses =
            [("square", Loss::Square), ("huber", Loss::Huber), ("soft_l1", Loss::SoftL1), ("cauchy", Loss::Cauchy)];
        let loss = fit.as_ref().map(|fit| fit.choice("loss", &losses)).transpose()?.flatten();
        let scale = Quantity::within(0.1, 1000.0, "");
        let loss_scale = fit.as_ref().map(|fit| fit.number("loss_scale", scale)).transpose()?.flatten();
        Ok(Self {
            path: path.to_path_buf(),
            parameters,
            sensors,
            images,
            loss: loss.unwrap_or(Loss::Huber),
            loss_scale: loss_scale.unwrap_or(LOSS_SCALE),
            hold_out: fit.as_ref().map(hold_out).transpose()?.flatten(),
        })
    }

    /// An error about a line of this file.
    pub(crate) fn error(&self, line: usize, key: &str, message: String) -> SceneError {
        SceneError::Value { path: self.path.clone(), line, key: key.to_owned(), message }
    }
}

fn sensor(section: &Section<'_>) -> Result<SensorRule, SceneError> {
    let name = section.required("name", section.name("name")?, "the name of the sensor in the table")?;
    let stated = [
        section.name("part")?.map(SensorPlace::Part),
        section.name("probe")?.map(SensorPlace::Probe),
        point(section, "position")?.map(SensorPlace::Position),
        section.name("node")?.map(SensorPlace::Node),
    ];
    let mut stated = stated.into_iter().flatten();
    let (Some(place), None) = (stated.next(), stated.next()) else {
        return Err(section.error("name", "needs one place: part, probe, position or, in a network file, node"));
    };
    let sigma = section.number("sigma", Quantity::positive("K"))?;
    Ok(SensorRule { name, place, sigma, line: section.line() })
}

fn image(section: &Section<'_>) -> Result<ImageRule, SceneError> {
    let what = "the names of measured images, with * and ? as wildcards";
    let pattern = section.required("file", section.name("file")?, what)?;
    section.exclusive("time", "utc")?;
    let time = match section.string("utc")? {
        Some(text) => Some(Err(parse_epoch(text, TimeScale::UTC).map_err(|message| section.error("utc", message))?)),
        None => section.number("time", Quantity::non_negative("s"))?.map(Ok),
    };
    let pose = section.numbers::<7>("pose", Quantity::any(""))?.map(|[x, y, z, qw, qx, qy, qz]| {
        let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
        match (rotation.length() - 1.0).abs() <= LENGTH_TOLERANCE {
            true => Ok((DVec3::new(x, y, z), rotation.normalize())),
            false => Err(section.error("pose", "must be x, y, z [m] and a quaternion of length 1, scalar first")),
        }
    });
    let sigma = section.number("sigma", Quantity::positive("K"))?;
    Ok(ImageRule {
        pattern,
        time,
        pose: pose.transpose()?,
        sigma: section.required("sigma", sigma, "the standard deviation of a pixel [K]")?,
        mask: section.path("mask")?,
        surface: section.choice("shows", &[("apparent", false), ("surface", true)])?.unwrap_or(false),
        scale: section.number("scale", Quantity::positive("K"))?,
        line: section.line(),
    })
}

fn hold_out(section: &Section<'_>) -> Result<Option<HoldOut>, SceneError> {
    section.exclusive("hold_out", "hold_out_share")?;
    if let Some(share) = section.number("hold_out_share", Quantity::between(0.0, 1.0, ""))? {
        return Ok(Some(HoldOut::Share(share)));
    }
    match section.numbers::<2>("hold_out", Quantity::any("s"))? {
        Some([from, to]) if from >= to => Err(section.error("hold_out", "must be two rising times [s]")),
        ends => Ok(ends.map(HoldOut::Between)),
    }
}
