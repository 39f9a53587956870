//! Input that is not finite, at every entry: each value is refused with the name of its key.

use std::path::Path;

use super::case::Case;
use crate::scene::network::NetworkFile;
use crate::scene::{Scene, targets};

/// What is written where a number belongs.
const NOT_FINITE: [&str; 4] = ["nan", "inf", "-inf", "-nan"];

/// A scene whose numbers are all stated; each key is replaced in turn.
const SCENE: &str = r#"
[model]
path = "model.glb"
max_edge = 0.5
[time]
step = 10.0
steps = 2
warm_up_orbits = 1.0
[orbit]
altitude = 400000.0
period = 5553.0
beta_deg = 10.0
phase_deg = 20.0
[attitude]
mode = "spin"
quaternion = [1.0, 0.0, 0.0, 0.0]
spin_axis = [0.0, 0.0, 1.0]
rate_deg = 1.0
[environment]
solar_constant = 1361.0
albedo = 0.3
planet_ir = 237.0
planet_radius = 6371000.0
background_temperature = 2.7
[shadows]
redraw_angle_deg = 0.25
[[material]]
match = "cells"
absorptivity = 0.75
emissivity = 0.82
sides = "both"
back = { absorptivity = 0.4, emissivity = 0.6 }
response = "transition"
heating = { function = "exponential", rate = 3.0, t_max = 100.0 }
cooling = { function = "polynomial", coefficients = [0.0, 2.0, -1.0], t_max = 50.0 }
[[material]]
match = "*"
absorptivity = 0.3
emissivity = 0.8
response = "network"
thickness = 0.001
density = 2700.0
specific_heat = 900.0
conductivity = 167.0
over = { effective_emittance = 0.02, thickness = 0.01, density = 2700.0, specific_heat = 900.0, conductivity = 167.0 }
[radiance]
band_um = [8.0, 14.0]
[camera]
width = 64
height = 48
fov_deg = 45.0
frame = "body"
position = [6.5, 5.0, -7.5]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 0.0, 1.0]
near = 0.5
[initial]
temperature = 290.0
[[probe]]
name = "tip"
position = [0.0, 5.5, 0.0]
[network]
tolerance = 0.005
merge_rate = 50.0
[[contact]]
between = ["a", "b"]
distance = 0.001
conductance_per_area = 300.0
[[heater]]
part = "a"
power = 5.0
probe = "tip"
on_below = 280.0
off_above = 285.0
[output]
colour_range = [200.0, 350.0]
"#;

/// A network whose numbers are all stated.
const NETWORK: &str = r#"
space_temperature = 2.7
[[node]]
label = "a"
kind = "diffusive"
capacitance = 100.0
emissive_area = 0.1
temperature = 290.0
heat = { time = [0.0, 10.0], power = [1.0, 2.0] }
[[node]]
label = "b"
kind = "boundary"
temperature = 250.0
[[linear_conductor]]
nodes = ["a", "b"]
conductance = 0.5
[[radiative_conductor]]
nodes = ["a", "b"]
exchange_area = 0.01
[[thermostat]]
node = "a"
sensor = "a"
power = 3.0
on_below = 280.0
off_above = 285.0
initially_on = false
[output]
times = [0.0, 100.0]
"#;

/// Every number of a text once as each of [`NOT_FINITE`]: the key that it belongs to, and the text.
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

/// Where numbers with a decimal point stand in a line.
fn numbers(line: &str) -> Vec<(usize, &str)> {
    let part = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(start) = line[at..].find(part).map(|start| at + start) {
        let end = line[start..].find(|c| !part(c)).map_or(line.len(), |end| start + end);
        let word = &line[start..end];
        if word.contains('.') && word.parse::<f64>().is_ok() {
            found.push((start, word));
        }
        at = end;
    }
    found
}

/// The key within an inline table that a place in a line belongs to.
fn inner_key(line: &str, at: usize) -> Option<&str> {
    let open = line.find('{')?;
    let before = line[..at].rfind('=').filter(|equals| *equals > open)?;
    line[..before].trim_end().rsplit([' ', '{', ',']).next()
}

/// Texts that were not refused by a message that names their key.
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

/// Rows of targets, the second of which is no number.
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

/// Texts that TOML takes: it has words for numbers that are not finite.
fn taken_by_toml(text: &str) -> f64 {
    spoiled(text).iter().filter(|(_, text)| text.parse::<toml::Table>().is_ok()).count() as f64
}

/// Targets that a number's own parser takes.
fn taken_by_parser() -> f64 {
    NOT_FINITE.iter().filter(|value| value.parse::<f64>().is_ok()).count() as f64
}

/// All of them: the same on every device, for no device is asked.
pub fn cases() -> Vec<Case> {
    let case = |name: &str, count: usize, source: &str, measure: fn() -> Result<f64, String>, without: fn() -> f64| {
        let what = format!("each number as nan, -nan, inf and -inf, {count} in all: refused, naming the key");
        Case::new(format!("non-finite input, {name}"), what, "accepted", (0.0, source))
            .remedy("every number has a range, in which it must lie", "what the file format takes for a number")
            .measured(move |_, _| measure(), move |_| without())
    };
    vec![
        case("scene", spoiled(SCENE).len(), "issue 6, refused by name", scenes, || taken_by_toml(SCENE)),
        case("network file", spoiled(NETWORK).len(), "issue 6, refused by name", networks, || taken_by_toml(NETWORK)),
        case("targets", NOT_FINITE.len(), "issue 3, a clear error", target_rows, taken_by_parser),
    ]
}
