//! An axis of a plot: linear or logarithmic, with round marks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::ticks;

/// The description of an axis by the user of [`super::plot::Plot`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Name and unit: `temperature [K]`.
    pub label: String,
    /// Whether the axis is logarithmic. A logarithmic axis leaves out values that are not positive, and the plot says so.
    pub log: bool,
    /// Ends. `None` takes them from the data.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis whose ends come from the data.
    pub fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), log: false, range: None }
    }

    /// A logarithmic axis whose ends come from the data.
    pub fn logarithmic(label: &str) -> Self {
        Self { label: label.to_owned(), log: true, range: None }
    }

    /// Whether the axis can show a value.
    pub(crate) fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }

    /// The scale for these values. `margin` is the extra share of the span at both ends.
    pub(super) fn scale(&self, values: impl Iterator<Item = f64>, margin: f64) -> AxisScale {
        let given = self.range.filter(|[a, b]| a < b && self.shows(*a) && self.shows(*b));
        let range = values.filter(|value| self.shows(*value)).fold(None, |range, value| {
            let [least, greatest] = range.unwrap_or([value, value]);
            Some([f64::min(least, value), f64::max(greatest, value)])
        });
        let widen = |[a, b]: [f64; 2]| {
            // For a single value: a decade on a logarithmic axis, otherwise a thousandth of it, or 1 around zero.
            let half = if self.log { 0.5 } else { (a.abs() * 1e-3).max(f64::from(u8::from(a == 0.0))) };
            let pad = if b > a { margin * (b - a) } else { half };
            [a - pad, b + pad]
        };
        let ends = match (given, range) {
            (Some(range), _) => range,
            (None, Some(range)) if self.log => widen(range.map(f64::log10)).map(|exponent| 10f64.powf(exponent)),
            (None, Some(range)) => widen(range),
            (None, None) if self.log => [1.0, 10.0],
            (None, None) => [0.0, 1.0],
        };
        AxisScale { lower: ends[0], upper: ends[1], log: self.log }
    }
}

/// Maps values to positions between the ends of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisScale {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) log: bool,
}

/// Most marks on an axis.
const MARKS: usize = 9;

impl AxisScale {
    /// Whether each decade has marks of its own.
    fn is_by_decades(&self) -> bool {
        self.log && self.upper.log10() - self.lower.log10() >= 1.5
    }

    fn marks(&self) -> Vec<f64> {
        if !self.is_by_decades() {
            return ticks::ticks(self.lower, self.upper, MARKS).values;
        }
        let [first, last] = [self.lower, self.upper].map(f64::log10);
        let every = ((last - first) / MARKS as f64).ceil().max(1.0) as i32;
        // Two or three decades by themselves leave most of an axis without a number.
        let in_each: &[f64] = if 3.0 * (last - first) <= MARKS as f64 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let decades =
            (first.floor() as i32..=(last + 1e-6).floor() as i32).filter(|decade| decade.rem_euclid(every) == 0);
        let all = decades.flat_map(|decade| in_each.iter().map(move |times| times * 10f64.powi(decade)));
        all.filter(|mark| (first - 1e-6..=last + 1e-6).contains(&mark.log10())).collect()
    }

    /// The value clamped to the ends, for shading that may be cut.
    pub(crate) fn inside(&self, value: f64) -> f64 {
        value.clamp(self.lower, self.upper)
    }
}

impl Ranged for AxisScale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let place = |value: f64| if self.log { value.log10() } else { value };
        let share = (place(*value) - place(self.lower)) / (place(self.upper) - place(self.lower));
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.marks()
    }

    fn range(&self) -> Range<f64> {
        self.lower..self.upper
    }
}

impl ValueFormatter<f64> for AxisScale {
    fn format_ext(&self, value: &f64) -> String {
        let marks = self.marks();
        let step = match marks.as_slice() {
            // These marks always differ.
            _ if self.is_by_decades() => *value,
            [first, second, ..] => second - first,
            _ => self.upper - self.lower,
        };
        ticks::label(*value, step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logarithmic_axis_places_decades_evenly_and_leaves_out_what_is_not_positive() {
        let axis = Axis::logarithmic("error [K]");
        let scale = axis.scale([1e-5, 0.0, -3.0, f64::NAN, 1e-1].into_iter(), 0.0);
        assert!((scale.lower / 1e-5 - 1.0).abs() < 1e-9 && (scale.upper / 1e-1 - 1.0).abs() < 1e-9);
        assert_eq!(scale.marks().len(), 5);
        assert_eq!([scale.map(&1e-3, (0, 400)), scale.map(&1e-2, (0, 400))], [200, 300]);
        assert_eq!(scale.format_ext(&1e-2), "0.01");
        assert_eq!(scale.format_ext(&1e-5), "1e-5");
        let two = axis.scale([0.9, 80.0].into_iter(), 0.0);
        assert_eq!(
            two.marks().iter().map(|mark| two.format_ext(mark)).collect::<Vec<_>>(),
            ["1", "2", "5", "10", "20", "50"]
        );
        let three = axis.scale([0.2, 20.0].into_iter(), 0.0);
        assert_eq!(
            three.marks().iter().map(|mark| three.format_ext(mark)).collect::<Vec<_>>(),
            ["0.2", "0.5", "1", "2", "5", "10", "20"]
        );
        let linear = Axis::linear("").scale([1e-5, 1e-1].into_iter(), 0.0);
        assert_ne!(linear.map(&1e-3, (0, 400)), 200);
    }

    #[test]
    fn ends_are_those_given_or_those_of_the_data_with_a_margin() {
        let mut axis = Axis::linear("");
        assert_eq!(axis.scale([10.0, 20.0].into_iter(), 0.1).range(), 9.0..21.0);
        axis.range = Some([0.0, 5.0]);
        assert_eq!(axis.scale([10.0, 20.0].into_iter(), 0.1).range(), 0.0..5.0);
        axis.range = Some([5.0, 5.0]);
        assert_eq!(axis.scale([10.0, 20.0].into_iter(), 0.0).range(), 10.0..20.0, "an empty range is none");
        for values in [vec![], vec![0.0], vec![300.0], vec![f64::NAN]] {
            let scale = Axis::linear("").scale(values.into_iter(), 0.05);
            assert!(scale.lower < scale.upper && !scale.marks().is_empty());
        }
    }
}
