//! The hard cases at small size on the device and in f64: each error is within its limit with the remedy, and beyond it
//! without.

use std::sync::LazyLock;

use isotherm::internals::{CaseScale, HardCase, HardRow};
use isotherm::{Target, internals};

use super::device::context;

static CASES: LazyLock<(Vec<HardCase>, Vec<f64>)> = LazyLock::new(|| {
    let cases = internals::all_hard_cases();
    let without = internals::without(&cases, CaseScale::Small);
    (cases, without)
});

/// Names of cases that miss their limit everywhere.
const MISSES: [&str; 0] = [];

fn check(target: &Target) {
    let (cases, without) = &*CASES;
    let rows = internals::measure_hard_case(target, cases, without, CaseScale::Small, &|_| {});
    for row in &rows {
        let (found, limit) = (row.error.map(|error| row.in_unit(error)), row.in_unit(row.limit));
        println!("{}: {found:?}, limit {limit}, without {} ({:.1} s)", row.name, row.in_unit(row.without), row.wall_s);
    }
    let missed: Vec<String> = rows.iter().filter_map(HardRow::miss).collect();
    let known = |miss: &&String| MISSES.iter().any(|name| miss.starts_with(&format!("{name}:")));
    let unknown: Vec<&String> = missed.iter().filter(|miss| !known(miss)).collect();
    assert!(unknown.is_empty(), "{unknown:#?}");
    assert_eq!(missed.len(), MISSES.len(), "what is known to miss has changed: {missed:#?}");
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_device_holds_every_limit() {
    check(&Target::Device(context()));
}

#[test]
#[ignore = "long: tools/test --all"]
fn the_reference_holds_every_limit() {
    check(&Target::Reference);
}

#[test]
fn without_its_remedy_every_case_misses() {
    let (cases, without) = &*CASES;
    for (case, without) in cases.iter().zip(without) {
        assert!(*without > case.limit, "{}: {without} {} without, limit {}", case.name, case.unit, case.limit);
    }
}
