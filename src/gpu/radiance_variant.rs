//! Shader variants of the image: what a scene's pixels show.

use super::sampling::RowOf;
use super::shaders::Shader;

/// A variant of `radiance.vert`, `radiance.frag` and `background.frag`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct RadianceVariant {
    /// Whether surfaces reflect their surroundings.
    pub reflections: bool,
    /// Whether some of them are rough mirrors, which needs `reflections`.
    pub rough: bool,
    /// Whether some of them are smooth mirrors, which needs `reflections`.
    pub smooth: bool,
    /// Whether they reflect the craft itself too, which needs `reflections`.
    pub traced: bool,
    /// Whether the Sun shines in the band.
    pub sun: bool,
    /// Whether the reflected part is an output of its own, which needs `reflections`.
    pub apart: bool,
    /// Whether the sky is drawn behind the craft.
    pub background: bool,
    /// Whether emissivities depend on angle and temperature.
    pub tables: bool,
    /// Whether the planet is not uniform, which needs `reflections` or `background`.
    pub map: bool,
    /// Whether it has normals of its own, which needs `reflections` or `tables`.
    pub crinkled: bool,
}

impl RadianceVariant {
    /// Emission alone, before nothing.
    pub const PLAIN: Self = Self {
        reflections: false,
        rough: false,
        smooth: false,
        traced: false,
        sun: false,
        apart: false,
        background: false,
        tables: false,
        map: false,
        crinkled: false,
    };

    /// The vertex shader and the fragment shader of the craft. `mean` are the samples of a texel of a mean, and `shutter` is how a point finds its row with a
    /// rolling shutter.
    pub fn shaders(&self, mean: Option<u32>, shutter: Option<RowOf>) -> [Shader; 2] {
        let words = [
            (self.reflections, "reflections"),
            (self.rough, "rough"),
            (self.smooth, "smooth"),
            (self.traced, "traced"),
            (self.reflections && self.sun, "sun"),
            (self.apart, "apart"),
            (self.tables, "tables"),
            (self.reflections && self.map, "map"),
        ];
        let words = words.into_iter().filter(|(present, _)| *present).map(|(_, word)| word);
        let words = words.chain(words_of_mean(mean).iter().copied()).collect();
        let normals = self.needs_normals().then_some("normals");
        let multiple = mean.filter(|each| *each > 1).map(|_| "multiple");
        let of_vertex = normals.into_iter().chain(multiple).chain(shutter.map(RowOf::words).unwrap_or_default());
        let of_vertex = of_vertex.collect();
        [Shader::new("radiance.vert", of_vertex), Shader::new("radiance.frag", words)]
    }

    /// The vertex shader and the fragment shader of the sky.
    pub fn background(&self, mean: Option<u32>) -> [Shader; 2] {
        let words = [(self.traced, "traced"), (self.sun, "sun"), (self.map, "map")];
        let words = words.into_iter().filter_map(|(has, word)| has.then_some(word));
        let words = words.chain(words_of_mean(mean).iter().copied()).collect();
        [Shader::new("background.vert", Vec::new()), Shader::new("background.frag", words)]
    }

    /// The shader that adds what surfaces reflect of the craft itself. `several`: to the mean over several samples of a pixel.
    pub fn traced(&self, several: bool) -> Shader {
        let words = [
            (self.rough, "rough"),
            (self.smooth, "smooth"),
            (self.sun, "sun"),
            (self.apart, "apart"),
            (self.tables, "tables"),
            (self.map, "map"),
            (several, "several"),
        ];
        let words = words.into_iter().filter_map(|(has, word)| has.then_some(word)).collect();
        Shader::new("traced.comp", words)
    }

    /// The shader that makes an image from a crop around a craft that is far away.
    pub fn distant(&self) -> Shader {
        let words = [(true, "sky"), (self.sun, "sun"), (self.map, "map")];
        let words = words.into_iter().filter(|(has, _)| *has && self.background);
        Shader::new("distant.comp", words.map(|(_, word)| word).collect())
    }

    /// Whether a pixel of a surface needs its normal.
    pub fn needs_normals(&self) -> bool {
        self.reflections || self.tables
    }

    /// Whether a pixel needs the surroundings of the craft.
    pub fn sees_surroundings(&self) -> bool {
        self.reflections || self.background
    }

    /// Every variant in any scene.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::default(), Self { background: true, ..Self::default() }];
        all.push(Self { background: true, sun: true, ..Self::default() });
        for [rough, smooth] in [[false, false], [false, true], [true, false], [true, true]] {
            for number in 0..8 {
                let [sun, apart, background] = [1, 2, 4].map(|bit| number & bit != 0);
                let plain = Self { rough, smooth, sun, apart, background, reflections: true, ..Self::default() };
                all.extend([plain, Self { map: true, ..plain }]);
                all.push(Self { traced: true, map: apart, ..plain });
            }
        }
        all.extend([false, true].map(|sun| Self { background: true, map: true, sun, ..Self::default() }));
        let crinkled = Self { reflections: true, crinkled: true, ..Self::default() };
        all.iter().flat_map(|shows| [*shows, Self { tables: true, ..*shows }]).chain([crinkled]).collect()
    }
}

/// Words of a mean with this number of samples of a texel.
fn words_of_mean(mean: Option<u32>) -> &'static [&'static str] {
    match mean {
        None => &[],
        Some(1) => &["mean"],
        Some(_) => &["mean", "multiple"],
    }
}
