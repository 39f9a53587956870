//! The results as tables, for the terminal (Markdown) and for the page.

use super::drivers::DriverRow;
use super::frames::{FrameRow, IMAGE};
use super::frontier::{Frontier, FrontierReference, FrontierRow};
use super::hard::HardRow;
use super::integrators::{Integrated, IntegratorRun};
use super::models::{ChoiceRow, DRAW_EVERY, MOST_ORBITS, Moved};
use super::record::{Bench, DeviceMeasurements};
use super::responses::ResponseRow;
use super::schemes::ABSENT;
use super::truth::CaseSummary;
use crate::converge::search::seconds;
use crate::output::html::{kelvin_text, significant};
use crate::output::statistics::Percentiles;

/// A table with a title and notes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BenchTable {
    pub(crate) title: String,
    /// Names of the columns, with units.
    pub(crate) head: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
    /// Sentences below the table.
    pub(crate) notes: Vec<String>,
}

impl BenchTable {
    /// As Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule = format!("|{}\n", "---|".repeat(self.head.len()));
        let mut text = format!("{}\n\n{}{rule}", self.title, line(&self.head));
        text.extend(self.rows.iter().map(|row| line(row)));
        text.extend(self.notes.iter().map(|note| format!("\n{note}\n")));
        text
    }
}

/// The median, and the range of the middle 80 % of the samples.
fn spread(spread: Option<Percentiles>) -> String {
    match spread {
        Some(Percentiles { median, p10, p90, .. }) => {
            format!("{} ({} to {})", significant(median), significant(p10), significant(p90))
        }
        None => dash(),
    }
}

fn heads(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn number(value: Option<f64>) -> String {
    value.map_or(dash(), significant)
}

/// The text of an empty cell.
fn dash() -> String {
    "-".to_owned()
}

/// A row that ends with the reason for its missing cells.
fn not_run(mut cells: Vec<String>, reason: &str, columns: usize) -> Vec<String> {
    cells.push(format!("not run: {reason}"));
    cells.resize(columns, dash());
    cells
}

pub(crate) fn limits(measured: &DeviceMeasurements) -> Option<BenchTable> {
    let limits = measured.limits.as_ref()?;
    let mut rows: Vec<Vec<String>> = limits
        .copies
        .iter()
        .map(|copied| {
            let what = format!("copy of {} MiB, read and written", copied.bytes >> 20);
            vec![what, spread(copied.gigabytes_per_second), "GB/s".to_owned()]
        })
        .collect();
    let us = |what: &str, time| vec![what.to_owned(), spread(time), "us".to_owned()];
    rows.push(us("one empty dispatch, submitted and waited for (host's clock)", limits.submission_us));
    rows.push(us("each of 256 empty dispatches with barriers between", limits.dispatch_us));
    let clock = if limits.by_timestamps { "device's own" } else { "host's, for the device has no timestamps" };
    Some(BenchTable {
        title: format!("Limits of {}: median (10 to 90 %)", measured.name),
        head: heads(&["what", "median (10 to 90 %)", "unit"]),
        rows,
        notes: vec![format!("The clock of copies and dispatches is the {clock}.")],
    })
}

/// Cost of a node.
pub(crate) fn responses(measured: &DeviceMeasurements) -> Option<BenchTable> {
    let row = |row: &ResponseRow| {
        let name = row.response.clone();
        let nodes = row.nodes.to_string();
        match &row.failed {
            Some(reason) => not_run(vec![name, nodes], reason, 6),
            None => vec![
                name,
                nodes,
                spread(row.ns_a_node),
                significant(row.bytes_a_node),
                number(row.gigabytes_per_second),
                row.share_of_copy.map_or(dash(), |share| format!("{:.0} %", 100.0 * share)),
            ],
        }
    };
    (!measured.responses.is_empty()).then(|| BenchTable {
        title: format!("Responses on {}: time of a step by the device's clock", measured.name),
        head: heads(&["response", "nodes", "ns a node: median (10 to 90 %)", "bytes a node", "GB/s", "share of copy"]),
        rows: measured.responses.iter().map(row).collect(),
        notes: vec![
            "Sun, infrared and albedo act on every node, and its target moves at every step. With a constant target only time \
             passes. Bytes count every array that a step reads or writes once. Temperatures of neighbours come from the cache."
                .to_owned(),
        ],
    })
}

/// Whole steps of scenes, with a column for each pass.
pub(crate) fn frames(measured: &DeviceMeasurements) -> Option<BenchTable> {
    let mut names: Vec<&str> = Vec::new();
    for pass in measured.frames.iter().flat_map(|row| &row.passes) {
        if !names.contains(&pass.name.as_str()) {
            names.push(&pass.name);
        }
    }
    names.sort_by_key(|name| PASSES.iter().position(|known| known == name).unwrap_or(PASSES.len()));
    let mut head: Vec<String> =
        ["scene", "longest edge [m]", "shadows", "nodes", "bytes a node", "start-up [s]"].map(str::to_owned).to_vec();
    head.extend(names.iter().map(|name| format!("{name} [ms]")));
    head.extend(["step with image [ms]", "worst [ms]", "images a second", "step without [ms]"].map(str::to_owned));
    let row = |row: &FrameRow| {
        let shadows = if row.shadows { "on" } else { "off" };
        let mut cells = vec![row.scene.clone(), row.longest_edge_m.to_string(), shadows.to_owned()];
        if let Some(reason) = &row.failed {
            return not_run(cells, reason, head.len());
        }
        cells.extend([row.nodes.to_string(), significant(row.bytes_a_node), significant(row.start_up_s)]);
        cells.extend(names.iter().map(|name| {
            let pass = row.passes.iter().find(|pass| pass.name == *name);
            pass.map_or(dash(), |pass| {
                let rare = pass.ms.samples < u64::from(row.steps);
                let often = if rare { format!(", in {} steps", pass.ms.samples) } else { String::new() };
                format!("{}{often}", significant(pass.ms.median))
            })
        }));
        let step = row.whole_step_ms.map(|time| time.median);
        cells.extend([
            spread(row.whole_step_ms),
            number(row.worst_step_ms),
            number(step.map(|ms| 1e3 / ms)),
            spread(row.step_ms),
        ]);
        cells
    };
    let first = measured.frames.iter().find(|row| row.failed.is_none())?;
    Some(BenchTable {
        title: format!("Whole steps on {}: an image of {} x {} pixels", measured.name, IMAGE[0], IMAGE[1]),
        rows: measured.frames.iter().map(row).collect(),
        head,
        notes: vec![format!(
            "Medians over {} steps of about {} s, in which the Sun moves little: shadows are found anew only in the steps given. \
             Passes are timed by the device's clock. Steps are timed by the host's, from one image in host memory to the next, while \
             the host prepares the next step. The first image culls all triangles, later images cull those of joints that have moved.",
            first.steps,
            significant(first.step_s)
        )],
    })
}

pub(crate) fn models(measured: &DeviceMeasurements) -> Option<BenchTable> {
    let models = measured.models.as_ref()?;
    let base = models.choices.iter().find_map(|row| row.step_ms.filter(|_| row.from_base.is_none()));
    let kelvins = |moved: Option<Moved>| match moved {
        Some(moved) => [kelvin_text(moved.rms_k), kelvin_text(moved.max_k)],
        None => [dash(), dash()],
    };
    let row = |row: &ChoiceRow| {
        let mut cells = vec![row.choice.clone()];
        if let Some(reason) = &row.failed {
            return not_run(cells, reason, 8);
        }
        cells.extend([number(row.step_ms), number(row.step_ms.zip(base).map(|(step, base)| step / base))]);
        cells.extend(kelvins(row.from_base));
        cells.push(row.from_base.map_or(dash(), |moved| {
            format!("{} ({:.1} %)", significant(moved.radiance_rms), 1e2 * moved.radiance_rms / moved.radiance_mean)
        }));
        cells.extend(kelvins(row.from_network));
        cells
    };
    let notes = vec![format!(
        "Scene '{}', {} nodes, {} steps of {} s. The first row is the base; every other row changes one thing. Differences of \
         temperatures are weighted with area, over all steps; those of radiance are over the craft's pixels in an image every \
         {DRAW_EVERY} steps, with their share of its mean. The other responses approximate the network. The network starts from its \
         periodic state if everything is measured. The others warm up for {MOST_ORBITS} orbits at most. Surfaces exchange \
         radiation, and hide the planet from each other, in the last two rows alone.",
        models.scene,
        models.nodes,
        models.steps,
        significant(models.step_s)
    )];
    Some(BenchTable {
        title: format!("Model choices on {}: what each costs and changes", measured.name),
        head: heads(&[
            "choice",
            "ms a step",
            "over the base",
            "from the base: rms",
            "largest",
            "radiance, rms [W m-2 sr-1]",
            "from the network: rms",
            "largest",
        ]),
        rows: models.choices.iter().map(row).collect(),
        notes,
    })
}

/// Cost and error of each response, with and without shadows and radiation between surfaces (exchange).
pub(crate) fn frontier(measured: &DeviceMeasurements) -> Option<BenchTable> {
    let Frontier { rows, reference } = &measured.frontier;
    let accurate = rows.first().and_then(|row| row.error).map_or(f64::NAN, |error| error.rms);
    let told = match reference {
        None => "A quick measurement has no reference, so it has no errors.".to_owned(),
        Some(Err(reason)) => format!("There are no errors, because their reference could not run: {reason}"),
        Some(Ok(FrontierReference { settings, left, nodes, step_ms, wall_s, .. })) => format!(
            "Errors are of pixels that show the same part, against the {} with all light and {} settings of `isotherm converge` finer: \
             {settings}{}. That run has {nodes} nodes, takes {} ms a step and took {}. Its own error is not measured. Errors that halve with mesh and step would \
             leave it as far from the truth as the accurate network with all light is from it, {}.",
            if left.is_empty() { "accurate network" } else { "network" },
            if left.is_empty() { "all" } else { "the other" },
            if left.is_empty() {
                String::new()
            } else {
                format!(
                    ". It would take too long with {left}, which stay as they are, so their error is not in these figures"
                )
            },
            significant(*step_ms),
            seconds(*wall_s),
            kelvin_text(accurate)
        ),
    };
    let row = |row: &FrontierRow| {
        let mut cells = vec![row.response.clone(), row.light().to_owned()];
        if let Some(reason) = &row.failed {
            return not_run(cells, reason, 7);
        }
        let kelvins = |value: Option<f64>| value.map_or(dash(), kelvin_text);
        cells.push(number(row.step_ms));
        let errors = row.error.map_or([None; 3], |error| [error.rms, error.p99, error.max].map(Some));
        cells.extend(errors.map(kelvins));
        cells.push(kelvins(row.from_accurate_k));
        cells
    };
    (!rows.is_empty()).then(|| BenchTable {
        title: format!("Milliseconds against kelvin on {}", measured.name),
        head: heads(&[
            "response",
            "light between parts",
            "ms a step",
            "error of pixels: rms",
            "p99",
            "largest",
            "of it by response and light: rms from the accurate network on the same mesh",
        ]),
        rows: rows.iter().map(row).collect(),
        notes: vec![
            told,
            "Every run starts as the scene states, in the steps of the table of model choices.".to_owned(),
        ],
    })
}

pub(crate) fn drivers(bench: &Bench) -> Option<BenchTable> {
    let row = |row: &DriverRow| {
        let [first, other] = &row.devices;
        let devices = vec![first.clone(), other.clone()];
        if let Some(reason) = &row.failed {
            return not_run(devices, reason, 6);
        }
        let parts = format!("{} of {}", row.other_part, row.pixels);
        let cells = [kelvin_text(row.rms_k), kelvin_text(row.max_k), parts, format!("{:.1e}", row.radiance_relative)];
        devices.into_iter().chain(cells).collect()
    };
    let first = bench.drivers.first()?;
    Some(BenchTable {
        title: format!("The same scene on every device: '{}'", first.scene),
        head: heads(&[
            "device",
            "against",
            "temperatures, rms",
            "largest",
            "pixels of another part or material",
            "radiance, largest relative difference",
        ]),
        rows: bench.drivers.iter().map(row).collect(),
        notes: vec![
            "After 40 steps, in an image of 640 x 512 pixels; radiance where both show the same part.".to_owned(),
        ],
    })
}

/// The passes of a frame in order.
const PASSES: [&str; 5] = ["thermal_step", "cull", "radiance", "read radiance", "read identity"];

/// The integrators on a case.
pub(crate) fn integrators(integrated: &Integrated, case: &CaseSummary) -> BenchTable {
    let mut notes = vec![format!(
        "{} nodes ({} of them arithmetic), {} conductors, stiffness {} (docs/numerics.md 3: {}); {} frames of {:.2} s, in f64 on \
         the processor.",
        case.nodes,
        case.arithmetic,
        case.conductors,
        significant(case.stiffness),
        case.published_stiffness,
        case.frames,
        case.frame_s,
    )];
    let [rms, max] = [case.reference_error.rms, case.reference_error.max].map(kelvin_text);
    notes.push(format!(
        "Errors: all nodes at the ends of all frames, against RKL2 in f64 with {} sub-steps a frame, itself off by {rms} rms \
         and {max} at most.",
        case.reference_sub_steps
    ));
    BenchTable {
        title: format!("Integrators: {}", case.title),
        head: heads(&[
            "scheme",
            "passes a frame",
            "sub-steps a frame",
            "iterations a frame",
            "ms a frame: median (10 to 90 %)",
            "rms error",
            "largest error",
        ]),
        rows: integrated
            .runs
            .iter()
            .map(|run| row(run, case.frames))
            .chain(ABSENT.iter().map(|(name, why)| left_out(name, why)))
            .collect(),
        notes,
    }
}

fn left_out(scheme: &str, why: &str) -> Vec<String> {
    let mut cells = vec![dash(); 7];
    (cells[0], cells[4]) = (scheme.to_owned(), why.to_owned());
    cells
}

fn row(run: &IntegratorRun, frames: usize) -> Vec<String> {
    let (Some(work), Some(error)) = (run.work, run.error) else {
        return left_out(&run.scheme, &format!("not run: {}", run.failed.as_deref().unwrap_or("nothing was measured")));
    };
    let scheme = if work.frames < frames as u64 {
        format!("{} (its first {} frames: it took too long)", run.scheme, work.frames)
    } else {
        run.scheme.clone()
    };
    let a_frame = |count: u64| significant(count as f64 / work.frames.max(1) as f64);
    vec![
        scheme,
        a_frame(work.stages),
        a_frame(work.sub_steps),
        a_frame(work.iterations),
        spread(run.wall_ms),
        kelvin_text(error.rms),
        kelvin_text(error.max),
    ]
}

/// The hard cases of a device. `None` if they were not measured.
pub(crate) fn hard(measured: &DeviceMeasurements) -> Option<BenchTable> {
    let rows = &measured.hard;
    if rows.is_empty() {
        return None;
    }
    let cells = |row: &HardRow| {
        let error = match (&row.failed, &row.omitted, row.error) {
            (Some(reason), ..) => format!("failed: {reason}"),
            (None, Some(reason), _) => format!("- ({reason})"),
            (None, None, error) => error.map_or(dash(), |error| row.in_unit(error)),
        };
        let holds = match row.holds {
            Some(true) => "yes",
            Some(false) => "NO",
            None => "-",
        };
        vec![
            row.name.clone(),
            row.what.clone(),
            error,
            format!("{} ({})", row.in_unit(row.limit), row.limit_source),
            holds.to_owned(),
            row.remedy.clone(),
            format!("{} ({})", row.in_unit(row.without), row.removed),
        ]
    };
    let count = |wanted: Option<bool>| rows.iter().filter(|row| row.holds == wanted).count();
    let mut notes = vec![format!(
        "{} hold, {} miss, {} were not to be measured here. {:.0} s.",
        count(Some(true)),
        count(Some(false)),
        count(None),
        rows.iter().map(|row| row.wall_s).sum::<f64>()
    )];
    notes.extend(rows.iter().filter_map(HardRow::miss).map(|miss| format!("Missed: {miss}.")));
    Some(BenchTable {
        title: format!("Hard cases on {}", measured.name),
        head: heads(&[
            "case",
            "what",
            "largest error",
            "limit (source)",
            "holds",
            "remedy",
            "without it (in its place)",
        ]),
        rows: rows.iter().map(cells).collect(),
        notes,
    })
}

/// All tables of a run, in the order of its devices.
pub fn all_tables(bench: &Bench) -> Vec<BenchTable> {
    let row = |measured: &DeviceMeasurements| {
        let mut tables: Vec<BenchTable> = limits(measured)
            .into_iter()
            .chain(responses(measured))
            .chain(frames(measured))
            .chain(models(measured))
            .chain(frontier(measured))
            .collect();
        let with_case = measured.integrators.iter().zip(&bench.cases);
        tables.extend(with_case.map(|(integrated, case)| integrators(integrated, case)));
        tables.extend(hard(measured));
        tables
    };
    bench.devices.iter().flat_map(row).chain(drivers(bench)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_counts_what_holds_and_names_what_misses() {
        let row = |error: f64, holds| HardRow {
            name: "a case".to_owned(),
            unit: "K".to_owned(),
            error: Some(error),
            limit: 0.02,
            holds,
            without: f64::INFINITY,
            ..HardRow::default()
        };
        let rows = vec![row(0.01, Some(true)), row(0.03, Some(false)), HardRow { error: None, ..row(0.0, None) }];
        let measured = DeviceMeasurements { hard: rows, ..DeviceMeasurements::default() };
        let table = hard(&measured).unwrap();
        assert!(table.rows.iter().all(|cells| cells.len() == table.head.len()));
        assert_eq!(table.rows.iter().map(|cells| cells[4].as_str()).collect::<Vec<_>>(), ["yes", "NO", "-"]);
        assert!(table.rows[0][6].starts_with("no number"), "{:?}", table.rows[0]);
        assert!(table.notes[0].starts_with("1 hold, 1 miss, 1 were not"), "{:?}", table.notes);
        assert!(table.notes[1].contains("a case: 30.0 mK"), "{:?}", table.notes);
        assert_eq!(hard(&DeviceMeasurements::default()), None);
    }
}
