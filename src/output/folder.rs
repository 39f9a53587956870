//! The output folder of a command: the names of its files, the files that it may overwrite, and its files, which appear whole or not at all.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use super::OutputError;
use super::csv_rows::{write_checked_rows, write_rows};
use super::guarded::{Access, GuardedFolder};
use super::inputs::real;
use super::manifest::{HOME, Listing, Manifest};
use super::temporary::Unfinished;
use super::whole_file::check_folder;

/// Prefix of unfinished files of a folder. Unfinished files lie beside the manifest.
const PART: &str = "part-";
/// The saved state of a run, beside the manifest.
pub(crate) const STATE: &str = ".isotherm/state";
/// The findings of a run's rays, beside its state.
pub(crate) const CASTS: &str = ".isotherm/casts";

/// The output folder of a command.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    /// Every file that the command may write: subfolder (empty for the root) and name pattern.
    patterns: Vec<(String, String)>,
    /// Whether the folder did not exist.
    fresh: bool,
    manifest: Option<Manifest>,
    /// The files of an earlier part of the same run.
    earlier: Listing,
    parts: AtomicU64,
    /// The folder, held open from its first use on.
    guarded: OnceLock<GuardedFolder>,
}

impl Folder {
    /// Describes a folder without touching it. `own` lists the command's files: `series.csv`, `plots/*.svg`, `frames/step_#.exr`. `*` stands for any
    /// characters, `#` for digits.
    pub fn new(root: &Path, patterns: &[impl AsRef<str>]) -> Self {
        let split = |pattern: &str| {
            pattern.rsplit_once('/').map_or((String::new(), pattern.to_owned()), |(a, b)| (a.into(), b.into()))
        };
        Self {
            root: root.to_path_buf(),
            patterns: patterns.iter().map(|pattern| split(pattern.as_ref())).collect(),
            fresh: !root.exists(),
            manifest: None,
            earlier: Listing::default(),
            parts: AtomicU64::new(0),
            guarded: OnceLock::new(),
        }
    }

    /// Creates the folder with its parents and subfolders, and locks it. Without `overwrite` it refuses a folder that holds anything. With `overwrite` it
    /// removes the files that the manifest lists and keeps all others. Three things are refused and stay untouched: a folder with files but without a
    /// manifest, a listed file that was changed, and a file of somebody else where the command would write.
    ///
    /// # Errors
    /// The folder is a file, another command writes into it, it is refused, it cannot be created or written, or holds one of the `inputs`.
    pub fn prepare(mut self, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        if self.root.exists() && !self.root.is_dir() {
            return Err(OutputError::NotAFolder(self.root));
        }
        if self.root.exists() {
            match Manifest::open(&self.root)? {
                Some((manifest, listing)) => {
                    self.keep_inputs(inputs)?;
                    if !overwrite && !self.is_empty()? {
                        return Err(OutputError::FolderNotEmpty(self.root));
                    }
                    self.clear(&listing)?;
                    manifest.begin()?;
                    self.manifest = Some(manifest);
                }
                None => {
                    self.keep_inputs(inputs)?;
                    if !self.is_empty()? {
                        let root = self.root;
                        return Err(match overwrite {
                            true => OutputError::NoManifest(root),
                            false => OutputError::FolderNotEmpty(root),
                        });
                    }
                }
            }
        }
        fs::create_dir_all(&self.root).map_err(|source| OutputError::CreateFolder(self.root.clone(), source))?;
        if self.manifest.is_none() {
            self.manifest = Some(Manifest::create(&self.root)?);
        }
        self.make_folders()?;
        Ok(self)
    }

    /// Locks a folder in which a run is to go on. Refuses files that are not as isotherm left them.
    ///
    /// # Errors
    /// No run was begun there, another command writes into it, or it is refused.
    pub(crate) fn reopen(mut self) -> Result<Self, OutputError> {
        if !self.root.is_dir() {
            return Err(OutputError::NoRun(self.root));
        }
        let Some((manifest, listing)) = Manifest::open(&self.root)? else { return Err(OutputError::NoRun(self.root)) };
        for path in listing.paths() {
            listing.verified(&self.root, path)?;
        }
        self.refuse_strangers(&listing)?;
        self.earlier = listing;
        self.manifest = Some(manifest);
        self.remove_parts()?;
        Ok(self)
    }

    /// Makes the subfolders of a folder that was reopened, in case the run was killed before it did.
    ///
    /// # Errors
    /// They cannot be written.
    pub(crate) fn make_folders(&self) -> Result<(), OutputError> {
        let guarded = self.guarded()?;
        for name in self.names_of_folders() {
            let path = self.root.join(name);
            if !name.is_empty() {
                guarded.make(name).map_err(|source| OutputError::CreateFolder(path.clone(), source))?;
            }
            // Permission bits do not show read-only mounts or quotas, so this tries to write.
            check_folder(&path).map_err(|source| OutputError::NotWritable(path, source))?;
        }
        Ok(())
    }

    /// The folder, held open. No link in it is followed.
    ///
    /// # Errors
    /// It cannot be opened.
    pub(crate) fn guarded(&self) -> Result<&GuardedFolder, OutputError> {
        if let Some(guarded) = self.guarded.get() {
            return Ok(guarded);
        }
        let opened = GuardedFolder::open(&self.root).map_err(|source| OutputError::Read(self.root.clone(), source))?;
        Ok(self.guarded.get_or_init(|| opened))
    }

    /// Whether the run in a reopened folder came to its end.
    pub(crate) fn is_finished(&self) -> bool {
        self.earlier.finished
    }

    /// Path of the saved state of a run.
    pub(crate) fn state(&self) -> PathBuf {
        self.root.join(STATE)
    }

    /// Notes that the command came to its end, and removes the saved state with the file beside it.
    ///
    /// # Errors
    /// The manifest cannot be written.
    pub(crate) fn finish(&self) -> Result<(), OutputError> {
        if let Some(manifest) = &self.manifest {
            manifest.finish()?;
        }
        self.remove_state()
    }

    fn remove_state(&self) -> Result<(), OutputError> {
        [STATE, CASTS].iter().try_for_each(|name| self.remove(&self.file(name)))
    }

    /// Whether the folder holds nothing but an own folder without files of the user.
    fn is_empty(&self) -> Result<bool, OutputError> {
        Ok(entries(&self.root)?.iter().all(|path| *path == self.root.join(HOME)))
    }

    /// Removes the files of a listing, after a look at all of them.
    fn clear(&self, listing: &Listing) -> Result<(), OutputError> {
        let files = listing.paths().filter_map(|path| listing.verified(&self.root, path).transpose());
        let files = files.collect::<Result<Vec<_>, _>>()?;
        self.refuse_strangers(listing)?;
        for path in &files {
            self.remove(path)?;
        }
        for folder in files.iter().filter_map(|path| path.parent()).filter(|folder| *folder != self.root) {
            // This fails for a folder with files in it, which then stays.
            let _ = fs::remove_dir(folder);
        }
        self.remove_state()?;
        self.remove_parts()
    }

    /// Removes a file of the folder. There may be none.
    fn remove(&self, path: &Path) -> Result<(), OutputError> {
        let name = path.strip_prefix(&self.root).unwrap_or(path).to_string_lossy();
        match self.guarded()?.remove(&name) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(OutputError::Remove(path.to_path_buf(), error))
            }
            _ => Ok(()),
        }
    }

    /// Removes the unfinished files that a killed process left beside its manifest.
    fn remove_parts(&self) -> Result<(), OutputError> {
        let parts = entries(&self.root.join(HOME))?.into_iter().filter(|path| name_of(path).starts_with(PART));
        parts.filter(|path| !path.is_dir()).try_for_each(|path| self.remove(&path))
    }

    /// Refuses a file that the listing does not have where the command would write, and a link in place of a subfolder.
    fn refuse_strangers(&self, listing: &Listing) -> Result<(), OutputError> {
        for (name, folder) in self.names_of_folders().into_iter().map(|name| (name, self.root.join(name))) {
            match fs::symlink_metadata(&folder) {
                Err(_) => continue,
                Ok(metadata) if name.is_empty() || metadata.is_dir() => {}
                Ok(metadata) if metadata.is_symlink() => return Err(OutputError::Link(folder)),
                Ok(_) => return Err(OutputError::Stranger(folder)),
            }
            for path in self.own_in(name)? {
                let short = path.strip_prefix(&self.root).unwrap_or(&path).to_string_lossy().into_owned();
                if !listing.has(&short) {
                    return Err(OutputError::Stranger(path));
                }
            }
        }
        Ok(())
    }

    /// Refuses to replace or remove one of these input files, even if its path is written differently.
    ///
    /// # Errors
    /// [`OutputError::Overwrites`].
    pub(crate) fn keep_inputs(&self, inputs: &[PathBuf]) -> Result<(), OutputError> {
        let mut written = Vec::new();
        for name in self.names_of_folders() {
            written.extend(self.own_in(name)?.iter().map(|path| real(path)));
        }
        match inputs.iter().find(|input| written.contains(&real(input))) {
            Some(input) => Err(OutputError::Overwrites(input.clone())),
            None => Ok(()),
        }
    }

    /// Removes the folders that [`Folder::prepare`] created, if nothing was written to them.
    pub(crate) fn take_back(&self) {
        for folder in self.folders().iter().filter(|folder| **folder != self.root) {
            // This fails for a folder with files in it, which then stays.
            let _ = fs::remove_dir(folder);
        }
        // Beside files of the user the manifest stays, because without it the folder would be refused next time.
        if let (Some(manifest), Ok(true)) = (&self.manifest, self.is_empty()) {
            manifest.remove();
        }
        if self.fresh {
            let _ = fs::remove_dir(&self.root);
        }
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Path of a file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Writes a file. The file appears whole or not at all, and the manifest lists it beforehand.
    ///
    /// # Errors
    /// `content` fails, a file of somebody else is in its place, or the disk is full.
    pub(crate) fn write<F>(&self, name: &str, content: F) -> Result<(), OutputError>
    where
        F: FnOnce(&mut dyn Write) -> Result<(), OutputError>,
    {
        let path = self.place_for(name)?;
        let failed = |source| OutputError::write(&path, source);
        let guarded = self.guarded()?;
        let part = format!("{HOME}/{PART}{}", self.parts.fetch_add(1, Ordering::Relaxed));
        let _unfinished = Unfinished::new(&self.root.join(&part));
        let written = (|| {
            let file = guarded.file(&part, Access::New).map_err(failed)?;
            let mut writer = BufWriter::with_capacity(1 << 16, file);
            content(&mut writer)?;
            let file = writer.into_inner().map_err(|error| failed(error.into_error()))?;
            if let Some(manifest) = &self.manifest {
                manifest.note(name, &file.metadata().map_err(failed)?)?;
            }
            drop(file);
            guarded.rename(&part, name).map_err(failed)
        })();
        if written.is_err() {
            let _ = guarded.remove(&part);
        }
        written
    }

    /// Writes bytes as [`Folder::write`] does.
    ///
    /// # Errors
    /// As [`Folder::write`].
    pub(crate) fn write_bytes(&self, name: &str, bytes: &[u8]) -> Result<(), OutputError> {
        self.write(name, |writer| {
            writer.write_all(bytes).map_err(|source| OutputError::write(&self.file(name), source))
        })
    }

    /// Writes a CSV file with a header as [`Folder::write`] does. All rows have the header's length.
    ///
    /// # Errors
    /// As [`Folder::write`].
    pub(crate) fn write_csv<C: AsRef<str>>(
        &self,
        name: &str,
        rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>,
    ) -> Result<(), OutputError> {
        self.write(name, |writer| {
            write_rows(writer, rows).map_err(|source| OutputError::write(&self.file(name), source))
        })
    }

    /// Writes a CSV file with a header, up to the first row that is an error. The file is then as it was.
    ///
    /// # Errors
    /// A row is an error, or [`Folder::write`] fails.
    pub(crate) fn write_checked_csv(
        &self,
        name: &str,
        rows: impl IntoIterator<Item = Result<Vec<String>, OutputError>>,
    ) -> Result<(), OutputError> {
        self.write(name, |writer| {
            write_checked_rows(writer, rows, |source| OutputError::write(&self.file(name), source))
        })
    }

    /// Writes a structure as JSON as [`Folder::write`] does. Numbers that are not finite become `null`.
    ///
    /// # Errors
    /// As [`Folder::write`].
    pub(crate) fn write_json(&self, name: &str, value: &impl serde::Serialize) -> Result<(), OutputError> {
        let json =
            serde_json::to_string_pretty(value).map_err(|error| OutputError::write(&self.file(name), error.into()))?;
        self.write_bytes(name, format!("{json}\n").as_bytes())
    }

    /// The path of a file that is to be written, after a look for links and files of somebody else.
    pub(super) fn place_for(&self, name: &str) -> Result<PathBuf, OutputError> {
        let path = self.file(name);
        if let Some(parent) = path.parent().filter(|parent| *parent != self.root)
            && fs::symlink_metadata(parent).is_ok_and(|metadata| metadata.is_symlink())
        {
            return Err(OutputError::Link(parent.to_path_buf()));
        }
        match fs::symlink_metadata(&path) {
            Ok(metadata) if !self.earlier.has(name) || !metadata.is_file() => Err(OutputError::Stranger(path)),
            _ => Ok(path),
        }
    }

    /// The manifest of a folder that was prepared.
    pub(super) fn manifest(&self) -> Option<&Manifest> {
        self.manifest.as_ref()
    }

    fn names_of_folders(&self) -> Vec<&str> {
        let mut names = vec![""];
        for (folder, _) in &self.patterns {
            if !names.contains(&folder.as_str()) {
                names.push(folder);
            }
        }
        names
    }

    fn folders(&self) -> Vec<PathBuf> {
        self.names_of_folders().into_iter().map(|name| self.root.join(name)).collect()
    }

    /// The paths in a subfolder that have names of the command's own files.
    fn own_in(&self, folder: &str) -> Result<Vec<PathBuf>, OutputError> {
        let path = self.root.join(folder);
        if !path.is_dir() {
            return Ok(Vec::new());
        }
        let mut written = entries(&path)?;
        written.retain(|path| {
            let mut patterns = self.patterns.iter().filter(|(name, _)| name == folder);
            patterns.any(|(_, pattern)| matches(pattern.as_bytes(), name_of(path).as_bytes()))
        });
        Ok(written)
    }
}

/// Whether a name fits a pattern with `*` for any characters and `#` for digits.
fn matches(pattern: &[u8], name: &[u8]) -> bool {
    match pattern.split_first() {
        None => name.is_empty(),
        Some((b'*', rest)) => (0..=name.len()).any(|taken| matches(rest, &name[taken..])),
        Some((b'#', rest)) => {
            let digits = name.iter().take_while(|byte| byte.is_ascii_digit()).count();
            digits > 0 && matches(rest, &name[digits..])
        }
        Some((byte, rest)) => name.first() == Some(byte) && matches(rest, &name[1..]),
    }
}

/// Removes a file that may be absent.
fn name_of(path: &Path) -> &str {
    path.file_name().and_then(OsStr::to_str).unwrap_or_default()
}

/// Paths in a folder, sorted by name.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let read = |source| OutputError::Read(folder.to_path_buf(), source);
    let mut paths = fs::read_dir(folder)
        .and_then(|list| list.map(|entry| entry.map(|e| e.path())).collect::<io::Result<Vec<_>>>())
        .map_err(read)?;
    paths.sort();
    Ok(paths)
}

#[cfg(test)]
mod tests;
