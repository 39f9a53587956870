//! The folder of a data set, into which several processes may write at once.
//!
//! Each process has a folder of its own below `.isotherm`, in which it makes an orbit. A whole orbit moves to its place by one renaming. So an orbit
//! in its place is whole, and the folder looks alike whichever process made an orbit. A lock on a file in the process's folder lasts as long as the
//! process. A folder without it belongs to a process that was killed, and is removed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use serde_json::Value as Json;

use super::error::DatasetError;
use super::orbit_folder::{CHECKSUMS, OrbitFolder};
use crate::labels::image::Split;
use crate::labels::places;
use crate::output::OutputError;

/// The folder for isotherm's own records.
const HOME: &str = ".isotherm";
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
    root: PathBuf,
    work: PathBuf,
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
        let home = root.join(HOME);
        if root.exists() && !root.is_dir() {
            return Err(OutputError::NotAFolder(root.to_path_buf()).into());
        }
        fs::create_dir_all(root).map_err(|error| OutputError::CreateFolder(root.to_path_buf(), error))?;
        if begin == Begin::Force && home.join(IDENTITY).is_file() {
            clear(root)?;
        }
        if !home.join(IDENTITY).is_file() {
            let strangers = entries(root)?.into_iter().any(|path| path != home);
            if strangers {
                return Err(OutputError::FolderNotEmpty(root.to_path_buf()).into());
            }
        }
        let not_writable = |error: io::Error| OutputError::NotWritable(root.to_path_buf(), error);
        fs::create_dir_all(&home).map_err(not_writable)?;
        remove_dead(&home)?;
        let (work, lock) = work_folder(&home).map_err(not_writable)?;
        let store = Self { root: root.to_path_buf(), work, _lock: lock };
        let text = format!("{identity:#}\n");
        match fs::read_to_string(home.join(IDENTITY)) {
            Ok(there) => compare(root, &there, identity)?,
            Err(_) => store.write_to(&home.join(IDENTITY), text.as_bytes())?,
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
        &self.root
    }

    /// Whether an orbit is there, which is then whole.
    pub(crate) fn has(&self, split: Split, orbit: u32) -> bool {
        self.root.join(places::orbit(split, orbit)).is_dir()
    }

    /// Begins an orbit.
    ///
    /// # Errors
    /// A folder that can not be written.
    pub(crate) fn begin(&self, split: Split, orbit: u32) -> Result<OrbitFolder, DatasetError> {
        let path = self.work.join(format!("{orbit:06}"));
        let failed = |error| OutputError::CreateFolder(path.clone(), error);
        if path.exists() {
            fs::remove_dir_all(&path).map_err(failed)?;
        }
        fs::create_dir(&path).map_err(failed)?;
        Ok(OrbitFolder::new(&self.root, path, places::orbit(split, orbit)))
    }

    /// Puts a whole orbit in its place. Where another process was faster, that orbit stays, which has the same bytes.
    ///
    /// # Errors
    /// A folder that can not be written.
    pub(crate) fn commit(&self, mut folder: OrbitFolder) -> Result<(), DatasetError> {
        folder.write_list()?;
        let place = folder.place();
        let failed = |error| OutputError::write(&place, error);
        if let Some(split) = place.parent() {
            fs::create_dir_all(split).map_err(failed)?;
        }
        match fs::rename(folder.path(), &place) {
            Err(_) if place.is_dir() => fs::remove_dir_all(folder.path()).map_err(failed)?,
            renamed => renamed.map_err(failed)?,
        }
        Ok(())
    }

    /// Writes a file of the whole set. The file appears whole or not at all.
    ///
    /// # Errors
    /// A full disk, or a folder that can not be written.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), DatasetError> {
        self.write_to(&self.root.join(name), bytes)
    }

    fn write_to(&self, path: &Path, bytes: &[u8]) -> Result<(), DatasetError> {
        let failed = |error| OutputError::write(path, error);
        self.write_path(path, |writer| Ok(writer.write_all(bytes).map_err(failed)?))
    }

    fn write_path(
        &self,
        path: &Path,
        content: impl FnOnce(&mut dyn Write) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let failed = |error| OutputError::write(path, error);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(failed)?;
        }
        let part = self.work.join("part");
        let mut writer = io::BufWriter::with_capacity(1 << 16, File::create(&part).map_err(failed)?);
        content(&mut writer)?;
        writer.into_inner().map_err(|error| failed(error.into_error()))?;
        Ok(fs::rename(&part, path).map_err(failed)?)
    }

    /// Runs `work` while no other process does.
    ///
    /// # Errors
    /// An error of `work`, or a file that can not be locked.
    pub(crate) fn alone<T>(&self, work: impl FnOnce() -> Result<T, DatasetError>) -> Result<T, DatasetError> {
        let path = self.root.join(HOME).join(FINISH);
        let failed = |error| OutputError::write(&path, error);
        let file = File::create(&path).map_err(failed)?;
        file.lock().map_err(failed)?;
        work()
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        // A folder that can not be removed is left to the next process. A process that was killed when this one began may have ended since.
        let _ = fs::remove_dir_all(&self.work);
        let _ = remove_dead(&self.root.join(HOME));
    }
}

/// The identity of a data set, as it was begun.
///
/// # Errors
/// A folder without a data set.
pub(crate) fn identity(root: &Path) -> Result<Json, DatasetError> {
    let path = root.join(HOME).join(IDENTITY);
    let none = |reason: String| DatasetError::None { folder: root.to_path_buf(), reason };
    let text =
        fs::read_to_string(&path).map_err(|error| none(format!("{} can not be read: {error}", path.display())))?;
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

/// A new folder for this process, with its lock.
fn work_folder(home: &Path) -> io::Result<(PathBuf, File)> {
    let work = tempfile::Builder::new().prefix(WORK).tempdir_in(home)?.keep();
    // The file gets its name after it is locked, so nobody takes the folder for a dead process's.
    let begun = work.join("begun");
    let lock = File::create(&begun)?;
    lock.lock()?;
    fs::rename(&begun, work.join(LOCK))?;
    Ok((work, lock))
}

/// Removes the folders of processes that were killed.
fn remove_dead(home: &Path) -> Result<(), OutputError> {
    for path in entries(home)? {
        let is_work = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(WORK));
        // A folder without a lock file was made a moment ago, or its process was killed then. Such a folder is empty.
        let Some(lock) = is_work.then(|| File::open(path.join(LOCK)).ok()).flatten() else { continue };
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

/// Removes a data set: the files that its lists of checksums name, the lists and the reports.
fn clear(root: &Path) -> Result<(), OutputError> {
    let removed = |path: &Path, error| OutputError::Remove(path.to_path_buf(), error);
    let remove = |path: &Path| match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(removed(path, error)),
        _ => Ok(()),
    };
    let list = fs::read_to_string(root.join(CHECKSUMS)).unwrap_or_default();
    let named = list.lines().filter_map(|line| line.split_once("  ")).map(|(_, path)| Path::new(path));
    // A list from elsewhere may name files outside the folder, which are not of the data set.
    for path in named.filter(|path| path.components().all(|part| matches!(part, Component::Normal(_)))) {
        remove(&root.join(path))?;
    }
    for split in Split::ALL {
        for orbit in entries(&root.join(split.name())).unwrap_or_default() {
            if orbit.join(CHECKSUMS).is_file() {
                fs::remove_dir_all(&orbit).map_err(|error| removed(&orbit, error))?;
            }
        }
        let _ = fs::remove_dir(root.join(split.name()));
    }
    for path in entries(root)? {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if name == CHECKSUMS || name.starts_with(REPORT) {
            remove(&path)?;
        } else if path.is_dir() {
            // Only an empty folder goes.
            let _ = fs::remove_dir(&path);
        }
    }
    remove(&root.join(HOME).join(IDENTITY))
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
