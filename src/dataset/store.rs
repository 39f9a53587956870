//! The folder of a data set, into which several processes may write at once.
//!
//! Each process has a folder of its own below `.isotherm`, in which it makes an orbit. A whole orbit moves to its place by one renaming. So an orbit
//! in its place is whole, and the folder looks alike whichever process made an orbit. A lock on a file in the process's folder lasts as long as the
//! process. A folder without it belongs to a process that was killed, and is removed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::Value as Json;

use super::error::DatasetError;
use super::orbit_folder::{CHECKSUMS, OrbitFolder};
use crate::labels::image::Split;
use crate::labels::places;
use crate::output::OutputError;
use crate::output::guarded::{Access, GuardedFolder, Kind};

/// The folder for isotherm's own records.
pub(super) const HOME: &str = ".isotherm";
/// The file with the identity of the data set.
const IDENTITY: &str = "dataset.json";
/// Start of the names of the processes' folders.
const WORK: &str = "work-";
/// The file that a process locks in its folder.
const LOCK: &str = "lock";
/// The file that is locked while the files of the whole set are written.
const FINISH: &str = "finish.lock";

/// Start of the names of reports, which no checksum covers.
pub(crate) const REPORT: &str = "report-";

/// The treatment of orbits that a folder holds already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Begin {
    /// No orbit of this shard may be there.
    Fresh,
    /// Orbits that are there are kept.
    Resume,
    /// The data set that is there is removed.
    Force,
}

#[derive(Debug)]
pub(crate) struct Store {
    guarded: Arc<GuardedFolder>,
    /// The folder of this process, within the data set's.
    work: String,
    // The lock ends with the file.
    _lock: File,
}

impl Store {
    /// Opens or makes the folder of a data set with this identity. `own` are the orbits of this process.
    ///
    /// # Errors
    /// A folder with other files, another data set or orbits of this process, or one that can not be written.
    pub(crate) fn open(
        root: &Path,
        identity: &Json,
        begin: Begin,
        orbits: &mut dyn Iterator<Item = (Split, u32)>,
    ) -> Result<Self, DatasetError> {
        if root.exists() && !root.is_dir() {
            return Err(OutputError::NotAFolder(root.to_path_buf()).into());
        }
        fs::create_dir_all(root).map_err(|error| OutputError::CreateFolder(root.to_path_buf(), error))?;
        let not_writable = |error: io::Error| OutputError::NotWritable(root.to_path_buf(), error);
        let guarded = Arc::new(GuardedFolder::open(root).map_err(not_writable)?);
        let home = root.join(HOME);
        let is_begun = || is_file(&guarded, &format!("{HOME}/{IDENTITY}"));
        if begin == Begin::Force && is_begun()? {
            clear(&guarded)?;
        }
        if !is_begun()? {
            let strangers = entries(root)?.into_iter().any(|path| path != home);
            if strangers {
                return Err(OutputError::FolderNotEmpty(root.to_path_buf()).into());
            }
        }
        guarded.make(HOME).map_err(not_writable)?;
        remove_dead(&guarded)?;
        let (work, lock) = work_folder(&guarded).map_err(not_writable)?;
        let store = Self { guarded, work, _lock: lock };
        let text = format!("{identity:#}\n");
        let path = format!("{HOME}/{IDENTITY}");
        match store.guarded.read_text(&path) {
            Ok(there) => compare(root, &there, identity)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => store.write(&path, text.as_bytes())?,
            Err(error) => return Err(OutputError::Read(root.join(path), error).into()),
        }
        if begin == Begin::Fresh {
            let count = orbits.filter(|(split, orbit)| store.has(*split, *orbit)).count();
            if count > 0 {
                return Err(DatasetError::Begun { folder: root.to_path_buf(), count });
            }
        }
        Ok(store)
    }

    pub(crate) fn root(&self) -> &Path {
        self.guarded.root()
    }

    /// The folder, held open.
    pub(crate) fn guarded(&self) -> &GuardedFolder {
        &self.guarded
    }

    /// Whether an orbit is there, which is then whole.
    pub(crate) fn has(&self, split: Split, orbit: u32) -> bool {
        matches!(self.guarded.kind(&places::orbit(split, orbit)), Ok(Some(Kind::Folder)))
    }

    /// Whether the files of the whole set are there.
    ///
    /// # Errors
    /// A link in their place.
    pub(crate) fn is_finished(&self) -> Result<bool, DatasetError> {
        Ok(is_file(&self.guarded, CHECKSUMS)?)
    }

    /// Begins an orbit.
    ///
    /// # Errors
    /// A folder that can not be written.
    pub(crate) fn begin(&self, split: Split, orbit: u32) -> Result<OrbitFolder, DatasetError> {
        let name = format!("{}/{orbit:06}", self.work);
        let path = self.root().join(&name);
        let failed = |error| OutputError::CreateFolder(path.clone(), error);
        if path.exists() {
            fs::remove_dir_all(&path).map_err(failed)?;
        }
        self.guarded.make(&name).map_err(failed)?;
        Ok(OrbitFolder::new(Arc::clone(&self.guarded), name, places::orbit(split, orbit)))
    }

    /// Puts a whole orbit in its place. Where another process was faster, that orbit stays, which has the same bytes.
    ///
    /// # Errors
    /// A folder that can not be written.
    pub(crate) fn commit(&self, mut folder: OrbitFolder) -> Result<(), DatasetError> {
        folder.write_list()?;
        let place = self.root().join(folder.place());
        let failed = |error| OutputError::write(&place, error);
        match self.guarded.rename(folder.path(), folder.place()) {
            Err(_) if matches!(self.guarded.kind(folder.place()), Ok(Some(Kind::Folder))) => {
                fs::remove_dir_all(self.root().join(folder.path())).map_err(failed)?;
            }
            renamed => renamed.map_err(failed)?,
        }
        Ok(())
    }

    /// Writes a file of the whole set. The file appears whole or not at all.
    ///
    /// # Errors
    /// A full disk, or a folder that can not be written.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), DatasetError> {
        let part = format!("{}/part", self.work);
        let written = self.guarded.file(&part, Access::Anew).and_then(|mut file| {
            file.write_all(bytes)?;
            drop(file);
            self.guarded.rename(&part, name)
        });
        Ok(written.map_err(|error| OutputError::write(&self.root().join(name), error))?)
    }

    /// Runs `work` while no other process does.
    ///
    /// # Errors
    /// An error of `work`, or a file that can not be locked.
    pub(crate) fn alone<T>(&self, work: impl FnOnce() -> Result<T, DatasetError>) -> Result<T, DatasetError> {
        let path = format!("{HOME}/{FINISH}");
        let failed = |error| OutputError::write(&self.root().join(&path), error);
        let file = self.guarded.file(&path, Access::Anew).map_err(failed)?;
        file.lock().map_err(failed)?;
        work()
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // A folder that can not be removed is left to the next process. A process that was killed when this one began may have ended since.
        let _ = fs::remove_dir_all(self.root().join(&self.work));
        let _ = remove_dead(&self.guarded);
    }
}

/// The identity of a data set, as it was begun.
///
/// # Errors
/// A folder without a data set.
pub(crate) fn identity(root: &Path) -> Result<Json, DatasetError> {
    let path = root.join(HOME).join(IDENTITY);
    let none = |reason: String| DatasetError::None { folder: root.to_path_buf(), reason };
    let read = GuardedFolder::open(root).and_then(|set| set.read_text(&format!("{HOME}/{IDENTITY}")));
    let text = read.map_err(|error| none(format!("{} can not be read: {error}", path.display())))?;
    serde_json::from_str(&text).map_err(|error| none(format!("{} is damaged: {error}", path.display())))
}

/// Keys of the identity in which two processes must agree, and their words for users.
const AGREE: [(&str, &str); 4] = [
    ("spec_sha256", "SPEC"),
    ("scene_sha256", "scene or model"),
    ("device", "device"),
    ("version", "version of isotherm"),
];

fn compare(root: &Path, there: &str, identity: &Json) -> Result<(), DatasetError> {
    let there: Json = serde_json::from_str(there).unwrap_or_default();
    let other = AGREE.iter().find(|(key, _)| there.get(*key) != identity.get(*key));
    match other {
        Some((_, what)) => Err(DatasetError::Other { folder: root.to_path_buf(), what: (*what).to_owned() }),
        None => Ok(()),
    }
}

/// Whether a file stands at a path.
fn is_file(guarded: &GuardedFolder, path: &str) -> Result<bool, OutputError> {
    match guarded.kind(path) {
        Ok(kind) => Ok(kind == Some(Kind::File)),
        Err(error) => Err(OutputError::Read(guarded.root().join(path), error)),
    }
}

/// A new folder for this process, with its lock.
fn work_folder(guarded: &GuardedFolder) -> io::Result<(String, File)> {
    // Processes of several computers may write, and one process may have several data sets.
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let work = format!("{HOME}/{WORK}{:x}-{:x}", std::process::id(), since.as_nanos());
    // The file gets its name after it is locked, so nobody takes the folder for a dead process's.
    let begun = format!("{work}/begun");
    let lock = guarded.file(&begun, Access::New)?;
    lock.lock()?;
    guarded.rename(&begun, &format!("{work}/{LOCK}"))?;
    Ok((work, lock))
}

/// Removes the folders of processes that were killed.
fn remove_dead(guarded: &GuardedFolder) -> Result<(), OutputError> {
    for path in entries(&guarded.root().join(HOME))? {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        // A folder without a lock file was made a moment ago, or its process was killed then. Such a folder is empty.
        let lock = || guarded.file(&format!("{HOME}/{name}/{LOCK}"), Access::Read).ok();
        let Some(lock) = name.starts_with(WORK).then(lock).flatten() else { continue };
        if matches!(lock.try_lock(), Err(TryLockError::WouldBlock)) {
            continue;
        }
        match fs::remove_dir_all(&path) {
            // Another process was faster.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            removed => removed.map_err(|error| OutputError::Remove(path.clone(), error))?,
        }
    }
    Ok(())
}

/// Removes a data set: the files that its lists of checksums name, the lists and the reports. Files behind a link stay.
fn clear(guarded: &GuardedFolder) -> Result<(), OutputError> {
    let root = guarded.root();
    let removed = |path: &str, error| OutputError::Remove(root.join(path), error);
    let remove = |path: &str| match guarded.remove(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(removed(path, error)),
        _ => Ok(()),
    };
    let list = guarded.read_text(CHECKSUMS).unwrap_or_default();
    for (_, path) in list.lines().filter_map(|line| line.split_once("  ")) {
        // A list from elsewhere may name files outside the folder, which are not of the data set.
        match guarded.remove(path) {
            Err(error) if !matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::InvalidInput) => {
                return Err(removed(path, error));
            }
            _ => {}
        }
    }
    for split in Split::ALL {
        let name = split.name();
        if matches!(guarded.kind(name), Ok(Some(Kind::Folder))) {
            for orbit in entries(&root.join(name)).unwrap_or_default() {
                if !orbit.is_symlink() && orbit.join(CHECKSUMS).is_file() {
                    fs::remove_dir_all(&orbit).map_err(|error| OutputError::Remove(orbit.clone(), error))?;
                }
            }
        }
        let _ = fs::remove_dir(root.join(name));
    }
    for path in entries(root)? {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if name == CHECKSUMS || name.starts_with(REPORT) {
            remove(&name)?;
        } else if path.is_dir() && !path.is_symlink() {
            // Only an empty folder goes.
            let _ = fs::remove_dir(&path);
        }
    }
    remove(&format!("{HOME}/{IDENTITY}"))
}

/// Paths in a folder, sorted.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let read = |source| OutputError::Read(folder.to_path_buf(), source);
    let mut paths = fs::read_dir(folder)
        .and_then(|list| list.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>())
        .map_err(read)?;
    paths.sort();
    Ok(paths)
}
