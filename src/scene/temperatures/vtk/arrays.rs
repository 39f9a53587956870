//! The arrays of a VTK file in XML: as text, in base64, or appended, with or without zlib.

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use roxmltree::Node;

use crate::files::Expansion;
use crate::scene::error::SceneError;
use crate::scene::temperatures::table::refuse;

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The data behind `<AppendedData>`.
pub(super) struct Appended<'a> {
    bytes: &'a [u8],
    raw: bool,
}

/// The XML of a file, and its appended data, which need not be text.
pub(super) fn parted<'a>(bytes: &'a [u8], path: &Path) -> Result<(Cow<'a, str>, Option<Appended<'a>>), SceneError> {
    let text = |bytes: &'a [u8]| {
        std::str::from_utf8(bytes).map_err(|_| refuse(path, 1, "VTKFile", "is not UTF-8 text before its appended data"))
    };
    let tag = b"<AppendedData";
    let Some(at) = bytes.windows(tag.len()).position(|window| window == tag) else {
        return Ok((Cow::Borrowed(text(bytes)?), None));
    };
    let head = text(&bytes[..at])?;
    let behind = &bytes[at..];
    let begin = behind.iter().position(|byte| *byte == b'>').unwrap_or(behind.len());
    let raw = behind[..begin].windows(3).any(|window| window == b"raw");
    let data = behind.iter().skip(begin).position(|byte| *byte == b'_').map(|mark| &behind[begin + mark + 1..]);
    let data = data.ok_or_else(|| refuse(path, 1, "AppendedData", "has no mark '_' before its data"))?;
    Ok((Cow::Owned(format!("{head}</VTKFile>")), Some(Appended { bytes: data, raw })))
}

pub(super) struct Arrays<'a> {
    path: &'a Path,
    appended: Option<Appended<'a>>,
    /// Bytes of a number in a header.
    width: usize,
    big: bool,
    zlib: bool,
    expansion: Expansion,
}

impl<'a> Arrays<'a> {
    /// The arrays of a file of `size` bytes.
    pub(super) fn new(
        root: Node,
        appended: Option<Appended<'a>>,
        path: &'a Path,
        size: usize,
    ) -> Result<Self, SceneError> {
        let zlib = match root.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                let message = format!("is {other}; isotherm reads vtkZLibDataCompressor and no compressor");
                return Err(refuse(path, 1, "VTKFile.compressor", message));
            }
        };
        let width = match root.attribute("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => {
                return Err(refuse(path, 1, "VTKFile.header_type", format!("is {other}, not UInt32 or UInt64")));
            }
        };
        let big = root.attribute("byte_order") == Some("BigEndian");
        Ok(Self { path, appended, width, big, zlib, expansion: Expansion::of(size) })
    }

    /// Counts `count` things of `each` bytes that an array is about to become.
    pub(super) fn charge(&self, array: Node, count: usize, each: usize) -> Result<(), SceneError> {
        self.expansion.charge(count, each).map_err(|fault| self.wrong(array, fault))
    }

    pub(super) fn wrong(&self, node: Node, message: impl std::fmt::Display) -> SceneError {
        let line = u64::from(node.document().text_pos_at(node.range().start).row);
        let name = node.attribute("Name").map_or(String::new(), |name| format!(" {name}"));
        refuse(self.path, line, &format!("{}{name}", node.tag_name().name()), message)
    }

    pub(super) fn values(&self, array: Node) -> Result<Vec<f64>, SceneError> {
        let kind = array.attribute("type").unwrap_or("");
        let text = array.text().unwrap_or("").trim();
        let bytes = match array.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                self.charge(array, text.len().div_ceil(2), size_of::<f64>())?;
                let number = |word: &str| {
                    word.parse::<f64>().map_err(|_| self.wrong(array, format!("'{word}' is not a number")))
                };
                return text.split_ascii_whitespace().map(number).collect();
            }
            "binary" => self.of_base64(array, text.as_bytes())?,
            "appended" => {
                let appended =
                    self.appended.as_ref().ok_or_else(|| self.wrong(array, "the file has no AppendedData"))?;
                let offset = array.attribute("offset").and_then(|text| text.parse::<usize>().ok());
                let data = offset.and_then(|offset| appended.bytes.get(offset..));
                let data = data.ok_or_else(|| self.wrong(array, "has no offset within the appended data"))?;
                if appended.raw { self.of_raw(array, data)? } else { self.of_base64(array, data)? }
            }
            other => return Err(self.wrong(array, format!("has the format {other}, not ascii, binary or appended"))),
        };
        let big = self.big;
        macro_rules! numbers {
            ($kind:ty) => {{
                self.charge(array, bytes.len() / size_of::<$kind>(), size_of::<f64>())?;
                let bytes = bytes.chunks_exact(size_of::<$kind>());
                bytes
                    .map(|bytes| {
                        let number = bytes.try_into().unwrap_or_default();
                        (if big { <$kind>::from_be_bytes(number) } else { <$kind>::from_le_bytes(number) }) as f64
                    })
                    .collect()
            }};
        }
        Ok(match kind {
            "Float64" => numbers!(f64),
            "Float32" => numbers!(f32),
            "Int64" => numbers!(i64),
            "UInt64" => numbers!(u64),
            "Int32" => numbers!(i32),
            "UInt32" => numbers!(u32),
            "Int16" => numbers!(i16),
            "UInt16" => numbers!(u16),
            "Int8" => numbers!(i8),
            "UInt8" => numbers!(u8),
            other => return Err(self.wrong(array, format!("has the type {other}, which is no number"))),
        })
    }

    fn word(&self, bytes: &[u8]) -> usize {
        let mut word = [0; 8];
        word[..self.width].copy_from_slice(&bytes[..self.width]);
        if self.big {
            word[..self.width].reverse();
        }
        usize::try_from(u64::from_le_bytes(word)).unwrap_or(usize::MAX)
    }

    fn truncated(&self, array: Node) -> SceneError {
        self.wrong(array, "is truncated or damaged")
    }

    /// Bytes that follow their length, or blocks that follow their lengths.
    fn of_raw(&self, array: Node, data: &[u8]) -> Result<Vec<u8>, SceneError> {
        let truncated = || self.truncated(array);
        let first = self.word(data.get(..self.width).ok_or_else(truncated)?);
        if !self.zlib {
            let bytes = data[self.width..].get(..first).ok_or_else(truncated)?;
            self.charge(array, bytes.len(), 1)?;
            return Ok(bytes.to_vec());
        }
        let head = first.checked_add(3).and_then(|words| words.checked_mul(self.width)).ok_or_else(truncated)?;
        let header = data.get(..head).ok_or_else(truncated)?;
        self.inflated(array, header, &data[head..])
    }

    /// Bytes in base64 that follow their length, or blocks that follow their lengths. The header may have a padding of its
    /// own.
    fn of_base64(&self, array: Node, text: &[u8]) -> Result<Vec<u8>, SceneError> {
        let truncated = || self.truncated(array);
        let mut text = text.iter().copied().take_while(|byte| *byte != b'<').filter(|byte| !byte.is_ascii_whitespace());
        // No more letters are taken than the header asks for: many arrays may begin in one text.
        let mut letters = |count: usize| -> Result<Vec<u8>, SceneError> {
            let taken: Vec<u8> = text.by_ref().take(count).collect();
            self.charge(array, taken.len(), 2)?;
            if taken.len() == count { Ok(taken) } else { Err(self.truncated(array)) }
        };
        let decoded = |text: &[u8]| BASE64.decode(text).map_err(|_| truncated());
        let begin = letters(in_base64(self.width))?;
        let first = self.word(decoded(&begin)?.get(..self.width).ok_or_else(truncated)?);
        if self.zlib {
            let head = first.checked_add(3).and_then(|words| words.checked_mul(self.width)).ok_or_else(truncated)?;
            let rest = letters(in_base64(head) - begin.len())?;
            let header = decoded(&[begin, rest].concat())?;
            let stored: usize = header.get(..head).ok_or_else(truncated)?[3 * self.width..]
                .chunks_exact(self.width)
                .map(|word| self.word(word))
                .fold(0, usize::saturating_add);
            let blocks = decoded(&letters(in_base64(stored))?)?;
            return self.inflated(array, &header[..head], &blocks);
        }
        if begin.ends_with(b"=") {
            let data = decoded(&letters(in_base64(first))?)?;
            return Ok(data.get(..first).ok_or_else(truncated)?.to_vec());
        }
        let needed = first.saturating_add(self.width);
        let rest = letters(in_base64(needed) - begin.len())?;
        let data = decoded(&[begin, rest].concat())?;
        Ok(data.get(self.width..needed).ok_or_else(truncated)?.to_vec())
    }

    /// Blocks of zlib. The header holds their number, their size, the last one's size where it is shorter, and their stored
    /// sizes.
    fn inflated(&self, array: Node, header: &[u8], mut data: &[u8]) -> Result<Vec<u8>, SceneError> {
        let words: Vec<usize> = header.chunks_exact(self.width).map(|word| self.word(word)).collect();
        let (size, last, stored) = (words[1], words[2], &words[3..]);
        let mut bytes = Vec::new();
        for (number, stored) in stored.iter().enumerate() {
            let block = data.get(..*stored).ok_or_else(|| self.truncated(array))?;
            data = &data[*stored..];
            let wanted = if number + 1 == words[0] && last > 0 { last } else { size };
            self.charge(array, wanted, 1)?;
            let begin = bytes.len();
            let read = flate2::read::ZlibDecoder::new(block).take(wanted as u64).read_to_end(&mut bytes);
            if read.is_err() || bytes.len() - begin != wanted {
                return Err(self.truncated(array));
            }
        }
        Ok(bytes)
    }
}

/// Letters that so many bytes take in base64.
fn in_base64(bytes: usize) -> usize {
    bytes.div_ceil(3).saturating_mul(4)
}
