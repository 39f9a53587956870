//! Writes valid containers around hostile sizes: zlib in VTK, HDF5 with right checksums, PNG with right CRCs, EXR, and meshopt in glTF.

use std::io::Write;

use base64::Engine;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    SmallVec, Vec2, WritableImage,
};
use flate2::write::ZlibEncoder;
use hdf5_writer::{
    AttributeBuilder, DatasetBuilder, Error, FILTER_DEFLATE, FilterDescription, Hdf5Builder, WriteOptions,
    jenkins_lookup3,
};
use serde_json::{Value, json};

use crate::mutate::Random;

/// Sizes at which a reader may ask for too much, or count too far.
const HOSTILE: [u64; 22] = [
    0,
    1,
    2,
    255,
    65_535,
    65_536,
    1 << 20,
    1 << 24,
    1 << 26,
    1 << 28,
    1 << 29,
    1 << 30,
    (1 << 31) - 1,
    1 << 31,
    u32::MAX as u64,
    1 << 32,
    1 << 40,
    1_000_000_000_000_000_000,
    i64::MAX as u64,
    1 << 63,
    u64::MAX - 7,
    u64::MAX,
];

/// The true size, or in one case of `one_in` a hostile one.
fn size(random: &mut Random, truth: usize, one_in: usize) -> u64 {
    if random.below(one_in) == 0 { *random.pick(&HOSTILE) } else { truth as u64 }
}

/// Bytes that compress well or badly. One case in a hundred is a megabyte.
fn content(random: &mut Random, unit: usize) -> Vec<u8> {
    let long = if random.below(100) == 0 { 1 << 20 } else { 1 << random.below(13) };
    let length = long / unit * unit;
    match random.below(3) {
        0 => vec![0; length],
        1 => (0..length).map(|at| (at / unit) as u8).collect(),
        _ => (0..length).map(|_| random.next() as u8).collect(),
    }
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    // Memory takes every byte.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// A mesh whose arrays lie in blocks of zlib. Several pieces may read the same blocks.
pub fn vtk(random: &mut Random, _: &[Vec<u8>]) -> Vec<u8> {
    let (kind, bytes_each) = *random.pick(&[("Float32", 4), ("Float64", 8), ("Int8", 1), ("UInt16", 2), ("Int64", 8)]);
    let width = if random.below(2) == 0 { 4 } else { 8 };
    let mut appended = Vec::new();
    let mut array = |random: &mut Random, bytes: &[u8]| {
        let offset = appended.len();
        let blocks: Vec<&[u8]> = bytes.chunks(1 << 15).collect();
        let stored: Vec<Vec<u8>> = blocks.iter().map(|block| zlib(block)).collect();
        let last = blocks.last().map_or(0, |block| if block.len() == 1 << 15 { 0 } else { block.len() });
        let mut header = vec![size(random, blocks.len(), 8), size(random, 1 << 15, 8), size(random, last, 8)];
        header.extend(stored.iter().map(|block| size(random, block.len(), 30)));
        appended.extend(header.iter().flat_map(|word| word.to_le_bytes()[..width].to_vec()));
        appended.extend(stored.concat());
        offset
    };
    let places = content(random, 24);
    let count = places.len() / (3 * bytes_each);
    let places = array(random, &places);
    let values = array(random, &vec![200; count]);
    let pieces = if random.below(6) == 0 { 1 + random.below(300) } else { 1 };
    let mut xml = format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt{}\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>",
        8 * width
    );
    for _ in 0..pieces {
        let values = if random.below(10) == 0 { places } else { values };
        let stated = match random.below(3) {
            0 if random.below(2) == 0 => format!(" NumberOfPoints=\"{count}\""),
            0 => format!(" NumberOfPoints=\"{}\"", random.pick(&HOSTILE)),
            _ => String::new(),
        };
        xml += &format!(
            "<Piece{stated}><Points><DataArray type=\"{kind}\" NumberOfComponents=\"3\" format=\"appended\" offset=\"{places}\"/></Points>\
             <PointData><DataArray type=\"UInt8\" Name=\"T\" format=\"appended\" offset=\"{values}\"/></PointData></Piece>"
        );
    }
    xml += "</UnstructuredGrid>";
    let mut file = xml.into_bytes();
    if random.below(2) == 0 {
        file.extend(b"<AppendedData encoding=\"raw\">_");
        file.extend(&appended);
    } else {
        file.extend(b"<AppendedData encoding=\"base64\">_");
        file.extend(base64::engine::general_purpose::STANDARD.encode(&appended).into_bytes());
    }
    file.extend(b"</AppendedData></VTKFile>");
    file
}

const SET: &str = "AnalysisSet1";
const GROUP: &str = "DataGroup1";

/// A small TMD, whose large datasets may be in compressed chunks.
fn small_tmd(chunked: bool, strings: bool) -> Result<Vec<u8>, Error> {
    let (times, nodes) = (2u64, 3u64);
    let group = |name: &str| format!("{SET}/{GROUP}/{name}");
    let deflate = || FilterDescription { id: FILTER_DEFLATE, name: None, client_data: vec![6] };
    let pack = |dataset: DatasetBuilder, chunk: &[u64]| {
        if chunked { dataset.chunked(chunk.to_vec()).filter(deflate()) } else { dataset }
    };
    let kinds = ["D", "one", "B", "two", "D", "three"].repeat(2);
    let data = [10.0, 900.0, 1.0].repeat((times * nodes) as usize);
    let names = ["Temperature", "Capacitance", "Total_Solar_Heat_Source"];
    let text = |name: String, shape: Vec<u64>, values: &[&str]| {
        if strings {
            DatasetBuilder::vlen_string_data(name, shape, values)
        } else {
            DatasetBuilder::fixed_string_data(name, shape, values)
        }
    };
    Hdf5Builder::new()
        .attribute(AttributeBuilder::fixed_string_vector("FileVersion", &["01.00"])?)
        .group_attribute(SET, AttributeBuilder::scalar("TAbs", 273.15)?)
        .dataset(DatasetBuilder::typed_data(format!("{SET}/thermalNodes"), [nodes, 2], &[1, 1, 2, 1, 3, 1])?)
        .dataset(DatasetBuilder::fixed_string_data(format!("{SET}/thermalNodesRealAttributes"), [3], &names)?)
        .dataset(text(format!("{SET}/thermalNodesStringAttributes"), vec![2], &["Type", "Label"])?)
        .dataset(DatasetBuilder::typed_data(group("times"), [times], &[0.0, 10.0])?)
        .dataset(pack(
            DatasetBuilder::typed_data(group("thermalNodesRealData"), [times, nodes, 3], &data)?,
            &[1, nodes, 3],
        ))
        .dataset(text(group("thermalNodesStringData"), vec![times, nodes, 2], &kinds)?)
        .dataset(DatasetBuilder::typed_data(format!("{SET}/conductorsGL"), [1, 4], &[1, 2, 1, 1])?)
        .dataset(pack(
            DatasetBuilder::typed_data(group("conductorDataGL"), [times, 1, 2], &[0.5, 1.0, 0.5, 1.0])?,
            &[2, 1, 2],
        ))
        .dataset(DatasetBuilder::typed_data(format!("{SET}/conductorsGR"), [1, 4], &[2, 3, 1, 1])?)
        .dataset(DatasetBuilder::typed_data(group("conductorDataGR"), [times, 1, 2], &[1e-3, 1.0, 1e-3, 1.0])?)
        .into_plan()?
        .encode(WriteOptions::default())
}

/// TMD files in four layouts, which are valid.
pub fn tmds() -> Vec<Vec<u8>> {
    let layouts = [(false, false), (true, false), (false, true), (true, true)];
    layouts.into_iter().filter_map(|(chunked, strings)| small_tmd(chunked, strings).ok()).collect()
}

/// A TMD with changed object headers, whose checksums are right again.
pub fn hdf5(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = random.pick(seeds).clone();
    let headers = headers(&bytes);
    for _ in 0..=random.below(3) {
        let (begin, end) = *random.pick(&headers);
        let at = begin + random.below(end - begin);
        match random.below(3) {
            0 => bytes[at] ^= 1 << random.below(8),
            // A word of an extent, an address or a size is among those that are changed.
            1 => replace_word(&mut bytes[at..end], random),
            _ => {
                let known: Vec<usize> = (begin..end.saturating_sub(8)).filter(|at| is_small(&bytes[*at..])).collect();
                if !known.is_empty() {
                    let at = *random.pick(&known);
                    replace_word(&mut bytes[at..end], random);
                }
            }
        }
    }
    for (begin, end) in headers {
        let start = signature(&bytes, begin);
        let sum = jenkins_lookup3(&bytes[start..end]).to_le_bytes();
        bytes[end..end + 4].copy_from_slice(&sum);
    }
    bytes
}

/// Whether eight bytes are a number below 65536, as extents are.
fn is_small(bytes: &[u8]) -> bool {
    bytes[2..8].iter().all(|byte| *byte == 0) && bytes[..2] != [0, 0]
}

fn replace_word(bytes: &mut [u8], random: &mut Random) {
    let wide = if random.below(2) == 0 { 8 } else { 4 };
    let count = wide.min(bytes.len());
    bytes[..count].copy_from_slice(&random.pick(&HOSTILE).to_le_bytes()[..count]);
}

/// The messages of each object header of version 2, without signature and checksum.
fn headers(bytes: &[u8]) -> Vec<(usize, usize)> {
    let places = (0..bytes.len().saturating_sub(16)).filter(|at| bytes[*at..].starts_with(b"OHDR"));
    let messages = places.filter_map(|at| {
        let flags = bytes[at + 5];
        let width = 1 << (flags & 3);
        let size_at = at + 6 + if flags & 0x20 == 0 { 0 } else { 16 } + if flags & 0x10 == 0 { 0 } else { 4 };
        let mut word = [0; 8];
        word[..width].copy_from_slice(bytes.get(size_at..size_at + width)?);
        let (begin, length) = (size_at + width, u64::from_le_bytes(word) as usize);
        (begin.checked_add(length)?.checked_add(4)? <= bytes.len() && length > 0).then_some((begin, begin + length))
    });
    messages.collect()
}

/// Where the header of these messages begins.
fn signature(bytes: &[u8], messages: usize) -> usize {
    bytes[..messages].windows(4).rposition(|window| window == b"OHDR").unwrap_or(0)
}

/// A PNG with right CRCs, whose size need not be that of its pixels.
pub fn png(random: &mut Random, _: &[Vec<u8>]) -> Vec<u8> {
    let (columns, rows) = (1 + random.below(64), 2 + random.below(64));
    let depth = *random.pick(&[8u8, 8, 16, 16, 1, 4]);
    let colour = *random.pick(&[0u8, 0, 0, 0, 2, 3]);
    let line = 1 + columns * usize::from(depth).div_ceil(8);
    let filter = random.below(5) as u8;
    let noise = random.next() as u8;
    let pixels: Vec<u8> = (0..rows)
        .flat_map(|row| (0..line).map(move |at| if at == 0 { filter } else { noise ^ (row * at) as u8 }))
        .collect();
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::new();
    header.extend((size(random, columns, 4) as u32).to_be_bytes());
    header.extend((size(random, rows, 4) as u32).to_be_bytes());
    header.extend([depth, colour, 0, 0, u8::from(random.below(8) == 0)]);
    chunk(&mut file, b"IHDR", &header);
    if random.below(6) == 0 {
        let text = [b"note\0\0".to_vec(), zlib(&content(random, 1))].concat();
        chunk(&mut file, b"zTXt", &text);
    }
    let stored = zlib(&pixels);
    let cut = if random.below(10) == 0 { random.below(stored.len()) } else { stored.len() };
    chunk(&mut file, b"IDAT", &stored[..cut]);
    chunk(&mut file, b"IEND", &[]);
    file
}

fn chunk(file: &mut Vec<u8>, kind: &[u8; 4], content: &[u8]) {
    file.extend((content.len() as u32).to_be_bytes());
    let mut sum = flate2::Crc::new();
    sum.update(kind);
    sum.update(content);
    file.extend(kind);
    file.extend(content);
    file.extend(sum.sum().to_be_bytes());
}

/// EXR files of one channel in every compression that a map may have and both layouts, which are valid.
pub fn exrs() -> Vec<Vec<u8>> {
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
    ];
    let layouts = [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 4))];
    let all = compressions.into_iter().flat_map(|compression| layouts.map(|blocks| (compression, blocks)));
    let file = |(compression, blocks)| {
        let values: Vec<f32> = (0..9 * 18).map(|at| 250.0 + at as f32).collect();
        let channels = AnyChannels::sort(SmallVec::from_vec(vec![AnyChannel::new("T", FlatSamples::F32(values))]));
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let image = Image::from_layer(Layer::new((18, 9), LayerAttributes::default(), encoding, channels));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).ok()?;
        Some(bytes.into_inner())
    };
    all.filter_map(file).collect()
}

/// An EXR with changed windows, tiles, offsets or sizes of blocks.
pub fn exr(random: &mut Random, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = random.pick(seeds).clone();
    const PLACES: [(&[u8], usize); 6] = [
        (b"dataWindow\0box2i\0", 4),
        (b"displayWindow\0box2i\0", 4),
        (b"tiles\0tiledesc\0", 4),
        (b"channels\0chlist\0", 6),
        (b"chunkCount\0int\0", 4),
        (b"pixelAspectRatio\0float\0", 4),
    ];
    for _ in 0..=random.below(3) {
        let (name, skipped) = *random.pick(&PLACES);
        let known = bytes.windows(name.len()).position(|window| window == name);
        let at = match known.filter(|_| random.below(3) > 0) {
            Some(begin) => begin + name.len() + skipped + 4 * random.below(4),
            // Behind the header stand the offsets and the blocks.
            None => random.below(bytes.len()),
        };
        let end = bytes.len();
        if at < end {
            replace_word(&mut bytes[at..(at + 4).min(end)], random);
        }
    }
    bytes
}

/// A stream of elements that all have the bytes of `last`.
fn same_elements(count: usize, last: &[u8]) -> Vec<u8> {
    let stride = last.len();
    let block = (8192 / stride / 16 * 16).min(256);
    let mut stream = vec![0xa0];
    let mut left = count;
    while left > 0 {
        let elements = left.min(block);
        stream.extend(vec![0; elements.div_ceil(16).div_ceil(4) * stride]);
        left -= elements;
    }
    stream.extend(vec![0; 32usize.saturating_sub(stride)]);
    stream.extend(last);
    stream
}

/// A glTF with compressed positions, triangles and copies: some hundred bytes may stand for any number of triangles.
pub fn meshopt(random: &mut Random, _: &[Vec<u8>]) -> Vec<u8> {
    // Most models are small: one at the bound takes a tenth of a second.
    let largest = if random.below(20) == 0 { [12, 14] } else { [5, 6] };
    let [bits, more] = largest.map(|most| random.below(most));
    let (triangles, copies) = (1 + random.below(1 << bits), 1 + random.below(1 << more));
    let corners: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let each: Vec<u8> = [0.25f32; 3].iter().flat_map(|x| x.to_le_bytes()).collect();
    let faces = [&[0xe1][..], &vec![0xfe; triangles], &vec![0; triangles], &[0; 16]].concat();
    let places = same_elements(copies, &each);
    let mut buffer = corners.clone();
    let mut views = vec![json!({"buffer": 0, "byteLength": 36})];
    let mut add = |random: &mut Random, stream: &[u8], stride: usize, count: usize, mode: &str| {
        let offset = buffer.len();
        buffer.extend(stream);
        buffer.resize(buffer.len().next_multiple_of(4), 0);
        let compression = json!({
            "buffer": 0, "byteOffset": size(random, offset, 60), "byteLength": size(random, stream.len(), 60), "byteStride": stride,
            "count": size(random, count, 10), "mode": mode,
        });
        views.push(
            json!({"buffer": 1, "byteLength": stride * count, "extensions": {"EXT_meshopt_compression": compression}}),
        );
    };
    add(random, &faces, 4, 3 * triangles, "TRIANGLES");
    add(random, &places, 12, copies, "ATTRIBUTES");
    let sparse = random.below(8) == 0;
    let mut positions = json!({"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"});
    if sparse {
        let zeros = json!({"bufferView": 0, "componentType": 5125});
        positions = json!({"componentType": 5126, "count": size(random, 3, 2), "type": "VEC3",
            "sparse": {"count": 1, "indices": zeros, "values": {"bufferView": 0}}});
    }
    let primitive = json!({"attributes": {"POSITION": 0}, "indices": 1});
    let primitives: Vec<Value> = vec![primitive; 1 + if random.below(30) == 0 { random.below(200) } else { 0 }];
    let node = json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}});
    let nodes: Vec<Value> = vec![node; 1 + if random.below(30) == 0 { random.below(200) } else { 0 }];
    let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
    let file = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["EXT_meshopt_compression", "EXT_mesh_gpu_instancing"],
        "extensionsRequired": ["EXT_meshopt_compression"],
        "buffers": [
            {"byteLength": buffer.len(), "uri": format!("data:application/octet-stream;base64,{data}")},
            {"byteLength": size(random, 1 << 20, 4), "extensions": {"EXT_meshopt_compression": {"fallback": true}}},
        ],
        "bufferViews": views,
        "accessors": [
            positions,
            {"bufferView": 1, "componentType": 5125, "count": size(random, 3 * triangles, 12), "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": size(random, copies, 12), "type": "VEC3"},
        ],
        "meshes": [{"primitives": primitives}],
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
    });
    file.to_string().into_bytes()
}

/// Valid meshes, images and models, from which changed ones may be made too.
pub fn some(make: fn(&mut Random, &[Vec<u8>]) -> Vec<u8>, read: impl Fn(&[u8]) -> bool) -> Vec<Vec<u8>> {
    let mut random = Random::new(1);
    (0..1000).map(|_| make(&mut random, &[])).filter(|bytes| bytes.len() < 4000 && read(bytes)).take(8).collect()
}
