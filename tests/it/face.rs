//! The public face of the library stays small.

use std::path::Path;

/// Names that `lib.rs` exports, besides `internals`.
fn exported(text: &str) -> Vec<String> {
    let uses = text.split("pub use ").skip(1).filter_map(|rest| rest.split_once(';')).map(|(tree, _)| tree);
    let mut names = Vec::new();
    for tree in uses {
        let list = tree.split_once('{').map_or_else(
            || tree.rsplit("::").next().unwrap_or(tree).to_owned(),
            |(_, list)| list.trim_end_matches('}').to_owned(),
        );
        names.extend(list.split(',').map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()));
    }
    names
}

#[test]
fn the_library_exports_at_most_forty_names() {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).expect("lib.rs");
    let names = exported(&text);
    assert!(names.iter().any(|name| name == "Simulation") && names.len() > 12, "{names:?}");
    assert!(names.len() <= 40, "{} names: {names:?}", names.len());
    let modules: Vec<&str> = text.lines().filter(|line| line.starts_with("pub mod")).collect();
    assert_eq!(modules, ["pub mod internals;", "pub mod package;"]);
    // The count sees names in braces and alone.
    assert_eq!(exported("pub use a::B;\npub use c::{D, E};"), ["B", "D", "E"]);
}
