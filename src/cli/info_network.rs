//! `isotherm info SCENE --network OUT/`: the thermal network of a scene for another program.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::network_export::write_tables;
use super::prepare::{guard, prepare_with_progress};
use super::progress::{spinner, stop_flag};
use super::reach::ReachArguments;
use crate::guard::finding::CheckEffort;
use crate::simulation::network_file::network_file;

/// Most numbers of heat.
const MOST: f64 = 1e8;

/// Writes the network of a scene into a folder.
pub(super) fn write(scene: &Path, output: &Path, force: bool, reach: ReachArguments) -> Result<(), CliError> {
    let wrong = |message: String| CliError::Usage(format!("{}: {message}", scene.display()));
    let mut prepared = prepare_with_progress(scene, reach)?;
    guard(&mut prepared, CheckEffort::NO_IMAGE);
    let Some(network) = &prepared.network else {
        return Err(wrong("has no thermal network: no material has response = \"network\"".to_owned()));
    };
    if prepared.exchange.is_some() {
        let message = "the loads of a scene with [exchange] depend on its temperatures, so they are not known beforehand; \
                       leave [exchange] out, and take the GR of isotherm view-factors --gr";
        return Err(wrong(message.to_owned()));
    }
    let numbers = network.network().len() as f64 * f64::from(prepared.scene.time.steps);
    if numbers > MOST {
        return Err(wrong(format!(
            "its heat is {numbers:.1e} numbers, {MOST:e} at most: take fewer time.steps or a larger model.max_edge"
        )));
    }
    let bar = spinner("finding the heat of the steps");
    let file = network_file(&prepared, &stop_flag(), &mut || bar.tick());
    bar.finish_and_clear();
    let Some(file) = file? else { return Ok(()) };
    let name = scene.file_name().unwrap_or_default().to_string_lossy();
    let head = [
        format!("The thermal network of {name} from time 0, as the f64 reference finds its start."),
        "The heat of a step is what surfaces absorb of Sun and planet in it, and that of heaters without thermostat."
            .to_owned(),
    ];
    let inputs: &[PathBuf] = &prepared.scene.files;
    write_tables(&file, &head, output, force, inputs)
}
