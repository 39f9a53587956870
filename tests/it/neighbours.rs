//! Neighbours that nothing joins: `check`, run and report tell them, and `[network] contacts` joins what touches.

use isotherm::internals::{CheckEffort, check};
use serde_json::{Value, json};

use super::craft::{Folder, scene_with};
use super::model::make::Maker;
use super::program::{self, run, succeed};

const SKIN: &str =
    "response = \"network\"\nthickness = 0.002\ndensity = 2700\nspecific_heat = 900\nconductivity = 160\n";
const TRANSITION: &str = "response = \"transition\"\nretarget = \"merge\"\nheating = { function = \"quadratic\", t_max_steps = 20 }\n\
                          cooling = { function = \"linear\", t_max_steps = 30 }\n";

/// The craft with skin and mast in the network, and its cells outside.
fn scene(network: &str) -> String {
    let mast = format!("{SKIN}[radiance]");
    scene_with(&[
        (TRANSITION, SKIN),
        ("response = \"instant\"\n[radiance]", &mast),
        ("[[probe]]", &format!("{network}[[probe]]")),
    ])
}

/// Neighbours that `check` lists for one reason.
fn listed(folder: &Folder, apart_by: &str) -> Vec<Value> {
    let value = program::json(folder.0.path(), &["check", "scene.toml", "--json"]);
    let pairs = value["checked"]["neighbours"].as_array().expect("a list");
    pairs.iter().filter(|pair| pair["apart_by"] == apart_by).cloned().collect()
}

/// Issue 33, point 1: parts that touch were isolated without a word.
#[test]
fn neighbours_without_contact_are_told_listed_and_joined() {
    let folder = Folder::new(&scene(""));
    let pairs = listed(&folder, "no_contact");
    assert!(!pairs.is_empty() && pairs[0]["remaining"].as_f64().expect("a share") < 1.0, "{pairs:?}");
    let ran = run(folder.0.path(), &["check", "scene.toml"]);
    assert!(
        ran.out.contains("warning: network.contacts: neighbours touch")
            && ran.out.contains("Neighbours without contact")
    );
    for (contacts, apart) in [("stated", pairs.len()), ("auto", 0)] {
        let folder = Folder::new(&scene(&format!("[network]\ncontacts = \"{contacts}\"\n")));
        let prepared = folder.prepared();
        let checked = check(&prepared, CheckEffort::WHOLE);
        assert!(checked.findings.iter().all(|finding| finding.check != "contacts"), "{:?}", checked.findings);
        let summary = &prepared.network.as_ref().expect("a network").shell.summary;
        assert_eq!(summary.contacts.len(), usize::from(contacts == "auto"), "{:?}", summary.contacts);
        assert_eq!(listed(&folder, "no_contact").len(), apart, "{contacts}");
    }
}

/// Parts with another response beside the network were isolated without a word.
#[test]
fn what_lies_outside_the_network_is_told() {
    let told = "materials outside the network lie at its surfaces, and nothing conducts between them: 'mast' (instant)";
    let scene = |network: &str| scene_with(&[(TRANSITION, SKIN), ("[[probe]]", &format!("{network}[[probe]]"))]);
    for (contacts, count) in [("", 1), ("contacts = \"auto\"", 1), ("contacts = \"stated\"", 0)] {
        let folder = Folder::new(&scene(&format!("[network]\n{contacts}\n")));
        let ran = run(folder.0.path(), &["check", "scene.toml"]);
        assert_eq!(ran.out.matches(told).count(), count, "{contacts}: {}", ran.out);
        assert_eq!(listed(&folder, "response").len(), count, "{contacts}");
    }
    let folder = Folder::new(&scene(""));
    let ran = run(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    let report = std::fs::read_to_string(folder.path("out/report.html")).expect("a report");
    assert!(ran.err.contains(told) && report.contains("nothing conducts between them"), "{}", ran.err);
}

/// Boxes in a row, each of a part of its own, with these gaps between them [m].
fn row(folder: &Folder, gaps: &[f64]) {
    let mut maker = Maker::cube();
    let material = maker.push("materials", json!({ "name": "skin" }));
    maker.json["meshes"][0]["primitives"][0]["material"] = json!(material);
    let mut at = 0.0;
    let mut nodes = vec![json!({ "mesh": 0, "name": "box_0" })];
    for (number, gap) in gaps.iter().enumerate() {
        at += 2.0 + gap;
        nodes.push(json!({ "mesh": 0, "name": format!("box_{}", number + 1), "translation": [at, 0, 0] }));
    }
    maker.json["scenes"] = json!([{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }]);
    maker.json["nodes"] = json!(nodes);
    maker.save(folder.0.path());
}

/// A scene of skin alone.
fn skin_alone(network: &str) -> String {
    let text = scene(network);
    let cells = text.find("[[material]]\nmatch = \"cells\"").expect("cells");
    let rest = text.find("[radiance]").expect("a section");
    let probe = text.find("[[probe]]").expect("a probe");
    let network = text[..probe].rfind("[network]").filter(|_| !network.is_empty()).unwrap_or(probe);
    format!("{}{}{}", &text[..cells], &text[rest..network], &text[network..probe])
}

/// Gaps of millimetres isolated without a word.
#[test]
fn gaps_between_parts_are_told_until_the_scene_states_their_distance() {
    for (network, findings, apart) in [
        ("", 1, 1),
        ("[network]\ncontacts = \"auto\"\n", 1, 1),
        ("[network]\ncontacts = \"auto\"\ncontact_distance = 0.001\n", 0, 1),
        ("[network]\ncontacts = \"auto\"\ncontact_distance = 0.004\n", 0, 0),
        ("[network]\ncontacts = \"stated\"\n", 0, 0),
    ] {
        let folder = Folder::new(&skin_alone(network));
        row(&folder, &[0.003, 0.006]);
        let checked = check(&folder.prepared(), CheckEffort::WHOLE);
        let told = checked.findings.iter().filter(|finding| finding.about == "network.contact_distance");
        assert_eq!(told.count(), findings, "{network}: {:?}", checked.findings);
        assert_eq!(listed(&folder, "gap").len(), apart, "{network}");
    }
    let folder = Folder::new(&skin_alone("[network]\ncontact_distance = 0.004\n"));
    let ran = run(folder.0.path(), &["check", "scene.toml"]);
    assert!(ran.code == 2 && ran.err.contains("needs contacts = \"auto\""), "{}", ran.err);
}

/// A run names three pairs, and says how many more there are and what lists them.
#[test]
fn a_run_says_where_all_pairs_are_listed() {
    let folder = Folder::new(&skin_alone(""));
    row(&folder, &[0.0; 5]);
    let ran = run(folder.0.path(), &["run", "scene.toml", "-o", "out", "--device", "cpu"]);
    assert!(ran.err.contains("and there are 2 more pairs, which isotherm check lists"), "{} {}", ran.out, ran.err);
    assert_eq!(succeed(folder.0.path(), &["check", "scene.toml"]).matches("no contact").count(), 5);
}
