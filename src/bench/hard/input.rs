//! Hard case: numbers that are not finite. Every input refuses them with the name of the key.

use std::path::Path;

use super::case::HardCase;
use crate::scene::network::NetworkFile;
use crate::scene::{Scene, targets};

/// The replacements of a number.
const NOT_FINITE: [&str; 4] = ["nan", "inf", "-inf", "-nan"];

/// A scene that states all numbers. Each one is replaced in turn.
const SCENE: &str = include_str!("input/scene.toml");

/// A network file that states all numbers.
const NETWORK: &str = include_str!("input/network.toml");

/// Replaces every number by each of [`NOT_FINITE`]. Returns pairs of key and text.
fn spoiled(text: &str) -> Vec<(String, String)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut all = Vec::new();
    for (number, line) in lines.iter().enumerate() {
        let Some((key, _)) = line.split_once(" = ") else { continue };
        for (at, word) in numbers(line) {
            for value in NOT_FINITE {
                let other = format!("{}{value}{}", &line[..at], &line[at + word.len()..]);
                let mut lines = lines.clone();
                lines[number] = &other;
                all.push((inner_key(line, at).unwrap_or(key).to_owned(), lines.join("\n")));
            }
        }
    }
    all
}

/// Positions of numbers with a decimal point in a line.
fn numbers(line: &str) -> Vec<(usize, &str)> {
    let part = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let mut files = Vec::new();
    let mut at = 0;
    while let Some(start) = line[at..].find(part).map(|start| at + start) {
        let end = line[start..].find(|c| !part(c)).map_or(line.len(), |end| start + end);
        let word = &line[start..end];
        if word.contains('.') && word.parse::<f64>().is_ok() {
            files.push((start, word));
        }
        at = end;
    }
    files
}

/// The inline-table key at a position in a line.
fn inner_key(line: &str, at: usize) -> Option<&str> {
    let open = line.find('{')?;
    let before = line[..at].rfind('=').filter(|equals| *equals > open)?;
    line[..before].trim_end().rsplit([' ', '{', ',']).next()
}

/// The texts that were accepted, or refused without the name of the key.
fn accepted(texts: &[(String, String)], refusal: impl Fn(&str) -> Option<String>) -> f64 {
    let named = |(key, text): &&(String, String)| refusal(text).is_some_and(|message| message.contains(key.as_str()));
    texts.iter().filter(|one| !named(one)).count() as f64
}

fn scenes() -> Result<f64, String> {
    let failed = |error: std::io::Error| error.to_string();
    let folder = tempfile::tempdir().map_err(failed)?;
    std::fs::write(folder.path().join("model.glb"), b"").map_err(failed)?;
    let path = folder.path().join("scene.toml");
    let refusal = |text: &str| Scene::parse(text, &path).err().map(|error| error.to_string());
    if let Some(message) = refusal(SCENE) {
        return Err(format!("the scene itself is refused: {message}"));
    }
    Ok(accepted(&spoiled(SCENE), refusal))
}

fn networks() -> Result<f64, String> {
    let refusal = |text: &str| NetworkFile::parse(text, Path::new("network.toml")).err().map(|error| error.to_string());
    if let Some(message) = refusal(NETWORK) {
        return Err(format!("the network itself is refused: {message}"));
    }
    Ok(accepted(&spoiled(NETWORK), refusal))
}

/// Target files whose second row is not a finite number.
fn target_files() -> Vec<(String, String)> {
    NOT_FINITE.map(|value| ("target".to_owned(), format!("step,target\n1,267\n51,{value}\n"))).to_vec()
}

fn target_rows() -> Result<f64, String> {
    let refusal = |text: &str| targets::parse(text, Path::new("targets.csv")).err().map(|error| error.to_string());
    if let Some(message) = refusal("step,target\n1,267\n51,300\n") {
        return Err(format!("the targets themselves are refused: {message}"));
    }
    Ok(accepted(&target_files(), refusal))
}

/// Number of texts that TOML accepts. TOML has words for infinity and NaN.
fn taken_by_toml(text: &str) -> f64 {
    spoiled(text).iter().filter(|(_, text)| text.parse::<toml::Table>().is_ok()).count() as f64
}

/// Number of targets that Rust's number parser accepts.
fn taken_by_parser() -> f64 {
    NOT_FINITE.iter().filter(|value| value.parse::<f64>().is_ok()).count() as f64
}

/// The cases. No case uses a device, so all are the same on every target.
pub(crate) fn cases() -> Vec<HardCase> {
    let case = |name: &str, count: usize, source: &str, measure: fn() -> Result<f64, String>, without: fn() -> f64| {
        let what = format!("each number as nan, -nan, inf and -inf, {count} in all: refused, naming the key");
        HardCase::new(format!("non-finite input, {name}"), what, "accepted", (0.0, source))
            .remedy("every number has a range, in which it must lie", "what the file format takes for a number")
            .measured(move |_, _| measure(), move |_| without())
    };
    vec![
        case("scene", spoiled(SCENE).len(), "docs/numerics.md 6, refused by name", scenes, || taken_by_toml(SCENE)),
        case("network file", spoiled(NETWORK).len(), "docs/numerics.md 6, refused by name", networks, || {
            taken_by_toml(NETWORK)
        }),
        case("targets", NOT_FINITE.len(), "docs/numerics.md 6, a clear error", target_rows, taken_by_parser),
    ]
}
