//! The table of all buffers and images.

use ash::vk;

use super::layout;
use super::resource_row::{Count, Pieces, Role, Row, row, unbound};
use crate::environment::MAX_SUN_SAMPLES;

/// Size of one float for each node of a group [bytes].
const GROUP: usize = 16;
/// Size of two floats for each node of a group [bytes].
const PAIRS: usize = 32;
/// Words of the log of a heater: its switches in a frame, and the times of the first ones.
pub const LOGGED: usize = 16;
/// Size of the three indices of a triangle [bytes].
const CORNERS: usize = 12;
/// Size of the Sun samples of a step [bytes].
const SAMPLES: usize = 16 * MAX_SUN_SAMPLES;

macro_rules! table {
    ($($(#[$doc:meta])* $name:ident: $row:expr;)*) => {
        /// A buffer or image that passes access.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Resource {
            $($(#[$doc])* $name,)*
        }

        impl Resource {
            /// All resources.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Its properties.
            pub fn row(self) -> Row {
                use Count::*;
                use Pieces::{Always, WithoutImage, WithoutNormals};
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
    /// Albedo table over the directions of a normal, written by the host.
    AlbedoValues: row(4, Albedo, FromHost, "Albedo").each_slot();
    /// `Step`s of a fused dispatch, written by the host.
    FusedSteps: row(size_of::<layout::Step>(), Count::FusedSteps, Uniform, "Step").each_slot();
    /// Sun samples of a fused dispatch, written by the host.
    FusedSunSamples: row(SAMPLES, Count::FusedSteps, Uniform, "Sun").each_slot();
    /// Albedo tables of a fused dispatch, written by the host.
    FusedAlbedoValues: row(4, FusedAlbedo, FromHost, "Albedo").each_slot();
    /// `View`, written by the host.
    View: row(size_of::<layout::View>(), Once, Uniform, "View").each_slot().each_joint();
    /// `Surroundings` of the image, written by the host.
    Surroundings: row(size_of::<layout::Surroundings>(), Count::Surroundings, Uniform, "Surroundings").each_slot();
    /// `Reflector` of both faces of every material.
    Reflectors: row(size_of::<layout::Reflector>(), Count::Reflectors, Storage, "Reflector");
    /// Lobes of rough mirrors before the planet, written by the host.
    Lobes: row(4, Count::Lobes, FromHost, "Lobe").each_slot();
    /// Emissivities of the faces over angle and temperature.
    Emissivities: row(4, Count::Emissivities, Storage, "Emissivity");
    /// `Tracing` of the image, written by the host.
    Tracing: row(size_of::<layout::Tracing>(), Count::Tracing, Uniform, "Tracing").each_slot();
    /// Boxes of the tree for reflections of the craft, written by the host where parts have moved.
    TraceBoxes: row(size_of::<layout::ShadowBox>(), Count::TraceBoxes, FromHost, "TraceBox").each_slot();
    /// Triangles of this tree, written by the host where parts have moved.
    TraceTriangles: row(size_of::<layout::ShadowTriangle>(), Count::TraceTriangles, FromHost, "TraceTriangle").each_slot();
    /// Nodes of the corners of these triangles, and their material.
    TraceCorners: row(16, Count::TraceTriangles, Storage, "TraceCorner");
    /// `PlanetView` of the image, written by the host.
    PlanetView: row(size_of::<layout::PlanetView>(), Count::PlanetView, Uniform, "PlanetView").each_slot();
    /// Radiances of a planet that is not uniform, over that of its mean temperature.
    PlanetMap: row(4, Count::PlanetMap, Storage, "PlanetMap");
    /// Its means over the direction of a surface, written by the host.
    PlanetMeans: row(4, Count::PlanetMeans, FromHost, "PlanetMean").each_slot();
    /// `Material` of every material.
    Materials: row(size_of::<layout::Material>(), Count::Materials, Storage, "Material");
    /// Straight pieces of the shaped response functions.
    Shapes: row(8, Count::Shapes, Storage, "Shape");
    /// Material index of every group.
    GroupMaterial: row(4, Groups, Storage, "GroupMaterial").in_pieces(WithoutImage);
    /// Part index of every group.
    GroupPart: row(4, DrawnGroups, Storage, "GroupPart").in_pieces(WithoutImage);
    /// x of the normals.
    NormalX: row(GROUP, LoadedGroups, Storage, "NormalX").in_pieces(WithoutNormals);
    /// y of the normals.
    NormalY: row(GROUP, LoadedGroups, Storage, "NormalY").in_pieces(WithoutNormals);
    /// z of the normals.
    NormalZ: row(GROUP, LoadedGroups, Storage, "NormalZ").in_pieces(WithoutNormals);
    /// x of the normals of crinkled foil that is drawn.
    CrinkledX: row(GROUP, CrinkledGroups, Storage, "NormalX");
    /// y of these normals.
    CrinkledY: row(GROUP, CrinkledGroups, Storage, "NormalY");
    /// z of these normals.
    CrinkledZ: row(GROUP, CrinkledGroups, Storage, "NormalZ");
    /// x of the positions [m].
    PositionX: row(GROUP, PlacedGroups, Storage, "PositionX");
    /// y of the positions [m].
    PositionY: row(GROUP, PlacedGroups, Storage, "PositionY");
    /// z of the positions [m].
    PositionZ: row(GROUP, PlacedGroups, Storage, "PositionZ");
    /// Node indices of the triangles.
    Triangles: row(CORNERS, Count::Triangles, Storage, "Triangle").in_pieces(Always);
    /// Triangles that culling kept, at the front of the triangles of each draw.
    VisibleTriangles: row(CORNERS, Count::Triangles, WrittenIndices, "VisibleTriangle").in_pieces(Always);
    /// One `DrawCommand` for each run of `VisibleTriangles`.
    Draws: row(size_of::<layout::DrawCommand>(), Count::Draws, Commands, "Draw").in_pieces(Always);
    /// Table of the band's radiance.
    BandTable: row(4, Band, Storage, "BandTable");
    /// Target temperature of every node [K]. Under a plate it is the temperature of the structure.
    Target: row(GROUP, TargetGroups, Storage, "Target").in_pieces(Always);
    /// Target minus old temperature of every node [K]. Along a shaped function it is target minus present temperature. Of a
    /// plate it is what f32 does not hold of its temperature.
    Span: row(GROUP, MovingGroups, Storage, "Span").in_pieces(Always);
    /// Time since the transition of every node began [steps]. Under a plate it is the rest and the trend of the structure.
    Elapsed: row(GROUP, TargetGroups, Storage, "Elapsed").in_pieces(Always);
    /// Temperature of every node [K], then the power of every heater of a network in one pass [W].
    Temperature: row(GROUP, HeatedGroups, Storage, "Temperature").in_pieces(WithoutImage);
    /// Groups and emission of every run of nodes whose absorbed heat is summed.
    HeatRuns: row(16, Count::HeatRuns, Storage, "Run");
    /// Area over which every node absorbs [m2].
    HeatAreas: row(GROUP, HeatGroups, Storage, "Area");
    /// Heat that every run absorbs in a step [W].
    AbsorbedHeat: row(4, Count::HeatRuns, ToHost, "Absorbed").each_slot();
    /// Patches of the fronts of four nodes, then of their backs.
    ExchangeNodes: row(PAIRS, ExchangeGroups, Storage, "ExchangeNode").in_pieces(Always);
    /// `ExchangePatch` of every patch.
    ExchangePatches: row(size_of::<layout::ExchangePatch>(), Count::ExchangePatches, Storage, "ExchangePatch");
    /// Nodes of the patches, and their shares.
    ExchangeMembers: row(8, Count::ExchangeMembers, Storage, "ExchangeMember");
    /// Rows of the exchange areas of infrared and of sunlight in fours.
    ExchangeEntries: row(16, Count::ExchangeEntries, Storage, "ExchangeEntry");
    /// Rows of the poses of the body and of the joints, written by the host.
    ExchangePoses: row(48, Count::ExchangeJoints, FromHost, "ExchangePose").each_slot();
    /// Directions of rays, and whether they are open.
    ExchangeSky: row(16, Count::ExchangeSky, Storage, "ExchangeSky");
    /// Shares of the planet's infrared and albedo that every patch sees.
    ExchangeSeen: row(8, Count::ExchangePatches, Storage, "ExchangeSeen");
    /// Infrared of the planet and sunlight that every patch reflects at first [W/m2].
    ExchangeReflected: row(8, Count::ExchangePatches, Storage, "ExchangeReflected");
    /// Sunlight from other patches that every patch absorbs [W/m2].
    ExchangeSunlight: row(4, Count::ExchangePatches, Storage, "ExchangeSunlight");
    /// Rows of the shares of mirrored sunlight, written by the host.
    ExchangeMirrors: row(8, Count::ExchangeMirrors, FromHost, "ExchangeMirror").each_slot();
    /// Sunlight that every patch mirrors [W/m2].
    ExchangeMirrored: row(4, Count::ExchangeMirrored, Storage, "ExchangeMirrored");
    /// Infrared that every patch sends at first [W/m2].
    ExchangeSent: row(4, Count::ExchangePatches, Storage, "ExchangeSent");
    /// Flux from other patches that every patch absorbs [W/m2].
    ExchangeReceived: row(8, Count::ExchangePatches, Storage, "ExchangeReceived");
    /// Temperature of every node before the last step [K], where images lie between steps.
    EarlierTemperature: row(GROUP, BetweenGroups, Storage, "Earlier");
    /// Temperature of every node at the time of an image between steps [K].
    BetweenTemperature: row(GROUP, BetweenGroups, Storage, "Between Temperature");
    /// Transform of the shadow map, written by the host.
    SunView: row(size_of::<layout::SunView>(), Count::SunView, Uniform, "SunView").each_slot().each_joint();
    /// Node indices of the triangles that cast shadows.
    Occluders: unbound(CORNERS, Count::Occluders, Indices);
    /// Shadow map.
    SunDepthImage: unbound(4, SunTexels, Depth);
    /// Copy of the shadow map that shaders read.
    SunDepth: row(4, SunTexels, Storage, "SunDepth");
    /// Boxes of the tree for shadow rays.
    ShadowTree: row(size_of::<layout::ShadowBox>(), Boxes, Storage, "ShadowTree");
    /// Triangles of the tree for shadow rays.
    ShadowTriangles: row(size_of::<layout::ShadowTriangle>(), Traced, Storage, "ShadowTriangle");
    /// Share of the Sun that every node sees.
    Visibility: row(GROUP, ShadowedGroups, Storage, "Visibility").in_pieces(Always);
    /// Radiance, temperature and depth of every pixel.
    RadianceImage: unbound(16, DrawnTexels, Colour(vk::Format::R32G32B32A32_SFLOAT));
    /// Part and material index of every pixel.
    IdentityImage: unbound(8, DrawnTexels, Colour(vk::Format::R32G32_UINT));
    /// Normal times depth and face of every texel, if surfaces reflect the craft itself.
    SurfaceImage: unbound(16, SurfaceTexels, Colour(vk::Format::R32G32B32A32_SFLOAT));
    /// Copy of `SurfaceImage` that shaders read.
    Surface: row(16, SurfaceTexels, Storage, "Surface");
    /// Depth buffer.
    DepthImage: unbound(4, DrawnTexels, Depth);
    /// `Shutter`, written by the host.
    Shutter: row(size_of::<layout::Shutter>(), RollingOnce, Uniform, "Shutter").each_slot().each_joint();
    /// `Distant`, written by the host.
    Distant: row(size_of::<layout::Distant>(), DistantOnce, Uniform, "Distant").each_slot();
    /// Sizes of an image that is computed from drawn ones.
    Sampling: row(size_of::<layout::Sampling>(), ComputedOnce, Uniform, "Sampling");
    /// Copy of `RadianceImage` that shaders read, and to which reflections of the craft are added.
    DrawnRadiance: row(16, LitTexels, Storage, "DrawnRadiance");
    /// Copy of `IdentityImage` that shaders read.
    DrawnIdentity: row(8, ReadTexels, Storage, "DrawnIdentity");
    /// Mean radiance and coverage of every texel over its samples.
    MeanImage: unbound(8, MeanTexels, Colour(vk::Format::R32G32_SFLOAT));
    /// `MeanImage` before the mean over the samples of a texel.
    MultiImage: unbound(8, MultiSamples, Colour(vk::Format::R32G32_SFLOAT));
    /// Depth buffer of `MeanImage` or `MultiImage`.
    MeanDepthImage: unbound(4, MeanSamples, Depth);
    /// Copy of `MeanImage` that shaders read, and to which reflections of the craft are added.
    Mean: row(8, MeanTexels, Storage, "MeanRadiance");
    /// Places of the pixels' corners in the finer image of a distorting lens.
    LensMap: row(8, LensCorners, Storage, "LensMap");
    /// Radiance, temperature, depth and coverage of every pixel of an image that is computed from drawn ones.
    ImageRadiance: row(16, ComputedPixels, Storage, "ImageRadiance");
    /// Part and material of every pixel of such an image.
    ImageIdentity: row(8, ComputedPixels, Storage, "ImageIdentity");
    /// Host copy of `RadianceImage`, `DrawnRadiance` or `ImageRadiance`.
    RadianceReadback: unbound(16, Pixels, Readback).each_slot();
    /// Host copy of `IdentityImage` or `ImageIdentity`.
    IdentityReadback: unbound(8, Pixels, Readback).each_slot();
    /// Host copy of `Temperature`.
    TemperatureReadback: unbound(GROUP, Groups, Readback).each_slot();

    /// `Sensor`, written by the host.
    Sensor: row(size_of::<layout::Sensor>(), Count::Sensor, Uniform, "Sensor").each_slot();
    /// Weights of the point spread and of the halo.
    SensorKernel: row(16, Count::SensorWeights, Uniform, "Kernel");
    /// Copy of the image's radiance that the sensor reads.
    SensorSeen: row(16, Count::SensorPixels, Storage, "Seen");
    /// Radiance of four pixels after the point spread along rows, for each term.
    SensorRows: row(16, Count::SensorRows, Storage, "Rows");
    /// Mean radiance of each cell of the halo's grid.
    SensorCells: row(4, Count::SensorCells, Storage, "Cells");
    /// The halo at each cell.
    SensorHalo: row(4, Count::SensorCells, Storage, "Halo");
    /// Share of the light that arrives at four pixels.
    SensorVignetting: row(16, Count::SensorVignetting, Storage, "Vignetting");
    /// Signal of the bolometer at the last image.
    SensorBolometer: row(16, Count::SensorBolometer, Storage, "Bolometer");
    /// Inverse temperatures over a table of radiances, for the radiometric output [1/K].
    SensorGuesses: row(4, Count::SensorGuesses, Storage, "Guess");
    /// Digital number of each pixel, and its count of temperature in the upper half word.
    SensorReading: row(16, Count::SensorGroups, Storage, "Reading");
    /// Host copy of `SensorReading`.
    SensorReadback: unbound(16, Count::SensorGroups, Readback).each_slot();

    /// 1 / C and emission of the nodes of a network that is stepped in one pass.
    OnePassNodes: row(PAIRS, OnePassGroups, Storage, "Node");
    /// Range of links and of sources of every group.
    OnePassRows: row(16, OnePassGroups, Storage, "Row");
    /// Neighbours by weak conductors, and these conductors.
    OnePassLinks: row(16, Count::OnePassLinks, Storage, "Link");
    /// Drawn nodes that heat every group, and the areas.
    OnePassSources: row(16, Count::OnePassSources, Storage, "Source");
    /// Range of groups, first weight and factors of every group in blocks. In large blocks, range of the links inside.
    OnePassUnits: row(PAIRS, OnePassBlockGroups, Storage, "Unit");
    /// Weights of the conduction inside blocks.
    OnePassWeights: row(16, Count::OnePassWeights, Storage, "Weight");
    /// Mean temperatures of every other step [K].
    OnePassMeanEven: row(GROUP, OnePassGroups, Storage, "Mean Gathered Next");
    /// Mean temperatures of the steps between those of `OnePassMeanEven`.
    OnePassMeanOdd: row(GROUP, OnePassGroups, Storage, "Mean Gathered Next");
    /// Bases and rests of the temperatures [K].
    OnePassStates: row(PAIRS, OnePassGroups, Storage, "State");
    /// What the nodes of blocks receive in a step, and their temperatures at its start [K].
    OnePassDrives: row(PAIRS, OnePassBlockGroups, Storage, "Drive Start");
    /// Change by conduction inside blocks in the last step [K].
    OnePassCouplings: row(GROUP, OnePassBlockGroups, Storage, "Coupling");
    /// Every other vector of the stages of large blocks: changes and errors [K].
    OnePassVectorEven: row(PAIRS, OnePassLargeGroups, Storage, "Before Gathered Vector");
    /// The vectors between those of `OnePassVectorEven`.
    OnePassVectorOdd: row(PAIRS, OnePassLargeGroups, Storage, "Before Gathered Vector");
    /// Sums of these vectors by their parts [K].
    OnePassSums: row(PAIRS, OnePassLargeGroups, Storage, "Sum");
    /// What the estimate of the error keeps: four numbers of every node.
    OnePassMemory: row(4 * GROUP, OnePassEstimated, Storage, "Memory");
    /// Error of the nodes of blocks before it spreads, and that since the last estimate [K].
    OnePassErrors: row(PAIRS, OnePassBlockGroups, Storage, "Error Spread");
    /// Sum of the squares of the estimated errors of every group [K2], the largest [K], and its place.
    OnePassTold: row(GROUP, OnePassEstimated, Storage, "Told");
    /// Sensor, place, thresholds and gain of every heater.
    OnePassHeaters: row(PAIRS, Count::OnePassHeaters, Storage, "Heater");
    /// Power of every heater while it is on [W], written by the host.
    OnePassPowers: row(4, Count::OnePassHeaters, FromHost, "Power").each_slot();
    /// State of the thermostat of every heater.
    OnePassSwitches: row(16, Count::OnePassHeaters, Storage, "Switch");
    /// Switches of every heater in a frame.
    OnePassLog: row(4 * LOGGED, Count::OnePassHeaters, ToHost, "Log").each_slot();

    /// Corners, joint and side of every patch whose rays are cast.
    RayPatches: row(16, Given, FromHost, "RayPatch");
    /// Corners of the patches, and shares of their rays.
    RayCorners: row(8, Given, FromHost, "RayCorner");
    /// Triangles in the file's pose.
    RayTriangles: row(size_of::<layout::ShadowTriangle>(), Given, FromHost, "RayTriangle");
    /// Poses of the body and of the joints.
    RayPoses: row(48, Given, FromHost, "RayPose");
    /// Boxes of the tree for these rays.
    RayBoxes: row(size_of::<layout::ShadowBox>(), Given, FromHost, "RayBox");
    /// Triangles of the tree for these rays.
    RayPlaced: row(size_of::<layout::ShadowTriangle>(), Given, FromHost, "RayPlaced");
    /// Patches at the corners of these triangles.
    RayLeaves: row(32, Given, FromHost, "RayLeaf");
    /// Patches where these rays end.
    RayEnds: row(4, Given, ToHost, "RayEnd");
    /// Size of a response dispatch.
    ResponseSteps: row(size_of::<layout::Steps>(), Given, FromHost, "Steps");
    /// Targets at the steps of a response [K].
    ResponseTargets: row(4, Given, FromHost, "Commanded");
    /// Temperatures at the steps of a response [K].
    ResponseTemperatures: row(4, Given, ToHost, "Temperature");
    /// Temperatures or radiances to convert.
    RadiationInput: row(4, Given, FromHost, "Input");
    /// Converted radiances or temperatures.
    RadiationOutput: row(4, Given, ToHost, "Output");
    /// Inverse temperatures over a table of radiances [1/K].
    InverseTemperatures: row(4, Given, FromHost, "Guess");
    /// Source of a measured copy.
    CopiedFrom: unbound(1, Given, Storage);
    /// Destination of a measured copy.
    CopiedTo: unbound(1, Given, Storage);
    /// Nominal output of empty dispatches.
    Untouched: unbound(16, Given, Storage);
    /// Staging buffer of uploads.
    Staged: unbound(1, Given, Staging);
    /// Staging buffer of downloads.
    Fetched: unbound(1, Given, Readback);
}
