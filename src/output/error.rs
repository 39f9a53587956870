//! Errors of writing and reading output files.

use std::path::{Path, PathBuf};

/// An error of the output files, which names the file or folder.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The output folder is not empty, and `--force` is not set.
    #[error(
        "output folder {} is not empty; name another folder, or pass --force to replace the files that isotherm wrote into it",
        .0.display()
    )]
    FolderNotEmpty(PathBuf),

    /// The output folder has files but no manifest.
    #[error(
        "output folder {} has files, but no manifest says which of them isotherm wrote (older versions wrote none), so --force \
         removes nothing; empty the folder yourself, or name another",
        .0.display()
    )]
    NoManifest(PathBuf),

    /// Another process writes into the folder.
    #[error("another run writes into output folder {} at present; wait for it, or name another folder", .0.display())]
    InUse(PathBuf),

    /// The manifest of the folder is damaged: the folder and the line.
    #[error(
        "the manifest of output folder {} is damaged at '{}'; name another folder",
        .0.display(), .1.escape_debug()
    )]
    Manifest(PathBuf, String),

    /// A file of isotherm was changed by somebody else.
    #[error("{} is not as isotherm left it; move it away, or name another folder", .0.display())]
    Changed(PathBuf),

    /// A file of somebody else stands where the command would write.
    #[error("{} was not written by isotherm, and the run would replace it; move it away, or name another folder", .0.display())]
    Stranger(PathBuf),

    /// A link stands where a file or folder of isotherm should.
    #[error("{} is a link, which isotherm does not follow; remove the link, or name another folder", .0.display())]
    Link(PathBuf),

    /// There is no run to resume.
    #[error("no run was begun in {}; begin one with: isotherm run SCENE -o {}", .0.display(), .0.display())]
    NoRun(PathBuf),

    /// A saved state cannot be used: the file and the reason.
    #[error("the saved state {} {}; begin anew with --force", .0.display(), .1)]
    State(PathBuf, String),

    /// A thermal state cannot be used: the file and the reason.
    #[error("the thermal state {} {}", .0.display(), .1)]
    ThermalState(PathBuf, String),

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

    /// Standard output takes no more.
    #[error("cannot write to standard output: {0}")]
    StandardOutput(#[source] std::io::Error),

    /// Two outputs of a command would go to the same place.
    #[error("{} and {} are the same output; name another for one of them", .0.display(), .1.display())]
    Twice(PathBuf, PathBuf),

    /// A file or folder cannot be read.
    #[error("cannot read {}: {}", .0.display(), .1)]
    Read(PathBuf, #[source] std::io::Error),

    /// An old file of isotherm cannot be removed.
    #[error("cannot remove {}: {}", .0.display(), .1)]
    Remove(PathBuf, #[source] std::io::Error),

    /// An invalid EXR file, or one that isotherm did not write. The text gives the reason.
    #[error("{}: {}", .0.display(), .1)]
    Exr(PathBuf, String),

    /// A value cannot be encoded: its description (`PNG picture`, `plot "Materials"`) and the encoder's reason.
    #[error("cannot encode {0}: {1}")]
    Encode(String, String),

    /// A number of a result is not finite: no file is written with it.
    #[error("{what} is {value}, which is no result; please report the input")]
    NotFinite {
        /// The number, with its node and its step or time.
        what: String,
        /// Its value.
        value: f64,
    },

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
    pub(crate) fn is_about_the_folder(&self) -> bool {
        !matches!(self, Self::Mismatch(_) | Self::Encode(..) | Self::StandardOutput(_) | Self::NotFinite { .. })
    }
}
