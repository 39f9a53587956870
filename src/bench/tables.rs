//! The measurements as tables, for the terminal (Markdown) and for the page.

use super::hard;
use super::record::{Bench, CaseSummary, Integrated, Measured, Run, Spread};
use super::schemes::ABSENT;
use crate::output::html::{kelvin, significant};

/// A table with its title and what is to be said below it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Names of the columns, with units.
    pub head: Vec<&'static str>,
    /// Cells.
    pub rows: Vec<Vec<String>>,
    /// Sentences.
    pub notes: Vec<String>,
}

impl Table {
    /// As Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let head: Vec<String> = self.head.iter().map(|cell| (*cell).to_owned()).collect();
        let rule = format!("|{}\n", "---|".repeat(head.len()));
        let mut text = format!("{}\n\n{}{rule}", self.title, line(&head));
        text.extend(self.rows.iter().map(|row| line(row)));
        text.extend(self.notes.iter().map(|note| format!("\n{note}\n")));
        text
    }
}

/// Median, and the range in which eight of ten samples lie.
fn spread(spread: Option<Spread>) -> String {
    match spread {
        Some(Spread { median, p10, p90, .. }) => {
            format!("{} ({} to {})", significant(median), significant(p10), significant(p90))
        }
        None => "-".to_owned(),
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), significant)
}

/// The limits of a device.
pub fn limits(measured: &Measured) -> Option<Table> {
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
    Some(Table {
        title: format!("Limits of {}: median (10 to 90 %)", measured.name),
        head: vec!["what", "median (10 to 90 %)", "unit"],
        rows,
        notes: vec![format!("The clock of copies and dispatches is the {clock}.")],
    })
}

/// What a node costs.
pub fn responses(measured: &Measured) -> Option<Table> {
    let row = |row: &super::record::Response| {
        let name = row.response.clone();
        let nodes = row.nodes.to_string();
        match &row.failed {
            Some(reason) => vec![name, nodes, format!("not run: {reason}"), "-".into(), "-".into(), "-".into()],
            None => vec![
                name,
                nodes,
                spread(row.ns_a_node),
                significant(row.bytes_a_node),
                number(row.gigabytes_per_second),
                row.share_of_copy.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share)),
            ],
        }
    };
    (!measured.responses.is_empty()).then(|| Table {
        title: format!("Responses on {}: time of a step by the device's clock", measured.name),
        head: vec!["response", "nodes", "ns a node: median (10 to 90 %)", "bytes a node", "GB/s", "share of copy"],
        rows: measured.responses.iter().map(row).collect(),
        notes: vec![
            "Sun, infrared and albedo on every node, whose target moves every tick, but for a constant target, where time \
             alone passes. Bytes count every array that a step reads or writes once, neighbours' temperatures from the cache."
                .to_owned(),
        ],
    })
}

/// The integrators on a case.
pub fn integrators(measured: &Measured, integrated: &Integrated, case: &CaseSummary) -> Table {
    let mut notes = vec![format!(
        "{} nodes ({} of them arithmetic), {} conductors, stiffness {} (NUMERICS.md 3: {}); {} frames of {:.2} s. Path: 'workgroup' \
         is one that takes all stages of a dispatch, 'dispatches' a dispatch for every stage.",
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
    Table {
        title: format!("Integrators on {}: {}", measured.name, case.title),
        head: vec![
            "scheme",
            "path",
            "passes a frame",
            "sub-steps a frame",
            "dispatches a frame",
            "iterations a frame",
            "ms a frame: median (10 to 90 %)",
            "wall ms a frame",
            "rms error",
            "largest error",
        ],
        rows: integrated
            .runs
            .iter()
            .map(|run| row(run, case.frames))
            .chain(ABSENT.iter().map(|(name, why)| left_out(name, why)))
            .collect(),
        notes,
    }
}

fn kelvin_text(value: f64) -> String {
    let (value, unit) = kelvin(value);
    format!("{value} {unit}")
}

fn left_out(scheme: &str, why: &str) -> Vec<String> {
    let mut cells =
        vec![scheme.to_owned(), "-".to_owned(), "-".to_owned(), "-".to_owned(), "-".to_owned(), "-".to_owned()];
    cells.extend([why.to_owned(), "-".to_owned(), "-".to_owned(), "-".to_owned()]);
    cells
}

fn row(run: &Run, frames: usize) -> Vec<String> {
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
        run.path.clone(),
        a_frame(work.stages),
        a_frame(work.sub_steps),
        a_frame(work.dispatches),
        a_frame(work.iterations),
        spread(run.device_ms),
        number(run.wall_ms.map(|time| time.median)),
        kelvin_text(error.rms),
        kelvin_text(error.max),
    ]
}

/// Everything of one run, in the order of its devices.
pub fn all(bench: &Bench) -> Vec<Table> {
    let of = |measured: &Measured| {
        let mut tables: Vec<Table> = limits(measured).into_iter().chain(responses(measured)).collect();
        let with_case = measured.integrators.iter().zip(&bench.cases);
        tables.extend(with_case.map(|(integrated, case)| integrators(measured, integrated, case)));
        tables.extend(hard::record::table(&measured.name, &measured.hard));
        tables
    };
    bench.devices.iter().flat_map(of).collect()
}
