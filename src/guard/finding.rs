//! A finding of a check, and how much the checks look at.

use std::fmt;

const MOST_NAMES: usize = 4;

/// How much is looked at.
#[derive(Debug, Clone, Copy)]
pub struct CheckEffort {
    /// Most images for which the place of the craft in the image is computed.
    pub(crate) images: usize,
    /// Most images for which the camera may be found inside the craft.
    pub(crate) inside: usize,
    /// The time of the only image [s], in place of the scene's own times.
    pub(crate) at: Option<f64>,
}

impl CheckEffort {
    pub(crate) const BRIEF: Self = Self { images: 32, inside: 2, at: None };
    /// For a caller that has no images of the scene's own camera.
    pub(crate) const NO_IMAGE: Self = Self { images: 0, inside: 0, at: None };
    /// For `isotherm check`.
    pub const WHOLE: Self = Self { images: 10_000, inside: 64, at: None };
}

/// Something that is probably wrong.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Finding {
    /// Which check found it.
    pub check: &'static str,
    /// The key, material or parts that it is about.
    pub about: String,
    /// The probable mistake, in words.
    pub message: String,
    /// Advice, in words.
    pub remedy: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {}: {}", self.about, self.message, self.remedy)
    }
}

/// `part 'a'`, or `parts 'a', 'b' and 3 more`.
pub(super) fn named(kind: &str, names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("'{name}'")).collect();
    match (names.len(), names.len().saturating_sub(MOST_NAMES)) {
        (1, _) => format!("{kind} {}", shown.concat()),
        (_, 0) => format!("{kind}s {}", shown.join(", ")),
        (_, more) => format!("{kind}s {} and {more} more", shown.join(", ")),
    }
}

/// A number with four significant digits, or as many as it has before its point.
pub(crate) fn short(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return value.to_string();
    }
    let before = value.abs().log10().floor();
    if !(-4.0..9.0).contains(&before) {
        return format!("{value:.3e}");
    }
    let digits = (3.0 - before).max(0.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::{named, short};

    #[test]
    fn numbers_keep_four_digits() {
        let texts = [107_899.91, 74.6001, 0.19604, 2.0, 1e-7, 0.0].map(short);
        assert_eq!(texts, ["107900", "74.6", "0.196", "2", "1.000e-7", "0"]);
    }

    #[test]
    fn long_lists_of_names_are_cut() {
        assert_eq!(named("part", &["a"]), "part 'a'");
        assert_eq!(named("part", &["a", "b"]), "parts 'a', 'b'");
        assert_eq!(named("part", &["a", "b", "c", "d", "e"]), "parts 'a', 'b', 'c', 'd' and 1 more");
    }
}
