//! Hard cases of transitions: wide and narrow steps, extreme t_max, jittering targets, late retargets, and a whole day.

use std::f64::consts::TAU;

use super::case::{CaseScale, HardCase, apart, worst_of};
use super::exact::curve;
use super::plain::{self, Omission};
use crate::simulation::target::{Target, respond_f64};
use crate::thermal::function::Function;
use crate::thermal::material::{Domain, Profile, Retarget, Transition};

/// Error limit for the values of docs/numerics.md 1 [K], and its source.
const VALUES: (f64, &str) = (2e-4, "docs/numerics.md 6, values of 1");
/// Error limit for t_max up to 1000 steps [K], and its source.
const SHORT: (f64, &str) = (5e-4, "docs/numerics.md 6, t_max up to 1000 steps");
/// Error limits for t_max of 60,000 steps and targets that move by 2 K and by 200 K [K], and their sources.
const LONG: [(f64, &str); 2] =
    [(1e-3, "docs/numerics.md 6, 60,000 steps, 2 K"), (0.03, "docs/numerics.md 6, 60,000 steps, 200 K")];
/// Steps at 10 Hz in an orbit of 6017 s, and in a day.
const ORBIT: usize = 60_170;
const DAY: usize = 864_000;

fn along(power: i32, t_max: f64) -> Transition {
    let function = if power == 1 { Function::Linear } else { Function::Quadratic };
    let profile = Profile { function, t_max_steps: t_max };
    Transition { heating: profile.clone(), cooling: profile, retarget: Retarget::Merge, domain: Domain::Temperature }
}

fn exact(targets: &[f32]) -> Vec<f64> {
    targets.iter().copied().map(f64::from).collect()
}

/// A node, its targets, and its expected temperatures after every step.
struct Commanded {
    power: i32,
    t_max: f64,
    initial: f32,
    targets: Vec<f32>,
    expected: Vec<f64>,
}

impl Commanded {
    fn error(&self, target: &Target) -> Result<f64, String> {
        let temperatures =
            target.respond(&along(self.power, self.t_max), f64::from(self.initial), &exact(&self.targets));
        Ok(apart(&temperatures.map_err(|error| error.to_string())?, &self.expected))
    }

    fn without(&self, omitted: Omission) -> f64 {
        let initial = f64::from(self.initial);
        apart(&plain::transition(self.power, self.t_max, initial, &self.targets, omitted), &self.expected)
    }

    fn in_plain_f32(&self) -> f64 {
        apart(&plain::merge_f32(self.power, self.t_max as f32, self.initial, &self.targets), &self.expected)
    }
}

/// Targets that hold for some steps each. The node reaches each curve at rest, so the result has a closed form.
fn held(power: i32, t_max: f64, initial: f32, holds: &[(f32, usize)]) -> Commanded {
    let (mut targets, mut expected) = (Vec::new(), Vec::new());
    let mut old = f64::from(initial);
    for (target, steps) in holds {
        targets.extend(std::iter::repeat_n(*target, *steps));
        expected.extend((1..=*steps).map(|step| curve(power, t_max, old, f64::from(*target), step as f64)));
        old = expected.last().copied().unwrap_or(old);
    }
    Commanded { power, t_max, initial, targets, expected }
}

/// From 2.7 K to 1000 K and back. Each target holds for 1.5 times the duration.
fn wide() -> Vec<Commanded> {
    let both = |power, t_max: f64| {
        let steps = (1.5 * t_max) as usize;
        held(power, t_max, 2.7, &[(1000.0, steps), (2.7, steps)])
    };
    vec![both(1, 100.0), both(2, 100.0), both(1, 361.0), both(2, 361.0)]
}

/// From 2.7 K to 5 K and back before the end, then once more to the end.
fn narrow() -> Vec<Commanded> {
    let both = |power| held(power, 100.0, 2.7, &[(5.0, 50), (2.7, 150), (5.0, 150), (2.7, 150)]);
    vec![both(1), both(2)]
}

/// A new target every step. If t_max is at most 1, the temperature equals the target.
fn every_step(t_max: f64) -> Vec<Commanded> {
    let mut bits = 1u64;
    let targets: Vec<f32> = (0..300)
        .map(|_| {
            // Any sequence works. This is Knuth's MMIX generator.
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            2.7 + 997.3 * ((bits >> 40) as f32 / (1u32 << 24) as f32)
        })
        .collect();
    let expected: Vec<f64> = targets.iter().map(|target| f64::from(*target)).collect();
    let commanded_at =
        |power| Commanded { power, t_max, initial: 300.0, targets: targets.clone(), expected: expected.clone() };
    vec![commanded_at(1), commanded_at(2)]
}

/// A target that swings around 280 K once an orbit. The expected result comes from the f64 reference.
fn swinging(t_max: f64, swing: f64, steps: usize) -> Commanded {
    let targets: Vec<f32> =
        (1..=steps).map(|step| (280.0 + swing * (TAU * step as f64 / ORBIT as f64).sin()) as f32).collect();
    let expected = respond_f64(&along(2, t_max), 280.0, &exact(&targets));
    Commanded { power: 2, t_max, initial: 280.0, targets, expected }
}

/// From 2.7 K to 267 K. The target alternates between it and the next larger f32.
fn jitter() -> Vec<Commanded> {
    let commanded_at = |power| {
        let targets: Vec<f32> =
            (0..150).map(|step| if step % 2 == 0 { 267.0 } else { f32::from_bits(267f32.to_bits() + 1) }).collect();
        let expected = (1..=150).map(|step| curve(power, 100.0, f64::from(2.7f32), 267.0, f64::from(step))).collect();
        Commanded { power, t_max: 100.0, initial: 2.7, targets, expected }
    };
    vec![commanded_at(1), commanded_at(2)]
}

/// From 2.7 K to 267 K in 100 steps, with 268 K on the last step. Computed by hand from docs/numerics.md 1.
fn last_step() -> Commanded {
    let targets: Vec<f32> = (1..=150).map(|step| if step < 100 { 267.0 } else { 268.0 }).collect();
    let old = f64::from(2.7f32);
    let first = (1..100).map(|step| curve(2, 100.0, old, 267.0, f64::from(step)));
    // State after step 99: r = 0.01. Gap and rate follow with d = 1 K.
    let (gap, rate) = ((267.0 - old) * 1e-4 + 1.0, (267.0 - old) * 1e-2 + 1.0);
    let r = gap / rate;
    let span = gap / (r * r);
    let later = (100..=150).map(|step: i32| {
        let left = (r - f64::from(step - 99) / 100.0).max(0.0);
        268.0 - span * left * left
    });
    let expected = first.chain(later).collect();
    Commanded { power: 2, t_max: 100.0, initial: 2.7, targets, expected }
}

/// An even ramp from rest with a linear transition, which ends at full rate on a whole step.
fn ramp() -> Commanded {
    let (t_max, slope, initial) = (361.0, 0.3f64, 20.5f64);
    let targets: Vec<f32> = (1..=3 * 721).map(|step| (initial + slope * f64::from(step)) as f32).collect();
    let expected = respond_f64(&along(1, t_max), initial, &exact(&targets));
    Commanded { power: 1, t_max, initial: initial as f32, targets, expected }
}

/// A case with the largest error of several nodes.
fn commanded(case: HardCase, nodes: fn(CaseScale) -> Vec<Commanded>, without: fn(&Commanded) -> f64) -> HardCase {
    let worst = move |target: &Target, scale| {
        nodes(scale).iter().try_fold(0.0, |worst, node| Ok(worst_of(worst, node.error(target)?)))
    };
    case.measured(worst, move |scale| nodes(scale).iter().map(without).fold(0.0, worst_of))
}

pub(crate) fn cases() -> Vec<HardCase> {
    let mut cases = range_cases();
    cases.extend(retarget_cases());
    cases
}

fn case(name: &str, description: &str, limit: (f64, &'static str)) -> HardCase {
    HardCase::new(name, description, "K", limit)
}

/// A case that is compared with the f64 reference.
fn reference_case(name: &str, description: &str, limit: (f64, &'static str)) -> HardCase {
    HardCase { expects_reference: true, ..case(name, description, limit) }
}

/// Cases of wide and narrow ranges and of extreme t_max.
fn range_cases() -> Vec<HardCase> {
    vec![
        commanded(
            case(
                "2.7 to 1000 K in one step and back",
                "linear and quadratic in 100 and 361 steps, held after the end; closed form",
                VALUES,
            )
            .remedy("time stops at t_max, and the end of a transition is its target itself", "time runs on"),
            |_| wide(),
            |node| node.without(Omission::Clamp),
        ),
        commanded(
            case("2.7 to 5 K and back", "turned back half-way, then all the way; closed form", VALUES).remedy(
                "a change of direction is a fresh transition from the present temperature",
                "the phase is kept",
            ),
            |_| narrow(),
            |node| node.without(Omission::FreshStart),
        ),
        commanded(
            case("t_max 0", "another target every step, 2.7 to 1000 K: the temperature is the target", VALUES).remedy(
                "no time is left where t_max is 0, and nothing is divided by it",
                "elapsed / t_max is not a number",
            ),
            |_| every_step(0.0),
            |node| node.without(Omission::Immediate),
        ),
        commanded(
            case("t_max 1", "another target every step, 2.7 to 1000 K: the temperature is the target", VALUES)
                .remedy("time advances before the temperature is read", "read before time advances: the node freezes"),
            |_| every_step(1.0),
            |node| node.without(Omission::AdvanceFirst),
        ),
        commanded(
            reference_case(
                "t_max 60,000, targets over 2 K",
                "quadratic, target a sine of one orbit at 10 Hz; the f64 reference",
                LONG[0],
            )
            .remedy(
                "the span is stored, and the clock counts powers of two of a step",
                "f32 with old, target and elapsed",
            ),
            |scale| vec![swinging(60_000.0, 1.0, scale.of(ORBIT / 2, ORBIT, ORBIT))],
            Commanded::in_plain_f32,
        ),
        commanded(
            reference_case(
                "t_max 60,000, targets over 200 K",
                "quadratic, target a sine of one orbit at 10 Hz; the f64 reference",
                LONG[1],
            )
            .remedy(
                "the span is stored, and the clock counts powers of two of a step",
                "f32 with old, target and elapsed",
            ),
            |scale| vec![swinging(60_000.0, 100.0, scale.of(ORBIT / 2, ORBIT, ORBIT))],
            Commanded::in_plain_f32,
        ),
    ]
}

/// Cases of jittering targets, of retargets, and of a whole day.
fn retarget_cases() -> Vec<HardCase> {
    vec![
        commanded(
            case(
                "targets that jitter by one ulp",
                "267 K and the next f32 in turn, from 2.7 K in 100 steps; closed form without the jitter",
                SHORT,
            )
            .remedy("gap and rate of the transition under way are merged with those of the new step", "restart at every change"),
            |_| jitter(),
            |node| node.without(Omission::Merge),
        ),
        commanded(
            case(
                "retarget on the last step",
                "267 K in 100 steps, 268 K on the 100th; the merge rule by hand",
                VALUES,
            )
            .remedy("gap and rate of the transition under way are merged with those of the new step", "the phase is kept"),
            |_| vec![last_step()],
            |node| node.without(Omission::FreshStart),
        ),
        commanded(
            reference_case(
                "retarget on the last step of a linear ramp",
                "0.3 K a step in 361 steps, which ends at full rate on whole steps; the f64 reference",
                SHORT,
            )
            .remedy("less than 2^-22 of its time left is over, and the clock counts powers of two of a step", "f32 with old, target and elapsed"),
            |_| vec![ramp()],
            Commanded::in_plain_f32,
        ),
        commanded(
            reference_case(
                "a day of a short transition at 10 Hz",
                "864,000 steps (60,170 in --quick) of t_max 361, target a sine of +-100 K an orbit; the f64 reference",
                SHORT,
            )
            .remedy("a target that moves takes the rate of what is under way over", "restart at every change"),
            |scale| vec![swinging(361.0, 100.0, scale.of(ORBIT / 4, ORBIT, DAY))],
            |node| node.without(Omission::Merge),
        ),
        commanded(
            reference_case(
                "a day of a long transition at 10 Hz",
                "864,000 steps (60,170 in --quick) of t_max 60,000, target a sine of +-100 K an orbit; the f64 reference",
                LONG[1],
            )
            .remedy("the span is stored, and the clock counts powers of two of a step", "f32 with old, target and elapsed"),
            |scale| vec![swinging(60_000.0, 100.0, scale.of(ORBIT / 2, ORBIT, DAY))],
            Commanded::in_plain_f32,
        ),
    ]
}
