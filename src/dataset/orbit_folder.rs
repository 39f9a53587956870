//! The folder of an orbit in the making, with the checksums of its files.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::error::DatasetError;
use crate::output::OutputError;

/// Name of the list of checksums, of an orbit and of the whole set.
pub(crate) const CHECKSUMS: &str = "checksums.sha256";

/// An orbit in the making.
#[derive(Debug)]
pub(crate) struct OrbitFolder {
    root: PathBuf,
    path: PathBuf,
    /// Path of the folder in the data set.
    place: String,
    /// Paths and checksums of its files.
    sums: Vec<(String, String)>,
    /// Bytes that were written.
    pub(crate) bytes: u64,
}

impl OrbitFolder {
    /// An orbit without files. `root` is the folder of the data set, `path` the empty folder in which the orbit is made, and `place` its path in the data set.
    pub(super) fn new(root: &Path, path: PathBuf, place: String) -> Self {
        Self { root: root.to_path_buf(), path, place, sums: Vec::new(), bytes: 0 }
    }

    /// Where it is made.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Where it belongs.
    pub(super) fn place(&self) -> PathBuf {
        self.root.join(&self.place)
    }

    /// Writes the list of its checksums.
    pub(super) fn write_list(&mut self) -> Result<(), DatasetError> {
        self.sums.sort();
        let list: String = self.sums.iter().map(|(path, sum)| format!("{sum}  {path}\n")).collect();
        self.write_uncounted(CHECKSUMS, list.as_bytes())
    }

    /// Writes a file of the orbit, by its path in the data set or in the orbit's folder.
    ///
    /// # Errors
    /// A full disk.
    pub(crate) fn write(&mut self, path: &str, bytes: &[u8]) -> Result<(), DatasetError> {
        let name = self.name(path).to_owned();
        self.write_uncounted(&name, bytes)?;
        self.sums.push((format!("{}/{name}", self.place), sum_of(bytes)));
        Ok(())
    }

    /// Writes a file of the orbit with the bytes of `content`, which may read the orbit's other files.
    ///
    /// # Errors
    /// `content` fails, or the disk is full.
    pub(crate) fn write_from(
        &mut self,
        path: &str,
        content: impl FnOnce(&Self, &mut dyn Write) -> io::Result<()>,
    ) -> Result<(), DatasetError> {
        let name = self.name(path).to_owned();
        let mut writer = Summed { hasher: Sha256::new(), bytes: 0, file: None };
        let written = (|| {
            writer.file = Some(io::BufWriter::new(File::create(self.path.join(&name))?));
            content(self, &mut writer)?;
            writer.flush()
        })();
        written.map_err(|error| self.failed(&name, error))?;
        self.bytes += writer.bytes;
        self.sums.push((format!("{}/{name}", self.place), hexadecimal(&writer.hasher.finalize())));
        Ok(())
    }

    /// Reads a file of the orbit.
    ///
    /// # Errors
    /// It was not written, or can not be read.
    pub(crate) fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        fs::read(self.path.join(self.name(path)))
    }

    /// A path in the orbit's folder.
    fn name<'a>(&self, path: &'a str) -> &'a str {
        path.strip_prefix(&self.place).map_or(path, |name| name.trim_start_matches('/'))
    }

    /// The error names the file that would have appeared.
    fn failed(&self, name: &str, error: io::Error) -> OutputError {
        OutputError::write(&self.root.join(&self.place).join(name), error)
    }

    fn write_uncounted(&mut self, name: &str, bytes: &[u8]) -> Result<(), DatasetError> {
        let file = self.path.join(name);
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent).map_err(|error| self.failed(name, error))?;
        }
        fs::write(&file, bytes).map_err(|error| self.failed(name, error))?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }
}

/// A file whose checksum grows with it.
struct Summed {
    hasher: Sha256,
    bytes: u64,
    file: Option<io::BufWriter<File>>,
}

impl Write for Summed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.as_mut().map_or(Ok(bytes.len()), |file| file.write(bytes))?;
        self.hasher.update(&bytes[..count]);
        self.bytes += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), Write::flush)
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 (hexadecimal).
pub fn sum_of(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}
