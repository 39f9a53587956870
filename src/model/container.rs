//! Splits a `.glb` or `.gltf` file into JSON text and binary chunk (glTF 2.0, 4).

use super::{ModelFault, format};

const MAGIC: &[u8; 4] = b"glTF";
const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";
const HEADER_LENGTH: usize = 12;
const CHUNK_HEADER_LENGTH: usize = 8;

/// The two parts of a glTF file.
pub(super) struct Container<'a> {
    pub(crate) json: &'a [u8],
    pub(crate) binary: Option<&'a [u8]>,
}

/// Splits a GLB file. Any other file counts as JSON text.
/// The reader of the `gltf` crate subtracts the header from an unchecked length, so it is not used.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, ModelFault> {
    if bytes.iter().all(|byte| *byte == 0 || byte.is_ascii_whitespace()) {
        return Err(ModelFault::Empty);
    }
    if let Some(found) = format::not_fetched(bytes) {
        return Err(ModelFault::NotFetched(found));
    }
    if let Some(format) = format::other(bytes) {
        return Err(ModelFault::Format(format));
    }
    if !bytes.starts_with(MAGIC) {
        // Section 4.2 forbids a byte order mark but allows readers to ignore it.
        let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        return Ok(Container { json, binary: None });
    }
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(ModelFault::Container(format!(
            "the header needs {HEADER_LENGTH} bytes, the file has {}",
            bytes.len()
        )));
    };
    if version == 1 {
        return Err(ModelFault::Format(format::GLTF_1));
    }
    if version != 2 {
        return Err(ModelFault::Container(format!("version {version}, only 2 is supported")));
    }
    let Some(mut rest) = bytes.get(HEADER_LENGTH..length) else {
        return Err(ModelFault::Container(format!(
            "the header says {length} bytes, the file has {}: it is truncated or damaged",
            bytes.len()
        )));
    };

    let (json, after) = chunk(rest)?;
    if json.kind != JSON_CHUNK {
        return Err(ModelFault::Container(format!(
            "the first chunk is {:?}, not JSON",
            String::from_utf8_lossy(json.kind)
        )));
    }
    rest = after;
    let mut binary = None;
    // Section 4.4.3: only the first binary chunk counts. Chunks of other kinds are ignored.
    while !rest.is_empty() && binary.is_none() {
        let (chunk, after) = chunk(rest)?;
        if chunk.kind == BINARY_CHUNK {
            binary = Some(chunk.data);
        }
        rest = after;
    }
    Ok(Container { json: json.data, binary })
}

struct Chunk<'a> {
    kind: &'a [u8],
    data: &'a [u8],
}

fn chunk(bytes: &[u8]) -> Result<(Chunk<'_>, &[u8]), ModelFault> {
    let (Some(length), Some(kind)) = (word(bytes, 0), bytes.get(4..CHUNK_HEADER_LENGTH)) else {
        return Err(ModelFault::Container(format!(
            "{} bytes are left where a chunk header of 8 should be",
            bytes.len()
        )));
    };
    let data = &bytes[CHUNK_HEADER_LENGTH..];
    match data.split_at_checked(length) {
        Some((data, rest)) => Ok((Chunk { kind, data }, rest)),
        None => Err(ModelFault::Container(format!(
            "the {} chunk says {length} bytes, {} are left",
            String::from_utf8_lossy(kind).trim_end_matches('\0'),
            data.len()
        ))),
    }
}

/// The little-endian 32-bit number at `offset`.
fn word(bytes: &[u8], offset: usize) -> Option<usize> {
    let word = bytes.get(offset..)?.first_chunk::<4>()?;
    usize::try_from(u32::from_le_bytes(*word)).ok()
}
