//! What `isotherm bench` leaves in its folder.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::page::page;
use super::plots;
use super::record::Bench;
use crate::output::OutputError;
use crate::output::folder::{prepare_folder, write_bytes};

/// All numbers.
pub const RECORD: &str = "bench.json";
/// The page.
pub const PAGE: &str = "report.html";

/// The folder: `bench.json`, `report.html`, `plots/NAME.svg`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BenchFolder {
    root: PathBuf,
}

impl BenchFolder {
    /// Makes `root` ready as `RunFolder::prepare` does for a run; with `overwrite` the files above are removed.
    ///
    /// # Errors
    /// The folder is a file, is not empty, cannot be created, cannot be written to, or holds one of the `inputs`.
    pub fn prepare(root: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        let plots = root.join("plots");
        let own = |path: &Path| {
            let is_plot = path.parent() == Some(&plots) && path.extension() == Some(OsStr::new("svg"));
            is_plot || [RECORD, PAGE].iter().any(|name| root.join(name) == path)
        };
        prepare_folder(root, std::slice::from_ref(&plots), overwrite, &own, inputs)?;
        Ok(Self { root: root.to_path_buf() })
    }

    /// A file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Writes everything.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, bench: &Bench) -> Result<(), OutputError> {
        let diagrams = plots::all(bench)?;
        for diagram in &diagrams {
            write_bytes(&self.file("plots").join(format!("{}.svg", diagram.name)), diagram.svg.as_bytes())?;
        }
        bench.write(&self.file(RECORD))?;
        write_bytes(&self.file(PAGE), page(bench, &diagrams).as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_removes_its_own_files_unless_they_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let inside = |name: &str| folder.path().join(name);
        std::fs::create_dir(inside("plots")).unwrap();
        for name in [RECORD, "plots/limits.svg", "scene.toml"] {
            std::fs::write(inside(name), b"earlier").unwrap();
        }
        let link = inside("material.svg");
        #[cfg(unix)]
        std::os::unix::fs::symlink(inside("plots/limits.svg"), &link).unwrap();
        #[cfg(not(unix))]
        let link = inside("plots/limits.svg");
        let error = BenchFolder::prepare(folder.path(), true, &[inside("scene.toml"), link.clone()]).unwrap_err();
        assert!(matches!(&error, OutputError::Overwrites(path) if *path == link), "{error}");
        assert!(inside(RECORD).exists() && inside("plots/limits.svg").exists(), "a refused folder is untouched");
        BenchFolder::prepare(folder.path(), true, &[inside("scene.toml")]).unwrap();
        assert!(inside("scene.toml").exists() && !inside(RECORD).exists() && !inside("plots/limits.svg").exists());
    }
}
