//! Values at the ends of distributions. A scene must accept them, however rarely they are drawn.

use toml::Value;

use super::distribution::Distribution;

/// Number of the corners of some values that reach each of their ends and choices.
pub(crate) fn corners<'a>(drawn: impl IntoIterator<Item = &'a Distribution>) -> usize {
    fn of(drawn: &Distribution) -> usize {
        match drawn {
            Distribution::Constant(_) => 1,
            Distribution::Choice(values, _) => values.len() * values.iter().map(of).max().unwrap_or(1),
            Distribution::List(items) => items.iter().map(of).max().unwrap_or(1),
            Distribution::Table(values) => values.iter().map(|(_, value)| of(value)).max().unwrap_or(1),
            _ => 2,
        }
    }
    drawn.into_iter().map(of).fold(2, usize::max)
}

/// A corner: the least values of all distributions, then their greatest, in turn. Choices take one value after the other, and then each value with its next corner.
pub(crate) fn corner(drawn: &Distribution, number: usize) -> Value {
    match drawn {
        Distribution::Constant(value) => value.clone(),
        Distribution::Uniform(ends) | Distribution::LogUniform(ends) | Distribution::Normal { within: ends, .. } => {
            Value::Float(ends[number % 2])
        }
        Distribution::Choice(values, _) => corner(&values[number % values.len()], number / values.len()),
        Distribution::Direction => Value::Array([0.0, 0.0, 1.0].map(Value::Float).to_vec()),
        Distribution::Rotation => Value::Array([1.0, 0.0, 0.0, 0.0].map(Value::Float).to_vec()),
        Distribution::List(items) => Value::Array(items.iter().map(|item| corner(item, number)).collect()),
        Distribution::Table(values) => {
            Value::Table(values.iter().map(|(key, value)| (key.clone(), corner(value, number))).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_reach_both_ends_and_each_choice() {
        let choice = Distribution::Choice(
            (1..=3).map(|number| Distribution::Constant(Value::Integer(number))).collect(),
            vec![1.0; 3],
        );
        let table =
            Distribution::Table(vec![("a".to_owned(), Distribution::Uniform([-1.0, 2.0])), ("b".to_owned(), choice)]);
        assert_eq!(corners([&table]), 3);
        let shown = |number| corner(&table, number).to_string();
        assert_eq!([0, 1, 2].map(shown), ["{ a = -1.0, b = 1 }", "{ a = 2.0, b = 2 }", "{ a = -1.0, b = 3 }"]);
        assert_eq!(corners([&Distribution::Direction]), 2);
        // Among tables, each reaches both ends of its own values.
        let among = Distribution::Choice(vec![Distribution::Constant(Value::Integer(7)), table], vec![1.0; 2]);
        assert_eq!(corners([&among]), 6);
        let shown: Vec<String> = (0..6).map(|number| corner(&among, number).to_string()).collect();
        assert_eq!(shown[1..], ["{ a = -1.0, b = 1 }", "7", "{ a = 2.0, b = 2 }", "7", "{ a = -1.0, b = 3 }"]);
    }
}
