//! Formats numbers for CSV files.

/// Nine significant digits, which distinguish any two f32. Long numbers use scientific notation.
pub(super) fn nine_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-5..9).contains(&exponent) {
        format!("{value:.*}", (8 - exponent).max(0) as usize)
    } else {
        format!("{value:.8e}")
    }
}

#[cfg(test)]
mod tests {
    use super::nine_digits;

    #[test]
    fn numbers_have_nine_significant_digits() {
        assert_eq!(nine_digits(54.933_461_23), "54.9334612");
        assert_eq!(nine_digits(0.000_123_456_789_12), "0.000123456789");
        assert_eq!(nine_digits(1.5e-30), "1.50000000e-30");
        assert_eq!(nine_digits(0.0), "0");
    }
}
