//! Networks that are cold or lose their heat, where radiation has little slope. Each step must still reach a balance.
//! The default integrator against the accurate one.

use crate::program::run;

/// Temperatures [K] at every output time with the default and the accurate integrator. The first column is the time [s].
fn both(text: &str) -> [Vec<Vec<f64>>; 2] {
    ["default", "accurate"].map(|integrator| {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("net.toml"), text).expect("written");
        let ran = run(folder.path(), &["network", "net.toml", "-o", "out.csv", "--integrator", integrator]);
        assert_eq!(ran.code, 0, "{integrator}: {}", ran.err);
        let series = std::fs::read_to_string(folder.path().join("out.csv")).expect("a series");
        let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        series.lines().skip(1).map(row).collect()
    })
}

/// Default tolerance (docs/numerics.md 6).
const LIMIT: f64 = 20e-3;

fn agree(what: &str, text: &str) {
    let [default, accurate] = both(text);
    assert_eq!(default.len(), accurate.len(), "{what}");
    let mut worst = 0.0f64;
    for (own, other) in default.iter().flatten().zip(accurate.iter().flatten()) {
        let difference = (own - other).abs();
        assert!(difference <= LIMIT, "{what}: {own} by default, {other} accurate");
        worst = worst.max(difference);
    }
    println!("{what}: {worst:.1e} K");
}

fn one(kind: &str, keys: &str, space: f64) -> String {
    format!(
        "space_temperature = {space}\n[[node]]\nlabel = 'a'\nkind = '{kind}'\nemissive_area = 0.1\n{keys}\n\
         [output]\ntimes = [0, 25, 50, 100]\n"
    )
}

#[test]
fn a_cold_node_that_is_heated_ends_in_its_balance() {
    let ramp = "heat = { time = [0, 100], power = [0, 100] }";
    agree("a node of 1 J/K", &one("diffusive", &format!("capacitance = 1.0\ntemperature = 2.7\n{ramp}"), 2.7));
    agree("a node without capacitance", &one("arithmetic", ramp, 2.7));
    agree("the same under a space at 0 K", &one("arithmetic", ramp, 0.0));
    let jump = "heat = { time = [0, 50, 50, 100], power = [0, 0, 10, 10] }";
    agree("heat from 50 s on", &one("arithmetic", jump, 0.0));
    agree("a start at 0 K", &one("arithmetic", "temperature = 0\nheat = 10", 0.0));
}

#[test]
fn a_node_whose_heat_ends_falls_to_the_temperature_of_space() {
    let fall = "heat = { time = [0, 100], power = [100, 0] }";
    agree("a node without capacitance", &one("arithmetic", fall, 2.7));
}

#[test]
fn arithmetic_nodes_of_a_large_network_start_cold_too() {
    let mut text = "space_temperature = 2.7\n".to_owned();
    for node in 0..1100 {
        let (kind, keys) = if node % 2 == 0 {
            ("arithmetic", "heat = { time = [0, 100], power = [0, 50] }".to_owned())
        } else {
            ("diffusive", format!("capacitance = 50.0\ntemperature = {}", 3 + node / 8))
        };
        text += &format!("[[node]]\nlabel = 'n{node}'\nkind = '{kind}'\nemissive_area = 0.05\n{keys}\n");
    }
    for node in (0..1100).step_by(2) {
        text += &format!("[[linear_conductor]]\nnodes = ['n{node}', 'n{}']\nconductance = 0.01\n", node + 1);
    }
    text += "[output]\ntimes = [0, 25, 50, 100]\n";
    agree("550 of 1100 nodes", &text);
}

#[test]
fn a_heat_beyond_every_craft_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("net.toml"), one("arithmetic", "heat = 1e30", 2.7)).expect("written");
    let ran = run(folder.path(), &["network", "net.toml", "-o", "out.csv"]);
    assert_ne!(ran.code, 0);
    let word = "node.heat: must be 0 or from 1e-15 to 1e12, of either sign [W], found 1e30";
    assert!(ran.err.contains(word), "{}", ran.err);
}
