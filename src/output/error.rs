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
    #[error("cannot create output folder {}: {source}", path.display())]
    CreateFolder {
        /// The folder.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },

    /// No file can be created in the output folder.
    #[error("output folder {} is not writable: {source}", path.display())]
    NotWritable {
        /// The folder.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },

    /// A file cannot be written; what existed under its name is untouched.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },

    /// A file or folder cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },

    /// An old file of isotherm's own cannot be removed.
    #[error("cannot remove {}: {source}", path.display())]
    Remove {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },

    /// The values of a frame do not fill its pixels.
    #[error("frame {width}x{height}: channel {channel} has {values} values")]
    FrameSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Name of the channel.
        channel: &'static str,
        /// How many values it has.
        values: usize,
    },

    /// An EXR file is not one, or not one that isotherm wrote.
    #[error("{}: {reason}", path.display())]
    Exr {
        /// The file.
        path: PathBuf,
        /// What is wrong or missing.
        reason: String,
    },

    /// A value cannot be encoded in the format of the file.
    #[error("cannot encode {what}: {reason}")]
    Encode {
        /// `PNG picture`, `plot "Materials"`.
        what: String,
        /// The encoder's reason.
        reason: String,
    },

    /// A row of a series does not fit its columns.
    #[error("series row at {time} s has {values} {group} values for {columns} {group} columns")]
    SeriesRow {
        /// Time of the row [s].
        time: f64,
        /// `part`, `material` or `probe`.
        group: &'static str,
        /// Values in the row.
        values: usize,
        /// Columns in the series.
        columns: usize,
    },

    /// Areas or group numbers do not belong to the temperatures.
    #[error("{nodes} temperatures, but {values} {what}")]
    NodeCount {
        /// Number of temperatures.
        nodes: usize,
        /// `areas` or `group numbers`.
        what: &'static str,
        /// How many of them.
        values: usize,
    },

    /// A group number beyond the number of groups.
    #[error("node {node}: group {group} of {groups}")]
    GroupNumber {
        /// Index of the node.
        node: usize,
        /// Its group.
        group: u32,
        /// Number of groups.
        groups: usize,
    },
}

impl OutputError {
    /// An error of writing `path`.
    pub(crate) fn write(path: &Path, source: std::io::Error) -> Self {
        Self::Write { path: path.to_path_buf(), source }
    }

    /// An EXR error of `path`.
    pub(crate) fn exr(path: &Path, reason: impl ToString) -> Self {
        Self::Exr { path: path.to_path_buf(), reason: reason.to_string() }
    }
}

impl OutputError {
    /// Whether the user can mend it: a folder or file that is in the way, absent, or not writable.
    pub fn is_about_the_folder(&self) -> bool {
        !matches!(
            self,
            Self::FrameSize { .. }
                | Self::SeriesRow { .. }
                | Self::NodeCount { .. }
                | Self::GroupNumber { .. }
                | Self::Encode { .. }
        )
    }
}
