//! Plots of a run: temperatures of materials, parts and probes over time, with eclipses shaded.

use super::OutputError;
use super::plot::{Line, Plot, Shade};
use super::plot_axis::Axis;
use super::report::PlotEntry;
use super::series::{Series, SeriesRow};
use super::statistics::Summary;

/// Most lines in one plot.
const MOST_LINES: usize = 10;

/// Most lines with a band from minimum to maximum. More bands would hide each other.
const MOST_BANDS: usize = 5;

/// Eclipses: start and end of each [s].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Eclipses {
    /// The planet hides the whole Sun.
    pub umbra: Vec<(f64, f64)>,
    /// The planet hides a part of the Sun.
    pub penumbra: Vec<(f64, f64)>,
}

/// Draws the plots `materials`, `parts` and `probes`. Plots without lines are left out.
pub fn temperature_plots(series: &Series, eclipses: &Eclipses) -> Result<Vec<PlotEntry>, OutputError> {
    let clock = Clock::for_rows(series.rows());
    let group = |names: &[String], of: fn(&SeriesRow) -> &[Option<Summary>]| -> Vec<Line> {
        let lines = names.iter().enumerate().map(|(index, name)| {
            let present = || series.rows().iter().filter_map(|row| Some((clock.time(row.time), of(row)[index]?)));
            Line {
                name: name.clone(),
                points: present().map(|(time, s)| [time, s.mean]).collect(),
                band: present().map(|(time, s)| [time, f64::from(s.min), f64::from(s.max)]).collect(),
                ..Line::default()
            }
        });
        lines.filter(|line| !line.points.is_empty()).collect()
    };
    let probes = series.probes().iter().enumerate().map(|(index, name)| Line {
        name: name.clone(),
        points: series.rows().iter().map(|row| [clock.time(row.time), f64::from(row.probes[index])]).collect(),
        ..Line::default()
    });
    let kinds = [
        ("materials", "Materials", group(series.materials(), |row| &row.materials)),
        ("parts", "Parts", group(series.parts(), |row| &row.parts)),
        ("probes", "Probes", probes.collect()),
    ];
    let mut plots = vec![];
    for (name, title, lines) in kinds {
        if lines.is_empty() {
            continue;
        }
        let count = lines.len();
        let mut lines = widest_swings(lines);
        let mut subtitle = match name {
            "probes" => "temperature of the nearest node",
            _ if lines.len() > MOST_BANDS => "area-weighted mean",
            _ => "area-weighted mean, and band from least to greatest",
        }
        .to_owned();
        if lines.len() > MOST_BANDS {
            lines.iter_mut().for_each(|line| line.band.clear());
        }
        if count > lines.len() {
            let (shown, left) = (lines.len(), count - lines.len());
            subtitle += &format!("; the {shown} of {count} with the widest swing, {left} are left out");
        }
        plots.push(clock.plot(name, [title, &subtitle, "temperature [K]"], lines, eclipses)?);
    }
    Ok(plots)
}

/// The lines with the largest value ranges, at most [`MOST_LINES`], in list order.
fn widest_swings(lines: Vec<Line>) -> Vec<Line> {
    let swing = |line: &Line| {
        let values = line.points.iter().map(|point| point[1]).filter(|value| value.is_finite());
        let (least, greatest) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        greatest - least
    };
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|a, b| swing(&lines[*b]).total_cmp(&swing(&lines[*a])).then(a.cmp(b)));
    order.truncate(MOST_LINES);
    order.sort_unstable();
    order.into_iter().map(|index| lines[index].clone()).collect()
}

/// The unit of displayed times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    unit: &'static str,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::series::tests::orbit;

    #[test]
    fn each_kind_that_is_there_has_its_plot() {
        let names = |series: &Series| -> Vec<String> {
            let plots = temperature_plots(series, &Eclipses::default()).unwrap();
            plots.into_iter().map(|plot| plot.file.replace("plots/", "").replace(".svg", "")).collect()
        };
        assert_eq!(names(&orbit(2, 3, 1)), ["materials", "parts", "probes"]);
        assert_eq!(names(&orbit(1, 0, 0)), ["parts"]);
        assert!(names(&Series::new(&["a".into()], &[], &[])).is_empty());
    }

    #[test]
    fn the_widest_swings_are_kept_and_the_rest_is_told() {
        // The swing of `orbit` grows with the index. Of 14 parts the first 4 are left out.
        let plots = temperature_plots(&orbit(14, 2, 0), &Eclipses::default()).unwrap();
        let parts = &plots[1].svg;
        assert!(parts.contains("the 10 of 14 with the widest swing, 4 are left out"));
        assert!(parts.contains("B0_module_13") && parts.contains("B0_module_4\n") && !parts.contains("B0_module_3\n"));
        assert!(!plots[0].svg.contains("left out"));
    }

    #[test]
    fn an_eclipse_is_shaded_in_the_unit_of_the_axis() {
        let eclipses = Eclipses { umbra: vec![(2100.0, 4200.0)], penumbra: vec![(2092.0, 2100.0), (4200.0, 4208.0)] };
        let lit = temperature_plots(&orbit(0, 1, 0), &Eclipses::default()).unwrap();
        let dark = temperature_plots(&orbit(0, 1, 0), &eclipses).unwrap();
        let count = |plots: &[PlotEntry], what: &str| plots[0].svg.matches(what).count();
        // There are three intervals and two legend patches.
        assert_eq!(count(&dark, "<rect"), count(&lit, "<rect") + 5);
        assert!(dark[0].svg.contains("umbra") && !lit[0].svg.contains("umbra"));
        assert!(dark[0].svg.contains("time [min]"));
    }

    #[test]
    fn long_runs_are_shown_in_hours() {
        let row = |time| SeriesRow { time, all: None, parts: vec![], materials: vec![], probes: vec![] };
        assert_eq!(Clock::for_rows(&[row(0.0), row(59.0)]).unit, "s");
        assert_eq!(Clock::for_rows(&[row(0.0), row(5580.0)]).unit, "min");
        assert_eq!(Clock::for_rows(&[row(0.0), row(86_400.0)]).time(7200.0), 2.0);
    }
}
