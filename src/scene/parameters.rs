//! A file of parameters: values of a scene that are varied, and the ranges in which they are known.

use std::path::{Path, PathBuf};

use wildmatch::WildMatch;

use super::error::SceneError;
use super::faults::Faults;
use super::file::{SourceFile, unreadable};
use super::quantity::Quantity;
use super::section::Section;
use crate::files::{self, Reach};
use crate::misspelt::suggestion;

const KEYS: &[&str] = &[
    "name",
    "vary",
    "material",
    "part",
    "node",
    "between",
    "between_materials",
    "face",
    "range",
    "percent",
    "step",
    "prior",
    "prior_value",
    "prior_sigma",
];

/// Keys of the root. A fit reads the others too.
pub(super) const ROOT: &[&str] = &["parameter", "sensor", "image", "fit"];

/// Relative step of a difference where a parameter states none.
const STEP: f64 = 0.01;

/// Most characters of a name. A channel of an EXR image has at most 255, of which some stand before and after the name.
const LONGEST_NAME: usize = 200;

/// The value that a parameter varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ParameterKind {
    /// Absorptivity of a face.
    Absorptivity,
    /// Emissivity of a face.
    Emissivity,
    /// Thickness [m].
    Thickness,
    /// Heat capacity per area [J/(m2 K)].
    Capacity,
    /// Conductivity [W/(m K)].
    Conductivity,
    /// Effective emittance of a blanket towards the structure below it.
    EffectiveEmittance,
    /// Conductance of a contact [W/K or W/(m2 K)].
    Contact,
    /// Power of a heater [W].
    Heater,
    /// Solar constant [W/m2].
    SolarConstant,
    /// Albedo of the planet.
    Albedo,
    /// Infrared of the planet [W/m2].
    PlanetIr,
    /// Heat of nodes of a network file [W].
    NodeHeat,
    /// Capacitance of nodes of a network file [J/K].
    Capacitance,
    /// Emissive area of nodes of a network file [m2].
    EmissiveArea,
    /// Linear conductors of a network file [W/K].
    Conductance,
    /// Radiative conductors of a network file [m2].
    ExchangeArea,
}

/// Words of the kinds.
const KINDS: [(&str, ParameterKind); 16] = [
    ("absorptivity", ParameterKind::Absorptivity),
    ("emissivity", ParameterKind::Emissivity),
    ("thickness", ParameterKind::Thickness),
    ("capacity", ParameterKind::Capacity),
    ("conductivity", ParameterKind::Conductivity),
    ("effective_emittance", ParameterKind::EffectiveEmittance),
    ("contact", ParameterKind::Contact),
    ("heater", ParameterKind::Heater),
    ("solar_constant", ParameterKind::SolarConstant),
    ("albedo", ParameterKind::Albedo),
    ("planet_ir", ParameterKind::PlanetIr),
    ("node_heat", ParameterKind::NodeHeat),
    ("capacitance", ParameterKind::Capacitance),
    ("emissive_area", ParameterKind::EmissiveArea),
    ("conductance", ParameterKind::Conductance),
    ("exchange_area", ParameterKind::ExchangeArea),
];

impl ParameterKind {
    /// The word in a file.
    pub(crate) fn word(self) -> &'static str {
        KINDS.iter().find(|(_, kind)| *kind == self).map_or("", |(word, _)| word)
    }

    /// Unit of the value, empty for a pure number.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Absorptivity | Self::Emissivity | Self::EffectiveEmittance | Self::Albedo => "",
            Self::Thickness => "m",
            Self::Capacity => "J/(m2 K)",
            Self::Conductivity => "W/(m K)",
            Self::Contact => "W/K or W/(m2 K)",
            Self::Heater | Self::NodeHeat => "W",
            Self::Capacitance => "J/K",
            Self::EmissiveArea | Self::ExchangeArea => "m2",
            Self::Conductance => "W/K",
            Self::SolarConstant | Self::PlanetIr => "W/m2",
        }
    }

    /// Whether the value may be at most 1.
    pub(crate) fn is_share(self) -> bool {
        matches!(self, Self::Absorptivity | Self::Emissivity | Self::EffectiveEmittance | Self::Albedo)
    }

    /// Whether the value may be negative.
    pub(crate) fn is_power(self) -> bool {
        matches!(self, Self::Heater | Self::NodeHeat)
    }

    /// Keys of which one names the owners of the value. Empty where the whole scene has one value.
    fn owners(self) -> &'static [&'static str] {
        match self {
            Self::Absorptivity
            | Self::Emissivity
            | Self::Thickness
            | Self::Capacity
            | Self::Conductivity
            | Self::EffectiveEmittance => &["material"],
            Self::Contact => &["between", "between_materials"],
            Self::Heater => &["part"],
            Self::NodeHeat | Self::Capacitance | Self::EmissiveArea => &["node"],
            Self::Conductance | Self::ExchangeArea => &["between"],
            Self::SolarConstant | Self::Albedo | Self::PlanetIr => &[],
        }
    }
}

/// The range in which a parameter is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ParameterRange {
    /// From one value to another, in the unit of the parameter.
    Values([f64; 2]),
    /// So many percent to both sides.
    Percent(f64),
}

/// What is known of a parameter before it is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ParameterPrior {
    /// Its range: the ends are two standard deviations off.
    Range,
    /// A value, or the one of the scene, and the standard deviation of its logarithm.
    Stated(Option<f64>, f64),
    /// Nothing.
    None,
}

impl ParameterRange {
    /// The ends as shares by which a value changes, the lower value first.
    pub(crate) fn shares(self, value: Option<f64>) -> [f64; 2] {
        match (self, value) {
            (Self::Percent(percent), Some(value)) if value < 0.0 => [percent / 100.0, -percent / 100.0],
            (Self::Percent(percent), _) => [-percent / 100.0, percent / 100.0],
            (Self::Values(ends), Some(value)) => ends.map(|end| end / value - 1.0),
            (Self::Values(_), None) => [0.0; 2],
        }
    }
}

/// A value of a scene that is varied.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameter {
    pub(crate) name: String,
    pub(crate) kind: ParameterKind,
    /// Patterns on the names of the owners: of materials or parts, or the two sides of a contact. Empty where the whole scene has one value.
    pub(crate) owners: Vec<String>,
    /// Key of the owners.
    pub(crate) owner_key: &'static str,
    /// Whether optics are of the back.
    pub(crate) back: bool,
    pub(crate) range: ParameterRange,
    /// Relative step of a difference.
    pub(crate) step: f64,
    pub(crate) prior: ParameterPrior,
    path: PathBuf,
    line: usize,
}

impl Parameter {
    /// An error about a key of this parameter.
    pub(crate) fn error(&self, key: &str, message: String) -> SceneError {
        SceneError::Value { path: self.path.clone(), line: self.line, key: format!("parameter.{key}"), message }
    }

    /// The first owner that is none of the known names, and what it may mean.
    pub(crate) fn unknown_owner<'k>(&self, known: impl IntoIterator<Item = &'k str> + Clone) -> Option<(&str, String)> {
        let fits = |pattern: &WildMatch| known.clone().into_iter().any(|name| pattern.matches(name));
        let unknown = self.owners.iter().find(|owner| !fits(&WildMatch::new(owner)))?;
        Some((unknown, suggestion(unknown, known.clone())))
    }

    /// Whether the parameter varies a value of the outside of a material.
    pub(crate) fn varies(&self, kind: ParameterKind, material: &str) -> bool {
        let fits = |pattern: &String| WildMatch::new(pattern).matches(material);
        self.kind == kind && !self.back && self.owners.iter().any(fits)
    }

    /// The parameter of a range that a material states for its outside, of a scene at `path`.
    pub(crate) fn of_material(kind: ParameterKind, material: &str, range: [f64; 2], path: &Path) -> Self {
        Self {
            name: format!("{} of {material}", kind.word()),
            kind,
            owners: vec![material.to_owned()],
            owner_key: "material",
            back: false,
            range: ParameterRange::Values(range),
            step: STEP,
            prior: ParameterPrior::Range,
            path: path.to_path_buf(),
            line: 1,
        }
    }
}

/// Reads a file of parameters.
///
/// # Errors
/// A file that cannot be read, and the first wrong value with file, line and key.
pub(crate) fn read_parameters(path: &Path) -> Result<Vec<Parameter>, SceneError> {
    let text = files::read_text(path).map_err(|fault| unreadable(path, &fault))?;
    let (reach, faults) = (Reach::of(path), Faults::default());
    let file = SourceFile::new(path, &text, &reach, &faults);
    let table = file.parse()?;
    parameters_of(&Section::root(&file, &table, ROOT)?, path)
}

/// The parameters in the file at `path`.
///
/// # Errors
/// As for [`read_parameters`].
pub(super) fn parameters_of(root: &Section<'_>, path: &Path) -> Result<Vec<Parameter>, SceneError> {
    let parameters = list(root, path)?;
    if parameters.is_empty() {
        return Err(root.error("parameter", "is missing: at least one [[parameter]] says what is varied"));
    }
    Ok(parameters)
}

/// Reads every `[[parameter]]` of a section.
pub(super) fn list(section: &Section<'_>, path: &Path) -> Result<Vec<Parameter>, SceneError> {
    let sections = section.tables("parameter", KEYS)?;
    let mut parameters: Vec<Parameter> = Vec::new();
    for section in &sections {
        let parameter = parameter(section, path)?;
        if parameters.iter().any(|other| other.name == parameter.name) {
            let key = if section.has("name") { "name" } else { "vary" };
            let message = format!("'{}' is the name of an earlier parameter: state another name", parameter.name);
            return Err(section.error(key, message));
        }
        parameters.push(parameter);
    }
    Ok(parameters)
}

fn parameter(section: &Section<'_>, path: &Path) -> Result<Parameter, SceneError> {
    let kind = section.choice("vary", &KINDS)?;
    let kind = section.required("vary", kind, "the value that is varied, such as \"absorptivity\"")?;
    let own = kind.owners();
    for key in ["material", "part", "node", "between", "between_materials"] {
        if section.has(key) && !own.contains(&key) {
            return Err(section.error(key, format!("has no meaning for vary = \"{}\"", kind.word())));
        }
    }
    let mut owners = (Vec::new(), "");
    if let Some(first) = own.first() {
        let key = own.iter().find(|key| section.has(key)).unwrap_or(first);
        let patterns = section.required(key, section.strings(key)?, "names with * and ? as wildcards")?;
        if key.starts_with("between") && patterns.len() != 2 {
            return Err(section.error(key, "must be two names, one for each side"));
        }
        owners = (patterns, *key);
    }
    let of_face = matches!(kind, ParameterKind::Absorptivity | ParameterKind::Emissivity);
    if section.has("face") && !of_face {
        return Err(section.error("face", format!("has no meaning for vary = \"{}\"", kind.word())));
    }
    let back = section.choice("face", &[("front", false), ("back", true)])?.unwrap_or(false);
    let range = match (
        section.numbers::<2>("range", Quantity::any(""))?,
        section.number("percent", Quantity::within(0.001, 1000.0, ""))?,
    ) {
        (Some([low, high]), None) if low >= high => return Err(section.error("range", "must be two rising numbers")),
        (Some([_, high]), None) if kind.is_share() && high > 1.0 => {
            return Err(section.error("range", format!("ends at {high}, but {} is at most 1", kind.word())));
        }
        (Some([low, _]), None) if low < 0.0 && !kind.is_power() => {
            return Err(section.error("range", format!("begins at {low}, but {} is not negative", kind.word())));
        }
        (Some(ends), None) => ParameterRange::Values(ends),
        (None, Some(percent)) => ParameterRange::Percent(percent),
        (Some(_), Some(_)) => return Err(section.error("percent", "cannot be combined with range")),
        (None, None) => {
            return Err(section.missing("range", &["percent"], "two rising values, or percent for both sides"));
        }
    };
    let prior = prior(section)?;
    let step = section.number("step", Quantity::within(1e-5, 0.2, ""))?.unwrap_or(STEP);
    let of = if owners.0.is_empty() { String::new() } else { format!(" of {}", owners.0.join(", ")) };
    let face = if back { " (back)" } else { "" };
    let name = section.name("name")?.unwrap_or_else(|| format!("{}{of}{face}", kind.word()));
    if name.chars().count() > LONGEST_NAME {
        return Err(section.error("name", format!("has more than {LONGEST_NAME} characters: state a shorter name")));
    }
    Ok(Parameter {
        name,
        kind,
        owners: owners.0,
        owner_key: owners.1,
        back,
        range,
        step,
        prior,
        path: path.to_path_buf(),
        line: section.line(),
    })
}

fn prior(section: &Section<'_>) -> Result<ParameterPrior, SceneError> {
    let word = section.choice("prior", &[("range", ParameterPrior::Range), ("none", ParameterPrior::None)])?;
    let value = section.number("prior_value", Quantity::positive(""))?;
    let sigma = section.number("prior_sigma", Quantity::within(1e-6, 10.0, ""))?;
    match (word, value, sigma) {
        (Some(_), None, None) | (None, None, None) => Ok(word.unwrap_or(ParameterPrior::Range)),
        (None, value, Some(sigma)) => Ok(ParameterPrior::Stated(value, sigma)),
        (None, Some(_), None) => {
            Err(section.missing("prior_sigma", &["prior_value"], "the standard deviation of the logarithm"))
        }
        (Some(_), ..) => Err(section.error("prior", "cannot be combined with prior_value and prior_sigma")),
    }
}
