//! Frame lists of a network that is stepped in one pass, with the bindings of `glsl/one_pass.comp`.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use crate::gpu::frame::Frame;
use crate::gpu::one_pass_variant::{OnePassKind, OnePassVariant};
use crate::gpu::pass::{
    Access, Barrier, COMPUTE_READ, COMPUTE_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access, barrier, scope,
};
use crate::gpu::resource::Resource;

/// Invocations of a workgroup.
const WORKGROUP: u32 = 64;

/// Read and write of a compute pass.
const COMPUTE: Scope =
    scope(S::COMPUTE_SHADER, A::from_raw(A::SHADER_STORAGE_READ.as_raw() | A::SHADER_STORAGE_WRITE.as_raw()));

/// What the lists of a network depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnePassShape {
    /// Group of four nodes after the last one of each of the [`SECTIONS`].
    pub ends: [u32; SECTIONS.len()],
    /// Number of heaters.
    pub heaters: u32,
    /// Whether a local step has more than two Runge-Kutta steps.
    pub fine: bool,
    /// Whether no drawn node is free to take what nobody sees.
    pub masked: bool,
}

/// Sections of the groups in order: what is done with their nodes, and whether these radiate to each other. Blocks come first.
pub const SECTIONS: [(OnePassKind, bool); 5] = [
    (OnePassKind::Drive, true),
    (OnePassKind::Drive, false),
    (OnePassKind::Advance, true),
    (OnePassKind::Advance, false),
    (OnePassKind::Alone, false),
];
/// Number of sections with blocks.
const BLOCKS: usize = 2;

/// Place of a step among those of a frame.
#[derive(Clone, Copy)]
struct Place {
    /// Its number. A trial has that of the step that it is for.
    number: u32,
    first: bool,
    /// Whether its temperatures are not kept.
    trial: bool,
    after_trial: bool,
    /// Whether the drawn nodes take its temperatures.
    shown: bool,
}

/// Mean temperatures from which a step starts. The step leaves those of the next one in the other buffer.
fn means(odd: bool) -> Resource {
    if odd { Resource::OnePassMeanOdd } else { Resource::OnePassMeanEven }
}

impl OnePassShape {
    /// Steps of one length, after the flux of the drawn nodes. The state is in the odd buffer if `odd`. A step without a
    /// past is tried first. The second result is `odd` for the new state.
    pub fn steps(&self, count: u32, tried: bool, odd: bool) -> (Frame, bool) {
        let all = count + u32::from(tried);
        let steps = (0..all).flat_map(|number| {
            let trial = tried && number == 0;
            let after_trial = tried && number == 1;
            let place = Place {
                number: number.saturating_sub(u32::from(tried)),
                first: number == 0,
                trial,
                after_trial,
                shown: number + 1 == all,
            };
            self.step(place, odd ^ (number % 2 == 1))
        });
        let mut entries: Vec<Entry> = steps.collect();
        if self.heaters > 0 {
            let to_host = scope(S::HOST, A::HOST_READ);
            entries.push(Entry::Barriers(vec![barrier(Resource::OnePassLog, COMPUTE_WRITE, to_host)]));
        }
        (Frame { entries }, odd ^ (all % 2 == 1))
    }

    /// One step. Blocks come first, because nodes outside them write the same buffers.
    fn step(&self, place: Place, odd: bool) -> Vec<Entry> {
        let Place { first, trial, after_trial, shown, .. } = place;
        let blocks = self.in_blocks() > 0;
        let pass = |kind, radiative, groups| {
            let variant = OnePassVariant { trial, shown, radiative, ..self.variant(kind) };
            self.pass(variant.lean(), odd, groups)
        };
        let mut entries = Vec::new();
        let mut before = vec![barrier(means(!odd), COMPUTE_WRITE, COMPUTE_WRITE)];
        if self.heaters > 0 {
            entries.extend(self.heat(place, odd));
            before.push(barrier(Resource::Temperature, COMPUTE_WRITE, COMPUTE));
            if !(blocks || trial) {
                before.push(barrier(Resource::OnePassRests, COMPUTE_READ, COMPUTE_WRITE));
            }
        } else {
            before.push(barrier(means(odd), COMPUTE_WRITE, COMPUTE_READ));
            if first {
                before.push(barrier(Resource::Temperature, COMPUTE_WRITE, COMPUTE));
            } else if shown && !blocks {
                before.push(barrier(Resource::Temperature, COMPUTE_READ, COMPUTE_WRITE));
            }
            if !(blocks && after_trial) {
                before.push(barrier(Resource::OnePassRests, COMPUTE_WRITE, COMPUTE));
            }
        }
        if blocks {
            before.push(barrier(Resource::OnePassDrives, COMPUTE_WRITE, COMPUTE_WRITE));
            before.push(barrier(Resource::OnePassCouplings, COMPUTE_WRITE, COMPUTE_READ));
            for (kind, radiative, groups) in self.sections().filter(|(kind, ..)| *kind == OnePassKind::Drive) {
                entries.extend([Entry::Barriers(before), pass(kind, radiative, groups)]);
                before = vec![barrier(Resource::OnePassDrives, COMPUTE_WRITE, COMPUTE_WRITE)];
            }
            let mut between = vec![
                barrier(Resource::OnePassDrives, COMPUTE_WRITE, COMPUTE_READ),
                barrier(Resource::OnePassCouplings, COMPUTE_READ, COMPUTE_WRITE),
            ];
            between.extend((!trial).then_some(barrier(Resource::OnePassRests, COMPUTE_READ, COMPUTE_WRITE)));
            between.extend(shown.then_some(barrier(Resource::Temperature, COMPUTE_READ, COMPUTE_WRITE)));
            entries.extend([Entry::Barriers(between), pass(OnePassKind::Conduct, false, (0, self.in_blocks()))]);
            before = self.after_writes(place, odd);
        }
        for (kind, radiative, groups) in self.sections().filter(|(kind, ..)| *kind != OnePassKind::Drive) {
            entries.extend([Entry::Barriers(before), pass(kind, radiative, groups)]);
            before = self.after_writes(place, odd);
        }
        entries
    }

    /// The power of the heaters in a step.
    fn heat(&self, Place { number, first, trial, after_trial, .. }: Place, odd: bool) -> [Entry; 2] {
        use Resource as R;
        let mut before = vec![
            barrier(means(odd), COMPUTE_WRITE, COMPUTE_READ),
            barrier(R::Temperature, if first { COMPUTE_WRITE } else { COMPUTE_READ }, COMPUTE_WRITE),
            barrier(R::OnePassSwitches, COMPUTE_WRITE, COMPUTE),
        ];
        before.extend((!first).then_some(barrier(R::OnePassLog, COMPUTE_WRITE, COMPUTE)));
        before.extend((!after_trial).then_some(barrier(R::OnePassRests, COMPUTE_WRITE, COMPUTE)));
        let bound = |binding, resource, scope| Access { binding: Some(binding), ..access(resource, scope) };
        let accesses = vec![
            bound(0, R::OnePassHeaters, COMPUTE_READ),
            bound(1, R::OnePassPowers, COMPUTE_READ),
            bound(2, R::OnePassSwitches, COMPUTE_READ),
            bound(2, R::OnePassSwitches, COMPUTE_WRITE),
            bound(3, R::OnePassLog, COMPUTE_READ),
            bound(3, R::OnePassLog, COMPUTE_WRITE),
            bound(5, means(odd), COMPUTE_READ),
            bound(7, R::OnePassRests, COMPUTE_READ),
            bound(10, R::Temperature, COMPUTE_WRITE),
        ];
        let said = Said::Heaters { number, first, trial };
        let workgroups = self.heaters.div_ceil(WORKGROUP);
        let work = Work::Dispatch { kernel: Kernel::Heaters, workgroups, set: u32::from(odd), said };
        [Entry::Barriers(before), Entry::Pass(Pass { name: "one_pass_heaters".to_owned(), work, accesses })]
    }

    /// Barriers between two passes that write the temperatures of their sections.
    fn after_writes(&self, Place { trial, shown, .. }: Place, odd: bool) -> Vec<Barrier> {
        let mut barriers = vec![barrier(means(!odd), COMPUTE_WRITE, COMPUTE_WRITE)];
        barriers.extend((!trial).then_some(barrier(Resource::OnePassRests, COMPUTE_WRITE, COMPUTE)));
        barriers.extend(shown.then_some(barrier(Resource::Temperature, COMPUTE_WRITE, COMPUTE)));
        barriers
    }

    /// Groups in blocks.
    pub fn in_blocks(&self) -> u32 {
        self.ends[BLOCKS - 1]
    }

    /// All groups.
    pub fn groups(&self) -> u32 {
        self.ends[SECTIONS.len() - 1]
    }

    /// The sections with nodes, and their groups.
    fn sections(&self) -> impl Iterator<Item = (OnePassKind, bool, (u32, u32))> {
        let starts = std::iter::once(0).chain(self.ends);
        let sections = SECTIONS.into_iter().zip(starts.zip(self.ends));
        sections.filter(|(_, (first, end))| first < end).map(|((kind, radiative), groups)| (kind, radiative, groups))
    }

    fn variant(&self, kind: OnePassKind) -> OnePassVariant {
        let Self { fine, masked, .. } = *self;
        OnePassVariant { kind, trial: false, shown: false, radiative: false, fine, masked }
    }

    fn pass(&self, variant: OnePassVariant, odd: bool, (first, end): (u32, u32)) -> Entry {
        let mut accesses = Vec::new();
        let mut bind = |binding, resource, reads: bool, writes: bool| {
            let scopes = [(reads, COMPUTE_READ), (writes, COMPUTE_WRITE)];
            for (_, scope) in scopes.into_iter().filter(|(is, _)| *is) {
                accesses.push(Access { binding: Some(binding), ..access(resource, scope) });
            }
        };
        use Resource as R;
        let (drives, conducts) = (variant.kind == OnePassKind::Drive, variant.kind == OnePassKind::Conduct);
        bind(4, means(odd), true, false);
        if !conducts {
            bind(0, R::OnePassNodes, true, false);
            if variant.kind != OnePassKind::Alone {
                bind(2, R::OnePassLinks, true, false);
                bind(5, means(odd), true, false);
            }
        }
        if conducts {
            bind(8, R::OnePassDrives, true, false);
            bind(9, R::OnePassCouplings, false, true);
            bind(11, R::OnePassWeights, true, false);
            bind(12, R::OnePassUnits, true, false);
        }
        if drives {
            bind(8, R::OnePassDrives, false, true);
            bind(9, R::OnePassCouplings, true, false);
        } else {
            bind(6, means(!odd), false, true);
        }
        if !(conducts && variant.trial) {
            bind(7, R::OnePassRests, !conducts, !drives && !variant.trial);
        }
        if !conducts || variant.shown {
            bind(1, R::OnePassRows, true, false);
            bind(3, R::OnePassSources, true, false);
            bind(10, R::Temperature, !conducts, variant.shown);
        }
        let said = Said::OnePass(first, end);
        let workgroups = (end - first).div_ceil(WORKGROUP);
        let work = Work::Dispatch { kernel: Kernel::OnePass(variant), workgroups, set: u32::from(odd), said };
        Entry::Pass(Pass { name: variant.shader().name(), work, accesses })
    }
}
