//! `isotherm network` as a user runs it, with the f64 twin.

use std::path::Path;

use crate::program::{Ran, run};

/// A tank that cools, and the thermostat that warms it before the file ends.
pub const FILE: &str = r#"
space_temperature = 0.0
[[node]]
label = "tank, left"
kind = "diffusive"
capacitance = 400.0
temperature = 290.0
[[node]]
label = "rack"
kind = "boundary"
temperature = 250.0
[[linear_conductor]]
nodes = ["tank, left", "rack"]
conductance = 0.5
[[thermostat]]
node = "tank, left"
power = 30.0
on_below = 280.0
off_above = 285.0
initially_on = false
[output]
times = [0, 100, 400]
"#;

fn solve(text: &str, arguments: &[&str]) -> (tempfile::TempDir, Ran) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("net.toml"), text).expect("written");
    let ran = run(folder.path(), &[&["network", "net.toml", "--device", "cpu"], arguments].concat());
    (folder, ran)
}

/// Like `solve`, but on the device that `device` names, or without any name.
fn solve_on(text: &str, device: &[&str]) -> (tempfile::TempDir, Ran) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("net.toml"), text).expect("written");
    let ran = run(folder.path(), &[&["network", "net.toml"][..], device].concat());
    (folder, ran)
}

#[test]
fn series_and_events_are_written_and_the_work_is_told() {
    let (folder, ran) = solve(FILE, &["-o", "out.csv", "--integrator", "accurate", "--plot", "out.svg"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    for part in ["device: cpu", "RKL2 with", "sub-steps of", "senses that node itself", "work: "] {
        assert!(ran.err.contains(part), "{part}: {}", ran.err);
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
    let series = read("out.csv");
    let mut lines = series.lines();
    assert_eq!(lines.next(), Some("time,\"tank, left\",rack"));
    assert_eq!(lines.next(), Some("0,290.000000000,250.000000000"));
    // 250 + 40 exp(-100 / 800) = 285.299876.
    assert!(lines.next().is_some_and(|line| line.starts_with("100,285.2998")), "{series}");
    let events = read("out.events.csv");
    // 800 ln(40 / 30) = 230.145658 s.
    assert!(events.starts_with("time,node,on\n230.14"), "{events}");
    assert!(events.contains(",\"tank, left\",true\n"), "{events}");
    assert!(read("out.svg").contains("<svg"));
}

#[test]
fn a_series_goes_to_standard_output_without_a_file() {
    let (_folder, ran) = solve(FILE, &[]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert_eq!(ran.out.lines().count(), 4);
    assert!(ran.err.contains("switch: 230.14"), "{}", ran.err);
}

#[test]
fn a_steady_state_is_one_row() {
    let text = FILE.replace("power = 30.0", "power = 1.0");
    let (_folder, ran) = solve(&text, &["--steady"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    // 1 W over 0.5 W/K keeps the heated node below the threshold, so the heater stays on.
    assert_eq!(ran.out, "time,\"tank, left\",rack\n0,252.000000000,250.000000000\n");
    assert!(ran.err.contains("thermostat of 'tank, left': on"), "{}", ran.err);
    let (_folder, ran) = solve(FILE, &["--steady"]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("would switch off while on and on while off"), "{}", ran.err);
}

#[test]
fn what_the_user_can_mend_ends_with_2() {
    for (good, bad, message) in [
        ("nodes = [\"tank, left\", \"rack\"]", "nodes = [\"tank, left\", \"rak\"]", "did you mean 'rack'?"),
        ("conductance = 0.5", "conductance = -0.5", "net.toml:14: linear_conductor.conductance: must be 0 or above"),
        ("[output]\ntimes = [0, 100, 400]\n", "", "output.times is missing"),
        ("temperature = 290.0", "temperature = 290.0\nheat = -1e6", "likely loses more heat than it can"),
        (
            "conductance = 0.5",
            "conductance = 1e30",
            "the GL of 1e30 W/K between 'tank, left' and 'rack' evens them out",
        ),
    ] {
        let (_folder, ran) = solve(&FILE.replace(good, bad), &[]);
        assert_eq!(ran.code, 2, "{bad}: {}", ran.err);
        assert!(ran.err.contains(message), "{bad}: {}", ran.err);
    }
    let (_folder, ran) = solve(FILE, &["--integrator", "best"]);
    assert_eq!(ran.code, 2);
    let (_folder, ran) = solve(FILE, &["--tolerance", "0"]);
    assert_eq!(ran.code, 2);
}

#[test]
fn rows_come_in_the_order_asked_for() {
    let (_folder, ran) = solve(&FILE.replace("times = [0, 100, 400]", "times = [400, 0, 400, 100]"), &[]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let rows: Vec<&str> = ran.out.lines().skip(1).collect();
    let times: Vec<&str> = rows.iter().filter_map(|row| row.split(',').next()).collect();
    assert_eq!(times, ["400", "0", "400", "100"]);
    assert!(rows[0] == rows[2] && rows[0][3..] != rows[3][3..], "{}", ran.out);
}

/// A named device is accepted, and the output says that the processor integrates.
#[test]
fn a_network_is_integrated_on_the_processor_whatever_device_is_named() {
    let (_folder, plain) = solve_on(FILE, &[]);
    assert_eq!(plain.code, 0, "{}", plain.err);
    assert!(plain.err.contains("device: cpu") && !plain.err.contains("integrated:"), "{}", plain.err);
    let (_folder, named) = solve_on(FILE, &["--device", "llvmpipe"]);
    assert_eq!((named.code, &named.out), (0, &plain.out), "{}", named.err);
    let told = "integrated: in f64 on the processor, as every network file; --device llvmpipe changes nothing";
    assert!(named.err.contains(told), "{}", named.err);
}

/// Space at 0 K and an arithmetic node. Without heat it is at 0 K. Negative heat has no balance.
#[test]
fn a_node_without_heat_is_at_0_k_and_one_below_is_refused() {
    let text = |heat: &str| {
        format!(
            "space_temperature = 0\n[[node]]\nlabel = \"foil\"\nkind = \"arithmetic\"\nemissive_area = 0.1\nheat = {heat}\n\
             [output]\ntimes = [0, 60, 100]\n"
        )
    };
    for device in [["--device", ""], ["--device", "cpu"]] {
        let (_folder, ran) = solve_on(&text("{ time = [50, 50], power = [10, 0] }"), &device);
        assert_eq!(ran.code, 0, "{}", ran.err);
        let last: f64 = ran.out.trim_end().rsplit(',').next().and_then(|cell| cell.parse().ok()).expect("a number");
        assert!(last.abs() < 1e-6, "{}", ran.out);
        for heat in ["-1", "{ time = [50, 60], power = [10, -1] }"] {
            let (_folder, ran) = solve_on(&text(heat), &device);
            assert_eq!(ran.code, 2, "{heat}, {device:?}: {}", ran.out);
            assert!(ran.err.contains("node 'foil'"), "{}", ran.err);
        }
    }
}

/// A node of time constant C / G between two thresholds. Its switching times are sums of tau ln((aim - from) / (aim -
/// to)).
#[test]
fn switching_times_hold_over_days() {
    let text = "space_temperature = 0\n\
                [[node]]\nlabel = \"tank\"\nkind = \"diffusive\"\ncapacitance = 15000\ntemperature = 272\n\
                [[node]]\nlabel = \"rack\"\nkind = \"boundary\"\ntemperature = 200\n\
                [[linear_conductor]]\nnodes = [\"tank\", \"rack\"]\nconductance = 0.05\n\
                [[thermostat]]\nnode = \"tank\"\nsensor = \"tank\"\npower = 20\non_below = 262\noff_above = 268\n\
                initially_on = false\n[output]\ntimes = [400000]\n";
    let way = |from: f64, to: f64, aim: f64| 300_000.0 * ((aim - from) / (aim - to)).ln();
    let mut exact = vec![way(272.0, 262.0, 200.0)];
    while exact.len() < 22 {
        let last = exact[exact.len() - 1];
        exact.push(last + if exact.len() % 2 == 1 { way(262.0, 268.0, 600.0) } else { way(268.0, 262.0, 200.0) });
    }
    for device in [["--device", ""], ["--device", "cpu"]] {
        let (_folder, ran) = solve_on(text, &device);
        assert_eq!(ran.code, 0, "{}", ran.err);
        let lines = ran.err.lines().filter_map(|line| line.strip_prefix("switch: ")?.split(' ').next()?.parse().ok());
        let found: Vec<f64> = lines.collect();
        assert_eq!(found.len(), exact.len(), "{}", ran.err);
        let late = found.iter().zip(&exact).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max);
        println!("22 switches in 4e5 s, {device:?}: {late:.3} s");
        assert!(late < 0.05, "{device:?}: {late} s");
    }
}

#[test]
fn the_example_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ran = run(root, &["network", "models/cubesat_network.toml", "--device", "cpu"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.err.contains("switch: "), "its heater must switch: {}", ran.err);
}

#[test]
fn an_s2e_core_model_is_imported() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write(
        "node.csv",
        "Node_id,Node_label,node_type (0: diffusive 1: boundary 2: arithmetic),heater_node_id,capacity[J/K],alpha,\
         epsilon,area[m^2],normal_v_b_x,normal_v_b_y,normal_v_b_z,initial_temperature[K]\n\
         0,PANEL.1,0,1,241.2,0.11,0.05,0.01,-1,0,0,293\n1,FOIL.1,2,0,0,0,0,0,0,0,0,293\n2,SPACE.1,1,0,0,0,0,0,0,0,0,3\n",
    );
    write("cij.csv", "[W/K],PANEL.1,FOIL.1,SPACE.1\nPANEL.1,0,0.5,0\nFOIL.1,0.5,0,0\nSPACE.1,0,0,0\n");
    write("rij.csv", "[m2],PANEL.1,FOIL.1,SPACE.1\nPANEL.1,0,0,0\nFOIL.1,0,0,0.02\nSPACE.1,0,0.02,0\n");
    write("heaters.csv", "id,power_rating[W],lower_threshold[degC],upper_threshold[degC]\n1,3,15,18\n");
    write("heatload.csv", "NodeID/Times[s],0,1000\n0,0,2\n1,0,0\n2,0,0\n");
    let ran = run(folder.path(), &["network", "import", ".", "-o", "net.toml"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let text = std::fs::read_to_string(folder.path().join("net.toml")).expect("written");
    for part in [
        "label = \"PANEL.1\"",
        "capacitance = 241.2",
        "kind = \"arithmetic\"",
        "power = [0.0, 2.0]",
        "on_below = 288.15",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(text.matches("_conductor]]").count(), 2, "{text}");
    std::fs::write(folder.path().join("net.toml"), text + "\n[output]\ntimes = [0, 1000]\n").expect("written");
    let ran = run(folder.path(), &["network", "net.toml", "--device", "cpu"]);
    assert_eq!((ran.code, ran.out.lines().count()), (0, 3), "{}", ran.err);

    write("rij.csv", "[m2],PANEL.1,FOIL.1,SPACE.1\nPANEL.1,0,0,0\nFOIL.1,0,0,0.02\nSPACE.1,0,0.03,0\n");
    let ran = run(folder.path(), &["network", "import", ".", "-o", "net.toml"]);
    assert_eq!(ran.code, 2);
    assert!(ran.err.contains("a conductor has one value"), "{}", ran.err);
}

/// 30 tanks that cool towards a rack, each with a heater that switches every 25 s or so.
fn thirty_heaters(days: u32) -> String {
    let mut text =
        "space_temperature = 0.0\n[[node]]\nlabel = \"rack\"\nkind = \"boundary\"\ntemperature = 250.0\n".to_owned();
    for tank in 0..30 {
        text.push_str(&format!(
            "[[node]]\nlabel = \"tank{tank}\"\nkind = \"diffusive\"\ncapacitance = {}\ntemperature = 288.0\n\
             [[linear_conductor]]\nnodes = [\"tank{tank}\", \"rack\"]\nconductance = 0.5\n\
             [[thermostat]]\nnode = \"tank{tank}\"\npower = 40.0\non_below = 280.0\noff_above = 281.0\n",
            400 + 7 * tank
        ));
    }
    let times: Vec<String> = (0..=days).map(|day| (86_400 * day).to_string()).collect();
    format!("{text}[output]\ntimes = [{}]\n", times.join(", "))
}

fn ordinary_heaters_run_on(days: u32, least: usize) {
    let (folder, ran) = solve(&thirty_heaters(days), &["-o", "out.csv"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let lines = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file").lines().count();
    assert_eq!(lines("out.csv"), days as usize + 2);
    assert!(lines("out.events.csv") > least, "{} switches", lines("out.events.csv"));
}

#[test]
#[ignore = "long: tools/test --all"]
fn ordinary_heaters_switch_as_often_as_they_need() {
    ordinary_heaters_run_on(6, 300_000);
}

/// Bands of 1 mK and 1e-7 K, and the heater of a foil without capacitance.
#[test]
fn a_band_that_can_not_hold_ends_the_run_and_keeps_what_was_computed() {
    let times = FILE.replace("[0, 100, 400]", "[1e6, 100, 0]");
    let foil = times
        .replace("capacitance = 400.0\ntemperature = 290.0", "capacitance = 400.0\ntemperature = 290.0\n[[node]]\nlabel = \"foil\"\nkind = \"arithmetic\"")
        .replace("[[thermostat]]\nnode = \"tank, left\"", "[[linear_conductor]]\nnodes = [\"tank, left\", \"foil\"]\nconductance = 0.1\n[[thermostat]]\nnode = \"foil\"");
    for (text, node, band) in [
        (times.replace("off_above = 285.0", "off_above = 280.001"), "tank, left", "280.001"),
        (times.replace("off_above = 285.0", "off_above = 280.0000001"), "tank, left", "280.0000001"),
        (foil, "foil", "285"),
    ] {
        let (folder, ran) = solve(&text, &["-o", "out.csv", "--plot", "out.svg"]);
        assert_eq!(ran.code, 2, "{}", ran.err);
        // The tank reaches the band after 800 ln(40 / 30) = 230.1 s.
        for part in [
            "at 2",
            &format!("thermostat of '{node}'"),
            " times within ",
            &format!("from 280 to {band} K"),
            "30 W",
            "widen",
        ] {
            assert!(ran.err.contains(part), "{part}: {}", ran.err);
        }
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
        let series = read("out.csv");
        let rows: Vec<&str> = series.lines().skip(1).map(|line| line.split(',').next().unwrap_or_default()).collect();
        assert_eq!(rows, ["100", "0"], "the rows that were reached, in the order asked for");
        assert!(read("out.events.csv").lines().nth(1).is_some_and(|line| line.starts_with("230.14")));
        assert!(read("out.svg").contains("<svg"));
        let (_folder, ran) = solve(&text, &[]);
        assert_eq!((ran.code, ran.out.lines().count()), (2, 3), "{}", ran.err);
    }
    // An error before the first row leaves the file of an earlier run.
    let (folder, _) = solve(FILE, &["-o", "out.csv"]);
    let cold =
        FILE.replace("temperature = 290.0", "temperature = 290.0\nheat = -1e9").replace("[0, 100, 400]", "[100]");
    std::fs::write(folder.path().join("net.toml"), cold).expect("written");
    let before = std::fs::read(folder.path().join("out.csv")).expect("a file");
    let ran = run(folder.path(), &["network", "net.toml", "--device", "cpu", "-o", "out.csv"]);
    assert_eq!(ran.code, 2, "{}", ran.err);
    assert_eq!(std::fs::read(folder.path().join("out.csv")).expect("a file"), before);
}
