//! Single files that appear whole or not at all.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use super::OutputError;
use super::temporary::Unfinished;

/// Prefix of unfinished files. A killed process may leave one.
const TEMPORARY_PREFIX: &str = ".isotherm-";

/// Checks early that [`write_atomic`] will be able to write the file.
///
/// # Errors
/// As [`write_atomic`].
pub(crate) fn check_writable(path: &Path) -> Result<(), OutputError> {
    temporary_beside(path).map(|_| ())
}

/// Writes a temporary file and renames it to `path` if `content` succeeds. Other processes see the old file or the whole new file. After an error the
/// old file is unchanged and no temporary file is left.
///
/// # Errors
/// `content` fails, or [`OutputError::Write`] if the folder is missing or not writable or the disk is full.
pub(crate) fn write_atomic<F>(path: &Path, content: F) -> Result<(), OutputError>
where
    F: FnOnce(&mut dyn Write) -> Result<(), OutputError>,
{
    let mut file = temporary_beside(path)?;
    let _unfinished = Unfinished::new(file.path());
    let failed = |source| OutputError::write(path, source);
    keep_access(path, file.as_file()).map_err(failed)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file.as_file_mut());
    content(&mut writer)?;
    writer.flush().map_err(failed)?;
    drop(writer);
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Gives a file the permission bits of the one that it replaces, and its owner where the system allows that.
fn keep_access(replaced: &Path, file: &fs::File) -> io::Result<()> {
    #[cfg(unix)]
    if let Ok(metadata) = fs::metadata(replaced) {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
        // Only an administrator may give a file away.
        let _ = fchown(file, Some(metadata.uid()), Some(metadata.gid()));
        file.set_permissions(fs::Permissions::from_mode(metadata.permissions().mode() & 0o777))?;
    }
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

/// Tries to write in a folder. Permission bits do not show read-only mounts or quotas.
///
/// # Errors
/// The folder takes no file.
pub(super) fn check_folder(folder: &Path) -> io::Result<()> {
    temporary_in(folder).map(|_| ())
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

#[cfg(test)]
mod tests;
