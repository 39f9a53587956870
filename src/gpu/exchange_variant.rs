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
    /// What patches send at first.
    Send {
        /// Whether there is sunlight.
        sun: bool,
        /// Whether there is planet infrared.
        planet_ir: bool,
        /// Whether there is reflected sunlight.
        albedo: bool,
        /// Whether the craft shadows itself.
        shadow: bool,
    },
    /// What patches absorb of what all send.
    Receive {
        /// Whether there is sunlight.
        sun: bool,
    },
}

impl ExchangeVariant {
    /// What patches send under the light of a thermal step.
    pub fn sent_under(variant: ThermalVariant) -> Self {
        let ThermalVariant { sun, planet_ir, albedo, shadow, .. } = variant;
        Self::Send { sun, planet_ir, albedo, shadow: sun && shadow }
    }

    /// Every variant in any scene.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::Rays, Self::Sky, Self::Receive { sun: false }, Self::Receive { sun: true }];
        for bits in 0..16 {
            let [sun, planet_ir, albedo, shadow] = [0, 1, 2, 3].map(|bit| bits >> bit & 1 == 1);
            if sun || !(albedo || shadow) {
                all.push(Self::Send { sun, planet_ir, albedo, shadow });
            }
        }
        all
    }

    /// Its shader, such as `exchange_send.sun.shadow`.
    pub fn shader(&self) -> Shader {
        let (entry, words) = match *self {
            Self::Rays => ("exchange_rays.comp", vec![]),
            Self::Sky => ("exchange_sky.comp", vec![]),
            Self::Send { sun, planet_ir, albedo, shadow } => (
                "exchange_send.comp",
                vec![(sun, "sun"), (planet_ir, "planet_ir"), (albedo, "albedo"), (shadow, "shadow")],
            ),
            Self::Receive { sun } => ("exchange_receive.comp", vec![(sun, "sun")]),
        };
        Shader::new(entry, words.into_iter().filter_map(|(is, word)| is.then_some(word)).collect())
    }
}
