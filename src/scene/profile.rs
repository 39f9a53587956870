//! `heating = { .. }` and `cooling = { .. }`: a function with its values, and the time that it takes.

use crate::thermal::function::{Function, FunctionError, parse::KINDS};
use crate::thermal::material::Profile;

use super::error::SceneError;
use super::keys;
use super::quantity::Quantity;
use super::section::list;
use super::values::ValueSource;

/// Keys that belong to one kind of function, with the kind.
const VALUES: [(&str, &str); 5] = [
    ("coefficients", "polynomial"),
    ("rate", "exponential"),
    ("file", "table"),
    ("target", "table"),
    ("text", "expression"),
];

/// Reads the profile `key`. `step` [s] turns a `t_max` in seconds into steps.
pub(super) fn read(source: &impl ValueSource, key: &str, step: f64) -> Result<Option<Profile>, SceneError> {
    let Some(group) = source.group(key, keys::PROFILE)? else {
        return Ok(None);
    };
    let kinds = KINDS.map(|kind| (kind, kind));
    let Some(kind) = group.choice("function", &kinds)? else {
        return Err(group.error("function", format!("is missing: one of {}", list(KINDS))));
    };
    let function = function(&group, kind)?;
    let steps = group.number("t_max_steps", Quantity::non_negative("steps"))?;
    let seconds = group.number("t_max", Quantity::non_negative("s"))?;
    let t_max_steps = match (steps, seconds) {
        (Some(_), Some(_)) => {
            return Err(group.error("t_max", "cannot be combined with 't_max_steps': state one of the two".to_string()));
        }
        (Some(steps), None) => steps,
        (None, Some(seconds)) => seconds / step,
        (None, None) => {
            let message = "is missing: the time to reach the target, in steps (t_max_steps) or in seconds (t_max)";
            return Err(group.error("t_max_steps", message.to_string()));
        }
    };
    Ok(Some(Profile { function, t_max_steps }))
}

fn function(group: &impl ValueSource, kind: &str) -> Result<Function, SceneError> {
    let rate = group.number("rate", Quantity::any(""))?;
    let coefficients = group.list("coefficients")?;
    let file = group.path("file")?;
    let target = group.number("target", Quantity::non_negative("K"))?;
    let text = group.text("text")?;
    let present = [coefficients.is_some(), rate.is_some(), file.is_some(), target.is_some(), text.is_some()];
    for ((key, owner), present) in VALUES.into_iter().zip(present) {
        let belongs = owner == kind || (key == "rate" && kind == "logarithmic");
        if present && !belongs {
            return Err(group.error(key, format!("has no meaning for '{kind}'")));
        }
    }
    let missing = |key: &str, what: &str| group.error(key, format!("is missing: {what}"));
    let wrong = |key: &'static str| move |error: FunctionError| group.error(key, error.to_string());
    match kind {
        "linear" => Ok(Function::Linear),
        "quadratic" => Ok(Function::Quadratic),
        "polynomial" => {
            let coefficients = coefficients.ok_or_else(|| missing("coefficients", "[c0, c1, c2, ..] of s"))?;
            Function::polynomial(&coefficients).map_err(wrong("coefficients"))
        }
        "exponential" => {
            let rate = rate.ok_or_else(|| missing("rate", "k of (1 - e^-ks) / (1 - e^-k)"))?;
            Function::exponential(rate).map_err(wrong("rate"))
        }
        "logarithmic" => {
            let rate = rate.ok_or_else(|| missing("rate", "k of ln(1 + ks) / ln(1 + k)"))?;
            Function::logarithmic(rate).map_err(wrong("rate"))
        }
        "table" => {
            let file = file.ok_or_else(|| missing("file", "a CSV file with the columns time and temperature"))?;
            Function::read_table(&file, target).map_err(wrong("file"))
        }
        _ => {
            let text = text.ok_or_else(|| missing("text", "GLSL text of s, such as \"s*s*(3.0-2.0*s)\""))?;
            Function::expression(text).map_err(wrong("text"))
        }
    }
}
