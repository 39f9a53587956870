//! A picture in memory: pixels, rectangles, text and PNG encoding.

use std::convert::Infallible;

use embedded_graphics::Pixel;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Size};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::Alignment;

use super::OutputError;
pub(crate) use super::typeface::FontFace;

/// Red, green, blue in sRGB.
pub(crate) type Rgb = [u8; 3];

/// Pixels in sRGB, 8 bits a channel, rows from top to bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<Rgb>,
}

pub(super) const PAPER: Rgb = [255, 255, 255];
pub(super) const INK: Rgb = [25, 28, 32];
/// Colour of secondary text.
pub(super) const FAINT_INK: Rgb = [95, 100, 108];
/// Colour of lines around scales.
pub(super) const FRAME_LINE: Rgb = [120, 124, 130];

impl Canvas {
    pub(crate) fn new(width: u32, height: u32, colour: Rgb) -> Self {
        Self { width, height, pixels: vec![colour; width as usize * height as usize] }
    }

    /// A canvas of `width * height` pixels. Missing pixels are black, surplus pixels are dropped.
    pub(crate) fn from_pixels(width: u32, height: u32, mut pixels: Vec<Rgb>) -> Self {
        pixels.resize(width as usize * height as usize, [0; 3]);
        Self { width, height, pixels }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Colour of a pixel. `None` outside the canvas.
    pub fn get(&self, x: u32, y: u32) -> Option<Rgb> {
        (x < self.width && y < self.height).then(|| self.pixels[y as usize * self.width as usize + x as usize])
    }

    /// Fills a rectangle, clipped to the canvas.
    pub(crate) fn fill(&mut self, x: u32, y: u32, width: u32, height: u32, colour: Rgb) {
        let right = x.saturating_add(width).min(self.width) as usize;
        for row in y..y.saturating_add(height).min(self.height) {
            let start = row as usize * self.width as usize;
            if (x as usize) < right {
                self.pixels[start + x as usize..start + right].fill(colour);
            }
        }
    }

    /// Copies another canvas with its upper left corner at (x, y). Every pixel becomes a square of `zoom` pixels.
    pub(crate) fn paste(&mut self, other: &Self, x: u32, y: u32, zoom: u32) {
        for row in 0..other.height {
            for column in 0..other.width {
                let colour = other.pixels[row as usize * other.width as usize + column as usize];
                self.fill(x + column * zoom, y + row * zoom, zoom, zoom, colour);
            }
        }
    }

    /// Writes a line of text with its top at `y`. `x` is its left end, middle or right end.
    pub(crate) fn text(&mut self, text: &str, x: u32, y: u32, face: FontFace, alignment: Alignment, colour: Rgb) {
        let width = face.width(text).cast_signed();
        let left = x.cast_signed()
            - match alignment {
                Alignment::Left => 0,
                Alignment::Center => width / 2,
                Alignment::Right => width,
            };
        face.draw(text, |[column, row], share| {
            let place = [left + column, y.cast_signed() + row].map(u32::try_from);
            let [Ok(x), Ok(y)] = place else { return };
            let Some(paper) = self.get(x, y) else { return };
            let mix = |(paper, ink): (u8, u8)| (f32::from(paper) + share * (f32::from(ink) - f32::from(paper))).round();
            self.fill(x, y, 1, 1, [0, 1, 2].map(|channel| mix((paper[channel], colour[channel])) as u8));
        });
    }

    /// The picture at another size. Each new pixel is the mean of the area that it covers.
    pub(crate) fn resized(&self, width: u32, height: u32) -> Self {
        let columns = cover(self.width, width);
        let rows = cover(self.height, height);
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        for row in &rows {
            for column in &columns {
                let mut sum = [0.0; 3];
                for &(y, share_y) in row {
                    for &(x, share_x) in column {
                        let colour = self.pixels[y * self.width as usize + x];
                        for (sum, value) in sum.iter_mut().zip(colour) {
                            *sum += share_x * share_y * f64::from(value);
                        }
                    }
                }
                pixels.push(sum.map(|value| value.round() as u8));
            }
        }
        Self { width, height, pixels }
    }

    /// The PNG file of the picture. The same picture gives the same bytes.
    pub fn png(&self) -> Result<Vec<u8>, OutputError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let what = || format!("PNG picture {}x{}", self.width, self.height);
        let failed = |error: png::EncodingError| OutputError::Encode(what(), error.to_string());
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(self.pixels.as_flattened()).map_err(failed)?;
        writer.finish().map_err(failed)?;
        Ok(bytes)
    }
}

/// For each of `to` cells over `from` pixels: the covered pixels and their shares of the cell.
fn cover(from: u32, to: u32) -> Vec<Vec<(usize, f64)>> {
    let scale = f64::from(from) / f64::from(to);
    let cell = |i: u32| {
        let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
        let pixels = start.floor() as usize..(end.ceil() as usize).min(from as usize);
        let overlap = |p: usize| (end.min(p as f64 + 1.0) - start.max(p as f64)).max(0.0) / scale;
        pixels.map(|p| (p, overlap(p))).collect()
    };
    (0..to).map(cell).collect()
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(point, colour) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(point.x), u32::try_from(point.y)) {
                self.fill(x, y, 1, 1, [colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info.width, info.height, pixels)
    }

    #[test]
    fn a_png_holds_the_pixels() {
        let mut canvas = Canvas::new(5, 3, [10, 20, 30]);
        canvas.fill(4, 2, 9, 9, [1, 2, 3]);
        canvas.fill(9, 9, 1, 1, [9; 3]);
        let (width, height, pixels) = decode(&canvas.png().unwrap());
        assert_eq!((width, height), (5, 3));
        assert_eq!(pixels[..3], [10, 20, 30]);
        assert_eq!(pixels[42..], [1, 2, 3]);
        assert_eq!(canvas.png().unwrap(), canvas.png().unwrap());
        assert!(Canvas::new(0, 3, [0; 3]).png().is_err());
    }

    #[test]
    fn text_is_where_its_anchor_says() {
        let ink = |anchor| {
            let mut canvas = Canvas::new(60, 20, [0; 3]);
            canvas.text("HH", 30, 2, FontFace::Normal, anchor, [255; 3]);
            let columns: Vec<u32> = (0..60).filter(|&x| (0..20).any(|y| canvas.get(x, y) != Some([0; 3]))).collect();
            (columns[0], columns[columns.len() - 1])
        };
        assert!(ink(Alignment::Left).0 >= 30);
        assert!(ink(Alignment::Right).1 <= 30);
        assert!(ink(Alignment::Center).0 < 30 && ink(Alignment::Center).1 > 30);
    }

    #[test]
    fn resizing_keeps_the_mean_and_one_colour() {
        let grey = Canvas::new(13, 7, [77; 3]);
        assert!(grey.resized(5, 3).pixels.iter().all(|pixel| *pixel == [77; 3]));
        let mut half = Canvas::new(4, 4, [0; 3]);
        half.fill(0, 0, 2, 4, [200; 3]);
        assert_eq!(half.resized(1, 1).pixels, [[100; 3]]);
        assert_eq!(half.resized(2, 1).pixels, [[200; 3], [0; 3]]);
    }
}
