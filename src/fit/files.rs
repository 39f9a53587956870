//! Writes a fit: values, correlations, misfits, the values as TOML, and plots.

use super::plots::{measured_plot, residual_plot};
use super::result::Fitted;
use crate::output::OutputError;
use crate::output::folder::Folder;

const VALUES: &str = "parameters.csv";
const CORRELATION: &str = "correlation.csv";
const MISFITS: &str = "misfits.csv";
const RESIDUALS: &str = "residuals.csv";
const FITTED: &str = "fitted.toml";
const JSON: &str = "fit.json";
const MEASURED_PLOT: &str = "measured.svg";
const RESIDUAL_PLOT: &str = "residuals.svg";

/// All files of the command.
pub(crate) const FILES: [&str; 8] =
    [VALUES, CORRELATION, MISFITS, RESIDUALS, FITTED, JSON, MEASURED_PLOT, RESIDUAL_PLOT];

/// Writes every file.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Folder, fitted: &Fitted) -> Result<(), OutputError> {
    folder.write_csv(VALUES, fitted.parameter_rows())?;
    folder.write_csv(CORRELATION, correlations(fitted))?;
    folder.write_csv(MISFITS, misfits(fitted))?;
    folder.write_csv(RESIDUALS, residuals(fitted))?;
    folder.write_bytes(FITTED, fitted.text.as_bytes())?;
    folder.write_json(JSON, &fitted.json())?;
    folder.write_bytes(MEASURED_PLOT, measured_plot(fitted).svg()?.as_bytes())?;
    folder.write_bytes(RESIDUAL_PLOT, residual_plot(fitted).svg()?.as_bytes())
}

/// The table of values that a terminal shows.
pub(crate) fn summary(fitted: &Fitted) -> Vec<Vec<String>> {
    let chosen = |row: Vec<String>| [0, 1, 2, 3, 4, 10].map(|column| row[column].clone()).to_vec();
    fitted.parameter_rows().into_iter().map(chosen).collect()
}

fn correlations(fitted: &Fitted) -> Vec<Vec<String>> {
    let names = || fitted.unknowns.iter().map(|unknown| unknown.name.clone());
    let head = std::iter::once("parameter".to_owned()).chain(names()).collect();
    let row = |(i, name): (usize, String)| {
        let cells = (0..fitted.unknowns.len()).map(move |j| format!("{:.6}", fitted.posterior.correlation(i, j)));
        std::iter::once(name).chain(cells).collect()
    };
    std::iter::once(head).chain(names().enumerate().map(row)).collect()
}

fn misfits(fitted: &Fitted) -> Vec<Vec<String>> {
    let head = ["kind", "name", "place", "held_out", "values", "rms_before_k", "rms_after_k", "rms_after_sigmas"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (i, group) in fitted.measurements.groups.iter().enumerate() {
        for held_out in [false, true] {
            let misfits = fitted.misfits(Some(i), held_out);
            if misfits.count > 0 {
                let numbers = [misfits.before, misfits.after, misfits.sigmas].map(|value| format!("{value:.6}"));
                let words = [group.kind.to_owned(), group.name.clone(), group.place.clone(), held_out.to_string()];
                rows.push(words.into_iter().chain([misfits.count.to_string()]).chain(numbers).collect());
            }
        }
    }
    rows
}

/// A row for each row of telemetry. `weight` is the share with which a glitch counts.
fn residuals(fitted: &Fitted) -> Vec<Vec<String>> {
    let head = ["sensor", "time", "measured_k", "sigma_k", "before_k", "after_k", "weight", "held_out"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (i, point) in fitted.measurements.points.iter().enumerate() {
        let group = &fitted.measurements.groups[point.group];
        if group.kind == "sensor" {
            let after = fitted.best.computed[i];
            let [_, weight] = fitted.loss.0.of(((after - point.value) / point.sigma).powi(2), fitted.loss.1);
            let numbers =
                [point.value, point.sigma, fitted.before[i], after, weight].map(|value| format!("{value:.6}"));
            let words = [group.name.clone(), point.time.to_string()];
            rows.push(words.into_iter().chain(numbers).chain([point.held_out.to_string()]).collect());
        }
    }
    rows
}
