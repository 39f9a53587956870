//! How an image is made where it is not drawn directly: from a finer image, with several samples of a pixel, through the distortion of a lens, or row after row.

use crate::gpu::layout;

/// How an image is made that a device does not simply draw.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// Width and height of the image that is drawn with one sample of a pixel [texels]: the image itself, or a finer one with a distorting lens.
    pub(crate) drawn: [u32; 2],
    /// Focal lengths in it [texels].
    pub(crate) focal: [f64; 2],
    /// Principal point in it [texels].
    pub(crate) centre: [f64; 2],
    /// Places of the pixels' corners in it [texels], row after row. Empty without distortion.
    pub map: Vec<[f32; 2]>,
    /// How the mean over several samples is made from a finer image. `None` where none is drawn.
    pub mean: Option<Mean>,
    /// Samples of a pixel that are drawn one after another and gathered. 1 where no image is gathered.
    pub gathered: u32,
    /// The rolling shutter, with its rows but without poses. `None` if all rows see one pose.
    pub shutter: Option<(RowOf, layout::Shutter)>,
    /// Whether the craft may be so far away that its image is made from a crop.
    pub(crate) distant: bool,
    /// Whether a point spread reads the texels in the pixels.
    pub(crate) fine: bool,
    /// Whether the image may be the mean over the sub-frames of an exposure.
    pub(crate) exposed: bool,
}

/// The image from which the mean over the samples of a pixel is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mean {
    /// Its width and height [texels].
    pub size: [u32; 2],
    /// Lookups along the width and height of a pixel.
    pub(crate) lookups: [u32; 2],
    /// Samples of a texel (MSAA), which the device averages.
    pub each: u32,
}

/// Distortion through which a point finds its row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowOf {
    /// None.
    Pinhole,
    /// Brown-Conrady.
    Brown,
    /// Fisheye.
    Fisheye,
}

impl RowOf {
    /// Words of the shaders with a rolling shutter.
    pub(crate) fn words(self) -> Vec<&'static str> {
        match self {
            Self::Pinhole => vec!["rolling"],
            Self::Brown => vec!["rolling", "brown"],
            Self::Fisheye => vec!["rolling", "fisheye"],
        }
    }
}

/// What the passes of such an image depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampled {
    /// Whether the lens distorts.
    pub lens: bool,
    /// Samples of a texel of the image from which the mean over several samples is made.
    pub mean: Option<u32>,
    /// Samples of a pixel that are drawn one after another and gathered.
    pub gathered: u32,
    /// How a point finds its row with a rolling shutter.
    pub shutter: Option<RowOf>,
    /// Rows of the image.
    pub rows: u32,
    /// Where the craft stands.
    pub distance: Distance,
    /// Whether the texels in the pixels are kept for a point spread.
    pub fine: bool,
    /// Whether the image may be the mean over the sub-frames of an exposure.
    pub exposed: bool,
}

/// A sub-frame of an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SubFrame {
    /// Its number in the order in which they are drawn.
    pub number: u32,
    /// Number of all.
    pub count: u32,
}

impl SubFrame {
    /// Whether the exposure ends with it.
    pub(crate) fn is_last(self) -> bool {
        self.number + 1 == self.count
    }
}

/// Whether an image is made from a crop around the craft.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Distance {
    /// No image of the scene is.
    #[default]
    Near,
    /// Some image of the scene is, and not this one.
    MayBeFar,
    /// This one is.
    Far,
}

impl Sampled {
    /// Whether the image is computed from drawn ones.
    pub(crate) fn is_resampled(&self) -> bool {
        self.lens || self.mean.is_some() || self.gathered > 1 || self.distance != Distance::Near || self.exposed
    }
}

impl Sampled {
    /// The same for an image that is made from a crop.
    pub(crate) fn far(self) -> Self {
        Self { mean: None, gathered: 1, distance: Distance::Far, ..self }
    }
}

impl Sampling {
    /// What its passes depend on.
    pub(crate) fn passes(&self, [_, rows]: [u32; 2]) -> Sampled {
        let shutter = self.shutter.map(|(row_of, _)| row_of);
        let distance = if self.distant { Distance::MayBeFar } else { Distance::Near };
        Sampled {
            lens: !self.map.is_empty(),
            mean: self.mean.map(|mean| mean.each),
            gathered: self.gathered,
            shutter,
            rows,
            distance,
            fine: self.fine,
            exposed: self.exposed,
        }
    }

    /// Width and height of the largest image that is drawn [texels].
    pub(crate) fn largest(&self) -> [u32; 2] {
        self.mean.map_or(self.drawn, |mean| mean.size)
    }

    /// Its sizes for the shader.
    pub(crate) fn sizes(&self, [width, height]: [u32; 2]) -> layout::Sampling {
        let ([source_width, source_height], [columns, rows]) =
            (self.largest(), self.mean.map_or([1; 2], |mean| mean.lookups));
        layout::Sampling { width, height, source_width, source_height, columns, rows }
    }
}
