//! Records the times of work on host and device, as JSON for Perfetto and chrome://tracing.
//!
//! The device's timestamps give the times of passes. All of them are shifted to the host's clock so that no frame begins before its submission. The
//! file states how uncertain this shift is. Work outside the frame (uploads, stages of networks) appears only in the host's spans.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use serde_json::{Value, json};

use crate::gpu::timing::DeviceFrame;

/// The worker of a track. Tracks are shown in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Track {
    /// The thread that runs the loop.
    Host,
    /// The thread that writes files while the loop goes on.
    Writer,
    /// The queue of the device.
    Device,
}

impl Track {
    const ALL: [Self; 3] = [Self::Host, Self::Writer, Self::Device];

    fn name(self) -> &'static str {
        match self {
            Self::Host => "host: loop",
            Self::Writer => "host: files",
            Self::Device => "device: queue",
        }
    }
}

#[derive(Debug)]
struct Event {
    track: Track,
    name: String,
    /// Time since the trace began [us].
    start: f64,
    length: f64,
}

#[derive(Debug)]
struct Recording {
    began: Instant,
    events: Mutex<Vec<Event>>,
    frames: Mutex<Vec<DeviceFrame>>,
}

/// A recording, or nothing.
#[derive(Debug, Clone, Default)]
pub struct Trace(Option<Arc<Recording>>);

/// A span of work that ends when this is dropped.
#[must_use = "the span ends when this is dropped"]
pub(crate) struct Span<'a> {
    trace: &'a Trace,
    track: Track,
    name: &'static str,
    began: Instant,
}

impl Drop for Span<'_> {
    fn drop(&mut self) {
        if let Some(shared) = &self.trace.0 {
            let start = shared.since_began(self.began);
            let length = shared.since_began(Instant::now()) - start;
            let event = Event { track: self.track, name: self.name.to_owned(), start, length };
            shared.events.lock().unwrap_or_else(PoisonError::into_inner).push(event);
        }
    }
}

impl Recording {
    /// [us].
    fn since_began(&self, instant: Instant) -> f64 {
        instant.saturating_duration_since(self.began).as_secs_f64() * 1e6
    }
}

impl Trace {
    pub(crate) fn recording() -> Self {
        let empty = || Mutex::new(Vec::new());
        Self(Some(Arc::new(Recording { began: Instant::now(), events: empty(), frames: Mutex::new(Vec::new()) })))
    }

    pub(crate) fn is_recording(&self) -> bool {
        self.0.is_some()
    }

    pub(crate) fn span(&self, track: Track, name: &'static str) -> Span<'_> {
        Span { trace: self, track, name, began: Instant::now() }
    }

    pub(crate) fn frame(&self, frame: DeviceFrame) {
        if let Some(shared) = &self.0 {
            shared.frames.lock().unwrap_or_else(PoisonError::into_inner).push(frame);
        }
    }

    /// The recording in the trace event format (<https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU>), as complete events in
    /// microseconds.
    ///
    /// The device's clock is shifted by the least amount with which no frame begins before its submission. `other_data.clock_slack_us` is the most by which
    /// all frames could be later.
    pub(crate) fn json(&self) -> Value {
        let Some(shared) = &self.0 else { return json!({ "traceEvents": [] }) };
        let frames = shared.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let events = shared.events.lock().unwrap_or_else(PoisonError::into_inner);
        let (offset, slack) = shared.clock(&frames);
        let thread = |track: Track| json!(Track::ALL.iter().position(|known| *known == track));
        let complete = |track: Track, name: &str, start: f64, length: f64| json!({ "name": name, "ph": "X", "pid": 1, "tid": thread(track), "ts": start, "dur": length });
        let mut all: Vec<Value> =
            vec![json!({ "name": "process_name", "ph": "M", "pid": 1, "args": { "name": "isotherm" } })];
        for track in Track::ALL {
            let named = |what: &str, value: Value| json!({ "name": what, "ph": "M", "pid": 1, "tid": thread(track), "args": value });
            all.push(named("thread_name", json!({ "name": track.name() })));
            all.push(named("thread_sort_index", json!({ "sort_index": thread(track) })));
        }
        all.extend(events.iter().map(|event| complete(event.track, &event.name, event.start, event.length)));
        for (name, start, length) in frames.iter().flat_map(|frame| &frame.passes) {
            all.push(complete(Track::Device, name, start * 1e-3 + offset, length * 1e-3));
        }
        json!({ "traceEvents": all, "displayTimeUnit": "ms", "otherData": { "clock_slack_us": slack } })
    }
}

impl Recording {
    /// Shift of the device's clock [us], and by how much more it could be shifted.
    fn clock(&self, frames: &[DeviceFrame]) -> (f64, f64) {
        let mut least = f64::NEG_INFINITY;
        let mut most = f64::INFINITY;
        for frame in frames {
            let starts = frame.passes.iter().map(|(_, start, _)| start * 1e-3).reduce(f64::min);
            let ends = frame.passes.iter().map(|(_, start, length)| (start + length) * 1e-3).reduce(f64::max);
            if let (Some(start), Some(end)) = (starts, ends) {
                least = least.max(self.since_began(frame.submitted) - start);
                most = most.min(self.since_began(frame.done) - end);
            }
        }
        if least.is_finite() { (least, (most - least).max(0.0)) } else { (0.0, 0.0) }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_recording_has_a_span_for_each_stretch_of_work_and_none_without_it() {
        let trace = Trace::recording();
        drop(trace.span(Track::Host, "loads"));
        let json = trace.json();
        let events = json["traceEvents"].as_array().expect("events");
        assert!(events.iter().any(|event| event["name"] == "loads" && event["ph"] == "X" && event["tid"] == 0));
        let off = Trace::default();
        drop(off.span(Track::Host, "loads"));
        assert_eq!(off.json()["traceEvents"].as_array().map(Vec::len), Some(0));
    }

    #[test]
    fn the_clock_of_the_device_is_set_between_submission_and_end() {
        let trace = Trace::recording();
        let began = trace.0.as_ref().expect("a recording").began;
        let at = |us: u64| began + Duration::from_micros(us);
        // A device whose clock is 1 s ahead: passes begin 30 us and 10 us after their submission.
        let frame = |submitted, start: f64, end: f64, done| DeviceFrame {
            submitted: at(submitted),
            done: at(done),
            passes: vec![("pass".to_owned(), 1e9 + start * 1e3, (end - start) * 1e3)],
        };
        trace.frame(frame(100, 130.0, 180.0, 200));
        trace.frame(frame(300, 310.0, 360.0, 365));
        let json = trace.json();
        let starts: Vec<f64> = json["traceEvents"]
            .as_array()
            .expect("events")
            .iter()
            .filter(|event| event["name"] == "pass")
            .map(|event| event["ts"].as_f64().expect("a time"))
            .collect();
        // The second frame determines the shift. The first then begins 20 us after its submission.
        assert!((starts[0] - 120.0).abs() < 1e-3 && (starts[1] - 300.0).abs() < 1e-3, "{starts:?}");
        let slack = json["otherData"]["clock_slack_us"].as_f64().expect("a slack");
        assert!((slack - 15.0).abs() < 1e-3, "{slack}");
    }
}
