//! Checks of the emissivities in the band of the images, when a scene is prepared.

use super::prepare_error::PrepareError;
use super::visible::laws_in_band;
use crate::model::Model;
use crate::scene::Scene;
use crate::thermal::emissivity::BandEmissivity;
use crate::thermal::emissivity_table::EmissivityTable;
use crate::thermal::material::{Material, Sides};

/// Difference between the mean of a law over the hemisphere and the emissivity of the energy balance, from which on a warning says so.
const NOTABLE: f64 = 0.05;
/// Temperature at which both are compared where the law depends on it [K].
const ROOM: f64 = 300.0;

/// Gives each band of a scene the laws of its materials, checks them, and returns warnings. The materials get the laws of the first band.
///
/// # Errors
/// A law that does not cover its band, exceeds 1, or stands beside a rolling shutter.
pub(super) fn check_bands(
    scene: &mut Scene,
    model: &Model,
    materials: &mut [Material],
) -> Result<Vec<String>, PrepareError> {
    if scene.bands.is_empty() {
        return check(scene, materials);
    }
    let mut warnings = Vec::new();
    let stated = materials.to_vec();
    for index in (0..scene.bands.len()).rev() {
        let (in_band, told) = laws_in_band(&scene.bands[index], model, &stated);
        materials.iter_mut().zip(&in_band).for_each(|(material, law)| material.in_band.clone_from(law));
        scene.bands[index].in_band = in_band;
        scene.assumptions.extend(told);
        warnings.extend(check(&scene.in_band(index), materials)?);
    }
    Ok(warnings)
}

/// Checks the laws of all materials, and returns warnings.
///
/// # Errors
/// A law that does not cover the band, exceeds 1, or stands beside a rolling shutter.
fn check(scene: &Scene, materials: &[Material]) -> Result<Vec<String>, PrepareError> {
    let mut warnings = Vec::new();
    for material in materials {
        let faces = match material.sides {
            Sides::Outside => 1,
            Sides::Both { .. } => 2,
        };
        let thermal = [material.front.emissivity, material.back().emissivity];
        for (face, (law, thermal)) in material.in_band.iter().zip(thermal).take(faces).enumerate() {
            if law.is_plain() {
                continue;
            }
            let name = if face == 0 { material.name.clone() } else { format!("{}, back", material.name) };
            let failed = |message: String| PrepareError::Emissivity {
                path: scene.source.clone(),
                material: name.clone(),
                message,
            };
            warnings.extend(check_face(scene, law, thermal, &name).map_err(failed)?);
        }
    }
    Ok(warnings)
}

fn check_face(scene: &Scene, law: &BandEmissivity, thermal: f64, name: &str) -> Result<Option<String>, String> {
    if let Some(by_wavelength) = law.by_wavelength.as_ref().filter(|law| !law.covers(scene.band)) {
        let ends = [by_wavelength.points.first(), by_wavelength.points.last()];
        let [first, last] = ends.map(|point| point.map_or(0.0, |point| (point[0] * 1e10).round() / 1e4));
        return Err(format!(
            "emissivity_by_wavelength runs from {first} to {last} um and must cover the band, {}",
            scene.band
        ));
    }
    let table = EmissivityTable::new(law, thermal, scene.passband());
    if table.largest() > 1.0 + 1e-9 {
        return Err(format!(
            "emissivity_by_angle and emissivity_by_wavelength together exceed 1 (Kirchhoff's law): their product reaches {:.3}",
            table.largest()
        ));
    }
    let Some(by_angle) = &law.by_angle else { return Ok(None) };
    let along_normal = if law.by_wavelength.is_some() { by_angle.at(1.0) } else { 1.0 };
    let mean = table.temperature_factor(ROOM) * by_angle.hemispherical() / along_normal;
    Ok(((mean - thermal).abs() > NOTABLE).then(|| {
        format!(
            "material '{name}': the mean of emissivity_by_angle over the hemisphere is {mean:.3} in the band, and the energy balance uses \
             emissivity = {thermal}"
        )
    }))
}
