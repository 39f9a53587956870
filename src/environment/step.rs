//! The load of a step: Sun, planet and albedo, averaged with the exact times of eclipses inside the step.
//!
//! Sunlight is given as up to eight light vectors. Each is the exact integral over a stretch of the step. The step is cut at the contacts of an eclipse,
//! and into more stretches where the craft turns.

use std::f64::consts::TAU;
use std::iter::Sum;
use std::ops::Mul;
use std::sync::{Arc, LazyLock};

use glam::{DAffine3, DVec3};

use super::albedo::{AlbedoTable, constant_table, mean_albedo_factor};
use super::albedo_field::{AlbedoField, AlbedoFields};
use super::joints::{Joint, JointError, Joints};
use super::placements::{PlaceError, PlacementSample};
use super::quadrature::GaussLegendre;
use super::shadow::turn_between;
use super::sky::{SkyError, SkyModel};
use super::view_factor::ApparentRadius;
use super::{MAX_SUN_SAMPLES, PlanetLoad, StepLoad, SunSample};
use crate::environment::{Attitude, Environment, Orbit};

/// The environment of a scene, which gives the load of any step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepLoads {
    sky: SkyModel,
    environment: Environment,
    albedo: Option<AlbedoSource>,
    joints: Joints,
    /// Whether loads are means over all orientations.
    tumbles: bool,
    /// Length down to which a step is halved where the eclipse begins or ends in it [s]. Infinite where no surface needs that.
    shortest_part: f64,
    /// Length down to which a step of the scene is halved in any case [s].
    longest_part: f64,
    /// Angle by which the Sun or a joint may turn against the craft in a part of a step [rad], and the length down to which a step of the scene is halved for that [s]. Infinite where light needs none.
    turn: [f64; 2],
}

/// Fields, whose tables are made when they are needed. Copies of the loads share them.
#[derive(Debug, Clone, PartialEq)]
enum AlbedoSource {
    /// The constant distance of a circular orbit.
    Fixed(Arc<AlbedoField>),
    Varying(Arc<AlbedoFields>),
}

impl AlbedoSource {
    fn table(&self, planet: &PlanetLoad) -> Option<AlbedoTable> {
        match self {
            Self::Fixed(field) => field.table(planet.sun_zenith),
            Self::Varying(fields) => fields.table(planet.distance_ratio, planet.sun_zenith),
        }
    }
}

/// Angle that the Sun sweeps in the body frame during one sample [rad] (0.06 deg), where [`MAX_SUN_SAMPLES`] allows.
///
/// A plate on which the Sun rises or sets during a sample errs by at most its flux times 1/8 of the angle. This is 0.05 W/m2 for the eight samples of
/// a 17 s step in low orbit. Every other plate gets its exact mean flux.
pub(crate) const SWEEP_PER_SAMPLE: f64 = 1.1e-3;

static LIT_RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(4));
static PENUMBRA_RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(12));

/// The length of a step [s], halved until it is at most `longest` [s], but `at_most` times.
pub(crate) fn halved(step: f64, longest: f64, at_most: f64) -> f64 {
    let halvings = (step / longest * (1.0 - ROUNDING)).log2().ceil().clamp(0.0, at_most);
    step / halvings.exp2()
}

impl StepLoads {
    /// The loads of a scene. Builds the albedo field of a circular orbit where there is a Sun and an albedo above 0. The fields of a trajectory are built
    /// when needed.
    ///
    /// # Errors
    /// See [`SkyModel::new`].
    pub fn new(orbit: impl Into<Orbit>, attitude: &Attitude, environment: &Environment) -> Result<Self, SkyError> {
        let sky = SkyModel::new(orbit, attitude, environment)?;
        let albedo = (reflected(environment) > 0.0).then(|| match sky.constant_distance_ratio() {
            Some(ratio) => AlbedoSource::Fixed(Arc::new(AlbedoField::new(ratio))),
            None => AlbedoSource::Varying(Arc::default()),
        });
        Ok(Self {
            sky,
            environment: environment.clone(),
            albedo,
            joints: Joints::default(),
            tumbles: *attitude == Attitude::Tumble,
            shortest_part: f64::INFINITY,
            longest_part: f64::INFINITY,
            turn: [f64::INFINITY; 2],
        })
    }

    /// Takes the albedo from fields that loads of other orbits share, so that orbits of many heights make few tables.
    pub(crate) fn share_albedo(&mut self, fields: &Arc<AlbedoFields>) {
        if self.albedo.is_some() {
            self.albedo = Some(match self.sky.constant_distance_ratio() {
                Some(ratio) => AlbedoSource::Fixed(Arc::new(AlbedoField::between(fields, ratio))),
                None => AlbedoSource::Varying(Arc::clone(fields)),
            });
        }
    }

    /// Adds joints to the craft. Joints with a rate are walked from the time `from` [s] on in steps of `step` [s].
    pub(crate) fn with_joints(mut self, joints: Vec<Joint>, from: f64, step: f64) -> Self {
        let sun = |time: f64| self.sky.sun_direction(time);
        self.joints = Joints::under_a_sky(joints, from, step, self.sky.repeats_after(), sun);
        self
    }

    /// Has steps halved down to a length [s] where the eclipse begins or ends in them.
    pub fn with_parts_of(self, shortest_part: f64) -> Self {
        Self { shortest_part, ..self }
    }

    /// Has every step of the scene halved down to a length [s].
    pub(crate) fn with_parts_up_to(self, longest_part: f64) -> Self {
        Self { longest_part, ..self }
    }

    /// Has steps of the scene halved where the Sun or a joint turns against the craft by more than an angle [rad], down to a length [s].
    pub(crate) fn with_parts_by_turn(self, turn: [f64; 2]) -> Self {
        Self { turn, ..self }
    }

    /// Has steps halved as with other loads of the same sky, so that two runs can be compared step by step.
    pub(crate) fn take_parts_of(&mut self, other: &Self) {
        (self.shortest_part, self.longest_part, self.turn) = (other.shortest_part, other.longest_part, other.turn);
    }

    /// Takes the parts of steps, and the albedo tables where the distance is the same, of loads of almost the same scene.
    pub(crate) fn take_of(&mut self, other: &Self) {
        self.take_parts_of(other);
        self.take_albedo_of(other);
    }

    /// Takes the albedo tables of loads at the same distance, which hang on nothing else.
    fn take_albedo_of(&mut self, other: &Self) {
        let same = match (&self.albedo, &other.albedo) {
            (Some(AlbedoSource::Fixed(own)), Some(AlbedoSource::Fixed(other))) => own.is_as_far_as(other),
            (Some(AlbedoSource::Varying(_)), Some(AlbedoSource::Varying(_))) => true,
            _ => false,
        };
        if same {
            self.albedo.clone_from(&other.albedo);
        }
    }

    /// Whether the interval of `steps` steps from `start` to `end` [s] is to be halved: because a step of the scene is taken in parts, because the Sun or a joint turns too far in it, or because the eclipse
    /// begins or ends in it and a surface stores too little heat for its mean load.
    pub(crate) fn needs_halves(&self, start: f64, end: f64, steps: f64) -> bool {
        let is_lit = || [start, 0.5 * (start + end), end].iter().any(|time| self.sky.lit_fraction(*time) > 0.0);
        if self.is_always_halved(end - start, steps) || (steps <= 1.0 && self.turns_far(start, end) && is_lit()) {
            return true;
        }
        let in_penumbra = || {
            let lit = self.sky.lit_fraction(0.5 * (start + end));
            0.0 < lit && lit < 1.0
        };
        end - start > self.shortest_part * (1.0 + ROUNDING)
            && self.environment.solar_constant.is_some()
            && (in_penumbra() || !self.sky.contacts(start, end).is_empty())
    }

    /// Length of the parts in which a step of the scene is taken at time 0 because the Sun or a joint turns [s].
    pub(crate) fn turned_part(&self, step: f64) -> f64 {
        let mut halves = std::iter::successors(Some(step), |part| Some(0.5 * part));
        halves.find(|part| !self.turns_far(0.0, *part)).unwrap_or(step)
    }

    /// Whether the Sun or a joint turns so far against the craft that one finding of the light would not do for the interval, which may be shorter.
    fn turns_far(&self, start: f64, end: f64) -> bool {
        end - start > self.turn[1] * (1.0 + ROUNDING) && self.turn_share(start, end) > 1.0 + ROUNDING
    }

    /// Largest turn of the Sun or of a joint against the craft from `start` to `end` [s], over the turn above which a step is halved. 0 where light needs no parts.
    pub(crate) fn turn_share(&self, start: f64, end: f64) -> f64 {
        /// Chords of the way of a joint.
        const CHORDS: u32 = 4;
        if self.environment.solar_constant.is_none() || self.turn[0].is_infinite() {
            return 0.0;
        }
        let sun = match self.sky.spin_period() {
            Some(period) if end - start >= period => TAU * (end - start) / period,
            _ => self.sky.sun_sweep(start, end),
        };
        let poses = |chord: u32| self.joints_at(start + (end - start) * f64::from(chord) / f64::from(CHORDS)).1;
        let poses: Vec<_> = (0..=CHORDS).map(poses).collect();
        let turn = |joint: usize| poses.windows(2).map(|pair| turn_between(&pair[0][joint], &pair[1][joint])).sum();
        (0..poses[0].len()).map(turn).fold(sun, f64::max) / self.turn[0]
    }

    /// Whether an interval of a length [s], of `steps` steps, is halved wherever it lies. Only a step of the scene, or a part of it, can be.
    pub(crate) fn is_always_halved(&self, length: f64, steps: f64) -> bool {
        steps <= 1.0 && length > self.longest_part * (1.0 + ROUNDING)
    }

    /// Takes the next place of the craft from outside, at the present time `now` [s]. The first one ends the scene's own orbit and attitude.
    ///
    /// # Errors
    /// A place that can not be.
    pub(crate) fn place(&mut self, place: PlacementSample, now: f64) -> Result<(), PlaceError> {
        self.sky = self.sky.placed(place, now)?;
        self.tumbles = false;
        if let Some(AlbedoSource::Fixed(_)) = self.albedo {
            self.albedo = Some(AlbedoSource::Varying(Arc::default()));
        }
        self.joints = self.joints.restart_at(now, &|time| self.sky.sun_direction(time));
        Ok(())
    }

    /// Holds a joint at a position [rad or m] from the present time `now` [s] on.
    ///
    /// # Errors
    /// There is no such joint, it plays an animation, or the position lies outside its limits.
    pub(crate) fn set_joint(&mut self, name: &str, position: f64, now: f64) -> Result<(), JointError> {
        let joints = self.joints.held(name, position)?;
        self.joints = joints.restart_at(now, &|time| self.sky.sun_direction(time));
        Ok(())
    }

    pub(crate) fn joints(&self) -> &Joints {
        &self.joints
    }

    /// Position of each joint [rad or m] at a time [s], and the poses of the body and of each joint. Both are empty where nothing moves.
    pub fn joints_at(&self, time: f64) -> (Vec<f64>, Vec<DAffine3>) {
        self.joints.at(time, &|time| self.sky.sun_direction(time))
    }

    /// The sky that the loads come from.
    pub fn sky_model(&self) -> &SkyModel {
        &self.sky
    }

    /// The load of the step from `start` to `end` [s]. Where `end` is not later than `start`, the load is taken at the instant `start`.
    ///
    /// The sun samples contain all light of the step. Eclipses are cut at their contacts. The only approximation concerns plates on which the Sun
    /// rises or sets (see [`SWEEP_PER_SAMPLE`]). In a long step [`MAX_SUN_SAMPLES`] samples sweep greater angles, and the error of such a plate grows
    /// in proportion: up to 1.5 W/m2 in a step of 700 s and 18 W/m2 in a step of an orbit or more, in low orbit. Under a spinning craft the errors of
    /// steps are larger but cancel over its turns. Planet infrared, albedo and the poses of joints are taken in the middle of the step. In steps of
    /// more than a few minutes these values differ from their means.
    pub fn step_load(&self, start: f64, end: f64) -> StepLoad {
        let middle = if end > start { 0.5 * (start + end) } else { start };
        if self.tumbles {
            return self.mean_load(start, end, middle);
        }
        let mut planet = self.planet_load(middle);
        let table = |planet: &PlanetLoad| self.albedo.as_ref().and_then(|source| source.table(planet));
        let albedo = planet.as_ref().and_then(table);
        if let (Some(planet), None) = (&mut planet, &albedo) {
            planet.albedo_flux = 0.0;
        }
        StepLoad {
            start,
            sun: self.sun_samples(start, end),
            planet,
            albedo,
            background_temperature: self.environment.background_temperature.unwrap_or(0.0),
            joints: self.joints_at(middle).1,
        }
    }

    /// The load of a step for a craft that tumbles. A convex surface of area A shows the mean area A/4 to every direction, so each of its places receives a
    /// quarter of what a plate that faces the source receives.
    fn mean_load(&self, start: f64, end: f64, middle: f64) -> StepLoad {
        let sky = self.sky.sky(middle);
        let Environment { solar_constant, planet_ir, .. } = self.environment;
        let sun = solar_constant.unwrap_or(0.0) * sky.solar_scale;
        let direct = if end > start && (end - start).is_finite() {
            let stretches = self.lit_runs(start, end).into_iter().flatten();
            stretches.map(|stretch| self.light(&stretch, start, end, |_| 1.0)).sum::<f64>() / (end - start)
        } else {
            sky.lit_fraction
        };
        let reflected = self.environment.albedo.unwrap_or(0.0) * mean_albedo_factor(sky.distance_ratio, sky.sun_zenith);
        let light = sun * (0.25 * direct + reflected);
        let radius = ApparentRadius::new(sky.distance_ratio);
        let planet = PlanetLoad {
            nadir: DVec3::ZERO,
            sunward: DVec3::ZERO,
            distance_ratio: sky.distance_ratio,
            planet_ir: planet_ir.unwrap_or(0.0) * 0.5 * radius.sin * radius.sin / (1.0 + radius.cos),
            albedo_flux: light,
            sun_zenith: sky.sun_zenith,
        };
        StepLoad {
            start,
            sun: Vec::new(),
            planet: Some(planet),
            albedo: (light > 0.0).then(constant_table),
            background_temperature: self.environment.background_temperature.unwrap_or(0.0),
            joints: Vec::new(),
        }
    }

    fn planet_load(&self, time: f64) -> Option<PlanetLoad> {
        let albedo_flux = reflected(&self.environment);
        if self.environment.planet_ir.is_none() && albedo_flux == 0.0 {
            return None;
        }
        let sky = self.sky.sky(time);
        let nadir = sky.nadir_direction;
        let sunward = sky.sun_direction - nadir * nadir.dot(sky.sun_direction);
        Some(PlanetLoad {
            nadir,
            sunward: if sunward.length() > NO_SIDE { sunward.normalize() } else { nadir.any_orthonormal_vector() },
            distance_ratio: sky.distance_ratio,
            planet_ir: self.environment.planet_ir.unwrap_or(0.0),
            albedo_flux: albedo_flux * sky.solar_scale,
            sun_zenith: sky.sun_zenith,
        })
    }

    fn sun_samples(&self, start: f64, end: f64) -> Vec<SunSample> {
        let Some(solar_constant) = self.environment.solar_constant else {
            return Vec::new();
        };
        if end <= start || !(end - start).is_finite() {
            let sky = self.sky.sky(start);
            let flux = solar_constant * sky.solar_scale * sky.lit_fraction;
            return SunSample { direction: sky.sun_direction, flux }.unless_dark().into_iter().collect();
        }
        // The Sun's distance changes by less than 3e-4 a day.
        let solar_constant = solar_constant * self.sky.point(0.5 * (start + end)).map_or(f64::NAN, |p| p.solar_scale);
        let runs = self.lit_runs(start, end);
        let counts = self.sample_counts(&runs);
        let mut samples = Vec::new();
        for (run, count) in runs.iter().zip(counts) {
            let (first, last) = (run[0].start, run[run.len() - 1].end);
            let edge = |index: usize| first + (last - first) * index as f64 / count as f64;
            for index in 0..count {
                let light = self.light_of_sample(run, edge(index), edge(index + 1));
                let flux = light * (solar_constant / (end - start));
                samples.extend(SunSample { direction: flux.normalize_or_zero(), flux: flux.length() }.unless_dark());
            }
        }
        samples
    }

    /// The time of a step outside umbra, as runs of adjacent stretches that are smooth inside.
    ///
    /// A step longer than the period of the orbit, or than a turn of a spinning craft, sees the same skies again. Such a step is folded onto its
    /// first period, and a stretch counts as often as the step passes it.
    fn lit_runs(&self, start: f64, end: f64) -> Vec<Vec<LitStretch>> {
        let (turns, rest, window) = match self.repeats_within(start, end) {
            Some(period) if end - start >= period => {
                let turns = ((end - start) / period).floor();
                (turns, (end - start) - turns * period, period)
            }
            _ => (0.0, end - start, end - start),
        };
        let mut cuts = self.sky.contacts(start, start + window);
        cuts.extend([start, start + rest, start + window]);
        cuts.sort_by(f64::total_cmp);

        let mut runs: Vec<Vec<LitStretch>> = Vec::new();
        let mut in_run = false;
        for pair in cuts.windows(2).filter(|pair| pair[1] > pair[0]) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let lit = self.sky.lit_fraction(middle);
            if lit == 0.0 {
                in_run = false;
                continue;
            }
            let passes = turns + if middle < start + rest { 1.0 } else { 0.0 };
            let stretch = LitStretch { start: pair[0], end: pair[1], passes, penumbra: lit < 1.0 };
            match runs.last_mut() {
                Some(run) if in_run => run.push(stretch),
                _ => runs.push(vec![stretch]),
            }
            in_run = true;
        }
        runs
    }

    /// Period after which the Sun has the same direction in the body during a step [s]. For a spinning craft it exists only where the light does not change
    /// in the step.
    fn repeats_within(&self, start: f64, end: f64) -> Option<f64> {
        let steady = || {
            let lit = self.sky.lit_fraction(start);
            (lit == 0.0 || lit == 1.0) && self.sky.contacts(start, end).is_empty()
        };
        let turn = || self.sky.spin_period().filter(|turn| *turn <= end - start && steady());
        self.sky.repeats_after().or_else(turn)
    }

    /// Integral of lit fraction times the Sun's direction over the part of a run in [`from`, `to`] [s].
    ///
    /// For a spinning craft all light has the direction of the middle. A mean vector is shorter by the share a^2/24, where a is the angle of the sample.
    /// Plates whose horizon the Sun crosses lose as much, and this loss would add up over the turns. With the direction of the middle, the gain of fully
    /// lit plates balances it.
    fn light_of_sample(&self, run: &[LitStretch], from: f64, to: f64) -> DVec3 {
        if self.sky.spin_period().is_none() {
            return run.iter().map(|stretch| self.light(stretch, from, to, |time| self.sky.sun_direction(time))).sum();
        }
        let light: f64 = run.iter().map(|stretch| self.light(stretch, from, to, |_| 1.0)).sum();
        light * self.sky.sun_direction(0.5 * (from + to))
    }

    /// Number of samples for each run: by the Sun's sweep, reduced on the longest runs to stay within [`MAX_SUN_SAMPLES`].
    fn sample_counts(&self, runs: &[Vec<LitStretch>]) -> Vec<usize> {
        let wanted = |run: &Vec<LitStretch>| {
            let sweep = self.sky.sun_sweep(run[0].start, run[run.len() - 1].end);
            ((sweep / SWEEP_PER_SAMPLE).ceil() as usize).max(1)
        };
        let mut counts: Vec<usize> = runs.iter().map(wanted).collect();
        while counts.iter().sum::<usize>() > MAX_SUN_SAMPLES {
            let Some(largest) = counts.iter_mut().max() else {
                break;
            };
            *largest -= 1;
        }
        counts
    }

    /// Integral of lit fraction times `value` over the part of a stretch in [`from`, `to`], times its passes [s]. For a plate that is lit throughout, the
    /// dot product of its normal with the integral of the direction is exact.
    fn light<T>(&self, stretch: &LitStretch, from: f64, to: f64, value: impl Fn(f64) -> T) -> T
    where
        T: Sum + Mul<f64, Output = T>,
    {
        let (from, to) = (from.max(stretch.start), to.min(stretch.end));
        if to <= from {
            return std::iter::empty().sum();
        }
        let sum: T = if stretch.penumbra {
            // Near a contact the lit fraction varies as the power 3/2 of the time from it.
            let lit = |(time, weight): (f64, f64)| value(time) * (weight * self.sky.lit_fraction(time));
            PENUMBRA_RULE.on_smoothed(from, to).map(lit).sum()
        } else {
            LIT_RULE.on(from, to).map(|(time, weight)| value(time) * weight).sum()
        };
        sum * stretch.passes
    }
}

/// A stretch of a step in which the lit fraction is smooth.
struct LitStretch {
    start: f64,
    end: f64,
    /// How often the step passes it.
    passes: f64,
    /// Whether the Sun is partly covered, rather than free.
    penumbra: bool,
}

impl SunSample {
    fn unless_dark(self) -> Option<Self> {
        (self.flux > 0.0).then_some(self)
    }
}

/// Share by which the length of a part may be rounded.
const ROUNDING: f64 = 1e-6;

/// Sine of the Sun's angle from the nadir line below which the Sun has no side.
const NO_SIDE: f64 = 1e-9;

/// Solar constant times albedo [W/m2]; 0 where either is absent.
fn reflected(environment: &Environment) -> f64 {
    environment.solar_constant.unwrap_or(0.0) * environment.albedo.unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
