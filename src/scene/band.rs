//! `[[band]]`: the bands in which a camera sees, each with a radiance of its own, and `output.ratio`.

use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::file::read_text;
use super::keys;
use super::preset::{BAND_PRESETS, Preset};
use super::quantity::Quantity;
use super::section::Section;
use super::sensor::{self, SensorContext};
use super::{Background, BandRatio, Camera, Reflections, SUNNY, Scene, SceneBand, Surrounded};
use crate::environment::Environment;
use crate::thermal::passband::Passband;
use crate::thermal::planck::Band;
use crate::thermal::planet_map::{MapAxes, PlanetPattern};
use crate::thermal::radiance::RadianceTable;
use crate::thermal::ratio::RatioTable;
use crate::thermal::sensor::Sensor;
use crate::thermal::sensor::reading::SensorConstants;

/// Bands as they were read, each with its section.
pub(super) type ReadBands<'a> = Vec<(SceneBand, Section<'a>)>;

/// The first band.
pub(super) fn first(bands: &[(SceneBand, Section)]) -> Option<Band> {
    bands.first().map(|(first, _)| first.passband.band)
}

/// Reads every `[[band]]` without its sensor.
pub(super) fn read<'a>(
    root: &Section<'a>,
    radiance: Option<&Section>,
    files: &mut Vec<PathBuf>,
) -> Result<ReadBands<'a>, SceneError> {
    let mut bands: ReadBands = Vec::new();
    for section in root.tables("band", keys::BAND)? {
        for band in one_or_preset(&section, files)? {
            // Names are parts of file names, which some file systems tell apart by letters alone.
            if let Some((other, _)) = bands.iter().find(|(other, _)| other.name.eq_ignore_ascii_case(&band.name)) {
                let differs = if other.name == band.name { "" } else { " in other case, and names files" };
                return Err(section.error("name", format!("'{}' is the name of another band{differs}", band.name)));
            }
            bands.push((band, section.clone()));
        }
    }
    let doubled = ["band_um", "planet_albedo"].into_iter().find(|key| radiance.is_some_and(|one| one.has(key)));
    if let (Some(section), Some(key), false) = (radiance, doubled, bands.is_empty()) {
        let message = "stands beside [[band]], which states it for each band: leave it out here";
        return Err(section.clash(key, &["band.*"], message));
    }
    Ok(bands)
}

/// The band of a section, or all those that its preset names.
fn one_or_preset(section: &Section, files: &mut Vec<PathBuf>) -> Result<Vec<SceneBand>, SceneError> {
    let choices = BAND_PRESETS.map(|preset| (preset.key, preset));
    let planet_albedo = section.number("planet_albedo", Quantity::within(0.0, 1.0, ""))?;
    let noise = section.number("noise", Quantity::within(0.0, 1e9, "W/(m2 sr)"))?;
    let band = |name: String, passband: Passband| SceneBand {
        name,
        passband,
        sensor: None,
        planet_albedo,
        noise,
        in_band: Vec::new(),
    };
    if let Some(preset) = section.choice("preset", &choices)? {
        for key in ["name", "band_um", "response"] {
            section.exclusive(key, "preset")?;
        }
        let width = section.number("width_um", Quantity::within(0.01, 2.0, "um"))?;
        let what = format!("the full width of each filter [um]; that of {} is unknown", preset.name);
        let width = section.required("width_um", width, &what)?;
        let filter = |centre: &f64| {
            let [lower, upper] = [centre - 0.5 * width, centre + 0.5 * width].map(|um| um / 1e6);
            let name = format!("{}_{}", preset.key, centre.to_string().replace('.', "_"));
            band(name, Band { lower, upper }.into())
        };
        return Ok(preset.centres_um.iter().map(filter).collect());
    }
    if section.has("width_um") {
        return Err(section.clash("width_um", &["preset"], "belongs to a preset"));
    }
    let name = section.required("name", section.name("name")?, "the name of the band's channel")?;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.len() > 32 || !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(is_plain) {
        let message =
            format!("'{name}' names a channel and files: use 1 to 32 letters, digits, _ and -, a letter first");
        return Err(section.error("name", message));
    }
    section.exclusive("band_um", "response")?;
    let ends = section.numbers::<2>("band_um", Quantity::within(0.2, 50.0, "um"))?;
    let passband = match (ends, section.path("response")?) {
        (Some([lower, upper]), _) if lower >= upper => {
            return Err(section.error("band_um", format!("must run from low to high, found {lower} to {upper} um")));
        }
        (Some(ends), _) => {
            let [lower, upper] = ends.map(|um| um / 1e6);
            Band { lower, upper }.into()
        }
        (None, Some(path)) => {
            let passband = response(&path).map_err(|message| section.error("response", message))?;
            files.push(path);
            passband
        }
        (None, None) => return Err(section.missing("band_um", &["response"], "[low, high] in um, or response")),
    };
    Ok(vec![band(name, passband)])
}

/// Reads a response: a CSV file with the columns `wavelength_um` and `response`.
fn response(path: &Path) -> Result<Passband, String> {
    let text = read_text(path).map_err(|error| error.to_string())?;
    let name = path.display();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| format!("{name}: {error}"))?.clone();
    let column = |wanted: &str| {
        let place = header.iter().position(|cell| cell == wanted);
        place.ok_or_else(|| format!("{name}: has no column '{wanted}'; a response has wavelength_um and response"))
    };
    let columns = [column("wavelength_um")?, column("response")?];
    let quantities = [Quantity::within(0.2, 50.0, "um"), Quantity::any("")];
    let mut points = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|error| format!("{name}: {error}"))?;
        let line = row.position().map_or(0, csv::Position::line);
        let mut point = [0.0; 2];
        for ((value, column), quantity) in point.iter_mut().zip(columns).zip(quantities) {
            let text = row.get(column).unwrap_or_default();
            let number = text.parse::<f64>().map_err(|_| format!("{name}:{line}: '{text}' is not a number"))?;
            *value = quantity.check(number).map_err(|message| format!("{name}:{line}: {message}"))?;
        }
        points.push(point);
    }
    Passband::of_response(&points).map_err(|fault| format!("{name} {fault}"))
}

/// Values of other sections that a band needs.
pub(super) struct BandContext<'a> {
    pub(super) root: &'a Section<'a>,
    pub(super) camera: Option<&'a Camera>,
    pub(super) preset: Option<&'static Preset>,
    /// Distance between pixels [m], where it is known.
    pub(super) pitch: Option<f64>,
    pub(super) environment: &'a Environment,
    pub(super) surrounded: &'a Surrounded,
}

/// Reads the sensors of the bands, and says which light the bands lack. The sensor of the first band is `[sensor]` where the band states none.
pub(super) fn sensors(
    bands: ReadBands,
    of_first: Option<&Sensor>,
    context: &BandContext,
    (files, assumptions): (&mut Vec<PathBuf>, &mut Vec<String>),
) -> Result<Vec<SceneBand>, SceneError> {
    let &BandContext { root, camera, preset, pitch, .. } = context;
    let mut all: Vec<SceneBand> = Vec::new();
    for (mut band, section) in bands {
        assumptions.extend(light(&band, &section, context)?);
        let stated = section.table("sensor", keys::SENSOR)?;
        if let (true, Some(_), true) = (all.is_empty(), &stated, root.has("sensor")) {
            let message = "stands beside [sensor], which is the sensor of the first band: leave one of them out";
            return Err(section.clash("sensor", &["sensor.*"], message));
        }
        band.sensor = match stated {
            None => of_first.filter(|_| all.is_empty()).cloned(),
            Some(own) => {
                let Some(camera) = camera else {
                    return Err(section.clash("sensor", &["camera.*"], "needs a section [camera], which is missing"));
                };
                let preset = figures((&section, section.has("preset")), &band, preset)?;
                let context = SensorContext { camera, preset, pitch, passband: band.passband.clone() };
                Some(sensor::read(&own, &context, files, assumptions)?)
            }
        };
        if band.noise.is_some() && band.sensor.is_some() {
            return Err(section.clash("noise", &["sensor.*"], "stands beside a sensor, which states it"));
        }
        all.push(band);
    }
    Ok(all)
}

/// Which sunlight a band lacks, in words.
///
/// # Errors
/// An albedo of the planet that no image can show.
fn light(band: &SceneBand, section: &Section, context: &BandContext) -> Result<Option<String>, SceneError> {
    let &BandContext { environment, surrounded, .. } = context;
    let name = &band.name;
    if band.planet_albedo.is_some() && environment.solar_constant.is_none() {
        let message = "is that of a planet in sunlight: state environment.solar_constant";
        return Err(section.clash("planet_albedo", &["environment.solar_constant"], message));
    }
    if band.planet_albedo.is_some() && surrounded.albedo_map.is_some() {
        let message = "cannot be combined with radiance.planet_albedo_map";
        return Err(section.clash("planet_albedo", &["radiance.planet_albedo_map"], message));
    }
    if band.planet_albedo.is_some_and(|albedo| albedo > 0.0) && turns(surrounded) {
        let message = "does not go with radiance.planet_map: sunlight would turn with the map";
        return Err(section.clash("planet_albedo", &["radiance.planet_map"], message));
    }
    let is_sunny = environment.solar_constant.is_some() && band.passband.band.lower < SUNNY;
    let lacks = match surrounded.reflections {
        Reflections::Off => "the craft reflects no sunlight (radiance.reflections is off)",
        Reflections::Environment if !context.root.has("shadows") => {
            "the craft shades nothing (there is no section [shadows])"
        }
        _ => "nothing of the sunlight on the craft is left out",
    };
    let albedo = match surrounded.albedo_map {
        Some(_) => "its map".to_owned(),
        None => band.planet_albedo.or(environment.albedo.filter(|_| !turns(surrounded))).unwrap_or(0.0).to_string(),
    };
    Ok(is_sunny.then(|| {
        format!("Band '{name}' has sunlight: {lacks}, and the day side of the planet reflects {albedo} of it where it is shown.")
    }))
}

/// Whether the planet has a map that turns with it.
fn turns(surrounded: &Surrounded) -> bool {
    surrounded.planet.as_ref().is_some_and(|pattern| !matches!(pattern.axes, MapAxes::Sun))
}

/// The camera's preset, where its sensor sees the band at all. `owner` is the section that states the sensor, and whether the band is the preset's own.
///
/// # Errors
/// A band that lies half in the preset's band.
pub(super) fn figures(
    (owner, of_preset): (&Section, bool),
    band: &SceneBand,
    preset: Option<&'static Preset>,
) -> Result<Option<&'static Preset>, SceneError> {
    let Some((camera, [low, high])) = preset.and_then(|preset| Some((preset, preset.band_um?))) else {
        return Ok(preset);
    };
    let [lower, upper] = band.passband.band.micrometres();
    if of_preset || (lower >= low && upper <= high) {
        return Ok(preset);
    }
    if upper <= low || lower >= high {
        return Ok(None);
    }
    let message = format!(
        "band '{}' runs from {lower} to {upper} um, and the sensor of {} sees {low} to {high} um: the band must lie inside or outside of it",
        band.name, camera.name
    );
    Err(owner.clash("sensor", &["band_um", "response", "camera.preset"], message))
}

/// Reads `output.ratio`.
pub(super) fn ratio(
    output: Option<&Section>,
    bands: &[SceneBand],
    root: &Section,
) -> Result<Option<BandRatio>, SceneError> {
    let stated = output.map(|section| section.strings("ratio")).transpose()?.flatten();
    let (Some(section), Some(names)) = (output, stated) else {
        let idle = root.tables("band", keys::BAND)?.into_iter().find(|section| section.has("noise"));
        return match idle {
            None => Ok(None),
            Some(section) => Err(section.clash("noise", &["output.ratio"], "is that of output.ratio, which is absent")),
        };
    };
    let wrong = |message: String| section.clash("ratio", &["band.*"], message);
    let [first, second] = &names[..] else {
        return Err(wrong(format!("must name two bands, found {}", names.len())));
    };
    let place = |name: &String| {
        let known = || bands.iter().map(|band| band.name.as_str()).collect::<Vec<_>>().join(", ");
        let place = bands.iter().position(|band| band.name == *name);
        place.ok_or_else(|| wrong(format!("names '{name}', which is no [[band]]; there are: {}", known())))
    };
    let places = [place(first)?, place(second)?];
    let tables = places.map(|place| RadianceTable::new(bands[place].passband.clone()));
    let noise = |number: usize| {
        let band = &bands[places[number]];
        let of_sensor = |sensor: &Sensor| {
            let constants = SensorConstants::new(sensor, &tables[number]);
            constants.noise / constants.transmitted
        };
        band.sensor.as_ref().map(of_sensor).or(band.noise).ok_or_else(|| {
            wrong(format!("needs the noise of band '{}': state [band.sensor], or noise [W m-2 sr-1]", band.name))
        })
    };
    let noise = [noise(0)?, noise(1)?];
    let [a, b] = &tables;
    let table = RatioTable::new(a, b).map_err(|fault| wrong(format!("of '{first}' and '{second}' {fault}")))?;
    Ok(Some(BandRatio { bands: places, noise, table }))
}

impl Scene {
    /// Wavelengths of the images and their response, from the first `[[band]]` or `radiance.band_um`.
    pub(crate) fn passband(&self) -> Passband {
        self.bands.first().map_or_else(|| self.band.into(), |band| band.passband.clone())
    }

    /// Share of the sunlight that the planet reflects in a band, where an image shows it. By default a band with sunlight has the albedo of the heat balance.
    pub(crate) fn albedo_in(&self, band: &SceneBand) -> f64 {
        let settings = &self.surrounded;
        let is_shown = settings.background == Background::Planet || settings.reflections != Reflections::Off;
        let is_sunny = self.environment.solar_constant.is_some() && band.passband.band.lower < SUNNY;
        let default = self.environment.albedo.filter(|_| is_sunny && !turns(settings) && settings.albedo_map.is_none());
        if is_shown { band.planet_albedo.or(default).unwrap_or(0.0) } else { 0.0 }
    }

    /// The albedos of the planet's places, in a band with sunlight.
    pub(crate) fn albedos(&self, band: Band) -> Option<&PlanetPattern> {
        self.surrounded.albedo_map.as_deref().filter(|_| band.lower < SUNNY)
    }

    /// The scene of one of its bands by itself, for images alone.
    pub(crate) fn in_band(&self, index: usize) -> Self {
        let band = self.bands[index].clone();
        let mut scene = self.clone();
        scene.band = band.passband.band;
        scene.sensor.clone_from(&band.sensor);
        scene.surrounded.planet_albedo = self.albedo_in(&band);
        scene.surrounded.channels = false;
        scene.bands = vec![band];
        scene.ratio = None;
        scene.energy_balance = false;
        (scene.images.error, scene.images.budget) = (false, false);
        scene
    }
}
