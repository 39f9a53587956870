//! Runs of nodes whose absorbed heat is summed.

/// Where the absorbed heat of nodes is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum HeatOf {
    /// In their temperatures, which balance the load: an instant response.
    Balance,
    /// In their targets: a transition.
    Target,
    /// In the flux that stands in the place of their temperatures: a network before its step.
    Flux,
}

/// Most groups of four nodes in a run, so that the sum of a run is exact to 1e-6 in f32.
pub(crate) const RUN_GROUPS: u32 = 1024;

/// Consecutive groups of nodes with one material and part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeatRun {
    /// First group of four nodes, and the one after the last.
    pub(crate) groups: (u32, u32),
    /// Where its absorbed heat is found.
    pub(crate) of: HeatOf,
    /// Stefan-Boltzmann constant times emissivity, summed over the faces [W m-2 K-4].
    pub(crate) emission: f64,
    /// Its part.
    pub(crate) part: u32,
}

/// The runs of all nodes, and the areas of the nodes.
#[derive(Debug, Clone, Default)]
pub struct HeatTables {
    /// Runs in the order of their groups. Runs with the same [`HeatOf`] follow each other.
    pub(crate) runs: Vec<HeatRun>,
    /// Area over which each node absorbs and emits [m2]. 0 for padding.
    pub(crate) areas: Vec<f64>,
}

impl HeatTables {
    /// First run and the one after the last for each place where heat is found.
    pub(crate) fn sections(&self) -> Vec<(HeatOf, (u32, u32))> {
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
    pub(crate) fn words(&self) -> Vec<[u32; 4]> {
        let words = |run: &HeatRun| [run.groups.0, run.groups.1, (run.emission as f32).to_bits(), 0];
        self.runs.iter().map(words).collect()
    }
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
    }
}
