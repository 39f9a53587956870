//! What a check found, and how hard the checks look.

use std::fmt;

/// Most names that one finding lists.
const MOST_NAMES: usize = 4;

/// How much is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Most images for which the place of the craft in the image is computed.
    pub images: usize,
    /// Most images for which the camera may be found inside the craft.
    pub inside: usize,
    /// The time of the only image [s], in place of those that the scene states.
    pub at: Option<f64>,
}

impl Effort {
    /// At the start of a run.
    pub const BRIEF: Self = Self { images: 32, inside: 2, at: None };
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
    /// What is found.
    pub message: String,
    /// What to do.
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
