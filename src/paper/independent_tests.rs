//! An independent solution of the cube's periodic state for tests: Runge-Kutta of order 4 with a fixed step, and
//! Gauss-Seidel for panels without heat capacity.

use super::cube::{Cube, Orbit, PERIOD, Problem, STEP, STEPS};
use super::orbits::Orbits;
use crate::environment::sky::SkyError;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::{Network, NodeKind};

/// Solves all cubes.
pub fn orbits() -> Orbits {
    Orbits::compute(|_: &Cube, problem: &Problem| Ok::<_, SkyError>(settle(problem))).unwrap()
}

/// A cube's periodic state.
pub fn settle(problem: &Problem) -> Orbit {
    let diffusive = problem.network.kinds[0] == NodeKind::Diffusive;
    if !diffusive {
        return (0..=STEPS).map(|step| balance(&problem.network, &problem.heat[step % STEPS])).collect();
    }
    let mut start = [problem.network.temperatures[0]; 6];
    loop {
        let orbit = integrate(problem, start);
        let change: [f64; 6] = std::array::from_fn(|face| orbit[STEPS][face] - start[face]);
        if change.iter().all(|change| change.abs() < 1e-8) {
            return orbit;
        }
        // Removes the heat gained over the orbit, by panel or, if panels conduct, for the whole cube.
        let gain = change.iter().sum::<f64>() / 6.0;
        start = std::array::from_fn(|face| {
            let slope = 4.0 * STEFAN_BOLTZMANN * problem.network.emissive_areas[face] * orbit[0][face].powi(3);
            let change = if problem.network.linear.is_empty() { change[face] } else { gain };
            orbit[STEPS][face] + change * problem.network.capacitances[face] / (slope * PERIOD)
        });
    }
}

fn integrate(problem: &Problem, start: [f64; 6]) -> Orbit {
    const PARTS: usize = 4;
    let mut t = start;
    let mut orbit = vec![start];
    for step in 0..STEPS {
        for part in 0..PARTS {
            let heat = &problem.heat[if part < PARTS / 2 { step } else { (step + 1) % STEPS }];
            let span = STEP / PARTS as f64;
            let rate = |t: [f64; 6]| rates(&problem.network, heat, t);
            let ahead = |rate: [f64; 6], span: f64| std::array::from_fn(|face| t[face] + span * rate[face]);
            let a = rate(t);
            let b = rate(ahead(a, 0.5 * span));
            let c = rate(ahead(b, 0.5 * span));
            let d = rate(ahead(c, span));
            t = std::array::from_fn(|face| t[face] + span / 6.0 * (a[face] + 2.0 * (b[face] + c[face]) + d[face]));
        }
        orbit.push(t);
    }
    orbit
}

fn rates(network: &Network, heat: &[f64; 6], t: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|face| {
        let emitted =
            network.emissive_areas[face] * STEFAN_BOLTZMANN * (t[face].powi(4) - network.space_temperature.powi(4));
        let conducted = neighbours(network, face).map(|(other, conductance)| conductance * (t[other] - t[face]));
        (heat[face] - emitted + conducted.sum::<f64>()) / network.capacitances[face]
    })
}

fn neighbours(network: &Network, face: usize) -> impl Iterator<Item = (usize, f64)> {
    network.linear.iter().filter_map(move |conductor| match conductor.nodes.map(|node| node as usize) {
        [a, b] if a == face => Some((b, conductor.conductance)),
        [a, b] if b == face => Some((a, conductor.conductance)),
        _ => None,
    })
}

fn balance(network: &Network, heat: &[f64; 6]) -> [f64; 6] {
    let mut t = [300.0f64; 6];
    loop {
        let before = t;
        for face in 0..6 {
            let [mut low, mut high] = [0.0, 2000.0];
            let excess = |temperature: f64| {
                let conducted = neighbours(network, face).map(|(other, gl)| gl * (t[other] - temperature));
                let fourth = temperature.powi(4) - network.space_temperature.powi(4);
                heat[face] + conducted.sum::<f64>() - network.emissive_areas[face] * STEFAN_BOLTZMANN * fourth
            };
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if excess(middle) > 0.0 { low = middle } else { high = middle }
            }
            t[face] = 0.5 * (low + high);
        }
        if t.iter().zip(before).all(|(after, before)| (after - before).abs() < 1e-9) {
            return t;
        }
    }
}
