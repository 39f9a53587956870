//! Grey images: PNG of 8 and 16 bits with text chunks, animated PNG, and their reader.

use std::io::Cursor;

use super::OutputError;
use crate::files::Expansion;

fn failed(error: impl ToString) -> OutputError {
    OutputError::Encode("PNG image".to_owned(), error.to_string())
}

/// A PNG of 16 bits. `text` has keywords and their texts.
///
/// # Errors
/// An image that PNG can not hold.
pub(crate) fn png_16(
    [width, height]: [u32; 2],
    values: &[u16],
    text: &[(&str, String)],
) -> Result<Vec<u8>, OutputError> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
    png_of([width, height], png::BitDepth::Sixteen, &bytes, text)
}

/// A PNG of 8 bits.
///
/// # Errors
/// As [`png_16`].
pub(crate) fn png_8(size: [u32; 2], values: &[u8], text: &[(&str, String)]) -> Result<Vec<u8>, OutputError> {
    png_of(size, png::BitDepth::Eight, values, text)
}

fn png_of(
    [width, height]: [u32; 2],
    depth: png::BitDepth,
    bytes: &[u8],
    text: &[(&str, String)],
) -> Result<Vec<u8>, OutputError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fast);
    // Filters find nothing in noise. A setting of compression sets a filter too, so the filter is set after the compression.
    encoder.set_filter(png::Filter::NoFilter);
    for (keyword, text) in text {
        encoder.add_itxt_chunk((*keyword).to_owned(), text.clone()).map_err(failed)?;
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(bytes).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}

/// An animated PNG of 8 bits that plays again and again. `rate` is in images a second.
///
/// # Errors
/// No image, images of different sizes, or an error of `images`.
pub(crate) fn animated(
    [width, height]: [u32; 2],
    count: usize,
    rate: f64,
    images: impl Iterator<Item = Result<Vec<u8>, OutputError>>,
) -> Result<Vec<u8>, OutputError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_animated(count as u32, 0).map_err(failed)?;
    encoder.set_frame_delay((1000.0 / rate).round().max(1.0) as u16, 1000).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut written = 0;
    for image in images {
        writer.write_image_data(&image?).map_err(failed)?;
        written += 1;
    }
    if written != count {
        return Err(failed(format!("an animation of {count} images has {written}")));
    }
    writer.finish().map_err(failed)?;
    Ok(file)
}

/// Width, height and bytes of a grey PNG that isotherm wrote.
///
/// # Errors
/// Another file.
pub fn read_png(bytes: &[u8]) -> Result<([u32; 2], Vec<u8>), OutputError> {
    let wrong = |reason: String| OutputError::Mismatch(format!("no PNG that can be read: {reason}"));
    let not_read = |error: png::DecodingError| wrong(error.to_string());
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(not_read)?;
    let size = reader.output_buffer_size().ok_or_else(|| wrong("it is too large".to_owned()))?;
    Expansion::of_image(bytes.len()).charge(size, 1).map_err(|fault| wrong(fault.to_string()))?;
    let mut values = vec![0; size];
    let info = reader.next_frame(&mut values).map_err(not_read)?;
    values.truncate(info.buffer_size());
    Ok(([info.width, info.height], values))
}

/// A grey image: its size, its values, and the text of keyword `isotherm` where it has one.
pub(crate) struct GrayImage {
    pub(crate) size: [u32; 2],
    pub(crate) values: Vec<u16>,
    pub(crate) text: Option<String>,
}

/// Reads a grey PNG of 8 or 16 bits.
///
/// # Errors
/// Another file.
pub(crate) fn read_gray(bytes: &[u8]) -> Result<GrayImage, OutputError> {
    let wrong = |reason: &str| OutputError::Mismatch(format!("no grey PNG of 8 or 16 bits: {reason}"));
    let not_read = |error: png::DecodingError| wrong(&error.to_string());
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(not_read)?;
    let info = reader.info();
    let (colour, depth) = (info.color_type, info.bit_depth);
    let own = info.utf8_text.iter().find(|chunk| chunk.keyword == "isotherm");
    let text = own.and_then(|chunk| chunk.get_text().ok());
    if colour != png::ColorType::Grayscale || !matches!(depth, png::BitDepth::Eight | png::BitDepth::Sixteen) {
        return Err(wrong(&format!("it has {colour:?} of {depth:?} bits")));
    }
    let length = reader.output_buffer_size().ok_or_else(|| wrong("it is too large"))?;
    Expansion::of_image(bytes.len()).charge(length, 1).map_err(|fault| wrong(&fault.to_string()))?;
    let mut raw = vec![0; length];
    let frame = reader.next_frame(&mut raw).map_err(not_read)?;
    raw.truncate(frame.buffer_size());
    let values = match depth {
        png::BitDepth::Sixteen => raw.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect(),
        _ => raw.iter().map(|byte| u16::from(*byte)).collect(),
    };
    Ok(GrayImage { size: [frame.width, frame.height], values, text })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_text_come_back() {
        let values: Vec<u16> = (0..12).map(|i| i * 5461).collect();
        let file = png_16([4, 3], &values, &[("isotherm", "{\"scale\":0.5}".to_owned())]).unwrap();
        let (size, bytes) = read_png(&file).unwrap();
        let back: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
        assert_eq!((size, back), ([4, 3], values));
        let read = read_gray(&file).unwrap();
        assert!(read.size == [4, 3] && read.values[11] == 11 * 5461 && read.text.unwrap().contains("0.5"));
        let has = |word: &[u8]| file.windows(word.len()).any(|window| window == word);
        assert!(has(b"iTXt") && has(b"{\"scale\":0.5}") && !has(b"{\"scale\":0.6}"));
        assert!(png_16([4, 3], &[0; 11], &[]).is_err());
    }

    #[test]
    fn an_animation_has_its_images() {
        let images = || (0..3u8).map(|image| Ok(vec![image; 20]));
        let file = animated([5, 4], 3, 10.0, images()).unwrap();
        let count = |word: &[u8]| file.windows(4).filter(|window| *window == word).count();
        // The first image is in IDAT, those after it in fdAT. Each has its control chunk.
        assert_eq!([count(b"acTL"), count(b"fcTL"), count(b"fdAT")], [1, 3, 2]);
        assert!(animated([5, 4], 4, 10.0, images()).is_err());
    }
}
