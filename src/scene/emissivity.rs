//! `emissivity_by_angle` and `emissivity_by_wavelength`: laws of a face in the band of the images.

use super::error::SceneError;
use super::keys;
use super::quantity::Quantity;
use super::value_source::ValueSource;
use crate::thermal::emissivity::{BandEmissivity, ByAngle, ByWavelength};

const MOST_ENTRIES: usize = 10_000;

#[derive(Clone, Copy)]
enum Law {
    Fresnel,
    Table,
}

/// Reads both laws of a face.
pub(super) fn read(source: &impl ValueSource) -> Result<BandEmissivity, SceneError> {
    let by_angle = source.group("emissivity_by_angle", keys::BY_ANGLE)?;
    let by_wavelength = source.group("emissivity_by_wavelength", keys::BY_WAVELENGTH)?;
    Ok(BandEmissivity {
        by_angle: by_angle.map(|section| angle_law(&section)).transpose()?,
        by_wavelength: by_wavelength.map(|section| wavelengths(&section)).transpose()?,
    })
}

fn angle_law(section: &impl ValueSource) -> Result<ByAngle, SceneError> {
    let law = section.choice("law", &[("fresnel", Law::Fresnel), ("table", Law::Table)])?;
    let law = law.ok_or_else(|| section.error("law", "is missing: 'fresnel' with n and k, or 'table'".to_owned()))?;
    let other: &[&str] = match law {
        Law::Fresnel => &["angle_deg", "emissivity"],
        Law::Table => &["n", "k"],
    };
    for key in other {
        if !matches!(section.list(key), Ok(None)) {
            return Err(section.error(key, "belongs to the other law".to_owned()));
        }
    }
    match law {
        Law::Fresnel => {
            let number = |key: &str, least: f64, what: &str| {
                let value = section.number(key, Quantity::within(least, 1e3, ""))?;
                value.ok_or_else(|| section.error(key, format!("is missing: {what}")))
            };
            Ok(ByAngle::Fresnel {
                n: number("n", 1e-3, "the refractive index in the band")?,
                k: number("k", 0.0, "the extinction coefficient in the band, 0 for a dielectric")?,
            })
        }
        Law::Table => {
            let points = points(section, "angle_deg", "deg", f64::to_radians)?;
            let end = std::f64::consts::FRAC_PI_2;
            if points[0][0] != 0.0 || (points[points.len() - 1][0] - end).abs() > 1e-9 {
                return Err(section.error("angle_deg", "must run from 0 to 90 deg".to_owned()));
            }
            if points[0][1] <= 0.0 {
                return Err(section.error("emissivity", "must be above 0 along the normal".to_owned()));
            }
            Ok(ByAngle::Table(points))
        }
    }
}

fn wavelengths(section: &impl ValueSource) -> Result<ByWavelength, SceneError> {
    Ok(ByWavelength {
        points: points(section, "wavelength_um", "um", |wavelength| wavelength / 1e6)?,
        temperature: section.number("temperature", Quantity::within(1.0, 1e4, "K"))?,
    })
}

/// Two arrays of the same length: rising places, and the emissivity at each.
fn points(
    section: &impl ValueSource,
    key: &str,
    unit: &str,
    si: impl Fn(f64) -> f64,
) -> Result<Vec<[f64; 2]>, SceneError> {
    let list =
        |key: &str| section.list(key)?.ok_or_else(|| section.error(key, "is missing: an array of numbers".to_owned()));
    let (places, values) = (list(key)?, list("emissivity")?);
    if !(2..=MOST_ENTRIES).contains(&places.len()) {
        return Err(section.error(key, format!("must have 2 to {MOST_ENTRIES} numbers, found {}", places.len())));
    }
    if values.len() != places.len() {
        let message = format!("must have as many numbers as {key}, {}, found {}", places.len(), values.len());
        return Err(section.error("emissivity", message));
    }
    if let Some(pair) = places.windows(2).find(|pair| pair[0] >= pair[1]) {
        return Err(section.error(key, format!("must rise, found {} {unit} after {}", pair[1], pair[0])));
    }
    if let Some(place) = places.iter().find(|place| **place < 0.0) {
        return Err(section.error(key, format!("must not be below 0, found {place} {unit}")));
    }
    if let Some(value) = values.iter().find(|value| !(0.0..=1.0).contains(*value)) {
        return Err(section.error("emissivity", format!("must be in [0, 1], found {value}")));
    }
    Ok(places.into_iter().zip(values).map(|(place, value)| [si(place), value]).collect())
}
