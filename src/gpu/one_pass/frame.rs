//! Frame lists of a network that is stepped in one pass, with the bindings of `glsl/one_pass.comp`.

use std::collections::BTreeMap;

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use crate::gpu::frame::Frame;
use crate::gpu::one_pass_variant::{OnePassKind, OnePassVariant};
use crate::gpu::pass::{
    Access, COMPUTE_READ, COMPUTE_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access, barrier, is_write, scope,
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
    /// Whether no drawn node is free to take what nobody sees.
    pub masked: bool,
}

/// A run of groups whose nodes are treated alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Section {
    /// Work on its nodes.
    pub kind: OnePassKind,
    /// Whether they radiate to other nodes.
    pub radiative: bool,
    /// Whether a Runge-Kutta step is too coarse for one of them.
    pub fast: bool,
}

const fn section(kind: OnePassKind, radiative: bool, fast: bool) -> Section {
    Section { kind, radiative, fast }
}

/// Sections of the groups in order. Blocks come first, and what has no estimate last.
pub const SECTIONS: [Section; 11] = [
    section(OnePassKind::Drive, true, true),
    section(OnePassKind::Drive, true, false),
    section(OnePassKind::Drive, false, true),
    section(OnePassKind::Drive, false, false),
    section(OnePassKind::Advance, true, true),
    section(OnePassKind::Advance, true, false),
    section(OnePassKind::Advance, false, true),
    section(OnePassKind::Advance, false, false),
    section(OnePassKind::Alone, false, true),
    section(OnePassKind::Alone, false, false),
    section(OnePassKind::Balance, true, false),
];
/// Number of sections with blocks.
const BLOCKS: usize = 4;
/// Number of sections with an estimate.
const ESTIMATED: usize = 8;

/// Place of a step among those of a frame.
#[derive(Clone, Copy)]
struct Place {
    /// Its number. A trial has that of the step that it is for.
    number: u32,
    /// Steps of the same length before it.
    age: u32,
    first: bool,
    /// Whether its temperatures are not kept.
    trial: bool,
    /// Whether the drawn nodes take its temperatures.
    shown: bool,
}

/// Mean temperatures from which a step starts. The step leaves those of the next one in the other buffer.
fn means(odd: bool) -> Resource {
    if odd { Resource::OnePassMeanOdd } else { Resource::OnePassMeanEven }
}

impl OnePassShape {
    /// Steps of one length, after the flux of the drawn nodes. `age` is the number of such steps before them. The state is
    /// in the odd buffer if `odd`. Where there were none, the first one is tried before. The second result is `odd` for
    /// the new state.
    pub fn steps(&self, count: u32, age: u32, odd: bool) -> (Frame, bool) {
        let tried = age == 0;
        let all = count + u32::from(tried);
        let steps = (0..all).flat_map(|number| {
            let trial = tried && number == 0;
            let place = Place {
                number: number.saturating_sub(u32::from(tried)),
                age: age.saturating_add(number.saturating_sub(u32::from(tried))),
                first: number == 0,
                trial,
                shown: number + 1 == all,
            };
            self.step(place, odd ^ (number % 2 == 1))
        });
        let mut entries = ordered(steps.collect());
        if self.heaters > 0 {
            let to_host = scope(S::HOST, A::HOST_READ);
            entries.push(Entry::Barriers(vec![barrier(Resource::OnePassLog, COMPUTE_WRITE, to_host)]));
        }
        (Frame { entries }, odd ^ (all % 2 == 1))
    }

    /// The passes of a step. Nodes without capacity come first, because the others take their temperatures. Then come the blocks.
    fn step(&self, place: Place, odd: bool) -> Vec<Pass> {
        let mut passes: Vec<Pass> = (self.heaters > 0).then(|| self.heat(place, odd)).into_iter().collect();
        let of_kind = |wanted: &[OnePassKind], passes: &mut Vec<Pass>| {
            let sections = self.sections().filter(|(section, _)| wanted.contains(&section.kind));
            passes.extend(sections.map(|(section, groups)| self.pass(section, place, odd, groups)));
        };
        of_kind(&[OnePassKind::Balance], &mut passes);
        of_kind(&[OnePassKind::Drive], &mut passes);
        if self.in_blocks() > 0 {
            let conducts = section(OnePassKind::Conduct, false, false);
            passes.push(self.pass(conducts, place, odd, (0, self.in_blocks())));
        }
        of_kind(&[OnePassKind::Advance, OnePassKind::Alone], &mut passes);
        passes
    }

    /// The power of the heaters in a step.
    fn heat(&self, Place { number, first, trial, .. }: Place, odd: bool) -> Pass {
        use Resource as R;
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
        Pass { name: "one_pass_heaters".to_owned(), work, accesses }
    }

    /// Groups in blocks.
    pub fn in_blocks(&self) -> u32 {
        self.ends[BLOCKS - 1]
    }

    /// All groups.
    pub fn groups(&self) -> u32 {
        self.ends[SECTIONS.len() - 1]
    }

    /// Groups whose error is estimated.
    pub fn estimated(&self) -> u32 {
        self.ends[ESTIMATED - 1]
    }

    /// The sections with nodes, and their groups.
    fn sections(&self) -> impl Iterator<Item = (Section, (u32, u32))> {
        let starts = std::iter::once(0).chain(self.ends);
        SECTIONS.into_iter().zip(starts.zip(self.ends)).filter(|(_, (first, end))| first < end)
    }

    fn pass(&self, of: Section, place: Place, odd: bool, (first, end): (u32, u32)) -> Pass {
        let Section { kind, radiative, fast } = of;
        let Place { age, trial, shown, .. } = place;
        let variant = OnePassVariant { kind, trial, shown, radiative, fast, masked: self.masked }.lean();
        let mut accesses = Vec::new();
        let mut bind = |binding, resource, reads: bool, writes: bool| {
            let scopes = [(reads, COMPUTE_READ), (writes, COMPUTE_WRITE)];
            for (_, scope) in scopes.into_iter().filter(|(is, _)| *is) {
                accesses.push(Access { binding: Some(binding), ..access(resource, scope) });
            }
        };
        use Resource as R;
        let (drives, conducts) = (kind == OnePassKind::Drive, kind == OnePassKind::Conduct);
        let (alone, balances) = (kind == OnePassKind::Alone, kind == OnePassKind::Balance);
        let estimates = !(variant.trial || alone || balances);
        bind(4, means(odd), true, balances);
        if !conducts {
            bind(0, R::OnePassNodes, true, false);
            if !alone {
                bind(2, R::OnePassLinks, true, false);
                bind(5, means(odd), true, false);
            }
        }
        if conducts {
            bind(8, R::OnePassDrives, true, false);
            bind(9, R::OnePassCouplings, estimates, true);
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
        if estimates {
            bind(13, R::OnePassMemory, !conducts, true);
            if drives || conducts {
                bind(14, R::OnePassErrors, conducts, drives);
            }
            if !drives {
                bind(15, R::OnePassTold, true, true);
            }
        }
        let said = Said::OnePass { first, end, age };
        let workgroups = (end - first).div_ceil(WORKGROUP);
        let work = Work::Dispatch { kernel: Kernel::OnePass(variant), workgroups, set: u32::from(odd), said };
        Pass { name: variant.shader().name(), work, accesses }
    }
}

/// State of a resource in a list of passes.
#[derive(Clone, Copy, PartialEq)]
enum Last {
    /// Nothing has to be waited for.
    Clean,
    Read,
    Written,
}

/// Passes with the barriers that their accesses need. There are too many combinations of sections to write these by hand. What the passes write, earlier frames
/// and the thermal steps of this one wrote too.
fn ordered(passes: Vec<Pass>) -> Vec<Entry> {
    let mut last: BTreeMap<Resource, Last> = BTreeMap::new();
    for access in passes.iter().flat_map(|pass| &pass.accesses).filter(|access| is_write(access.scope.access)) {
        last.insert(access.resource, Last::Written);
    }
    // A single step only reads one of the two buffers that take turns.
    last.extend([false, true].map(|odd| (means(odd), Last::Written)));
    let mut entries = Vec::new();
    for pass in passes {
        let mut uses: BTreeMap<Resource, [bool; 2]> = BTreeMap::new();
        for access in &pass.accesses {
            uses.entry(access.resource).or_default()[usize::from(is_write(access.scope.access))] = true;
        }
        let mut barriers = Vec::new();
        for (resource, [reads, writes]) in uses {
            let before = last.insert(resource, if writes { Last::Written } else { Last::Read }).unwrap_or(Last::Clean);
            let after = match (reads, writes) {
                (true, true) => COMPUTE,
                (true, false) => COMPUTE_READ,
                (false, _) => COMPUTE_WRITE,
            };
            match before {
                Last::Written => barriers.push(barrier(resource, COMPUTE_WRITE, after)),
                Last::Read if writes => barriers.push(barrier(resource, COMPUTE_READ, COMPUTE_WRITE)),
                Last::Read | Last::Clean => {}
            }
        }
        if !barriers.is_empty() {
            entries.push(Entry::Barriers(barriers));
        }
        entries.push(Entry::Pass(pass));
    }
    entries
}
