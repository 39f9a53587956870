//! What can go wrong while results are written or read back.

use std::path::{Path, PathBuf};

/// An error of the output files; each names its file or folder.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The output folder holds something and the user did not ask to overwrite.
    #[error(
        "output folder {} is not empty; name another folder, or pass --force to overwrite isotherm's own files in it",
        .0.display()
    )]
    FolderNotEmpty(PathBuf),

    /// The output folder's name belongs to a file.
    #[error("output folder {} is a file; name another folder", .0.display())]
    NotAFolder(PathBuf),

    /// The output file's name belongs to a folder.
    #[error("output file {} is a folder; name a file in it", .0.display())]
    NotAFile(PathBuf),

    /// An output's name belongs to a file that was read.
    #[error("output file {} is one that the command reads; name another", .0.display())]
    Overwrites(PathBuf),

    /// The output folder cannot be made.
    #[error("cannot create output folder {}: {}", .0.display(), .1)]
    CreateFolder(PathBuf, #[source] std::io::Error),

    /// No file can be created in the output folder.
    #[error("output folder {} is not writable: {}", .0.display(), .1)]
    NotWritable(PathBuf, #[source] std::io::Error),

    /// A file cannot be written; what existed under its name is untouched.
    #[error("cannot write {}: {}", .0.display(), .1)]
    Write(PathBuf, #[source] std::io::Error),

    /// A file or folder cannot be read.
    #[error("cannot read {}: {}", .0.display(), .1)]
    Read(PathBuf, #[source] std::io::Error),

    /// An old file of isotherm's own cannot be removed.
    #[error("cannot remove {}: {}", .0.display(), .1)]
    Remove(PathBuf, #[source] std::io::Error),

    /// An EXR file is not one, or not one that isotherm wrote: what is wrong or missing.
    #[error("{}: {}", .0.display(), .1)]
    Exr(PathBuf, String),

    /// A value cannot be encoded in the format of the file: `PNG picture`, `plot "Materials"`, and the encoder's reason.
    #[error("cannot encode {0}: {1}")]
    Encode(String, String),

    /// Lists that belong together differ in length: pixels and channels, nodes and areas, rows and columns.
    #[error("{0}")]
    Mismatch(String),
}

impl OutputError {
    /// An error of writing `path`.
    pub(crate) fn write(path: &Path, source: std::io::Error) -> Self {
        Self::Write(path.to_path_buf(), source)
    }

    /// An EXR error of `path`.
    pub(crate) fn exr(path: &Path, reason: impl ToString) -> Self {
        Self::Exr(path.to_path_buf(), reason.to_string())
    }

    /// Whether the user can mend it: a folder or file that is in the way, absent, or not writable.
    pub fn is_about_the_folder(&self) -> bool {
        !matches!(self, Self::Mismatch(_) | Self::Encode(..))
    }
}
