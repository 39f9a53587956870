//! Networks that are cold or lose their heat, where radiation has little slope. Each step must still reach a balance.
//! Device against f64.

use crate::program::run;

/// Temperatures [K] at every output time on the device and in f64. The first column is the time [s].
fn both(text: &str) -> [Vec<Vec<f64>>; 2] {
    ["device", "cpu"].map(|device| {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("net.toml"), text).expect("written");
        let on_device = ["network", "net.toml", "-o", "out.csv", "--device", ""];
        let on_processor = ["network", "net.toml", "-o", "out.csv", "--device", "cpu"];
        let ran = run(folder.path(), if device == "cpu" { &on_processor } else { &on_device });
        assert_eq!(ran.code, 0, "{device}: {}", ran.err);
        let series = std::fs::read_to_string(folder.path().join("out.csv")).expect("a series");
        let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        series.lines().skip(1).map(row).collect()
    })
}

/// Default tolerance (docs/numerics.md 6).
const LIMIT: f64 = 20e-3;

fn agree(what: &str, text: &str) {
    let [device, reference] = both(text);
    assert_eq!(device.len(), reference.len(), "{what}");
    let mut worst = 0.0f64;
    for (own, other) in device.iter().flatten().zip(reference.iter().flatten()) {
        let difference = (own - other).abs();
        assert!(difference <= LIMIT, "{what}: {own} on the device, {other} in f64");
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
fn what_single_precision_does_not_hold_is_refused_by_name() {
    let network = |conductance: &str, heat: &str, space: &str| {
        format!(
            "space_temperature = {space}\n[[node]]\nlabel = 'a'\nkind = 'arithmetic'\nemissive_area = 0.1\nheat = {heat}\n\
             [[node]]\nlabel = 'b'\nkind = 'boundary'\ntemperature = 200\n\
             [[linear_conductor]]\nnodes = ['a', 'b']\nconductance = {conductance}\n[output]\ntimes = [0, 100]\n"
        )
    };
    for (text, word) in [
        (
            network("1e-50", "1", "2.7"),
            "nodes 0 and 1 of the file's order have a GL of 1e-50 W/K; it takes 0, or 1e-30 to",
        ),
        (network("1e30", "1", "2.7"), "GL of 1e30 W/K; it takes 0, or 1e-30 to below 1e30 W/K. Sums and products"),
        (network("1.0", "1e30", "2.7"), "node.heat: must be 0 or from 1e-15 to 1e12, of either sign [W], found 1e30"),
        (network("1.0", "1", "1e5"), "space is at"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("net.toml"), &text).expect("written");
        let ran = run(folder.path(), &["network", "net.toml", "-o", "out.csv", "--device", ""]);
        assert_ne!(ran.code, 0, "{text}");
        assert!(ran.err.contains(word), "{word}: {}", ran.err);
    }
}

#[test]
fn hubs_side_by_side_are_refused_where_one_invocation_cannot_take_their_conductors() {
    let mut text = String::new();
    for hub in 0..4 {
        text += &format!("[[node]]\nlabel = 'h{hub}'\nkind = 'diffusive'\ncapacitance = 17000.0\ntemperature = 250\n");
    }
    for other in 0..16_000 {
        text += &format!("[[node]]\nlabel = 'b{other}'\nkind = 'boundary'\ntemperature = 300\n");
        for hub in 0..4 {
            text += &format!("[[linear_conductor]]\nnodes = ['h{hub}', 'b{other}']\nconductance = 0.01\n");
        }
    }
    text += "[output]\ntimes = [0, 100]\n";
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("net.toml"), &text).expect("written");
    let ran = run(folder.path(), &["network", "net.toml", "-o", "out.csv"]);
    assert_ne!(ran.code, 0);
    assert!(ran.err.contains("nodes 0 to 3") && ran.err.contains("conductors"), "{}", ran.err);
}
