//! What the pixels of a scene's images show.

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
    /// Dispatches that follow a path of light one after the other, 0 without `traced`.
    pub dispatches: u32,
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
    /// Whether pixels of foil have light of their own.
    pub in_pixels: bool,
}

impl RadianceVariant {
    /// Emission alone, before a sky of no radiance.
    pub const PLAIN: Self = Self {
        reflections: false,
        rough: false,
        smooth: false,
        traced: false,
        dispatches: 0,
        sun: false,
        apart: false,
        background: false,
        tables: false,
        map: false,
        crinkled: false,
        in_pixels: false,
    };

    /// Whether a pixel of a surface needs its normal.
    pub(crate) fn needs_normals(&self) -> bool {
        self.reflections || self.tables
    }

    /// Whether a pixel needs the surroundings of the craft.
    pub(crate) fn sees_surroundings(&self) -> bool {
        self.reflections || self.background
    }
}
