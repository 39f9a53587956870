//! Values that are drawn, each from a named distribution with its parameters.

use std::ops::Range;

use toml::de::{DeTable, DeValue};
use toml::{Spanned, Value};

use super::random::Source;
use super::toml_value::{number, shown};
use crate::scene::keys::suggestion;

/// A value, or how it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawn {
    /// Always the same.
    Constant(Value),
    /// Any number between two with the same probability.
    Uniform([f64; 2]),
    /// A number whose logarithm is uniform.
    LogUniform([f64; 2]),
    /// A Gaussian, cut at the ends of `within`.
    Normal {
        /// Its middle.
        mean: f64,
        /// Its standard deviation.
        deviation: f64,
        /// Least and greatest value.
        within: [f64; 2],
    },
    /// One of some values, with their shares.
    Choice(Vec<Value>, Vec<f64>),
    /// A unit vector, uniform on the sphere.
    Direction,
    /// A unit quaternion (w, x, y, z), uniform over all rotations.
    Rotation,
    /// A list, each of whose items is drawn.
    List(Vec<Drawn>),
    /// A table, each of whose values is drawn.
    Table(Vec<(String, Drawn)>),
}

/// Words that name a distribution.
pub const NAMES: [&str; 6] = ["uniform", "log_uniform", "normal", "choice", "direction", "rotation"];

/// Least probability of `within`, below which a normal distribution is refused.
const LEAST_SHARE: f64 = 1e-6;

/// Place and text of what is wrong.
type Fault = (Range<usize>, String);

impl Drawn {
    /// Reads a value.
    ///
    /// # Errors
    /// The place of a distribution that can not be, and why.
    pub(super) fn read(value: &Spanned<DeValue>) -> Result<Self, Fault> {
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
                let each = table.iter().map(|(key, value)| Ok((key.get_ref().to_string(), Self::read(value)?)));
                Ok(Self::Table(each.collect::<Result<_, Fault>>()?))
            }
            DeValue::Array(array) => {
                let items = array.iter().map(Self::read).collect::<Result<Vec<_>, _>>()?;
                if items.iter().all(|item| matches!(item, Self::Constant(_))) {
                    return Ok(Self::Constant(constant(value)?));
                }
                Ok(Self::List(items))
            }
            _ => Ok(Self::Constant(constant(value)?)),
        }
    }

    /// Draws the value. Its numbers belong to `name`.
    pub fn draw(&self, name: &str, source: &Source) -> Value {
        match self {
            Self::Constant(value) => value.clone(),
            Self::Choice(values, shares) => {
                let mut left = source.uniform(name) * shares.iter().sum::<f64>();
                let met = shares.iter().position(|share| {
                    left -= share;
                    left < 0.0
                });
                // Rounding may leave a rest after the last share that is not 0.
                let last = shares.iter().rposition(|share| *share > 0.0).unwrap_or(0);
                values[met.unwrap_or(last)].clone()
            }
            Self::Direction => {
                let direction = direction(name, source, 180.0);
                Value::Array(direction.into_iter().map(Value::Float).collect())
            }
            Self::Rotation => Value::Array(rotation(name, source).into_iter().map(Value::Float).collect()),
            Self::List(items) => {
                let each = items.iter().enumerate();
                Value::Array(each.map(|(index, item)| item.draw(&format!("{name}.{index}"), source)).collect())
            }
            Self::Table(values) => {
                let each = values.iter();
                Value::Table(
                    each.map(|(key, value)| (key.clone(), value.draw(&format!("{name}.{key}"), source))).collect(),
                )
            }
            Self::Uniform(_) | Self::LogUniform(_) | Self::Normal { .. } => {
                Value::Float(self.quantile(source.uniform(name)))
            }
        }
    }

    /// Draws a number. It is 0 where the value is none.
    pub fn number(&self, name: &str, source: &Source) -> f64 {
        match self.draw(name, source) {
            Value::Float(number) => number,
            Value::Integer(number) => number as f64,
            _ => 0.0,
        }
    }

    /// The number below which a share of the draws lies.
    fn quantile(&self, share: f64) -> f64 {
        match *self {
            Self::Uniform([low, high]) => low + share * (high - low),
            Self::LogUniform([low, high]) => libm::exp(libm::log(low) + share * libm::log(high / low)).clamp(low, high),
            Self::Normal { mean, deviation, within } => {
                let [low, high] = within.map(|end| normal_share((end - mean) / deviation));
                (mean + deviation * normal_quantile(low + share * (high - low))).clamp(within[0], within[1])
            }
            _ => 0.0,
        }
    }

    /// Names of the numbers that it takes, in order.
    pub fn names(&self, name: &str) -> Vec<String> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Uniform(_) | Self::LogUniform(_) | Self::Normal { .. } | Self::Choice(..) => vec![name.to_owned()],
            Self::Direction => ["around", "height"].map(|part| format!("{name}.{part}")).to_vec(),
            Self::Rotation => (0..3).map(|part| format!("{name}.{part}")).collect(),
            Self::List(items) => {
                items.iter().enumerate().flat_map(|(index, item)| item.names(&format!("{name}.{index}"))).collect()
            }
            Self::Table(values) => {
                values.iter().flat_map(|(key, value)| value.names(&format!("{name}.{key}"))).collect()
            }
        }
    }

    /// A text that is always the same.
    pub fn text(&self) -> Option<&str> {
        if let Self::Constant(value) = self { value.as_str() } else { None }
    }

    /// The keys of a table.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        let values = if let Self::Table(values) = self { values.as_slice() } else { &[] };
        values.iter().map(|(key, _)| key.as_str())
    }

    /// Least and greatest number that may be drawn. `None` where it is not a number.
    pub fn range(&self) -> Option<[f64; 2]> {
        let of = |value: &Value| match value {
            Value::Float(number) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            _ => None,
        };
        match self {
            Self::Constant(value) => of(value).map(|number| [number; 2]),
            Self::Uniform(range) | Self::LogUniform(range) => Some(*range),
            Self::Normal { within, .. } => Some(*within),
            Self::Choice(values, _) => {
                let numbers = values.iter().map(of).collect::<Option<Vec<f64>>>()?;
                let ends = |all: [f64; 2], number: &f64| [all[0].min(*number), all[1].max(*number)];
                Some(numbers.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends))
            }
            _ => None,
        }
    }
}

/// A unit vector within an angle [deg] of +Z, uniform on the sphere.
pub fn direction(name: &str, source: &Source, half_angle_deg: f64) -> [f64; 3] {
    let around = std::f64::consts::TAU * source.uniform(&format!("{name}.around"));
    let least = libm::cos(half_angle_deg.to_radians());
    let z = 1.0 - source.uniform(&format!("{name}.height")) * (1.0 - least);
    let across = (1.0 - z * z).max(0.0).sqrt();
    [across * libm::cos(around), across * libm::sin(around), z]
}

/// A unit quaternion (w, x, y, z), uniform over all rotations (Shoemake 1992).
fn rotation(name: &str, source: &Source) -> [f64; 4] {
    let [a, b, c] = [0, 1, 2].map(|part| source.uniform(&format!("{name}.{part}")));
    let [b, c] = [b, c].map(|share| std::f64::consts::TAU * share);
    let [p, q] = [(1.0 - a).sqrt(), a.sqrt()];
    [q * libm::cos(c), p * libm::sin(b), p * libm::cos(b), q * libm::sin(c)]
}

/// Share of a normal distribution below a number of standard deviations.
fn normal_share(deviations: f64) -> f64 {
    0.5 * libm::erfc(-deviations / std::f64::consts::SQRT_2)
}

/// Number of standard deviations below which a share lies, by bisection.
fn normal_quantile(share: f64) -> f64 {
    let (mut low, mut high) = (-38.0, 38.0);
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if normal_share(middle) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// A value without distributions.
fn constant(value: &Spanned<DeValue>) -> Result<Value, Fault> {
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
            Value::Table(each.collect::<Result<_, Fault>>()?)
        }
    })
}

/// Reads a table that names a distribution.
fn distribution(table: &DeTable, place: Range<usize>) -> Result<Drawn, Fault> {
    let names: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).filter(|key| NAMES.contains(key)).collect();
    let [name] = names[..] else {
        return Err((place, format!("names {} distributions, and takes one: {}", names.len(), names.join(", "))));
    };
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
    let of = |key: &str| table.get(key);
    let Some(value) = of(name) else { return Err((place, "names no distribution".to_owned())) };
    let pair = |value: &Spanned<DeValue>, what: &str| {
        let numbers: Option<Vec<f64>> =
            value.get_ref().as_array().and_then(|all| all.iter().map(|item| number(item.get_ref())).collect());
        let pair: Option<[f64; 2]> = numbers.and_then(|numbers| numbers.try_into().ok());
        let pair = pair.filter(|pair| pair.iter().all(|number| number.is_finite()));
        pair.ok_or_else(|| (value.span(), format!("{what}, not {}", shown(value.get_ref()))))
    };
    let rising = |value: &Spanned<DeValue>, word: &str| {
        let [low, high] = pair(value, &format!("{word} takes two finite numbers, [low, high]"))?;
        if low > high {
            return Err((value.span(), format!("{word} must run from low to high, found {low} to {high}")));
        }
        Ok([low, high])
    };
    match name {
        "uniform" => rising(value, "uniform").map(Drawn::Uniform),
        "log_uniform" => {
            let ends = rising(value, "log_uniform")?;
            if ends[0] <= 0.0 {
                return Err((value.span(), format!("log_uniform must begin above 0, found {}", ends[0])));
            }
            Ok(Drawn::LogUniform(ends))
        }
        "normal" => {
            let [mean, deviation] = pair(value, "normal takes two finite numbers, [mean, standard deviation]")?;
            if deviation <= 0.0 {
                return Err((
                    value.span(),
                    format!("the standard deviation of normal must be above 0, found {deviation}"),
                ));
            }
            let within = of("within").map(|ends| rising(ends, "within")).transpose()?;
            let within = within.unwrap_or([mean - 6.0 * deviation, mean + 6.0 * deviation]);
            let share = normal_share((within[1] - mean) / deviation) - normal_share((within[0] - mean) / deviation);
            if share < LEAST_SHARE {
                let message = format!(
                    "normal has a share of {share:.1e} within {} to {}: nothing can be drawn",
                    within[0], within[1]
                );
                return Err((value.span(), message));
            }
            Ok(Drawn::Normal { mean, deviation, within })
        }
        "choice" => {
            let Some(values) = value.get_ref().as_array().filter(|values| !values.is_empty()) else {
                return Err((value.span(), "choice takes an array of values that is not empty".to_owned()));
            };
            let values = values.iter().map(constant).collect::<Result<Vec<_>, _>>()?;
            let Some(stated) = of("weights") else {
                let shares = vec![1.0; values.len()];
                return Ok(Drawn::Choice(values, shares));
            };
            let weights: Option<Vec<f64>> =
                stated.get_ref().as_array().and_then(|all| all.iter().map(|item| number(item.get_ref())).collect());
            let fits = |weights: &Vec<f64>| {
                let each = weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0);
                weights.len() == values.len() && each && weights.iter().sum::<f64>() > 0.0
            };
            let message = format!("weights takes {} numbers of 0 or more, not all 0", values.len());
            let weights = weights.filter(fits).ok_or_else(|| (stated.span(), message))?;
            Ok(Drawn::Choice(values, weights))
        }
        "direction" | "rotation" => match value.get_ref().as_str() {
            Some("uniform") => Ok(if name == "direction" { Drawn::Direction } else { Drawn::Rotation }),
            _ => Err((value.span(), format!("{name} takes the word \"uniform\""))),
        },
        _ => Err((place, "names no distribution".to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::random::{Plan, Sampling, Stream};

    fn read(text: &str) -> Result<Drawn, String> {
        let text = format!("x = {text}");
        let table = DeTable::parse(&text).unwrap();
        Drawn::read(table.get_ref().get("x").unwrap()).map_err(|(_, message)| message)
    }

    fn draws(text: &str, count: u64) -> Vec<f64> {
        let plan = Plan { seed: 1, sampling: Sampling::Random, counts: [count; 2], names: Default::default() };
        let drawn = read(text).unwrap();
        (0..count).map(|number| drawn.number("x", &plan.source(Stream::Image, number, 0))).collect()
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
            let found = all.iter().sum::<f64>() / 4000.0;
            let spread = (all.iter().map(|value| (value - found).powi(2)).sum::<f64>() / 4000.0).sqrt();
            assert!((found - mean).abs() < 4.0 * deviation / 4000f64.sqrt(), "{text}: {found}");
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
            let message = read(text).unwrap_err();
            assert!(message.contains(part), "{text}: {message}");
        }
    }

    #[test]
    fn directions_and_rotations_have_unit_length_and_no_favourite() {
        let plan = Plan { seed: 1, sampling: Sampling::Random, counts: [1; 2], names: Default::default() };
        let mut mean = [0.0; 3];
        for number in 0..2000 {
            let source = plan.source(Stream::Image, number, 0);
            let one = direction("d", &source, 180.0);
            assert!((one.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(direction("d", &source, 10.0)[2] >= 10f64.to_radians().cos());
            let turn = rotation("r", &source);
            assert!((turn.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            (0..3).for_each(|axis| mean[axis] += one[axis] / 2000.0);
        }
        // Each component has the variance 1/3.
        assert!(mean.iter().all(|x| x.abs() < 4.0 / (3.0f64 * 2000.0).sqrt()), "{mean:?}");
    }
}
