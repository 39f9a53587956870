//! Plots of a run: temperatures of materials, parts and probes over time, with eclipses shaded.

use super::OutputError;
use super::eclipses::Eclipses;
use super::report::PlotEntry;
use super::series_lines::{LineGroup, SeriesLines};

/// Most lines with a band from minimum to maximum. More bands would hide each other.
const MOST_BANDS: usize = 5;

/// Draws the plots `materials`, `parts` and `probes`. Plots without lines are left out.
pub(crate) fn temperature_plots(series: SeriesLines, eclipses: &Eclipses) -> Result<Vec<PlotEntry>, OutputError> {
    let (clock, with_sigma) = (series.clock, series.with_sigma);
    let kinds = [
        ("materials", "Materials", series.materials),
        ("parts", "Parts", series.parts),
        ("probes", "Probes", series.probes),
    ];
    let mut plots = vec![];
    for (name, title, LineGroup { count, mut lines }) in kinds {
        if lines.is_empty() {
            continue;
        }
        let mut subtitle = match name {
            "probes" if with_sigma => {
                "temperature of the nearest node, and band of two standard deviations by [uncertainty]"
            }
            "probes" => "temperature of the nearest node",
            "parts" if with_sigma && lines.len() <= MOST_BANDS => {
                "area-weighted mean, and band of two standard deviations by [uncertainty]"
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::clock::DisplayClock;
    use crate::output::series::SeriesRow;
    use crate::output::series::TemperatureSeries;
    use crate::output::series::tests::{orbit, text};

    fn drawn(series: &TemperatureSeries, eclipses: &Eclipses) -> Vec<PlotEntry> {
        let table = text(series);
        temperature_plots(SeriesLines::read(series, false, || Ok(table.as_bytes())).unwrap(), eclipses).unwrap()
    }

    #[test]
    fn each_kind_that_is_there_has_its_plot() {
        let names = |series: &TemperatureSeries| -> Vec<String> {
            let plots = drawn(series, &Eclipses::default());
            plots.into_iter().map(|plot| plot.file.replace("plots/", "").replace(".svg", "")).collect()
        };
        assert_eq!(names(&orbit(2, 3, 1)), ["materials", "parts", "probes"]);
        assert_eq!(names(&orbit(1, 0, 0)), ["parts"]);
        assert!(names(&TemperatureSeries::new(&["a".into()], &[], &[])).is_empty());
    }

    #[test]
    fn the_widest_swings_are_kept_and_the_rest_is_told() {
        // The swing of `orbit` grows with the index. Of 14 parts the first 4 are left out.
        let plots = drawn(&orbit(14, 2, 0), &Eclipses::default());
        let parts = &plots[1].svg;
        assert!(parts.contains("the 10 of 14 with the widest swing, 4 are left out"));
        assert!(parts.contains("B0_module_13") && parts.contains("B0_module_4\n") && !parts.contains("B0_module_3\n"));
        assert!(!plots[0].svg.contains("left out"));
    }

    #[test]
    fn an_eclipse_is_shaded_in_the_unit_of_the_axis() {
        let eclipses = Eclipses { umbra: vec![(2100.0, 4200.0)], penumbra: vec![(2092.0, 2100.0), (4200.0, 4208.0)] };
        let lit = drawn(&orbit(0, 1, 0), &Eclipses::default());
        let dark = drawn(&orbit(0, 1, 0), &eclipses);
        let count = |plots: &[PlotEntry], what: &str| plots[0].svg.matches(what).count();
        // There are three intervals and two legend patches.
        assert_eq!(count(&dark, "<rect"), count(&lit, "<rect") + 5);
        assert!(dark[0].svg.contains("umbra") && !lit[0].svg.contains("umbra"));
        assert!(dark[0].svg.contains("time [min]"));
    }

    #[test]
    fn long_runs_are_shown_in_hours() {
        let row = |time| SeriesRow { time, all: None, parts: vec![], materials: vec![], probes: vec![] };
        assert_eq!(DisplayClock::for_rows(&[row(0.0), row(59.0)]).unit, "s");
        assert_eq!(DisplayClock::for_rows(&[row(0.0), row(5580.0)]).unit, "min");
        assert_eq!(DisplayClock::for_rows(&[row(0.0), row(86_400.0)]).time(7200.0), 2.0);
    }
}
