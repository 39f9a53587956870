//! Transitions on the device against the paper's curves and their f64 twins, with one target a step.

use std::sync::Arc;

use glam::DVec3;
use isotherm::internals::{
    Context, Frame, Function, Function::Linear, Function::Quadratic, Request, Response, Retarget, Sides, StepKind,
    StepRange, ThermalVariant, Wanted, respond_f64,
};

use super::device::{LooseNodes, Present, Worst, assert_silent, context, dark, material, temperatures, transition};
use super::random::Random;

const NOTHING: Present = Present { sun: false, planet_ir: false, albedo: false };

fn same(function: Function, t_max: f64, retarget: Retarget) -> Response {
    transition((function.clone(), t_max), (function, t_max), retarget)
}

/// Temperature [K] after every step of a node that starts at rest and gets a target each step. Without a load the
/// target is the temperature of space.
fn response(context: &Arc<Context>, response: &Response, initial: f64, targets: &[f64]) -> Vec<f64> {
    let nodes = LooseNodes::new(NOTHING, vec![material(0.0, 1.0, Sides::Outside, response.clone())], &[DVec3::Z]);
    let mut renderer = nodes.renderer(context, &[]);
    renderer.settle_at(&vec![initial as f32; nodes.len()]).expect("the device settles");
    let mut found = Vec::new();
    for target in targets {
        let submitted =
            renderer.submit(Request::step(&dark(*target), 1.0).and_temperatures()).expect("the device steps");
        let collected = renderer.collect(submitted).expect("the device answers");
        found.push(f64::from(collected.temperatures.expect("temperatures were asked for")[0]));
    }
    found
}

/// The same in f64.
fn twin_response(response: &Response, initial: f64, targets: &[f64]) -> Vec<f64> {
    let Response::Transition(transition) = response else { panic!("a transition") };
    respond_f64(transition, initial, targets)
}

/// Step and temperature [K].
type Value = (usize, f64);

/// docs/numerics.md 1 (figures 5 and 6 of Vural et al. 2023): function, t_max, initial temperature, target, and
/// temperatures at steps.
const PAPER: &[(Function, f64, f64, f64, &[Value])] = &[
    (Quadratic, 361.0, 2.7, 267.0, &[(1, 4.162_238), (50, 70.843_124), (180, 200.558_427), (361, 267.0)]),
    (Quadratic, 100.0, 2.7, 267.0, &[(1, 7.959_570), (50, 200.925), (100, 267.0), (1000, 267.0)]),
    (Quadratic, 1000.0, 2.7, 267.0, &[(1, 3.228_336), (180, 89.284_680), (361, 159.080_760), (1000, 267.0)]),
    (Quadratic, 361.0, 500.0, 2.7, &[(1, 497.248_691), (100, 262.647_156), (180, 127.714_735), (361, 2.7)]),
    (Quadratic, 100.0, 500.0, 2.7, &[(1, 490.103_730), (50, 127.025), (100, 2.7), (361, 2.7)]),
    (Quadratic, 1000.0, 500.0, 2.7, &[(1, 499.005_897), (100, 405.513), (361, 205.758_033), (1000, 2.7)]),
    (Quadratic, 100.0, 2.7, 1000.0, &[(1, 22.546_270), (50, 750.675), (100, 1000.0)]),
    (Quadratic, 100.0, 1000.0, 2.7, &[(1, 980.153_730), (50, 252.025), (100, 2.7)]),
    (Quadratic, 100.0, 2.7, 5.0, &[(1, 2.745_770), (50, 4.425), (100, 5.0)]),
    (Quadratic, 100.0, 5.0, 2.7, &[(1, 4.954_230), (50, 3.275), (100, 2.7)]),
    (Linear, 361.0, 2.7, 267.0, &[(1, 3.432_133), (100, 75.913_296), (180, 134.483_934), (361, 267.0)]),
    (Linear, 1000.0, 2.7, 267.0, &[(1, 2.9643), (50, 15.915), (361, 98.1123)]),
    (Linear, 361.0, 500.0, 2.7, &[(1, 498.622_438), (50, 431.121_884), (180, 252.038_781), (361, 2.7)]),
    (Linear, 1000.0, 500.0, 2.7, &[(1, 499.5027), (100, 450.27), (361, 320.4747)]),
];

#[test]
fn the_papers_transitions() {
    let context = context();
    let (mut worst, mut late) = (Worst::none(), Worst::none());
    for (function, t_max, initial, target, values) in PAPER {
        let steps = values.iter().map(|(step, _)| *step).max().expect("a row has values");
        let found =
            response(&context, &same(function.clone(), *t_max, Retarget::Merge), *initial, &vec![*target; steps]);
        for (step, expected) in *values {
            let name = || format!("step {step} of {function:?} {initial} -> {target} K in {t_max}");
            worst.see(found[step - 1], *expected, name);
            late.see(found[step.saturating_sub(2)], *expected, name);
        }
    }
    worst.within(2e-4, "K", "the paper's transitions");
    assert!(late.difference > 1.0, "one step too early must show: {late:?}");
    assert_silent(&context);
}

/// docs/numerics.md 1: quadratic, t_max 100, from 2.7 K, 267 K from step 1 on, and another target from a later step on.
const MOVED: &[(f64, usize, &[Value])] = &[
    (350.0, 51, &[(51, 205.196_949), (60, 240.849_884), (100, 338.447_090), (125, 350.0)]),
    (210.0, 51, &[(51, 202.365_768), (60, 209.731_835), (75, 210.0)]),
    (120.0, 51, &[(51, 199.314_593), (100, 140.231_25), (150, 120.0)]),
    (268.0, 100, &[(100, 267.045_137), (101, 267.114_118), (125, 267.993_881)]),
];

#[test]
fn targets_that_move() {
    let context = context();
    let quadratic = same(Quadratic, 100.0, Retarget::Merge);
    let mut worst = Worst::none();
    for (target, from, values) in MOVED {
        let targets: Vec<f64> = (1..=150).map(|step| if step < *from { 267.0 } else { *target }).collect();
        let found = response(&context, &quadratic, 2.7, &targets);
        for (step, expected) in *values {
            worst.see(found[step - 1], *expected, || format!("step {step} of -> {target} K at {from}"));
        }
        let restarted = response(&context, &same(Quadratic, 100.0, Retarget::Restart), 2.7, &targets);
        let twin = twin_response(&same(Quadratic, 100.0, Retarget::Restart), 2.7, &targets);
        Worst::of(&restarted, &twin, |step| format!("step {}", step + 1)).within(2e-4, "K", "restart");
        if *target > 267.0 {
            assert!((restarted[from + 8] - found[from + 8]).abs() > 0.1, "the two rules must differ");
        }
    }
    // A ramp of 0.25 K a step from 100 K, for the lag of the temperature.
    let ramp: Vec<f64> = (1..=500).map(|step| 100.0 + 0.25 * f64::from(step)).collect();
    let found = response(&context, &quadratic, 100.0, &ramp);
    for (step, lag) in [(10, 2.234_622), (50, 7.190_054), (100, 7.916_822), (200, 6.182_499), (500, 6.125_940)] {
        worst.see(ramp[step - 1] - found[step - 1], lag, || format!("lag at step {step} of the ramp"));
    }
    worst.within(2e-4, "K", "moved targets");
}

#[test]
fn random_targets() {
    let context = context();
    let mut random = Random(11);
    let (mut worst, mut wrong) = (Worst::none(), Worst::none());
    for (index, t_max) in [0.0, 1.0, 7.5, 100.0, 361.0, 1000.0].into_iter().enumerate() {
        for retarget in [Retarget::Merge, Retarget::Restart] {
            // The target holds for some steps and then moves by several kelvin.
            let mut targets: Vec<f64> = Vec::new();
            while targets.len() < 400 {
                let (target, steps) = (random.between(90.0, 400.0), random.between(1.0, 30.0));
                targets.extend(vec![target; steps as usize]);
            }
            let heating = if index % 2 == 0 { Quadratic } else { Linear };
            let cooling = if index % 3 == 0 { Quadratic } else { Linear };
            let kind = transition((heating.clone(), t_max), (cooling.clone(), 0.6 * t_max), retarget);
            let found = response(&context, &kind, 200.0, &targets);
            let name = |step: usize| format!("step {} of {kind:?}", step + 1);
            let twin = twin_response(&kind, 200.0, &targets);
            let one = Worst::of(&found, &twin, name);
            worst.see(one.device, one.twin, || one.node);
            let slower = transition((heating, t_max * 1.000_1), (cooling, 0.6 * t_max), retarget);
            let other = Worst::of(&found, &twin_response(&slower, 200.0, &targets), name);
            wrong.see(other.device, other.twin, || other.node);
        }
    }
    worst.within(5e-4, "K", "random targets");
    assert!(wrong.difference > 5e-4, "a ten-thousandth of t_max must show: {wrong:?}");
}

#[test]
fn advance_lets_time_pass_and_nothing_else() {
    let context = context();
    let kind = transition((Quadratic, 361.0), (Linear, 100.0), Retarget::Merge);
    let nodes = LooseNodes::new(NOTHING, vec![material(0.0, 1.0, Sides::Outside, kind.clone())], &[DVec3::Z]);
    let advance =
        StepRange { variant: ThermalVariant { kind: StepKind::Advance, ..nodes.ranges[0].variant }, ..nodes.ranges[0] };
    let mut renderer = nodes.renderer(&context, &[advance]);
    for (initial, target) in [(2.7, 267.0), (400.0, 120.0)] {
        renderer.settle_at(&vec![initial as f32; nodes.len()]).expect("the device settles");
        let twin = twin_response(&kind, initial, &vec![target; 400]);
        let mut worst = Worst::none();
        for (step, expected) in twin.iter().enumerate() {
            // The first step commands the target. In the others only time passes, under any load.
            let (range, load) = if step == 0 { (nodes.ranges[0], dark(target)) } else { (advance, dark(1.0)) };
            let wanted = Wanted { temperatures: true, ..Wanted::default() };
            let frame = Frame::step(&[range], wanted);
            let submitted =
                renderer.submit(Request { list: Some(&frame), ..Request::step(&load, 1.0) }).expect("the device steps");
            let collected = renderer.collect(submitted).expect("the device answers");
            let found = f64::from(collected.temperatures.expect("temperatures were asked for")[0]);
            worst.see(found, *expected, || format!("step {} of {initial} -> {target} K", step + 1));
        }
        worst.within(2e-4, "K", "advance");
        assert!((twin[1] - twin[0]).abs() > 1.0, "one step must show");
    }
    assert_silent(&context);
}

#[test]
fn parts_of_steps_add_up() {
    let context = context();
    let kind = same(Quadratic, 100.0, Retarget::Merge);
    let nodes = LooseNodes::new(NOTHING, vec![material(0.0, 1.0, Sides::Outside, kind.clone())], &[DVec3::Z]);
    let mut renderer = nodes.renderer(&context, &[]);
    renderer.settle_at(&vec![2.7; nodes.len()]).expect("the device settles");
    for _ in 0..200 {
        let submitted = renderer.submit(Request::step(&dark(267.0), 0.25)).expect("the device steps");
        renderer.collect(submitted).expect("the device answers");
    }
    // Curve 5.2 of docs/numerics.md 1 at step 50.
    let found = temperatures(&nodes, &mut renderer)[0];
    assert!((found - 200.925).abs() < 2e-4, "{found}");
}
