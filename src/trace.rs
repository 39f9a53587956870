//! What each thread of a run does and did: the account of its time, a timeline for Perfetto and chrome://tracing, and the work under way.
//!
//! A thread enters a recording once. Code below then begins spans without a handle, and a thread outside records nothing.
//! The device's timestamps give the times of passes. All of them are shifted to the host's clock so that no frame begins before its submission. The
//! file states how uncertain this shift is. Work of the device outside the frame (uploads, stages of networks) appears only in the host's spans.

use std::borrow::Cow;
use std::cell::RefCell;
use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::{Value, json};

use crate::host::processor_time;

/// A thread of a run, or the queue of the device. Tracks are shown in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Track {
    /// The thread that runs the loop.
    Host,
    /// The thread that writes files while the loop goes on.
    Writer,
    /// The thread that checks in f64 while the loop goes on.
    Check,
    /// The queue of the device.
    Device,
}

impl Track {
    const ALL: [Self; 4] = [Self::Host, Self::Writer, Self::Check, Self::Device];

    fn name(self) -> &'static str {
        match self {
            Self::Host => "host: loop",
            Self::Writer => "host: files",
            Self::Check => "host: check",
            Self::Device => "device: queue",
        }
    }
}

/// Measured times of a frame on a device.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DeviceFrame {
    /// Host time of the submission.
    pub(crate) submitted: Instant,
    /// Host time at which the host saw the fence.
    pub(crate) done: Instant,
    /// Name, start and duration of each group of passes [ns of the device clock].
    pub(crate) passes: Vec<(String, f64, f64)>,
}

/// Where the time of a run went.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct TimeAccount {
    /// Wall time since the run began [s].
    pub(crate) wall_s: f64,
    /// Wall time of the loop's works without parts [s]. The rest of a work with parts has no name.
    pub(crate) named_s: f64,
    pub(crate) works: Vec<TimeSpent>,
}

/// Time that a thread spent on one kind of work.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct TimeSpent {
    /// `host: loop`, `host: files`, `host: check`.
    pub(crate) thread: &'static str,
    /// Number of works around this one.
    pub(crate) depth: usize,
    /// The work. It stands below the work that it is part of.
    pub(crate) work: String,
    /// Wall time [s].
    pub(crate) wall_s: f64,
    /// Processor time of all threads meanwhile [s]. 0 where the system does not report it.
    pub(crate) processor_s: f64,
    /// Number of times.
    pub(crate) count: u64,
}

#[derive(Debug)]
struct Event {
    track: Track,
    name: String,
    /// Time since the trace began [us].
    start: f64,
    length: f64,
}

/// A kind of work as part of another, and what was spent on it.
#[derive(Debug)]
struct WorkKind {
    name: Cow<'static, str>,
    around: Option<usize>,
    wall: Duration,
    processor: Duration,
    count: u64,
}

/// Work under way.
#[derive(Debug)]
struct Open {
    work: usize,
    detail: String,
    began: Instant,
    processor: Duration,
}

/// What a thread does and did.
#[derive(Debug, Default)]
struct Thread {
    works: Vec<WorkKind>,
    open: Vec<Open>,
}

#[derive(Debug)]
struct Recording {
    began: Instant,
    /// Of the host's tracks.
    threads: [Mutex<Thread>; 3],
    /// The timeline, where it is kept.
    timeline: Option<Mutex<Timeline>>,
}

/// Most stretches of work in a timeline: some 100 MB of memory and of file.
const MOST_EVENTS: usize = 1 << 20;

#[derive(Debug, Default)]
struct Timeline {
    events: Vec<Event>,
    frames: Vec<DeviceFrame>,
    /// Passes in the frames.
    passes: usize,
    /// Stretches of work that came after the most that are kept.
    left_out: u64,
}

impl Timeline {
    /// Whether so many more stretches of work are kept. Those that are not are counted.
    fn takes(&mut self, more: usize) -> bool {
        let takes = self.events.len() + self.passes + more <= MOST_EVENTS;
        self.left_out += if takes { 0 } else { more as u64 };
        takes
    }
}

/// A recording of a run, or nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trace(Option<Arc<Recording>>);

thread_local! {
    /// The recording in which this thread is a track.
    static HERE: RefCell<Option<(Arc<Recording>, Track)>> = const { RefCell::new(None) };
}

/// Makes this thread a track of a recording until it is dropped.
#[must_use = "the thread leaves the recording when this is dropped"]
pub(crate) struct OnTrack(Option<(Arc<Recording>, Track)>);

impl Drop for OnTrack {
    fn drop(&mut self) {
        HERE.set(self.0.take());
    }
}

/// A span of work that ends when this is dropped.
#[must_use = "the span ends when this is dropped"]
pub(crate) struct Span(Option<(Arc<Recording>, Track, usize)>);

/// Begins work of this thread. Nothing is recorded where the thread is no track of a recording, such as a helper that computes for all.
pub(crate) fn span(name: impl Into<Cow<'static, str>>) -> Span {
    span_with(name, String::new)
}

/// As [`span`], with a detail that is told while the work is under way.
pub(crate) fn span_with(name: impl Into<Cow<'static, str>>, detail: impl FnOnce() -> String) -> Span {
    let Some((recording, track)) = HERE.with_borrow(Clone::clone) else { return Span(None) };
    let detail = detail();
    let depth = recording.thread(track).map(|mut thread| thread.begin(name.into(), detail));
    Span(depth.map(|depth| (recording, track, depth)))
}

/// Does work of this thread in a span.
pub(crate) fn timed<T>(name: &'static str, work: impl FnOnce() -> T) -> T {
    let _span = span(name);
    work()
}

/// Keeps the measured times of a frame, where this thread is in a recording with a timeline.
pub(crate) fn keep_frame(frame: DeviceFrame) {
    if let Some((recording, _)) = HERE.with_borrow(Clone::clone)
        && let Some(timeline) = &recording.timeline
    {
        let mut timeline = lock(timeline);
        if timeline.takes(frame.passes.len()) {
            timeline.passes += frame.passes.len();
            timeline.frames.push(frame);
        }
    }
}

/// Whether this thread is in a recording with a timeline.
pub(crate) fn keeps_frames() -> bool {
    HERE.with_borrow(|here| here.as_ref().is_some_and(|(recording, _)| recording.timeline.is_some()))
}

impl Drop for Span {
    fn drop(&mut self) {
        let Some((recording, track, depth)) = self.0.take() else { return };
        let Some(mut thread) = recording.thread(track) else { return };
        while thread.open.len() > depth {
            let ended = thread.end();
            if let (Some((name, began)), Some(timeline)) = (ended, &recording.timeline) {
                let (start, length) = (recording.since_began(began), began.elapsed().as_secs_f64() * 1e6);
                let mut timeline = lock(timeline);
                if timeline.takes(1) {
                    timeline.events.push(Event { track, name, start, length });
                }
            }
        }
    }
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Thread {
    /// Begins work. Returns how much was under way before.
    fn begin(&mut self, name: Cow<'static, str>, detail: String) -> usize {
        let around = self.open.last().map(|open| open.work);
        let known = self.works.iter().position(|work| work.around == around && work.name == name);
        let work = known.unwrap_or_else(|| {
            self.works.push(WorkKind { name, around, wall: Duration::ZERO, processor: Duration::ZERO, count: 0 });
            self.works.len() - 1
        });
        self.open.push(Open { work, detail, began: Instant::now(), processor: processor_time().unwrap_or_default() });
        self.open.len() - 1
    }

    /// Ends the last work that began. Returns its name with its detail, and when it began.
    fn end(&mut self) -> Option<(String, Instant)> {
        let open = self.open.pop()?;
        let work = &mut self.works[open.work];
        work.wall += open.began.elapsed();
        work.processor += processor_time().unwrap_or_default().saturating_sub(open.processor);
        work.count += 1;
        Some((told(&work.name, &open.detail), open.began))
    }

    /// The parts of a work in order, and all their parts, each with the number of works around it.
    fn below(&self, around: Option<usize>, depth: usize) -> Vec<(usize, &WorkKind)> {
        let parts = self.works.iter().enumerate().filter(|(_, work)| work.around == around);
        parts.flat_map(|(number, work)| [vec![(depth, work)], self.below(Some(number), depth + 1)].concat()).collect()
    }
}

/// A name with its detail.
fn told(name: &str, detail: &str) -> String {
    if detail.is_empty() { name.to_owned() } else { format!("{name} {detail}") }
}

impl Recording {
    /// What a thread of the host does and did.
    fn thread(&self, track: Track) -> Option<MutexGuard<'_, Thread>> {
        self.threads.get(track as usize).map(lock)
    }

    /// [us].
    fn since_began(&self, instant: Instant) -> f64 {
        instant.saturating_duration_since(self.began).as_secs_f64() * 1e6
    }
}

impl Trace {
    /// Begins a recording, with a timeline or with sums only.
    pub(crate) fn begin(with_timeline: bool) -> Self {
        let timeline = with_timeline.then(Mutex::default);
        Self(Some(Arc::new(Recording { began: Instant::now(), threads: Default::default(), timeline })))
    }

    /// The recording that this thread is in, or nothing.
    pub(crate) fn here() -> Self {
        Self(HERE.with_borrow(|here| here.as_ref().map(|(recording, _)| Arc::clone(recording))))
    }

    /// Makes this thread a track. The timeline and the sums then have its spans.
    pub(crate) fn enter(&self, track: Track) -> OnTrack {
        OnTrack(HERE.replace(self.0.clone().map(|recording| (recording, track))))
    }

    /// What the loop does now: its works from the widest to the narrowest, each with its detail. Empty where nothing is under way.
    pub(crate) fn doing(&self) -> Vec<String> {
        let Some(thread) = self.0.as_ref().and_then(|shared| shared.thread(Track::Host)) else { return Vec::new() };
        thread.open.iter().map(|open| told(&thread.works[open.work].name, &open.detail)).collect()
    }

    /// Time that the threads of the host have spent on works that have ended. Each work stands below the work that it is part of.
    pub(crate) fn account(&self) -> TimeAccount {
        let mut works: Vec<TimeSpent> = Vec::new();
        for track in [Track::Host, Track::Writer, Track::Check] {
            let Some(thread) = self.0.as_ref().and_then(|shared| shared.thread(track)) else { continue };
            works.extend(thread.below(None, 0).into_iter().map(|(depth, work)| TimeSpent {
                thread: track.name(),
                depth,
                work: work.name.clone().into_owned(),
                wall_s: work.wall.as_secs_f64(),
                processor_s: work.processor.as_secs_f64(),
                count: work.count,
            }));
        }
        let is_whole = |number: usize| works.get(number + 1).is_none_or(|next| next.depth <= works[number].depth);
        let of_loop = works.iter().enumerate().filter(|(_, spent)| spent.thread == Track::Host.name());
        let named_s = of_loop.filter(|(number, _)| is_whole(*number)).map(|(_, spent)| spent.wall_s).sum();
        let wall_s = self.0.as_ref().map_or(0.0, |shared| shared.began.elapsed().as_secs_f64());
        TimeAccount { wall_s, named_s, works }
    }

    /// Stretches of work that the timeline left out, because it had the most that it takes.
    pub(crate) fn left_out(&self) -> u64 {
        let timeline = self.0.as_ref().and_then(|shared| shared.timeline.as_ref());
        timeline.map_or(0, |timeline| lock(timeline).left_out)
    }

    /// Writes the recording in the trace event format (<https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU>), as complete events in
    /// microseconds.
    ///
    /// The device's clock is shifted by the least amount with which no frame begins before its submission. `otherData.clock_slack_us` is the most by which
    /// all frames could be later, and `otherData.left_out` the number of events beyond the most.
    ///
    /// # Errors
    /// Of the writer.
    pub(crate) fn write(&self, to: &mut dyn Write) -> std::io::Result<()> {
        let Some((shared, timeline)) = self.0.as_ref().and_then(|shared| Some((shared, shared.timeline.as_ref()?)))
        else {
            return write!(to, "{}", json!({ "traceEvents": [] }));
        };
        let kept = lock(timeline);
        let (offset, slack) = shared.clock(&kept.frames);
        write!(to, "{{\"displayTimeUnit\":\"ms\",")?;
        write!(to, "\"otherData\":{},", json!({ "clock_slack_us": slack, "left_out": kept.left_out }))?;
        write!(to, "\"traceEvents\":[")?;
        write!(to, "{}", json!({ "name": "process_name", "ph": "M", "pid": 1, "args": { "name": "isotherm" } }))?;
        for track in Track::ALL {
            let thread = track as usize;
            let named =
                |what: &str, value: Value| json!({ "name": what, "ph": "M", "pid": 1, "tid": thread, "args": value });
            write!(to, ",\n{}", named("thread_name", json!({ "name": track.name() })))?;
            write!(to, ",\n{}", named("thread_sort_index", json!({ "sort_index": thread })))?;
        }
        let of_host = kept.events.iter().map(|event| (event.track, &event.name, event.start, event.length));
        let passes = kept.frames.iter().flat_map(|frame| &frame.passes);
        let of_device = passes.map(|(name, start, length)| (Track::Device, name, start * 1e-3 + offset, length * 1e-3));
        for (track, name, start, length) in of_host.chain(of_device) {
            let event = json!({ "name": name, "ph": "X", "pid": 1, "tid": track as usize, "ts": start, "dur": length });
            write!(to, ",\n{event}")?;
        }
        write!(to, "]}}")
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
    use super::*;

    fn written(trace: &Trace) -> Value {
        let mut bytes = Vec::new();
        trace.write(&mut bytes).expect("memory takes all");
        serde_json::from_slice(&bytes).expect("JSON")
    }

    #[test]
    fn a_timeline_ends_where_it_is_full() {
        let trace = Trace::begin(true);
        let timeline = trace.0.as_ref().and_then(|shared| shared.timeline.as_ref()).expect("a timeline");
        // As if that many passes were there: room is left for two stretches.
        lock(timeline).passes = MOST_EVENTS - 2;
        let on = trace.enter(Track::Host);
        let pass = |number: usize| (format!("pass {number}"), 0.0, 1.0);
        let now = Instant::now();
        keep_frame(DeviceFrame { submitted: now, done: now, passes: (0..3).map(pass).collect() });
        (0..5).for_each(|_| drop(span("step")));
        drop(on);
        assert_eq!((trace.left_out(), trace.account().works[0].count), (6, 5));
        let json = written(&trace);
        let events = json["traceEvents"].as_array().expect("events");
        assert_eq!(json["otherData"]["left_out"], 6);
        assert_eq!(events.iter().filter(|event| event["ph"] == "X").count(), 2);
    }

    #[test]
    fn a_recording_has_a_span_for_each_stretch_of_work_and_none_without_it() {
        let trace = Trace::begin(true);
        let on = trace.enter(Track::Host);
        drop(span("loads"));
        drop(on);
        drop(span("outside"));
        let json = written(&trace);
        let events = json["traceEvents"].as_array().expect("events");
        assert!(events.iter().any(|event| event["name"] == "loads" && event["ph"] == "X" && event["tid"] == 0));
        assert!(events.iter().all(|event| event["name"] != "outside"));
        let off = Trace::begin(false);
        let on = off.enter(Track::Host);
        drop(span("loads"));
        drop(on);
        assert_eq!(written(&off)["traceEvents"].as_array().map(Vec::len), Some(0));
        assert_eq!(off.account().works.len(), 1);
    }

    #[test]
    fn works_stand_below_their_work_and_only_the_narrowest_name_time() {
        let trace = Trace::begin(false);
        let on = trace.enter(Track::Host);
        for orbit in 0..2 {
            let _orbit = span("orbit");
            let _casts = span_with("casting rays", || format!("for pose {orbit}"));
            assert_eq!(trace.doing(), ["orbit".to_owned(), format!("casting rays for pose {orbit}")]);
            std::thread::sleep(Duration::from_millis(2));
        }
        assert_eq!(trace.doing(), Vec::<String>::new());
        drop(on);
        let account = trace.account();
        let told: Vec<_> = account.works.iter().map(|spent| (spent.depth, &*spent.work, spent.count)).collect();
        assert_eq!(told, [(0, "orbit", 2), (1, "casting rays", 2)], "{told:?}");
        let [orbit, casts] = [0, 1].map(|number: usize| account.works[number].wall_s);
        assert!(account.named_s == casts && casts >= 0.004 && casts < orbit, "{account:?}");
    }

    #[test]
    fn the_clock_of_the_device_is_set_between_submission_and_end() {
        let trace = Trace::begin(true);
        let began = trace.0.as_ref().expect("a recording").began;
        let at = |us: u64| began + Duration::from_micros(us);
        // A device whose clock is 1 s ahead: passes begin 30 us and 10 us after their submission.
        let frame = |submitted, start: f64, end: f64, done| DeviceFrame {
            submitted: at(submitted),
            done: at(done),
            passes: vec![("pass".to_owned(), 1e9 + start * 1e3, (end - start) * 1e3)],
        };
        let on = trace.enter(Track::Host);
        keep_frame(frame(100, 130.0, 180.0, 200));
        keep_frame(frame(300, 310.0, 360.0, 365));
        drop(on);
        let json = written(&trace);
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
