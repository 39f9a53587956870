//! `isotherm network export`: writes a network file as other programs read it.

use std::path::{Path, PathBuf};

use super::error::CliError;
use crate::misspelt::suggestion;
use crate::output::console::say;
use crate::output::destination::{Destination, destinations};
use crate::output::folder::Folder;
use crate::output::inputs::keep_inputs;
use crate::scene::Solution;
use crate::scene::network::NetworkFile;
use crate::scene::network::export_tmd::{TmdSolution, tmd};
use crate::scene::network::tables;
use crate::simulation::prepare_error::PrepareError;

/// The network file in a folder of tables.
const NETWORK: &str = "network.toml";

/// Write a network file for another program: as ESATAN TMD (HDF5), or as CSV.
///
/// A TMD holds nodes, GL, GR, heat as QI, boundary nodes, and the temperatures of --series. Space is a boundary node of it. A folder holds nodes.csv, gl.csv,
/// gr.csv, heat.csv and network.toml. The command prints what a TMD cannot hold (docs/network.md).
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm network export models/cubesat_network.toml -o cubesat.TMD\n  \
isotherm network export models/cubesat_network.toml --series cubesat.csv -o cubesat.TMD\n  \
isotherm network export models/cubesat_network.toml -o tables/")]
pub(crate) struct Arguments {
    /// Network file (TOML)
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Temperatures that `isotherm network` found for this file
    #[arg(long, value_name = "OUT.csv")]
    series: Option<PathBuf>,
    /// TMD file to write (.TMD or .h5), or folder of CSV files
    #[arg(short, long, value_name = "FILE.TMD|FOLDER")]
    output: PathBuf,
    /// Replace the files of an earlier export in the folder
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.file;
    let file = NetworkFile::load(path).map_err(PrepareError::from)?;
    for assumption in &file.assumptions {
        say!("assumed: {assumption}");
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let ending = arguments.output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    if !ending.is_some_and(|ending| ["tmd", "h5", "hdf5"].contains(&&*ending)) {
        if arguments.series.is_some() {
            let message = "--series belongs to a TMD file: -o FILE.TMD; for other programs the series is CSV already";
            return Err(CliError::Usage(message.to_owned()));
        }
        let head = [format!("From {name}")];
        return write_tables(&file, &head, &arguments.output, arguments.force, std::slice::from_ref(path));
    }
    let inputs: Vec<PathBuf> = std::iter::once(path).chain(&arguments.series).cloned().collect();
    keep_inputs(&arguments.output, &inputs)?;
    let [output] = destinations([Some(&*arguments.output)])?;
    let solution = arguments.series.as_deref().map(|series| read_series(series, &file)).transpose()?;
    let solved = solution.as_ref().map(|(times, rows)| TmdSolution { times, rows });
    let (tmd, notes) = tmd(&file, &name, solved);
    for note in notes {
        say!("note: {note}");
    }
    let bytes = tmd.bytes().map_err(|message| CliError::Usage(format!("{}: {message}", path.display())))?;
    output.unwrap_or(Destination::StandardOutput).write_bytes(&bytes)?;
    say!(
        "exported: {} nodes, {} GL, {} GR, {} times",
        tmd.nodes.len(),
        tmd.linear.values.len(),
        tmd.radiative.values.len(),
        tmd.times.len()
    );
    Ok(())
}

/// Writes the tables of a network and its network file into a folder. `head` becomes comments of the network file.
pub(super) fn write_tables(
    file: &NetworkFile,
    head: &[String],
    root: &Path,
    force: bool,
    inputs: &[PathBuf],
) -> Result<(), CliError> {
    let names: Vec<&str> = tables::NAMES.into_iter().chain([NETWORK]).collect();
    let folder = Folder::new(root, &names).prepare(force, inputs)?;
    for (name, rows) in tables::NAMES.iter().zip(file.tables()) {
        folder.write_csv(name, rows)?;
    }
    folder.write_bytes(NETWORK, file.text(head, &[]).as_bytes())?;
    let network = &file.network;
    let (nodes, linear, radiative) = (network.len(), network.linear.len(), network.radiative.len());
    say!("exported: {nodes} nodes, {linear} GL, {radiative} GR to {}", root.display());
    Ok(folder.finish()?)
}

/// Times of a series, and the temperatures of the nodes of a network in its own order.
fn read_series(path: &Path, file: &NetworkFile) -> Result<(Vec<f64>, Vec<Vec<f64>>), CliError> {
    let solution = Solution::load_csv(path).map_err(PrepareError::from)?;
    let place = |label: &String| {
        solution.nodes.iter().position(|node| node.name == *label).ok_or_else(|| {
            let near = suggestion(label, solution.nodes.iter().map(|node| node.name.as_str()));
            CliError::Usage(format!(
                "{}: has no column for the node '{label}' of the network file{near}",
                path.display()
            ))
        })
    };
    let places = file.labels.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    let count = solution.nodes.len();
    let row = |row: &[f64]| places.iter().map(|place| row[*place]).collect();
    let rows = solution.temperatures.chunks_exact(count).map(row).collect();
    Ok((solution.times, rows))
}
