//! What a comparison leaves in its folder.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::differences::table;
use super::page::Page;
use super::runs::Runs;
use super::{INSTANT, NETWORK, RESPONSES, TRANSITION};
use crate::output::OutputError;
use crate::output::colour::ColourScale;
use crate::output::comparison::{Legend, panel, sheet};
use crate::output::comparison_plots::{MOST_PLOTS, Response, differences, temperatures};
use crate::output::folder::{prepare_folder, write_atomic, write_bytes};
use crate::output::job::eclipses;
use crate::output::report::{Picture, PlotEntry};

/// The page.
pub const PAGE: &str = "compare.html";
/// Differences by part.
pub const TABLE: &str = "compare.csv";
/// Differences of all nodes over time.
pub const OVER_TIME: &str = "differences.csv";
/// All shown steps on one sheet.
pub const SHEET: &str = "comparison.png";

/// The folder: `compare.html`, `compare.csv`, `differences.csv`, `series_RESPONSE.csv`, `comparison.png`,
/// `panels/step_000120.png`, `plots/NAME.svg`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompareFolder {
    root: PathBuf,
    /// Whether there was no such folder.
    fresh: bool,
}

impl CompareFolder {
    /// Makes `root` ready as `RunFolder::prepare` does for a run; with `overwrite` the files above are removed.
    ///
    /// # Errors
    /// The folder is a file, is not empty, cannot be created, cannot be written to, or holds one of the `inputs`.
    pub fn prepare(root: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        let folder = Self { root: root.to_path_buf(), fresh: !root.exists() };
        prepare_folder(root, &folder.below(), overwrite, &|path| folder.is_own(path), inputs)?;
        Ok(folder)
    }

    fn below(&self) -> [PathBuf; 2] {
        ["panels", "plots"].map(|name| self.file(name))
    }

    /// Takes back the folders of a comparison that was not written: those that are empty, and the folder itself where
    /// there was none before.
    pub fn take_back(&self) {
        let root = self.fresh.then(|| self.root.clone());
        for folder in self.below().into_iter().chain(root) {
            // A folder that is not empty holds what is another's, and stays.
            let _ = std::fs::remove_dir(folder);
        }
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    fn is_own(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        match path.parent() {
            Some(parent) if parent == self.file("panels") => name.starts_with("step_") && extension == "png",
            Some(parent) if parent == self.file("plots") => extension == "svg",
            Some(parent) if parent == self.root => {
                [PAGE, TABLE, OVER_TIME, SHEET].contains(&name) || RESPONSES.iter().any(|one| name == series_name(one))
            }
            _ => false,
        }
    }
}

/// Temperatures of a response over time.
pub fn series_name(response: &str) -> String {
    format!("series_{response}.csv")
}

/// Parts in the order of how far `instant` is from the network, the farthest first; those without area are left out.
pub fn farthest_parts(runs: &Runs) -> Vec<usize> {
    let parts = &runs.ran[INSTANT].differences.parts;
    let mut order: Vec<usize> = (0..parts.len()).filter(|part| parts[*part].area > 0.0).collect();
    order.sort_by(|a, b| parts[*b].rms().total_cmp(&parts[*a].rms()).then(a.cmp(b)));
    order
}

/// Writes every file; `pictured` hears of each picture.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    folder: &CompareFolder,
    runs: &Runs,
    page: &Page,
    pictured: &(dyn Fn() + Sync),
) -> Result<(), OutputError> {
    let network = &runs.ran[NETWORK];
    let scene = &network.prepared.scene;
    let found = [INSTANT, TRANSITION].map(|run| (RESPONSES[run], &runs.ran[run].differences));
    let materials: Vec<String> = network.prepared.materials.iter().map(|material| material.name.clone()).collect();
    let rows = table(network.series.parts(), &materials, &runs.vertices, &found, scene.time.step);
    write_csv(&folder.file(TABLE), &rows)?;
    write_csv(&folder.file(OVER_TIME), &over_time(runs))?;
    for (name, ran) in RESPONSES.iter().zip(&runs.ran) {
        ran.series.write(&folder.file(&series_name(name)))?;
    }

    let mut pictures = Vec::new();
    if !runs.views.is_empty() {
        let title = format!("{}: instant, transition, network", scene.name);
        let legend = Legend::new(&title, RESPONSES, &runs.views, scene.colour_range);
        let details = details(runs, &legend.temperature);
        let png = sheet(&runs.views, &legend, &details)?.png()?;
        write_bytes(&folder.file(SHEET), &png)?;
        pictures.push(Picture {
            title: "Temperatures under each response, and their differences from the network".to_owned(),
            file: SHEET.to_owned(),
            png,
        });
        let panels = runs.views.par_iter().map(|view| {
            let file = format!("panels/step_{:06}.png", view.step);
            let png = panel(view, &legend)?.png()?;
            write_bytes(&folder.file(&file), &png)?;
            pictured();
            Ok(Picture { title: view.caption.clone(), file, png })
        });
        pictures.extend(panels.collect::<Result<Vec<_>, OutputError>>()?);
    }

    let shades = eclipses(&network.prepared);
    let lines = [INSTANT, TRANSITION].map(|run| {
        let steps = &runs.ran[run].differences.steps;
        (RESPONSES[run], steps.iter().map(|step| [step.time, step.rms]).collect())
    });
    let responses: Vec<Response> =
        RESPONSES.iter().zip(&runs.ran).map(|(name, ran)| Response { name, series: &ran.series }).collect();
    let mut parts = farthest_parts(runs);
    parts.truncate(MOST_PLOTS);
    let mut named = vec![differences(&lines, network.series.rows(), RESPONSES[NETWORK], &shades)?];
    named.extend(temperatures(&responses, &parts, &shades)?);
    let mut plots = Vec::new();
    for plot in named {
        let file = format!("plots/{}.svg", plot.name);
        write_bytes(&folder.file(&file), plot.svg.as_bytes())?;
        plots.push(PlotEntry { title: plot.title, file, svg: plot.svg });
    }
    write_bytes(&folder.file(PAGE), page.html(runs, &pictures, &plots).as_bytes())
}

fn details(runs: &Runs, scale: &ColourScale) -> String {
    let band = if runs.ran[NETWORK].prepared.scene.colour_range.is_some() { "the scene's" } else { "of all pictures" };
    format!(
        "{} of the drawn steps; one colour scale for all temperatures ({band}, {} to {} K), one for all differences",
        runs.views.len(),
        scale.lower,
        scale.upper
    )
}

/// `differences.csv`: time [s], then mean, rms and max [K] over all nodes, of instant and of transition.
fn over_time(runs: &Runs) -> Vec<Vec<String>> {
    let mut head = vec!["time".to_owned()];
    for run in [INSTANT, TRANSITION] {
        head.extend(["mean", "rms", "max"].map(|what| format!("{}:{what}", RESPONSES[run])));
    }
    let [instant, transition] = [INSTANT, TRANSITION].map(|run| &runs.ran[run].differences.steps);
    let row = |(a, b): (&super::differences::OfStep, &super::differences::OfStep)| {
        let values = [a.mean, a.rms, f64::from(a.max), b.mean, b.rms, f64::from(b.max)];
        std::iter::once(a.time.to_string()).chain(values.map(|value| format!("{value:.6}"))).collect()
    };
    std::iter::once(head).chain(instant.iter().zip(transition).map(row)).collect()
}

fn write_csv(path: &Path, rows: &[Vec<String>]) -> Result<(), OutputError> {
    write_atomic(path, |writer| {
        let mut csv = csv::Writer::from_writer(writer);
        let written = rows.iter().try_for_each(|row| csv.write_record(row));
        written.and_then(|()| csv.flush().map_err(Into::into)).map_err(|error| OutputError::write(path, error.into()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comparison_that_was_not_written_leaves_no_folders() {
        let outside = tempfile::tempdir().unwrap();
        let fresh = outside.path().join("fresh");
        let prepared = CompareFolder::prepare(&fresh, false, &[]).unwrap();
        assert!(fresh.join("panels").is_dir());
        prepared.take_back();
        assert!(!fresh.exists());

        let empty = outside.path().join("empty");
        std::fs::create_dir(&empty).unwrap();
        CompareFolder::prepare(&empty, false, &[]).unwrap().take_back();
        assert_eq!(std::fs::read_dir(&empty).unwrap().count(), 0, "the user's own folder stays");

        let prepared = CompareFolder::prepare(&fresh, false, &[]).unwrap();
        std::fs::write(fresh.join("plots/mine.txt"), b"mine").unwrap();
        prepared.take_back();
        assert!(fresh.join("plots/mine.txt").exists() && !fresh.join("panels").exists());
    }

    #[test]
    fn force_removes_its_own_files_only() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["panels", "plots"] {
            std::fs::create_dir(at(name)).unwrap();
        }
        let own = ["compare.csv", "series_network.csv", "panels/step_000004.png", "plots/part_1.svg"];
        let others = ["notes.txt", "series_mine.csv", "panels/mine.png"];
        for name in own.iter().chain(&others) {
            std::fs::write(at(name), b"earlier").unwrap();
        }
        assert!(matches!(CompareFolder::prepare(folder.path(), false, &[]), Err(OutputError::FolderNotEmpty(_))));
        CompareFolder::prepare(folder.path(), true, &[]).unwrap();
        assert!(own.iter().all(|name| !at(name).exists()) && others.iter().all(|name| at(name).exists()));
    }
}
