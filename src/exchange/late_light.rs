//! Light of late reflections, by groups of neighbouring patches.
//!
//! Between shiny faces light is reflected some 1 / (1 - r) times until it is gone, and following it patch by patch takes as long. After some reflections it no longer matters
//! which patch of a group has it. With P_gh the share of the light of group g that arrives at h, and r_g the reflectivity of a group, light R_g that groups reflect arrives as
//! t = (1 - P^T r)^-1 P^T R, all further reflections counted. A group spreads its part over its patches as if all of the craft were alike bright.

use nalgebra::{DMatrix, DVector};

use super::factors::Factors;

/// Patches of a group.
const GROUP: usize = 8;
/// Most groups: their matrix is inverted, in a fraction of a second. Craft of many small sides have more.
const MOST: usize = 512;

/// Light that groups of patches send to each other with all reflections.
#[derive(Debug)]
pub(super) struct LateLight {
    /// First patch of each group, and the patch after the last.
    first: Vec<usize>,
    /// Share of each patch in the light of its group.
    shares: Vec<f64>,
    /// Light that arrives at a group (row), over light that another reflects (column).
    arrives: DMatrix<f64>,
}

impl LateLight {
    /// The groups of patches on these sides of the craft, with these absorptivities. `None` where there are too many, or light goes on for ever.
    pub(super) fn new(factors: &Factors, sides: &[u32], absorptivities: &[f64]) -> Option<Self> {
        let first = groups(sides, absorptivities);
        if first.len() > MOST + 1 {
            return None;
        }
        let group_of: Vec<usize> = first.windows(2).enumerate().flat_map(|(g, run)| vec![g; run[1] - run[0]]).collect();
        let count = first.len() - 1;
        let of_group = |values: &dyn Fn(usize) -> f64| -> Vec<f64> {
            first.windows(2).map(|run| (run[0]..run[1]).map(values).sum()).collect()
        };
        let areas = of_group(&|patch| factors.areas[patch]);
        let reflects = of_group(&|patch| factors.areas[patch] * (1.0 - absorptivities[patch]));
        // Column: the group that sends. Row: the group that receives.
        let mut sent = DMatrix::zeros(count, count);
        let mut seen = vec![0.0; group_of.len()];
        for (patch, seen) in seen.iter_mut().enumerate() {
            let from = group_of[patch];
            for (other, area) in factors.shared.row(patch) {
                *seen += area;
                sent[(group_of[*other as usize], from)] += area / areas[from];
            }
        }
        let mut left = -sent.clone();
        for (group, mut column) in left.column_iter_mut().enumerate() {
            column *= reflects[group] / areas[group];
            column[group] += 1.0;
        }
        let arrives = left.lu().solve(&sent).filter(|all| all.iter().all(|share| share.is_finite()))?;
        let all = of_group(&|patch| seen[patch]);
        let shares =
            seen.iter().zip(&group_of).map(|(seen, group)| seen / all[*group].max(f64::MIN_POSITIVE)).collect();
        Some(Self { first, shares, arrives })
    }

    /// All light that still arrives at each patch, where patches `reflect` light.
    pub(super) fn arriving(&self, reflected: &[(u32, f64)]) -> Vec<f64> {
        let mut of_group = DVector::zeros(self.first.len() - 1);
        let mut group = 0;
        for (patch, light) in reflected {
            while self.first[group + 1] <= *patch as usize {
                group += 1;
            }
            of_group[group] += light;
        }
        let arrives = &self.arrives * of_group;
        let patches = |group: usize| self.first[group]..self.first[group + 1];
        (0..arrives.len())
            .flat_map(|group| patches(group).map(move |patch| (group, patch)))
            .map(|(group, patch)| arrives[group] * self.shares[patch])
            .collect()
    }
}

/// First patches of groups: neighbours on one side of the craft that absorb alike. The last entry is the number of patches.
fn groups(sides: &[u32], absorptivities: &[f64]) -> Vec<usize> {
    let size = GROUP.max(sides.len().div_ceil(MOST));
    let mut first = vec![0];
    for patch in 1..sides.len() {
        let is_alike = sides[patch] == sides[patch - 1] && absorptivities[patch] == absorptivities[patch - 1];
        if !is_alike || patch - first[first.len() - 1] == size {
            first.push(patch);
        }
    }
    first.push(sides.len());
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::factors::Correction;
    use crate::exchange::sparse::Sparse;

    /// A closed corridor: patches see those within some places of them, and absorb this share.
    fn corridor(count: usize, reach: f64) -> Factors {
        let seen = |i: usize, j: usize| (-(i as f64 - j as f64).abs() / reach).exp();
        let most = (0..count).map(|i| (0..count).map(|j| seen(i, j)).sum::<f64>()).fold(0.0, f64::max);
        let row = |i: usize| -> Vec<(u32, f64)> {
            let others: Vec<f64> = (0..count).map(|j| seen(i, j) / most).collect();
            let rest = 1.0 - others.iter().sum::<f64>();
            (0..count).map(|j| (j as u32, others[j] + if i == j { rest } else { 0.0 })).collect()
        };
        Factors {
            areas: vec![1.0; count],
            shared: Sparse::from_rows((0..count).map(row).collect()),
            space: vec![0.0; count],
            rays: 512,
            correction: Correction::default(),
            inside: vec![0.0; count],
        }
    }

    /// Light at one end of a corridor, after some reflections, arrives by groups as it does patch by patch.
    #[test]
    fn groups_send_light_as_their_patches_do() {
        let count = 320;
        for (reach, emissivity, within) in [(40.0, 0.05, 0.01), (40.0, 0.002, 0.01), (8.0, 0.05, 0.03)] {
            let factors = corridor(count, reach);
            let taken = vec![emissivity; count];
            let late = LateLight::new(&factors, &vec![0; count], &taken).expect("light ends");
            let step = |light: &[f64]| -> Vec<f64> {
                let arrives = |i: usize| factors.shared.row(i).iter().map(|(j, area)| area * light[*j as usize]);
                (0..count).map(|i| arrives(i).sum::<f64>() * (1.0 - emissivity)).collect()
            };
            let mut light = vec![0.0; count];
            light[3] = 1.0;
            for _ in 0..8 {
                light = step(&light);
            }
            let reflected: Vec<(u32, f64)> = (0..).zip(light.iter().copied()).collect();
            let mut expected = vec![0.0; count];
            while light.iter().sum::<f64>() > 1e-9 {
                let next = step(&light);
                expected.iter_mut().zip(&next).for_each(|(all, light)| *all += light / (1.0 - emissivity));
                light = next;
            }
            let found = late.arriving(&reflected);
            let sum = |of: &[f64], run: std::ops::Range<usize>| of[run].iter().sum::<f64>();
            let all = sum(&expected, 0..count);
            assert!((sum(&found, 0..count) / all - 1.0).abs() < 1e-6, "energy: {} of {all}", sum(&found, 0..count));
            // Quarters of the corridor, over all light.
            let apart = (0..4).map(|k| (sum(&found, 80 * k..80 * k + 80) - sum(&expected, 80 * k..80 * k + 80)) / all);
            let apart = apart.fold(0.0, |most: f64, off| most.max(off.abs()));
            println!("reach {reach}, emissivity {emissivity}: {apart:.1e} of all light");
            assert!(apart < within, "{apart}");
            // Were all patches one group, the far end would have as much as the near one.
            let even = sum(&expected, 0..80) / all - 0.25;
            assert!(even > 5.0 * within || emissivity < 0.01, "{even}");
        }
    }
}
