//! Plots of times against numbers of nodes or errors.

use super::frames::FrameRow;
use super::frontier::Frontier;
use super::integrators::Integrated;
use super::models::Models;
use super::record::Bench;
use super::responses::ResponseRow;
use super::truth::CaseSummary;
use crate::output::OutputError;
use crate::output::plot::{Mark, Plot, PlotLine};
use crate::output::plot_axis::Axis;
use crate::output::report::PlotEntry;

/// All plots of each device: responses, whole steps, model choices and integrator cases.
pub(crate) fn all(bench: &Bench) -> Result<Vec<PlotEntry>, OutputError> {
    let mut entries = Vec::new();
    for (number, measured) in (1..).zip(&bench.devices) {
        let names = [
            ("responses", "nanoseconds a node and step", responses(&measured.responses)),
            ("frames", "whole steps", frames(&measured.frames)),
            ("models", "choices of a model", measured.models.as_ref().and_then(models)),
            (
                "frontier",
                "milliseconds against kelvin",
                measured.models.as_ref().and_then(|models| frontier(&measured.frontier, models)),
            ),
        ];
        for (name, title, plot) in names {
            let Some(plot) = plot else { continue };
            let plot = Plot { subtitle: format!("{}; {}", measured.name, plot.subtitle), ..plot };
            entries.push(PlotEntry::new(&format!("{name}_{number}"), &format!("{}: {title}", measured.name), &plot)?);
        }
        for (integrated, case) in measured.integrators.iter().zip(&bench.cases) {
            let Some(plot) = work_precision(integrated, case) else { continue };
            let name = format!("work_precision_{number}_{}", case.key);
            entries.push(PlotEntry::new(&name, &format!("{}: {}", measured.name, case.title), &plot)?);
        }
    }
    Ok(entries)
}

fn push(lines: &mut Vec<PlotLine>, name: &str, point: [f64; 2]) {
    match lines.iter_mut().find(|line| line.name == name) {
        Some(line) => line.points.push(point),
        None => {
            lines.push(PlotLine {
                name: name.to_owned(),
                points: vec![point],
                mark: Mark::Joined,
                ..PlotLine::default()
            });
        }
    }
}

/// A logarithmic axis with a margin around the values.
fn around(label: &str, values: impl Iterator<Item = f64>) -> Axis {
    let ends = values.fold([f64::INFINITY, 0.0], |[least, most]: [f64; 2], value| [least.min(value), most.max(value)]);
    Axis { range: Some([0.85 * ends[0], ends[1] / 0.85]), ..Axis::logarithmic(label) }
}

/// A plot with logarithmic axes and these labels. `None` without points.
fn lines_of(title: String, subtitle: String, [x, y]: [&str; 2], series: Vec<PlotLine>) -> Option<Plot> {
    let points = || series.iter().flat_map(|line| line.points.iter());
    points().next()?;
    let (x, y) = (around(x, points().map(|point| point[0])), around(y, points().map(|point| point[1])));
    Some(Plot { title, subtitle, x, y, series, shaded: Vec::new() })
}

/// A line for each response over the number of nodes.
fn responses(rows: &[ResponseRow]) -> Option<Plot> {
    let mut lines = Vec::new();
    for row in rows {
        if let Some(time) = row.ns_a_node {
            push(&mut lines, &row.response, [row.nodes as f64, time.median]);
        }
    }
    let title = "What a node costs under each response".to_owned();
    let subtitle = "median of the passes by the device's clock, Sun, infrared and albedo on every node".to_owned();
    lines_of(title, subtitle, ["nodes", "time of a step [ns a node]"], lines)
}

/// Two lines for each scene, with and without shadows, over the number of nodes.
fn frames(rows: &[FrameRow]) -> Option<Plot> {
    let mut lines = Vec::new();
    for row in rows {
        let shadows = if row.shadows { "shadows" } else { "no shadows" };
        if let Some(time) = row.whole_step_ms {
            push(&mut lines, &format!("{}, {shadows}", row.scene), [row.nodes as f64, time.median]);
        }
        if let (Some(worst), true) = (row.worst_step_ms, row.shadows) {
            push(&mut lines, &format!("{}, {shadows}, worst", row.scene), [row.nodes as f64, worst]);
        }
    }
    let title = "A whole step: temperatures, shadows, and an image of 640 x 512 that the host has read".to_owned();
    let subtitle =
        "median time by the host's clock, with shadows the worst too; longest edges of 2 to 0.25 m".to_owned();
    lines_of(title, subtitle, ["nodes", "time of a step [ms]"], lines)
}

/// A point for each choice: cost against effect.
fn models(models: &Models) -> Option<Plot> {
    let mut lines = Vec::new();
    for row in &models.choices {
        if let (Some(cost), Some(moved)) = (row.step_ms, row.from_base)
            && moved.rms_k > 0.0
        {
            push(&mut lines, &row.choice, [cost, moved.rms_k]);
        }
    }
    let base = models.choices.first();
    let cost = base.and_then(|row| row.step_ms).map_or(String::new(), |ms| format!(", at {ms:.2} ms a step"));
    let title = format!("What each choice costs and changes: {}", models.scene);
    let subtitle = format!("{} nodes; against '{}'{cost}", models.nodes, base.map_or("", |row| &row.choice));
    let labels = ["thermal, shadow and network passes of a step [ms]", "change of temperature, rms [K]"];
    lines_of(title, subtitle, labels, lines)
}

/// A line for each response, over the light between parts: cost against error.
fn frontier(frontier: &Frontier, models: &Models) -> Option<Plot> {
    let mut lines = Vec::new();
    for row in frontier.rows.iter().rev() {
        if let (Some(cost), Some(error)) = (row.step_ms, row.error) {
            push(&mut lines, &row.response, [cost, error.rms]);
        }
    }
    let reference = frontier.reference.as_ref()?.as_ref().ok()?;
    let title = format!("Milliseconds against kelvin: {}", models.scene);
    let subtitle = format!(
        "{} nodes; lines run from no shadows over shadows to exchange; reference: {} finer, {} nodes, {:.0} ms a step",
        models.nodes,
        if reference.left.is_empty() { "all settings" } else { "most settings" },
        reference.nodes,
        reference.step_ms
    );
    let labels =
        ["thermal, shadow and network passes of a step [ms]", "error of pixels against finer settings, rms [K]"];
    lines_of(title, subtitle, labels, lines)
}

/// A line for each method, from its fastest run to its slowest.
fn work_precision(integrated: &Integrated, case: &CaseSummary) -> Option<Plot> {
    let mut lines = Vec::new();
    for run in &integrated.runs {
        let (Some(time), Some(error)) = (run.wall_ms, run.error) else { continue };
        push(&mut lines, &run.family, [time.median, error.rms]);
    }
    for line in &mut lines {
        line.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    let reference = case.reference_error.rms;
    let title = format!("Work and precision: {}", case.title);
    let subtitle =
        format!("{} nodes, in f64 on the processor; the reference itself is off by {reference:.0e} K rms", case.nodes);
    let x = format!("time of a frame of {:.1} s, median [ms]", case.frame_s);
    let plot = lines_of(title, subtitle, [&x, ""], lines)?;
    Some(Plot { y: Axis::logarithmic("error, rms over nodes and frames [K]"), ..plot })
}
