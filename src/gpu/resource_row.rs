//! What the table of resources says of each buffer and image: size, memory, usage and binding.

use ash::vk;
use gpu_allocator::MemoryLocation;
use vk::BufferUsageFlags as U;

/// Rule for the number of elements of a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// Always one.
    Once,
    /// Steps of a fused dispatch.
    FusedSteps,
    /// Directions in the albedo table.
    Albedo,
    /// Directions in the albedo tables of a fused dispatch.
    FusedAlbedo,
    /// Materials.
    Materials,
    /// Straight pieces of the shaped response functions.
    Shapes,
    /// One, if a pixel needs the surroundings of the craft.
    Surroundings,
    /// Two faces of every material, if surfaces reflect or an emissivity has a law.
    Reflectors,
    /// Numbers of the lobes of rough mirrors.
    Lobes,
    /// Numbers of the emissivities over angle and temperature.
    Emissivities,
    /// One, if surfaces reflect the craft itself.
    Tracing,
    /// Boxes of the tree for these reflections.
    TraceBoxes,
    /// Triangles of this tree.
    TraceTriangles,
    /// One, if the planet has a map.
    PlanetView,
    /// Cells of that map.
    PlanetMap,
    /// Means over it for the directions of a surface, if surfaces reflect.
    PlanetMeans,
    /// Groups of four nodes.
    Groups,
    /// Groups, if a load or a reflection depends on the normal of a node.
    LoadedGroups,
    /// Groups, if the image has normals of its own.
    CrinkledGroups,
    /// Groups, if nodes keep a state between steps.
    MovingGroups,
    /// Groups, if this state has three numbers.
    TargetGroups,
    /// Groups, if anything is drawn or casts a shadow.
    PlacedGroups,
    /// Groups, if an image is drawn.
    DrawnGroups,
    /// Groups, if images lie between steps.
    BetweenGroups,
    /// Groups, if the craft shadows itself.
    ShadowedGroups,
    /// Triangles of an image.
    Triangles,
    /// Draws of an image.
    Draws,
    /// Values in the band table.
    Band,
    /// One, if shadows use a shadow map.
    SunView,
    /// Triangles that are drawn into the shadow map.
    Occluders,
    /// Texels of the shadow map.
    SunTexels,
    /// Boxes of the tree for shadow rays.
    Boxes,
    /// Triangles of the tree for shadow rays.
    Traced,
    /// Pixels of the image.
    Pixels,
    /// Texels of the largest image that is drawn, if surfaces reflect the craft itself.
    SurfaceTexels,
    /// Texels of the image that is drawn with one sample of a pixel.
    DrawnTexels,
    /// The same, if another image is computed from it.
    ReadTexels,
    /// The same, if another image is computed from it or reflections of the craft are added to it.
    LitTexels,
    /// Pixels of an image that is computed from drawn ones.
    ComputedPixels,
    /// Texels of the image from which the mean over several samples is made.
    MeanTexels,
    /// Samples of its texels.
    MeanSamples,
    /// Samples of its texels, if there are several of each.
    MultiSamples,
    /// Corners of the pixels of an image with distortion.
    LensCorners,
    /// One, if the image is computed from drawn ones.
    ComputedOnce,
    /// One, if the craft may be far away.
    DistantOnce,
    /// One, if the image has a rolling shutter.
    RollingOnce,
    /// One, if the image has a sensor.
    Sensor,
    /// Room for the weights of its kernels.
    SensorWeights,
    /// Pixels that it reads.
    SensorPixels,
    /// Groups of four pixels, each row rounded up.
    SensorGroups,
    /// These groups times the separable terms of its point spread.
    SensorRows,
    /// Cells of its halo.
    SensorCells,
    /// Groups, if it has a map of vignetting.
    SensorVignetting,
    /// Groups, if its bolometer lags.
    SensorBolometer,
    /// Entries of its table of temperatures.
    SensorGuesses,
    /// Groups of a network that is stepped in one pass.
    OnePassGroups,
    /// Those of its groups that are in blocks.
    OnePassBlockGroups,
    /// Those of its groups that are in large blocks.
    OnePassLargeGroups,
    /// Those of its groups whose error is estimated.
    OnePassEstimated,
    /// Words of its links.
    OnePassLinks,
    /// Words of its sources.
    OnePassSources,
    /// Weights of four nodes for its blocks.
    OnePassWeights,
    /// Its heaters.
    OnePassHeaters,
    /// Groups of nodes, and of the heaters of a network that is stepped in one pass.
    HeatedGroups,
    /// Groups, if surfaces radiate to each other.
    ExchangeGroups,
    /// Patches that radiate to each other, and one for faces without any.
    ExchangePatches,
    /// Nodes of these patches.
    ExchangeMembers,
    /// Fours of pairs of these patches.
    ExchangeEntries,
    /// Joints, the body too, if surfaces radiate to each other.
    ExchangeJoints,
    /// Rays that keep what patches see of the sky.
    ExchangeSky,
    /// Patches, and pairs of those that mirror sunlight.
    ExchangeMirrors,
    /// Patches, if some mirror sunlight.
    ExchangeMirrored,
    /// Runs of nodes whose absorbed heat is summed.
    HeatRuns,
    /// Groups, if absorbed heat is summed.
    HeatGroups,
    /// A number that the code gives at creation.
    Given,
}

impl Count {
    /// Whether the number grows with the nodes or triangles of a scene.
    pub fn grows_with_nodes(self) -> bool {
        matches!(
            self,
            Self::Groups
                | Self::LoadedGroups
                | Self::CrinkledGroups
                | Self::MovingGroups
                | Self::TargetGroups
                | Self::PlacedGroups
                | Self::DrawnGroups
                | Self::BetweenGroups
                | Self::ShadowedGroups
                | Self::Triangles
                | Self::TraceBoxes
                | Self::TraceTriangles
                | Self::Draws
                | Self::OnePassGroups
                | Self::OnePassBlockGroups
                | Self::OnePassLargeGroups
                | Self::OnePassEstimated
                | Self::OnePassLinks
                | Self::OnePassSources
                | Self::OnePassWeights
                | Self::HeatedGroups
                | Self::HeatGroups
                | Self::ExchangeGroups
        )
    }
}

impl Count {
    /// Whether the number is that of radiation between surfaces.
    pub fn is_of_exchange(self) -> bool {
        matches!(
            self,
            Self::ExchangeGroups
                | Self::ExchangePatches
                | Self::ExchangeMembers
                | Self::ExchangeEntries
                | Self::ExchangeJoints
                | Self::ExchangeSky
                | Self::ExchangeMirrors
                | Self::ExchangeMirrored
        )
    }

    /// Whether the number grows with the size of the image.
    pub fn is_of_images(self) -> bool {
        matches!(
            self,
            Self::Pixels
                | Self::DrawnTexels
                | Self::ReadTexels
                | Self::LitTexels
                | Self::SurfaceTexels
                | Self::ComputedPixels
                | Self::MeanTexels
                | Self::LensCorners
        ) || self.is_multiple()
    }

    /// Whether the elements of an image are the samples of its texels.
    pub fn is_multiple(self) -> bool {
        matches!(self, Self::MeanSamples | Self::MultiSamples)
    }
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
    pub fn location(self) -> MemoryLocation {
        match self {
            Self::Uniform | Self::FromHost | Self::Staging => MemoryLocation::CpuToGpu,
            Self::ToHost | Self::Readback => MemoryLocation::GpuToCpu,
            _ => MemoryLocation::GpuOnly,
        }
    }

    /// Usage flags of a buffer, empty for an image.
    pub fn usage(self) -> U {
        match self {
            Self::Uniform => U::UNIFORM_BUFFER,
            Self::FromHost | Self::Storage | Self::ToHost => U::STORAGE_BUFFER | U::TRANSFER_DST | U::TRANSFER_SRC,
            Self::Readback => U::TRANSFER_DST,
            Self::Staging => U::TRANSFER_SRC,
            Self::Indices => U::INDEX_BUFFER | U::TRANSFER_DST,
            Self::WrittenIndices => U::INDEX_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST,
            Self::Commands => U::INDIRECT_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST,
            Self::Colour(_) | Self::Depth => U::empty(),
        }
    }

    /// Descriptor type.
    pub fn descriptor(self) -> vk::DescriptorType {
        if self == Self::Uniform { vk::DescriptorType::UNIFORM_BUFFER } else { vk::DescriptorType::STORAGE_BUFFER }
    }
}

/// When every pass binds only a part of a buffer. The buffer may then be longer than the largest binding of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pieces {
    /// Never, because some pass binds it whole.
    Never,
    /// In scenes without an image, because drawing reads the whole buffer.
    WithoutImage,
    /// In scenes whose images need no normals, because drawing with them reads the whole buffer.
    WithoutNormals,
    /// Always.
    Always,
}

/// Properties of a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Size of an element [bytes]. Ranges of nodes, triangles and draws count elements.
    pub element: usize,
    /// Number of elements.
    pub count: Count,
    /// Use.
    pub role: Role,
    /// Whether each frame in flight has its own copy. A fence then orders the accesses of the host.
    pub per_slot: bool,
    /// Whether every joint has its own slice, with vectors in the joint's frame.
    pub per_joint: bool,
    /// When passes bind only parts.
    pub pieces: Pieces,
    /// GLSL blocks that it is bound to, without the suffix `Block`. It is empty if no shader uses the resource.
    pub blocks: &'static str,
}

impl Row {
    /// With a copy for each frame in flight.
    pub(super) const fn each_slot(self) -> Self {
        Self { per_slot: true, ..self }
    }

    /// With a slice for every joint.
    pub(super) const fn each_joint(self) -> Self {
        Self { per_joint: true, ..self }
    }

    /// Bound in parts.
    pub(super) const fn in_pieces(self, pieces: Pieces) -> Self {
        Self { pieces, ..self }
    }

    /// Whether its size on the device grows with the number of nodes. Buffers that only the host reads do not count.
    pub fn grows_with_nodes(&self) -> bool {
        self.count.grows_with_nodes() && self.role != Role::Readback
    }

    /// Number of copies of the buffer.
    pub fn copies(&self) -> usize {
        if self.per_slot { SLOTS } else { 1 }
    }
}

/// A resource that shaders use, with one copy for all slots and joints.
pub(super) const fn row(element: usize, count: Count, role: Role, blocks: &'static str) -> Row {
    Row { element, count, role, per_slot: false, per_joint: false, pieces: Pieces::Never, blocks }
}

/// A resource that no shader uses.
pub(super) const fn unbound(element: usize, count: Count, role: Role) -> Row {
    row(element, count, role, "")
}

/// Frames in flight. The device works on one while the host reads the other.
pub const SLOTS: usize = 2;
