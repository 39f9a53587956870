//! `docs/effect.md`: the patch that adds a lamp still fits, touches what the page says, and names known buffers.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use isotherm::internals;

const PATCH: &str = include_str!("../../docs/effect.patch");
const PAGE: &str = include_str!("../../docs/effect.md");

/// Each file of the patch, whether it is new, and the number of lines that it adds.
fn files() -> Vec<(&'static str, bool, usize)> {
    let mut files: Vec<(&str, bool, usize)> = Vec::new();
    for line in PATCH.lines() {
        if let Some(names) = line.strip_prefix("diff --git a/") {
            files.push((names.split(" b/").next().expect("a name"), false, 0));
        } else if let Some(file) = files.last_mut() {
            file.1 |= line.starts_with("new file");
            file.2 += usize::from(line.starts_with('+') && !line.starts_with("+++"));
        }
    }
    files
}

/// The patched files in a folder.
fn patched() -> tempfile::TempDir {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (file, is_new, _) in files() {
        let copy = folder.path().join(file);
        fs::create_dir_all(copy.parent().expect("a folder")).expect("folders");
        if !is_new {
            fs::copy(root.join(file), copy).expect("a file of the patch");
        }
    }
    let patch = root.join("docs/effect.patch");
    let applied = Command::new("git").args(["apply", "-C1"]).arg(patch).current_dir(folder.path()).output();
    let applied = applied.expect("git runs");
    assert!(applied.status.success(), "docs/effect.patch: {}", String::from_utf8_lossy(&applied.stderr));
    folder
}

#[test]
fn the_patch_fits_and_touches_what_the_page_says() {
    let folder = patched();
    for (file, is_new, lines) in files() {
        let (folder_of, name) = file.rsplit_once('/').expect("a folder");
        let named =
            PAGE.contains(file) || PAGE.contains(&format!("`{folder_of}/`")) && (!is_new || PAGE.contains(name));
        assert!(named, "the page does not name {file}");
        assert!(folder.path().join(file).exists(), "{file}");
        assert!(is_new || lines <= 13, "{file}: {lines} lines outside the effect's own files");
    }
    assert_eq!(files().iter().filter(|(_, is_new, _)| *is_new).count(), 5);
}

#[test]
fn the_shader_of_the_patch_compiles_and_names_known_buffers() {
    let text = fs::read_to_string(patched().path().join("glsl/lamp.comp")).expect("a shader");
    let options = naga::front::glsl::Options::from(naga::ShaderStage::Compute);
    let module = naga::front::glsl::Frontend::default().parse(&options, &text).expect("GLSL that naga reads");
    let known: BTreeSet<String> =
        internals::all_resources().map(|resource| format!("{}Block", resource.name)).collect();
    for (_, variable) in module.global_variables.iter().filter(|(_, variable)| variable.binding.is_some()) {
        let block = module.types[variable.ty].name.clone().unwrap_or_default();
        assert!(known.contains(&block), "no buffer has the name of {block}");
    }
}

/// Builds the library with the lamp.
#[test]
#[ignore = "checks the whole crate once more, which takes a minute or several"]
fn the_patched_tree_builds() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let patched = patched();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut copy = Command::new("cp");
    copy.args(["-r", "Cargo.toml", "Cargo.lock", "src", "glsl", "spirv", "models", "tests", "tools", "python"]);
    let mut copied = copy.arg(folder.path()).current_dir(root).spawn().expect("cp runs");
    assert!(copied.wait().expect("cp ends").success());
    let over = Command::new("cp").args(["-r", "."]).arg(folder.path()).current_dir(patched.path()).status();
    assert!(over.expect("cp runs").success());
    let mut check = Command::new(env!("CARGO"));
    // The dependencies that the lints of tools/test or other checks left, and no records of a folder that is gone.
    let lints = root.join("target/lints");
    let known = if lints.exists() { lints } else { root.join("target") };
    check.args(["check", "--workspace", "--lib", "--offline"]).current_dir(folder.path());
    check.env("CARGO_INCREMENTAL", "0");
    let built = check.env("CARGO_TARGET_DIR", known).output().expect("cargo runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}
