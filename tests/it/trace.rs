//! `isotherm run --trace`: every pass and host task in the trace event format.

use std::collections::BTreeMap;

use serde_json::Value;

use super::craft::{Folder, SCENE};
use super::program::succeed;

/// Complete events of a trace: track, name, start and end [us].
fn events(trace: &Value) -> Vec<(u64, String, f64, f64)> {
    let complete = trace["traceEvents"].as_array().expect("events").iter().filter(|event| event["ph"] == "X");
    let number = |event: &Value, key: &str| event[key].as_f64().expect("a number");
    let one = |event: &Value| {
        let (start, length) = (number(event, "ts"), number(event, "dur"));
        (
            event["tid"].as_u64().expect("a track"),
            event["name"].as_str().expect("a name").to_owned(),
            start,
            start + length,
        )
    };
    complete.map(one).collect()
}

#[test]
fn a_trace_holds_every_pass_of_the_report_and_no_pass_outside_the_run() {
    let folder = Folder::new(SCENE);
    let path = folder.0.path();
    succeed(path, &["run", "scene.toml", "-o", "out", "--trace", "trace.json"]);
    let read =
        |name: &str| -> Value { serde_json::from_slice(&std::fs::read(path.join(name)).expect(name)).expect("JSON") };
    let (trace, report) = (read("trace.json"), read("out/report.json"));
    let events = events(&trace);

    let mut device: BTreeMap<&str, u64> = BTreeMap::new();
    events.iter().filter(|event| event.0 == 3).for_each(|event| *device.entry(&event.1).or_default() += 1);
    let passes = report["passes"].as_array().expect("passes");
    assert!(!passes.is_empty());
    for pass in passes {
        let name = pass["name"].as_str().expect("a name");
        assert_eq!(device.get(name).copied(), pass["count"].as_u64(), "{name}");
    }
    for name in ["reading the model", "settling", "finding the loads", "recording a frame", "waiting for the device"] {
        assert!(events.iter().any(|event| event.0 == 0 && event.1 == name), "{name}");
    }
    assert!(events.iter().any(|event| event.0 == 1 && event.1 == "encoding and writing an image"));

    // The queue runs one pass after another, after the start of the host.
    let mut queue: Vec<(f64, f64)> =
        events.iter().filter(|event| event.0 == 3).map(|event| (event.2, event.3)).collect();
    queue.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(queue[0].0 > 0.0 && queue.windows(2).all(|pair| pair[0].1 <= pair[1].0 + 1.0), "{queue:?}");
    let slack = trace["otherData"]["clock_slack_us"].as_f64().expect("a slack");
    assert!(slack.is_finite() && slack >= 0.0, "{slack}");
}

#[test]
fn a_trace_of_the_reference_has_no_device_and_a_run_without_one_no_file() {
    let folder = Folder::new(SCENE);
    let path = folder.0.path();
    succeed(path, &["run", "scene.toml", "-o", "out", "--device", "cpu", "--trace", "trace.json"]);
    let trace: Value = serde_json::from_slice(&std::fs::read(path.join("trace.json")).expect("a trace")).expect("JSON");
    assert!(events(&trace).iter().all(|event| event.0 != 3));
    assert!(events(&trace).iter().any(|event| event.1 == "stepping nodes in f64"));
}

/// Thread, name, start and end [us] of a span.
type Event = (u64, String, f64, f64);

/// Share of the time between two moments [us] in which the loop's thread is in a span without spans inside.
fn named(events: &[Event], [from, to]: [f64; 2]) -> f64 {
    let of_loop: Vec<[f64; 2]> = events.iter().filter(|event| event.0 == 0).map(|event| [event.2, event.3]).collect();
    let has_parts = |[start, end]: [f64; 2]| {
        of_loop.iter().any(|[first, last]| start <= *first && *last <= end && last - first < end - start)
    };
    of_loop.iter().filter(|span| !has_parts(**span)).map(|[start, end]| end - start).sum::<f64>() / (to - from)
}

#[test]
fn at_least_95_hundredths_of_the_time_of_a_run_have_a_name() {
    let periodic = SCENE.replacen("step = 60\n", "step = 60\nwarm_up = \"periodic\"\n", 1);
    assert_ne!(periodic, SCENE);
    for (scene, device) in [(SCENE, None), (SCENE, Some("cpu")), (periodic.as_str(), None)] {
        let folder = Folder::new(scene);
        let path = folder.0.path();
        let of_device = device.map_or(Vec::new(), |name| vec!["--device", name]);
        let of_run = || {
            let run = ["run", "scene.toml", "-o", "out", "--force", "--trace", "trace.json"];
            succeed(path, &[&run[..], &of_device].concat());
            let read = |name: &str| -> Value {
                serde_json::from_slice(&std::fs::read(path.join(name)).expect(name)).expect("JSON")
            };
            let (events, time) = (events(&read("trace.json")), read("out/report.json")["speed"]["time"].clone());
            let [named, wall] = ["named_s", "wall_s"].map(|key| time[key].as_f64().expect("a number"));
            println!("{device:?}: {:.3} of {wall:.2} s", named / wall);
            (events, time, named / wall)
        };
        // A busy machine stops a run of 0.2 s for some hundredths of it, between works too.
        let (events, time, share) = (0..3).map(|_| of_run()).max_by(|a, b| a.2.total_cmp(&b.2)).expect("runs");
        let number = |key: &str| time[key].as_f64().expect("a number");
        assert!((0.95..=1.0).contains(&share), "{time:#}");
        // The timeline says so too. It also counts a span that has parts at other times only.
        let own = named(&events, [0.0, 1e6 * number("wall_s")]);
        assert!(own <= 1.0 && own > share - 1e-3, "{own}, {share}");
        // A timeline that lacks a span names less: the longest span without parts, and all that contain it.
        let of_loop = || events.iter().filter(|event| event.0 == 0);
        let is_in = |one: &Event, other: &Event| other.2 <= one.2 && one.3 <= other.3;
        let has_parts = |one: &&Event| of_loop().any(|other| other.3 - other.2 < one.3 - one.2 && is_in(other, one));
        let length = |event: &Event| event.3 - event.2;
        let leaves = of_loop().filter(|event| !has_parts(event));
        let longest = leaves.max_by(|one, other| length(one).total_cmp(&length(other))).expect("a span");
        let without: Vec<Event> = events.iter().filter(|event| !is_in(longest, event)).cloned().collect();
        assert!(named(&without, [0.0, 1e6 * number("wall_s")]) < own - 0.02);
    }
}
