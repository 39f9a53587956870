//! Compute dispatches that convert a list of temperatures to band radiances, and back.

use std::sync::Arc;

use super::bindings::Bindings;
use super::context::Context;
use super::error::GpuError;
use super::layout;
use super::lists;
use super::once::Once;
use super::pass::Kernel;
use super::resource::Resource;
use super::store::Resources;
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::radiance::RadianceTable;
use crate::thermal::radiance_f32::RadianceTableF32;

const WORKGROUP: usize = 64;

/// Band table in the layout of the shader: the head, then ln G with its guard values.
pub fn band_table(table: &RadianceTableF32) -> Vec<f32> {
    let head = layout::Band { edge_high: table.edge_high, edge_low: table.edge_low };
    let mut values: Vec<f32> = bytemuck::cast_slice(&[head]).to_vec();
    values.extend_from_slice(&table.values);
    values
}

/// Radiance of a blackbody [W m-2 sr-1], one for each temperature [K].
pub fn band_radiances(
    context: &Arc<Context>,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    temperatures: &[f32],
) -> Result<Vec<f32>, GpuError> {
    let table = RadianceTableF32::new(table, guesses);
    map(context, Kernel::Blackbody, &table, temperatures, 300.0)
}

/// Temperature of a blackbody [K], one for each radiance [W m-2 sr-1]. `BrightnessTable::check` must accept the
/// radiances.
pub fn brightness_temperatures(
    context: &Arc<Context>,
    table: &RadianceTable,
    guesses: &BrightnessTable,
    radiances: &[f32],
) -> Result<Vec<f32>, GpuError> {
    let table = RadianceTableF32::new(table, guesses);
    let filler = guesses.max_radiance as f32;
    map(context, Kernel::Brightness, &table, radiances, filler)
}

/// Runs a kernel that converts a list of numbers to a list of the same length. `filler` pads the last workgroup.
fn map(
    context: &Arc<Context>,
    kernel: Kernel,
    table: &RadianceTableF32,
    input: &[f32],
    filler: f32,
) -> Result<Vec<f32>, GpuError> {
    let mut padded = input.to_vec();
    padded.resize(input.len().next_multiple_of(WORKGROUP).max(WORKGROUP), filler);
    let mut once = Once::new(context)?;
    let mut resources = Resources::new(context);
    let band = band_table(table);
    resources.make_of(Resource::BandTable, band.len())?;
    resources.upload(&mut once, Resource::BandTable, &band)?;
    resources.make_with(Resource::RadiationInput, &padded)?;
    resources.make_of(Resource::RadiationOutput, padded.len())?;
    resources.make_with(Resource::InverseTemperatures, &table.inverse_temperatures)?;
    let list = lists::radiation(kernel, (padded.len() / WORKGROUP) as u32);
    let mut bindings = Bindings::plain(context);
    bindings.add(&resources, list.passes())?;
    once.run([&list], &resources, Some(&bindings), &|_| Vec::new())?;
    Ok(resources.read(Resource::RadiationOutput, 0, input.len()).to_vec())
}
