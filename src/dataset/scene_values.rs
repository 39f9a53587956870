//! The scene of an orbit and the sensor of an image: the scene file with the values that were drawn.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value as Json, json};
use toml::{Table, Value};

use super::corner::{corner, corners};
use super::distribution::{Distribution, NAMES as NAMES_OF_DISTRIBUTIONS};
use super::error::DatasetError;
use super::random::RandomStream;
use super::scene_sections::SENSOR;
use super::spec::Spec;
use crate::environment::albedo_field::AlbedoFields;
use crate::files::Reach;
use crate::lens::Distortion;
use crate::scene::{Scene, SceneError};
use crate::thermal::sensor::Sensor;

/// The section whose keys belong to its mode.
const ATTITUDE: &str = "attitude";

/// Keys that tell the tables of a list apart.
pub(crate) const NAMES: [&str; 4] = ["match", "part", "name", "node"];

/// A scene file as a table.
#[derive(Debug, Clone)]
pub struct SceneText {
    path: PathBuf,
    reach: Reach,
    table: Table,
    has_distortion: bool,
    /// Albedo tables of all orbits.
    pub(super) albedo: Arc<AlbedoFields>,
}

/// The scene of an orbit, and the values that were drawn for it.
pub struct OrbitScene {
    /// The scene.
    pub scene: Scene,
    /// Its values.
    pub values: OrbitValues,
}

/// The values of an orbit's scene.
pub struct OrbitValues {
    /// The drawn values, by section and key.
    pub drawn: Json,
    /// All values of the scene file.
    table: Table,
}

/// The sensor of an image, and the values that were drawn for it.
pub(crate) struct DrawnSensor {
    pub(crate) sensor: Sensor,
    /// The drawn values by section and key.
    pub(crate) drawn: Json,
}

impl SceneText {
    /// Reads a scene file, and checks it as it stands.
    ///
    /// # Errors
    /// Everything that [`Scene::load`] refuses.
    pub fn load(path: &Path, reach: Reach) -> Result<Self, DatasetError> {
        let scene = Scene::load_within(path, reach.clone())?;
        let has_distortion = scene.camera.is_some_and(|camera| camera.lens.distortion != Distortion::None);
        let unreadable = |reason: String| SceneError::Unreadable { path: path.to_path_buf(), reason };
        let text = crate::files::read_text(path).map_err(|fault| unreadable(fault.to_string()))?;
        let table = text.parse::<Table>().map_err(|error| unreadable(error.to_string()))?;
        Ok(Self { path: path.to_path_buf(), reach, table, has_distortion, albedo: Arc::default() })
    }

    /// Whether the camera's lens has distortion.
    pub(crate) fn has_distortion(&self) -> bool {
        self.has_distortion
    }

    /// The scene of an orbit.
    ///
    /// # Errors
    /// Values that the scene refuses, or a list of tables without the named table.
    pub fn of_orbit(&self, spec: &Spec, orbit: u64) -> Result<OrbitScene, DatasetError> {
        let source = spec.plan.source(RandomStream::Orbit, orbit, 0);
        let (table, drawn) = self.table_of(spec, orbit, &|section, drawn| drawn.draw(section, &source))?;
        let scene = self.scene(&table).map_err(|reason| DatasetError::Orbit { orbit, reason })?;
        Ok(OrbitScene { scene, values: OrbitValues { drawn, table } })
    }

    /// Refuses distributions whose ends the scene refuses, before anything is made: such a value might be drawn late. Returns all files that a scene of the
    /// SPEC names.
    ///
    /// # Errors
    /// The first end that is refused.
    pub(crate) fn check_ends(&self, spec: &Spec) -> Result<BTreeSet<PathBuf>, DatasetError> {
        let mut files = BTreeSet::new();
        let of_orbit = spec.drawn.each_orbit.iter().map(|(_, drawn)| drawn);
        for number in 0..corners(of_orbit.chain(&spec.drawn.each_image)) {
            let (mut table, _) = self.table_of(spec, 0, &|_, drawn| corner(drawn, number))?;
            let wrong = |message: String| DatasetError::Spec { path: spec.path.clone(), message };
            if let Some(each_image) = &spec.drawn.each_image {
                merge(&mut table, SENSOR, corner(each_image, number)).map_err(wrong)?;
            }
            let scene =
                self.scene(&table).map_err(|reason| wrong(format!("{reason} (at an end of what may be drawn)")))?;
            files.extend(scene.files);
        }
        Ok(files)
    }

    /// The scene file of an orbit, and the values that were drawn for it, by section. `value` gives the value of a section.
    fn table_of(
        &self,
        spec: &Spec,
        orbit: u64,
        value: &dyn Fn(&str, &Distribution) -> Value,
    ) -> Result<(Table, Json), DatasetError> {
        let source = spec.plan.source(RandomStream::Orbit, orbit, 0);
        let mut table = self.table.clone();
        let mut told = Map::new();
        let wrong = |message: String| DatasetError::Spec { path: spec.path.clone(), message };
        for (section, drawn) in &spec.drawn.each_orbit {
            let value = value(section, drawn);
            told.insert(section.clone(), as_json(&value));
            if section == ATTITUDE {
                leave_mode(&mut table, &value);
            }
            merge(&mut table, section, value).map_err(wrong)?;
        }
        if let Some(life) = &spec.drawn.life {
            let (age, materials) = life.draw(&source);
            let shown: Vec<Json> = materials.iter().map(as_json).collect();
            told.insert("life".to_owned(), json!({"age": age, "material": shown}));
            merge(&mut table, "material", Value::Array(materials)).map_err(wrong)?;
        }
        if let Some(season) = &spec.drawn.season {
            let values = season.draw(&source);
            let find = |key: &str| values.iter().find(|(name, _)| *name == key).map_or(0.0, |(_, value)| *value);
            told.insert(
                "season".to_owned(),
                values.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect(),
            );
            set(&mut table, "orbit", "beta_deg", Value::Float(find("beta_deg")));
            let solar = table.get("environment").and_then(|section| section.get("solar_constant"));
            if let Some(solar) =
                solar.and_then(|value| value.as_float().or(value.as_integer().map(|whole| whole as f64)))
            {
                set(&mut table, "environment", "solar_constant", Value::Float(solar * find("solar_scale")));
            }
        }
        // A sensor may be whole only with the values that are drawn for an image. Until the first image, the sensor has the values of the first
        // image.
        if let Some(each_image) = &spec.drawn.each_image {
            merge(&mut table, SENSOR, of_sensor(spec, each_image, spec.images_of(orbit).start)).map_err(wrong)?;
        }
        if let Some(Value::Table(sensor)) = table.get_mut(SENSOR) {
            // The counter of the noise is the time of the image.
            if !states_seed(spec) {
                sensor.insert("seed".to_owned(), Value::Integer(source.bits("sensor.seed").into()));
            }
            // Images are of times far apart, so the bolometer has settled in each.
            sensor.insert("time_constant".to_owned(), Value::Float(0.0));
        }
        Ok((table, Json::Object(told)))
    }

    /// The sensor of an image of an orbit. `None` where the SPEC draws none for each image.
    ///
    /// # Errors
    /// Values that the scene refuses, or a scene without a sensor.
    pub(crate) fn of_image(
        &self,
        spec: &Spec,
        (orbit, values): (u64, &OrbitValues),
        image: u64,
    ) -> Result<Option<DrawnSensor>, DatasetError> {
        let Some(each_image) = &spec.drawn.each_image else { return Ok(None) };
        let sensor = of_sensor(spec, each_image, image);
        let drawn = json!({ SENSOR: as_json(&sensor) });
        let mut table = values.table.clone();
        let wrong = |reason: String| DatasetError::Orbit { orbit, reason: format!("image {image}: {reason}") };
        merge(&mut table, SENSOR, sensor).map_err(wrong)?;
        let sensor = self.scene(&table).map_err(wrong)?.sensor;
        Ok(sensor.map(|sensor| DrawnSensor { sensor, drawn }))
    }

    fn scene(&self, table: &Table) -> Result<Scene, String> {
        let text = toml::to_string(table).map_err(|error| error.to_string())?;
        let mut scene = Scene::parse_within(&text, &self.path, self.reach.clone()).map_err(|error| refusal(&error))?;
        scene.show_planet();
        Ok(scene)
    }
}

/// Why the scene refuses drawn values. Lines are left out, because no file has this text.
fn refusal(error: &SceneError) -> String {
    match error {
        SceneError::Value { key, message, .. } if message.contains("found a table") => {
            format!("{key}: {message}, which names none of the distributions {}", NAMES_OF_DISTRIBUTIONS.join(", "))
        }
        SceneError::Value { key, message, .. } => format!("{key}: {message}"),
        SceneError::Several(errors) => errors.iter().map(refusal).collect::<Vec<_>>().join("; "),
        other => other.to_string(),
    }
}

/// The values of the sensor that are drawn for an image. Every attempt at a pose has the same values.
fn of_sensor(spec: &Spec, each_image: &Distribution, image: u64) -> Value {
    each_image.draw(SENSOR, &spec.plan.source(RandomStream::Image, image, 0))
}

/// Whether the SPEC itself says which seed the sensor has.
fn states_seed(spec: &Spec) -> bool {
    let of_orbit = spec.drawn.each_orbit.iter().filter(|(section, _)| section == SENSOR).map(|(_, drawn)| drawn);
    of_orbit.chain(&spec.drawn.each_image).flat_map(Distribution::keys).any(|key| key == "seed")
}

/// Leaves out the attitude of the scene where another mode is drawn: its keys belong to no other mode.
fn leave_mode(table: &mut Table, drawn: &Value) {
    let stated = table.get(ATTITUDE).and_then(|section| section.get("mode"));
    if drawn.get("mode").is_some_and(|mode| Some(mode) != stated) {
        table.remove(ATTITUDE);
    }
}

fn set(table: &mut Table, section: &str, key: &str, value: Value) {
    if let Value::Table(section) = table.entry(section).or_insert_with(|| Value::Table(Table::new())) {
        section.insert(key.to_owned(), value);
    }
}

/// Puts the values of a drawn section into the scene, key by key. An item of a list goes to the scene's item of the same name.
fn merge(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    match (table.get_mut(key), value) {
        (Some(Value::Table(stated)), Value::Table(drawn)) => {
            drawn.into_iter().try_for_each(|(key, value)| merge(stated, &key, value))
        }
        (Some(Value::Array(stated)), Value::Array(drawn)) if drawn.iter().any(Value::is_table) => {
            for item in drawn {
                let Value::Table(item) = item else { continue };
                let Some((name, word)) = NAMES.iter().find_map(|name| Some((*name, item.get(*name)?))) else {
                    return Err(format!(
                        "[[each_orbit.{key}]] needs one of {}, which names a [[{key}]] of the scene",
                        NAMES.join(", ")
                    ));
                };
                let mut met =
                    stated.iter_mut().filter_map(Value::as_table_mut).filter(|table| table.get(name) == Some(word));
                let Some(table) = met.next() else {
                    return Err(format!("the scene has no [[{key}]] with {name} = {word}"));
                };
                for (key, value) in item {
                    merge(table, &key, value)?;
                }
            }
            Ok(())
        }
        (None, Value::Array(drawn)) if drawn.iter().any(Value::is_table) => Err(format!("the scene has no [[{key}]]")),
        (_, value) => {
            table.insert(key.to_owned(), value);
            Ok(())
        }
    }
}

fn as_json(value: &Value) -> Json {
    match value {
        Value::String(text) => json!(text),
        Value::Integer(number) => json!(number),
        Value::Float(number) => json!(number),
        Value::Boolean(boolean) => json!(boolean),
        Value::Datetime(date) => json!(date.to_string()),
        Value::Array(items) => items.iter().map(as_json).collect(),
        Value::Table(table) => Json::Object(table.iter().map(|(key, value)| (key.clone(), as_json(value))).collect()),
    }
}
