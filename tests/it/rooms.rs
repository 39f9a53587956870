//! Rooms only use rooms below them, and files do not use each other in circles. The test reads the paths in the code.
//! It sees the `use` of a type, not method calls on its values.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The rooms of `src`. Each uses only rooms before it.
const ORDER: [&str; 28] = [
    "text",
    "misspelt",
    "host",
    "stop",
    "trace",
    "files",
    "environment",
    "thermal",
    "exchange",
    "model",
    "lens",
    "scene",
    "raster",
    "gpu",
    "simulation",
    "guard",
    "output",
    "labels",
    "compare",
    "converge",
    "sensitivity",
    "dataset",
    "server",
    "view",
    "fit",
    "paper",
    "bench",
    "cli",
];

/// Uses that the order allows but that must not occur.
const APART: [(&str, &str); 1] = [("gpu", "scene")];

/// A module as a path from the crate root.
type Module = Vec<String>;

/// Files, and the files that they use.
type Arrows<'a> = BTreeMap<&'a str, BTreeSet<&'a str>>;

/// The references of a crate, file by file.
struct Crate {
    /// File of every module that has one.
    files: BTreeMap<Module, String>,
    /// Other names in each module: name -> paths.
    names: BTreeMap<Module, BTreeMap<String, Module>>,
    /// Paths in each module, from the root.
    paths: BTreeMap<Module, BTreeSet<Module>>,
}

/// Words and signs of a source text, without comments, strings and characters.
fn tokens(text: &str) -> Vec<String> {
    let characters: Vec<char> = text.chars().collect();
    let at = |i: usize| characters.get(i).copied().unwrap_or('\0');
    let mut tokens = Vec::new();
    let mut i = 0;
    while i < characters.len() {
        let c = at(i);
        if c == '/' && at(i + 1) == '/' {
            while i < characters.len() && at(i) != '\n' {
                i += 1;
            }
        } else if c == '/' && at(i + 1) == '*' {
            while i < characters.len() && !(at(i) == '*' && at(i + 1) == '/') {
                i += 1;
            }
            i += 2;
        } else if c == 'r' && (at(i + 1) == '"' || (at(i + 1) == '#' && (at(i + 2) == '"' || at(i + 2) == '#'))) {
            let hashes = (i + 1..).take_while(|j| at(*j) == '#').count();
            i += 2 + hashes;
            while i < characters.len() && !(at(i) == '"' && (0..hashes).all(|j| at(i + 1 + j) == '#')) {
                i += 1;
            }
            i += 1 + hashes;
        } else if c == '"' {
            i += 1;
            while i < characters.len() && at(i) != '"' {
                i += if at(i) == '\\' { 2 } else { 1 };
            }
            i += 1;
        } else if c == '\'' && at(i + 1) == '\\' {
            i += 3;
            while i < characters.len() && at(i) != '\'' {
                i += 1;
            }
            i += 1;
        } else if c == '\'' && at(i + 2) == '\'' {
            i += 3;
        } else if c.is_alphanumeric() || c == '_' {
            let start = i;
            while at(i).is_alphanumeric() || at(i) == '_' {
                i += 1;
            }
            tokens.push(characters[start..i].iter().collect());
        } else if c == ':' && at(i + 1) == ':' {
            tokens.push("::".to_owned());
            i += 2;
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            i += 1;
        }
    }
    tokens
}

/// Paths of a use tree with the name of each, and the end of the tree.
fn use_tree(tokens: &[String], mut i: usize, prefix: &[String], found: &mut Vec<(String, Vec<String>)>) -> usize {
    let mut path = prefix.to_vec();
    loop {
        match tokens[i].as_str() {
            "{" => {
                i += 1;
                while tokens[i] != "}" {
                    i = use_tree(tokens, i, &path, found);
                    if tokens[i] == "," {
                        i += 1;
                    }
                }
                return i + 1;
            }
            "self" if !path.is_empty() => i += 1,
            word => {
                path.push(word.to_owned());
                i += 1;
            }
        }
        if tokens[i] == "::" {
            i += 1;
            continue;
        }
        let mut name = path.last().cloned().unwrap_or_default();
        if tokens[i] == "as" {
            name.clone_from(&tokens[i + 1]);
            i += 2;
        }
        found.push((name, path));
        return i;
    }
}

impl Crate {
    /// Reads sources by their path below `src`.
    fn read(sources: &BTreeMap<String, String>) -> Self {
        let mut files = BTreeMap::new();
        for path in sources.keys() {
            let stem = path.trim_end_matches(".rs").trim_end_matches("/mod");
            let module = if stem == "lib" { Vec::new() } else { stem.split('/').map(str::to_owned).collect() };
            files.insert(module, path.clone());
        }
        let mut read = Self { files, names: BTreeMap::new(), paths: BTreeMap::new() };
        for (module, path) in read.files.clone() {
            read.scan(&module, &tokens(&sources[&path]));
        }
        read
    }

    fn scan(&mut self, file: &Module, tokens: &[String]) {
        let mut module = file.clone();
        let mut depth = 0;
        let mut inline: Vec<usize> = Vec::new();
        let mut i = 0;
        while i < tokens.len() {
            match tokens[i].as_str() {
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    if inline.last() == Some(&depth) {
                        inline.pop();
                        module.pop();
                    }
                }
                "mod" if tokens.get(i + 2).is_some_and(|next| next == "{") => {
                    module.push(tokens[i + 1].clone());
                    inline.push(depth);
                    depth += 1;
                    i += 3;
                    continue;
                }
                "use" => {
                    let mut found = Vec::new();
                    let is_public = i > 0 && (tokens[i - 1] == "pub" || tokens[i - 1] == ")");
                    i = use_tree(tokens, i + 1, &[], &mut found);
                    for (name, path) in found {
                        let path = self.absolute(&module, &path);
                        // Re-exporting a type is no use of it, unless the file also names it elsewhere.
                        let named = || tokens.iter().filter(|word| **word == name).count() > 1;
                        if !is_public || (name.starts_with(char::is_uppercase) && named()) {
                            self.paths.entry(module.clone()).or_default().insert(path.clone());
                        }
                        self.names.entry(module.clone()).or_default().insert(name, path);
                    }
                    continue;
                }
                word if word.starts_with(|c: char| c.is_alphabetic() || c == '_')
                    && tokens.get(i + 1).is_some_and(|next| next == "::")
                    && (i == 0 || tokens[i - 1] != "::") =>
                {
                    let mut path = vec![word.to_owned()];
                    while tokens.get(i + 1).is_some_and(|next| next == "::")
                        && tokens.get(i + 2).is_some_and(|next| next.starts_with(|c: char| c.is_alphabetic()))
                    {
                        path.push(tokens[i + 2].clone());
                        i += 2;
                    }
                    let path = self.absolute(&module, &path);
                    self.paths.entry(module.clone()).or_default().insert(path);
                }
                _ => {}
            }
            i += 1;
        }
    }

    /// A path in a module as a path from the root. A path outside the crate stays as it is.
    fn absolute(&self, module: &Module, path: &[String]) -> Module {
        let mut base = module.clone();
        let mut rest = path;
        match path[0].as_str() {
            "crate" => {
                base.clear();
                rest = &path[1..];
            }
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|word| word == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            _ => {}
        }
        base.extend_from_slice(rest);
        base
    }

    /// The file that defines the target of a path. `None` for a module, or outside the crate.
    fn home(&self, path: &[String], hops: usize) -> Option<&str> {
        if self.files.contains_key(path) || hops == 0 {
            return None;
        }
        let length = (0..path.len())
            .rev()
            .find(|length| self.files.contains_key(&path[..*length]) || self.names.contains_key(&path[..*length]))?;
        let (module, rest) = path.split_at(length);
        if let Some(other) = self.names.get(module).and_then(|names| names.get(&rest[0])) {
            if other == path {
                return None;
            }
            return self.home(&[other, &rest[1..]].concat(), hops - 1);
        }
        if module.is_empty() {
            return None;
        }
        self.file(module)
    }

    /// The file that a module stands in.
    fn file(&self, module: &[String]) -> Option<&str> {
        (0..=module.len()).rev().find_map(|length| self.files.get(&module[..length])).map(String::as_str)
    }

    /// Files and what they use.
    fn arrows(&self) -> Arrows<'_> {
        let mut arrows = Arrows::new();
        for (module, paths) in &self.paths {
            let Some(from) = self.file(module) else { continue };
            let homes = paths.iter().filter_map(|path| self.home(path, 8)).filter(|to| *to != from);
            arrows.entry(from).or_default().extend(homes);
        }
        arrows
    }
}

/// Groups of files that use each other in circles.
fn circles<'a>(arrows: &Arrows<'a>) -> BTreeSet<Vec<&'a str>> {
    let reached = |from: &'a str| {
        let mut seen = BTreeSet::new();
        let mut open = vec![from];
        while let Some(file) = open.pop() {
            open.extend(arrows.get(file).into_iter().flatten().filter(|next| seen.insert(**next)));
        }
        seen
    };
    let reach: BTreeMap<&str, BTreeSet<&str>> = arrows.keys().map(|file| (*file, reached(file))).collect();
    let circle = |file: &&'a str| -> Vec<&'a str> {
        let back = |other: &&&str| reach.get(**other).is_some_and(|there| there.contains(file));
        reach[file].iter().filter(back).copied().collect()
    };
    arrows.keys().map(circle).filter(|circle| !circle.is_empty()).collect()
}

/// Uses of a room by a lower room, as `file -> file`.
fn upward(arrows: &Arrows) -> Vec<String> {
    let room = |file: &str| file.split('/').next().unwrap_or(file).trim_end_matches(".rs").to_owned();
    let rank = |room: &str| ORDER.iter().position(|known| *known == room).expect("every room has its place in ORDER");
    let runs_up = |from: &str, to: &str| {
        let (from, to) = (room(from), room(to));
        rank(&from) < rank(&to) || APART.contains(&(&from, &to))
    };
    let all = arrows.iter().flat_map(|(from, others)| others.iter().map(move |to| (*from, *to)));
    all.filter(|(from, to)| runs_up(from, to)).map(|(from, to)| format!("{from} -> {to}")).collect()
}

/// The sources below `src`, except those that name all rooms.
fn sources() -> BTreeMap<String, String> {
    fn visit(folder: &Path, root: &Path, found: &mut BTreeMap<String, String>) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                visit(&path, root, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(root).expect("below src").to_str().expect("UTF-8").to_owned();
                found.insert(name, std::fs::read_to_string(&path).expect("a source"));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = BTreeMap::new();
    visit(&root, &root, &mut found);
    found.retain(|file, _| !["internals.rs", "lib.rs", "main.rs", "package.rs"].contains(&file.as_str()));
    found
}

#[test]
fn no_arrow_runs_up_and_no_files_use_each_other_in_a_circle() {
    let all = Crate::read(&sources());
    let arrows = all.arrows();
    assert!(arrows.values().map(BTreeSet::len).sum::<usize>() > 1000, "hardly any arrow was found");
    assert_eq!(upward(&arrows), Vec::<String>::new(), "arrows that run up");
    let circles = circles(&arrows);
    assert!(circles.is_empty(), "files in circles: {circles:#?}");
}

#[test]
fn the_architecture_states_the_order() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).expect("a page");
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let order = ORDER.map(|room| format!("`{room}`")).join(", ");
    assert!(words.contains(&order), "ARCHITECTURE.md does not say {order}");
}

#[test]
fn an_arrow_that_runs_up_and_a_circle_are_found() {
    let with = |file: &str, text: &str| {
        let mut sources = sources();
        sources.get_mut(file).expect("a file").push_str(text);
        let all = Crate::read(&sources);
        let arrows = all.arrows();
        (upward(&arrows), circles(&arrows).into_iter().map(|circle| circle.join(" ")).collect::<Vec<_>>())
    };
    // Through a re-export of `scene/mod.rs`, in a function.
    let (up, _) = with("environment/utc.rs", "fn f(band: crate::scene::SceneError) {}");
    assert_eq!(up, ["environment/utc.rs -> scene/error.rs"]);
    let (up, _) = with("gpu/limits.rs", "use crate::scene::{Scene, targets};");
    assert_eq!(up, ["gpu/limits.rs -> scene/mod.rs"]);
    // Through a renamed module, and in a test module.
    let (_, circles) = with("thermal/planck.rs", "use super::radiance as other; type A = other::RadianceTable;");
    let circle = "thermal/passband.rs thermal/planck.rs thermal/radiance.rs".to_owned();
    assert!(circles.contains(&circle), "{circles:?}");
    let (_, circles) = with("thermal/planck.rs", "mod more { use super::super::radiance::RadianceTable; }");
    assert!(circles.contains(&circle), "{circles:?}");
    // Not in comments, strings and names of other crates.
    let quiet = r##"/* crate::cli::f */ const A: &str = "crate::cli::f \" crate::cli::f"; use rayon::cli::f; // crate::cli::f
        const B: &str = r#"" crate::cli::f"#; const C: char = '"'; const D: char = '\''; fn g<'a>(_: &'a str) {}"##;
    assert_eq!(with("thermal/planck.rs", quiet).0, Vec::<String>::new());
    let heard = format!("{quiet} use crate::cli::run;fn h() {{ run::f() }}");
    assert_eq!(with("thermal/planck.rs", &heard).0, ["thermal/planck.rs -> cli/run.rs"]);
}
