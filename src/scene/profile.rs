//! `heating = { .. }` and `cooling = { .. }`: a function with its values and its duration.

use std::path::PathBuf;

use crate::thermal::function::{Function, FunctionError, parse::KINDS};
use crate::thermal::material::{LONGEST_T_MAX, Profile, SHORTEST_T_MAX};

use super::choice::list;
use super::error::SceneError;
use super::keys;
use super::quantity::Quantity;
use super::value_source::ValueSource;

/// Keys that only some kinds of function read, with these kinds.
const VALUES: [(&str, &[&str]); 5] = [
    ("coefficients", &["polynomial"]),
    ("rate", &["exponential", "logarithmic"]),
    ("file", &["table"]),
    ("target", &["table"]),
    ("text", &["expression"]),
];

#[derive(Debug, Clone, PartialEq)]
pub(super) struct StatedProfile {
    pub(super) profile: Profile,
    pub(super) file: Option<PathBuf>,
}

/// Reads the profile `key`. `step` [s] turns a `t_max` in seconds into steps.
pub(super) fn read(source: &impl ValueSource, key: &str, step: f64) -> Result<Option<StatedProfile>, SceneError> {
    let Some(group) = source.group(key, keys::PROFILE)? else {
        return Ok(None);
    };
    let kinds = KINDS.map(|kind| (kind, kind));
    let Some(kind) = group.choice("function", &kinds)? else {
        return Err(group.missing("function", &format!("one of {}", list(KINDS))));
    };
    let function = function(&group, kind)?;
    let steps = group.number("t_max_steps", Quantity::within(0.0, LONGEST_T_MAX, "steps"))?;
    let seconds = group.number("t_max", Quantity::non_negative("s"))?;
    let t_max_steps = match (steps, seconds) {
        (Some(_), Some(_)) => {
            return Err(group.clash(
                "t_max",
                &["t_max_steps"],
                "cannot be combined with 't_max_steps': state one of the two".to_string(),
            ));
        }
        (Some(steps), None) if steps == 0.0 || steps >= SHORTEST_T_MAX => steps,
        (Some(steps), None) => {
            let message = format!("must be 0 or from {SHORTEST_T_MAX} to {LONGEST_T_MAX} [steps], found {steps:e}");
            return Err(group.error("t_max_steps", message));
        }
        (None, Some(seconds)) if seconds != 0.0 && seconds / step < SHORTEST_T_MAX => {
            let message = format!(
                "{seconds} s are {:e} steps of {step} s: state 0, or at least {SHORTEST_T_MAX} steps",
                seconds / step
            );
            return Err(group.clash("t_max", &["time.step"], message));
        }
        (None, Some(seconds)) if seconds / step <= LONGEST_T_MAX => seconds / step,
        (None, Some(seconds)) => {
            let message = format!(
                "{seconds} s are {} steps of {step} s, and a transition takes at most {LONGEST_T_MAX}: state a shorter \
                 one, or a longer time.step",
                seconds / step
            );
            return Err(group.clash("t_max", &["time.step"], message));
        }
        (None, None) => {
            let what = "the time to reach the target, in steps (t_max_steps) or in seconds (t_max)";
            return Err(group.missing("t_max_steps", what));
        }
    };
    Ok(Some(StatedProfile { profile: Profile { function, t_max_steps }, file: group.path("file")? }))
}

fn function(group: &impl ValueSource, kind: &str) -> Result<Function, SceneError> {
    let rate = group.number("rate", Quantity::any(""))?;
    let coefficients = group.list("coefficients")?;
    let target = group.number("target", Quantity::non_negative("K"))?;
    let text = group.text("text")?;
    let present =
        [coefficients.is_some(), rate.is_some(), group.text("file")?.is_some(), target.is_some(), text.is_some()];
    for ((key, owners), present) in VALUES.into_iter().zip(present) {
        if present && !owners.contains(&kind) {
            let owners = list(owners.iter().copied());
            return Err(group.clash(
                key,
                &["function"],
                format!("has no meaning for '{kind}': it belongs to {owners}"),
            ));
        }
    }
    let missing = |key: &str, what: &str| group.missing(key, what);
    let wrong = |key: &'static str| move |error: FunctionError| group.error(key, error.to_string());
    match kind {
        "linear" => Ok(Function::Linear),
        "quadratic" => Ok(Function::Quadratic),
        "polynomial" => {
            let coefficients = coefficients.ok_or_else(|| {
                missing("coefficients", "[c0, c1, c2, ..] of c0 + c1 s + c2 s^2 + .., which must rise from 0 to 1")
            })?;
            Function::polynomial(&coefficients).map_err(wrong("coefficients"))
        }
        "exponential" => {
            let rate = rate.ok_or_else(|| missing("rate", "the number k of (1 - e^-ks) / (1 - e^-k)"))?;
            Function::exponential(rate).map_err(wrong("rate"))
        }
        "logarithmic" => {
            let rate = rate.ok_or_else(|| missing("rate", "the number k of ln(1 + ks) / ln(1 + k)"))?;
            Function::logarithmic(rate).map_err(wrong("rate"))
        }
        "table" => {
            let file = group
                .path("file")?
                .ok_or_else(|| missing("file", "a CSV file with the columns time and temperature"))?;
            Function::read_table(&file, target).map_err(wrong("file"))
        }
        _ => {
            let text = text.ok_or_else(|| missing("text", "GLSL text of s, such as \"s*s*(3.0-2.0*s)\""))?;
            Function::expression(text).map_err(wrong("text"))
        }
    }
}
