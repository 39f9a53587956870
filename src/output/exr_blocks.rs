//! The blocks of lines of an EXR file, packed and compressed by all threads.
//!
//! The `exr` crate writes the header and places the blocks. Its own compressor takes most of the processor time of a frame, so this file packs as OpenEXR's
//! `ImfZip.cpp` does and compresses with `flate2`. Blocks where all values are 0 are compressed once.

use std::io::{self, Cursor, Write as _};
use std::ops::Range;

use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use ::exr::block::writer::ChunksWriter as _;
use ::exr::error::Error;
use ::exr::prelude::{AnyChannels, FlatSamples, Image as ExrImage, Layer, WritableImage as _};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

/// Lines of a block of `Compression::ZIP16`.
const LINES: usize = 16;
/// Level of compression.
const LEVEL: u32 = 2;
/// What is added to the difference of two bytes.
const EQUAL: u8 = 128;

/// Writes an image of 32-bit channels with `Compression::ZIP16`, in lines of increasing order.
pub(super) fn write(bytes: &mut Vec<u8>, image: &ExrImage<Layer<AnyChannels<FlatSamples>>>) -> Result<(), Error> {
    let (width, height) = (image.layer_data.size.width(), image.layer_data.size.height());
    let channels = image.layer_data.channel_data.list.iter().map(|channel| words(&channel.sample_data));
    let channels = channels.collect::<Result<Vec<&[u32]>, Error>>()?;
    let firsts: Vec<usize> = (0..height).step_by(LINES).collect();
    let blocks = firsts.par_iter().map(|first| {
        let lines = *first..height.min(first + LINES);
        let pixels = lines.start * width..lines.end * width;
        let is_blank = |words: &&[u32]| words[pixels.clone()].iter().fold(0, |any, word| any | word) == 0;
        let is_kept = lines.len() == LINES && channels.iter().all(is_blank);
        if is_kept { Ok(None) } else { block(&channels, lines, width).map(Some) }
    });
    let blocks = blocks.collect::<io::Result<Vec<Option<Vec<u8>>>>>()?;
    let zeros = vec![0; LINES * width];
    let blank =
        if blocks.contains(&None) { block(&vec![&zeros[..]; channels.len()], 0..LINES, width)? } else { Vec::new() };
    ::exr::block::write(Cursor::new(bytes), image.write().infer_meta_data(), true, |_, writer| {
        for (index, (first, block)) in firsts.into_iter().zip(blocks).enumerate() {
            let compressed_pixels_le = block.unwrap_or_else(|| blank.clone());
            let lines = CompressedScanLineBlock { y_coordinate: first as i32, compressed_pixels_le };
            writer.write_chunk(index, Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(lines) })?;
        }
        Ok(())
    })
}

/// The bits of a channel.
fn words(samples: &FlatSamples) -> Result<&[u32], Error> {
    match samples {
        FlatSamples::F32(values) => Ok(bytemuck::cast_slice(values)),
        FlatSamples::U32(values) => Ok(values),
        FlatSamples::F16(_) => Err(Error::NotSupported("a channel of 16-bit floats".into())),
    }
}

/// A block of lines: compressed, or as it is where that is no longer.
fn block(channels: &[&[u32]], lines: Range<usize>, width: usize) -> io::Result<Vec<u8>> {
    let half = 2 * channels.len() * lines.len() * width;
    let mut packed = vec![0; 2 * half];
    let (even, odd) = packed.split_at_mut(half);
    let mut places = even.as_chunks_mut::<2>().0.iter_mut().zip(odd.as_chunks_mut::<2>().0);
    let rows = lines.flat_map(|line| channels.iter().map(move |words| &words[line * width..(line + 1) * width]));
    for row in rows.clone() {
        for (word, (even, odd)) in row.iter().zip(&mut places) {
            let [first, second, third, fourth] = word.to_le_bytes();
            (*even, *odd) = ([first, third], [second, fourth]);
        }
    }
    let mut last = packed.first().copied().unwrap_or_default();
    for byte in packed.iter_mut().skip(1) {
        let difference = byte.wrapping_sub(last).wrapping_add(EQUAL);
        last = std::mem::replace(byte, difference);
    }
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(half), Compression::new(LEVEL));
    encoder.write_all(&packed)?;
    let compressed = encoder.finish()?;
    let is_shorter = compressed.len() < packed.len();
    Ok(if is_shorter { compressed } else { rows.flatten().flat_map(|word| word.to_le_bytes()).collect() })
}
