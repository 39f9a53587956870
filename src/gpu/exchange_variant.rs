//! Shader variants of the passes of radiation between surfaces.

use super::shaders::Shader;
use super::variant::ThermalVariant;

/// A pass of radiation between surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ExchangeVariant {
    /// Casts the rays of patches.
    Rays,
    /// Finds the shares of the planet's light that patches see.
    Sky,
    /// What patches reflect of Sun and planet at first.
    Light {
        /// Whether there is sunlight.
        sun: bool,
        /// Whether there is planet infrared.
        planet_ir: bool,
        /// Whether there is reflected sunlight.
        albedo: bool,
        /// Whether the craft shadows itself.
        shadow: bool,
        /// Whether patches mirror sunlight.
        mirrors: bool,
    },
    /// What patches receive of the sunlight that others mirror.
    Mirror,
    /// What patches absorb of the sunlight that all reflect.
    Reflected {
        /// Whether patches mirror sunlight.
        mirrors: bool,
    },
    /// Infrared that patches send at first.
    Send {
        /// Whether there is planet infrared.
        planet_ir: bool,
    },
    /// What patches absorb of what all send.
    Receive {
        /// Whether there is sunlight.
        sun: bool,
    },
}

impl ExchangeVariant {
    /// What patches reflect under the light of a thermal step.
    pub fn light(variant: ThermalVariant, mirrors: bool) -> Self {
        let ThermalVariant { sun, planet_ir, albedo, shadow, .. } = variant;
        Self::Light { sun, planet_ir, albedo, shadow: sun && shadow, mirrors: sun && mirrors }
    }

    /// Every variant in any scene.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::Rays, Self::Sky, Self::Mirror];
        for is in [false, true] {
            all.extend([Self::Send { planet_ir: is }, Self::Receive { sun: is }, Self::Reflected { mirrors: is }]);
        }
        for bits in 0..32 {
            let [sun, planet_ir, albedo, shadow, mirrors] = [0, 1, 2, 3, 4].map(|bit| bits >> bit & 1 == 1);
            if sun || !(albedo || shadow || mirrors) {
                all.push(Self::Light { sun, planet_ir, albedo, shadow, mirrors });
            }
        }
        all
    }

    /// Its shader, such as `exchange_light.sun.shadow`.
    pub fn shader(&self) -> Shader {
        let (entry, words) = match *self {
            Self::Rays => ("exchange_rays.comp", vec![]),
            Self::Sky => ("exchange_sky.comp", vec![]),
            Self::Light { sun, planet_ir, albedo, shadow, mirrors } => (
                "exchange_light.comp",
                vec![
                    (sun, "sun"),
                    (planet_ir, "planet_ir"),
                    (albedo, "albedo"),
                    (shadow, "shadow"),
                    (mirrors, "mirrors"),
                ],
            ),
            Self::Mirror => ("exchange_mirror.comp", vec![]),
            Self::Reflected { mirrors } => ("exchange_receive.comp", vec![(true, "reflected"), (mirrors, "mirrors")]),
            Self::Send { planet_ir } => ("exchange_send.comp", vec![(planet_ir, "planet_ir")]),
            Self::Receive { sun } => ("exchange_receive.comp", vec![(sun, "sun")]),
        };
        Shader::new(entry, words.into_iter().filter_map(|(is, word)| is.then_some(word)).collect())
    }
}
