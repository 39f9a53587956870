//! Positions and velocities at epochs, and what lies between them: never across a gap, a step or the end of a segment.

use std::fmt;

use glam::DVec3;

/// Position and velocity of a craft, GCRF, from the planet's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position [m].
    pub position: DVec3,
    /// Velocity [m/s].
    pub velocity: DVec3,
}

/// A line of an ephemeris.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time since the start of the scene [s].
    pub time: f64,
    /// Position [m], GCRF.
    pub position: DVec3,
    /// Velocity [m/s], GCRF, where it is stated.
    pub velocity: Option<DVec3>,
}

/// How to get from samples to what lies between.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// A polynomial of this degree through positions.
    Lagrange(usize),
    /// A polynomial of at least this degree through positions and velocities.
    Hermite(usize),
}

/// Degree where a file states none: on the public ISS ephemeris (240 s) Hermite 7 errs by 2 m, as do 5 and 11.
pub const DEFAULT_DEGREE: usize = 7;

/// Highest degree that is followed.
pub const HIGHEST_DEGREE: usize = 31;

/// Spacing over the larger of its neighbours and the segment's median beyond which it is a gap: two epochs are missing.
pub const GAP: f64 = 2.5;

/// Change of velocity between two samples that the Earth's gravity does not explain [m/s], above which (and above
/// [`MANOEUVRE_SHARE`] times the segment's median) something fired between them.
pub const MANOEUVRE: f64 = 0.1;

/// See [`MANOEUVRE`].
pub const MANOEUVRE_SHARE: f64 = 10.0;

/// Samples of one segment of a file, in order, with what it says of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// In order of time; two of the same time are a step (a manoeuvre).
    pub samples: Vec<Sample>,
    /// How to interpolate.
    pub interpolation: Interpolation,
    /// Times between which the segment may be used [s].
    pub usable: (f64, f64),
}

/// A trajectory by its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Ephemeris {
    /// In order of time; they may touch.
    pieces: Vec<Segment>,
}

/// What was made of the samples, in counts that a user should see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Findings {
    /// Samples that said the same as the one before.
    pub repeated: usize,
    /// Epochs with two different states.
    pub steps: usize,
    /// Gaps inside segments.
    pub gaps: usize,
    /// Intervals in which the velocity changed without a sample of the change.
    pub manoeuvres: usize,
}

impl fmt::Display for Findings {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.repeated, "repeated lines left out"),
            (self.steps, "epochs with two states (a step at a manoeuvre)"),
            (self.gaps, "gaps inside segments, which are not bridged"),
            (self.manoeuvres, "intervals with a manoeuvre inside, which only their own two states bridge"),
        ];
        let said: Vec<String> =
            counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        out.write_str(&said.join(", "))
    }
}

impl Ephemeris {
    /// From the segments of a file, whose samples are in order of time.
    pub fn new(segments: Vec<Segment>) -> (Self, Findings) {
        let mut findings = Findings::default();
        let mut pieces = Vec::new();
        for segment in segments {
            split(segment, &mut pieces, &mut findings);
        }
        pieces.sort_by(|a, b| a.usable.0.total_cmp(&b.usable.0));
        (Self { pieces }, findings)
    }

    /// The state at a time [s]; `None` where no piece covers it. At a step, what comes after.
    pub fn state(&self, time: f64) -> Option<State> {
        let after = self.pieces.partition_point(|piece| piece.usable.0 <= time);
        // Pieces hardly overlap; where they do, the later one is meant to take over.
        self.pieces[..after].iter().rev().find(|piece| time <= piece.usable.1).map(|piece| piece.state(time))
    }

    /// Stretches of time that are covered [s], joined where they touch.
    pub fn coverage(&self) -> Vec<(f64, f64)> {
        let mut joined: Vec<(f64, f64)> = Vec::new();
        for piece in &self.pieces {
            match joined.last_mut() {
                Some(last) if piece.usable.0 <= last.1 + JOIN => last.1 = last.1.max(piece.usable.1),
                _ => joined.push(piece.usable),
            }
        }
        joined
    }

    /// Times at which the trajectory may jump or bend [s].
    pub fn seams(&self) -> impl Iterator<Item = f64> + '_ {
        self.pieces.iter().flat_map(|piece| [piece.usable.0, piece.usable.1])
    }
}

/// Difference between two epochs that is rounding [s].
const JOIN: f64 = 1e-6;

/// Cuts a segment at its gaps, steps and manoeuvres.
fn split(segment: Segment, pieces: &mut Vec<Segment>, findings: &mut Findings) {
    let Segment { mut samples, interpolation, usable } = segment;
    let before = samples.len();
    samples.dedup_by(|later, earlier| {
        later.time - earlier.time <= JOIN && same(later.position, earlier.position) && same_velocity(later, earlier)
    });
    findings.repeated += before - samples.len();
    if samples.is_empty() {
        return;
    }
    let spacings: Vec<f64> = samples.windows(2).map(|pair| pair[1].time - pair[0].time).collect();
    let typical = median(spacings.iter().copied().filter(|spacing| *spacing > JOIN));
    let residuals: Vec<Option<f64>> = samples.windows(2).map(|pair| unexplained(&pair[0], &pair[1])).collect();
    let usual = median(residuals.iter().flatten().copied());

    let mut start = 0;
    let mut cut = |start: usize, end: usize, interpolation| {
        let samples = &samples[start..end];
        let (first, last) = (samples[0].time.max(usable.0), samples[samples.len() - 1].time.min(usable.1));
        if first <= last {
            pieces.push(Segment { samples: samples.to_vec(), interpolation, usable: (first, last) });
        }
    };
    for (index, spacing) in spacings.iter().enumerate() {
        let beside = |index: Option<usize>| index.and_then(|index| spacings.get(index)).copied().unwrap_or(0.0);
        let around = beside(index.checked_sub(1)).max(beside(Some(index + 1))).max(typical);
        if *spacing <= JOIN {
            findings.steps += 1;
        } else if *spacing > GAP * around {
            findings.gaps += 1;
        } else if residuals[index].is_some_and(|residual| residual > MANOEUVRE.max(MANOEUVRE_SHARE * usual)) {
            findings.manoeuvres += 1;
            cut(index, index + 2, Interpolation::Hermite(3));
        } else {
            continue;
        }
        cut(start, index + 1, interpolation);
        start = index + 1;
    }
    cut(start, samples.len(), interpolation);
}

fn same(a: DVec3, b: DVec3) -> bool {
    a.distance(b) <= 1e-9 * a.length().max(b.length())
}

fn same_velocity(a: &Sample, b: &Sample) -> bool {
    match (a.velocity, b.velocity) {
        (Some(a), Some(b)) => same(a, b),
        _ => true,
    }
}

/// The upper median; 0 of nothing.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Earth's second zonal coefficient, and its equatorial radius [m] (EGM96).
const J2: f64 = 1.082_626_7e-3;
const EQUATOR: f64 = 6.378_136_3e6;

/// Acceleration of the Earth's gravity with its oblateness [m/s2] (Vallado, eq. 8-30); GCRF stands for the equator.
fn gravity(position: DVec3) -> DVec3 {
    let mu = super::orbit::EARTH_GRAVITATIONAL_PARAMETER;
    let r2 = position.length_squared();
    let central = -mu / (r2 * r2.sqrt());
    let oblate = 1.5 * J2 * EQUATOR * EQUATOR / r2;
    let sin2 = position.z * position.z / r2;
    let (across, along) = (1.0 + oblate * (1.0 - 5.0 * sin2), 1.0 + oblate * (3.0 - 5.0 * sin2));
    central * position * DVec3::new(across, across, along)
}

/// Velocity [m/s] that a coast from one sample to the next does not explain; `None` without velocities, and for spans
/// so long that the coast itself is not known.
fn unexplained(from: &Sample, to: &Sample) -> Option<f64> {
    let (mut velocity, end) = (from.velocity?, to.velocity?);
    let span = to.time - from.time;
    let mut position = from.position;
    let turn = span * velocity.length() / position.length();
    if span <= JOIN || turn > LONGEST_COAST {
        return None;
    }
    let steps = (turn / 0.02).ceil().max(1.0);
    let h = span / steps;
    for _ in 0..steps as usize {
        // Runge and Kutta's method of order 4.
        let (k1, l1) = (velocity, gravity(position));
        let (k2, l2) = (velocity + l1 * (0.5 * h), gravity(position + k1 * (0.5 * h)));
        let (k3, l3) = (velocity + l2 * (0.5 * h), gravity(position + k2 * (0.5 * h)));
        let (k4, l4) = (velocity + l3 * h, gravity(position + k3 * h));
        position += (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (h / 6.0);
        velocity += (l1 + 2.0 * l2 + 2.0 * l3 + l4) * (h / 6.0);
    }
    Some(velocity.distance(end))
}

/// Angle of the orbit over which a coast is compared [rad].
const LONGEST_COAST: f64 = 1.0;

impl Segment {
    fn state(&self, time: f64) -> State {
        let samples = &self.samples;
        let next = samples.partition_point(|sample| sample.time <= time);
        if next > 0 {
            let last = &samples[next - 1];
            if let (true, Some(velocity)) = (last.time == time, last.velocity) {
                return State { position: last.position, velocity };
            }
        }
        let (points, with_velocity) = match self.interpolation {
            Interpolation::Lagrange(degree) => (degree + 1, false),
            Interpolation::Hermite(degree) => (degree.div_ceil(2).max(1) + usize::from(degree % 2 == 0), true),
        };
        let points = points.min(samples.len());
        let first = next.saturating_sub(points.div_ceil(2)).min(samples.len() - points);
        let window = &samples[first..first + points];
        let mut state = polynomial(window, with_velocity, time);
        if next > 0 && samples[next - 1].time == time {
            state.position = samples[next - 1].position;
        }
        state
    }
}

/// Newton's divided differences, with every node twice where the velocity counts; value and slope by Horner's rule.
fn polynomial(window: &[Sample], with_velocity: bool, time: f64) -> State {
    let with_velocity = with_velocity && window.iter().all(|sample| sample.velocity.is_some());
    let middle = window[window.len() / 2].time;
    // Times in units of the window keep the differences within the range of the positions.
    let scale = (window[window.len() - 1].time - window[0].time).max(1.0);
    let mut nodes = [0.0; MOST_NODES];
    let mut differences = [DVec3::ZERO; MOST_NODES];
    let mut slopes = [DVec3::ZERO; MOST_NODES];
    let mut count = 0;
    for sample in window {
        for _ in 0..if with_velocity { 2 } else { 1 } {
            nodes[count] = (sample.time - middle) / scale;
            differences[count] = sample.position;
            slopes[count] = sample.velocity.unwrap_or(DVec3::ZERO) * scale;
            count += 1;
        }
    }
    for order in 1..count {
        for index in (order..count).rev() {
            let span = nodes[index] - nodes[index - order];
            differences[index] =
                if span == 0.0 { slopes[index] } else { (differences[index] - differences[index - 1]) / span };
        }
    }
    let at = (time - middle) / scale;
    let (mut position, mut velocity) = (differences[count - 1], DVec3::ZERO);
    for index in (0..count - 1).rev() {
        velocity = velocity * (at - nodes[index]) + position;
        position = position * (at - nodes[index]) + differences[index];
    }
    // One sample alone has no slope but its own.
    let velocity = if count == 1 { window[0].velocity.unwrap_or(DVec3::ZERO) } else { velocity / scale };
    State { position, velocity }
}

/// Nodes of the highest degree.
const MOST_NODES: usize = HIGHEST_DEGREE + 2;

#[cfg(test)]
mod tests;
