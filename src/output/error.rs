//! Errors of writing and reading output files.

use std::path::{Path, PathBuf};

/// An error of the output files. It names the file or folder.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The output folder is not empty, and `--force` is not set.
    #[error(
        "output folder {} is not empty; name another folder, or pass --force to overwrite isotherm's own files in it",
        .0.display()
    )]
    FolderNotEmpty(PathBuf),

    /// The output folder is a file.
    #[error("output folder {} is a file; name another folder", .0.display())]
    NotAFolder(PathBuf),

    /// The output file is a folder.
    #[error("output file {} is a folder; name a file in it", .0.display())]
    NotAFile(PathBuf),

    /// The output is one of the command's inputs.
    #[error("output file {} is an input of the command; name another file", .0.display())]
    Overwrites(PathBuf),

    /// The output folder cannot be made.
    #[error("cannot create output folder {}: {}", .0.display(), .1)]
    CreateFolder(PathBuf, #[source] std::io::Error),

    /// No file can be created in the output folder.
    #[error("output folder {} is not writable: {}", .0.display(), .1)]
    NotWritable(PathBuf, #[source] std::io::Error),

    /// A file cannot be written. An existing file of this name is unchanged.
    #[error("cannot write {}: {}", .0.display(), .1)]
    Write(PathBuf, #[source] std::io::Error),

    /// A file or folder cannot be read.
    #[error("cannot read {}: {}", .0.display(), .1)]
    Read(PathBuf, #[source] std::io::Error),

    /// An old file of isotherm cannot be removed.
    #[error("cannot remove {}: {}", .0.display(), .1)]
    Remove(PathBuf, #[source] std::io::Error),

    /// An invalid EXR file, or one that isotherm did not write. The text says what is wrong.
    #[error("{}: {}", .0.display(), .1)]
    Exr(PathBuf, String),

    /// A value cannot be encoded: its description (`PNG picture`, `plot "Materials"`) and the encoder's reason.
    #[error("cannot encode {0}: {1}")]
    Encode(String, String),

    /// Two lists differ in length: pixels and channels, nodes and areas, rows and columns.
    #[error("{0}")]
    Mismatch(String),
}

impl OutputError {
    pub(crate) fn write(path: &Path, source: std::io::Error) -> Self {
        Self::Write(path.to_path_buf(), source)
    }

    pub(crate) fn exr(path: &Path, reason: impl ToString) -> Self {
        Self::Exr(path.to_path_buf(), reason.to_string())
    }

    /// Whether the user can fix it: a folder or file is in the way, missing or not writable.
    pub fn is_about_the_folder(&self) -> bool {
        !matches!(self, Self::Mismatch(_) | Self::Encode(..))
    }
}
