//! The folder of an orbit in the making, with the checksums of its files.

use std::fs::File;
use std::io::{self, Read, Write};
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::error::DatasetError;
use crate::output::OutputError;
use crate::output::guarded::{Access, GuardedFolder};

/// Name of the list of checksums, of an orbit and of the whole set.
pub(crate) const CHECKSUMS: &str = "checksums.sha256";

/// An orbit in the making.
#[derive(Debug)]
pub(crate) struct OrbitFolder {
    /// The folder of the data set.
    guarded: Arc<GuardedFolder>,
    path: String,
    /// Path of the folder in the data set.
    place: String,
    /// Paths and checksums of its files.
    sums: Vec<(String, String)>,
    /// Bytes that were written.
    pub(crate) bytes: u64,
}

impl OrbitFolder {
    /// An orbit without files. `path` is the empty folder in which the orbit is made, and `place` its path. Both lie within the data set.
    pub(super) fn new(guarded: Arc<GuardedFolder>, path: String, place: String) -> Self {
        Self { guarded, path, place, sums: Vec::new(), bytes: 0 }
    }

    /// Where it is made.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Where it belongs.
    pub(super) fn place(&self) -> &str {
        &self.place
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
            writer.file = Some(io::BufWriter::new(self.guarded.file(&self.made(&name), Access::New)?));
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
        let mut bytes = Vec::new();
        self.guarded.file(&self.made(self.name(path)), Access::Read)?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// Path at which a file is made.
    fn made(&self, name: &str) -> String {
        format!("{}/{name}", self.path)
    }

    /// A path in the orbit's folder.
    fn name<'a>(&self, path: &'a str) -> &'a str {
        path.strip_prefix(&self.place).map_or(path, |name| name.trim_start_matches('/'))
    }

    /// The error names the file that would have appeared.
    fn failed(&self, name: &str, error: io::Error) -> OutputError {
        OutputError::write(&self.guarded.root().join(&self.place).join(name), error)
    }

    fn write_uncounted(&mut self, name: &str, bytes: &[u8]) -> Result<(), DatasetError> {
        self.guarded.write_new(&self.made(name), bytes).map_err(|error| self.failed(name, error))?;
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

pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 (hexadecimal).
pub fn sum_of(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}
