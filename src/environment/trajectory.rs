//! A real trajectory: positions of craft and Sun in GCRF at scene times.

use std::f64::consts::TAU;
use std::fmt;
use std::ops::RangeInclusive;

use glam::DVec3;
use hifitime::{Epoch, TimeScale, Unit};

use super::ephemeris::Ephemeris;
use super::frames::{gcrf_from_teme, tt_centuries};
use super::orbit::EARTH_GRAVITATIONAL_PARAMETER;
use super::state::{SLACK, StateVector};
use super::sun::sun_position;
use super::utc::utc;

const CENTURY: f64 = 36_525.0 * 86_400.0;
/// Plausible distances from the Earth's centre [m], of positions that are read and of those that are computed. Beyond the Sun-Earth Lagrange points the
/// units are probably wrong.
pub(crate) const DISTANCES: RangeInclusive<f64> = 1e5..=2e9;
/// Greatest age of elements [s]. Ten years later they say nothing of a craft's place.
const OLDEST: f64 = 10.0 * 365.25 * 86_400.0;
/// How much farther than its apogee, or nearer than its perigee, SGP4 may place a craft. Drag and the Moon change both by less before the orbit is another.
const OTHER_ORBIT: f64 = 1.25;

/// A trajectory around the Earth.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Source, for reports.
    pub(crate) description: String,
    start: Epoch,
    /// Time 0 of the scene in centuries of TT since J2000.
    start_centuries: f64,
    source: TrajectorySource,
    /// Period of the osculating orbit at time 0 [s].
    period: f64,
}

/// Source of the craft's positions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TrajectorySource {
    /// A two-line element set.
    Elements {
        constants: Box<sgp4::Constants>,
        /// Epoch of the elements less the start of the scene [s].
        epoch: f64,
        /// Distances of perigee and apogee from the Earth's centre [m].
        reach: [f64; 2],
    },
    Ephemeris(Ephemeris),
}

/// An error of a trajectory.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// A time before its beginning, after its end or in a gap.
    #[error(
        "the trajectory is needed from {from} to {to}{}, but {what}",
        if *warm_up { " (the warm-up comes before time.start)" } else { "" }
    )]
    Uncovered {
        /// First time that is needed, UTC.
        from: String,
        /// Last time that is needed, UTC.
        to: String,
        /// Whether the first time lies before time 0.
        warm_up: bool,
        /// Covered time.
        what: String,
    },
    /// A time at which SGP4 fails.
    #[error("SGP4 gives no position at {time}: {reason}")]
    Propagation {
        /// Time, UTC.
        time: String,
        /// Message of the propagator.
        reason: String,
    },
    /// A time years from the epoch of the elements.
    #[error(
        "the elements are {years:.0} years from {time}: after ten years they say nothing of a craft's place; take elements of that time"
    )]
    Aged {
        /// Time, UTC.
        time: String,
        /// Time since the epoch of the elements [years of 365.25 days].
        years: f64,
    },
    /// A computed position that no craft on this trajectory has.
    #[error(
        "at {time} the computed position is {distance:.3e} km from the Earth's centre, and this trajectory lies from {nearest:.3e} to {farthest:.3e} km: \
         the data do not hold at that time"
    )]
    Astray {
        /// Time, UTC.
        time: String,
        /// Distance from the centre [km].
        distance: f64,
        /// Least plausible distance [km].
        nearest: f64,
        /// Greatest plausible distance [km].
        farthest: f64,
    },
    /// A position inside the planet.
    #[error("at {time} the craft is {distance:.0} km from the centre of a planet of {radius:.0} km{cause}")]
    Underground {
        /// Time, UTC.
        time: String,
        /// Distance from the centre [km].
        distance: f64,
        /// Planet radius [km].
        radius: f64,
        /// A probable cause, with leading punctuation. May be empty.
        cause: String,
    },
}

impl Trajectory {
    /// A trajectory from a source of positions, with times since `start`.
    ///
    /// # Errors
    /// There is no state at time 0.
    pub(crate) fn new(description: String, start: Epoch, source: TrajectorySource) -> Result<Self, TrajectoryError> {
        let mut trajectory = Self::elsewhere(description, start, source);
        trajectory.check(0.0, 0.0)?;
        if let Some(StateVector { position, velocity }) = trajectory.state(0.0) {
            // The vis-viva equation. An open orbit has no period.
            let inverse = 2.0 / position.length() - velocity.length_squared() / EARTH_GRAVITATIONAL_PARAMETER;
            if inverse > 0.0 {
                trajectory.period = TAU / (EARTH_GRAVITATIONAL_PARAMETER * inverse.powi(3)).sqrt();
            }
        }
        Ok(trajectory)
    }

    /// A trajectory without a period, which need not cover time 0.
    pub(crate) fn elsewhere(description: String, start: Epoch, source: TrajectorySource) -> Self {
        // Seconds are added to this epoch. TAI has no leap seconds.
        let start = start.to_time_scale(TimeScale::TAI);
        Self { description, start, start_centuries: tt_centuries(start), source, period: f64::INFINITY }
    }

    /// Time from the epoch of elements to a time of the scene [s]. `None` where it has none.
    pub(crate) fn age_of_elements(&self, time: f64) -> Option<f64> {
        match &self.source {
            TrajectorySource::Elements { epoch, .. } => Some(time - epoch),
            _ => None,
        }
    }

    /// Intervals of time that an ephemeris covers [s]. `None` for elements.
    pub(crate) fn coverage(&self) -> Option<Vec<(f64, f64)>> {
        match &self.source {
            TrajectorySource::Elements { .. } => None,
            TrajectorySource::Ephemeris(ephemeris) => Some(ephemeris.coverage()),
        }
    }

    /// Time 0 of the scene.
    pub(crate) fn start(&self) -> Epoch {
        self.start
    }

    /// Period of the osculating orbit at time 0 [s]. Infinite for an open orbit.
    pub(crate) fn period(&self) -> f64 {
        self.period
    }

    pub(crate) fn epoch(&self, time: f64) -> Epoch {
        self.start + Unit::Second * time
    }

    /// UTC of a scene time, to the millisecond: `2023-10-29T17:03:44.412Z`.
    pub(crate) fn utc(&self, time: f64) -> String {
        utc(self.epoch(time))
    }

    /// State of the craft at a time [s]. `None` where the trajectory does not cover it.
    pub fn state(&self, time: f64) -> Option<StateVector> {
        match &self.source {
            TrajectorySource::Elements { constants, epoch, .. } => {
                let minutes = sgp4::MinutesSinceEpoch((time - epoch) / 60.0);
                let prediction = constants.propagate(minutes).ok()?;
                let rotation = gcrf_from_teme(self.centuries(time));
                let metres = |vector: [f64; 3]| rotation * (DVec3::from_array(vector) * 1e3);
                Some(StateVector { position: metres(prediction.position), velocity: metres(prediction.velocity) })
            }
            TrajectorySource::Ephemeris(ephemeris) => ephemeris.state(time),
        }
    }

    /// Position of the Sun from the planet's centre [m].
    pub(crate) fn sun(&self, time: f64) -> DVec3 {
        sun_position(self.centuries(time))
    }

    fn centuries(&self, time: f64) -> f64 {
        self.start_centuries + time / CENTURY
    }

    /// Times at which the trajectory may have a jump or a kink [s].
    pub(crate) fn seams(&self) -> Vec<f64> {
        match &self.source {
            TrajectorySource::Elements { .. } => Vec::new(),
            TrajectorySource::Ephemeris(ephemeris) => ephemeris.seams().collect(),
        }
    }

    /// Checks that the trajectory covers an interval [s].
    ///
    /// # Errors
    /// A time that is not covered, with the ranges that are. A time at which SGP4 fails (tried every minute).
    pub fn check(&self, from: f64, to: f64) -> Result<(), TrajectoryError> {
        match &self.source {
            TrajectorySource::Elements { constants, epoch, reach } => {
                if let Some(time) = [from, to].into_iter().find(|time| (time - epoch).abs() > OLDEST) {
                    let years = (time - epoch).abs() / (365.25 * 86_400.0);
                    return Err(TrajectoryError::Aged { time: self.utc(time), years });
                }
                let looks = ((to - from) / 60.0).ceil().clamp(1.0, MOST_LOOKS);
                for look in 0..=looks as usize {
                    let time = from + (to - from) * look as f64 / looks;
                    let state = constants.propagate(sgp4::MinutesSinceEpoch((time - epoch) / 60.0));
                    let state = state.map_err(|error| TrajectoryError::Propagation {
                        time: self.utc(time),
                        reason: error.to_string(),
                    })?;
                    let distance = DVec3::from_array(state.position).length() * 1e3;
                    self.plausible(time, distance, reach[0] / OTHER_ORBIT..=reach[1] * OTHER_ORBIT)?;
                }
                Ok(())
            }
            TrajectorySource::Ephemeris(ephemeris) => {
                let coverage = ephemeris.coverage();
                if coverage.iter().any(|(start, end)| start - SLACK <= from && to <= end + SLACK) {
                    return Ok(());
                }
                Err(TrajectoryError::Uncovered {
                    from: self.utc(from),
                    to: self.utc(to),
                    warm_up: from < 0.0,
                    what: self.covered(&coverage),
                })
            }
        }
    }

    /// Checks a distance from the Earth's centre [m] that was computed for a time [s].
    ///
    /// # Errors
    /// [`TrajectoryError::Astray`].
    pub(crate) fn plausible(
        &self,
        time: f64,
        distance: f64,
        range: RangeInclusive<f64>,
    ) -> Result<(), TrajectoryError> {
        if range.contains(&distance) {
            return Ok(());
        }
        let (distance, nearest, farthest) = (distance / 1e3, range.start() / 1e3, range.end() / 1e3);
        Err(TrajectoryError::Astray { time: self.utc(time), distance, nearest, farthest })
    }

    fn covered(&self, coverage: &[(f64, f64)]) -> String {
        let [(first, _), .., (_, last)] = coverage else {
            return match coverage {
                [(start, end)] => format!("it covers {} to {}", self.utc(*start), self.utc(*end)),
                _ => "it covers nothing".to_owned(),
            };
        };
        let gaps: Vec<String> = coverage
            .windows(2)
            .take(3)
            .map(|pair| format!("{} to {}", self.utc(pair[0].1), self.utc(pair[1].0)))
            .collect();
        let more = if coverage.len() > 4 { format!(" and {} more", coverage.len() - 4) } else { String::new() };
        format!("it covers {} to {} with gaps: {}{more}", self.utc(*first), self.utc(*last), gaps.join(", "))
    }
}

/// Greatest number of times at which a propagation is tried beforehand.
const MOST_LOOKS: f64 = 1e5;

impl fmt::Display for Trajectory {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.description)
    }
}

/// Seconds from one epoch to another, leap seconds included.
pub(crate) fn seconds_between(from: Epoch, to: Epoch) -> f64 {
    (to.to_tai_duration() - from.to_tai_duration()).to_seconds()
}
