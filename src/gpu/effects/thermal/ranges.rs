//! The ranges of nodes, each with the smallest variant that a step needs.

use crate::environment::StepLoad;
use crate::gpu::effects::thermal::variant::{StepKind, StepRange, ThermalVariant};

/// The ranges as they are where surfaces do not see each other.
pub(crate) fn without_exchange(mut ranges: Vec<StepRange>) -> Vec<StepRange> {
    ranges.iter_mut().for_each(|range| range.variant.exchange = false);
    ranges
}

/// The ranges with the smallest variants for a load.
pub(crate) fn ranges_of_load(ranges: &[StepRange], load: &StepLoad) -> Vec<StepRange> {
    ranges_of_step(ranges, !load.sun.is_empty(), load.albedo.is_some())
}

/// The ranges for an unchanged load: immediate responses are left out and transitions continue.
pub(crate) fn idle(ranges: &[StepRange]) -> Vec<StepRange> {
    let moving = ranges.iter().filter(|range| range.variant.kind.has_state());
    moving.map(|range| StepRange { variant: range.variant.idle(), ..*range }).collect()
}

/// The ranges with the smallest variants for a step with these kinds of light.
pub(crate) fn ranges_of_step(ranges: &[StepRange], has_sun: bool, has_albedo: bool) -> Vec<StepRange> {
    ranges.iter().map(|range| StepRange { variant: range.variant.for_step(has_sun, has_albedo), ..*range }).collect()
}

/// The ranges with fused variants. A range without a state keeps its variant, because only its last step counts.
pub(crate) fn fused(ranges: &[StepRange]) -> Vec<StepRange> {
    let variant = |variant: ThermalVariant| variant.fused().unwrap_or(variant);
    ranges.iter().map(|range| StepRange { variant: variant(range.variant), ..*range }).collect()
}

/// Whether a kind of range belongs to a network.
pub(crate) fn is_of_network(kind: StepKind) -> bool {
    kind == StepKind::Absorb
}
