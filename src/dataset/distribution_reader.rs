//! Reads values that are drawn: constants, distributions, and lists and tables of them.

use std::ops::Range;

use toml::de::{DeTable, DeValue};
use toml::{Spanned, Value};

use super::distribution::{Distribution, NAMES, normal_share};
use super::toml_value::shown;
use crate::misspelt::suggestion;
use crate::scene::section::as_number as number;

/// Least probability of `within`, below which a normal distribution is refused.
const LEAST_SHARE: f64 = 1e-6;

/// Place in the file, and text, of a mistake.
type TextFault = (Range<usize>, String);

/// Reads a value.
///
/// # Errors
/// The place of a distribution that can not be, and why.
pub(super) fn read(value: &Spanned<DeValue>) -> Result<Distribution, TextFault> {
    match value.get_ref() {
        DeValue::Table(table) if table.keys().any(|key| NAMES.contains(&key.get_ref().as_ref())) => {
            distribution(table, value.span())
        }
        DeValue::Table(table) => {
            let slip = table.keys().find(|key| {
                let word: &str = key.get_ref().as_ref();
                table.len() == 1 && suggestion(word, NAMES).contains("did you mean")
            });
            if let Some(key) = slip {
                let word: &str = key.get_ref().as_ref();
                return Err((key.span(), format!("'{word}' is no distribution{}", suggestion(word, NAMES))));
            }
            let each = table.iter().map(|(key, value)| Ok((key.get_ref().to_string(), read(value)?)));
            Ok(Distribution::Table(each.collect::<Result<_, TextFault>>()?))
        }
        DeValue::Array(array) => {
            let items = array.iter().map(read).collect::<Result<Vec<_>, _>>()?;
            if items.iter().all(|item| matches!(item, Distribution::Constant(_))) {
                return Ok(Distribution::Constant(constant(value)?));
            }
            Ok(Distribution::List(items))
        }
        _ => Ok(Distribution::Constant(constant(value)?)),
    }
}

/// A value without distributions.
fn constant(value: &Spanned<DeValue>) -> Result<Value, TextFault> {
    Ok(match value.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Boolean(boolean) => Value::Boolean(*boolean),
        DeValue::Datetime(date) => Value::Datetime(*date),
        DeValue::Integer(integer) => {
            let number = i64::from_str_radix(integer.as_str(), integer.radix()).ok();
            Value::Integer(number.ok_or_else(|| (value.span(), format!("{integer} is too large")))?)
        }
        DeValue::Float(_) => match number(value.get_ref()) {
            Some(number) if number.is_finite() => Value::Float(number),
            _ => return Err((value.span(), "must be finite".to_owned())),
        },
        DeValue::Array(array) => Value::Array(array.iter().map(constant).collect::<Result<_, _>>()?),
        DeValue::Table(table) => {
            let each = table.iter().map(|(key, value)| Ok((key.get_ref().to_string(), constant(value)?)));
            Value::Table(each.collect::<Result<_, TextFault>>()?)
        }
    })
}

fn distribution(table: &DeTable, place: Range<usize>) -> Result<Distribution, TextFault> {
    let names: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).filter(|key| NAMES.contains(key)).collect();
    let [name] = names[..] else {
        return Err((place, format!("names {} distributions, and takes one: {}", names.len(), names.join(", "))));
    };
    check_keys(table, name)?;
    let Some(value) = table.get(name) else { return Err((place, "names no distribution".to_owned())) };
    match name {
        "uniform" => read_rising(value, "uniform").map(Distribution::Uniform),
        "log_uniform" => {
            let ends = read_rising(value, "log_uniform")?;
            if ends[0] <= 0.0 {
                return Err((value.span(), format!("log_uniform must begin above 0, found {}", ends[0])));
            }
            Ok(Distribution::LogUniform(ends))
        }
        "normal" => read_normal(table, value),
        "choice" => read_choice(table, value),
        "direction" | "rotation" => match value.get_ref().as_str() {
            Some("uniform") => Ok(if name == "direction" { Distribution::Direction } else { Distribution::Rotation }),
            _ => Err((value.span(), format!("{name} takes the word \"uniform\""))),
        },
        _ => Err((place, "names no distribution".to_owned())),
    }
}

/// Refuses keys that the distribution does not have.
fn check_keys(table: &DeTable, name: &str) -> Result<(), TextFault> {
    let extra: &[&str] = match name {
        "normal" => &["within"],
        "choice" => &["weights"],
        _ => &[],
    };
    if let Some(key) = table.keys().find(|key| *key.get_ref() != name && !extra.contains(&key.get_ref().as_ref())) {
        let word: &str = key.get_ref().as_ref();
        let known: Vec<&str> = [name].into_iter().chain(extra.iter().copied()).collect();
        return Err((key.span(), format!("unknown key '{word}'{}", suggestion(word, known.iter().copied()))));
    }
    Ok(())
}

fn read_pair(value: &Spanned<DeValue>, what: &str) -> Result<[f64; 2], TextFault> {
    let numbers: Option<Vec<f64>> =
        value.get_ref().as_array().and_then(|all| all.iter().map(|item| number(item.get_ref())).collect());
    let pair: Option<[f64; 2]> = numbers.and_then(|numbers| numbers.try_into().ok());
    let pair = pair.filter(|pair| pair.iter().all(|number| number.is_finite()));
    pair.ok_or_else(|| (value.span(), format!("{what}, not {}", shown(value.get_ref()))))
}

fn read_rising(value: &Spanned<DeValue>, word: &str) -> Result<[f64; 2], TextFault> {
    let [low, high] = read_pair(value, &format!("{word} takes two finite numbers, [low, high]"))?;
    if low > high {
        return Err((value.span(), format!("{word} must run from low to high, found {low} to {high}")));
    }
    Ok([low, high])
}

/// Reads a normal distribution and its limits.
fn read_normal(table: &DeTable, value: &Spanned<DeValue>) -> Result<Distribution, TextFault> {
    let [mean, deviation] = read_pair(value, "normal takes two finite numbers, [mean, standard deviation]")?;
    if deviation <= 0.0 {
        return Err((value.span(), format!("the standard deviation of normal must be above 0, found {deviation}")));
    }
    let within = table.get("within").map(|ends| read_rising(ends, "within")).transpose()?;
    let within = within.unwrap_or([mean - 6.0 * deviation, mean + 6.0 * deviation]);
    let share = normal_share((within[1] - mean) / deviation) - normal_share((within[0] - mean) / deviation);
    if share < LEAST_SHARE {
        let message =
            format!("normal has a share of {share:.1e} within {} to {}: nothing can be drawn", within[0], within[1]);
        return Err((value.span(), message));
    }
    Ok(Distribution::Normal { mean, deviation, within })
}

/// Reads a choice among values, and its weights.
fn read_choice(table: &DeTable, value: &Spanned<DeValue>) -> Result<Distribution, TextFault> {
    let Some(values) = value.get_ref().as_array().filter(|values| !values.is_empty()) else {
        return Err((value.span(), "choice takes an array of values that is not empty".to_owned()));
    };
    let values = values.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let Some(stated) = table.get("weights") else {
        let shares = vec![1.0; values.len()];
        return Ok(Distribution::Choice(values, shares));
    };
    let weights: Option<Vec<f64>> =
        stated.get_ref().as_array().and_then(|all| all.iter().map(|item| number(item.get_ref())).collect());
    let fits = |weights: &Vec<f64>| {
        let each = weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0);
        weights.len() == values.len() && each && weights.iter().sum::<f64>() > 0.0
    };
    let message = format!("weights takes {} numbers of 0 or more, not all 0", values.len());
    let weights = weights.filter(fits).ok_or_else(|| (stated.span(), message))?;
    Ok(Distribution::Choice(values, weights))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::random::{CubeSampling, RandomPlan, RandomStream};

    fn of(text: &str) -> Result<Distribution, String> {
        let text = format!("x = {text}");
        let table = DeTable::parse(&text).unwrap();
        read(table.get_ref().get("x").unwrap()).map_err(|(_, message)| message)
    }

    fn draws(text: &str, count: u64) -> Vec<f64> {
        let plan =
            RandomPlan { seed: 1, sampling: CubeSampling::Random, counts: [count; 2], names: Default::default() };
        let drawn = of(text).unwrap();
        (0..count).map(|number| drawn.number("x", &plan.source(RandomStream::Image, number, 0))).collect()
    }

    #[test]
    fn draws_have_the_stated_moments() {
        for (text, mean, deviation) in [
            ("{ uniform = [2, 4] }", 3.0, 2.0 / 12f64.sqrt()),
            ("{ normal = [10, 3] }", 10.0, 3.0),
            // The mean of a log-uniform number is (b - a) / ln(b / a).
            (
                "{ log_uniform = [1, 10] }",
                9.0 / 10f64.ln(),
                (99.0 / 2.0 / 10f64.ln() - (9.0 / 10f64.ln()).powi(2)).sqrt(),
            ),
            ("{ choice = [0, 1], weights = [3, 1] }", 0.25, (3.0f64 / 16.0).sqrt()),
        ] {
            let all = draws(text, 4000);
            let computed = all.iter().sum::<f64>() / 4000.0;
            let spread = (all.iter().map(|value| (value - computed).powi(2)).sum::<f64>() / 4000.0).sqrt();
            assert!((computed - mean).abs() < 4.0 * deviation / 4000f64.sqrt(), "{text}: {computed}");
            assert!((spread / deviation - 1.0).abs() < 0.06, "{text}: {spread}");
        }
    }

    #[test]
    fn a_cut_normal_stays_within_and_keeps_its_shape() {
        let all = draws("{ normal = [0, 1], within = [0, 1] }", 4000);
        assert!(all.iter().all(|value| (0.0..=1.0).contains(value)));
        // Mean of a normal cut at 0 and 1: (phi(0) - phi(1)) / (Phi(1) - Phi(0)) = 0.15697 / 0.34134.
        let mean = all.iter().sum::<f64>() / 4000.0;
        assert!((mean - 0.4599).abs() < 4.0 * 0.29 / 4000f64.sqrt(), "{mean}");
    }

    #[test]
    fn what_can_not_be_drawn_is_refused() {
        for (text, part) in [
            ("{ uniform = [4, 2] }", "from low to high"),
            ("{ uniform = 3 }", "two finite numbers"),
            ("{ log_uniform = [0, 2] }", "above 0"),
            ("{ normal = [1, 0] }", "standard deviation"),
            ("{ normal = [0, 1], within = [9, 10] }", "nothing can be drawn"),
            ("{ choice = [] }", "not empty"),
            ("{ choice = [1, 2], weights = [1] }", "weights takes 2"),
            ("{ choice = [1, 2], weights = [0, 0] }", "not all 0"),
            ("{ uniform = [1, 2], normal = [1, 2] }", "takes one"),
            ("{ uniform = [1, 2], within = [1, 2] }", "unknown key 'within'"),
            ("{ unifrom = [1, 2] }", "did you mean 'uniform'"),
            ("{ rotation = 3 }", "uniform"),
            ("nan", "finite"),
        ] {
            let message = of(text).unwrap_err();
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
