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
    events.iter().filter(|event| event.0 == 2).for_each(|event| *device.entry(&event.1).or_default() += 1);
    let passes = report["passes"].as_array().expect("passes");
    assert!(!passes.is_empty());
    for pass in passes {
        let name = pass["name"].as_str().expect("a name");
        assert_eq!(device.get(name).copied(), pass["count"].as_u64(), "{name}");
    }
    for name in ["load and build the scene", "settle and warm up", "loads of the step", "submit", "wait for the device"]
    {
        assert!(events.iter().any(|event| event.0 == 0 && event.1 == name), "{name}");
    }
    assert!(events.iter().any(|event| event.0 == 1 && event.1 == "write EXR"));

    // The queue runs one pass after another, after the start of the host.
    let mut queue: Vec<(f64, f64)> =
        events.iter().filter(|event| event.0 == 2).map(|event| (event.2, event.3)).collect();
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
    assert!(events(&trace).iter().all(|event| event.0 != 2));
    assert!(events(&trace).iter().any(|event| event.1 == "f64 reference"));
}
