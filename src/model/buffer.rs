//! The bytes of the buffers of a glTF file: binary chunk, separate file or data URI.

use std::borrow::Cow;
use std::io::{self, Read};
use std::path::Path;

use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::read::DecoderReader;

use super::ModelFault;
use super::document::{Document, GltfBuffer};
use super::error::label;
use crate::files::{self, Reach};

/// Base64 with optional padding, because writers differ.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Longest media type of a data URI. RFC 2397 expects short ones.
const LONGEST_KIND: usize = 1024;

/// Reads every buffer. Each has exactly `byteLength` bytes, and no more are read.
pub(super) fn load<'a>(
    document: &Document,
    binary: Option<&'a [u8]>,
    folder: &Path,
    reach: &Reach,
) -> Result<Vec<Cow<'a, [u8]>>, ModelFault> {
    let mut buffers = Vec::with_capacity(document.buffers.len());
    for (index, buffer) in document.buffers.iter().enumerate() {
        let fail = |problem: String| ModelFault::element(label("buffer", index, buffer.name.as_deref()), problem);
        let bytes = match (&buffer.uri, binary) {
            (None, _) if buffer.is_fallback => Cow::Borrowed(&[][..]),
            (Some(uri), _) => Cow::Owned(resolve(uri.get(), buffer, folder, reach).map_err(fail)?),
            (None, Some(binary)) if index == 0 => {
                // A chunk is padded to a multiple of four.
                let length = length(buffer, binary.len() as u64, "the binary chunk").map_err(fail)?;
                Cow::Borrowed(&binary[..length])
            }
            (None, None) if index == 0 => return Err(fail("has no URI, and the file has no binary chunk".to_owned())),
            (None, _) => return Err(fail("has no URI, and only buffer 0 can be the binary chunk".to_owned())),
        };
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The length of a buffer whose `origin` has this number of bytes.
fn length(buffer: &GltfBuffer, has: u64, origin: &str) -> Result<usize, String> {
    let wanted = buffer.byte_length;
    let length = usize::try_from(wanted).ok().filter(|_| wanted <= has);
    length.ok_or_else(|| format!("needs {wanted} bytes, {origin} has {has}"))
}

/// The bytes behind a URI, which is JSON text with its quotes.
fn resolve(json: &str, buffer: &GltfBuffer, folder: &Path, reach: &Reach) -> Result<Vec<u8>, String> {
    let quoted = json.strip_prefix('"').and_then(|text| text.strip_suffix('"')).ok_or("its URI is not a text")?;
    if quoted.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return decode_data(&quoted[5..], buffer);
    }
    let uri: String = serde_json::from_str(json).map_err(|error| format!("its URI cannot be read: {error}"))?;
    if let Some((scheme, _)) = uri.split_once(':')
        && scheme.len() > 1
        && scheme.chars().all(|letter| letter.is_ascii_alphanumeric() || "+-.".contains(letter))
    {
        return Err(format!("the URI scheme {scheme:?} is not supported; use a file beside the model or a data URI"));
    }
    let mut name = Vec::with_capacity(uri.len());
    let damaged = |error: io::Error| error.to_string();
    Unescaped { rest: uri.as_bytes(), json: false }.read_to_end(&mut name).map_err(damaged)?;
    let name = String::from_utf8(name).map_err(|_| format!("the URI {uri:?} is not UTF-8"))?;
    let path = folder.join(name);
    let unreadable = |fault| format!("{} cannot be read: {fault}", path.display());
    reach.admit(&path).map_err(unreadable)?;
    let (file, has) = files::open(&path).map_err(unreadable)?;
    let length = length(buffer, has, &path.display().to_string())?;
    let mut bytes = Vec::with_capacity(length);
    file.take(length as u64).read_to_end(&mut bytes).map_err(|error| unreadable(error.into()))?;
    match bytes.len() == length {
        true => Ok(bytes),
        false => Err(format!("{} became shorter while it was read", path.display())),
    }
}

/// Decodes a data URI without its `data:` (RFC 2397). Only the result is held in memory: a URI can have gigabytes.
fn decode_data(json: &str, buffer: &GltfBuffer) -> Result<Vec<u8>, String> {
    let comma = json.bytes().take(LONGEST_KIND).position(|byte| byte == b',');
    let comma = comma.ok_or("the data URI has no comma before its data")?;
    let (kind, payload) = (&json[..comma], &json[comma + 1..]);
    let mut plain = Unescaped { rest: payload.as_bytes(), json: true };
    if kind.rsplit(';').next().is_some_and(|last| last.eq_ignore_ascii_case("base64")) {
        let decoded = DecoderReader::new(plain, &BASE64);
        collect(decoded, payload.len() / 4 * 3 + 3, buffer).map_err(|error| {
            error.map_or_else(|text| text, |error| format!("the base64 of its data URI is damaged: {error}"))
        })
    } else {
        collect(&mut plain, payload.len(), buffer)
            .map_err(|error| error.map_or_else(|text| text, |error| error.to_string()))
    }
}

/// The bytes of a buffer from `source`, which has about `expected` of them. The rest is read too, so that damage in it is found.
fn collect(mut source: impl Read, expected: usize, buffer: &GltfBuffer) -> Result<Vec<u8>, Result<io::Error, String>> {
    let wanted = buffer.byte_length;
    let mut bytes = Vec::with_capacity(usize::try_from(wanted).map_or(expected, |wanted| wanted.min(expected)));
    source.by_ref().take(wanted).read_to_end(&mut bytes).map_err(Ok)?;
    let has = bytes.len() as u64 + io::copy(&mut source, &mut io::sink()).map_err(Ok)?;
    length(buffer, has, "its data URI").map_err(Err)?;
    Ok(bytes)
}

/// A text in which each `%XX` stands for a byte (RFC 3986, section 2.1), and in JSON text also `\/` and `\uXXXX`.
struct Unescaped<'a> {
    rest: &'a [u8],
    json: bool,
}

impl Unescaped<'_> {
    /// The first byte of the rest, where JSON may escape it.
    fn character(&mut self) -> io::Result<Option<u8>> {
        let (byte, length) = match self.rest {
            [] => return Ok(None),
            [b'\\', b'/', ..] if self.json => (b'/', 2),
            [b'\\', b'u', digits @ ..] if self.json => {
                let code =
                    digits.get(..4).and_then(|digits| u16::from_str_radix(str::from_utf8(digits).ok()?, 16).ok());
                (
                    code.and_then(|code| u8::try_from(code).ok())
                        .filter(u8::is_ascii)
                        .ok_or_else(|| wrong(NOT_ASCII))?,
                    6,
                )
            }
            [b'\\', ..] if self.json => return Err(wrong(NOT_ASCII)),
            [byte, ..] => (*byte, 1),
        };
        self.rest = &self.rest[length..];
        Ok(Some(byte))
    }
}

const NOT_ASCII: &str = "its data URI has a character that no URI has";

fn wrong(message: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

impl Read for Unescaped<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        for (count, slot) in out.iter_mut().enumerate() {
            let Some(byte) = self.character()? else { return Ok(count) };
            *slot = byte;
            if byte == b'%' {
                let mut digit =
                    || Ok::<_, io::Error>(self.character()?.and_then(|digit| char::from(digit).to_digit(16)));
                let (Some(high), Some(low)) = (digit()?, digit()?) else {
                    return Err(wrong("a % in the URI is not followed by two hexadecimal digits"));
                };
                *slot = (high * 16 + low) as u8;
            }
        }
        Ok(out.len())
    }
}
