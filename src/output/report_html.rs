//! `report.html`: one page that needs no network, no script and no other file.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::report::{Accuracy, Report, SourceFile};

const STYLE: &str = include_str!("report.css");

/// The page of a report.
pub fn page(report: &Report) -> String {
    let mut html = Html::default();
    html.raw("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html.raw("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    html.element("title", &format!("{} - isotherm report", report.title));
    html.raw(&format!("<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n"));
    html.element("h1", &report.title);
    html.element("p", &format!("{}, with isotherm {} on {}", report.scene.path, report.version, report.device.name));
    if report.interrupted {
        html.raw("<p class=\"warning\">This run was stopped before its last step; what is here is complete up to there.</p>\n");
    }
    html.raw("</header>\n<main>\n");
    headline(&mut html, report);
    list(&mut html, "Warnings", &report.warnings, "warning");
    for picture in &report.pictures {
        html.raw("<figure>\n");
        let data = STANDARD.encode(&picture.png);
        html.raw(&format!("<img src=\"data:image/png;base64,{data}\" alt=\"{}\">\n", escape(&picture.title)));
        caption(&mut html, &picture.title, &picture.file);
    }
    for plot in &report.plots {
        html.raw("<figure>\n");
        html.raw(&plot.svg);
        caption(&mut html, &plot.title, &plot.file);
    }
    accuracy(&mut html, report.accuracy.as_ref());
    costs(&mut html, report);
    settings(&mut html, report);
    files(&mut html, report);
    html.raw("</main>\n</body>\n</html>\n");
    html.0
}

/// Text with everything replaced that HTML would read as markup, in content and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // HTML has no way to write these, escaped or not.
            control if control.is_control() && !matches!(control, '\n' | '\t') => escaped.push('\u{FFFD}'),
            other => escaped.push(other),
        }
    }
    escaped
}

/// A relative path as the target of a link.
fn link_target(path: &str) -> String {
    let mut target = String::new();
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'/' => target.push(char::from(byte)),
            other => target.push_str(&format!("%{other:02X}")),
        }
    }
    target
}

/// The page so far. Text goes through [`Html::element`] or [`Html::table`], which escape; markup
/// through [`Html::raw`].
#[derive(Default)]
struct Html(String);

impl Html {
    fn raw(&mut self, markup: &str) {
        self.0.push_str(markup);
    }

    fn element(&mut self, tag: &str, text: &str) {
        self.0.push_str(&format!("<{tag}>{}</{tag}>\n", escape(text)));
    }

    /// A table with a head, which may be empty. Columns of nothing but numbers are set flush right.
    fn table(&mut self, head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) {
        let rows: Vec<Vec<String>> = rows.into_iter().collect();
        let numeric = |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
        let class: Vec<&str> = (0..columns)
            .map(|column| {
                let all = column > 0 && rows.iter().all(|row| row.get(column).is_some_and(numeric));
                if all { " class=\"number\"" } else { "" }
            })
            .collect();
        let row = |tag: &str, cells: &[&str]| -> String {
            let cells = cells.iter().zip(&class).map(|(cell, class)| format!("<{tag}{class}>{}</{tag}>", escape(cell)));
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        self.raw("<div class=\"wide\"><table>\n");
        if !head.is_empty() {
            self.raw(&format!("<thead>{}</thead>\n", row("th", head)));
        }
        self.raw("<tbody>\n");
        for cells in &rows {
            self.raw(&row("td", &cells.iter().map(String::as_str).collect::<Vec<_>>()));
        }
        self.raw("</tbody>\n</table></div>\n");
    }
}

/// Speed beside its error: neither means anything without the other.
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
    if let Some(time) = speed.image_ms {
        figures.push((significant(time), "ms", "per image, files not counted".to_owned()));
    }
    match &report.accuracy {
        Some(accuracy) => {
            let (largest, unit) = kelvin(accuracy.max_k);
            figures.push((largest, unit, "largest difference from the f64 reference".to_owned()));
            let (rms, unit) = kelvin(accuracy.rms_k);
            figures.push((rms, unit, "rms difference from the f64 reference".to_owned()));
        }
        None => figures.push(("no error".into(), "", "was measured: nothing was compared with the reference".into())),
    }
    html.raw("<div class=\"headline\">\n");
    for (value, unit, what) in figures {
        html.raw(&format!("<div><span class=\"value\">{} <small>{unit}</small></span>", escape(&value)));
        html.raw(&format!("<span class=\"what\">{}</span></div>\n", escape(&what)));
    }
    html.raw("</div>\n");
}

fn caption(html: &mut Html, title: &str, file: &str) {
    html.raw(&format!("<figcaption>{}, ", escape(title)));
    html.raw(&format!("<a href=\"{}\">{}</a></figcaption>\n</figure>\n", link_target(file), escape(file)));
}

fn list(html: &mut Html, title: &str, items: &[String], class: &str) {
    if items.is_empty() {
        return;
    }
    html.element("h2", title);
    html.raw(&format!("<ul class=\"{class}\">\n"));
    items.iter().for_each(|item| html.element("li", item));
    html.raw("</ul>\n");
}

fn accuracy(html: &mut Html, accuracy: Option<&Accuracy>) {
    let Some(accuracy) = accuracy else { return };
    html.element("h2", "Accuracy");
    let kelvin = |value: f64| {
        let (value, unit) = kelvin(value);
        format!("{value} {unit}")
    };
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let sample = format!(
        "{} of {} nodes, {} steps",
        thousands(accuracy.nodes),
        thousands(accuracy.of_nodes),
        thousands(accuracy.steps)
    );
    let place = format!("{}, step {}, {} s", accuracy.worst_node, accuracy.worst_step, accuracy.worst_time_s);
    html.table(
        &["Device against f64 reference", "temperature"],
        [
            row("largest difference", kelvin(accuracy.max_k)),
            row("at", place),
            row("rms difference", kelvin(accuracy.rms_k)),
            row("sample", sample),
        ],
    );
    accuracy.notes.iter().for_each(|note| html.element("p", note));
}

fn costs(html: &mut Html, report: &Report) {
    if !report.passes.is_empty() {
        html.element("h2", "Time on the device");
        let time = |ms: f64| significant(ms);
        let rows = report.passes.iter().map(|pass| {
            let times = [pass.median_ms, pass.p10_ms, pass.p90_ms].map(time);
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
    rows.push(("wall time, files included".to_owned(), format!("{} s", significant(speed.wall_s))));
    html.table(&[], rows.into_iter().filter(|(_, value)| !value.is_empty()).map(|(name, value)| vec![name, value]));
}

fn settings(html: &mut Html, report: &Report) {
    list(html, "Assumed, because the scene does not say", &report.assumptions, "plain");
    list(html, "Switched off in this scene", &report.switched_off, "plain");
    if !report.settings.is_empty() {
        html.element("h2", "Settings");
    }
    for section in &report.settings {
        html.element("h3", &section.title);
        html.table(&[], section.entries.iter().map(|(name, value)| vec![name.clone(), value.clone()]));
    }
}

fn files(html: &mut Html, report: &Report) {
    html.element("h2", "Inputs");
    html.raw("<p>Command: ");
    html.raw(&format!("<code>{}</code></p>\n", escape(&report.command_line)));
    let input = |file: &SourceFile| vec![file.kind.clone(), file.path.clone(), file.sha256.clone()];
    html.table(&["", "file", "SHA-256"], std::iter::once(&report.scene).chain(&report.inputs).map(input));
    let link = |path: &str| format!("<a href=\"{}\">{}</a>", link_target(path), escape(path));
    if !report.files.is_empty() {
        html.element("h2", "Files");
        html.raw("<ul class=\"plain\">\n");
        for file in &report.files {
            html.raw(&format!("<li>{}: {}</li>\n", link(&file.path), escape(&file.what)));
        }
        html.raw("</ul>\n");
    }
    if !report.frames.is_empty() {
        html.raw(&format!("<details><summary>{} frames</summary>\n<table>\n", report.frames.len()));
        html.raw("<tr><th>step</th><th class=\"number\">time [s]</th><th>EXR</th><th>false colour</th></tr>\n");
        for frame in &report.frames {
            let picture = frame.picture.as_deref().map(link).unwrap_or_default();
            let (step, time) = (frame.step, frame.time_s);
            html.raw(&format!("<tr><td>{step}</td><td class=\"number\">{time}</td>"));
            html.raw(&format!("<td>{}</td><td>{picture}</td></tr>\n", link(&frame.file)));
        }
        html.raw("</table></details>\n");
    }
}

/// Three significant digits without trailing zeros lost: 12.5, 0.310, 8230.
fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let decimals = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    if decimals > 6 { format!("{value:.2e}") } else { format!("{value:.decimals$}") }
}

/// A difference in the unit in which it reads best.
fn kelvin(value: f64) -> (String, &'static str) {
    match value.abs() {
        size if size >= 1.0 || size == 0.0 || !size.is_finite() => (significant(value), "K"),
        size if size >= 1e-3 => (significant(value * 1e3), "mK"),
        _ => (significant(value * 1e6), "µK"),
    }
}

/// A count with thin spaces between thousands.
fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

fn bytes(count: u64) -> String {
    match count {
        0..1024 => format!("{count} B"),
        1024..1_048_576 => format!("{} KiB", significant(count as f64 / 1024.0)),
        _ => format!("{} MiB", significant(count as f64 / 1_048_576.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::report::tests::full;
    use crate::output::report::{FrameEntry, Section};

    #[test]
    fn text_from_outside_cannot_become_markup() {
        const EVIL: &str = "<script>alert('1')</script>\"&\u{1}";
        let evil = || EVIL.to_owned();
        let mut report = full();
        report.title = evil();
        report.command_line = evil();
        report.scene.path = evil();
        report.device.name = evil();
        report.warnings = vec![evil()];
        report.settings = vec![Section { title: evil(), entries: vec![(evil(), evil())] }];
        report.frames = vec![FrameEntry { file: evil(), picture: Some(evil()), ..FrameEntry::default() }];
        report.pictures[0].title = evil();
        report.pictures[0].file = evil();
        let page = page(&report);
        assert!(!page.contains("<script") && !page.contains('\u{1}'));
        let escaped = "&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&quot;&amp;\u{FFFD}";
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
        report.accuracy = None;
        assert!(page(&report).contains("nothing was compared"));
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

    #[test]
    fn numbers_read_well() {
        let cases = [(12.5, "12.5"), (0.31, "0.310"), (8231.4, "8231"), (0.0, "0"), (3.2e-9, "3.20e-9")];
        for (value, expected) in cases {
            assert_eq!(significant(value), expected);
        }
        assert_eq!(kelvin(1.13e-3), ("1.13".to_owned(), "mK"));
        assert_eq!(kelvin(2.4), ("2.40".to_owned(), "K"));
        assert_eq!(kelvin(4.2e-5), ("42.0".to_owned(), "µK"));
        assert_eq!(
            [thousands(12), thousands(1234), thousands(1_234_567)],
            ["12", "1\u{2009}234", "1\u{2009}234\u{2009}567"]
        );
        assert_eq!([bytes(12), bytes(2048), bytes(7_987_408)], ["12 B", "2.00 KiB", "7.62 MiB"]);
    }
}
