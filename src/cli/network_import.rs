//! `isotherm network import`: converts an s2e-core thermal model to a network file.

use std::path::PathBuf;

use super::error::CliError;
use crate::output::console::say;
use crate::output::destination::{Destination, destinations};
use crate::output::inputs::keep_inputs;
use crate::scene::network::import::import;

/// Convert the thermal CSV files of s2e-core to a network file.
///
/// DIR holds node.csv, cij.csv, rij.csv and optionally heaters.csv and heatload.csv, in the format of s2e-core
/// (ut-issl/s2e-core, settings/sample_satellite/thermal_csv_files). The command prints what a network file cannot hold.
/// It leaves out solar load on node normals. Heat tables do not repeat after their last time.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  isotherm network import thermal_csv_files/ -o network.toml")]
pub struct Arguments {
    /// Folder with the CSV files
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Network file to write, or - for standard output
    #[arg(short, long, value_name = "FILE.toml")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let imported = import(&arguments.folder).map_err(CliError::Usage)?;
    for note in &imported.notes {
        say!("assumed: {note}");
    }
    let read =
        ["node.csv", "cij.csv", "rij.csv", "heaters.csv", "heatload.csv"].map(|name| arguments.folder.join(name));
    keep_inputs(&arguments.output, &read)?;
    let [output] = destinations([Some(&*arguments.output)])?;
    Ok(output.unwrap_or(Destination::StandardOutput).write_bytes(imported.text.as_bytes())?)
}
