//! Names of the files that `isotherm paper` leaves.

use std::path::{Path, PathBuf};

use super::orbit_figures::TABLES;
use super::transitions::{PANELS, Panel};
use crate::output::OutputError;
use crate::output::folder::prepare_folder;

/// The folder: `figure2.svg` to `figure6.svg`, `figure2_1.csv` to `figure6_4.csv`, `figure7.png`, `checks.csv` and
/// `index.html`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PaperFolder {
    root: PathBuf,
}

/// Temperature of each step of a transition.
pub fn series_name(panel: &Panel) -> String {
    format!("figure{}_{}.csv", panel.figure[0], panel.figure[1])
}

/// The plot of a figure.
pub fn plot_name(figure: u8) -> String {
    format!("figure{figure}.svg")
}

/// The picture of figure 7.
pub const FIGURE_7: &str = "figure7.png";
/// The table of checks.
pub const CHECKS: &str = "checks.csv";
/// The page.
pub const INDEX: &str = "index.html";

impl PaperFolder {
    /// Makes `root` ready as `RunFolder::prepare` does for a run; with `overwrite` the files above are removed.
    ///
    /// # Errors
    /// The folder is a file, is not empty, cannot be created, cannot be written to, or holds one of the `inputs`.
    pub fn prepare(root: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        let mut names = vec![FIGURE_7.to_owned(), CHECKS.to_owned(), INDEX.to_owned()];
        names.extend((2..=6).map(plot_name));
        names.extend(PANELS.iter().map(series_name));
        names.extend(TABLES.map(str::to_owned));
        let own = |path: &Path| names.iter().any(|name| root.join(name) == path);
        prepare_folder(root, &[], overwrite, &own, inputs)?;
        Ok(Self { root: root.to_path_buf() })
    }

    /// A file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_removes_its_own_files_only() {
        let folder = tempfile::tempdir().unwrap();
        let earlier = ["figure2_4.csv", "figure4.svg", "figure5_1.csv", "figure6.svg", "index.html"];
        for name in earlier.into_iter().chain(["notes.txt", "figure5_9.csv"]) {
            std::fs::write(folder.path().join(name), b"earlier").unwrap();
        }
        assert!(matches!(PaperFolder::prepare(folder.path(), false, &[]), Err(OutputError::FolderNotEmpty(_))));
        let input = [folder.path().join("figure5_1.csv")];
        assert!(matches!(PaperFolder::prepare(folder.path(), true, &input), Err(OutputError::Overwrites(_))));
        assert!(earlier.into_iter().all(|name| folder.path().join(name).exists()), "a refused folder is untouched");
        let paper = PaperFolder::prepare(folder.path(), true, &[]).unwrap();
        let left = |name| paper.file(name).exists();
        assert!(left("notes.txt") && left("figure5_9.csv"));
        assert!(earlier.into_iter().all(|name| !left(name)));
    }
}
