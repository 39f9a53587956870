//! Random networks: every integrator against the exact solution.

use isotherm::internals::{IntegrationSettings, Integrator, ReferenceStepper, Series, integrate};

use super::exact::{Solution, solve};
use super::random::{Case, case};

/// Slowest sensor whose switching time is tested [K/s]. Below it 1e-8 K correspond to 0.1 s.
const SLOWEST: f64 = 1e-7;

fn run(case: &Case, integrator: Integrator) -> Series {
    let mut stepper = ReferenceStepper::new(case.network.clone(), &case.schedule.sensors());
    integrate(&mut stepper, &case.network, &case.schedule, &IntegrationSettings::of(integrator), |_| true)
        .unwrap_or_else(|error| panic!("{}: {error:?}", case.name))
}

/// Largest differences in [K] and in [s]. Times count only for sensors faster than `SLOWEST`.
fn compare(case: &Case, found: &Series, exact: &Solution) -> (f64, f64) {
    let kelvins = found.rows.iter().flatten().zip(exact.rows.iter().flatten());
    let kelvin = kelvins.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let states = |list: &mut dyn Iterator<Item = (usize, bool)>| list.collect::<Vec<_>>();
    let ours = states(&mut found.switches.iter().map(|switch| (switch.thermostat, switch.on)));
    let theirs = states(&mut exact.switches.iter().map(|switch| (switch.1, switch.2)));
    assert_eq!(ours, theirs, "{}: the thermostats switch otherwise", case.name);
    let second = found
        .switches
        .iter()
        .zip(&exact.switches)
        .filter(|(_, exact)| exact.3.abs() > SLOWEST)
        .map(|(switch, exact)| (switch.time - exact.0).abs())
        .fold(0.0, f64::max);
    (kelvin, second)
}

#[test]
#[ignore = "long: tools/test --all"]
fn random_networks_are_within_their_tolerances() {
    let all = [(Integrator::Default, 20e-3), (Integrator::Accurate, 2e-3), (Integrator::Cheap, 0.2)];
    let mut worst = [[0.0_f64; 2]; 3];
    let mut switches = 0;
    // Mostly small networks, because the exact solution costs the cube of the number of nodes.
    for seed in (0..40).map(|seed| (seed, 14)).chain([(3, 40), (29, 40)]) {
        let case = case(seed.0, seed.1);
        let exact = solve(&case.network, &case.schedule);
        switches += exact.switches.len();
        print!("{} ({} switches):", case.name, exact.switches.len());
        for (worst, (integrator, limit)) in worst.iter_mut().zip(all) {
            let series = run(&case, integrator);
            let (kelvin, second) = compare(&case, &series, &exact);
            print!(" {integrator} {:.3} mK, {second:.4} s;", 1e3 * kelvin);
            *worst = [worst[0].max(kelvin), worst[1].max(second)];
            assert!(kelvin <= limit, "{}, {integrator}: {kelvin} K", case.name);
            assert!(second <= 0.05, "{}, {integrator}: {second} s", case.name);
        }
        println!();
    }
    println!("{switches} switches; worst [K, s] by default, accurate, cheap: {worst:?}");
    assert!(switches > 100, "the family must switch");
}

/// Different heat must change temperatures and times, or the comparison proves nothing.
#[test]
fn a_network_that_differs_is_told_apart() {
    let mut case = (0..60).map(|seed| case(seed, 14)).find(|case| case.name.contains("thermostats")).expect("a case");
    let exact = solve(&case.network, &case.schedule);
    case.network.emissive_areas[0] *= 1.01;
    let series = run(&case, Integrator::Accurate);
    let kelvins = series.rows.iter().flatten().zip(exact.rows.iter().flatten());
    assert!(kelvins.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) > 20e-3);
}
