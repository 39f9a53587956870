//! Invalid scenes and their error messages.

use std::path::Path;

use isotherm::scene::Scene;

use super::{Folder, SHORT, TABLE};

#[test]
fn what_is_wrong_is_refused_with_line_key_and_reason() {
    let folder = Folder::new();
    assert!(folder.parse(SHORT).is_ok(), "the scene that the cases spoil is itself right");
    let cases = include_str!("refusals.txt");
    let mut count = 0;
    for case in cases.split("\n\n").filter(|case| !case.starts_with('#')) {
        let lines = |mark: &str| -> String {
            let marked = case.lines().filter_map(|line| line.strip_prefix(mark));
            marked.map(|line| format!("{line}\n")).collect()
        };
        let (out, put, expected) = (lines("- "), lines("+ "), lines("> "));
        assert!(SHORT.contains(&out) && !expected.is_empty(), "no case of the short scene:\n{case}");
        let spoilt = if out.is_empty() { format!("{SHORT}{put}") } else { SHORT.replacen(&out, &put, 1) };
        let message = folder.refusal(&spoilt);
        assert!(message.starts_with(expected.trim_end()), "{case}\nfound\n> {message}");
        count += 1;
    }
    assert!(count >= 108, "only {count} cases were read");
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
