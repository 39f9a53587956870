//! Plots over time: the unit of the times, and eclipses as shades.

use super::OutputError;
use super::eclipses::Eclipses;
use super::plot::{Plot, PlotLine, Shade};
use super::plot_axis::Axis;
use super::report::PlotEntry;
use super::series::SeriesRow;

/// How many digits tell the times of images apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Seconds {
    digits: usize,
}

impl Seconds {
    /// Whole seconds where times lie a second or more apart. Otherwise as many digits as their smallest distance has, or two where it has many.
    pub(crate) fn between(times: &[f64]) -> Self {
        let all: Vec<f64> = std::iter::once(0.0).chain(times.iter().copied()).collect();
        let gaps = all.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 0.0);
        let least = gaps.fold(f64::INFINITY, f64::min);
        if least >= 1.0 {
            return Self { digits: 0 };
        }
        let first = (-least.log10().floor()).clamp(1.0, 9.0) as usize;
        let states = |digits: &usize| {
            let scaled = least * 10f64.powi(*digits as i32);
            (scaled - scaled.round()).abs() < 1e-6 * scaled
        };
        Self { digits: (first..first + 3).find(states).unwrap_or(first + 1) }
    }

    /// A time [s] as text.
    pub(crate) fn of(self, time: f64) -> String {
        format!("{time:.*}", self.digits)
    }

    /// The time with one digit more.
    pub(crate) fn finer(self, time: f64) -> String {
        format!("{time:.*}", self.digits + 1)
    }
}

/// The unit of displayed times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DisplayClock {
    pub(super) unit: &'static str,
    seconds: f64,
}

impl DisplayClock {
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
        series: Vec<PlotLine>,
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

#[cfg(test)]
mod tests {
    use super::Seconds;

    #[test]
    fn labels_of_times_differ() {
        let labels = |times: &[f64]| times.iter().map(|time| Seconds::between(times).of(*time)).collect::<Vec<_>>();
        assert_eq!(labels(&[0.0, 0.4, 0.8, 1.2]), ["0.0", "0.4", "0.8", "1.2"]);
        assert_eq!(labels(&[0.0, 0.25, 0.5]), ["0.00", "0.25", "0.50"]);
        assert_eq!(labels(&[0.0, 154.3, 308.6]), ["0", "154", "309"]);
        assert_eq!(labels(&[0.5]), ["0.5"]);
        assert_eq!(labels(&[0.0]), ["0"]);
        let thirds: Vec<f64> = (0..50).map(|image| f64::from(image) / 30.0).collect();
        let mut unique = labels(&thirds);
        unique.dedup();
        assert_eq!(unique.len(), 50, "{unique:?}");
        assert_eq!(Seconds::between(&[0.0, 154.3]).finer(154.3), "154.3");
    }
}
