//! `[shadows]`: the shadows that the craft casts on itself.

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;

/// Default turn of the Sun after which light is found anew [deg]: half the Sun's diameter.
const REDRAW_ANGLE_DEG: f64 = 0.25;

/// The shadows that the craft casts on itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowSettings {
    /// Largest distance between two samples of light on a surface [m]. `None` for a four hundredth of the craft.
    pub spacing: Option<f64>,
    /// Turn of the Sun or of a joint against the craft after which light is found anew [rad].
    pub redraw_angle: f64,
    /// Whether images show the edges of shadows on foil in pixels, where nodes show them in triangles.
    pub in_pixels: bool,
}

impl Default for ShadowSettings {
    fn default() -> Self {
        Self { spacing: None, redraw_angle: REDRAW_ANGLE_DEG.to_radians(), in_pixels: true }
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
    if let Some(other) = section.string("method")?.filter(|method| !["depth", "exact"].contains(method)) {
        return Err(section.error("method", format!("must be \"depth\" or \"exact\", found \"{other}\"")));
    }
    section.whole("resolution", 64..=4096)?;
    for key in ["method", "resolution"].into_iter().filter(|key| section.has(key)) {
        assumptions
            .push(format!("shadows.{key} has no effect: rays find the light on areas (spacing states how many)."));
    }
    Ok(Some(ShadowSettings {
        spacing: section.number("spacing", Quantity::positive("m"))?,
        redraw_angle: section
            .number("redraw_angle_deg", Quantity::within(0.0, 90.0, "deg"))?
            .unwrap_or(REDRAW_ANGLE_DEG)
            .to_radians(),
        in_pixels: section.boolean("in_pixels")?.unwrap_or(true),
    }))
}
