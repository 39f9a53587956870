//! Detects gaps in a series of epochs: spacings too long for the sampling around them.

/// A spacing is long above this ratio to the usual one. Two epochs are then missing.
pub(crate) const GAP: f64 = 2.5;

/// Number of similar long spacings in a row that count as coarser sampling. Fewer are single epochs between gaps.
pub(crate) const COARSE: usize = 4;

/// For each spacing of `times` (which do not decrease), whether it is a gap. Spacings of at most `same` are not. A run of [`COARSE`] similar spacings is
/// not a gap either, except spacings that are `too_far` to bridge.
pub(crate) fn gaps(times: &[f64], same: f64, too_far: impl Fn(usize) -> bool) -> Vec<bool> {
    let spacings: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let typical = median(&spacings, same);
    let is_long: Vec<bool> = spacings.iter().map(|spacing| *spacing > GAP * typical).collect();
    let mut gaps = vec![false; spacings.len()];
    let mut end = 0;
    for run in is_long.chunk_by(|a, b| a == b) {
        let start = end;
        end += run.len();
        if !run[0] {
            continue;
        }
        for index in start..end {
            let beside = |index: Option<usize>| index.filter(|index| (start..end).contains(index)).map(|i| spacings[i]);
            let around = beside(index.checked_sub(1)).into_iter().chain(beside(Some(index + 1))).fold(0.0, f64::max);
            gaps[index] = run.len() < COARSE || spacings[index] > GAP * around || too_far(index);
        }
    }
    gaps
}

/// The upper median of the spacings above `same`. 0 where there are none.
fn median(spacings: &[f64], same: f64) -> f64 {
    let mut sorted: Vec<f64> = spacings.iter().copied().filter(|spacing| *spacing > same).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gaps found in a series given by its spacings.
    fn found(spacings: &[f64]) -> Vec<usize> {
        let mut times = vec![0.0];
        for spacing in spacings {
            times.push(times[times.len() - 1] + spacing);
        }
        let gaps = gaps(&times, 0.0, |index| spacings[index] > 5000.0);
        (0..gaps.len()).filter(|index| gaps[*index]).collect()
    }

    fn dense(long: &[f64]) -> Vec<f64> {
        [&[60.0; 20], long, &[60.0; 20]].concat()
    }

    #[test]
    fn lone_epochs_between_gaps_hide_none() {
        assert_eq!(found(&dense(&[3000.0])), [20]);
        assert_eq!(found(&dense(&[3000.0, 3000.0])), [20, 21]);
        assert_eq!(found(&dense(&[600.0, 3000.0])), [20, 21]);
        assert_eq!(found(&dense(&[3000.0, 2000.0, 3000.0])), [20, 21, 22]);
        assert_eq!(found(&dense(&[3000.0, 60.0, 3000.0])), [20, 22]);
    }

    #[test]
    fn a_coarser_stretch_and_one_missing_epoch_are_no_gaps() {
        assert!(found(&dense(&[120.0])).is_empty());
        assert!(found(&dense(&[600.0; 6])).is_empty());
        assert!(found(&dense(&[200.0, 400.0, 800.0, 1600.0, 800.0, 400.0, 200.0])).is_empty());
        assert_eq!(found(&dense(&[600.0, 600.0, 6000.0, 600.0, 600.0])), [22]);
        assert_eq!(found(&dense(&[5500.0; 6])), [20, 21, 22, 23, 24, 25]);
        assert!(found(&[6000.0; 5]).is_empty() && found(&[]).is_empty());
    }
}
