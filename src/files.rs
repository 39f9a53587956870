//! Opens every file that a user, a scene or a glTF names. Kind, folder and size of the file are checked.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};

mod decoder;
mod expansion;

pub(crate) use decoder::decode;
pub(crate) use expansion::Expansion;

/// Most bytes of a file that is read whole. Trajectories of a year at 1 s take half of it.
pub(crate) const LARGEST_FILE: u64 = 4 << 30;

/// First bytes of files that are no text.
const BINARIES: [(&[u8], &str); 7] = [
    (b"glTF", "a model (glTF)"),
    (b"\x89PNG", "a picture (PNG)"),
    (b"\xFF\xD8\xFF", "a picture (JPEG)"),
    (b"\x76\x2F\x31\x01", "an image (EXR)"),
    (b"\x89HDF", "an HDF5 file, as TMD files are"),
    (b"PK\x03\x04", "a zip archive, as spreadsheets are"),
    (b"\x1F\x8B", "a file compressed by gzip"),
];

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum FileFault {
    /// The operating system does not open or read it.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// A folder, a device, a pipe or a socket.
    #[error("it is {0}, and only regular files are read here")]
    Kind(&'static str),
    /// A file outside the folder of the file that names it.
    #[error(
        "{} lies outside {}, the folder of the file that names it; --allow-outside reads it all the same",
        path.display(),
        folder.display()
    )]
    Outside {
        /// The file behind all symbolic links.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// A file with more than this many bytes.
    #[error("it has more than {0} bytes, the most that is read")]
    Long(u64),
    /// A text is not UTF-8, but maybe a file of a known kind.
    #[error("it is not UTF-8 text{}", .0.map_or(String::new(), |kind| format!(", but {kind}")))]
    Utf8(Option<&'static str>),
}

/// The files that a file may name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reach {
    /// Files in this folder and in its subfolders, behind all symbolic links.
    Within(PathBuf),
    /// Every file (`--allow-outside`).
    Anywhere,
}

impl Reach {
    /// The folder of `file`.
    pub fn of(file: &Path) -> Self {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self::Within(folder.to_path_buf())
    }

    /// Whether `path` is a regular file that may be read. A symbolic link counts as its target.
    pub(crate) fn admit(&self, path: &Path) -> Result<(), FileFault> {
        regular(&std::fs::metadata(path)?)?;
        let Self::Within(folder) = self else { return Ok(()) };
        let (folder, path) = (folder.canonicalize()?, path.canonicalize()?);
        if path.starts_with(&folder) { Ok(()) } else { Err(FileFault::Outside { path, folder }) }
    }
}

/// Opens a regular file. Nothing else is opened, because opening a pipe waits and opening a device can act on it.
pub(crate) fn open(path: &Path) -> Result<(File, u64), FileFault> {
    regular(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    regular(&metadata)?;
    Ok((file, metadata.len()))
}

pub(crate) fn read(path: &Path) -> Result<Vec<u8>, FileFault> {
    let (file, length) = open(path)?;
    read_to(file, length, LARGEST_FILE)
}

pub(crate) fn read_text(path: &Path) -> Result<String, FileFault> {
    text(read(path)?)
}

/// The bytes as text.
fn text(bytes: Vec<u8>) -> Result<String, FileFault> {
    String::from_utf8(bytes).map_err(|fault| {
        let kind = BINARIES.iter().find(|(beginning, _)| fault.as_bytes().starts_with(beginning));
        FileFault::Utf8(kind.map(|(_, kind)| *kind))
    })
}

/// Reads a text that the command line names: a regular file, a pipe or a socket, such as `/dev/stdin`.
pub(crate) fn read_text_or_pipe(path: &Path) -> Result<String, FileFault> {
    let metadata = std::fs::metadata(path)?;
    if !is_stream(&metadata) {
        regular(&metadata)?;
    }
    text(read_to(File::open(path)?, 0, LARGEST_FILE)?)
}

/// Reads `file` to its end, which must come within `most` bytes.
fn read_to(file: File, length: u64, most: u64) -> Result<Vec<u8>, FileFault> {
    if length > most {
        return Err(FileFault::Long(most));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(FileFault::Long(most)) } else { Ok(bytes) }
}

fn regular(metadata: &Metadata) -> Result<(), FileFault> {
    if metadata.is_file() {
        return Ok(());
    }
    Err(FileFault::Kind(match metadata.is_dir() {
        true => "a directory",
        false if is_stream(metadata) => "a pipe or a socket",
        false => "a device",
    }))
}

#[cfg(unix)]
fn is_stream(metadata: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    metadata.file_type().is_fifo() || metadata.file_type().is_socket()
}

#[cfg(not(unix))]
fn is_stream(_: &Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_outside_the_folder_are_refused_whatever_the_way_to_them() {
        let folder = tempfile::tempdir().unwrap();
        let (inside, outside) = (folder.path().join("in"), folder.path().join("out.csv"));
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(&outside, "secret").unwrap();
        std::fs::write(inside.join("a.csv"), "a").unwrap();
        let reach = Reach::of(&inside.join("scene.toml"));
        for path in [inside.join("a.csv"), inside.join("../in/a.csv"), inside.canonicalize().unwrap().join("a.csv")] {
            reach.admit(&path).unwrap();
        }
        for path in [inside.join("../out.csv"), outside.clone()] {
            let message = reach.admit(&path).unwrap_err().to_string();
            assert!(message.contains("outside") && message.contains("--allow-outside"), "{message}");
            Reach::Anywhere.admit(&path).unwrap();
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_count_as_what_they_lead_to_and_devices_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(to, folder.path().join(name)).unwrap();
            folder.path().join(name)
        };
        std::fs::write(folder.path().join("a.csv"), "a").unwrap();
        let reach = Reach::of(&folder.path().join("scene.toml"));
        let inside = link("a.csv", "inside");
        reach.admit(&inside).unwrap();
        assert_eq!(read_text(&inside).unwrap(), "a");
        assert!(matches!(reach.admit(&link("/etc/passwd", "outside")), Err(FileFault::Outside { .. })));
        let device = link("/dev/zero", "device");
        assert!(matches!(reach.admit(&device), Err(FileFault::Kind("a device"))));
        assert!(matches!(read(&device), Err(FileFault::Kind("a device"))));
        assert!(matches!(read_text_or_pipe(&device), Err(FileFault::Kind("a device"))));
        assert!(matches!(read(folder.path()), Err(FileFault::Kind("a directory"))));
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_read_only_where_the_command_line_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(matches!(read(&pipe), Err(FileFault::Kind("a pipe or a socket"))));
        let writer = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::write(pipe, "step,target\n")
        });
        assert_eq!(read_text_or_pipe(&pipe).unwrap(), "step,target\n");
        writer.join().unwrap().unwrap();
    }

    #[test]
    fn no_more_than_the_limit_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long");
        std::fs::write(&path, [0; 10]).unwrap();
        let file = || File::open(&path).unwrap();
        assert_eq!(read_to(file(), 10, 10).unwrap().len(), 10);
        assert!(matches!(read_to(file(), 10, 9), Err(FileFault::Long(9))));
        // A length that the system does not know is found out by reading.
        assert!(matches!(read_to(file(), 0, 9), Err(FileFault::Long(9))));
    }
}
