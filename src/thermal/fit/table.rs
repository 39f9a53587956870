//! A table made from all rows, whose error is measured with every second row.

use super::data::FitData;
use super::response::{Fit, FittedResponse};
use crate::thermal::function::{Function, FunctionError, FunctionKind, TemperatureSample};
use crate::thermal::material::Domain;

/// The table of all rows. The errors are measured with a table of every second row, at the other rows, because a table meets its own rows
/// exactly.
///
/// # Errors
/// Data from which no table can be made: noise that changes direction, or a last rate that never leads to a given target.
pub(super) fn fit(data: &FitData, samples: &[TemperatureSample]) -> Result<Fit, FunctionError> {
    let last = samples.len() - 1;
    let kept: Vec<TemperatureSample> =
        samples.iter().enumerate().filter(|(row, _)| row % 2 == 0 || *row == last).map(|(_, row)| *row).collect();
    let others: Vec<[f64; 2]> = data.rows.iter().step_by(2).copied().filter(|row| row[0] < data.last_time()).collect();
    // The table of all rows comes first, because its error names the row of the data.
    let whole = response(data, samples)?;
    let half = Fit::new(response(data, &kept)?, kept.len(), data, &others, Vec::new());
    Ok(Fit { response: whole, ..half })
}

fn response(data: &FitData, samples: &[TemperatureSample]) -> Result<FittedResponse, FunctionError> {
    let function = Function::table(samples, data.target)?;
    // The last row of a table that continues to its target is at the second knot.
    let left_at_last_row = match &function {
        Function::Shaped(shape) => match &shape.kind {
            FunctionKind::Table(measured) if measured.len() > samples.len() => measured.knots()[1],
            _ => 0.0,
        },
        _ => 0.0,
    };
    let last = samples.last().map_or(data.initial, |row| row.temperature);
    Ok(FittedResponse {
        function,
        domain: Domain::Temperature,
        t_max: data.last_time() / (1.0 - left_at_last_row),
        initial: data.initial,
        target: data.target.unwrap_or(last),
    })
}
