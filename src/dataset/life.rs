//! Age of the surfaces: absorptivity and emissivity between the beginning and the end of life.
//!
//! All materials of a craft share its age, and each has a scatter of its own. Absorptivity and emissivity of a material age together.

use toml::Value;

use super::distribution::Distribution;
use super::random::RandomSource;
use super::reader::SpecTable;
use crate::scene::SceneError;

/// Keys of `[life]`.
pub(crate) const LIFE: &[&str] = &["age", "material"];
/// Keys of `[[life.material]]`.
pub(crate) const LIFE_MATERIAL: &[&str] = &["match", "begin", "end", "scatter"];
/// Keys of `begin` and `end`.
pub(crate) const OPTICS: &[&str] = &["absorptivity", "emissivity"];

/// A material that ages.
#[derive(Debug, Clone, PartialEq)]
struct Aging {
    name: String,
    /// Absorptivity and emissivity at the beginning and at the end, where they are stated.
    ends: [Option<[f64; 2]>; 2],
    scatter: Option<Distribution>,
}

/// How the craft ages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Life {
    age: Distribution,
    materials: Vec<Aging>,
}

impl Life {
    pub(super) fn read(root: &SpecTable) -> Result<Option<Self>, SceneError> {
        let Some(table) = root.table("life", LIFE)? else { return Ok(None) };
        let age = table.drawn_number("age", 0.0..=1.0, "")?;
        let age = table.required("age", age, "the share of the life that has passed, 0 to 1")?;
        let materials = table.tables("material", LIFE_MATERIAL)?;
        let mut read: Vec<Aging> = Vec::new();
        for material in &materials {
            let aging = aging(material)?;
            if read.iter().any(|other| other.name == aging.name) {
                let message = format!("'{}' is the match of another [[life.material]]", aging.name);
                return Err(material.error("match", &message));
            }
            read.push(aging);
        }
        let materials = read;
        if materials.is_empty() {
            return Err(table.error("material", "is missing: sections [[life.material]]"));
        }
        Ok(Some(Self { age, materials }))
    }

    /// Names of the numbers of an orbit.
    pub(crate) fn names(&self) -> Vec<String> {
        let scatter =
            self.materials.iter().filter_map(|one| Some(one.scatter.as_ref()?.names(&format!("life.{}", one.name))));
        self.age.names("life.age").into_iter().chain(scatter.flatten()).collect()
    }

    /// Whether it says which absorptivity or emissivity a material has.
    pub(crate) fn states(&self, name: &str, key: &str) -> bool {
        let place = OPTICS.iter().position(|optics| *optics == key);
        self.materials.iter().any(|one| one.name == name && place.is_some_and(|place| one.ends[place].is_some()))
    }

    /// The age, and for each material the keys of its `[[material]]` in the scene.
    pub(crate) fn draw(&self, source: &RandomSource) -> (f64, Vec<Value>) {
        let age = self.age.number("life.age", source);
        let values = self.materials.iter().map(|one| {
            let name = format!("life.{}", one.name);
            let age_of_surface = age + one.scatter.as_ref().map_or(0.0, |scatter| scatter.number(&name, source));
            // A scatter leads to no age before the beginning and after the end.
            let age_of_surface = age_of_surface.clamp(0.0, 1.0);
            let mut table = toml::Table::new();
            table.insert("match".to_owned(), Value::String(one.name.clone()));
            for (key, ends) in OPTICS.iter().zip(one.ends) {
                if let Some([begin, end]) = ends {
                    table.insert((*key).to_owned(), Value::Float(begin + age_of_surface * (end - begin)));
                }
            }
            Value::Table(table)
        });
        (age, values.collect())
    }
}

fn aging(table: &SpecTable) -> Result<Aging, SceneError> {
    let name = table.required("match", table.text("match")?, "the match of a [[material]] of the scene")?.to_owned();
    let optics = |key: &str| {
        let what = "absorptivity or emissivity, or both";
        let values = table.required(key, table.table(key, OPTICS)?, what)?;
        Ok::<_, SceneError>([values.number(OPTICS[0], 0.0..=1.0)?, values.number(OPTICS[1], 0.0..=1.0)?])
    };
    let [begin, end] = [optics("begin")?, optics("end")?];
    let mut ends = [None; 2];
    for place in 0..2 {
        ends[place] = match (begin[place], end[place]) {
            (Some(begin), Some(end)) => Some([begin, end]),
            (None, None) => None,
            _ => return Err(table.error("end", &format!("{} stands in only one of begin and end", OPTICS[place]))),
        };
    }
    if ends == [None; 2] {
        return Err(table.error("begin", "holds neither absorptivity nor emissivity"));
    }
    Ok(Aging { name, ends, scatter: table.drawn_number("scatter", -1.0..=1.0, "")? })
}
