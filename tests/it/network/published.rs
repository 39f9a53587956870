//! Published solutions: NAFEMS T2 and T3, and the five-node network of the shared data.

use isotherm::internals::{
    HeatTable, IntegrationSettings, Integrator, LinearConductor, Network, NodeKind, ReferenceStepper, Schedule,
    integrate, steady,
};

/// Cells of a bar.
const CELLS: usize = 100;

/// A bar of 0.1 m and 1 m2 with given ends. `storage` is rho c [J m-3 K-1].
fn bar(conductivity: f64, storage: f64, ends: [(NodeKind, f64); 2], start: f64) -> Network {
    let length = 0.1 / CELLS as f64;
    let mut network = Network::default();
    for node in 0..=CELLS {
        let end = match node {
            0 => Some(ends[0]),
            CELLS => Some(ends[1]),
            _ => None,
        };
        let (kind, temperature) = end.unwrap_or((NodeKind::Diffusive, start));
        network.kinds.push(kind);
        network.capacitances.push(if kind == NodeKind::Diffusive { storage * length } else { 0.0 });
        network.emissive_areas.push(0.0);
        network.temperatures.push(temperature);
        if node > 0 {
            let nodes = [node as u32 - 1, node as u32];
            network.linear.push(LinearConductor { nodes, conductance: conductivity / length });
        }
    }
    network
}

/// NAFEMS T3 (The Standard NAFEMS Benchmarks, 1990): 36.60 C at 0.08 m after 32 s. A boundary has a constant
/// temperature, so the driven end is an arithmetic node. A large conductance and its heat hold it at 100 sin(pi t /
/// 40).
#[test]
fn nafems_t3() {
    const ZERO: f64 = 273.15;
    const HOLD: f64 = 1e9;
    let ends = [(NodeKind::Boundary, ZERO), (NodeKind::Arithmetic, ZERO)];
    let mut network = bar(35.0, 440.5 * 7200.0, ends, ZERO);
    network.linear.push(LinearConductor { nodes: [0, CELLS as u32], conductance: HOLD });
    let times: Vec<f64> = (0..=640).map(|step| f64::from(step) * 0.05).collect();
    let powers = times.iter().map(|t| HOLD * 100.0 * (std::f64::consts::PI * t / 40.0).sin()).collect();
    let heat = vec![(CELLS as u32, HeatTable { times, powers })];
    let schedule = Schedule { heat, times: vec![32.0], ..Schedule::default() };
    for integrator in [Integrator::Default, Integrator::Accurate] {
        let mut stepper = ReferenceStepper::new(network.clone(), &[]);
        let series =
            integrate(&mut stepper, &network, &schedule, &IntegrationSettings::of(integrator), |_| true).unwrap();
        let celsius = series.rows[0][CELLS * 8 / 10] - ZERO;
        println!("T3, {integrator}: {celsius:.4} C");
        assert!((celsius / 36.60 - 1.0).abs() < 1e-3, "{integrator}: {celsius}");
        let neighbour = series.rows[0][CELLS * 8 / 10 - 1] - ZERO;
        assert!((neighbour / 36.60 - 1.0).abs() > 1e-3, "the node beside it must not pass");
    }
}

/// NAFEMS T2: 927.0 K at the end that radiates with 0.98 to 300 K. The other end is at 1000 K, k is 55.6 W/mK.
#[test]
fn nafems_t2() {
    let ends = [(NodeKind::Boundary, 1000.0), (NodeKind::Arithmetic, 300.0)];
    let mut network = bar(55.6, 1.0, ends, 300.0);
    network.space_temperature = 300.0;
    network.emissive_areas[CELLS] = 0.98;
    let mut stepper = ReferenceStepper::new(network.clone(), &[]);
    let end = steady(&mut stepper, &network, &Schedule::default()).unwrap().temperatures[CELLS];
    println!("T2: {end:.4} K");
    assert!((end / 927.0 - 1.0).abs() < 1e-3, "{end}");
    network.emissive_areas[CELLS] = 0.93;
    let mut stepper = ReferenceStepper::new(network.clone(), &[]);
    let end = steady(&mut stepper, &network, &Schedule::default()).unwrap().temperatures[CELLS];
    assert!((end / 927.0 - 1.0).abs() > 1e-3, "another emissivity must not pass");
}
