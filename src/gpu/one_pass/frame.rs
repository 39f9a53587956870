//! Frame lists of a network that is stepped in one pass, with the bindings of `glsl/one_pass.comp`.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use crate::gpu::frame::Frame;
use crate::gpu::one_pass_variant::{OnePassKind, OnePassVariant, StageVariant};
use crate::gpu::pass::{
    Access, COMPUTE_READ, COMPUTE_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access, barrier, scope,
};
use crate::gpu::resource::Resource;
use crate::thermal::network::one_pass::{EstimatePart, since};

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
    /// Whether they are in large blocks.
    pub large: bool,
}

const fn section(kind: OnePassKind, radiative: bool, fast: bool) -> Section {
    Section { kind, radiative, fast, large: false }
}

const fn large(radiative: bool, fast: bool) -> Section {
    Section { kind: OnePassKind::Drive, radiative, fast, large: true }
}

/// Sections of the groups in order. Large blocks come first, then other blocks, and what has no estimate last.
pub const SECTIONS: [Section; 15] = [
    large(true, true),
    large(true, false),
    large(false, true),
    large(false, false),
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
/// Number of sections with large blocks.
const LARGE: usize = 4;
/// Number of sections with blocks.
const BLOCKS: usize = 8;
/// Number of sections with an estimate.
const ESTIMATED: usize = 12;

/// Place of a step among those of a frame.
#[derive(Clone, Copy)]
struct Place {
    /// Its number. A trial has that of the step that it is for.
    number: u32,
    /// Its part in the estimate of the error.
    sample: EstimatePart,
    /// Steps since the last estimate.
    since: u32,
    first: bool,
    /// Whether it follows its trial.
    tried: bool,
    /// Whether the mean temperatures at its start are in the odd buffer.
    odd: bool,
    /// Whether its temperatures are not kept.
    trial: bool,
    /// Whether the drawn nodes take its temperatures.
    shown: bool,
    /// Stages of the conduction inside large blocks.
    stages: u32,
}

/// Mean temperatures from which a step starts. The step leaves those of the next one in the other buffer.
fn means(odd: bool) -> Resource {
    if odd { Resource::OnePassMeanOdd } else { Resource::OnePassMeanEven }
}

/// Vectors of a stage.
fn vectors(stage: u32) -> Resource {
    if stage.is_multiple_of(2) { Resource::OnePassVectorEven } else { Resource::OnePassVectorOdd }
}

/// Barriers between compute passes over those of the buffers for which it is true.
fn wait(entries: &mut Vec<Entry>, buffers: &[(Resource, bool)]) {
    let needed = buffers.iter().filter(|(_, is)| *is);
    let barriers: Vec<_> = needed.map(|(resource, _)| barrier(*resource, COMPUTE_WRITE, COMPUTE)).collect();
    if !barriers.is_empty() {
        entries.push(Entry::Barriers(barriers));
    }
}

impl OnePassShape {
    /// Steps of one length, after the flux of the drawn nodes. `age` is the number of such steps before them. The state is
    /// in the odd buffer if `odd`. Where there were none, the first one is tried before. Large blocks conduct in a number of `stages`. The second result is
    /// `odd` for the new state.
    pub fn steps(&self, count: u32, age: u32, odd: bool, stages: u32) -> (Frame, bool) {
        let tried = age == 0;
        let all = count + u32::from(tried);
        let mut entries = Vec::new();
        for number in 0..all {
            let trial = tried && number == 0;
            let own = number.saturating_sub(u32::from(tried));
            let age = age.saturating_add(own);
            self.step(
                Place {
                    number: own,
                    sample: if trial { EstimatePart::None } else { EstimatePart::of(age) },
                    since: since(age),
                    first: number == 0,
                    tried: tried && number == 1,
                    odd: odd ^ (number % 2 == 1),
                    trial,
                    shown: number + 1 == all,
                    stages,
                },
                &mut entries,
            );
        }
        if self.heaters > 0 {
            let to_host = scope(S::HOST, A::HOST_READ);
            entries.push(Entry::Barriers(vec![barrier(Resource::OnePassLog, COMPUTE_WRITE, to_host)]));
        }
        (Frame { entries }, odd ^ (all % 2 == 1))
    }

    /// The phases of a step with their barriers. The heaters come first, because nodes take their power. Nodes without capacity come before others, which take
    /// their temperatures. Then come all other nodes, and at last the conduction inside blocks, which needs what their nodes received.
    fn step(&self, place: Place, entries: &mut Vec<Entry>) {
        use OnePassKind as K;
        use Resource as R;
        let Place { sample, first, tried, trial, shown, odd, .. } = place;
        let (this, next) = (means(odd), means(!odd));
        let has = |kinds: &[K]| self.sections().any(|(section, _)| kinds.contains(&section.kind));
        let (heats, balances, in_blocks) = (self.heaters > 0, has(&[K::Balance]), has(&[K::Drive]));
        // Nodes that gather from others, and nodes that finish their step, before the conduction or without one.
        let (gathers, finishes) = (has(&[K::Drive, K::Advance]), has(&[K::Advance, K::Alone]));
        let (others, leads) = (gathers || finishes, finishes && !in_blocks);
        let (estimates, samples) =
            (sample == EstimatePart::Estimate, sample != EstimatePart::None && self.estimated() > 0);

        // What earlier steps left, and the loads of this frame. A trial only reads the states.
        wait(
            entries,
            &[
                (R::Temperature, first || heats || shown && (balances || leads)),
                (this, heats || balances || gathers),
                (next, true),
                (R::OnePassStates, !tried || (balances || leads) && !(heats && others)),
                (R::OnePassDrives, in_blocks),
                (R::OnePassCouplings, in_blocks),
                (R::OnePassMemory, samples),
                (R::OnePassErrors, estimates && in_blocks),
                (R::OnePassTold, estimates && samples),
                (R::OnePassSwitches, heats),
                (R::OnePassLog, heats),
            ],
        );
        if heats {
            entries.push(Entry::Pass(self.heat(place)));
            // The power is read. What the sensors read is overwritten.
            let states = balances || leads && !trial;
            wait(entries, &[(R::Temperature, true), (this, balances), (R::OnePassStates, states)]);
        }
        if balances {
            let passes = self.sections().filter(|(section, _)| section.kind == K::Balance);
            entries.extend(passes.map(|(section, groups)| Entry::Pass(self.pass(section, place, groups))));
            wait(
                entries,
                &[(R::Temperature, shown && others), (this, gathers), (next, finishes), (R::OnePassStates, others)],
            );
        }
        let mut last: Option<OnePassKind> = None;
        let steps = self.sections().filter(|(section, _)| matches!(section.kind, K::Drive | K::Advance | K::Alone));
        for (of, groups) in steps {
            let kind = Some(of.kind);
            if last.is_some() {
                // Other nodes of the same buffers.
                let (still_drives, ends) = (kind == Some(K::Drive), kind != Some(K::Drive));
                wait(
                    entries,
                    &[
                        (R::Temperature, shown && ends),
                        (next, last != Some(K::Drive)),
                        (R::OnePassStates, ends && !trial),
                        (R::OnePassDrives, still_drives),
                        (R::OnePassMemory, samples && kind != Some(K::Alone)),
                        (R::OnePassErrors, estimates && still_drives),
                        (R::OnePassTold, estimates && last == Some(K::Advance) && kind == last),
                    ],
                );
            }
            entries.push(Entry::Pass(self.pass(of, place, groups)));
            last = kind;
        }
        if in_blocks {
            let large = self.in_large() > 0;
            if large {
                self.stages(place, entries);
            }
            wait(
                entries,
                &[
                    (R::Temperature, shown),
                    (next, finishes || balances),
                    (R::OnePassStates, !trial),
                    (R::OnePassDrives, !large),
                    (R::OnePassCouplings, true),
                    (R::OnePassMemory, estimates),
                    (R::OnePassErrors, estimates && !large),
                    (R::OnePassTold, estimates && has(&[K::Advance])),
                    (R::OnePassSums, large),
                ],
            );
            let conducts = section(K::Conduct, false, false);
            let ranges = [(true, (0, self.in_large())), (false, (self.in_large(), self.in_blocks()))];
            let mut passes = ranges.into_iter().filter(|(_, (first, end))| first < end);
            let mut pass = |(large, groups)| Entry::Pass(self.pass(Section { large, ..conducts }, place, groups));
            entries.extend(passes.next().map(&mut pass));
            if let Some(other) = passes.next() {
                // Other nodes of the same buffers.
                wait(
                    entries,
                    &[
                        (R::Temperature, shown),
                        (next, true),
                        (R::OnePassStates, !trial),
                        (R::OnePassCouplings, true),
                        (R::OnePassMemory, estimates),
                        (R::OnePassTold, estimates),
                    ],
                );
                entries.push(pass(other));
            }
        }
    }

    /// The stages of the conduction inside large blocks. Each reads the vectors of the one before.
    fn stages(&self, place: Place, entries: &mut Vec<Entry>) {
        use Resource as R;
        let estimates = place.sample == EstimatePart::Estimate;
        for number in 0..=place.stages {
            let begins = number == 0;
            wait(
                entries,
                &[
                    (R::OnePassDrives, begins),
                    (R::OnePassErrors, begins && estimates),
                    (R::OnePassVectorEven, true),
                    (R::OnePassVectorOdd, !begins),
                    (R::OnePassSums, true),
                ],
            );
            entries.push(Entry::Pass(self.stage(number, estimates)));
        }
    }

    fn stage(&self, number: u32, estimates: bool) -> Pass {
        use Resource as R;
        let bound = |binding, resource, scope| Access { binding: Some(binding), ..access(resource, scope) };
        let variant = StageVariant { begins: number == 0, estimates };
        let mut accesses = vec![
            bound(0, R::OnePassNodes, COMPUTE_READ),
            bound(2, R::OnePassLinks, COMPUTE_READ),
            bound(3, R::OnePassSums, COMPUTE_WRITE),
            bound(4, vectors(number), COMPUTE_WRITE),
            bound(12, R::OnePassUnits, COMPUTE_READ),
        ];
        if variant.begins {
            accesses.extend([8, 5].map(|binding| bound(binding, R::OnePassDrives, COMPUTE_READ)));
            if estimates {
                accesses.extend([14, 6].map(|binding| bound(binding, R::OnePassErrors, COMPUTE_READ)));
            }
        } else {
            accesses.push(bound(3, R::OnePassSums, COMPUTE_READ));
            accesses.push(bound(4, vectors(number), COMPUTE_READ));
            accesses.extend([8, 5].map(|binding| bound(binding, vectors(number + 1), COMPUTE_READ)));
        }
        let workgroups = self.in_large().div_ceil(WORKGROUP);
        let (kernel, said) = (Kernel::Stage(variant), Said::Stage { number });
        let work = Work::Dispatch { kernel, workgroups, set: number % 2, said };
        Pass { name: variant.shader().name(), work, accesses }
    }

    /// The power of the heaters in a step.
    fn heat(&self, Place { number, first, trial, odd, .. }: Place) -> Pass {
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
            bound(7, R::OnePassStates, COMPUTE_READ),
            bound(10, R::Temperature, COMPUTE_WRITE),
        ];
        let said = Said::Heaters { number, first, trial };
        let workgroups = self.heaters.div_ceil(WORKGROUP);
        let work = Work::Dispatch { kernel: Kernel::Heaters, workgroups, set: u32::from(odd), said };
        Pass { name: "one_pass_heaters".to_owned(), work, accesses }
    }

    /// Groups in large blocks.
    pub fn in_large(&self) -> u32 {
        self.ends[LARGE - 1]
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

    /// A pass over a range of groups.
    fn pass(&self, of: Section, place: Place, (first, end): (u32, u32)) -> Pass {
        use OnePassKind as K;
        use Resource as R;
        let Section { kind, radiative, fast, large } = of;
        let Place { sample, since, trial, shown, odd, .. } = place;
        let variant = OnePassVariant { kind, trial, sample, shown, radiative, fast, large }.lean();
        let mut accesses = Vec::new();
        let mut bind = |binding, resource, reads: bool, writes: bool| {
            let scopes = [(reads, COMPUTE_READ), (writes, COMPUTE_WRITE)];
            for (_, scope) in scopes.into_iter().filter(|(is, _)| *is) {
                accesses.push(Access { binding: Some(binding), ..access(resource, scope) });
            }
        };
        let (drives, conducts, balances) = (kind == K::Drive, kind == K::Conduct, kind == K::Balance);
        let (notes, estimates) = (variant.sample == EstimatePart::Note, variant.sample == EstimatePart::Estimate);
        if !conducts {
            bind(0, R::OnePassNodes, true, false);
            if kind != K::Alone {
                bind(2, R::OnePassLinks, true, false);
                bind(4, means(odd), true, balances);
                bind(5, means(odd), true, false);
            }
        }
        if drives {
            bind(8, R::OnePassDrives, false, true);
            bind(9, R::OnePassCouplings, true, false);
        } else {
            bind(6, means(!odd), false, true);
        }
        if conducts {
            bind(8, R::OnePassDrives, true, false);
            bind(9, R::OnePassCouplings, false, true);
            if variant.large {
                bind(11, R::OnePassSums, true, false);
            } else {
                bind(11, R::OnePassWeights, true, false);
                bind(12, R::OnePassUnits, true, false);
            }
        }
        bind(7, R::OnePassStates, true, !drives && !variant.trial);
        if !conducts || variant.shown {
            bind(1, R::OnePassRows, true, false);
            bind(3, R::OnePassSources, true, false);
            bind(10, R::Temperature, !conducts, variant.shown);
        }
        if notes || estimates {
            bind(13, R::OnePassMemory, estimates && !conducts, true);
        }
        if estimates {
            if drives {
                bind(14, R::OnePassErrors, false, true);
            } else {
                bind(15, R::OnePassTold, true, true);
            }
            if conducts {
                bind(14, R::OnePassErrors, true, false);
            }
        }
        let said = Said::OnePass { first, end, since };
        let workgroups = (end - first).div_ceil(WORKGROUP);
        let work = Work::Dispatch { kernel: Kernel::OnePass(variant), workgroups, set: u32::from(odd), said };
        Pass { name: variant.shader().name(), work, accesses }
    }
}
