//! The report of a run, and its summary on the console.

use std::path::{Path, PathBuf};

use super::prepare::device_memory;
use crate::gpu::effects::sensor::{COPIED_FOR_SENSOR, READ};
use crate::gpu::plan::Planned;
use crate::gpu::samples::Samples;
use crate::output::console::{answer, say};
use crate::output::folder::Folder;
use crate::output::image_index::IMAGES;
use crate::output::job::{REPORT_HTML, REPORT_JSON, RunOutcome};
use crate::output::report::{
    FileEntry, HOW_TO_ASK, InputFile, ModelSize, PassTime, Report, ReportDevice, ReportFiles, ReportFindings,
    ReportSource, SettingGroup, Speed,
};
use crate::output::settings;
use crate::output::step_cost::step_cost;
use crate::output::tables::{BUDGET, JOINTS, SERIES};
use crate::simulation::engine::Engine;
use crate::simulation::forecast::Forecast;
use crate::simulation::network::{BEYOND, ESTIMATED};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// Cost of a step and of an image: the median of each pass, weighted by how often it ran.
pub(super) fn speed(prepared: &Prepared, engine: &dyn Engine, outcome: &RunOutcome, wall_s: f64) -> Speed {
    let passes = pass_times(engine);
    let steps = engine.steps();
    let images = outcome.frames.len() as u64;
    let mean = |of_kind: &dyn Fn(&str) -> bool, runs: u64| {
        let of_kind = passes.iter().filter(|pass| of_kind(&pass.name));
        // The sum of no times is -0.
        let whole = of_kind.map(|pass| pass.median_ms * pass.count as f64).fold(0.0, |sum, time| sum + time);
        (runs > 0 && !passes.is_empty()).then_some(whole / runs as f64)
    };
    let costs = &outcome.network_costs;
    let median = |samples: Vec<f64>| PassTime::from_samples("network", &samples).map(|time| time.median_ms);
    let network_wall_ms = median(costs.iter().map(|cost| cost.wall_ms).collect());
    // A dispatch of many steps is not a single step.
    let step_ms =
        mean(&|name| name.starts_with("thermal_step.") || name.starts_with("one_pass"), steps - engine.fused_steps())
            .map(|ms| network_wall_ms.unwrap_or(ms))
            // Temperatures of a file take no thermal step.
            .filter(|_| prepared.given.is_none());
    let of_image = |name: &str| {
        IMAGE_PASSES.contains(&name) || [COPIED_FOR_SENSOR, READ].contains(&name) || name.starts_with("sensor_")
    };
    Speed {
        steps,
        images,
        ns_per_node_step: step_ms.map(|ms| ms * 1e6 / prepared.nodes.count.max(1) as f64),
        step_ms,
        network_wall_ms,
        image_ms: mean(&of_image, images),
        wall_s,
        ..Speed::default()
    }
}

/// Passes of an image without its sensor.
const IMAGE_PASSES: [&str; 13] = [
    "cull",
    "radiance",
    "mean",
    "copy radiance",
    "copy identity",
    "copy mean",
    "copy surfaces",
    "traced",
    "gather",
    "resample",
    "distant",
    "read radiance",
    "read identity",
];

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
    let time = |(name, samples): (&String, &Samples<f64>)| {
        PassTime::from_samples(name, samples).map(|time| PassTime { count: samples.count(), ..time })
    };
    times.filter_map(time).collect()
}

/// The report of a run. The caller adds buffers, speed and command line.
pub(super) fn report(
    prepared: &Prepared,
    plan: &[Planned],
    chosen: &Target,
    engine: &mut dyn Engine,
    outcome: RunOutcome,
    start_up_s: f64,
) -> Report {
    let mut inputs = list_inputs(prepared).into_iter();
    let scene = inputs.next().unwrap_or_default();
    let files = list_files(prepared, &outcome);
    let memory = chosen.device().map(|_| device_memory(plan));
    let forecast = Forecast::of(prepared).entries(memory);
    let forecast = SettingGroup { title: "Forecast before the first step".to_owned(), entries: forecast };
    let mut warnings = prepared.warnings.clone();
    let device = describe_device(chosen, &outcome, start_up_s);
    let missed = outcome.periodic.and_then(|periodic| periodic.warning(""));
    let off = outcome.accuracy.as_ref().and_then(|accuracy| accuracy.warning(prepared));
    let off_range = outcome.range_warning();
    let network = network_section(prepared, engine);
    let entries = engine.exchange_description();
    let exchange = (!entries.is_empty())
        .then(|| SettingGroup { title: "Radiation between surfaces, as found".to_owned(), entries });
    let beyond = tell_network(network.as_ref());
    for warning in missed.into_iter().chain(off).chain(off_range).chain(beyond) {
        say!("warning: {warning}");
        warnings.push(warning);
    }
    Report {
        source: ReportSource {
            title: prepared.scene.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene,
            inputs: inputs.collect(),
            ..ReportSource::default()
        },
        device,
        findings: ReportFindings {
            pixel_error: outcome.pixel_error,
            accuracy: outcome.accuracy,
            energy: outcome.energy,
            budgets: outcome.budgets,
            sigma: outcome.sigma,
        },
        model: measure_model(prepared),
        passes: pass_times(engine),
        settings: settings::groups(prepared).into_iter().chain(network).chain(exchange).chain([forecast]).collect(),
        assumptions: prepared.scene.assumptions.clone(),
        warnings,
        switched_off: prepared.switched_off(),
        results: ReportFiles { frames: outcome.frames, pictures: outcome.pictures, plots: outcome.plots, files },
        interrupted: !outcome.complete,
        ..Report::default()
    }
}

/// The device of a run, with its times and its estimated errors.
fn describe_device(chosen: &Target, outcome: &RunOutcome, start_up_s: f64) -> ReportDevice {
    let mut device = match chosen {
        Target::Device(context) => ReportDevice {
            name: context.info.name.clone(),
            driver: context.info.driver.clone(),
            details: vec![
                ("Vulkan".to_owned(), context.info.api_version.clone()),
                ("start-up".to_owned(), format!("{start_up_s:.2} s")),
                ("stepping and drawing".to_owned(), format!("{:.2} s", outcome.stepping_s)),
            ],
        },
        Target::Reference => ReportDevice { name: chosen.name(), ..ReportDevice::default() },
    };
    if let Some(periodic) = outcome.periodic {
        say!("warm-up: {}", periodic.summary());
        device.details.push(("periodic warm-up".to_owned(), periodic.summary()));
    }
    if let Some(error) = outcome.between {
        let error = format!("up to {error:.1e} K (an eighth of the second difference over the steps beside an image)");
        answer!("temperatures between steps are off by {error}");
        device.details.push(("temperatures of images between steps".to_owned(), format!("off by {error}")));
    }
    device
}

/// The input files. The first is the scene.
fn list_inputs(prepared: &Prepared) -> Vec<InputFile> {
    let kind = |number: usize, path: &Path| match number {
        0 => "scene",
        1 => "model",
        _ if prepared.scene.materials.table() == Some(path) => "materials",
        _ if prepared.scene.sky_files.iter().any(|known| known == path) => "trajectory or attitude",
        _ => "response table",
    };
    let input = |(number, path): (usize, &PathBuf)| InputFile {
        kind: kind(number, path).to_owned(),
        path: path.display().to_string(),
        sha256: prepared.hashes.of_file(path),
    };
    let mut inputs: Vec<_> = prepared.scene.files.iter().enumerate().map(input).collect();
    if let Some(scene) = inputs.first_mut() {
        scene.sha256 = prepared.hashes.all.clone();
    }
    inputs
}

fn measure_model(prepared: &Prepared) -> ModelSize {
    let mut nodes_by_response: Vec<(String, u64)> = Vec::new();
    for (kind, nodes) in prepared.nodes.by_kind() {
        nodes_by_response.push((kind.to_string(), nodes as u64));
    }
    ModelSize {
        nodes: prepared.nodes.count as u64,
        triangles: prepared.triangle_count() as u64,
        area_m2: prepared.model.area,
        nodes_by_response,
    }
}

fn list_files(prepared: &Prepared, outcome: &RunOutcome) -> Vec<FileEntry> {
    let files = [
        (true, SERIES, "temperatures over time"),
        (true, REPORT_JSON, "this report as JSON"),
        (prepared.joints() > 1, JOINTS, "joints over time"),
        (prepared.scene.images.budget, BUDGET, "budget of each part over time"),
        (!outcome.frames.is_empty(), "frames/", "EXR and PNG of every image"),
        (prepared.scene.time.draw.is_between_steps(), IMAGES, "time and pose of every image"),
        (!outcome.plots.is_empty(), "plots/", "the plots as SVG"),
    ];
    let there = files.into_iter().filter(|(there, ..)| *there);
    there.map(|(_, path, what)| FileEntry { path: path.to_owned(), what: what.to_owned() }).collect()
}

/// Tells the cost and the errors of a network, and returns a warning about them.
fn tell_network(network: Option<&SettingGroup>) -> Option<String> {
    let said = |name: &str| network.into_iter().flat_map(|group| &group.entries).find(|(entry, _)| entry == name);
    if let Some((name, value)) = said(ESTIMATED) {
        say!("network in one pass: {name} {value}");
    }
    if let Some((name, value)) = said(COST) {
        say!("{name}: {value}");
    }
    said(BEYOND).map(|(_, value)| format!("the network in one pass: {value}"))
}

pub(super) fn print_summary(report: &Report, folder: &Folder) {
    let speed = &report.speed;
    answer!("{} steps and {} images in {:.1} s on {}", speed.steps, speed.images, speed.wall_s, report.device.name);
    if let (Some(step), Some(node)) = (speed.step_ms, speed.ns_per_node_step) {
        answer!("a thermal step takes {step:.2} ms, {node:.2} ns a node");
        if speed.network_wall_ms.is_some() {
            answer!("that is the wall time of the thermal network, which the processor integrates");
        }
    }
    match &report.findings.pixel_error {
        Some(error) => answer!(
            "error of a pixel's temperature, one standard deviation: rms {:.2e} K, p99 {:.2e} K, at most {:.2e} K ({} images)",
            error.rms_k,
            error.p99_k,
            error.max_k,
            error.images
        ),
        None if speed.images > 0 => answer!("error of a pixel's temperature: {HOW_TO_ASK}"),
        None => {}
    }
    let largest = report.findings.sigma.iter().flat_map(|sigma| &sigma.places);
    if let Some(largest) = largest.max_by(|a, b| a.sigma_k.total_cmp(&b.sigma_k)) {
        answer!(
            "uncertainty by the ranges of parameters, one standard deviation: at most {:.2} K ({} at {} s, most by {})",
            largest.sigma_k,
            largest.place,
            largest.time_s,
            largest.cause
        );
    }
    if let Some(accuracy) = &report.findings.accuracy {
        if accuracy.nodes > 0 {
            answer!(
                "rounding and implementation, against the f64 reference: largest difference {:.1e} K, rms {:.1e} K ({} nodes, {} steps)",
                accuracy.max_k,
                accuracy.rms_k,
                accuracy.nodes,
                accuracy.steps
            );
        }
        if let Some(error) = &accuracy.step_length {
            answer!(
                "error of the step length: at most {:.1e} K, rms {:.1e} K ({} nodes that store heat, {})",
                error.max_k,
                error.rms_k,
                error.nodes,
                error.measure
            );
        }
        for note in &accuracy.notes {
            answer!("{note}");
        }
    }
    if let Some(closure) = report.findings.energy.as_ref().and_then(|energy| energy.closure) {
        answer!("the energy balance of the network closes to {closure:.1e}");
    }
    answer!("report: {}", folder.file(REPORT_HTML).display());
}
