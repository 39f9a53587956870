//! The validation layer with synchronisation: silent on complete frames, and the missing barriers that it detects.

use std::sync::{Arc, LazyLock};

use glam::DVec3;
use isotherm::internals::{
    AlbedoField, Barrier, Context, Curve, Frame, Function, ListEntry, Optics, PassWork, PlanetLoad, Renderer, Request,
    Retarget, Sides, StepKind, StepLoad, StepRange, ThermalVariant, Wanted, device_view,
};

use super::device::{assert_silent, dark, material, planet, sunlight, transition, validated_context};
use super::hazard::without_barrier;
use super::program::{end, isotherm, refusal};
use super::quads::{Quads, camera, looking};

/// The sheet's triangles.
const TRIANGLES: u32 = 2;
const WANTED: Wanted = Wanted {
    image: true,
    sampled: None,
    cull: TRIANGLES,
    temperatures: true,
    shows: isotherm::internals::RadianceVariant::PLAIN,
    texels: 0,
    sub_frame: None,
};

fn range() -> StepRange {
    let kind = StepKind::Merge;
    let variant = ThermalVariant {
        both_sides: true,
        sun: true,
        planet_ir: true,
        albedo: true,
        ..ThermalVariant::bare(kind, Curve::Power)
    };
    StepRange { variant, groups: (0, 64), joint: 0 }
}

/// A sheet with thermal inertia in front of a camera.
fn sheet(context: &Arc<Context>) -> Renderer {
    let quadratic = (Function::Quadratic, 50.0);
    let sides = Sides::Both { back: Optics { absorptivity: 0.4, emissivity: 0.63 } };
    let mut quads =
        Quads::new(vec![material(0.88, 0.8, sides, transition(quadratic.clone(), quadratic, Retarget::Merge))]);
    quads.variant = range().variant;
    quads.add(Quads::square(DVec3::ZERO, DVec3::X, DVec3::Y, 1.0), 0, 0, |_| 250.0);
    quads.renderer(context, &camera(32, 24, 20.0))
}

/// Sun, planet and albedo.
fn load() -> StepLoad {
    static LOAD: LazyLock<StepLoad> = LazyLock::new(everything);
    LOAD.clone()
}

fn everything() -> StepLoad {
    let (ratio, sun_zenith) = (1.064, 0.5);
    let below = planet(DVec3::Z, DVec3::X, ratio, 237.0, sun_zenith);
    StepLoad {
        sun: sunlight([(DVec3::new(0.6, 0.0, -0.8), 1361.0)]),
        planet: Some(PlanetLoad { albedo_flux: 0.3 * 1361.0, ..below }),
        albedo: AlbedoField::new(ratio).table(sun_zenith),
        ..dark(2.7)
    }
}

/// Submits a frame with the inputs of its passes.
fn submit(renderer: &mut Renderer, frame: &Frame, load: &StepLoad, wanted: Wanted) {
    let pose = looking(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::Y);
    let view = device_view(&camera(32, 24, 20.0), &pose);
    let views = if wanted.image { std::slice::from_ref(&view) } else { &[] };
    let submitted = renderer.submit(Request { views, list: Some(frame), ..Request::step(load, 1.0) });
    let submitted = submitted.expect("the device works");
    renderer.collect(submitted).expect("the device answers");
}

/// A layer that does not speak of a missing barrier is no witness.
#[test]
fn a_mute_layer_is_refused() {
    if validated_context().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let end_with = |filter: &str| {
        let mut command = isotherm(folder.path(), &["radiance", "--band", "8:14", "300"]);
        command.env("ISOTHERM_VALIDATION", "1").env("VK_LAYER_MESSAGE_ID_FILTER", filter);
        refusal(&end(command))
    };
    assert_eq!(end_with(""), (Some(0), String::new()));
    let (code, message) = end_with("SYNC-HAZARD-READ-AFTER-WRITE");
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("its silence means nothing"), "{message}");
}

#[test]
fn whole_frames_are_silent() {
    let Some(context) = validated_context() else { return };
    let load = load();
    {
        let mut renderer = sheet(&context);
        renderer.settle(&load).expect("the device settles");
        let ranges = [range()];
        for (image, temperatures) in [(true, true), (false, true), (true, false), (false, false), (true, true)] {
            let wanted = Wanted { image, cull: TRIANGLES, temperatures, ..Wanted::default() };
            submit(&mut renderer, &Frame::step(&ranges, wanted), &load, wanted);
            submit(&mut renderer, &Frame::step(&[], wanted), &load, wanted);
        }
        // Two frames are in flight, then the first is reused.
        let pose = looking(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::Y);
        let view = device_view(&camera(32, 24, 20.0), &pose);
        let request = Request { views: &[view], ..Request::step(&load, 1.0).and_temperatures() };
        let flying: Vec<_> = (0..2).map(|_| renderer.submit(request).expect("the device steps")).collect();
        for submitted in flying {
            renderer.collect(submitted).expect("the device answers");
        }
        renderer.settle(&load).expect("the device settles again");
    }
    assert_silent(&context);
}

fn barriers(frame: &Frame) -> Vec<Barrier> {
    let of = |entry: &ListEntry| if let ListEntry::Barriers(barriers) = entry { barriers.clone() } else { Vec::new() };
    frame.entries.iter().flat_map(of).collect()
}

/// The layer's messages about a frame after one complete step: identifiers of the first ones, without repetition.
fn said_of(frame: &Frame, wanted: Wanted) -> Option<Vec<String>> {
    let context = validated_context()?;
    let mut renderer = sheet(&context);
    let load = load();
    renderer.settle(&load).expect("the device settles");
    submit(&mut renderer, &Frame::step(&[range()], WANTED), &load, WANTED);
    assert_silent(&context);
    submit(&mut renderer, frame, &load, wanted);
    submit(&mut renderer, frame, &load, wanted);
    let identifier = |message: &String| message.split(": ").next().unwrap_or_default().to_owned();
    let mut said: Vec<String> = context.validation_messages().iter().map(identifier).collect();
    said.dedup();
    Some(said)
}

/// Removes each barrier of `frame`, which follows `first` in one command buffer, and lists those that the layer
/// detects. The expected lists were measured with versions 1.3.239 and 1.4.309. tests/it/hazards.rs covers the others.
fn check(first: &Frame, frame: &Frame, wanted: Wanted, seen: &[&str], unseen: &[&str]) {
    let joined = |frame: Frame| Frame { entries: [first.entries.clone(), frame.entries].concat() };
    let Some(said) = said_of(&joined(frame.clone()), wanted) else { return };
    assert_eq!(said, Vec::<String>::new(), "the whole frame");
    let (mut found_seen, mut found_unseen) = (Vec::new(), Vec::new());
    for (n, barrier) in barriers(frame).iter().enumerate() {
        let Some(said) = said_of(&joined(without_barrier(frame, n)), wanted) else { return };
        let name = format!("{:?}: {:?} -> {:?}", barrier.resource, barrier.before.stage, barrier.after.stage);
        if name == COMPUTE_TO_VERTEX {
            assert_eq!(said, ["SYNC-HAZARD-READ-AFTER-WRITE"], "{name}");
        }
        if said.is_empty() { found_unseen.push(name) } else { found_seen.push(name) }
    }
    // Version 1.4.309 does not judge the indices that an indirect draw reads. tests/it/hazards.rs does.
    let judges_indices = found_seen.iter().any(|name| name.starts_with(INDICES));
    let is_judged = |name: &&str| judges_indices || !name.starts_with(INDICES);
    found_unseen.retain(|name| is_judged(&name.as_str()));
    let [seen, unseen] = [seen, unseen].map(|names| names.iter().copied().filter(is_judged).collect::<Vec<_>>());
    assert_eq!(found_seen, seen, "barriers whose absence the layer sees");
    assert_eq!(found_unseen, unseen, "barriers whose absence it does not see; where it has learnt to, move them");
}

const INDICES: &str = "VisibleTriangles: ";
const COMPUTE_TO_VERTEX: &str = "Temperature: COMPUTE_SHADER -> VERTEX_SHADER";
const COMPUTE_TO_COPY: &str = "Temperature: COMPUTE_SHADER -> COPY";
const TEMPERATURE_TO_STEP: &str = "Temperature: VERTEX_SHADER | COMPUTE_SHADER | COPY -> COMPUTE_SHADER";
const STATE_TO_STEP: [&str; 3] = [
    "Target: COMPUTE_SHADER | COPY | CLEAR -> COMPUTE_SHADER",
    "Span: COMPUTE_SHADER | COPY | CLEAR -> COMPUTE_SHADER",
    "Elapsed: COMPUTE_SHADER | COPY | CLEAR -> COMPUTE_SHADER",
];
const STATE_TO_SETTLING: [&str; 3] = [
    "Target: COMPUTE_SHADER | COPY | CLEAR -> COPY",
    "Span: COMPUTE_SHADER | COPY | CLEAR -> COPY | CLEAR",
    "Elapsed: COMPUTE_SHADER | COPY | CLEAR -> COPY | CLEAR",
];
const DRAWN_TO_CULL: &str = "Draws: DRAW_INDIRECT | COMPUTE_SHADER -> COMPUTE_SHADER";
const CULL_TO_DRAWS: &str = "Draws: COMPUTE_SHADER -> DRAW_INDIRECT";
const CULLED_TO_CULL: &str = "VisibleTriangles: COMPUTE_SHADER | INDEX_INPUT -> COMPUTE_SHADER";
const CULL_TO_DRAWING: &str = "VisibleTriangles: COMPUTE_SHADER -> INDEX_INPUT";
const IMAGES_TO_DRAWING: [&str; 2] =
    ["RadianceImage: COPY -> COLOR_ATTACHMENT_OUTPUT", "IdentityImage: COPY -> COLOR_ATTACHMENT_OUTPUT"];
const DEPTH: &str =
    "DepthImage: EARLY_FRAGMENT_TESTS | LATE_FRAGMENT_TESTS -> EARLY_FRAGMENT_TESTS | LATE_FRAGMENT_TESTS";
const IMAGES_TO_COPY: [&str; 2] =
    ["RadianceImage: COLOR_ATTACHMENT_OUTPUT -> COPY", "IdentityImage: COLOR_ATTACHMENT_OUTPUT -> COPY"];

#[test]
fn barriers_of_a_step() {
    let [radiance, identity] = IMAGES_TO_DRAWING;
    let [radiance_copy, identity_copy] = IMAGES_TO_COPY;
    let [target, span, elapsed] = STATE_TO_STEP;
    let images = [radiance, identity, radiance_copy, identity_copy];
    let seen = [&[CULL_TO_DRAWING, CULL_TO_DRAWS, COMPUTE_TO_VERTEX][..], &images, &[COMPUTE_TO_COPY]].concat();
    // Barriers to the previous submit and barriers for the host.
    let to_host =
        ["RadianceReadback: COPY -> HOST", "IdentityReadback: COPY -> HOST", "TemperatureReadback: COPY -> HOST"];
    let last_frame = [TEMPERATURE_TO_STEP, target, span, elapsed, CULLED_TO_CULL, DRAWN_TO_CULL, DEPTH];
    let unseen = [&last_frame[..], &to_host].concat();
    check(&Frame::default(), &Frame::step(&[range()], WANTED), WANTED, &seen, &unseen);
}

/// A frame without data for the host, because two of them in one command buffer would write it twice.
fn unread(frame: &Frame) -> Frame {
    let mut entries = frame.entries.clone();
    entries.retain_mut(|entry| match entry {
        ListEntry::Pass(pass) => !matches!(pass.work, PassWork::Copy { to, .. } if to.per_slot),
        ListEntry::Barriers(barriers) => {
            barriers.retain(|barrier| !barrier.resource.per_slot);
            !barriers.is_empty()
        }
    });
    Frame { entries }
}

#[test]
fn barriers_between_two_steps() {
    let drawn = Wanted { image: true, cull: TRIANGLES, temperatures: false, ..Wanted::default() };
    let step = unread(&Frame::step(&[range()], drawn));
    let [radiance, identity] = IMAGES_TO_DRAWING;
    let culled = [CULLED_TO_CULL, DRAWN_TO_CULL, CULL_TO_DRAWING, CULL_TO_DRAWS];
    let seen = [&[TEMPERATURE_TO_STEP][..], &culled, &[COMPUTE_TO_VERTEX, radiance, identity]].concat();
    // Two dispatches of one kind on one buffer, depth (which rasterisation order covers), and images without a copy.
    let unseen = [&STATE_TO_STEP[..], &[DEPTH], &IMAGES_TO_COPY].concat();
    check(&step, &step, drawn, &seen, &unseen);
}

#[test]
fn barriers_between_a_step_and_settling() {
    let step = Frame::step(&[range()], Wanted::default());
    let seen = [&STATE_TO_SETTLING[..], &[COMPUTE_TO_COPY]].concat();
    check(&step, &Frame::settle(&[range()]), Wanted::default(), &seen, &[TEMPERATURE_TO_STEP]);
}

#[test]
fn barriers_between_settling_and_a_step() {
    let step = Frame::step(&[range()], Wanted::default());
    let seen = [&[TEMPERATURE_TO_STEP][..], &STATE_TO_STEP].concat();
    check(&Frame::settle(&[range()]), &step, Wanted::default(), &seen, &[]);
}
