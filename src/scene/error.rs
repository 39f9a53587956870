//! Errors in a scene file and in the files that it names. Each error names file, line and key.

use std::path::{Path, PathBuf};

/// An error that keeps a scene from being used. The user can fix it (exit code 2).
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file that the scene needs cannot be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The path that was tried.
        path: PathBuf,
        /// The reason from the operating system.
        reason: String,
    },
    /// The file is a model, where a scene is asked for.
    #[error(
        "{}: is a model, and a scene is a TOML file that names it: path = \"{}\" under [model]. `isotherm info {} --scene > scene.toml` makes one to begin with",
        path.display(),
        path.file_name().unwrap_or_default().display(),
        path.display()
    )]
    Model {
        /// The model.
        path: PathBuf,
    },
    /// The file is not TOML.
    #[error("{}:{line}: not valid TOML: {message}", path.display())]
    Syntax {
        /// Scene file or materials table.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Message of the TOML parser.
        message: String,
    },
    /// A key is unknown or missing, or its value has a wrong type, is out of range or contradicts another key.
    #[error("{}:{line}: {key}: {message}", path.display())]
    Value {
        /// Scene file or materials table.
        path: PathBuf,
        /// Line of the value, from 1. For a missing key it is the line of the section's header.
        line: usize,
        /// Section and key: `time.step`.
        key: String,
        /// The fault and the valid values, in words.
        message: String,
    },
    /// A thermal value in the `extras` of a glTF material is wrong.
    #[error("{}: material '{material}': isotherm_{key}: {message}", model.display())]
    Extras {
        /// The glTF file.
        model: PathBuf,
        /// Name of the glTF material.
        material: String,
        /// Key without its prefix `isotherm_`.
        key: String,
        /// The fault and the valid values, in words.
        message: String,
    },
    /// Several errors of one file and of the tables that it names, in the order of their lines.
    #[error("{}", list(.0))]
    Several(Vec<SceneError>),
    /// Some glTF materials have no thermal values.
    #[error(
        "{}:{line}: material: no [[material]] rule matches, and neither glTF extras nor materials.default give values \
         to {} of {}: {}{advice}",
        path.display(),
        names.len(),
        model.display(),
        names.join(", ")
    )]
    Unmatched {
        /// The scene file.
        path: PathBuf,
        /// Line of the last rule, after which a new rule can stand, or 1 if there is no rule.
        line: usize,
        /// The glTF file.
        model: PathBuf,
        /// Names of the materials, each with the keys that the material's own extras lack.
        names: Vec<String>,
        /// A probable cause, with leading punctuation. May be empty.
        advice: String,
    },
}

impl SceneError {
    /// The file that the error is about, its line (from 1), and the key in it, as far as they are known. The first of several errors counts.
    pub(crate) fn place(&self) -> (Option<&Path>, Option<usize>, Option<&str>) {
        match self {
            Self::Unreadable { path, .. } | Self::Model { path } => (Some(path), None, None),
            Self::Syntax { path, line, .. } => (Some(path), Some(*line), None),
            Self::Value { path, line, key, .. } => (Some(path), Some(*line), Some(key)),
            Self::Extras { model, key, .. } => (Some(model), None, Some(key)),
            Self::Unmatched { path, line, .. } => (Some(path), Some(*line), Some("material")),
            Self::Several(errors) => errors.first().map_or((None, None, None), Self::place),
        }
    }

    /// The errors one by one.
    pub fn each(&self) -> &[Self] {
        match self {
            Self::Several(errors) => errors,
            one => std::slice::from_ref(one),
        }
    }

    /// File and line, for the order of errors.
    pub(super) fn position(&self) -> (Option<PathBuf>, usize) {
        match self {
            Self::Syntax { path, line, .. } | Self::Value { path, line, .. } | Self::Unmatched { path, line, .. } => {
                (Some(path.clone()), *line)
            }
            Self::Unreadable { path, .. } | Self::Model { path } => (Some(path.clone()), 0),
            Self::Extras { model, .. } => (Some(model.clone()), 0),
            Self::Several(errors) => errors.first().map_or((None, 0), Self::position),
        }
    }
}

fn list(errors: &[SceneError]) -> String {
    errors.iter().map(SceneError::to_string).collect::<Vec<_>>().join("\n")
}
