//! The hazard check finds nothing in complete frames, and something if any barrier is missing.

use isotherm::internals;
use isotherm::internals::{
    Curve, Distance, Frame, HeatOf, LightBy, ListEntry, RadianceVariant, Recipe, RowOf, Sampled, StepKind, StepRange,
    SubFrame, ThermalVariant, TriangleRun, Wanted, compose,
};

use super::hazard::{HazardKind, barrier_count, derive, hazards, unread_by_host, without_barrier};

fn variant(kind: StepKind, both_sides: bool) -> ThermalVariant {
    ThermalVariant { both_sides, sun: true, planet_ir: true, albedo: true, ..ThermalVariant::bare(kind, Curve::Power) }
}

fn range(kind: StepKind, both_sides: bool, groups: (u32, u32)) -> StepRange {
    StepRange { variant: variant(kind, both_sides), groups, joint: 0 }
}

/// A plate by itself, and one over a structure.
const PLATE: StepKind = StepKind::Radiative { over: false, fast: false };
const OVER: StepKind = StepKind::Radiative { over: true, fast: true };

/// Scenes with one kind of node and with several.
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
            lit_by_rays(range(StepKind::Merge, false, (0, 64))),
            lit_by_rays(range(StepKind::Absorb, true, (64, 128))),
        ],
        vec![range(PLATE, false, (0, 64))],
        vec![range(OVER, true, (0, 64))],
        vec![
            range(StepKind::Merge, false, (0, 64)),
            range(PLATE, true, (64, 128)),
            lit_by_rays(range(OVER, false, (128, 192))),
        ],
    ]
}

fn lit_by_rays(range: StepRange) -> StepRange {
    StepRange { variant: ThermalVariant { light: LightBy::Rays, ..range.variant }, ..range }
}

const DRAWN: Wanted = Wanted {
    image: true,
    sampled: None,
    cull: 100,
    temperatures: true,
    shows: RadianceVariant::PLAIN,
    texels: 0,
    sub_frame: None,
};

/// An image that is simply drawn.
pub const ONE: Sampled = Sampled {
    lens: false,
    mean: None,
    gathered: 1,
    shutter: None,
    rows: 60,
    distance: Distance::Near,
    fine: false,
    exposed: false,
};

fn wanted() -> Vec<Wanted> {
    let mut all = Vec::new();
    for (image, cull) in [(false, 0), (true, 0), (true, 100), (true, 5_000_000)] {
        all.extend([false, true].map(|temperatures| Wanted { image, cull, temperatures, ..Wanted::default() }));
    }
    for (mean, lens, shutter, cull) in [
        (None, true, None, 100),
        (Some(1), false, None, 0),
        (Some(4), false, None, 100),
        (Some(4), true, Some(RowOf::Brown), 100),
        (None, false, Some(RowOf::Pinhole), 100),
    ] {
        let sampled = Some(Sampled { lens, mean, shutter, ..ONE });
        all.push(Wanted { image: true, sampled, cull, ..Wanted::default() });
    }
    for shutter in [None, Some(RowOf::Pinhole)] {
        let sampled = Some(Sampled { gathered: 4, shutter, ..ONE });
        all.push(Wanted { image: true, sampled, cull: 100, ..Wanted::default() });
    }
    for distance in [Distance::MayBeFar, Distance::Far] {
        let sampled = Some(Sampled { distance, ..ONE });
        all.push(Wanted { image: true, sampled, cull: 100, ..Wanted::default() });
    }
    for (number, mean) in [(0, None), (1, Some(1)), (2, None), (2, Some(1))] {
        let sub_frame = Some(SubFrame { number, count: 3 });
        // A sensor waits for the texels of the last one.
        let fine = mean.is_some() && number < 2;
        let sampled = Some(Sampled { mean, fine, exposed: true, ..ONE });
        all.push(Wanted { image: true, sampled, sub_frame, cull: 100, ..Wanted::default() });
    }
    // Everything that an image may show.
    let shows = RadianceVariant {
        reflections: true,
        rough: true,
        smooth: true,
        traced: true,
        dispatches: 3,
        sun: true,
        apart: true,
        background: true,
        tables: true,
        map: true,
        crinkled: true,
    };
    all.push(Wanted { shows, texels: 3_000_000, ..DRAWN });
    let far = Some(Sampled { distance: Distance::Far, ..ONE });
    all.push(Wanted { shows, texels: 100, sampled: far, ..DRAWN });
    let sampled = Some(Sampled { mean: Some(4), ..ONE });
    all.push(Wanted { shows: RadianceVariant { apart: false, ..shows }, texels: 100, sampled, ..DRAWN });
    let sampled = Some(Sampled { gathered: 4, ..ONE });
    all.push(Wanted { shows: RadianceVariant { apart: false, ..shows }, texels: 100, sampled, ..DRAWN });
    all
}

/// The ranges for many steps in a dispatch.
fn fused(ranges: &[StepRange]) -> Vec<StepRange> {
    let variant = |variant: ThermalVariant| variant.fused().unwrap_or(variant);
    ranges.iter().map(|range| StepRange { variant: variant(range.variant), ..*range }).collect()
}

/// The passes that sum the absorbed heat of sections.
pub fn absorbed_heat(sections: &[(HeatOf, (u32, u32))]) -> Frame {
    compose(&Recipe { heat: (sections.to_vec(), 0.0), ..Recipe::default() })
}

/// Where the absorbed heat of ranges is found, with a run of nodes for each.
fn heat(ranges: &[StepRange]) -> Vec<(HeatOf, (u32, u32))> {
    let of = |range: &StepRange| match range.variant.kind {
        StepKind::Instant => HeatOf::Balance,
        StepKind::Absorb => HeatOf::Flux,
        _ => HeatOf::Target,
    };
    let mut found: Vec<HeatOf> = ranges.iter().map(of).collect();
    found.sort_unstable();
    found.dedup();
    (0..).zip(found).map(|(number, of)| (of, (number, number + 1))).collect()
}

/// Every frame that a run submits: settling, steps, many steps at once, and an image of the current state.
fn frames(ranges: &[StepRange]) -> Vec<Frame> {
    let mut frames = vec![Frame::settle(ranges), Frame::step(&fused(ranges), Wanted::default())];
    let summed = absorbed_heat(&heat(ranges));
    frames.push(Frame::step(ranges, Wanted::default()).then(summed.clone()).then(Frame::step(&[], DRAWN)));
    frames.push(summed);
    frames.extend(wanted().into_iter().map(|wanted| Frame::step(ranges, wanted)));
    frames.extend(wanted().into_iter().map(|wanted| Frame::step(&[], wanted)));
    frames.push(Frame::keep().then(Frame::step(ranges, Wanted { temperatures: true, ..Wanted::default() })));
    frames.extend(wanted().into_iter().filter(|wanted| wanted.image).map(|wanted| between(ranges, wanted)));
    frames
}

/// An image between two steps.
fn between(ranges: &[StepRange], wanted: Wanted) -> Frame {
    Frame::between(ranges, wanted, &[TriangleRun { joint: 0, triangles: (0, wanted.cull) }])
}

#[test]
fn any_two_frames_in_a_row_have_all_their_barriers() {
    for ranges in scenes() {
        let settle = Frame::settle(&ranges);
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
        let settle = Frame::settle(&ranges);
        for (number, whole) in frames(&ranges).iter().enumerate() {
            for n in 0..barrier_count(whole) {
                let broken = without_barrier(whole, n);
                assert_eq!(barrier_count(&broken) + 1, barrier_count(whole));
                let missed = frames(&ranges).iter().any(|before| {
                    let sequence = [&settle, before, &broken, &broken];
                    // Only the barrier to the host orders the host's reads.
                    !hazards(sequence).is_empty() || !unread_by_host([&broken]).is_empty()
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
        .filter_map(|entry| if let ListEntry::Barriers(barriers) = entry { Some(barriers) } else { None })
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

/// A row of lists has no hazard, and the host sees its data. Without any one barrier from list `first` on (removed
/// wherever it occurs), this must fail.
pub fn each_barrier_is_needed(row: &[Frame], first: usize) {
    assert_eq!(hazards(row), []);
    assert!(unread_by_host(row).is_empty());
    for list in &row[first..] {
        for n in 0..barrier_count(list) {
            let missed = (0..row.len()).filter(|place| row[*place] == *list).any(|place| {
                let mut broken = row.to_vec();
                broken[place] = without_barrier(list, n);
                unread_by_host(&broken[..=place]) != unread_by_host(&row[..=place]) || !hazards(&broken).is_empty()
            });
            assert!(missed, "without barrier {n} of\n{list}");
        }
    }
}

#[test]
fn what_is_submitted_once_has_all_its_barriers() {
    let ranges = &scenes()[3];
    let drawn = DRAWN;
    let settle = Frame::settle(ranges);
    let (bare, step) = (Frame::step(ranges, Wanted::default()), Frame::step(ranges, drawn));
    // A frame's barriers also cover uploads to the state, which settling copies to.
    let uploaded = [
        &internals::MATERIALS,
        &internals::GROUP_MATERIAL,
        &internals::GROUP_PART,
        &internals::LIT_X,
        &internals::POSITION_X,
        &internals::TRIANGLES,
        &internals::DRAWS,
        &internals::BAND_TABLE,
        &internals::TEMPERATURE,
    ];
    for resource in uploaded {
        let row = [internals::upload(resource), settle.clone(), step.clone()];
        assert_eq!(hazards(&row), []);
        let broken = [without_barrier(&row[0], 0), settle.clone(), step.clone()];
        assert!(!hazards(&broken).is_empty(), "{resource:?}");
    }
    each_barrier_is_needed(&[settle, bare, internals::download(&internals::TEMPERATURE)], 2);
    let curve = Curve::Shaped { fourth_power: false };
    let response = internals::respond_list(StepKind::Merge, curve, 4);
    each_barrier_is_needed(&[internals::upload(&internals::TARGET), response.clone(), response.clone(), response], 0);
    for converted in [internals::radiances(3), internals::brightnesses(3)] {
        each_barrier_is_needed(&[internals::upload(&internals::BAND_TABLE), converted], 0);
    }
    each_barrier_is_needed(&[internals::filled(), internals::copied(), internals::copied()], 0);
    each_barrier_is_needed(&[internals::dispatched(3), internals::dispatched(3)], 0);
}

/// Barriers that follow from the accesses alone also suffice, and there are about as many.
#[test]
fn barriers_that_follow_from_the_accesses_suffice() {
    let (mut by_hand, mut derived) = (0, 0);
    let mut judge = |row: &[Frame]| {
        let made = derive(row);
        assert_eq!(hazards(&made), []);
        assert!(unread_by_host(&made).is_empty());
        // The first frames follow nothing.
        by_hand += row.iter().skip(2).map(barrier_count).sum::<usize>();
        derived += made.iter().skip(2).map(barrier_count).sum::<usize>();
    };
    crate::one_pass::runs_of_all_shapes().iter().for_each(|run| judge(run));
    for ranges in scenes() {
        let all = frames(&ranges);
        for (number, one) in all.iter().enumerate() {
            let other = &all[(number * 7 + 3) % all.len()];
            judge(&[one.clone(), other.clone(), one.clone(), other.clone(), one.clone()]);
        }
    }
    println!("{by_hand} barriers by hand, {derived} derived");
    assert!(derived < by_hand + by_hand / 20, "{by_hand} barriers by hand, {derived} derived");
}

/// Every ordering of device work is in a list. Only the recorder makes Vulkan barriers, and only from lists.
#[test]
fn all_barriers_are_recorded_from_lists() {
    let mut folders = vec![std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder of src") {
            let path = entry.expect("an entry of src").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).expect("a file of src");
                let words = ["cmd_pipeline_barrier", "MemoryBarrier2", "cmd_set_event", "cmd_wait_events"];
                found.extend(words.iter().any(|word| text.contains(word)).then_some(path));
            }
        }
    }
    let names: Vec<_> = found.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    assert_eq!(names, ["record.rs"]);
}
