//! Directions (`"+Z"` or `[x, y, z]`) and quaternions (scalar first) in a scene file.

use glam::{DQuat, DVec3};

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;

/// The axes of a frame with their names, which are also the normals of a cube.
pub(crate) const AXES: [(&str, DVec3); 6] = [
    ("+X", DVec3::X),
    ("-X", DVec3::NEG_X),
    ("+Y", DVec3::Y),
    ("-Y", DVec3::NEG_Y),
    ("+Z", DVec3::Z),
    ("-Z", DVec3::NEG_Z),
];

/// Sine of the angle below which two directions count as parallel. Parallel directions span no frame.
const PARALLEL: f64 = 1e-6;

/// Largest error of a quaternion's length. Three digits for each component are enough.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// A unit vector from an axis name or from three numbers. The length of the numbers must not be 0.
pub(super) fn axis(section: &Section, key: &str) -> Result<Option<DVec3>, SceneError> {
    if !section.has(key) {
        return Ok(None);
    }
    if section.stands_in(key) {
        return Ok(Some(AXES[key.len() % AXES.len()].1));
    }
    if section.is_array(key) {
        return direction(section, key);
    }
    let word = section.string(key)?.unwrap_or_default();
    let axis = AXES.iter().find(|(name, _)| *name == word).map(|(_, axis)| *axis);
    axis.map(Some).ok_or_else(|| {
        section.error(key, format!("'{word}' is no axis: write one of +X, -X, +Y, -Y, +Z, -Z, or [x, y, z]"))
    })
}

/// A unit vector from three numbers. Their length must not be 0.
pub(super) fn direction(section: &Section, key: &str) -> Result<Option<DVec3>, SceneError> {
    let Some(numbers) = section.numbers::<3>(key, Quantity::any(""))? else {
        return Ok(None);
    };
    // Scaling comes first, because the squares of extreme components leave the range of f64.
    let largest = numbers.iter().fold(0.0_f64, |largest, number| largest.max(number.abs()));
    if largest == 0.0 {
        return Err(section.error(key, "is no direction: its length is 0"));
    }
    let scaled = DVec3::from_array(numbers.map(|number| number / largest));
    Ok(Some(scaled.normalize()))
}

pub(super) fn point(section: &Section, key: &str) -> Result<Option<DVec3>, SceneError> {
    if section.stands_in(key) {
        // Two points that stand in differ.
        return Ok(Some(DVec3::new(key.len() as f64, 1.0, 2.0)));
    }
    Ok(section.numbers::<3>(key, Quantity::any("m"))?.map(DVec3::from_array))
}

/// Whether two unit vectors are nearly parallel or opposite.
pub(super) fn parallel(a: DVec3, b: DVec3) -> bool {
    a.cross(b).length() < PARALLEL
}

/// Reads a rotation `[w, x, y, z]`, whose length must be 1 to three digits. A normalisation is reported.
pub(super) fn quaternion(
    section: &Section,
    key: &str,
    assumptions: &mut Vec<String>,
) -> Result<Option<DQuat>, SceneError> {
    if section.stands_in(key) {
        return Ok(Some(DQuat::IDENTITY));
    }
    let Some([w, x, y, z]) = section.numbers::<4>(key, Quantity::any(""))? else {
        return Ok(None);
    };
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    let length = quaternion.length();
    if (length - 1.0).abs() > QUATERNION_TOLERANCE {
        let message = format!("must be a unit quaternion [w, x, y, z], scalar first; its length is {length}");
        return Err(section.error(key, message));
    }
    if (length - 1.0).abs() > 1e-9 {
        assumptions.push(format!("A quaternion of length {length} ({key}) is normalised."));
    }
    Ok(Some(quaternion.normalize()))
}
