//! The open part of a patch's sky, kept in bundles of rays, and the share of the planet's light that comes through it.
//!
//! A bundle keeps its mean direction and the share of its rays that left the craft, in one word. Rays are spread with the cosine, so each bundle carries the same
//! share of the light of a uniform sky. Of the bundles towards the planet, the open part over all of them is the share of its infrared that the patch sees; for albedo
//! each counts with the sunlight on the ground that it meets. The loads of an open hemisphere, which are exact, are multiplied with these shares. Twin: `glsl/exchange_sky.comp`.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::turn::turned;
use crate::environment::{PlanetLoad, StepLoad};
use crate::thermal::received::PlanetShares;

const BUNDLE: usize = 4;
/// Parts of a bundle in which its open share is counted: one to four rays divide them.
pub(super) const PARTS: u32 = 12;
const BITS: u32 = 14;
const GRID: u32 = (1 << BITS) - 1;

/// A turn below this is rounding [rad].
const STILL: f64 = 1e-9;
/// Change of a flux of sunlight, over the flux, that counts.
const FLUX: f64 = 0.01;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PatchRay {
    /// The two numbers that chose its direction about the normal.
    pub(crate) place: [f64; 2],
    pub(crate) direction: DVec3,
}

pub(crate) fn bundles_of(rays: usize) -> usize {
    rays.div_ceil(BUNDLE)
}

/// First ray of a bundle.
fn first_ray(bundle: usize, rays: usize) -> usize {
    rays * bundle / bundles_of(rays).max(1)
}

/// Numbers of the rays of a patch, one bundle after the other, and the words of the bundles, of which nothing is open. Neighbours make a bundle: rays are sorted into
/// rings about the normal, and by azimuth within a ring.
pub(super) fn gathered(rays: &[PatchRay]) -> (Vec<u16>, Vec<u32>) {
    let (count, length) = (bundles_of(rays.len()), rays.len());
    // As many bundles around a ring as there are rings, times four, have about the same width and height.
    let rings = ((count as f64).sqrt() / 2.0).round().max(1.0) as usize;
    // A place in 32 bits and the number of its ray, so that whole numbers are sorted.
    let key = |number: u32, place: f64| ((place * 2f64.powi(32)) as u64) << 32 | u64::from(number);
    let mut order: Vec<u64> = (0..).zip(rays).map(|(number, ray)| key(number, ray.place[0])).collect();
    order.sort_unstable();
    for ring in 0..rings {
        let [first, end] = [ring, ring + 1].map(|ring| first_ray(count * ring / rings, length));
        let ring = &mut order[first..end];
        ring.iter_mut().for_each(|ray| *ray = key(*ray as u32, rays[*ray as u32 as usize].place[1]));
        ring.sort_unstable();
    }
    let order: Vec<u16> = order.into_iter().map(|ray| ray as u16).collect();
    let word = |bundle: usize| {
        let directions = order[first_ray(bundle, length)..first_ray(bundle + 1, length)]
            .iter()
            .map(|ray| rays[usize::from(*ray)].direction);
        let first = rays[usize::from(order[first_ray(bundle, length)])].direction;
        word_of(directions.sum::<DVec3>().normalize_or(first), 0)
    };
    let words = (0..count).map(word).collect();
    (order, words)
}

/// Words of bundles with what is open of the rays in this order.
pub(super) fn opened<'a>(
    order: &'a [u16],
    words: &'a [u32],
    is_open: impl Fn(u16) -> bool + 'a,
) -> impl Iterator<Item = u32> + 'a {
    words.iter().enumerate().map(move |(bundle, word)| {
        let rays = &order[first_ray(bundle, order.len())..first_ray(bundle + 1, order.len())];
        let open = rays.iter().filter(|ray| is_open(**ray)).count() as u32;
        word | (PARTS * open / rays.len() as u32) << (2 * BITS)
    })
}

/// Parts of twelve of a bundle that are open.
pub(super) fn open_parts(word: u32) -> u8 {
    (word >> (2 * BITS)) as u8
}

/// The word of a bundle of which nothing is open, with so many parts open.
pub(super) fn with_open_parts(word: u32, parts: u8) -> u32 {
    word | u32::from(parts) << (2 * BITS)
}

/// A bundle as a word: a direction on an octahedron (Cigolle et al. 2014, Journal of Computer Graphics Techniques 3(2)) in steps of 2^-14, and the open ones of 12 parts.
fn word_of(direction: DVec3, open: u32) -> u32 {
    let scaled = direction / direction.abs().element_sum();
    let sign = |value: f64| if value < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if scaled.z >= 0.0 {
        (scaled.x, scaled.y)
    } else {
        ((1.0 - scaled.y.abs()) * sign(scaled.x), (1.0 - scaled.x.abs()) * sign(scaled.y))
    };
    let steps = |value: f64| ((0.5 * value + 0.5) * f64::from(GRID)).round() as u32;
    open << (2 * BITS) | steps(x) << BITS | steps(y)
}

/// Room for every number of open parts.
const MEANS: usize = 16;
/// Just above a half, so that halves are rounded alike whatever the rounding of the share.
const HALF: f64 = 0.5001;

/// Words of the sky between two poses: the same bundles, each with the mean of its open shares to the next twelfth.
///
/// Twin: `glsl/exchange_sky.comp`.
pub(super) fn mean_sky([from, to]: [&[u32]; 2], share: f64) -> Vec<u32> {
    // Twelve parts have few means.
    let means: [[u32; MEANS]; MEANS] =
        std::array::from_fn(|a| std::array::from_fn(|b| (a as f64 + share * (b as f64 - a as f64) + HALF) as u32));
    let parts = |word: u32| usize::from(open_parts(word)) % MEANS;
    let mean = |(a, b): (&u32, &u32)| means[parts(*a)][parts(*b)] << (2 * BITS) | (a & ((1 << (2 * BITS)) - 1));
    from.par_iter().zip(to).map(mean).collect()
}

fn open_share(word: u32) -> f64 {
    f64::from(word >> (2 * BITS)) / f64::from(PARTS)
}

fn direction_of(word: u32) -> DVec3 {
    let value = |steps: u32| f64::from(steps & GRID) * (2.0 / f64::from(GRID)) - 1.0;
    let (x, y) = (value(word >> BITS), value(word));
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    let folded = |value: f64| if value < 0.0 { value + below } else { value - below };
    DVec3::new(folded(x), folded(y), z).normalize()
}

/// The planet as a patch sees it: unit vectors in the frame of the patch, and the Sun at the centre of the planet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanetFromPatch {
    nadir: DVec3,
    sun: DVec3,
    distance_ratio: f64,
}

impl PlanetFromPatch {
    /// The planet of a load in the frame of a joint.
    pub fn new(planet: &PlanetLoad, load: &StepLoad, joint: u32) -> Self {
        let turn = load.joint_from_body(joint);
        let (sine, cosine) = planet.sun_zenith.sin_cos();
        let sun = planet.sunward * sine - planet.nadir * cosine;
        Self { nadir: turn * planet.nadir, sun: turn * sun, distance_ratio: planet.distance_ratio }
    }

    /// Cosine of the zenith angle of the Sun where a direction meets the planet. `None` where it meets none.
    fn lit(&self, direction: DVec3) -> Option<f64> {
        let ratio = self.distance_ratio;
        let cosine = direction.dot(self.nadir);
        let inner = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
        (cosine > 0.0 && inner > 0.0).then(|| {
            let distance = ratio * cosine - inner.sqrt();
            (distance * direction - ratio * self.nadir).dot(self.sun).max(0.0)
        })
    }

    /// The shares that a patch with these bundles sees. Where no bundle points at the planet, or at its lit part, the share of all open rays stands
    /// in.
    pub fn seen(&self, bundles: &[u32]) -> PlanetShares {
        let (mut all, mut open, mut lit, mut open_lit) = (0.0, 0.0, 0.0, 0.0);
        let free = bundles.iter().map(|word| open_share(*word)).sum::<f64>() / bundles.len().max(1) as f64;
        for word in bundles {
            if let Some(light) = self.lit(direction_of(*word)) {
                all += 1.0;
                open += open_share(*word);
                lit += light;
                open_lit += open_share(*word) * light;
            }
        }
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { free };
        PlanetShares { planet_ir: share(open, all), albedo: share(open_lit, lit) }
    }
}

/// The conditions on which the light of Sun and planet on a craft depends.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct FoundFor {
    /// Directions to the planet, to the Sun as the planet sees it, and to the Sun as the craft sees it, body frame. Zero without.
    pub(crate) directions: [DVec3; 3],
    /// Sunlight of the Sun and of the planet [W/m2].
    pub(crate) fluxes: [f64; 2],
    pub(crate) poses: Vec<DAffine3>,
    /// When the step starts [s].
    pub(crate) start: f64,
}

impl FoundFor {
    pub(crate) fn new(load: &StepLoad) -> Self {
        let mut directions = [DVec3::ZERO; 3];
        let mut fluxes = [load.sun.iter().map(|sample| sample.flux).sum(), 0.0];
        directions[2] = load.sun.iter().map(|sample| sample.flux * sample.direction).sum::<DVec3>().normalize_or_zero();
        if let Some(planet) = &load.planet {
            let (sine, cosine) = planet.sun_zenith.sin_cos();
            directions[0] = planet.nadir;
            directions[1] = planet.sunward * sine - planet.nadir * cosine;
            fluxes[1] = if load.albedo.is_some() { planet.albedo_flux } else { 0.0 };
        }
        Self { directions, fluxes, poses: load.joints.clone(), start: load.start }
    }

    /// Whether time has gone back since an earlier finding, or the warm-up has ended.
    fn restarts(&self, last: &Self) -> bool {
        self.start < last.start || (last.start < 0.0 && self.start >= 0.0)
    }

    /// How far Sun, planet or joints have turned since [rad]; infinite where sunlight has changed, where time goes back, or where the
    /// warm-up ends: so equal orbits find the light at equal times.
    fn turn(&self, now: &Self) -> f64 {
        if now.restarts(self) {
            return f64::INFINITY;
        }
        let apart = |(a, b): (&DVec3, &DVec3)| a.cross(*b).length().atan2(a.dot(*b));
        let alike = |(a, b): (&f64, &f64)| (a - b).abs() <= FLUX * a.max(*b);
        if !self.fluxes.iter().zip(&now.fluxes).all(alike) {
            return f64::INFINITY;
        }
        self.directions.iter().zip(&now.directions).map(apart).fold(turned(&self.poses, &now.poses), f64::max)
    }
}

/// The part of the exchange between patches that a step computes anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Due {
    /// Earlier results hold.
    Nothing,
    Infrared,
    /// Infrared and the light of Sun and planet.
    All,
}

/// When the exchange between patches is computed anew. Infrared: after some steps. Light of Sun and planet: after the planet, the Sun or a joint has
/// turned far enough against the craft, or sunlight has changed.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Renewal {
    /// Turn after which light is computed anew [rad].
    pub(crate) angle: f64,
    /// Most steps for which infrared is held.
    pub(crate) every: f64,
    /// Length of a step [s].
    step: f64,
    /// Time for which the last infrared was held when it was computed anew [s]. 0 where none came before.
    pub(crate) held: f64,
    /// Whether rows have changed since.
    new_rows: bool,
    /// The last computation. A saved state keeps it.
    pub(crate) last: LastFound,
}

/// The last computation of light and infrared.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct LastFound {
    /// Conditions for which light was last computed.
    found_for: Option<FoundFor>,
    /// Steps since light and since infrared were found.
    since: [f64; 2],
    /// Steps since infrared was found, whatever its rows.
    infrared: f64,
    /// How far Sun, planet or joints had turned since light was found, in the step before [rad].
    turn: f64,
    /// Part of the change from the finding of light before to the last one by which the light of the last one goes on: half of it leads to the middle of a turn that is as far, less the
    /// half of a step in whose middle the load lies. 0 where light, a joint or the craft jumped.
    pub(crate) lead: f64,
}

impl LastFound {
    /// How far Sun, planet or joints have turned since light was found [rad]; infinite where none was, or where it no longer tells anything.
    fn turn_to(&self, now: &FoundFor) -> f64 {
        self.found_for.as_ref().map_or(f64::INFINITY, |last| last.turn(now))
    }
}

impl Renewal {
    pub(crate) fn new(angle: f64, every: f64, step: f64) -> Self {
        Self { angle, every, step, ..Self::default() }
    }

    /// Lets the infrared count as held for long enough, because its rows have changed.
    pub(crate) fn new_rows(&mut self) {
        self.last.since[1] = self.every;
        self.new_rows = true;
    }

    /// Whether infrared would be held for too long if a load that lasts `steps` had it too.
    fn is_due(&self, steps: f64) -> bool {
        self.last.since[1] + steps > self.every + STILL
    }

    /// Whether Sun, planet or joints have turned, or turn before infrared is found the next time, so far that light must be found with it.
    fn is_far(&self, now: &FoundFor, infrared: bool, new_rows: bool) -> bool {
        let turn = self.last.turn_to(now);
        // Where nothing turns any more, what is a little off would be so for ever: the last light, or light by rows of other poses.
        let rests = (turn - self.last.turn).abs() <= STILL;
        if rests && (turn > STILL || self.last.lead > 0.0 || new_rows) {
            return true;
        }
        let ahead = if infrared { (self.every - 1.0).max(0.0) / self.last.since[0].max(1.0) } else { 0.0 };
        // Rounding must not count where the angle is 0.
        turn * (1.0 + ahead) > self.angle.max(STILL)
    }

    /// The part that must be computed anew for a load that lasts `steps`. The part counts as done then. `fresh` asks for all.
    pub(crate) fn due(&mut self, load: &StepLoad, steps: f64, fresh: bool) -> Due {
        let now = FoundFor::new(load);
        let infrared = self.is_due(steps);
        let new_rows = std::mem::take(&mut self.new_rows);
        let turn = if fresh { f64::INFINITY } else { self.last.turn_to(&now) };
        let goes_on = !fresh && self.last.found_for.as_ref().is_some_and(|last| !now.restarts(last));
        let due = if fresh || self.is_far(&now, infrared, new_rows) {
            let moved = turn - self.last.turn;
            let is_steady = turn.is_finite() && moved > STILL && self.last.turn > 0.0;
            self.last.lead = if is_steady { 0.5 * (1.0 - moved / turn).clamp(0.0, 1.0) } else { 0.0 };
            self.last.turn = 0.0;
            self.last.found_for = Some(now);
            self.last.since = [0.0; 2];
            Due::All
        } else {
            self.last.turn = turn;
            if infrared {
                self.last.since[1] = 0.0;
                Due::Infrared
            } else {
                Due::Nothing
            }
        };
        if due > Due::Nothing {
            self.held = if goes_on { self.step * self.last.infrared } else { 0.0 };
            self.last.infrared = 0.0;
        }
        self.last.infrared += steps;
        self.last.since = self.last.since.map(|since| since + steps);
        due
    }
}

#[cfg(test)]
mod tests;
