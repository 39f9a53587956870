//! Which orbits are for training, validation and tests. All images of an orbit have the same purpose, so nothing leaks between them.

use super::random::Stream;
use super::spec::Spec;
use crate::labels::image::Split;

/// What the images of an orbit are for. The numbers of orbits are those of the shares, rounded.
pub fn split_of(spec: &Spec, orbit: u64) -> Split {
    let orbits = spec.orbits();
    let place = spec.plan.place(Stream::Orbit, "split", orbit, orbits) as f64;
    let [train, validation, _] = spec.split.map(|share| share * orbits as f64);
    if place < train.round() {
        Split::Train
    } else if place < (train + validation).round() {
        Split::Validation
    } else {
        Split::Test
    }
}
