//! What a frame is asked for, and what it leaves.

use super::effects::image::sampling::SubFrame;
use super::layout;
use super::pass::Frame;
use crate::environment::StepLoad;

/// The heaters of a network over a step.
#[derive(Debug, Clone, Copy)]
pub struct Heating<'a> {
    /// Start of the step [s].
    pub(crate) start: f64,
    /// Mean power of each heater while it is on [W].
    pub(crate) powers: &'a [f64],
}

/// The tree for reflections of the craft, and the rays of an image.
#[derive(Clone, Copy)]
pub struct TracedTree<'a> {
    /// Rays, without the sizes of the image.
    pub(crate) settings: layout::Tracing,
    /// Boxes of the tree.
    pub(crate) boxes: &'a [layout::ShadowBox],
    /// Its triangles, always in the same order.
    pub(crate) triangles: &'a [layout::ShadowTriangle],
    /// A number that changes with the tree.
    pub(crate) version: u64,
}

/// What the pixels of an image show.
#[derive(Default, Clone, Copy)]
pub enum PixelSource<'a> {
    /// The nodes in the views.
    #[default]
    Nodes,
    /// A crop of a craft that is far away, which the views show, and how it is put into the pixels.
    Crop(layout::Distant),
    /// The nodes, with light of their own in some pixels: the values of `PixelChanges`.
    Changed(&'a [[f32; 2]]),
}

impl PixelSource<'_> {
    /// Whether the image is made from a crop.
    pub(crate) fn is_crop(&self) -> bool {
        matches!(self, Self::Crop(_))
    }
}

/// Work and outputs of a frame.
#[derive(Default, Clone, Copy)]
pub struct Request<'a> {
    /// Load of the nodes, and its duration [steps].
    pub step: Option<(&'a StepLoad, f64)>,
    /// Views of the image, one for the body and one for each joint. The view of a joint is relative to the joint's
    /// frame. Without views, nothing is drawn.
    pub views: &'a [layout::View],
    /// The rolling shutter for each of the views. A view belongs to the first row. Empty if all rows see one pose.
    /// With them stands how the sky turns while the rows are taken, where pixels show it.
    pub shutters: (&'a [layout::Shutter], Option<layout::ShutterSky>),
    /// Whether the host reads the temperatures of all nodes.
    pub temperatures: bool,
    /// Whether the host reads the heat that every run of nodes absorbs.
    pub absorbed: bool,
    /// Time of the image [s], for a sensor. Without it the sensor sees nothing.
    pub time: Option<f64>,
    /// What surrounds the craft in the image, and the lobes of all rough mirrors before the planet. Without a value the image takes the value of the slot's last image.
    pub surroundings: Option<(layout::Surroundings, &'a [f32])>,
    /// Axes of the map of a planet that is not uniform, and its means over the direction of a surface.
    pub planet: Option<(layout::PlanetView, &'a [f32])>,
    /// What reflections of the craft need. Without a value the image takes the value of the slot's last image.
    pub traced: Option<TracedTree<'a>>,
    /// What pixels show.
    pub pixels: PixelSource<'a>,
    /// The sub-frame of an exposure that the image is.
    pub sub_frame: Option<SubFrame>,
    /// Heaters of a network that the frame steps.
    pub heating: Option<Heating<'a>>,
    /// Whether the temperatures before the step are kept, for images between them and those after it.
    pub keep: bool,
    /// Share of the last step that has passed at the image's time. `None` shows the present temperatures.
    pub between: Option<f32>,
    /// A list to submit instead of the usual one for this request. Tests use it to leave a barrier out.
    pub list: Option<&'a Frame>,
}

impl<'a> Request<'a> {
    /// A step under a load for a number of steps, without outputs.
    pub fn step(load: &'a StepLoad, steps: f64) -> Self {
        Self { step: Some((load, steps)), ..Self::default() }
    }

    /// Adds the temperatures to the outputs.
    pub fn and_temperatures(self) -> Self {
        Self { temperatures: true, ..self }
    }
}

/// Outputs of a frame.
#[derive(Default)]
pub struct Collected<'a> {
    /// Radiance [W m-2 sr-1], temperature [K], depth [m] and coverage of every pixel; 0 for the background. Without
    /// several samples the coverage is 1 where a surface is. Where the scene asks for the reflected radiance, it stands in
    /// place of the coverage. Where it asks for a sky, the background has its radiance.
    pub radiance: Option<&'a [[f32; 4]]>,
    /// Part and material index of every pixel, each plus 1; 0 for the background.
    pub identity: Option<&'a [[u32; 2]]>,
    /// Digital number and count of temperature of every pixel.
    pub(crate) readings: Option<Vec<[u16; 2]>>,
    /// Temperature of every node [K].
    pub temperatures: Option<&'a [f32]>,
    /// Heat that every run of nodes absorbs in the step [W].
    pub(crate) absorbed: Option<&'a [f32]>,
}

/// A submitted frame, to be passed to `collect`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use = "what the frame leaves is read by `collect`"]
pub struct Submitted(pub(crate) usize);
