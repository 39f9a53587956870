//! Compares the outputs of an earlier commit's program with those of the present one.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::Parser;
use serde_json::Value;

/// Show that a change of the program changes no output.
///
/// Images, series, plots and pictures are compared byte by byte. Reports are compared without their times.
///
/// Example: cargo run --release -p isotherm-tools --bin same_outputs -- 431b7c8
#[derive(Parser)]
struct Arguments {
    /// Commit of the earlier program.
    commit: String,
    /// Scenes to run.
    #[arg(long, default_values = ["models/station.toml", "models/station_transition.toml", "models/iss.toml"])]
    scenes: Vec<PathBuf>,
    /// Folder for the earlier program and the runs.
    #[arg(long, default_value = "target/same_outputs")]
    folder: PathBuf,
}

/// Keys of `report.json` that hold times or the folder of the run.
const TIMES: [&str; 9] = [
    "ns_per_node_step",
    "step_ms",
    "network_wall_ms",
    "image_ms",
    "wall_s",
    "median_ms",
    "p10_ms",
    "p90_ms",
    "command_line",
];

fn main() -> ExitCode {
    match compare(&Arguments::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Number of files that differ.
fn compare(arguments: &Arguments) -> Result<usize, Box<dyn Error>> {
    let folder = std::path::absolute(&arguments.folder)?;
    std::fs::create_dir_all(&folder)?;
    let before = program(&arguments.commit, &folder)?;
    succeed(Command::new("cargo").args(["build", "--locked", "--release", "-p", "isotherm"]))?;
    let after = Path::new("target/release/isotherm").to_owned();
    let mut different = 0;
    for scene in &arguments.scenes {
        let name = scene.file_stem().unwrap_or_default().to_string_lossy();
        let runs = [(&before, "before"), (&after, "after")]
            .map(|(program, word)| (program, folder.join(format!("{name}_{word}"))));
        for (program, out) in &runs {
            let help = Command::new(program).args(["run", "--help"]).output()?.stdout;
            // A build from before the option reads every file.
            let outside = String::from_utf8_lossy(&help).contains("--allow-outside").then_some("--allow-outside");
            succeed(Command::new(program).arg("run").arg(scene).arg("-o").arg(out).arg("--force").args(outside))?;
        }
        let [before, after] = runs.map(|(_, out)| out);
        let files: BTreeSet<PathBuf> = files(&before)?.union(&files(&after)?).cloned().collect();
        let unlike: Vec<&PathBuf> =
            files.iter().filter(|file| !is_same(&before.join(file), &after.join(file))).collect();
        for file in &unlike {
            println!("{}: {} differs", scene.display(), file.display());
        }
        println!("{}: {} of {} files are the same", scene.display(), files.len() - unlike.len(), files.len());
        different += unlike.len();
    }
    Ok(different)
}

/// The program of a commit. It is built if it does not exist.
fn program(commit: &str, folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let program = folder.join(format!("isotherm_{commit}"));
    if !program.exists() {
        let source = folder.join("source");
        succeed(Command::new("git").args(["worktree", "add", "--force", "--detach"]).arg(&source).arg(commit))?;
        let mut build = Command::new("cargo");
        build.args(["build", "--locked", "--release", "-p", "isotherm", "--target-dir"]).arg(folder.join("build"));
        let built = succeed(build.current_dir(&source));
        succeed(Command::new("git").args(["worktree", "remove", "--force"]).arg(&source))?;
        built?;
        std::fs::copy(folder.join("build/release/isotherm"), &program)?;
    }
    Ok(program)
}

fn succeed(command: &mut Command) -> Result<(), Box<dyn Error>> {
    let status = command.status()?;
    if status.success() { Ok(()) } else { Err(format!("{command:?} ended with {status}").into()) }
}

/// All files below a folder, relative to it.
fn files(folder: &Path) -> std::io::Result<BTreeSet<PathBuf>> {
    let mut found = BTreeSet::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next)? {
            let path = entry?.path();
            // The manifest of a folder holds times.
            if path.ends_with(".isotherm") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap_or(&path).to_owned());
            }
        }
    }
    Ok(found)
}

fn is_same(before: &Path, after: &Path) -> bool {
    let (Ok(before_bytes), Ok(after_bytes)) = (std::fs::read(before), std::fs::read(after)) else { return false };
    match before.extension().and_then(|extension| extension.to_str()) {
        Some("json") => {
            let [before, after] = [&before_bytes, &after_bytes].map(|bytes| serde_json::from_slice(bytes));
            let (Ok(before), Ok(after)) = (before, after) else { return false };
            is_same_value("", &before, &after)
        }
        // The page shows the values of report.json. Its embedded pictures are also compared as files.
        Some("html") => without_numbers(&before_bytes) == without_numbers(&after_bytes),
        _ => before_bytes == after_bytes,
    }
}

/// Compares two report values except for times, and prints every difference.
fn is_same_value(place: &str, before: &Value, after: &Value) -> bool {
    match (before, after) {
        (Value::Object(before), Value::Object(after)) => {
            let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
            let counted = keys.into_iter().filter(|key| !TIMES.contains(&key.as_str()));
            let of =
                |entries: &serde_json::Map<String, Value>, key: &String| entries.get(key).cloned().unwrap_or_default();
            counted
                .map(|key| is_same_value(&format!("{place}/{key}"), &of(before, key), &of(after, key)))
                .filter(|same| !same)
                .count()
                == 0
        }
        (Value::Array(before), Value::Array(after)) if before.len() == after.len() => {
            let pairs = before.iter().zip(after).enumerate();
            pairs
                .map(|(i, (before, after))| is_same_value(&format!("{place}/{i}"), before, after))
                .filter(|same| !same)
                .count()
                == 0
        }
        _ if before == after || [before, after].iter().all(|value| is_seconds(value)) => true,
        _ => {
            println!("  {place}:\n    before: {before}\n    after:  {after}");
            false
        }
    }
}

/// Whether a value is a time as text, such as `1.76 s`.
fn is_seconds(value: &Value) -> bool {
    let number = value.as_str().and_then(|text| text.strip_suffix(" s"));
    number.is_some_and(|number| number.parse::<f64>().is_ok())
}

/// A page without digits and without the folders of the two runs.
fn without_numbers(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes).replace("_before", "").replace("_after", "");
    text.chars().filter(|c| !c.is_ascii_digit() && !" .-e".contains(*c)).collect()
}
