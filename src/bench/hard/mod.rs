//! The hard cases: each has a limit, a remedy, and a measurement without the remedy.
//!
//! `case` defines a case. `transitions`, `networks`, `environment` and `input` list them. `way` integrates
//! a network on any target. `exact` has closed-form solutions. `plain` has simple code without remedies.

use std::time::Instant;

use rayon::prelude::*;

use crate::simulation::target::Target;

mod case;
mod environment;
mod exact;
mod input;
mod networks;
mod plain;
mod transitions;
mod way;

pub use case::CaseScale;
pub use case::HardCase;
pub use case::HardRow;

/// All cases.
pub fn all_hard_cases() -> Vec<HardCase> {
    let lists = [
        transitions::cases(),
        vec![networks::massless::no_capacitance()],
        networks::conducting::cases(),
        networks::thermostats::cases(),
        networks::cold::cases(),
        environment::cases(),
        environment::shadow::cases(),
        input::cases(),
    ];
    lists.into_iter().flatten().collect()
}

/// The errors of all cases without their remedies, in order. These errors are the same for every target.
pub fn without(cases: &[HardCase], scale: CaseScale) -> Vec<f64> {
    cases.par_iter().map(|case| (case.without)(scale)).collect()
}

/// Measures every case on a target. `says` gets each name beforehand.
pub fn measure_hard_case(
    target: &Target,
    cases: &[HardCase],
    without: &[f64],
    scale: CaseScale,
    says: &dyn Fn(&str),
) -> Vec<HardRow> {
    let one = |(case, without): (&HardCase, &f64)| {
        says(&case.name);
        let began = Instant::now();
        let error = match target {
            Target::Reference if case.expects_reference => None,
            _ => Some((case.measure)(target, scale)),
        };
        let mut row = HardRow::of(case, *without);
        match error {
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
