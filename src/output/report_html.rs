//! `report.html`: one page that needs no network, script or other file.

use super::html::{Html, bytes, escape, kelvin, kelvin_text, link, significant, thousands};
use super::report::{HOW_TO_ASK, InputFile, PartBudget, Report};
use super::sigma::{LargestSigma, SigmaCause, SigmaReport};
use crate::simulation::check::Accuracy;
use crate::simulation::energy::{EnergyBalance, PartEnergy};
use crate::simulation::uncertainty::PixelError;
use crate::thermal::budget::CHANNELS;
use crate::trace::TimeAccount;

/// Most parts in the tables of energy and of budgets. `report.json` has all of them.
const MOST_PARTS: usize = 20;

pub(crate) fn page(report: &Report) -> String {
    let mut html = Html::page(&format!("{} - isotherm report", report.source.title));
    html.element("h1", &report.source.title);
    html.element(
        "p",
        &format!("{}, with isotherm {} on {}", report.source.scene.path, report.source.version, report.device.name),
    );
    if report.interrupted {
        html.raw("<p class=\"warning\">This run was stopped before its last step; what is here is complete.</p>\n");
    }
    html.raw("</header>\n<main>\n");
    headline(&mut html, report);
    html.list("Warnings", &report.warnings, "warning");
    for picture in &report.results.pictures {
        html.picture(&picture.png, &picture.title, &picture.file);
    }
    for plot in &report.results.plots {
        html.figure(&plot.svg, &plot.title, &plot.file);
    }
    pixel_error(&mut html, report.findings.pixel_error.as_ref());
    accuracy(&mut html, report.findings.accuracy.as_ref());
    energy(&mut html, report.findings.energy.as_ref());
    budgets(&mut html, &report.findings.budgets);
    uncertainty(&mut html, report.findings.sigma.as_ref());
    time(&mut html, report);
    costs(&mut html, report);
    settings(&mut html, report);
    files(&mut html, report);
    html.into_page()
}

/// Speed next to its error, because neither means anything alone.
fn headline(html: &mut Html, report: &Report) {
    let speed = &report.speed;
    let nodes = thousands(report.model.nodes);
    let mut figures = vec![];
    if let Some(time) = speed.ns_per_node_step {
        figures.push((significant(time), "ns", format!("per node and step, {nodes} nodes")));
    }
    if let Some(time) = speed.step_ms {
        figures.push((significant(time), "ms", "per thermal step".to_owned()));
    }
    if let Some(time) = speed.network_wall_ms {
        figures.push((significant(time), "ms", "wall time of the network in a step".to_owned()));
    }
    if let Some(time) = speed.image_ms {
        figures.push((significant(time), "ms", "per image, files not counted".to_owned()));
    }
    match &report.findings.pixel_error {
        Some(error) => {
            let (rms, unit) = kelvin(error.rms_k);
            figures.push((rms, unit, "error of a pixel's temperature, rms".to_owned()));
            let (p99, unit) = kelvin(error.p99_k);
            figures.push((p99, unit, "error of a pixel's temperature, in 99 of 100 pixels at most".to_owned()));
        }
        None => figures.push(("not asked for".into(), "", format!("error of a pixel's temperature: {HOW_TO_ASK}"))),
    }
    match &report.findings.accuracy.as_ref().filter(|accuracy| accuracy.nodes > 0) {
        Some(accuracy) => {
            let (largest, unit) = kelvin(accuracy.max_k);
            figures.push((
                largest,
                unit,
                "largest difference by rounding and implementation, from the f64 reference".to_owned(),
            ));
            let (rms, unit) = kelvin(accuracy.rms_k);
            figures.push((
                rms,
                unit,
                "rms difference by rounding and implementation, from the f64 reference".to_owned(),
            ));
        }
        None => {
            figures.push(("no rounding".into(), "", "was measured: nothing was compared with the reference".into()));
        }
    }
    html.headline(figures.into_iter().map(|(value, unit, what)| (value, unit.to_owned(), what)));
}

fn pixel_error(html: &mut Html, error: Option<&PixelError>) {
    let Some(error) = error else { return };
    html.element("h2", "Error of the pixels");
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    html.table(
        &["T_error, one standard deviation", "temperature"],
        [
            row("rms", kelvin_text(error.rms_k)),
            row("in 99 of 100 pixels at most", kelvin_text(error.p99_k)),
            row("largest", kelvin_text(error.max_k)),
            row("sample", format!("{} pixels of {} images", thousands(error.pixels), thousands(error.images))),
        ],
    );
    html.element(
        "p",
        "T_error is the error of the computation. Uncertain materials, orbits and shapes are no part of it.",
    );
}

fn accuracy(html: &mut Html, accuracy: Option<&Accuracy>) {
    let Some(accuracy) = accuracy else { return };
    html.element("h2", "Accuracy");
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let sample = format!(
        "{} of {} nodes, {} steps",
        thousands(accuracy.nodes),
        thousands(accuracy.of_nodes),
        thousands(accuracy.steps)
    );
    let place = format!("{}, step {}, {} s", accuracy.worst_node, accuracy.worst_step, accuracy.worst_time_s);
    if accuracy.nodes > 0 {
        html.table(
            &["Rounding and implementation: device against f64 reference", "temperature"],
            [
                row("largest difference", kelvin_text(accuracy.max_k)),
                row("at", place),
                row("rms difference", kelvin_text(accuracy.rms_k)),
                row("sample", sample),
            ],
        );
    }
    if let Some(error) = &accuracy.step_length {
        html.table(
            &["Error of the step length", "temperature"],
            [
                row("largest", kelvin_text(error.max_k)),
                row("at", format!("{}, {} s", error.worst_node, error.worst_time_s)),
                row("rms", kelvin_text(error.rms_k)),
                row("sample", format!("{} nodes that store heat", thousands(error.nodes))),
                row("measure", error.measure.clone()),
            ],
        );
    }
    accuracy.notes.iter().for_each(|note| html.element("p", note));
}

fn energy(html: &mut Html, balance: Option<&EnergyBalance>) {
    let Some(balance) = balance.filter(|balance| !balance.parts.is_empty()) else { return };
    html.element("h2", "Energy over the run");
    if let Some(closure) = balance.closure {
        html.element(
            "p",
            &format!(
                "The energy balance of the network closes to {closure:.1e} of the heat that it took. Emission is \
                 found from the temperatures at the steps, so the rest also shows the error of the step length."
            ),
        );
    }
    if balance.all.unstored_j != 0.0 {
        html.element(
            "p",
            "Surfaces with the response instant or transition store no heat. The last column is what they absorbed less what \
             they emitted: heat that a transition loses or, with a minus, makes.",
        );
    }
    let mut parts: Vec<&PartEnergy> = balance.parts.iter().collect();
    parts.sort_by(|a, b| b.absorbed_j.total_cmp(&a.absorbed_j));
    let rows = std::iter::once(&balance.all).chain(parts.into_iter().take(MOST_PARTS)).map(|part| {
        let joules = [part.absorbed_j, part.heated_j, part.received_j, part.emitted_j, part.stored_j, part.unstored_j];
        std::iter::once(part.part.clone()).chain(joules.map(|joules| significant(joules / 1e3))).collect()
    });
    html.table(
        &["part", "absorbed [kJ]", "heaters [kJ]", "received [kJ]", "emitted [kJ]", "stored [kJ]", "not stored [kJ]"],
        rows,
    );
    if balance.parts_left_out > 0 {
        let left_out = balance.parts_left_out;
        html.element("p", &format!("Parts without an account: {left_out}. Their response is radiative or given."));
    }
    if balance.parts.len() > MOST_PARTS {
        let rest = balance.parts.len() - MOST_PARTS;
        html.element("p", &format!("{rest} parts that absorb less are in report.json."));
    }
}

fn uncertainty(html: &mut Html, sigma: Option<&SigmaReport>) {
    let Some(sigma) = sigma else { return };
    html.element("h2", "Uncertainty by the ranges of parameters");
    let share = |share: f64| format!("{:+.1} %", 100.0 * share);
    let of_cause = |cause: &SigmaCause| {
        let value = cause.value.map_or("several".to_owned(), |value| format!("{value} {}", cause.unit));
        let [low, high] = cause.range_share.map(share);
        vec![cause.name.clone(), value, format!("{low} to {high}"), kelvin_text(cause.largest_k)]
    };
    html.table(
        &["parameter", "value", "range of 95 %", "its largest standard deviation"],
        sigma.causes.iter().map(of_cause),
    );
    let of_place = |place: &LargestSigma| {
        vec![place.place.clone(), kelvin_text(place.sigma_k), format!("{} s", place.time_s), place.cause.clone()]
    };
    html.table(
        &["part or probe", "largest T_sigma", "at", "most by"],
        sigma.places.iter().take(MOST_PARTS).map(of_place),
    );
    if sigma.places.len() > MOST_PARTS {
        html.element("p", &format!("{} more places are in report.json.", sigma.places.len() - MOST_PARTS));
    }
    html.element("p", "A range is four standard deviations wide. Every step of every part and probe is in series.csv.");
}

fn budgets(html: &mut Html, budgets: &[PartBudget]) {
    if budgets.is_empty() {
        return;
    }
    html.element("h2", "What warms and cools each part");
    html.element("p", "Gains over the area of the part, in the mean over the run [W/m2]. Their sum is 0.");
    let head: Vec<&str> = std::iter::once("part").chain(CHANNELS).collect();
    let row = |budget: &PartBudget| {
        let gains =
            CHANNELS.iter().map(|name| budget.mean_w_per_m2.get(name).map_or(String::new(), |gain| significant(*gain)));
        std::iter::once(budget.part.clone()).chain(gains).collect()
    };
    html.table(&head, budgets.iter().take(MOST_PARTS).map(row));
    if budgets.len() > MOST_PARTS {
        html.element("p", &format!("{} more parts are in report.json.", budgets.len() - MOST_PARTS));
    }
}

/// Works that took a smaller share of the time stand in `report.json` only.
const LEAST_TOLD: f64 = 2e-3;

/// Where the time of the run went. A work stands below the work that it is part of.
fn time(html: &mut Html, report: &Report) {
    let TimeAccount { wall_s: whole, named_s, works } = &report.speed.time;
    if works.is_empty() {
        return;
    }
    html.element("h2", "Where the time went");
    html.element(
        "p",
        &format!(
            "Rows without parts name {:.1} % of {} s of wall time. Processor time is of all threads meanwhile. Smaller works are in report.json.",
            100.0 * named_s / whole,
            significant(*whole)
        ),
    );
    let rows = works.iter().filter(|spent| spent.wall_s >= LEAST_TOLD * whole).map(|spent| {
        let work = format!("{}{}", "\u{2003}".repeat(spent.depth), spent.work);
        vec![
            spent.thread.to_owned(),
            work,
            significant(spent.wall_s),
            significant(spent.processor_s),
            thousands(spent.count),
        ]
    });
    html.table(&["thread", "work", "wall [s]", "processor [s]", "times"], rows);
}

fn costs(html: &mut Html, report: &Report) {
    if !report.passes.is_empty() {
        html.element("h2", "Time on the device");
        let rows = report.passes.iter().map(|pass| {
            let times = [pass.median_ms, pass.p10_ms, pass.p90_ms].map(significant);
            std::iter::once(pass.name.clone()).chain(times).chain([thousands(pass.count)]).collect()
        });
        html.table(&["pass", "median [ms]", "10 % [ms]", "90 % [ms]", "runs"], rows);
    }
    html.element("h2", "Run");
    let (model, speed, device) = (&report.model, &report.speed, &report.device);
    let mut rows = vec![("device".to_owned(), device.name.clone()), ("driver".to_owned(), device.driver.clone())];
    rows.extend(device.details.iter().cloned());
    rows.push(("nodes".to_owned(), thousands(model.nodes)));
    rows.extend(model.nodes_by_response.iter().map(|(name, nodes)| (format!("nodes, {name}"), thousands(*nodes))));
    rows.push(("triangles".to_owned(), thousands(model.triangles)));
    rows.push(("area".to_owned(), format!("{} m²", significant(model.area_m2))));
    rows.extend(report.buffers.iter().map(|buffer| (format!("buffer, {}", buffer.name), bytes(buffer.bytes))));
    if !report.buffers.is_empty() {
        rows.push(("buffers together".to_owned(), bytes(report.buffers.iter().map(|buffer| buffer.bytes).sum())));
    }
    rows.push(("steps, warm-up included".to_owned(), thousands(speed.steps)));
    rows.push(("images".to_owned(), thousands(speed.images)));
    for (memory, what) in speed.memory_b.into_iter().zip(["forecast", "at its peak"]) {
        rows.extend(memory.map(|memory| (format!("memory of the process, {what}"), bytes(memory))));
    }
    rows.push(("wall time, files included".to_owned(), format!("{} s", significant(speed.wall_s))));
    html.pairs(rows.into_iter().filter(|(_, value)| !value.is_empty()));
}

fn settings(html: &mut Html, report: &Report) {
    html.list("Assumed, because the scene does not say", &report.assumptions, "plain");
    html.list("Switched off in this scene", &report.switched_off, "plain");
    if !report.settings.is_empty() {
        html.element("h2", "Settings");
    }
    html.settings(&report.settings);
}

fn files(html: &mut Html, report: &Report) {
    html.element("h2", "Inputs");
    html.command(&report.source.command_line);
    let short = |hash: &str| format!("{}...", hash.chars().take(16).collect::<String>());
    let input = |file: &InputFile| vec![file.kind.clone(), file.path.clone(), short(&file.sha256)];
    let inputs = std::iter::once(&report.source.scene).chain(&report.source.inputs);
    html.table(&["input", "file", "SHA-256 (whole in report.json)"], inputs.map(input));
    if !report.results.files.is_empty() {
        html.element("h2", "Files");
        html.raw("<ul class=\"plain\">\n");
        for file in &report.results.files {
            html.raw(&format!("<li>{}: {}</li>\n", link(&file.path), escape(&file.what)));
        }
        html.raw("</ul>\n");
    }
    if !report.results.frames.is_empty() {
        html.raw(&format!("<details><summary>{} frames</summary>\n<table>\n", report.results.frames.len()));
        html.raw("<tr><th>step</th><th class=\"number\">time [s]</th><th class=\"number\">range [m]</th><th class=\"number\">camera in the body frame [m]</th><th class=\"number\">turn from the body frame (w, x, y, z)</th><th class=\"number\">planet's centre off the axis [deg]</th><th class=\"number\">planet in the view [%]</th><th>EXR</th><th>false colour</th></tr>\n");
        for frame in &report.results.frames {
            let picture = frame.picture.as_deref().map(link).unwrap_or_default();
            let (step, time) = (frame.step, frame.time_s);
            let place = frame.camera_m.map(significant).join(", ");
            html.raw(&format!("<tr><td>{step}</td><td class=\"number\">{time}</td>"));
            let turn = frame.camera_turn.map(|part| format!("{part:.4}")).join(", ");
            let angle = frame.planet_off_axis_deg.map(|angle| format!("{angle:.1}")).unwrap_or_default();
            let planet = frame.planet_share.map(|share| format!("{:.0}", 100.0 * share)).unwrap_or_default();
            for value in [significant(frame.range()), place, turn, angle, planet] {
                html.raw(&format!("<td class=\"number\">{value}</td>"));
            }
            html.raw(&format!("<td>{}</td><td>{picture}</td></tr>\n", link(&frame.file)));
        }
        html.raw("</table></details>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::report::tests::full;
    use crate::output::report::{FrameEntry, SettingGroup};

    #[test]
    fn text_from_outside_cannot_become_markup() {
        const EVIL: &str = "<script>alert('1')</script>\"&\u{1}\u{1b}\u{202e}";
        let evil = || EVIL.to_owned();
        let mut report = full();
        report.source.title = evil();
        report.source.command_line = evil();
        report.source.scene.path = evil();
        report.device.name = evil();
        report.warnings = vec![evil()];
        report.settings = vec![SettingGroup { title: evil(), entries: vec![(evil(), evil())] }];
        report.results.frames = vec![FrameEntry { file: evil(), picture: Some(evil()), ..FrameEntry::default() }];
        report.results.pictures[0].title = evil();
        report.results.pictures[0].file = evil();
        let page = page(&report);
        assert!(!page.contains("<script") && !page.contains(['\u{1}', '\u{1b}', '\u{202e}']));
        let escaped = "&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&quot;&amp;\\u{1}\\u{1b}\\u{202e}";
        assert_eq!(escape(EVIL), escaped);
        assert!(page.matches(escaped).count() >= 10);
        assert!(page.contains("href=\"%3Cscript%3E"));
    }

    #[test]
    fn the_page_needs_nothing_else() {
        let page = page(&full());
        for outside in ["http://", "https://", "<link", "<script", "@import", "url("] {
            assert!(!page.replace("http://www.w3.org/2000/svg", "").contains(outside), "{outside}");
        }
        assert!(page.contains("src=\"data:image/png;base64,AQID\"") && page.contains("<svg></svg>"));
    }

    #[test]
    fn speed_and_error_stand_together_before_everything_else() {
        let mut report = full();
        let text = page(&report);
        let place = |what: &str| text.find(what).unwrap();
        let first_section = place("<h2>");
        for figure in ["3.64 <small>ns", "1.13 <small>mK", "42.0 <small>µK"] {
            assert!(place(figure) < first_section, "{figure}");
        }
        // The error of the pixels comes before the difference from the twin, which is no error of theirs.
        assert!(place("1.50 <small>K") < place("1.13 <small>mK") && !text.contains("not asked for"));
        (report.findings.accuracy, report.findings.pixel_error) = (None, None);
        let text = page(&report);
        assert!(text.contains("nothing was compared") && text.contains("state error = true in [output]"));
    }

    #[test]
    fn every_element_is_closed() {
        for report in [full(), Report::default()] {
            let page = page(&report);
            for tag in
                ["html", "head", "body", "main", "table", "tr", "td", "th", "ul", "li", "div", "figure", "a", "p"]
            {
                let opened = page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
                assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
            }
        }
    }
}
