//! `isotherm run`: runs a scene and writes images, plots and a report.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use super::arguments::{command_line, folder};
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::prepare::{device_memory, guard, prepare_with_progress, say_size};
use super::progress::{progress_bar, stop_flag, tell_work, warm_up_bar};
use super::reach::ReachArguments;
use super::resume::{EarlierRun, identity};
use super::run_report::{print_summary, report, speed};
use super::thermal_state;
use super::uncertainty::sigma_of;
use crate::gpu::plan::{Planned, check_plan};
use crate::guard::finding::CheckEffort;
use crate::host::peak_memory;
use crate::output::casts_file;
use crate::output::console::{answer, say};
use crate::output::destination::{Destination, destinations};
use crate::output::folder::Folder;
use crate::output::inputs::keep_inputs;
use crate::output::job::{Done, FILES, Job, REPORT_HTML, REPORT_JSON, RunOutcome, SaveEvery, run_into};
use crate::output::report::{BufferSize, FrameEntry, Report, ReportSource, Speed};
use crate::output::run_state::RunProgress;
use crate::output::state_file::encode;
use crate::output::{mcap, report_html, video};
use crate::scene::Draw;
use crate::simulation::check::SAMPLE;
use crate::simulation::device_data::DeviceData;
use crate::simulation::forecast::Forecast;
use crate::simulation::host_memory::forecast_memory;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::stop::{Stopped, until};
use crate::trace::{Trace, Track, timed};

/// Run a scene: write temperatures, images, plots and a report.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm run models/station.toml -o out/station\n  \
isotherm run models/station.toml -o out/reference --device cpu\n  \
isotherm run models/station.toml -o out/checked --check=5000\n  \
isotherm run models/station.toml -o out/traced --trace out/traced.json\n  \
isotherm run --resume out/station\n  \
isotherm run models/station.toml -o out/warm --save-state out/warm.state --save-state-at 0\n  \
isotherm run models/station.toml -o out/again --from-state out/warm.state\n  \
isotherm run models/station.toml -o out/robot --mcap out/robot.mcap")]
pub(crate) struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    #[arg(required_unless_present = "resume")]
    scene: Option<PathBuf>,
    /// Output folder. Without --force it must be empty or absent
    #[arg(short, long, value_name = "DIR", required_unless_present = "resume", value_parser = folder())]
    output: Option<PathBuf>,
    /// Replace the files that isotherm wrote into the output folder, and keep all others. It refuses a file that was changed since
    #[arg(long)]
    force: bool,
    /// Go on with a run that was ended, from the state that it saved (DIR/.isotherm/state). The files come out as in an undisturbed run
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "force", "check"])]
    resume: Option<PathBuf>,
    /// How often the state is saved: a number of seconds, or of steps as in `100steps`. With 0 it is saved only after the warm-up and when a signal
    /// ends the run
    #[arg(long, value_name = "INTERVAL", default_value = "60", value_parser = parse_interval)]
    save_every: SaveEvery,
    /// Number of nodes to compare with the f64 reference [default on a device: 256]. The report states the error beside
    /// the speed. More nodes take longer. Networks of up to 100,000 nodes are compared as a whole
    #[arg(long, value_name = "NODES", require_equals = true, value_parser = clap::value_parser!(u32).range(1..))]
    check: Option<Option<u32>>,
    /// Write a timeline of host and device for ui.perfetto.dev or chrome://tracing, or - for standard output
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
    /// Write the thermal state at the end of the run, from which another run begins with --from-state. With [exchange], FILE.casts beside it keeps rays and reflections
    #[arg(long, value_name = "FILE")]
    save_state: Option<PathBuf>,
    /// Write that state as it is at a step of the run instead; 0 is the state after the warm-up
    #[arg(long, value_name = "SECONDS", requires = "save_state")]
    save_state_at: Option<f64>,
    /// Begin time 0 with a state of --save-state, instead of a warm-up. It is refused where model, materials or the order of the nodes differ
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    from_state: Option<PathBuf>,
    /// Write the images also as a log for robotics: ROS 2 messages in MCAP (docs/serve.md), or - for standard output
    #[arg(long, value_name = "FILE.mcap")]
    mcap: Option<PathBuf>,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

fn parse_interval(text: &str) -> Result<SaveEvery, String> {
    let wrong = || "it takes a number of seconds, such as 60, or of steps, such as 100steps".to_owned();
    if let Some(steps) = text.strip_suffix("steps") {
        return match steps.trim().parse() {
            Ok(0) | Err(_) => Err(wrong()),
            Ok(steps) => Ok(SaveEvery::Steps(steps)),
        };
    }
    let seconds: f64 = text.strip_suffix('s').unwrap_or(text).trim().parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(seconds).map(SaveEvery::Time).map_err(|_| wrong())
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let began = Instant::now();
    let [timeline, of_state, log] =
        destinations([arguments.trace.as_deref(), arguments.save_state.as_deref(), arguments.mcap.as_deref()])?;
    let trace = Trace::begin(timeline.is_some());
    let _on_track = trace.enter(Track::Host);
    tell_work(&trace);
    let earlier = arguments.resume.as_deref().map(EarlierRun::open).transpose()?;
    if let (Some(root), Some(None)) = (&arguments.resume, &earlier) {
        answer!("the run in {} is finished: there is nothing to resume", root.display());
        return Ok(());
    }
    let earlier = earlier.flatten();
    let (scene, root) = scene_and_folder(arguments, earlier.as_ref())?;
    let reach = reach_of(arguments, earlier.as_ref());
    let prepared = load_scene(&scene, reach)?;
    let fresh = if earlier.is_none() { Some(Folder::new(&root, &FILES)) } else { None };
    keep_scene_files(arguments, &prepared, fresh.as_ref())?;
    let at = thermal_state::step_of_state(arguments.save_state_at, &prepared.scene.time)?;
    video::check(&prepared.scene.images)?;
    let camera = prepared.scene.camera.as_ref().filter(|_| prepared.scene.time.draw != Draw::None);
    let chosen = timed("opening the device", || choose_device(arguments, earlier.as_ref()))?;
    let sample = choose_sample(arguments, earlier.as_ref(), &prepared, &chosen);
    let command_line = match &earlier {
        Some(earlier) => earlier.identity().command_line.clone(),
        None => command_line(),
    };
    let identity = identity(&prepared, &scene, reach, &chosen, sample, &command_line);
    if let Some(earlier) = &earlier {
        earlier.compare(&identity)?;
        casts_file::read_in(&earlier.folder, &prepared);
    }
    let begin = arguments.from_state.as_ref().map(|path| thermal_state::read(path, &prepared, &chosen)).transpose()?;
    let device_data = timed("planning the memory", || DeviceData::new(&prepared));
    let data = device_data.scene_data(&prepared, camera);
    let plan = data.plan();
    say_size(&prepared, &plan, &chosen);
    chosen.device().map_or(Ok(()), |context| check_plan(context, &plan, data.image))?;
    let stop = stop_flag();
    let sigma = sigma_of(&prepared, &chosen, &stop).map_err(|error| stopped_early(error, arguments))?;
    let (folder, state) = open_folder(arguments, &prepared, &root, earlier, fresh)?;
    let forecast = forecast_run(&prepared, begin.is_some(), (&chosen, &plan));
    let made = timed("making the engine", || until(&stop, || chosen.engine(&prepared, camera)));
    let mut engine = made.map_err(|Stopped| stopped_early(CliError::StoppedBefore, arguments))??;
    let start_up_s = began.elapsed().as_secs_f64();
    let bars = step_bars(&forecast, prepared.scene.time.steps);
    let job = Job {
        check: sample,
        save_every: arguments.save_every,
        identity: &identity,
        earlier: state.as_ref(),
        begin: begin.as_ref(),
        sigma: sigma.as_ref(),
        take_after: arguments.save_state.as_ref().map(|_| at),
    };
    let told = |done: Done| {
        if done != Done::WarmUp {
            bars[0].finish_and_clear();
        }
        bars[done as usize].inc(1);
    };
    let outcome = until(&stop, || run_into(&prepared, &mut *engine, &folder, &job, &stop, &told));
    bars.iter().for_each(ProgressBar::finish_and_clear);
    let outcome = outcome.map_err(|Stopped| CliError::StoppedRun(root.clone()))??;
    write_state(arguments, of_state.as_ref(), &outcome, &prepared)?;
    if let Some(log) = &log {
        timed("writing the log of robotics", || write_log(log, &folder, &outcome.frames, &prepared))?;
    }
    warn_unchecked(begin.is_some() && sample.is_some(), &outcome);
    let wall_s = outcome.wall_before_s + began.elapsed().as_secs_f64();
    let memory_b = [forecast.memory, peak_memory()];
    let speed = Speed { time: trace.account(), memory_b, ..speed(&prepared, &*engine, &outcome, wall_s) };
    let report = report(&prepared, &plan, &chosen, &mut *engine, outcome, start_up_s);
    let source = ReportSource { command_line, ..report.source };
    let report = Report { buffers: list_buffers(&plan, &chosen), speed, source, ..report };
    write_report(&folder, &report, timeline.as_ref(), &trace)?;
    print_summary(&report, &folder);
    check_validation(&chosen)?;
    if report.interrupted { Err(CliError::StoppedRun(root)) } else { Ok(()) }
}

/// The error of a stop before the first step. A resumed run keeps its earlier steps.
fn stopped_early(error: CliError, arguments: &Arguments) -> CliError {
    match (error, &arguments.resume) {
        (CliError::StoppedBefore, Some(root)) => CliError::StoppedRun(root.clone()),
        (error, _) => error,
    }
}

fn reach_of(arguments: &Arguments, earlier: Option<&EarlierRun>) -> ReachArguments {
    earlier.map_or(arguments.reach, |earlier| arguments.reach.or(earlier.identity().allow_outside))
}

fn warn_unchecked(asked: bool, outcome: &RunOutcome) {
    if asked && outcome.accuracy.is_none() {
        say!(
            "warning: nothing was compared with the f64 reference: the state was saved without it, or with another --check"
        );
    }
}

fn forecast_run(prepared: &Prepared, has_state: bool, (target, plan): (&Target, &[Planned])) -> Forecast {
    let memory = forecast_memory(prepared, target, device_memory(plan));
    let forecast = Forecast { memory, ..Forecast::of(prepared) };
    let forecast = if has_state { forecast.without_warm_up() } else { forecast };
    say!("{}", forecast.sentence());
    forecast
}

/// Writes the thermal state that was asked for, and the file beside it.
fn write_state(
    arguments: &Arguments,
    to: Option<&Destination>,
    outcome: &RunOutcome,
    prepared: &Prepared,
) -> Result<(), CliError> {
    if let (Some(path), Some(to), Some(state)) = (&arguments.save_state, to, &outcome.state) {
        to.write_bytes(&encode(state)?)?;
        casts_file::write_beside(path, prepared);
    }
    Ok(())
}

fn write_log(log: &Destination, folder: &Folder, frames: &[FrameEntry], prepared: &Prepared) -> Result<(), CliError> {
    log.write(|writer| mcap::write(writer, folder, frames, prepared))?;
    Ok(())
}

/// Writes the report and the timeline, and marks the folder of a whole run as finished.
fn write_report(
    folder: &Folder,
    report: &Report,
    timeline: Option<&Destination>,
    trace: &Trace,
) -> Result<(), CliError> {
    folder.write_json(REPORT_JSON, report)?;
    folder.write_bytes(REPORT_HTML, report_html::page(report).as_bytes())?;
    if let Some(timeline) = timeline {
        timeline.write_with(|writer| trace.write(writer))?;
        if trace.left_out() > 0 {
            say!("note: the timeline has its first million stretches of work, and leaves out {}", trace.left_out());
        }
    }
    if !report.interrupted {
        folder.finish()?;
    }
    Ok(())
}

/// The scene's file and the output folder.
fn scene_and_folder(arguments: &Arguments, earlier: Option<&EarlierRun>) -> Result<(PathBuf, PathBuf), CliError> {
    match (earlier, &arguments.scene, &arguments.output) {
        (Some(earlier), given, _) => Ok((earlier.scene(given.as_deref()), earlier.folder.root().to_path_buf())),
        (None, Some(scene), Some(output)) => Ok((scene.clone(), output.clone())),
        _ => Err(CliError::Usage("name a scene, and a folder with -o".to_owned())),
    }
}

/// Loads, builds and checks a scene.
fn load_scene(scene: &Path, reach: ReachArguments) -> Result<Prepared, CliError> {
    let mut prepared = prepare_with_progress(scene, reach)?;
    guard(&mut prepared, CheckEffort::BRIEF);
    Ok(prepared)
}

/// Refuses outputs that would replace an input.
fn keep_scene_files(arguments: &Arguments, prepared: &Prepared, fresh: Option<&Folder>) -> Result<(), CliError> {
    if let Some(folder) = fresh {
        folder.keep_inputs(&prepared.scene.files)?;
    }
    let casts = arguments.save_state.as_ref().map(|path| casts_file::beside(path));
    for path in [&arguments.trace, &arguments.save_state, &casts, &arguments.mcap].into_iter().flatten() {
        keep_inputs(path, prepared.scene.files.iter().chain(&arguments.from_state))?;
    }
    Ok(())
}

/// Opens the device that is named, or the device of the earlier run.
fn choose_device(arguments: &Arguments, earlier: Option<&EarlierRun>) -> Result<Target, CliError> {
    let device = match (&arguments.device.device, earlier) {
        (None, Some(earlier)) => DeviceArguments { device: Some(earlier.device()) },
        (given, _) => DeviceArguments { device: given.clone() },
    };
    Ok(device.open()?)
}

/// Number of nodes to compare with the f64 reference.
fn choose_sample(
    arguments: &Arguments,
    earlier: Option<&EarlierRun>,
    prepared: &Prepared,
    chosen: &Target,
) -> Option<usize> {
    let with_check = matches!(chosen, Target::Device(_));
    if arguments.check.is_some() && !with_check {
        say!("nothing to check: this run is the f64 reference itself");
    }
    match earlier {
        Some(earlier) => earlier.identity().check,
        // The reference would read the same file.
        None => (with_check && prepared.given.is_none())
            .then(|| arguments.check.flatten().map_or(SAMPLE, |nodes| nodes as usize)),
    }
}

/// Opens the folder of the earlier run, with its state, or prepares a fresh folder.
fn open_folder(
    arguments: &Arguments,
    prepared: &Prepared,
    root: &Path,
    earlier: Option<EarlierRun>,
    fresh: Option<Folder>,
) -> Result<(Folder, Option<RunProgress>), CliError> {
    match (earlier, fresh) {
        (Some(earlier), _) => {
            earlier.folder.make_folders()?;
            Ok((earlier.folder, Some(earlier.state.progress)))
        }
        (None, folder) => {
            let folder = folder.unwrap_or_else(|| Folder::new(root, &FILES));
            Ok((folder.prepare(arguments.force, &prepared.scene.files)?, None))
        }
    }
}

/// Bars of the warm-up, the steps and the pictures, in the order of [`Done`].
fn step_bars(forecast: &Forecast, steps: u32) -> [ProgressBar; 3] {
    [warm_up_bar(forecast), progress_bar(u64::from(steps) + 1, "steps"), progress_bar(forecast.images, "pictures")]
}

/// Buffers of a device; the reference has none.
fn list_buffers(plan: &[Planned], chosen: &Target) -> Vec<BufferSize> {
    match chosen {
        Target::Device(_) => plan
            .iter()
            .map(|planned| BufferSize { name: format!("{:?}", planned.resource), bytes: planned.bytes })
            .collect(),
        Target::Reference => Vec::new(),
    }
}
