//! Pictures of one scene under three responses: temperatures on one scale, and differences from the third response.

use super::OutputError;
use embedded_graphics::text::Alignment;

use super::canvas::{Canvas, FAINT_INK, FRAME_LINE, Face, INK, PAPER, Rgb};
use super::colour::{BACKGROUND, ColourScale, NOT_A_NUMBER};
use super::frame::check_channels;
use super::ticks::{self, union};

/// Space around the picture and between groups [px].
const MARGIN: u32 = 16;
/// Space between pictures [px].
const GAP: u32 = 6;
/// Height of the two title lines [px].
const TITLE_HEIGHT: u32 = 46;
/// Height of a colour bar [px].
const BAR_HEIGHT: u32 = 16;
/// Height of a colour bar with its text [px].
const SCALE_HEIGHT: u32 = 62;
/// Share of the scale's end below which the scale is linear. Above it the scale is logarithmic, so that small
/// differences stay visible.
const LINEAR: f64 = 0.02;
/// Share of the differences that the scale covers. The rest has the colour of an end, which is marked.
const HELD: f64 = 0.995;

/// The camera's view at one step under each response.
#[derive(Debug, Clone, PartialEq)]
pub struct Views {
    /// Number of the step.
    pub step: u32,
    /// The time in words.
    pub caption: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Surface temperatures [K] under each response. The last response is the reference.
    pub temperatures: [Vec<f32>; 3],
    /// Index of the part + 1 at each pixel. It is 0 without a surface.
    pub part: Vec<u32>,
}

impl Views {
    fn hit(&self, pixel: usize) -> bool {
        self.part[pixel] != 0
    }

    /// A response minus the reference [K], at each pixel with a surface.
    fn differences(&self, response: usize) -> impl Iterator<Item = f32> + '_ {
        let pixels = (0..self.part.len()).filter(|pixel| self.hit(*pixel));
        pixels.map(move |pixel| self.temperatures[response][pixel] - self.temperatures[2][pixel])
    }

    /// Root mean square of the differences of a response [K]. `None` if no surface is in view.
    pub fn rms(&self, response: usize) -> Option<f64> {
        let (count, squares) = self
            .differences(response)
            .fold((0u64, 0.0), |(count, sum), d| (count + 1, sum + f64::from(d) * f64::from(d)));
        (count > 0).then(|| (squares / count as f64).sqrt())
    }
}

/// Colours of differences: blue below zero, white at zero, red above. The map is ColorBrewer's RdBu, which suits the
/// colour-blind, over asinh of the difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DifferenceScale {
    /// Largest absolute difference on the scale [K].
    pub limit: f64,
}

impl DifferenceScale {
    /// A scale with round ends that covers nearly all differences in the views.
    pub fn covering(views: &[Views]) -> Self {
        let all = views.iter().flat_map(|view| view.differences(0).chain(view.differences(1)));
        let mut sizes: Vec<f32> = all.map(f32::abs).filter(|size| size.is_finite()).collect();
        if sizes.is_empty() {
            return Self { limit: 1.0 };
        }
        let rank = ((sizes.len() - 1) as f64 * HELD).round() as usize;
        let (_, held, _) = sizes.select_nth_unstable_by(rank, f32::total_cmp);
        let held = f64::from(*held).max(1e-3);
        Self { limit: ticks::round_range(-held, held)[1] }
    }

    /// Position of a difference [K] on the scale, from -1 to 1.
    fn place(&self, difference: f64) -> f64 {
        (difference / (LINEAR * self.limit)).asinh() / (1.0 / LINEAR).asinh()
    }

    /// Difference [K] at a position on the scale.
    fn at(&self, place: f64) -> f64 {
        (place * (1.0 / LINEAR).asinh()).sinh() * LINEAR * self.limit
    }

    /// Marks for a bar of `length` pixels: 0, and 1, 2 and 5 of every decade. Marks start at the ends and stop when
    /// there is no more room.
    fn marks(&self, length: f64) -> Vec<f64> {
        const ROOM: f64 = 40.0;
        let mut marks = vec![0.0];
        let mut free = 1.0 + 1e-9;
        let mut decade = 10f64.powi(self.limit.log10().floor() as i32);
        while self.place(5.0 * decade) * 0.5 * length > ROOM {
            for value in [5.0, 2.0, 1.0].map(|digit| digit * decade) {
                let place = self.place(value);
                if place <= free && place * 0.5 * length > ROOM {
                    marks.extend([value, -value]);
                    free = place - 2.0 * ROOM / length;
                }
            }
            decade *= 0.1;
        }
        marks
    }

    /// Colour of a difference [K].
    pub fn colour(&self, difference: f32) -> Rgb {
        if difference.is_nan() {
            return NOT_A_NUMBER;
        }
        let share = (0.5 - 0.5 * self.place(f64::from(difference))).clamp(0.0, 1.0);
        // The ends of the map are so dark that they would merge with the background, so they are cut.
        let colour = colorous::RED_BLUE.eval_continuous(0.06 + 0.88 * share);
        [colour.r, colour.g, colour.b]
    }
}

/// The title and the scales of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Legend {
    /// First line of a picture.
    pub title: String,
    /// Names of the responses.
    pub names: [String; 3],
    /// Scale of temperatures.
    pub temperature: ColourScale,
    /// Scale of differences.
    pub difference: DifferenceScale,
    /// The shown part of every image: left, top, width and height [px].
    pub crop: [u32; 4],
}

impl Legend {
    /// One legend for all views. `range` [K] fixes the temperature scale, which otherwise covers the views.
    pub fn new(title: &str, names: [&str; 3], views: &[Views], range: Option<[f64; 2]>) -> Self {
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
        let [own, reference] = [&view.temperatures[response], &view.temperatures[2]];
        self.colours(view, |pixel| self.difference.colour(own[pixel] - reference[pixel]))
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
pub fn sheet(views: &[Views], legend: &Legend, details: &str) -> Result<Canvas, OutputError> {
    views.iter().try_for_each(check)?;
    let [width, height] = legend.cell(260);
    let caption = Face::Normal.height() + 8;
    let header = Face::Title.height() + 8;
    let temperatures = 3 * width + 2 * GAP;
    let differences = 2 * width + GAP;
    let whole = temperatures + MARGIN + differences + 2 * MARGIN;
    let top = MARGIN + TITLE_HEIGHT + header;
    let rows = views.len() as u32;
    let mut canvas = Canvas::new(whole, top + rows * (height + caption) + MARGIN + SCALE_HEIGHT, PAPER);
    titles(&mut canvas, &legend.title, details);
    let column = |index: u32| MARGIN + index * (width + GAP) + if index > 2 { MARGIN - GAP } else { 0 };
    for (index, name) in (0u32..).zip(headings(&legend.names)) {
        let name = Face::Title.fit(&name, width);
        canvas.text(&name, column(index), MARGIN + TITLE_HEIGHT, Face::Title, Alignment::Left, INK);
    }
    for (row, view) in (0u32..).zip(views) {
        let y = top + row * (height + caption);
        for (index, image) in (0u32..).zip(pictures(view, legend)) {
            paste(&mut canvas, &image, column(index), y, [width, height]);
        }
        let below = y + height + 2;
        canvas.text(
            &Face::Normal.fit(&view.caption, temperatures),
            MARGIN,
            below,
            Face::Normal,
            Alignment::Left,
            FAINT_INK,
        );
        for (index, response) in [(3, 0), (4, 1)] {
            let text = view.rms(response).map_or("nothing in view".to_owned(), |rms| format!("rms in view {rms:.1} K"));
            canvas.text(
                &Face::Normal.fit(&text, width),
                column(index),
                below,
                Face::Normal,
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
pub fn panel(view: &Views, legend: &Legend) -> Result<Canvas, OutputError> {
    check(view)?;
    let [width, height] = legend.cell(440);
    let header = Face::Title.height() + 8;
    let whole = 3 * width + 2 * GAP;
    let top = MARGIN + TITLE_HEIGHT + header;
    let lower = top + height + 10 + SCALE_HEIGHT + header;
    let mut canvas = Canvas::new(whole + 2 * MARGIN, lower + height + 10 + SCALE_HEIGHT, PAPER);
    titles(&mut canvas, &legend.title, &view.caption);
    let column = |index: u32| MARGIN + index * (width + GAP);
    for (index, (image, name)) in (0u32..).zip(pictures(view, legend).into_iter().zip(headings(&legend.names))) {
        let (column, y) = if index < 3 { (column(index), top) } else { (column(index - 3), lower) };
        canvas.text(&Face::Title.fit(&name, width), column, y - header, Face::Title, Alignment::Left, INK);
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
fn figures(view: &Views, names: &[String; 3]) -> Vec<(String, Face)> {
    let mut lines = vec![(format!("Against {}, in view", names[2]), Face::Title)];
    for response in [0, 1] {
        let Some(rms) = view.rms(response) else {
            return vec![("Nothing is in view".to_owned(), Face::Title)];
        };
        let ends =
            view.differences(response).fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], d| [a.min(d), b.max(d)]);
        let within = view.differences(response).filter(|d| d.abs() <= 5.0).count() as f64;
        let share = 100.0 * within / view.differences(response).count().max(1) as f64;
        lines.push((String::new(), Face::Normal));
        lines.push((names[response].clone(), Face::Title));
        lines.push((format!("rms {rms:.1} K"), Face::Normal));
        lines.push((format!("from {:+.1} K to {:+.1} K", ends[0], ends[1]), Face::Normal));
        lines.push((format!("{share:.0} % of the pixels within 5 K"), Face::Normal));
    }
    lines
}

/// The part of the images with surfaces and a small margin: left, top, width and height [px].
fn crop(views: &[Views]) -> [u32; 4] {
    let Some(first) = views.first() else { return [0, 0, 1, 1] };
    let mut ends: Option<[u32; 4]> = None;
    for view in views {
        for pixel in (0..view.part.len()).filter(|pixel| view.hit(*pixel)) {
            let (x, y) = (pixel as u32 % view.width, pixel as u32 / view.width);
            let [left, top, right, bottom] = ends.unwrap_or([x, y, x, y]);
            ends = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
        }
    }
    let Some([left, top, right, bottom]) = ends else { return [0, 0, first.width, first.height] };
    let room = (right - left).max(bottom - top) / 40 + 1;
    let (left, top) = (left.saturating_sub(room), top.saturating_sub(room));
    let (right, bottom) = ((right + 1 + room).min(first.width), (bottom + 1 + room).min(first.height));
    [left, top, right - left, bottom - top]
}

fn temperature_range(view: &Views) -> Option<[f32; 2]> {
    let pixels = (0..view.part.len()).filter(|pixel| view.hit(*pixel));
    let all = pixels.flat_map(|pixel| [0, 1, 2].map(|response| view.temperatures[response][pixel]));
    all.filter(|t| t.is_finite()).map(|t| [t, t]).reduce(union)
}

fn check(view: &Views) -> Result<(), OutputError> {
    let [a, b, c] = view.temperatures.each_ref().map(|temperatures| ("T", temperatures.len()));
    check_channels([view.width, view.height], &[a, b, c, ("part", view.part.len())])
}

fn titles(canvas: &mut Canvas, title: &str, details: &str) {
    let width = canvas.width() - 2 * MARGIN;
    canvas.text(&Face::Title.fit(title, width), MARGIN, MARGIN - 2, Face::Title, Alignment::Left, INK);
    canvas.text(&Face::Normal.fit(details, width), MARGIN, MARGIN + 19, Face::Normal, Alignment::Left, FAINT_INK);
}

/// Draws an image at a position, scaled to its cell.
fn paste(canvas: &mut Canvas, image: &Canvas, x: u32, y: u32, [width, height]: [u32; 2]) {
    if width >= image.width() {
        canvas.paste(image, x, y, width / image.width());
    } else {
        canvas.paste(&image.resized(width, height), x, y, 1);
    }
}

/// A horizontal colour bar.
struct Bar<'a> {
    label: &'a str,
    ends: [f64; 2],
    /// Position (share of the length) and number of each mark.
    marks: Vec<(f64, String)>,
    /// Smallest and largest value in the pictures.
    present: Option<[f32; 2]>,
}

impl Bar<'_> {
    /// Draws the bar at `x`, `y` with the given width: label, range of values, and numbers. A triangle marks an
    /// exceeded end. `colour` maps a share of the length to a colour.
    fn draw(&self, canvas: &mut Canvas, [x, y, width]: [u32; 3], colour: impl Fn(f64) -> Rgb) {
        let [lower, upper] = self.ends;
        let text = Face::Normal.height();
        canvas.text(&Face::Normal.fit(self.label, width), x, y, Face::Normal, Alignment::Left, INK);
        let triangle = BAR_HEIGHT / 2;
        let (left, top) = (x + triangle + 2, y + text + 4);
        let length = width.saturating_sub(2 * (triangle + 2)).max(8);
        canvas.fill(left - 1, top - 1, length + 2, BAR_HEIGHT + 2, FRAME_LINE);
        for column in 0..length {
            let share = (f64::from(column) + 0.5) / f64::from(length);
            canvas.fill(left + column, top, 1, BAR_HEIGHT, colour(share));
        }
        for (share, number) in &self.marks {
            let column = (share * f64::from(length)).round() as u32;
            let at = left + column.min(length - 1);
            canvas.fill(at, top + BAR_HEIGHT + 1, 1, 4, INK);
            let half = Face::Normal.width(number) / 2;
            let at = at.clamp(x + half, (x + width).saturating_sub(half).max(x + half));
            canvas.text(number, at, top + BAR_HEIGHT + 6, Face::Normal, Alignment::Center, INK);
        }
        let Some([least, greatest]) = self.present else { return };
        for row in 0..triangle {
            let height = BAR_HEIGHT - 2 * row;
            if greatest > upper as f32 {
                canvas.fill(left + length + 1 + row, top + row, 1, height, colour(1.0));
            }
            if least < lower as f32 {
                canvas.fill(left - 2 - row, top + row, 1, height, colour(0.0));
            }
        }
        let values = [least, greatest].map(|value| ticks::label(f64::from(value), (upper - lower) / 1e3));
        let found = format!("from {} to {}", values[0], values[1]);
        if Face::Normal.width(&found) + Face::Normal.width(self.label) + 16 < width {
            canvas.text(&found, x + width, y, Face::Normal, Alignment::Right, FAINT_INK);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::frame::tests::sphere;

    fn views(offset: f32) -> Views {
        let frame = sphere(80, 60, 0);
        let shifted = |by: f32| frame.temperature.iter().map(|t| t + by).collect::<Vec<f32>>();
        Views {
            step: 3,
            caption: "step 3".into(),
            width: 80,
            height: 60,
            temperatures: [shifted(offset), shifted(-2.0), shifted(0.0)],
            part: frame.part,
        }
    }

    #[test]
    fn zero_is_white_and_the_ends_are_red_and_blue() {
        let scale = DifferenceScale { limit: 20.0 };
        // ColorBrewer's middle is 247. The spline through the map passes below it.
        assert!(scale.colour(0.0).iter().all(|channel| *channel > 230), "{:?}", scale.colour(0.0));
        let ([r, _, b], [r2, _, b2]) = (scale.colour(20.0), scale.colour(-20.0));
        assert!(r > b + 60 && b2 > r2 + 60);
        assert_eq!(scale.colour(35.0), scale.colour(20.0));
        assert_eq!(scale.colour(f32::NAN), NOT_A_NUMBER);
        for i in -200..=200 {
            let colour = scale.colour(i as f32 * 0.1);
            for special in [BACKGROUND, NOT_A_NUMBER] {
                let distance: u32 = colour.iter().zip(special).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
                assert!(distance > 60, "{colour:?} is close to {special:?}");
            }
        }
    }

    #[test]
    fn a_small_difference_shows_and_the_bar_says_what_it_is() {
        let scale = DifferenceScale { limit: 250.0 };
        // 10 K of 250 K: asinh(2) / asinh(50) = 0.31. A linear scale gives 0.04, which is white.
        assert!((scale.place(10.0) - 0.313).abs() < 1e-3);
        for value in [-250.0, -3.0, 0.0, 40.0, 250.0] {
            assert!((scale.at(scale.place(value)) - value).abs() < 1e-9);
        }
        let mut marks = scale.marks(450.0);
        marks.sort_by(f64::total_cmp);
        assert_eq!(marks, [-200.0, -50.0, -20.0, -5.0, 0.0, 5.0, 20.0, 50.0, 200.0]);
        assert!(scale.marks(1000.0).len() > marks.len() && DifferenceScale { limit: 0.001 }.marks(450.0).len() > 2);
    }

    #[test]
    fn rms_and_scale_come_from_what_is_in_view() {
        let mut view = views(29.0);
        assert!((view.rms(0).unwrap() - 29.0).abs() < 1e-4 && (view.rms(1).unwrap() - 2.0).abs() < 1e-4);
        assert_eq!(DifferenceScale::covering(std::slice::from_ref(&view)).limit, 30.0);
        // Background pixels do not count. A few pixels out of thousands may exceed the scale.
        let miss = view.part.iter().position(|part| *part == 0).unwrap();
        view.temperatures[0][miss] = 9999.0;
        let hit = view.part.iter().position(|part| *part != 0).unwrap();
        view.temperatures[0][hit] += 500.0;
        assert_eq!(DifferenceScale::covering(std::slice::from_ref(&view)).limit, 30.0);
        assert!(view.rms(0).unwrap() > 29.5);
        view.part.fill(0);
        assert_eq!(view.rms(0), None);
        assert_eq!(DifferenceScale::covering(&[view]).limit, 1.0);
    }

    #[test]
    fn a_sheet_shows_temperatures_and_differences_beside_each_other() {
        let view = views(30.0);
        let legend = Legend::new("Craft", ["instant", "transition", "network"], std::slice::from_ref(&view), None);
        let [left, top, width, height] = legend.crop;
        assert!(left > 5 && top > 0 && width < 60 && height <= 60, "the empty sides are cut off: {:?}", legend.crop);
        let sheet = sheet(std::slice::from_ref(&view), &legend, "details").unwrap();
        let zoom = legend.cell(260)[0] / width;
        let y = MARGIN + TITLE_HEIGHT + Face::Title.height() + 8 + (30 - top) * zoom;
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
