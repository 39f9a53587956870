//! `isotherm run`: runs a scene and writes images, plots and a report.

use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::ProgressBar;

use super::device::{DeviceArguments, check_validation};
use super::error::CliError;
use super::progress::{building_bar, progress_bar, show_stage, stop_flag};
use crate::gpu::resources::{Planned, check_plan, device_bytes};
use crate::output::folder::{Folder, check_writable, keep_inputs, write_bytes, write_json};
use crate::output::job::{Done, FILES, JOINTS, Outcome, REPORT_HTML, REPORT_JSON, SERIES, run_into};
use crate::output::report::{
    BufferSize, Device, FileEntry, ModelSize, PassTime, Report, SettingGroup, SourceFile, Speed,
};
use crate::output::{report_html, settings};
use crate::scene::Draw;
use crate::simulation::check::SAMPLE;
use crate::simulation::device_data::DeviceData;
use crate::simulation::engine::Engine;
use crate::simulation::is_drawn;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::trace::{Trace, Track};

/// Run a scene: write temperatures, images, plots and a report.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm run models/station.toml -o out/station\n  \
isotherm run models/station.toml -o out/reference --device cpu\n  \
isotherm run models/station.toml -o out/checked --check=5000\n  \
isotherm run models/station.toml -o out/traced --trace out/traced.json")]
pub struct Arguments {
    /// Scene file (TOML, described in docs/scene.md)
    scene: PathBuf,
    /// Output folder, which must be empty or absent
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Overwrite isotherm's own files in the output folder
    #[arg(long)]
    force: bool,
    /// Number of nodes to compare with the f64 reference [default on a device: 256]. The report states the error beside
    /// the speed. More nodes take longer. Networks of up to 100,000 nodes are compared as a whole
    #[arg(long, value_name = "NODES", require_equals = true, value_parser = clap::value_parser!(u32).range(1..))]
    check: Option<Option<u32>>,
    /// Write a timeline of host and device for ui.perfetto.dev or chrome://tracing
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArguments,
}

/// Loads a scene and prints its warnings.
pub(super) fn prepare_with_progress(path: &Path) -> Result<Prepared, CliError> {
    let bar = building_bar();
    let prepared = Prepared::new(path, &mut |stage| show_stage(&bar, stage));
    bar.finish_and_clear();
    let prepared = prepared?;
    for warning in &prepared.warnings {
        eprintln!("warning: {warning}");
    }
    for assumption in &prepared.scene.assumptions {
        eprintln!("assumed: {assumption}");
    }
    Ok(prepared)
}

/// Prints the number of nodes and triangles, and their memory on the device.
pub(super) fn say_size(prepared: &Prepared, plan: &[Planned], chosen: &Target) {
    let nodes = prepared.nodes.count;
    eprintln!("{}: {nodes} nodes, {} triangles on {}", prepared.scene.name, prepared.triangle_count(), chosen.name());
    if let Target::Device(context) = chosen {
        let of_network = prepared.network_bytes(plan);
        let all = plan.iter().map(|planned| planned.bytes).sum::<u64>() + of_network.device + of_network.host;
        let of_nodes = device_bytes(plan) + of_network.device;
        eprintln!(
            "device memory: {:.1} bytes a node; {:.1} MiB in all, with images and what the host reads, of {} MiB free",
            of_nodes as f64 / nodes.max(1) as f64,
            all as f64 / f64::from(1 << 20),
            context.free_memory() >> 20
        );
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let began = Instant::now();
    let trace = match &arguments.trace {
        Some(path) => {
            check_writable(path)?;
            Trace::recording()
        }
        None => Trace::default(),
    };
    let prepares = trace.span(Track::Host, "load and build the scene");
    let prepared = prepare_with_progress(&arguments.scene)?;
    drop(prepares);
    let folder = Folder::new(&arguments.output, &FILES);
    folder.keep_inputs(&prepared.scene.files)?;
    if let Some(path) = &arguments.trace {
        keep_inputs(path, &prepared.scene.files)?;
    }
    let camera = prepared.scene.camera.as_ref().filter(|_| prepared.scene.time.draw != Draw::None);
    let chosen = arguments.device.open()?;
    let device_data = DeviceData::new(&prepared);
    let data = device_data.scene_data(&prepared, camera);
    let plan = data.plan();
    say_size(&prepared, &plan, &chosen);
    if let Target::Device(context) = &chosen {
        let of_network = prepared.network_bytes(&plan);
        check_plan(context, &plan, of_network.device + of_network.host, data.image)?;
    }
    let folder = folder.prepare(arguments.force, &prepared.scene.files)?;
    let stop = stop_flag();
    let mut engine = chosen.engine(&prepared, camera)?;
    engine.record(trace.clone());
    let start_up_s = began.elapsed().as_secs_f64();

    let time = &prepared.scene.time;
    let images = (0..=time.steps).filter(|step| is_drawn(&time.draw, *step)).count() as u64;
    let bars = [
        progress_bar(u64::from(prepared.warm_up_steps()), "warm-up"),
        progress_bar(u64::from(time.steps) + 1, "steps"),
        progress_bar(images, "pictures"),
    ];
    let with_check = matches!(chosen, Target::Device(_));
    if arguments.check.is_some() && !with_check {
        eprintln!("nothing to check: this run is the f64 reference itself");
    }
    let sample = with_check.then(|| arguments.check.flatten().map_or(SAMPLE, |nodes| nodes as usize));
    let outcome = run_into(&prepared, &mut *engine, &folder, sample, &stop, &|done: Done| bars[done as usize].inc(1));
    bars.iter().for_each(ProgressBar::finish_and_clear);
    let outcome = outcome?;

    let buffers =
        plan.iter().map(|planned| BufferSize { name: format!("{:?}", planned.resource), bytes: planned.bytes });
    let report = Report {
        buffers: if with_check { buffers.collect() } else { Vec::new() },
        speed: speed(&prepared, &*engine, &outcome, began.elapsed().as_secs_f64()),
        ..report(&prepared, &chosen, &*engine, outcome, start_up_s)
    };
    write_json(&folder.file(REPORT_JSON), &report)?;
    write_bytes(&folder.file(REPORT_HTML), report_html::page(&report).as_bytes())?;
    if let Some(path) = &arguments.trace {
        write_bytes(path, trace.json().to_string().as_bytes())?;
    }
    print_summary(&report, &folder);
    check_validation(&chosen)?;
    if report.interrupted { Err(CliError::Stopped(arguments.output.clone())) } else { Ok(()) }
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
    let step_ms = mean(&|name| name.starts_with("thermal_step."), steps - engine.fused_steps())
        .map(|ms| network_ms.map_or(network_wall_ms.unwrap_or(ms), |network| ms + network));
    let of_image = |name: &str| ["cull", "radiance", "read radiance", "read identity"].contains(&name);
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

/// The settings and integration of the thermal network.
fn network_section(prepared: &Prepared, engine: &dyn Engine) -> Option<SettingGroup> {
    let network = prepared.network.as_ref()?;
    let entries = network.description().into_iter().chain(engine.network_description()).collect();
    Some(SettingGroup { title: "Thermal network".to_owned(), entries })
}

fn pass_times(engine: &dyn Engine) -> Vec<PassTime> {
    let times = engine.pass_times().into_iter().flatten();
    times.filter_map(|(name, samples)| PassTime::from_samples(name, samples)).collect()
}

fn report(prepared: &Prepared, chosen: &Target, engine: &dyn Engine, outcome: Outcome, start_up_s: f64) -> Report {
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
        (!outcome.frames.is_empty(), "frames/", "EXR and PNG of every drawn step"),
        (!outcome.plots.is_empty(), "plots/", "the plots as SVG"),
    ];
    let files = files.into_iter().filter(|(there, ..)| *there);
    let mut warnings = prepared.warnings.clone();
    let mut details_of_warm_up = Vec::new();
    if let Some(periodic) = outcome.periodic {
        let coarse = match periodic.coarse {
            0 => String::new(),
            coarse => format!(" ({coarse} of them coarse)"),
        };
        let went = format!(
            "{} orbits{coarse}, the last of which changed no node by more than {:.1e} K",
            periodic.orbits, periodic.change
        );
        eprintln!("warm-up: {went}");
        if !periodic.is_met() {
            warnings.push(format!("The warm-up did not become periodic within {} K: {went}.", periodic.tolerance));
        }
        details_of_warm_up.push(("periodic warm-up".to_owned(), went));
    }
    let device = Device { details: device.details.into_iter().chain(details_of_warm_up).collect(), ..device };
    Report {
        title: prepared.scene.name.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command_line: std::env::args().collect::<Vec<_>>().join(" "),
        scene,
        inputs: inputs.collect(),
        device,
        accuracy: outcome.accuracy,
        model: ModelSize {
            nodes: prepared.nodes.count as u64,
            triangles: prepared.triangle_count() as u64,
            area_m2: prepared.area,
            nodes_by_response,
        },
        passes: pass_times(engine),
        settings: settings::groups(prepared).into_iter().chain(network_section(prepared, engine)).collect(),
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
    println!("{} steps and {} images in {:.1} s on {}", speed.steps, speed.images, speed.wall_s, report.device.name);
    if let (Some(step), Some(node)) = (speed.step_ms, speed.ns_per_node_step) {
        println!("a thermal step takes {step:.2} ms, {node:.2} ns a node");
        match (speed.network_ms, speed.network_wall_ms) {
            (Some(own), Some(wall)) => println!(
                "of it {own:.2} ms are the passes of the thermal network, whose wall time is {wall:.2} ms with loads, \
                 transfers and control"
            ),
            (None, Some(_)) => println!("that is the wall time of the thermal network, which the processor integrates"),
            (_, None) => {}
        }
    }
    if let Some(accuracy) = &report.accuracy {
        println!(
            "against the f64 reference: largest difference {:.1e} K, rms {:.1e} K ({} nodes, {} steps)",
            accuracy.max_k, accuracy.rms_k, accuracy.nodes, accuracy.steps
        );
        for note in &accuracy.notes {
            println!("{note}");
        }
    }
    println!("report: {}", folder.file(REPORT_HTML).display());
}
