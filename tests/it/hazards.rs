//! The hazard check finds nothing in the frames as they are, and something wherever a barrier is taken away.

use isotherm::environment::shadow::Method;
use isotherm::gpu::frame::{Frame, StepRange, Wanted};
use isotherm::gpu::hazard::{HazardKind, hazards};
use isotherm::gpu::pass::Entry;
use isotherm::gpu::variant::{Curve, StepKind, ThermalVariant};

fn variant(kind: StepKind, both_sides: bool) -> ThermalVariant {
    ThermalVariant {
        kind,
        curve: Curve::Power,
        both_sides,
        sun: true,
        planet_ir: true,
        albedo: true,
        shadow: false,
        fused: false,
    }
}

fn range(kind: StepKind, both_sides: bool, groups: (u32, u32)) -> StepRange {
    StepRange { variant: variant(kind, both_sides), groups, joint: 0 }
}

/// Scenes of one kind of node, and of several.
fn scenes() -> Vec<Vec<StepRange>> {
    vec![
        vec![range(StepKind::Merge, false, (0, 64))],
        vec![range(StepKind::Instant, false, (0, 64))],
        vec![
            range(StepKind::Instant, false, (0, 64)),
            range(StepKind::Merge, false, (64, 192)),
            range(StepKind::Merge, true, (192, 256)),
            range(StepKind::Restart, false, (256, 320)),
        ],
        vec![
            with_shadow(range(StepKind::Merge, false, (0, 64))),
            with_shadow(range(StepKind::Absorb, true, (64, 128))),
        ],
    ]
}

fn with_shadow(range: StepRange) -> StepRange {
    StepRange { variant: ThermalVariant { shadow: true, ..range.variant }, ..range }
}

fn wanted() -> Vec<Wanted> {
    let mut all = Vec::new();
    for (image, cull) in [(false, 0), (true, 0), (true, 100), (true, 5_000_000)] {
        all.extend([false, true].map(|temperatures| Wanted { image, cull, temperatures }));
    }
    all
}

/// The ranges as they are moved by many ticks in a dispatch.
fn fused(ranges: &[StepRange]) -> Vec<StepRange> {
    let variant = |variant: ThermalVariant| variant.fused().unwrap_or(variant);
    ranges.iter().map(|range| StepRange { variant: variant(range.variant), ..*range }).collect()
}

/// Every frame that a run of a scene submits: settling, ticks, many of them at once, and a picture of the state as it is.
fn frames(ranges: &[StepRange]) -> Vec<Frame> {
    let mut frames = vec![Frame::settle(ranges), Frame::step(&fused(ranges), Wanted::default())];
    for method in [Method::Depth, Method::Exact] {
        let shadows = Frame::shadows(ranges, method);
        if shadows.entries.is_empty() {
            continue;
        }
        frames.push(shadows.clone().then(Frame::settle(ranges)));
        let drawn = Wanted { image: true, cull: 100, temperatures: true };
        frames.push(shadows.then(Frame::step(ranges, drawn)));
    }
    frames.extend(wanted().into_iter().map(|wanted| Frame::step(ranges, wanted)));
    frames.extend(wanted().into_iter().map(|wanted| Frame::step(&[], wanted)));
    frames
}

#[test]
fn any_two_frames_in_a_row_have_all_their_barriers() {
    for ranges in scenes() {
        // A run begins with the shadows of its first load.
        let settle = Frame::shadows(&ranges, Method::Depth).then(Frame::settle(&ranges));
        for first in frames(&ranges) {
            for second in frames(&ranges) {
                let found = hazards([&settle, &first, &second]);
                assert!(found.is_empty(), "{}\n---\n{first}---\n{second}", found[0]);
            }
        }
    }
}

#[test]
fn each_barrier_that_is_taken_away_is_missed() {
    for ranges in scenes() {
        // A run begins with the shadows of its first load.
        let settle = Frame::shadows(&ranges, Method::Depth).then(Frame::settle(&ranges));
        for (number, whole) in frames(&ranges).iter().enumerate() {
            for n in 0..whole.barrier_count() {
                let broken = whole.without_barrier(n);
                assert_eq!(broken.barrier_count() + 1, whole.barrier_count());
                let missed = frames(&ranges).iter().any(|before| {
                    let sequence = [&settle, before, &broken, &broken];
                    // What the host reads is ordered by the barrier to the host alone.
                    !hazards(sequence).is_empty() || !isotherm::gpu::hazard::unread_by_host([&broken]).is_empty()
                });
                assert!(missed, "frame {number} without barrier {n} of {}", describe(whole, n));
            }
        }
    }
}

fn describe(frame: &Frame, n: usize) -> String {
    let all: Vec<String> = frame
        .entries
        .iter()
        .filter_map(|entry| if let Entry::Barriers(barriers) = entry { Some(barriers) } else { None })
        .flatten()
        .map(|barrier| format!("{barrier:?}"))
        .collect();
    all[n].clone()
}

#[test]
fn two_dispatches_on_the_same_nodes_collide() {
    let overlapping = [range(StepKind::Merge, false, (0, 128)), range(StepKind::Merge, true, (64, 192))];
    let found = hazards([&Frame::step(&overlapping, Wanted::default())]);
    assert!(found.iter().any(|hazard| hazard.kind == HazardKind::WriteAfterWrite), "{found:?}");
}
