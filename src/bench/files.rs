//! Writes the output files of `isotherm bench`.

use super::page::page;
use super::plots;
use super::record::Bench;
use crate::output::OutputError;
use crate::output::folder::Folder;
use crate::output::report::write_plots;

/// All numbers as JSON.
pub const RECORD: &str = "bench.json";
/// The page.
pub const PAGE: &str = "report.html";
/// All files.
pub const OWN: [&str; 3] = [RECORD, PAGE, "plots/*.svg"];

/// Writes everything.
pub fn write_bench_files(folder: &Folder, bench: &Bench) -> Result<(), OutputError> {
    let diagrams = plots::all(bench)?;
    write_plots(folder, &diagrams)?;
    folder.write_json(RECORD, bench)?;
    folder.write_bytes(PAGE, page(bench, &diagrams).as_bytes())
}
