//! `[shadows]`: whether and how the craft shadows itself.

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::environment::shadow::Method;

/// Texels each way, where the scene does not say.
const RESOLUTION: u32 = 2048;
/// Angle of the Sun after which shadows are found anew, where the scene does not say [deg]: half the Sun's diameter.
const REDRAW_ANGLE_DEG: f64 = 0.25;

/// How the craft shadows itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowSettings {
    /// From a depth map or by rays.
    pub method: Method,
    /// Texels of the depth map each way.
    pub resolution: u32,
    /// Angle of the Sun against the craft after which shadows are found anew [rad].
    pub redraw_angle: f64,
}

impl Default for ShadowSettings {
    fn default() -> Self {
        Self { method: Method::Depth, resolution: RESOLUTION, redraw_angle: REDRAW_ANGLE_DEG.to_radians() }
    }
}

/// Reads `[shadows]`; without it the craft casts none.
pub(super) fn read(
    section: Option<&Section>,
    assumptions: &mut Vec<String>,
) -> Result<Option<ShadowSettings>, SceneError> {
    let Some(section) = section else {
        assumptions.push("The craft casts no shadow on itself (there is no section [shadows]).".to_owned());
        return Ok(None);
    };
    let method = match section.string("method")? {
        None | Some("depth") => Method::Depth,
        Some("exact") => Method::Exact,
        Some(other) => {
            return Err(section.error("method", format!("must be \"depth\" or \"exact\", found \"{other}\"")));
        }
    };
    if method == Method::Exact && section.has("resolution") {
        return Err(section.error("resolution", "rays have none: it belongs to method = \"depth\""));
    }
    assumptions.push(
        "What the craft takes from itself of the planet's infrared and albedo, and what it reflects onto itself, is \
         left out: [shadows] is about sunlight."
            .to_owned(),
    );
    Ok(Some(ShadowSettings {
        method,
        resolution: section.whole("resolution", 64..=4096)?.unwrap_or(RESOLUTION),
        redraw_angle: section
            .number("redraw_angle_deg", Quantity::within(0.0, 90.0, "deg"))?
            .unwrap_or(REDRAW_ANGLE_DEG)
            .to_radians(),
    }))
}
