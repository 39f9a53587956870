//! Errors in a model file and in requests about it.

use std::path::PathBuf;

use crate::files::FileFault;

/// Why a model cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file is at fault.
    #[error("{}: {fault}", path.display())]
    File {
        /// The file that was asked for.
        path: PathBuf,
        /// The error.
        fault: ModelFault,
    },
    /// The longest edge is not a positive, finite length.
    #[error("a longest edge of {0} m is refused: it must be finite and greater than 0")]
    MaxEdge(f64),
    /// The shortest edge is not a valid length.
    #[error("a shortest edge of {0} m is refused: it must be finite and 0 or greater")]
    MinEdge(f64),
    /// A craft longer than any, whose edges would make millions of nodes.
    #[error(
        "{}: the craft is {extent:.0} m long, so it is probably in mm or cm, and glTF is in metres: scale its root node by 0.001 or 0.01. Edges of at most \
         {edge} m would make {nodes:.0} nodes or more; if the size is right, use longer edges",
        path.display()
    )]
    WrongUnit {
        /// The model's file.
        path: PathBuf,
        /// Longest side of the box around the craft [m].
        extent: f64,
        /// The shortest of the longest edges [m].
        edge: f64,
        /// Nodes that the division would make at least.
        nodes: f64,
    },
    /// Subdivision would exceed the vertex limit.
    #[error(
        "{}: subdivision to edges of at most {max_edge} m needs {needed} vertices or more, and the limit is {limit}. The craft is \
         {extent:.3} m long: use a longer edge. If the file is in mm or cm, scale its root node by 0.001 or 0.01, because glTF is in metres",
        path.display()
    )]
    TooManyVertices {
        /// The model's file.
        path: PathBuf,
        /// Longest side of the box around the craft [m].
        extent: f64,
        /// The longest edge [m].
        max_edge: f64,
        /// Vertices at the subdivision level that exceeds the limit.
        needed: usize,
        /// The vertex limit.
        limit: usize,
    },
}

/// An error in a glTF file.
#[derive(Debug, thiserror::Error)]
pub enum ModelFault {
    /// The operating system cannot read it.
    #[error("cannot be read: {0}")]
    Unreadable(FileFault),
    /// The binary container (GLB) is damaged.
    #[error("damaged GLB container: {0}")]
    Container(String),
    /// A file of another format.
    #[error("this is {0}, and isotherm reads glTF 2.0 (.glb, .gltf): docs/cad.md says how to convert it")]
    Format(&'static str),
    /// What stands in place of a file that was not fetched.
    #[error("this is {0}, and not the model")]
    NotFetched(&'static str),
    /// A file without content.
    #[error("the file is empty: a program that was to write it has failed, so export the model again")]
    Empty,
    /// The text is not JSON.
    #[error("the glTF JSON cannot be parsed: {0}")]
    Json(serde_json::Error),
    /// One element breaks a rule of glTF 2.0 or a limit of isotherm.
    #[error("{element}: {problem}")]
    Element {
        /// Kind, index and name: `node 5 "port array"`.
        element: String,
        /// The fault, in words.
        problem: String,
    },
    /// A required extension is not supported.
    #[error("the file requires {}, which is not supported{advice}", names.join(", "))]
    ExtensionsRequired {
        /// The extensions.
        names: Vec<String>,
        /// Advice for the user, with leading punctuation. May be empty.
        advice: String,
    },
    /// The file holds no triangle.
    #[error("nothing to draw: {0}")]
    NothingToDraw(String),
}

impl ModelFault {
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
