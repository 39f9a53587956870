//! `isotherm run`: runs a scene and writes images, plots and a report.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use super::arguments::{command_line, folder};
use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::{building_bar, progress_bar, show_stage, stop_flag};
use super::reach::ReachArguments;
use super::resume::{Earlier, identity};
use super::thermal_state;
use crate::gpu::resources::{Planned, check_plan, device_bytes};
use crate::gpu::samples::Samples;
use crate::gpu::sensor::{COPIED, READ};
use crate::guard;
use crate::guard::finding::Effort;
use crate::output::console::{answer, say};
use crate::output::destination::destinations;
use crate::output::folder::Folder;
use crate::output::image_index::IMAGES;
use crate::output::inputs::keep_inputs;
use crate::output::job::{Done, FILES, Job, Outcome, REPORT_HTML, REPORT_JSON, SaveEvery, run_into};
use crate::output::report::{
    BufferSize, Device, FileEntry, ModelSize, PassTime, Report, SettingGroup, SourceFile, Speed,
};
use crate::output::state_file::encode;
use crate::output::step_cost::step_cost;
use crate::output::tables::{JOINTS, SERIES};
use crate::output::{mcap, report_html, settings, video};
use crate::scene::{Draw, Scene};
use crate::simulation::check::SAMPLE;
use crate::simulation::device_data::DeviceData;
use crate::simulation::engine::Engine;
use crate::simulation::forecast::{Forecast, Rate};
use crate::simulation::network::{BEYOND, ESTIMATED};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::trace::{Trace, Track};

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
pub struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    #[arg(required_unless_present = "resume")]
    scene: Option<PathBuf>,
    /// Output folder. Without --force it must be empty or absent
    #[arg(short, long, value_name = "DIR", required_unless_present = "resume", value_parser = folder())]
    output: Option<PathBuf>,
    /// Replace the files that isotherm wrote into the output folder, and keep all others. It refuses a file that was changed since
    #[arg(long)]
    force: bool,
    /// Go on with a run that was ended, from the state that it saved (DIR/.isotherm/state). The files are those of an undisturbed run
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
    /// Write the thermal state at the end of the run, from which another run begins with --from-state
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

/// Loads a scene and prints its warnings.
pub(super) fn prepare_with_progress(path: &Path, reach: ReachArguments) -> Result<Prepared, CliError> {
    prepare_scene(reach.scene(path)?)
}

/// Prepares a scene and prints its warnings.
pub(super) fn prepare_scene(scene: Scene) -> Result<Prepared, CliError> {
    let bar = building_bar();
    let prepared = Prepared::from_scene(scene, &mut |stage| show_stage(&bar, stage));
    bar.finish_and_clear();
    let prepared = prepared?;
    for warning in &prepared.warnings {
        say!("warning: {warning}");
    }
    for assumption in &prepared.scene.assumptions {
        say!("assumed: {assumption}");
    }
    Ok(prepared)
}

/// Prints what is probably wrong in a scene, and keeps it for the report.
pub(super) fn guard(prepared: &mut Prepared, effort: Effort) {
    for finding in guard::check(prepared, effort).findings {
        say!("warning: {finding}");
        prepared.warnings.push(finding.to_string());
    }
}

/// Memory of a run on the device, with images and what the host reads [bytes].
pub(super) fn device_memory(prepared: &Prepared, plan: &[Planned]) -> u64 {
    let of_network = prepared.network_bytes(plan);
    plan.iter().map(|planned| planned.bytes).sum::<u64>() + of_network.device + of_network.host
}

/// Prints the number of nodes and triangles, and their memory on the device.
pub(super) fn say_size(prepared: &Prepared, plan: &[Planned], chosen: &Target) {
    let nodes = prepared.nodes.count;
    say!("{}: {nodes} nodes, {} triangles on {}", prepared.scene.name, prepared.triangle_count(), chosen.name());
    if let Target::Device(context) = chosen {
        let of_network = prepared.network_bytes(plan);
        let all = device_memory(prepared, plan);
        let of_nodes = device_bytes(plan) + of_network.device;
        say!(
            "device memory: {:.1} bytes a node; {:.1} MiB in all, images and buffers for the host included, of {} MiB free",
            of_nodes as f64 / nodes.max(1) as f64,
            all as f64 / f64::from(1 << 20),
            context.free_memory() >> 20
        );
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let began = Instant::now();
    let [timeline, of_state, log] =
        destinations([arguments.trace.as_deref(), arguments.save_state.as_deref(), arguments.mcap.as_deref()])?;
    let trace = if timeline.is_some() { Trace::recording() } else { Trace::default() };
    let earlier = match &arguments.resume {
        None => None,
        Some(root) => match Earlier::open(root)? {
            Some(earlier) => Some(earlier),
            None => {
                answer!("the run in {} is finished: there is nothing to resume", root.display());
                return Ok(());
            }
        },
    };
    let (scene, root) = match (&earlier, &arguments.scene, &arguments.output) {
        (Some(earlier), given, _) => (earlier.scene(given.as_deref())?, earlier.folder.root().to_path_buf()),
        (None, Some(scene), Some(output)) => (scene.clone(), output.clone()),
        _ => return Err(CliError::Usage("name a scene, and a folder with -o".to_owned())),
    };
    let reach = match &earlier {
        Some(earlier) => arguments.reach.or(earlier.allows_outside()?),
        None => arguments.reach,
    };
    let prepares = trace.span(Track::Host, "load and build the scene");
    let mut prepared = prepare_with_progress(&scene, reach)?;
    drop(prepares);
    let guards = trace.span(Track::Host, "look for what is probably wrong");
    guard(&mut prepared, Effort::BRIEF);
    drop(guards);
    let fresh = if earlier.is_none() { Some(Folder::new(&root, &FILES)) } else { None };
    if let Some(folder) = &fresh {
        folder.keep_inputs(&prepared.scene.files)?;
    }
    for path in [&arguments.trace, &arguments.save_state, &arguments.mcap].into_iter().flatten() {
        keep_inputs(path, prepared.scene.files.iter().chain(&arguments.from_state))?;
    }
    let at = thermal_state::step_of_state(arguments.save_state_at, &prepared.scene.time)?;
    let take_after = arguments.save_state.as_ref().map(|_| at);
    video::check(&prepared.scene.images)?;
    let camera = prepared.scene.camera.as_ref().filter(|_| prepared.scene.time.draw != Draw::None);
    let device = match (&arguments.device.device, &earlier) {
        (None, Some(earlier)) => DeviceArguments { device: Some(earlier.device()?) },
        (given, _) => DeviceArguments { device: given.clone() },
    };
    let chosen = device.open()?;
    let with_check = matches!(chosen, Target::Device(_));
    if arguments.check.is_some() && !with_check {
        say!("nothing to check: this run is the f64 reference itself");
    }
    let sample = match &earlier {
        Some(earlier) => earlier.check()?,
        // The reference would read the same file.
        None => (with_check && prepared.given.is_none())
            .then(|| arguments.check.flatten().map_or(SAMPLE, |nodes| nodes as usize)),
    };
    let command_line = match &earlier {
        Some(earlier) => earlier.command_line()?,
        None => command_line(),
    };
    let identity = identity(&prepared, &scene, reach, &chosen, sample, &command_line);
    if let Some(earlier) = &earlier {
        earlier.compare(&identity)?;
    }
    let begin = arguments.from_state.as_ref().map(|path| thermal_state::read(path, &prepared, &chosen)).transpose()?;
    let device_data = DeviceData::new(&prepared);
    let data = device_data.scene_data(&prepared, camera);
    let plan = data.plan();
    say_size(&prepared, &plan, &chosen);
    if let Target::Device(context) = &chosen {
        let of_network = prepared.network_bytes(&plan);
        check_plan(context, &plan, of_network.device + of_network.host, data.image)?;
    }
    let (folder, state) = match (earlier, fresh) {
        (Some(earlier), _) => {
            earlier.folder.make_folders()?;
            (earlier.folder, Some(earlier.state))
        }
        (None, folder) => {
            let folder = folder.unwrap_or_else(|| Folder::new(&root, &FILES));
            (folder.prepare(arguments.force, &prepared.scene.files)?, None)
        }
    };
    let forecast = Forecast::of(&prepared);
    let forecast = if begin.is_some() { forecast.without_warm_up() } else { forecast };
    say!("{}", forecast.sentence(Rate::of(&chosen)));
    let stop = stop_flag();
    let mut engine = chosen.engine(&prepared, camera)?;
    engine.record(trace.clone());
    let start_up_s = began.elapsed().as_secs_f64();

    let time = &prepared.scene.time;
    let bars = [
        progress_bar(if forecast.warm_up_is_most { 0 } else { forecast.warm_up }, "warm-up"),
        progress_bar(u64::from(time.steps) + 1, "steps"),
        progress_bar(forecast.images, "pictures"),
    ];
    let job = Job {
        check: sample,
        save_every: arguments.save_every,
        identity: &identity,
        earlier: state.as_ref(),
        begin: begin.as_ref(),
        take_after,
    };
    let outcome = run_into(&prepared, &mut *engine, &folder, &job, &stop, &|done: Done| bars[done as usize].inc(1));
    bars.iter().for_each(ProgressBar::finish_and_clear);
    let outcome = outcome?;
    if let (Some(destination), Some(state)) = (&of_state, &outcome.state) {
        destination.write_bytes(&encode(state))?;
    }
    if let Some(log) = &log {
        let span = trace.span(Track::Host, "MCAP");
        log.write(|writer| mcap::write(writer, &folder, &outcome.frames, prepared.scene.time.start))?;
        drop(span);
    }
    if begin.is_some() && sample.is_some() && outcome.accuracy.is_none() {
        say!(
            "warning: nothing was compared with the f64 reference: the state was saved without it, or with another --check"
        );
    }

    let buffers =
        plan.iter().map(|planned| BufferSize { name: format!("{:?}", planned.resource), bytes: planned.bytes });
    let wall_s = outcome.wall_before_s + began.elapsed().as_secs_f64();
    let report = Report {
        buffers: if with_check { buffers.collect() } else { Vec::new() },
        speed: speed(&prepared, &*engine, &outcome, wall_s),
        command_line,
        ..report(&prepared, &plan, &chosen, &mut *engine, outcome, start_up_s)
    };
    folder.write_json(REPORT_JSON, &report)?;
    folder.write_bytes(REPORT_HTML, report_html::page(&report).as_bytes())?;
    if let Some(timeline) = &timeline {
        timeline.write_bytes(trace.json().to_string().as_bytes())?;
    }
    if !report.interrupted {
        folder.finish()?;
    }
    print_summary(&report, &folder);
    check_validation(&chosen)?;
    if report.interrupted { Err(CliError::StoppedRun(root)) } else { Ok(()) }
}

/// Cost of a step and of an image: the median of each pass, weighted by how often it ran.
fn speed(prepared: &Prepared, engine: &dyn Engine, outcome: &Outcome, wall_s: f64) -> Speed {
    let passes = pass_times(engine);
    let steps = engine.steps();
    let images = outcome.frames.len() as u64;
    let mean = |of_kind: &dyn Fn(&str) -> bool, runs: u64| {
        let times = passes.iter().filter(|pass| of_kind(&pass.name)).map(|pass| pass.median_ms * pass.count as f64);
        (runs > 0 && !passes.is_empty()).then(|| times.sum::<f64>() / runs as f64)
    };
    let costs = &outcome.network_costs;
    let median = |samples: Vec<f64>| PassTime::from_samples("network", &samples).map(|time| time.median_ms);
    let network_ms = median(costs.iter().filter_map(|cost| cost.device_ms).collect());
    let network_wall_ms = median(costs.iter().map(|cost| cost.wall_ms).collect());
    // A dispatch of many steps is not a single step.
    let step_ms =
        mean(&|name| name.starts_with("thermal_step.") || name.starts_with("one_pass"), steps - engine.fused_steps())
            .map(|ms| network_ms.map_or(network_wall_ms.unwrap_or(ms), |network| ms + network))
            // Temperatures of a file take no thermal step.
            .filter(|_| prepared.given.is_none());
    let of_image = |name: &str| {
        ["cull", "radiance", "read radiance", "read identity", COPIED, READ].contains(&name)
            || name.starts_with("sensor_")
    };
    Speed {
        steps,
        images,
        ns_per_node_step: step_ms.map(|ms| ms * 1e6 / prepared.nodes.count.max(1) as f64),
        step_ms,
        network_ms,
        network_wall_ms,
        image_ms: mean(&of_image, images),
        wall_s,
    }
}

/// Name of the parts of a step's cost.
const COST: &str = "device time of a step [ns a node]";

/// The settings and integration of the thermal network.
fn network_section(prepared: &Prepared, engine: &mut dyn Engine) -> Option<SettingGroup> {
    let network = prepared.network.as_ref()?;
    let mut entries: Vec<_> = network.description().into_iter().chain(engine.network_description()).collect();
    let cost = step_cost(&pass_times(engine), engine.steps(), prepared.nodes.count);
    if !cost.is_empty() {
        entries.push((COST.to_owned(), cost));
    }
    Some(SettingGroup { title: "Thermal network".to_owned(), entries })
}

fn pass_times(engine: &dyn Engine) -> Vec<PassTime> {
    let times = engine.pass_times().into_iter().flatten();
    let of = |(name, samples): (&String, &Samples<f64>)| {
        PassTime::from_samples(name, samples).map(|time| PassTime { count: samples.count(), ..time })
    };
    times.filter_map(of).collect()
}

fn report(
    prepared: &Prepared,
    plan: &[Planned],
    chosen: &Target,
    engine: &mut dyn Engine,
    outcome: Outcome,
    start_up_s: f64,
) -> Report {
    let device = match chosen {
        Target::Device(context) => Device {
            name: context.info.name.clone(),
            driver: context.info.driver.clone(),
            details: vec![
                ("Vulkan".to_owned(), context.info.api_version.clone()),
                ("start-up".to_owned(), format!("{start_up_s:.2} s")),
                ("stepping and drawing".to_owned(), format!("{:.2} s", outcome.stepping_s)),
            ],
        },
        Target::Reference => Device { name: chosen.name(), ..Device::default() },
    };
    let kind = |number: usize, path: &Path| match number {
        0 => "scene",
        1 => "model",
        _ if prepared.scene.materials.table() == Some(path) => "materials",
        _ if prepared.scene.sky_files.iter().any(|known| known == path) => "trajectory or attitude",
        _ => "response table",
    };
    let mut inputs = prepared.scene.files.iter().enumerate().map(|(number, path)| SourceFile {
        kind: kind(number, path).to_owned(),
        path: path.display().to_string(),
        sha256: prepared.file_hashes.get(path).cloned().unwrap_or_default(),
    });
    let scene = SourceFile { sha256: prepared.hash.clone(), ..inputs.next().unwrap_or_default() };
    let mut nodes_by_response: Vec<(String, u64)> = Vec::new();
    for (kind, nodes) in prepared.nodes.by_kind() {
        nodes_by_response.push((kind.to_string(), nodes as u64));
    }
    let files = [
        (true, SERIES, "temperatures over time"),
        (true, REPORT_JSON, "this report as JSON"),
        (prepared.joints() > 1, JOINTS, "joints over time"),
        (!outcome.frames.is_empty(), "frames/", "EXR and PNG of every image"),
        (prepared.scene.time.draw.is_between_steps(), IMAGES, "time and pose of every image"),
        (!outcome.plots.is_empty(), "plots/", "the plots as SVG"),
    ];
    let files = files.into_iter().filter(|(there, ..)| *there);
    let memory = chosen.device().map(|_| device_memory(prepared, plan));
    let forecast = Forecast::of(prepared).entries(&[Rate::of(chosen)], memory);
    let forecast = SettingGroup { title: "Forecast before the first step".to_owned(), entries: forecast };
    let mut warnings = prepared.warnings.clone();
    let mut details_of_run = Vec::new();
    if let Some(periodic) = outcome.periodic {
        say!("warm-up: {}", periodic.summary());
        details_of_run.push(("periodic warm-up".to_owned(), periodic.summary()));
    }
    if let Some(error) = outcome.between {
        let error = format!("up to {error:.1e} K (an eighth of the second difference over the steps beside an image)");
        answer!("temperatures between steps are off by {error}");
        details_of_run.push(("temperatures of images between steps".to_owned(), format!("off by {error}")));
    }
    let missed = outcome.periodic.and_then(|periodic| periodic.warning(""));
    let off = outcome.accuracy.as_ref().and_then(|accuracy| accuracy.warning(prepared));
    let network = network_section(prepared, engine);
    let entries = engine.exchange_description();
    let exchange = (!entries.is_empty())
        .then(|| SettingGroup { title: "Radiation between surfaces, as found".to_owned(), entries });
    let said = |name: &str| network.iter().flat_map(|group| &group.entries).find(|(entry, _)| entry == name);
    if let Some((name, value)) = said(ESTIMATED) {
        say!("network in one pass: {name} {value}");
    }
    if let Some((name, value)) = said(COST) {
        say!("{name}: {value}");
    }
    let beyond = said(BEYOND).map(|(_, value)| format!("the network in one pass: {value}"));
    for warning in missed.into_iter().chain(off).chain(beyond) {
        say!("warning: {warning}");
        warnings.push(warning);
    }
    let device = Device { details: device.details.into_iter().chain(details_of_run).collect(), ..device };
    Report {
        title: prepared.scene.name.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene,
        inputs: inputs.collect(),
        device,
        accuracy: outcome.accuracy,
        energy: outcome.energy,
        model: ModelSize {
            nodes: prepared.nodes.count as u64,
            triangles: prepared.triangle_count() as u64,
            area_m2: prepared.area,
            nodes_by_response,
        },
        passes: pass_times(engine),
        settings: settings::groups(prepared).into_iter().chain(network).chain(exchange).chain([forecast]).collect(),
        assumptions: prepared.scene.assumptions.clone(),
        warnings,
        switched_off: prepared.switched_off(),
        frames: outcome.frames,
        pictures: outcome.pictures,
        plots: outcome.plots,
        files: files.map(|(_, path, what)| FileEntry { path: path.to_owned(), what: what.to_owned() }).collect(),
        interrupted: !outcome.complete,
        ..Report::default()
    }
}

fn print_summary(report: &Report, folder: &Folder) {
    let speed = &report.speed;
    answer!("{} steps and {} images in {:.1} s on {}", speed.steps, speed.images, speed.wall_s, report.device.name);
    if let (Some(step), Some(node)) = (speed.step_ms, speed.ns_per_node_step) {
        answer!("a thermal step takes {step:.2} ms, {node:.2} ns a node");
        match (speed.network_ms, speed.network_wall_ms) {
            (Some(own), Some(wall)) => answer!(
                "the passes of the thermal network take {own:.2} ms of it; their wall time is {wall:.2} ms, loads, transfers and \
                 control included"
            ),
            (None, Some(_)) => answer!("that is the wall time of the thermal network, which the processor integrates"),
            (_, None) => {}
        }
    }
    if let Some(accuracy) = &report.accuracy {
        answer!(
            "against the f64 reference: largest difference {:.1e} K, rms {:.1e} K ({} nodes, {} steps)",
            accuracy.max_k,
            accuracy.rms_k,
            accuracy.nodes,
            accuracy.steps
        );
        if let Some(error) = &accuracy.step_length {
            answer!(
                "error of the step length: at most {:.1e} K, rms {:.1e} K ({} nodes that store heat, twice the difference to steps of half the length)",
                error.max_k,
                error.rms_k,
                error.nodes
            );
        }
        for note in &accuracy.notes {
            answer!("{note}");
        }
    }
    if let Some(closure) = report.energy.as_ref().and_then(|energy| energy.closure) {
        answer!("the energy balance of the network closes to {closure:.1e}");
    }
    answer!("report: {}", folder.file(REPORT_HTML).display());
}
