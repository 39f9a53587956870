//! Line plots as SVG: lines, bands, points, shaded intervals, linear or logarithmic axes, and a legend.

use std::fmt::Display;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::OutputError;
use super::plot_axis::Axis;
use super::polyline::{runs, thin};
use crate::text::plain_lines;

/// Width of a plot [px].
const WIDTH: u32 = 900;
/// Height of a plot [px].
const HEIGHT: u32 = 400;
/// Height of title and subtitle [px].
pub(super) const TITLE: u32 = 50;
/// Width of numbers and label left of the axes [px].
const LEFT: u32 = 74;
/// Height of numbers and label below the axes [px].
const BOTTOM: u32 = 48;
/// Scale factor of the drawing. Plotters only supports whole numbers, so drawing larger gives fractions of a pixel.
pub(super) const FINE: u32 = 10;

/// A drawing or a part of one.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Space around the axes [px].
pub(super) struct Layout {
    /// Height of title and subtitle.
    pub(crate) title: u32,
    /// Width of the legend on the right. 0 means no legend.
    pub(crate) legend: u32,
}

pub(super) const INK: RGBColor = RGBColor(25, 28, 32);
pub(super) const FAINT: RGBColor = RGBColor(95, 100, 108);
pub(super) const GRID: RGBColor = RGBColor(226, 228, 231);

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mark {
    /// Joined by a line.
    #[default]
    Line,
    /// Joined by a dashed line: a reference or a limit.
    Dashed,
    /// A dot for each point: measurements.
    Points,
    /// Dots joined by a line: ordered measurements.
    Joined,
}

/// One series of a plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlotLine {
    /// Name in the legend.
    pub name: String,
    /// Points [x, y] in drawing order. A point that is not finite makes a gap.
    pub points: Vec<[f64; 2]>,
    /// Band behind the line: [x, lower, upper]. No points mean no band.
    pub band: Vec<[f64; 3]>,
    /// Style of the points.
    pub mark: Mark,
    /// Number of the colour, which lines may share. `None` takes the place in the plot.
    pub colour: Option<usize>,
}

/// Intervals of x with a grey background, such as eclipses.
#[derive(Debug, Clone, PartialEq)]
pub struct Shade {
    /// Name in the legend.
    pub(crate) name: String,
    /// Start and end of each interval, in units of the x axis.
    pub(crate) intervals: Vec<(f64, f64)>,
    /// Darkness in [0, 1].
    pub(crate) strength: f64,
}

/// A line plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// First line, bold.
    pub title: String,
    /// Second line: the quantity that the plot shows, and which lines are not drawn.
    pub subtitle: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The series. The first is on top.
    pub series: Vec<PlotLine>,
    /// Shaded intervals behind the series.
    pub shaded: Vec<Shade>,
}

impl Plot {
    /// The plot as an SVG document of 900 x 400 pixels that scales to any width. The same plot gives the same text.
    pub fn svg(&self) -> Result<String, OutputError> {
        let layout = Layout { title: TITLE, legend: 220 };
        document(&self.title, [WIDTH, HEIGHT], |root| self.draw_on(root, &layout))
    }

    pub(super) fn draw_on(&self, root: &Area, layout: &Layout) -> Result<(), String> {
        let subtitle = match self.left_out() {
            0 => self.subtitle.clone(),
            count => {
                let separator = if self.subtitle.is_empty() { "" } else { "; " };
                let why = if self.x.log || self.y.log { "not finite or not above 0" } else { "not finite" };
                format!("{}{separator}{count} points {why} are left out", self.subtitle)
            }
        };
        draw_title(root, &self.title, &subtitle)?;
        let (_, below) = root.split_vertically(layout.title * FINE);
        let (area, legend) = below.split_horizontally(below.dim_in_pixel().0 - layout.legend * FINE);
        self.draw_chart(&area)?;
        self.draw_axis_labels(&area)?;
        if layout.legend > 0 { self.draw_legend(&legend) } else { Ok(()) }
    }

    fn draw_chart(&self, area: &Area) -> Result<(), String> {
        let bands = self.series.iter().flat_map(|line| &line.band);
        let band_y = bands.clone().flat_map(|[_, lower, upper]| [*lower, *upper]);
        let points = self.series.iter().flat_map(|line| &line.points);
        let x = self.x.scale(points.clone().map(|p| p[0]).chain(bands.map(|b| b[0])), 0.0);
        let y = self.y.scale(points.map(|p| p[1]).chain(band_y), 0.05);
        let mut chart = ChartBuilder::on(area)
            .margin_top(6 * FINE)
            .margin_right(18 * FINE)
            .margin_bottom(6 * FINE)
            .set_label_area_size(LabelAreaPosition::Left, LEFT * FINE)
            .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM * FINE)
            .build_cartesian_2d(x, y)
            .map_err(text)?;
        for shade in &self.shaded {
            for &(start, end) in shade.intervals.iter().filter(|(start, end)| *end >= x.lower && *start <= x.upper) {
                let corners = [(x.inside(start), y.lower), (x.inside(end), y.upper)];
                let style = shade_colour(shade.strength).filled();
                chart.draw_series([Rectangle::new(corners, style)]).map_err(text)?;
            }
        }
        chart
            .configure_mesh()
            .bold_line_style(GRID.stroke_width(FINE))
            .light_line_style(TRANSPARENT)
            .axis_style(FAINT.stroke_width(FINE))
            .label_style(font(12.0, false, INK))
            .set_all_tick_mark_size(4 * FINE)
            .draw()
            .map_err(text)?;
        // Bands come first. Series are drawn in reverse order, so that the first line is on top.
        for (index, line) in self.series.iter().enumerate().rev() {
            for band in runs(&line.band, |[a, b, c]| self.x.shows(*a) && self.y.shows(*b) && self.y.shows(*c)) {
                let band = thin(band, |b| [b[1], b[2]]);
                let lower = band.iter().map(|b| (b[0], b[1]));
                let outline: Vec<_> = lower.chain(band.iter().rev().map(|b| (b[0], b[2]))).collect();
                chart.draw_series([Polygon::new(outline, line_colour(index, line).mix(0.16))]).map_err(text)?;
            }
        }
        for (index, line) in self.series.iter().enumerate().rev() {
            let colour = line_colour(index, line);
            let dot = |[x, y]: &[f64; 2]| Circle::new((*x, *y), 25 * FINE / 10, colour.filled());
            for run in runs(&line.points, |[a, b]| self.x.shows(*a) && self.y.shows(*b)) {
                let points = thin(run, |p| [p[1], p[1]]);
                let path = points.iter().map(|p| (p[0], p[1]));
                let stroke = colour.stroke_width(18 * FINE / 10);
                match line.mark {
                    Mark::Points => chart.draw_series(run.iter().map(dot)).map(|_| ()).map_err(text)?,
                    _ if run.len() == 1 => chart.draw_series(run.iter().map(dot)).map(|_| ()).map_err(text)?,
                    Mark::Line | Mark::Joined => {
                        chart.draw_series([PathElement::new(path.collect::<Vec<_>>(), stroke)]).map_err(text)?;
                        if line.mark == Mark::Joined {
                            chart.draw_series(run.iter().map(dot)).map_err(text)?;
                        }
                    }
                    Mark::Dashed => {
                        let dashes = DashedLineSeries::new(path, 7 * FINE, 4 * FINE, stroke);
                        chart.draw_series(dashes).map(|_| ()).map_err(text)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Plotters would put the labels at the edge of the drawing, not at the middle of the axes.
    fn draw_axis_labels(&self, area: &Area) -> Result<(), String> {
        let (width, height) = area.dim_in_pixel();
        let style = font(13.0, false, INK).pos(Pos::new(HPos::Center, VPos::Center));
        let middle_x = (LEFT * FINE + width) / 2;
        let middle_y = (height - BOTTOM * FINE) / 2;
        let x = Text::new(self.x.label.clone(), (middle_x as i32, (height - 14 * FINE) as i32), style.clone());
        let turned = style.transform(FontTransform::Rotate270);
        let y = Text::new(self.y.label.clone(), (18 * FINE as i32, middle_y as i32), turned);
        area.draw(&x).and_then(|()| area.draw(&y)).map_err(text)
    }

    fn draw_legend(&self, area: &Area) -> Result<(), String> {
        const ROW: f64 = 20.0;
        /// Characters that fit into the legend at this size.
        const ROOM: usize = 28;
        let at = |x: f64, y: f64| ((x * f64::from(FINE)) as i32, (y * f64::from(FINE)) as i32);
        let short = |name: &str| match name.char_indices().nth(ROOM) {
            Some((end, _)) => format!("{}…", name[..end].trim_end()),
            None => name.to_owned(),
        };
        for (index, line) in self.series.iter().enumerate() {
            let y = 16.0 + ROW * index as f64;
            let colour = line_colour(index, line);
            if !line.band.is_empty() {
                let corners = [at(4.0, y - 6.0), at(26.0, y + 6.0)];
                area.draw(&Rectangle::new(corners, colour.mix(0.16).filled())).map_err(text)?;
            }
            let spans: &[(f64, f64)] = match line.mark {
                Mark::Line | Mark::Joined => &[(4.0, 26.0)],
                Mark::Dashed => &[(4.0, 11.0), (15.0, 22.0)],
                Mark::Points => &[],
            };
            for &(from, to) in spans {
                let stroke = colour.stroke_width(2 * FINE);
                area.draw(&PathElement::new([at(from, y), at(to, y)], stroke)).map_err(text)?;
            }
            if matches!(line.mark, Mark::Points | Mark::Joined) {
                area.draw(&Circle::new(at(15.0, y), 3 * FINE, colour.filled())).map_err(text)?;
            }
            write(area, &short(&line.name), (34.0, y - 7.0), 12.0, false, INK)?;
        }
        for (row, shade) in self.shaded.iter().filter(|shade| !shade.intervals.is_empty()).enumerate() {
            let y = 24.0 + ROW * (self.series.len() + row) as f64;
            let corners = [at(4.0, y - 6.0), at(26.0, y + 6.0)];
            area.draw(&Rectangle::new(corners, shade_colour(shade.strength).filled())).map_err(text)?;
            write(area, &short(&shade.name), (34.0, y - 7.0), 12.0, false, INK)?;
        }
        Ok(())
    }

    /// Number of points that cannot be shown.
    fn left_out(&self) -> usize {
        let points = self.series.iter().flat_map(|line| &line.points);
        points.filter(|[x, y]| !self.x.shows(*x) || !self.y.shows(*y)).count()
    }
}

/// An SVG document of this size [px] that scales to any width. `name` identifies it in errors.
pub(super) fn document(
    name: &str,
    [width, height]: [u32; 2],
    draw: impl FnOnce(&Area) -> Result<(), String>,
) -> Result<String, OutputError> {
    let mut svg = String::new();
    let drawn = {
        let root = SVGBackend::with_string(&mut svg, (width * FINE, height * FINE)).into_drawing_area();
        root.fill(&WHITE).map_err(text).and_then(|()| draw(&root)).and_then(|()| root.present().map_err(text))
    };
    drawn.map_err(|reason| OutputError::Encode(format!("plot \"{name}\""), reason))?;
    let fine = format!(r#"<svg width="{}" height="{}""#, width * FINE, height * FINE);
    let shown = format!(r#"<svg role="img" width="{width}" height="{height}""#);
    // Only texts hold hidden characters. XML forbids some of them.
    Ok(plain_lines(&svg.replacen(&fine, &shown, 1)).into_owned())
}

/// Draws title and subtitle at the upper left of an area.
pub(super) fn draw_title(area: &Area, title: &str, subtitle: &str) -> Result<(), String> {
    write(area, title, (14.0, 8.0), 16.0, true, INK)?;
    write(area, subtitle, (14.0, 29.0), 12.0, false, FAINT)
}

/// Ten distinct colours (Tableau 10), repeated after the tenth.
fn line_colour(index: usize, line: &PlotLine) -> RGBColor {
    let colour = colorous::TABLEAU10[line.colour.unwrap_or(index) % colorous::TABLEAU10.len()];
    RGBColor(colour.r, colour.g, colour.b)
}

fn shade_colour(strength: f64) -> RGBAColor {
    RGBColor(70, 80, 100).mix(0.22 * strength.clamp(0.0, 1.0))
}

fn font(size: f64, bold: bool, colour: RGBColor) -> TextStyle<'static> {
    let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
    // The SVG backend divides sizes by 1.24.
    let font = FontDesc::new(FontFamily::SansSerif, size * 1.24 * f64::from(FINE), style);
    TextStyle { color: colour.to_backend_color(), ..TextStyle::from(font) }
}

/// Writes a line whose upper left corner is at a place [px].
pub(super) fn write(
    area: &Area,
    line: &str,
    (x, y): (f64, f64),
    size: f64,
    bold: bool,
    colour: RGBColor,
) -> Result<(), String> {
    let style = font(size, bold, colour).pos(Pos::new(HPos::Left, VPos::Top));
    let place = ((x * f64::from(FINE)) as i32, (y * f64::from(FINE)) as i32);
    area.draw(&Text::new(line.to_owned(), place, style)).map_err(text)
}

fn text(error: impl Display) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<[f64; 2]>) -> Plot {
        let series = vec![PlotLine { name: "a".into(), points, ..PlotLine::default() }];
        Plot { title: "T".into(), x: Axis::linear("time [s]"), y: Axis::linear("y [K]"), series, ..Plot::default() }
    }

    #[test]
    fn the_document_is_whole_repeatable_and_escaped() {
        let mut plot = plot(vec![[0.0, 1.0], [1.0, 2.0]]);
        plot.title = "a < b & \"c\"".into();
        plot.series[0].name = "<script>".into();
        let svg = plot.svg().unwrap();
        assert!(svg.starts_with("<svg role=\"img\" width=\"900\"") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("a &lt; b &amp; &quot;c&quot;") && svg.contains("&lt;script&gt;"));
        assert!(svg.contains("time [s]") && svg.contains("y [K]"));
        assert_eq!(svg, plot.svg().unwrap());
    }

    #[test]
    fn a_gap_divides_a_line_and_is_told() {
        let whole = plot((0..10).map(|i| [f64::from(i), 1.0]).collect());
        let mut broken = whole.clone();
        broken.series[0].points[5][1] = f64::NAN;
        // Legend and axes have the same number of polylines in both documents, so they cancel.
        let lines = |plot: &Plot| plot.svg().unwrap().matches("<polyline").count();
        assert_eq!(lines(&broken), lines(&whole) + 1);
        assert!(broken.svg().unwrap().contains("1 points not finite are left out"));
        assert!(!whole.svg().unwrap().contains("left out"));
    }

    #[test]
    fn plots_without_data_are_drawn() {
        for points in [vec![], vec![[1.0, 1.0]], vec![[f64::NAN, 1.0]]] {
            for log in [false, true] {
                let mut plot = plot(points.clone());
                plot.y.log = log;
                plot.shaded = vec![Shade { name: "umbra".into(), intervals: vec![(-5.0, 50.0)], strength: 1.0 }];
                assert!(plot.svg().is_ok());
            }
        }
        assert!(Plot::default().svg().is_ok());
    }
}
