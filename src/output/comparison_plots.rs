//! Plots of one scene under several responses: differences, part temperatures and probe temperatures over time.

use super::OutputError;
use super::clock::DisplayClock;
use super::eclipses::Eclipses;
use super::plot::{Mark, PlotLine};
use super::report::PlotEntry;
use super::series::{SeriesRow, TemperatureSeries};

pub(crate) const MOST_PLOTS: usize = 6;

#[derive(Debug, Clone, Copy)]
pub(crate) struct NamedSeries<'a> {
    pub(crate) name: &'a str,
    /// Its temperatures. All responses have the same columns.
    pub(crate) series: &'a TemperatureSeries,
}

/// Plots root mean square differences over time. Each response has points [time in s, difference in K].
pub(crate) fn differences(
    lines: &[(&str, Vec<[f64; 2]>)],
    rows: &[SeriesRow],
    reference: &str,
    eclipses: &Eclipses,
) -> Result<PlotEntry, OutputError> {
    let clock = DisplayClock::for_rows(rows);
    let line = |(name, points): &(&str, Vec<[f64; 2]>)| PlotLine {
        name: (*name).to_owned(),
        points: points.iter().map(|[time, value]| [clock.time(*time), *value]).collect(),
        ..PlotLine::default()
    };
    let subtitle = "area-weighted root mean square over all nodes";
    let words = [&format!("Difference from {reference}"), subtitle, "difference [K]"];
    clock.plot("differences", words, lines.iter().map(line).collect(), eclipses)
}

/// Plots the whole craft, the parts with indices `parts` (at most `MOST_PLOTS`) and the probes. Each plot has a line
/// for every response. The last response is the reference. File names use numbers, because part names may be invalid as
/// file names.
pub(crate) fn temperatures(
    responses: &[NamedSeries],
    parts: &[usize],
    eclipses: &Eclipses,
) -> Result<Vec<PlotEntry>, OutputError> {
    let Some(first) = responses.first() else { return Ok(Vec::new()) };
    let clock = DisplayClock::for_rows(first.series.rows());
    let mut plots = Vec::new();
    let mut draw = |name: String, title: String, subtitle: &str, value: &dyn Fn(&SeriesRow) -> Option<f64>| {
        let line = |(index, response): (usize, &NamedSeries)| PlotLine {
            name: response.name.to_owned(),
            points: response.series.rows().iter().filter_map(|row| Some([clock.time(row.time), value(row)?])).collect(),
            mark: if index + 1 == responses.len() { Mark::Line } else { Mark::Dashed },
            ..PlotLine::default()
        };
        let lines = responses.iter().enumerate().map(line).collect();
        plots.push(clock.plot(&name, [&title, subtitle, "temperature [K]"], lines, eclipses)?);
        Ok::<_, OutputError>(())
    };
    draw("all".to_owned(), "Whole craft".to_owned(), "area-weighted mean", &|row| row.all.map(|s| s.mean))?;
    for &part in parts.iter().take(MOST_PLOTS) {
        let title = format!("Part {}", first.series.parts()[part]);
        let value = |row: &SeriesRow| row.parts[part].map(|s| s.mean);
        draw(format!("part_{}", part + 1), title, "area-weighted mean", &value)?;
    }
    for (probe, name) in first.series.probes().iter().enumerate().take(MOST_PLOTS) {
        let value = |row: &SeriesRow| Some(f64::from(row.probes[probe]));
        let subtitle = "temperature of the nearest node";
        draw(format!("probe_{}", probe + 1), format!("Probe {name}"), subtitle, &value)?;
    }
    Ok(plots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::series::tests::orbit;

    #[test]
    fn there_is_a_plot_for_all_the_parts_asked_for_and_the_probes() {
        let series = orbit(9, 1, 2);
        let responses = ["instant", "network"].map(|name| NamedSeries { name, series: &series });
        let plots = temperatures(&responses, &[8, 2], &Eclipses::default()).unwrap();
        let names: Vec<&str> = plots.iter().map(|plot| &plot.file[6..plot.file.len() - 4]).collect();
        assert_eq!(names, ["all", "part_9", "part_3", "probe_1", "probe_2"]);
        assert!(plots[1].svg.contains("B0_module_8") && plots[1].svg.contains("instant"));
        let all: Vec<usize> = (0..9).collect();
        assert_eq!(temperatures(&responses, &all, &Eclipses::default()).unwrap().len(), 1 + MOST_PLOTS + 2);
        assert!(temperatures(&[], &[], &Eclipses::default()).unwrap().is_empty());
    }

    #[test]
    fn differences_have_a_line_for_each_response() {
        let series = orbit(1, 0, 0);
        let lines = [("instant", vec![[0.0, 1.0], [60.0, 2.0]]), ("transition", vec![[0.0, 0.5], [60.0, 0.7]])];
        let plot = differences(&lines, series.rows(), "network", &Eclipses::default()).unwrap();
        assert!(plot.svg.contains("transition") && plot.svg.contains("Difference from network"));
    }
}
