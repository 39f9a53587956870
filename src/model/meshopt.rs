//! Decodes compressed buffer views: the streams and filters of the glTF extension EXT_meshopt_compression (its specification, appendices A and B).

use super::meshopt_filter::Filter;

/// Fewest bytes of the tail of an attribute stream.
const LEAST_TAIL: usize = 32;
/// Elements that share the widths of their deltas.
const GROUP: usize = 16;
/// Bytes of the table at the end of a triangle stream.
const TABLE: usize = 16;
/// Zero bytes at the end of an index stream.
const INDEX_TAIL: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StreamKind {
    /// Elements of any meaning.
    Attributes,
    /// Indices of a list of triangles.
    Triangles,
    Indices,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Compressed {
    pub(super) buffer: usize,
    /// First compressed byte.
    pub(super) offset: u64,
    pub(super) length: u64,
    /// Bytes of an element.
    pub(super) stride: usize,
    pub(super) count: usize,
    pub(super) mode: StreamKind,
    pub(super) filter: Filter,
}

impl Compressed {
    /// The elements, one after the other.
    ///
    /// # Errors
    /// Bytes that are no such stream, in words.
    pub(super) fn decode(&self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let (stride, count) = (self.stride, self.count);
        if count.checked_mul(stride).is_none() {
            return Err(format!("has {count} elements of {stride} bytes"));
        }
        match self.mode {
            StreamKind::Attributes => {
                if stride == 0 || stride > 256 || stride % 4 != 0 {
                    return Err(format!("has a stride of {stride} bytes, where a multiple of 4 up to 256 is possible"));
                }
                let mut elements = attributes(bytes, stride, count)?;
                self.filter.apply(&mut elements, stride)?;
                Ok(elements)
            }
            StreamKind::Triangles | StreamKind::Indices if self.filter != Filter::None => {
                Err("has a filter, which indices may not have".to_owned())
            }
            StreamKind::Triangles => packed(&triangles(bytes, count)?, stride),
            StreamKind::Indices => packed(&indices(bytes, count)?, stride),
        }
    }
}

/// Indices as little-endian numbers of 2 or 4 bytes.
fn packed(indices: &[u32], stride: usize) -> Result<Vec<u8>, String> {
    match stride {
        2 => match indices.iter().find(|index| **index > u32::from(u16::MAX)) {
            None => Ok(indices.iter().flat_map(|index| (*index as u16).to_le_bytes()).collect()),
            Some(index) => Err(format!("has index {index} in 2 bytes")),
        },
        4 => Ok(indices.iter().flat_map(|index| index.to_le_bytes()).collect()),
        _ => Err(format!("has indices of {stride} bytes, where 2 or 4 are possible")),
    }
}

struct StreamReader<'a> {
    rest: &'a [u8],
}

impl<'a> StreamReader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or("ends too early")?;
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// A number in groups of seven bits, the lowest first. At most 32 bits.
    fn number(&mut self) -> Result<u32, String> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("has a number of more than five bytes".to_owned())
    }

    /// An index as its signed distance from the last one.
    fn index(&mut self, last: u32) -> Result<u32, String> {
        Ok(last.wrapping_add(signed(self.number()?)))
    }
}

/// A signed number from one whose lowest bit is the sign, in two's complement.
fn signed(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn header(reader: &mut StreamReader, wanted: u8) -> Result<(), String> {
    let header = reader.byte()?;
    if header == wanted { Ok(()) } else { Err(format!("begins with {header:#04x} instead of {wanted:#04x}")) }
}

/// Mode 0. Elements are stored in blocks, byte by byte: the first bytes of all elements of the block, then their second bytes, and so on.
fn attributes(bytes: &[u8], stride: usize, count: usize) -> Result<Vec<u8>, String> {
    let tail = stride.max(LEAST_TAIL);
    let body = bytes.len().checked_sub(tail).ok_or("ends too early")?;
    let mut reader = StreamReader { rest: &bytes[..body] };
    header(&mut reader, 0xa0)?;
    let mut last = bytes[bytes.len() - stride..].to_vec();
    let block = (8192 / stride / GROUP * GROUP).min(256);
    let mut elements: Vec<u8> = Vec::new();
    let mut left = count;
    while left > 0 {
        let size = left.min(block);
        let first = elements.len();
        // Every byte of a block takes at least a bit of the stream, so the list can not grow beyond it.
        elements.resize(first + size * stride, 0);
        for byte in 0..stride {
            let groups = size.div_ceil(GROUP);
            let widths = reader.take(groups.div_ceil(4))?;
            for group in 0..groups {
                let width = widths[group / 4] >> (group % 4 * 2) & 3;
                let deltas = deltas(&mut reader, width)?;
                for (at, delta) in (group * GROUP..size).zip(deltas) {
                    last[byte] = last[byte].wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
                    elements[first + at * stride + byte] = last[byte];
                }
            }
        }
        left -= size;
    }
    if reader.rest.is_empty() { Ok(elements) } else { Err("goes on after its last element".to_owned()) }
}

/// Sixteen deltas of 0, 2, 4 or 8 bits. A delta with all its bits set is followed by a whole byte.
fn deltas(reader: &mut StreamReader, width: u8) -> Result<[u8; GROUP], String> {
    let mut deltas = [0; GROUP];
    let bits = match width {
        0 => return Ok(deltas),
        3 => {
            deltas.copy_from_slice(reader.take(GROUP)?);
            return Ok(deltas);
        }
        width => 2 * usize::from(width),
    };
    let most = (1u8 << bits) - 1;
    let packed = reader.take(GROUP * bits / 8)?;
    for (at, delta) in deltas.iter_mut().enumerate() {
        let from_top = 8 - bits - at * bits % 8;
        let value = packed[at * bits / 8] >> from_top & most;
        *delta = if value == most { reader.byte()? } else { value };
    }
    Ok(deltas)
}

/// The last sixteen values. A place counts back from the newest, 0.
struct RecentValues<T> {
    values: [T; 16],
    next: usize,
}

impl<T: Copy> RecentValues<T> {
    fn of(value: T) -> Self {
        Self { values: [value; 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.values[self.next % 16] = value;
        self.next += 1;
    }

    fn back(&self, place: usize) -> T {
        self.values[(self.next + 31 - place) % 16]
    }
}

/// Mode 1. A triangle shares an edge with one of the last sixteen, or starts anew.
fn triangles(bytes: &[u8], count: usize) -> Result<Vec<u32>, String> {
    if !count.is_multiple_of(3) {
        return Err(format!("has {count} indices of triangles, which is no multiple of 3"));
    }
    let body = bytes.len().checked_sub(TABLE).ok_or("ends too early")?;
    let table = &bytes[body..];
    let mut reader = StreamReader { rest: &bytes[..body] };
    header(&mut reader, 0xe1)?;
    let codes = reader.take(count / 3)?;
    let mut indices = Vec::with_capacity(count);
    let mut edges = RecentValues::of([u32::MAX; 2]);
    let mut vertices = RecentValues::of(u32::MAX);
    let (mut next, mut last) = (0u32, 0u32);
    let fresh = |next: &mut u32| {
        let index = *next;
        *next = next.wrapping_add(1);
        index
    };
    for code in codes {
        let (high, low) = (usize::from(code >> 4), usize::from(code & 15));
        if high < 15 {
            let [a, b] = edges.back(high);
            let c = match low {
                0 => fresh(&mut next),
                1..=12 => vertices.back(low),
                13 => last.wrapping_sub(1),
                14 => last.wrapping_add(1),
                _ => reader.index(last)?,
            };
            if low == 0 || low > 12 {
                vertices.push(c);
            }
            if low > 12 {
                last = c;
            }
            edges.push([c, b]);
            edges.push([a, c]);
            indices.extend([a, b, c]);
            continue;
        }
        let aux = if low < 14 { table[low] } else { reader.byte()? };
        if low >= 14 && aux == 0 {
            next = 0;
        }
        let places = [if low == 15 { 15 } else { 0 }, usize::from(aux >> 4), usize::from(aux & 15)];
        // All three are found before any of them counts as one of the last.
        let mut corners = [0; 3];
        for (corner, place) in corners.iter_mut().zip(places) {
            *corner = match place {
                0 => fresh(&mut next),
                15 if low >= 14 => 0,
                place => vertices.back(place - 1),
            };
        }
        for (corner, place) in corners.iter_mut().zip(places) {
            if place == 15 && low >= 14 {
                last = reader.index(last)?;
                *corner = last;
            }
        }
        for (at, (corner, place)) in corners.into_iter().zip(places).enumerate() {
            if at == 0 || place == 0 || (place == 15 && low >= 14) {
                vertices.push(corner);
            }
        }
        let [a, b, c] = corners;
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
        indices.extend(corners);
    }
    if reader.rest.is_empty() { Ok(indices) } else { Err("goes on after its last triangle".to_owned()) }
}

/// Mode 2. Every index is a distance from one of two earlier ones.
fn indices(bytes: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let body = bytes.len().checked_sub(INDEX_TAIL).ok_or("ends too early")?;
    let mut reader = StreamReader { rest: &bytes[..body] };
    header(&mut reader, 0xd1)?;
    if count > reader.rest.len() {
        return Err("ends too early".to_owned());
    }
    let mut last = [0u32; 2];
    let mut indices = Vec::with_capacity(count);
    for _ in 0..count {
        let value = reader.number()?;
        let base = &mut last[(value & 1) as usize];
        *base = base.wrapping_add(signed(value >> 1));
        indices.push(*base);
    }
    if reader.rest.is_empty() { Ok(indices) } else { Err("goes on after its last index".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Streams of the encoder of meshoptimizer 0.2.30 (Python package), vertex version 0 and index version 1, of the elements below.
    const ATTRIBUTES: &str = "a055555555020820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820820\
        82082082aaaaaaaa0f66666666666666adf66666666666666659f6666ff66666666659baadf66666666666666659f666666666ff666659baadf666666666666666\
        59f66666666666666f59baf666666666666666f2f66666666666666659f666ff666666666659baadf66666666666666659f66666666ff6666659baadf666666666\
        66666659f6666666666666ff59baadf66666666666666659f66666666666666659000000007f000000000e304c6e8aacc8eaf9d7bb997d5b3f1d01203c5e7a9cb8\
        daf6e7cba98d6b4f2d11102c4e6a8ca8cae6f7dbb99d7b5fc000000050150820820820820820820820002af66ff6666666666659baadf66666666666666659f666\
        6666ff66000059baad000000000000000000000000000000000000000000000000000000000000005a0500";
    const TRIANGLES: &str = "e1fe0dfe13fe12fe12fe0dfe03fe02fe02fe10fffffffefffe8fffff1e13ff1e0ecf0f0cf304f202f2028f048f048f028f0200ffac01b901b801f301015f040400\
        1faf0101fff802850308ff060101ffc4040202ffbf040202ba04007687566778a9866589689801690000";
    const INDICES: &str = "d10004cd010407981ffd891103921f0400000000";

    /// What the triangles are. The encoder turns some of them round.
    const CORNERS: [[u32; 3]; 33] = [
        [0, 1, 6],
        [0, 6, 5],
        [2, 7, 1],
        [1, 7, 6],
        [3, 8, 2],
        [2, 8, 7],
        [4, 9, 3],
        [3, 9, 8],
        [5, 6, 11],
        [5, 11, 10],
        [6, 7, 12],
        [6, 12, 11],
        [7, 8, 13],
        [7, 13, 12],
        [8, 9, 14],
        [8, 14, 13],
        [0, 1, 2],
        [2, 1, 3],
        [100, 7, 99],
        [98, 97, 100],
        [99, 100, 101],
        [0, 1, 2],
        [13, 2, 12],
        [3, 200, 5],
        [1, 0, 9],
        [12, 11, 10],
        [300, 301, 302],
        [302, 301, 303],
        [303, 301, 300],
        [15, 16, 17],
        [17, 16, 18],
        [17, 18, 19],
        [302, 301, 304],
    ];

    fn bytes(text: &str) -> Vec<u8> {
        let digits: Vec<u8> = text.chars().map(|digit| digit.to_digit(16).unwrap() as u8).collect();
        digits.as_chunks::<2>().0.iter().map(|[high, low]| high << 4 | low).collect()
    }

    /// Slow and fast changes, constants, noise.
    fn element(i: u32) -> [u8; 4] {
        let jump = if i.is_multiple_of(37) { 90 } else { 0 };
        let noise = if i < 48 { (i * i * 31) >> 2 } else { 7 };
        [i / 3, i % 16 * 3 + jump, 5, noise].map(|value| value as u8)
    }

    fn stream(mode: StreamKind, stride: usize, count: usize) -> Compressed {
        Compressed { buffer: 0, offset: 0, length: 0, stride, count, mode, filter: Filter::None }
    }

    fn all() -> [(Compressed, Vec<u8>, Vec<u8>); 3] {
        let elements: Vec<u8> = (0..300).flat_map(element).collect();
        let corners = CORNERS.as_flattened().iter().flat_map(|index| index.to_le_bytes()).collect();
        let list =
            [0u32, 1, 51, 2, 49, 1000, 70000, 69999, 3, 4].iter().flat_map(|index| index.to_le_bytes()).collect();
        [
            (stream(StreamKind::Attributes, 4, 300), bytes(ATTRIBUTES), elements),
            (stream(StreamKind::Triangles, 4, 99), bytes(TRIANGLES), corners),
            (stream(StreamKind::Indices, 4, 10), bytes(INDICES), list),
        ]
    }

    #[test]
    fn streams_of_another_encoder_are_decoded() {
        for (stream, bytes, expected) in all() {
            assert_eq!(stream.decode(&bytes).as_ref(), Ok(&expected), "{:?}", stream.mode);
            // A changed byte of the stream gives other elements or an error.
            let same = (0..bytes.len()).filter(|at| {
                let mut wrong = bytes.clone();
                wrong[*at] ^= 1;
                stream.decode(&wrong).as_ref() == Ok(&expected)
            });
            // Bits of the widths of groups that the last block does not have, zero bytes before a tail, entries of the table that nothing uses.
            assert!(same.count() * 2 < bytes.len(), "{:?}", stream.mode);
        }
    }

    #[test]
    fn a_stream_that_is_cut_or_goes_on_is_refused() {
        for (stream, bytes, _) in all() {
            for length in 0..bytes.len() {
                assert!(stream.decode(&bytes[..length]).is_err(), "{:?} of {length} bytes", stream.mode);
            }
            assert!(stream.decode(&[&bytes[..], &[0]].concat()).is_err());
            let many = Compressed { count: usize::MAX / 8, ..stream.clone() };
            assert!(many.decode(&bytes).is_err(), "and so is one that claims more than it has, at once");
            assert!(Compressed { stride: 3, ..stream.clone() }.decode(&bytes).is_err());
        }
        let (triangles, bytes, _) = &all()[1];
        assert!(Compressed { filter: Filter::Exponential, ..triangles.clone() }.decode(bytes).is_err());
    }
}
