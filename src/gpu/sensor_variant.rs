//! Shader variants of `sensor_pixel.comp`. A variant has only the effects of its sensor.

use super::shaders::Shader;

/// Where the share of light of each pixel comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Vignette {
    /// All pixels have all light.
    None,
    /// The fourth power of a cosine.
    Cos4,
    /// A map.
    Map,
}

/// A variant of `sensor_pixel.comp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SensorVariant {
    /// Whether it ends a point spread, which `sensor_rows.comp` began.
    pub spread: bool,
    /// Whether it adds a halo.
    pub halo: bool,
    /// Loss of light towards the corners.
    pub vignette: Vignette,
    /// Whether the bolometer lags.
    pub lag: bool,
    /// Whether there is temporal noise.
    pub noise: bool,
    /// Whether there is a fixed pattern.
    pub pattern: bool,
    /// Whether there are bad pixels.
    pub bad: bool,
    /// Whether temperatures are counted.
    pub kelvin: bool,
}

impl SensorVariant {
    /// Every variant in any scene.
    pub fn all() -> Vec<Self> {
        let vignettes = [Vignette::None, Vignette::Cos4, Vignette::Map];
        let of = |vignette, bits: u32| {
            let is = |bit: u32| bits >> bit & 1 == 1;
            let [spread, halo, lag, noise, pattern, bad, kelvin] = [0, 1, 2, 3, 4, 5, 6].map(is);
            Self { spread, halo, vignette, lag, noise, pattern, bad, kelvin }
        };
        vignettes.into_iter().flat_map(|vignette| (0..128).map(move |bits| of(vignette, bits))).collect()
    }

    /// Its shader, such as `sensor_pixel.spread.noise`.
    pub fn shader(&self) -> Shader {
        let words = [
            (self.spread, "spread"),
            (self.halo, "halo"),
            (self.vignette == Vignette::Cos4, "cos4"),
            (self.vignette == Vignette::Map, "map"),
            (self.lag, "lag"),
            (self.noise, "noise"),
            (self.pattern, "pattern"),
            (self.bad, "bad"),
            (self.kelvin, "kelvin"),
        ];
        Shader::new("sensor_pixel.comp", words.into_iter().filter_map(|(is, word)| is.then_some(word)).collect())
    }
}
