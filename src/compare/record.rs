//! Stores the temperatures of all vertices at all steps in a temporary file, because large scenes exceed memory.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::output::OutputError;

/// One row of temperatures for each step.
pub(crate) struct Record {
    file: File,
    folder: PathBuf,
    vertices: usize,
}

impl Record {
    /// An empty record in a folder. The file vanishes when the process ends.
    pub(crate) fn new(folder: &Path, vertices: usize) -> Result<Self, OutputError> {
        let file = tempfile::tempfile_in(folder).map_err(|source| OutputError::write(folder, source))?;
        Ok(Self { file, folder: folder.to_path_buf(), vertices })
    }

    /// Adds the temperatures of the next step [K] in vertex order.
    pub(crate) fn push(&mut self, temperatures: &[f32]) -> Result<(), OutputError> {
        let written = self.file.write_all(bytemuck::cast_slice(temperatures));
        written.map_err(|source| OutputError::write(&self.folder, source))
    }

    /// The temperatures of a step [K].
    ///
    /// The step was not recorded.
    pub(crate) fn row(&mut self, step: u32) -> Result<Vec<f32>, OutputError> {
        let mut row = vec![0.0f32; self.vertices];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut row);
        let start = u64::from(step) * bytes.len() as u64;
        let read = self.file.seek(SeekFrom::Start(start)).and_then(|_| self.file.read_exact(bytes));
        read.map_err(|source| OutputError::Read(self.folder.clone(), source))?;
        Ok(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_in_any_order_and_leave_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let mut record = Record::new(folder.path(), 3).unwrap();
        for step in 0..4 {
            record.push(&[1.0, 2.0, 3.0].map(|t| t * (step + 1) as f32)).unwrap();
        }
        assert_eq!(record.row(3).unwrap(), [4.0, 8.0, 12.0]);
        assert_eq!(record.row(0).unwrap(), [1.0, 2.0, 3.0]);
        assert!(record.row(4).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
