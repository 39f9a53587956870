//! `[model]` and `[[part]]`: the longest and shortest edges of the model's triangles.

use wildmatch::WildMatch;

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::misspelt::suggestion;
use crate::model::{Model, Part};

/// The edge lengths that a part asks for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Edges {
    /// Longer edges are split [m]. An infinite one keeps the file's triangles. `None` leaves the choice to the program.
    pub max: Option<f64>,
    /// Shorter edges are merged [m]. `None` merges nothing.
    pub min: Option<f64>,
}

/// A `[[part]]`: name patterns, and edge lengths in place of the lengths of `[model]`.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRule {
    /// Wildcard patterns (`*`, `?`).
    pub(crate) patterns: Vec<String>,
    /// The stated lengths. `[model]` gives the missing ones.
    pub(crate) edges: Edges,
}

/// The node density of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Density {
    /// The edge lengths of `[model]`.
    pub model: Edges,
    /// The rules in file order. The first rule that matches a part's name wins.
    pub parts: Vec<PartRule>,
    /// Whether the program chose the longest edge of `[model]`.
    pub is_chosen: bool,
}

impl PartRule {
    /// Whether one of the patterns matches the name of a part. Case counts.
    pub(crate) fn matches(&self, part: &str) -> bool {
        self.patterns.iter().any(|pattern| WildMatch::new(pattern).matches(part))
    }
}

impl Density {
    /// The edge lengths that hold for a part.
    pub fn of(&self, part: &Part) -> Edges {
        let rule = self.parts.iter().find(|rule| rule.matches(&part.name)).map(|rule| rule.edges).unwrap_or_default();
        Edges { max: rule.max.or(self.model.max), min: rule.min.or(self.model.min) }
    }

    /// Longest edge of every part [m], infinite where the part keeps the file's triangles.
    pub(crate) fn max_edges(&self, model: &Model) -> Vec<f64> {
        model.parts.iter().map(|part| self.of(part).max.unwrap_or(f64::INFINITY)).collect()
    }

    /// Shortest edge of every part [m], 0 where nothing is merged.
    pub(crate) fn min_edges(&self, model: &Model) -> Vec<f64> {
        model.parts.iter().map(|part| self.of(part).min.unwrap_or(0.0)).collect()
    }

    /// The assumption of a scene that states no longest edge, where the program chooses none.
    pub(super) fn assumed(&self, keeps_file: bool) -> Option<String> {
        let is_stated = self.model.max.is_some() || self.parts.iter().any(|part| part.edges.max.is_some());
        let told = || "The model's triangles are not subdivided (model.max_edge is absent).".to_string();
        (keeps_file && !is_stated).then(told)
    }

    /// One sentence for each pattern that has no effect.
    pub(crate) fn idle_patterns(&self, model: &Model) -> Vec<String> {
        let mut idle = Vec::new();
        for (index, rule) in self.parts.iter().enumerate() {
            for pattern in &rule.patterns {
                let wildcard = WildMatch::new(pattern);
                let mut matched = model.parts.iter().filter(|part| wildcard.matches(&part.name)).peekable();
                if matched.peek().is_none() {
                    let near = suggestion(pattern, model.parts.iter().map(|part| part.name.as_str()));
                    idle.push(format!(
                        "pattern '{pattern}' of [[part]] {} matches no part of the model{near}",
                        index + 1
                    ));
                } else if matched.all(|part| self.parts[..index].iter().any(|rule| rule.matches(&part.name))) {
                    idle.push(format!("pattern '{pattern}' of [[part]] {} matches what earlier ones match", index + 1));
                }
            }
        }
        idle
    }
}

pub(super) fn read(model: &Section, parts: &[Section]) -> Result<Density, SceneError> {
    let whole = edges(model, Edges::default())?;
    let parts = parts.iter().map(|section| part(section, whole)).collect::<Result<Vec<_>, _>>()?;
    Ok(Density { model: whole, parts, is_chosen: false })
}

fn part(section: &Section, whole: Edges) -> Result<PartRule, SceneError> {
    let patterns = section.required("match", section.strings("match")?, "the names of parts, with * and ?")?;
    if !section.has("max_edge") && !section.has("min_edge") {
        return Err(section.missing("max_edge", &["min_edge"], "a [[part]] states max_edge, min_edge, or both [m]"));
    }
    Ok(PartRule { patterns, edges: edges(section, whole)? })
}

/// The edge lengths that a section states. `whole` fills in the missing ones.
fn edges(section: &Section, whole: Edges) -> Result<Edges, SceneError> {
    let max = match section.string("max_edge") {
        Ok(Some("file")) => Some(f64::INFINITY),
        Ok(Some(other)) => {
            let message = format!(
                "must be a length above 0 [m], or \"file\", which keeps the file's triangles; found \"{other}\""
            );
            return Err(section.error("max_edge", message));
        }
        _ => section.number("max_edge", Quantity::positive("m"))?,
    };
    let min = section.number("min_edge", Quantity::non_negative("m"))?;
    if let (Some(longest), Some(shortest)) = (max.or(whole.max), min.or(whole.min))
        && shortest > longest
    {
        let key = if min.is_some() { "min_edge" } else { "max_edge" };
        let message = format!(
            "edges below {shortest} m would be merged and those above {longest} m split: min_edge must not be above \
             max_edge"
        );
        return Err(section.clash(key, &["max_edge", "min_edge", "model.max_edge", "model.min_edge"], message));
    }
    Ok(Edges { max, min })
}
