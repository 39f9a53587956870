//! How an image is made where it is not drawn directly: from a finer image, with several samples of a pixel or through the distortion of a lens.

use super::layout;

/// An image that is made from a finer one, its source.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// Width and height of the source [texels].
    pub source: [u32; 2],
    /// Focal lengths of the source [texels].
    pub focal: [f64; 2],
    /// Principal point of the source [texels].
    pub centre: [f64; 2],
    /// Lookups along the width and height of a pixel. Radiance and coverage are their mean.
    pub lookups: [u32; 2],
    /// Samples of a texel (MSAA). The device averages their radiance and keeps the surface of the first.
    pub each: u32,
    /// Places of the pixels' corners in the source [texels], row after row. Empty without distortion.
    pub map: Vec<[f32; 2]>,
}

/// What the passes of such an image depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampled {
    /// Samples of a texel.
    pub each: u32,
    /// Whether the lens distorts.
    pub lens: bool,
    /// Rows of the image.
    pub rows: u32,
}

impl Sampling {
    /// What its passes depend on.
    pub fn passes(&self, [_, rows]: [u32; 2]) -> Sampled {
        Sampled { each: self.each, lens: !self.map.is_empty(), rows }
    }

    /// Its sizes for the shader.
    pub(super) fn sizes(&self, [width, height]: [u32; 2]) -> layout::Sampling {
        let ([source_width, source_height], [columns, rows]) = (self.source, self.lookups);
        layout::Sampling { width, height, source_width, source_height, columns, rows }
    }
}
