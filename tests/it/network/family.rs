//! A family of random networks by every integrator against the exact solution.

use isotherm::thermal::network::control::{Integrator, Series, Settings, integrate};
use isotherm::thermal::network::reference::ReferenceStepper;

use super::exact::{Solution, solve};
use super::random::{Case, case};

/// Slowest sensor whose switching time is asserted [K/s]: below it 1e-8 K are 0.1 s.
const SLOWEST: f64 = 1e-7;

fn run(case: &Case, integrator: Integrator) -> Series {
    let mut stepper = ReferenceStepper::new(case.network.clone(), &case.schedule.sensors());
    let settings = Settings::of(integrator);
    integrate(&mut stepper, &case.network, &case.schedule, &settings, |_| true)
        .unwrap_or_else(|error| panic!("{}: {error:?}", case.name))
}

/// Largest differences in kelvin and in seconds.
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
fn random_networks_are_within_their_tolerances() {
    let seeds: u64 = std::env::var("SEEDS").map_or(40, |text| text.parse().unwrap());
    let first: u64 = std::env::var("FIRST").map_or(0, |text| text.parse().unwrap());
    let mut worst = [[0.0_f64; 2]; 3];
    for seed in first..first + seeds {
        let case = case(seed, 40);
        let started = std::time::Instant::now();
        let exact = solve(&case.network, &case.schedule);
        let took = started.elapsed().as_secs_f64();
        print!("{} ({} switches, exact {took:.2} s):", case.name, exact.switches.len());
        let all = [(Integrator::Default, 20e-3), (Integrator::Accurate, 2e-3), (Integrator::Cheap, 0.5)];
        for (place, (integrator, limit)) in all.into_iter().enumerate() {
            let started = std::time::Instant::now();
            let series = run(&case, integrator);
            let (kelvin, second) = compare(&case, &series, &exact);
            let took = started.elapsed().as_secs_f64();
            print!(
                "  {integrator} {:.3} mK {:.4} s, {} sub-steps, {} rejected, {took:.2} s;",
                1e3 * kelvin,
                second,
                series.counts.sub_steps,
                series.rejected
            );
            worst[place][0] = worst[place][0].max(kelvin / limit);
            worst[place][1] = worst[place][1].max(second);
            if kelvin > limit {
                print!(" ####");
            }
            if second > 0.05 {
                print!(" @@@@");
            }
        }
        println!();
    }
    println!("worst, shares of the limits and seconds: {worst:?}");
}
