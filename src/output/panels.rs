//! A figure of several small plots in a grid, as one SVG document.

use super::OutputError;
use super::plot::{Area, FINE, Layout, Plot, TITLE, document, draw_title};

/// Width of a figure [px].
const WIDTH: u32 = 960;
/// Height of a panel [px].
const PANEL_HEIGHT: u32 = 280;
/// Height of a panel's title and subtitle [px].
const PANEL_TITLE: u32 = 46;
/// Width of a panel's legend [px].
const LEGEND: u32 = 200;

/// Plots in a grid. Panels without legends should have few lines that the title explains.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Panels {
    /// First line, bold.
    pub(crate) title: String,
    pub(crate) subtitle: String,
    pub(crate) columns: usize,
    /// Whether each panel has a legend on its right.
    pub(crate) legends: bool,
    /// The panels, row by row.
    pub(crate) plots: Vec<Plot>,
}

impl Panels {
    /// The figure as an SVG document. The document is 960 pixels wide and scales to any width. The same figure gives the same text.
    pub(crate) fn svg(&self) -> Result<String, OutputError> {
        let columns = self.columns.max(1);
        let rows = self.plots.len().div_ceil(columns).max(1);
        let height = TITLE + PANEL_HEIGHT * u32::try_from(rows).unwrap_or(1);
        document(&self.title, [WIDTH, height], |root| self.draw(root, rows, columns))
    }

    fn draw(&self, root: &Area, rows: usize, columns: usize) -> Result<(), String> {
        draw_title(root, &self.title, &self.subtitle)?;
        let (_, below) = root.split_vertically(TITLE * FINE);
        let cells = below.split_evenly((rows, columns));
        let layout = Layout { title: PANEL_TITLE, legend: if self.legends { LEGEND } else { 0 } };
        self.plots.iter().zip(&cells).try_for_each(|(plot, cell)| plot.draw_on(cell, &layout))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::plot::PlotLine;

    fn panels(count: usize, columns: usize) -> Panels {
        let plot = |number: usize| {
            let series = vec![PlotLine { points: vec![[0.0, 1.0], [1.0, number as f64]], ..PlotLine::default() }];
            Plot { title: format!("panel {number}"), series, ..Plot::default() }
        };
        Panels { title: "All".into(), columns, plots: (0..count).map(plot).collect(), ..Panels::default() }
    }

    #[test]
    fn every_panel_is_drawn_in_rows() {
        let svg = panels(6, 3).svg().unwrap();
        assert!((0..6).all(|number| svg.contains(&format!("panel {number}"))) && svg.contains("All"));
        assert!(svg.contains(&format!("height=\"{}\"", TITLE + 2 * PANEL_HEIGHT)));
        assert!(panels(4, 3).svg().unwrap().contains(&format!("height=\"{}\"", TITLE + 2 * PANEL_HEIGHT)));
        assert!(panels(6, 6).svg().unwrap().contains(&format!("height=\"{}\"", TITLE + PANEL_HEIGHT)));
        assert_eq!(svg, panels(6, 3).svg().unwrap());
    }

    #[test]
    fn legends_are_drawn_where_asked_for() {
        let named = |legends| {
            let mut panels = Panels { legends, ..panels(2, 1) };
            panels.plots[1].series[0].name = "a line".into();
            panels.svg().unwrap()
        };
        assert!(named(true).contains("a line") && !named(false).contains("a line"));
    }

    #[test]
    fn a_figure_without_panels_is_drawn() {
        assert!(panels(0, 0).svg().is_ok());
    }
}
