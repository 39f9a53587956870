//! `isotherm network import`: converts an ESATAN TMD file or an s2e-core thermal model to a network file.

use std::path::{Path, PathBuf};

use super::error::CliError;
use crate::output::console::say;
use crate::output::destination::{Destination, destinations};
use crate::output::inputs::keep_inputs;
use crate::scene::network::{import_s2e, import_tmd};
use crate::scene::tmd::Tmd;

/// Convert another program's thermal model to a network file.
///
/// A file is read as an ESATAN TMD (HDF5): nodes, GL, GR, QA, QE, QI, QR and QS over time, boundary nodes, and the times
/// as times of output. A folder is read as a model of s2e-core: node.csv, cij.csv, rij.csv and optionally heaters.csv and heatload.csv
/// (ut-issl/s2e-core, settings/sample_satellite/thermal_csv_files). The command prints what a network file cannot hold, and docs/network.md describes
/// both.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm network import DISCTR_TRANSIENT.TMD -o disctr.toml\n  \
isotherm network disctr.toml -o disctr.csv\n  isotherm network import thermal_csv_files/ -o network.toml")]
pub(crate) struct Arguments {
    /// TMD file, or folder with the CSV files of s2e-core
    #[arg(value_name = "FILE.TMD|DIR")]
    source: PathBuf,
    /// Network file to write, or - for standard output
    #[arg(short, long, value_name = "NETWORK.toml")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let source = &arguments.source;
    let (text, read) = if source.is_dir() { s2e(source)? } else { (tmd(source)?, vec![source.clone()]) };
    keep_inputs(&arguments.output, &read)?;
    let [output] = destinations([Some(&*arguments.output)])?;
    Ok(output.unwrap_or(Destination::StandardOutput).write_bytes(text.as_bytes())?)
}

/// The network file of a folder of s2e-core, and the files that are read.
fn s2e(folder: &Path) -> Result<(String, Vec<PathBuf>), CliError> {
    let imported = import_s2e::import(folder).map_err(CliError::Usage)?;
    for note in &imported.notes {
        say!("assumed: {note}");
    }
    let read = ["node.csv", "cij.csv", "rij.csv", "heaters.csv", "heatload.csv"].map(|name| folder.join(name));
    Ok((imported.text, read.to_vec()))
}

/// The network file of a TMD file.
fn tmd(path: &Path) -> Result<String, CliError> {
    let tmd = Tmd::load(path).map_err(|error| CliError::Usage(error.to_string()))?;
    let wrong = |message| CliError::Usage(format!("{}: {message}", path.display()));
    let imported = import_tmd::network(&tmd).map_err(wrong)?;
    let network = &imported.file.network;
    say!(
        "imported: {} of {} nodes, {} GL, {} GR, {} times to {} s",
        network.len(),
        tmd.nodes.len(),
        network.linear.len(),
        network.radiative.len(),
        imported.file.times.len(),
        imported.file.times.last().copied().unwrap_or(0.0)
    );
    for note in &imported.notes {
        say!("note: {note}");
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut head = vec![format!("From the TMD file {name}: {}", tmd.description)];
    head.extend(imported.notes.iter().cloned());
    Ok(imported.file.text(&head, &imported.comments))
}
