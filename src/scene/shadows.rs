//! `[shadows]`: the method and resolution of the shadows that the craft casts on itself.

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::environment::shadow::ShadowMethod;

/// Default texels along each side.
const RESOLUTION: u32 = 2048;
/// Default Sun angle after which shadows are computed again [deg]: half the Sun's diameter.
const REDRAW_ANGLE_DEG: f64 = 0.25;

/// The shadows that the craft casts on itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowSettings {
    /// Depth map or rays.
    pub method: ShadowMethod,
    /// Texels of the depth map along each side.
    pub resolution: u32,
    /// Sun angle relative to the craft after which shadows are computed again [rad].
    pub redraw_angle: f64,
}

impl Default for ShadowSettings {
    fn default() -> Self {
        Self { method: ShadowMethod::Depth, resolution: RESOLUTION, redraw_angle: REDRAW_ANGLE_DEG.to_radians() }
    }
}

/// Reads `[shadows]`. Without the section the craft casts no shadows.
pub(super) fn read(
    section: Option<&Section>,
    assumptions: &mut Vec<String>,
) -> Result<Option<ShadowSettings>, SceneError> {
    let Some(section) = section else {
        assumptions.push("The craft casts no shadow on itself (there is no section [shadows]).".to_owned());
        return Ok(None);
    };
    let method = match section.string("method")? {
        None | Some("depth") => ShadowMethod::Depth,
        Some("exact") => ShadowMethod::Exact,
        Some(other) => {
            return Err(section.error("method", format!("must be \"depth\" or \"exact\", found \"{other}\"")));
        }
    };
    if method == ShadowMethod::Exact && section.has("resolution") {
        return Err(section.clash("resolution", &["method"], "rays have none: it belongs to method = \"depth\""));
    }
    Ok(Some(ShadowSettings {
        method,
        resolution: section.whole("resolution", 64..=4096)?.unwrap_or(RESOLUTION),
        redraw_angle: section
            .number("redraw_angle_deg", Quantity::within(0.0, 90.0, "deg"))?
            .unwrap_or(REDRAW_ANGLE_DEG)
            .to_radians(),
    }))
}
