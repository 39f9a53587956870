//! What everything takes, against how many nodes there are or how wrong it is.

use super::record::{Bench, CaseSummary, FrameRow, Integrated, Measured, Models, Response};
use crate::output::OutputError;
use crate::output::plot::{Line, Mark, Plot};
use crate::output::plot_axis::Axis;

/// A diagram and the name of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagram {
    /// File without `.svg`.
    pub name: String,
    /// Title.
    pub title: String,
    /// SVG.
    pub svg: String,
}

/// For each device: responses, whole ticks, choices of a model, and every case of the integrators.
///
/// # Errors
/// [`OutputError::Encode`].
pub fn all(bench: &Bench) -> Result<Vec<Diagram>, OutputError> {
    let mut diagrams = Vec::new();
    for (number, measured) in bench.devices.iter().enumerate() {
        let own = [
            ("responses", "nanoseconds a node and step", responses(&measured.responses)),
            ("frames", "whole ticks", frames(&measured.frames)),
            ("models", "choices of a model", measured.models.as_ref().map(models)),
        ];
        for (name, title, plot) in own {
            let Some(plot) = plot.filter(|plot| !plot.series.is_empty()) else { continue };
            let plot = Plot { subtitle: format!("{}; {}", measured.name, plot.subtitle), ..plot };
            let title = format!("{}: {title}", measured.name);
            diagrams.push(Diagram { name: format!("{name}_{}", number + 1), title, svg: plot.svg()? });
        }
        for (integrated, case) in measured.integrators.iter().zip(&bench.cases) {
            let plot = work_precision(measured, integrated, case);
            if plot.series.is_empty() {
                continue;
            }
            let name = format!("work_precision_{}_{}", number + 1, case.key);
            diagrams.push(Diagram { name, title: format!("{}: {}", measured.name, case.title), svg: plot.svg()? });
        }
    }
    Ok(diagrams)
}

/// Adds a point to the line of a name.
fn push(lines: &mut Vec<Line>, name: &str, point: [f64; 2]) {
    match lines.iter_mut().find(|line| line.name == name) {
        Some(line) => line.points.push(point),
        None => {
            lines.push(Line { name: name.to_owned(), points: vec![point], mark: Mark::Joined, ..Line::default() });
        }
    }
}

/// An axis of logarithms on which no point lies at the edge.
fn around(label: &str, values: impl Iterator<Item = f64>) -> Axis {
    let ends = values.fold([f64::INFINITY, 0.0], |[least, most]: [f64; 2], value| [least.min(value), most.max(value)]);
    Axis { range: Some([0.85 * ends[0], ends[1] / 0.85]), ..Axis::logarithmic(label) }
}

/// A line for each response, over the number of nodes.
fn responses(rows: &[Response]) -> Option<Plot> {
    let mut lines = Vec::new();
    for row in rows {
        if let Some(time) = row.ns_a_node {
            push(&mut lines, &row.response, [row.nodes as f64, time.median]);
        }
    }
    let points = || lines.iter().flat_map(|line| line.points.iter());
    points().next()?;
    Some(Plot {
        title: "What a node costs under each response".to_owned(),
        subtitle: "median of the passes by the device's clock, Sun, infrared and albedo on every node".to_owned(),
        x: around("nodes", points().map(|point| point[0])),
        y: around("time of a step [ns a node]", points().map(|point| point[1])),
        series: lines,
        shaded: Vec::new(),
    })
}

/// A line for each scene with shadows and one without, over the number of nodes.
fn frames(rows: &[FrameRow]) -> Option<Plot> {
    let mut lines = Vec::new();
    for row in rows {
        let shadows = if row.shadows { "shadows" } else { "no shadows" };
        if let Some(time) = row.tick_ms {
            push(&mut lines, &format!("{}, {shadows}", row.scene), [row.nodes as f64, time.median]);
        }
        if let (Some(worst), true) = (row.worst_tick_ms, row.shadows) {
            push(&mut lines, &format!("{}, {shadows}, worst", row.scene), [row.nodes as f64, worst]);
        }
    }
    let points = || lines.iter().flat_map(|line| line.points.iter());
    points().next()?;
    Some(Plot {
        title: "A whole tick: step, shadows, image of 640 x 512 and its way to the host".to_owned(),
        subtitle: "median tick, with shadows the worst too, at longest edges of 2 to 0.25 m, by the host's clock"
            .to_owned(),
        x: around("nodes", points().map(|point| point[0])),
        y: around("time of a tick [ms]", points().map(|point| point[1])),
        series: lines,
        shaded: Vec::new(),
    })
}

/// A point for each choice: what it costs against what it changes.
fn models(models: &Models) -> Plot {
    let mut lines: Vec<Line> = Vec::new();
    for row in &models.choices {
        if let (Some(cost), Some(moved)) = (row.step_ms, row.from_base)
            && moved.rms_k > 0.0
        {
            push(&mut lines, &row.choice, [cost, moved.rms_k]);
        }
    }
    let base = models.choices.first();
    let cost = base.and_then(|row| row.step_ms).map_or(String::new(), |ms| format!(", at {ms:.2} ms a tick"));
    let points = || lines.iter().flat_map(|line| line.points.iter());
    Plot {
        title: format!("What each choice costs and changes: {}", models.scene),
        subtitle: format!("{} nodes; against '{}'{cost}", models.nodes, base.map_or("", |row| &row.choice)),
        x: around("thermal, shadow and network passes of a tick [ms]", points().map(|point| point[0])),
        y: around("change of temperature, rms [K]", points().map(|point| point[1])),
        series: lines,
        shaded: Vec::new(),
    }
}

/// A line for each method, from its cheapest run to its dearest.
fn work_precision(measured: &Measured, integrated: &Integrated, case: &CaseSummary) -> Plot {
    let mut lines: Vec<Line> = Vec::new();
    for run in &integrated.runs {
        let (Some(time), Some(error)) = (run.time(), run.error) else { continue };
        push(&mut lines, &run.family, [time.median, error.rms]);
    }
    for line in &mut lines {
        line.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    let clock = if measured.info.is_some() { "device's clock" } else { "host's clock" };
    let own = case.reference_error.rms;
    let times = lines.iter().flat_map(|line| &line.points).map(|[time, _]| *time);
    Plot {
        title: format!("Work and precision: {}", case.title),
        subtitle: format!("{}; {} nodes; the reference itself is off by {own:.0e} K rms", measured.name, case.nodes),
        x: around(&format!("time of a frame of {:.1} s, median, {clock} [ms]", case.frame_s), times),
        y: Axis::logarithmic("error, rms over nodes and frames [K]"),
        series: lines,
        shaded: Vec::new(),
    }
}
