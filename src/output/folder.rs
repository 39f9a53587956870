//! The output folder: its names, its rules, and files that appear whole or not at all.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::OutputError;

/// Start of the name of a file under way; a killed process may leave one behind, and the next `--force` removes it.
const TEMPORARY_PREFIX: &str = ".isotherm-";

/// The folder of one run: `frames/step_000120.{exr,png}`, `plots/NAME.svg`, `series.csv`, `report.{json,html}`,
/// `contact_sheet.png`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunFolder {
    root: PathBuf,
}

impl RunFolder {
    /// Makes `root` ready for a run: creates it with its parents, refuses one that holds anything unless `overwrite`,
    /// and with `overwrite` removes the files of an earlier run (by the names above; anything else stays), so that old
    /// frames never mix with new ones. A file that is one of the `inputs` of the run is not removed.
    ///
    /// # Errors
    /// The folder is a file, is not empty, cannot be created, or cannot be written to; or [`OutputError::Overwrites`].
    pub fn prepare(root: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        let folder = Self { root: root.to_path_buf() };
        let below = [folder.frames(), folder.plots()];
        prepare_folder(root, &below, overwrite, &|path| folder.is_own(path), inputs)?;
        Ok(folder)
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// `frames/step_000120.exr`: radiance, temperature, depth and labels of a step.
    pub fn frame_exr(&self, step: u32) -> PathBuf {
        self.frames().join(format!("step_{step:06}.exr"))
    }

    /// `frames/step_000120.png`: the false-colour picture of a step.
    pub fn frame_png(&self, step: u32) -> PathBuf {
        self.frames().join(format!("step_{step:06}.png"))
    }

    /// `plots/NAME.svg`.
    pub fn plot(&self, name: &str) -> PathBuf {
        self.plots().join(format!("{name}.svg"))
    }

    /// `contact_sheet.png`: small pictures of several steps.
    pub fn contact_sheet(&self) -> PathBuf {
        self.root.join("contact_sheet.png")
    }

    /// `series.csv`: temperatures over time.
    pub fn series(&self) -> PathBuf {
        self.root.join("series.csv")
    }

    /// `joints.csv`: positions of the joints over time.
    pub fn joints(&self) -> PathBuf {
        self.root.join("joints.csv")
    }

    /// `report.json`.
    pub fn report_json(&self) -> PathBuf {
        self.root.join("report.json")
    }

    /// `report.html`.
    pub fn report_html(&self) -> PathBuf {
        self.root.join("report.html")
    }

    /// `path` as seen from the folder, with forward slashes: what links in the report use.
    pub fn relative(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.root).unwrap_or(path);
        inside.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
    }

    /// Whether a run into `root` would replace or remove one of these files.
    ///
    /// # Errors
    /// [`OutputError::Overwrites`].
    pub fn keep_inputs(root: &Path, inputs: &[PathBuf]) -> Result<(), OutputError> {
        let folder = Self { root: root.to_path_buf() };
        keep_inputs_in([root, &folder.frames(), &folder.plots()], &|path| folder.is_own(path), inputs)
    }

    fn frames(&self) -> PathBuf {
        self.root.join("frames")
    }

    fn plots(&self) -> PathBuf {
        self.root.join("plots")
    }

    fn is_own(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        let parent = path.parent();
        if parent == Some(&self.frames()) {
            return name.starts_with("step_") && matches!(extension, "exr" | "png");
        }
        if parent == Some(&self.plots()) {
            return extension == "svg";
        }
        let own = [self.series(), self.joints(), self.contact_sheet(), self.report_json(), self.report_html()];
        own.iter().any(|own| own == path)
    }
}

/// Makes `root` and the folders `below` it ready for a command's files: creates them, refuses a `root` that holds
/// anything unless `overwrite`, and with `overwrite` removes the files that are the command's `own`, unless one of them is
/// one of the `inputs`.
///
/// # Errors
/// The folder is a file, is not empty, cannot be created, or cannot be written to; or [`OutputError::Overwrites`].
pub fn prepare_folder(
    root: &Path,
    below: &[PathBuf],
    overwrite: bool,
    own: &dyn Fn(&Path) -> bool,
    inputs: &[PathBuf],
) -> Result<(), OutputError> {
    let folders = || std::iter::once(root).chain(below.iter().map(PathBuf::as_path));
    keep_inputs_in(folders(), own, inputs)?;
    if root.exists() {
        if !root.is_dir() {
            return Err(OutputError::NotAFolder(root.to_path_buf()));
        }
        if !overwrite && !entries(root)?.is_empty() {
            return Err(OutputError::FolderNotEmpty(root.to_path_buf()));
        }
        for folder in folders().filter(|folder| folder.is_dir()) {
            remove_files(folder, own)?;
        }
    }
    for path in folders() {
        fs::create_dir_all(path).map_err(|source| OutputError::CreateFolder { path: path.to_path_buf(), source })?;
        // Permission bits do not tell everything (read-only mounts, quotas): ask by doing.
        temporary_in(path).map_err(|source| OutputError::NotWritable { path: path.to_path_buf(), source })?;
    }
    Ok(())
}

/// Whether one of the files that a command reads is one of its `own` in these folders, however either is named.
fn keep_inputs_in<'a>(
    folders: impl IntoIterator<Item = &'a Path>,
    own: &dyn Fn(&Path) -> bool,
    inputs: &[PathBuf],
) -> Result<(), OutputError> {
    let inputs: Vec<(PathBuf, &PathBuf)> = inputs.iter().map(|input| (real(input), input)).collect();
    for folder in folders.into_iter().filter(|folder| folder.is_dir()) {
        for path in entries(folder)?.into_iter().filter(|path| own(path)) {
            let found = real(&path);
            if let Some((_, input)) = inputs.iter().find(|(input, _)| *input == found) {
                return Err(OutputError::Overwrites((*input).clone()));
            }
        }
    }
    Ok(())
}

/// Removes the files of a folder that are the command's own, and what a killed process left under way.
fn remove_files(folder: &Path, own: &dyn Fn(&Path) -> bool) -> Result<(), OutputError> {
    for path in entries(folder)? {
        let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
        if path.is_file() && (name.starts_with(TEMPORARY_PREFIX) || own(&path)) {
            fs::remove_file(&path).map_err(|source| OutputError::Remove { path, source })?;
        }
    }
    Ok(())
}

/// What a folder holds, sorted by name.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let read = |source| OutputError::Read { path: folder.to_path_buf(), source };
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
        // tempfile's own 0600 would stay with the finished file; 0666 is cut by the umask like any other file's.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// A path by its own name, links followed; as it is where nothing is there.
fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

/// Whether an output would replace one of the files that a command reads.
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

/// Whether [`write_atomic`] will find its folder, before the work whose result it is to write.
///
/// # Errors
/// As [`write_atomic`] without content.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    temporary_beside(path).map(|_| ())
}

/// Writes a file beside its place and renames it there when `content` succeeds: whoever looks sees the old file or the
/// whole new one. On an error nothing is left behind and what existed under the name stays.
///
/// # Errors
/// Those of `content`; and [`OutputError::Write`] where the folder is absent or not writable or the disk is full.
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

/// A temporary file in the folder of a path.
fn temporary_beside(path: &Path) -> Result<NamedTempFile, OutputError> {
    if path.is_dir() {
        return Err(OutputError::NotAFile(path.to_path_buf()));
    }
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    temporary_in(folder).map_err(|source| {
        // The temporary name would only confuse; the folder is what the user can mend.
        let source = io::Error::new(source.kind(), format!("in folder {}: {}", folder.display(), source.kind()));
        OutputError::write(path, source)
    })
}

/// Writes `bytes` as [`write_atomic`] does.
///
/// # Errors
/// [`OutputError::Write`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomic(path, |writer| writer.write_all(bytes).map_err(|source| OutputError::write(path, source)))
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

    #[test]
    fn an_absent_or_empty_folder_is_made_ready_with_its_parents() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("a/b/run");
        let run = RunFolder::prepare(&root, false, &[]).unwrap();
        assert_eq!(names(&root), ["frames", "plots"]);
        assert!(names(&root.join("frames")).is_empty(), "the write test must clean up");
        assert_eq!(run.frame_exr(120), root.join("frames/step_000120.exr"));
        assert_eq!(run.relative(&run.frame_png(7)), "frames/step_000007.png");
    }

    #[test]
    fn a_folder_with_content_needs_force_which_removes_only_isotherms_own_files() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::prepare(folder.path(), false, &[]).unwrap();
        let own = [run.series(), run.report_json(), run.report_html(), run.contact_sheet(), run.plot("materials")];
        for path in own.iter().chain(&[run.frame_exr(3), run.frame_png(3), folder.path().join(".isotherm-x.part")]) {
            fs::write(path, b"earlier").unwrap();
        }
        for name in ["notes.txt", "frames/mine.png", "frames/step_000003.txt", "plots/mine.pdf"] {
            fs::write(folder.path().join(name), b"the user's").unwrap();
        }
        let error = RunFolder::prepare(folder.path(), false, &[]).unwrap_err();
        assert!(error.to_string().contains("--force"), "{error}");
        assert!(run.series().exists(), "a refused folder is untouched");

        RunFolder::prepare(folder.path(), true, &[]).unwrap();
        assert_eq!(names(folder.path()), ["frames", "notes.txt", "plots"]);
        assert_eq!(names(&folder.path().join("frames")), ["mine.png", "step_000003.txt"]);
        assert_eq!(names(&folder.path().join("plots")), ["mine.pdf"]);
    }

    #[test]
    fn a_file_in_the_way_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        fs::write(&path, b"").unwrap();
        assert!(matches!(RunFolder::prepare(&path, true, &[]), Err(OutputError::NotAFolder(_))));
        let below = path.join("deeper");
        assert!(matches!(RunFolder::prepare(&below, false, &[]), Err(OutputError::CreateFolder { .. })));
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
        assert!(RunFolder::keep_inputs(&folder.path().join("out"), &inputs).is_ok());
        let error = RunFolder::keep_inputs(folder.path(), &inputs).unwrap_err();
        assert!(error.to_string().contains("series.csv") && error.is_about_the_folder(), "{error}");
        let error = RunFolder::prepare(folder.path(), true, &[aliased]).unwrap_err();
        assert!(matches!(error, OutputError::Overwrites(_)) && input.exists(), "{error}");
        RunFolder::prepare(folder.path(), true, &[folder.path().join("other.csv")]).unwrap();
        assert!(!input.exists(), "what is not read goes with --force");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_cannot_be_written_is_an_error() {
        // /proc refuses new entries to everybody, root included.
        let error = RunFolder::prepare(Path::new("/proc/isotherm-output"), false, &[]).unwrap_err();
        assert!(matches!(error, OutputError::CreateFolder { .. }), "{error}");
        let error = write_bytes(Path::new("/proc/isotherm.exr"), b"").unwrap_err();
        assert!(error.to_string().contains("/proc/isotherm.exr"), "{error}");
    }
}
