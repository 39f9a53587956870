//! A data set made by several shards at once.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use serde_json::Value as Json;

/// What a data set cost.
pub struct Measured {
    /// Name of the SPEC.
    pub name: String,
    /// The scene file.
    pub scene: PathBuf,
    /// Number of images.
    pub images: u64,
    /// Number of orbits.
    pub orbits: u64,
    shards: u64,
    /// Time until the last shard ended [s].
    pub seconds: f64,
    /// Part of the time of all shards in which images were labelled, encoded and written [s].
    pub seconds_of_files: f64,
    bytes: f64,
    /// Most memory of a process [bytes].
    memory: f64,
}

impl Measured {
    /// Head of the table.
    pub const HEAD: &str = "| SPEC | shards | images | orbits | seconds | images an hour | labels and files, share of the time | bytes an image | most memory of a process |\n\
                            |---|---|---|---|---|---|---|---|---|";

    /// Images in an hour, thermal runs and warm-ups included.
    pub fn images_an_hour(&self) -> f64 {
        3600.0 * self.images as f64 / self.seconds
    }

    /// Its row of the table.
    pub fn row(&self) -> String {
        format!(
            "| {} | {} | {} | {} | {:.0} | {:.0} | {:.0} % | {:.0} | {:.0} MB |",
            self.name,
            self.shards,
            self.images,
            self.orbits,
            self.seconds,
            self.images_an_hour(),
            1e2 * self.seconds_of_files / (self.seconds * self.shards as f64),
            self.bytes / self.images as f64,
            self.memory / 1e6
        )
    }
}

/// Makes a data set by shards at once, in a folder that is removed. `images` and, where it is given, `poses` take the place of those of the SPEC.
///
/// # Errors
/// A shard that fails.
pub fn measure(
    program: &Path,
    spec: &Path,
    (images, poses): (u64, Option<u64>),
    shards: u64,
) -> Result<Measured, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", spec.display());
    let home = spec.parent().unwrap_or(Path::new("."));
    let name = spec.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut text = fs::read_to_string(spec).map_err(failed)?;
    text = with(&text, "samples", images)?;
    if let Some(poses) = poses {
        text = with(&text, "poses_per_orbit", poses)?;
    }
    // Beside the SPEC, from where its scene is found.
    let copy = home.join(format!(".{name}-{}.toml", std::process::id()));
    let output = std::env::temp_dir().join(format!("isotherm-dataset-{}", std::process::id()));
    fs::write(&copy, &text).map_err(failed)?;
    let measured = run(program, &copy, &output, shards);
    fs::remove_file(&copy).map_err(failed)?;
    let reports = measured?;
    fs::remove_dir_all(&output).map_err(failed)?;
    let all = |key: &'static str| reports.1.iter().filter_map(move |report| report.get(key)?.as_f64());
    let table: toml::Table = text.parse().map_err(|error| format!("{}: {error}", spec.display()))?;
    let scene = table.get("scene").and_then(toml::Value::as_str).unwrap_or_default();
    Ok(Measured {
        name,
        scene: home.join(scene),
        images,
        orbits: all("orbits").sum::<f64>() as u64,
        shards,
        seconds: reports.0,
        seconds_of_files: all("seconds_of_files").sum(),
        bytes: all("bytes").sum(),
        memory: all("peak_memory_bytes").fold(0.0, f64::max),
    })
}

/// A line of the SPEC with another number.
fn with(text: &str, key: &str, number: u64) -> Result<String, String> {
    let head = format!("{key} = ");
    let changed = |line: &str| if line.starts_with(&head) { format!("{head}{number}") } else { line.to_owned() };
    if !text.lines().any(|line| line.starts_with(&head)) {
        return Err(format!("the SPEC has no line '{head}...'"));
    }
    Ok(text.lines().map(changed).collect::<Vec<_>>().join("\n") + "\n")
}

/// Runs the shards. Returns the time that they took [s], and their reports.
fn run(program: &Path, spec: &Path, output: &Path, shards: u64) -> Result<(f64, Vec<Json>), String> {
    let began = Instant::now();
    let start = |shard: u64| {
        let mut command = Command::new(program);
        command.arg("dataset").arg(spec).arg("-o").arg(output).args(["--shard", &format!("{shard}/{shards}")]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().map_err(|error| error.to_string())
    };
    let mut children = (0..shards).map(start).collect::<Result<Vec<_>, _>>()?;
    for child in &mut children {
        let status = child.wait().map_err(|error| error.to_string())?;
        if !status.success() {
            return Err(format!("isotherm dataset {} ended with {status}", spec.display()));
        }
    }
    let seconds = began.elapsed().as_secs_f64();
    let report = |shard: u64| {
        let path = output.join(format!("report-{shard}-of-{shards}.json"));
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
    };
    Ok((seconds, (0..shards).map(report).collect::<Result<Vec<Json>, String>>()?))
}
