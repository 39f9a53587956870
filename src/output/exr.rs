//! EXR files: frames without loss, with all metadata in the header.
//!
//! Channels: `L` (float, band radiance), `T` (float, temperature), `Z` (float, distance along the camera's +Z), `part`
//! and `material` (uint); with several samples of a pixel also `coverage` (float); with `output.channels` also `emitted` and `reflected` (float, the two parts
//! of `L`); with `output.error` also `T_error` (float, one standard deviation of the error of `T`); with `output.budget` also `Q_sun` to `Q_emitted`
//! (float, the budget of the surface); with `[uncertainty]` also `T_sigma`, `L_sigma` (float, not in a data set) and `cause` (uint, index into `isotherm_causes`); with `[[band]]` also `NAME.L` for each
//! band (float, radiance in it); with `output.ratio` also `T_ratio` and `T_ratio_error`. The header states units in `emissiveUnits`
//! `isotherm_units_*`. The string vectors `isotherm_parts` and `isotherm_materials` are indexed by the pixel value. All
//! types are OpenEXR's own (`v2d`, `v3d`, `m44d`, `stringvector`), so any reader shows them.
//!
//! The same frame gives the same bytes: blocks in increasing order, header attributes sorted by name.

use std::io::Cursor;
use std::path::Path;

use ::exr::meta::BlockDescription;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    LineOrder, MetaData, ReadChannels, ReadLayers, SmallVec,
};

use super::OutputError;
use super::exr_blocks;
use super::exr_header::{Attributes, header_attributes, text};
use super::frame::{FrameHeader, TEMPERATURE, TEMPERATURE_ERROR, check_channels, check_finite, check_size};
use super::whole_file::write_atomic;
use crate::files::{Expansion, decode};
use crate::simulation::image::{BandImage, BandImages, Image, ImageSigma, RatioImage};
use crate::thermal::budget::{CAUSES, CHANNELS};

/// Channel of the error of the temperature.
const ERROR: &str = "T_error";
/// Channels of the uncertainty by the ranges of parameters.
const SIGMA: [&str; 2] = ["T_sigma", "L_sigma"];
const CAUSE: &str = "cause";

/// Channel of the radiance in a band.
fn band_channel(name: &str) -> String {
    format!("{name}.L")
}

/// Writes a frame to `path`. The file appears whole or not at all.
///
/// # Errors
/// A channel does not fill the image, or the file cannot be written.
pub fn write_exr(path: &Path, frame: &Image, header: &FrameHeader) -> Result<(), OutputError> {
    let bytes = encode(frame, header).map_err(|error| match error {
        OutputError::Encode(_, reason) => OutputError::exr(path, reason),
        other => other,
    })?;
    write_atomic(path, |writer| writer.write_all(&bytes).map_err(|source| OutputError::write(path, source)))
}

pub(crate) fn encode(frame: &Image, header: &FrameHeader) -> Result<Vec<u8>, OutputError> {
    encode_with(frame, header, &[])
}

/// The same with more channels, each with its name.
pub(crate) fn encode_with(
    frame: &Image,
    header: &FrameHeader,
    more: &[(String, Vec<f32>)],
) -> Result<Vec<u8>, OutputError> {
    check_size(frame)?;
    let sizes: Vec<(&str, usize)> = more.iter().map(|(name, values)| (name.as_str(), values.len())).collect();
    check_channels(frame.size(), &sizes)?;
    check_finite(frame, header.step, |pixel| format!("part number {}", frame.part[pixel]))?;
    let mut channels = SmallVec::from_vec(vec![
        AnyChannel::new("L", FlatSamples::F32(frame.radiance.clone())),
        AnyChannel::new("T", FlatSamples::F32(frame.temperature.clone())),
        AnyChannel::new("Z", FlatSamples::F32(frame.depth.clone())),
        AnyChannel::new("part", FlatSamples::U32(frame.part.clone())),
        AnyChannel::new("material", FlatSamples::U32(frame.material.clone())),
    ]);
    if !frame.coverage.is_empty() {
        channels.push(AnyChannel::new("coverage", FlatSamples::F32(frame.coverage.clone())));
    }
    if !frame.error.is_empty() {
        channels.push(AnyChannel::new(ERROR, FlatSamples::F32(frame.error.clone())));
    }
    for (cause, name) in CHANNELS.iter().enumerate().filter(|_| !frame.budget.is_empty()) {
        let gains = frame.budget.iter().map(|budget| budget[cause]).collect();
        channels.push(AnyChannel::new(*name, FlatSamples::F32(gains)));
    }
    let sigma = &frame.sigma;
    if !sigma.cause.is_empty() {
        channels.push(AnyChannel::new(SIGMA[0], FlatSamples::F32(sigma.temperature.clone())));
        if !sigma.radiance.is_empty() {
            channels.push(AnyChannel::new(SIGMA[1], FlatSamples::F32(sigma.radiance.clone())));
        }
        channels.push(AnyChannel::new(CAUSE, FlatSamples::U32(sigma.cause.clone())));
    }
    for ((name, _), band) in header.bands.iter().zip(&frame.bands.images) {
        channels.push(AnyChannel::new(band_channel(name).as_str(), FlatSamples::F32(band.radiance.clone())));
    }
    if let Some(ratio) = &frame.bands.ratio {
        channels.push(AnyChannel::new(TEMPERATURE, FlatSamples::F32(ratio.temperature.clone())));
        channels.push(AnyChannel::new(TEMPERATURE_ERROR, FlatSamples::F32(ratio.error.clone())));
    }
    channels.extend(more.iter().map(|(name, values)| AnyChannel::new(name.as_str(), FlatSamples::F32(values.clone()))));
    let reflected = &frame.reflected;
    if !reflected.is_empty() {
        let of_surface = |(all, reflected): (&f32, &f32)| all - reflected;
        let emitted = frame.radiance.iter().zip(reflected).zip(&frame.part);
        let emitted = emitted.map(|(pair, part)| if *part == 0 { 0.0 } else { of_surface(pair) }).collect();
        channels.push(AnyChannel::new("emitted", FlatSamples::F32(emitted)));
        channels.push(AnyChannel::new("reflected", FlatSamples::F32(reflected.clone())));
    }
    let mut attributes = LayerAttributes::default();
    for (name, value) in header_attributes(frame, header) {
        attributes.other.insert(text(&name), value);
    }
    // Every reader supports ZIP. Increasing block order makes the bytes independent of threads.
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (frame.camera.width as usize, frame.camera.height as usize);
    let image = ExrImage::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(channels)));

    let mut bytes = Vec::new();
    let failed = |reason: String| OutputError::Encode("EXR image".into(), reason);
    exr_blocks::write(&mut bytes, &image).map_err(|error| failed(error.to_string()))?;
    sort_header(&mut bytes).ok_or_else(|| failed("the encoder's header is not understood".into()))?;
    Ok(bytes)
}

/// Reads a frame that isotherm wrote.
///
/// # Errors
/// The file is missing or no EXR file, or lacks one of isotherm's channels or attributes.
pub fn read_exr(path: &Path) -> Result<(Image, FrameHeader), OutputError> {
    decode_exr(&std::fs::read(path).map_err(|source| OutputError::Read(path.to_path_buf(), source))?, path)
}

/// Decodes the bytes of a frame as if it lay at `path`.
///
/// # Errors
/// As [`read_exr`].
pub fn decode_exr(bytes: &[u8], path: &Path) -> Result<(Image, FrameHeader), OutputError> {
    charge(bytes).map_err(|problem| OutputError::exr(path, problem))?;
    let image = decode(|| {
        let all = ::exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
        let all = all.first_valid_layer().all_attributes().non_parallel();
        all.from_buffered(Cursor::new(bytes)).map_err(|error| error.to_string())
    })
    .map_err(|problem| OutputError::exr(path, problem))?;
    let layer = image.layer_data;
    let attributes = Attributes { path, attributes: &layer.attributes };
    let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
    let mut channels = layer.channel_data.list;
    let has = |name: &str| channels.iter().any(|channel| channel.name.as_slice() == name.as_bytes());
    let (has_coverage, has_reflected, has_error) = (has("coverage"), has("reflected"), has(ERROR));
    let (has_budget, has_sigma, has_ratio) = (has(CHANNELS[0]), has(CAUSE), has(TEMPERATURE));
    let has_radiance_sigma = has(SIGMA[1]);
    let mut take = |name: &str| {
        let place = channels.iter().position(|channel| channel.name.as_slice() == name.as_bytes());
        place
            .map(|index| channels.swap_remove(index).sample_data)
            .ok_or_else(|| OutputError::exr(path, format!("channel {name} is missing: not a frame of isotherm")))
    };
    let mut float = |name: &str| match take(name)? {
        FlatSamples::F32(values) => Ok(values),
        _ => Err(OutputError::exr(path, format!("channel {name} is not 32-bit float"))),
    };
    let (radiance, temperature, depth) = (float("L")?, float("T")?, float("Z")?);
    let coverage = if has_coverage { float("coverage")? } else { Vec::new() };
    let reflected = if has_reflected { float("reflected")? } else { Vec::new() };
    let error = if has_error { float(ERROR)? } else { Vec::new() };
    let mut budget = Vec::new();
    if has_budget {
        budget.resize(temperature.len(), [0.0; CAUSES]);
        for (cause, name) in CHANNELS.iter().enumerate() {
            budget.iter_mut().zip(float(name)?).for_each(|(budget, gain)| budget[cause] = gain);
        }
    }
    let temperature_sigma = if has_sigma { float(SIGMA[0])? } else { Vec::new() };
    let radiance_sigma = if has_radiance_sigma { float(SIGMA[1])? } else { Vec::new() };
    let header = attributes.header()?;
    let mut bands = BandImages::default();
    for (name, _) in &header.bands {
        bands.images.push(BandImage { radiance: float(&band_channel(name))?, ..BandImage::default() });
    }
    if has_ratio {
        bands.ratio = Some(RatioImage { temperature: float(TEMPERATURE)?, error: float(TEMPERATURE_ERROR)? });
    }
    let mut label = |name: &str| match take(name)? {
        FlatSamples::U32(values) => Ok(values),
        _ => Err(OutputError::exr(path, format!("channel {name} is not 32-bit uint"))),
    };
    let (part, material) = (label("part")?, label("material")?);
    let cause = if has_sigma { label(CAUSE)? } else { Vec::new() };
    let causes = attributes.causes()?.into();
    let sigma = ImageSigma { temperature: temperature_sigma, radiance: radiance_sigma, cause, causes };
    let blank = attributes.image(width, height)?;
    let frame = Image {
        radiance,
        temperature,
        depth,
        part,
        material,
        coverage,
        reflected,
        error,
        budget,
        sigma,
        bands,
        ..blank
    };
    Ok((frame, header))
}

/// Checks that a file is compressed as frames are, and may become the pixels that its header states. Decoders of other compressions panic on damaged blocks.
fn charge(bytes: &[u8]) -> Result<(), String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), true).map_err(|error| error.to_string())?;
    let expansion = Expansion::of_image(bytes.len());
    for header in &meta.headers {
        if header.compression != Compression::ZIP16 || header.blocks != BlockDescription::ScanLines {
            return Err("is not compressed as a frame of isotherm".to_owned());
        }
        let pixels = header.layer_size.x().saturating_mul(header.layer_size.y());
        expansion.charge(pixels, header.channels.bytes_per_pixel).map_err(|fault| fault.to_string())?;
    }
    Ok(())
}

/// Sorts the header's attributes by name. The exr crate writes them in the random order of a hash map. Their total size
/// stays, so the block offsets after them stay valid. `None` if the bytes are no header.
fn sort_header(bytes: &mut [u8]) -> Option<()> {
    // OpenEXR layout: magic and version (8 bytes), then name\0 type\0 size(i32) value for each attribute, then \0.
    const START: usize = 8;
    let after_nul = |from: usize| Some(from + bytes.get(from..)?.iter().position(|&byte| byte == 0)? + 1);
    let mut attributes = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let size_at = after_nul(after_nul(at)?)?;
        let size = i32::from_le_bytes(bytes.get(size_at..size_at + 4)?.try_into().ok()?);
        let end = size_at + 4 + usize::try_from(size).ok()?;
        attributes.push(bytes.get(at..end)?.to_vec());
        at = end;
    }
    // Names end in \0, so comparing whole attributes compares their names.
    attributes.sort();
    bytes[START..at].copy_from_slice(&attributes.concat());
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::frame::tests::{header, sphere};
    use crate::thermal::planck::Band;

    #[test]
    fn a_frame_and_its_header_come_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let (mut frame, header) = (sphere(65, 37, 7), header());
        frame.temperature[3] = f32::MAX;
        frame.radiance[4] = 1e-42;
        frame.part[5] = u32::MAX;
        frame.coverage = (0..65 * 37).map(|pixel| pixel as f32 / 4096.0).collect();
        frame.error = (0..65 * 37).map(|pixel| pixel as f32 / 512.0).collect();
        frame.budget = (0..65 * 37).map(|pixel| std::array::from_fn(|cause| (8 * pixel + cause) as f32)).collect();
        frame.sigma.temperature = frame.error.clone();
        frame.sigma.radiance = frame.coverage.clone();
        frame.sigma.cause = (0..65 * 37).map(|pixel| pixel % 3).collect();
        frame.sigma.causes = vec!["albedo".into(), "heater of a".into()].into();
        let mut header = header;
        let bands = [0.5, 2.0].map(|factor| frame.radiance.iter().map(|radiance| factor * radiance).collect());
        frame.bands.images = bands.map(|radiance| BandImage { radiance, ..BandImage::default() }).to_vec();
        let (temperature, error) = (frame.temperature.clone(), frame.error.clone());
        frame.bands.ratio = Some(RatioImage { temperature, error });
        header.bands = [("near", 3e-6), ("far", 8e-6)]
            .map(|(name, lower)| (name.to_owned(), Band { lower, upper: 14e-6 }))
            .to_vec();
        write_exr(&path, &frame, &header).unwrap();
        let (read, read_header) = read_exr(&path).unwrap();
        assert_eq!(read, frame);
        assert_eq!(read_header, header);
        frame.depth[100] = frame.depth[100].next_up();
        assert_ne!(read, frame, "one ulp must show");
    }

    #[test]
    fn what_is_not_finite_is_refused_with_its_place() {
        for value in [f32::NAN, f32::INFINITY] {
            let mut frame = sphere(4, 4, 0);
            frame.temperature[6] = value;
            let error = encode(&frame, &header()).unwrap_err().to_string();
            assert!(error.contains("temperature in pixel (2, 1)"), "{error}");
        }
    }

    #[test]
    fn the_same_frame_gives_the_same_bytes() {
        let (frame, header) = (sphere(200, 150, 7), header());
        let first = encode(&frame, &header).unwrap();
        for _ in 0..5 {
            assert!(encode(&frame, &header).unwrap() == first);
        }
        let mut other = header;
        other.band.upper = 13e-6;
        assert!(encode(&frame, &other).unwrap() != first);
    }

    #[test]
    fn header_attributes_are_sorted_so_that_their_order_is_no_accident() {
        let bytes = encode(&sphere(4, 4, 0), &header()).unwrap();
        let position = |name: &str| bytes.windows(name.len()).position(|window| window == name.as_bytes()).unwrap();
        let names = ["channels\0", "emissiveUnits\0", "isotherm_background\0", "isotherm_time_s\0", "lineOrder\0"];
        assert!(names.windows(2).all(|pair| position(pair[0]) < position(pair[1])));
    }

    #[test]
    fn many_long_names_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut header = header();
        header.parts = (0..3000).map(|i| format!("{i} {}", "part of a part ".repeat(1 + i % 90))).collect();
        header.materials = vec![];
        write_exr(&path, &sphere(4, 4, 0), &header).unwrap();
        assert_eq!(read_exr(&path).unwrap().1, header);
    }

    #[test]
    fn what_is_no_frame_is_refused_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut bytes = encode(&sphere(16, 16, 0), &header()).unwrap();
        let cases: [(&str, Vec<u8>); 3] =
            [("empty", vec![]), ("text", b"not an image".to_vec()), ("truncated", bytes[..bytes.len() / 2].to_vec())];
        for (case, content) in cases {
            std::fs::write(&path, content).unwrap();
            let error = read_exr(&path).unwrap_err().to_string();
            assert!(error.contains("a.exr"), "{case}: {error}");
        }
        let name = b"isotherm_time_s\0";
        let at = bytes.windows(name.len()).position(|window| window == name).unwrap();
        bytes[at] = b'I';
        std::fs::write(&path, &bytes).unwrap();
        let error = read_exr(&path).unwrap_err().to_string();
        assert!(error.contains("isotherm_time_s is missing"), "{error}");
        assert!(matches!(read_exr(&folder.path().join("absent.exr")), Err(OutputError::Read { .. })));
    }

    #[test]
    fn a_frame_of_the_wrong_size_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut frame = sphere(4, 4, 0);
        frame.part.pop();
        assert!(write_exr(&path, &frame, &header()).is_err());
        assert!(!path.exists());
    }
}
