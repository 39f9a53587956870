//! Transitions on the device against the f64 reference: every function, both rules, both domains, all kinds of targets.

use std::sync::Arc;

use crate::random::Random;
use isotherm::gpu::context::Context;
use isotherm::gpu::response::{ResponseRun, respond};
use isotherm::thermal::function::{Function, Sample};
use isotherm::thermal::material::{Domain, Profile, Retarget, Transition};
use isotherm::thermal::transition::{TransitionState, transition_step};

fn device() -> Arc<Context> {
    Context::open(None, false).expect("a Vulkan device")
}

/// The f64 answer to what the device was given.
fn reference(transition: &Transition, run: &ResponseRun) -> Vec<f64> {
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

/// A measured step response with random rates.
fn noisy_table(rows: usize) -> Function {
    let mut random = Random(rows as u64);
    let mut temperature = 300.0;
    let points: Vec<(f64, f64)> = (0..rows)
        .map(|row| {
            temperature -= if row == 0 { 0.0 } else { random.unit().powi(3) * (-3.0 * row as f64 / rows as f64).exp() };
            (row as f64, temperature)
        })
        .collect();
    table(&points)
}

/// One difficult function of every kind.
fn shaped() -> Vec<Function> {
    let good = |function: Result<Function, _>| function.expect("a good function");
    let mut all = vec![
        good(Function::polynomial(&[0.0, 2.0, -1.0])),
        good(Function::polynomial(&[0.0, 0.0, 3.0, -2.0])),
        good(Function::polynomial(&[0.0, 0.0, 0.0, 10.0, -15.0, 6.0])),
        table(&[(0.0, 300.0), (1.0, 280.0), (2.0, 261.0), (4.0, 235.0), (7.0, 211.0), (9.0, 203.0), (12.0, 200.0)]),
        table(&[(0.0, 300.0), (1.0, 290.0), (1.5, 270.0), (5.0, 255.0), (5.5, 225.0), (8.0, 205.0), (10.0, 200.0)]),
        noisy_table(11),
        noisy_table(41),
    ];
    all.extend([0.01, 0.1, 3.0, 9.0, 20.0].map(|rate| good(Function::exponential(rate))));
    all.extend([1.0, 1.75, 2.0, 9.0, 100.0].map(|rate| good(Function::logarithmic(rate))));
    let texts = [
        "s*s*(3.0-2.0*s)",
        "smoothstep(0.0, 1.0, s)",
        "sin(1.57079633*s)",
        "1.0-acos(s)/1.57079633",
        "1.0-acos(s*s)/1.57079633",
        "log(1.0 + s) / log(2.0)",
        "mix(s, s*s, 0.5)",
        "tanh(2.0*s)/tanh(2.0)",
        "pow(s, 1.5)",
        "sqrt(s)",
        "(1.0-exp(-3.0*s))/(1.0-exp(-3.0))",
        "1.0-pow(1.0-s, 2.5)",
        "s < 0.4 ? 1.6*s : 0.64 + 0.6*(s-0.4)",
        "s < 0.123 ? 0.5*s : 0.0615 + 1.07012543*(s-0.123)",
    ];
    all.extend(texts.map(|text| good(Function::expression(text))));
    all
}

/// Targets of typical kinds within a span [K], for a number of steps.
fn runs(steps: usize, low: f64, high: f64, each: u64, random: &mut Random) -> Vec<(&'static str, ResponseRun)> {
    let span = high - low;
    let mut all = Vec::new();
    for number in 0..each {
        let mut add = |kind: &'static str, initial: f64, target: &mut dyn FnMut(usize) -> f64| {
            let targets = (1..=steps).map(|step| target(step) as f32).collect();
            all.push((kind, ResponseRun { initial: initial as f32, targets }));
        };
        let (from, to) = (random.between(low, high), random.between(low, high));
        add("step", from, &mut |_| to);
        let mut level = to;
        let mut rng = Random(number);
        add("steps", from, &mut |_| {
            if rng.unit() < 8.0 / steps as f64 {
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
        let phase = random.unit();
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

/// Largest error [K] for each kind of target.
fn errors(
    context: &Arc<Context>,
    transition: &Transition,
    runs: &[(&'static str, ResponseRun)],
) -> Vec<(&'static str, f64)> {
    let only: Vec<ResponseRun> = runs.iter().map(|(_, run)| run.clone()).collect();
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

/// Checks the largest error [K] of every function, kind of target and rule.
fn check(functions: &[Function], domain: Domain, t_max: f64, steps: usize, range: [f64; 2], limit: f64) {
    check_kinds(functions, domain, (t_max, steps), range, limit, |_| true);
}

fn check_kinds(
    functions: &[Function],
    domain: Domain,
    (t_max, steps): (f64, usize),
    [low, high]: [f64; 2],
    limit: f64,
    meant: fn(&str) -> bool,
) {
    let context = device();
    let mut moved = 0.0_f64;
    let mut over = Vec::new();
    for retarget in [Retarget::Merge, Retarget::Restart] {
        for function in functions {
            let transition = transition(function, t_max, retarget, domain);
            let mut runs = runs(steps, low, high, 3, &mut Random(1));
            runs.retain(|(kind, _)| meant(kind));
            for (kind, error) in errors(&context, &transition, &runs) {
                println!(
                    "{function}, {domain:?}, {t_max} steps, {low} to {high} K, {retarget:?}, {kind}: {error:.1e} K"
                );
                if error >= limit {
                    over.push(format!("{function}, {domain:?}, {t_max} steps, {retarget:?}, {kind}: {error:.1e} K"));
                }
            }
            let slower = Transition {
                heating: Profile { t_max_steps: 1.01 * t_max, ..transition.heating.clone() },
                ..transition.clone()
            };
            let only: Vec<ResponseRun> = runs.iter().map(|(_, run)| run.clone()).collect();
            let found = respond(&context, &slower, &only).expect("the device responds");
            let exact = reference(&transition, &only[0]);
            moved = exact.iter().zip(&found[0]).map(|(a, b)| (a - f64::from(*b)).abs()).fold(moved, f64::max);
        }
    }
    assert!(over.is_empty(), "beyond {limit:.0e} K:\n{}", over.join("\n"));
    assert!(moved > limit, "a hundredth of t_max must show: {moved:.1e} K");
}

#[test]
fn every_function_follows_its_twin_on_the_device() {
    check(&shaped(), Domain::Temperature, 100.0, 400, [2.7, 302.7], 5e-3);
}

#[test]
#[ignore = "long: tools/test --all"]
fn every_function_follows_its_twin_over_long_transitions() {
    check(&shaped(), Domain::Temperature, 361.0, 700, [2.7, 302.7], 5e-3);
    check(&shaped(), Domain::FourthPower, 100.0, 400, [150.0, 450.0], 5e-3);
    check(&shaped(), Domain::Temperature, 1000.0, 3000, [2.7, 302.7], 5e-3);
    check(&shaped(), Domain::FourthPower, 361.0, 700, [150.0, 450.0], 5e-3);
}

/// If a target moves all the time, such functions amplify rounding errors, even in f64. In a table that rests and then
/// leaps, 1e-6 K becomes 5e-3 K under a sine. With two lines that end at full rate, a ramp from rest ends exactly on a
/// step.
#[test]
fn functions_that_leap_or_end_early_follow_their_twin_where_the_target_is_held() {
    let functions = [
        table(&[(0.0, 300.0), (1.0, 300.0), (1.1, 270.0), (5.0, 268.0), (5.1, 215.0), (8.0, 200.0), (10.0, 200.0)]),
        Function::expression("min(1.0, 2.0*s)").expect("a good function"),
    ];
    let held = |kind: &str| matches!(kind, "step" | "steps" | "ulp jitter");
    for (t_max, steps) in [(100.0, 400), (1000.0, 3000)] {
        check_kinds(&functions, Domain::Temperature, (t_max, steps), [2.7, 302.7], 5e-3, held);
    }
}

/// The widest span of the paper.
#[test]
fn powers_follow_their_twin() {
    let powers = [Function::Linear, Function::Quadratic];
    check(&powers, Domain::Temperature, 100.0, 400, [2.7, 267.0], 5e-4);
    check(&powers, Domain::Temperature, 1.0, 200, [2.7, 1000.0], 5e-4);
    check(&powers, Domain::Temperature, 37.5, 300, [2.7, 1000.0], 5e-4);
}

/// Targets that are held for 1 to 12 steps, so that most moves reverse a transition under way.
fn reversals(steps: usize, [low, high]: [f64; 2], random: &mut Random) -> ResponseRun {
    let mut targets = Vec::new();
    while targets.len() < steps {
        let held = random.between(1.0, 13.0) as usize;
        targets.extend(vec![random.between(low, high) as f32; held]);
    }
    targets.truncate(steps);
    ResponseRun { initial: random.between(low, high) as f32, targets }
}

/// A branch with a t_max of 0 follows its target at once. Under `restart` the device once kept the closed gap of such a branch: up to 822 K too much.
#[test]
#[ignore = "long: tools/test --all"]
fn a_branch_that_is_immediate_follows_its_twin() {
    let context = device();
    let powers = [Function::Linear, Function::Quadratic];
    let shaped = shaped();
    let cases = [
        (&powers[..], Domain::Temperature, [2.7, 1000.0], 5e-4),
        (&powers[..], Domain::FourthPower, [150.0, 450.0], 5e-3),
        (&shaped[..], Domain::Temperature, [2.7, 302.7], 5e-3),
    ];
    let mut over = Vec::new();
    for (functions, domain, range, limit) in cases {
        let mut random = Random(3);
        let runs: Vec<ResponseRun> = (0..8).map(|_| reversals(240, range, &mut random)).collect();
        let apart = |kind: &Transition, found: &[Vec<f32>]| {
            let one = |(run, found): (&ResponseRun, &Vec<f32>)| {
                let exact = reference(kind, run);
                exact.iter().zip(found).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max)
            };
            runs.iter().zip(found).map(one).fold(0.0, f64::max)
        };
        for (retarget, cools) in [Retarget::Merge, Retarget::Restart].into_iter().flat_map(|r| [(r, false), (r, true)])
        {
            for function in functions {
                let with = |t_max: f64| {
                    let whole = transition(function, 37.5, retarget, domain);
                    let short = Profile { function: function.clone(), t_max_steps: t_max };
                    if cools { Transition { cooling: short, ..whole } } else { Transition { heating: short, ..whole } }
                };
                let kind = with(0.0);
                let found = respond(&context, &kind, &runs).expect("the device responds");
                let error = apart(&kind, &found);
                if error.is_nan() || error >= limit {
                    over.push(format!("{function}, {domain:?}, {retarget:?}, cooling at once {cools}: {error:.1e} K"));
                }
                let slower = apart(&with(3.0), &found);
                assert!(
                    slower > 2.0 * limit,
                    "{function}, {domain:?}, {retarget:?}: 3 steps must show: {slower:.1e} K"
                );
            }
        }
    }
    assert!(over.is_empty(), "{}", over.join("\n"));
}

/// The tolerances that are stated for long transitions.
#[test]
#[ignore = "long: tools/test --all"]
fn powers_follow_their_twin_however_long_they_take() {
    let powers = [Function::Linear, Function::Quadratic];
    check(&powers, Domain::Temperature, 361.0, 700, [2.7, 500.0], 5e-4);
    check(&powers, Domain::Temperature, 1000.0, 3000, [2.7, 1000.0], 5e-4);
    check(&powers, Domain::Temperature, 60_000.0, 90_000, [290.0, 292.0], 1e-3);
    check(&powers, Domain::Temperature, 60_000.0, 90_000, [180.0, 380.0], 0.03);
}

/// An even ramp from rest meets its target exactly on a whole step, when a linear transition ends at full rate. There
/// the lag falls from half of `t_max` to zero. Rounding must not delay it.
#[test]
fn a_linear_ramp_from_rest_is_over_on_its_whole_step() {
    let context = device();
    for (t_max, slope, initial) in [(10.0, 0.25, 100.0), (50.0, 1.0, 2.7), (100.0, -0.125, 400.0), (361.0, 0.3, 20.5)] {
        let transition = transition(&Function::Linear, t_max, Retarget::Merge, Domain::Temperature);
        let targets = (1..=(5.0 * t_max) as usize).map(|step| (initial + slope * step as f64) as f32).collect();
        let run = ResponseRun { initial: initial as f32, targets };
        let found = respond(&context, &transition, std::slice::from_ref(&run)).expect("the device responds").remove(0);
        let exact = reference(&transition, &run);
        let error = exact.iter().zip(&found).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
        assert!(error < 5e-4, "{slope} K a step in {t_max} steps: {error:.1e} K");
        // After n steps the clock shows (n + 1) / 2 steps. It shows t_max at n = 2 t_max - 1.
        let end = 2 * t_max as usize - 1;
        for (step, settled) in [(end - 1, false), (end, true), (end + 1, false)] {
            assert_eq!(found[step - 1] == run.targets[step - 1], settled, "{slope} K a step in {t_max}: step {step}");
        }
    }
}

/// docs/numerics.md 1: quadratic, t_max 100, from 2.7 K, 267 K commanded at step 1 and 350 K at step 51.
#[test]
fn the_command_prints_the_values_of_the_paper_with_a_moved_target() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("targets.csv"), "step,target\n1,267\n51,350\n125,350\n").expect("a file");
    let values = |cooling: &str, device: &[&str]| -> Vec<f64> {
        let fixed = ["response", "--heating", "quadratic:100", "--cooling", cooling, "--initial", "2.7"];
        let ran = super::program::run(folder.path(), &[&fixed[..], &["--targets", "targets.csv"], device].concat());
        assert_eq!(ran.code, 0, "{}", ran.err);
        let rows = ran.out.lines().skip(1).map(|line| line.split(',').nth(1).and_then(|value| value.parse().ok()));
        rows.collect::<Option<_>>().expect("step,temperature")
    };
    for device in [&[][..], &["--device", "cpu"]] {
        let found = values("linear:10", device);
        assert_eq!(found.len(), 126);
        for (step, expected) in [(0, 2.7), (50, 200.925), (51, 205.196_949), (60, 240.849_884), (125, 350.0)] {
            assert!((found[step] - expected).abs() < 2e-4, "step {step}: {} against {expected}", found[step]);
        }
        assert!((found[52] - 205.196_949).abs() > 1.0, "a step later must show");
    }
}

/// docs/numerics.md 1: under `restart` a target counts as moved beyond 0.7 mK. Device and f64 must decide alike, or one of
/// them becomes an exponential lag, 88 K away.
#[test]
fn a_jitter_of_the_target_restarts_on_the_device_where_it_does_in_f64() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let values = |jitter: f64, function: &str, domain: &str, device: &[&str]| -> Vec<f64> {
        let row = |step: u32| format!("{step},{:.10}\n", 267.0 + f64::from(step % 2) * jitter);
        let text: String = (1..=361).map(row).collect();
        std::fs::write(folder.path().join("targets.csv"), format!("step,target\n{text}")).expect("a file");
        let function = format!("{function}:361");
        let fixed = ["response", "--heating", &function, "--cooling", &function, "--initial", "2.7"];
        let rest = ["--targets", "targets.csv", "--retarget", "restart", "--domain", domain];
        let ran = super::program::run(folder.path(), &[&fixed[..], &rest, device].concat());
        assert_eq!(ran.code, 0, "{}", ran.err);
        let rows = ran.out.lines().skip(1).map(|line| line.split(',').nth(1).and_then(|value| value.parse().ok()));
        rows.collect::<Option<_>>().expect("step,temperature")
    };
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    for (function, domain) in [("quadratic", "T"), ("expression=s*s*(3.0-2.0*s)", "T"), ("quadratic", "T4")] {
        let still = values(0.0, function, domain, &["--device", "cpu"]);
        for (jitter, moved) in
            [(1e-9, false), (1e-5, false), (5e-4, false), (6.3e-4, false), (7.7e-4, true), (1e-3, true)]
        {
            let exact = values(jitter, function, domain, &["--device", "cpu"]);
            let found = values(jitter, function, domain, &[]);
            let (error, effect) = (apart(&exact, &found), apart(&exact, &still));
            assert!(error < 5e-3, "{function} in {domain}, {jitter} K: {error} K");
            assert_eq!(effect > 1.0, moved, "{function} in {domain}, {jitter} K moves it by {effect} K");
        }
    }
}
