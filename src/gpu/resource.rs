//! Every buffer and image of the program, one row each. Memory plan, allocation, binding, hazard check, the check of the
//! layouts against the shaders and `isotherm info` read this table.

use ash::vk;
use gpu_allocator::MemoryLocation;
use vk::BufferUsageFlags as U;

use super::layout;
use crate::environment::MAX_SUN_SAMPLES;

/// What decides how many elements a resource has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// One.
    Once,
    /// Steps of a fused dispatch.
    FusedSteps,
    /// Directions of the table of albedo.
    Albedo,
    /// The same, for every step of a fused dispatch.
    FusedAlbedo,
    /// Materials.
    Materials,
    /// Cubic pieces of the response functions.
    Shapes,
    /// Groups of four nodes.
    Groups,
    /// Groups, where a load depends on the normal of a node.
    LoadedGroups,
    /// Groups, where nodes keep a state between steps.
    MovingGroups,
    /// Groups, where anything is drawn or casts a shadow.
    PlacedGroups,
    /// Groups, where an image is drawn.
    DrawnGroups,
    /// Groups, where the craft shadows itself.
    ShadowedGroups,
    /// Triangles of an image.
    Triangles,
    /// Draws of an image.
    Draws,
    /// Values of the band's table.
    Band,
    /// One, where the Sun's view is drawn.
    SunView,
    /// Triangles that are drawn as the Sun sees them.
    Occluders,
    /// Texels of the Sun's view.
    SunTexels,
    /// Boxes around the triangles that rays are tried against.
    Boxes,
    /// Triangles that rays are tried against.
    Traced,
    /// Pixels of the image.
    Pixels,
    /// Groups of four nodes of a large network.
    NetworkGroups,
    /// Slices of its rows, and their end.
    NetworkSlices,
    /// Entries of linear conductors, four nodes each.
    NetworkLinear,
    /// Entries of radiative conductors, four nodes each.
    NetworkRadiative,
    /// Nodes where some have more conductors than a row holds, and their end.
    NetworkTails,
    /// Conductors of these beyond the row.
    NetworkLinks,
    /// None: the list of all groups needs no entries.
    NetworkAll,
    /// Groups with an arithmetic node.
    NetworkArithmetic,
    /// Groups with a node that is no boundary.
    NetworkFree,
    /// Sensors.
    NetworkSensors,
    /// Sensors, for every sub-step of a submission.
    NetworkSensed,
    /// Workgroups of the largest pass.
    NetworkWorkgroups,
    /// One, of a large network.
    NetworkOnce,
    /// As many as its maker asks for.
    Given,
}

impl Count {
    /// Whether it follows the number of a scene's nodes or triangles.
    pub fn grows_with_nodes(self) -> bool {
        matches!(
            self,
            Self::Groups
                | Self::LoadedGroups
                | Self::MovingGroups
                | Self::PlacedGroups
                | Self::DrawnGroups
                | Self::ShadowedGroups
                | Self::Triangles
                | Self::Draws
        )
    }
}

/// What a resource is for, which decides its memory and its usage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The host writes, and every invocation reads at the same address. (On lavapipe each scalar of a storage buffer costs every
    /// invocation 0.5 ns; a uniform is read once.)
    Uniform,
    /// The host writes and shaders read.
    FromHost,
    /// Shaders and copies read and write.
    Storage,
    /// Shaders and copies write, and the host may read and write between submissions.
    ToHost,
    /// Copies write and the host reads.
    Readback,
    /// The host writes and copies read.
    Staging,
    /// Copies write and draws take their vertices from it.
    Indices,
    /// The same, and shaders write.
    WrittenIndices,
    /// Shaders and copies write, and draws take their commands from it.
    Commands,
    /// An image that is drawn into.
    Colour(vk::Format),
    /// A depth image.
    Depth,
}

impl Role {
    /// Whether it is an image, which has a layout.
    pub fn is_image(self) -> bool {
        matches!(self, Self::Colour(_) | Self::Depth)
    }

    /// Where the memory is; images are on the device.
    pub fn location(self) -> MemoryLocation {
        match self {
            Self::Uniform | Self::FromHost | Self::Staging => MemoryLocation::CpuToGpu,
            Self::ToHost | Self::Readback => MemoryLocation::GpuToCpu,
            _ => MemoryLocation::GpuOnly,
        }
    }

    /// How a buffer may be used; none of an image.
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

    /// How shaders see it.
    pub fn descriptor(self) -> vk::DescriptorType {
        if self == Self::Uniform { vk::DescriptorType::UNIFORM_BUFFER } else { vk::DescriptorType::STORAGE_BUFFER }
    }
}

/// Whether every pass that binds a buffer binds a piece of it, so that it may be longer than what a device binds at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pieces {
    /// Some pass binds it whole.
    Never,
    /// Where no image is drawn, which pulls values from anywhere.
    WithoutImage,
    /// Every pass.
    Always,
}

/// What a resource is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Bytes of an element; ranges of nodes, triangles and draws are ranges of elements.
    pub element: usize,
    /// What their number follows.
    pub count: Count,
    /// What it is for.
    pub role: Role,
    /// Whether the two frames in flight have one each; a fence orders the uses of each by the host.
    pub per_slot: bool,
    /// Whether every joint has a slice of it: what it says is said in the frame in which the joint's nodes do not move.
    pub per_joint: bool,
    /// How passes bind it.
    pub pieces: Pieces,
    /// The blocks of GLSL that it is bound to, without the word `Block`; empty where no shader sees it.
    pub blocks: &'static str,
}

impl Row {
    const fn each_slot(self) -> Self {
        Self { per_slot: true, ..self }
    }

    const fn each_joint(self) -> Self {
        Self { per_joint: true, ..self }
    }

    const fn in_pieces(self, pieces: Pieces) -> Self {
        Self { pieces, ..self }
    }

    /// Whether its size on the device follows the number of nodes; what only the host reads is not counted.
    pub fn grows_with_nodes(&self) -> bool {
        self.count.grows_with_nodes() && self.role != Role::Readback
    }

    /// Copies of a buffer.
    pub fn copies(&self) -> usize {
        if self.per_slot { SLOTS } else { 1 }
    }
}

const fn row(element: usize, count: Count, role: Role, blocks: &'static str) -> Row {
    Row { element, count, role, per_slot: false, per_joint: false, pieces: Pieces::Never, blocks }
}

/// What only the host and copies see.
const fn unbound(element: usize, count: Count, role: Role) -> Row {
    row(element, count, role, "")
}

/// Frames in flight: the device works on one while the host reads the other.
pub const SLOTS: usize = 2;

/// Bytes of a float of each of the four nodes of a group.
const GROUP: usize = 16;
/// Bytes of base and rest of the temperature, or of power and slope of the heat, of each of them.
const PAIRS: usize = 32;
/// Bytes of the corners of a triangle.
const CORNERS: usize = 12;
/// Bytes of the Sun's samples of a step.
const SAMPLES: usize = 16 * MAX_SUN_SAMPLES;

macro_rules! table {
    ($($(#[$doc:meta])* $name:ident: $row:expr;)*) => {
        /// Whatever a pass reads or writes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Resource {
            $($(#[$doc])* $name,)*
        }

        impl Resource {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// What it is.
            pub fn row(self) -> Row {
                use Count::*;
                use Pieces::{Always, WithoutImage};
                use Role::*;
                match self {
                    $(Self::$name => $row,)*
                }
            }
        }
    };
}

table! {
    /// `Step`, written by the host.
    Step: row(size_of::<layout::Step>(), Once, Uniform, "Step").each_slot().each_joint();
    /// Sun samples of the step, written by the host.
    SunSamples: row(SAMPLES, Once, Uniform, "Sun").each_slot().each_joint();
    /// Albedo over the directions of a normal, written by the host.
    AlbedoValues: row(4, Albedo, FromHost, "Albedo").each_slot();
    /// `Step`s of a fused dispatch, written by the host.
    FusedSteps: row(size_of::<layout::Step>(), Count::FusedSteps, Uniform, "Step").each_slot();
    /// Their Sun samples, written by the host.
    FusedSunSamples: row(SAMPLES, Count::FusedSteps, Uniform, "Sun").each_slot();
    /// Their albedos over the directions of a normal, written by the host.
    FusedAlbedoValues: row(4, FusedAlbedo, FromHost, "Albedo").each_slot();
    /// `View`, written by the host.
    View: row(size_of::<layout::View>(), Once, Uniform, "View").each_slot().each_joint();
    /// `Material` of every material.
    Materials: row(size_of::<layout::Material>(), Count::Materials, Storage, "Material");
    /// Pieces of the response functions that are no powers.
    Shapes: row(16, Count::Shapes, Storage, "Shape");
    /// Material of every group of four nodes.
    GroupMaterial: row(4, Groups, Storage, "GroupMaterial").in_pieces(WithoutImage);
    /// Part of every group of four nodes.
    GroupPart: row(4, DrawnGroups, Storage, "GroupPart").in_pieces(WithoutImage);
    /// Normals, one buffer a component.
    NormalX: row(GROUP, LoadedGroups, Storage, "NormalX").in_pieces(Always);
    /// See `NormalX`.
    NormalY: row(GROUP, LoadedGroups, Storage, "NormalY").in_pieces(Always);
    /// See `NormalX`.
    NormalZ: row(GROUP, LoadedGroups, Storage, "NormalZ").in_pieces(Always);
    /// Positions [m], one buffer a component.
    PositionX: row(GROUP, PlacedGroups, Storage, "PositionX");
    /// See `PositionX`.
    PositionY: row(GROUP, PlacedGroups, Storage, "PositionY");
    /// See `PositionX`.
    PositionZ: row(GROUP, PlacedGroups, Storage, "PositionZ");
    /// Node indices of the triangles.
    Triangles: row(CORNERS, Count::Triangles, Storage, "Triangle").in_pieces(Always);
    /// Those of them that may cover a pixel's centre, at the front of those of their draw.
    VisibleTriangles: row(CORNERS, Count::Triangles, WrittenIndices, "VisibleTriangle").in_pieces(Always);
    /// `DrawCommand` of each run of `VisibleTriangles`.
    Draws: row(size_of::<layout::DrawCommand>(), Count::Draws, Commands, "Draw").in_pieces(Always);
    /// Table of the band's radiance.
    BandTable: row(4, Band, Storage, "BandTable");
    /// Target temperature of every node [K].
    Target: row(GROUP, MovingGroups, Storage, "Target").in_pieces(Always);
    /// Target less old temperature of every node [K].
    Span: row(GROUP, MovingGroups, Storage, "Span").in_pieces(Always);
    /// Steps since the transition began, of every node.
    Elapsed: row(GROUP, MovingGroups, Storage, "Elapsed").in_pieces(Always);
    /// Temperature of every node [K].
    Temperature: row(GROUP, Groups, Storage, "Temperature").in_pieces(WithoutImage);
    /// The Sun's view, written by the host.
    SunView: row(size_of::<layout::SunView>(), Count::SunView, Uniform, "SunView").each_slot().each_joint();
    /// Node indices of the triangles that cast shadows.
    Occluders: unbound(CORNERS, Count::Occluders, Indices);
    /// Depth as seen from the Sun, as it is drawn.
    SunDepthImage: unbound(4, SunTexels, Depth);
    /// The same where shaders read it.
    SunDepth: row(4, SunTexels, Storage, "SunDepth");
    /// Boxes around the triangles that cast shadows.
    ShadowTree: row(size_of::<layout::ShadowBox>(), Boxes, Storage, "ShadowTree");
    /// These triangles.
    ShadowTriangles: row(size_of::<layout::ShadowTriangle>(), Traced, Storage, "ShadowTriangle");
    /// Share of the Sun that every node sees.
    Visibility: row(GROUP, ShadowedGroups, Storage, "Visibility").in_pieces(Always);
    /// Radiance, temperature and depth of every pixel.
    RadianceImage: unbound(16, Pixels, Colour(vk::Format::R32G32B32A32_SFLOAT));
    /// Part and material of every pixel.
    IdentityImage: unbound(8, Pixels, Colour(vk::Format::R32G32_UINT));
    /// Depth buffer.
    DepthImage: unbound(4, Pixels, Depth);
    /// The images and temperatures where the host reads them.
    RadianceReadback: unbound(16, Pixels, Readback).each_slot();
    /// See `RadianceReadback`.
    IdentityReadback: unbound(8, Pixels, Readback).each_slot();
    /// See `RadianceReadback`.
    TemperatureReadback: unbound(GROUP, Groups, Readback).each_slot();

    /// Capacitances and sums of the nodes of a large network.
    NetworkRows: row(PAIRS, NetworkGroups, Storage, "Row");
    /// Where the conductors of every slice of rows begin.
    NetworkSlices: row(8, Count::NetworkSlices, Storage, "Slice");
    /// Neighbours of four nodes each.
    NetworkNeighbours: row(16, NetworkLinear, Storage, "Neighbour");
    /// Linear conductors to them [W/K].
    NetworkConductances: row(16, NetworkLinear, Storage, "Conductance");
    /// Neighbours that four nodes each radiate to, and how much.
    NetworkRadiators: row(32, NetworkRadiative, Storage, "Radiator");
    /// Where the conductors of a node beyond its row begin.
    NetworkTails: row(4, Count::NetworkTails, Storage, "Tail");
    /// These conductors.
    NetworkLinks: row(size_of::<layout::NetworkLink>(), Count::NetworkLinks, Storage, "Link");
    /// Heat of every node [W] and its slope [W/s], written by the host.
    NetworkHeat: row(PAIRS, NetworkGroups, FromHost, "Heat");
    /// The list of a pass over all nodes, which is empty and which no such pass binds.
    NetworkAll: unbound(4, Count::NetworkAll, Storage);
    /// Groups with arithmetic nodes, and a bit for each of these.
    NetworkArithmetic: row(4, Count::NetworkArithmetic, Storage, "List");
    /// The same of nodes that are no boundary.
    NetworkFree: row(4, Count::NetworkFree, Storage, "List");
    /// Nodes of the sensors.
    NetworkSensors: row(4, Count::NetworkSensors, Storage, "List");
    /// Kept temperatures of a network: base and rest [K] of every node.
    NetworkKept: unbound(PAIRS, NetworkGroups, ToHost);
    /// Temperatures of a network that is tried, of every other stage.
    NetworkEven: row(PAIRS, NetworkGroups, Storage, "Present Gathered Next");
    /// See `NetworkEven`.
    NetworkOdd: row(PAIRS, NetworkGroups, Storage, "Present Gathered Next");
    /// Rests of the nodes of a network at the start of a sub-step [K]; of TR-BDF2 the change of the first stage.
    NetworkStart: row(GROUP, NetworkGroups, Storage, "Start");
    /// Rates of the nodes of a network [K/s]; of TR-BDF2 the heat at the start [W].
    NetworkRates: row(GROUP, NetworkGroups, Storage, "Rate");
    /// Largest errors, where the host reads them.
    NetworkErrors: row(4, NetworkGroups, ToHost, "Error");
    /// Temperatures of the sensors, where the host reads them.
    NetworkSensed: row(8, Count::NetworkSensed, ToHost, "Sensed");
    /// Parts of sums.
    SolverPartials: row(8, NetworkWorkgroups, Storage, "Partial");
    /// What the solver knows of itself, where the host reads it.
    SolverScalars: row(size_of::<layout::NetworkSolver>(), NetworkOnce, ToHost, "Scalar");
    /// Preconditioned residual of the solver [K].
    SolverConditioned: row(GROUP, NetworkGroups, Storage, "Conditioned ConditionedOne");
    /// Direction of search.
    SolverDirection: row(GROUP, NetworkGroups, Storage, "Direction");
    /// The matrix times that.
    SolverProductDirection: row(GROUP, NetworkGroups, Storage, "ProductDirection");
    /// Solution [K].
    SolverSolution: row(GROUP, NetworkGroups, Storage, "Solution");
    /// The matrix times the preconditioned residual.
    SolverProduct: row(GROUP, NetworkGroups, Storage, "Product");
    /// The diagonal [W/K].
    SolverDiagonal: row(GROUP, NetworkGroups, Storage, "Diagonal");

    /// What the dispatches over a small network do.
    SmallAttempt: row(size_of::<layout::NetworkAttempt>(), Given, FromHost, "Attempt");
    /// Its nodes.
    SmallNodes: row(size_of::<layout::NetworkNode>(), Given, FromHost, "Node");
    /// Its conductors.
    SmallLinks: row(size_of::<layout::NetworkLink>(), Given, FromHost, "Link");
    /// Heat of every node [W] and its slope [W/s].
    SmallHeat: row(8, Given, FromHost, "Heat");
    /// Weights of the stages of a sub-step.
    SmallStages: row(size_of::<layout::NetworkStage>(), Given, FromHost, "Stage");
    /// Sensors, and arithmetic nodes without arithmetic neighbours.
    SmallLists: row(4, Given, FromHost, "List");
    /// Base and rest of every node [K], as kept or as tried.
    SmallEven: row(8, Given, ToHost, "State");
    /// The other of the two.
    SmallOdd: row(8, Given, ToHost, "State");
    /// Stages under way.
    SmallWork: row(16, Given, Storage, "Work");
    /// What was done, the largest error, and the sensors' temperatures.
    SmallResult: row(4, Given, ToHost, "Result");
    /// Order in which the balances of arithmetic nodes are eliminated.
    BalanceSchedule: row(4, Given, FromHost, "Schedule");
    /// Their matrix.
    BalanceMatrix: row(4, Given, Storage, "Matrix");
    /// Order in which the balances of all nodes are eliminated.
    StepSchedule: row(4, Given, FromHost, "Schedule");
    /// Their matrix.
    StepMatrix: row(4, Given, Storage, "Matrix");

    /// How many steps of a response to take.
    ResponseSteps: row(size_of::<layout::Steps>(), Given, FromHost, "Steps");
    /// Targets of these steps [K].
    ResponseTargets: row(4, Given, FromHost, "Commanded");
    /// Temperatures at these steps [K].
    ResponseTemperatures: row(4, Given, ToHost, "Temperature");
    /// Temperatures or radiances that are turned into the other.
    RadiationInput: row(4, Given, FromHost, "Input");
    /// What comes of them.
    RadiationOutput: row(4, Given, ToHost, "Output");
    /// Inverse temperatures of a table of radiances [1/K].
    InverseTemperatures: row(4, Given, FromHost, "Guess");
    /// What a measured copy reads.
    CopiedFrom: unbound(1, Given, Storage);
    /// What it writes.
    CopiedTo: unbound(1, Given, Storage);
    /// What passes that do nothing are taken to write.
    Untouched: unbound(16, Given, Storage);
    /// What the host uploads.
    Staged: unbound(1, Given, Staging);
    /// What the host downloads.
    Fetched: unbound(1, Given, Readback);
}
