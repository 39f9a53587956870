//! Rotations at epochs, and what lies between them: quaternions on the shorter arc, spinning bodies by their rate.

use glam::{DQuat, DVec3};

use super::ephemeris::SLACK;
use super::spacing::gaps;

/// A rotation at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationSample {
    /// Time since the start of the scene [s].
    pub time: f64,
    /// Rotates body vectors into the history's frame.
    pub frame_from_body: DQuat,
    /// Rate about the body's Z axis until the next sample [rad/s], where the history is that of a spinning body.
    pub spin: Option<f64>,
}

/// The frame that a history turns into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HistoryFrame {
    /// The scene's inertial frame: GCRF, or that of the circular orbit.
    Inertial,
    /// LVLH.
    Orbit,
}

/// An attitude by its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationHistory {
    /// What it came from, for reports.
    pub description: String,
    /// What the samples turn into.
    pub frame: HistoryFrame,
    /// In order of time; nothing is interpolated from one piece to the next.
    pieces: Vec<Vec<RotationSample>>,
}

impl RotationHistory {
    /// From segments whose samples are in order of time; two samples of one time are a jump; [`gaps`] are
    /// not bridged.
    pub fn new(description: String, frame: HistoryFrame, segments: Vec<Vec<RotationSample>>) -> Self {
        let mut pieces = Vec::new();
        for samples in segments {
            let times: Vec<f64> = samples.iter().map(|sample| sample.time).collect();
            let gaps = gaps(&times, 0.0, |_| false);
            let mut start = 0;
            for index in (0..gaps.len()).filter(|index| gaps[*index] || times[*index] == times[index + 1]) {
                pieces.push(samples[start..=index].to_vec());
                start = index + 1;
            }
            pieces.push(samples[start..].to_vec());
        }
        pieces.retain(|piece| !piece.is_empty());
        pieces.sort_by(|a: &Vec<RotationSample>, b| a[0].time.total_cmp(&b[0].time));
        Self { description, frame, pieces }
    }

    /// The rotation of the body into the frame at a time [s]; `None` where no piece covers it, or ends
    /// within [`SLACK`].
    pub fn rotation(&self, time: f64) -> Option<DQuat> {
        let ends = |piece: &[RotationSample]| (piece[0].time, piece[piece.len() - 1].time);
        let after = self.pieces.partition_point(|piece| piece[0].time <= time);
        let covering = self.pieces[..after].iter().rev().find(|piece| time <= ends(piece).1);
        let beside = || {
            let near = |piece: &&Vec<_>| ends(piece).0 - SLACK <= time && time <= ends(piece).1 + SLACK;
            self.pieces[..self.pieces.len().min(after + 1)].iter().rev().find(near)
        };
        let piece = covering.or_else(beside)?;
        let time = time.clamp(ends(piece).0, ends(piece).1);
        let next = piece.partition_point(|sample| sample.time <= time);
        let from = &piece[next - 1];
        let Some(to) = piece.get(next) else {
            return Some(from.frame_from_body);
        };
        let share = (time - from.time) / (to.time - from.time);
        Some(match from.spin {
            None => from.frame_from_body.slerp(to.frame_from_body, share),
            Some(rate) => {
                // What the rate does not explain is spread evenly: the axis wanders and the rate is rounded.
                let turn = |seconds: f64| DQuat::from_axis_angle(DVec3::Z, rate * seconds);
                let explained = from.frame_from_body * turn(to.time - from.time);
                let rest = to.frame_from_body * explained.inverse();
                DQuat::IDENTITY.slerp(rest, share) * from.frame_from_body * turn(time - from.time)
            }
        })
    }

    /// Stretches of time that are covered [s], joined where they touch.
    pub fn coverage(&self) -> Vec<(f64, f64)> {
        let mut joined: Vec<(f64, f64)> = Vec::new();
        for piece in &self.pieces {
            let (start, end) = (piece[0].time, piece[piece.len() - 1].time);
            match joined.last_mut() {
                Some(last) if start <= last.1 + SLACK => last.1 = last.1.max(end),
                _ => joined.push((start, end)),
            }
        }
        joined
    }

    /// Largest angle between neighbouring samples of a history of quaternions [rad]: from pi on its sense is lost.
    pub fn largest_turn(&self) -> f64 {
        let turn = |pair: &[RotationSample]| {
            if pair[0].spin.is_some() { 0.0 } else { pair[0].frame_from_body.angle_between(pair[1].frame_from_body) }
        };
        self.pieces.iter().flat_map(|piece| piece.windows(2).map(turn)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn sample(time: f64, angle: f64, spin: Option<f64>) -> RotationSample {
        RotationSample { time, frame_from_body: DQuat::from_axis_angle(DVec3::Z, angle), spin }
    }

    fn history(samples: Vec<RotationSample>) -> RotationHistory {
        RotationHistory::new(String::new(), HistoryFrame::Inertial, vec![samples])
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
}
