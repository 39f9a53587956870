//! Input data of a scene for the device, as plain numbers.

use std::sync::Arc;

use glam::Vec3;

use super::effects::exchange::tables::ExchangeTables;
use super::effects::heat::tables::HeatTables;
use super::effects::image::runs::TriangleRun;
use super::effects::image::sampling::{Mean, Sampled, Sampling};
use super::effects::image::variant::RadianceVariant;
use super::effects::network::tables::OnePassTables;
use super::effects::sensor::tables::SensorTables;
use super::effects::thermal::variant::{StepKind, StepRange, ThermalVariant};
use super::layout;
use super::shapes::Shapes;
use crate::environment::shadow::LitAreas;
use crate::exchange::mirrors::Mirrors;
use crate::exchange::sky::Renewal;
use crate::model::nodes::{GROUP, RANGE_GROUPS};

/// Nodes of a workgroup of the thermal step. Ranges are multiples of it.
pub const NODES_PER_WORKGROUP: usize = GROUP * RANGE_GROUPS;

/// Data of a scene. Nodes come in groups of four with a common material and part.
pub struct SceneData<'a> {
    /// Ranges of nodes with their pipelines.
    pub ranges: Vec<StepRange>,
    /// Material index of each group.
    pub group_material: &'a [u32],
    /// Part index of each group.
    pub group_part: &'a [u32],
    /// Unit normal of each node; zero for padding.
    pub normals: &'a [Vec3],
    /// Position of each node in the body frame [m].
    pub positions: &'a [Vec3],
    /// Node indices of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// Materials.
    pub materials: &'a [layout::Material],
    /// Shaped response functions.
    pub shapes: &'a Shapes,
    /// Band table (see `blackbody::band_table`).
    pub band_table: &'a [f32],
    /// Width and height of the image [px]; `None` without an image.
    pub image: Option<[u32; 2]>,
    /// Whether images lie between steps, so that their temperatures are interpolated.
    pub between: bool,
    /// How the image is made; `None` if it is simply drawn.
    pub sampling: Option<Sampling>,
    /// What finds the lit areas of the nodes; `None` if normals tell the light.
    pub light: Option<LitAreas>,
    /// Joints; `None` if no part moves.
    pub joints: Option<JointData<'a>>,
    /// Thermal network that the frames step in one pass.
    pub network: Option<&'a OnePassTables>,
    /// Runs of nodes whose absorbed heat is summed, if it is.
    pub heat: Option<&'a HeatTables>,
    /// Patches that radiate to each other; `None` without.
    pub exchange: Option<ExchangeData<'a>>,
    /// Sensor of the image; `None` without one.
    pub sensor: Option<&'a SensorTables>,
    /// What the image shows besides the emission of surfaces.
    pub shown: Shown<'a>,
}

impl<'a> SceneData<'a> {
    /// No nodes and no image, as a start for small scenes that are made by hand.
    pub fn empty(shapes: &'a Shapes) -> Self {
        Self {
            ranges: Vec::new(),
            group_material: &[],
            group_part: &[],
            normals: &[],
            positions: &[],
            triangles: &[],
            materials: &[],
            shapes,
            band_table: &[],
            image: None,
            between: false,
            sampling: None,
            light: None,
            joints: None,
            network: None,
            heat: None,
            exchange: None,
            sensor: None,
            shown: Shown::default(),
        }
    }
}

/// What an image shows besides the emission of surfaces. By default that is nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shown<'a> {
    /// Shader variant.
    pub(crate) variant: RadianceVariant,
    /// Front and back of each material, if they reflect.
    pub(crate) reflectors: &'a [layout::Reflector],
    /// Number of values of all lobes. The values belong to the planet's distance and come with the requests.
    pub(crate) lobe_values: usize,
    /// Emissivities of the faces over angle and temperature, if they have any.
    pub(crate) emissivities: &'a [f32],
    /// Radiances of a planet that is not uniform, over the radiance of its mean temperature.
    pub(crate) planet_map: &'a [f32],
    /// Nodes of the corners of the triangles in the tree for reflections of the craft, and the word of the first. The tree
    /// follows the joints and comes with the requests.
    pub(crate) traced: &'a [[u32; 4]],
    /// Word of each node: its material times 4; plus 1 where its front sees nothing but the craft; plus 2 where its back does.
    pub(crate) traced_nodes: &'a [u32],
    /// Boxes of this tree.
    pub(crate) traced_boxes: usize,
    /// Normals of all nodes, if the image has normals of its own.
    pub(crate) crinkled: &'a [Vec3],
    /// Number of its means over the direction of a surface, which come with the requests.
    pub(crate) planet_means: usize,
}

/// Patches that radiate to each other.
#[derive(Clone)]
pub struct ExchangeData<'a> {
    /// Their tables.
    pub(crate) tables: &'a ExchangeTables,
    /// When what they exchange is found anew.
    pub(crate) renewal: Renewal,
    /// The patches that mirror sunlight.
    pub(crate) mirrors: Option<&'a Arc<Mirrors>>,
}

/// Triangles of each joint.
#[derive(Clone)]
pub struct JointData<'a> {
    /// Number of joints, counting the body.
    pub(crate) count: u32,
    /// Runs of triangles. Each begins at a multiple of 64.
    pub(crate) triangles: &'a [TriangleRun],
}

impl SceneData<'_> {
    /// Whether one dispatch may take many steps. This needs transitions that depend on nothing but the load.
    pub(crate) fn fuses(&self) -> bool {
        let kinds = || self.ranges.iter().map(|range| range.variant.kind);
        self.exchange.is_none() && kinds().any(StepKind::has_state) && kinds().all(|kind| kind != StepKind::Absorb)
    }

    /// Triangles of the body and of each joint.
    pub(crate) fn runs(&self) -> Vec<TriangleRun> {
        let whole = TriangleRun { joint: 0, triangles: (0, self.triangles.len() as u32) };
        self.joints.as_ref().map_or_else(|| vec![whole], |joints| joints.triangles.to_vec())
    }

    /// Number of joints, counting the body.
    pub(crate) fn joint_count(&self) -> u32 {
        self.joints.as_ref().map_or(1, |joints| joints.count)
    }

    /// Groups of four nodes.
    pub(crate) fn groups(&self) -> usize {
        self.normals.len() / GROUP
    }

    /// Whether the variant of a range fulfils a condition.
    pub(crate) fn any_range(&self, has: fn(&ThermalVariant) -> bool) -> bool {
        self.ranges.iter().any(|range| has(&range.variant))
    }

    /// Whether an image is drawn.
    pub(crate) fn draws(&self) -> bool {
        self.image.is_some()
    }

    /// A number of an image, or 0 without one.
    pub(crate) fn if_drawn(&self, number: usize) -> usize {
        only(self.draws(), number)
    }

    /// A number of an image that is not simply drawn, or 0.
    pub(crate) fn of_sampling(&self, number: impl Fn(&Sampling) -> usize) -> usize {
        self.sampling.as_ref().map_or(0, number)
    }

    /// A number of an image that is computed from drawn ones, or 0.
    pub(crate) fn of_computed(&self, number: impl Fn(&Sampling) -> usize) -> usize {
        let computed = self.sampled().is_some_and(|sampled| sampled.is_resampled());
        self.sampling.as_ref().filter(|_| computed).map_or(0, number)
    }

    /// A number of the image from which the mean over several samples is made, or 0.
    pub(crate) fn of_mean(&self, number: impl Fn(&Mean) -> usize) -> usize {
        self.sampling.as_ref().and_then(|sampling| sampling.mean.as_ref()).map_or(0, number)
    }

    /// What the passes of the image depend on, if it is not simply drawn.
    pub(crate) fn sampled(&self) -> Option<Sampled> {
        Some(self.sampling.as_ref()?.passes(self.image?))
    }

    /// Width and height of the largest image that is drawn [px].
    pub(crate) fn drawn(&self) -> Option<[u32; 2]> {
        self.sampling.as_ref().map(Sampling::largest).or(self.image)
    }

    /// Width and height of the image with one sample of a texel [texels].
    pub(crate) fn drawn_singly(&self) -> Option<[u32; 2]> {
        self.sampling.as_ref().map(|sampling| sampling.drawn).or(self.image)
    }

    /// Texels of the largest image that is drawn, if surfaces reflect the craft itself, or 0.
    pub(crate) fn texels(&self) -> usize {
        self.drawn().filter(|_| self.shown.variant.traced).map_or(0, area)
    }
}

/// A number where it is needed, or 0.
pub(crate) fn only(present: bool, number: usize) -> usize {
    if present { number } else { 0 }
}

/// Number of pixels of an image.
pub(crate) fn area([width, height]: [u32; 2]) -> usize {
    width as usize * height as usize
}
