//! The table of materials, and the command that lists, searches and converts a table.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use serde_json::{Value, json};

use super::craft::{Folder, SCENE};
use super::program::{end, isotherm, json as parsed, refusal, succeed};

fn entries(folder: &Path, arguments: &[&str]) -> Vec<Value> {
    let all = [&["materials", "--json"], arguments].concat();
    parsed(folder, &all).as_array().expect("a list").clone()
}

fn text<'a>(entry: &'a Value, key: &str) -> &'a str {
    entry[key].as_str().unwrap_or_default()
}

/// What is wrong with the entries of a table: each needs a source and physical values, and none stands twice.
fn faults(entries: &[Value]) -> Vec<String> {
    let mut faults = Vec::new();
    let (mut names, mut finishes) = (HashSet::new(), HashSet::new());
    for entry in entries {
        let name = text(entry, "name");
        let mut claim = |holds: bool, fault: &str| {
            if !holds {
                faults.push(format!("{name}: {fault}"));
            }
        };
        claim(names.insert(name), "the name stands twice");
        claim(finishes.insert(text(entry, "finish")), "the finish stands twice");
        let limits = [
            ("absorptivity", "optics_source", 0.0, 1.0),
            ("absorptivity_eol", "eol", 0.0, 1.0),
            ("emissivity", "optics_source", 1e-3, 1.0),
            ("emissivity_eol", "eol", 1e-3, 1.0),
            ("conductivity", "bulk_source", 0.01, 500.0),
            ("density", "bulk_source", 1.0, 23_000.0),
            ("specific_heat", "bulk_source", 100.0, 4200.0),
        ];
        // The paper's insulation stores no heat.
        let empty = name == "paper_goldized_mli";
        for (key, source, least, most) in limits {
            let Some(value) = entry[key].as_f64() else { continue };
            claim((least..=most).contains(&value) || (empty && value == 0.0), &format!("{key} = {value}"));
            claim(text(entry, source).len() >= 4, &format!("{key} without {source}"));
        }
        claim(!entry["optics_source"].is_null() || !entry["bulk_source"].is_null(), "no source");
        claim(!text(entry, "bulk_source").contains("not recorded"), "a source that nobody can find");
        if let Some(range) = entry["temperature_range"].as_array() {
            claim(range[0].as_f64() < range[1].as_f64(), "the range does not rise");
        }
    }
    faults
}

#[test]
fn every_entry_has_a_source_and_physical_values() {
    let folder = Folder::new(SCENE);
    let table = entries(folder.0.path(), &[]);
    assert_eq!(faults(&table), [""; 0]);
    let finishes = entries(folder.0.path(), &["--finishes"]).len();
    let bulk = table.iter().filter(|entry| entry["optics_source"].is_null()).count();
    assert!(finishes >= 120 && bulk >= 25, "{finishes} finishes, {bulk} bulk materials");
    let aged = table.iter().filter(|entry| !entry["eol"].is_null()).count();
    assert!(aged >= 10, "{aged} entries with values of the end of life");
    for (key, wrong) in [
        ("absorptivity", json!(1.2)),
        ("emissivity", json!(0.0)),
        ("finish", table[1]["finish"].clone()),
        ("optics_source", json!("")),
        ("temperature_range", json!([400.0, 300.0])),
    ] {
        let mut spoiled = table.clone();
        let first = spoiled.iter_mut().find(|entry| !entry["emissivity"].is_null()).expect("a finish");
        first[key] = wrong;
        assert!(!faults(&spoiled).is_empty(), "{key}");
    }
}

/// Every source begins with a word of the legend at the top of the table.
#[test]
fn the_table_explains_its_sources() {
    let folder = Folder::new(SCENE);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/materials.toml");
    let table = std::fs::read_to_string(path).expect("the table");
    let legend: String = table.lines().take_while(|line| line.starts_with('#')).collect();
    let unknown = |source: &str| {
        let source = source.rsplit(": ").next().unwrap_or(source);
        let word = source.split([' ', ',', ';']).next().unwrap_or_default();
        !legend.contains(word)
    };
    for entry in entries(folder.0.path(), &[]) {
        for key in ["optics_source", "back_source", "bulk_source"] {
            assert!(!unknown(text(&entry, key)) || text(&entry, key).contains("composed"), "{entry}");
        }
    }
    assert!(unknown("Somebody, 2020"));
}

#[test]
fn words_and_kinds_narrow_the_list() {
    let folder = Folder::new(SCENE);
    let place = folder.0.path();
    let names = |arguments: &[&str]| -> Vec<String> {
        entries(place, arguments).iter().map(|entry| text(entry, "name").to_owned()).collect()
    };
    assert_eq!(names(&["z306", "BLACK"]), ["chemglaze_black_paint_z306"]);
    assert_eq!(names(&["Invar"]), ["bulk_invar_36"]);
    assert!(names(&["polito"]).contains(&"pcb_green".to_owned()), "a source is searched");
    let [all, finishes, bulk] = [&[][..], &["--finishes"], &["--bulk"]].map(|kind| names(kind).len());
    let both = entries(place, &["--bulk"]).iter().filter(|entry| !entry["optics_source"].is_null()).count();
    assert_eq!(all, finishes + bulk - both);
    let list = succeed(place, &["materials", "paint"]);
    assert!(list.contains("white_silicone_paint") && list.contains("0.29") && list.contains("finishes"), "{list}");
}

/// Each entry is told with the keys and values that the file states, read by a parser of its own.
#[test]
fn nothing_of_the_table_is_left_out() {
    let folder = Folder::new(SCENE);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/materials.toml");
    let stated: toml::Table = std::fs::read_to_string(path).expect("the table").parse().expect("TOML");
    let told = entries(folder.0.path(), &[]);
    assert_eq!(told.len(), stated.len());
    // 200 and 200.0 are one number.
    fn plain(value: &Value) -> Value {
        match value {
            Value::Number(number) => json!(number.as_f64()),
            Value::Array(all) => all.iter().map(plain).collect(),
            Value::Object(group) => group.iter().map(|(key, value)| (key.clone(), plain(value))).collect(),
            other => other.clone(),
        }
    }
    for mut entry in told {
        let name = entry.as_object_mut().and_then(|keys| keys.remove("name")).expect("a name");
        let stated = serde_json::to_value(&stated[name.as_str().expect("a text")]).expect("JSON");
        assert_eq!(plain(&entry), plain(&stated), "{name}");
    }
}

#[test]
fn csv_json_and_the_entry_itself_say_the_same() {
    let folder = Folder::new(SCENE);
    let place = folder.0.path();
    let table = entries(place, &[]);
    assert_eq!(succeed(place, &["materials", "--csv", "-o", "all.csv"]), "");
    let mut reader = csv::Reader::from_path(place.join("all.csv")).expect("a file");
    let head = reader.headers().expect("a header").clone();
    let rows: HashMap<String, Vec<String>> = reader
        .records()
        .map(|row| row.expect("a row").iter().map(str::to_owned).collect::<Vec<_>>())
        .map(|row| (row[0].clone(), row))
        .collect();
    assert_eq!(rows.len(), table.len());
    for entry in &table {
        let row = &rows[text(entry, "name")];
        for (column, cell) in head.iter().zip(row) {
            let stated = match entry.pointer(&format!("/{}", column.replace('.', "/"))) {
                Some(Value::String(text)) => text.clone(),
                Some(value) => value.to_string(),
                None => String::new(),
            };
            assert_eq!(*cell, stated, "{column} of {entry}");
        }
    }
    // An entry that is printed whole is an entry of a table.
    for words in [&["sheldahl", "fep"][..], &["array", "silicon"], &["hughson", "a_276"]] {
        let whole = succeed(place, &[&["materials"], words].concat());
        std::fs::write(place.join("mine.toml"), &whole).expect("written");
        assert_eq!(entries(place, &["--table", "mine.toml"]), entries(place, words), "{whole}");
    }
}

#[test]
fn a_table_of_the_user_is_read_and_checked() {
    let folder = Folder::new(SCENE);
    let place = folder.0.path();
    let mine = "['odd name']\nfinish = \"paint\\u001b[31m\"\nabsorptivity = 0.3\noptics_source = 'measured here'\n";
    std::fs::write(place.join("mine.toml"), mine).expect("written");
    let whole = succeed(place, &["materials", "--table", "mine.toml"]);
    assert!(whole.contains("[\"odd name\"]") && !whole.contains('\u{1b}'), "{whole}");
    let refused = |arguments: &[&str]| {
        let (code, message) = refusal(&end(isotherm(place, &[&["materials"], arguments].concat())));
        assert_eq!(code, Some(2), "{arguments:?}: {message}");
        message
    };
    assert!(
        refused(&["--table", "mine.toml", "gold"]).contains("none of the 1 entries of mine.toml has the words 'gold'")
    );
    assert!(refused(&["--table", "absent.toml"]).contains("cannot be read"));
    assert!(refused(&["--table", "mine.toml", "-o", "mine.toml"]).contains("mine.toml"));
    std::fs::write(place.join("mine.toml"), mine.replace("0.3", "3")).expect("written");
    assert!(refused(&["--table", "mine.toml"]).contains("mine.toml:3: odd name.absorptivity"));
    let clash = end(isotherm(place, &["materials", "--json", "--csv"]));
    assert_eq!(clash.status.code(), Some(2));
}
