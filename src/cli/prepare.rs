//! Loads a scene for a command, and prints its warnings, its assumptions and the size of the work before it runs.

use std::path::Path;

use super::error::CliError;
use super::progress::{building_bar, show_stage};
use super::reach::ReachArguments;
use crate::gpu::plan::{Planned, device_bytes};
use crate::guard;
use crate::guard::finding::{CheckEffort, Finding, short};
use crate::guard::neighbours::{self, NAMED_IN_REPORT};
use crate::output::console::say;
use crate::scene::Scene;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::trace::span;

/// Loads a scene and prints its warnings.
pub(super) fn prepare_with_progress(path: &Path, reach: ReachArguments) -> Result<Prepared, CliError> {
    let scene = {
        let _reads = span("reading the scene");
        reach.scene(path)?
    };
    prepare_scene(scene)
}

/// Prepares a scene and prints its warnings.
pub(super) fn prepare_scene(scene: Scene) -> Result<Prepared, CliError> {
    let bar = building_bar();
    let mut work = None;
    let prepared = Prepared::from_scene(scene, &mut |stage| {
        show_stage(&bar, stage);
        // One stage ends before the next one begins.
        drop(work.take());
        work = Some(span(stage.work()));
    });
    drop(work);
    bar.finish_and_clear();
    let prepared = prepared?;
    say_notes(&prepared);
    Ok(prepared)
}

/// Prints the warnings and the assumptions of a scene.
pub(super) fn say_notes(prepared: &Prepared) {
    for warning in &prepared.warnings {
        say!("warning: {warning}");
    }
    for assumption in &prepared.scene.assumptions {
        say!("assumed: {assumption}");
    }
}

/// Prints the probable mistakes in a scene, and keeps them for the report.
pub(super) fn guard(prepared: &mut Prepared, effort: CheckEffort) {
    let _looks = span("looking for mistakes");
    let checked = guard::check(prepared, effort);
    checked.findings.iter().for_each(|finding| say!("warning: {finding}"));
    // The report has place for more pairs of neighbours than a line on the console.
    let pairs = neighbours::check(prepared, &checked.neighbours, NAMED_IN_REPORT);
    let others = checked.findings.iter().filter(|finding| finding.check != "contacts");
    prepared.warnings.extend(others.chain(&pairs).map(Finding::to_string));
}

/// Memory of a run on the device, with images and with the buffers that the host reads [bytes].
pub(super) fn device_memory(plan: &[Planned]) -> u64 {
    plan.iter().map(|planned| planned.bytes).sum()
}

/// Prints the size of the craft, the number of nodes and triangles, and their memory on the device.
pub(super) fn say_size(prepared: &Prepared, plan: &[Planned], chosen: &Target) {
    let nodes = prepared.nodes.count;
    let [low, high] = guard::bounds(prepared);
    let [x, y, z] = (high - low).to_array().map(short);
    let (name, triangles) = (&prepared.scene.name, prepared.triangle_count());
    say!("{name}: {x} x {y} x {z} m, {nodes} nodes, {triangles} triangles on {}", chosen.name());
    if let Target::Device(context) = chosen {
        let all = device_memory(plan);
        let of_nodes = device_bytes(plan);
        say!(
            "device memory: {:.1} bytes a node; {:.1} MiB in all, images and buffers for the host included, of {} MiB free",
            of_nodes as f64 / nodes.max(1) as f64,
            all as f64 / f64::from(1 << 20),
            context.free_memory() >> 20
        );
    }
}
