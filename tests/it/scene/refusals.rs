//! Invalid scenes and their error messages.

use std::path::Path;

use isotherm::Scene;

use super::super::cases::Case;
use super::{FULL, Folder, SHORT, TABLE};

const CASES: &str = include_str!("refusals.txt");

/// All messages about a scene, each without the folder's own path.
fn messages(folder: &Folder, scene: &str) -> Vec<String> {
    let error = folder.parse(scene).expect_err("this scene must be refused");
    let own = format!("{}/", folder.0.path().display());
    error.each().iter().map(|one| one.to_string().replace(&own, "")).collect()
}

#[test]
fn what_is_wrong_is_refused_with_line_key_and_reason() {
    let folder = Folder::new();
    assert!(folder.parse(SHORT).is_ok(), "the scene that the cases spoil is itself right");
    let cases = Case::all(CASES);
    let mut wrong = String::new();
    for case in &cases {
        let spoilt = case.spoil(SHORT).unwrap_or_else(|| panic!("no case of the short scene:\n{}", case.text));
        let found = messages(&folder, &spoilt);
        let right = found.iter().zip(&case.expected).all(|(message, expected)| message.starts_with(expected));
        if !right || found.len() != case.expected.len() {
            wrong.push_str(&format!("{}\nfound\n> {}\n\n", case.text, found.join("\n> ")));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(cases.len() >= 180, "only {} cases were read", cases.len());
}

/// Two faults in one scene: both are told, or one that the other may have caused is left out. Nothing else is told.
#[test]
fn two_faults_are_told_together_and_cause_no_third() {
    let folder = Folder::new();
    let cases = Case::all(CASES);
    let unlined = |message: &str| -> String {
        message.splitn(3, ':').enumerate().filter(|(place, _)| *place != 1).map(|(_, part)| part).collect()
    };
    let alone: Vec<Vec<String>> =
        cases.iter().map(|case| messages(&folder, &case.spoil(SHORT).unwrap_or_default())).collect();
    let (mut pairs, mut both, mut others) = (0, 0, 0);
    for (first, one) in cases.iter().enumerate() {
        // Every 29th partner keeps the test short.
        for (second, other) in cases.iter().enumerate().skip(first + 1).step_by(29) {
            let Some(spoilt) = one.spoil(SHORT).and_then(|spoilt| other.spoil(&spoilt)) else { continue };
            let syntax =
                |number: usize| alone[number].iter().any(|message: &String| message.contains("not valid TOML"));
            // One fault may mend the other.
            if folder.parse(&spoilt).is_ok() {
                continue;
            }
            let found = messages(&folder, &spoilt);
            // What makes the file no TOML, such as a key that is stated twice, hides all else.
            if syntax(first) || syntax(second) || found.iter().any(|message| message.contains("not valid TOML")) {
                continue;
            }
            let known: Vec<String> =
                alone[first].iter().chain(&alone[second]).map(|message| unlined(message)).collect();
            let strange: Vec<&String> = found.iter().filter(|message| !known.contains(&unlined(message))).collect();
            if !strange.is_empty() {
                others += 1;
                println!("{}\n{}\n! {strange:#?}\n", one.text, other.text);
            }
            pairs += 1;
            both += usize::from(found.len() >= 2);
        }
    }
    println!("{both} of {pairs}, {others} with another message");
    // The edits of a pair may themselves clash, as two modes of an attitude do.
    assert!(others * 50 < pairs, "{others} of {pairs} pairs have another message");
    assert!(both * 10 > pairs * 8, "{both} of {pairs} pairs are told together");
}

/// A value of the wrong type for a key with this value.
fn wrong(value: &str) -> &'static str {
    match value.chars().next() {
        Some('"') => "17.5",
        Some('[') => "true",
        Some('{' | 't' | 'f') => "3",
        _ => "\"x\"",
    }
}

/// The full scene with values of the wrong type in the chosen lines, counted from 1.
fn spoil_lines(chosen: impl Fn(usize) -> bool) -> String {
    let line = |(place, line): (usize, &str)| match line.split_once(" = ") {
        Some((key, value)) if chosen(place + 1) => format!("{key} = {}\n", wrong(value)),
        _ => format!("{line}\n"),
    };
    FULL.lines().enumerate().map(line).collect()
}

#[test]
fn a_wrong_type_of_any_key_is_one_error_at_its_line() {
    let folder = Folder::new();
    for (place, line) in FULL.lines().enumerate().filter(|(_, line)| line.contains(" = ")) {
        let found = messages(&folder, &spoil_lines(|number| number == place + 1));
        let expected = format!("scene.toml:{}: ", place + 1);
        assert!(found.len() == 1 && found[0].starts_with(&expected), "{line}\n{}", found.join("\n"));
    }
}

#[test]
fn wrong_types_of_all_keys_are_told_in_one_go() {
    let folder = Folder::new();
    let keys: Vec<usize> =
        FULL.lines().enumerate().filter(|(_, line)| line.contains(" = ")).map(|(place, _)| place + 1).collect();
    let found = messages(&folder, &spoil_lines(|_| true));
    let line = |message: &String| message.split(':').nth(1).and_then(|line| line.parse::<usize>().ok()).unwrap_or(0);
    let lines: Vec<usize> = found.iter().map(line).collect();
    assert!(lines.is_sorted_by(|a, b| a < b), "one error for a line, in order: {}", found.join("\n"));
    let silent: Vec<&str> =
        keys.iter().filter(|key| !lines.contains(key)).filter_map(|key| FULL.lines().nth(key - 1)).collect();
    assert!(lines.iter().all(|line| keys.contains(line)), "{}", found.join("\n"));
    // What another wrong value decides about is not read: which keys of an attitude, of a lens or of a rule count.
    assert!(silent.len() <= 8, "no error about {silent:?}");
}

#[test]
fn a_table_is_refused_with_its_own_path_and_line() {
    let folder = Folder::new();
    for (from, to, expected) in [
        ("optics_source = 'Fortescue 11.3'\n", "", "table.toml:1: paint.optics_source: is missing"),
        ("finish = 'white paint'\n", "", "table.toml:1: paint.finish: is missing"),
        ("emissivity = 0.83", "emissivity = 8.3", "table.toml:4: paint.emissivity: must be in [0, 1], found 8.3"),
        ("bulk_source = 'AcubeSAT'\n", "", "table.toml:7: metal.bulk_source: is missing"),
        ("density = 2770", "densty = 2770", "table.toml:10: metal.densty: unknown key; did you mean 'density'?"),
        ("back_source = 'composed'\n", "", "table.toml:14: array.back_source: is missing"),
        ("[metal]", "[paint]", "table.toml:7: not valid TOML: "),
        ("emissivity = 0.83", "emissivity = 0.83\nemissivity_eol = 0.8", "table.toml:1: paint.eol: is missing"),
        ("emissivity = 0.83", "emissivity = 0.83\neol = 'a year'", "table.toml:5: paint.eol: describes values"),
        (
            "density = 2770",
            "density = 2770\nemissivity_eol = 0.8",
            "table.toml:11: metal.emissivity_eol: needs the value",
        ),
        ("density = 2770", "temperature_range = [400, 300]", "table.toml:10: metal.temperature_range: must rise"),
        ("density = 2770", "temperature_range = [-40, 300]", "table.toml:10: metal.temperature_range: must be"),
    ] {
        assert!(TABLE.contains(from), "{from}");
        std::fs::write(folder.path("table.toml"), TABLE.replacen(from, to, 1)).unwrap();
        let message = folder.refusal(SHORT);
        assert!(message.starts_with(expected), "expected {expected}\n found {message}");
    }
}

#[test]
fn a_scene_file_that_cannot_be_read_is_named() {
    let folder = Folder::new();
    let message = |path: &Path| Scene::load(path).unwrap_err().to_string();
    let absent = folder.path("absent.toml");
    assert!(message(&absent).starts_with(&format!("{}: cannot be read: No such file", absent.display())));
    assert!(message(folder.0.path()).contains("cannot be read: it is a directory"));
    let binary = folder.path("binary.toml");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    assert!(message(&binary).contains("UTF-8"));
    std::fs::write(folder.path("scene.toml"), SHORT).unwrap();
    assert_eq!(Scene::load(&folder.path("scene.toml")).unwrap().name, "scene");
}
