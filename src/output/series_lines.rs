//! The lines of the plots of a run, read from its growing tables in a stream, so that memory does not grow with the steps.

use std::io::Read;

use super::OutputError;
use super::clock::DisplayClock;
use super::plot::PlotLine;
use super::series::TemperatureSeries;
use super::thinned::Thinned;

const MOST_LINES: usize = 10;

/// Lines of one kind: materials, parts or probes.
pub(crate) struct LineGroup {
    /// Lines that have values.
    pub(crate) count: usize,
    /// The lines with the widest swing, thinned.
    pub(crate) lines: Vec<PlotLine>,
}

/// The lines of `series.csv`.
pub(crate) struct SeriesLines {
    pub(crate) clock: DisplayClock,
    /// Whether the bands of parts and probes are their uncertainty.
    pub(crate) with_sigma: bool,
    pub(crate) materials: LineGroup,
    pub(crate) parts: LineGroup,
    pub(crate) probes: LineGroup,
}

/// A line in the table: its name, the column of its mean, and its band.
struct LineColumn {
    name: String,
    at: usize,
    band: LineBand,
}

/// The band about a line.
#[derive(Clone, Copy)]
enum LineBand {
    None,
    /// From the least to the greatest value, which stand beside the mean.
    Extremes,
    /// Two standard deviations to both sides, which stand in this column.
    Sigma(usize),
}

impl LineBand {
    fn ends(self, mean: f64, at: usize, cell: &dyn Fn(usize) -> Option<f64>) -> Option<(f64, f64)> {
        match self {
            Self::None => None,
            Self::Extremes => cell(at - 1).zip(cell(at + 1)),
            Self::Sigma(column) => cell(column).map(|sigma| (mean - 2.0 * sigma, mean + 2.0 * sigma)),
        }
    }
}

impl SeriesLines {
    /// Reads the table twice, with the columns of `series`, after which columns of the uncertainty may follow. `open` opens it.
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn read<R: Read>(
        series: &TemperatureSeries,
        with_sigma: bool,
        mut open: impl FnMut() -> Result<R, OutputError>,
    ) -> Result<Self, OutputError> {
        let summaries = |names: &[String], first: usize| -> Vec<LineColumn> {
            let one = |(i, name): (usize, &String)| LineColumn {
                name: name.clone(),
                at: first + 3 * i + 1,
                band: LineBand::Extremes,
            };
            names.iter().enumerate().map(one).collect()
        };
        let mut parts = summaries(series.parts(), 1);
        let after = 1 + 3 * parts.len();
        let materials = summaries(series.materials(), after);
        let after = after + 3 * materials.len() + 3;
        let probe =
            |(i, name): (usize, &String)| LineColumn { name: name.clone(), at: after + i, band: LineBand::None };
        let mut probes: Vec<LineColumn> = series.probes().iter().enumerate().map(probe).collect();
        if with_sigma {
            let first = after + probes.len();
            parts.iter_mut().chain(&mut probes).zip(first..).for_each(|(line, at)| line.band = LineBand::Sigma(at));
        }

        let columns: Vec<&LineColumn> = parts.iter().chain(&materials).chain(&probes).collect();
        let mut swings = vec![[f64::INFINITY, f64::NEG_INFINITY]; columns.len()];
        let mut present = vec![false; columns.len()];
        let (mut rows, mut until) = (0, 0.0f64);
        each_row(open()?, |cell| {
            rows += 1;
            until = until.max(cell(0).map_or(0.0, f64::abs));
            for ((column, swing), present) in columns.iter().zip(&mut swings).zip(&mut present) {
                if let Some(value) = cell(column.at) {
                    *present = true;
                    if value.is_finite() {
                        *swing = [swing[0].min(value), swing[1].max(value)];
                    }
                }
            }
        })?;
        let clock = DisplayClock::until(until);
        let ranges = [0..parts.len(), parts.len()..parts.len() + materials.len()];
        let [of_parts, of_materials] = ranges.map(|range| widest(range, &present, &swings));
        let of_probes = widest(parts.len() + materials.len()..columns.len(), &present, &swings);

        let chosen: Vec<usize> =
            [&of_parts, &of_materials, &of_probes].into_iter().flat_map(|kind| kind.1.clone()).collect();
        let mut lines: Vec<[Thinned; 2]> = chosen.iter().map(|_| [Thinned::of(rows), Thinned::of(rows)]).collect();
        each_row(open()?, |cell| {
            let Some(time) = cell(0).map(|time| clock.time(time)) else { return };
            for (index, [points, band]) in chosen.iter().zip(&mut lines) {
                let LineColumn { at, band: kind, .. } = *columns[*index];
                if let Some(mean) = cell(at) {
                    points.push([time, mean, mean], 0);
                    if let Some((least, greatest)) = kind.ends(mean, at, cell) {
                        band.push([time, least, greatest], 0);
                    }
                }
            }
        })?;
        let mut made = chosen.iter().zip(lines).map(|(index, [points, band])| PlotLine {
            name: columns[*index].name.clone(),
            points: points.points().iter().map(|[time, mean, _]| [*time, *mean]).collect(),
            band: band.points(),
            ..PlotLine::default()
        });
        let mut kind = |(count, chosen): (usize, Vec<usize>)| LineGroup {
            count,
            lines: made.by_ref().take(chosen.len()).collect(),
        };
        let (parts, materials, probes) = (kind(of_parts), kind(of_materials), kind(of_probes));
        Ok(Self { clock, with_sigma, materials, parts, probes })
    }
}

/// The number of columns with values, and the columns with the widest swing, at most [`MOST_LINES`], in order.
fn widest(range: std::ops::Range<usize>, present: &[bool], swings: &[[f64; 2]]) -> (usize, Vec<usize>) {
    let mut there: Vec<usize> = range.filter(|index| present[*index]).collect();
    let count = there.len();
    let swing = |index: usize| swings[index][1] - swings[index][0];
    there.sort_by(|a, b| swing(*b).total_cmp(&swing(*a)).then(a.cmp(b)));
    there.truncate(MOST_LINES);
    there.sort_unstable();
    (count, there)
}

/// Calls a function for each row of a table with its cells as numbers. An empty cell has none.
pub(super) fn each_row(
    table: impl Read,
    mut row: impl FnMut(&dyn Fn(usize) -> Option<f64>),
) -> Result<(), OutputError> {
    let mut reader = csv::Reader::from_reader(table);
    let mut record = csv::ByteRecord::new();
    let failed = |error: csv::Error| OutputError::Mismatch(format!("a table of the run cannot be read: {error}"));
    while reader.read_byte_record(&mut record).map_err(failed)? {
        row(&|at| std::str::from_utf8(record.get(at)?).ok()?.parse().ok());
    }
    Ok(())
}
