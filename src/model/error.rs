//! What can be wrong with a model file or with what is asked of it.

use std::path::PathBuf;

/// Why a model cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file is at fault.
    #[error("{}: {fault}", path.display())]
    File {
        /// The file that was asked for.
        path: PathBuf,
        /// What is wrong with it.
        fault: Fault,
    },
    /// The longest edge asked for is no length.
    #[error("a longest edge of {0} m is refused: it must be finite and greater than 0")]
    MaxEdge(f64),
    /// The shortest edge asked for is no length.
    #[error("a shortest edge of {0} m is refused: it must be finite and 0 or greater")]
    MinEdge(f64),
    /// Subdivision would make more vertices than allowed.
    #[error(
        "{}: subdivision to edges of at most {max_edge} m needs {needed} vertices or more, and the limit is {limit}; \
         use a longer edge",
        path.display()
    )]
    TooManyVertices {
        /// The model's file.
        path: PathBuf,
        /// The longest edge asked for [m].
        max_edge: f64,
        /// Vertices needed at the level of subdivision that passed the limit.
        needed: usize,
        /// Most vertices allowed.
        limit: usize,
    },
}

/// What is wrong with a glTF file.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The operating system refuses it.
    #[error("cannot be read: {0}")]
    Unreadable(std::io::Error),
    /// The binary container (GLB) is damaged.
    #[error("damaged GLB container: {0}")]
    Container(String),
    /// The text is not JSON.
    #[error("the glTF JSON cannot be parsed: {0}")]
    Json(serde_json::Error),
    /// One element breaks a rule of glTF 2.0 or a limit of this program.
    #[error("{element}: {problem}")]
    Element {
        /// Kind, index and name: `node 5 "port array"`.
        element: String,
        /// What is wrong with it.
        problem: String,
    },
    /// `extensionsRequired` names what this program lacks.
    #[error("the file requires {}, which is not supported{advice}", names.join(", "))]
    ExtensionsRequired {
        /// The extensions.
        names: Vec<String>,
        /// What the user can do about it, with its leading punctuation; empty where nothing is known.
        advice: String,
    },
    /// No triangle is left.
    #[error("nothing to draw: {0}")]
    NothingToDraw(String),
}

impl Fault {
    /// A fault of the element that [`label`] names.
    pub(super) fn element(element: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Element { element: element.into(), problem: problem.into() }
    }
}

/// `accessor 3`, or `node 5 "name"` where it has a name.
pub(super) fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {index} {name:?}"),
        _ => format!("{kind} {index}"),
    }
}

/// `1 camera`, `3 cameras`.
pub(super) fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}
