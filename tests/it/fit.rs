//! `isotherm fit`: hidden values of networks and plates, closed forms and scipy.

mod craft;
mod refusals;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use isotherm::internals::STEFAN_BOLTZMANN;
use serde_json::Value;

use super::budget::{LIT, scene, squares, sunlight};
use super::program::{end, isotherm, refusal, stderr, succeed};
use super::random::Random;

const CPU: [&str; 2] = ["--device", "cpu"];

/// Fits, and reads the results.
fn fit(folder: &Path, arguments: &[&str]) -> Value {
    succeed(folder, &[&["fit"], arguments].concat());
    let place = arguments.iter().position(|argument| *argument == "-o").expect("a folder") + 1;
    let text = std::fs::read_to_string(folder.join(arguments[place]).join("fit.json")).expect("results");
    serde_json::from_str(&text).expect("JSON")
}

/// Logarithm of the factor of each parameter, and its standard deviation.
fn logarithms(fitted: &Value) -> Vec<[f64; 2]> {
    let list = fitted["parameters"].as_array().expect("a list").iter();
    let number = |value: &Value| value.as_f64().expect("a number");
    list.map(|parameter| [number(&parameter["factor"]).ln(), number(&parameter["log_sigma"])]).collect()
}

fn sentences(fitted: &Value) -> String {
    fitted["text"].as_array().expect("a list").iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n")
}

fn network(capacitance: f64, area: f64, conductance: f64, times: &[f64]) -> String {
    format!(
        "space_temperature = 2.7\n[[node]]\nlabel = \"panel\"\nkind = \"diffusive\"\ncapacitance = {capacitance}\nemissive_area = {area}\n\
         temperature = 285\nheat = 9\n[[node]]\nlabel = \"structure\"\nkind = \"diffusive\"\ncapacitance = 450\ntemperature = 288\n\
         [[linear_conductor]]\nnodes = [\"panel\", \"structure\"]\nconductance = {conductance}\n[output]\ntimes = {times:?}\n"
    )
}

fn three_parameters(prior: &str) -> String {
    [
        ("capacitance", "node = \"pan*\"", 40),
        ("emissive_area", "node = \"panel\"", 40),
        ("conductance", "between = [\"structure\", \"panel\"]", 100),
    ]
    .map(|(vary, owner, percent)| format!("[[parameter]]\nvary = \"{vary}\"\n{owner}\npercent = {percent}\n{prior}\n"))
    .concat()
}

const FIT_NETWORK: [&str; 6] = ["network.toml", "--measured", "t.csv", "--parameters", "p.toml", "-o"];

/// `python3 tools/oracle/fitted.py tests/oracle/fit_network.csv` (scipy 1.17.1) printed these.
#[test]
fn a_network_is_fitted_as_scipy_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("network.toml", &network(120.0, 0.0085, 0.35, &[0.0, 6000.0]));
    write("t.csv", include_str!("../oracle/fit_network.csv"));
    let known = [[-0.214680, 0.037265], [0.119232, 0.006331], [0.337248, 0.016146]];
    let off = |fitted: &Value| {
        let pairs = logarithms(fitted).into_iter().zip(known);
        let off = pairs.map(|([x, sigma], [x0, sigma0])| ((x - x0).abs() / sigma0).max((sigma / sigma0 - 1.0).abs()));
        off.fold(0.0, f64::max)
    };
    write("p.toml", &three_parameters(""));
    let fitted = fit(folder.path(), &[&FIT_NETWORK[..], &["out"]].concat());
    assert!(off(&fitted) < 0.02, "{} of a standard deviation: {fitted}", off(&fitted));
    let correlation = fitted["correlation"][0][1].as_f64().expect("a number");
    assert!((correlation + 0.94904).abs() < 0.003, "{correlation}");
    // Without the loss the glitch of 8 K shows.
    write("p.toml", &(three_parameters("") + "[fit]\nloss = \"square\"\n"));
    let square = fit(folder.path(), &[&FIT_NETWORK[..], &["square"]].concat());
    assert!(off(&square) > 0.1, "{}", off(&square));
    // The fitted file is a network file that computes what the fit says.
    let text = std::fs::read_to_string(folder.path().join("out/fitted.toml")).expect("a file");
    write("network.toml", &text);
    write("p.toml", &three_parameters(""));
    let again = fit(folder.path(), &[&FIT_NETWORK[..], &["again"]].concat());
    let before = again["rms"]["before_k"].as_f64().expect("a number");
    assert!((before - fitted["rms"]["after_k"].as_f64().expect("a number")).abs() < 1e-4);
    for name in ["parameters.csv", "correlation.csv", "misfits.csv", "residuals.csv", "measured.svg", "residuals.svg"] {
        assert!(folder.path().join("out").join(name).exists(), "{name}");
    }
}

/// Standard deviations a hundredth of the true ones make the errors of the values void, and a glitch among good ones does not.
#[test]
fn residuals_that_make_the_errors_void_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("network.toml", &network(120.0, 0.0085, 0.35, &[0.0, 6000.0]));
    write("p.toml", &three_parameters(""));
    let table = include_str!("../oracle/fit_network.csv");
    for (table, is_void) in [(table.to_owned(), false), (table.replace(",0.5\n", ",0.005\n"), true)] {
        write("t.csv", &table);
        let said = end(isotherm(folder.path(), &[&["fit"], &FIT_NETWORK[..], &["out", "--force"]].concat()));
        let warns = stderr(&said).contains("warning: the residuals are too large");
        let text = std::fs::read_to_string(folder.path().join("out/fit.json")).expect("results");
        assert!(said.status.success() && warns == is_void && text.contains("are void") == is_void, "{text}");
    }
}

/// A heat below 0 has an error above 0, and its interval begins at the lower end. Small values keep their digits.
#[test]
fn values_below_zero_and_small_ones_stand_right_in_the_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    write("network.toml", &network(120.0, 2e-7, 0.35, &[0.0, 6000.0]).replace("heat = 9", "heat = -2"));
    write("t.csv", "time,sensor,temperature,sigma\n1000,panel,281,0.5\n3000,panel,279,0.5\n");
    let heat = "[[parameter]]\nvary = \"node_heat\"\nnode = \"panel\"\npercent = 40\n";
    write("p.toml", &(heat.to_owned() + &heat.replace("node_heat", "emissive_area")));
    fit(folder.path(), &[&FIT_NETWORK[..], &["out"]].concat());
    let table = std::fs::read_to_string(folder.path().join("out/parameters.csv")).expect("a table");
    let row = |line: usize| -> Vec<f64> {
        let cells = table.lines().nth(line).expect("a row").split(',').skip(2).take(5);
        cells.map(|cell| cell.parse().expect("a number")).collect()
    };
    let [heat, area] = [row(1), row(2)];
    assert!(heat[1] < 0.0 && heat[2] > 0.0 && heat[3] < heat[1] && heat[1] < heat[4], "{table}");
    assert!(area[0] == 2e-7 && area[2] > 0.0 && area[3] > 0.0 && area[3] < area[1], "{table}");
}

/// Telemetry of a network with hidden values; forty draws of the noise, without priors.
#[test]
fn hidden_values_lie_within_two_standard_deviations() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    let times: Vec<f64> = (1..=40).map(|row| 150.0 * f64::from(row)).collect();
    let hidden = [1.0 / 1.2, 1.12, 1.4];
    write("true.toml", &network(120.0 * hidden[0], 0.0085 * hidden[1], 0.35 * hidden[2], &times));
    succeed(folder.path(), &["network", "true.toml", "-o", "truth.csv"]);
    let table = std::fs::read_to_string(folder.path().join("truth.csv")).expect("a table");
    let truth: Vec<Vec<f64>> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    write("network.toml", &network(120.0, 0.0085, 0.35, &times));
    write("p.toml", &three_parameters("prior = \"none\""));
    let [mut within, mut within_a_third, mut all] = [0, 0, 0];
    for trial in 0..40 {
        let mut random = Random(trial);
        let mut rows = "time,sensor,temperature,sigma\n".to_owned();
        for row in &truth {
            for (node, name) in ["panel", "structure"].into_iter().enumerate() {
                rows += &format!("{},{name},{:.5},0.5\n", row[0], row[node + 1] + 0.5 * random.normal());
            }
        }
        write("t.csv", &rows);
        let fitted = fit(folder.path(), &[&FIT_NETWORK[..], &["out", "--force"]].concat());
        for ([x, sigma], hidden) in logarithms(&fitted).into_iter().zip(hidden) {
            let off = (x - hidden.ln()).abs() / sigma;
            all += 1;
            within += usize::from(off <= 2.0);
            within_a_third += usize::from(off <= 2.0 / 3.0);
        }
    }
    println!("{within} of {all} within two standard deviations");
    assert!(within * 100 >= 90 * all, "{within} of {all}");
    assert!(within_a_third * 100 < 90 * all, "a third of the deviation would be too small");
}

/// A plate in balance: T^4 = alpha S / (eps sigma). Telemetry fixes the ratio of the two, and the priors the rest: a Gaussian with two linear terms.
#[test]
fn telemetry_of_a_plate_fixes_absorptivity_over_emissivity() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"radiative\"\n";
    let text = scene(&[("plate", own)], LIT, "").replace("draw_every = 5", "draw_every = 0");
    let folder = squares(&text, &[("plate", [0.0; 3], true)]);
    let measured = (1.05 * sunlight() / (0.8 * STEFAN_BOLTZMANN)).powf(0.25);
    let rows: String = (0..=10).map(|step| format!("{},top,{measured:.6},\n", 60 * step)).collect();
    folder.write("t.csv", &format!("time,sensor,temperature,sigma\n{rows}"));
    let pair = |[first, second]: [&str; 2]| {
        format!(
            "[[parameter]]\nvary = \"absorptivity\"\nmaterial = \"plate\"\npercent = 10\n{first}\n\
             [[parameter]]\nvary = \"emissivity\"\nmaterial = \"plate\"\npercent = 10\n{second}\n\
             [[sensor]]\nname = \"top\"\nposition = [0.4, 0.3, 0]\nsigma = 0.1\n"
        )
    };
    folder.write("p.toml", &pair(["prior_sigma = 0.1", "prior_sigma = 0.2"]));
    let arguments = [&["scene.toml", "--measured", "t.csv", "--parameters", "p.toml", "-o", "out"], &CPU[..]].concat();
    let fitted = fit(folder.0.path(), &arguments);
    // The initial state is the balance of the values that are tried, so every row is T = c (alpha / eps)^(1/4).
    let of_data = (4.0 * 0.1 / measured).powi(2) / 11.0;
    let whole = 0.01 + 0.04 + of_data;
    let ratio = 1.05f64.ln();
    let known = [
        [0.01 / whole * ratio, (0.01 - 0.01f64.powi(2) / whole).sqrt()],
        [-0.04 / whole * ratio, (0.04 - 0.04f64.powi(2) / whole).sqrt()],
    ];
    for ([x, sigma], [x0, sigma0]) in logarithms(&fitted).into_iter().zip(known) {
        assert!(
            (x - x0).abs() < 0.01 * sigma0 && (sigma / sigma0 - 1.0).abs() < 0.01,
            "{x} {sigma}, not {x0} {sigma0}"
        );
        assert!((sigma / sigma0 - 1.03).abs() > 0.01, "three percent more must show");
    }
    let covariance = fitted["covariance_of_logarithms"][0][1].as_f64().expect("a number");
    assert!((covariance / (0.01 * 0.04 / whole) - 1.0).abs() < 0.02, "{covariance}");
    let said = sentences(&fitted);
    assert!(said.contains("the data fix 'absorptivity of plate' / 'emissivity of plate', not each"), "{said}");
    // Without priors nothing tells the two apart.
    folder.write("p.toml", &pair(["prior = \"none\"", "prior = \"none\""]));
    let output = end(isotherm(folder.0.path(), &[&["fit"], &arguments[..5], &["-o", "singular"], &CPU[..]].concat()));
    let (code, line) = refusal(&output);
    assert!(
        code == Some(2) && line.contains("singular: the data fix 'absorptivity of plate' /"),
        "{}",
        stderr(&output)
    );
    assert!(!folder.path("singular").exists());
}

#[cfg(unix)]
#[test]
fn control_c_keeps_the_best_values_so_far() {
    let own = "emissivity = 0.8\nheat_capacity_per_area = 2430\nsides = \"outside\"\nresponse = \"radiative\"\n";
    let text = scene(&[("plate", own)], LIT, "").replace("steps = 10\ndraw_every = 5", "steps = 40000\ndraw_every = 0");
    let folder = squares(&text, &[("plate", [0.0; 3], true)]);
    folder.write("t.csv", "time,sensor,temperature,sigma\n300,plate,300,0.5\n2400000,plate,300,0.5\n");
    folder.write("p.toml", "[[parameter]]\nvary = \"absorptivity\"\nmaterial = \"plate\"\npercent = 60\n");
    let arguments =
        ["fit", "scene.toml", "--measured", "t.csv", "--parameters", "p.toml", "-o", "out", "--device", "cpu"];
    let mut command = isotherm(folder.0.path(), &arguments);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("its messages")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.starts_with("step 0: ")), "the first derivatives are there");
    let kill = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(kill.expect("a shell").success());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("it ends").code(), Some(1), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("stopped; what was finished is in out")), "{rest:?}");
    let text = std::fs::read_to_string(folder.path("out/fit.json")).expect("results");
    let fitted: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&fitted["stopped"], &fitted["converged"]), (&true.into(), &false.into()));
}
