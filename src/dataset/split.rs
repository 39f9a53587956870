//! The split of the orbits into training, validation and tests. All images of an orbit have the same purpose, so nothing leaks between them.

use super::random::RandomStream;
use super::spec::Spec;
use crate::labels::image::Split;

/// The use of the images of an orbit. The numbers of orbits follow the shares of the SPEC, rounded.
pub fn split_of(spec: &Spec, orbit: u64) -> Split {
    let place = spec.plan.place(RandomStream::Orbit, "split", orbit, spec.orbits()) as f64;
    let [validation, test] = begins(spec);
    if place < validation {
        Split::Train
    } else if place < test {
        Split::Validation
    } else {
        Split::Test
    }
}

/// The purposes that have a share, but for which there are too few orbits.
pub fn empty_splits(spec: &Spec) -> Vec<Split> {
    let [validation, test] = begins(spec);
    let counts = [validation, test - validation, spec.orbits() as f64 - test];
    let all = Split::ALL.into_iter().zip(counts).zip(spec.split);
    all.filter(|((_, count), share)| *count < 1.0 && *share > 0.0).map(|((split, _), _)| split).collect()
}

/// The places at which validation and tests begin.
fn begins(spec: &Spec) -> [f64; 2] {
    let [train, validation, _] = spec.split.map(|share| share * spec.orbits() as f64);
    [train.round(), (train + validation).round()]
}
