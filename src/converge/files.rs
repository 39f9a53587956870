//! Writes the results of a search: table, plot and settings.

use super::knobs::{KnobScene, knobs_of};
use super::pixels::PixelDifference;
use super::search::{ConvergeRow, Converged};
use crate::output::OutputError;
use crate::output::folder::Folder;
use crate::output::plot::{Mark, Plot, PlotLine};
use crate::output::plot_axis::Axis;

const TABLE: &str = "converge.csv";
const PLOT: &str = "converge.svg";
const SETTINGS: &str = "settings.toml";

/// All files of the command.
pub(crate) const FILES: [&str; 3] = [TABLE, PLOT, SETTINGS];

/// Heads of the table.
const HEAD: [&str; 16] = [
    "setting",
    "before",
    "after",
    "change_rms_k",
    "change_p99_k",
    "change_max_k",
    "from_finest_rms_k",
    "from_finest_p99_k",
    "from_finest_max_k",
    "pixels",
    "left_out",
    "nodes",
    "steps",
    "step_ms",
    "processor_ms",
    "run_s",
];

/// Heads of the table that a terminal shows, without the last columns.
const SHORT_HEAD: [&str; 11] = [
    "setting",
    "before",
    "after",
    "change K",
    "p99",
    "max",
    "from finest K",
    "p99",
    "max",
    "ms a step",
    "processor ms",
];

/// Writes every file.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Folder, converged: &Converged) -> Result<(), OutputError> {
    let rows = converged.rows.iter().map(|row| cells(&converged.knobs, row));
    folder.write_csv(TABLE, std::iter::once(HEAD.map(str::to_owned).to_vec()).chain(rows))?;
    folder.write_bytes(PLOT, plot(converged).svg()?.as_bytes())?;
    folder.write_bytes(SETTINGS, settings(converged).as_bytes())
}

/// Name of a run, and its setting before and after.
fn names(knobs: &KnobScene, row: &ConvergeRow) -> [String; 3] {
    match row.refined {
        0 => ["as it is".to_owned(), String::new(), String::new()],
        refined if refined == knobs.all => ["all finer".to_owned(), String::new(), String::new()],
        refined => {
            let keys: Vec<_> = knobs_of(refined).collect();
            match keys[..] {
                [(bit, knob)] => {
                    let [before, after] = knobs.values(bit, knob);
                    [knob.key.to_owned(), before, after]
                }
                _ => [
                    keys.iter().map(|(_, knob)| knob.key).collect::<Vec<_>>().join(" + "),
                    String::new(),
                    String::new(),
                ],
            }
        }
    }
}

fn kelvins(difference: Option<PixelDifference>, digits: usize) -> [String; 3] {
    let kelvins = difference.map(|one| [one.rms, one.p99, one.max].map(|value| format!("{value:.digits$}")));
    kelvins.unwrap_or_default()
}

fn cells(knobs: &KnobScene, row: &ConvergeRow) -> Vec<String> {
    let compared = row.error.or(row.change).unwrap_or_default();
    let cost = &row.cost;
    let mut cells = names(knobs, row).to_vec();
    cells.extend(kelvins(row.change, 6));
    cells.extend(kelvins(row.error, 6));
    cells.extend([compared.pixels, compared.left_out, cost.nodes].map(|count| count.to_string()));
    cells.extend([cost.steps.to_string(), format!("{:.4}", cost.step_ms)]);
    cells.extend([cost.processor_ms.map_or(String::new(), |ms| format!("{ms:.4}")), format!("{:.3}", cost.wall_s)]);
    cells
}

/// The table that a terminal shows, with its head.
pub(crate) fn summary(converged: &Converged) -> Vec<Vec<String>> {
    let row = |row: &ConvergeRow| {
        let mut cells = names(&converged.knobs, row).to_vec();
        cells.extend(kelvins(row.change, 3));
        cells.extend(kelvins(row.error, 3));
        cells.push(format!("{:.2}", row.cost.step_ms));
        cells.push(row.cost.processor_ms.map_or(String::new(), |ms| format!("{ms:.1}")));
        cells
    };
    std::iter::once(SHORT_HEAD.map(str::to_owned).to_vec()).chain(converged.rows.iter().map(row)).collect()
}

/// Difference from the finest settings over the cost of the scene's time, both as factors of ten.
fn plot(converged: &Converged) -> Plot {
    let Converged { rows, knobs, within, left, .. } = converged;
    let steps = f64::from(rows[0].cost.steps.max(1));
    let point = |row: &ConvergeRow| [row.cost.stepping_ms() / steps, row.error.map_or(*left, |error| error.rms)];
    let line = |name: String, points: Vec<[f64; 2]>, mark| PlotLine { name, points, mark, ..PlotLine::default() };
    let mut series: Vec<PlotLine> = Vec::new();
    for row in rows {
        let [name, _, after] = names(knobs, row);
        series.push(match row.refined {
            0 => line("the scene as it is".to_owned(), vec![point(row)], Mark::Points),
            refined if refined == knobs.all => line("all finer: estimate".to_owned(), vec![point(row)], Mark::Points),
            refined if refined.count_ones() == 1 => {
                line(format!("{name} = {after}"), vec![point(&rows[0]), point(row)], Mark::Joined)
            }
            _ => line("several finer".to_owned(), vec![point(row)], Mark::Points),
        });
    }
    let costs: Vec<f64> = rows.iter().map(|row| point(row)[0]).collect();
    let ends = [costs.iter().copied().fold(f64::INFINITY, f64::min), costs.iter().copied().fold(0.0, f64::max)];
    series.push(line(format!("within {within} K"), ends.map(|cost| [cost, *within]).to_vec(), Mark::Dashed));
    Plot {
        title: format!("Kelvin against milliseconds: {}", knobs.scene().name),
        subtitle: "pixels against the run with all settings finer, whose own error is an estimate; lines begin at the scene as it is"
            .to_owned(),
        x: Axis { range: Some([0.9 * ends[0], ends[1] / 0.9]), ..Axis::logarithmic("time for a step of the scene [ms]") },
        y: Axis::logarithmic("difference of pixels, rms [K]"),
        series,
        ..Plot::default()
    }
}

/// The sentences of the result.
pub(crate) fn verdict(converged: &Converged) -> Vec<String> {
    let Converged { knobs, rows, within, left, chosen, images } = converged;
    let mut lines = Vec::new();
    if let Some(total) = rows[0].error {
        lines.push(format!(
            "as it is, the scene is {:.3} K rms (p99 {:.3}, at most {:.2} K) from all settings finer, over {} pixels of {images} images; {} pixels where \
             the part differs are left out",
            total.rms, total.p99, total.max, total.pixels, total.left_out
        ));
    }
    lines.push(format!(
        "the run with all settings finer is itself off by about {left:.3} K rms: an estimate from the change that each setting made, and no measurement"
    ));
    let error = |row: &ConvergeRow| row.error.map_or(f64::INFINITY, |error| error.rms);
    match chosen {
        Some(index) => lines.push(format!(
            "within {within} K rms at the least cost: {}: {:.3} K from all settings finer, and {left:.3} K for these",
            knobs.sentence(rows[*index].refined),
            error(&rows[*index])
        )),
        None => {
            let best = rows.iter().min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(&rows[0]);
            lines.push(format!(
                "nothing that was tested is shown to be within {within} K rms; the best is {}: {:.3} K from all settings finer, and {left:.3} K for these. \
                 Paste the finest settings and converge again",
                knobs.sentence(best.refined),
                error(best)
            ));
        }
    }
    lines
}

/// The chosen settings as TOML for the scene file, or the finest ones.
fn settings(converged: &Converged) -> String {
    let Converged { knobs, rows, chosen, .. } = converged;
    let refined = chosen.map_or(knobs.all, |index| rows[index].refined);
    let mut text: String = verdict(converged).iter().map(|line| format!("# {line}\n")).collect();
    text.push_str(match (chosen, refined) {
        (None, _) => "# The finest settings follow. They replace keys of the scene; all other keys stay.\n",
        (_, 0) => "# The scene stays as it is.\n",
        _ => "# These keys replace those of the scene; all other keys stay.\n",
    });
    text + &knobs.toml(refined)
}
