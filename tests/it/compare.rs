//! The command `compare` of the built program: three responses of one small craft.

use std::collections::BTreeMap;

use super::craft::{Folder, SCENE, scene_with};
use super::program::{end, isotherm, refusal, stderr, succeed};

const SKIN: &str = "match = \"skin\"\n";
const CELLS: &str = "match = \"cells\"\n";
const MAST: &str = "match = \"mast\"\n";
/// 2 mm of aluminium.
const BULK: &str = "thickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 200\n";

/// The craft with bulk values for skin and cells. The scene states functions for the skin. Those of the cells are
/// fitted. The mast has no memory.
fn scene(bulk: &str) -> String {
    let skin = format!("{SKIN}{bulk}");
    let cells = format!("{CELLS}{bulk}");
    let scene = scene_with(&[
        (SKIN, &skin),
        (CELLS, &cells),
        ("heating = { function = \"quadratic\", t_max_steps = 4 }\n", ""),
        ("cooling = { function = \"quadratic\", t_max_steps = 6 }\n", ""),
    ]);
    // The response of the cells is `network`.
    let (before, after) = scene.split_once(&cells).expect("the cells");
    format!(
        "{before}{cells}{}",
        after.replacen("response = \"transition\"\nretarget = \"merge\"", "response = \"network\"", 1)
    )
}

/// The rows of `compare.csv` by part and response.
fn table(text: &str) -> BTreeMap<(String, String), BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let head = reader.headers().expect("a head").clone();
    let rows = reader.records().map(|row| row.expect("a row"));
    rows.map(|row| {
        let cells = head.iter().map(str::to_owned).zip(row.iter().map(str::to_owned)).collect();
        ((row[0].to_owned(), row[1].to_owned()), cells)
    })
    .collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} = '{}' is a number", row[column]))
}

fn column(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(folder.path(file)).expect("a CSV file");
    let index = reader.headers().expect("a head").iter().position(|column| column == name).expect(name);
    reader.records().map(|row| row.expect("a row")[index].parse().expect("a number")).collect()
}

#[test]
#[ignore = "long: tools/test --all"]
fn three_responses_of_one_craft() {
    let folder = Folder::new(&scene(BULK));
    let said = succeed(folder.0.path(), &["compare", "scene.toml", "-o", "out"]);
    assert!(said.contains("cells, fitted between") && !said.contains("skin, fitted"), "{said}");
    for file in [
        "compare.html",
        "comparison.png",
        "differences.csv",
        "panels/step_000004.png",
        "plots/differences.svg",
        "plots/probe_1.svg",
    ] {
        assert!(folder.path("out").join(file).exists(), "{file}");
    }
    let rows = table(&std::fs::read_to_string(folder.path("out/compare.csv")).expect("the table"));
    assert_eq!(rows.len(), 2 * 5, "four parts and all");
    let of = |part: &str, response: &str| &rows[&(part.to_owned(), response.to_owned())];
    // A material without memory in every run has no difference.
    assert_eq!((number(of("mast", "instant"), "rms"), number(of("mast", "transition"), "max")), (0.0, 0.0));
    // A shield of 4860 J/(m2 K) takes 18 min to cool (tau = C / (4 e sigma T^3) at 290 K). After the entry into eclipse
    // the balance is far below it.
    assert!(number(of("body", "instant"), "rms") > 20.0);
    assert!(number(of("wing_port", "transition"), "rms") < 0.5 * number(of("wing_port", "instant"), "rms"));

    // The table must agree with the series. The wing has one temperature except for its gradient.
    let row = of("wing_port", "instant");
    let step = number(row, "step") as usize;
    assert_eq!(number(row, "time"), 60.0 * step as f64);
    assert!((number(row, "temperature") - number(row, "network") - number(row, "max")).abs() < 1e-3);
    let [own, network] = ["instant", "network"].map(|name| format!("out/series_{name}.csv"));
    let within = |file: &str, value: f64| {
        let [least, greatest] = ["min", "max"].map(|end| column(&folder, file, &format!("part:wing_port:{end}"))[step]);
        least - 1e-3 <= value && value <= greatest + 1e-3
    };
    assert!(within(&own, number(row, "temperature")) && within(&network, number(row, "network")));
    let means = |file: &str| column(&folder, file, "all:mean");
    let difference = column(&folder, "out/differences.csv", "instant:mean");
    for (step, (own, network)) in means(&own).into_iter().zip(means(&network)).enumerate() {
        assert!((own - network - difference[step]).abs() < 2e-5, "step {step}");
    }

    let page = std::fs::read_to_string(folder.path("out/compare.html")).expect("the page");
    for text in ["instant in all runs", "step response between", "Functions are those of", "Cost"] {
        assert!(page.contains(text), "{text}");
    }

    // With a hundredth of the capacitance, the network and the fitted transition are nearly the instant balance.
    folder.write("scene.toml", &scene(&BULK.replace("0.002", "0.00002")));
    succeed(folder.0.path(), &["compare", "scene.toml", "-o", "thin", "--device", "cpu"]);
    let thin = table(&std::fs::read_to_string(folder.path("thin/compare.csv")).expect("the table"));
    let thick = number(of("wing_port", "instant"), "rms");
    let thin = number(&thin[&("wing_port".to_owned(), "instant".to_owned())], "rms");
    assert!(thin < 0.2 * thick, "{thin} K against {thick} K");

    let output = end(isotherm(folder.0.path(), &["compare", "scene.toml", "-o", "out"]));
    let (code, line) = refusal(&output);
    assert_eq!(code, Some(2));
    assert!(line.contains("not empty"), "{line}");
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_reference_agrees_with_the_device() {
    let folder = Folder::new(&scene(BULK));
    for (device, name) in [(None, "device"), (Some("cpu"), "cpu")] {
        let mut arguments = vec!["compare", "scene.toml", "-o", name];
        arguments.extend(device.map(|device| ["--device", device]).into_iter().flatten());
        succeed(folder.0.path(), &arguments);
    }
    let [device, cpu] = ["device", "cpu"]
        .map(|name| table(&std::fs::read_to_string(folder.path(name).join("compare.csv")).expect("the table")));
    for (key, row) in &device {
        let difference = (number(row, "rms") - number(&cpu[key], "rms")).abs();
        // A network has an error of 5 mK by default. Both runs have it, so the limit is twice that.
        assert!(difference < 1e-2, "{key:?}: {difference} K");
    }
}

#[test]
fn what_a_network_lacks_is_named_with_its_keys() {
    let refused = |scene: &str| {
        let folder = Folder::new(scene);
        let output = end(isotherm(folder.0.path(), &["compare", "scene.toml", "-o", "out", "--device", "cpu"]));
        assert!(!folder.path("out").exists(), "nothing is left behind");
        let (code, line) = refusal(&output);
        assert_eq!(code, Some(2), "{line}");
        line
    };
    let line = refused(SCENE);
    for text in ["scene.toml", "'skin': thickness [m], density [kg/m3], specific_heat [J/(kg K)]", "'cells': thickness"]
    {
        assert!(line.contains(text), "{text}: {line}");
    }
    assert!(!line.contains("'mast'"), "a material without memory stays as it is: {line}");

    let line = refused(&scene(&BULK.replace("density = 2700\n", "")));
    assert!(line.contains("'skin': density [kg/m3]; 'cells': density [kg/m3]. "), "{line}");

    // An instant material with a thickness was probably meant to have memory.
    let line = refused(&scene(BULK).replacen(MAST, &format!("{MAST}thickness = 0.001\n"), 1));
    assert!(line.contains("'mast': density [kg/m3], specific_heat [J/(kg K)]. "), "{line}");

    let responses = ["response = \"transition\"\n", "response = \"network\"\n"];
    let instant =
        responses.iter().fold(SCENE.to_owned(), |scene, from| scene.replace(from, "response = \"instant\"\n"));
    let line = refused(&instant);
    assert!(line.contains("no network to compare with"), "{line}");
}

#[test]
fn a_scene_that_draws_nothing_is_compared_in_numbers() {
    let folder = Folder::new(&scene(BULK).replace("draw_every = 4", "draw_every = 0"));
    succeed(folder.0.path(), &["compare", "scene.toml", "-o", "out", "--device", "cpu"]);
    assert!(!folder.path("out/comparison.png").exists() && folder.path("out/compare.csv").exists());
    let page = std::fs::read_to_string(folder.path("out/compare.html")).expect("the page");
    assert!(page.contains("there are no pictures"));
}

/// A fit that takes days, or that follows nothing, is none. What the scene states is taken as it is.
#[test]
fn a_fit_that_is_none_is_refused() {
    let thick = scene(&BULK.replace("0.002", "2")).replace("steps = 12", "steps = 1\nwarm_up_orbits = 0");
    let folder = Folder::new(&thick);
    let output = end(isotherm(folder.0.path(), &["compare", "scene.toml", "-o", "out", "--device", "cpu"]));
    let (_, line) = refusal(&output);
    for text in ["material 'cells'", "orbits, so it would hardly move", "State heating and cooling"] {
        assert!(line.contains(text), "{text}: {line}");
    }
    assert!(!folder.path("out/compare.csv").exists());
    // The cells of this scene have the rule with `network`.
    let stated = "response = \"network\"\nheating = { function = \"quadratic\", t_max = 2e5 }\n\
                  cooling = { function = \"quadratic\", t_max = 2e5 }\n";
    folder.write("scene.toml", &thick.replace("response = \"network\"\n", stated));
    succeed(folder.0.path(), &["compare", "scene.toml", "-o", "out", "--device", "cpu"]);
}

/// Without a warm-up in the scene each run starts where an orbit ends as it began. `warm_up_orbits = 0` keeps the cold start, 62 K or so away.
#[test]
fn runs_start_from_their_own_periodic_states() {
    let own = scene(BULK).replace("draw_every = 4", "draw_every = 0").replace("steps = 12", "steps = 1");
    let folder = Folder::new(&own);
    let told = |run: &str| {
        let output = end(isotherm(folder.0.path(), &["compare", "scene.toml", "-o", run, "--device", "cpu"]));
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output)
    };
    let said = told("own");
    assert!(said.contains("its own periodic state") && !said.contains("No orbit is stepped"), "{said}");
    folder.write("scene.toml", &own.replace("steps = 1", "steps = 1\nwarm_up = \"periodic\""));
    let said = told("periodic");
    assert!(!said.contains("its own periodic state"), "{said}");
    folder.write("scene.toml", &own.replace("steps = 1", "steps = 1\nwarm_up_orbits = 0"));
    told("cold");
    let of = |run: &str, name: &str| column(&folder, &format!("{run}/series_{name}.csv"), "part:wing_port:mean")[0];
    for name in ["instant", "transition", "network"] {
        let [own, periodic, cold] = ["own", "periodic", "cold"].map(|run| of(run, name));
        println!("{name}: {own} K periodic, {cold} K cold");
        assert_eq!(own, periodic, "{name}");
        assert!(name == "instant" || (own - cold).abs() > 1.0, "{name}: {own} K and {cold} K");
    }
}

/// 4 mm of aluminium takes longer to warm than the run, and its warm-up can not become periodic.
#[test]
#[ignore = "long: tools/test --all"]
fn a_fit_and_a_warm_up_that_are_not_to_be_trusted_are_told() {
    let thick = BULK.replace("0.002", "0.004");
    let periodic = "step = 60\nwarm_up = \"periodic\"\nwarm_up_tolerance = 1e-6\nwarm_up_orbits = 2\n";
    let folder = Folder::new(&scene(&thick).replace("step = 60\n", periodic).replace("steps = 12", "steps = 2"));
    let output = end(isotherm(folder.0.path(), &["compare", "scene.toml", "-o", "out", "--device", "cpu"]));
    let said = stderr(&output);
    assert!(output.status.success(), "{said}");
    let page = std::fs::read_to_string(folder.path("out/compare.html")).expect("the page");
    for part in ["The warm-up of 'network' did not become periodic within 0.000001 K", "of 'cells' takes"] {
        let escaped = part.replace('\'', "&#39;");
        assert!(said.contains(&format!("warning: {part}")) || said.contains(part), "{part}: {said}");
        assert!(page.contains(part) || page.contains(&escaped), "{part}");
    }
    for command in [&["run", "scene.toml", "-o", "ran"][..], &["render", "scene.toml", "--time", "60", "-o", "a.exr"]] {
        let output = end(isotherm(folder.0.path(), &[command, &["--device", "cpu"]].concat()));
        let said = stderr(&output);
        assert!(said.contains("warning: The warm-up did not become periodic within 0.000001 K: 2 orbits"), "{said}");
    }
}
