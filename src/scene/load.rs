//! Reads a scene file into the checked [`Scene`], section by section.

use std::io::Read;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::combinations::{with_samples, with_usual_samples};
use super::error::SceneError;
use super::faults::{Faults, read_all};
use super::file::{SourceFile, read_text};
use super::quantity::Quantity;
use super::radiance::{Background, SUNNY};
use super::section::Section;
use super::{
    Camera, Draw, Initial, MaterialRules, Parameter, Preset, Reflections, Scene, SceneBand, ShadowSettings, SkyScene,
    Surrounded, Time, band, camera, combinations, density, exchange, joint, keys, material, mesh_network, output,
    parameters, preset, radiance, sensor, shadows, temperatures, view, work,
};
use crate::environment::Environment;
use crate::environment::trajectory::Trajectory;
use crate::files::{self, Reach};
use crate::thermal::passband::Passband;
use crate::thermal::planck::Band;
use crate::thermal::sensor::Sensor;

/// Whether a file is there and has the name of a glTF file, or begins as one.
fn is_model(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default();
    let Ok((mut file, _)) = files::open(path) else { return false };
    let mut begins = [0; 4];
    ["glb", "gltf"].iter().any(|known| ending.eq_ignore_ascii_case(known))
        || (file.read_exact(&mut begins).is_ok() && begins == *b"glTF")
}

impl Scene {
    /// Reads and checks a scene file. Paths in the file are relative to its folder, and lead to files in it.
    ///
    /// # Errors
    /// A file that cannot be read, and everything that [`Scene::parse`] refuses.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_within(path, Reach::of(path))
    }

    /// Reads and checks a scene file that may name the files of `reach`.
    ///
    /// # Errors
    /// As for `load`.
    pub fn load_within(path: &Path, reach: Reach) -> Result<Self, SceneError> {
        if is_model(path) {
            return Err(SceneError::Model { path: path.to_path_buf() });
        }
        Self::parse_within(&read_text(path)?, path, reach)
    }

    /// Checks the text of a scene file as if it lay at `path`. The materials table is read, and the model must exist.
    ///
    /// # Errors
    /// All errors, each with file, line and key: see [`SceneError`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        Self::parse_within(text, path, Reach::of(path))
    }

    /// Like [`Scene::parse`], for a file that may name the files of `reach`.
    ///
    /// # Errors
    /// As for `parse`.
    pub fn parse_within(text: &str, path: &Path, reach: Reach) -> Result<Self, SceneError> {
        read_all(path, |faults| {
            let mut scene = Self::read(text, path, &reach, faults)?;
            scene.assumptions.extend(faults.take_small());
            Ok(scene)
        })
    }

    fn read(text: &str, path: &Path, reach: &Reach, faults: &Faults) -> Result<Self, SceneError> {
        let file = SourceFile::new(path, text, reach, faults);
        let table = file.parse()?;
        let root = Section::root(&file, &table, keys::ROOT)?;
        let (mut assumptions, mut files) = (Vec::new(), vec![path.to_path_buf()]);

        let model = root.required_table("model", keys::MODEL)?;
        let model_path = model_path(&model)?;
        files.push(model_path.clone());
        let density = density::read(&model, &root.tables("part", keys::PART)?)?;
        let sky = SkyScene::read(&root, path, &mut files, &mut assumptions)?;
        let mut sky_files = files[2..].to_vec();
        let time = sky.time.clone();
        let shadows = read_shadows(&root, &sky.environment, &mut assumptions)?;
        let exchange =
            exchange::read(root.table("exchange", keys::EXCHANGE)?.as_ref(), shadows.is_some(), &mut assumptions)?;
        let joints = joint::read(&root.tables("joint", keys::JOINT)?, &mut files, &mut assumptions)?;
        let temperatures = temperatures::read(root.table("temperatures", keys::TEMPERATURES)?.as_ref(), &mut files)?;
        assumptions.extend(density.assumed(temperatures.is_some() || (shadows.is_none() && exchange.is_none())));
        let materials = read_materials(&root, (path, reach, faults), time.step, &mut files, &mut assumptions)?;
        let preset = root.table("camera", keys::CAMERA)?.as_ref().map(preset::read).transpose()?.flatten();
        let section = root.table("radiance", keys::RADIANCE)?;
        let output = root.table("output", keys::OUTPUT)?;
        let bands = band::read(&root, section.as_ref(), &mut files)?;
        let band = radiance::band(section.as_ref(), band::first(&bands), preset, &mut assumptions)?;
        let light = (&sky.environment, &sky.orbit, Some(band).filter(|_| bands.is_empty()), shadows.is_some());
        let mut surrounded = radiance::surrounded(section.as_ref(), light, (&mut files, &mut assumptions))?;
        surrounded.channels = view::channels(output.as_ref(), surrounded.reflections != Reflections::Off)?;
        let before = files.len();
        let camera = read_camera(&root, &sky, (preset, surrounded.channels), &mut files, &mut assumptions)?;
        sky_files.extend_from_slice(&files[before..]);
        let sections = [section.as_ref(), output.as_ref()];
        camera.iter().try_for_each(|camera| check_camera(&root, camera, &time, &surrounded, sections))?;
        let context = (&sky.environment, &surrounded, preset);
        let SensedCamera { camera, sensor, bands } =
            read_sensed(&root, camera, (bands, band), context, (&mut files, &mut assumptions))?;
        work::check_images(&root.required_table("time", keys::TIME)?, &time, camera.as_ref())?;
        let initial = view::initial(root.table("initial", keys::INITIAL)?.as_ref(), &mut assumptions)?;
        let probes = view::probes(&root.tables("probe", keys::PROBE)?)?;
        let images = output::read(output.as_ref(), any_sensor(sensor.as_ref(), &bands), temperatures.is_some())?;
        combinations::check_tumble(&root, &sky.attitude, &images, &surrounded)?;
        let heaters = mesh_network::heaters(&root.tables("heater", keys::HEATER)?, &probes)?;
        let mut scene = Self {
            source: path.to_path_buf(),
            reach: reach.clone(),
            name: sky.name,
            model_path,
            density,
            time,
            orbit: sky.orbit,
            attitude: sky.attitude,
            environment: sky.environment,
            shadows,
            exchange,
            joints,
            materials,
            camera,
            preset,
            sensor,
            images,
            band,
            ratio: band::ratio(output.as_ref(), &bands, &root)?,
            bands,
            surrounded,
            initial,
            temperatures,
            probes,
            network: mesh_network::settings(root.table("network", keys::NETWORK)?.as_ref(), &mut assumptions)?,
            contacts: mesh_network::contacts(&root.tables("contact", keys::CONTACT)?, &mut assumptions)?,
            heaters,
            colour_range: view::colour_range(output.as_ref())?,
            energy_balance: view::energy_balance(output.as_ref())?,
            uncertainty: read_uncertainty(&root, path)?,
            files,
            sky_files,
            assumptions,
        };
        scene.settle();
        Ok(scene)
    }

    /// Applies the defaults that follow from several sections.
    fn settle(&mut self) {
        self.take_temperatures();
        if self.uncertainty.is_some() {
            self.assumptions.push(
                "A range holds 95 % of the values that may be, normally distributed about its middle and independent of others ([uncertainty]). \
                 isotherm run alone uses the ranges."
                    .to_owned(),
            );
        }
        if self.sensor.is_some() || self.bands.iter().any(|band| band.sensor.is_some()) {
            self.show_planet();
        }
        self.light_bands();
    }

    /// Gives the first band its own daylight of the planet.
    fn light_bands(&mut self) {
        if let Some(first) = self.bands.first() {
            self.surrounded.planet_albedo = self.albedo_in(first);
        }
    }

    /// Switches off the computations that temperatures from a file replace, and says so.
    fn take_temperatures(&mut self) {
        let Some(temperatures) = &self.temperatures else { return };
        self.assumptions.push(format!(
            "All temperatures are those of {} (temperatures.file): response, [initial], the warm-up, [network], [exchange], \
             [[contact]] and [[heater]] have no effect, and no energy balance is kept.",
            temperatures.file.file_name().unwrap_or_default().to_string_lossy()
        ));
        self.initial = Initial::Balance;
        self.time.warm_up_orbits = 0.0;
        self.time.warm_up_assumed = false;
        self.time.periodic = None;
        self.exchange = None;
        self.contacts.clear();
        self.heaters.clear();
        self.energy_balance = false;
    }

    /// Puts the planet behind the craft where the scene does not say what stands there, for images that look like a camera's.
    pub(crate) fn show_planet(&mut self) {
        let surrounded = &mut self.surrounded;
        let is_open = surrounded.is_unstated && surrounded.background == Background::Off;
        if self.camera.is_none() || !is_open {
            return;
        }
        let space = self.environment.background_temperature.unwrap_or(0.0);
        let kelvin = surrounded.planet_temperature;
        let told = if kelvin <= space {
            "No planet stands behind the craft (radiance.background is absent), because neither environment.planet_ir nor \
             radiance.planet_temperature tells how warm it is."
                .to_owned()
        } else {
            surrounded.background = Background::Planet;
            let is_sunny = self.environment.solar_constant.is_some() && self.band.lower < SUNNY;
            let uniform = surrounded.albedo_map.is_none();
            if is_sunny && uniform && surrounded.reflections == Reflections::Off {
                surrounded.planet_albedo = self.environment.albedo.unwrap_or(0.0);
            }
            format!(
                "The planet stands behind the craft, at {kelvin:.2} K (radiance.background is absent; \"off\" leaves it out)."
            )
        };
        self.light_bands();
        if !self.assumptions.contains(&told) {
            self.assumptions.push(told);
        }
    }

    /// The camera of a scene that draws images.
    ///
    /// # Errors
    /// [`SceneError::Value`] where the scene has none.
    pub fn require_camera(&self) -> Result<&Camera, SceneError> {
        self.camera.as_ref().ok_or_else(|| SceneError::Value {
            path: self.source.clone(),
            line: 1,
            key: "camera".to_string(),
            message: "is missing: a section [camera] is needed to draw".to_string(),
        })
    }
}

/// The parameters of `[uncertainty]`. `None` without the section.
fn read_uncertainty(root: &Section, path: &Path) -> Result<Option<Vec<Parameter>>, SceneError> {
    let section = root.table("uncertainty", keys::UNCERTAINTY)?;
    section.map(|section| parameters::list(&section, path)).transpose()
}

fn model_path(section: &Section) -> Result<PathBuf, SceneError> {
    section.required("path", section.path("path")?, "the glTF file, .glb or .gltf")
}

/// The camera. A scene that draws nothing may have none.
fn optional_camera(
    root: &Section,
    draw: &Draw,
    preset: Option<&Preset>,
    around: &camera::PathOrbit<'_>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Option<Camera>, SceneError> {
    match root.table("camera", keys::CAMERA)? {
        Some(section) => camera::read(&section, preset, around, files, assumptions).map(Some),
        None if *draw == Draw::None => Ok(None),
        None => Ok(Some(camera::unstated(assumptions))),
    }
}

fn optional_sensor(
    root: &Section,
    camera: Option<&Camera>,
    preset: Option<&'static Preset>,
    passband: Passband,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Option<Sensor>, SceneError> {
    let Some(section) = root.table("sensor", keys::SENSOR)? else { return Ok(None) };
    let Some(camera) = camera else {
        return Err(root.clash("sensor", &["camera.*"], "needs a section [camera], which is missing"));
    };
    let pitch = pitch(root, preset)?;
    sensor::read(&section, &sensor::SensorContext { camera, preset, pitch, passband }, files, assumptions).map(Some)
}

/// Distance between the centres of pixels [m], where it is known.
fn pitch(root: &Section, preset: Option<&Preset>) -> Result<Option<f64>, SceneError> {
    let pitch = root.table("camera", keys::CAMERA)?.map(|camera| camera.number("pixel_pitch", Quantity::positive("m")));
    Ok(pitch.transpose()?.flatten().or(preset.and_then(|preset| preset.pitch)))
}

/// The camera with the samples that its sensors read, and the sensors: `[sensor]`, and one for each band that states one.
struct SensedCamera {
    camera: Option<Camera>,
    sensor: Option<Sensor>,
    bands: Vec<SceneBand>,
}

/// A sensor of a scene that has one.
fn any_sensor<'a>(first: Option<&'a Sensor>, bands: &'a [SceneBand]) -> Option<&'a Sensor> {
    first.or(bands.iter().find_map(|band| band.sensor.as_ref()))
}

fn read_sensed(
    root: &Section,
    camera: Option<Camera>,
    (bands, band): (band::ReadBands, Band),
    (environment, surrounded, preset): (&Environment, &Surrounded, Option<&'static Preset>),
    (files, assumptions): (&mut Vec<PathBuf>, &mut Vec<String>),
) -> Result<SensedCamera, SceneError> {
    let passband = bands.first().map_or_else(|| band.into(), |(first, _)| first.passband.clone());
    let of_first = match bands.first() {
        Some((first, section)) if root.has("sensor") => band::figures((root, section.has("preset")), first, preset)?,
        _ => preset,
    };
    let sensor = optional_sensor(root, camera.as_ref(), of_first, passband, files, assumptions)?;
    let pitch = pitch(root, preset)?;
    let context = band::BandContext { root, camera: camera.as_ref(), preset, pitch, environment, surrounded };
    let bands = band::sensors(bands, sensor.as_ref(), &context, (files, assumptions))?;
    let sensor = sensor.or(bands.first().and_then(|first| first.sensor.clone()));
    let mut sensors = sensor.iter().chain(bands.iter().filter_map(|band| band.sensor.as_ref()));
    let spread = sensors.find(|sensor| sensor.spread.is_some());
    let camera = with_samples(camera, spread, surrounded.channels, (root, assumptions))?;
    assumptions.extend(preset.filter(|_| camera.is_some()).map(preset::told));
    Ok(SensedCamera { camera, sensor, bands })
}

/// SHA-256 (hexadecimal) of the contents of [`Scene::files`], in order. Each content follows its length, so that no
/// byte can move between files unnoticed.
pub(crate) fn scene_hash(contents: &[&[u8]]) -> String {
    let mut hasher = Sha256::new();
    for content in contents {
        hasher.update((content.len() as u64).to_le_bytes());
        hasher.update(content);
    }
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 of a file (hexadecimal).
pub(crate) fn file_hash(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads `[shadows]`, which need a Sun.
fn read_shadows(
    root: &Section,
    environment: &Environment,
    assumptions: &mut Vec<String>,
) -> Result<Option<ShadowSettings>, SceneError> {
    let shadows = shadows::read(root.table("shadows", keys::SHADOWS)?.as_ref(), assumptions)?;
    if let (Some(_), Some(section), None) =
        (&shadows, root.table("shadows", keys::SHADOWS)?, environment.solar_constant)
    {
        return Err(section.clash(
            "method",
            &["environment.solar_constant"],
            "[shadows] needs environment.solar_constant, which is missing",
        ));
    }
    Ok(shadows)
}

fn read_materials(
    root: &Section,
    origin: (&Path, &Reach, &Faults),
    step: f64,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<MaterialRules, SceneError> {
    material::read(
        root.table("materials", keys::MATERIALS)?.as_ref(),
        &root.tables("material", keys::MATERIAL)?,
        origin,
        step,
        root.has("temperatures"),
        files,
        assumptions,
    )
}

/// Reads the camera, whose path may be relative to the orbit. `channels` tells that its images show parts of the radiance.
fn read_camera(
    root: &Section,
    sky: &SkyScene,
    (preset, channels): (Option<&'static Preset>, bool),
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Option<Camera>, SceneError> {
    let start = sky.orbit.trajectory().map(Trajectory::start).or(sky.time.start);
    let around = camera::PathOrbit { orbit: &sky.orbit, planet_radius: sky.environment.planet_radius, start };
    let camera = optional_camera(root, &sky.time.draw, preset, &around, files, assumptions)?;
    camera.map(|camera| with_usual_samples(camera, channels, root)).transpose()
}

/// Checks a camera against the times of the images, `[radiance]` and `[output]`.
fn check_camera(
    root: &Section,
    camera: &Camera,
    time: &Time,
    surrounded: &Surrounded,
    [radiance, output]: [Option<&Section>; 2],
) -> Result<(), SceneError> {
    let covered = camera.check_times(work::image_times(time));
    if let Some(section) = root.table("camera", keys::CAMERA)? {
        section.blame("path", &["line_time", "exposure_time", "time.*", "orbit.*"], covered)?;
    }
    combinations::check_camera(surrounded, camera, radiance, output, root.has("joint"))
}

#[cfg(test)]
mod tests {
    use super::super::valid_scene::VALID;
    use super::{Scene, scene_hash};

    #[test]
    fn the_scene_that_stands_in_is_valid() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, VALID).unwrap();
        Scene::parse(VALID, &path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(Scene::parse(VALID, &path).is_err(), "the model must exist");
    }

    #[test]
    fn the_hash_tells_files_and_their_borders_apart() {
        // printf '\2\0\0\0\0\0\0\0ab' | sha256sum
        let hash = scene_hash(&[b"ab"]);
        assert_eq!(hash, "5dff2b3fa79721a8181b9beb1db6bcce93b482f9aa3a5c9b864fc4429e31d5f2");
        assert_ne!(hash, scene_hash(&[b"a", b"b"]));
        assert_ne!(scene_hash(&[b"ab", b"c"]), scene_hash(&[b"a", b"bc"]));
    }
}
