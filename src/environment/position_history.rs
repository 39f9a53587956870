//! Positions at times, interpolated by cubics. Parabolas through neighbouring positions give the slopes.

use glam::DVec3;

use super::divided_differences;
use super::spacing::gaps;
use super::state::SLACK;

/// Positions given by samples, in pieces between gaps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PositionHistory {
    /// In order of time. Nothing is interpolated between pieces.
    pieces: Vec<Vec<PositionSample>>,
}

/// Time [s], position [m] and slope [m/s].
type PositionSample = (f64, [DVec3; 3]);

impl PositionHistory {
    /// A history of times [s], which increase, and positions [m]. [`gaps`] are not bridged.
    pub(crate) fn new(samples: &[(f64, DVec3)]) -> Self {
        let times: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
        let gaps = gaps(&times, 0.0, |_| false);
        let ends = (0..gaps.len()).filter(|index| gaps[*index]).map(|index| index + 1).chain([samples.len()]);
        let mut start = 0;
        let mut pieces = Vec::new();
        for end in ends {
            pieces.push(with_slopes(&samples[start..end]));
            start = end;
        }
        pieces.retain(|piece| !piece.is_empty());
        Self { pieces }
    }

    /// Position at a time [s]. `None` where no piece covers it to within [`SLACK`].
    pub(crate) fn position(&self, time: f64) -> Option<DVec3> {
        let covers =
            |piece: &&Vec<PositionSample>| piece[0].0 - SLACK <= time && time <= piece[piece.len() - 1].0 + SLACK;
        let piece = self.pieces.iter().find(covers)?;
        let time = time.clamp(piece[0].0, piece[piece.len() - 1].0);
        let next = piece.partition_point(|(at, _)| *at <= time).clamp(1, piece.len().max(2) - 1);
        match piece.get(next - 1..=next) {
            Some(two) => Some(divided_differences::polynomial(two, 2, time).0),
            None => Some(piece[0].1[0]),
        }
    }

    /// Intervals of time that are covered [s].
    pub(crate) fn coverage(&self) -> Vec<(f64, f64)> {
        self.pieces.iter().map(|piece| (piece[0].0, piece[piece.len() - 1].0)).collect()
    }
}

/// Samples with the slope of the parabola through each and its neighbours. At an end it is the parabola through the last three.
fn with_slopes(samples: &[(f64, DVec3)]) -> Vec<PositionSample> {
    let slope = |index: usize| {
        if samples.len() < 2 {
            return DVec3::ZERO;
        }
        let first = index.saturating_sub(1).min(samples.len().saturating_sub(3));
        let near = &samples[first..samples.len().min(first + 3)];
        let near: Vec<PositionSample> =
            near.iter().map(|(time, at)| (*time, [*at, DVec3::ZERO, DVec3::ZERO])).collect();
        divided_differences::polynomial(&near, 1, samples[index].0).1
    };
    let sample = |(index, (time, position)): (usize, &(f64, DVec3))| (*time, [*position, slope(index), DVec3::ZERO]);
    samples.iter().enumerate().map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(times: &[f64], position: impl Fn(f64) -> DVec3) -> PositionHistory {
        PositionHistory::new(&times.iter().map(|time| (*time, position(*time))).collect::<Vec<_>>())
    }

    #[test]
    fn parabolas_come_back_exactly_from_uneven_samples() {
        let curve = |t: f64| DVec3::new(3.0 - 2.0 * t, 0.5 * t * t, 1.0 + t - 0.25 * t * t);
        let bent = |t: f64| curve(t) + DVec3::X * 0.01 * t.powi(3);
        let times = [0.0, 1.0, 2.5, 3.0, 5.0, 6.0];
        for step in 0..=60 {
            let time = f64::from(step) * 0.1;
            let computed = |of: &PositionHistory| of.position(time).expect("covered");
            assert!(computed(&history(&times, curve)).distance(curve(time)) < 1e-12, "{time}");
            let off = computed(&history(&times, bent)).distance(bent(time));
            assert!(off < 0.05, "{time}: {off}");
        }
        let middle = history(&times, bent).position(4.0).expect("covered");
        assert!(middle.distance(bent(4.0)) > 1e-4, "a cubic is not a parabola");
    }

    /// The error of a smooth curve falls with the third power of the spacing or faster.
    #[test]
    fn a_circle_is_followed_to_third_order() {
        let circle = |t: f64| DVec3::new(t.cos(), t.sin(), 0.0) * 100.0;
        let worst = |count: u32| {
            let times: Vec<f64> = (0..=count).map(|i| 6.0 * f64::from(i) / f64::from(count)).collect();
            let history = history(&times, circle);
            let off = |i: u32| {
                let time = 1.0 + 4.0 * f64::from(i) / 1000.0;
                history.position(time).expect("covered").distance(circle(time))
            };
            (0..=1000).map(off).fold(0.0, f64::max)
        };
        let (coarse, fine) = (worst(30), worst(60));
        assert!(coarse < 0.1 && fine < coarse / 7.5, "{coarse} {fine}");
    }

    #[test]
    fn velocity_does_not_jump_at_a_sample() {
        let history = history(&[0.0, 1.0, 2.0, 3.0], |t| DVec3::X * t.powi(3));
        let at = |t: f64| history.position(t).expect("covered").x;
        let (before, after) = ((at(2.0) - at(2.0 - 1e-5)) / 1e-5, (at(2.0 + 1e-5) - at(2.0)) / 1e-5);
        assert!((before - after).abs() < 1e-3, "{before} {after}");
    }

    #[test]
    fn ends_gaps_and_few_samples() {
        let times = [0.0, 1.0, 2.0, 3.0, 50.0, 51.0, 52.0, 53.0];
        let line = history(&times, |t| DVec3::X * t);
        assert_eq!(line.coverage(), [(0.0, 3.0), (50.0, 53.0)]);
        for (time, there) in
            [(-0.1, false), (0.0, true), (3.0 + 1e-9, true), (20.0, false), (53.0, true), (53.1, false)]
        {
            assert_eq!(line.position(time).is_some(), there, "{time}");
        }
        assert_eq!(history(&[4.0], |_| DVec3::Y).position(4.0), Some(DVec3::Y));
        assert_eq!(history(&[4.0, 6.0], |t| DVec3::Y * t).position(4.5), Some(DVec3::Y * 4.5));
        assert_eq!(PositionHistory::new(&[]).position(0.0), None);
    }
}
