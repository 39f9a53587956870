//! `isotherm network import`: the CSV files of an s2e-core thermal model as a network file.

use std::path::PathBuf;

use super::error::CliError;
use crate::output::folder::{keep_inputs, write_bytes};
use crate::scene::network::import::import;

/// Turn the thermal CSV files of s2e-core into a network file.
///
/// DIR holds node.csv, cij.csv, rij.csv and, where there are any, heaters.csv and heatload.csv, as s2e-core reads them
/// (ut-issl/s2e-core, settings/sample_satellite/thermal_csv_files). What the network file cannot say is printed: solar
/// load on node normals is left out, and heat tables are not repeated after their last time.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  isotherm network import thermal_csv_files/ -o network.toml")]
pub struct Arguments {
    /// Folder with the CSV files
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Network file that is written
    #[arg(short, long, value_name = "FILE.toml")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let imported = import(&arguments.folder).map_err(CliError::Usage)?;
    for note in &imported.notes {
        eprintln!("assumed: {note}");
    }
    let read =
        ["node.csv", "cij.csv", "rij.csv", "heaters.csv", "heatload.csv"].map(|name| arguments.folder.join(name));
    keep_inputs(&arguments.output, &read)?;
    Ok(write_bytes(&arguments.output, imported.text.as_bytes())?)
}
