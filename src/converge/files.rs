//! Writes the results of a search: table, plot, page and settings.

use super::knobs::{Knob, KnobScene, Levels, number};
use super::pixels::PixelDifference;
use super::search::{AS_STATED, CHOICE, ConvergeRow, Converged, FINEST, changed_keys};
use crate::output::OutputError;
use crate::output::folder::Folder;
use crate::output::html::Html;
use crate::output::plot::{Mark, Plot, PlotLine};
use crate::output::plot_axis::Axis;
use crate::scene::{Draw, Edges};

pub(crate) const TABLE: &str = "converge.csv";
pub(crate) const PLOT: &str = "converge.svg";
pub(crate) const PAGE: &str = "converge.html";
pub(crate) const SETTINGS: &str = "settings.toml";

/// All files of the command.
pub(crate) const FILES: [&str; 4] = [TABLE, PLOT, PAGE, SETTINGS];

/// Heads of the table.
const HEAD: [&str; 17] = [
    "knob",
    "before",
    "after",
    "change_rms_k",
    "change_p99_k",
    "change_max_k",
    "error_rms_k",
    "error_p99_k",
    "error_max_k",
    "pixels",
    "left_out",
    "step_ms",
    "steps",
    "run_s",
    "processor_s",
    "nodes",
    "failed",
];

/// Writes every file.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write(folder: &Folder, found: &Converged, command_line: &str) -> Result<(), OutputError> {
    let rows = found.rows.iter().map(cells);
    folder.write_csv(TABLE, std::iter::once(HEAD.map(str::to_owned).to_vec()).chain(rows))?;
    let svg = plot(found).svg()?;
    folder.write_bytes(PLOT, svg.as_bytes())?;
    let settings = settings(found);
    folder.write_bytes(SETTINGS, settings.as_bytes())?;
    folder.write_bytes(PAGE, page(found, &svg, &settings, command_line).as_bytes())
}

fn cells(row: &ConvergeRow) -> Vec<String> {
    let kelvins = |difference: Option<PixelDifference>| match difference {
        Some(one) => [one.rms, one.p99, one.max].map(|value| format!("{value:.6}")),
        None => Default::default(),
    };
    let compared = row.error.or(row.change);
    let count =
        |value: fn(&PixelDifference) -> usize| compared.as_ref().map_or(String::new(), |one| value(one).to_string());
    let cost = &row.cost;
    let mut cells = vec![row.knob.clone(), row.before.clone(), row.after.clone()];
    cells.extend(kelvins(row.change));
    cells.extend(kelvins(row.error));
    cells.extend([count(|one| one.pixels), count(|one| one.left_out)]);
    cells.extend(match row.failed {
        Some(_) => [const { String::new() }; 5],
        None => [
            format!("{:.4}", cost.step_ms),
            cost.steps.to_string(),
            format!("{:.3}", cost.wall_s),
            cost.cpu_s.map_or(String::new(), |seconds| format!("{seconds:.2}")),
            cost.nodes.to_string(),
        ],
    });
    cells.push(row.failed.clone().unwrap_or_default());
    cells
}

/// The table that a terminal shows: the most important columns.
pub(crate) fn summary(found: &Converged) -> Vec<Vec<String>> {
    let kelvin = |difference: Option<PixelDifference>, value: fn(&PixelDifference) -> f64| {
        difference.as_ref().map_or("-".to_owned(), |one| format!("{:.3}", value(one)))
    };
    let head = ["setting", "before", "after", "rms K", "p99 K", "max K", "from finest", "ms a step", "processor s"];
    let row = |row: &ConvergeRow| {
        let mut cells = vec![row.knob.clone(), row.before.clone(), row.after.clone()];
        cells.extend([
            kelvin(row.change, |one| one.rms),
            kelvin(row.change, |one| one.p99),
            kelvin(row.change, |one| one.max),
        ]);
        cells.push(kelvin(row.error, |one| one.rms));
        cells.extend(match &row.failed {
            Some(_) => ["failed".to_owned(), "-".to_owned()],
            None => [format!("{:.3}", row.cost.step_ms), row.cost.cpu_s.map_or("-".to_owned(), |s| format!("{s:.1}"))],
        });
        cells
    };
    std::iter::once(head.map(str::to_owned).to_vec()).chain(found.rows.iter().map(row)).collect()
}

/// Error against the finest settings over the cost of the scene's time, both as factors of ten.
fn plot(found: &Converged) -> Plot {
    let base = found.rows.first().map_or(1, |row| row.cost.steps).max(1);
    let mut series: Vec<PlotLine> = Vec::new();
    for row in &found.rows {
        let Some(error) = row.error else { continue };
        let point = [row.cost.stepping_ms() / f64::from(base), error.rms];
        match series.iter_mut().find(|line| line.name == row.knob) {
            Some(line) => line.points.push(point),
            None => {
                let mark = if [AS_STATED, CHOICE].contains(&row.knob.as_str()) { Mark::Points } else { Mark::Joined };
                series.push(PlotLine { name: row.knob.clone(), points: vec![point], mark, ..PlotLine::default() });
            }
        }
    }
    let costs: Vec<f64> = series.iter().flat_map(|line| &line.points).map(|point| point[0]).collect();
    let ends = [costs.iter().copied().fold(f64::INFINITY, f64::min), costs.iter().copied().fold(0.0, f64::max)];
    series.push(PlotLine {
        name: format!("within {} K", found.within),
        points: ends.map(|cost| [cost, found.within]).to_vec(),
        mark: Mark::Dashed,
        ..PlotLine::default()
    });
    let finest = found.rows.iter().find(|row| row.knob == FINEST);
    let finest = finest.map_or(0.0, |row| row.cost.stepping_ms() / f64::from(base));
    Plot {
        title: format!("Kelvin against milliseconds: {}", found.knobs.scene().name),
        subtitle: format!(
            "error against all settings finer, which takes {finest:.2} ms; each line refines one setting"
        ),
        x: Axis::logarithmic("time for a step of the scene [ms]"),
        y: Axis::logarithmic("difference of pixels, rms [K]"),
        series,
        ..Plot::default()
    }
}

/// The sentences of the result.
pub(crate) fn verdict(found: &Converged) -> Vec<String> {
    let total = found.rows.iter().find(|row| row.knob == FINEST).and_then(|row| row.change);
    let mut lines = Vec::new();
    if let Some(total) = total {
        lines.push(format!(
            "as it is, the scene is {:.3} K rms (p99 {:.3}, at most {:.2} K) from all settings finer, over {} pixels of {} images; {} pixels where the part \
             differs are left out",
            total.rms, total.p99, total.max, total.pixels, found.images, total.left_out
        ));
    }
    lines.push(format!(
        "the finest settings themselves may still be off by {:.3} K rms (their last refinements, in squares)",
        found.finest_error
    ));
    lines.push(match &found.chosen {
        Some((levels, error)) => {
            let keys = changed_keys(&found.knobs, levels);
            let keys = if keys.is_empty() { "the scene's own settings".to_owned() } else { keys.join(", ") };
            format!(
                "within {} K at the least cost: {keys}; measured {:.3} K rms (p99 {:.3}, at most {:.2} K)",
                found.within, error.rms, error.p99, error.max
            )
        }
        None => format!("no settings below the finest were within {} K: {SETTINGS} has the finest", found.within),
    });
    lines
}

/// The chosen settings as TOML for the scene file.
fn settings(found: &Converged) -> String {
    let mut text = String::new();
    for line in verdict(found) {
        text.push_str(&format!("# {line}\n"));
    }
    text.push_str("# These keys replace those of the scene; all others stay.\n");
    let levels = found.chosen.as_ref().map_or(&found.finest, |(levels, _)| levels);
    text.push_str(&overlay(&found.knobs, levels));
    text
}

/// The keys that differ from the scene, in their sections.
fn overlay(knobs: &KnobScene, levels: &Levels) -> String {
    let is_finer = |knob: Knob| levels[knob.index()] > 0;
    let scene = knobs.refined(levels);
    let mut sections: Vec<(&str, Vec<String>)> = Vec::new();
    for knob in Knob::ALL.into_iter().filter(|knob| is_finer(*knob)) {
        let (section, key) = knob.key().split_once('.').unwrap_or(("", knob.key()));
        let mut lines = vec![format!("{key} = {}", knobs.value(knob, levels))];
        match knob {
            Knob::Mesh => lines.extend(scene.density.model.min.map(|edge| format!("min_edge = {}", number(edge)))),
            Knob::Step => {
                lines.push(format!("steps = {}", scene.time.steps));
                if (scene.time.warm_up_step - scene.time.step).abs() > 1e-9 * scene.time.step {
                    lines.push(format!("warm_up_step = {}", number(scene.time.warm_up_step)));
                }
                match &scene.time.draw {
                    Draw::Every(stride) => lines.push(format!("draw_every = {stride}")),
                    Draw::Steps(steps) => lines.push(format!("draw_steps = {steps:?}")),
                    Draw::None | Draw::Times(_) => {}
                }
                let times = 1 << levels[Knob::Step.index()];
                lines.push(format!("# A material that states t_max_steps needs {times} times as many."));
            }
            _ => {}
        }
        match sections.iter_mut().find(|(name, _)| *name == section) {
            Some((_, all)) => all.append(&mut lines),
            None => sections.push((section, lines)),
        }
    }
    let mut text: String = sections.iter().map(|(name, lines)| format!("\n[{name}]\n{}\n", lines.join("\n"))).collect();
    for rule in scene.density.parts.iter().filter(|_| is_finer(Knob::Mesh)) {
        let Edges { max, min } = rule.edges;
        text.push_str(&format!("\n[[part]]\nmatch = {:?}\n", rule.patterns));
        text.extend(max.map(|edge| format!("max_edge = {}\n", number(edge))));
        text.extend(min.map(|edge| format!("min_edge = {}\n", number(edge))));
    }
    text
}

fn page(found: &Converged, svg: &str, settings: &str, command_line: &str) -> String {
    let mut html = Html::page(&format!("Convergence of {}", found.knobs.scene().name));
    html.element("h1", &format!("Convergence of {}", found.knobs.scene().name));
    html.element("p", command_line);
    html.raw("</header>\n<main>\n");
    verdict(found).iter().chain(&found.warnings).for_each(|line| html.element("p", line));
    html.figure(svg, "Kelvin against milliseconds", PLOT);
    let rows = summary(found);
    if let Some((head, rows)) = rows.split_first() {
        let head: Vec<&str> = head.iter().map(String::as_str).collect();
        html.table(&head, rows.iter().cloned());
    }
    html.element("h2", "Settings to paste");
    html.element("pre", settings);
    html.into_page()
}
