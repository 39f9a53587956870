//! Transitions on the device against the f64 reference: every function, both rules, both domains, all kinds of targets.

use std::sync::Arc;

use isotherm::gpu::context::Context;
use isotherm::gpu::response::{Run, respond};
use isotherm::thermal::function::{Function, Sample};
use isotherm::thermal::material::{Domain, Profile, Retarget, Transition};
use isotherm::thermal::transition::{TransitionState, transition_step};

fn device() -> Arc<Context> {
    Context::open(None, false).expect("a Vulkan device")
}

/// Numbers in [0, 1) that are the same in every run (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// The f64 answer to what the device was given.
fn reference(transition: &Transition, run: &Run) -> Vec<f64> {
    let mut state = TransitionState::settled(f64::from(run.initial), transition);
    run.targets
        .iter()
        .map(|target| {
            let (next, t) = transition_step(state, f64::from(*target), 1.0, transition);
            state = next;
            t
        })
        .collect()
}

fn table(points: &[(f64, f64)]) -> Function {
    let samples: Vec<_> = points.iter().map(|&(time, temperature)| Sample { time, temperature }).collect();
    Function::table(&samples, None).expect("a good table")
}

/// One of every kind, and what is awkward about each.
fn functions() -> Vec<Function> {
    let good = |function: Result<Function, _>| function.expect("a good function");
    vec![
        Function::Linear,
        Function::Quadratic,
        good(Function::polynomial(&[0.0, 2.0, -1.0])),
        good(Function::polynomial(&[0.0, 0.0, 3.0, -2.0])),
        good(Function::exponential(0.01)),
        good(Function::exponential(3.0)),
        good(Function::exponential(9.0)),
        good(Function::logarithmic(1.0)),
        good(Function::logarithmic(9.0)),
        good(Function::logarithmic(100.0)),
        table(&[(0.0, 300.0), (1.0, 280.0), (2.0, 261.0), (4.0, 235.0), (7.0, 211.0), (9.0, 203.0), (12.0, 200.0)]),
        good(Function::expression("s*s*(3.0-2.0*s)")),
        good(Function::expression("sin(1.5707963*s)")),
    ]
}

/// Targets of the kinds that a node meets, each within a span [K]; `steps` of them.
fn runs(steps: usize, low: f64, high: f64, each: u64, random: &mut Random) -> Vec<(&'static str, Run)> {
    let span = high - low;
    let mut all = Vec::new();
    for number in 0..each {
        let mut add = |kind: &'static str, initial: f64, target: &mut dyn FnMut(usize) -> f64| {
            let targets = (1..=steps).map(|step| target(step) as f32).collect();
            all.push((kind, Run { initial: initial as f32, targets }));
        };
        let (from, to) = (random.between(low, high), random.between(low, high));
        add("step", from, &mut |_| to);
        let mut level = to;
        let mut rng = Random(number);
        add("steps", from, &mut |_| {
            if rng.next() < 8.0 / steps as f64 {
                level = rng.between(low, high);
            }
            level
        });
        add("ulp jitter", from, &mut |step| {
            let to = to as f32;
            f64::from(if step % 2 == 0 { to } else { to.next_up() })
        });
        let mut rng = Random(number + 100);
        let size = span * 10f64.powf(-2.0 - number as f64);
        add("jitter", from, &mut |_| (to + size * rng.between(-1.0, 1.0)).clamp(low, high));
        add("ramp", from, &mut |step| from + (to - from) * step as f64 / steps as f64);
        let periods = random.between(0.5, 6.0);
        let phase = random.next();
        add("sine", from, &mut |step| {
            let turn = std::f64::consts::TAU * (phase + periods * step as f64 / steps as f64);
            0.5 * (low + high) + 0.5 * span * turn.sin()
        });
        let period = (steps as f64 / periods).max(4.0);
        add("saw", from, &mut |step| {
            let x = (step as f64 / period).fract();
            low + span * (2.0 * x - 1.0).abs()
        });
    }
    all
}

fn transition(function: &Function, t_max_steps: f64, retarget: Retarget, domain: Domain) -> Transition {
    let profile = Profile { function: function.clone(), t_max_steps };
    Transition { heating: profile.clone(), cooling: profile, retarget, domain }
}

/// Worst error [K] of each kind of target.
fn errors(context: &Arc<Context>, transition: &Transition, runs: &[(&'static str, Run)]) -> Vec<(&'static str, f64)> {
    let only: Vec<Run> = runs.iter().map(|(_, run)| run.clone()).collect();
    let found = respond(context, transition, &only).expect("the device responds");
    let mut worst: Vec<(&'static str, f64)> = Vec::new();
    for ((kind, run), found) in runs.iter().zip(found) {
        let exact = reference(transition, run);
        let error = exact.iter().zip(&found).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
        match worst.iter_mut().find(|(known, _)| known == kind) {
            Some((_, known)) => *known = known.max(error),
            None => worst.push((kind, error)),
        }
    }
    worst
}

#[test]
fn survey() {
    let context = device();
    for (t_max, steps, low, high) in
        [(100.0, 400, 2.7, 267.0), (361.0, 1000, 2.7, 500.0), (1000.0, 3000, 100.0, 400.0), (1000.0, 3000, 2.7, 1000.0)]
    {
        for domain in [Domain::Temperature, Domain::FourthPower] {
            for retarget in [Retarget::Merge, Retarget::Restart] {
                for function in functions() {
                    let transition = transition(&function, t_max, retarget, domain);
                    let found = errors(&context, &transition, &runs(steps, low, high, 6, &mut Random(1)));
                    let list: Vec<String> = found.iter().map(|(k, e)| format!("{k} {e:.1e}")).collect();
                    println!("{t_max} {low}-{high} {domain:?} {retarget:?} {function}: {}", list.join(", "));
                }
            }
        }
    }
}

#[test]
fn survey_slow() {
    let context = device();
    for (t_max, steps, low, high) in [(60_000.0, 60_000, 299.0, 301.0), (60_000.0, 60_000, 200.0, 400.0)] {
        for domain in [Domain::Temperature, Domain::FourthPower] {
            for retarget in [Retarget::Merge, Retarget::Restart] {
                for function in functions() {
                    let transition = transition(&function, t_max, retarget, domain);
                    let found = errors(&context, &transition, &runs(steps, low, high, 1, &mut Random(1)));
                    let list: Vec<String> = found.iter().map(|(k, e)| format!("{k} {e:.1e}")).collect();
                    println!("{t_max} {low}-{high} {domain:?} {retarget:?} {function}: {}", list.join(", "));
                }
            }
        }
    }
}
#[test]
fn where_it_parts() {
    let context = device();
    let table =
        table(&[(0.0, 300.0), (1.0, 280.0), (2.0, 261.0), (4.0, 235.0), (7.0, 211.0), (9.0, 203.0), (12.0, 200.0)]);
    for function in [Function::logarithmic(9.0).unwrap(), table] {
        let Function::Shaped(shape) = &function else { panic!() };
        println!("Temp {function} turns {:?}", shape.turns());
        let n = 60_000;
        let transition = transition(&function, n as f64, Retarget::Merge, Domain::Temperature);
        let to = 300f32;
        for size in [3.1e-5f32, 1e-3, 1e-2, 0.1] {
            let still = reference(&transition, &Run { initial: 299.0, targets: vec![to; n] });
            let mut rng = Random(5);
            let alternating = Run {
                initial: 299.0,
                targets: (1..=n).map(|step| if step % 2 == 0 { to } else { to + size }).collect(),
            };
            let random =
                Run { initial: 299.0, targets: (1..=n).map(|_| to + size * rng.between(-1.0, 1.0) as f32).collect() };
            let both = [alternating, random];
            let found = respond(&context, &transition, &both).unwrap();
            for (run, found) in both.iter().zip(found) {
                let exact = reference(&transition, run);
                let cost = exact.iter().zip(&still).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let error = exact.iter().zip(&found).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
                let start = (0..n).find(|i| (exact[*i] - f64::from(found[*i])).abs() > 1e-4);
                println!("Temp size {size}: cost in f64 {cost:.2e}, error {error:.2e} from {start:?}");
            }
        }
    }
}
