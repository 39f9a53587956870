//! `report.html`: speed and error on one page that needs no network and no script.

use super::integrators::IntegratorRun;
use super::limits::Limits;
use super::record::{Bench, DeviceMeasurements};
use super::tables;
use crate::output::html::{Html, kelvin, significant};
use crate::output::report::PlotEntry;

pub(crate) fn page(bench: &Bench, diagrams: &[PlotEntry]) -> String {
    let mut html = Html::page("Speed against error - isotherm bench");
    html.element("h1", "Speed against error");
    let names: Vec<&str> = bench.devices.iter().map(|measured| measured.name.as_str()).collect();
    html.element("p", &format!("isotherm {} on {}", bench.version, names.join(" and ")));
    if !bench.release {
        html.raw("<p class=\"warning\">Built without --release: times of the host are not those of a release.</p>\n");
    }
    if bench.quick {
        html.element("p", "--quick: fewer schemes, fewer nodes, 40 frames of the orbit, one run of each scheme, an orbit where a hard case lasts a day.");
    }
    html.raw("</header>\n<main>\n");
    html.headline(headline(bench));
    for diagram in diagrams {
        html.figure(&diagram.svg, &diagram.title, &diagram.file);
    }
    for table in tables::all_tables(bench) {
        html.element("h2", &table.title);
        let head: Vec<&str> = table.head.iter().map(String::as_str).collect();
        html.table(&head, table.rows);
        table.notes.iter().for_each(|note| html.element("p", note));
    }
    machine(&mut html, bench);
    html.into_page()
}

/// Time and error of the default integrator on every case of the first device.
fn headline(bench: &Bench) -> Vec<(String, String, String)> {
    let mut figures = Vec::new();
    let Some(first) = bench.devices.first() else { return figures };
    for measured in bench.devices.iter().filter(|measured| !measured.hard.is_empty()) {
        let count = |held| measured.hard.iter().filter(|row| row.holds == Some(held)).count();
        let (holds, misses) = (count(true), count(false));
        let what = format!("hard cases hold their limits on {}", measured.name);
        figures.push((holds.to_string(), format!("of {}", holds + misses), what));
    }
    for integrated in &first.integrators {
        let is_default = |run: &&IntegratorRun| run.scheme == "default, 5 mK";
        let Some(run) = integrated.runs.iter().find(is_default) else { continue };
        if let (Some(time), Some(error)) = (run.wall_ms, run.error) {
            let (rms, unit) = kelvin(error.rms);
            let what =
                format!("a frame of the case {}, default integrator, at {rms} {unit} rms error", integrated.case);
            figures.push((significant(time.median), "ms".to_owned(), what));
        }
    }
    if let Some(rate) = first.limits.as_ref().and_then(Limits::bandwidth) {
        figures.push((significant(rate), "GB/s".to_owned(), "read and written by a copy".to_owned()));
    }
    figures
}

fn machine(html: &mut Html, bench: &Bench) {
    html.element("h2", "Where and how");
    let load = |at: &Option<[f64; 3]>| match at {
        Some([one, five, fifteen]) => format!("{one}, {five}, {fifteen}"),
        None => "not known".to_owned(),
    };
    let mut rows: Vec<(String, String)> = Vec::new();
    for DeviceMeasurements { name, info, load_average: [before, after], stolen, .. } in &bench.devices {
        rows.push(("device".to_owned(), name.clone()));
        if let Some(info) = info {
            rows.push(("driver".to_owned(), info.driver.clone()));
            rows.push(("Vulkan".to_owned(), info.api_version.clone()));
        }
        rows.push(("load average before (1, 5, 15 minutes)".to_owned(), load(before)));
        rows.push(("load average after".to_owned(), load(after)));
        if let Some(stolen) = stolen {
            let share = format!("{:.1} % of what was asked for", 1e2 * stolen);
            rows.push(("processor time that other guests of the host took".to_owned(), share));
        }
    }
    rows.push(("processors".to_owned(), bench.processors.to_string()));
    rows.push(("wall time of everything".to_owned(), format!("{} s", significant(bench.wall_s))));
    html.pairs(rows);
    html.command(&bench.command_line);
    html.element(
        "p",
        "Times are medians with the range from the tenth to the ninetieth percentile, over all frames of all runs of a scheme, \
         after two frames to warm up. Passes are stages, each an evaluation of all exchanges, rejected sub-steps included. All \
         numbers are in bench.json.",
    );
}
