//! Text of pictures: widths of lines, and outlines of letters with smooth edges.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, Glyph, PxScaleFont, ScaleFont, point};

use crate::text::plain;

/// Open Sans, Apache License 2.0 (`typeface/README.md`).
static OPEN_SANS: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("typeface/OpenSans-Regular.ttf")).ok());

/// A size of the typeface. Characters that it does not have appear as `?`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FontFace {
    /// Lines of 13 pixels.
    Small,
    /// Lines of 15 pixels.
    Normal,
    /// Lines of 19 pixels.
    Title,
}

impl FontFace {
    fn font(self) -> Option<PxScaleFont<&'static FontRef<'static>>> {
        // From the top of an A with an accent to the foot of a g the outlines take 0.95 of this scale.
        Some(OPEN_SANS.as_ref()?.as_scaled(1.05 * self.height() as f32))
    }

    /// Width of a line of text [px].
    pub(crate) fn width(self, text: &str) -> u32 {
        self.set(text).1.ceil() as u32
    }

    /// Height of a line of text [px].
    pub(crate) fn height(self) -> u32 {
        match self {
            Self::Small => 13,
            Self::Normal => 15,
            Self::Title => 19,
        }
    }

    /// The text, cut with `...` if it is wider than `width` [px].
    pub(crate) fn fit(self, text: &str, width: u32) -> String {
        if self.width(text) <= width {
            return text.to_owned();
        }
        let cut = |end: usize| format!("{}...", text[..end].trim_end());
        let ends = text.char_indices().map(|(end, _)| end).rev();
        ends.map(cut).find(|cut| self.width(cut) <= width).unwrap_or_else(|| "...".to_owned())
    }

    /// Draws a line of text whose upper left corner is the origin: calls `ink` with each place and the share of the pixel that letters cover.
    pub(crate) fn draw(self, text: &str, mut ink: impl FnMut([i32; 2], f32)) {
        let Some(font) = self.font() else { return };
        for glyph in self.set(text).0 {
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            let [left, top] = [corner.x as i32, corner.y as i32];
            outline.draw(|x, y, share| ink([left + x.cast_signed(), top + y.cast_signed()], share.clamp(0.0, 1.0)));
        }
    }

    /// The letters of a line at their places, and its width [px].
    fn set(self, text: &str) -> (Vec<Glyph>, f32) {
        let Some(font) = self.font() else { return (Vec::new(), 0.0) };
        let baseline = (0.5 * (self.height() as f32 + font.ascent() + font.descent())).round();
        let (mut glyphs, mut right, mut last) = (Vec::new(), 0.0, None);
        for letter in plain(text).chars() {
            let known = Some(font.glyph_id(letter)).filter(|id| id.0 != 0);
            let id = known.unwrap_or_else(|| font.glyph_id('?'));
            right += last.map_or(0.0, |last| font.kern(last, id));
            glyphs.push(id.with_scale_and_position(font.scale(), point(right, baseline)));
            right += font.h_advance(id);
            last = Some(id);
        }
        (glyphs, right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_too_wide_is_cut() {
        let room = FontFace::Small.width("station");
        assert!((30..60).contains(&room), "{room} px");
        assert_eq!(FontFace::Small.fit("station", room), "station");
        let cut = FontFace::Small.fit("station", room - 1);
        assert!(cut.starts_with("stat") && cut.ends_with("...") && FontFace::Small.width(&cut) < room, "{cut}");
        assert_eq!(FontFace::Small.fit("station", 1), "...");
    }

    #[test]
    fn letters_have_smooth_edges_and_stay_in_their_line() {
        for face in [FontFace::Small, FontFace::Normal, FontFace::Title] {
            let (mut inside, mut shares) = (true, Vec::new());
            face.draw("Ägyp 273 K", |[_, y], share| {
                inside &= share < 0.05 || (0..face.height().cast_signed()).contains(&y);
                shares.push(share);
            });
            assert!(inside, "{face:?}");
            assert!(shares.iter().any(|share| (0.2..0.8).contains(share)) && shares.iter().any(|share| *share > 0.9));
        }
        assert_eq!(FontFace::Normal.width("\u{4e2d}"), FontFace::Normal.width("?"));
        assert_ne!(FontFace::Normal.width("W"), FontFace::Normal.width("i"), "no letter of a typewriter");
    }
}
