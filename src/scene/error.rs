//! What can be wrong with a scene file or with what it names, said with file, line and key.

use std::path::PathBuf;

/// Anything that keeps a scene from being used. The user can mend every one of them (exit code 2).
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file that the scene needs cannot be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The path that was tried.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The file is not TOML.
    #[error("{}:{line}: not valid TOML: {message}", path.display())]
    Syntax {
        /// Scene file or materials table.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What the TOML parser said.
        message: String,
    },
    /// A key is unknown or missing, or its value is of the wrong type, out of range or at odds with another.
    #[error("{}:{line}: {key}: {message}", path.display())]
    Value {
        /// Scene file or materials table.
        path: PathBuf,
        /// Line of the value, or of the section's header where the key is missing; from 1.
        line: usize,
        /// Section and key: `time.step`.
        key: String,
        /// What is wrong and what would be right.
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
        /// What is wrong and what would be right.
        message: String,
    },
    /// glTF materials that nothing gives thermal values to.
    #[error(
        "{}:{line}: material: no [[material]] rule matches, and neither glTF extras nor materials.default give values \
         to {} of {}: {}",
        path.display(),
        names.len(),
        model.display(),
        names.join(", ")
    )]
    Unmatched {
        /// The scene file.
        path: PathBuf,
        /// Line of the last rule, where another could follow; 1 where there is none.
        line: usize,
        /// The glTF file.
        model: PathBuf,
        /// Names of the materials, each with what its own extras lack where it has some.
        names: Vec<String>,
    },
}
