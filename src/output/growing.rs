//! A table that grows while a run goes on: whole lines, written at least about once a second.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::OutputError;
use super::csv_rows::write_rows;
use super::folder::Folder;
use super::guarded::Access;
use super::manifest::LinePlace;

/// Longest time for which a line waits while others follow.
const LONGEST_WAIT: Duration = Duration::from_millis(500);
/// A line that comes this long after the line before is written at once, since the next line may be late.
const RARE: Duration = Duration::from_millis(20);
/// Most bytes that wait.
const MOST_BYTES: usize = 1 << 16;

pub(crate) struct Growing<'a> {
    folder: &'a Folder,
    name: String,
    path: PathBuf,
    file: File,
    place: Option<LinePlace>,
    length: u64,
    waiting: Vec<u8>,
    written: Instant,
    came: Instant,
}

impl<'a> Growing<'a> {
    /// Begins a table with its head.
    ///
    /// # Errors
    /// A file of somebody else in its place, or a full disk.
    pub(crate) fn begin(folder: &'a Folder, name: &str, head: Vec<String>) -> Result<Self, OutputError> {
        let path = folder.place_for(name)?;
        // The table of an earlier part of the run begins anew.
        let before = std::fs::metadata(&path).map_or(0, |metadata| metadata.len());
        let place = folder.manifest().map(|manifest| manifest.note_growing(name, [0, before])).transpose()?;
        let opened = folder.guarded()?.file(name, Access::Anew);
        let file = opened.map_err(|source| OutputError::write(&path, source))?;
        let mut table = Self::new(folder, name, path, file, place, 0);
        table.push(head)?;
        table.flush()?;
        Ok(table)
    }

    /// Goes on with a table after its first `length` bytes, and drops the rest.
    ///
    /// # Errors
    /// The table is shorter, or cannot be written.
    pub(crate) fn again(folder: &'a Folder, name: &str, length: u64) -> Result<Self, OutputError> {
        let path = folder.place_for(name)?;
        let failed = |source| OutputError::write(&path, source);
        let mut file = folder.guarded()?.file(name, Access::Change).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if metadata.len() < length {
            return Err(OutputError::Changed(path));
        }
        let place =
            folder.manifest().map(|manifest| manifest.note_growing(name, [length, metadata.len()])).transpose()?;
        file.set_len(length).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let table = Self::new(folder, name, path, file, place, length);
        table.note(length)?;
        Ok(table)
    }

    fn new(folder: &'a Folder, name: &str, path: PathBuf, file: File, place: Option<LinePlace>, length: u64) -> Self {
        let (name, now) = (name.to_owned(), Instant::now());
        Self { folder, name, path, file, place, length, waiting: Vec::new(), written: now, came: now }
    }

    /// Adds a line.
    ///
    /// # Errors
    /// A full disk. All lines that fit as a whole are kept.
    pub(crate) fn push(&mut self, cells: Vec<String>) -> Result<(), OutputError> {
        write_rows(&mut self.waiting, [cells]).map_err(|source| OutputError::write(&self.path, source))?;
        let now = Instant::now();
        let rare = now - std::mem::replace(&mut self.came, now) > RARE;
        if rare || now - self.written > LONGEST_WAIT || self.waiting.len() > MOST_BYTES { self.flush() } else { Ok(()) }
    }

    /// Writes the lines that wait.
    ///
    /// # Errors
    /// As [`Growing::push`].
    pub(crate) fn flush(&mut self) -> Result<(), OutputError> {
        self.written = Instant::now();
        if self.waiting.is_empty() {
            return Ok(());
        }
        let lines = std::mem::take(&mut self.waiting);
        self.note(self.length + lines.len() as u64)?;
        if let Err(error) = self.file.write_all(&lines) {
            let arrived =
                self.file.metadata().map_or(0, |metadata| metadata.len().saturating_sub(self.length)) as usize;
            let whole = lines[..arrived.min(lines.len())].iter().rposition(|byte| *byte == b'\n');
            self.length += whole.map_or(0, |last| last as u64 + 1);
            let _ = self.file.set_len(self.length);
            let _ = self.note(self.length);
            return Err(OutputError::write(&self.path, error));
        }
        self.length += lines.len() as u64;
        self.note(self.length)
    }

    /// Writes the lines that wait, and waits until the disk has them. Returns the length of the table [bytes].
    ///
    /// # Errors
    /// As [`Growing::push`].
    pub(crate) fn sync(&mut self) -> Result<u64, OutputError> {
        self.flush()?;
        self.file.sync_data().map_err(|source| OutputError::write(&self.path, source))?;
        Ok(self.length)
    }

    /// Tells the manifest the length, and the length to come.
    fn note(&self, to: u64) -> Result<(), OutputError> {
        let (Some(manifest), Some(place)) = (self.folder.manifest(), self.place) else { return Ok(()) };
        let metadata = self.file.metadata().map_err(|source| OutputError::write(&self.path, source))?;
        manifest.note_growth(place, &self.name, [self.length, to], &metadata)
    }

    /// Opens the table for reading.
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn reader(&mut self) -> Result<impl Read + use<>, OutputError> {
        self.flush()?;
        let opened = self.folder.guarded()?.file(&self.name, Access::Read);
        opened.map_err(|source| OutputError::Read(self.path.clone(), source))
    }
}

impl Drop for Growing<'_> {
    fn drop(&mut self) {
        // After an error elsewhere, the rows so far are kept.
        let _ = self.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(text: &str) -> Vec<String> {
        vec![text.to_owned(), "1".to_owned()]
    }

    #[test]
    fn lines_come_whole_and_a_table_goes_on_after_a_state() {
        let outside = tempfile::tempdir().unwrap();
        let root = outside.path().join("out");
        let read = || std::fs::read_to_string(root.join("series.csv")).unwrap();
        let open = || Folder::new(&root, &["series.csv"]);
        let folder = open().prepare(false, &[]).unwrap();
        let mut table = Growing::begin(&folder, "series.csv", row("time")).unwrap();
        assert_eq!(read(), "time,1\n");
        table.push(row("0")).unwrap();
        let saved = table.sync().unwrap();
        std::thread::sleep(2 * RARE);
        table.push(row("1")).unwrap();
        assert_eq!(read(), "time,1\n0,1\n1,1\n", "a late line does not wait");
        // A kill leaves the lines that were written, and the end of a line that was not.
        std::mem::forget(table);
        drop(folder);
        let folder = open().reopen().unwrap();
        let mut table = Growing::again(&folder, "series.csv", saved).unwrap();
        table.push(row("2")).unwrap();
        drop(table);
        assert_eq!(read(), "time,1\n0,1\n2,1\n");
        assert!(matches!(Growing::again(&folder, "series.csv", 1000), Err(OutputError::Changed(_))));
        drop(folder);
        // What a user adds makes it a file of the user.
        let text = read() + "3,1\n";
        std::fs::write(root.join("series.csv"), text).unwrap();
        assert!(matches!(open().reopen(), Err(OutputError::Changed(_))));
        assert!(matches!(open().prepare(true, &[]), Err(OutputError::Changed(_))));
    }

    #[test]
    fn a_kill_within_a_write_leaves_a_file_that_the_manifest_knows() {
        let outside = tempfile::tempdir().unwrap();
        let root = outside.path().join("out");
        let open = || Folder::new(&root, &["series.csv"]);
        let folder = open().prepare(false, &[]).unwrap();
        let mut table = Growing::begin(&folder, "series.csv", row("time")).unwrap();
        table.note(table.length + 8).unwrap();
        table.file.write_all(b"12,").unwrap();
        std::mem::forget(table);
        drop(folder);
        drop(open().reopen().unwrap());
        open().prepare(true, &[]).unwrap();
        assert!(!root.join("series.csv").exists());
    }
}
