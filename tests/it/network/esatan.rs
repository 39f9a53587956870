//! The five-node network of the shared data: a transient and its steady state.

use isotherm::internals::{
    HeatTable, IntegrationSettings, Integrator, LinearConductor, Network, NodeKind, RadiativeConductor,
    ReferenceStepper, Schedule, integrate, steady,
};
use serde_json::Value;

use crate::model::shared_files::shared;

/// The published solution has steps of 1000 s, so it is 1.5 mK off the exact one.
const LIMIT: f64 = 2e-3;

#[test]
fn the_five_node_network_is_met() {
    let Some(shared) = shared() else { return };
    let text = std::fs::read_to_string(shared.join("thermal/esatan_5node.json")).expect("the shared file");
    let data: Value = serde_json::from_str(&text).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let numbers = |value: &Value| value.as_array().expect("an array").iter().map(number).collect::<Vec<_>>();
    let nodes = data["nodes"].as_object().expect("nodes");
    let labels: Vec<&String> = nodes.keys().collect();
    let place = |label: f64| labels.iter().position(|own| **own == label.to_string()).expect("a node") as u32;
    let (mut network, mut heat) = (Network::default(), Vec::new());
    for (at, node) in nodes.values().enumerate() {
        let fixed = node["boundary"].as_f64();
        network.kinds.push(if fixed.is_some() { NodeKind::Boundary } else { NodeKind::Diffusive });
        network.capacitances.push(node["C"].as_f64().unwrap_or(0.0));
        network.emissive_areas.push(0.0);
        network.temperatures.push(fixed.unwrap_or_else(|| number(&node["T0"])));
        heat.extend(node["Q"].as_f64().map(|power| (at as u32, HeatTable::constant(power))));
    }
    for (key, radiative) in [("GL", false), ("GR", true)] {
        for row in data[key].as_array().expect("conductors") {
            let row = numbers(row);
            let nodes = [place(row[0]), place(row[1])];
            if radiative {
                network.radiative.push(RadiativeConductor { nodes, exchange_area: row[2] });
            } else {
                network.linear.push(LinearConductor { nodes, conductance: row[2] });
            }
        }
    }
    let order: Vec<usize> = numbers(&data["order"]).into_iter().map(|label| place(label) as usize).collect();
    let schedule = Schedule { heat, times: numbers(&data["t_s"]), ..Schedule::default() };
    let worst = |row: &[f64], expected: &Value| {
        let pairs = order.iter().zip(numbers(expected));
        pairs.map(|(node, expected)| (row[*node] - expected).abs()).fold(0.0, f64::max)
    };
    for integrator in [Integrator::Default, Integrator::Accurate] {
        let mut stepper = ReferenceStepper::new(network.clone(), &[]);
        let series =
            integrate(&mut stepper, &network, &schedule, &IntegrationSettings::of(integrator), |_| true).unwrap();
        let rows = data["T_K"].as_array().expect("rows");
        let error = series.rows.iter().zip(rows).map(|(row, expected)| worst(row, expected)).fold(0.0, f64::max);
        println!("five nodes, {integrator}: {:.3} mK", 1e3 * error);
        assert!(error <= LIMIT, "{integrator}: {error}");
        assert!(worst(&series.rows[5], &rows[6]) > LIMIT, "another row must not pass");
    }
    let mut stepper = ReferenceStepper::new(network.clone(), &[]);
    let found = steady(&mut stepper, &network, &schedule).unwrap();
    let error = worst(&found.temperatures, &data["steady_K"]);
    println!("five nodes, steady: {:.3} mK", 1e3 * error);
    assert!(error <= LIMIT, "{error}");
}
