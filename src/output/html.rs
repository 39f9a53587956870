//! HTML pages that need no network, script or other file: text, tables, pictures, links and readable numbers.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::report::SettingGroup;
use crate::text::{plain_lines, unsigned_zeros};

const STYLE: &str = include_str!("report.css");

/// Separator of thousands: narrow, without a line break.
const THIN_SPACE: char = '\u{202F}';

/// A page under construction. [`Html::element`] and [`Html::table`] escape their text. [`Html::raw`] does not.
#[derive(Default)]
pub(crate) struct Html(String);

impl Html {
    /// Starts a page with its style. The header stays open.
    pub(crate) fn page(title: &str) -> Self {
        let mut html = Self::default();
        html.raw("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
        html.raw("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
        html.element("title", title);
        html.raw(&format!("<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n"));
        html
    }

    /// Ends a page that [`Html::page`] began.
    pub(crate) fn into_page(mut self) -> String {
        self.raw("</main>\n</body>\n</html>\n");
        self.0
    }

    /// Adds markup without escaping it.
    pub(crate) fn raw(&mut self, markup: &str) {
        self.0.push_str(markup);
    }

    pub(crate) fn element(&mut self, tag: &str, text: &str) {
        self.0.push_str(&format!("<{tag}>{}</{tag}>\n", escape(text)));
    }

    /// Embeds a PNG picture with a title and a link to its file.
    pub(crate) fn picture(&mut self, png: &[u8], title: &str, file: &str) {
        let data = STANDARD.encode(png);
        let image = format!("<img src=\"data:image/png;base64,{data}\" alt=\"{}\">\n", escape(title));
        self.figure(&image, title, file);
    }

    /// Adds an image or SVG drawing with a title and a link to its file.
    pub(crate) fn figure(&mut self, content: &str, title: &str, file: &str) {
        self.raw("<figure>\n");
        // A drawing has no name of its own.
        let named = format!("<svg role=\"img\" aria-label=\"{}\" width", escape(title));
        self.raw(&content.replacen("<svg role=\"img\" width", &named, 1));
        self.raw(&format!("<figcaption>{}, ", escape(title)));
        self.raw(&format!("{}</figcaption>\n</figure>\n", link(file)));
    }

    /// Large numbers at the top: value, unit and meaning.
    pub(crate) fn headline(&mut self, figures: impl IntoIterator<Item = (String, String, String)>) {
        self.raw("<div class=\"headline\">\n");
        for (value, unit, what) in figures {
            let (value, unit) = (escape(&value), escape(&unit));
            self.raw(&format!("<div><span class=\"value\">{value} <small>{unit}</small></span>"));
            self.raw(&format!("<span class=\"what\">{}</span></div>\n", escape(&what)));
        }
        self.raw("</div>\n");
    }

    /// A list under a title. A list without items is left out.
    pub(crate) fn list(&mut self, title: &str, items: &[String], class: &str) {
        if items.is_empty() {
            return;
        }
        self.element("h2", title);
        self.raw(&format!("<ul class=\"{class}\">\n"));
        items.iter().for_each(|item| self.element("li", item));
        self.raw("</ul>\n");
    }

    /// Links to files in the folder.
    pub(crate) fn files<'a>(&mut self, names: impl IntoIterator<Item = &'a str>) {
        self.element("h2", "Files");
        self.raw("<ul class=\"plain\">\n");
        names.into_iter().for_each(|name| self.raw(&format!("<li>{}</li>\n", link(name))));
        self.raw("</ul>\n");
    }

    pub(crate) fn command(&mut self, line: &str) {
        self.raw(&format!("<p>Command: <code>{}</code></p>\n", escape(line)));
    }

    /// A table of names and values.
    pub(crate) fn pairs(&mut self, pairs: impl IntoIterator<Item = (String, String)>) {
        self.table(&[], pairs.into_iter().map(|(name, value)| vec![name, value]));
    }

    pub(crate) fn settings(&mut self, groups: &[SettingGroup]) {
        for group in groups {
            self.element("h3", &group.title);
            self.pairs(group.entries.iter().cloned());
        }
    }

    /// A table with an optional head. Columns of numbers are right-aligned.
    pub(crate) fn table(&mut self, head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) {
        let rows: Vec<Vec<String>> = rows.into_iter().collect();
        let numeric = |cell: &String| cell.replace(THIN_SPACE, "").parse::<f64>().is_ok();
        let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
        let class: Vec<&str> = (0..columns)
            .map(|column| {
                let all = !head.is_empty() && rows.iter().all(|row| row.get(column).is_some_and(numeric));
                if all { " class=\"number\"" } else { "" }
            })
            .collect();
        let row = |tag: &str, cells: &[&str]| -> String {
            let cells = cells.iter().zip(&class).map(|(cell, class)| format!("<{tag}{class}>{}</{tag}>", escape(cell)));
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        self.raw("<div class=\"wide\" role=\"group\" aria-label=\"Table\" tabindex=\"0\"><table>\n");
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

/// A difference with its unit.
pub(crate) fn kelvin_text(value: f64) -> String {
    let (value, unit) = kelvin(value);
    format!("{value} {unit}")
}

/// Escapes text for HTML content and quoted attributes.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    // HTML cannot represent control characters, even escaped.
    for character in unsigned_zeros(&plain_lines(text)).chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
    }
    escaped
}

pub(crate) fn link(path: &str) -> String {
    format!("<a href=\"{}\">{}</a>", link_target(path), escape(path))
}

fn link_target(path: &str) -> String {
    let mut target = String::new();
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'/' => {
                target.push(char::from(byte));
            }
            other => target.push_str(&format!("%{other:02X}")),
        }
    }
    target
}

/// Three significant digits with trailing zeros: 12.5, 0.310, 8230.
pub(crate) fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let decimals = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    if decimals > 6 { format!("{value:.2e}") } else { format!("{value:.decimals$}") }
}

/// A difference in a readable unit.
pub(crate) fn kelvin(value: f64) -> (String, &'static str) {
    match value.abs() {
        size if size >= 1.0 || size == 0.0 || !size.is_finite() => (significant(value), "K"),
        size if size >= 1e-3 => (significant(value * 1e3), "mK"),
        _ => (significant(value * 1e6), "µK"),
    }
}

/// A count with narrow no-break spaces between thousands.
pub(crate) fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(THIN_SPACE);
        }
        text.push(digit);
    }
    text
}

/// A memory size in a readable unit.
pub(crate) fn bytes(count: u64) -> String {
    match count {
        0..1024 => format!("{count} B"),
        1024..1_048_576 => format!("{} KiB", significant(count as f64 / 1024.0)),
        _ => format!("{} MiB", significant(count as f64 / 1_048_576.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            ["12", "1\u{202F}234", "1\u{202F}234\u{202F}567"]
        );
        assert_eq!([bytes(12), bytes(2048), bytes(7_987_408)], ["12 B", "2.00 KiB", "7.62 MiB"]);
    }

    #[test]
    fn only_columns_of_numbers_under_a_head_are_flush_right() {
        let rows = || [["a", "1\u{202F}200", "12 km"], ["b", "-0.5", "7"]].map(|row| row.map(str::to_owned).to_vec());
        let mut html = Html::default();
        html.table(&["name", "count", "length"], rows());
        let with_head = html.0;
        assert_eq!(with_head.matches("class=\"number\"").count(), 3, "head and two cells of the second column");
        let mut html = Html::default();
        html.table(&[], rows());
        assert!(!html.0.contains("number"));
    }
}
