//! `[materials]` and `[[material]]`: rules that assign thermal values to glTF materials.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use wildmatch::WildMatch;

use crate::files::Reach;
use crate::misspelt::suggestion;
use crate::model::{Model, ModelMaterial};
use crate::thermal::material::Material;

use super::error::SceneError;
use super::extras::Extras;
use super::faults::{Faults, OTHER_FILES, OWN_SECTION};
use super::section::Section;
use super::table::MaterialTable;
use super::value_source::ValueSource;
use super::values::{Complete, Incomplete, Values};

/// Most idle patterns that an error lists.
const MOST_ADVICE: usize = 8;

/// Rules in file order. The first rule that matches a glTF material's name wins.
#[derive(Debug, Clone, Default)]
pub struct MaterialRules {
    /// The rules.
    pub rules: Vec<MaterialRule>,
    /// The rule for materials that no other rule matches and that have no `isotherm_` extras.
    pub default: Option<MaterialRule>,
    /// Rule of each material that stands for some parts alone.
    of_material: BTreeMap<usize, usize>,
    /// The settings for reading `extras` when the model is known.
    extras: ExtrasContext,
}

/// Name patterns and the values that they assign.
#[derive(Debug, Clone)]
pub struct MaterialRule {
    /// Wildcard patterns (`*`, `?`) on glTF material names.
    pub(crate) patterns: Vec<String>,
    /// Wildcard patterns on names of parts. `None` takes all parts.
    pub(crate) parts: Option<Vec<String>>,
    /// The values. `name` is set when the rule is applied.
    pub material: Material,
}

/// The settings for reading `extras`. The model is only known later.
#[derive(Debug, Clone)]
struct ExtrasContext {
    table: MaterialTable,
    table_path: Option<PathBuf>,
    /// The values that `[materials]` states for all materials.
    common: Values,
    /// Length of a step [s].
    step: f64,
    /// The files that `extras` may name.
    reach: Reach,
    /// Scene file, and the line after which a new rule can stand.
    scene: PathBuf,
    line: usize,
}

impl Default for ExtrasContext {
    fn default() -> Self {
        Self {
            table: MaterialTable::default(),
            table_path: None,
            common: Values::default(),
            step: 1.0,
            reach: Reach::Anywhere,
            scene: PathBuf::new(),
            line: 1,
        }
    }
}

/// Reads `[materials]` and every `[[material]]`. `step` [s] turns a `t_max` in seconds into steps. A scene whose
/// temperatures are `given` needs no responses. The paths of the table and of function files join `files`.
pub(super) fn read(
    materials: Option<&Section>,
    rules: &[Section],
    (scene, reach, faults): (&Path, &Reach, &Faults),
    step: f64,
    given: bool,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<MaterialRules, SceneError> {
    let mut context =
        ExtrasContext { step, reach: reach.clone(), scene: scene.to_path_buf(), ..ExtrasContext::default() };
    context.line = rules.last().or(materials).map_or(1, Section::line);
    if let Some(section) = materials {
        context.common = Values::read(section, step)?;
        if let Some(path) = section.path("table")? {
            context.table = MaterialTable::read(&path, reach, step, faults).or_else(|error| match error {
                SceneError::Unreadable { .. } => Err(section.error("table", error)),
                SceneError::Syntax { .. } => section.blame("table", &[], Err(error)),
                other => Err(other),
            })?;
            files.push(path.clone());
            context.table_path = Some(path);
        }
    }
    if given {
        context.common.assume_instant();
    }
    let mut assumed = Assumed::default();
    let rules = rules
        .iter()
        .enumerate()
        .map(|(index, section)| rule(section, index + 1, &context, files, &mut assumed))
        .collect::<Result<_, _>>()?;
    let default = match materials {
        Some(section) => default(section, &context, files, &mut assumed)?,
        None => None,
    };
    assumed.say(assumptions);
    Ok(MaterialRules { rules, default, of_material: BTreeMap::new(), extras: context })
}

fn rule(
    section: &Section,
    number: usize,
    context: &ExtrasContext,
    files: &mut Vec<PathBuf>,
    assumed: &mut Assumed,
) -> Result<MaterialRule, SceneError> {
    let parts = section.strings("part")?;
    let patterns = section.strings("match")?.or_else(|| parts.is_some().then(|| vec!["*".to_owned()]));
    let what = "the names of glTF materials, with * and ? as wildcards, or 'part', the names of parts";
    let patterns = section.required("match", patterns, what)?;
    let source = format!("{} rule {number}", file_name(&context.scene));
    let settled = settle(section, &section.strings("use")?.unwrap_or_default(), source, context)?;
    assumed.note(&settled.complete, &format!("rule {number} ({})", patterns.join(", ")));
    settled.add_files(files);
    Ok(MaterialRule { patterns, parts, material: settled.material(String::new()) })
}

fn default(
    section: &Section,
    context: &ExtrasContext,
    files: &mut Vec<PathBuf>,
    assumed: &mut Assumed,
) -> Result<Option<MaterialRule>, SceneError> {
    let Some(names) = section.strings("default")? else {
        return Ok(None);
    };
    let (entries, description) =
        context.table.combine(&names).map_err(|message| section.clash("default", &OF_THE_TABLE, message))?;
    let complete = entries
        .or(&context.common)
        .complete(context.step)
        .map_err(|Incomplete { message, .. }| section.clash("default", &OF_VALUES, message))?;
    assumed.note(&complete, "materials.default");
    let source = format!("{} materials.default; {description}", file_name(&context.scene));
    let settled = SettledMaterial { complete, source };
    settled.add_files(files);
    Ok(Some(MaterialRule { patterns: vec!["*".to_string()], parts: None, material: settled.material(String::new()) }))
}

/// The keys that decide which entries of a table are known, and the keys that a complete set of values depends on.
const OF_THE_TABLE: [&str; 1] = ["materials.table"];
const OF_VALUES: [&str; 3] = [OWN_SECTION, OTHER_FILES, "materials.*"];

struct SettledMaterial {
    complete: Complete,
    source: String,
}

impl SettledMaterial {
    /// Adds the files of its functions, each once.
    fn add_files(&self, files: &mut Vec<PathBuf>) {
        for file in &self.complete.files {
            if !files.contains(file) {
                files.push(file.clone());
            }
        }
    }

    fn material(self, name: String) -> Material {
        let Complete { front, sides, gloss, in_band, bulk, response, transition, ranges, .. } = self.complete;
        Material { name, front, sides, gloss, in_band, bulk, response, transition, source: self.source, ranges }
    }
}

/// Combines the values of `place`, of its table entries and of `[materials]`, in this order of priority.
fn settle(
    place: &impl ValueSource,
    entries: &[String],
    mut source: String,
    context: &ExtrasContext,
) -> Result<SettledMaterial, SceneError> {
    let stated = Values::read(place, context.step)?;
    let mut values = stated.clone();
    if !entries.is_empty() {
        let (entries, description) =
            context.table.combine(entries).map_err(|message| place.clash("use", &OF_THE_TABLE, message))?;
        values = values.or(&entries);
        let overrides = stated.states_front() || stated.states_back() || stated.states_bulk();
        source.push_str(if overrides { ", over " } else { "; " });
        source.push_str(&description);
    }
    let located = |Incomplete { key, message }| place.clash(key, &OF_VALUES, message);
    let complete = values.or(&context.common).complete(context.step).map_err(located)?;
    stated.check_back_is_used(&complete).map_err(located)?;
    Ok(SettledMaterial { complete, source })
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[derive(Default)]
struct Assumed {
    sides: Vec<String>,
    retarget: Vec<String>,
    domain: Vec<String>,
}

impl Assumed {
    fn note(&mut self, complete: &Complete, who: &str) {
        if complete.sides_assumed {
            self.sides.push(who.to_string());
        }
        if complete.retarget_assumed {
            self.retarget.push(who.to_string());
        }
        if complete.domain_assumed {
            self.domain.push(who.to_string());
        }
    }

    fn say(&self, assumptions: &mut Vec<String>) {
        if !self.sides.is_empty() {
            let who = self.sides.join(", ");
            assumptions.push(format!("Surfaces exchange heat on their outside only (sides is absent): {who}."));
        }
        if !self.retarget.is_empty() {
            let who = self.retarget.join(", ");
            assumptions.push(format!("A transition merges with the one under way (retarget is absent): {who}."));
        }
        if !self.domain.is_empty() {
            let who = self.domain.join(", ");
            assumptions.push(format!("A transition moves T, not its fourth power (domain is absent): {who}."));
        }
    }
}

impl MaterialRules {
    /// A material for each of `model.materials`. Values come from the first rule that matches its name, else from its
    /// own `extras`, else from the default rule. Function files of `extras` join `files`.
    ///
    /// # Errors
    /// [`SceneError::Unmatched`] with the names of all materials without values. An error about the first wrong or
    /// incomplete `extras`.
    pub fn resolve(&self, model: &Model, files: &mut Vec<PathBuf>) -> Result<Vec<Material>, SceneError> {
        let mut materials = Vec::with_capacity(model.materials.len());
        let mut unmatched = Vec::new();
        for (place, wanted) in model.materials.iter().enumerate() {
            match self.find((place, wanted), model, files)? {
                Some(material) => materials.push(material),
                None => unmatched.push(format!("'{}'", wanted.name)),
            }
        }
        if unmatched.is_empty() {
            return Ok(materials);
        }
        let idle = self.idle_patterns(model);
        let advice: String = idle.iter().take(MOST_ADVICE).map(|told| format!(". But {told}")).collect();
        Err(SceneError::Unmatched {
            path: self.extras.scene.clone(),
            line: self.extras.line,
            model: model.source.clone(),
            names: unmatched,
            advice,
        })
    }

    /// Gives the surfaces of parts that rules tell apart materials of their own: `paint of wing` for what the rule of `wing` takes of the material
    /// `paint`.
    pub fn split_by_part(&mut self, model: &mut Model) {
        if self.rules.iter().all(|rule| rule.parts.is_none()) {
            return;
        }
        let rule_of = |material: u32, part: u32| {
            let [material, part] =
                [&model.materials[material as usize].name, &model.parts[part as usize].name].map(String::as_str);
            let rule = self.rules.iter().position(|rule| rule.takes(material, part));
            rule.filter(|rule| self.rules[*rule].parts.is_some())
        };
        let pairs: BTreeSet<(u32, u32)> =
            model.vertex_material.iter().copied().zip(model.vertex_part.iter().copied()).collect();
        let chosen: BTreeMap<(u32, u32), Option<usize>> =
            pairs.into_iter().map(|(material, part)| ((material, part), rule_of(material, part))).collect();
        let mut made: BTreeMap<(u32, Option<usize>), u32> = BTreeMap::new();
        for ((material, _), rule) in &chosen {
            if rule.is_none() {
                made.insert((*material, None), *material);
            }
        }
        for ((material, _), rule) in &chosen {
            let Some(number) = rule.filter(|_| !made.contains_key(&(*material, *rule))) else { continue };
            // A material that no other rule takes keeps its place and its name.
            let alone = chosen.range((*material, 0)..=(*material, u32::MAX)).all(|(_, other)| other == rule);
            let place = if alone {
                *material
            } else {
                let whole = &model.materials[*material as usize];
                let parts =
                    self.rules[number].parts.iter().flatten().map(String::as_str).collect::<Vec<_>>().join(", ");
                let split = ModelMaterial {
                    name: format!("{} of {parts}", whole.name),
                    extras: whole.extras.clone(),
                    colour: whole.colour,
                };
                model.materials.push(split);
                model.materials.len() as u32 - 1
            };
            made.insert((*material, *rule), place);
            self.of_material.insert(place as usize, number);
        }
        for (material, part) in model.vertex_material.iter_mut().zip(&model.vertex_part) {
            *material = made[&(*material, chosen[&(*material, *part)])];
        }
    }

    pub(crate) fn table(&self) -> Option<&Path> {
        self.extras.table_path.as_deref()
    }

    fn find(
        &self,
        (place, wanted): (usize, &ModelMaterial),
        model: &Model,
        files: &mut Vec<PathBuf>,
    ) -> Result<Option<Material>, SceneError> {
        let stated = self.of_material.get(&place).map(|rule| &self.rules[*rule]);
        let whole = || self.rules.iter().find(|rule| rule.parts.is_none() && rule.matches(&wanted.name));
        if let Some(rule) = stated.or_else(whole) {
            return Ok(Some(Material { name: wanted.name.clone(), ..rule.material.clone() }));
        }
        if let Some(extras) = Extras::open(&model.source, &self.extras.reach, wanted)? {
            let entries: Vec<String> = extras.string("use")?.map(str::to_string).into_iter().collect();
            let source = format!("{} extras", file_name(&model.source));
            let mut settled = settle(&extras, &entries, source, &self.extras)?;
            if settled.complete.sides_assumed {
                settled.source.push_str("; outside only, because sides is absent");
            }
            if settled.complete.retarget_assumed {
                settled.source.push_str("; merged, because retarget is absent");
            }
            if settled.complete.domain_assumed {
                settled.source.push_str("; T moves, because domain is absent");
            }
            if extras.has_small() {
                settled.source.push_str("; a number too small for its unit counts as 0");
            }
            settled.add_files(files);
            return Ok(Some(settled.material(wanted.name.clone())));
        }
        Ok(self.default.as_ref().map(|rule| Material { name: wanted.name.clone(), ..rule.material.clone() }))
    }

    /// One sentence for each pattern that matches no material or part, or only materials of an earlier rule. Such a pattern is
    /// probably misspelt.
    pub fn idle_patterns(&self, model: &Model) -> Vec<String> {
        let [parts, materials] = [
            model.parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(),
            model.materials.iter().map(|material| material.name.as_str()).collect(),
        ];
        let matches = |names: &[&str], pattern: &str| names.iter().any(|name| WildMatch::new(pattern).matches(name));
        let mut idle = Vec::new();
        for (index, rule) in self.rules.iter().enumerate() {
            let (number, before) = (index + 1, idle.len());
            for pattern in rule.parts.iter().flatten().filter(|pattern| !matches(&parts, pattern)) {
                let near = suggestion(pattern, parts.iter().copied());
                idle.push(format!("pattern '{pattern}' of rule {number} matches no part of the model{near}"));
            }
            let earlier = || self.rules[..index].iter().filter(|rule| rule.parts.is_none());
            for pattern in &rule.patterns {
                let wildcard = WildMatch::new(pattern);
                let taken = |name: &&str| !wildcard.matches(name) || earlier().any(|rule| rule.matches(name));
                if !matches(&materials, pattern) {
                    let hint = match matches(&parts, pattern) {
                        true => {
                            ", but a part: 'match' takes names of materials, and 'part' takes names of parts".to_owned()
                        }
                        false => suggestion(pattern, materials.iter().copied()),
                    };
                    idle.push(format!("pattern '{pattern}' of rule {number} matches no material of the model{hint}"));
                } else if rule.parts.is_none() && materials.iter().all(taken) {
                    idle.push(format!("pattern '{pattern}' of rule {number} matches what earlier rules match"));
                }
            }
            if rule.parts.is_some() && idle.len() == before && !self.of_material.values().any(|taker| *taker == index) {
                idle.push(format!(
                    "rule {number} takes no surface: no part of its 'part' has a material of its 'match', or earlier rules take them"
                ));
            }
        }
        idle
    }
}

impl MaterialRule {
    /// Whether the rule is for a material on a part.
    fn takes(&self, material: &str, part: &str) -> bool {
        let fits = |parts: &Vec<String>| parts.iter().any(|pattern| WildMatch::new(pattern).matches(part));
        self.matches(material) && self.parts.as_ref().is_none_or(fits)
    }

    /// Whether one of the patterns matches the name of a glTF material. Case counts.
    pub fn matches(&self, name: &str) -> bool {
        self.patterns.iter().any(|pattern| WildMatch::new(pattern).matches(name))
    }
}
