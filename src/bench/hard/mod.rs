//! The hard cases, each with its limit, its remedy, and what is measured where the remedy is taken away.
//!
//! [`transitions`], [`networks`], [`environment`] and [`input`] list the cases; [`stepper`] is a network on whichever target,
//! [`exact`] and [`plain`] are what they are held against: closed forms, and the small code that has no remedies.

use std::time::Instant;

use rayon::prelude::*;

use super::run::Target;

pub mod environment;
pub mod exact;
pub mod input;
pub mod networks;
pub mod plain;
pub mod record;
pub mod stepper;
pub mod transitions;

pub use record::HardRow;

/// How long the cases are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scale {
    /// For tests.
    Small,
    /// For `--quick`: an orbit where the whole is a day.
    Quick,
    /// Everything: a day is a day.
    Whole,
}

impl Scale {
    /// One of three values.
    pub fn of<T>(self, small: T, quick: T, whole: T) -> T {
        match self {
            Self::Small => small,
            Self::Quick => quick,
            Self::Whole => whole,
        }
    }
}

/// What a target is asked for: the largest error, in the unit of the case, or why there is none.
pub type Measure = Box<dyn Fn(&Target, Scale) -> Result<f64, String> + Send + Sync>;
/// The same without the remedy, by small code on the processor.
pub type Without = Box<dyn Fn(Scale) -> f64 + Send + Sync>;

/// A hard case.
pub struct Case {
    /// Name, which no other case has.
    pub name: String,
    /// What is done, and what is expected.
    pub what: String,
    /// Unit of error and limit.
    pub unit: &'static str,
    /// Largest error that is allowed.
    pub limit: f64,
    /// Who says so.
    pub source: String,
    /// What keeps the error below it.
    pub remedy: &'static str,
    /// What is done in its place where it is taken away.
    pub removed: &'static str,
    /// Whether what is expected comes from the f64 reference, which then has no error of its own to show.
    pub expects_reference: bool,
    /// Measures the error on a target.
    pub measure: Measure,
    /// Measures it without the remedy; infinite where no number comes out.
    pub without: Without,
}

/// All cases in the order of the issue.
pub fn all() -> Vec<Case> {
    let mut cases = transitions::cases();
    cases.extend(networks::cases());
    cases.extend(environment::cases());
    cases.extend(input::cases());
    cases
}

/// The errors of all cases without their remedies, in the order of the cases: they are those of every target.
pub fn without(cases: &[Case], scale: Scale) -> Vec<f64> {
    cases.par_iter().map(|case| (case.without)(scale)).collect()
}

/// Measures every case on a target; `says` hears its name beforehand.
pub fn measure(target: &Target, cases: &[Case], without: &[f64], scale: Scale, says: &dyn Fn(&str)) -> Vec<HardRow> {
    let one = |(case, without): (&Case, &f64)| {
        says(&case.name);
        let began = Instant::now();
        let found = match target {
            Target::Reference if case.expects_reference => None,
            _ => Some((case.measure)(target, scale)),
        };
        let mut row = HardRow::of(case, *without);
        match found {
            None => row.omitted = Some("the f64 reference is what is expected".to_owned()),
            Some(Ok(error)) => {
                row.error = Some(error);
                row.holds = Some(error <= case.limit);
            }
            Some(Err(reason)) => {
                row.failed = Some(reason);
                row.holds = Some(false);
            }
        }
        row.wall_s = began.elapsed().as_secs_f64();
        row
    };
    cases.iter().zip(without).map(one).collect()
}

/// Largest difference of two series; infinite where one holds no number or they differ in length.
pub(crate) fn apart(found: &[f64], expected: &[f64]) -> f64 {
    if found.len() != expected.len() {
        return f64::INFINITY;
    }
    found.iter().zip(expected).fold(0.0, |worst, (a, b)| worst_of(worst, (a - b).abs()))
}

/// The larger of two errors; infinite where one is not a number.
pub(crate) fn worst_of(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) }
}
