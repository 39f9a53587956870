//! Frame lists outside a scene and a network: uploads, downloads, responses, radiances and measured copies and
//! dispatches.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::effects::thermal::variant::{Curve, StepKind};
use super::effects::thermal::{ELAPSED, SPAN, TARGET};
use super::layout;
use super::pass::{
    Barrier, COMPUTE, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Frame, HOST_READ, Pass, Scope, barrier, scope, to_host,
};
use super::resource::Role::{Copied, FromHost, Readback, Staging, ToHost};
use super::resource::{Resource, resources};
use super::shaders::Shader;

resources! {
    /// Size of a response dispatch.
    RESPONSE_STEPS = Resource::given("ResponseSteps", size_of::<layout::Steps>(), FromHost);
    /// Targets at the steps of a response [K].
    RESPONSE_TARGETS = Resource::given("ResponseTargets", 4, FromHost);
    /// Temperatures at the steps of a response [K].
    RESPONSE_TEMPERATURES = Resource::given("ResponseTemperatures", 4, ToHost);
    /// Temperatures or radiances to convert.
    RADIATION_INPUT = Resource::given("RadiationInput", 4, FromHost);
    /// Converted radiances or temperatures.
    RADIATION_OUTPUT = Resource::given("RadiationOutput", 4, ToHost);
    /// Inverse temperatures over a table of radiances [1/K].
    INVERSE_TEMPERATURES = Resource::given("InverseTemperatures", 4, FromHost);
    /// Source of a measured copy.
    COPIED_FROM = Resource::given("CopiedFrom", 1, Copied);
    /// Destination of a measured copy.
    COPIED_TO = Resource::given("CopiedTo", 1, Copied);
    /// Nominal output of empty dispatches.
    UNTOUCHED = Resource::given("Untouched", 16, Copied);
    /// Staging buffer of uploads.
    STAGED = Resource::given("Staged", 1, Staging);
    /// Staging buffer of downloads.
    FETCHED = Resource::given("Fetched", 1, Readback);
}

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

/// A dispatch and a copy of its output to the host, with the barriers between and after them.
pub(super) fn witnessed() -> Frame {
    let dispatch = Pass::dispatch("blackbody", Shader::plain("blackbody.comp"), 1);
    let copy = Pass::copy("copy", &RADIATION_OUTPUT, &FETCHED);
    list([(dispatch, vec![barrier(&RADIATION_OUTPUT, COMPUTE_WRITE, COPY_READ)]), (copy, vec![to_host(&FETCHED)])])
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
