//! Pictures of one scene under three responses: temperatures on one scale, and differences from the third response.

use super::OutputError;
use embedded_graphics::text::Alignment;

use super::canvas::{Canvas, FAINT_INK, FontFace, INK, PAPER, Rgb};
use super::colour::{BACKGROUND, ColourScale};
use super::colour_bar::Bar;
use super::difference_scale::{DifferenceScale, LINEAR};
use super::ticks::{self, union};
use super::views::{Views, crop, temperature_range};

/// Space around the picture and between groups [px].
const MARGIN: u32 = 16;
/// Space between pictures [px].
const GAP: u32 = 6;
/// Height of the two title lines [px].
const TITLE_HEIGHT: u32 = 46;
/// Height of a colour bar with its text [px].
const SCALE_HEIGHT: u32 = 62;
/// The title and the scales of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Legend {
    /// First line of a picture.
    pub(crate) title: String,
    /// Names of the responses.
    pub(crate) names: [String; 3],
    pub(crate) temperature: ColourScale,
    pub(crate) difference: DifferenceScale,
    /// The shown part of every image: left, top, width and height [px].
    pub(crate) crop: [u32; 4],
}

impl Legend {
    /// One legend for all views. `range` [K] fixes the temperature scale, which otherwise covers the views.
    pub(crate) fn new(title: &str, names: [&str; 3], views: &[Views], range: Option<[f64; 2]>) -> Self {
        let covering = || ColourScale::covering(views.iter().filter_map(temperature_range));
        Self {
            title: title.to_owned(),
            names: names.map(str::to_owned),
            temperature: range.map_or_else(covering, ColourScale::new),
            difference: DifferenceScale::covering(views),
            crop: crop(views),
        }
    }

    fn colours(&self, view: &Views, colour: impl Fn(usize) -> Rgb) -> Canvas {
        let [left, top, width, height] = self.crop;
        let pixels = (top..top + height).flat_map(|y| (left..left + width).map(move |x| (y * view.width + x) as usize));
        let pixels = pixels.map(|pixel| if view.hit(pixel) { colour(pixel) } else { BACKGROUND });
        Canvas::from_pixels(width, height, pixels.collect())
    }

    /// The temperatures of a response in false colour.
    fn temperature(&self, view: &Views, response: usize) -> Canvas {
        self.colours(view, |pixel| self.temperature.colour(view.temperatures[response][pixel]))
    }

    /// The differences of a response in false colour.
    fn difference(&self, view: &Views, response: usize) -> Canvas {
        let [shown, reference] = [&view.temperatures[response], &view.temperatures[2]];
        self.colours(view, |pixel| self.difference.colour(shown[pixel] - reference[pixel]))
    }

    /// Size of a cell of at most this width [px].
    fn cell(&self, width: u32) -> [u32; 2] {
        let [_, _, w, h] = self.crop.map(f64::from);
        let scale = (f64::from(width) / w).min(1.2 * f64::from(width) / h);
        // Whole magnification factors keep pixels square.
        let scale = if scale >= 1.0 { scale.floor() } else { scale };
        [w * scale, h * scale].map(|size| size.round().max(1.0) as u32)
    }

    fn temperature_bar(&self, canvas: &mut Canvas, place: [u32; 3], views: &[Views]) {
        let ranges = views.iter().filter_map(temperature_range);
        let present = ranges.reduce(union);
        let [lower, upper] = [self.temperature.lower, self.temperature.upper];
        let most = (place[2] / 64).clamp(2, 12) as usize;
        let marks = ticks::ticks(lower, upper, most);
        let marks =
            marks.values.iter().map(|value| ((value - lower) / (upper - lower), ticks::label(*value, marks.step)));
        let bar = Bar { label: "temperature [K]", ends: [lower, upper], marks: marks.collect(), present };
        bar.draw(canvas, place, |share| self.temperature.colour((lower + (upper - lower) * share) as f32));
    }

    fn difference_bar(&self, canvas: &mut Canvas, place: [u32; 3], views: &[Views]) {
        let all = views.iter().flat_map(|view| view.differences(0).chain(view.differences(1)));
        let present = all.filter(|d| d.is_finite()).map(|d| [d, d]).reduce(union);
        let scale = &self.difference;
        let marks = scale.marks(f64::from(place[2])).into_iter();
        let marks = marks.map(|value| {
            (0.5 + 0.5 * scale.place(value), ticks::label(value, if value == 0.0 { 1.0 } else { value.abs() }))
        });
        let label = format!(
            "difference to {} [K], logarithmic beyond {}",
            self.names[2],
            ticks::label(LINEAR * scale.limit, LINEAR * scale.limit)
        );
        let bar = Bar { label: &label, ends: [-scale.limit, scale.limit], marks: marks.collect(), present };
        bar.draw(canvas, place, |share| scale.colour(scale.at(2.0 * share - 1.0) as f32));
    }
}

/// All views on one sheet. Each row has three temperature pictures and two difference pictures.
pub(crate) fn sheet(views: &[Views], legend: &Legend, details: &str) -> Result<Canvas, OutputError> {
    views.iter().try_for_each(Views::check)?;
    let [width, height] = legend.cell(260);
    let caption = FontFace::Normal.height() + 8;
    let header = FontFace::Title.height() + 8;
    let temperatures = 3 * width + 2 * GAP;
    let differences = 2 * width + GAP;
    let whole = temperatures + MARGIN + differences + 2 * MARGIN;
    let top = MARGIN + TITLE_HEIGHT + header;
    let rows = views.len() as u32;
    let mut canvas = Canvas::new(whole, top + rows * (height + caption) + MARGIN + SCALE_HEIGHT, PAPER);
    titles(&mut canvas, &legend.title, details);
    let column = |index: u32| MARGIN + index * (width + GAP) + if index > 2 { MARGIN - GAP } else { 0 };
    for (index, name) in (0u32..).zip(headings(&legend.names)) {
        let name = FontFace::Title.fit(&name, width);
        canvas.text(&name, column(index), MARGIN + TITLE_HEIGHT, FontFace::Title, Alignment::Left, INK);
    }
    for (row, view) in (0u32..).zip(views) {
        let y = top + row * (height + caption);
        for (index, image) in (0u32..).zip(pictures(view, legend)) {
            paste(&mut canvas, &image, column(index), y, [width, height]);
        }
        let below = y + height + 2;
        canvas.text(
            &FontFace::Normal.fit(&view.caption, temperatures),
            MARGIN,
            below,
            FontFace::Normal,
            Alignment::Left,
            FAINT_INK,
        );
        for (index, response) in [(3, 0), (4, 1)] {
            let text = view.rms(response).map_or("nothing in view".to_owned(), |rms| format!("rms in view {rms:.1} K"));
            canvas.text(
                &FontFace::Normal.fit(&text, width),
                column(index),
                below,
                FontFace::Normal,
                Alignment::Left,
                FAINT_INK,
            );
        }
    }
    let y = top + rows * (height + caption) + 6;
    legend.temperature_bar(&mut canvas, [MARGIN, y, temperatures], views);
    legend.difference_bar(&mut canvas, [column(3), y, differences], views);
    Ok(canvas)
}

/// One view, large: temperatures above differences, with the numbers below.
pub(crate) fn panel(view: &Views, legend: &Legend) -> Result<Canvas, OutputError> {
    view.check()?;
    let [width, height] = legend.cell(440);
    let header = FontFace::Title.height() + 8;
    let whole = 3 * width + 2 * GAP;
    let top = MARGIN + TITLE_HEIGHT + header;
    let lower = top + height + 10 + SCALE_HEIGHT + header;
    let mut canvas = Canvas::new(whole + 2 * MARGIN, lower + height + 10 + SCALE_HEIGHT, PAPER);
    titles(&mut canvas, &legend.title, &view.caption);
    let column = |index: u32| MARGIN + index * (width + GAP);
    for (index, (image, name)) in (0u32..).zip(pictures(view, legend).into_iter().zip(headings(&legend.names))) {
        let (column, y) = if index < 3 { (column(index), top) } else { (column(index - 3), lower) };
        canvas.text(&FontFace::Title.fit(&name, width), column, y - header, FontFace::Title, Alignment::Left, INK);
        paste(&mut canvas, &image, column, y, [width, height]);
    }
    let shown = std::slice::from_ref(view);
    legend.temperature_bar(&mut canvas, [MARGIN, top + height + 10, whole], shown);
    legend.difference_bar(&mut canvas, [MARGIN, lower + height + 10, 2 * width + GAP], shown);
    let x = column(2) + MARGIN;
    for (line, (text, face)) in (0u32..).zip(figures(view, &legend.names)) {
        canvas.text(&face.fit(&text, width - MARGIN), x, lower + 4 + line * 20, face, Alignment::Left, INK);
    }
    Ok(canvas)
}

fn headings(names: &[String; 3]) -> [String; 5] {
    let [first, second, third] = names;
    [first.clone(), second.clone(), third.clone(), format!("{first} - {third}"), format!("{second} - {third}")]
}

fn pictures(view: &Views, legend: &Legend) -> [Canvas; 5] {
    let [first, second, third] = [0, 1, 2].map(|response| legend.temperature(view, response));
    [first, second, third, legend.difference(view, 0), legend.difference(view, 1)]
}

/// The differences in a view as lines of text.
fn figures(view: &Views, names: &[String; 3]) -> Vec<(String, FontFace)> {
    let mut lines = vec![(format!("Against {}, in view", names[2]), FontFace::Title)];
    for response in [0, 1] {
        let Some(rms) = view.rms(response) else {
            return vec![("Nothing is in view".to_owned(), FontFace::Title)];
        };
        let ends =
            view.differences(response).fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], d| [a.min(d), b.max(d)]);
        let within = view.differences(response).filter(|d| d.abs() <= 5.0).count() as f64;
        let share = 100.0 * within / view.differences(response).count().max(1) as f64;
        lines.push((String::new(), FontFace::Normal));
        lines.push((names[response].clone(), FontFace::Title));
        lines.push((format!("rms {rms:.1} K"), FontFace::Normal));
        lines.push((format!("from {:+.1} K to {:+.1} K", ends[0], ends[1]), FontFace::Normal));
        lines.push((format!("{share:.0} % of the pixels within 5 K"), FontFace::Normal));
    }
    lines
}

fn titles(canvas: &mut Canvas, title: &str, details: &str) {
    let width = canvas.width() - 2 * MARGIN;
    canvas.text(&FontFace::Title.fit(title, width), MARGIN, MARGIN - 2, FontFace::Title, Alignment::Left, INK);
    canvas.text(
        &FontFace::Normal.fit(details, width),
        MARGIN,
        MARGIN + 19,
        FontFace::Normal,
        Alignment::Left,
        FAINT_INK,
    );
}

/// Draws an image at a position, scaled to its cell.
fn paste(canvas: &mut Canvas, image: &Canvas, x: u32, y: u32, [width, height]: [u32; 2]) {
    if width >= image.width() {
        canvas.paste(image, x, y, width / image.width());
    } else {
        canvas.paste(&image.resized(width, height), x, y, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::views::tests::views;

    #[test]
    fn a_sheet_shows_temperatures_and_differences_beside_each_other() {
        let view = views(30.0);
        let legend = Legend::new("Craft", ["instant", "transition", "network"], std::slice::from_ref(&view), None);
        let [left, top, width, height] = legend.crop;
        assert!(left > 5 && top > 0 && width < 60 && height <= 60, "the empty sides are cut off: {:?}", legend.crop);
        let sheet = sheet(std::slice::from_ref(&view), &legend, "details").unwrap();
        let zoom = legend.cell(260)[0] / width;
        let y = MARGIN + TITLE_HEIGHT + FontFace::Title.height() + 8 + (30 - top) * zoom;
        let x = |column: u32| {
            MARGIN + column * (width * zoom + GAP) + if column > 2 { MARGIN - GAP } else { 0 } + (40 - left) * zoom
        };
        let pixel = 30 * 80 + 40;
        for response in 0..3 {
            let expected = legend.temperature.colour(view.temperatures[response][pixel]);
            assert_eq!(sheet.get(x(response as u32), y), Some(expected));
        }
        assert_eq!(sheet.get(x(3), y), Some(legend.difference.colour(30.0)));
        assert_eq!(sheet.get(x(4), y), Some(legend.difference.colour(-2.0)));
        assert_ne!(sheet.get(x(3), y), sheet.get(x(4), y));
        assert!(panel(&view, &legend).unwrap().png().is_ok());
    }

    #[test]
    fn broken_and_empty_views_are_met() {
        let mut view = views(1.0);
        view.part.fill(0);
        let legend = Legend::new("", ["a", "b", "c"], std::slice::from_ref(&view), Some([100.0, 400.0]));
        assert_eq!(legend.crop, [0, 0, 80, 60]);
        assert!(panel(&view, &legend).unwrap().png().is_ok());
        view.temperatures[1].pop();
        assert!(panel(&view, &legend).is_err() && sheet(&[view], &legend, "").is_err());
    }
}
