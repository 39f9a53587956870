//! `isotherm info`: describes the devices, a scene or a model.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::device::DeviceArguments;
use super::error::CliError;
use super::prepare::{device_memory, guard, prepare_with_progress};
use super::reach::ReachArguments;
use super::{info_network, info_scene};
use crate::gpu::context;
use crate::gpu::effects::exchange::tables::ExchangeTables;
use crate::gpu::frame::{Frame, compose};
use crate::gpu::pass::ListEntry;
use crate::gpu::plan::{Planned, device_bytes};
use crate::gpu::scene_frames::SceneFrames;
use crate::guard::finding::CheckEffort;
use crate::model::Model;
use crate::output::console::answer;
use crate::output::console::say;
use crate::output::settings::lens_lines;
use crate::scene::Draw;
use crate::simulation::device_data::DeviceData;
use crate::simulation::exchange::describe;
use crate::simulation::forecast::Forecast;
use crate::simulation::joints;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareError;
use crate::simulation::target::Target;
use crate::text::plain_json;

/// Describe the devices, a scene or a model.
///
/// Without a file: the Vulkan devices, their limits and missing features. With a scene (.toml): its passes and
/// barriers, nodes, bytes, and the effects that it switches off. With a model (.glb, .gltf): triangles, areas,
/// materials and parts.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isotherm info\n  isotherm info models/station.toml\n  \
isotherm info models/station.glb --json\n  isotherm info models/station.glb --scene\n  isotherm info models/cubesat_conduction.toml --network network/")]
pub(crate) struct Arguments {
    /// Scene or model
    file: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print a scene of a model to begin with
    #[arg(long, requires = "file", conflicts_with_all = ["json", "network"])]
    scene: bool,
    /// Write the thermal network of a scene into a folder, as a network file and as CSV, and print nothing else
    #[arg(long, value_name = "FOLDER", requires = "file", conflicts_with = "json")]
    network: Option<PathBuf>,
    /// Replace the files of an earlier --network in the folder
    #[arg(long, requires = "network")]
    force: bool,
    #[command(flatten)]
    reach: ReachArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let (Some(scene), Some(output)) = (&arguments.file, &arguments.network) {
        return info_network::write(scene, output, arguments.force, arguments.reach);
    }
    let (value, text) = match &arguments.file {
        None => devices(&arguments.device)?,
        Some(path)
            if !arguments.scene && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) =>
        {
            scene(path, arguments.reach)?
        }
        Some(path) => model(path, arguments)?,
    };
    if arguments.json {
        answer!("{}", plain_json(&format!("{value:#}")));
    } else {
        answer!("{}", text.trim_end());
    }
    Ok(())
}

/// All devices, or the named one.
fn devices(wanted: &DeviceArguments) -> Result<(serde_json::Value, String), CliError> {
    let devices = match wanted.device {
        None => context::devices()?,
        Some(_) => match wanted.open()? {
            Target::Device(context) => vec![context.info.clone()],
            Target::Reference => Vec::new(),
        },
    };
    let mut text = String::new();
    for (number, device) in devices.iter().enumerate() {
        let verdict = match (device.lacks.is_empty(), number) {
            (true, 0) => "usable, the default".to_owned(),
            (true, _) => "usable".to_owned(),
            (false, _) => device.lacks.join(", "),
        };
        text.push_str(&format!(
            "{}\n  kind                      {}\n  driver                    {}\n  Vulkan                    {}\n  \
             memory                    {} MiB\n  storage buffer range      {} MiB\n  workgroups a dispatch     {}\n  \
             largest image side        {}\n  corners placed to         1/{} pixel\n  timestamp                 {} ns\n  verdict                   {}\n",
            device.name,
            device.kind,
            device.driver,
            device.api_version,
            device.memory >> 20,
            device.max_storage_buffer_range >> 20,
            device.max_workgroups,
            device.max_framebuffer_side,
            1u64 << device.sub_pixel_bits.min(63),
            device.timestamp_period,
            verdict,
        ));
    }
    text.push_str("cpu\n  the f64 reference: slow, simple, trusted (--device cpu)\n");
    Ok((json!({ "version": env!("CARGO_PKG_VERSION"), "devices": devices }), text))
}

fn model(path: &Path, arguments: &Arguments) -> Result<(serde_json::Value, String), CliError> {
    let summary = Model::load_within(path, &arguments.reach.of(path)).map_err(PrepareError::from)?.summary();
    if arguments.scene {
        return Ok((
            serde_json::Value::Null,
            info_scene::text(path, summary.materials.iter().map(|material| material.name.as_str())),
        ));
    }
    // The JSON has fixed keys. The text prints remarks elsewhere.
    for note in summary.notes.iter().filter(|_| arguments.json) {
        say!("note: {note}");
    }
    let value = serde_json::to_value(&summary).unwrap_or_default();
    Ok((value, summary.to_string()))
}

fn scene(path: &Path, reach: ReachArguments) -> Result<(serde_json::Value, String), CliError> {
    let mut prepared = prepare_with_progress(path, reach)?;
    guard(&mut prepared, CheckEffort::NO_IMAGE);
    let camera = prepared.scene.camera.as_ref().filter(|_| prepared.scene.time.draw != Draw::None);
    let poses = prepared.loads.joints_at(0.0).1;
    let cast = prepared.exchange.as_ref().map(|craft| (craft, craft.cast(&poses)));
    let tables = cast.as_ref().map(|(_, exchange)| ExchangeTables::new(exchange, prepared.joints() > 1));
    let device_data = DeviceData::new(&prepared).with_exchange(tables);
    let data = device_data.scene_data(&prepared, camera);
    let frame = compose(&SceneFrames::new(&data).whole());
    let plan = data.plan();
    let bytes = device_memory(&plan);
    let forecast = Forecast::of(&prepared).entries(Some(bytes));
    let node_bytes = device_bytes(&plan);
    let a_node = node_bytes as f64 / prepared.nodes.count.max(1) as f64;
    let facts = SceneFacts {
        joints: joints::describe(&prepared.loads, &prepared.nodes),
        network: prepared.network.as_ref().map(|network| network.description()).unwrap_or_default(),
        exchange: cast.as_ref().map(|(craft, exchange)| describe(craft, exchange)).unwrap_or_default(),
        bytes,
        bytes_per_node: a_node,
        switched_off: prepared.switched_off(),
        prepared: &prepared,
        plan,
        frame,
        forecast,
    };
    Ok((facts.json(), facts.text()))
}

/// The facts that `isotherm info` tells about a scene.
struct SceneFacts<'a> {
    prepared: &'a Prepared,
    joints: Vec<joints::Description>,
    network: Vec<(String, String)>,
    exchange: Vec<(String, String)>,
    plan: Vec<Planned>,
    bytes: u64,
    bytes_per_node: f64,
    forecast: Vec<(String, String)>,
    frame: Frame,
    switched_off: Vec<String>,
}

impl SceneFacts<'_> {
    fn text(&self) -> String {
        let mut text = format!(
            "{}: {} nodes, {} triangles, {:.2} m2\n\nNodes by response\n",
            self.prepared.scene.name,
            self.prepared.nodes.count,
            self.prepared.triangle_count(),
            self.prepared.model.area
        );
        for (kind, nodes) in self.prepared.nodes.by_kind() {
            text.push_str(&format!("  {:<40} {nodes:>10}\n", kind.to_string()));
        }
        if !self.joints.is_empty() {
            text.push_str("\nJoints, at time 0\n");
        }
        for joint in &self.joints {
            text.push_str(&format!("  {:<40} {}\n", joint.name, joint.sentence()));
        }
        push_lines(&mut text, "\nThermal network\n", &self.network);
        push_lines(&mut text, "\nRadiation between surfaces\n", &self.exchange);
        if let Some(camera) = &self.prepared.scene.camera {
            text.push_str(&format!("\nCamera, {} x {} pixels\n", camera.width, camera.height));
            for (name, value) in lens_lines(camera) {
                text.push_str(&format!("  {name:<40} {value}\n"));
            }
        }
        push_lines(&mut text, "\nForecast of a run\n", &self.forecast);
        text.push_str("\nBytes on the device\n");
        for planned in &self.plan {
            text.push_str(&format!("  {:<40} {:>12}\n", format!("{:?}", planned.resource), planned.bytes));
        }
        text.push_str(&format!(
            "  {:<40} {:>12}\n  a node, triangles included, without images and readback: {:.1}\n\nFrame\n",
            "in all", self.bytes, self.bytes_per_node
        ));
        for line in self.frame.to_string().lines() {
            text.push_str(&format!("  {line}\n"));
        }
        text.push_str(&format!("\nSwitched off: {}\n", self.switched_off.join(", ")));
        text
    }

    fn json(&self) -> serde_json::Value {
        let steps: Vec<serde_json::Value> = self
            .frame
            .entries
            .iter()
            .map(|entry| match entry {
                ListEntry::Pass(pass) => json!({ "pass": pass.name }),
                ListEntry::Barriers(barriers) => json!({ "barriers": barriers.iter().map(|barrier| json!({
                    "resource": format!("{:?}", barrier.resource),
                    "before": format!("{:?}", barrier.before.stage),
                    "after": format!("{:?}", barrier.after.stage),
                })).collect::<Vec<_>>() }),
            })
            .collect();
        json!({
            "scene": self.prepared.scene.name,
            "nodes": self.prepared.nodes.count,
            "triangles": self.prepared.triangle_count(),
            "area_m2": self.prepared.model.area,
            "nodes_by_response": self.prepared.nodes.by_kind().iter()
                .map(|(kind, nodes)| json!({ "response": kind.to_string(), "nodes": nodes })).collect::<Vec<_>>(),
            "joints": self.joints,
            "bytes": self.bytes,
            "bytes_a_node": self.bytes_per_node,
            "merged": self.prepared.model.merged,
            "buffers": self.plan.iter().map(|planned| json!({
                "name": format!("{:?}", planned.resource), "bytes": planned.bytes })).collect::<Vec<_>>(),
            "frame": steps,
            "network": self.network.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
            "forecast": self.forecast.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
            "switched_off": self.switched_off,
        })
    }
}

/// Adds a title and a line for each name and value. Without lines it adds nothing.
fn push_lines(text: &mut String, title: &str, lines: &[(String, String)]) {
    if !lines.is_empty() {
        text.push_str(title);
    }
    for (name, value) in lines {
        text.push_str(&format!("  {name:<40} {value}\n"));
    }
}
