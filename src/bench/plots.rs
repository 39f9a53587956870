//! Work-precision diagrams: what a frame takes against how wrong it is.

use super::record::{Bench, CaseSummary, Integrated, Measured};
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

/// One diagram for each device and case.
///
/// # Errors
/// [`OutputError::Encode`].
pub fn all(bench: &Bench) -> Result<Vec<Diagram>, OutputError> {
    let mut diagrams = Vec::new();
    for (number, measured) in bench.devices.iter().enumerate() {
        for (integrated, case) in measured.integrators.iter().zip(&bench.cases) {
            let plot = work_precision(measured, integrated, case);
            let name = format!("work_precision_{}_{}", number + 1, case.key);
            diagrams.push(Diagram { name, title: format!("{}: {}", measured.name, case.title), svg: plot.svg()? });
        }
    }
    Ok(diagrams)
}

/// A line for each method, from its cheapest run to its dearest.
fn work_precision(measured: &Measured, integrated: &Integrated, case: &CaseSummary) -> Plot {
    let mut lines: Vec<Line> = Vec::new();
    for run in &integrated.runs {
        let (Some(time), Some(error)) = (run.time(), run.error) else { continue };
        let point = [time.median, error.rms];
        match lines.iter_mut().find(|line| line.name == run.family) {
            Some(line) => line.points.push(point),
            None => lines.push(Line {
                name: run.family.clone(),
                points: vec![point],
                mark: Mark::Joined,
                ..Line::default()
            }),
        }
    }
    for line in &mut lines {
        line.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    let times = lines.iter().flat_map(|line| &line.points).map(|[time, _]| *time);
    let ends = times.fold([f64::INFINITY, 0.0], |[least, most]: [f64; 2], time| [least.min(time), most.max(time)]);
    // No point on the edge.
    let x = Axis { range: Some([0.85 * ends[0], ends[1] / 0.85]), ..Axis::logarithmic("") };
    let clock = if measured.info.is_some() { "device's clock" } else { "host's clock" };
    let own = case.reference_error.rms;
    Plot {
        title: format!("Work and precision: {}", case.title),
        subtitle: format!("{}; {} nodes; the reference itself is off by {own:.0e} K rms", measured.name, case.nodes),
        x: Axis { label: format!("time of a frame of {:.1} s, median, {clock} [ms]", case.frame_s), ..x },
        y: Axis::logarithmic("error, rms over nodes and frames [K]"),
        series: lines,
        shaded: Vec::new(),
    }
}
