//! The output folder: file names, overwrite rules, and files that appear whole or not at all.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use wildmatch::WildMatch;

use super::OutputError;

/// Prefix of unfinished files. A killed process may leave one, and the next `--force` removes it.
const TEMPORARY_PREFIX: &str = ".isotherm-";

/// The output folder of a command.
#[derive(Debug, Clone)]
pub struct Folder {
    root: PathBuf,
    /// Every file that the command may write: subfolder (empty for the root) and name pattern.
    own: Vec<(String, WildMatch)>,
    /// Whether the folder did not exist.
    fresh: bool,
}

impl Folder {
    /// Describes a folder without touching it. `own` lists the command's files: `series.csv`, `plots/*.svg`.
    pub fn new(root: &Path, own: &[impl AsRef<str>]) -> Self {
        let split =
            |own: &str| own.rsplit_once('/').map_or((String::new(), own.to_owned()), |(a, b)| (a.into(), b.into()));
        let own = own.iter().map(|own| split(own.as_ref())).map(|(folder, name)| (folder, WildMatch::new(&name)));
        Self { root: root.to_path_buf(), own: own.collect(), fresh: !root.exists() }
    }

    /// Creates the folder with its parents and subfolders. Without `overwrite` it refuses a folder that holds anything.
    /// With `overwrite` it removes the command's own files and keeps all others.
    ///
    /// # Errors
    /// The folder is a file, is not empty, cannot be created or written, or holds one of the `inputs`.
    pub fn prepare(self, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        self.keep_inputs(inputs)?;
        if self.root.exists() {
            if !self.root.is_dir() {
                return Err(OutputError::NotAFolder(self.root));
            }
            if !overwrite && !entries(&self.root)?.is_empty() {
                return Err(OutputError::FolderNotEmpty(self.root));
            }
            let unfinished = |path: &Path| name_of(path).starts_with(TEMPORARY_PREFIX);
            for path in self.files(unfinished)?.into_iter().filter(|path| path.is_file()) {
                fs::remove_file(&path).map_err(|source| OutputError::Remove(path, source))?;
            }
        }
        for path in self.folders() {
            fs::create_dir_all(&path).map_err(|source| OutputError::CreateFolder(path.clone(), source))?;
            // Permission bits do not show read-only mounts or quotas, so this tries to write.
            temporary_in(&path).map_err(|source| OutputError::NotWritable(path, source))?;
        }
        Ok(self)
    }

    /// Refuses to replace or remove one of these input files, even if its path is written differently.
    ///
    /// # Errors
    /// [`OutputError::Overwrites`].
    pub fn keep_inputs(&self, inputs: &[PathBuf]) -> Result<(), OutputError> {
        let own: Vec<PathBuf> = self.files(|_| false)?.iter().map(|path| real(path)).collect();
        match inputs.iter().find(|input| own.contains(&real(input))) {
            Some(input) => Err(OutputError::Overwrites(input.clone())),
            None => Ok(()),
        }
    }

    /// Removes the folders that [`Folder::prepare`] created, if nothing was written to them.
    pub fn take_back(&self) {
        for folder in self.folders().iter().rev().filter(|folder| self.fresh || **folder != self.root) {
            // This fails for a folder with files in it, which then stays.
            let _ = fs::remove_dir(folder);
        }
    }

    /// Path of the folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Path of a file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// The folder and its subfolders.
    fn folders(&self) -> Vec<PathBuf> {
        let mut names = vec![""];
        for (folder, _) in &self.own {
            if !names.contains(&folder.as_str()) {
                names.push(folder);
            }
        }
        names.into_iter().map(|name| self.root.join(name)).collect()
    }

    /// The command's own files that exist, and files that `also` accepts.
    fn files(&self, also: impl Fn(&Path) -> bool) -> Result<Vec<PathBuf>, OutputError> {
        let mut found = Vec::new();
        for folder in self.folders().into_iter().filter(|folder| folder.is_dir()) {
            let own = |path: &PathBuf| {
                let here = self.own.iter().filter(|(name, _)| self.root.join(name) == folder);
                also(path) || here.into_iter().any(|(_, pattern)| pattern.matches(name_of(path)))
            };
            found.extend(entries(&folder)?.into_iter().filter(own));
        }
        Ok(found)
    }
}

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

fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY_PREFIX).suffix(".part");
    #[cfg(unix)]
    {
        // tempfile creates files with mode 0600. 0666 gets the umask, like any other file.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// A path with links resolved. A path that does not exist stays as it is.
fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

/// Refuses an output that would replace one of the inputs.
///
/// # Errors
/// [`OutputError::Overwrites`].
pub fn keep_inputs<'a>(output: &Path, inputs: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), OutputError> {
    let output_file = real(output);
    match inputs.into_iter().any(|input| real(input) == output_file) {
        true => Err(OutputError::Overwrites(output.to_path_buf())),
        false => Ok(()),
    }
}

/// Checks early that [`write_atomic`] will be able to write the file.
///
/// # Errors
/// As [`write_atomic`].
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    temporary_beside(path).map(|_| ())
}

/// Writes a temporary file and renames it to `path` if `content` succeeds. Others see the old file or the whole new
/// one. After an error the old file is unchanged and no temporary file is left.
///
/// # Errors
/// Those of `content`, or [`OutputError::Write`] if the folder is missing or not writable or the disk is full.
pub fn write_atomic<F>(path: &Path, content: F) -> Result<(), OutputError>
where
    F: FnOnce(&mut dyn Write) -> Result<(), OutputError>,
{
    let mut file = temporary_beside(path)?;
    let failed = |source| OutputError::write(path, source);
    let mut writer = BufWriter::with_capacity(1 << 16, file.as_file_mut());
    content(&mut writer)?;
    writer.flush().map_err(failed)?;
    drop(writer);
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Creates a temporary file in the folder of a path.
fn temporary_beside(path: &Path) -> Result<NamedTempFile, OutputError> {
    if path.is_dir() {
        return Err(OutputError::NotAFile(path.to_path_buf()));
    }
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    temporary_in(folder).map_err(|source| {
        // The user knows the folder, not the temporary name.
        let source = io::Error::new(source.kind(), format!("in folder {}: {}", folder.display(), source.kind()));
        OutputError::write(path, source)
    })
}

/// Writes `bytes` as [`write_atomic`] does.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomic(path, |writer| writer.write_all(bytes).map_err(|source| OutputError::write(path, source)))
}

/// Writes a CSV file with a header as [`write_atomic`] does. All rows have the header's length.
pub fn write_csv<C: AsRef<[u8]>>(
    path: &Path,
    rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>,
) -> Result<(), OutputError> {
    write_atomic(path, |writer| write_rows(writer, rows).map_err(|source| OutputError::write(path, source)))
}

/// Writes CSV with a header. All rows have the header's length.
pub fn write_rows<C: AsRef<[u8]>>(
    writer: impl Write,
    rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>,
) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(writer);
    for row in rows {
        csv.write_record(row).map_err(|error| match error.into_kind() {
            csv::ErrorKind::Io(error) => error,
            other => io::Error::other(format!("{other:?}")),
        })?;
    }
    csv.flush()
}

/// Writes a structure as JSON. Numbers that are not finite become `null`.
pub fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), OutputError> {
    let failed = |error: serde_json::Error| OutputError::write(path, error.into());
    write_bytes(path, format!("{}\n", serde_json::to_string_pretty(value).map_err(failed)?).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        entries(folder).unwrap().iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_finished_file_is_alone_in_its_folder_and_readable_by_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"one").unwrap();
        write_bytes(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["a.txt"]);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let plain = folder.path().join("plain");
            fs::write(&plain, b"").unwrap();
            let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
            assert_eq!(mode(&path), mode(&plain));
        }
    }

    #[test]
    fn a_failure_leaves_nothing_behind_and_the_old_file_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let error = write_atomic(&path, |writer| {
            writer.write_all(b"half of the new").unwrap();
            Err(OutputError::write(&path, io::Error::from(io::ErrorKind::StorageFull)))
        });
        assert!(error.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_panic_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let run = std::panic::catch_unwind(|| write_atomic(&path, |_| panic!("in the middle")));
        assert!(run.is_err());
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = write_bytes(&folder.path().join("absent/a.txt"), b"").unwrap_err().to_string();
        assert!(error.contains("a.txt") && error.contains("in folder") && error.contains("absent"), "{error}");
        let error = write_bytes(folder.path(), b"").unwrap_err();
        assert!(matches!(error, OutputError::NotAFile(_)), "{error}");
    }

    const OWN: [&str; 4] = ["series.csv", "frames/step_*.exr", "frames/step_*.png", "plots/*.svg"];

    fn prepare(root: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Folder, OutputError> {
        Folder::new(root, &OWN).prepare(overwrite, inputs)
    }

    #[test]
    fn an_absent_or_empty_folder_is_made_ready_with_its_parents() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("a/b/run");
        let run = prepare(&root, false, &[]).unwrap();
        assert_eq!(names(&root), ["frames", "plots"]);
        assert!(names(&root.join("frames")).is_empty(), "the write test must clean up");
        assert_eq!(run.file("plots/a.svg"), root.join("plots/a.svg"));
    }

    #[test]
    fn a_folder_with_content_needs_force_which_removes_only_isotherms_own_files() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        prepare(folder.path(), false, &[]).unwrap();
        let own = ["series.csv", "plots/materials.svg", "frames/step_000003.exr", "frames/step_000003.png"];
        let others = ["notes.txt", "frames/mine.png", "frames/step_000003.txt", "plots/mine.pdf", "step_000003.exr"];
        for name in own.iter().chain(&others).chain(&[".isotherm-x.part"]) {
            fs::write(at(name), b"earlier").unwrap();
        }
        let error = prepare(folder.path(), false, &[]).unwrap_err();
        assert!(error.to_string().contains("--force"), "{error}");
        assert!(own.iter().all(|name| at(name).exists()), "a refused folder is untouched");

        prepare(folder.path(), true, &[]).unwrap();
        assert!(others.iter().all(|name| at(name).exists()));
        assert_eq!(names(folder.path()), ["frames", "notes.txt", "plots", "step_000003.exr"]);
        assert_eq!(names(&at("frames")), ["mine.png", "step_000003.txt"]);
        assert_eq!(names(&at("plots")), ["mine.pdf"]);
    }

    #[test]
    fn files_that_were_not_written_leave_no_folders() {
        let outside = tempfile::tempdir().unwrap();
        let fresh = outside.path().join("fresh");
        let prepared = prepare(&fresh, false, &[]).unwrap();
        assert!(fresh.join("frames").is_dir());
        prepared.take_back();
        assert!(!fresh.exists());

        let empty = outside.path().join("empty");
        fs::create_dir(&empty).unwrap();
        prepare(&empty, false, &[]).unwrap().take_back();
        assert!(names(&empty).is_empty(), "the user's own folder stays");

        let prepared = prepare(&fresh, false, &[]).unwrap();
        fs::write(fresh.join("plots/mine.txt"), b"mine").unwrap();
        prepared.take_back();
        assert!(fresh.join("plots/mine.txt").exists() && !fresh.join("frames").exists());
    }

    #[test]
    fn a_file_in_the_way_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        fs::write(&path, b"").unwrap();
        assert!(matches!(prepare(&path, true, &[]), Err(OutputError::NotAFolder(_))));
        assert!(matches!(prepare(&path.join("deeper"), false, &[]), Err(OutputError::CreateFolder { .. })));
    }

    #[test]
    fn a_file_that_is_read_is_not_written_whatever_it_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("series.csv");
        fs::write(&input, b"the user's").unwrap();
        let inputs = [input.clone()];
        let aliased = folder.path().join(".").join("series.csv");
        assert!(matches!(keep_inputs(&aliased, &inputs), Err(OutputError::Overwrites(_))));
        assert!(keep_inputs(&folder.path().join("other.csv"), &inputs).is_ok());
        assert!(Folder::new(&folder.path().join("out"), &OWN).keep_inputs(&inputs).is_ok());
        let error = Folder::new(folder.path(), &OWN).keep_inputs(&inputs).unwrap_err();
        assert!(error.to_string().contains("series.csv") && error.is_about_the_folder(), "{error}");
        let error = prepare(folder.path(), true, &[aliased]).unwrap_err();
        assert!(matches!(error, OutputError::Overwrites(_)) && input.exists(), "{error}");
        prepare(folder.path(), true, &[folder.path().join("other.csv")]).unwrap();
        assert!(!input.exists(), "what is not read goes with --force");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_is_read_is_not_removed() {
        let folder = tempfile::tempdir().unwrap();
        let [own, link] = ["plots/a.svg", "material.svg"].map(|name| folder.path().join(name));
        fs::create_dir(folder.path().join("plots")).unwrap();
        fs::write(&own, b"earlier").unwrap();
        std::os::unix::fs::symlink(&own, &link).unwrap();
        let error = prepare(folder.path(), true, std::slice::from_ref(&link)).unwrap_err();
        assert!(matches!(&error, OutputError::Overwrites(path) if *path == link), "{error}");
        assert!(own.exists(), "a refused folder is untouched");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_cannot_be_written_is_an_error() {
        // /proc refuses new files even to root.
        let error = prepare(Path::new("/proc/isotherm-output"), false, &[]).unwrap_err();
        assert!(matches!(error, OutputError::CreateFolder { .. }), "{error}");
        let error = write_bytes(Path::new("/proc/isotherm.exr"), b"").unwrap_err();
        assert!(error.to_string().contains("/proc/isotherm.exr"), "{error}");
    }
}
