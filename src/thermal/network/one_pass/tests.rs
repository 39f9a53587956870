//! The one pass against the accurate integrator, its conservation and its order.

use super::*;
use crate::thermal::network::control::{IntegrationSettings, Integrator, Leg, integrate_leg};
use crate::thermal::network::reference::ReferenceStepper;
use crate::thermal::network::schedule::{Schedule, Thermostat};
use crate::thermal::network::{LinearConductor, Network, NodeKind, RadiativeConductor};

const HOTTEST: f64 = 400.0;

/// A number between 0 and 1 that depends on `n` without a pattern.
fn scattered(n: usize) -> f64 {
    (n as f64 * 0.618_033_988_75 + (n * n) as f64 * 0.414_213_562).fract()
}

/// A sheet of `side` x `side` cells. Conductors are slow, but every seventh is `fast` times faster.
fn sheet(side: usize, fast: f64) -> Network {
    let count = side * side;
    let mut linear = Vec::new();
    for at in 0..count {
        for (other, inside) in [(at + 1, at % side + 1 < side), (at + side, at + side < count)] {
            if inside {
                let rate = 0.004 * (0.5 + scattered(linear.len()));
                let conductance = if linear.len() % 7 == 3 { fast * rate } else { rate };
                linear.push(LinearConductor { nodes: [at as u32, other as u32], conductance: 1000.0 * conductance });
            }
        }
    }
    Network {
        space_temperature: 2.7,
        kinds: vec![NodeKind::Diffusive; count],
        capacitances: (0..count).map(|at| 1000.0 * (0.5 + scattered(3 * at))).collect(),
        emissive_areas: (0..count).map(|at| 0.3 * (0.2 + scattered(5 * at))).collect(),
        temperatures: vec![280.0; count],
        linear,
        ..Network::default()
    }
}

/// Heat of a node [W]: sunlight that turns over it in an orbit of 6000 s, as a mean from `from` to `to` [s].
fn sunlight(node: usize, from: f64, to: f64) -> f64 {
    let turn = std::f64::consts::TAU / 6000.0;
    let phase = 0.4 * scattered(7 * node);
    80.0 + 60.0 * ((turn * from + phase).cos() - (turn * to + phase).cos()) / (turn * (to - from))
}

fn heat(network: &Network, from: f64, to: f64) -> Vec<f64> {
    (0..network.len()).map(|node| sunlight(node, from, to) * network.emissive_areas[node] / 0.3).collect()
}

/// Temperatures after `time` [s] by the accurate integrator, with the heat of steps of `step` [s].
fn accurate(network: &Network, time: f64, step: f64) -> Vec<f64> {
    let mut stepper = ReferenceStepper::new(network.clone(), &[]);
    let settings = IntegrationSettings { tolerance: 1e-4, ..IntegrationSettings::of(Integrator::Accurate) };
    let mut first = f64::INFINITY;
    for number in 0..(time / step).round() as u32 {
        let from = f64::from(number) * step;
        let schedule =
            Schedule { constant: heat(network, from, from + step), times: vec![step], ..Schedule::default() };
        let leg = Leg { horizon: time, step: first, tight_switches: false };
        let (series, ended) = integrate_leg(&mut stepper, network, &schedule, &settings, leg, |_| true);
        ended.expect("no failure");
        first = series.first_step.unwrap_or(series.step);
    }
    stepper.temperatures()
}

fn one_pass(network: &Network, time: f64, step: f64) -> OnePassNetwork {
    let plan = OnePassPlan::new(network, step, &vec![HOTTEST; network.len()]).expect("a network for one pass");
    let mut one_pass = OnePassNetwork::new(&plan, Vec::new(), f64::INFINITY);
    for number in 0..(time / step).round() as u32 {
        let from = f64::from(number) * step;
        one_pass.advance(&heat(network, from, from + step), &[], from, step);
    }
    one_pass
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// Also the estimate is of the size of the error.
#[test]
fn a_sheet_with_strong_conductors_is_near_the_accurate_integrator() {
    let network = sheet(9, 400.0);
    let truth = accurate(&network, 3000.0, 15.0);
    let stepped = one_pass(&network, 3000.0, 15.0);
    assert!(!stepped.plan.blocks().is_empty());
    let error = rms(stepped.temperatures(), &truth);
    assert!(error < 4e-3, "{error} K");
    let told = stepped.estimate().rms;
    assert!(told > 0.3 * error && told < 30.0 * error.max(1e-4), "{told} for {error}");
}

#[test]
fn the_error_falls_with_the_square_of_the_step() {
    for fast in [1.0, 50.0] {
        let network = sheet(6, fast);
        let truth = accurate(&network, 2400.0, 2.5);
        let error = |step| rms(one_pass(&network, 2400.0, step).temperatures(), &truth);
        let [coarse, fine] = [20.0, 10.0].map(error);
        let order = (coarse / fine).log2();
        println!(
            "strong conductors {fast} times faster: {coarse:.2e} K at 20 s, {fine:.2e} K at 10 s, order {order:.2}"
        );
        assert!(order > 1.7, "order {order} from {coarse} to {fine} K");
    }
}

/// Each part of the scheme is needed: the conduction inside blocks in the local step, the last change in the weak conduction, and the loads in the local
/// step.
#[test]
fn a_part_left_out_shows() {
    let step = 15.0;
    let run = |fast: f64, time: f64, change: fn(&mut OnePassNetwork), loads_outside: bool| {
        let mut network = sheet(9, fast);
        if fast > 1.0 {
            network.capacitances.iter_mut().for_each(|capacitance| *capacitance *= 0.2);
        } else {
            // Neighbours that warm differently.
            network.temperatures.iter_mut().enumerate().for_each(|(node, t)| *t += 60.0 * scattered(node));
        }
        let truth = accurate(&network, time, step);
        let plan = OnePassPlan::new(&network, step, &vec![HOTTEST; network.len()]).expect("a network for one pass");
        let mut stepped = OnePassNetwork::new(&plan, Vec::new(), f64::INFINITY);
        for number in 0..(time / step).round() as u32 {
            let from = f64::from(number) * step;
            let heat = heat(&network, from, from + step);
            change(&mut stepped);
            if loads_outside {
                stepped.advance(&vec![0.0; network.len()], &[], from, step);
                for (node, heat) in heat.iter().enumerate() {
                    stepped.temperatures[node] += step * heat / network.capacitances[node];
                }
            } else {
                stepped.advance(&heat, &[], from, step);
            }
        }
        rms(stepped.temperatures(), &truth)
    };
    type Part = (&'static str, f64, f64, fn(&mut OnePassNetwork), bool);
    let parts: [Part; 3] = [
        ("the conduction inside blocks", 400.0, 1800.0, |stepped| stepped.coupling.fill(0.0), false),
        ("the last change", 1.0, 300.0, |stepped| stepped.last.fill(0.0), false),
        ("loads in the local step", 400.0, 1800.0, |_| (), true),
    ];
    for (part, fast, time, change, loads_outside) in parts {
        let (whole, without) = (run(fast, time, |_| (), false), run(fast, time, change, loads_outside));
        println!("without {part}: {without:.1e} K, with it {whole:.1e} K");
        assert!(without > 3.0 * whole, "without {part}: {without} K, with it {whole} K");
    }
}

/// Without loads and radiation, conduction moves heat but does not make it.
#[test]
fn heat_is_conserved() {
    let mut network = sheet(8, 1e4);
    network.emissive_areas.fill(0.0);
    for (node, temperature) in network.temperatures.iter_mut().enumerate() {
        *temperature = 200.0 + 200.0 * scattered(11 * node);
    }
    let plan = OnePassPlan::new(&network, 15.0, &vec![HOTTEST; network.len()]).expect("a network for one pass");
    let mut stepped = OnePassNetwork::new(&plan, Vec::new(), f64::INFINITY);
    let stored = |temperatures: &[f64]| network.capacitances.iter().zip(temperatures).map(|(c, t)| c * t).sum::<f64>();
    let before = stored(stepped.temperatures());
    for _ in 0..500 {
        stepped.advance(&vec![0.0; network.len()], &[], 0.0, 15.0);
    }
    let after = stored(stepped.temperatures());
    assert!((after / before - 1.0).abs() < 1e-12, "{before} J became {after} J");
    let mean = before / network.capacitances.iter().sum::<f64>();
    assert!(
        stepped.temperatures().iter().all(|temperature| (temperature - mean).abs() < 20.0),
        "the nodes approach each other"
    );
}

/// The conduction of a large block by stages is that by matrices, within what the series leaves out. Other conductances show.
#[test]
fn stages_conduct_as_matrices_do() {
    let (step, count) = (15.0, super::blocks::BLOCK_AT_MOST + 8);
    let rate = |link: usize| 0.05 * 10f64.powf(1.5 * scattered(link));
    let chain = |factor: f64| {
        let join =
            |link: usize| LinearConductor { nodes: [link as u32, link as u32 + 1], conductance: factor * rate(link) };
        Network {
            kinds: vec![NodeKind::Diffusive; count],
            capacitances: vec![1.0; count],
            emissive_areas: vec![0.0; count],
            temperatures: vec![300.0; count],
            linear: (0..count - 1).map(join).collect(),
            ..Network::default()
        }
    };
    let mut matrix = vec![0.0; count * count];
    for link in 0..count - 1 {
        for (row, column, sign) in
            [(link, link, 1.0), (link + 1, link + 1, 1.0), (link, link + 1, -1.0), (link + 1, link, -1.0)]
        {
            matrix[row * count + column] += sign * step * rate(link);
        }
    }
    let [mean, change] = exponential::exponentials(&matrix, count);
    let drives: Vec<f64> = (0..count).map(|node| 5.0 * scattered(3 * node)).collect();
    let starts: Vec<f64> = (0..count).map(|node| 280.0 + 0.05 * node as f64).collect();
    let row = |matrix: &[f64], node: usize, values: &[f64]| -> f64 {
        matrix[node * count..(node + 1) * count].iter().zip(values).map(|(weight, value)| weight * value).sum()
    };
    let exact = |node: usize| row(&mean, node, &drives) + row(&change, node, &starts) - drives[node];
    let worst = |factor: f64| {
        let plan = OnePassPlan::new(&chain(factor), step, &vec![HOTTEST; count]).expect("a network for one pass");
        assert_eq!(plan.large().map(|large| large.nodes().len()), Some(count));
        let mut computed = vec![0.0; count];
        plan.conduct(&drives, &starts, &mut computed);
        (0..count).map(|node| (computed[node] - exact(node)).abs()).fold(0.0, f64::max)
    };
    let [found, other] = [1.0, 1.01].map(worst);
    println!("{found:.1e} K off, {other:.1e} K with other conductances");
    assert!(found < 1e-4, "{found} K");
    assert!(other > 30.0 * found, "{other} K with other conductances, {found} K");
}

/// A sheet that is one large block, with a heater in it.
#[test]
fn a_large_block_is_near_the_accurate_integrator() {
    let mut network = sheet(24, 1.0);
    network.linear.iter_mut().for_each(|one| one.conductance *= 60.0);
    let truth = accurate(&network, 1500.0, 15.0);
    let stepped = one_pass(&network, 1500.0, 15.0);
    let series = stepped.plan.series().expect("a large block");
    let error = rms(stepped.temperatures(), &truth);
    println!("{} stages: {error:.1e} K rms, told {:.1e}", series.stages(), stepped.estimate().rms);
    assert!(error < 0.01, "{error} K");
    let told = stepped.estimate().rms;
    assert!(told > 0.2 * error && told < 30.0 * error.max(1e-4), "{told} for {error}");
    // What 1 W does to a node: its own heat and what conduction takes away.
    let response = stepped.plan.response(40, &[(40, 1.0)]);
    let alone = 15.0 / network.capacitances[40];
    assert!(response > 0.0 && response < 0.7 * alone, "{response} of {alone} K");
    let all: Vec<(u32, f64)> = network.capacitances.iter().zip(0..).map(|(c, node)| (node, c / 15.0)).collect();
    assert!((stepped.plan.response(40, &all) - 1.0).abs() < 1e-4, "a common source heats all nodes alike");
}

/// A network that does not fit the step fits a half, a quarter or an eighth of it.
#[test]
fn a_shorter_step_fits_where_the_whole_one_does_not() {
    let mut network = sheet(6, 1.0);
    network.linear.iter_mut().for_each(|one| one.conductance *= 60.0);
    let fits = |step: f64| {
        OnePassPlan::fitting(&network, step, &vec![HOTTEST; network.len()])
            .map(|plan| (step / plan.longest(), plan.halvings()))
    };
    let of_node = |node: usize| network.capacitances[node] / (network.emissive_areas[node] * radiative_slope(HOTTEST));
    let least = (0..network.len()).map(of_node).fold(f64::INFINITY, f64::min);
    // A node of a block takes three time constants in a step.
    for (constants, parts) in [(2.9, Ok((1.0, 0))), (5.8, Ok((2.0, 1))), (11.0, Ok((4.0, 2))), (20.0, Ok((8.0, 3)))] {
        assert_eq!(fits(constants * least), parts, "{constants} time constants");
    }
    assert!(matches!(fits(30.0 * least), Err(Unfit::Fast { .. })));
}

/// A blanket over a sheet. Each of its nodes exchanges heat with the structure below by radiation and conduction [W/K].
fn covered(capacitance: f64, emittance: f64, conductance: f64) -> Network {
    let mut network = sheet(5, 30.0);
    let structures = network.len();
    for node in 0..structures {
        network.kinds.push(if capacitance > 0.0 { NodeKind::Diffusive } else { NodeKind::Arithmetic });
        network.capacitances.push(capacitance);
        network.emissive_areas.push(network.emissive_areas[node]);
        network.temperatures.push(280.0);
        let nodes = [node as u32, (structures + node) as u32];
        network.radiative.push(RadiativeConductor { nodes, exchange_area: emittance * 0.3 });
        if conductance > 0.0 {
            network.linear.push(LinearConductor { nodes, conductance });
        }
    }
    network.emissive_areas[..structures].fill(0.0);
    network
}

/// A thin blanket, and one that stores no heat and also conducts. Another exchange shows.
#[test]
fn a_blanket_over_a_structure_is_near_the_accurate_integrator() {
    for (capacitance, emittance, conductance) in [(140.0, 0.03, 0.0), (0.0, 0.05, 0.02)] {
        let truth = accurate(&covered(capacitance, emittance, conductance), 3000.0, 15.0);
        let error = |emittance: f64| {
            rms(one_pass(&covered(capacitance, emittance, conductance), 3000.0, 15.0).temperatures(), &truth)
        };
        let (computed, other) = (error(emittance), error(1.2 * emittance));
        println!("{capacitance} J/K: {computed:.1e} K rms, {other:.1e} K with another exchange");
        assert!(computed < 1e-2, "{capacitance} J/K: {computed} K");
        assert!(other > 10.0 * computed, "{capacitance} J/K: {other} K with another exchange, {computed} K");
    }
}

/// Thin sheets, with up to twelve time constants in a step, weakly joined to a structure. With Runge-Kutta steps for slow nodes they would be lost.
#[test]
fn a_thin_sheet_is_near_the_accurate_integrator() {
    let mut network = sheet(5, 1.0);
    for node in 0..network.len() {
        if node % 2 == 0 {
            network.capacitances[node] = 15.0 * network.emissive_areas[node] * radiative_slope(330.0) / 12.0;
        }
    }
    network.linear.retain(|one| one.nodes.iter().all(|node| node % 2 == 1));
    let truth = accurate(&network, 1500.0, 15.0);
    let stepped = one_pass(&network, 1500.0, 15.0);
    assert!((0..network.len()).filter(|node| stepped.plan.is_fast(*node)).count() >= network.len() / 2);
    let error = rms(stepped.temperatures(), &truth);
    assert!(error < 5e-3, "{error} K");
    let slow = local::local_change(330.0, 100.0, 12.0 / (4.0 * 330f64.powi(3)), local::SLOW_STEPS);
    let fast = local::fast_change(330.0, 100.0, 12.0 / (4.0 * 330f64.powi(3)), 100);
    assert!((slow - fast).abs() > 1.0, "{slow} {fast}");
}

/// A step of another length restarts, and long ones are divided.
#[test]
fn steps_of_other_lengths_keep_the_accuracy() {
    let network = sheet(6, 50.0);
    let plan = OnePassPlan::new(&network, 15.0, &vec![HOTTEST; network.len()]).expect("a network for one pass");
    let mut stepped = OnePassNetwork::new(&plan, Vec::new(), f64::INFINITY);
    let (mut now, end) = (0.0, 1806.0);
    for length in [15.0, 7.0, 60.0, 15.0, 31.0].into_iter().cycle() {
        let length = f64::min(length, end - now);
        if length <= 0.0 {
            break;
        }
        stepped.advance(&heat(&network, now, now + length), &[], now, length);
        now += length;
    }
    let error = rms(stepped.temperatures(), &accurate(&network, end, 3.0));
    assert!(error < 0.03, "{error} K");
}

/// Copies of a block share their matrices, and a small difference makes another kind.
#[test]
fn copies_share_their_matrices() {
    let join = |a: u32, b: u32, conductance: f64| LinearConductor { nodes: [a, b], conductance };
    let mut network = Network {
        kinds: vec![NodeKind::Diffusive; 9],
        capacitances: vec![2.0; 9],
        emissive_areas: vec![0.1; 9],
        temperatures: vec![300.0; 9],
        linear: (0..3)
            .flat_map(|block| [join(3 * block, 3 * block + 1, 1.0), join(3 * block + 1, 3 * block + 2, 2.0)])
            .collect(),
        ..Network::default()
    };
    let kinds =
        |network: &Network| OnePassPlan::new(network, 1.0, &[300.0; 9]).expect("three blocks").conductions().len();
    assert_eq!(kinds(&network), 1);
    network.linear[0].conductance = 1.001;
    assert_eq!(kinds(&network), 2);
}

/// A heater of node 40 and its neighbours in a sheet, sensed at node 40, with a band in which it cycles.
fn heated() -> OnePassHeater {
    let shares = vec![(40, 0.5), (39, 0.25), (41, 0.25)];
    let thermostat =
        Thermostat { node: 40, sensor: 40, power: 400.0, on_below: 270.0, off_above: 273.0, initially_on: false };
    OnePassHeater { thermostat: Some(thermostat), shares }
}

/// Switching times [s] and temperatures of the accurate integrator.
fn accurately_switched(
    network: &Network,
    heater: &OnePassHeater,
    time: f64,
    step: f64,
) -> (Vec<(f64, bool)>, Vec<f64>) {
    let thermostat = heater.thermostat.as_ref().expect("a thermostat");
    let sensors = [thermostat.sensor];
    let mut stepper = ReferenceStepper::new(network.clone(), &sensors);
    let settings = IntegrationSettings { tolerance: 1e-4, ..IntegrationSettings::of(Integrator::Accurate) };
    let (mut first, mut on, mut switches) = (f64::INFINITY, false, Vec::new());
    for number in 0..(time / step).round() as u32 {
        let from = f64::from(number) * step;
        let schedule = Schedule {
            constant: heat(network, from, from + step),
            thermostats: vec![Thermostat { initially_on: on, ..thermostat.clone() }],
            spread: vec![heater.shares.clone()],
            times: vec![step],
            ..Schedule::default()
        };
        let leg = Leg { horizon: time, step: first, tight_switches: true };
        let (series, ended) = integrate_leg(&mut stepper, network, &schedule, &settings, leg, |_| true);
        ended.expect("no failure");
        switches.extend(series.switches.iter().map(|switch| (from + switch.time, switch.on)));
        (first, on) = (series.first_step.unwrap_or(series.step), series.on[0]);
    }
    let temperatures = stepper.temperatures();
    (switches, temperatures)
}

/// The sensor stands in a block (`fast`) or alone. Each switch of the accurate integrator is found, near its time. Where the sensor is read at the
/// start of a step only, times are up to a step late.
#[test]
fn thermostats_switch_when_the_accurate_integrator_says() {
    for (fast, step) in [(1.0, 5.0), (400.0, 5.0), (400.0, 2.5)] {
        let network = sheet(9, fast);
        let (truth, end) = accurately_switched(&network, &heated(), 6000.0, step);
        let run = |blind: bool| {
            let plan = OnePassPlan::new(&network, step, &vec![HOTTEST; network.len()]).expect("a network for one pass");
            let mut one_pass = OnePassNetwork::new(&plan, vec![heated()], f64::INFINITY);
            let mut switches = Vec::new();
            for number in 0..(6000.0 / step) as u32 {
                let from = f64::from(number) * step;
                if blind {
                    // The same rate with and without the heater, and none.
                    one_pass.gains[0] = 0.0;
                    one_pass.last[40] = 0.0;
                }
                switches.extend(one_pass.advance(&heat(&network, from, from + step), &[400.0], from, step));
            }
            let off = |(switch, (time, on)): (&Switch, &(f64, bool))| {
                assert_eq!(switch.on, *on);
                (switch.time - time).abs()
            };
            let late = switches.iter().zip(&truth).map(off).sum::<f64>() / truth.len() as f64;
            (switches.len(), late, rms(one_pass.temperatures(), &end))
        };
        let [(computed, late, error), (_, blind, _)] = [false, true].map(run);
        println!(
            "{fast}, {step} s: {computed} of {} switches, {late:.2} s off in the mean, {error:.4} K rms at the end; read at the start {blind:.2} s",
            truth.len()
        );
        assert!(truth.len() >= 8, "{} switches", truth.len());
        assert_eq!(computed, truth.len());
        assert!(late < 0.5 * step, "{late} s");
        assert!(blind > 2.0 * late, "{blind} s, and {late} s with the last change");
    }
}
