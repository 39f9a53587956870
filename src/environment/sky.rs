//! The sky at an instant: directions of Sun and planet in the body frame, and the times of eclipses.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;
use thiserror::Error;

use super::Sky;
use super::attitude::BodyFrame;
use super::eclipse::{Discs, sign_change};
use super::orbit_point::OrbitPoint;
use super::placements::{PlaceError, PlacementSample, Placements};
use super::state::SLACK;
use super::trajectory::{DISTANCES, Trajectory, TrajectoryError};
use crate::environment::{Attitude, Environment, Orbit};

/// An error in the values of a sky.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SkyError {
    /// A length or time that is not positive and finite.
    #[error("{what} must be positive and finite, not {value}")]
    NotPositive {
        /// Name of the value, with its unit.
        what: &'static str,
        /// Given value.
        value: f64,
    },
    /// An altitude too small to be resolved beside the planet's radius.
    #[error("the altitude of {altitude} m is nothing beside the planet radius of {planet_radius} m")]
    OnTheGround {
        /// Altitude [m].
        altitude: f64,
        /// Radius [m].
        planet_radius: f64,
    },
    /// An angle that is not finite.
    #[error("{what} must be finite, not {value}")]
    NotFinite {
        /// Name of the angle.
        what: &'static str,
        /// Given value.
        value: f64,
    },
    /// An attitude that does not define a rotation.
    #[error("the two axes of the attitude are parallel, or an axis or its quaternion is zero or not finite")]
    Attitude,
    /// A trajectory that does not cover a time that is needed.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// A place that something outside gave, or one that is missing.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// A table of rotations that does not cover a time that is needed.
    #[error("the attitude is needed from {from} to {to}, but {description} covers {covered}")]
    Uncovered {
        /// First time that is needed.
        from: String,
        /// Last time that is needed.
        to: String,
        /// Source of the table.
        description: String,
        /// Time that it covers.
        covered: String,
    },
}

/// Least altitude over planet radius (6 mm over Earth). Below it `distance_ratio - 1` has too few digits.
const LEAST_RELATIVE_ALTITUDE: f64 = 1e-9;

/// Orbit, attitude and planet of a scene, which give the sky at any time.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyModel {
    orbit: Orbit,
    body: BodyFrame,
    planet_radius: f64,
    eclipse: bool,
}

impl SkyModel {
    /// The sky of a scene.
    ///
    /// # Errors
    /// Where altitude, period or planet radius are not positive, an angle is not finite, or the attitude is degenerate.
    pub fn new(orbit: impl Into<Orbit>, attitude: &Attitude, environment: &Environment) -> Result<Self, SkyError> {
        let orbit = orbit.into();
        let planet_radius = environment.planet_radius;
        let positive = |what: &'static str, value: f64| {
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(SkyError::NotPositive { what, value }) }
        };
        positive("the planet radius [m]", planet_radius)?;
        if let Orbit::Circular(orbit) = &orbit {
            positive("the altitude [m]", orbit.altitude)?;
            positive("the period [s]", orbit.period)?;
            if orbit.altitude / planet_radius < LEAST_RELATIVE_ALTITUDE {
                return Err(SkyError::OnTheGround { altitude: orbit.altitude, planet_radius });
            }
            for (what, value) in [("beta", orbit.beta), ("the phase", orbit.phase)] {
                if !value.is_finite() {
                    return Err(SkyError::NotFinite { what, value });
                }
            }
        }
        let body = BodyFrame::new(attitude).ok_or(SkyError::Attitude)?;
        Ok(Self { orbit, body, planet_radius, eclipse: environment.eclipse })
    }

    /// The same planet with a craft whose places are given from here on.
    ///
    /// # Errors
    /// A place that can not be.
    pub(crate) fn placed(&self, place: PlacementSample, now: f64) -> Result<Self, PlaceError> {
        let places = match &self.orbit {
            Orbit::Given(places) => places.and(place, now, self.planet_radius)?,
            _ => Placements::new(place, self.planet_radius)?,
        };
        let places = Arc::new(places);
        Ok(Self { orbit: Orbit::Given(Arc::clone(&places)), body: BodyFrame::Given(places), ..self.clone() })
    }

    /// Checks that trajectory and attitude cover an interval [s] and that the craft is above the ground.
    ///
    /// # Errors
    /// The first value that is missing, and the interval that is covered.
    pub fn check(&self, from: f64, to: f64) -> Result<(), SkyError> {
        if let Orbit::Given(places) = &self.orbit {
            return Ok(places.check(from, to)?);
        }
        let Some(trajectory) = self.orbit.trajectory() else {
            return self.check_attitude(from, to, |time| format!("{time} s"));
        };
        trajectory.check(from, to)?;
        let looks = ((to - from) / LOOK_EVERY).ceil().clamp(1.0, MOST_LOOKS);
        for look in 0..=looks as usize {
            let time = from + (to - from) * look as f64 / looks;
            let distance = trajectory.state(time).map_or(f64::INFINITY, |state| state.position.length());
            if distance <= self.planet_radius * (1.0 + LEAST_RELATIVE_ALTITUDE) {
                let (distance, radius) = (distance / 1e3, self.planet_radius / 1e3);
                let days = trajectory.age_of_elements(time).map(|age| age / 86_400.0);
                let cause = days.map_or(String::new(), |days| {
                    format!(": the elements are {days:.0} days from it, and hold for days; take elements of that time, or fewer steps")
                });
                let time = trajectory.utc(time);
                return Err(TrajectoryError::Underground { time, distance, radius, cause }.into());
            }
            if distance.is_finite() {
                trajectory.plausible(time, distance, 0.0..=*DISTANCES.end())?;
            }
        }
        self.check_attitude(from, to, |time| trajectory.utc(time))
    }

    fn check_attitude(&self, from: f64, to: f64, name: impl Fn(f64) -> String) -> Result<(), SkyError> {
        let BodyFrame::History(history) = &self.body else {
            return Ok(());
        };
        let coverage = history.coverage();
        if coverage.iter().any(|(start, end)| start - SLACK <= from && to <= end + SLACK) {
            return Ok(());
        }
        let stretches = coverage.iter().take(4).map(|(start, end)| format!("{} to {}", name(*start), name(*end)));
        Err(SkyError::Uncovered {
            from: name(from),
            to: name(to),
            description: history.description.clone(),
            covered: stretches.collect::<Vec<_>>().join(", "),
        })
    }

    /// Period of the orbit [s].
    pub(crate) fn period(&self) -> f64 {
        self.orbit.period()
    }

    /// Period after which everything in the body frame repeats [s]. `None` where it does not repeat.
    pub(crate) fn repeats_after(&self) -> Option<f64> {
        match &self.orbit {
            Orbit::Circular(orbit) if self.body.repeats_with_the_orbit() => Some(orbit.period),
            _ => None,
        }
    }

    /// Period of a spinning craft [s]. `None` for any other.
    pub(crate) fn spin_period(&self) -> Option<f64> {
        self.body.spin_period()
    }

    /// Distance to the planet's centre over its radius. `None` where it changes.
    pub(crate) fn constant_distance_ratio(&self) -> Option<f64> {
        match &self.orbit {
            Orbit::Circular(orbit) => Some(1.0 + orbit.altitude / self.planet_radius),
            Orbit::Trajectory(_) | Orbit::Given(_) => None,
        }
    }

    /// Positions of craft and Sun. `None` where the trajectory does not cover the time. [`SkyModel::check`] tests this beforehand.
    pub fn point(&self, time: f64) -> Option<OrbitPoint> {
        self.orbit.point(time, self.planet_radius)
    }

    /// The sky at a time [s]. Values are NaN where trajectory or attitude do not cover the time.
    pub fn sky(&self, time: f64) -> Sky {
        let Some(point) = self.point(time) else {
            return Sky::nowhere(time);
        };
        let (body_from_inertial, body_from_orbit) = self.body.rotations(&point);
        let OrbitPoint { position, sun, .. } = point;
        let lit_fraction = if self.eclipse { self.discs_at(&point).lit_fraction() } else { 1.0 };
        Sky {
            time,
            body_from_inertial,
            body_from_orbit,
            sun_direction: body_from_inertial * point.sun_direction,
            nadir_direction: body_from_inertial * -position.normalize(),
            lit_fraction,
            distance_ratio: self.constant_distance_ratio().unwrap_or(position.length() / self.planet_radius),
            sun_zenith: position.cross(sun).length().atan2(position.dot(sun)),
            solar_scale: point.solar_scale,
        }
    }

    /// Unit vector to the Sun, body frame.
    pub fn sun_direction(&self, time: f64) -> DVec3 {
        self.point(time).map_or(DVec3::NAN, |point| self.body.rotations(&point).0 * point.sun_direction)
    }

    /// Share of the Sun's disc that the planet leaves visible, in [0, 1]. 1 where the scene has no eclipse.
    pub fn lit_fraction(&self, time: f64) -> f64 {
        if self.eclipse { self.point(time).map_or(f64::NAN, |point| self.discs_at(&point).lit_fraction()) } else { 1.0 }
    }

    /// Times in (`start`, `end`) [s] at which penumbra or umbra begins or ends, in order.
    pub(crate) fn contacts(&self, start: f64, end: f64) -> Vec<f64> {
        self.events(start, end).into_iter().map(|event| event.time).collect()
    }

    /// Beginnings and ends of penumbra and umbra in (`start`, `end`) [s], in order.
    ///
    /// On a circular orbit the separation of Sun and planet is monotonic between orbit noon and midnight. Each contact happens there at most once, and
    /// bisection finds it. On a trajectory the separation is monotonic over a stretch of [`STRETCH`], except where it turns. The turn is then found first.
    pub fn events(&self, start: f64, end: f64) -> Vec<EclipseEvent> {
        let mut events = Vec::new();
        if !self.eclipse {
            return events;
        }
        let mut find = |low: f64, high: f64| {
            let border = |boundary: Boundary, events: &mut Vec<EclipseEvent>| {
                let gap = |time: f64| self.discs(time).map_or(f64::NAN, |discs| boundary.gap(&discs));
                if let Some(time) = sign_change(gap, low, high) {
                    events.push(EclipseEvent { time, boundary, entry: gap(high) < 0.0 });
                }
            };
            border(Boundary::Penumbra, &mut events);
            border(Boundary::Umbra, &mut events);
        };
        match &self.orbit {
            Orbit::Circular(orbit) => {
                let half = 0.5 * orbit.period;
                let since_noon = orbit.angle(start) / TAU * orbit.period;
                let mut turn = start - since_noon.rem_euclid(half) + half;
                let mut low = start;
                while low < end {
                    let high = turn.min(end);
                    find(low, high);
                    low = high;
                    turn += half;
                }
            }
            of_points => {
                let mut seams = match of_points {
                    Orbit::Given(places) => places.times().collect(),
                    _ => of_points.trajectory().map(Trajectory::seams).unwrap_or_default(),
                };
                seams.retain(|seam| start < *seam && *seam < end);
                seams.push(end);
                let mut low = start;
                for seam in seams {
                    while low < seam {
                        let rate = self.point(low).map_or(f64::INFINITY, |point| point.rate);
                        let high = seam.min(low + (STRETCH / rate).clamp(1e-3, LONGEST_STRETCH));
                        self.in_stretch(low, high, &mut find);
                        low = high;
                    }
                }
            }
        }
        events.retain(|event| start < event.time && event.time < end);
        events.sort_by(|a, b| a.time.total_cmp(&b.time));
        events
    }

    /// Passes on a stretch of a trajectory, cut where the separation of Sun and planet turns. Skips it where the Sun is far from the limb.
    fn in_stretch(&self, low: f64, high: f64, find: &mut impl FnMut(f64, f64)) {
        let separation = |time: f64| self.discs(time).map_or(f64::NAN, |discs| discs.separation - discs.planet);
        let (Some(at_low), Some(point)) = (self.discs(low), self.point(low)) else {
            return;
        };
        // Against the Sun the limb moves at most at the craft's rate round the planet. A factor of two allows for the growth of the disc.
        let away = (at_low.separation - at_low.planet).abs() - at_low.sun;
        if away > 3.0 * point.rate * (high - low) {
            return;
        }
        let small = 1e-3 * (high - low);
        let slope_at_low = separation(low + small) - separation(low);
        let slope_at_high = separation(high) - separation(high - small);
        if slope_at_low * slope_at_high >= 0.0 {
            find(low, high);
            return;
        }
        let rising = sign_change(|time| separation(time + small) - separation(time), low, high - small);
        let turn = rising.map_or(0.5 * (low + high), |time| time + 0.5 * small);
        find(low, turn);
        find(turn, high);
    }

    /// Angle by which the Sun's direction turns in the body frame between two times [rad], from chords.
    pub(crate) fn sun_sweep(&self, start: f64, end: f64) -> f64 {
        const CHORDS: u32 = 16;
        let direction = |index: u32| self.sun_direction(start + (end - start) * f64::from(index) / f64::from(CHORDS));
        let chord = |index: u32| 2.0 * (0.5 * direction(index).distance(direction(index + 1))).min(1.0).asin();
        (0..CHORDS).map(chord).sum::<f64>().min(TAU * ((end - start) / self.period()).max(1.0))
    }

    /// The discs of Sun and planet. `None` where the trajectory does not cover the time.
    fn discs(&self, time: f64) -> Option<Discs> {
        self.point(time).map(|point| self.discs_at(&point))
    }

    fn discs_at(&self, point: &OrbitPoint) -> Discs {
        Discs::seen_from(point.position, point.sun, self.planet_radius)
    }
}

/// Kind of an [`EclipseEvent`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// The planet's disc touches the Sun's from outside.
    Penumbra,
    /// The planet's disc touches the Sun's from inside: a total eclipse, or far out an annular one.
    Umbra,
}

impl Boundary {
    fn gap(self, discs: &Discs) -> f64 {
        match self {
            Self::Penumbra => discs.outer_gap(),
            Self::Umbra => discs.inner_gap(),
        }
    }
}

/// A contact of the planet's disc with the Sun's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EclipseEvent {
    /// Time since the start [s].
    pub time: f64,
    /// Kind of the contact.
    pub boundary: Boundary,
    /// Whether it begins (otherwise it ends).
    pub entry: bool,
}

/// Angle round the planet of one stretch in the search on a trajectory [rad].
pub(crate) const STRETCH: f64 = 0.05;

/// Longest stretch [s]. Far from the Earth the motion of the Sun limits it.
const LONGEST_STRETCH: f64 = 86_400.0;

/// Interval at which the altitude of a trajectory is checked [s], and the greatest number of checks.
const LOOK_EVERY: f64 = 60.0;
const MOST_LOOKS: f64 = 1e5;

/// Angle at the planet's centre between the horizon and the point below the craft [rad].
pub(crate) fn horizon_angle(distance_ratio: f64) -> f64 {
    (distance_ratio * distance_ratio - 1.0).max(0.0).sqrt().atan()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DQuat;

    use super::*;
    use crate::environment::CircularOrbit;

    fn orbit(altitude: f64, period: f64) -> CircularOrbit {
        CircularOrbit { altitude, period, beta: 0.0, phase: 20f64.to_radians() }
    }

    fn environment() -> Environment {
        Environment {
            solar_constant: Some(1361.0),
            albedo: Some(0.3),
            planet_ir: Some(237.0),
            planet_radius: 6.378_137e6,
            eclipse: true,
            background_temperature: Some(2.7),
        }
    }

    fn model(altitude: f64, beta: f64) -> SkyModel {
        let orbit = CircularOrbit { beta, ..orbit(altitude, 6017.0) };
        SkyModel::new(&orbit, &Attitude::Inertial { inertial_from_body: DQuat::IDENTITY }, &environment()).unwrap()
    }

    /// docs/numerics.md 2: the planet's shadow is steps 85-235 of 360 at 224 km and 97-223 at 772 km, with phase 20 deg.
    #[test]
    fn the_papers_shadow_begins_and_ends_where_numerics_2_says() {
        for (altitude, entry, exit) in [(224e3, 85.0, 235.0), (772e3, 97.0, 223.0)] {
            let step = 6017.0 / 360.0;
            let contacts: Vec<f64> =
                model(altitude, 0.0).contacts(0.0, 6017.0).into_iter().map(|time| time / step).collect();
            let [penumbra, umbra, umbra_end, penumbra_end] = contacts[..] else { panic!("{contacts:?}") };
            assert!(penumbra < umbra && umbra < umbra_end && umbra_end < penumbra_end, "{contacts:?}");
            assert!((0.5 * (penumbra + umbra) - entry).abs() < 0.6, "{altitude} m: {contacts:?}");
            assert!((0.5 * (umbra_end + penumbra_end) - exit).abs() < 0.6, "{altitude} m: {contacts:?}");
            let other = model(996e3 - altitude, 0.0).contacts(0.0, 6017.0);
            assert!((other[0] / step - entry).abs() > 5.0, "the other altitude must not pass");
        }
    }

    #[test]
    fn contacts_are_where_the_lit_fraction_changes() {
        for beta in [0.0, 0.7, -1.0] {
            let model = model(224e3, beta);
            let contacts = model.contacts(-5500.0, 24_500.0);
            assert_eq!(contacts.len(), if beta == 0.0 { 20 } else { contacts.len() / 4 * 4 }, "beta {beta}");
            assert!(contacts.len() >= 16, "beta {beta}");
            for quad in contacts.chunks(4) {
                assert_eq!(model.lit_fraction(quad[0] - 1e-6), 1.0);
                assert!(model.lit_fraction(quad[0] + 1e-2) < 1.0);
                assert_eq!(model.lit_fraction(quad[1] + 1e-6), 0.0);
                assert!(model.lit_fraction(quad[1] - 1e-2) > 0.0);
                assert_eq!(model.lit_fraction(quad[2] - 1e-6), 0.0);
                assert!(model.lit_fraction(quad[2] + 1e-2) > 0.0);
                assert!(model.lit_fraction(quad[3] - 1e-2) < 1.0);
                assert_eq!(model.lit_fraction(quad[3] + 1e-6), 1.0);
            }
        }
    }

    #[test]
    fn contacts_do_not_depend_on_how_time_is_cut() {
        let model = model(408e3, 0.5);
        let whole = model.contacts(0.0, 12_000.0);
        let cut: Vec<f64> =
            (0..1200).flat_map(|step| model.contacts(f64::from(step) * 10.0, f64::from(step + 1) * 10.0)).collect();
        assert_eq!(whole.len(), cut.len());
        for (a, b) in whole.iter().zip(&cut) {
            assert!((a - b).abs() < 1e-7, "{a} {b}");
        }
    }

    #[test]
    fn high_beta_and_a_scene_without_eclipse_stay_lit() {
        for beta in [1.4, std::f64::consts::FRAC_PI_2] {
            assert_eq!(model(772e3, beta).contacts(0.0, 6017.0), Vec::<f64>::new());
            assert_eq!(model(772e3, beta).lit_fraction(3000.0), 1.0);
        }
        let without = Environment { eclipse: false, ..environment() };
        let attitude = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::Z };
        let model = SkyModel::new(&orbit(224e3, 6017.0), &attitude, &without).unwrap();
        assert_eq!(model.contacts(0.0, 6017.0), Vec::<f64>::new());
        assert_eq!(model.sky(2600.0).lit_fraction, 1.0);
    }

    #[test]
    fn the_sky_agrees_with_its_parts() {
        let attitude = Attitude::Nadir { nadir_axis: DVec3::Z, forward_axis: DVec3::X };
        let orbit = CircularOrbit { beta: 0.4, ..orbit(408e3, 5560.0) };
        let model = SkyModel::new(&orbit, &attitude, &environment()).unwrap();
        for time in [0.0, 900.0, 2500.0] {
            let sky = model.sky(time);
            assert!(sky.nadir_direction.distance(DVec3::Z) < 1e-12);
            assert!((sky.sun_zenith.cos() + sky.sun_direction.z).abs() < 1e-12);
            assert!((sky.body_from_orbit * DVec3::Z).distance(sky.nadir_direction) < 1e-12);
            assert!(sky.sun_direction.distance(model.sun_direction(time)) < 1e-15);
        }
        let sweep = model.sun_sweep(100.0, 200.0);
        assert!((sweep - TAU * 100.0 / 5560.0 * 0.4f64.cos()).abs() < 1e-3, "{sweep}");
        let turned = CircularOrbit { phase: orbit.phase + PI, ..orbit };
        let other = SkyModel::new(&turned, &attitude, &environment()).unwrap();
        assert!((other.sky(0.0).sun_zenith - model.sky(0.0).sun_zenith).abs() > 0.5);
    }

    #[test]
    fn unusable_values_are_named() {
        let attitude = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::Z };
        let error = |orbit: CircularOrbit| SkyModel::new(&orbit, &attitude, &environment()).unwrap_err().to_string();
        assert!(error(orbit(-1.0, 6017.0)).contains("altitude"));
        assert!(error(orbit(408e3, 0.0)).contains("period"));
        assert!(error(orbit(1e-4, 6017.0)).contains("nothing beside the planet radius"));
        assert!(error(CircularOrbit { beta: f64::NAN, ..orbit(408e3, 5560.0) }).contains("beta"));
        let parallel = Attitude::Sun { sun_axis: DVec3::X, north_axis: DVec3::X };
        assert_eq!(SkyModel::new(&orbit(408e3, 5560.0), &parallel, &environment()), Err(SkyError::Attitude));
    }
}
