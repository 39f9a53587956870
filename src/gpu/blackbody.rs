//! Compute dispatches that convert a list of temperatures to band radiances, and back.

use std::sync::Arc;

use super::bindings::Bindings;
use super::context::Context;
use super::effects::image::resources::BAND_TABLE;
use super::error::GpuError;
use super::layout;
use super::lists;
use super::lists::{INVERSE_TEMPERATURES, RADIATION_INPUT, RADIATION_OUTPUT};
use super::once::Once;
use super::pass::Frame;
use super::store::Resources;
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::radiance::RadianceTable;

const WORKGROUP: usize = 64;

/// Band table in the layout of the shader: c2 / lambda_max rounded to f32, the remainder, then ln G with its guard values.
pub fn band_table(table: &RadianceTable) -> Vec<f32> {
    let edge_high = table.edge_temperature as f32;
    let edge_low = (table.edge_temperature - f64::from(edge_high)) as f32;
    let head = layout::Band { edge_high, edge_low };
    let mut values: Vec<f32> = bytemuck::cast_slice(&[head]).to_vec();
    values.extend(table.values.iter().map(|&value| value as f32));
    values
}

/// Radiance of a blackbody [W m-2 sr-1], one for each temperature [K].
pub fn band_radiances(
    context: &Arc<Context>,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    temperatures: &[f32],
) -> Result<Vec<f32>, GpuError> {
    map(context, lists::radiances, (table, guesses), temperatures, 300.0)
}

/// Temperature of a blackbody [K], one for each radiance [W m-2 sr-1]. `BrightnessTable::check` must accept the
/// radiances.
pub fn brightness_temperatures(
    context: &Arc<Context>,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    radiances: &[f32],
) -> Result<Vec<f32>, GpuError> {
    map(context, lists::brightnesses, (table, guesses), radiances, guesses.max_radiance as f32)
}

/// Runs a list that converts a list of numbers to a list of the same length. `filler` pads the last workgroup.
fn map(
    context: &Arc<Context>,
    list: fn(u32) -> Frame,
    (table, guesses): (&RadianceTable, &BrightnessTable),
    input: &[f32],
    filler: f32,
) -> Result<Vec<f32>, GpuError> {
    let mut padded = input.to_vec();
    padded.resize(input.len().next_multiple_of(WORKGROUP).max(WORKGROUP), filler);
    let mut once = Once::new(context)?;
    let mut resources = Resources::new(context);
    let band = band_table(table);
    resources.make_of(&BAND_TABLE, band.len())?;
    resources.upload(&mut once, &BAND_TABLE, &band)?;
    resources.make_with(&RADIATION_INPUT, &padded)?;
    resources.make_of(&RADIATION_OUTPUT, padded.len())?;
    let inverse_temperatures: Vec<f32> = guesses.inverse_temperatures.iter().map(|&inverse| inverse as f32).collect();
    resources.make_with(&INVERSE_TEMPERATURES, &inverse_temperatures)?;
    let list = list((padded.len() / WORKGROUP) as u32);
    let mut bindings = Bindings::plain(context);
    bindings.add(&resources, list.passes())?;
    once.run([&list], &resources, Some(&bindings))?;
    Ok(resources.read(&RADIATION_OUTPUT, 0, input.len()).to_vec())
}
