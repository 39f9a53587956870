//! A hard case and its measurement.

use serde::Serialize;

use crate::output::html::{kelvin_text, significant};
use crate::simulation::target::Target;

/// The length of the cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CaseScale {
    /// Short, for tests.
    Small,
    /// Medium, for `--quick`: an orbit instead of a day.
    Quick,
    /// Full length.
    Whole,
}

impl CaseScale {
    /// Selects one of three values.
    pub(crate) fn of<T>(self, small: T, quick: T, whole: T) -> T {
        match self {
            Self::Small => small,
            Self::Quick => quick,
            Self::Whole => whole,
        }
    }
}

/// Measures a target. Returns the largest error in the unit of the case, or the reason why there is none.
pub(crate) type Measure = Box<dyn Fn(&Target, CaseScale) -> Result<f64, String> + Send + Sync>;
/// The same error without the remedy, computed by simple code on the processor.
pub(crate) type Without = Box<dyn Fn(CaseScale) -> f64 + Send + Sync>;

/// A hard case.
pub struct HardCase {
    /// Unique name.
    pub name: String,
    /// Input and expected result.
    pub(crate) what: String,
    /// Unit of error and limit.
    pub unit: &'static str,
    /// Largest allowed error.
    pub limit: f64,
    /// Source of the limit.
    pub(crate) source: String,
    /// The method that keeps the error below the limit.
    pub(crate) remedy: &'static str,
    /// The simpler method that replaces the remedy.
    pub(crate) removed: &'static str,
    /// Whether the expected result comes from the f64 reference. The reference then has no error of its own.
    pub(crate) expects_reference: bool,
    /// Measures the error on a target.
    pub(crate) measure: Measure,
    /// Measures the error without the remedy: infinite if there is no valid number.
    pub(crate) without: Without,
}

impl HardCase {
    /// A case with a limit and its source. The other methods complete it.
    pub(super) fn new(
        name: impl Into<String>,
        what: impl Into<String>,
        unit: &'static str,
        (limit, source): (f64, impl Into<String>),
    ) -> Self {
        Self {
            name: name.into(),
            what: what.into(),
            unit,
            limit,
            source: source.into(),
            remedy: "",
            removed: "",
            expects_reference: false,
            measure: Box::new(|_, _| Err("nothing is measured".to_owned())),
            without: Box::new(|_| f64::INFINITY),
        }
    }

    /// Sets the remedy and its replacement.
    pub(super) fn remedy(self, remedy: &'static str, removed: &'static str) -> Self {
        Self { remedy, removed, ..self }
    }

    /// Sets the measurements with and without the remedy.
    pub(super) fn measured(
        self,
        measure: impl Fn(&Target, CaseScale) -> Result<f64, String> + Send + Sync + 'static,
        without: impl Fn(CaseScale) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self { measure: Box::new(measure), without: Box::new(without), ..self }
    }
}

/// The result of a case on a device.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct HardRow {
    /// Name.
    pub name: String,
    /// Input and expected result.
    pub(crate) what: String,
    /// Unit of errors and limit.
    pub(crate) unit: String,
    /// Largest error.
    pub error: Option<f64>,
    /// Largest allowed error.
    pub limit: f64,
    pub(crate) limit_source: String,
    /// Whether the error is within the limit. `None` if nothing was measured.
    pub(crate) holds: Option<bool>,
    /// The method that keeps the error below the limit.
    pub(crate) remedy: String,
    /// The simpler method that replaces the remedy.
    pub(crate) removed: String,
    /// Error without the remedy, `null` in JSON if there is no valid number.
    pub without: f64,
    /// The reason for an omitted measurement.
    pub(crate) omitted: Option<String>,
    /// The reason for a failed measurement.
    pub(crate) failed: Option<String>,
    /// Wall time of the measurement [s].
    pub wall_s: f64,
}

impl HardRow {
    pub(crate) fn of(case: &HardCase, without: f64) -> Self {
        Self {
            name: case.name.clone(),
            what: case.what.clone(),
            unit: case.unit.to_owned(),
            limit: case.limit,
            limit_source: case.source.clone(),
            remedy: case.remedy.to_owned(),
            removed: case.removed.to_owned(),
            without,
            ..Self::default()
        }
    }

    /// A measured value with its unit.
    pub fn in_unit(&self, value: f64) -> String {
        if !value.is_finite() {
            return "no number".to_owned();
        }
        if self.unit == "K" {
            return kelvin_text(value);
        }
        // Counts need no decimals.
        let figure = if value.fract() == 0.0 && self.unit != "s" { value.to_string() } else { significant(value) };
        format!("{figure} {}", self.unit)
    }

    /// A sentence about a missed limit. `None` if the limit holds.
    pub fn miss(&self) -> Option<String> {
        if self.holds != Some(false) {
            return None;
        }
        let result = match (&self.failed, self.error) {
            (Some(reason), _) => reason.clone(),
            (None, error) => self.in_unit(error.unwrap_or(f64::INFINITY)),
        };
        Some(format!("{}: {result}, limit {}", self.name, self.in_unit(self.limit)))
    }
}

/// Largest difference of two series, infinite if they differ in length or contain NaN.
pub(crate) fn apart(computed: &[f64], expected: &[f64]) -> f64 {
    if computed.len() != expected.len() {
        return f64::INFINITY;
    }
    computed.iter().zip(expected).fold(0.0, |worst, (a, b)| worst_of(worst, (a - b).abs()))
}

/// The larger of two errors, infinite if one is NaN.
pub(crate) fn worst_of(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(error: Option<f64>, failed: Option<&str>) -> HardRow {
        let holds = Some(failed.is_none() && error.is_some_and(|error| error <= 0.02));
        let (name, unit, failed) = ("a case".to_owned(), "K".to_owned(), failed.map(str::to_owned));
        HardRow { name, unit, error, limit: 0.02, holds, failed, without: f64::INFINITY, ..HardRow::default() }
    }

    #[test]
    fn what_misses_says_by_how_much_or_why() {
        assert_eq!(row(Some(0.02), None).miss(), None);
        assert_eq!(row(Some(0.03), None).miss().as_deref(), Some("a case: 30.0 mK, limit 20.0 mK"));
        assert_eq!(row(Some(f64::INFINITY), None).miss().as_deref(), Some("a case: no number, limit 20.0 mK"));
        assert_eq!(row(None, Some("no device")).miss().as_deref(), Some("a case: no device, limit 20.0 mK"));
        let omitted = HardRow { holds: None, omitted: Some("itself".to_owned()), ..row(None, None) };
        assert_eq!(omitted.miss(), None);
    }

    #[test]
    fn counts_are_whole_and_others_have_three_digits() {
        let of = |unit: &str, value| HardRow { unit: unit.to_owned(), ..HardRow::default() }.in_unit(value);
        assert_eq!(of("accepted", 272.0), "272 accepted");
        assert_eq!(of("s", 100.0), "100 s");
        assert_eq!(of("K", 2.0e-4), "200 \u{b5}K");
    }
}
