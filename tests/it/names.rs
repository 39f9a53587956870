//! Names with control characters, marks that turn text round, and formulas: no output shows them as they are.

use std::fs;
use std::path::Path;

use isotherm::internals::is_hidden;
use serde_json::json;

use super::craft::{Folder, glb, scene_with};
use super::program::{end, isotherm, stderr};

/// A name that colours a terminal, forges a message, turns text round and breaks XML.
const EVIL: &str = "=1+1\u{1b}[31m\r\nerror: forged\u{202e}\u{9b}\u{7f}\u{0}\u{ffff}<b>";

/// The same as a string of TOML.
const EVIL_TOML: &str = r#""=1+1\u001b[31m\r\nerror: forged\u202e\u009b\u007f\u0000\uffff<b>""#;

/// What stands for it in every output.
const SHOWN: &str = "=1+1\\u{1b}[31m\\r\\nerror: forged\\u{202e}\\u{9b}\\u{7f}\\u{0}\\u{ffff}<b>";

/// Line feeds divide lines. Nothing else that is hidden may be there, and no line is forged.
fn check(text: &str, what: &str) {
    let wrong = text.chars().find(|character| *character != '\n' && is_hidden(*character));
    assert_eq!(wrong, None, "{what}: {text:?}");
    assert!(!text.lines().any(|line| line.starts_with("error: forged")), "{what}: {text}");
}

/// Runs a command and checks what it prints. Returns both streams.
fn printed(folder: &Path, arguments: &[&str], success: bool) -> String {
    let output = end(isotherm(folder, arguments));
    assert_eq!(output.status.success(), success, "{arguments:?}: {}", stderr(&output));
    assert_ne!(output.status.code(), Some(101));
    let out = String::from_utf8(output.stdout.clone()).expect("text");
    check(&out, &format!("{arguments:?}"));
    check(&stderr(&output), &format!("{arguments:?}"));
    out + &stderr(&output)
}

/// Checks every text file of a folder, and that every SVG is XML.
fn check_files(folder: &Path) -> usize {
    let mut drawings = 0;
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.extension().and_then(|extension| extension.to_str()) {
            _ if path.is_dir() => drawings += check_files(&path),
            Some("svg" | "html" | "csv") => {
                let text = fs::read_to_string(&path).expect("text");
                check(&text, &path.display().to_string());
                if path.extension().is_some_and(|extension| extension == "svg") {
                    roxmltree::Document::parse(&text).expect("XML");
                    drawings += 1;
                }
            }
            _ => {}
        }
    }
    drawings
}

#[test]
fn names_of_a_model_and_a_scene_are_escaped_in_every_output() {
    let scene = scene_with(&[
        ("name = \"craft\"", &format!("name = {EVIL_TOML}")),
        ("match = \"cells\"", &format!("match = {EVIL_TOML}")),
        ("name = \"tip\"", &format!("name = {EVIL_TOML}")),
        ("part = \"wing_starboard\"", &format!("part = {EVIL_TOML}")),
    ]);
    let folder = Folder::new(&scene);
    let mut maker = glb();
    maker.json["materials"][1]["name"] = json!(EVIL);
    let nodes = maker.json["nodes"].as_array_mut().expect("nodes");
    let wing = nodes.iter_mut().find(|node| node["name"] == "wing_starboard").expect("a wing");
    wing["name"] = json!(EVIL);
    maker.save(folder.0.path());
    let at = folder.0.path();
    assert!(printed(at, &["info", "made.glb"], true).contains(SHOWN));
    printed(at, &["info", "made.glb", "--json"], true);
    assert!(printed(at, &["info", "scene.toml"], true).contains(SHOWN));
    printed(at, &["info", "scene.toml", "--json"], true);
    printed(at, &["run", "scene.toml", "--device", "cpu", "-o", "out"], true);
    assert!(check_files(&folder.path("out")) > 0, "a run draws plots");
    let series = fs::read_to_string(folder.path("out/series.csv")).expect("a series");
    let header = series.lines().next().expect("a header");
    assert!(header.contains(&format!("part:{SHOWN}:min")) && header.contains(&format!("probe:{SHOWN}")), "{header}");
}

#[test]
fn labels_of_a_network_are_escaped_and_no_cell_is_a_formula() {
    let network = format!(
        "[[node]]\nlabel = {EVIL_TOML}\nkind = \"diffusive\"\ncapacitance = 100\ntemperature = 285\n\
         [[node]]\nlabel = \"-Y, wall\"\nkind = \"boundary\"\ntemperature = 280\n\
         [[linear_conductor]]\nnodes = [{EVIL_TOML}, \"-Y, wall\"]\nconductance = 0.5\n\
         [[thermostat]]\nnode = {EVIL_TOML}\npower = 5\non_below = 284\noff_above = 286\ninitially_on = true\n\
         [output]\ntimes = [0, 500]\n"
    );
    let folder = Folder::new(&network);
    let at = folder.0.path();
    let arguments = ["network", "scene.toml", "--device", "cpu"];
    printed(at, &[&arguments[..], &["-o", "net.csv", "--plot", "net.svg"]].concat(), true);
    let printed_csv = printed(at, &arguments, true);
    check_files(at);
    let csv = fs::read_to_string(folder.path("net.csv")).expect("written");
    let header = csv.lines().next().expect("a header");
    assert_eq!(header, format!("time,\"'{SHOWN}\",\"'-Y, wall\""));
    assert!(printed_csv.contains(header));
    let events = fs::read_to_string(folder.path("net.events.csv")).expect("written");
    assert!(events.lines().nth(1).is_some_and(|line| line.contains(&format!(",\"'{SHOWN}\","))), "{events}");
    // Numbers stay numbers.
    assert!(csv.lines().skip(1).all(|line| line.split(',').all(|cell| cell.parse::<f64>().is_ok())), "{csv}");
}

#[test]
fn what_is_refused_is_told_without_control_characters() {
    let folder = Folder::new("");
    let at = folder.0.path();
    let missing = "no\u{1b}[31m\nerror: forged\u{202e}.toml";
    for arguments in [&["info", missing][..], &["run", missing, "-o", "out"], &["network", missing]] {
        assert!(printed(at, arguments, false).contains("\\u{1b}[31m"), "{arguments:?}");
    }
    printed(at, &["info", "--\u{1b}[31m\nerror: forged"], false);
    printed(at, &["radiance", "\u{1b}[31m\nerror: forged"], false);
    for scene in [
        format!("{EVIL_TOML} = 1"),
        format!("[time]\nstep = {EVIL_TOML}"),
        format!("name = {EVIL_TOML}\n[shadows]\nmethod = {EVIL_TOML}"),
        "name = \"\u{1b}[31m\"".to_owned(),
    ] {
        folder.write("scene.toml", &scene);
        printed(at, &["info", "scene.toml"], false);
    }
    let mut maker = glb();
    maker.json["nodes"][1]["name"] = json!(EVIL);
    maker.json["nodes"][1]["mesh"] = json!(99);
    maker.json["extensionsRequired"] = json!([EVIL]);
    maker.save(at);
    printed(at, &["info", "made.glb"], false);
    maker.json.as_object_mut().expect("an object").remove("extensionsRequired");
    maker.save(at);
    printed(at, &["info", "made.glb"], false);
}
