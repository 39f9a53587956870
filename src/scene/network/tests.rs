//! Tests of valid and invalid network files.

use std::path::Path;

use super::NetworkFile;
use crate::thermal::network::NodeKind;

const GOOD: &str = r#"
space_temperature = 3.0

[[node]]
label = "box"
kind = "diffusive"
capacitance = 500.0
emissive_area = 0.1
temperature = 290.0
heat = { time = [0, 100, 100, 200], power = [1, 2, 5, 5] }

[[node]]
label = "blanket"
kind = "arithmetic"
emissive_area = 0.2

[[node]]
label = "rack"
kind = "boundary"
temperature = 300.0
heat = 4

[[linear_conductor]]
nodes = ["box", "rack"]
conductance = 0.5

[[radiative_conductor]]
nodes = ["box", "blanket"]
exchange_area = 0.01

[[thermostat]]
node = "box"
power = 10.0
on_below = 280.0
off_above = 285.0

[output]
times = [0, 10, 20.5]
"#;

fn parse(text: &str) -> Result<NetworkFile, String> {
    NetworkFile::parse(text, Path::new("net.toml")).map_err(|error| error.to_string())
}

#[test]
fn a_file_is_read_as_it_stands() {
    let file = parse(GOOD).unwrap();
    assert_eq!(file.labels, ["box", "blanket", "rack"]);
    assert_eq!(file.network.kinds, [NodeKind::Diffusive, NodeKind::Arithmetic, NodeKind::Boundary]);
    assert_eq!(file.network.space_temperature, 3.0);
    assert_eq!(file.network.linear[0].nodes, [0, 2]);
    assert_eq!(file.network.radiative[0].exchange_area, 0.01);
    assert_eq!(file.schedule.times, [0.0, 10.0, 20.5]);
    assert_eq!(file.schedule.thermostats[0].sensor, 0);
    let said = file.assumptions.join(" ");
    for part in ["senses that node itself", "is off at time 0", "Boundary node 'rack' keeps"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn rows_are_asked_for_in_any_order_and_twice() {
    let file = parse(&GOOD.replacen("[0, 10, 20.5]", "[20.5, 0, 10, 20.5, -0.0]", 1)).unwrap();
    assert_eq!(file.schedule.times, [0.0, 10.0, 20.5], "the run meets every time once");
    assert_eq!(file.times, [20.5, 0.0, 10.0, 20.5, 0.0]);
    assert_eq!(file.asked(&["first", "second", "third"]), ["third", "first", "second", "third", "first"]);
}

#[test]
fn the_reference_explains_every_key() {
    let reference = include_str!("../../../docs/network.md");
    for (header, keys) in [
        ("The root", &["space_temperature"][..]),
        ("[[node]]", super::node::KEYS),
        ("[[linear_conductor]]", super::LINEAR),
        ("[[radiative_conductor]]", super::RADIATIVE),
        ("[[thermostat]]", super::THERMOSTAT),
        ("[output]", super::OUTPUT),
    ] {
        let titled = |part: &&str| part.lines().next().is_some_and(|title| title.contains(header));
        let part = reference.split("\n## ").find(titled).unwrap_or_default();
        for key in keys {
            assert!(part.contains(&format!("`{key}`")), "docs/network.md is silent on {header} {key}");
        }
    }
    // The example in docs/network.md must be a valid file.
    let example = reference.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap_or_default();
    assert_eq!(parse(example).map(|file| file.labels), Ok(vec!["panel".to_owned(), "structure".to_owned()]));
}

#[test]
fn slips_are_refused_with_line_and_key() {
    for (good, bad, message) in [
        (
            "space_temperature = 3.0",
            "space_temperture = 3.0",
            "net.toml:2: space_temperture: unknown key; did you mean 'space_temperature'?",
        ),
        (
            "space_temperature = 3.0",
            "space_temperature = -3.0",
            "net.toml:2: space_temperature: must be 0 or above [K], found -3",
        ),
        (
            "capacitance = 500.0",
            "capacitance = -500.0",
            "net.toml:7: node.capacitance: must be 0 or above [J/K], found -500",
        ),
        ("capacitance = 500.0", "capacitance = 0", "net.toml:7: node.capacitance: must be above 0 [J/K]"),
        ("capacitance = 500.0", "capacitance = nan", "net.toml:7: node.capacitance: must be a finite number [J/K]"),
        ("capacitance = 500.0\n", "", "node.capacitance: is missing"),
        ("emissive_area = 0.1", "emissive_area = inf", "net.toml:8: node.emissive_area: must be a finite number [m2]"),
        ("kind = \"diffusive\"", "kind = \"difusive\"", "did you mean 'diffusive'?"),
        ("temperature = 290.0", "temperature = -1", "net.toml:9: node.temperature: must be 0 or above [K]"),
        ("label = \"blanket\"", "label = \"box\"", "net.toml:13: node.label: 'box' is the label of an earlier node"),
        (
            "[0, 100, 100, 200]",
            "[0, 100, 50, 200]",
            "net.toml:10: node.heat.time: must not descend, but 50 follows 100",
        ),
        ("[0, 100, 100, 200]", "[0, 100, 100, 100]", "node.heat.time: 100 stands three times"),
        ("[0, 100, 100, 200]", "[0, 100, 100]", "node.heat.power: must have a value for each of the 3 times, found 4"),
        ("[1, 2, 5, 5]", "[1, nan, 5, 5]", "node.heat.power: must be a finite number"),
        ("heat = 4", "heat = true", "node.heat: expected a number [W], found true"),
        (
            "nodes = [\"box\", \"rack\"]",
            "nodes = [\"box\", \"rak\"]",
            "linear_conductor.nodes: no node has the label 'rak'; did you mean 'rack'?",
        ),
        (
            "nodes = [\"box\", \"rack\"]",
            "nodes = [\"box\", \"box\"]",
            "linear_conductor.nodes: 'box' cannot be joined to itself",
        ),
        ("nodes = [\"box\", \"rack\"]", "nodes = [\"box\"]", "linear_conductor.nodes: must be the labels of two nodes"),
        (
            "conductance = 0.5",
            "conductance = -0.5",
            "linear_conductor.conductance: must be 0 or above [W/K], found -0.5",
        ),
        ("exchange_area = 0.01", "exchange_area = -1", "radiative_conductor.exchange_area: must be 0 or above [m2]"),
        ("off_above = 285.0", "off_above = 280.0", "thermostat.off_above: must be above on_below, 280 K"),
        ("node = \"box\"", "node = \"bx\"", "thermostat.node: no node has the label 'bx'"),
        ("[0, 10, 20.5]", "[-1, 10]", "output.times: must not lie before the start"),
        ("emissive_area = 0.2\n", "", "radiates"),
        ("kind = \"arithmetic\"", "kind = \"arithmetic\"\ncapacitance = 2.0", "node.capacitance: must be 0 or absent"),
    ] {
        assert!(GOOD.contains(good), "{good}");
        let text = GOOD.replacen(good, bad, 1);
        match parse(&text) {
            Err(error) => assert!(error.contains(message), "{bad}: {error}"),
            // The blanket has a conductor to the box, so it needs no emission.
            Ok(_) => assert_eq!(message, "radiates", "{bad} was accepted"),
        }
    }
}

#[test]
fn an_arithmetic_node_without_a_way_out_is_named() {
    let text = GOOD.replace("emissive_area = 0.2\n", "").replace("exchange_area = 0.01", "exchange_area = 0");
    let error = parse(&text).unwrap_err();
    assert!(error.contains("net.toml:14: node.kind: arithmetic node 'blanket' has no path"), "{error}");
}
