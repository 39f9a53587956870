//! The destination of one file of a command: standard output, a stream that takes bytes as they come, or a file that appears whole.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::OutputError;
use super::console;
use super::csv_rows::{write_checked_rows, write_rows};
use super::waiting::{Patient, Waiting};
use super::whole_file::{check_writable, write_atomic};

/// The name of standard output on a command line.
pub(crate) const STANDARD_OUTPUT: &str = "-";

/// Most links that are followed to a file. Linux has the same limit.
const MOST_LINKS: usize = 40;

/// Where the bytes of one file go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Destination {
    StandardOutput,
    /// A device, a pipe or a socket, which is opened and written, never replaced.
    Stream(PathBuf),
    /// A regular file, or none yet. Links are resolved. The file appears whole or not at all.
    File(PathBuf),
}

impl Destination {
    /// The destination at a path: `-` and `/dev/stdout` are standard output, links lead to their targets, and a device, a pipe, a socket or an open
    /// file of a process is a stream.
    ///
    /// # Errors
    /// The path is a folder, or cannot be resolved.
    pub(crate) fn at(path: &Path) -> Result<Self, OutputError> {
        if path == Path::new(STANDARD_OUTPUT) {
            return Ok(Self::StandardOutput);
        }
        let metadata = fs::metadata(path);
        if metadata.as_ref().map_or(names_a_folder(path), fs::Metadata::is_dir) {
            return Err(OutputError::NotAFile(path.to_path_buf()));
        }
        match follow(path).map_err(|source| OutputError::write(path, source))? {
            LinkEnd::Descriptor(1) => Ok(Self::StandardOutput),
            LinkEnd::Path(target) if metadata.map_or(true, |metadata| metadata.is_file()) => Ok(Self::File(target)),
            _ => Ok(Self::Stream(path.to_path_buf())),
        }
    }

    /// Writes the bytes of `content`.
    ///
    /// # Errors
    /// `content` fails, or the destination takes no more. A file is then as it was. If standard output takes no more, the command still writes its
    /// other files and fails at its end.
    pub(crate) fn write<F>(&self, content: F) -> Result<(), OutputError>
    where
        F: FnOnce(&mut dyn Write) -> Result<(), OutputError>,
    {
        match self {
            Self::File(path) => write_atomic(path, content),
            Self::Stream(path) => {
                let stream = open_stream(path).map_err(|source| OutputError::write(path, source))?;
                self.write_through(stream, content)
            }
            Self::StandardOutput => match self.write_through(console::standard_output(), content) {
                Err(OutputError::StandardOutput(error)) => {
                    console::lose(error);
                    Ok(())
                }
                other => other,
            },
        }
    }

    fn write_through<F>(&self, stream: impl Write, content: F) -> Result<(), OutputError>
    where
        F: FnOnce(&mut dyn Write) -> Result<(), OutputError>,
    {
        let mut writer = BufWriter::with_capacity(1 << 16, Patient(stream));
        content(&mut writer)?;
        writer.flush().map_err(|source| self.failed(source))
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// As [`Destination::write`].
    pub(crate) fn write_bytes(&self, bytes: &[u8]) -> Result<(), OutputError> {
        self.write_with(|writer| writer.write_all(bytes))
    }

    /// Writes content that fails with the writer alone.
    ///
    /// # Errors
    /// As [`Destination::write`].
    pub(crate) fn write_with(&self, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), OutputError> {
        self.write(|writer| content(writer).map_err(|source| self.failed(source)))
    }

    /// Writes CSV with a header. All rows have the header's length.
    ///
    /// # Errors
    /// As [`Destination::write`].
    pub(crate) fn write_csv<C: AsRef<str>>(
        &self,
        rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>,
    ) -> Result<(), OutputError> {
        self.write(|writer| write_rows(writer, rows).map_err(|source| self.failed(source)))
    }

    /// Writes CSV with a header, up to the first row that is an error.
    ///
    /// # Errors
    /// A row is an error, or [`Destination::write`] fails. A file is then as it was.
    pub(crate) fn write_checked_csv(
        &self,
        rows: impl IntoIterator<Item = Result<Vec<String>, OutputError>>,
    ) -> Result<(), OutputError> {
        self.write(|writer| write_checked_rows(writer, rows, |source| self.failed(source)))
    }

    fn failed(&self, source: io::Error) -> OutputError {
        match self {
            Self::StandardOutput => OutputError::StandardOutput(source),
            Self::Stream(path) | Self::File(path) => OutputError::write(path, source),
        }
    }
}

/// The destinations of a command, before it works. Standard output that carries a file takes no messages from here on.
///
/// # Errors
/// A path is a folder or cannot be written, or two paths lead to the same place.
pub(crate) fn destinations<const N: usize>(paths: [Option<&Path>; N]) -> Result<[Option<Destination>; N], OutputError> {
    let mut opened = [const { None }; N];
    for (number, path) in paths.iter().enumerate() {
        let Some(path) = path else { continue };
        let destination = Destination::at(path)?;
        if let Destination::File(target) = &destination {
            check_writable(target)?;
        }
        // A device takes any number of files.
        let once = !matches!(destination, Destination::Stream(_));
        let same = |earlier: &usize| once && opened[*earlier].as_ref() == Some(&destination);
        if let Some(earlier) = (0..number).find(same) {
            let earlier = paths[earlier].unwrap_or(path);
            return Err(OutputError::Twice(earlier.to_path_buf(), path.to_path_buf()));
        }
        opened[number] = Some(destination);
    }
    if opened.contains(&Some(Destination::StandardOutput)) {
        console::claim();
    }
    Ok(opened)
}

/// Whether further files can stand beside the file at `path`, which must be a regular file for this.
///
/// # Errors
/// As [`Destination::at`].
pub(crate) fn has_neighbours(path: &Path) -> Result<bool, OutputError> {
    Ok(matches!(Destination::at(path)?, Destination::File(_)))
}

/// The end of a chain of links.
enum LinkEnd {
    /// A path that is no link. There may be no file.
    Path(PathBuf),
    /// An open file of a process, such as `/dev/stdout` and `/dev/fd/3`, with its number if the process is this one, otherwise 0. The process holds
    /// the file itself, not its path, so the file must not be replaced.
    Descriptor(u32),
}

/// Follows links by hand, because a link whose target is missing cannot be resolved as a whole.
fn follow(path: &Path) -> io::Result<LinkEnd> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        if let Some(number) = descriptor(&path) {
            return Ok(LinkEnd::Descriptor(number));
        }
        match fs::read_link(&path) {
            Ok(link) => path = path.parent().unwrap_or(Path::new("")).join(link),
            Err(_) => return Ok(LinkEnd::Path(path)),
        }
    }
    Err(io::Error::other("too many links, one after the other"))
}

/// The number in [`LinkEnd::Descriptor`] of a path such as `/dev/fd/3` or `/proc/self/fd/3`.
fn descriptor(path: &Path) -> Option<u32> {
    let number = path.file_name()?.to_str()?.parse().ok()?;
    let folder = fs::canonicalize(path.parent()?).ok()?;
    let is = |other: &str| fs::canonicalize(other).is_ok_and(|other| other == folder);
    match ["/proc/self/fd", "/proc/thread-self/fd", "/dev/fd"].into_iter().any(is) {
        true => Some(number),
        false => (folder.starts_with("/proc") && folder.ends_with("fd")).then_some(0),
    }
}

/// Whether a path ends as only the path of a folder does.
fn names_a_folder(path: &Path) -> bool {
    let text = path.as_os_str().as_encoded_bytes();
    [&b"/"[..], b"/.", std::path::MAIN_SEPARATOR_STR.as_bytes()].into_iter().any(|end| text.ends_with(end))
}

/// Opens a stream, or a file that a process has open, for writing.
fn open_stream(path: &Path) -> io::Result<Box<dyn Write>> {
    let _waiting = Waiting::begin();
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if fs::metadata(path)?.file_type().is_socket() && descriptor(path).is_none() {
            return Ok(Box::new(std::os::unix::net::UnixStream::connect(path)?));
        }
    }
    // A regular file that a process has open may hold bytes of that process, so it is appended to.
    let file: File = match fs::metadata(path)?.is_file() {
        true => OpenOptions::new().append(true).open(path)?,
        false => OpenOptions::new().write(true).open(path)?,
    };
    Ok(Box::new(file))
}

#[cfg(all(test, unix))]
mod tests;
