//! What is under way while a scene is made ready, and what keeps it from being so.

use std::path::PathBuf;

use crate::environment::shadow::LARGEST_TREE;
use crate::environment::sky::SkyError;
use crate::model::ModelError;
use crate::scene::{JointRule, Scene, SceneError};

/// What is under way while a scene is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The model is read, and its short edges are merged.
    Reading,
    /// Long edges are split: the vertices so far.
    Splitting(usize),
    /// The thermal network is made.
    Network,
    /// Nodes are put in the order of the device.
    Ordering,
    /// Loads are prepared.
    Loads,
}

impl Stage {
    /// How many there are.
    pub const COUNT: u64 = 5;

    /// How many come before it.
    pub fn number(self) -> u64 {
        match self {
            Self::Reading => 0,
            Self::Splitting(_) => 1,
            Self::Network => 2,
            Self::Ordering => 3,
            Self::Loads => 4,
        }
    }
}

impl std::fmt::Display for Stage {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Reading => write!(out, "reading the model"),
            Self::Splitting(vertices) => write!(out, "splitting: {vertices} vertices"),
            Self::Network => write!(out, "making the network"),
            Self::Ordering => write!(out, "ordering the nodes"),
            Self::Loads => write!(out, "preparing the loads"),
        }
    }
}

/// What keeps a scene from being made.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The scene file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The orbit or attitude.
    #[error("{path}: {source}")]
    Sky {
        /// The scene file.
        path: PathBuf,
        /// What is wrong.
        source: SkyError,
    },
    /// The thermal network.
    #[error("{path}: {message}")]
    Network {
        /// The scene file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// More triangles than rays are tried against.
    #[error(
        "{path}: shadows.method: {triangles} triangles make a tree of {boxes} boxes; rays take at most {LARGEST_TREE}: \
         use method = \"depth\""
    )]
    TooManyOccluders {
        /// The scene file.
        path: PathBuf,
        /// Triangles of the model before it is split.
        triangles: usize,
        /// Boxes of the tree.
        boxes: usize,
    },
    /// A joint.
    #[error("{path}:{line}: joint: {message}")]
    Joint {
        /// The scene file.
        path: PathBuf,
        /// Line of the joint.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A file that vanished after it was checked.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A probe on a part that the model does not have.
    #[error("{path}: probe '{probe}': the model has no part '{part}'; it has {parts}")]
    ProbePart {
        /// The scene file.
        path: PathBuf,
        /// The probe.
        probe: String,
        /// What it asks for.
        part: String,
        /// What there is.
        parts: String,
    },
}

impl PrepareError {
    /// An error about the thermal network of a scene.
    pub(super) fn network(scene: &Scene, message: impl ToString) -> Self {
        Self::Network { path: scene.source.clone(), message: message.to_string() }
    }

    /// An error about a joint of a scene.
    pub(super) fn joint(scene: &Scene, rule: &JointRule, message: String) -> Self {
        Self::Joint { path: scene.source.clone(), line: rule.line, message }
    }
}
