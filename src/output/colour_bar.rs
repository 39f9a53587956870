//! A horizontal colour bar.

use embedded_graphics::text::Alignment;

use super::canvas::{Canvas, FAINT_INK, FRAME_LINE, FontFace, INK, Rgb};
use super::ticks;

/// Height of a colour bar [px].
const BAR_HEIGHT: u32 = 16;

pub(super) struct Bar<'a> {
    pub(crate) label: &'a str,
    /// Values at both ends.
    pub(crate) ends: [f64; 2],
    /// Position (share of the length) and number of each mark.
    pub(crate) marks: Vec<(f64, String)>,
    /// Smallest and largest value in the pictures.
    pub(crate) present: Option<[f32; 2]>,
}

impl Bar<'_> {
    /// Draws the bar at `x`, `y` with the given width: label, range of values, and numbers. A triangle marks an
    /// exceeded end. `colour` maps a share of the length to a colour.
    pub(crate) fn draw(&self, canvas: &mut Canvas, [x, y, width]: [u32; 3], colour: impl Fn(f64) -> Rgb) {
        let [lower, upper] = self.ends;
        let text = FontFace::Normal.height();
        canvas.text(&FontFace::Normal.fit(self.label, width), x, y, FontFace::Normal, Alignment::Left, INK);
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
            let half = FontFace::Normal.width(number) / 2;
            let at = at.clamp(x + half, (x + width).saturating_sub(half).max(x + half));
            canvas.text(number, at, top + BAR_HEIGHT + 6, FontFace::Normal, Alignment::Center, INK);
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
        let message = format!("from {} to {}", values[0], values[1]);
        if FontFace::Normal.width(&message) + FontFace::Normal.width(self.label) + 16 < width {
            canvas.text(&message, x + width, y, FontFace::Normal, Alignment::Right, FAINT_INK);
        }
    }
}
