//! `[exchange]`: radiation between the surfaces of the craft.

use super::Scene;
use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::exchange::step::ExchangeSettings;

/// Assumption of a scene without the section.
const ABSENT: &str =
    "No surface warms another, reflects onto it or hides the planet from it (there is no section [exchange]).";

impl Scene {
    /// Lets surfaces see each other by the defaults of `[exchange]`, where the scene has no such section.
    pub(crate) fn exchange_by_default(&mut self) {
        if self.exchange.is_none() {
            self.exchange = Some(ExchangeSettings::default());
            self.assumptions.retain(|text| text != ABSENT);
            self.assumptions.push(
                "Patches and rays are those of the defaults of [exchange], which the scene does not have.".to_owned(),
            );
        }
    }
}

/// Most reflections that a scene can state.
const MOST_BOUNCES: u32 = 1000;

/// Reads `[exchange]`. Without the section surfaces do not see each other.
pub(super) fn read(
    section: Option<&Section>,
    has_shadows: bool,
    assumptions: &mut Vec<String>,
) -> Result<Option<ExchangeSettings>, SceneError> {
    let Some(section) = section else {
        assumptions.push(ABSENT.to_owned());
        return Ok(None);
    };
    let patch_edge = section.number("patch_edge", Quantity::positive("m"))?;
    let default = ExchangeSettings::default();
    let bounces = match section.string("bounces") {
        Ok(None | Some("all")) => None,
        Ok(Some(other)) => {
            return Err(section.error("bounces", format!("must be \"all\" or a whole number, found \"{other}\"")));
        }
        Err(_) => section.whole("bounces", 0..=MOST_BOUNCES)?,
    };
    let specular_sunlight = section.boolean("specular_sunlight")?.unwrap_or(default.specular_sunlight);
    let mirrored = if specular_sunlight { ", but mirror direct sunlight once" } else { "" };
    assumptions.push(format!(
        "[exchange]: patches send alike from all of their surface and reflect diffusely{mirrored}. What arrives from other patches is what they are expected to send in the middle of a step."
    ));
    if !has_shadows {
        assumptions.push("Sunlight reaches surfaces that others hide (there is no section [shadows]).".to_owned());
    }
    Ok(Some(ExchangeSettings {
        rays: section.whole("rays", 1..=65_536)?.unwrap_or(default.rays),
        patch_edge,
        bounces,
        redraw_angle: section
            .number("redraw_angle_deg", Quantity::within(0.0, 90.0, "deg"))?
            .map_or(default.redraw_angle, f64::to_radians),
        specular_sunlight,
        hold: section.number("hold", Quantity::within(0.0, 3600.0, "s"))?,
    }))
}
