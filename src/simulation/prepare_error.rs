//! Stages and errors of preparing a scene.

use std::path::{Path, PathBuf};

use crate::environment::sky::SkyError;
use crate::files::FileFault;
use crate::model::ModelError;
use crate::raster::traced::LARGEST_REFLECTED;
use crate::scene::{JointRule, Scene, SceneError};
use crate::thermal::function::FunctionError;

/// A stage of preparing a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PrepareStage {
    /// The model is read and its short edges are merged.
    Reading,
    /// Edges of a long craft are about to be split into many.
    Long {
        /// Longest side of the box around the craft [m].
        metres: u32,
        /// Nodes that it has at least.
        nodes: usize,
    },
    /// Long edges are split. The value is the number of vertices so far.
    Splitting(usize),
    /// The thermal network is made.
    Network,
    /// Nodes are put in the order of the device.
    Ordering,
    /// Loads are prepared.
    Loads,
    /// Patches are made that radiate to each other.
    Patches,
}

impl PrepareStage {
    /// Number of stages.
    pub(crate) const COUNT: u64 = 6;

    /// The stage in words.
    pub(crate) fn work(self) -> &'static str {
        match self {
            Self::Reading => "reading the model",
            Self::Long { .. } | Self::Splitting(_) => "splitting edges",
            Self::Network => "making the network",
            Self::Ordering => "ordering the nodes",
            Self::Loads => "preparing the loads",
            Self::Patches => "making patches",
        }
    }

    /// Number of stages before this one.
    pub(crate) fn number(self) -> u64 {
        match self {
            Self::Reading => 0,
            Self::Long { .. } | Self::Splitting(_) => 1,
            Self::Network => 2,
            Self::Ordering => 3,
            Self::Loads => 4,
            Self::Patches => 5,
        }
    }
}

impl std::fmt::Display for PrepareStage {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Long { metres, nodes } => write!(
                out,
                "the craft is {metres} m long, and its edges make {nodes} nodes or more: if the file is in mm or cm, stop, and scale its root node"
            ),
            Self::Splitting(vertices) => write!(out, "splitting: {vertices} vertices"),
            _ => out.write_str(self.work()),
        }
    }
}

/// An error that keeps a scene from being prepared.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The temperatures of a file do not fit the scene.
    #[error("{}: temperatures: {reason}", path.display())]
    Temperatures {
        /// The scene file.
        path: PathBuf,
        /// The reason and the remedy.
        reason: String,
    },
    /// An error in the scene file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An error in the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An error in the orbit or attitude.
    #[error("{path}: {source}")]
    Sky {
        /// The scene file.
        path: PathBuf,
        /// The cause.
        source: SkyError,
    },
    /// An error in the thermal network.
    #[error("{path}: {message}")]
    Network {
        /// The scene file.
        path: PathBuf,
        /// The cause.
        message: String,
    },
    /// A structure that stores too little heat for the step.
    #[error(
        "{}: material '{material}': the structure of 'over' stores so little heat that it follows the outside within a step of {step} s: give the outside the \
         heat capacity of both, leave 'over' out, or state a shorter step",
        path.display()
    )]
    LightStructure {
        /// The scene file.
        path: PathBuf,
        /// The material.
        material: String,
        /// Length of a step [s].
        step: f64,
    },
    /// More triangles than the tree for reflections of the craft can hold.
    #[error(
        "{path}: radiance.reflections: {triangles} triangles make a tree of {boxes} boxes; rays take at most {LARGEST_REFLECTED}: \
         use reflections = \"environment\" or a coarser model"
    )]
    TooManyReflected {
        /// The scene file.
        path: PathBuf,
        /// Triangles of the model.
        triangles: usize,
        /// Boxes of the tree.
        boxes: usize,
    },
    /// A response function that changes too fast, which only its pieces have shown.
    #[error("{path}: material '{material}': {source}")]
    Function {
        /// The scene file.
        path: PathBuf,
        /// Name of the material.
        material: String,
        /// The cause.
        source: FunctionError,
    },
    /// An emissivity that the band, the angles or the camera do not allow.
    #[error("{path}: material '{material}': {message}")]
    Emissivity {
        /// The scene file.
        path: PathBuf,
        /// Name of the material.
        material: String,
        /// The cause.
        message: String,
    },
    /// An error in a joint.
    #[error("{path}:{line}: joint: {message}")]
    Joint {
        /// The scene file.
        path: PathBuf,
        /// Line of the joint.
        line: usize,
        /// The cause.
        message: String,
    },
    /// An error in the radiation between surfaces.
    #[error("{path}: exchange: {message}")]
    Exchange {
        /// The scene file.
        path: PathBuf,
        /// The cause.
        message: String,
    },
    /// A time that takes too much work to reach.
    #[error("{path}: {reason}")]
    Late {
        /// The scene file.
        path: PathBuf,
        /// The cause.
        reason: String,
    },
    /// More numbers in the series than a run may write.
    #[error(
        "{path}: time.steps: asks for too much work: {rows} rows of {columns} temperatures; the limit is {limit:e} numbers"
    )]
    LongSeries {
        /// The scene file.
        path: PathBuf,
        /// Rows of the series.
        rows: u64,
        /// Temperatures in each.
        columns: usize,
        /// Most numbers.
        limit: f64,
    },
    /// A file that disappeared after it was checked.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: FileFault,
    },
    /// Several errors about things that the model lacks.
    #[error("{}", PrepareError::each(self).join("\n"))]
    Several(Vec<PrepareError>),
    /// A probe on a part that does not exist.
    #[error("{path}: probe.part: of '{probe}', the model has no part '{part}'{near}")]
    ProbePart {
        /// The scene file.
        path: PathBuf,
        /// The probe.
        probe: String,
        /// The part that it names.
        part: String,
        /// The nearest name, or the parts of the model, with leading punctuation.
        near: String,
    },
}

impl PrepareError {
    /// The messages of all errors, one by one.
    pub(crate) fn each(&self) -> Vec<String> {
        match self {
            Self::Several(errors) => errors.iter().flat_map(Self::each).collect(),
            Self::Scene(error) => error.each().iter().map(ToString::to_string).collect(),
            one => vec![one.to_string()],
        }
    }

    pub(super) fn network(scene: &Scene, message: impl ToString) -> Self {
        Self::Network { path: scene.source.clone(), message: message.to_string() }
    }

    /// The file that the error is about, its line (from 1), and the key in it, as far as they are known.
    pub(crate) fn place(&self) -> (Option<&Path>, Option<usize>, Option<&str>) {
        match self {
            Self::Scene(error) => error.place(),
            Self::Several(errors) => errors.first().map_or((None, None, None), Self::place),
            Self::Model(_) => (None, None, None),
            Self::Joint { path, line, .. } => (Some(path), Some(*line), Some("joint")),
            Self::LongSeries { path, .. } => (Some(path), None, Some("time.steps")),
            Self::TooManyReflected { path, .. } => (Some(path), None, Some("radiance.reflections")),
            Self::Sky { path, .. }
            | Self::Network { path, .. }
            | Self::Emissivity { path, .. }
            | Self::Exchange { path, .. }
            | Self::Temperatures { path, .. }
            | Self::LightStructure { path, .. }
            | Self::Function { path, .. }
            | Self::Late { path, .. }
            | Self::Read { path, .. }
            | Self::ProbePart { path, .. } => (Some(path), None, None),
        }
    }

    pub(super) fn joint(scene: &Scene, rule: &JointRule, message: String) -> Self {
        Self::Joint { path: scene.source.clone(), line: rule.line, message }
    }
}
