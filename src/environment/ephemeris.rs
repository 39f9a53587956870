//! Ephemeris: positions and velocities at epochs, interpolated within segments but never across a gap, a step or a manoeuvre.

use std::fmt;

use glam::DVec3;

use super::coast::{LONGEST_COAST, Residual, gravity, residual, turn};
use super::divided_differences::{self, hermite_degree};
use super::spacing::gaps;
use super::state::{EphemerisSample, SLACK, StateVector};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// A polynomial of this degree through positions.
    Lagrange(usize),
    /// A polynomial through positions and velocities, whose degree is [`hermite_degree`] of this number.
    Hermite(usize),
    /// The polynomial through two states with gravity as their second derivatives.
    Coast,
}

/// Degree where a file states none. On the public ISS ephemeris (240 s) Hermite 7 errs by 2 m, as do 5 and 11.
pub(crate) const DEFAULT_DEGREE: usize = 7;

/// Change of velocity between two samples that gravity does not explain [m/s]. A change above it, and above the two shares below, is a manoeuvre.
pub(crate) const MANOEUVRE: f64 = 0.1;

/// Least ratio of a manoeuvre's unexplained change to the lower quartile of all intervals. Few intervals of a segment hold a manoeuvre.
pub(crate) const MANOEUVRE_SHARE: f64 = 10.0;

/// Least ratio of a manoeuvre's unexplained change to the change by gravity. The error of the gravity model (2e-5 in low orbit) and drag
/// at a perigee of 180 km (3e-5) stay below it.
pub(crate) const MANOEUVRE_OF_GRAVITY: f64 = 1e-4;

/// Two states of one epoch count as equal where they differ by less [m] [m/s]. Files are rounded, and orbits determined, no better than this.
const SAME_POSITION: f64 = 1.0;
const SAME_VELOCITY: f64 = 0.01;

/// Samples of one segment of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EphemerisSegment {
    /// In order of time. Two samples of one time are a step of the trajectory (a manoeuvre).
    pub(crate) samples: Vec<EphemerisSample>,
    pub(crate) interpolation: Interpolation,
    /// Times between which the segment may be used [s].
    pub(crate) usable: (f64, f64),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ephemeris {
    /// In order of time. Two pieces may touch.
    pieces: Vec<EphemerisSegment>,
}

/// Counts of irregular samples, for the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Findings {
    /// Samples equal to the one before.
    pub(crate) repeated: usize,
    /// Epochs with two different states.
    pub(crate) steps: usize,
    pub(crate) gaps: usize,
    /// Intervals in which a manoeuvre was detected that no sample states.
    pub(crate) manoeuvres: usize,
}

impl fmt::Display for Findings {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.repeated, "lines that repeat an epoch (to 1 m and 0.01 m/s) left out"),
            (self.steps, "epochs with two states (a step at a manoeuvre)"),
            (self.gaps, "gaps inside segments, which are not bridged"),
            (self.manoeuvres, "intervals with a manoeuvre inside, which only their own two states and gravity bridge"),
        ];
        let said: Vec<String> =
            counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        out.write_str(&said.join(", "))
    }
}

impl Ephemeris {
    /// An ephemeris from the segments of a file. The samples of each are in order of time.
    pub(crate) fn new(segments: Vec<EphemerisSegment>) -> (Self, Findings) {
        let mut findings = Findings::default();
        let mut pieces = Vec::new();
        for segment in segments {
            split(segment, &mut pieces, &mut findings);
        }
        pieces.sort_by(|a, b| a.usable.0.total_cmp(&b.usable.0));
        (Self { pieces }, findings)
    }

    /// The state at a time [s]. `None` where no piece covers it to within [`SLACK`]. At a step it is the state after it.
    pub(crate) fn state(&self, time: f64) -> Option<StateVector> {
        let after = self.pieces.partition_point(|piece| piece.usable.0 <= time);
        // Where pieces overlap the later one takes over.
        let covering = self.pieces[..after].iter().rev().find(|piece| time <= piece.usable.1);
        let beside = || {
            let near = |piece: &&EphemerisSegment| piece.usable.0 - SLACK <= time && time <= piece.usable.1 + SLACK;
            self.pieces[..self.pieces.len().min(after + 1)].iter().rev().find(near)
        };
        covering.or_else(beside).map(|piece| piece.state(time.clamp(piece.usable.0, piece.usable.1)))
    }

    /// Intervals of time that are covered [s]. Intervals that touch are joined.
    pub(crate) fn coverage(&self) -> Vec<(f64, f64)> {
        let mut joined: Vec<(f64, f64)> = Vec::new();
        for piece in &self.pieces {
            match joined.last_mut() {
                Some(last) if piece.usable.0 <= last.1 + SLACK => last.1 = last.1.max(piece.usable.1),
                _ => joined.push(piece.usable),
            }
        }
        joined
    }

    /// Times at which the trajectory may jump or bend [s].
    pub(crate) fn seams(&self) -> impl Iterator<Item = f64> + '_ {
        self.pieces.iter().flat_map(|piece| [piece.usable.0, piece.usable.1])
    }
}

/// Cuts a segment at its gaps, steps and manoeuvres.
fn split(segment: EphemerisSegment, pieces: &mut Vec<EphemerisSegment>, findings: &mut Findings) {
    let EphemerisSegment { mut samples, interpolation, usable } = segment;
    let before = samples.len();
    samples.dedup_by(|later, earlier| later.time - earlier.time <= SLACK && same(later, earlier));
    findings.repeated += before - samples.len();
    if samples.is_empty() {
        return;
    }
    let times: Vec<f64> = samples.iter().map(|sample| sample.time).collect();
    let gaps = gaps(&times, SLACK, |index| turn(&samples[index], &samples[index + 1]) > LONGEST_COAST);
    let residuals: Vec<Option<Residual>> = samples.windows(2).map(|pair| residual(&pair[0], &pair[1])).collect();
    let usual = lower_quartile(residuals.iter().flatten().map(|residual| residual.unexplained));
    let fired = |Residual { unexplained, falling }: Residual| {
        unexplained > MANOEUVRE.max(MANOEUVRE_SHARE * usual).max(MANOEUVRE_OF_GRAVITY * falling)
    };

    let mut start = 0;
    let mut cut = |start: usize, end: usize, interpolation| {
        let samples = &samples[start..end];
        let interpolation = match interpolation {
            // A coast takes the place of the neighbours that the degree would need.
            Interpolation::Hermite(5..) if samples.len() == 2 => Interpolation::Coast,
            other => other,
        };
        let (first, last) = (samples[0].time.max(usable.0), samples[samples.len() - 1].time.min(usable.1));
        if first <= last {
            pieces.push(EphemerisSegment { samples: samples.to_vec(), interpolation, usable: (first, last) });
        }
    };
    for index in 0..gaps.len() {
        if times[index + 1] - times[index] <= SLACK {
            findings.steps += 1;
        } else if gaps[index] {
            findings.gaps += 1;
        } else if residuals[index].is_some_and(fired) {
            findings.manoeuvres += 1;
            cut(index, index + 2, Interpolation::Coast);
        } else {
            continue;
        }
        cut(start, index + 1, interpolation);
        start = index + 1;
    }
    cut(start, samples.len(), interpolation);
}

fn same(a: &EphemerisSample, b: &EphemerisSample) -> bool {
    let velocities = match (a.velocity, b.velocity) {
        (Some(a), Some(b)) => a.distance(b) <= SAME_VELOCITY,
        _ => true,
    };
    velocities && a.position.distance(b.position) <= SAME_POSITION
}

/// The lower quartile. Of fewer than five values it is the least, of none it is 0.
fn lower_quartile(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 4).copied().unwrap_or(0.0)
}

impl EphemerisSegment {
    fn state(&self, time: f64) -> StateVector {
        let samples = &self.samples;
        let next = samples.partition_point(|sample| sample.time <= time);
        if next > 0 {
            let last = &samples[next - 1];
            if let (true, Some(velocity)) = (last.time == time, last.velocity) {
                return StateVector { position: last.position, velocity };
            }
        }
        let (points, each) = match self.interpolation {
            Interpolation::Lagrange(degree) => (degree + 1, 1),
            Interpolation::Hermite(degree) => (hermite_degree(degree).div_ceil(2), 2),
            Interpolation::Coast => (2, 3),
        };
        let mut state = polynomial(&samples[divided_differences::window(samples.len(), next, points)], each, time);
        if next > 0 && samples[next - 1].time == time {
            state.position = samples[next - 1].position;
        }
        state
    }
}

/// The polynomial through samples. `each` is 1 for positions, 2 for velocities as well, 3 for gravity as the acceleration.
fn polynomial(samples: &[EphemerisSample], each: usize, time: f64) -> StateVector {
    let each = if samples.iter().all(|sample| sample.velocity.is_some()) { each } else { 1 };
    if let [EphemerisSample { position, velocity, .. }] = samples {
        // A single sample gives only its own slope.
        return StateVector { position: *position, velocity: velocity.unwrap_or(DVec3::ZERO) };
    }
    let conditions = |sample: &EphemerisSample| {
        let bend = if each == 3 { gravity(sample.position) } else { DVec3::ZERO };
        (sample.time, [sample.position, sample.velocity.unwrap_or(DVec3::ZERO), bend])
    };
    let samples: Vec<(f64, [DVec3; 3])> = samples.iter().map(conditions).collect();
    let (position, velocity) = divided_differences::polynomial(&samples, each, time);
    StateVector { position, velocity }
}

#[cfg(test)]
mod tests;
