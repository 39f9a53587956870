//! Values that are drawn, each from a named distribution with its parameters.

use toml::Value;

use super::random::RandomSource;

/// A value, or how it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Distribution {
    /// Always the same.
    Constant(Value),
    /// Any number between two with the same probability.
    Uniform([f64; 2]),
    /// A number whose logarithm is uniform.
    LogUniform([f64; 2]),
    /// A Gaussian, cut at the ends of `within`.
    Normal {
        /// Mean before the cut.
        mean: f64,
        deviation: f64,
        /// Least and greatest value.
        within: [f64; 2],
    },
    /// One of some values, with their shares. A table among them may have values that are drawn.
    Choice(Vec<Distribution>, Vec<f64>),
    /// A unit vector, uniform on the sphere.
    Direction,
    /// A unit quaternion (w, x, y, z), uniform over all rotations.
    Rotation,
    /// A list, each of whose items is drawn.
    List(Vec<Distribution>),
    /// A table, each of whose values is drawn.
    Table(Vec<(String, Distribution)>),
}

/// Words that name a distribution.
pub(crate) const NAMES: [&str; 6] = ["uniform", "log_uniform", "normal", "choice", "direction", "rotation"];

impl Distribution {
    /// Draws the value from the random numbers of `name`.
    pub(crate) fn draw(&self, name: &str, source: &RandomSource) -> Value {
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
                let chosen = met.unwrap_or(last);
                values[chosen].draw(&format!("{name}.{chosen}"), source)
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

    /// Draws a number. A value that is no number gives 0.
    pub(crate) fn number(&self, name: &str, source: &RandomSource) -> f64 {
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
    pub(crate) fn names(&self, name: &str) -> Vec<String> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Uniform(_) | Self::LogUniform(_) | Self::Normal { .. } => vec![name.to_owned()],
            Self::Choice(values, _) => {
                let within = values.iter().enumerate().flat_map(|(index, item)| item.names(&format!("{name}.{index}")));
                std::iter::once(name.to_owned()).chain(within).collect()
            }
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
    pub(crate) fn text(&self) -> Option<&str> {
        if let Self::Constant(value) = self { value.as_str() } else { None }
    }

    /// The tables that may be drawn: the table itself, or those among which one is chosen.
    pub(crate) fn tables(&self) -> impl Iterator<Item = &[(String, Distribution)]> {
        let all = if let Self::Choice(values, _) = self { values.as_slice() } else { std::slice::from_ref(self) };
        all.iter().filter_map(|one| if let Self::Table(values) = one { Some(values.as_slice()) } else { None })
    }

    /// The keys of a table, or of all tables among which one is chosen.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &str> {
        self.tables().flatten().map(|(key, _)| key.as_str())
    }

    /// Least and greatest number that may be drawn. `None` where it is not a number.
    pub(crate) fn range(&self) -> Option<[f64; 2]> {
        let name_value = |value: &Value| match value {
            Value::Float(number) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            _ => None,
        };
        match self {
            Self::Constant(value) => name_value(value).map(|number| [number; 2]),
            Self::Uniform(range) | Self::LogUniform(range) => Some(*range),
            Self::Normal { within, .. } => Some(*within),
            Self::Choice(values, _) => {
                let ranges = values.iter().map(Self::range).collect::<Option<Vec<[f64; 2]>>>()?;
                let ends = |all: [f64; 2], one: &[f64; 2]| [all[0].min(one[0]), all[1].max(one[1])];
                Some(ranges.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends))
            }
            _ => None,
        }
    }
}

/// A unit vector within an angle [deg] of +Z, uniform on the sphere.
pub(crate) fn direction(name: &str, source: &RandomSource, half_angle_deg: f64) -> [f64; 3] {
    let around = std::f64::consts::TAU * source.uniform(&format!("{name}.around"));
    let least = libm::cos(half_angle_deg.to_radians());
    let z = 1.0 - source.uniform(&format!("{name}.height")) * (1.0 - least);
    let across = (1.0 - z * z).max(0.0).sqrt();
    [across * libm::cos(around), across * libm::sin(around), z]
}

/// A unit quaternion (w, x, y, z), uniform over all rotations (Shoemake 1992).
fn rotation(name: &str, source: &RandomSource) -> [f64; 4] {
    let [a, b, c] = [0, 1, 2].map(|part| source.uniform(&format!("{name}.{part}")));
    let [b, c] = [b, c].map(|share| std::f64::consts::TAU * share);
    let [p, q] = [(1.0 - a).sqrt(), a.sqrt()];
    [q * libm::cos(c), p * libm::sin(b), p * libm::cos(b), q * libm::sin(c)]
}

/// Share of a normal distribution below a number of standard deviations.
pub(super) fn normal_share(deviations: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::random::{CubeSampling, RandomPlan, RandomStream};

    #[test]
    fn directions_and_rotations_have_unit_length_and_no_favourite() {
        let plan = RandomPlan { seed: 1, sampling: CubeSampling::Random, counts: [1; 2], names: Default::default() };
        let mut mean = [0.0; 3];
        for number in 0..2000 {
            let source = plan.source(RandomStream::Image, number, 0);
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
