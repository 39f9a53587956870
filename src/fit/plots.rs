//! Plots of a fit: measured and computed temperatures, and residuals before and after.

use super::result::Fitted;
use crate::output::plot::{Mark, Plot, PlotLine, Shade};
use crate::output::plot_axis::Axis;

/// Most sensors of a plot, each with three lines.
const MOST: usize = 4;

/// Measured temperatures of the sensors that the fit moved most, and computed ones before and after.
pub(super) fn measured_plot(fitted: &Fitted) -> Plot {
    let groups = &fitted.measurements.groups;
    let mut chosen: Vec<usize> = (0..groups.len()).filter(|group| groups[*group].kind == "sensor").collect();
    let moved = |group: &usize| {
        let misfits = fitted.misfits(Some(*group), false);
        misfits.before - misfits.after
    };
    chosen.sort_by(|a, b| moved(b).total_cmp(&moved(a)));
    let left_out = chosen.len().saturating_sub(MOST);
    chosen.truncate(MOST);
    let mut series = Vec::new();
    for (colour, group) in chosen.into_iter().enumerate() {
        let line = |name: &str, mark: Mark, of: &dyn Fn(usize) -> f64| PlotLine {
            name: format!("{}: {name}", groups[group].name),
            points: points(fitted, group, of),
            mark,
            colour: Some(colour),
            ..PlotLine::default()
        };
        series.push(line("fitted", Mark::Line, &|i| fitted.best.computed[i]));
        series.push(line("before", Mark::Dashed, &|i| fitted.before[i]));
        series.push(line("measured", Mark::Points, &|i| fitted.measurements.points[i].value));
    }
    let rest = if left_out > 0 { format!("; {left_out} sensors that moved less are left out") } else { String::new() };
    Plot {
        title: format!("Measured and computed: {}", fitted.name),
        subtitle: format!("temperatures of sensors{rest}"),
        x: Axis::linear("time [s]"),
        y: Axis::linear("temperature [K]"),
        series,
        shaded: held_out(fitted),
    }
}

/// Computed minus measured temperatures: of each row of telemetry, and the mean of each image.
pub(super) fn residual_plot(fitted: &Fitted) -> Plot {
    let line = |kind: &str, when: &str, computed: &[f64]| {
        let groups = fitted.measurements.groups.iter().enumerate().filter(|(_, group)| group.kind == kind);
        let off = |i: usize| computed[i] - fitted.measurements.points[i].value;
        let of_group = |(group, _): (usize, _)| {
            let points = points(fitted, group, &off);
            if kind == "sensor" { points } else { mean(&points).into_iter().collect() }
        };
        let name = if kind == "sensor" { format!("telemetry, {when}") } else { format!("mean of an image, {when}") };
        PlotLine { name, points: groups.flat_map(of_group).collect(), mark: Mark::Points, ..PlotLine::default() }
    };
    let (after, before) = (&fitted.best.computed, &fitted.before);
    let lines = [
        line("sensor", "after", after),
        line("sensor", "before", before),
        line("image", "after", after),
        line("image", "before", before),
    ];
    let misfits = fitted.misfits(None, false);
    Plot {
        title: format!("Residuals: {}", fitted.name),
        subtitle: format!(
            "computed minus measured, {:.3} K rms before and {:.3} K after the fit",
            misfits.before, misfits.after
        ),
        x: Axis::linear("time [s]"),
        y: Axis::linear("residual [K]"),
        series: lines.into_iter().filter(|line| !line.points.is_empty()).collect(),
        shaded: held_out(fitted),
    }
}

/// Points of a group over time.
fn points(fitted: &Fitted, group: usize, of: &dyn Fn(usize) -> f64) -> Vec<[f64; 2]> {
    let all = fitted.measurements.points.iter().enumerate().filter(|(_, point)| point.group == group);
    let mut points: Vec<[f64; 2]> = all.map(|(i, point)| [point.time, of(i)]).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

fn mean(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let first = points.first()?;
    Some([first[0], points.iter().map(|point| point[1]).sum::<f64>() / points.len() as f64])
}

/// The time that was held out.
fn held_out(fitted: &Fitted) -> Vec<Shade> {
    let times = || fitted.measurements.points.iter().filter(|point| point.held_out).map(|point| point.time);
    let ends = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
    match ends.0 <= ends.1 {
        true => vec![Shade { name: "held out".to_owned(), intervals: vec![ends], strength: 0.3 }],
        false => Vec::new(),
    }
}
