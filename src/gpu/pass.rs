//! Types of a frame list: passes with their accesses, and barriers.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use super::exchange_variant::ExchangeVariant;
use super::heat_source::HeatOf;
use super::one_pass_variant::{OnePassVariant, StageVariant};
use super::radiance_variant::RadianceVariant;
use super::resource::Resource;
use super::sampling::RowOf;
use super::sensor_variant::SensorVariant;
use super::shaders::Shader;
use super::variant::{ResponseVariant, ThermalVariant};

/// Pipeline stages and their memory accesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    /// Stages.
    pub stage: S,
    /// Accesses. They are empty if a barrier orders execution only.
    pub access: A,
}

pub(super) const fn scope(stage: S, access: A) -> Scope {
    Scope { stage, access }
}

pub(super) const COMPUTE_READ: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ);
pub(super) const COMPUTE_UNIFORM: Scope = scope(S::COMPUTE_SHADER, A::UNIFORM_READ);
pub(super) const COMPUTE_WRITE: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
pub(super) const COPY_READ: Scope = scope(S::COPY, A::TRANSFER_READ);
pub(super) const COPY_WRITE: Scope = scope(S::COPY, A::TRANSFER_WRITE);
/// Write of `vkCmdFillBuffer`, which is a clear. Validation layers before February 2024 treat it as a copy
/// (Vulkan-ValidationLayers, pull request 7543).
pub(super) const CLEAR_WRITE: Scope =
    Scope { stage: S::from_raw(S::COPY.as_raw() | S::CLEAR.as_raw()), access: A::TRANSFER_WRITE };

/// Range of groups of four nodes, triangles or draws: the first and the one after the last. `None` is the whole
/// resource.
pub type Groups = Option<(u32, u32)>;

/// Access of a pass to a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// Resource.
    pub resource: Resource,
    /// Stages and accesses.
    pub scope: Scope,
    /// Accessed range.
    pub groups: Groups,
    /// Joint whose slice is accessed, if the resource has a slice for each joint; 0 is the body.
    pub slice: u32,
    /// Binding in the descriptor set, if any.
    pub binding: Option<u32>,
    /// Image layout, ignored for a buffer.
    pub layout: ImageLayout,
}

/// Shader program of a pass. It selects the pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kernel {
    /// Thermal step of a range.
    Thermal(ThermalVariant),
    /// Draws the shadow map of the Sun.
    SunDepth,
    /// Looks up the share of the Sun that each node sees in the shadow map.
    Visibility,
    /// Traces a ray from each node to one point of the Sun's disc.
    SunRay {
        /// Whether it is the first ray, which sets the share instead of adding to it.
        first: bool,
    },
    /// Finds the temperatures of an image between two steps.
    Between,
    /// Culls triangles that cover no pixel centre.
    Cull,
    /// Culls triangles of an image with several samples of a pixel or a rolling shutter.
    CullSamples {
        /// Whether a pixel has several samples.
        several: bool,
        /// How a point finds its row with a rolling shutter.
        shutter: Option<RowOf>,
    },
    /// Draws the remaining triangles as radiance, and the sky behind them.
    Radiance(RadianceVariant),
    /// Draws the triangles as radiance with a rolling shutter.
    RadianceOfRows(RowOf),
    /// Draws them as radiance and coverage, averaged over the samples of a texel, and the sky behind them.
    Mean {
        /// Samples of a texel.
        each: u32,
        /// What pixels show.
        shows: RadianceVariant,
    },
    /// The same of the triangles alone with a rolling shutter.
    MeanOfRows {
        /// Samples of a texel.
        each: u32,
        /// How a point finds its row.
        row_of: RowOf,
    },
    /// Draws the sky. No pass has this kernel: the pass of the craft draws it with its own bindings.
    Background {
        /// What pixels show.
        shows: RadianceVariant,
        /// Samples of a texel of a mean. `None` for the image of one sample.
        each: Option<u32>,
    },
    /// Adds what surfaces reflect of the craft itself.
    Traced {
        /// What pixels show.
        shows: RadianceVariant,
        /// Whether it is added to the mean over several samples of a pixel.
        several: bool,
    },
    /// Computes the image from drawn ones.
    Resample {
        /// Whether the lens distorts.
        lens: bool,
        /// Whether a pixel has several samples.
        several: bool,
    },
    /// Computes the image of a craft that is far away from a crop around it.
    Distant(RadianceVariant),
    /// Point spread of the sensor along rows.
    SensorRows,
    /// Mean radiance of the cells of its halo.
    SensorCells,
    /// Its halo.
    SensorHalo,
    /// Its pixels.
    SensorPixel(SensorVariant),
    /// The step of a network in one pass.
    OnePass(OnePassVariant),
    /// A stage of the conduction inside its large blocks.
    Stage(StageVariant),
    /// Power of the heaters of a network in one pass.
    Heaters,
    /// Sums the absorbed heat of runs of nodes.
    Heat(HeatOf),
    /// A pass of radiation between surfaces.
    Exchange(ExchangeVariant),
    /// Response of nodes to given targets.
    Response(ResponseVariant),
    /// Radiance of a blackbody in a band.
    Blackbody,
    /// Brightness temperature of a band radiance.
    Brightness,
    /// Does nothing.
    Empty,
}

impl Kernel {
    /// Whether it draws the triangles of all joints in turn.
    pub fn draws(self) -> bool {
        use Kernel::{Mean, MeanOfRows, Radiance, RadianceOfRows, SunDepth};
        matches!(self, Radiance(_) | RadianceOfRows(_) | Mean { .. } | MeanOfRows { .. } | SunDepth)
    }

    /// What it draws of the craft, if it does.
    pub fn target(self) -> Option<Target> {
        let (mean, surfaces) = match self {
            Self::Radiance(shows) => (None, shows.traced),
            Self::RadianceOfRows(_) => (None, false),
            Self::Mean { each, shows } => (Some(each), shows.traced),
            Self::MeanOfRows { each, .. } => (Some(each), false),
            _ => return None,
        };
        Some(Target { mean, surfaces })
    }

    /// The kernel of the sky behind the craft that it draws, where the image has one.
    pub fn sky(self) -> Option<Self> {
        let (shows, each) = match self {
            Self::Radiance(shows) => (shows, None),
            Self::Mean { each, shows } => (shows, Some(each)),
            _ => return None,
        };
        shows.background.then_some(Self::Background { shows, each })
    }

    /// Shader of a dispatch. For a draw, the vertex shader and the fragment shader, if it has one.
    pub fn shaders(self) -> Vec<Shader> {
        let plain = |entry| vec![Shader::new(entry, Vec::new())];
        match self {
            Self::Thermal(variant) => vec![variant.shader()],
            Self::Response(variant) => vec![variant.shader()],
            Self::OnePass(variant) => vec![variant.shader()],
            Self::Stage(variant) => vec![variant.shader()],
            Self::SensorRows => plain("sensor_rows.comp"),
            Self::SensorCells => plain("sensor_cells.comp"),
            Self::SensorHalo => plain("sensor_halo.comp"),
            Self::SensorPixel(variant) => vec![variant.shader()],
            Self::Heaters => plain("one_pass_heaters.comp"),
            Self::Heat(of) => vec![of.shader()],
            Self::Exchange(variant) => vec![variant.shader()],
            Self::SunDepth => plain("solar_depth.vert"),
            Self::Visibility => plain("solar_visibility.comp"),
            Self::SunRay { first: true } => vec![Shader::new("solar_rays.comp", vec!["first"])],
            Self::SunRay { first: false } => plain("solar_rays.comp"),
            Self::Between => plain("between.comp"),
            Self::Cull => plain("cull.comp"),
            Self::CullSamples { several, shutter } => {
                let several = if several { vec!["sampled"] } else { Vec::new() };
                let rolling = shutter.map(RowOf::words).unwrap_or_default();
                vec![Shader::new("cull.comp", [several, rolling].concat())]
            }
            Self::Radiance(shows) => shows.shaders(None, None).to_vec(),
            Self::RadianceOfRows(row_of) => RadianceVariant::PLAIN.shaders(None, Some(row_of)).to_vec(),
            Self::Mean { each, shows } => shows.shaders(Some(each), None).to_vec(),
            Self::MeanOfRows { each, row_of } => RadianceVariant::PLAIN.shaders(Some(each), Some(row_of)).to_vec(),
            Self::Background { shows, each } => shows.background(each).to_vec(),
            Self::Traced { shows, several } => vec![shows.traced(several)],
            Self::Resample { lens, several } => {
                let words = [(lens, "lens"), (several, "several")].into_iter().filter(|(has, _)| *has);
                vec![Shader::new("resample.comp", words.map(|(_, word)| word).collect())]
            }
            Self::Distant(shows) => vec![shows.distant()],
            Self::Blackbody => plain("blackbody.comp"),
            Self::Brightness => plain("brightness.comp"),
            Self::Empty => plain("empty.comp"),
        }
    }
}

/// Images that are drawn together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target {
    /// Samples of a texel of a mean. `None` for radiance and identity of one sample.
    pub mean: Option<u32>,
    /// Whether the surfaces of the texels are drawn too.
    pub surfaces: bool,
}

/// Push constants of a dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    /// None.
    Nothing,
    /// Share of the step that has passed at the image's time.
    Share,
    /// Index of the first triangle.
    Triangle(u32),
    /// Index of the first texel.
    Texel(u32),
    /// Number of the point on the Sun's disc, and joint of the nodes.
    Ray(u32, u32),
    /// A part of a step of a network in one pass.
    OnePass {
        /// First group.
        first: u32,
        /// Group after the last.
        end: u32,
        /// Steps since the last estimate of the error.
        since: u32,
    },
    /// A stage of the conduction inside large blocks, counted from 1. 0 is the first vector.
    Stage {
        /// Its number.
        number: u32,
    },
    /// Sums of absorbed heat.
    Heat {
        /// First run of nodes.
        first: u32,
    },
    /// Patches of a pass.
    Patches {
        /// First patch.
        first: u32,
        /// Patch after the last.
        end: u32,
    },
    /// A step of heaters.
    Heaters {
        /// Number of the step in the frame. A trial has that of the step that it is for.
        number: u32,
        /// Whether it is the first pass of the frame.
        first: bool,
        /// Whether the step is taken to learn its change.
        trial: bool,
    },
}

/// Work of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// Dispatch.
    Dispatch {
        /// Shader.
        kernel: Kernel,
        /// Number of workgroups.
        workgroups: u32,
        /// Number of the descriptor set among those of the kernel: the first of its nodes or triangles.
        set: u32,
        /// Push constants.
        said: Said,
    },
    /// Draw.
    Draw(Kernel),
    /// Copy from a buffer or image to a buffer.
    Copy {
        /// Source.
        from: Resource,
        /// Destination.
        to: Resource,
    },
    /// Fill of a buffer with a 32-bit word.
    Fill(Resource, u32),
}

/// A named command with all its accesses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pass {
    /// Debug label, and name of its timestamps.
    pub name: String,
    /// Work.
    pub work: Work,
    /// Accesses.
    pub accesses: Vec<Access>,
}

impl Pass {
    /// Its kernel; `None` for copies.
    pub fn kernel(&self) -> Option<Kernel> {
        match self.work {
            Work::Dispatch { kernel, .. } | Work::Draw(kernel) => Some(kernel),
            Work::Copy { .. } | Work::Fill(..) => None,
        }
    }
}

/// A memory barrier for one resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Barrier {
    /// Resource.
    pub resource: Resource,
    /// Earlier accesses.
    pub before: Scope,
    /// Later accesses.
    pub after: Scope,
    /// Old and new layout of an image.
    pub layouts: Option<(ImageLayout, ImageLayout)>,
}

/// An entry of a frame list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Entry {
    /// A pass.
    Pass(Pass),
    /// Barriers that are recorded together.
    Barriers(Vec<Barrier>),
}

/// The write accesses among some accesses.
pub fn writes(access: A) -> A {
    access
        & (A::SHADER_STORAGE_WRITE
            | A::TRANSFER_WRITE
            | A::COLOR_ATTACHMENT_WRITE
            | A::DEPTH_STENCIL_ATTACHMENT_WRITE
            | A::HOST_WRITE
            | A::MEMORY_WRITE)
}

/// Whether some accesses contain a write.
pub fn is_write(access: A) -> bool {
    !writes(access).is_empty()
}

/// A barrier on a buffer.
pub(super) fn barrier(resource: Resource, before: Scope, after: Scope) -> Barrier {
    Barrier { resource, before, after, layouts: None }
}

/// A barrier on an image with a layout change.
pub(super) fn transition(
    resource: Resource,
    before: Scope,
    after: Scope,
    old: ImageLayout,
    new: ImageLayout,
) -> Barrier {
    Barrier { resource, before, after, layouts: Some((old, new)) }
}

/// A barrier that makes a copy visible to the host.
pub(super) fn to_host(resource: Resource) -> Barrier {
    barrier(resource, COPY_WRITE, scope(S::HOST, A::HOST_READ))
}

/// Access to a whole resource without a binding.
pub(super) fn access(resource: Resource, scope: Scope) -> Access {
    Access { resource, scope, groups: None, slice: 0, binding: None, layout: ImageLayout::UNDEFINED }
}

/// A copy of a whole buffer or image.
pub(super) fn copy_pass(name: &str, from: Resource, to: Resource) -> Pass {
    let layout = if from.row().role.is_image() { ImageLayout::TRANSFER_SRC_OPTIMAL } else { ImageLayout::UNDEFINED };
    Pass {
        name: name.to_owned(),
        work: Work::Copy { from, to },
        accesses: vec![Access { layout, ..access(from, COPY_READ) }, access(to, COPY_WRITE)],
    }
}

/// A fill of a buffer of floats with zero.
pub(super) fn clear_pass(name: &str, resource: Resource) -> Pass {
    Pass { name: name.to_owned(), work: Work::Fill(resource, 0), accesses: vec![access(resource, CLEAR_WRITE)] }
}
