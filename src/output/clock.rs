//! Plots over time: the unit of the times, and eclipses as shades.

use super::OutputError;
use super::eclipses::Eclipses;
use super::plot::{Line, Plot, Shade};
use super::plot_axis::Axis;
use super::report::PlotEntry;
use super::series::SeriesRow;

/// The unit of displayed times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    pub(super) unit: &'static str,
    seconds: f64,
}

impl Clock {
    pub(super) fn for_rows(rows: &[SeriesRow]) -> Self {
        Self::until(rows.iter().map(|row| row.time.abs()).fold(0.0, f64::max))
    }

    /// The unit for times up to `span` [s].
    pub(super) fn until(span: f64) -> Self {
        let (unit, seconds) = match span {
            span if span <= 600.0 => ("s", 1.0),
            span if span <= 36_000.0 => ("min", 60.0),
            _ => ("h", 3600.0),
        };
        Self { unit, seconds }
    }

    pub(super) fn time(&self, seconds: f64) -> f64 {
        seconds / self.seconds
    }

    /// A plot over time. The strings are title, subtitle and label of the vertical axis.
    pub(super) fn plot(
        &self,
        name: &str,
        [title, subtitle, y]: [&str; 3],
        series: Vec<Line>,
        eclipses: &Eclipses,
    ) -> Result<PlotEntry, OutputError> {
        let shade = |name: &str, intervals: &[(f64, f64)], strength| Shade {
            name: name.to_owned(),
            intervals: intervals.iter().map(|&(start, end)| (self.time(start), self.time(end))).collect(),
            strength,
        };
        let plot = Plot {
            title: title.to_owned(),
            subtitle: subtitle.to_owned(),
            x: Axis::linear(&format!("time [{}]", self.unit)),
            y: Axis::linear(y),
            series,
            shaded: vec![shade("penumbra", &eclipses.penumbra, 0.4), shade("umbra", &eclipses.umbra, 1.0)],
        };
        PlotEntry::new(name, title, &plot)
    }
}
