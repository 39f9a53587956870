//! `[model]` and `[[part]]`: how long and how short the edges of the model's triangles may be.

use wildmatch::WildMatch;

use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use crate::model::{Model, Part};

/// Lengths of edges that a part asks for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Edges {
    /// Longer ones are split [m]; `None` keeps the file's own triangles.
    pub max: Option<f64>,
    /// The ends of shorter ones are merged [m]; `None` merges nothing.
    pub min: Option<f64>,
}

/// A `[[part]]`: patterns on names of parts, and what these ask for instead of what `[model]` does.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRule {
    /// Wildcard patterns (`*`, `?`).
    pub patterns: Vec<String>,
    /// What it states; the rest is that of `[model]`.
    pub edges: Edges,
}

/// The density of the nodes of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Density {
    /// Of the model.
    pub model: Edges,
    /// In the order of the file; the first that matches a part's name wins.
    pub parts: Vec<PartRule>,
}

impl PartRule {
    /// Whether one of the patterns matches the name of a part; case counts.
    pub fn matches(&self, part: &str) -> bool {
        self.patterns.iter().any(|pattern| WildMatch::new(pattern).matches(part))
    }
}

impl Density {
    /// What a part asks for.
    pub fn of(&self, part: &Part) -> Edges {
        let rule = self.parts.iter().find(|rule| rule.matches(&part.name)).map(|rule| rule.edges).unwrap_or_default();
        Edges { max: rule.max.or(self.model.max), min: rule.min.or(self.model.min) }
    }

    /// Longest edge of every part [m]; infinite where it keeps the file's triangles.
    pub fn max_edges(&self, model: &Model) -> Vec<f64> {
        model.parts.iter().map(|part| self.of(part).max.unwrap_or(f64::INFINITY)).collect()
    }

    /// Shortest edge of every part [m]; 0 where nothing is merged.
    pub fn min_edges(&self, model: &Model) -> Vec<f64> {
        model.parts.iter().map(|part| self.of(part).min.unwrap_or(0.0)).collect()
    }

    /// Patterns that change nothing, one sentence each.
    pub fn idle_patterns(&self, model: &Model) -> Vec<String> {
        let mut idle = Vec::new();
        for (index, rule) in self.parts.iter().enumerate() {
            for pattern in &rule.patterns {
                let wildcard = WildMatch::new(pattern);
                let mut matched = model.parts.iter().filter(|part| wildcard.matches(&part.name)).peekable();
                if matched.peek().is_none() {
                    idle.push(format!("Pattern '{pattern}' of [[part]] {} matches no part of the model.", index + 1));
                } else if matched.all(|part| self.parts[..index].iter().any(|rule| rule.matches(&part.name))) {
                    idle.push(format!(
                        "Pattern '{pattern}' of [[part]] {} matches what earlier ones match.",
                        index + 1
                    ));
                }
            }
        }
        idle
    }
}

/// Reads the edges of `[model]` and every `[[part]]`.
pub(super) fn read(model: &Section, parts: &[Section], assumptions: &mut Vec<String>) -> Result<Density, SceneError> {
    let whole = edges(model, Edges::default())?;
    let parts = parts.iter().map(|section| part(section, whole)).collect::<Result<Vec<_>, _>>()?;
    if whole.max.is_none() && parts.iter().all(|part| part.edges.max.is_none()) {
        assumptions.push("The model's triangles are not subdivided (model.max_edge is absent).".to_string());
    }
    Ok(Density { model: whole, parts })
}

fn part(section: &Section, whole: Edges) -> Result<PartRule, SceneError> {
    let patterns = section.required("match", section.strings("match")?, "the names of parts, with * and ?")?;
    if !section.has("max_edge") && !section.has("min_edge") {
        return Err(section.error("max_edge", "is missing: a [[part]] states max_edge, min_edge, or both [m]"));
    }
    Ok(PartRule { patterns, edges: edges(section, whole)? })
}

/// The edges that a section states; `whole` are those that hold where it is silent.
fn edges(section: &Section, whole: Edges) -> Result<Edges, SceneError> {
    let max = section.number("max_edge", Quantity::positive("m"))?;
    let min = section.number("min_edge", Quantity::non_negative("m"))?;
    if let (Some(longest), Some(shortest)) = (max.or(whole.max), min.or(whole.min))
        && shortest > longest
    {
        let key = if min.is_some() { "min_edge" } else { "max_edge" };
        let message = format!(
            "edges below {shortest} m would be merged and those above {longest} m split: min_edge must not be above \
             max_edge"
        );
        return Err(section.error(key, message));
    }
    Ok(Edges { max, min })
}
