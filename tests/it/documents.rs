//! The documents: links and names of files are valid, the README stays short, and `tools/benchmarks` replaces its tables.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::program::stderr;

fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every Markdown file of the repository.
fn pages() -> Vec<PathBuf> {
    let folders = ["", "docs", "models", "python"].map(|folder| repository().join(folder));
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(folder).expect("a folder"));
    let paths = files.map(|file| file.expect("a file").path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// Links of a page to missing files.
fn broken(page: &Path, text: &str) -> Vec<String> {
    let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let files = links.filter(|link| !link.contains("://")).map(|link| link.split('#').next().unwrap_or_default());
    let folder = page.parent().expect("a folder");
    files.filter(|file| !file.is_empty() && !folder.join(file).exists()).map(str::to_owned).collect()
}

#[test]
fn every_link_leads_to_a_file() {
    let pages = pages();
    assert!(pages.len() >= 9, "{pages:?}");
    for page in &pages {
        let text = std::fs::read_to_string(page).expect("text");
        assert_eq!(broken(page, &text), [""; 0], "{}", page.display());
        assert_eq!(broken(page, &format!("{text} [a](nowhere.md)")), ["nowhere.md"]);
    }
}

/// Files of the repository that a text names and that do not exist.
fn absent(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || "/._-".contains(c)));
    let words = words.map(|word| word.trim_end_matches('.'));
    let named = words.filter(|word| {
        let folders = ["docs", "glsl", "models", "python", "spirv", "src", "tests", "tools"];
        word.split_once('/').is_some_and(|(folder, rest)| folders.contains(&folder) && rest.contains('.'))
    });
    named.filter(|name| !repository().join(name).exists()).collect()
}

/// Pages and shaders name the files that explain them. The changelog also names files of the past.
#[test]
fn every_file_that_a_page_or_a_shader_names_exists() {
    let shaders = std::fs::read_dir(repository().join("glsl")).expect("a folder");
    let shaders = shaders.map(|file| file.expect("a file").path());
    let pages = pages().into_iter().filter(|page| !page.ends_with("CHANGELOG.md"));
    for file in pages.chain(shaders) {
        let text = std::fs::read_to_string(&file).expect("text");
        assert_eq!(absent(&text), [""; 0], "{}", file.display());
        assert_eq!(absent(&format!("{text} (see src/nowhere.rs).")), ["src/nowhere.rs"]);
    }
}

#[test]
fn the_readme_is_short() {
    let readme = std::fs::read_to_string(repository().join("README.md")).expect("the README");
    let words = readme.split_whitespace().count();
    assert!(words < 900, "{words} words; tables and references belong to docs/");
}

/// Runs `tools/benchmarks` on a page.
fn benchmarks(page: &Path, arguments: &[&str]) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_isotherm")).parent().expect("a folder");
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let mut script = Command::new(repository().join("tools/benchmarks"));
    script.arg("--page").arg(page).args(arguments).env("PATH", path);
    script.output().expect("the script starts")
}

const PAGE: &str = "\
before
<!-- begin good: echo '| new |' -->
old
<!-- end -->
between
<!-- begin bad: echo '| half |'; false -->
kept
<!-- end -->
after
";

#[test]
fn a_section_holds_what_its_command_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("page.md");
    std::fs::write(&page, PAGE).expect("a page");
    let all = benchmarks(&page, &[]);
    assert_eq!(all.status.code(), Some(2), "{}", stderr(&all));
    assert!(stderr(&all).contains("as they were: bad"), "{}", stderr(&all));
    let text = std::fs::read_to_string(&page).expect("the page");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[..5], ["before", "<!-- begin good: echo '| new |' -->", "```sh", "echo '| new |'", "```"]);
    assert!(lines[6].contains("load ") && lines[6].contains("revision "), "{}", lines[6]);
    assert_eq!(
        lines[8..],
        [
            "| new |",
            "<!-- end -->",
            "between",
            "<!-- begin bad: echo '| half |'; false -->",
            "kept",
            "<!-- end -->",
            "after"
        ]
    );
    let unknown = benchmarks(&page, &["worse"]);
    assert!(!unknown.status.success() && stderr(&unknown).contains("no section 'worse'"), "{}", stderr(&unknown));
    assert!(benchmarks(&page, &["good"]).status.success());
}

#[test]
fn every_benchmark_has_a_command() {
    let page = repository().join("docs/benchmarks.md");
    let listed = benchmarks(&page, &["--list"]);
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    let names: Vec<&str> = text.lines().filter_map(|line| Some(line.split_once(": ")?.0)).collect();
    assert_eq!(
        names,
        [
            "truth",
            "responses",
            "frames",
            "surroundings",
            "light",
            "models",
            "exchange-cost",
            "build",
            "integrators",
            "one-pass",
            "one-pass-large",
            "one-pass-fine",
            "peers"
        ]
    );
}
