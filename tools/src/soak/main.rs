//! Runs a small scene for very many steps and draws the memory of the process over the steps.

#[path = "../kills/craft.rs"]
mod craft;

use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use clap::Parser;
use isotherm::internals::{Axis, Plot, PlotLine};
use isotherm_tools::{exit_code, section};

const SCENE: &str = include_str!("soak.toml");
/// Time between two samples.
const PAUSE: Duration = Duration::from_millis(500);
/// Share of the steps after which the memory is expected to be steady.
const SETTLED: f64 = 0.05;

/// Run a small scene for very many steps and sample the memory of the process.
#[derive(Parser)]
struct Arguments {
    /// Number of steps
    #[arg(long, default_value_t = 1_000_000)]
    steps: u32,
    /// Device of the run
    #[arg(long, default_value = "cpu")]
    device: String,
    /// The built program [default: beside this one]
    #[arg(long)]
    program: Option<PathBuf>,
    /// Write the plot
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Replace the section between `<!-- soak -->` and `<!-- /soak -->` of this page
    #[arg(long, value_name = "FILE.md")]
    page: Option<PathBuf>,
}

fn main() -> ExitCode {
    exit_code(work(&Arguments::parse()))
}

/// Lines of a growing file, counted as they come.
struct Lines {
    path: PathBuf,
    read: u64,
    lines: u64,
}

impl Lines {
    fn count(&mut self) -> u64 {
        let Ok(mut file) = File::open(&self.path) else { return 0 };
        let mut bytes = Vec::new();
        if file.seek(SeekFrom::Start(self.read)).and_then(|_| file.read_to_end(&mut bytes)).is_ok() {
            self.read += bytes.len() as u64;
            self.lines += bytes.iter().filter(|byte| **byte == b'\n').count() as u64;
        }
        self.lines
    }
}

/// Resident memory of a process [MiB].
fn memory(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse::<f64>().ok().map(|kib| kib / 1024.0)
}

fn work(arguments: &Arguments) -> Result<(), String> {
    let failed = |error: std::io::Error| error.to_string();
    let program = section::program(arguments.program.clone())?;
    let folder = std::env::temp_dir().join(format!("isotherm-soak-{}", std::process::id()));
    fs::create_dir_all(&folder).map_err(failed)?;
    craft::write_model(&folder).map_err(failed)?;
    let scene = SCENE.replace("steps = 100", &format!("steps = {}", arguments.steps));
    fs::write(folder.join("scene.toml"), scene).map_err(failed)?;
    let began = Instant::now();
    let mut command = Command::new(program);
    command.args(["run", "scene.toml", "-o", "out", "--device", &arguments.device]).current_dir(&folder);
    let said = File::create(folder.join("said")).map_err(failed)?;
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said).spawn().map_err(failed)?;
    let mut lines = Lines { path: folder.join("out/series.csv"), read: 0, lines: 0 };
    let mut samples: Vec<[f64; 2]> = Vec::new();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            break status;
        }
        if let Some(memory) = memory(child.id()) {
            samples.push([lines.count() as f64, memory]);
        }
        std::thread::sleep(PAUSE);
    };
    let took = began.elapsed().as_secs_f64();
    if !status.success() {
        return Err(fs::read_to_string(folder.join("said")).unwrap_or_default());
    }
    let bytes = fs::metadata(folder.join("out/series.csv")).map_err(failed)?.len();
    let settled: Vec<[f64; 2]> =
        samples.iter().copied().filter(|[step, _]| *step > SETTLED * f64::from(arguments.steps)).collect();
    // The last samples are those of plots and report.
    let stepping = |sample: &&[f64; 2]| sample[0] < f64::from(arguments.steps);
    let least = settled.iter().filter(stepping).map(|sample| sample[1]).fold(f64::INFINITY, f64::min);
    let most = settled.iter().filter(stepping).map(|sample| sample[1]).fold(0.0, f64::max);
    let end = samples.last().map_or(0.0, |sample| sample[1]);
    if let Some(path) = &arguments.plot {
        draw(path, &samples, arguments)?;
    }
    let picture = arguments.plot.as_ref().and_then(|path| path.file_name()).map_or(String::new(), |name| {
        format!("\n![Memory of the process over the steps]({})\n", name.to_string_lossy())
    });
    let text = format!(
        "`cargo run {}-p isotherm-tools --bin soak -- --steps {} --device {} --plot docs/soak.svg --page docs/reliability.md`\n\n\
         A craft with a network, a thermostat, a transition and a joint that follows the Sun took {} steps on {} in {took:.0} s. `series.csv` grew to \
         {:.0} MB. The memory of the process was sampled twice a second.\n\n\
         | memory from {:.0} % of the steps on | MiB |\n|---|---|\n| least | {least:.1} |\n| most | {most:.1} |\n| while plots and report are made | {end:.1} |\n{picture}",
        section::PROFILE,
        arguments.steps,
        arguments.device,
        arguments.steps,
        arguments.device,
        bytes as f64 / 1e6,
        1e2 * SETTLED,
    );
    fs::remove_dir_all(&folder).map_err(failed)?;
    section::tell("soak", &text, arguments.page.as_deref())
}

fn draw(path: &Path, samples: &[[f64; 2]], arguments: &Arguments) -> Result<(), String> {
    let most = samples.iter().map(|sample| sample[1]).fold(0.0, f64::max);
    let points = samples.iter().map(|[step, memory]| [step / 1e3, *memory]).collect();
    let plot = Plot {
        title: format!("Memory over {} steps", arguments.steps),
        subtitle: format!("resident memory of `isotherm run` on {}, at most {most:.0} MiB", arguments.device),
        x: Axis::linear("steps [thousands]"),
        y: Axis { range: Some([0.0, 1.05 * most]), ..Axis::linear("memory [MiB]") },
        series: vec![PlotLine { name: "memory".to_owned(), points, ..PlotLine::default() }],
        ..Plot::default()
    };
    let svg = plot.svg().map_err(|error| error.to_string())?;
    fs::write(path, svg).map_err(|error| error.to_string())
}
