//! The words of a frame list: what a pass touches and how, and the barriers between passes.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use super::variant::ThermalVariant;
use super::wide_variant::WideVariant;

/// Whatever a pass reads or writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Resource {
    /// `Tick`, written by the host.
    Tick,
    /// Sun samples of the tick, written by the host.
    SunSamples,
    /// Albedo over the directions of a normal, written by the host.
    AlbedoValues,
    /// `Tick`s of a fused dispatch, written by the host.
    FusedTicks,
    /// Their Sun samples, written by the host.
    FusedSunSamples,
    /// Their albedos over the directions of a normal, written by the host.
    FusedAlbedoValues,
    /// `View`, written by the host.
    View,
    /// `Material` of every material.
    Materials,
    /// Pieces of the response functions that are no powers.
    Shapes,
    /// Material of every group of four nodes.
    GroupMaterial,
    /// Part of every group of four nodes.
    GroupPart,
    /// Normals, one buffer a component.
    NormalX,
    /// See `NormalX`.
    NormalY,
    /// See `NormalX`.
    NormalZ,
    /// Positions [m], one buffer a component.
    PositionX,
    /// See `PositionX`.
    PositionY,
    /// See `PositionX`.
    PositionZ,
    /// Node indices of the triangles.
    Triangles,
    /// Those of them that may cover a pixel's centre, at the front of those of their draw.
    VisibleTriangles,
    /// `DrawCommand` of each run of `VisibleTriangles`.
    Draws,
    /// Table of the band's radiance.
    BandTable,
    /// Target temperature of every node [K].
    Target,
    /// Target less old temperature of every node [K].
    Span,
    /// Steps since the transition began, of every node.
    Elapsed,
    /// Temperature of every node [K].
    Temperature,
    /// The Sun's view, written by the host.
    SunView,
    /// Node indices of the triangles that cast shadows.
    Occluders,
    /// Depth as seen from the Sun, as it is drawn.
    SunDepthImage,
    /// The same where shaders read it.
    SunDepth,
    /// Boxes around the triangles that cast shadows.
    ShadowTree,
    /// These triangles.
    ShadowTriangles,
    /// Share of the Sun that every node sees.
    Visibility,
    /// Radiance, temperature and depth of every pixel.
    RadianceImage,
    /// Part and material of every pixel.
    IdentityImage,
    /// Depth buffer.
    DepthImage,
    /// The images and temperatures where the host reads them.
    RadianceReadback,
    /// See `RadianceReadback`.
    IdentityReadback,
    /// See `RadianceReadback`.
    TemperatureReadback,
    /// Kept temperatures of a network: base and rest [K] of every node.
    NetworkKept,
    /// Temperatures of a network that is tried, of every other stage.
    NetworkEven,
    /// See `NetworkEven`.
    NetworkOdd,
    /// Rests of the nodes of a network at the start of a sub-step [K]; of TR-BDF2 the change of the first stage.
    NetworkStart,
    /// Rates of the nodes of a network [K/s]; of TR-BDF2 the heat at the start [W].
    NetworkRates,
    /// Largest errors, where the host reads them.
    NetworkErrors,
    /// Temperatures of the sensors, where the host reads them.
    NetworkSensed,
    /// Preconditioned residual of the solver [K].
    SolverConditioned,
    /// Direction of search.
    SolverDirection,
    /// The matrix times that.
    SolverProductDirection,
    /// Solution [K].
    SolverSolution,
    /// The matrix times the preconditioned residual.
    SolverProduct,
    /// The diagonal [W/K].
    SolverDiagonal,
    /// Parts of sums.
    SolverPartials,
    /// What the solver knows of itself, where the host reads it.
    SolverScalars,
}

impl Resource {
    /// Whether the two frames in flight have one each; a fence orders the uses of each by the host.
    pub fn per_slot(self) -> bool {
        matches!(
            self,
            Self::Tick
                | Self::SunSamples
                | Self::AlbedoValues
                | Self::FusedTicks
                | Self::FusedSunSamples
                | Self::FusedAlbedoValues
                | Self::View
                | Self::SunView
                | Self::RadianceReadback
                | Self::IdentityReadback
                | Self::TemperatureReadback
        )
    }

    /// Whether shaders see it as a uniform buffer: small, and read by every invocation at the same address. (On lavapipe
    /// each scalar of a storage buffer costs every invocation 0.5 ns; a uniform is read once.)
    pub fn is_uniform(self) -> bool {
        self.per_joint() || matches!(self, Self::FusedTicks | Self::FusedSunSamples)
    }

    /// Whether every joint has a slice of it: what it says is said in the frame in which the joint's nodes do not move.
    pub fn per_joint(self) -> bool {
        matches!(self, Self::Tick | Self::SunSamples | Self::View | Self::SunView)
    }

    /// Whether its size on the device follows the number of nodes; what only the host reads is not counted.
    pub fn grows_with_nodes(self) -> bool {
        matches!(
            self,
            Self::GroupMaterial
                | Self::GroupPart
                | Self::NormalX
                | Self::NormalY
                | Self::NormalZ
                | Self::PositionX
                | Self::PositionY
                | Self::PositionZ
                | Self::Triangles
                | Self::VisibleTriangles
                | Self::Draws
                | Self::Target
                | Self::Span
                | Self::Elapsed
                | Self::Temperature
                | Self::Visibility
        )
    }

    /// Whether every pass that binds it binds a piece of it, so that it may be longer than what a device binds at once;
    /// images pull the nodes' values from anywhere.
    pub fn is_bound_in_pieces(self, drawn: bool) -> bool {
        match self {
            Self::Triangles
            | Self::VisibleTriangles
            | Self::Draws
            | Self::NormalX
            | Self::NormalY
            | Self::NormalZ
            | Self::Target
            | Self::Span
            | Self::Elapsed
            | Self::Visibility => true,
            Self::GroupMaterial | Self::GroupPart | Self::Temperature => !drawn,
            _ => false,
        }
    }

    /// Whether its size on the device follows the number of pixels.
    pub fn grows_with_pixels(self) -> bool {
        (self.is_image() && self != Self::SunDepthImage)
            || matches!(self, Self::RadianceReadback | Self::IdentityReadback)
    }

    /// Whether it is an image, which has a layout.
    pub fn is_image(self) -> bool {
        matches!(self, Self::RadianceImage | Self::IdentityImage | Self::DepthImage | Self::SunDepthImage)
    }
}

/// A stage and how it touches memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    /// Pipeline stages.
    pub stage: S,
    /// Kinds of access; empty where a barrier orders execution only.
    pub access: A,
}

/// A stage and its access.
pub(super) const fn scope(stage: S, access: A) -> Scope {
    Scope { stage, access }
}

/// A compute shader reads a storage buffer.
pub(super) const COMPUTE_READ: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ);
/// A compute shader reads a uniform buffer.
pub(super) const COMPUTE_UNIFORM: Scope = scope(S::COMPUTE_SHADER, A::UNIFORM_READ);
/// A compute shader writes a storage buffer.
pub(super) const COMPUTE_WRITE: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
/// A copy reads.
pub(super) const COPY_READ: Scope = scope(S::COPY, A::TRANSFER_READ);
/// A copy writes.
pub(super) const COPY_WRITE: Scope = scope(S::COPY, A::TRANSFER_WRITE);
/// `vkCmdFillBuffer` is a clear command; validation layers before February 2024 (Vulkan-ValidationLayers, pull request
/// 7543) take it for a copy.
pub(super) const CLEAR_WRITE: Scope =
    Scope { stage: S::from_raw(S::COPY.as_raw() | S::CLEAR.as_raw()), access: A::TRANSFER_WRITE };

/// The groups of four nodes, the triangles or the draws that an access is confined to: the first, and the one after the last.
/// `None` is the whole resource.
pub type Groups = Option<(u32, u32)>;

/// One use of a resource by a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// What is touched.
    pub resource: Resource,
    /// Where and how.
    pub scope: Scope,
    /// Which part of it.
    pub groups: Groups,
    /// Of what has a slice for each joint, which joint's; 0 is the body's.
    pub slice: u32,
    /// Shader binding, where it is bound to one.
    pub binding: Option<u32>,
    /// Layout, of an image.
    pub layout: ImageLayout,
}

/// What a pass does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// `thermal_step` on a run of whole workgroups.
    Thermal {
        /// Compiled variant.
        variant: ThermalVariant,
        /// Groups of four nodes: first, and the one after the last.
        groups: (u32, u32),
    },
    /// Draws the depth of the parts as seen from the Sun.
    SunDepth,
    /// Finds what share of the Sun each node sees.
    Visibility {
        /// Groups of four nodes: first, and the one after the last.
        groups: (u32, u32),
    },
    /// Finds whether each node sees one point of the Sun's disc.
    SunRay {
        /// Number of the point; the first begins the count.
        ray: u32,
        /// Joint of the nodes.
        joint: u32,
        /// Groups of four nodes: first, and the one after the last.
        groups: (u32, u32),
    },
    /// Finds the triangles that may cover a pixel's centre.
    Cull {
        /// Triangles: first, and the one after the last.
        triangles: (u32, u32),
    },
    /// Draws the triangles that are left.
    Radiance,
    /// Copies a buffer or an image to a buffer.
    Copy {
        /// From here.
        from: Resource,
        /// To there.
        to: Resource,
    },
    /// Fills a buffer of floats with zero.
    Clear(Resource),
    /// A pass over the nodes of a network.
    Network(NetworkWork),
}

/// Nodes that a pass over a network is confined to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum NetworkNodes {
    /// All.
    All,
    /// The sensors.
    Sensors,
    /// Arithmetic nodes without arithmetic neighbours.
    Lone,
    /// All arithmetic nodes.
    Arithmetic,
    /// All that are no boundary.
    Free,
}

/// Which pass over the nodes of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkWork {
    /// Compiled variant.
    pub variant: WideVariant,
    /// Nodes of the pass.
    pub nodes: NetworkNodes,
    /// Stage whose time and weights it has.
    pub stage: u32,
    /// Sub-step.
    pub sub_step: u32,
    /// Whether the present stage is in `NetworkOdd`, and the next goes to `NetworkEven`.
    pub odd: bool,
    /// Of an update, 1 where it is the first; of the solver's decisions, which.
    pub mode: u32,
}

/// A named piece of work and everything that it touches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pass {
    /// Debug label and name of its timestamps.
    pub name: String,
    /// What it does.
    pub work: Work,
    /// What it touches.
    pub accesses: Vec<Access>,
}

impl Pass {
    /// Whether it takes many ticks.
    pub fn is_fused(&self) -> bool {
        matches!(self.work, Work::Thermal { variant, .. } if variant.fused)
    }
}

/// Orders the accesses of one resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Barrier {
    /// What it guards.
    pub resource: Resource,
    /// What came before.
    pub before: Scope,
    /// What comes after.
    pub after: Scope,
    /// Old and new layout, of an image.
    pub layouts: Option<(ImageLayout, ImageLayout)>,
}

/// One entry of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Work.
    Pass(Pass),
    /// Barriers that are recorded together.
    Barriers(Vec<Barrier>),
}

/// The kinds of access that write.
pub fn writes(access: A) -> A {
    access
        & (A::SHADER_STORAGE_WRITE
            | A::TRANSFER_WRITE
            | A::COLOR_ATTACHMENT_WRITE
            | A::DEPTH_STENCIL_ATTACHMENT_WRITE
            | A::HOST_WRITE
            | A::MEMORY_WRITE)
}

/// Whether any of the kinds of access writes.
pub fn is_write(access: A) -> bool {
    !writes(access).is_empty()
}

/// A barrier on a buffer.
pub(super) fn barrier(resource: Resource, before: Scope, after: Scope) -> Barrier {
    Barrier { resource, before, after, layouts: None }
}

/// A barrier on an image, which changes its layout.
pub(super) fn transition(
    resource: Resource,
    before: Scope,
    after: Scope,
    old: ImageLayout,
    new: ImageLayout,
) -> Barrier {
    Barrier { resource, before, after, layouts: Some((old, new)) }
}

/// Makes a copy visible to the host.
pub(super) fn to_host(resource: Resource) -> Barrier {
    barrier(resource, COPY_WRITE, scope(S::HOST, A::HOST_READ))
}

/// An access of a whole resource.
pub(super) fn access(resource: Resource, scope: Scope) -> Access {
    Access { resource, scope, groups: None, slice: 0, binding: None, layout: ImageLayout::UNDEFINED }
}

/// Copies a whole buffer or image.
pub(super) fn copy_pass(name: &str, from: Resource, to: Resource) -> Pass {
    let layout = if from.is_image() { ImageLayout::TRANSFER_SRC_OPTIMAL } else { ImageLayout::UNDEFINED };
    Pass {
        name: name.to_owned(),
        work: Work::Copy { from, to },
        accesses: vec![Access { layout, ..access(from, COPY_READ) }, access(to, COPY_WRITE)],
    }
}

/// Fills a buffer of floats with zero.
pub(super) fn clear_pass(name: &str, resource: Resource) -> Pass {
    Pass { name: name.to_owned(), work: Work::Clear(resource), accesses: vec![access(resource, CLEAR_WRITE)] }
}
