//! Networks with a closed-form solution, and invariants of every solution.

use isotherm::internals::{
    ControlError, HeatTable, IntegrationSettings, Integrator, LinearConductor, Network, NodeKind, RadiativeConductor,
    ReferenceStepper, Schedule, Series, SteadyError, StepMethod, Thermostat, integrate, steady,
};

use super::random::{Random, case};

const SIGMA: f64 = 5.670374419e-8;
const ALL: [(Integrator, f64); 3] =
    [(Integrator::Default, 20e-3), (Integrator::Accurate, 2e-3), (Integrator::Cheap, 200e-3)];

fn node(network: &mut Network, kind: NodeKind, capacitance: f64, area: f64, temperature: f64) -> u32 {
    network.kinds.push(kind);
    network.capacitances.push(capacitance);
    network.emissive_areas.push(area);
    network.temperatures.push(temperature);
    network.len() as u32 - 1
}

fn join(network: &mut Network, a: u32, b: u32, conductance: f64) {
    network.linear.push(LinearConductor { nodes: [a, b], conductance });
}

fn run(network: &Network, schedule: &Schedule, integrator: Integrator) -> Result<Series, ControlError> {
    let mut stepper = ReferenceStepper::new(network.clone(), &schedule.sensors());
    integrate(&mut stepper, network, schedule, &IntegrationSettings::of(integrator), |_| true)
}

/// T(t) of a node that only radiates, to space at 0 K: (T0^-3 + 3 eps A sigma t / C)^(-1/3).
#[test]
fn free_cooling_follows_its_closed_form() {
    let mut network = Network::default();
    node(&mut network, NodeKind::Diffusive, 1350.0, 0.85, 400.0);
    let times: Vec<f64> = (0..=20).map(|i| f64::from(i) * 500.0).collect();
    let exact = |t: f64| (400f64.powi(-3) + 3.0 * 0.85 * SIGMA * t / 1350.0).powf(-1.0 / 3.0);
    for (integrator, limit) in ALL {
        let schedule = Schedule { times: times.clone(), ..Schedule::default() };
        let series = run(&network, &schedule, integrator).unwrap();
        for (time, row) in times.iter().zip(&series.rows) {
            assert!((row[0] - exact(*time)).abs() <= limit, "{integrator} {time}: {} {}", row[0], exact(*time));
        }
        assert!((series.rows[20][0] - exact(10_100.0)).abs() > limit, "a wrong time must show");
    }
}

/// Two nodes joined by G: the mean stays, the difference decays with G (1/C1 + 1/C2).
#[test]
fn two_nodes_meet_as_their_closed_form_says() {
    let mut network = Network::default();
    let a = node(&mut network, NodeKind::Diffusive, 100.0, 0.0, 250.0);
    let b = node(&mut network, NodeKind::Diffusive, 300.0, 0.0, 350.0);
    join(&mut network, a, b, 2.0);
    let times = vec![0.0, 10.0, 40.0, 100.0, 1000.0];
    for (integrator, limit) in ALL {
        let series = run(&network, &Schedule { times: times.clone(), ..Schedule::default() }, integrator).unwrap();
        for (time, row) in times.iter().zip(&series.rows) {
            let gap = 100.0 * (-2.0 * (1.0 / 100.0 + 1.0 / 300.0) * time).exp();
            for (found, exact) in row.iter().zip([325.0 - 0.75 * gap, 325.0 + 0.25 * gap]) {
                assert!((found - exact).abs() <= limit, "{integrator} {time}: {found} {exact}");
            }
        }
    }
}

/// A heater on a node with losses to a boundary. Temperatures between its switches are exponentials.
#[test]
fn a_thermostat_switches_when_its_exponentials_say() {
    let mut network = Network::default();
    let tank = node(&mut network, NodeKind::Diffusive, 400.0, 0.0, 290.0);
    let rack = node(&mut network, NodeKind::Boundary, 0.0, 0.0, 250.0);
    join(&mut network, tank, rack, 0.5);
    let thermostat =
        Thermostat { node: tank, sensor: tank, power: 30.0, on_below: 280.0, off_above: 285.0, initially_on: false };
    let schedule = Schedule { thermostats: vec![thermostat], times: vec![0.0, 4000.0], ..Schedule::default() };
    let tau = 400.0 / 0.5;
    let fall = |from: f64, to: f64| tau * ((from - 250.0) / (to - 250.0_f64)).ln();
    let rise = |from: f64, to: f64| tau * ((310.0 - from) / (310.0 - to)).ln();
    let (mut expected, mut time, mut on) = (Vec::new(), fall(290.0, 280.0), false);
    while time < 4000.0 {
        on = !on;
        expected.push((time, on));
        time += if on { rise(280.0, 285.0) } else { fall(285.0, 280.0) };
    }
    for (integrator, _) in ALL {
        let series = run(&network, &schedule, integrator).unwrap();
        assert_eq!(series.switches.len(), expected.len());
        for (switch, (time, on)) in series.switches.iter().zip(&expected) {
            assert!((switch.time - time).abs() < 0.02 && switch.on == *on, "{integrator}: {switch:?} {time}");
        }
    }
}

/// A sensor outside its band at time 0 changes nothing until it crosses a threshold.
#[test]
fn a_thermostat_outside_its_band_waits_for_a_crossing() {
    let mut network = Network::default();
    let tank = node(&mut network, NodeKind::Diffusive, 400.0, 0.0, 270.0);
    let rack = node(&mut network, NodeKind::Boundary, 0.0, 0.0, 250.0);
    join(&mut network, tank, rack, 0.5);
    let thermostat =
        Thermostat { node: tank, sensor: tank, power: 30.0, on_below: 280.0, off_above: 285.0, initially_on: false };
    let mut schedule = Schedule { thermostats: vec![thermostat], times: vec![2000.0], ..Schedule::default() };
    assert!(run(&network, &schedule, Integrator::Default).unwrap().switches.is_empty());
    // Heat lifts it above the threshold and lets it fall again.
    schedule.heat = vec![(tank, HeatTable { times: vec![0.0, 600.0, 600.0], powers: vec![40.0, 40.0, 0.0] })];
    let series = run(&network, &schedule, Integrator::Default).unwrap();
    assert!(series.switches[0].on && series.switches[0].time > 600.0, "{:?}", series.switches);
}

/// An arithmetic sensor jumps with its heat, and the switch happens at the same time.
#[test]
fn a_jump_of_an_arithmetic_sensor_switches_at_once() {
    let mut network = Network { space_temperature: 3.0, ..Network::default() };
    let body = node(&mut network, NodeKind::Diffusive, 500.0, 0.05, 290.0);
    let foil = node(&mut network, NodeKind::Arithmetic, 0.0, 0.1, 290.0);
    join(&mut network, body, foil, 0.2);
    let thermostat =
        Thermostat { node: body, sensor: foil, power: 5.0, on_below: 240.0, off_above: 400.0, initially_on: false };
    let heat = vec![(foil, HeatTable { times: vec![100.0, 100.0], powers: vec![30.0, 0.0] })];
    let schedule =
        Schedule { heat, thermostats: vec![thermostat], times: vec![0.0, 100.0, 200.0], ..Schedule::default() };
    let series = run(&network, &schedule, Integrator::Default).unwrap();
    assert_eq!(series.switches.len(), 1);
    assert_eq!((series.switches[0].time, series.switches[0].on), (100.0, true));
    assert!(series.rows[1][1] > 250.0, "the row at the jump shows the value before it");
}

#[test]
fn a_heater_that_moves_its_sensor_across_the_band_is_an_error() {
    let mut network = Network { space_temperature: 3.0, ..Network::default() };
    let body = node(&mut network, NodeKind::Diffusive, 100.0, 0.05, 290.0);
    let foil = node(&mut network, NodeKind::Arithmetic, 0.0, 0.01, 290.0);
    join(&mut network, body, foil, 0.1);
    let thermostat =
        Thermostat { node: foil, sensor: foil, power: 20.0, on_below: 250.0, off_above: 252.0, initially_on: false };
    let schedule = Schedule { thermostats: vec![thermostat], times: vec![1e4], ..Schedule::default() };
    let error = run(&network, &schedule, Integrator::Default).unwrap_err();
    assert!(matches!(error, ControlError::Chatter { thermostat: 0, .. }), "{error:?}");
}

/// A node under constant negative heat reaches 0 K, which is an error.
#[test]
fn a_node_without_heat_left_is_an_error() {
    let mut network = Network::default();
    let body = node(&mut network, NodeKind::Diffusive, 100.0, 0.0, 50.0);
    let schedule = Schedule { heat: vec![(body, HeatTable::constant(-1.0))], times: vec![1e4], ..Schedule::default() };
    for (integrator, _) in ALL {
        let error = run(&network, &schedule, integrator).unwrap_err();
        assert!(matches!(error, ControlError::NoStep { node: 0, .. }), "{error:?}");
    }
}

/// Body, three arithmetic nodes and a second body in a chain, under changing heat. Every method runs with halved steps.
#[test]
fn integrators_have_their_orders() {
    let mut network = Network { space_temperature: 3.0, ..Network::default() };
    let hot = node(&mut network, NodeKind::Diffusive, 300.0, 0.3, 330.0);
    let chain: Vec<u32> = (0..3).map(|_| node(&mut network, NodeKind::Arithmetic, 0.0, 0.05, 300.0)).collect();
    let cold = node(&mut network, NodeKind::Diffusive, 100.0, 0.1, 250.0);
    for pair in [[hot, chain[0]], [chain[0], chain[1]], [chain[1], chain[2]], [chain[2], cold]] {
        join(&mut network, pair[0], pair[1], 1.5);
    }
    network.radiative.push(RadiativeConductor { nodes: [hot, chain[2]], exchange_area: 0.2 });
    let (power, slope) = (vec![10.0, 0.0, 20.0, 0.0, 5.0], vec![0.5, 0.1, -0.1, 0.3, -0.2]);
    let end = 40.0;
    let answer = |method: StepMethod, count: u32| {
        let mut stepper = ReferenceStepper::new(network.clone(), &[]);
        stepper.set_heat(&power, &slope);
        assert!(stepper.balance(0.0));
        let attempt = stepper.attempt(method, 0.0, end / f64::from(count), count);
        stepper.keep();
        (stepper.temperatures(), attempt.error)
    };
    let (exact, _) = answer(StepMethod::TrBdf2, 20_000);
    let error = |method, count| {
        let (found, estimate) = answer(method, count);
        (exact.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max), estimate)
    };
    for (method, order) in [
        (StepMethod::Euler, 1.0),
        (StepMethod::Rkl2 { stages: 3 }, 2.0),
        (StepMethod::Rkl2 { stages: 7 }, 2.0),
        (StepMethod::TrBdf2, 2.0),
    ] {
        let (coarse, estimate) = error(method, 40);
        let (fine, finer) = error(method, 80);
        let observed = (coarse / fine).log2();
        println!("{method}: {coarse:.2e} K at 1 s, order {observed:.2}, estimates {estimate:.1e} {finer:.1e}");
        assert!((observed - order).abs() < 0.15, "{method}: {observed}");
        // The error of one sub-step is one order higher, and the sum is about the whole error.
        let own = (estimate / finer).log2();
        assert!((own - order - 1.0).abs() < 0.3, "{method}: estimate of order {own}");
        assert!(40.0 * estimate > coarse / 2.0, "{method}: {estimate} a sub-step, {coarse} in all");
    }
}

/// Heat in = heat stored + heat radiated over an orbit with shadow, to 1e-4 of the heat in.
#[test]
fn the_energy_of_an_orbit_is_closed() {
    let mut network = Network { space_temperature: 2.7, ..Network::default() };
    let plate = node(&mut network, NodeKind::Diffusive, 2000.0, 0.8, 280.0);
    let inner = node(&mut network, NodeKind::Diffusive, 5000.0, 0.0, 285.0);
    let foil = node(&mut network, NodeKind::Arithmetic, 0.0, 0.2, 280.0);
    join(&mut network, plate, inner, 1.0);
    network.radiative.push(RadiativeConductor { nodes: [inner, foil], exchange_area: 0.1 });
    let table = HeatTable { times: vec![0.0, 3500.0, 3500.0, 5560.0], powers: vec![900.0, 700.0, 50.0, 50.0] };
    let times: Vec<f64> = (0..=5560).map(f64::from).collect();
    let schedule =
        Schedule { heat: vec![(plate, table), (foil, HeatTable::constant(40.0))], times, ..Schedule::default() };
    let heat_in = 3500.0 * 800.0 + 2060.0 * 50.0 + 5560.0 * 40.0;
    for (integrator, _) in ALL {
        let rows = run(&network, &schedule, integrator).unwrap().rows;
        let radiated = |row: &Vec<f64>| -> f64 {
            row.iter().zip(&network.emissive_areas).map(|(t, area)| area * SIGMA * (t.powi(4) - 2.7f64.powi(4))).sum()
        };
        let out: f64 = rows.windows(2).map(|pair| 0.5 * (radiated(&pair[0]) + radiated(&pair[1]))).sum();
        let stored = (0..2).map(|node| network.capacitances[node] * (rows[5560][node] - rows[0][node])).sum::<f64>();
        let open = (heat_in - out - stored) / heat_in;
        println!("{integrator}: open by {open:.1e}");
        assert!(open.abs() < 1e-4, "{integrator}: {open}");
        assert!((open + 1.0 / heat_in * 1000.0).abs() > 1e-4, "a kilojoule must show");
    }
}

/// Every node reaches its balance from any start.
#[test]
fn steady_states_balance_from_afar() {
    let mut random = Random(5);
    let mut found = 0;
    for seed in 0..60 {
        let case = case(seed, 30);
        let mut network = case.network;
        let schedule = Schedule { heat: case.schedule.heat, ..Schedule::default() };
        for node in 0..network.len() {
            if network.kinds[node] != NodeKind::Boundary {
                network.temperatures[node] = random.scale(1.0, 3000.0);
            }
        }
        let mut stepper = ReferenceStepper::new(network.clone(), &[]);
        let answer =
            steady(&mut stepper, &network, &schedule).unwrap_or_else(|error| panic!("{}: {error:?}", case.name));
        let mut heat = vec![0.0; network.len()];
        network.exchanged_heat(&answer.temperatures, &mut heat);
        for (node, table) in &schedule.heat {
            heat[*node as usize] += table.after(0.0).0;
        }
        for node in (0..network.len()).filter(|node| network.kinds[*node] != NodeKind::Boundary) {
            // A slope of 1000 W/K times the rounding error of a temperature.
            assert!(heat[node].abs() < 1e-6, "{}: node {node} is open by {} W", case.name, heat[node]);
        }
        found += 1;
    }
    assert_eq!(found, 60);
}

#[test]
fn a_steady_state_needs_a_way_out_and_agreeing_thermostats() {
    let mut network = Network::default();
    let a = node(&mut network, NodeKind::Diffusive, 100.0, 0.0, 250.0);
    let mut schedule = Schedule { heat: vec![(a, HeatTable::constant(1.0))], ..Schedule::default() };
    let answer = |network: &Network, schedule: &Schedule| {
        steady(&mut ReferenceStepper::new(network.clone(), &schedule.sensors()), network, schedule)
    };
    assert_eq!(answer(&network, &schedule), Err(SteadyError::Closed { node: 0 }));
    let b = node(&mut network, NodeKind::Boundary, 0.0, 0.0, 250.0);
    join(&mut network, a, b, 0.1);
    assert!((answer(&network, &schedule).unwrap().temperatures[0] - 260.0).abs() < 1e-9);
    let thermostat =
        Thermostat { node: a, sensor: a, power: 1.0, on_below: 255.0, off_above: 258.0, initially_on: true };
    schedule.thermostats = vec![thermostat];
    let settled = answer(&network, &schedule).unwrap();
    assert_eq!(settled.on, [false]);
    schedule.heat.clear();
    schedule.thermostats[0].power = 2.0;
    assert_eq!(answer(&network, &schedule), Err(SteadyError::Cycles { thermostat: 0 }));
}
