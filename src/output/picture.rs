//! Pictures of frames in false colour, with titles and scale.

use super::OutputError;
use embedded_graphics::text::Alignment;

use super::canvas::{Canvas, FAINT_INK, FRAME_LINE, FontFace, INK, PAPER};
use super::colour::ColourScale;
use super::frame::check_size;
use super::ticks::{self, union};
use crate::simulation::image::Image;

/// Space around the picture [px].
const MARGIN: u32 = 12;
/// Width of the colour bar [px].
const BAR_WIDTH: u32 = 22;
/// Width of the colour bar with its text [px].
const SCALE_WIDTH: u32 = 164;
/// Height of the two title lines [px].
const TITLE_HEIGHT: u32 = 44;
/// Smallest width of a picture [px]. A narrower image is magnified, so that its title fits.
const LEAST_WIDTH: u32 = 320;

/// A frame in false colour with title, details and colour scale.
///
/// `title` is the first line (the scene), `details` the second (step, time, band). Characters that the typeface does not have appear as
/// `?`. Long lines are cut with `...`. Images narrower than 320 pixels are magnified by a whole number.
pub fn picture(frame: &Image, scale: &ColourScale, title: &str, details: &str) -> Result<Canvas, OutputError> {
    check_size(frame)?;
    let zoom = LEAST_WIDTH.div_ceil(frame.camera.width).max(1);
    let (width, height) = (frame.camera.width * zoom, frame.camera.height * zoom);
    let mut canvas = Canvas::new(width + SCALE_WIDTH + 2 * MARGIN, height.max(140) + TITLE_HEIGHT + 2 * MARGIN, PAPER);
    let top = MARGIN + TITLE_HEIGHT;
    draw_title(&mut canvas, title, details);
    let image = scale.image(frame);
    canvas.paste(&image, MARGIN, top, zoom);

    let present = frame.range();
    draw_scale(&mut canvas, scale, [MARGIN + width, top, height.max(140)], scale.exceeded_by(frame), present);
    Ok(canvas)
}

/// A plain picture on the left and a frame in false colour on the right. Each has a caption above it. The frame has its
/// colour scale.
pub(crate) fn beside(
    left: (&Canvas, &str),
    right: (&Image, &str),
    scale: &ColourScale,
    title: &str,
    details: &str,
) -> Result<Canvas, OutputError> {
    let (frame, caption) = right;
    check_size(frame)?;
    let image = scale.image(frame);
    let height = left.0.height().max(frame.camera.height).max(140);
    let width = left.0.width() + MARGIN + frame.camera.width;
    let top = MARGIN + TITLE_HEIGHT + FontFace::Normal.height() + 4;
    let mut canvas = Canvas::new(width + SCALE_WIDTH + 2 * MARGIN, top + height + MARGIN, PAPER);
    draw_title(&mut canvas, title, details);
    let mut x = MARGIN;
    for (image, caption) in [(left.0, left.1), (&image, caption)] {
        let caption = FontFace::Normal.fit(caption, image.width());
        canvas.text(&caption, x, MARGIN + TITLE_HEIGHT, FontFace::Normal, Alignment::Left, INK);
        canvas.paste(image, x, top, 1);
        x += image.width() + MARGIN;
    }
    let bar = [MARGIN + width, top, height];
    draw_scale(&mut canvas, scale, bar, scale.exceeded_by(frame), frame.range());
    Ok(canvas)
}

/// A small frame on a contact sheet.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    caption: String,
    image: Canvas,
    range: Option<[f32; 2]>,
    exceeded: [bool; 2],
}

impl Tile {
    /// A small copy of a frame: at most `width` pixels wide.
    pub(crate) fn new(frame: &Image, scale: &ColourScale, caption: &str, width: u32) -> Result<Self, OutputError> {
        check_size(frame)?;
        let image = scale.image(frame);
        let width = width.clamp(1, frame.camera.width);
        let height =
            (f64::from(frame.camera.height) * f64::from(width) / f64::from(frame.camera.width)).round().max(1.0) as u32;
        Ok(Self {
            caption: caption.to_owned(),
            image: image.resized(width, height),
            range: frame.range(),
            exceeded: scale.exceeded_by(frame),
        })
    }
}

impl Tile {
    /// A tile whose picture was drawn already, with the range of its temperatures [K].
    pub(crate) fn drawn(caption: &str, image: Canvas, range: Option<[f32; 2]>) -> Self {
        Self { caption: caption.to_owned(), image, range, exceeded: [false; 2] }
    }
}

/// A grid of small pictures with captions, one title and one scale. `columns` is the number of tiles in a row.
pub(crate) fn contact_sheet(tiles: &[Tile], columns: u32, scale: &ColourScale, title: &str, details: &str) -> Canvas {
    const GAP: u32 = 8;
    let caption_height = FontFace::Small.height() + 4;
    let columns = columns.clamp(1, tiles.len().max(1) as u32);
    let rows = (tiles.len() as u32).div_ceil(columns);
    let cell_width = tiles.iter().map(|tile| tile.image.width()).max().unwrap_or(0);
    let cell_height = tiles.iter().map(|tile| tile.image.height()).max().unwrap_or(0) + caption_height;
    let grid_width = (columns * (cell_width + GAP)).saturating_sub(GAP).max(LEAST_WIDTH);
    let grid_height = (rows * (cell_height + GAP)).saturating_sub(GAP).max(140);

    let top = MARGIN + TITLE_HEIGHT;
    let mut canvas = Canvas::new(grid_width + SCALE_WIDTH + 2 * MARGIN, grid_height + top + MARGIN, PAPER);
    draw_title(&mut canvas, title, details);
    for (tile, index) in tiles.iter().zip(0u32..) {
        let x = MARGIN + (index % columns) * (cell_width + GAP);
        let y = top + (index / columns) * (cell_height + GAP);
        canvas.paste(&tile.image, x, y, 1);
        let caption = FontFace::Small.fit(&tile.caption, cell_width);
        canvas.text(&caption, x, y + tile.image.height() + 3, FontFace::Small, Alignment::Left, INK);
    }
    let exceeded = tiles.iter().fold([false; 2], |all, tile| [all[0] | tile.exceeded[0], all[1] | tile.exceeded[1]]);
    let present = tiles.iter().filter_map(|tile| tile.range).reduce(union);
    draw_scale(&mut canvas, scale, [MARGIN + grid_width, top, grid_height], exceeded, present);
    canvas
}

fn draw_title(canvas: &mut Canvas, title: &str, details: &str) {
    let width = canvas.width() - 2 * MARGIN;
    canvas.text(&FontFace::Title.fit(title, width), MARGIN, MARGIN - 2, FontFace::Title, Alignment::Left, INK);
    let face = if FontFace::Normal.width(details) <= width { FontFace::Normal } else { FontFace::Small };
    canvas.text(&face.fit(details, width), MARGIN, MARGIN + 19, face, Alignment::Left, FAINT_INK);
}

/// Draws the vertical scale at `left`, `top` with `height` [px]: label, bar and numbers. A triangle marks an exceeded
/// end. The range of the picture stands below.
fn draw_scale(
    canvas: &mut Canvas,
    scale: &ColourScale,
    [left, top, height]: [u32; 3],
    exceeded: [bool; 2],
    present: Option<[f32; 2]>,
) {
    let x = left + 18;
    canvas.text("temperature [K]", x, top, FontFace::Normal, Alignment::Left, INK);
    let triangle = BAR_WIDTH / 2;
    let bar_top = top + 22 + triangle;
    let bar_height = (top + height).saturating_sub(bar_top + triangle + 53).max(40);
    let line_height = f64::from(FontFace::Normal.height());
    let span = scale.upper - scale.lower;

    // Row i of the bar shows the value at the middle of that row.
    let value_at = |row: u32| scale.upper - span * (f64::from(row) + 0.5) / f64::from(bar_height);
    canvas.fill(x - 1, bar_top - 1, BAR_WIDTH + 2, bar_height + 2, FRAME_LINE);
    for row in 0..bar_height {
        canvas.fill(x, bar_top + row, BAR_WIDTH, 1, scale.colour(value_at(row) as f32));
    }
    let most = (f64::from(bar_height) / (2.6 * line_height)).floor().clamp(2.0, 10.0) as usize;
    let marks = ticks::ticks(scale.lower, scale.upper, most);
    for &value in &marks.values {
        let row = ((scale.upper - value) / span * f64::from(bar_height)).round() as u32;
        let y = bar_top + row.min(bar_height - 1);
        canvas.fill(x + BAR_WIDTH + 1, y, 6, 1, INK);
        let number = ticks::label(value, marks.step);
        canvas.text(&number, x + BAR_WIDTH + 11, y.saturating_sub(8), FontFace::Normal, Alignment::Left, INK);
    }
    for row in 0..triangle {
        if exceeded[1] {
            let colour = scale.colour(scale.upper as f32);
            canvas.fill(x + row, bar_top - 2 - row, BAR_WIDTH - 2 * row, 1, colour);
        }
        if exceeded[0] {
            let colour = scale.colour(scale.lower as f32);
            canvas.fill(x + row, bar_top + bar_height + 1 + row, BAR_WIDTH - 2 * row, 1, colour);
        }
    }
    let below = bar_top + bar_height + triangle + 8;
    let step = span / 1e3;
    let lines = match present {
        Some([least, greatest]) => {
            let number = |value: f32| ticks::label(f64::from(value), step.max(f64::from(value.abs()) * 1e-4));
            let ends = [scale.lower, scale.upper].map(|value| ticks::label(value, step.max(span / 100.0)));
            [
                format!("colours {} to {}", ends[0], ends[1]),
                format!("min {}", number(least)),
                format!("max {}", number(greatest)),
            ]
        }
        None => ["nothing in view".to_owned(), String::new(), String::new()],
    };
    for (line, row) in lines.iter().zip(0u32..) {
        canvas.text(line, x, below + row * 15, FontFace::Normal, Alignment::Left, FAINT_INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::canvas::Rgb;
    use crate::output::colour::BACKGROUND;
    use crate::output::frame::tests::sphere;

    #[test]
    fn the_image_is_in_the_picture_pixel_for_pixel() {
        let frame = sphere(400, 300, 3);
        let scale = ColourScale::new([150.0, 400.0]);
        let picture = picture(&frame, &scale, "Station", "step 3").unwrap();
        let colours = scale.image(&frame);
        for (x, y) in [(0, 0), (399, 299), (200, 150), (260, 90)] {
            assert_eq!(picture.get(MARGIN + x, MARGIN + TITLE_HEIGHT + y), colours.get(x, y));
        }
        assert_eq!(picture.get(MARGIN, MARGIN + TITLE_HEIGHT), Some(BACKGROUND));
        assert_ne!(picture.get(MARGIN + 200, MARGIN + TITLE_HEIGHT + 150), Some(BACKGROUND));
    }

    #[test]
    fn the_bar_runs_from_the_hottest_colour_down_to_the_coldest() {
        let frame = sphere(400, 300, 3);
        let scale = ColourScale::new([150.0, 400.0]);
        let picture = picture(&frame, &scale, "", "").unwrap();
        let x = MARGIN + 400 + 18 + BAR_WIDTH / 2;
        let bar: Vec<Rgb> = (0..picture.height()).filter_map(|y| picture.get(x, y)).collect();
        let row = |colour: Rgb| bar.iter().position(|c| c.iter().zip(colour).all(|(a, b)| a.abs_diff(b) <= 3));
        let (top, bottom) = (row(scale.colour(400.0)).unwrap(), row(scale.colour(150.0)).unwrap());
        assert!(top < bottom);
        // The middle of the bar is the middle of the range.
        let middle = bar[(top + bottom) / 2];
        assert!(middle.iter().zip(scale.colour(275.0)).all(|(a, b)| a.abs_diff(b) <= 4), "{middle:?}");
    }

    #[test]
    fn an_end_that_values_exceed_gets_a_triangle() {
        let frame = sphere(400, 300, 3);
        let tip = |range: [f64; 2]| {
            let scale = ColourScale::new(range);
            let picture = picture(&frame, &scale, "", "").unwrap();
            picture.get(MARGIN + 400 + 18 + BAR_WIDTH / 2, MARGIN + TITLE_HEIGHT + 22 + 5).unwrap()
        };
        assert_eq!(tip([150.0, 400.0]), PAPER);
        assert_eq!(tip([150.0, 250.0]), [252, 255, 164]);
    }

    #[test]
    fn small_large_and_empty_frames_are_drawn() {
        for (width, height) in [(1, 1), (7, 3), (64, 48), (1024, 16), (16, 900)] {
            let frame = sphere(width, height, 0);
            let scale = ColourScale::covering(frame.range());
            let canvas = picture(&frame, &scale, &"long title ".repeat(40), &"detail ".repeat(80)).unwrap();
            assert!(canvas.png().is_ok());
        }
        let mut broken = sphere(4, 4, 0);
        broken.temperature.clear();
        let scale = ColourScale::new([0.0, 1.0]);
        assert!(picture(&broken, &scale, "", "").is_err());
        assert!(contact_sheet(&[], 4, &scale, "", "").png().is_ok());
    }

    #[test]
    fn two_pictures_stand_beside_each_other() {
        let frame = sphere(200, 160, 3);
        let scale = ColourScale::new([150.0, 400.0]);
        let left = Canvas::new(200, 160, [1, 2, 3]);
        let both = beside((&left, "eye"), (&frame, "camera"), &scale, "Station", "").unwrap();
        let top = MARGIN + TITLE_HEIGHT + FontFace::Normal.height() + 4;
        assert_eq!(both.get(MARGIN, top), Some([1, 2, 3]));
        assert_eq!(both.get(MARGIN + 199, top + 159), Some([1, 2, 3]));
        let right = 2 * MARGIN + 200;
        assert_eq!(both.get(right - 1, top), Some(PAPER));
        assert_eq!(both.get(right, top), Some(BACKGROUND));
        assert_eq!(both.get(right + 100, top + 80), scale.image(&frame).get(100, 80));
    }

    #[test]
    fn a_sheet_has_a_cell_for_each_frame() {
        let scale = ColourScale::new([150.0, 400.0]);
        let tiles: Vec<Tile> =
            (0..5).map(|step| Tile::new(&sphere(200, 160, step), &scale, "t", 100).unwrap()).collect();
        let sheet = contact_sheet(&tiles, 3, &scale, "Station", "");
        let corner = |column: u32, row: u32| {
            sheet.get(MARGIN + column * 108 + 1, MARGIN + TITLE_HEIGHT + row * (80 + 17 + 8) + 1).unwrap()
        };
        assert_eq!([corner(0, 0), corner(2, 0), corner(1, 1)], [BACKGROUND; 3]);
        assert_eq!(corner(2, 1), PAPER);
    }
}
