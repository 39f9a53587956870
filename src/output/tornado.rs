//! A tornado plot as SVG: a bar for each parameter, from the effect of the low end of its range to the effect of the high end, the largest on top.

use plotters::prelude::*;

use super::OutputError;
use super::plot::{Area, FAINT, FINE, GRID, INK, TITLE, document, draw_title, write};
use super::ticks::{label, ticks};

/// Width of the plot, of the names on the left, and of the numbers beside the bars [px].
const WIDTH: f64 = 900.0;
const NAMES: f64 = 250.0;
const NUMBERS: f64 = 70.0;
/// Height of a row, of a bar, and of the axis below [px].
const ROW: f64 = 26.0;
const BAR: f64 = 14.0;
const AXIS: f64 = 46.0;
/// Characters of a name that fit.
const ROOM: usize = 36;

/// Colours of the low and the high end of a range.
const ENDS: [RGBColor; 2] = [RGBColor(78, 121, 167), RGBColor(242, 142, 44)];

/// A bar.
pub(crate) struct TornadoBar {
    pub(crate) name: String,
    /// The effects at the low and at the high end of the range.
    pub(crate) ends: [f64; 2],
}

/// The plot. `axis` names the quantity of the effects and its unit.
///
/// # Errors
/// A plot that cannot be drawn.
pub(crate) fn tornado(title: &str, subtitle: &str, axis: &str, bars: &[TornadoBar]) -> Result<String, OutputError> {
    let height = f64::from(TITLE) + 24.0 + ROW * bars.len() as f64 + AXIS;
    document(title, [WIDTH as u32, height as u32], |root| {
        draw_title(root, title, subtitle)?;
        draw(root, axis, bars).map_err(|error| error.to_string())
    })
}

fn at(x: f64, y: f64) -> (i32, i32) {
    ((x * f64::from(FINE)) as i32, (y * f64::from(FINE)) as i32)
}

fn draw(root: &Area, axis: &str, bars: &[TornadoBar]) -> Result<(), String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    let rectangle = |corners: [(f64, f64); 2], colour: RGBColor| {
        root.draw(&Rectangle::new(corners.map(|(x, y)| at(x, y)), colour.filled())).map_err(|error| text(&error))
    };
    let ends = bars.iter().flat_map(|bar| bar.ends);
    let [low, high] = ends.fold([0.0f64; 2], |[low, high], end| [low.min(end), high.max(end)]);
    let span = if high > low { high - low } else { 1.0 };
    let [left, right] = [NAMES + NUMBERS, WIDTH - NUMBERS];
    let place = |value: f64| left + (right - left) * (value - low) / span;
    let top = f64::from(TITLE) + 24.0;
    let bottom = top + ROW * bars.len() as f64;
    for (end, name) in ["low end of the range", "high end of the range"].into_iter().enumerate() {
        let x = left + 170.0 * end as f64;
        rectangle([(x, top - 18.0), (x + 14.0, top - 6.0)], ENDS[end])?;
        write(root, name, (x + 20.0, top - 19.0), 12.0, false, INK)?;
    }
    let marks = ticks(low, high.max(low + span), 7);
    for value in &marks.values {
        rectangle([(place(*value) - 0.5, top), (place(*value) + 0.5, bottom + 4.0)], GRID)?;
        let number = label(*value, marks.step);
        write(root, &number, (place(*value) - 3.2 * number.chars().count() as f64, bottom + 8.0), 12.0, false, INK)?;
    }
    write(root, axis, (0.5 * (left + right) - 80.0, bottom + 27.0), 13.0, false, INK)?;
    for (row, bar) in bars.iter().enumerate() {
        let y = top + ROW * row as f64 + 0.5 * (ROW - BAR);
        for (end, colour) in bar.ends.into_iter().zip(ENDS) {
            let [from, to] = [place(end.min(0.0)), place(end.max(0.0))];
            rectangle([(from, y), (to, y + BAR)], colour)?;
        }
        for end in bar.ends {
            let number = format!("{end:+.2}");
            let beside = if end < 0.0 { -6.2 * number.len() as f64 - 4.0 } else { 5.0 };
            let same_side = bar.ends[0] * bar.ends[1] > 0.0;
            let is_shorter = end.abs() < bar.ends[0].abs().max(bar.ends[1].abs());
            if !(same_side && is_shorter) {
                write(root, &number, (place(end) + beside, y), 11.0, false, FAINT)?;
            }
        }
        let name: String = match bar.name.char_indices().nth(ROOM) {
            Some((end, _)) => format!("{}\u{2026}", bar.name[..end].trim_end()),
            None => bar.name.clone(),
        };
        write(root, &name, (14.0, y), 12.0, false, INK)?;
    }
    rectangle([(place(0.0) - 0.7, top), (place(0.0) + 0.7, bottom + 4.0)], FAINT)
}

#[cfg(test)]
mod tests {
    use super::{TornadoBar, tornado};

    #[test]
    fn bars_lie_between_the_ends_and_have_names_and_numbers() {
        let bar = |name: &str, ends| TornadoBar { name: name.to_owned(), ends };
        let bars = [bar("emissivity <b>", [3.0, -2.5]), bar("albedo", [-0.5, 0.5]), bar("none", [0.0, 0.0])];
        let svg = tornado("title", "subtitle", "change [K]", &bars).unwrap();
        assert!(svg.contains("emissivity &lt;b&gt;") && svg.contains("+3.00") && svg.contains("-2.50"));
        assert!(svg.contains("low end of the range") && svg.contains("change [K]"));
        let widths = |colour: &str| -> Vec<f64> {
            let bars = svg.split("<rect ").filter(|rect| rect.contains(colour)).skip(1);
            let width = |rect: &str| rect.split("width=\"").nth(1)?.split('"').next()?.parse().ok();
            bars.map(|rect| width(rect).expect("a width")).collect()
        };
        let [low, high] = [widths("#4E79A7"), widths("#F28E2C")];
        assert!((low[0] / high[0] - 1.2).abs() < 0.01 && (low[1] - high[1]).abs() < 2.0, "{low:?} {high:?}");
        assert!(tornado("", "", "", &[]).is_ok());
    }
}
