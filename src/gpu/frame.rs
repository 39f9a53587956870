//! A frame, from top to bottom: the passes of each effect that a scene has, in the order of the queue.
//!
//! Command recording, debug labels, timestamps, `isotherm info` and the hazard check all use the list that [`compose`] makes.
//! Each effect writes the barriers before and after its passes by hand.

use super::effects::exchange::{self, Exchanged};
use super::effects::heat::{self, HeatSections};
use super::effects::image::runs::TriangleRun;
use super::effects::image::sampling::{Sampled, SubFrame};
use super::effects::image::variant::RadianceVariant;
use super::effects::image::{self, ImageRecipe};
use super::effects::network::PlanConstants;
use super::effects::network::sections::OnePassShape;
use super::effects::sensor::{self, Sensing};
use super::effects::thermal::variant::StepRange;
use super::effects::thermal::{self, BETWEEN_TEMPERATURE, TEMPERATURE};
use super::effects::traced;
pub use super::pass::Frame;

/// What a frame does. Nothing by default.
#[derive(Debug, Clone, Default)]
pub struct Recipe {
    /// Whether the temperatures before the step are kept, for images between them and those after it.
    pub keeps: bool,
    /// What surfaces send to each other.
    pub exchange: Option<Exchanged>,
    /// Ranges of nodes that take a step.
    pub ranges: Vec<StepRange>,
    /// Runs of nodes whose absorbed heat is summed, and the fourth power of the temperature of space [K4].
    pub heat: (HeatSections, f32),
    /// Steps of the network.
    pub network: Option<NetworkSteps>,
    /// The image.
    pub image: Option<ImageRecipe>,
    /// Ranges whose temperatures are interpolated for the image, and the share of the last step that has passed at its time.
    /// Without a share they are the present ones, which lie between themselves. Without ranges nothing is interpolated.
    pub between: Option<(Vec<StepRange>, Option<f32>)>,
    /// Whether the host reads the temperatures of all nodes.
    pub temperatures: bool,
    /// The sensor of the image.
    pub sensor: Option<Sensing>,
}

/// Steps of a network of one length.
#[derive(Debug, Clone)]
pub struct NetworkSteps {
    /// Sizes of the network.
    pub(crate) shape: OnePassShape,
    /// Number of steps.
    pub(crate) count: u32,
    /// Number of steps of this length before them.
    pub(crate) age: u32,
    /// Whether the state is in the odd buffer.
    pub(crate) odd: bool,
    /// Numbers of its plan.
    pub(crate) constants: PlanConstants,
}

/// The passes and barriers of a frame.
pub fn compose(recipe: &Recipe) -> Frame {
    let mut frame = Frame::default();
    if recipe.keeps {
        thermal::keep(&mut frame);
    }
    if let Some(exchanged) = &recipe.exchange {
        exchange::passes(&mut frame, exchanged);
    }
    thermal::step(&mut frame, &recipe.ranges);
    // The flux of nodes of a network stands in the place of their temperatures until its step.
    heat::passes(&mut frame, &recipe.heat.0, recipe.heat.1);
    if let Some(NetworkSteps { shape, count, age, odd, constants }) = &recipe.network {
        frame = frame.then(shape.steps(*count, *age, *odd, constants).0);
    }
    if let Some(image) = &recipe.image {
        let shown = if recipe.between.is_some() { &BETWEEN_TEMPERATURE } else { &TEMPERATURE };
        if let Some((ranges, share)) = &recipe.between {
            if share.is_none() {
                thermal::keep(&mut frame);
            }
            thermal::between(&mut frame, ranges, share.unwrap_or(1.0));
        }
        image::make(&mut frame, image, shown, |frame, place, lit| {
            let shutter = image.shutter();
            traced::passes(frame, (image.shows, shutter), place, lit, image.texels, shown);
        });
        image::expose(&mut frame, image);
        if image.sub_frame.is_none_or(SubFrame::is_last) {
            image::read(&mut frame, image);
        }
    }
    if recipe.temperatures {
        thermal::read(&mut frame);
    }
    if let (Some(sensing), Some(image)) = (recipe.sensor, &recipe.image) {
        sensor::passes(&mut frame, sensing, image.left_in()[0]);
    }
    frame
}

/// Outputs of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wanted {
    /// Whether an image is drawn.
    pub image: bool,
    /// How the image is made. `None` if it is simply drawn.
    pub sampled: Option<Sampled>,
    /// Triangles to cull before drawing. It is 0 if the view of the craft has not changed since the last image.
    pub cull: u32,
    /// Whether the host reads the temperatures of all nodes.
    pub temperatures: bool,
    /// What the pixels of the image show.
    pub shows: RadianceVariant,
    /// Texels whose reflections of the craft itself are traced, where `shows` has them.
    pub texels: u32,
    /// The sub-frame of an exposure that the image is.
    pub sub_frame: Option<SubFrame>,
}

impl Wanted {
    /// What a frame with these outputs does, where `culled` are the triangles to cull before drawing.
    pub fn recipe(&self, culled: &[TriangleRun]) -> Recipe {
        let Self { sampled, shows, texels, sub_frame, .. } = *self;
        let image = self.image.then(|| ImageRecipe { sampled, shows, texels, sub_frame, culled: culled.to_vec() });
        Recipe { image, temperatures: self.temperatures, ..Recipe::default() }
    }
}

impl Frame {
    /// One step of a craft without joints: thermal step of every range, then image and readback as wanted.
    pub fn step(ranges: &[StepRange], wanted: Wanted) -> Self {
        Self::step_in_runs(ranges, wanted, &[TriangleRun { joint: 0, triangles: (0, wanted.cull) }])
    }

    /// One step of a craft with joints. `culled` are the triangles to cull before drawing.
    pub fn step_in_runs(ranges: &[StepRange], wanted: Wanted, culled: &[TriangleRun]) -> Self {
        compose(&Recipe { ranges: ranges.to_vec(), ..wanted.recipe(culled) })
    }

    /// Keeps the temperatures before a step, for images between them and those after it.
    pub fn keep() -> Self {
        compose(&Recipe { keeps: true, ..Recipe::default() })
    }

    /// An image between two steps: temperatures of its time, then the image.
    pub fn between(ranges: &[StepRange], wanted: Wanted, culled: &[TriangleRun]) -> Self {
        compose(&Recipe { between: Some((ranges.to_vec(), Some(1.0))), ..wanted.recipe(culled) })
    }

    /// Start of a run: sets every node to the balance temperature of the present load.
    pub fn settle(ranges: &[StepRange]) -> Self {
        thermal::settle(ranges)
    }
}
