//! Values of docs/numerics.md 1, properties of the rule `merge`, and rules that fail.

use super::*;
use crate::thermal::function::{Function, TemperatureSample};
use crate::thermal::material::Domain;

#[allow(unreachable_pub)]
#[path = "../../../tests/it/random.rs"]
pub(crate) mod random;

pub(super) use random::Random;

const QUADRATIC: fn(f64) -> Profile = |t_max_steps| Profile { function: Function::Quadratic, t_max_steps };
const LINEAR: fn(f64) -> Profile = |t_max_steps| Profile { function: Function::Linear, t_max_steps };

/// A transition of T with the same function for heating and cooling.
fn same(profile: Profile, retarget: Retarget) -> Transition {
    Transition { heating: profile.clone(), cooling: profile, retarget, domain: Domain::Temperature }
}

/// Temperatures at steps 0, 1, ..., n for the targets of steps 1, ..., n, with one function for heating and cooling.
fn run(profile: Profile, rule: Retarget, initial: f64, steps: usize, target: impl Fn(usize) -> f64) -> Vec<f64> {
    run_transition(&same(profile, rule), initial, steps, target)
}

/// Temperatures at steps 0, 1, ..., n for any transition.
fn run_transition(transition: &Transition, initial: f64, steps: usize, target: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut state = TransitionState::settled(initial, transition);
    let mut temperatures = vec![initial];
    for step in 1..=steps {
        let (next, t) = transition_step(state, target(step), 1.0, transition);
        state = next;
        temperatures.push(t);
    }
    temperatures
}

/// A step and its temperature [K].
type At = (usize, f64);

/// Largest distance between a run and expected (step, temperature) pairs.
fn worst(temperatures: &[f64], expected: &[At]) -> f64 {
    expected.iter().map(|&(step, t)| (temperatures[step] - t).abs()).fold(0.0, f64::max)
}

/// docs/numerics.md prints six decimals.
const PRINTED: f64 = 5.1e-7;

/// Figures 5 and 6 of Vural et al. 2023, quadratic (docs/numerics.md 1): initial, target, t_max, T at steps 0 1 50 100 180 361 1000.
#[rustfmt::skip]
const FIGURES_5_AND_6: [(f64, f64, f64, [f64; 7]); 10] = [
    (2.7, 267.0, 361.0, [2.7, 4.162238, 70.843124, 128.845901, 200.558427, 267.0, 267.0]),
    (2.7, 267.0, 100.0, [2.7, 7.959570, 200.925, 267.0, 267.0, 267.0, 267.0]),
    (2.7, 267.0, 1000.0, [2.7, 3.228336, 28.469250, 52.917, 89.284680, 159.080760, 267.0]),
    (500.0, 2.7, 361.0, [500.0, 497.248691, 371.783673, 262.647156, 127.714735, 2.7, 2.7]),
    (500.0, 2.7, 100.0, [500.0, 490.103730, 127.025, 2.7, 2.7, 2.7, 2.7]),
    (500.0, 2.7, 1000.0, [500.0, 499.005897, 451.513250, 405.513, 337.084520, 205.758033, 2.7]),
    (2.7, 1000.0, 100.0, [2.7, 22.546270, 750.675, 1000.0, 1000.0, 1000.0, 1000.0]),
    (1000.0, 2.7, 100.0, [1000.0, 980.153730, 252.025, 2.7, 2.7, 2.7, 2.7]),
    (2.7, 5.0, 100.0, [2.7, 2.745770, 4.425, 5.0, 5.0, 5.0, 5.0]),
    (5.0, 2.7, 100.0, [5.0, 4.954230, 3.275, 2.7, 2.7, 2.7, 2.7]),
];

#[test]
fn quadratic_figures_5_and_6() {
    for rule in [Retarget::Merge, Retarget::Restart] {
        for (initial, target, t_max, expected) in FIGURES_5_AND_6 {
            let pairs: Vec<_> = [0, 1, 50, 100, 180, 361, 1000].into_iter().zip(expected).collect();
            let error = worst(&run(QUADRATIC(t_max), rule, initial, 1000, |_| target), &pairs);
            assert!(error < PRINTED, "{initial} -> {target} in {t_max}: {error} K");
            let late = worst(&run(QUADRATIC(t_max + 0.01), rule, initial, 1000, |_| target), &pairs);
            assert!(late > PRINTED, "a t_max 0.01 steps too long must show");
        }
    }
}

#[test]
fn linear_figure_5() {
    let cases = [
        (2.7, 267.0, 361.0, [3.432133, 39.306648, 75.913296, 134.483934, 267.0]),
        (2.7, 267.0, 1000.0, [2.9643, 15.915, 29.13, 50.274, 98.1123]),
        (500.0, 2.7, 361.0, [498.622438, 431.121884, 362.243767, 252.038781, 2.7]),
        (500.0, 2.7, 1000.0, [499.5027, 475.135, 450.27, 410.486, 320.4747]),
    ];
    for (initial, target, t_max, expected) in cases {
        let pairs: Vec<_> = [1, 50, 100, 180, 361].into_iter().zip(expected).collect();
        let error = worst(&run(LINEAR(t_max), Retarget::Merge, initial, 361, |_| target), &pairs);
        assert!(error < PRINTED, "{initial} -> {target} in {t_max}: {error} K");
        assert!(worst(&run(QUADRATIC(t_max), Retarget::Merge, initial, 361, |_| target), &pairs) > 1.0);
    }
}

#[test]
fn moving_targets() {
    let cases: [(usize, f64, &[At]); 4] = [
        (51, 350.0, &[(50, 200.925), (51, 205.196949), (60, 240.849884), (100, 338.447090), (125, 350.0)]),
        (51, 210.0, &[(50, 200.925), (51, 202.365768), (60, 209.731835), (75, 210.0)]),
        (51, 120.0, &[(50, 200.925), (51, 199.314593), (100, 140.23125), (150, 120.0)]),
        (100, 268.0, &[(100, 267.045137), (101, 267.114118), (125, 267.993881)]),
    ];
    for (at, second, expected) in cases {
        let target = |step| if step < at { 267.0 } else { second };
        let error = worst(&run(QUADRATIC(100.0), Retarget::Merge, 2.7, 150, target), expected);
        assert!(error < PRINTED, "-> {second} at {at}: {error} K");
        let late = |step| if step <= at { 267.0 } else { second };
        assert!(worst(&run(QUADRATIC(100.0), Retarget::Merge, 2.7, 150, late), expected) > 1e-3);
    }
}

#[test]
fn lag_behind_a_ramp() {
    let ramp = |step: usize| 100.0 + 0.25 * step as f64;
    let lag = |t_max, rule| -> Vec<f64> {
        let t = run(QUADRATIC(t_max), rule, 100.0, 500, ramp);
        [10, 50, 100, 200, 500].iter().map(|&step| ramp(step) - t[step]).collect()
    };
    let expected = [2.234622, 7.190054, 7.916822, 6.182499, 6.125940];
    let error = |lags: Vec<f64>| lags.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error(lag(100.0, Retarget::Merge)) < PRINTED, "{:?}", lag(100.0, Retarget::Merge));
    assert!(error(lag(101.0, Retarget::Merge)) > 0.01);
    assert!(error(lag(100.0, Retarget::Restart)) > 0.1);
}

#[test]
fn zero_t_max_is_immediate() {
    let temperatures = run(QUADRATIC(0.0), Retarget::Merge, 300.0, 9, |step| 10.0 * step as f64);
    assert!((1..=9).all(|step| temperatures[step] == 10.0 * step as f64));
    let transition = Transition { cooling: QUADRATIC(10.0), ..same(LINEAR(0.0), Retarget::Merge) };
    let state = TransitionState::settled(100.0, &transition);
    let (state, t) = transition_step(state, 50.0, 1.0, &transition);
    assert!((t - (50.0 + 50.0 * 0.81)).abs() < 1e-12, "cooling is gradual");
    let (_, t) = transition_step(state, 200.0, 1.0, &transition);
    assert_eq!(t, 200.0, "heating is immediate");
}

fn jittered() -> Vec<Profile> {
    let t_max = [361.0, 7.0, 1000.0];
    functions().into_iter().enumerate().map(|(i, function)| Profile { function, t_max_steps: t_max[i % 3] }).collect()
}

/// A target that moves by one ulp at every step must not change the curve. Under `restart` that holds up to [`MOVED`] (docs/numerics.md 1: restarting at
/// every change costs 42 K).
#[test]
fn jitter_of_one_ulp_costs_nothing() {
    for profile in jittered() {
        for initial in [2.7, 266.0, 500.0] {
            let still = run(profile.clone(), Retarget::Merge, initial, 1000, |_| 267.0);
            let cost = |rule, other: f64| {
                let jitter = |step: usize| if step.is_multiple_of(2) { 267.0 } else { other };
                let shaken = run(profile.clone(), rule, initial, 1000, jitter);
                still.iter().zip(shaken).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            for rule in [Retarget::Merge, Retarget::Restart] {
                let moved = cost(rule, 267.0_f64.next_up());
                assert!(moved < 1e-9, "{rule:?}, {profile:?} from {initial}: {moved} K");
            }
            // A restarted exponential hardly changes. A restarted power does.
            if profile.function.power().is_some() {
                assert!(cost(Retarget::Restart, 267.0 + 1.1 * MOVED) > 0.03 * (267.0 - initial).abs());
            }
        }
    }
}

/// Under `restart` a drift that is slower than [`MOVED`] in a step adds up until it counts. The target in use is never farther than that from the given one.
#[test]
fn a_slow_drift_restarts_every_few_steps() {
    for domain in [Domain::Temperature, Domain::FourthPower] {
        let transition = Transition { domain, ..same(QUADRATIC(50.0), Retarget::Restart) };
        let mut state = TransitionState::settled(300.0, &transition);
        let (mut restarts, mut last) = (0, 0.0);
        for step in 1..=5000 {
            let target = 300.0 + 2e-4 * f64::from(step);
            let before = state.target;
            (state, last) = transition_step(state, target, 1.0, &transition);
            restarts += u32::from(state.target != before);
            assert!((domain.temperature(state.target) - target).abs() <= MOVED, "{domain:?}, step {step}");
        }
        // 0.8 mK after four steps is the first difference above 0.7 mK.
        assert_eq!(restarts, 1250, "{domain:?}");
        // The lag of a restarted quadratic is half of `t_max` times the slope.
        assert!((301.0 - last - 0.005).abs() < 1e-3, "{domain:?}: {last} K");
    }
}

/// Shorter steps converge to one curve: the difference between successive halvings is proportional to the step.
#[test]
fn converges_as_the_step_shrinks() {
    for function in functions() {
        let profile = Profile { function, t_max_steps: 40.0 };
        let end = |ticks_a_step: u32| {
            let dt = 1.0 / f64::from(ticks_a_step);
            let transition = same(profile.clone(), Retarget::Merge);
            let mut state = TransitionState::settled(280.0, &transition);
            let mut samples = Vec::new();
            for step in 1..=200 * ticks_a_step {
                let time = f64::from(step) * dt;
                let target = 280.0 + 60.0 * (time / 25.0).sin();
                let (next, t) = transition_step(state, target, dt, &transition);
                state = next;
                if step % (10 * ticks_a_step) == 0 {
                    samples.push(t);
                }
            }
            samples
        };
        let runs: Vec<_> = [4, 16, 64, 256].into_iter().map(end).collect();
        let gaps: Vec<f64> =
            runs.windows(2).map(|w| w[0].iter().zip(&w[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)).collect();
        assert!(gaps[0] > 1e-3, "a coarse step must differ, or nothing is tested: {gaps:?}");
        assert!(gaps[2] < 0.2 * gaps[0] && gaps[2] < 0.5 * gaps[1], "{}: {gaps:?}", profile.function);
    }
}

/// The rules that docs/numerics.md 1 rejects, with the errors that it states.
#[test]
fn rejected_rules_fail() {
    let unclamped = |t: f64| 267.0 - 264.3 * (1.0 - t / 100.0).powi(2);
    assert!((unclamped(361.0) + 1533.0).abs() < 0.5, "turns back at t_max: {}", unclamped(361.0));
    let clamped = run(QUADRATIC(100.0), Retarget::Merge, 2.7, 361, |_| 267.0);
    assert_eq!(clamped[361], 267.0);

    let shaken = run(QUADRATIC(361.0), Retarget::Restart, 2.7, 361, |step| 267.0 + 1e-3 * (step % 2) as f64);
    let still = run(QUADRATIC(361.0), Retarget::Restart, 2.7, 361, |_| 267.0);
    let cost = still.iter().zip(&shaken).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(cost > 30.0, "restart turns every profile into an exponential lag: {cost} K");

    let state = TransitionState { target: 267.0, span: 264.3, elapsed: 50.0 };
    let merge = same(QUADRATIC(100.0), Retarget::Merge);
    let phase_kept = TransitionState { target: 412.0, span: 412.0 - 2.7, ..state };
    let jump = temperature(phase_kept, &merge) - temperature(state, &merge);
    assert!(jump > 36.0, "keeping the phase jumps: {jump} K");
    let merged = retarget(state, 412.0, &merge);
    assert!((temperature(merged, &merge) - temperature(state, &merge)).abs() < 1e-12);

    let restart = same(QUADRATIC(100.0), Retarget::Restart);
    let mut frozen = TransitionState::settled(100.0, &restart);
    for step in 1..=500 {
        frozen = advance(frozen, 1.0, &restart);
        frozen = retarget(frozen, 100.0 + f64::from(step), &restart);
        frozen = TransitionState { elapsed: 0.0, span: frozen.target - 100.0, ..frozen };
    }
    assert_eq!(temperature(frozen, &restart), 100.0, "evaluated before advancing, a node never moves");
}

/// Functions of every kind with their difficult cases: rates that start at 0 or at infinity, vary (a table), jump, or end early, slow and steep ones.
pub(super) fn functions() -> Vec<Function> {
    let measured = |points: &[(f64, f64)]| {
        let samples: Vec<_> =
            points.iter().map(|&(time, temperature)| TemperatureSample { time, temperature }).collect();
        Function::table(&samples, None).unwrap()
    };
    vec![
        Function::Linear,
        Function::Quadratic,
        Function::polynomial(&[0.0, 2.0, -1.0]).unwrap(),
        Function::polynomial(&[0.0, 0.0, 3.0, -2.0]).unwrap(),
        Function::polynomial(&[0.0, 4.0, -6.0, 3.0]).unwrap(),
        Function::exponential(0.01).unwrap(),
        Function::exponential(3.0).unwrap(),
        Function::exponential(60.0).unwrap(),
        Function::logarithmic(1.0).unwrap(),
        Function::logarithmic(9.0).unwrap(),
        Function::logarithmic(1e4).unwrap(),
        measured(&[(0.0, 300.0), (1.0, 280.0), (3.0, 250.0), (4.0, 249.0), (9.0, 200.0)]),
        measured(&[(0.0, 0.0), (1.0, 0.0), (2.0, 5.0), (2.5, 5.0), (7.0, 9.0), (8.0, 10.0), (9.0, 10.0)]),
        Function::expression("s*s*(3.0-2.0*s)").unwrap(),
        Function::expression("sin(1.5707963*s)").unwrap(),
        Function::expression("1.0-acos(s)/1.57079633").unwrap(),
        Function::expression("sqrt(s)").unwrap(),
        Function::expression("min(1.0, 2.0*s)").unwrap(),
        Function::expression("s < 0.5 ? 2.0*s*s : 1.0-2.0*(1.0-s)*(1.0-s)").unwrap(),
    ]
}

/// The properties of the rule for a target that moves by d from a state: T does not jump, d and its reverse cancel, and two halves of d equal d. Returns
/// the worst error of each, the last two as shares of the time.
fn broken(state: TransitionState, d: f64, transition: &Transition, rule: Rule) -> [f64; 3] {
    let there = rule(state, state.target + d, transition);
    let back = rule(there, state.target, transition);
    let halves = rule(rule(state, state.target + 0.5 * d, transition), state.target + d, transition);
    let duration = branch(state.span, transition).duration();
    let jump = temperature(there, transition) - temperature(state, transition);
    [jump, (back.elapsed - state.elapsed) / duration, (halves.elapsed - there.elapsed) / duration].map(f64::abs)
}

/// A rule for a target that moves.
type Rule = fn(TransitionState, f64, &Transition) -> TransitionState;

/// 1e5 random states and changes for every function, where the gap keeps its direction.
#[test]
fn changes_of_the_target_cancel_and_add_up() {
    let keeps_the_phase: Rule =
        |state, target, _| TransitionState { target, span: state.span + target - state.target, ..state };
    let keeps_the_rate: Rule = |state, target, transition| {
        let mut next = retarget(state, target, transition);
        next.elapsed += 1e-3 * (target - state.target).abs();
        next
    };
    for function in functions() {
        let transition = same(Profile { function: function.clone(), t_max_steps: 100.0 }, Retarget::Merge);
        let duration = transition.heating.duration();
        let mut random = Random(7);
        let mut worst = [[0.0f64; 3]; 3];
        for _ in 0..100_000 {
            let r = random.between(0.01, 0.999);
            let state = TransitionState { target: 300.0, span: 1.0, elapsed: duration * (1.0 - r) };
            let gap = transition.heating.remaining(r);
            let d = gap * random.between(-0.9, 9.0);
            // A state with almost no way left has no digits left to compare.
            if gap > 1e-6 {
                for (rule, worst) in [retarget as Rule, keeps_the_phase, keeps_the_rate].iter().zip(&mut worst) {
                    let computed = broken(state, d, &transition, *rule);
                    *worst = std::array::from_fn(|i| worst[i].max(computed[i]));
                }
            }
        }
        let [ours, phase, rate] = worst;
        assert!(ours[0] < 1e-12 && ours[1] < 1e-7 && ours[2] < 1e-7, "{function}: {ours:?}");
        assert!(phase[0] > 0.1, "{function}: a phase that is kept jumps: {phase:?}");
        assert!(rate[1] > 1e-7, "{function}: a phase that is off shows: {rate:?}");
    }
}

impl Random {
    pub(crate) fn one_of<T: Clone>(&mut self, choices: &[T]) -> T {
        choices[(self.unit() * choices.len() as f64) as usize].clone()
    }

    pub(crate) fn t_max(&mut self) -> f64 {
        let (short, long) = (self.between(1.0, 5.0), self.between(0.1, 361.0));
        self.one_of(&[0.0, 1.0, short, long, long])
    }

    /// What the target does next: holds, jitters by an ulp, creeps, or jumps.
    pub(crate) fn target(&mut self, before: f64) -> f64 {
        let change = match (10.0 * self.unit()) as u32 {
            0..4 => 0.0,
            4..6 => self.one_of(&[before.next_up() - before, before.next_down() - before]),
            6..9 => self.between(-1.0, 1.0),
            _ => self.between(-400.0, 400.0),
        };
        (before + change).clamp(2.7, 1000.0)
    }
}
