//! A buffer or image as its effect declares it: its name in GLSL, size, memory and use.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::fmt;

use ash::vk;
use gpu_allocator::MemoryLocation;
use vk::BufferUsageFlags as U;

use super::scene_data::SceneData;

/// What the number of elements follows. A pass over a range binds that range of each buffer that follows the same thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Per {
    /// The scene, or what the code gives at creation.
    Scene,
    /// Nodes, mostly in groups of four.
    Node,
    /// Triangles of an image.
    Triangle,
    /// Draws of an image.
    Draw,
    /// Pixels of an image.
    Pixel,
    /// Texels to which passes over a range of them add.
    Texel,
    /// Samples of the texels of an image.
    Sample,
}

/// Use of a resource, which decides its memory and Vulkan usage flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The host writes, and all invocations read the same address. lavapipe reads a uniform once, but each scalar of a
    /// storage buffer costs every invocation 0.5 ns.
    Uniform,
    /// The host writes and shaders read.
    FromHost,
    /// Shaders and copies read and write.
    Storage,
    /// Only copies and fills read and write.
    Copied,
    /// Shaders and copies write. The host reads and writes between submissions.
    ToHost,
    /// Copies write and the host reads.
    Readback,
    /// The host writes and copies read.
    Staging,
    /// Copies write, and draws read indices.
    Indices,
    /// Copies and shaders write, and draws read indices.
    WrittenIndices,
    /// Shaders and copies write, and indirect draws read commands.
    Commands,
    /// A colour attachment.
    Colour(vk::Format),
    /// A depth attachment.
    Depth,
}

impl Role {
    /// Whether it is an image.
    pub fn is_image(self) -> bool {
        matches!(self, Self::Colour(_) | Self::Depth)
    }

    /// Memory of a buffer. Images are in device memory.
    pub(crate) fn location(self) -> MemoryLocation {
        match self {
            Self::Uniform | Self::FromHost | Self::Staging => MemoryLocation::CpuToGpu,
            Self::ToHost | Self::Readback => MemoryLocation::GpuToCpu,
            _ => MemoryLocation::GpuOnly,
        }
    }

    /// Usage flags of a buffer, empty for an image.
    pub(crate) fn usage(self) -> U {
        match self {
            Self::Uniform => U::UNIFORM_BUFFER,
            Self::FromHost | Self::Storage | Self::ToHost => U::STORAGE_BUFFER | U::TRANSFER_DST | U::TRANSFER_SRC,
            Self::Copied => U::TRANSFER_DST | U::TRANSFER_SRC,
            Self::Readback => U::TRANSFER_DST,
            Self::Staging => U::TRANSFER_SRC,
            Self::Indices => U::INDEX_BUFFER | U::TRANSFER_DST,
            Self::WrittenIndices => U::INDEX_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST,
            Self::Commands => U::INDIRECT_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST,
            Self::Colour(_) | Self::Depth => U::empty(),
        }
    }

    /// Descriptor type.
    pub(crate) fn descriptor(self) -> vk::DescriptorType {
        if self == Self::Uniform { vk::DescriptorType::UNIFORM_BUFFER } else { vk::DescriptorType::STORAGE_BUFFER }
    }
}

/// When every pass binds only a part of a buffer. The buffer may then be longer than the largest binding of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pieces {
    /// Never, because some pass binds it whole.
    Never,
    /// In scenes without an image, because drawing reads the whole buffer.
    WithoutImage,
    /// In scenes whose images need no normals, because drawing with them reads the whole buffer.
    WithoutNormals,
    /// Always.
    Always,
}

/// Number of elements in a scene.
type Count = fn(&SceneData<'_>) -> usize;

/// Contents in a scene at the start.
type Contents = for<'a> fn(&'a SceneData<'_>) -> Cow<'a, [u8]>;

/// A buffer or image that passes access. Each is a `static` in the file of its effect, and is equal only to itself.
pub struct Resource {
    /// Name. A shader names a buffer by a block with this name and the suffix `Block`.
    pub name: &'static str,
    /// Size of an element [bytes]. Ranges of nodes, triangles and draws count elements.
    pub(crate) element: usize,
    /// Number of elements in a scene; 0 if the scene does not need it.
    pub(crate) count: Count,
    /// What this number follows.
    pub(crate) per: Per,
    /// Use.
    pub role: Role,
    /// Whether each frame in flight has its own copy. A fence then orders the accesses of the host.
    pub per_slot: bool,
    /// Whether every joint has its own slice, with vectors in the joint's frame.
    pub(crate) per_joint: bool,
    /// When passes bind only parts.
    pub(crate) pieces: Pieces,
    /// Width and height of an image.
    pub(crate) size: fn(&SceneData<'_>) -> [u32; 2],
    /// Contents at the start.
    pub(crate) contents: Option<Contents>,
}

impl Resource {
    /// A resource with one copy for all slots and joints.
    pub(crate) const fn new(name: &'static str, element: usize, role: Role, per: Per, count: Count) -> Self {
        let (per_slot, per_joint, pieces) = (false, false, Pieces::Never);
        Self { name, element, count, per, role, per_slot, per_joint, pieces, size: |_| [0; 2], contents: None }
    }

    /// A uniform buffer with a structure for the whole scene, which the host writes for each frame.
    pub(crate) const fn uniform<T>(name: &'static str, count: Count) -> Self {
        Self::new(name, size_of::<T>(), Role::Uniform, Per::Scene, count).each_slot()
    }

    /// A buffer that only a command outside scenes uses.
    pub(crate) const fn given(name: &'static str, element: usize, role: Role) -> Self {
        Self::new(name, element, role, Per::Scene, |_| 0)
    }

    /// An image of a size. `count` is its number of texels or samples.
    pub(crate) const fn image(
        name: &'static str,
        element: usize,
        role: Role,
        per: Per,
        count: Count,
        size: fn(&SceneData<'_>) -> [u32; 2],
    ) -> Self {
        let mut image = Self::new(name, element, role, per, count);
        image.size = size;
        image
    }

    /// With a copy for each frame in flight.
    pub(crate) const fn each_slot(mut self) -> Self {
        self.per_slot = true;
        self
    }

    /// With a slice for every joint.
    pub(crate) const fn each_joint(mut self) -> Self {
        self.per_joint = true;
        self
    }

    /// Bound in parts.
    pub(crate) const fn in_pieces(mut self, pieces: Pieces) -> Self {
        self.pieces = pieces;
        self
    }

    /// With contents from the scene at the start.
    pub(crate) const fn filled(mut self, contents: Contents) -> Self {
        self.contents = Some(contents);
        self
    }

    /// Whether its size on the device grows with the number of nodes. Buffers that only the host reads do not count.
    pub fn grows_with_nodes(&self) -> bool {
        matches!(self.per, Per::Node | Per::Triangle | Per::Draw) && self.role != Role::Readback
    }

    /// Whether its size follows the size of an image.
    pub(crate) fn grows_with_images(&self) -> bool {
        matches!(self.per, Per::Pixel | Per::Texel | Per::Sample)
    }

    /// Number of copies of the buffer.
    pub(crate) fn copies(&self) -> usize {
        if self.per_slot { SLOTS } else { 1 }
    }
}

impl PartialEq for Resource {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Resource {}

impl PartialOrd for Resource {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Resource {
    fn cmp(&self, other: &Self) -> Ordering {
        self.name.cmp(other.name)
    }
}

impl fmt::Debug for Resource {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name)
    }
}

/// Declares buffers and images, and lists them.
macro_rules! resources {
    ($($(#[$doc:meta])* $name:ident = $resource:expr;)*) => {
        // Tests name some of them.
        $($(#[$doc])* #[allow(unreachable_pub)] pub static $name: Resource = $resource;)*

        /// The buffers and images of this file, in order.
        pub(crate) const RESOURCES: &[&Resource] = &[$(&$name),*];
    };
}

pub(crate) use resources;

/// The bytes of values that lie in the scene.
pub(crate) fn lent<T: bytemuck::NoUninit>(values: &[T]) -> Cow<'_, [u8]> {
    Cow::Borrowed(bytemuck::cast_slice(values))
}

/// The bytes of values that are made for the device.
pub(crate) fn made<T: bytemuck::NoUninit>(values: &[T]) -> Cow<'static, [u8]> {
    Cow::Owned(bytemuck::cast_slice(values).to_vec())
}

/// Size of one float for each node of a group [bytes].
pub(crate) const GROUP: usize = 16;
/// Size of two floats for each node of a group [bytes].
pub(crate) const PAIRS: usize = 32;

/// Frames in flight. The device works on one while the host reads the other.
pub(crate) const SLOTS: usize = 2;
