//! The words of a frame list: what a pass touches and how, and the barriers between passes.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use super::resource::Resource;
use super::shaders::Shader;
use super::variant::{FusedVariant, ResponseVariant, ThermalVariant};
use super::wide_variant::{WideKind, WideVariant};

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

/// What selects a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kernel {
    /// `thermal_step` on a run of whole workgroups.
    Thermal(ThermalVariant),
    /// Draws the depth of the parts as seen from the Sun.
    SunDepth,
    /// Finds what share of the Sun each node sees.
    Visibility,
    /// Finds whether each node sees one point of the Sun's disc.
    SunRay {
        /// Whether it begins the count.
        first: bool,
    },
    /// Finds the triangles that may cover a pixel's centre.
    Cull,
    /// Draws the triangles that are left.
    Radiance,
    /// A pass over the nodes of a large network.
    Wide(WideVariant),
    /// Sub-steps of a small network.
    Fused(FusedVariant),
    /// Steps of nodes under given targets.
    Response(ResponseVariant),
    /// Radiance of a blackbody in a band.
    Blackbody,
    /// The inverse of that.
    Brightness,
    /// Nothing.
    Empty,
}

impl Kernel {
    /// Whether it draws the triangles of all joints, one after the other.
    pub fn draws(self) -> bool {
        matches!(self, Self::Radiance | Self::SunDepth)
    }

    /// Its shaders: one of a dispatch; the vertex shader and, where colours are drawn, the fragment shader of a draw.
    pub fn shaders(self) -> Vec<Shader> {
        let plain = |entry| vec![Shader::new(entry, Vec::new())];
        match self {
            Self::Thermal(variant) => vec![variant.shader()],
            Self::Response(variant) => vec![variant.shader()],
            Self::Fused(variant) => vec![variant.shader()],
            Self::Wide(variant) => vec![variant.shader()],
            Self::SunDepth => plain("solar_depth.vert"),
            Self::Visibility => plain("solar_visibility.comp"),
            Self::SunRay { first: true } => vec![Shader::new("solar_rays.comp", vec!["first"])],
            Self::SunRay { first: false } => plain("solar_rays.comp"),
            Self::Cull => plain("cull.comp"),
            Self::Radiance => ["radiance.vert", "radiance.frag"].map(|entry| Shader::new(entry, Vec::new())).to_vec(),
            Self::Blackbody => plain("blackbody.comp"),
            Self::Brightness => plain("brightness.comp"),
            Self::Empty => plain("empty.comp"),
        }
    }
}

/// What a dispatch says to its kernel besides what is bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    /// Nothing.
    Nothing,
    /// The first triangle.
    Triangle(u32),
    /// A point of the Sun's disc, by number, and the joint of the nodes.
    Ray(u32, u32),
    /// Times and weights of a pass over a network.
    Network(NetworkWork),
}

/// What a pass does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// Workgroups of a kernel.
    Dispatch {
        /// Which.
        kernel: Kernel,
        /// How many.
        workgroups: u32,
        /// Tells what it binds from what other passes of its kernel bind: the first of its nodes or triangles.
        set: u32,
        /// What it is told.
        said: Said,
    },
    /// Draws triangles.
    Draw(Kernel),
    /// Copies a buffer or an image to a buffer.
    Copy {
        /// From here.
        from: Resource,
        /// To there.
        to: Resource,
    },
    /// Fills a buffer with a word.
    Fill(Resource, u32),
}

/// Nodes that a pass over a network is confined to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum NetworkNodes {
    /// All.
    All,
    /// The sensors.
    Sensors,
    /// Arithmetic nodes.
    Arithmetic,
    /// All that are no boundary.
    Free,
}

/// When a pass over the nodes of a network runs, and over how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkWork {
    /// What it does.
    pub kind: WideKind,
    /// Groups of nodes, sensors, or sums of workgroups.
    pub count: u32,
    /// Stage whose time and weights it has.
    pub stage: u32,
    /// Sub-step.
    pub sub_step: u32,
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
    /// What selects its pipeline; `None` of copies.
    pub fn kernel(&self) -> Option<Kernel> {
        match self.work {
            Work::Dispatch { kernel, .. } | Work::Draw(kernel) => Some(kernel),
            Work::Copy { .. } | Work::Fill(..) => None,
        }
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
pub enum Entry {
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
    let layout = if from.row().role.is_image() { ImageLayout::TRANSFER_SRC_OPTIMAL } else { ImageLayout::UNDEFINED };
    Pass {
        name: name.to_owned(),
        work: Work::Copy { from, to },
        accesses: vec![Access { layout, ..access(from, COPY_READ) }, access(to, COPY_WRITE)],
    }
}

/// Fills a buffer of floats with zero: all of its bits are.
pub(super) fn clear_pass(name: &str, resource: Resource) -> Pass {
    Pass { name: name.to_owned(), work: Work::Fill(resource, 0), accesses: vec![access(resource, CLEAR_WRITE)] }
}
