//! Writes the results of a search: table, plot and settings.

use super::knobs::{KnobScene, Refined, knobs_of};
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
const HEAD: &str = "setting,before,after,change_rms_k,change_p99_k,change_max_k,from_finest_rms_k,from_finest_p99_k,from_finest_max_k,pixels,left_out,\
                    nodes,steps,step_ms,processor_ms,run_s";
/// Columns that a terminal does not show.
const UNSHOWN: [&str; 4] = ["pixels", "left_out", "steps", "run_s"];

/// Writes every file.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Folder, converged: &Converged) -> Result<(), OutputError> {
    folder.write_csv(TABLE, table(converged))?;
    folder.write_bytes(PLOT, plot(converged).svg()?.as_bytes())?;
    folder.write_bytes(SETTINGS, settings(converged).as_bytes())
}

/// The table with its head.
fn table(converged: &Converged) -> Vec<Vec<String>> {
    let head = HEAD.split(',').map(str::to_owned).collect();
    std::iter::once(head).chain(converged.rows.iter().map(|row| cells(&converged.knobs, row))).collect()
}

/// The table that a terminal shows.
pub(crate) fn summary(converged: &Converged) -> Vec<Vec<String>> {
    let shown = |row: Vec<String>| {
        HEAD.split(',').zip(row).filter(|(head, _)| !UNSHOWN.contains(head)).map(|(_, cell)| cell).collect()
    };
    table(converged).into_iter().map(shown).collect()
}

fn cells(knobs: &KnobScene, row: &ConvergeRow) -> Vec<String> {
    let kelvins = |difference: Option<PixelDifference>| {
        let kelvins = difference.map(|one| [one.rms, one.p99, one.max].map(|value| format!("{value:.4}")));
        kelvins.unwrap_or_default()
    };
    let compared = row.error.or(row.change).unwrap_or_default();
    let cost = &row.cost;
    let mut cells = names(knobs, row.refined).to_vec();
    cells.extend(kelvins(row.change).into_iter().chain(kelvins(row.error)));
    cells.extend([compared.pixels, compared.left_out, cost.nodes].map(|count| count.to_string()));
    cells.extend([cost.steps.to_string(), format!("{:.3}", cost.step_ms)]);
    cells.extend([cost.processor_ms.map_or(String::new(), |ms| format!("{ms:.3}")), format!("{:.2}", cost.wall_s)]);
    cells
}

/// Name of a run, and its setting before and after.
fn names(knobs: &KnobScene, refined: Refined) -> [String; 3] {
    let keys: Vec<_> = knobs_of(refined).collect();
    let [before, after] = match keys[..] {
        [(bit, knob)] => knobs.values(bit, knob),
        _ => Default::default(),
    };
    let name = match refined {
        0 => "as it is".to_owned(),
        all if all == knobs.all => "all finer".to_owned(),
        _ => keys.iter().map(|(_, knob)| knob.key).collect::<Vec<_>>().join(" + "),
    };
    [name, before, after]
}

/// Difference from the finest settings over the cost of the scene's time, both as factors of ten.
fn plot(converged: &Converged) -> Plot {
    let Converged { rows, knobs, within, left, .. } = converged;
    let steps = f64::from(rows[0].cost.steps.max(1));
    let point = |row: &ConvergeRow| [row.cost.stepping_ms() / steps, row.error.map_or(*left, |error| error.rms)];
    let line = |name: String, points: Vec<[f64; 2]>, mark| PlotLine { name, points, mark, ..PlotLine::default() };
    let of_row = |row: &ConvergeRow| {
        let [name, _, after] = names(knobs, row.refined);
        match row.refined {
            0 => line("the scene as it is".to_owned(), vec![point(row)], Mark::Points),
            all if all == knobs.all => line("all finer: estimate".to_owned(), vec![point(row)], Mark::Points),
            one if one.is_power_of_two() => {
                line(format!("{name} = {after}"), vec![point(&rows[0]), point(row)], Mark::Joined)
            }
            _ => line("several finer".to_owned(), vec![point(row)], Mark::Points),
        }
    };
    let mut series: Vec<PlotLine> = rows.iter().map(of_row).collect();
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
    let best = rows.iter().min_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or(&rows[0]);
    let row = chosen.map_or(best, |index| &rows[index]);
    let [before, after] = match chosen {
        Some(_) => [format!("within {within} K rms at the least cost: "), String::new()],
        None => [
            format!("nothing that was tested is shown to be within {within} K rms; the best is "),
            ". Paste the finest settings and converge again".to_owned(),
        ],
    };
    lines.push(format!(
        "{before}{}: {:.3} K from all settings finer, and {left:.3} K for these{after}",
        knobs.sentence(row.refined),
        error(row)
    ));
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
