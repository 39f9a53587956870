//! The bytes of the buffers of a glTF file: binary chunk, separate file or data URI.

use std::borrow::Cow;
use std::path::Path;

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::Fault;
use super::document::Document;
use super::error::label;

/// Base64 with optional padding, because writers differ.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Reads every buffer. Each has exactly `byteLength` bytes.
pub(super) fn load<'a>(
    document: &Document,
    binary: Option<&'a [u8]>,
    folder: &Path,
) -> Result<Vec<Cow<'a, [u8]>>, Fault> {
    let mut buffers = Vec::with_capacity(document.buffers.len());
    for (index, buffer) in document.buffers.iter().enumerate() {
        let fail = |problem: String| Fault::element(label("buffer", index, buffer.name.as_deref()), problem);
        let (mut bytes, origin) = match (&buffer.uri, binary) {
            (Some(uri), _) => resolve(uri, folder).map_err(fail)?,
            (None, Some(binary)) if index == 0 => (Cow::Borrowed(binary), "the binary chunk".to_owned()),
            (None, None) if index == 0 => return Err(fail("has no URI, and the file has no binary chunk".to_owned())),
            (None, _) => return Err(fail("has no URI, and only buffer 0 can be the binary chunk".to_owned())),
        };
        let wanted = buffer.byte_length.0;
        let length = usize::try_from(wanted).ok().filter(|length| *length <= bytes.len());
        let length = length.ok_or_else(|| fail(format!("needs {wanted} bytes, {origin} has {}", bytes.len())))?;
        // A chunk is padded to a multiple of four, and a file may be longer than needed.
        match &mut bytes {
            Cow::Borrowed(slice) => *slice = &slice[..length],
            Cow::Owned(vector) => vector.truncate(length),
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The bytes behind a URI, and a description of their origin.
fn resolve(uri: &str, folder: &Path) -> Result<(Cow<'static, [u8]>, String), String> {
    if let Some(data) = strip_scheme(uri, "data") {
        let bytes = decode_data(data)?;
        return Ok((Cow::Owned(bytes), "its data URI".to_owned()));
    }
    if let Some((scheme, _)) = uri.split_once(':')
        && scheme.len() > 1
        && scheme.chars().all(|letter| letter.is_ascii_alphanumeric() || "+-.".contains(letter))
    {
        return Err(format!("the URI scheme {scheme:?} is not supported; use a file beside the model or a data URI"));
    }
    let name = String::from_utf8(percent_decode(uri)?).map_err(|_| format!("the URI {uri:?} is not UTF-8"))?;
    let path = folder.join(name);
    match std::fs::read(&path) {
        Ok(bytes) => Ok((Cow::Owned(bytes), path.display().to_string())),
        Err(error) => Err(format!("{} cannot be read: {error}", path.display())),
    }
}

fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let (head, rest) = uri.split_once(':')?;
    head.eq_ignore_ascii_case(scheme).then_some(rest)
}

/// Decodes a data URI without its `data:` (RFC 2397).
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (kind, payload) = data.split_once(',').ok_or("the data URI has no comma before its data")?;
    let bytes = percent_decode(payload)?;
    if kind.rsplit(';').next().is_some_and(|last| last.eq_ignore_ascii_case("base64")) {
        BASE64.decode(&bytes).map_err(|error| format!("the base64 of its data URI is damaged: {error}"))
    } else {
        Ok(bytes)
    }
}

/// Replaces each `%XX` by its byte (RFC 3986, section 2.1).
fn percent_decode(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let digit = |at: usize| tail.get(at).and_then(|byte| char::from(*byte).to_digit(16));
        let (Some(high), Some(low)) = (digit(0), digit(1)) else {
            return Err("a % in the URI is not followed by two hexadecimal digits".to_owned());
        };
        bytes.push((high * 16 + low) as u8);
        rest = &tail[2..];
    }
    Ok(bytes)
}
