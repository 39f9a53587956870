//! A folder that a command writes, held open: every path in it is followed part by part from there, and no link within it is followed.
//!
//! A check of a path beforehand says nothing of the moment in which the path is used. Here the system refuses the link itself (`O_NOFOLLOW`), whichever
//! moment it appears in. The folder itself may be behind a link, because the user named it.

#[cfg(any(test, not(unix)))]
use std::fs;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

#[cfg(unix)]
use std::os::fd::OwnedFd;

#[cfg(unix)]
use rustix::fs::{AtFlags, CWD, Mode, OFlags, mkdirat, openat, renameat, statat, unlinkat};

/// How a file is opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    /// Reading and writing of a file that is there.
    Change,
    /// Writing of a file that is not there.
    New,
    /// Writing of a file from its beginning.
    Anew,
}

/// The folder.
#[derive(Debug)]
pub(crate) struct GuardedFolder {
    root: PathBuf,
    #[cfg(unix)]
    handle: OwnedFd,
}

/// A link stands where a folder or a file of the command belongs.
fn link(path: &str) -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("{path} is a link, or lies behind one, and isotherm writes through none"),
    )
}

/// The parts of a path within the folder.
fn parts(path: &str) -> io::Result<(Vec<&str>, &str)> {
    let mut parts: Vec<&str> = path.split('/').collect();
    let odd = |part: &&str| part.is_empty() || matches!(*part, "." | "..") || part.contains('\\');
    match (parts.iter().any(odd), parts.pop()) {
        (false, Some(name)) => Ok((parts, name)),
        _ => Err(io::Error::new(io::ErrorKind::InvalidInput, format!("'{path}' is no path within a folder"))),
    }
}

#[cfg(unix)]
impl GuardedFolder {
    /// Opens a folder that is there.
    ///
    /// # Errors
    /// As the system says.
    pub(crate) fn open(root: &Path) -> io::Result<Self> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        Ok(Self { root: root.to_path_buf(), handle: openat(CWD, root, flags, Mode::empty())? })
    }

    /// The folder of a path, opened part by part. `make` makes those that are missing.
    fn parent(&self, folders: &[&str], make: bool) -> io::Result<OwnedFd> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let mut at = self.handle.try_clone()?;
        for part in folders {
            at = match openat(&at, *part, flags, Mode::empty()) {
                Err(rustix::io::Errno::NOENT) if make => {
                    match mkdirat(&at, *part, Mode::from_raw_mode(0o777)) {
                        Ok(()) | Err(rustix::io::Errno::EXIST) => {}
                        Err(error) => return Err(error.into()),
                    }
                    openat(&at, *part, flags, Mode::empty()).map_err(|error| named(error, part))?
                }
                opened => opened.map_err(|error| named(error, part))?,
            };
        }
        Ok(at)
    }

    /// Makes a folder with those above it.
    ///
    /// # Errors
    /// A link or a file in its place, or as the system says.
    pub(crate) fn make(&self, path: &str) -> io::Result<()> {
        let (mut folders, name) = parts(path)?;
        folders.push(name);
        self.parent(&folders, true).map(|_| ())
    }

    /// Opens a file. A new one gets the folders above it.
    ///
    /// # Errors
    /// A link on the way, or as the system says.
    pub(crate) fn file(&self, path: &str, access: Access) -> io::Result<File> {
        let (folders, name) = parts(path)?;
        let parent = self.parent(&folders, matches!(access, Access::New | Access::Anew))?;
        let flags = OFlags::NOFOLLOW
            | OFlags::CLOEXEC
            | OFlags::NONBLOCK
            | match access {
                Access::Read => OFlags::RDONLY,
                Access::Change => OFlags::RDWR,
                Access::New => OFlags::RDWR | OFlags::CREATE | OFlags::EXCL,
                Access::Anew => OFlags::RDWR | OFlags::CREATE | OFlags::TRUNC,
            };
        let file =
            File::from(openat(parent, name, flags, Mode::from_raw_mode(0o666)).map_err(|error| named(error, name))?);
        if file.metadata()?.is_file() {
            return Ok(file);
        }
        Err(io::Error::new(io::ErrorKind::InvalidInput, format!("{name} is no regular file")))
    }

    /// Moves a file or a folder within the folder. The folders above its new place are made.
    ///
    /// # Errors
    /// A link on the way, or as the system says.
    pub(crate) fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        let ((from_folders, from), (to_folders, to)) = (parts(from)?, parts(to)?);
        let (old, new) = (self.parent(&from_folders, false)?, self.parent(&to_folders, true)?);
        Ok(renameat(old, from, new, to)?)
    }

    /// Brings the names in the folder above a path to the disk.
    ///
    /// # Errors
    /// A link on the way, or as the system says.
    pub(crate) fn sync_above(&self, path: &str) -> io::Result<()> {
        File::from(self.parent(&parts(path)?.0, false)?).sync_all()
    }

    /// Removes a file, or a link itself.
    ///
    /// # Errors
    /// A link on the way, or as the system says.
    pub(crate) fn remove(&self, path: &str) -> io::Result<()> {
        let (folders, name) = parts(path)?;
        Ok(unlinkat(self.parent(&folders, false)?, name, AtFlags::empty())?)
    }

    /// Whether something stands at a path: a folder or a file, and no link. `None` where there is nothing.
    ///
    /// # Errors
    /// A link on the way or at the path, or as the system says.
    pub(crate) fn kind(&self, path: &str) -> io::Result<Option<Kind>> {
        use rustix::fs::FileType;
        let (folders, name) = parts(path)?;
        let parent = match self.parent(&folders, false) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        match statat(parent, name, AtFlags::SYMLINK_NOFOLLOW) {
            Err(rustix::io::Errno::NOENT) => Ok(None),
            Err(error) => Err(error.into()),
            Ok(stat) => match FileType::from_raw_mode(stat.st_mode) {
                FileType::Directory => Ok(Some(Kind::Folder)),
                FileType::Symlink => Err(link(path)),
                _ => Ok(Some(Kind::File)),
            },
        }
    }
}

/// The error of a part of a path. Linux tells of a link with these two.
#[cfg(unix)]
fn named(error: rustix::io::Errno, part: &str) -> io::Error {
    match error {
        rustix::io::Errno::LOOP | rustix::io::Errno::NOTDIR => link(part),
        other => other.into(),
    }
}

/// What stands at a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Folder,
    File,
}

// Without handles the parts of a path are looked at before it is used.
#[cfg(not(unix))]
impl GuardedFolder {
    pub(crate) fn open(root: &Path) -> io::Result<Self> {
        fs::metadata(root).map(|_| Self { root: root.to_path_buf() })
    }

    fn free_of_links(&self, path: &str, make: bool) -> io::Result<PathBuf> {
        let (folders, name) = parts(path)?;
        let mut at = self.root.clone();
        for part in folders {
            at.push(part);
            match fs::symlink_metadata(&at) {
                Ok(metadata) if !metadata.is_dir() => return Err(link(part)),
                Err(error) if error.kind() == io::ErrorKind::NotFound && make => fs::create_dir(&at)?,
                other => drop(other?),
            }
        }
        at.push(name);
        if fs::symlink_metadata(&at).is_ok_and(|metadata| metadata.is_symlink()) { Err(link(path)) } else { Ok(at) }
    }

    pub(crate) fn make(&self, path: &str) -> io::Result<()> {
        fs::create_dir_all(self.free_of_links(path, true)?)
    }

    pub(crate) fn file(&self, path: &str, access: Access) -> io::Result<File> {
        let mut options = fs::OpenOptions::new();
        match access {
            Access::Read => options.read(true),
            Access::Change => options.read(true).write(true),
            Access::New => options.read(true).write(true).create_new(true),
            Access::Anew => options.read(true).write(true).create(true).truncate(true),
        };
        options.open(self.free_of_links(path, matches!(access, Access::New | Access::Anew))?)
    }

    pub(crate) fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        fs::rename(self.free_of_links(from, false)?, self.free_of_links(to, true)?)
    }

    pub(crate) fn sync_above(&self, _path: &str) -> io::Result<()> {
        Ok(())
    }

    pub(crate) fn remove(&self, path: &str) -> io::Result<()> {
        fs::remove_file(self.free_of_links(path, false)?)
    }

    pub(crate) fn kind(&self, path: &str) -> io::Result<Option<Kind>> {
        match self.free_of_links(path, false).and_then(fs::symlink_metadata) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            metadata => Ok(Some(if metadata?.is_dir() { Kind::Folder } else { Kind::File })),
        }
    }
}

impl GuardedFolder {
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Writes bytes to a new file.
    ///
    /// # Errors
    /// As [`GuardedFolder::file`], or a full disk.
    pub(crate) fn write_new(&self, path: &str, bytes: &[u8]) -> io::Result<()> {
        io::Write::write_all(&mut self.file(path, Access::New)?, bytes)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`GuardedFolder::file`].
    pub(crate) fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        io::Read::read_to_end(&mut self.file(path, Access::Read)?, &mut bytes)?;
        Ok(bytes)
    }

    /// Reads a text.
    ///
    /// # Errors
    /// As [`GuardedFolder::file`], or no UTF-8.
    pub(crate) fn read_text(&self, path: &str) -> io::Result<String> {
        io::read_to_string(self.file(path, Access::Read)?)
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// A folder with links to a folder and a file outside, and the outside.
    fn with_links() -> (tempfile::TempDir, GuardedFolder) {
        let outside = tempfile::tempdir().unwrap();
        let root = outside.path().join("out");
        fs::create_dir(&root).unwrap();
        fs::create_dir(outside.path().join("secret")).unwrap();
        fs::write(outside.path().join("secret/file"), "old").unwrap();
        symlink("../secret", root.join("linked")).unwrap();
        symlink("../secret/file", root.join("file")).unwrap();
        let guarded = GuardedFolder::open(&root).unwrap();
        (outside, guarded)
    }

    #[test]
    fn nothing_leaves_the_folder_through_a_link() {
        let (outside, guarded) = with_links();
        for access in [Access::Read, Access::Change, Access::New, Access::Anew] {
            for path in ["linked/file", "linked/new", "file", "linked/deep/new", "../secret/file", "linked/../file"] {
                assert!(guarded.file(path, access).is_err(), "{access:?} {path}");
            }
        }
        assert!(guarded.make("linked/new").is_err());
        guarded.write_new("inside", b"new").unwrap();
        assert!(guarded.rename("inside", "linked/file").is_err());
        assert!(guarded.rename("linked/file", "taken").is_err());
        assert!(guarded.remove("linked/file").is_err());
        assert!(guarded.kind("file").is_err() && guarded.kind("linked/file").is_err());
        // A link is replaced or removed, and not what it leads to.
        guarded.rename("inside", "file").unwrap();
        guarded.remove("linked").unwrap();
        let secret = outside.path().join("secret");
        assert_eq!(fs::read_to_string(secret.join("file")).unwrap(), "old");
        assert_eq!(fs::read_dir(secret).unwrap().count(), 1);
        assert_eq!(guarded.read_text("file").unwrap(), "new");
    }

    #[test]
    fn folders_are_made_and_a_file_that_is_there_is_not_new() {
        let folder = tempfile::tempdir().unwrap();
        let guarded = GuardedFolder::open(folder.path()).unwrap();
        guarded.write_new("a/b/c", b"1").unwrap();
        assert_eq!(guarded.kind("a/b").unwrap(), Some(Kind::Folder));
        assert_eq!(guarded.kind("a/b/c").unwrap(), Some(Kind::File));
        assert_eq!(guarded.kind("a/x/c").unwrap(), None);
        assert!(guarded.write_new("a/b/c", b"2").is_err());
        guarded.rename("a/b", "d/e").unwrap();
        assert_eq!(guarded.read_text("d/e/c").unwrap(), "1");
        // A pipe in the place of a file does not hold the program up.
        assert!(std::process::Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
        assert!(guarded.file("pipe", Access::Read).is_err());
    }
}
