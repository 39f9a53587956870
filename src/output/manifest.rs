//! The manifest of an output folder: a journal of the files that isotherm wrote into it, and the lock that keeps a second run out.
//!
//! The file is `.isotherm/manifest` in the folder, with one JSON object a line. A line stands in it before its file does, so the list is right after
//! a kill at any moment. A growing file has one line of fixed length, which is written over: its length so far, and the length that the write under
//! way leaves. The system releases the lock when the process ends, however it ends.

use std::collections::BTreeMap;
use std::fs::{self, File, Metadata, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::OutputError;
use super::guarded::{Access, GuardedFolder};

/// The folder for isotherm's own records in an output folder.
pub(crate) const HOME: &str = ".isotherm";
const NAME: &str = "manifest";
/// Time for which a locked folder is asked again: a process that was killed gives back its memory first, and its locks after that.
const DYING: Duration = Duration::from_secs(1);
const HEAD: &str = "{\"isotherm\":\"manifest\",\"version\":1}\n";

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(expecting = "struct Entry")]
struct JournalLine {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    isotherm: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    version: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    grows: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bytes: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    to: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    modified_ns: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    finished: Option<bool>,
}

/// The state of a file by its last line in the manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Known {
    /// The file was written whole.
    Whole { bytes: u64, modified_ns: u128 },
    /// The file grows from a length to another.
    Grows { from: u64, to: u64, modified_ns: u128 },
}

impl Known {
    fn is(&self, metadata: &Metadata) -> bool {
        let time = modified_ns(metadata);
        match *self {
            Self::Whole { bytes, modified_ns } => metadata.len() == bytes && time == modified_ns,
            Self::Grows { from, to, modified_ns } if from == to => metadata.len() == to && time == modified_ns,
            // The process was killed within a write.
            Self::Grows { from, to, modified_ns } => (from..=to).contains(&metadata.len()) && time >= modified_ns,
        }
    }
}

/// All files of a manifest.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Listing {
    files: BTreeMap<String, Vec<Known>>,
    /// Whether the command that wrote them came to its end.
    pub(crate) finished: bool,
}

impl Listing {
    /// Paths relative to the folder.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    pub(crate) fn has(&self, path: &str) -> bool {
        self.files.contains_key(path)
    }

    /// The listed file at a path below `root`, where it is there. Refuses a file that is not as isotherm left it, and a path that leads through a link.
    ///
    /// # Errors
    /// [`OutputError::Changed`] or [`OutputError::Link`].
    pub(crate) fn verified(&self, root: &Path, path: &str) -> Result<Option<PathBuf>, OutputError> {
        let full = root.join(path);
        let mut at = root.to_path_buf();
        let mut parts = Path::new(path).components().peekable();
        while let Some(part) = parts.next() {
            let Component::Normal(name) = part else { return Err(OutputError::Manifest(root.into(), path.into())) };
            at.push(name);
            let metadata = match fs::symlink_metadata(&at) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
                Err(error) => return Err(OutputError::Read(at, error)),
                Ok(metadata) => metadata,
            };
            if metadata.is_symlink() {
                return Err(OutputError::Link(at));
            }
            if parts.peek().is_none() {
                let known =
                    self.files.get(path).into_iter().flatten().any(|known| metadata.is_file() && known.is(&metadata));
                return if known { Ok(Some(full)) } else { Err(OutputError::Changed(full)) };
            }
            if !metadata.is_dir() {
                return Err(OutputError::Changed(at));
            }
        }
        Err(OutputError::Manifest(root.into(), path.into()))
    }
}

/// Modification time of a file [ns since 1970].
fn modified_ns(metadata: &Metadata) -> u128 {
    let time = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
    time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos())
}

/// A manifest that this process has locked.
#[derive(Debug)]
pub(crate) struct Manifest {
    path: PathBuf,
    journal: Mutex<Journal>,
}

#[derive(Debug)]
struct Journal {
    file: File,
    end: u64,
}

/// Place of a growing file's line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinePlace(u64);

impl Manifest {
    /// Locks the manifest of a folder. `None` where it has none.
    ///
    /// # Errors
    /// Another process has locked it, it is a link, or it cannot be read.
    pub(crate) fn open(root: &Path) -> Result<Option<(Self, Listing)>, OutputError> {
        let (home, path) = (root.join(HOME), root.join(HOME).join(NAME));
        for (part, is_home) in [(&home, true), (&path, false)] {
            match fs::symlink_metadata(part) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
                Err(error) => return Err(OutputError::Read(part.clone(), error)),
                Ok(metadata) if metadata.is_symlink() => return Err(OutputError::Link(part.clone())),
                Ok(metadata) if !is_home && !metadata.is_file() => return Err(OutputError::Changed(part.clone())),
                Ok(_) => {}
            }
        }
        let read = |source| OutputError::Read(path.clone(), source);
        let guarded = GuardedFolder::open(root).map_err(read)?;
        let file = match guarded.file(&format!("{HOME}/{NAME}"), Access::Change) {
            // The file was taken away in this moment.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            opened => opened.map_err(read)?,
        };
        let mut manifest = Self::locked(root, path.clone(), file)?;
        let listing = manifest.read(root)?;
        Ok(Some((manifest, listing)))
    }

    /// Makes the manifest of a folder and locks it.
    ///
    /// # Errors
    /// Another process did so in this moment, or it cannot be written.
    pub(crate) fn create(root: &Path) -> Result<Self, OutputError> {
        let path = root.join(HOME).join(NAME);
        let failed = |source| OutputError::NotWritable(root.to_path_buf(), source);
        let guarded = GuardedFolder::open(root).map_err(failed)?;
        let file = match guarded.file(&format!("{HOME}/{NAME}"), Access::New) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                return Err(OutputError::InUse(root.to_path_buf()));
            }
            made => made.map_err(failed)?,
        };
        let manifest = Self::locked(root, path, file)?;
        manifest.begin()?;
        Ok(manifest)
    }

    fn locked(root: &Path, path: PathBuf, file: File) -> Result<Self, OutputError> {
        let asked = Instant::now();
        let locked = loop {
            match file.try_lock() {
                Err(TryLockError::WouldBlock) if asked.elapsed() < DYING => std::thread::sleep(DYING / 20),
                other => break other,
            }
        };
        match locked {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(OutputError::InUse(root.to_path_buf())),
            Err(TryLockError::Error(source)) => return Err(OutputError::NotWritable(path, source)),
        }
        // The process that had the lock may have taken the file away.
        if !is_at(&file, &path) {
            return Err(OutputError::InUse(root.to_path_buf()));
        }
        Ok(Self { path, journal: Mutex::new(Journal { file, end: 0 }) })
    }

    /// Reads the journal. A last line without an end was not written whole, so its file does not stand yet.
    fn read(&mut self, root: &Path) -> Result<Listing, OutputError> {
        let journal = self.journal.get_mut().unwrap_or_else(PoisonError::into_inner);
        let mut text = Vec::new();
        journal.file.read_to_end(&mut text).map_err(|source| OutputError::Read(self.path.clone(), source))?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        journal.end = whole as u64;
        let mut listing = Listing::default();
        for line in text[..whole].split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
            let bad = || OutputError::Manifest(root.to_path_buf(), String::from_utf8_lossy(line).into_owned());
            let entry: JournalLine = serde_json::from_slice(line).map_err(|_| bad())?;
            let number = |text: &Option<String>| text.as_ref().and_then(|text| text.trim().parse::<u128>().ok());
            let size = |text: &Option<String>| number(text).and_then(|size| u64::try_from(size).ok());
            match (entry.file, entry.grows, entry.finished, entry.version) {
                (Some(path), ..) => {
                    let (bytes, modified_ns) = size(&entry.bytes).zip(number(&entry.modified_ns)).ok_or_else(bad)?;
                    listing.files.entry(path).or_default().push(Known::Whole { bytes, modified_ns });
                }
                (_, Some(path), ..) => {
                    let (from, to) = size(&entry.bytes).zip(size(&entry.to)).ok_or_else(bad)?;
                    let modified_ns = number(&entry.modified_ns).ok_or_else(bad)?;
                    let known = listing.files.entry(path).or_default();
                    known.retain(|known| matches!(known, Known::Whole { .. }));
                    known.push(Known::Grows { from, to, modified_ns });
                }
                (_, _, Some(finished), _) => listing.finished = finished,
                (_, _, _, Some(1)) => {}
                _ => return Err(bad()),
            }
        }
        Ok(listing)
    }

    /// Empties the manifest.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn begin(&self) -> Result<(), OutputError> {
        self.with(|journal| {
            journal.file.set_len(0)?;
            journal.end = 0;
            journal.append(HEAD)
        })
        .map(|_| ())
    }

    /// Notes a file that will stand at a path in a moment.
    ///
    /// # Errors
    /// The manifest cannot be written.
    pub(crate) fn note(&self, path: &str, metadata: &Metadata) -> Result<(), OutputError> {
        let entry = JournalLine {
            file: Some(path.to_owned()),
            bytes: Some(metadata.len().to_string()),
            modified_ns: Some(modified_ns(metadata).to_string()),
            ..JournalLine::default()
        };
        self.append(&entry).map(|_| ())
    }

    /// Notes a growing file that is being begun or cut, with a length between two bounds.
    ///
    /// # Errors
    /// The manifest cannot be written.
    pub(crate) fn note_growing(&self, path: &str, [from, to]: [u64; 2]) -> Result<LinePlace, OutputError> {
        // Two lengths tell that a write is under way, which has no time yet.
        self.append(&growing(path, from, to.max(from + 1), 0)).map(LinePlace)
    }

    /// Notes the length of a growing file, and the length that the write to come leaves. `found` is the file as it is.
    ///
    /// # Errors
    /// The manifest cannot be written.
    pub(crate) fn note_growth(
        &self,
        place: LinePlace,
        path: &str,
        [from, to]: [u64; 2],
        metadata: &Metadata,
    ) -> Result<(), OutputError> {
        let line = line(&growing(path, from, to, modified_ns(metadata)));
        self.with(|journal| {
            journal.file.seek(SeekFrom::Start(place.0))?;
            journal.file.write_all(line.as_bytes())?;
            Ok(place.0)
        })
        .map(|_| ())
    }

    /// Notes that the command came to its end.
    ///
    /// # Errors
    /// The manifest cannot be written.
    pub(crate) fn finish(&self) -> Result<(), OutputError> {
        self.append(&JournalLine { finished: Some(true), ..JournalLine::default() }).map(|_| ())
    }

    /// Removes the manifest. The lock holds until this is dropped.
    pub(crate) fn remove(&self) {
        let _ = fs::remove_file(&self.path);
        if let Some(home) = self.path.parent() {
            // This fails for a folder with files in it, which then stays.
            let _ = fs::remove_dir(home);
        }
    }

    fn append(&self, entry: &JournalLine) -> Result<u64, OutputError> {
        self.with(|journal| journal.append(&line(entry)))
    }

    fn with(&self, work: impl FnOnce(&mut Journal) -> io::Result<u64>) -> Result<u64, OutputError> {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        work(&mut journal).map_err(|source| OutputError::write(&self.path, source))
    }
}

impl Journal {
    /// Adds a line. Returns where it begins.
    fn append(&mut self, line: &str) -> io::Result<u64> {
        let at = self.end;
        self.file.seek(SeekFrom::Start(at))?;
        if let Err(error) = self.file.write_all(line.as_bytes()) {
            // Half a line would spoil the next line.
            let _ = self.file.set_len(at);
            return Err(error);
        }
        self.end = at + line.len() as u64;
        Ok(at)
    }
}

/// The line of a growing file. The length of the line does not depend on the numbers.
fn growing(path: &str, from: u64, to: u64, modified_ns: u128) -> JournalLine {
    JournalLine {
        grows: Some(path.to_owned()),
        bytes: Some(format!("{from:20}")),
        to: Some(format!("{to:20}")),
        modified_ns: Some(format!("{modified_ns:20}")),
        ..JournalLine::default()
    }
}

fn line(entry: &JournalLine) -> String {
    // An entry has strings and flags only, which JSON always holds.
    format!("{}\n", serde_json::to_string(entry).unwrap_or_default())
}

/// Whether a path still names an open file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let same = |a: &Metadata, b: &Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    matches!((file.metadata(), fs::symlink_metadata(path)), (Ok(a), Ok(b)) if same(&a, &b))
}

#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.exists()
}
