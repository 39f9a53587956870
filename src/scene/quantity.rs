//! Units and valid ranges of the numbers in a scene file.

use crate::environment::scene_time::LATEST;

/// Unit and range of a number. A number that is not finite is always refused.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quantity {
    /// Unit in messages, empty for a pure number.
    unit: &'static str,
    range: Range,
}

#[derive(Debug, Clone, Copy)]
enum Range {
    Any,
    Positive,
    NonNegative,
    /// The range includes both ends.
    Within(f64, f64),
    /// The range excludes both ends.
    Between(f64, f64),
}

/// The sizes that a number of each unit may have, unless it is 0. These ranges reach from far below to far above the sizes of craft, orbits and
/// materials. Numbers within them, their squares and their usual products lie in the range of an f32. A network on a device checks its conductors
/// once more. A number that is smaller counts as 0 where 0 is allowed.
const SIZES: [(&str, f64, f64); 18] = [
    ("m", 1e-12, 1e13),
    ("m2", 1e-15, 1e15),
    ("s", 1e-9, LATEST),
    ("1/s", 1e-12, 1e12),
    ("m/s", 1e-15, 1e6),
    ("deg", 1e-15, 1e9),
    ("deg/s", 1e-15, 1e6),
    ("K", 1e-9, 1e6),
    ("W", 1e-15, 1e12),
    ("J/K", 1e-12, 1e15),
    ("W/K", 1e-60, 1e60),
    ("W/(m K)", 1e-12, 1e9),
    ("W/(m2 K)", 1e-12, 1e12),
    ("kg/m3", 1e-9, 1e9),
    ("J/(kg K)", 1e-9, 1e9),
    ("pixels", 1e-3, 1e9),
    ("orbits", 1e-9, 1e6),
    ("W/m2", 1e-12, 1e9),
];

impl Quantity {
    pub(super) const fn any(unit: &'static str) -> Self {
        Self { unit, range: Range::Any }
    }

    pub(super) const fn positive(unit: &'static str) -> Self {
        Self { unit, range: Range::Positive }
    }

    pub(super) const fn non_negative(unit: &'static str) -> Self {
        Self { unit, range: Range::NonNegative }
    }

    pub(super) const fn within(lower: f64, upper: f64, unit: &'static str) -> Self {
        Self { unit, range: Range::Within(lower, upper) }
    }

    pub(super) const fn between(lower: f64, upper: f64, unit: &'static str) -> Self {
        Self { unit, range: Range::Between(lower, upper) }
    }

    /// The value if it is valid, 0 for a value that is too small for its unit where 0 is allowed, otherwise a message that states the range.
    pub(super) fn check(&self, value: f64) -> Result<f64, String> {
        if !value.is_finite() {
            return Err(format!("must be a finite number{}, found {value}", self.unit_suffix()));
        }
        let size = SIZES.iter().find(|(unit, ..)| *unit == self.unit);
        if value != 0.0 && self.has_zero() && size.is_some_and(|(_, least, _)| value.abs() < *least) {
            return Ok(0.0);
        }
        let (allowed, rule) = match self.range {
            Range::Any => (true, String::new()),
            Range::Positive => (value > 0.0, "above 0".to_string()),
            Range::NonNegative => (value >= 0.0, "0 or above".to_string()),
            Range::Within(lower, upper) => ((lower..=upper).contains(&value), format!("in [{lower}, {upper}]")),
            Range::Between(lower, upper) => {
                (lower < value && value < upper, format!("between {lower} and {upper}, neither included"))
            }
        };
        if !allowed {
            return Err(format!("must be {rule}{}, found {value}", self.unit_suffix()));
        }
        match size {
            Some((_, least, most)) if value != 0.0 && !(*least..=*most).contains(&value.abs()) => {
                let sign = if matches!(self.range, Range::Any) { ", of either sign" } else { "" };
                let or_zero = if matches!(self.range, Range::Positive) { "" } else { "0 or " };
                let unit = self.unit_suffix();
                Err(format!("must be {or_zero}from {least:e} to {most:e}{sign}{unit}, found {value:e}"))
            }
            _ => Ok(value),
        }
    }

    fn has_zero(&self) -> bool {
        match self.range {
            Range::Any | Range::NonNegative => true,
            Range::Positive => false,
            Range::Within(lower, upper) => lower <= 0.0 && upper >= 0.0,
            Range::Between(lower, upper) => lower < 0.0 && upper > 0.0,
        }
    }

    /// Rising valid values, which stand in for wrong ones.
    pub(super) fn valid<const N: usize>(&self) -> [f64; N] {
        let (lower, upper) = match self.range {
            Range::Any | Range::Positive | Range::NonNegative => (0.0, 2.0),
            Range::Within(lower, upper) | Range::Between(lower, upper) => (lower, upper),
        };
        let (lower, upper) = if lower < 1.0 && upper > 1.0 { (0.0, 2.0_f64.min(upper)) } else { (lower, upper) };
        std::array::from_fn(|place| lower + (upper - lower) * (place + 1) as f64 / (N + 1) as f64)
    }

    /// `a number [m]`, or `a number` without a unit.
    pub(super) fn expected(&self) -> String {
        format!("a number{}", self.unit_suffix())
    }

    fn unit_suffix(&self) -> String {
        if self.unit.is_empty() { String::new() } else { format!(" [{}]", self.unit) }
    }
}

#[cfg(test)]
mod tests {
    use super::Quantity;

    #[test]
    fn ends_of_a_range_belong_to_it_or_not() {
        let share = Quantity::within(0.0, 1.0, "");
        assert_eq!(share.check(1.0), Ok(1.0));
        assert_eq!(share.check(1.0 + f64::EPSILON), Err("must be in [0, 1], found 1.0000000000000002".to_string()));
        let field = Quantity::between(0.0, 180.0, "deg");
        assert_eq!(field.check(179.9), Ok(179.9));
        assert_eq!(field.check(180.0), Err("must be between 0 and 180, neither included [deg], found 180".to_string()));
        assert_eq!(Quantity::non_negative("K").check(0.0), Ok(0.0));
        assert!(Quantity::positive("K").check(0.0).is_err());
    }

    #[test]
    fn a_size_beyond_all_reason_is_refused() {
        let message = Quantity::any("deg").check(1e38);
        assert_eq!(message, Err("must be 0 or from 1e-15 to 1e9, of either sign [deg], found 1e38".to_string()));
        assert_eq!(Quantity::any("deg").check(-7.2e8), Ok(-7.2e8));
        assert_eq!(Quantity::any("deg").check(-0.0), Ok(-0.0));
        let message = Quantity::positive("m").check(5e-324);
        assert_eq!(message, Err("must be from 1e-12 to 1e13 [m], found 5e-324".to_string()));
        assert!(Quantity::non_negative("K").check(1e7).is_err() && Quantity::non_negative("W").check(1e19).is_err());
    }

    /// Issues 29.8 and 31.7: a probe at 6e-17 m and the heat of an exported node.
    #[test]
    fn a_number_too_small_for_its_unit_counts_as_0() {
        for (quantity, value) in [
            (Quantity::any("m"), 6e-17),
            (Quantity::any("W"), -6.7e-16),
            (Quantity::non_negative("W/K"), 1e-61),
            (Quantity::non_negative("K"), -1e-12),
            (Quantity::within(0.0, 1e6, "s"), 1e-12),
        ] {
            assert_eq!(quantity.check(value), Ok(0.0), "{value}");
        }
        assert_eq!(Quantity::any("m").check(1e-12), Ok(1e-12));
        assert!(
            Quantity::within(1e-6, 1e7, "s").check(1e-12).is_err() && Quantity::positive("m").check(6e-17).is_err()
        );
        assert!(Quantity::non_negative("K").check(-1e-6).is_err());
    }

    #[test]
    fn a_number_that_is_not_finite_is_never_allowed() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let message = Quantity::any("s").check(value);
            assert_eq!(message, Err(format!("must be a finite number [s], found {value}")));
        }
    }
}
