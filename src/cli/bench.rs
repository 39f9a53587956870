//! `isotherm bench`: measures speed and error.

use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressDrawTarget};

use super::arguments::{command_line, folder};
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::tell;
use super::reach::ReachArguments;
use crate::bench::files::{self, PAGE};
use crate::bench::hard::HardRow;
use crate::bench::plan::{BenchPlan, Measurement};
use crate::bench::run::{self, BenchError};
use crate::bench::tables;
use crate::gpu::context::devices;
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::scene::Scene;
use crate::simulation::target::Target;

/// Measure speed and error on every Vulkan device present and on the f64 reference.
///
/// limits: bandwidth of a copy and cost of an empty dispatch.
/// responses: ns a node and step of each response at 1e4 to 1e7 nodes, in GB/s and as a share of the copy.
/// frames: whole steps of scenes with an image of 640 x 512 pixels, pass by pass, with and without shadows, at longest
/// edges of 2, 1, 0.5 and 0.25 m.
/// models: cost of each model choice in one scene over an orbit, and the change in kelvin and radiance; the error of every
/// response with and without shadows, against the accurate network with all settings of converge finer.
/// drivers: differences in temperatures and images of one scene between all Vulkan devices.
/// integrators: four networks through one orbit with every integrator, with fixed sub-steps and with several
/// tolerances, in f64 on the processor: passes, time, and rms and largest error. The networks are a cube, a thin
/// sheet, a sheet with slivers, and a blanket over a structure.
/// hard: the hard cases. Each has a measured error, a limit, the source of the limit, and the error without its remedy.
/// --quick leaves them out unless --only asks for them.
///
/// Writes bench.json, plots/ and report.html, and prints the tables.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm bench -o out/bench\n  \
isotherm bench -o out/bench --quick --only integrators --device llvmpipe\n  isotherm bench --hard --quick")]
pub(crate) struct Arguments {
    /// Output folder. Without --force it must be empty or absent
    #[arg(short, long, value_name = "DIR", required_unless_present = "hard", value_parser = folder())]
    output: Option<PathBuf>,
    /// Run the hard cases alone; exit code 1 if one exceeds its limit
    #[arg(long, conflicts_with = "only")]
    hard: bool,
    /// Run only these, separated by commas: limits, responses, frames, models, drivers, integrators, hard
    #[arg(long, value_name = "SECTION", value_delimiter = ',', value_parser = parse_section)]
    only: Vec<Measurement>,
    /// Scenes for `frames`, the last one also for `drivers` [default: models/iss.toml and models/station.toml if
    /// present]
    #[arg(long, value_name = "SCENE")]
    scene: Vec<PathBuf>,
    /// Scene for `models`; its materials need network values [default: models/station.toml if present]
    #[arg(long, value_name = "SCENE")]
    model_scene: Option<PathBuf>,
    /// Use fewer schemes, nodes and frames: within 90 s on lavapipe
    #[arg(long)]
    quick: bool,
    /// Replace the files that isotherm wrote into the output folder, and keep all others. It refuses a file that was changed since
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

fn parse_section(text: &str) -> Result<Measurement, String> {
    let names: Vec<&str> = Measurement::ALL.iter().map(|section| section.name()).collect();
    Measurement::named(text).ok_or_else(|| format!("the sections are {}", names.join(", ")))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let chosen = match arguments.device.device {
        Some(_) => vec![arguments.device.open()?],
        None => everything(arguments.quick)?,
    };
    let sections = arguments.sections();
    let wants_models = sections.contains(&Measurement::Models);
    let with_scenes = [Measurement::Frames, Measurement::Drivers].iter().any(|section| sections.contains(section));
    let scenes = if with_scenes { scenes(&arguments.scene, arguments.reach)? } else { Vec::new() };
    let model_scene = if wants_models { model_scene(arguments.model_scene.as_deref(), arguments.reach)? } else { None };
    let inputs: Vec<PathBuf> = scenes.iter().chain(&model_scene).flat_map(|scene| scene.files.clone()).collect();
    let output = arguments.output.as_deref();
    let folder = output.map(|output| Folder::new(output, &files::OWN).prepare(arguments.force, &inputs)).transpose()?;
    let plan = BenchPlan {
        measurements: sections,
        quick: arguments.quick,
        targets: chosen.clone(),
        scenes,
        model_scene,
        command_line: command_line(),
    };
    let spinner = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    tell(&spinner);
    let bench = run::run(&plan, &|what| {
        spinner.set_message(what.to_owned());
        spinner.tick();
    });
    spinner.finish_and_clear();
    let bench = bench?;
    if let Some(folder) = &folder {
        files::write_bench_files(folder, &bench)?;
    }
    for table in tables::all_tables(&bench) {
        answer!("{}", table.markdown());
    }
    for (name, stolen) in bench.devices.iter().filter_map(|measured| Some((&measured.name, measured.stolen?))) {
        answer!("{name}: other guests of the host took {:.1} % of the processor time asked for\n", 1e2 * stolen);
    }
    if let Some(folder) = &folder {
        answer!("report: {}", folder.file(PAGE).display());
    }
    chosen.iter().try_for_each(check_validation)?;
    let misses = bench.devices.iter().flat_map(|measured| {
        let misses = measured.hard.iter().filter_map(HardRow::miss);
        misses.map(|miss| format!("{}: {miss}", measured.name))
    });
    let misses: Vec<String> = misses.collect();
    if misses.is_empty() {
        return Ok(());
    }
    Err(CliError::Solver(format!("hard cases that miss their limit:\n{}", misses.join("\n"))))
}

impl Arguments {
    fn sections(&self) -> Vec<Measurement> {
        if self.hard {
            return vec![Measurement::Hard];
        }
        if !self.only.is_empty() {
            return self.only.clone();
        }
        Measurement::ALL.into_iter().filter(|section| !self.quick || *section != Measurement::Hard).collect()
    }
}

/// Every usable device, and without `quick` the f64 reference.
fn everything(quick: bool) -> Result<Vec<Target>, CliError> {
    let mut all = Vec::new();
    for info in devices()? {
        if info.lacks.is_empty() {
            all.push(DeviceArguments { device: Some(info.name) }.open()?);
        } else {
            say!("left out: '{}' lacks {}", info.name, info.lacks.join(", "));
        }
    }
    if !quick {
        all.push(Target::Reference);
    }
    Ok(all)
}

/// The given scenes, or the present ones of this repository.
fn scenes(asked: &[PathBuf], reach: ReachArguments) -> Result<Vec<Scene>, CliError> {
    if !asked.is_empty() {
        return asked.iter().map(|path| reach.scene(path)).collect();
    }
    let mut scenes = Vec::new();
    for name in ["models/iss.toml", "models/station.toml"] {
        match reach.scene(Path::new(name)) {
            Ok(scene) => scenes.push(scene),
            Err(error) => say!("left out of frames and drivers: {error}"),
        }
    }
    Ok(scenes)
}

/// The given scene, or the one of this repository if present.
fn model_scene(asked: Option<&Path>, reach: ReachArguments) -> Result<Option<Scene>, CliError> {
    match (asked, reach.scene(asked.unwrap_or(Path::new("models/station.toml")))) {
        (_, Ok(scene)) => Ok(Some(scene)),
        (Some(_), Err(error)) => Err(error),
        (None, Err(error)) => {
            say!("left out of models: {error}");
            Ok(None)
        }
    }
}

impl From<BenchError> for CliError {
    fn from(error: BenchError) -> Self {
        match error {
            BenchError::Gpu(error) => Self::Gpu(error),
            other => Self::Solver(other.to_string()),
        }
    }
}
