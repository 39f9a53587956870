//! Frame lists outside a scene and a network: uploads, downloads, responses, radiances and measured copies and
//! dispatches.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::frame::Frame;
use super::pass::{
    Access, COMPUTE_READ, COMPUTE_WRITE, COPY_READ, COPY_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access,
    barrier, clear_pass, copy_pass, scope, to_host,
};
use super::resource::Resource;
use super::variant::{Curve, ResponseVariant};

/// All later accesses.
const LATER: Scope = scope(S::ALL_COMMANDS, A::from_raw(A::MEMORY_READ.as_raw() | A::MEMORY_WRITE.as_raw()));
/// All earlier writes.
const EARLIER: Scope = scope(S::ALL_COMMANDS, A::MEMORY_WRITE);

/// Accesses of the host and of compute shaders.
pub(super) const HOST_AND_COMPUTE: Scope = scope(
    S::from_raw(S::HOST.as_raw() | S::COMPUTE_SHADER.as_raw()),
    A::from_raw(A::HOST_READ.as_raw() | A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()),
);

/// Copies the staging buffer to `to`. The barrier is needed because a fence does not make writes visible to later
/// submissions.
pub fn upload(to: Resource) -> Frame {
    Frame {
        entries: vec![
            Entry::Pass(copy_pass("upload", Resource::Staged, to)),
            Entry::Barriers(vec![barrier(to, COPY_WRITE, LATER)]),
        ],
    }
}

/// Copies `from`, as earlier submissions wrote it, to the host.
pub fn download(from: Resource) -> Frame {
    Frame {
        entries: vec![
            Entry::Barriers(vec![barrier(from, EARLIER, COPY_READ)]),
            Entry::Pass(copy_pass("download", from, Resource::Fetched)),
            Entry::Barriers(vec![to_host(Resource::Fetched)]),
        ],
    }
}

/// A dispatch. Each access gives its binding, whether it reads and whether it writes.
pub(super) fn dispatch(
    name: String,
    kernel: Kernel,
    workgroups: u32,
    set: u32,
    bound: &[(u32, Resource, bool, bool)],
) -> Entry {
    let accesses = bound.iter().flat_map(|(binding, resource, reads, writes)| {
        let scopes = [(*reads, COMPUTE_READ), (*writes, COMPUTE_WRITE)].into_iter().filter(|(does, _)| *does);
        scopes.map(|(_, scope)| Access { binding: Some(*binding), ..access(*resource, scope) })
    });
    let work = Work::Dispatch { kernel, workgroups, set, said: Said::Nothing };
    Entry::Pass(Pass { name, work, accesses: accesses.collect() })
}

/// Steps of a response. The host reads the temperatures, and the next submission continues from the state.
pub fn respond(variant: ResponseVariant, workgroups: u32) -> Frame {
    let mut bound = vec![
        (0, Resource::ResponseSteps, true, false),
        (1, Resource::ResponseTargets, true, false),
        (3, Resource::Materials, true, false),
        (8, Resource::Target, true, true),
        (9, Resource::Span, true, true),
        (10, Resource::Elapsed, true, true),
        (11, Resource::ResponseTemperatures, false, true),
    ];
    bound.extend((variant.curve != Curve::Power).then_some((12, Resource::Shapes, true, false)));
    let written = [Resource::Target, Resource::Span, Resource::Elapsed, Resource::ResponseTemperatures];
    Frame {
        entries: vec![
            dispatch(variant.shader().name(), Kernel::Response(variant), workgroups, 0, &bound),
            Entry::Barriers(written.map(|one| barrier(one, COMPUTE_WRITE, HOST_AND_COMPUTE)).to_vec()),
        ],
    }
}

/// Converts temperatures to radiances. The inverse needs one table more.
pub fn radiation(kernel: Kernel, workgroups: u32) -> Frame {
    let mut bound = vec![
        (0, Resource::BandTable, true, false),
        (1, Resource::RadiationInput, true, false),
        (2, Resource::RadiationOutput, false, true),
    ];
    bound.extend((kernel == Kernel::Brightness).then_some((3, Resource::InverseTemperatures, true, false)));
    let to_host = scope(S::HOST, A::HOST_READ);
    Frame {
        entries: vec![
            dispatch(format!("{kernel:?}").to_lowercase(), kernel, workgroups, 0, &bound),
            Entry::Barriers(vec![barrier(Resource::RadiationOutput, COMPUTE_WRITE, to_host)]),
        ],
    }
}

/// Fills the source of a measured copy with ones, because some devices copy zeros faster.
pub fn filled() -> Frame {
    let fill = Pass { work: Work::Fill(Resource::CopiedFrom, 0x3f80_0000), ..clear_pass("fill", Resource::CopiedFrom) };
    Frame { entries: vec![Entry::Pass(fill), Entry::Barriers(vec![barrier(Resource::CopiedFrom, EARLIER, COPY_READ)])] }
}

/// A measured copy.
pub fn copied() -> Frame {
    Frame {
        entries: vec![
            Entry::Barriers(vec![barrier(Resource::CopiedTo, COPY_WRITE, COPY_WRITE)]),
            Entry::Pass(copy_pass("copy", Resource::CopiedFrom, Resource::CopiedTo)),
        ],
    }
}

/// Measured empty dispatches, with barriers as if each used the output of the last one.
pub fn dispatched(count: u32) -> Frame {
    let next = scope(S::COMPUTE_SHADER, HOST_AND_COMPUTE.access & !A::HOST_READ);
    let ordered = || Entry::Barriers(vec![barrier(Resource::Untouched, COMPUTE_WRITE, next)]);
    let pass = || {
        let work = Work::Dispatch { kernel: Kernel::Empty, workgroups: 1, set: 0, said: Said::Nothing };
        let accesses = vec![access(Resource::Untouched, COMPUTE_WRITE)];
        Entry::Pass(Pass { name: "empty".to_owned(), work, accesses })
    };
    Frame { entries: (0..count).flat_map(|_| [ordered(), pass()]).collect() }
}
