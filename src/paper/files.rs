//! Names of the output files of `isotherm paper`.

use super::orbit_figures::TABLES;
use super::transitions::{JUMPS, Jump};

/// The picture of figure 7.
pub(crate) const FIGURE_7: &str = "figure7.png";
pub(crate) const CHECKS: &str = "checks.csv";
pub(crate) const INDEX: &str = "index.html";

/// CSV of a transition's temperatures.
pub(crate) fn series_name(jump: &Jump) -> String {
    format!("figure{}_{}.csv", jump.figure[0], jump.figure[1])
}

pub(crate) fn plot_name(figure: u8) -> String {
    format!("figure{figure}.svg")
}

pub(crate) fn tables() -> Vec<String> {
    TABLES.map(str::to_owned).into_iter().chain(JUMPS.iter().map(series_name)).chain([CHECKS.to_owned()]).collect()
}

pub(crate) fn own_files() -> Vec<String> {
    tables().into_iter().chain((2..=6).map(plot_name)).chain([FIGURE_7, INDEX].map(str::to_owned)).collect()
}
