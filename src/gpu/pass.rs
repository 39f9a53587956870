//! What a frame consists of: passes with their shaders, and barriers between them.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};
use bytemuck::NoUninit;

use super::resource::{Per, Resource};
use super::shaders::Shader;

/// Pipeline stages and their memory accesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    /// Stages.
    pub stage: S,
    /// Accesses. They are empty if a barrier orders execution only.
    pub access: A,
}

pub(crate) const fn scope(stage: S, access: A) -> Scope {
    Scope { stage, access }
}

pub(crate) const COMPUTE_READ: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_READ);
pub(crate) const COMPUTE_WRITE: Scope = scope(S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
/// Reads and writes of a compute pass.
pub(crate) const COMPUTE: Scope =
    scope(S::COMPUTE_SHADER, A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()));
/// End of the compute passes, which only read.
pub(crate) const COMPUTED: Scope = scope(S::COMPUTE_SHADER, A::NONE);
pub(crate) const COPY_READ: Scope = scope(S::COPY, A::TRANSFER_READ);
pub(crate) const COPY_WRITE: Scope = scope(S::COPY, A::TRANSFER_WRITE);
/// End of the copies, which only read.
pub(crate) const COPIED: Scope = scope(S::COPY, A::NONE);
/// Write of `vkCmdFillBuffer`, which is a clear. Validation layers before February 2024 treat it as a copy
/// (Vulkan-ValidationLayers, pull request 7543).
pub(crate) const CLEAR_WRITE: Scope =
    Scope { stage: S::from_raw(S::COPY.as_raw() | S::CLEAR.as_raw()), access: A::TRANSFER_WRITE };
/// Write of a colour attachment.
pub(crate) const COLOUR: Scope = scope(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
/// Depth write.
pub(crate) const DEPTH_WRITE: Scope = scope(
    S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw()),
    A::DEPTH_STENCIL_ATTACHMENT_WRITE,
);
/// Depth test and write.
pub(crate) const DEPTH: Scope = scope(
    DEPTH_WRITE.stage,
    A::from_raw(A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()),
);
/// Read of the host.
pub(crate) const HOST_READ: Scope = scope(S::HOST, A::HOST_READ);

/// Access of a pass to a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// Resource.
    pub resource: &'static Resource,
    /// Stages and accesses.
    pub scope: Scope,
    /// Accessed elements: the first and the one after the last. `None` is the whole resource.
    pub range: Option<(u32, u32)>,
    /// Joint whose slice is accessed, if the resource has a slice for each joint; 0 is the body.
    pub slice: u32,
    /// Binding in the descriptor set, if any.
    pub binding: Option<u32>,
    /// Image layout, ignored for a buffer.
    pub layout: ImageLayout,
}

/// Which parts of which buffers a pass touches, where its shaders do not tell.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct PassReach {
    /// Joint whose slices it touches; 0 is the body.
    pub(crate) joint: u32,
    /// Ranges of the buffers with so many elements.
    pub(crate) ranges: Vec<(Per, (u32, u32))>,
    /// Buffers in the place of the ones that blocks name.
    pub(crate) instead: Vec<(&'static str, &'static Resource)>,
    /// A buffer that a measured dispatch counts as writing.
    pub(crate) nominal: Option<&'static Resource>,
}

/// A draw of triangles into images.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawing {
    /// Vertex shader and, if there are colours, fragment shader.
    pub(crate) shaders: Vec<Shader>,
    /// The same of what is drawn where no triangle is, with the same bindings. Empty for nothing.
    pub(crate) behind: Vec<Shader>,
    /// Images, each cleared to 0, and the image that gets the mean over its samples.
    pub(crate) colours: Vec<(&'static Resource, Option<&'static Resource>)>,
    /// Depth buffer.
    pub(crate) depth: &'static Resource,
    /// Samples of a texel.
    pub(crate) samples: u32,
    /// Indices of the triangles.
    pub(crate) indices: &'static Resource,
    /// Draw commands.
    pub(crate) commands: &'static Resource,
    /// Push constants of all shaders.
    pub(crate) constants: Vec<u8>,
}

/// Work of a pass.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PassWork {
    /// Dispatch.
    Dispatch {
        /// Shader.
        shader: Shader,
        /// Number of workgroups.
        workgroups: u32,
        /// Push constants.
        constants: Vec<u8>,
    },
    /// Draw.
    Draw(Drawing),
    /// Copy from a buffer or image to a buffer.
    Copy {
        /// Source.
        from: &'static Resource,
        /// Destination.
        to: &'static Resource,
    },
    /// Fill of a buffer with a 32-bit word.
    Fill(&'static Resource, u32),
}

/// A named command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pass {
    /// Debug label, and name of its timestamps.
    pub name: String,
    /// Dispatch, draw, copy or fill.
    pub work: PassWork,
    /// Parts of the buffers.
    pub reach: PassReach,
}

impl Pass {
    /// A dispatch. The shader tells which buffers it reads and writes.
    pub(crate) fn dispatch(name: impl Into<String>, shader: Shader, workgroups: u32) -> Self {
        let work = PassWork::Dispatch { shader, workgroups, constants: Vec::new() };
        Self { name: name.into(), work, reach: PassReach::default() }
    }

    /// A draw.
    pub(crate) fn draw(name: &str, drawing: Drawing) -> Self {
        Self { name: name.to_owned(), work: PassWork::Draw(drawing), reach: PassReach::default() }
    }

    /// A copy of a whole buffer or image.
    pub(crate) fn copy(name: &str, from: &'static Resource, to: &'static Resource) -> Self {
        Self { name: name.to_owned(), work: PassWork::Copy { from, to }, reach: PassReach::default() }
    }

    /// A fill of a buffer with a 32-bit word.
    pub(crate) fn fill(name: &str, resource: &'static Resource, word: u32) -> Self {
        Self { name: name.to_owned(), work: PassWork::Fill(resource, word), reach: PassReach::default() }
    }

    /// Limits it to a range of elements.
    pub(crate) fn over(mut self, per: Per, range: (u32, u32)) -> Self {
        self.reach.ranges.push((per, range));
        self
    }

    /// Gives it the slices of a joint.
    pub(crate) fn of_joint(mut self, joint: u32) -> Self {
        self.reach.joint = joint;
        self
    }

    /// Binds a buffer in the place of the one that a block names.
    pub(crate) fn instead(mut self, block: &'static str, resource: &'static Resource) -> Self {
        if block != resource.name {
            self.reach.instead.push((block, resource));
        }
        self
    }

    /// Gives the dispatch or the draw its push constants.
    pub(crate) fn told<T: NoUninit>(mut self, structure: &T) -> Self {
        if let PassWork::Dispatch { constants, .. } | PassWork::Draw(Drawing { constants, .. }) = &mut self.work {
            constants.extend_from_slice(bytemuck::bytes_of(structure));
        }
        self
    }

    /// Its shaders: of a dispatch, or of a draw with what is drawn behind.
    pub fn shaders(&self) -> Vec<&Shader> {
        match &self.work {
            PassWork::Dispatch { shader, .. } => vec![shader],
            PassWork::Draw(drawing) => drawing.shaders.iter().chain(&drawing.behind).collect(),
            PassWork::Copy { .. } | PassWork::Fill(..) => Vec::new(),
        }
    }

    /// The entry point of its first shader; `None` for copies.
    pub fn entry(&self) -> Option<&'static str> {
        self.shaders().first().map(|shader| shader.entry)
    }
}

/// A memory barrier for one resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Barrier {
    /// Resource.
    pub resource: &'static Resource,
    /// Earlier accesses.
    pub before: Scope,
    /// Later accesses.
    pub after: Scope,
    /// Old and new layout of an image.
    pub layouts: Option<(ImageLayout, ImageLayout)>,
}

/// An entry of a frame list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ListEntry {
    /// A pass.
    Pass(Pass),
    /// Barriers that are recorded together.
    Barriers(Vec<Barrier>),
}

/// Passes and barriers that are submitted together.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frame {
    /// Passes and barriers in queue order.
    pub entries: Vec<ListEntry>,
}

impl Frame {
    /// Appends a pass.
    pub(crate) fn pass(&mut self, pass: Pass) {
        self.entries.push(ListEntry::Pass(pass));
    }

    /// Appends passes that may run at the same time.
    pub(crate) fn passes_of(&mut self, passes: impl IntoIterator<Item = Pass>) {
        self.entries.extend(passes.into_iter().map(ListEntry::Pass));
    }

    /// Appends barriers that are recorded together.
    pub(crate) fn wait(&mut self, barriers: impl IntoIterator<Item = Barrier>) {
        let barriers: Vec<Barrier> = barriers.into_iter().collect();
        if !barriers.is_empty() {
            self.entries.push(ListEntry::Barriers(barriers));
        }
    }

    /// Appends another list to the same command buffer.
    pub fn then(mut self, next: Self) -> Self {
        self.entries.extend(next.entries);
        self
    }

    /// The passes in queue order.
    pub fn passes(&self) -> impl Iterator<Item = &Pass> {
        self.entries.iter().filter_map(|entry| match entry {
            ListEntry::Pass(pass) => Some(pass),
            ListEntry::Barriers(_) => None,
        })
    }

    /// Puts a word before the names of its passes, under which their times are kept.
    pub(crate) fn named(mut self, word: &str) -> Self {
        for entry in &mut self.entries {
            if let ListEntry::Pass(pass) = entry {
                pass.name = format!("{word} {}", pass.name);
            }
        }
        self
    }

    /// Resources that the host may read after the list.
    pub(crate) fn left_to_host(&self) -> impl Iterator<Item = &'static Resource> {
        let barriers = self.entries.iter().flat_map(|entry| match entry {
            ListEntry::Barriers(barriers) => barriers.as_slice(),
            ListEntry::Pass(_) => &[],
        });
        barriers.filter(|barrier| barrier.after.stage.contains(S::HOST)).map(|barrier| barrier.resource)
    }
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
pub(crate) fn barrier(resource: &'static Resource, before: Scope, after: Scope) -> Barrier {
    Barrier { resource, before, after, layouts: None }
}

/// A barrier that makes an image ready to be drawn. The old contents are lost.
pub(crate) fn to_draw(resource: &'static Resource, before: Scope, after: Scope) -> Barrier {
    Barrier { resource, before, after, layouts: Some((ImageLayout::UNDEFINED, ImageLayout::ATTACHMENT_OPTIMAL)) }
}

/// A barrier that makes a drawn image ready to be copied.
pub(crate) fn to_copy(resource: &'static Resource, before: Scope) -> Barrier {
    let layouts = Some((ImageLayout::ATTACHMENT_OPTIMAL, ImageLayout::TRANSFER_SRC_OPTIMAL));
    Barrier { resource, before, after: COPY_READ, layouts }
}

/// A barrier that makes a copy visible to the host.
pub(crate) fn to_host(resource: &'static Resource) -> Barrier {
    barrier(resource, COPY_WRITE, HOST_READ)
}
