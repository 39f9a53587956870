//! Heat that the parts of a scene absorb, summed on the device over runs of nodes.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::frame::Frame;
pub use super::heat_source::HeatOf;
use super::pass::{
    Access, COMPUTE_READ, COMPUTE_WRITE, Entry, Kernel, Pass, Said, Scope, Work, access, barrier, scope,
};
use super::resource::Resource;

/// Most groups of four nodes in a run, so that the sum of a run is exact to 1e-6 in f32.
pub const RUN_GROUPS: u32 = 1024;

/// Consecutive groups of nodes with one material and part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatRun {
    /// First group of four nodes, and the one after the last.
    pub groups: (u32, u32),
    /// Where its absorbed heat is found.
    pub of: HeatOf,
    /// Stefan-Boltzmann constant times emissivity, summed over the faces [W m-2 K-4].
    pub emission: f64,
    /// Its part.
    pub part: u32,
}

/// The runs of all nodes, and the areas of the nodes.
#[derive(Debug, Clone, Default)]
pub struct HeatTables {
    /// Runs in the order of their groups. Runs with the same [`HeatOf`] follow each other.
    pub runs: Vec<HeatRun>,
    /// Area over which each node absorbs and emits [m2]. 0 for padding.
    pub areas: Vec<f64>,
}

impl HeatTables {
    /// First run and the one after the last for each place where heat is found.
    pub fn sections(&self) -> Vec<(HeatOf, (u32, u32))> {
        let mut sections: Vec<(HeatOf, (u32, u32))> = Vec::new();
        for (number, run) in (0..).zip(&self.runs) {
            match sections.last_mut() {
                Some((of, (_, end))) if *of == run.of => *end = number + 1,
                _ => sections.push((run.of, (number, number + 1))),
            }
        }
        sections
    }

    /// The runs as the shader reads them.
    pub(super) fn words(&self) -> Vec<[u32; 4]> {
        let words = |run: &HeatRun| [run.groups.0, run.groups.1, (run.emission as f32).to_bits(), 0];
        self.runs.iter().map(words).collect()
    }
}

/// The buffer from which heat is read.
fn source(of: HeatOf) -> Resource {
    if of == HeatOf::Target { Resource::Target } else { Resource::Temperature }
}

/// Sums the absorbed heat of sections. It follows the thermal step, and precedes the step of a network.
pub fn absorbed_heat(sections: &[(HeatOf, (u32, u32))]) -> Frame {
    if sections.is_empty() {
        return Frame::default();
    }
    let reads = |resource: Resource| sections.iter().any(|(of, _)| source(*of) == resource);
    let mut barriers = Vec::new();
    if reads(Resource::Temperature) {
        barriers.push(barrier(Resource::Temperature, COMPUTE_WRITE, COMPUTE_READ));
    }
    if reads(Resource::Target) {
        let writers = scope(S::COMPUTE_SHADER | S::COPY, A::SHADER_STORAGE_WRITE | A::TRANSFER_WRITE);
        barriers.push(barrier(Resource::Target, writers, COMPUTE_READ));
    }
    let mut entries = vec![Entry::Barriers(barriers)];
    for (number, (of, runs)) in sections.iter().enumerate() {
        if number > 0 {
            // Sections write different places of one buffer.
            entries.push(Entry::Barriers(vec![barrier(Resource::AbsorbedHeat, COMPUTE_WRITE, COMPUTE_WRITE)]));
        }
        entries.push(Entry::Pass(pass(*of, *runs)));
    }
    let to_host = scope(S::HOST, A::HOST_READ);
    entries.push(Entry::Barriers(vec![barrier(Resource::AbsorbedHeat, COMPUTE_WRITE, to_host)]));
    Frame { entries }
}

fn pass(of: HeatOf, (first, end): (u32, u32)) -> Pass {
    let bound =
        |binding: u32, resource: Resource, scope: Scope| Access { binding: Some(binding), ..access(resource, scope) };
    let accesses = vec![
        bound(0, Resource::HeatRuns, COMPUTE_READ),
        bound(1, Resource::HeatAreas, COMPUTE_READ),
        bound(2, source(of), COMPUTE_READ),
        bound(3, Resource::AbsorbedHeat, COMPUTE_WRITE),
    ];
    let work = Work::Dispatch { kernel: Kernel::Heat(of), workgroups: end - first, set: 0, said: Said::Heat { first } };
    Pass { name: of.shader().name(), work, accesses }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_follow_each_other() {
        let run = |of| HeatRun { groups: (0, 1), of, emission: 0.0, part: 0 };
        let runs = vec![run(HeatOf::Balance), run(HeatOf::Target), run(HeatOf::Target), run(HeatOf::Flux)];
        let tables = HeatTables { runs, areas: Vec::new() };
        let expected = [(HeatOf::Balance, (0, 1)), (HeatOf::Target, (1, 3)), (HeatOf::Flux, (3, 4))];
        assert_eq!(tables.sections(), expected);
        assert!(absorbed_heat(&[]).entries.is_empty());
    }
}
