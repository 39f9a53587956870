//! `radiance.planet_map` and `radiance.planet_day_night`: a planet that is not uniform.

use std::f64::consts::TAU;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use exr::meta::BlockDescription;
use exr::meta::attribute::LevelMode;
use exr::prelude::{Compression, FlatSamples, MetaData, ReadChannels, ReadLayers, read};
use glam::DVec3;

use super::error::SceneError;
use super::keys;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::direction;
use crate::environment::Orbit;
use crate::files::{self, Expansion, decode};
use crate::text::plain;
use crate::thermal::planet_map::{DayLaw, Equirectangular, MapAxes, PlanetPattern};

/// Most cells of a map. With the poles they stay below the 128 MiB that every device binds at once.
const MOST_CELLS: usize = 1 << 24;
/// Hottest cell [K].
const HOTTEST: f32 = 6000.0;

/// The values of a map, in words, and the largest of them.
struct MapKind {
    values: &'static str,
    most: f32,
    unit: &'static str,
}

const KELVIN: MapKind = MapKind { values: "temperatures in K", most: HOTTEST, unit: " K" };
const ALBEDO: MapKind = MapKind { values: "albedos", most: 1.0, unit: "" };

/// Sidereal day of the Earth [s] (IERS Conventions 2010).
const SIDEREAL_DAY: f64 = 86_164.098_9;

/// Reads the pattern of a planet. A map's file joins `files`.
pub(super) fn read_pattern(
    section: &Section,
    orbit: &Orbit,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Option<PlanetPattern>, SceneError> {
    section.exclusive("planet_temperature", "planet_map")?;
    section.exclusive("planet_temperature", "planet_day_night")?;
    section.exclusive("planet_map", "planet_day_night")?;
    if let Some(section) = section.table("planet_day_night", keys::PLANET_DAY_NIGHT)? {
        let kelvin = |key: &str, what: &str| {
            section.required(key, section.number(key, Quantity::within(0.0, f64::from(HOTTEST), "K"))?, what)
        };
        let day = kelvin("day", "the temperature below the Sun [K]")?;
        let night = kelvin("night", "the temperature of the night side [K]")?;
        let law = section.choice("law", &[("step", DayLaw::Step), ("cosine", DayLaw::Cosine)])?;
        let law =
            section.required("law", law, "'step', or 'cosine' for T^4 between night and day by the Sun's height")?;
        if law == DayLaw::Cosine && day < night {
            return Err(section.error("day", format!("must be at least that of the night, {night} K, found {day} K")));
        }
        return Ok(Some(PlanetPattern::day_night(day, night, law)));
    }
    let Some(section) = section.table("planet_map", keys::PLANET_MAP)? else { return Ok(None) };
    read_map(&section, orbit, &KELVIN, files, assumptions).map(Some)
}

/// Reads the albedos of a planet. The map's file joins `files`.
pub(super) fn read_albedos(
    section: &Section,
    orbit: &Orbit,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Option<PlanetPattern>, SceneError> {
    for key in ["planet_albedo", "planet_map", "planet_day_night"] {
        section.exclusive("planet_albedo_map", key)?;
    }
    let Some(section) = section.table("planet_albedo_map", keys::PLANET_MAP)? else { return Ok(None) };
    read_map(&section, orbit, &ALBEDO, files, assumptions).map(Some)
}

fn read_map(
    section: &Section,
    orbit: &Orbit,
    kind: &MapKind,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<PlanetPattern, SceneError> {
    let path = section.required("file", section.path("file")?, &format!("a PNG or EXR file of {}", kind.values))?;
    let mut stated = [None; 2];
    for (stated, key) in stated.iter_mut().zip(["scale", "offset"]) {
        *stated = section.number(key, Quantity::within(-1e6, 1e6, ""))?;
    }
    let bytes = files::read(&path)
        .map_err(|fault| section.error("file", format!("{}: cannot be read: {fault}", path.display())))?;
    let scaled = match (is_png(&bytes), stated) {
        (true, [Some(scale), Some(offset)]) => Some([scale, offset]),
        (true, [scale, _]) => {
            let key = if scale.is_none() { "scale" } else { "offset" };
            let message = format!("is missing: a PNG has {} offset + scale x value", kind.values);
            return Err(section.error(key, message));
        }
        (false, [None, None]) => None,
        (false, [scale, _]) => {
            let key = if scale.is_some() { "scale" } else { "offset" };
            return Err(section.error(key, format!("belongs to a PNG: an EXR has {}", kind.values)));
        }
    };
    let map = decoded(&bytes, scaled).and_then(|map| checked(map, kind));
    let temperatures = map.map_err(|message| section.error("file", in_file(&path, &message)))?;
    files.push(path);
    Ok(PlanetPattern { temperatures, axes: axes(section, orbit, assumptions)? })
}

fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x89, b'P', b'N', b'G'])
}

/// The temperatures of a file. Scale and offset belong to a PNG.
pub(super) fn map_of(bytes: &[u8], scaled: Option<[f64; 2]>) -> Result<Equirectangular, String> {
    decoded(bytes, scaled).and_then(|map| checked(map, &KELVIN))
}

fn decoded(bytes: &[u8], scaled: Option<[f64; 2]>) -> Result<Equirectangular, String> {
    match scaled.filter(|_| is_png(bytes)) {
        Some(scaled) => from_png(bytes, scaled),
        None => from_exr(bytes),
    }
}

fn in_file(path: &Path, message: &str) -> String {
    format!("{}: {}", path.display(), plain(message))
}

fn axes(section: &Section, orbit: &Orbit, assumptions: &mut Vec<String>) -> Result<MapAxes, SceneError> {
    if orbit.trajectory().is_some() {
        for key in ["pole", "longitude_deg", "period"] {
            if section.has(key) {
                let message = "belongs to a circular orbit: on a trajectory the map turns with the Earth";
                return Err(section.error(key, message));
            }
        }
        return Ok(MapAxes::Earth);
    }
    let pole = direction(section, "pole")?.unwrap_or(DVec3::Z);
    let longitude = section.number("longitude_deg", Quantity::within(-360.0, 360.0, "deg"))?;
    let period = section.number("period", Quantity::positive("s"))?;
    if longitude.is_none() || !section.has("pole") {
        let sentence = "The planet's map has its pole along the orbit normal, or longitude 0 at orbit noon at time 0 \
                        (pole or longitude_deg of the map is absent).";
        assumptions.push(sentence.to_owned());
    }
    let longitude = longitude.unwrap_or(0.0).to_radians();
    Ok(MapAxes::Turning { pole, longitude, rate: TAU / period.unwrap_or(SIDEREAL_DAY) })
}

/// The temperatures of a grey PNG of 8 or 16 bits.
fn from_png(bytes: &[u8], [scale, offset]: [f64; 2]) -> Result<Equirectangular, String> {
    let failed = |error: png::DecodingError| format!("is no PNG that can be read: {error}");
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(failed)?;
    let (columns, rows) = (reader.info().width as usize, reader.info().height as usize);
    check_size(columns, rows, bytes)?;
    let (colour, depth) = (reader.info().color_type, reader.info().bit_depth);
    if colour != png::ColorType::Grayscale || !matches!(depth, png::BitDepth::Eight | png::BitDepth::Sixteen) {
        return Err(format!("is {colour:?} of {} bits: a map is grey, of 8 or 16 bits", depth as u8));
    }
    let size = reader.output_buffer_size().ok_or("is too large")?;
    let mut values = vec![0; size];
    reader.next_frame(&mut values).map_err(failed)?;
    let kelvin = |value: f64| (offset + scale * value) as f32;
    let cells: Vec<f32> = match depth {
        png::BitDepth::Eight => values.into_iter().map(|value| kelvin(f64::from(value))).collect(),
        _ => values.as_chunks().0.iter().map(|value| kelvin(f64::from(u16::from_be_bytes(*value)))).collect(),
    };
    Ok(Equirectangular::new(columns, rows, &cells))
}

/// The temperatures of an EXR with one channel.
fn from_exr(bytes: &[u8]) -> Result<Equirectangular, String> {
    let failed = |error: exr::error::Error| format!("is neither a PNG nor an EXR that can be read: {error}");
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), true).map_err(failed)?;
    let [header] = meta.headers.as_slice() else { return Err("must have one layer".to_owned()) };
    let (columns, rows) = (header.layer_size.x(), header.layer_size.y());
    check_size(columns, rows, bytes)?;
    if header.channels.list.len() != 1 {
        return Err(format!("has {} channels: a map has one, in K", header.channels.list.len()));
    }
    // B44 rounds, so no map of temperatures has it, and its decoder panics on damaged blocks. So does that of several levels.
    if matches!(header.compression, Compression::B44 | Compression::B44A) {
        return Err(format!("has the compression {}, which rounds: write it with ZIP", header.compression));
    }
    if matches!(header.blocks, BlockDescription::Tiles(tiles) if tiles.level_mode != LevelMode::Singular) {
        return Err("has several resolutions: a map has one".to_owned());
    }
    let image = decode(|| {
        let all = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
        all.non_parallel().from_buffered(Cursor::new(bytes)).map_err(failed)
    })?;
    let channel = image.layer_data.channel_data.list.into_iter().next().ok_or("has no channel")?;
    let cells = match channel.sample_data {
        FlatSamples::F32(values) => values,
        FlatSamples::F16(values) => values.into_iter().map(exr::prelude::f16::to_f32).collect(),
        FlatSamples::U32(values) => values.into_iter().map(|value| value as f32).collect(),
    };
    Ok(Equirectangular::new(columns, rows, &cells))
}

fn check_size(columns: usize, rows: usize, bytes: &[u8]) -> Result<(), String> {
    let cells = columns.saturating_mul(rows);
    if columns < 1 || rows < 2 || cells > MOST_CELLS {
        return Err(format!("has {columns} x {rows} pixels: a map has at least 1 x 2 and at most {MOST_CELLS} in all"));
    }
    Expansion::of_image(bytes.len()).charge(cells, 2 * size_of::<f32>()).map_err(|fault| fault.to_string())
}

fn checked(map: Equirectangular, kind: &MapKind) -> Result<Equirectangular, String> {
    let MapKind { most, unit, .. } = kind;
    match map.cells().iter().position(|value| !(0.0..=*most).contains(value)) {
        Some(cell) => Err(format!(
            "row {}, column {}: must be in [0, {most}]{unit}, found {}",
            cell / map.columns + 1,
            cell % map.columns + 1,
            map.cells()[cell]
        )),
        None => Ok(map),
    }
}
