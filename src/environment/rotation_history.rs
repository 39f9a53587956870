//! Attitude history: rotations at epochs, interpolated on the shorter arc, by a polynomial, or by the rate of a spinning body.

use glam::{DQuat, DVec3, DVec4};

use super::divided_differences::{self, hermite_degree};
use super::spacing::gaps;
use super::state::SLACK;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RotationSample {
    /// Time since the start of the scene [s].
    pub(crate) time: f64,
    /// Rotates body vectors into the history's frame.
    pub(crate) frame_from_body: DQuat,
    /// Derivative of its components by time [1/s], where it is stated.
    pub(crate) derivative: Option<DQuat>,
    /// Rate about the body's Z axis until the next sample [rad/s], in the history of a spinning body.
    pub(crate) spin: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HistoryFrame {
    /// The scene's inertial frame: GCRF, or the frame of the circular orbit.
    Inertial,
    Orbit,
}

/// Interpolation between samples. Samples with a spin rate follow that rate instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RotationInterpolation {
    /// The shorter arc between two samples, at a constant rate (SLERP).
    Arc,
    /// A polynomial of this degree through the components of the quaternions. The result is normalised.
    Lagrange(usize),
    /// A polynomial through quaternions and their derivatives, whose degree is [`hermite_degree`] of this number. The result is normalised.
    Hermite(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RotationSegment {
    /// In order of time. Two samples of one time are a jump.
    pub(crate) samples: Vec<RotationSample>,
    pub(crate) interpolation: RotationInterpolation,
    /// Times between which the segment may be used [s].
    pub(crate) usable: (f64, f64),
}

/// An attitude given by samples.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationHistory {
    /// Source, for reports.
    pub(crate) description: String,
    pub(crate) frame: HistoryFrame,
    /// In order of time. Nothing is interpolated between pieces.
    pieces: Vec<RotationSegment>,
}

impl RotationHistory {
    /// A history of segments whose samples are in order of time. Two samples of one time are a jump. [`gaps`] are not bridged.
    pub(crate) fn new(description: String, frame: HistoryFrame, segments: Vec<RotationSegment>) -> Self {
        let mut pieces = Vec::new();
        for RotationSegment { samples, interpolation, usable } in segments {
            let times: Vec<f64> = samples.iter().map(|sample| sample.time).collect();
            let gaps = gaps(&times, 0.0, |_| false);
            let ends = (0..gaps.len()).filter(|index| gaps[*index] || times[*index] == times[index + 1]);
            let mut start = 0;
            for end in ends.map(|index| index + 1).chain([samples.len()]) {
                let samples = with_one_sign(&samples[start..end]);
                start = end;
                let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
                    continue;
                };
                let usable = (first.time.max(usable.0), last.time.min(usable.1));
                if usable.0 <= usable.1 {
                    pieces.push(RotationSegment { samples, interpolation, usable });
                }
            }
        }
        pieces.sort_by(|a: &RotationSegment, b| a.usable.0.total_cmp(&b.usable.0));
        Self { description, frame, pieces }
    }

    /// Rotation of the body into the frame at a time [s]. `None` where no piece covers it to within [`SLACK`].
    pub(crate) fn rotation(&self, time: f64) -> Option<DQuat> {
        let after = self.pieces.partition_point(|piece| piece.usable.0 <= time);
        let covering = self.pieces[..after].iter().rev().find(|piece| time <= piece.usable.1);
        let beside = || {
            let near = |piece: &&RotationSegment| piece.usable.0 - SLACK <= time && time <= piece.usable.1 + SLACK;
            self.pieces[..self.pieces.len().min(after + 1)].iter().rev().find(near)
        };
        let piece = covering.or_else(beside)?;
        Some(piece.rotation(time.clamp(piece.usable.0, piece.usable.1)))
    }

    /// Intervals of time that are covered [s]. Intervals that touch are joined.
    pub(crate) fn coverage(&self) -> Vec<(f64, f64)> {
        let mut joined: Vec<(f64, f64)> = Vec::new();
        for piece in &self.pieces {
            let (start, end) = piece.usable;
            match joined.last_mut() {
                Some(last) if start <= last.1 + SLACK => last.1 = last.1.max(end),
                _ => joined.push((start, end)),
            }
        }
        joined
    }

    /// Largest angle between neighbouring quaternions [rad]. From pi on the direction of the turn is unknown.
    pub(crate) fn largest_turn(&self) -> f64 {
        let turn = |pair: &[RotationSample]| {
            if pair[0].spin.is_some() { 0.0 } else { pair[0].frame_from_body.angle_between(pair[1].frame_from_body) }
        };
        self.pieces.iter().flat_map(|piece| piece.samples.windows(2).map(turn)).fold(0.0, f64::max)
    }
}

/// Gives quaternions consistent signs. q and -q are the same rotation, so each sample takes the one nearer to the sample before.
fn with_one_sign(samples: &[RotationSample]) -> Vec<RotationSample> {
    let mut signed: Vec<RotationSample> = Vec::with_capacity(samples.len());
    for sample in samples {
        let mut sample = *sample;
        if signed.last().is_some_and(|last| last.frame_from_body.dot(sample.frame_from_body) < 0.0) {
            sample.frame_from_body = -sample.frame_from_body;
            sample.derivative = sample.derivative.map(|derivative| -derivative);
        }
        signed.push(sample);
    }
    signed
}

impl RotationSegment {
    /// The rotation at a time between the first sample and the last.
    fn rotation(&self, time: f64) -> DQuat {
        let samples = &self.samples;
        let next = samples.partition_point(|sample| sample.time <= time);
        let from = &samples[next.saturating_sub(1)];
        let Some(to) = samples.get(next).filter(|_| from.time < time) else {
            return from.frame_from_body;
        };
        let share = (time - from.time) / (to.time - from.time);
        if let Some(rate) = from.spin {
            // The rest of the rotation, which the rate does not explain, is spread evenly: the axis wanders and the rate is rounded.
            let turn = |seconds: f64| DQuat::from_axis_angle(DVec3::Z, rate * seconds);
            let explained = from.frame_from_body * turn(to.time - from.time);
            let rest = to.frame_from_body * explained.inverse();
            return DQuat::IDENTITY.slerp(rest, share) * from.frame_from_body * turn(time - from.time);
        }
        let (points, each) = match self.interpolation {
            RotationInterpolation::Arc => (2, 1),
            RotationInterpolation::Lagrange(degree) => (degree + 1, 1),
            RotationInterpolation::Hermite(degree) => (hermite_degree(degree).div_ceil(2), 2),
        };
        let window = &samples[divided_differences::window(samples.len(), next, points)];
        if window.len() == 2 && each == 1 {
            // A straight line between two quaternions turns unevenly, so the arc is used.
            return from.frame_from_body.slerp(to.frame_from_body, share);
        }
        let conditions = |sample: &RotationSample| {
            let slope = sample.derivative.map_or(DVec4::ZERO, DVec4::from);
            (sample.time, [DVec4::from(sample.frame_from_body), slope, DVec4::ZERO])
        };
        let conditions: Vec<(f64, [DVec4; 3])> = window.iter().map(conditions).collect();
        DQuat::from_vec4(divided_differences::polynomial(&conditions, each, time).0).normalize()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn sample(time: f64, angle: f64, spin: Option<f64>) -> RotationSample {
        RotationSample { time, frame_from_body: DQuat::from_axis_angle(DVec3::Z, angle), derivative: None, spin }
    }

    fn segment(samples: Vec<RotationSample>, interpolation: RotationInterpolation) -> RotationSegment {
        RotationSegment { samples, interpolation, usable: (f64::NEG_INFINITY, f64::INFINITY) }
    }

    fn history(samples: Vec<RotationSample>) -> RotationHistory {
        let segment = segment(samples, RotationInterpolation::Arc);
        RotationHistory::new(String::new(), HistoryFrame::Inertial, vec![segment])
    }

    fn angle(history: &RotationHistory, time: f64) -> f64 {
        let x = history.rotation(time).unwrap() * DVec3::X;
        x.y.atan2(x.x).rem_euclid(TAU)
    }

    #[test]
    fn a_steady_turn_is_exact_between_its_samples_whatever_the_sign_of_quaternions() {
        let mut samples: Vec<_> = (0..10).map(|i| sample(f64::from(i) * 10.0, f64::from(i) * 0.3, None)).collect();
        samples[4].frame_from_body = -samples[4].frame_from_body;
        let history = history(samples);
        for time in [0.0, 3.0, 35.0, 41.7, 90.0] {
            assert!((angle(&history, time) - 0.03 * time).abs() < 1e-12, "{time}");
        }
        assert_eq!(history.rotation(90.1), None);
        assert_eq!(history.rotation(-0.1), None);
    }

    #[test]
    fn a_spinning_body_turns_many_times_between_its_samples() {
        let rate = 1.0;
        let history = history(vec![sample(0.0, 0.0, Some(rate)), sample(100.0, 100.0, Some(rate))]);
        for time in [0.5, 33.3, 99.0] {
            assert!((angle(&history, time) - time.rem_euclid(TAU)).abs() < 1e-9, "{time}");
        }
    }

    /// 3 steps of 0.1 s end at 0.30000000000000004 s.
    #[test]
    fn rounding_of_a_time_does_not_leave_the_table() {
        let history = history((0..4).map(|i| sample(f64::from(i) / 10.0, f64::from(i), None)).collect());
        assert!((angle(&history, 3.0 * 0.1) - 3.0).abs() < 1e-12 && angle(&history, -1e-9) < 1e-12);
        assert_eq!(history.rotation(0.3001), None);
    }

    #[test]
    fn a_lone_sample_does_not_join_two_gaps() {
        let times = [0.0, 1.0, 2.0, 3.0, 50.0, 100.0, 101.0, 102.0, 103.0];
        let history = history(times.iter().map(|time| sample(*time, 0.0, None)).collect());
        assert_eq!(history.coverage(), [(0.0, 3.0), (50.0, 50.0), (100.0, 103.0)]);
    }

    #[test]
    fn jumps_and_gaps_are_not_crossed() {
        let samples = vec![
            sample(0.0, 0.0, None),
            sample(10.0, 0.1, None),
            sample(10.0, 1.0, None),
            sample(20.0, 1.1, None),
            sample(30.0, 1.2, None),
            sample(300.0, 0.0, None),
            sample(310.0, 0.1, None),
        ];
        let history = history(samples);
        assert!(angle(&history, 9.999) < 0.1 && (angle(&history, 10.0) - 1.0).abs() < 1e-12);
        assert_eq!(history.rotation(100.0), None);
        assert_eq!(history.coverage(), [(0.0, 30.0), (300.0, 310.0)]);
    }

    /// A constant turn about Z, then a turn about X at an oscillating rate, with the derivative.
    fn swinging(time: f64) -> RotationSample {
        let swing = DQuat::from_rotation_x(0.4 * time.sin());
        let swing_rate = DQuat::from_xyzw(0.2 * time.cos(), 0.0, 0.0, 0.0) * swing;
        let (turn, turn_rate) = (DQuat::from_rotation_z(0.3 * time), DQuat::from_xyzw(0.0, 0.0, 0.15, 0.0));
        RotationSample {
            time,
            frame_from_body: turn * swing,
            derivative: Some(turn_rate * turn * swing + turn * swing_rate),
            spin: None,
        }
    }

    /// The greatest error [rad] with samples `step` apart. Every other sample has the opposite sign.
    fn worst_error(interpolation: RotationInterpolation, step: f64) -> f64 {
        let count = (8.0 / step).round() as usize;
        let sample = |index: usize| {
            let sample = swinging(index as f64 * step);
            let sign = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            RotationSample {
                frame_from_body: sample.frame_from_body * sign,
                derivative: sample.derivative.map(|derivative| derivative * sign),
                ..sample
            }
        };
        let segments = vec![segment((0..=count).map(sample).collect(), interpolation)];
        let history = RotationHistory::new(String::new(), HistoryFrame::Inertial, segments);
        // Only the middle third, away from one-sided windows.
        (0..100).map(|i| 3.0 + 0.02 * f64::from(i)).fold(0.0, |worst, time| {
            let apart = history.rotation(time).unwrap().inverse() * swinging(time).frame_from_body;
            f64::max(worst, 2.0 * apart.xyz().length())
        })
    }

    #[test]
    fn polynomials_converge_with_their_degree() {
        for (interpolation, order) in [
            (RotationInterpolation::Arc, 2.0),
            (RotationInterpolation::Lagrange(1), 2.0),
            (RotationInterpolation::Lagrange(3), 4.0),
            (RotationInterpolation::Lagrange(5), 6.0),
            (RotationInterpolation::Hermite(3), 4.0),
            (RotationInterpolation::Hermite(5), 6.0),
        ] {
            let (coarse, fine) = (worst_error(interpolation, 0.2), worst_error(interpolation, 0.1));
            let computed = (coarse / fine).log2();
            assert!((computed - order).abs() < 0.4, "{interpolation:?}: order {computed:.2}, {fine:.1e} rad");
        }
        assert!(worst_error(RotationInterpolation::Hermite(7), 0.2) < 1e-8);
        assert!(worst_error(RotationInterpolation::Arc, 0.2) > 1e-3, "the arc alone must show");
    }

    #[test]
    fn samples_beyond_the_usable_times_serve_as_neighbours_only() {
        let samples: Vec<_> = (0..=20).map(|index| swinging(0.2 * f64::from(index))).collect();
        let whole = segment(samples, RotationInterpolation::Lagrange(5));
        let part = RotationSegment { usable: (1.05, 2.0), ..whole.clone() };
        let of = |segment| RotationHistory::new(String::new(), HistoryFrame::Inertial, vec![segment]);
        let (whole, part) = (of(whole), of(part));
        assert_eq!(part.coverage(), [(1.05, 2.0)]);
        assert_eq!(part.rotation(1.05), whole.rotation(1.05));
        assert_eq!((part.rotation(1.0), part.rotation(2.1)), (None, None));
    }
}
