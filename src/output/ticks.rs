//! Round marks along a scale, and their labels.

/// Marks at multiples of 1, 2 or 5 times a power of ten, all inside `[lower, upper]`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ticks {
    /// Distance between marks.
    pub(crate) step: f64,
    /// The marks in ascending order.
    pub(crate) values: Vec<f64>,
}

/// At most `most` round marks in a range. `most` is 2 or more. An empty or infinite range has none.
pub(crate) fn ticks(lower: f64, upper: f64, most: usize) -> Ticks {
    let span = upper - lower;
    if !(span > 0.0 && span.is_finite()) {
        return Ticks { step: 0.0, values: vec![] };
    }
    let step = round_step(span / most.max(2) as f64);
    // The slack of a millionth of a step keeps a mark on the end despite rounding.
    let first = (lower / step - 1e-6).ceil() as i64;
    let last = (upper / step + 1e-6).floor() as i64;
    Ticks { step, values: (first..=last).map(|i| i as f64 * step).collect() }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let decade = 10f64.powi(step.log10().floor() as i32);
    [1.0, 2.0, 5.0].into_iter().map(|m| m * decade).find(|round| *round >= step * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

/// The smallest non-empty range with round ends that contains `[lower, upper]`. Ends are multiples of about a twentieth
/// of the span.
pub(crate) fn round_range(lower: f64, upper: f64) -> [f64; 2] {
    // A single temperature still needs a range: a thousandth of the value, or 1 around zero.
    let margin = if upper > lower { 0.0 } else { (lower.abs() * 1e-3).max(if lower == 0.0 { 0.5 } else { 0.0 }) };
    let (lower, upper) = (lower - margin, upper + margin);
    let step = round_step((upper - lower) / 20.0);
    [(lower / step + 1e-6).floor() * step, (upper / step - 1e-6).ceil() * step]
}

/// The range that contains two ranges.
pub(super) fn union([a, b]: [f32; 2], [c, d]: [f32; 2]) -> [f32; 2] {
    [a.min(c), b.max(d)]
}

/// A number with enough decimals to distinguish neighbours one `step` apart. Very large or small numbers use powers of
/// ten.
pub(crate) fn label(value: f64, step: f64) -> String {
    // Rounding of i * step may miss zero.
    let value = if value.abs() < step.abs() * 1e-6 { 0.0 } else { value };
    let size = value.abs().max(step.abs());
    if size != 0.0 && !(1e-3..1e6).contains(&size) {
        let digits = if value == 0.0 { 0 } else { (value.abs() / step.abs()).log10().max(0.0).ceil() as usize };
        let text = format!("{value:.digits$e}");
        return match text.split_once('e') {
            Some((mantissa, exponent)) if mantissa.contains('.') => {
                format!("{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
            }
            _ => text,
        };
    }
    let decimals = if step == 0.0 { 0 } else { (-(step.abs().log10() + 1e-9).floor()).max(0.0) as usize };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_inside() {
        assert_eq!(ticks(153.0, 391.0, 6).values, [200.0, 250.0, 300.0, 350.0]);
        assert_eq!(ticks(0.0, 1.0, 5).values.len(), 6);
        assert_eq!(ticks(-0.3, 0.3, 6).step, 0.1);
        assert_eq!(ticks(2.7, 2.8, 4).step, 0.05);
        for bad in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(ticks(bad.0, bad.1, 5).values.is_empty());
        }
    }

    #[test]
    fn a_range_is_widened_to_round_ends_but_never_narrowed() {
        assert_eq!(round_range(153.2, 391.4), [140.0, 400.0]);
        assert_eq!(round_range(160.0, 400.0), [160.0, 400.0]);
        for (lower, upper) in [(2.7, 2.7), (0.0, 0.0), (-3.0, 12.4), (1e-9, 3e-9), (299.99, 300.01)] {
            let [a, b] = round_range(lower, upper);
            assert!(a <= lower + 1e-12 && upper <= b + 1e-12 && a < b, "{lower} {upper} -> {a} {b}");
        }
    }

    #[test]
    fn numbers_have_the_decimals_they_need() {
        let cases = [
            (250.0, 50.0, "250"),
            (0.30000000000000004, 0.1, "0.3"),
            (-1e-17, 0.1, "0.0"),
            (2.75, 0.05, "2.75"),
            (3e-9, 1e-9, "3e-9"),
            (2.5e7, 5e6, "2.5e7"),
        ];
        for (value, step, expected) in cases {
            assert_eq!(label(value, step), expected);
        }
    }
}
