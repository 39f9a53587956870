//! Frame lists outside a scene and a network: uploads, downloads, responses, radiances and measured copies and
//! dispatches.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::effects::thermal::variant::{Curve, StepKind};
use super::effects::thermal::{ELAPSED, SPAN, TARGET};
use super::layout;
use super::pass::{
    Barrier, COMPUTE, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Frame, HOST_READ, Pass, Scope, barrier, scope, to_host,
};
use super::resource::Resource;
use super::resource::Role::{Copied, FromHost, Readback, Staging, ToHost};
use super::shaders::Shader;

/// Corners, joint and side of every patch whose rays are cast.
pub(crate) static RAY_PATCHES: Resource = Resource::given("RayPatches", 16, FromHost);
/// Corners of the patches, and shares of their rays.
pub(crate) static RAY_CORNERS: Resource = Resource::given("RayCorners", 8, FromHost);
/// Triangles in the file's pose.
pub(crate) static RAY_TRIANGLES: Resource =
    Resource::given("RayTriangles", size_of::<layout::ShadowTriangle>(), FromHost);
/// Poses of the body and of the joints.
pub(crate) static RAY_POSES: Resource = Resource::given("RayPoses", 48, FromHost);
/// Boxes of the tree for these rays.
pub(crate) static RAY_BOXES: Resource = Resource::given("RayBoxes", size_of::<layout::ShadowBox>(), FromHost);
/// Triangles of the tree for these rays.
pub(crate) static RAY_PLACED: Resource = Resource::given("RayPlaced", size_of::<layout::ShadowTriangle>(), FromHost);
/// Patches at the corners of these triangles.
pub(crate) static RAY_LEAVES: Resource = Resource::given("RayLeaves", 32, FromHost);
/// Patches where these rays end.
pub(crate) static RAY_ENDS: Resource = Resource::given("RayEnds", 4, ToHost);
/// Size of a response dispatch.
pub(crate) static RESPONSE_STEPS: Resource = Resource::given("ResponseSteps", size_of::<layout::Steps>(), FromHost);
/// Targets at the steps of a response [K].
pub(crate) static RESPONSE_TARGETS: Resource = Resource::given("ResponseTargets", 4, FromHost);
/// Temperatures at the steps of a response [K].
pub(crate) static RESPONSE_TEMPERATURES: Resource = Resource::given("ResponseTemperatures", 4, ToHost);
/// Temperatures or radiances to convert.
pub(crate) static RADIATION_INPUT: Resource = Resource::given("RadiationInput", 4, FromHost);
/// Converted radiances or temperatures.
pub(crate) static RADIATION_OUTPUT: Resource = Resource::given("RadiationOutput", 4, ToHost);
/// Inverse temperatures over a table of radiances [1/K].
pub(crate) static INVERSE_TEMPERATURES: Resource = Resource::given("InverseTemperatures", 4, FromHost);
/// Source of a measured copy.
pub(crate) static COPIED_FROM: Resource = Resource::given("CopiedFrom", 1, Copied);
/// Destination of a measured copy.
pub(crate) static COPIED_TO: Resource = Resource::given("CopiedTo", 1, Copied);
/// Nominal output of empty dispatches.
pub(crate) static UNTOUCHED: Resource = Resource::given("Untouched", 16, Copied);
/// Staging buffer of uploads.
pub(crate) static STAGED: Resource = Resource::given("Staged", 1, Staging);
/// Staging buffer of downloads.
pub(crate) static FETCHED: Resource = Resource::given("Fetched", 1, Readback);

/// Buffers of commands outside scenes.
pub(crate) const RESOURCES: &[&Resource] = &[
    &RAY_PATCHES,
    &RAY_CORNERS,
    &RAY_TRIANGLES,
    &RAY_POSES,
    &RAY_BOXES,
    &RAY_PLACED,
    &RAY_LEAVES,
    &RAY_ENDS,
    &RESPONSE_STEPS,
    &RESPONSE_TARGETS,
    &RESPONSE_TEMPERATURES,
    &RADIATION_INPUT,
    &RADIATION_OUTPUT,
    &INVERSE_TEMPERATURES,
    &COPIED_FROM,
    &COPIED_TO,
    &UNTOUCHED,
    &STAGED,
    &FETCHED,
];

/// All later accesses.
const LATER: Scope = scope(S::ALL_COMMANDS, A::from_raw(A::MEMORY_READ.as_raw() | A::MEMORY_WRITE.as_raw()));
/// All earlier writes.
const EARLIER: Scope = scope(S::ALL_COMMANDS, A::MEMORY_WRITE);

/// Accesses of the host and of compute shaders.
pub(super) const HOST_AND_COMPUTE: Scope = scope(
    S::from_raw(S::HOST.as_raw() | S::COMPUTE_SHADER.as_raw()),
    A::from_raw(A::HOST_READ.as_raw() | A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()),
);

/// A list of passes, each with the barriers after it.
fn list(entries: impl IntoIterator<Item = (Pass, Vec<Barrier>)>) -> Frame {
    let mut frame = Frame::default();
    for (pass, barriers) in entries {
        frame.pass(pass);
        frame.wait(barriers);
    }
    frame
}

/// Copies the staging buffer to `to`. The barrier is needed because a fence does not make writes visible to later
/// submissions.
pub fn upload(to: &'static Resource) -> Frame {
    list([(Pass::copy("upload", &STAGED, to), vec![barrier(to, COPY_WRITE, LATER)])])
}

/// Copies `from`, as earlier submissions wrote it, to the host.
pub fn download(from: &'static Resource) -> Frame {
    let mut frame = Frame::default();
    frame.wait([barrier(from, EARLIER, COPY_READ)]);
    frame.then(list([(Pass::copy("download", from, &FETCHED), vec![to_host(&FETCHED)])]))
}

/// Steps of a response. The host reads the temperatures, and the next submission continues from the state.
pub fn respond(kind: StepKind, curve: Curve, workgroups: u32) -> Frame {
    let words = kind.words().iter().chain(curve.words()).copied().collect();
    let shader = Shader::new("response.comp", words);
    let written = [&TARGET, &SPAN, &ELAPSED, &RESPONSE_TEMPERATURES];
    let waits = written.map(|one| barrier(one, COMPUTE_WRITE, HOST_AND_COMPUTE)).to_vec();
    list([(Pass::dispatch(shader.name(), shader, workgroups), waits)])
}

/// Converts temperatures to radiances.
pub fn radiances(workgroups: u32) -> Frame {
    converted(Pass::dispatch("blackbody", Shader::plain("blackbody.comp"), workgroups))
}

/// Converts radiances to temperatures.
pub fn brightnesses(workgroups: u32) -> Frame {
    let pass = Pass::dispatch("brightness", Shader::plain("brightness.comp"), workgroups);
    converted(pass.instead("SensorGuesses", &INVERSE_TEMPERATURES))
}

fn converted(pass: Pass) -> Frame {
    list([(pass, vec![barrier(&RADIATION_OUTPUT, COMPUTE_WRITE, HOST_READ)])])
}

/// Casts the rays of some patches.
pub fn rays(constants: &layout::ExchangePass) -> Frame {
    let layout::ExchangePass { first, end, rays, .. } = *constants;
    let workgroups = ((end - first) * rays).div_ceil(64);
    let pass = Pass::dispatch("exchange_rays", Shader::plain("exchange_rays.comp"), workgroups).told(constants);
    list([(pass, vec![barrier(&RAY_ENDS, COMPUTE_WRITE, HOST_READ)])])
}

/// Fills the source of a measured copy with ones, because some devices copy zeros faster.
pub fn filled() -> Frame {
    let fill = Pass::fill("fill", &COPIED_FROM, 0x3f80_0000);
    list([(fill, vec![barrier(&COPIED_FROM, EARLIER, COPY_READ)])])
}

/// A measured copy.
pub fn copied() -> Frame {
    let mut frame = Frame::default();
    frame.wait([barrier(&COPIED_TO, COPY_WRITE, COPY_WRITE)]);
    frame.pass(Pass::copy("copy", &COPIED_FROM, &COPIED_TO));
    frame
}

/// Measured empty dispatches, with barriers as if each used the output of the last one.
pub fn dispatched(count: u32) -> Frame {
    let mut frame = Frame::default();
    for _ in 0..count {
        frame.wait([barrier(&UNTOUCHED, COMPUTE_WRITE, COMPUTE)]);
        let mut pass = Pass::dispatch("empty", Shader::plain("empty.comp"), 1);
        pass.reach.nominal = Some(&UNTOUCHED);
        frame.pass(pass);
    }
    frame
}
