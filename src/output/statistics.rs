//! Smallest, mean and largest temperature of node groups. The bits do not depend on the number of threads.

use rayon::prelude::*;

use super::OutputError;

/// Nodes that one task sums. The number is fixed, because the order of additions decides the last bits of a mean.
const CHUNK: usize = 1 << 15;

/// Temperatures of a group of nodes.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub(crate) struct Summary {
    /// Smallest [K].
    pub(crate) min: f32,
    /// Area-weighted mean [K].
    pub(crate) mean: f64,
    /// Largest [K].
    pub(crate) max: f32,
}

/// Median, tenth and ninetieth percentile of samples.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Percentiles {
    pub(crate) median: f64,
    /// Tenth percentile.
    pub(crate) p10: f64,
    /// Ninetieth percentile.
    pub(crate) p90: f64,
    pub(crate) samples: u64,
}

impl Percentiles {
    /// Percentiles with linear interpolation between ranks. `None` without samples. Samples that are not finite do not
    /// count.
    pub(crate) fn of(samples: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = samples.iter().copied().filter(|sample| sample.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let percentile = |share: f64| {
            let rank = share * last as f64;
            let below = rank.floor() as usize;
            let above = (below + 1).min(last);
            sorted[below] + (sorted[above] - sorted[below]) * (rank - below as f64)
        };
        Some(Self { median: percentile(0.5), p10: percentile(0.1), p90: percentile(0.9), samples: sorted.len() as u64 })
    }

    /// The same values in another unit.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { median: factor * self.median, p10: factor * self.p10, p90: factor * self.p90, ..self }
    }
}

#[derive(Debug, Clone, Copy)]
struct Sum {
    area: f64,
    area_temperature: f64,
    min: f32,
    max: f32,
}

impl Sum {
    const EMPTY: Self = Self { area: 0.0, area_temperature: 0.0, min: f32::INFINITY, max: f32::NEG_INFINITY };

    fn add(&mut self, temperature: f32, area: f64) {
        self.merge(&Self { area, area_temperature: area * f64::from(temperature), min: temperature, max: temperature });
    }

    fn merge(&mut self, other: &Self) {
        self.area += other.area;
        self.area_temperature += other.area_temperature;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    fn summary(&self) -> Option<Summary> {
        if self.area <= 0.0 {
            return None;
        }
        let mean = self.area_temperature / self.area;
        // f32::min and f32::max ignore NaN, but a group with a NaN must show it.
        let [min, max] = if mean.is_nan() { [f32::NAN; 2] } else { [self.min, self.max] };
        Some(Summary { min, mean, max })
    }
}

/// Nodes in groups (parts or materials), with their areas [m2].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StatisticsGroups {
    areas: Vec<f64>,
    group: Vec<u32>,
    count: usize,
}

impl StatisticsGroups {
    /// Node i has the area `areas[i]` and belongs to group `group[i]`, which is below `count`.
    ///
    /// # Errors
    /// The lists differ in length, or a group number is too large.
    pub(crate) fn new(areas: Vec<f64>, group: Vec<u32>, count: usize) -> Result<Self, OutputError> {
        if areas.len() != group.len() {
            let reason = format!("{} group numbers, but {} areas", group.len(), areas.len());
            return Err(OutputError::Mismatch(reason));
        }
        if let Some(node) = group.iter().position(|&group| group as usize >= count) {
            return Err(OutputError::Mismatch(format!("node {node}: group {} of {count}", group[node])));
        }
        Ok(Self { areas, group, count })
    }

    /// All nodes as one group.
    pub(crate) fn all(areas: Vec<f64>) -> Self {
        let group = vec![0; areas.len()];
        Self { areas, group, count: 1 }
    }

    /// The summary of each group. `None` for a group without area. NaN in a group makes its whole summary NaN.
    ///
    /// # Errors
    /// The number of temperatures differs from the number of nodes.
    pub(crate) fn summaries(&self, temperatures: &[f32]) -> Result<Vec<Option<Summary>>, OutputError> {
        if temperatures.len() != self.areas.len() {
            let reason = format!("{} temperatures, but {} areas", temperatures.len(), self.areas.len());
            return Err(OutputError::Mismatch(reason));
        }
        let chunks = temperatures.par_chunks(CHUNK).zip(self.areas.par_chunks(CHUNK)).zip(self.group.par_chunks(CHUNK));
        let partial: Vec<Vec<Sum>> = chunks
            .map(|((temperatures, areas), group)| {
                let mut sums = vec![Sum::EMPTY; self.count];
                for ((&temperature, &area), &group) in temperatures.iter().zip(areas).zip(group) {
                    sums[group as usize].add(temperature, area);
                }
                sums
            })
            .collect();
        let mut total = vec![Sum::EMPTY; self.count];
        for sums in &partial {
            total.iter_mut().zip(sums).for_each(|(total, sum)| total.merge(sum));
        }
        Ok(total.iter().map(Sum::summary).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_interpolated_between_ranks() {
        // numpy.percentile([1, 2, 3, 4, 10], [10, 50, 90]) = 1.4, 3.0, 7.6
        let time = Percentiles::of(&[10.0, 2.0, 3.0, f64::NAN, 1.0, 4.0]).unwrap();
        assert!((time.p10 - 1.4).abs() < 1e-12 && (time.p90 - 7.6).abs() < 1e-12);
        assert_eq!((time.median, time.samples), (3.0, 5));
        assert_eq!(Percentiles::of(&[2.5]).unwrap().p90, 2.5);
        assert_eq!(Percentiles::of(&[f64::NAN]), None);
    }

    #[test]
    fn a_mean_is_weighted_by_area_and_the_ends_are_not() {
        // By hand: (1*300 + 3*200) / 4 = 225. The plain mean is 250.
        let groups = StatisticsGroups::new(vec![1.0, 3.0, 5.0], vec![0, 0, 2], 4).unwrap();
        let result = groups.summaries(&[300.0, 200.0, 2.7]).unwrap();
        assert_eq!(result[0], Some(Summary { min: 200.0, mean: 225.0, max: 300.0 }));
        assert_eq!(result[1], None);
        assert_eq!(result[2].unwrap().max, 2.7);
        let even = StatisticsGroups::new(vec![1.0, 1.0, 5.0], vec![0, 0, 2], 4).unwrap();
        assert_eq!(even.summaries(&[300.0, 200.0, 2.7]).unwrap()[0].unwrap().mean, 250.0);
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        let nodes = 3 * CHUNK + 17;
        let noise = |i: usize| ((i * 2_654_435_761) % 1_000_003) as f64 / 1_000_003.0;
        let temperatures: Vec<f32> = (0..nodes).map(|i| 2.7 + 400.0 * noise(i) as f32).collect();
        let areas: Vec<f64> = (0..nodes).map(|i| 1e-4 + noise(i + 7)).collect();
        let groups = StatisticsGroups::new(areas.clone(), (0..nodes as u32).map(|i| i % 5).collect(), 5).unwrap();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| groups.summaries(&temperatures).unwrap())
        };
        let one = with(1);
        assert_eq!(one, with(2));
        assert_eq!(one, with(7));
        // Another order of additions changes the last bits, so the comparison above can fail.
        let sums = |order: &mut dyn Iterator<Item = usize>| order.map(|i| areas[i]).sum::<f64>();
        assert_ne!(sums(&mut (0..nodes)).to_bits(), sums(&mut (0..nodes).rev()).to_bits());
    }

    #[test]
    fn what_is_not_a_number_shows() {
        let summary = StatisticsGroups::all(vec![1.0; 3]).summaries(&[300.0, f32::NAN, 200.0]).unwrap()[0].unwrap();
        assert!(summary.min.is_nan() && summary.mean.is_nan() && summary.max.is_nan());
    }

    #[test]
    fn lists_that_do_not_fit_are_errors() {
        assert!(StatisticsGroups::new(vec![1.0], vec![0, 0], 1).is_err());
        let error = StatisticsGroups::new(vec![1.0; 2], vec![0, 3], 3).unwrap_err();
        assert_eq!(error.to_string(), "node 1: group 3 of 3");
        assert!(StatisticsGroups::all(vec![1.0; 2]).summaries(&[1.0]).is_err());
    }
}
