//! A picture with each material in a colour of its own, and a legend.

use embedded_graphics::text::Alignment;

use super::OutputError;
use super::canvas::{Canvas, FAINT_INK, FRAME_LINE, FontFace, INK, PAPER, Rgb};
use super::colour::BACKGROUND;

/// Space around the picture [px].
const MARGIN: u32 = 12;
/// Height of the two title lines [px].
const TITLE_HEIGHT: u32 = 44;
/// Width of the legend [px].
const LEGEND_WIDTH: u32 = 300;
/// Height of a line of the legend [px].
const LINE: u32 = 20;
/// Side of the square with a material's colour [px].
const SWATCH: u32 = 14;

/// Colours that are easy to tell apart: the first twenty of Kelly 1965 without white, black and grey.
const COLOURS: [Rgb; 19] = [
    [243, 195, 0],
    [135, 86, 146],
    [243, 132, 0],
    [161, 202, 241],
    [190, 0, 50],
    [194, 178, 128],
    [0, 136, 86],
    [230, 143, 172],
    [0, 103, 165],
    [249, 147, 121],
    [96, 78, 151],
    [246, 166, 0],
    [179, 68, 108],
    [220, 211, 0],
    [136, 45, 23],
    [141, 182, 0],
    [101, 69, 34],
    [226, 88, 34],
    [43, 61, 38],
];

/// Colour of a material. After the first nineteen the colours come again, darker and lighter in turn.
pub(crate) fn colour(material: usize) -> Rgb {
    let [round, place] = [material / COLOURS.len(), material % COLOURS.len()];
    COLOURS[place].map(|value| match round % 3 {
        0 => value,
        1 => (u32::from(value) * 6 / 10) as u8,
        _ => (255 - (255 - u32::from(value)) * 5 / 10) as u8,
    })
}

/// A material in the legend: its name, and a remark behind it.
pub(crate) type LegendEntry = (String, String);

/// The picture of an image of `width` pixels a row. `pixels` has part + 1 and material + 1 of each, 0 where no surface is. Borders between parts are darker.
///
/// # Errors
/// A size that does not fit the pixels.
pub(crate) fn material_picture(
    width: u32,
    pixels: &[[u32; 2]],
    materials: &[LegendEntry],
    title: &str,
    details: &str,
) -> Result<Canvas, OutputError> {
    let height = pixels.len() as u32 / width.max(1);
    let at = |x: u32, y: u32| pixels[y as usize * width as usize + x as usize];
    let coloured = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| {
        let [part, material] = at(x, y);
        let Some(material) = material.checked_sub(1) else { return BACKGROUND };
        let border = (x > 0 && at(x - 1, y)[0] != part) || (y > 0 && at(x, y - 1)[0] != part);
        let fill = colour(material as usize);
        if border { fill.map(|value| value / 2) } else { fill }
    });
    let image = Canvas::from_pixels(width, height, coloured.collect());
    let zoom = 320_u32.div_ceil(width.max(1)).max(1);
    let tall = (height * zoom).max(LINE * (materials.len() as u32 + 1));
    let top = MARGIN + TITLE_HEIGHT;
    let mut canvas = Canvas::new(width * zoom + LEGEND_WIDTH + 3 * MARGIN, top + tall + MARGIN, PAPER);
    let room = canvas.width() - 2 * MARGIN;
    canvas.text(&FontFace::Title.fit(title, room), MARGIN, MARGIN, FontFace::Title, Alignment::Left, INK);
    canvas.text(
        &FontFace::Normal.fit(details, room),
        MARGIN,
        MARGIN + 20,
        FontFace::Normal,
        Alignment::Left,
        FAINT_INK,
    );
    canvas.paste(&image, MARGIN, top, zoom);
    let mut counts = vec![0usize; materials.len()];
    for [_, material] in pixels {
        if let Some(count) = material.checked_sub(1).and_then(|material| counts.get_mut(material as usize)) {
            *count += 1;
        }
    }
    let left = width * zoom + 2 * MARGIN;
    for (number, ((name, remark), count)) in materials.iter().zip(counts).enumerate() {
        let y = top + LINE * number as u32;
        canvas.fill(left, y, SWATCH, SWATCH, FRAME_LINE);
        canvas.fill(left + 1, y + 1, SWATCH - 2, SWATCH - 2, colour(number));
        let remark = if count == 0 { format!("{remark}, not seen") } else { remark.clone() };
        let behind = FontFace::Small.width(&remark);
        let room = LEGEND_WIDTH.saturating_sub(SWATCH + 14 + behind);
        let ink = if count == 0 { FAINT_INK } else { INK };
        canvas.text(&FontFace::Small.fit(name, room), left + SWATCH + 6, y, FontFace::Small, Alignment::Left, ink);
        canvas.text(&remark, left + LEGEND_WIDTH, y, FontFace::Small, Alignment::Right, FAINT_INK);
    }
    Ok(canvas)
}

#[cfg(test)]
mod tests {
    use super::{COLOURS, LegendEntry, colour, material_picture};

    #[test]
    fn each_material_has_its_own_colour_and_stands_in_the_legend() {
        let materials: Vec<LegendEntry> = ["paint", "foil"].map(|name| (name.to_owned(), "1 m2".to_owned())).to_vec();
        let pixels: Vec<[u32; 2]> = (0..320 * 8).map(|pixel| if pixel % 320 < 160 { [1, 1] } else { [2, 2] }).collect();
        let canvas = material_picture(320, &pixels, &materials, "title", "details").unwrap();
        let computed =
            |colour| (0..canvas.height()).any(|y| (0..canvas.width()).any(|x| canvas.get(x, y) == Some(colour)));
        assert!(computed(colour(0)) && computed(colour(1)) && !computed(colour(2)));
        // The legend is right of the image.
        let beside =
            |colour| (0..canvas.height()).any(|y| (340..canvas.width()).any(|x| canvas.get(x, y) == Some(colour)));
        assert!(beside(colour(0)) && beside(colour(1)));
        let all: std::collections::BTreeSet<_> = (0..3 * COLOURS.len()).map(colour).collect();
        assert_eq!(all.len(), 3 * COLOURS.len());
    }
}
