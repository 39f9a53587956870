//! Progress on standard error, and signals. A terminal shows bars. A file or pipe gets a line every 10 seconds. Both tell what the loop of a run does.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, WeakProgressBar};

use super::pace::WorkPace;
use crate::converge::RunNews;
use crate::output::console::{self, say};
use crate::output::temporary::remove_unfinished;
use crate::output::waiting::waited;
use crate::simulation::forecast::Forecast;
use crate::simulation::prepare_error::PrepareStage;
use crate::trace::{OnTrack, Trace, Track};

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(10);

/// Time between two looks at the bars.
const LOOK: Duration = Duration::from_millis(250);

/// The bars that are told of, in the order in which they were made, each with its pace.
static BARS: Mutex<Vec<(WeakProgressBar, WorkPace)>> = Mutex::new(Vec::new());

/// The run whose work is told.
static WORK: OnceLock<Trace> = OnceLock::new();

/// A progress bar on standard error.
pub(super) fn progress_bar(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{msg:>12} [{bar:40}] {pos}/{len} {prefix}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ");
    bar.set_style(style);
    bar.set_message(what.to_owned());
    tell(&bar);
    bar
}

/// Shows what a search of several runs tells. Only one bar is shown at a time.
pub(super) fn show_news(bar: &RefCell<ProgressBar>, news: RunNews) {
    match news {
        RunNews::Says(text) => {
            bar.borrow().finish_and_clear();
            say!("{text}");
        }
        RunNews::Begins(name, steps) => bar.replace(progress_bar(steps, &name)).finish_and_clear(),
        RunNews::Stepped => bar.borrow().inc(1),
    }
}

pub(super) fn building_bar() -> ProgressBar {
    progress_bar(PrepareStage::COUNT, "building")
}

pub(super) fn show_stage(bar: &ProgressBar, stage: PrepareStage) {
    if let PrepareStage::Long { .. } = stage {
        say!("warning: {stage}");
        return;
    }
    bar.set_message(stage.to_string());
    bar.set_position(stage.number());
}

/// A counter on standard error for work of unknown length.
pub(super) fn spinner(what: &str) -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    let style = ProgressStyle::with_template("{msg:>12} {spinner} {human_pos} {prefix}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    bar.set_style(style);
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(120));
    tell(&bar);
    bar
}

/// A bar for the warm-up. A periodic one ends when it has met its change, and counts orbits.
pub(super) fn warm_up_bar(forecast: &Forecast) -> ProgressBar {
    if forecast.warm_up_is_most { spinner("warm-up orbits") } else { progress_bar(forecast.warm_up, "warm-up") }
}

/// Tells of a bar: in lines where standard error is no terminal, and behind the bar where it is one.
pub(super) fn tell(bar: &ProgressBar) {
    static TELLER: Once = Once::new();
    if let Ok(mut bars) = BARS.lock() {
        bars.push((bar.downgrade(), WorkPace::default()));
    }
    TELLER.call_once(|| {
        // A program without this thread is still right, only silent.
        let _ = std::thread::Builder::new().name("progress".to_owned()).spawn(tell_for_ever);
    });
}

/// Lets the lines tell what the loop of a run does.
pub(super) fn tell_work(trace: &Trace) {
    // A command has one run.
    let _ = WORK.set(trace.clone());
}

/// Lets the lines tell the work of this thread, until this is dropped.
pub(super) fn tell_work_here() -> OnTrack {
    let trace = Trace::begin(false);
    tell_work(&trace);
    trace.enter(Track::Host)
}

/// Looks at the bars, and tells of them.
fn tell_for_ever() {
    let (began, mut told) = (Instant::now(), Instant::now());
    loop {
        std::thread::sleep(LOOK);
        let now = began.elapsed().as_secs_f64();
        let Ok(mut bars) = BARS.lock() else { return };
        bars.retain(|(bar, _)| bar.upgrade().is_some_and(|bar| !bar.is_finished()));
        let mut seen = Vec::new();
        for (bar, pace) in bars.iter_mut() {
            let Some(bar) = bar.upgrade() else { continue };
            pace.see(now, bar.position());
            let left = length_of(&bar).map_or(String::new(), |length| pace.told(now, length));
            seen.push((bar, left));
        }
        drop(bars);
        let doing = WORK.get().map(Trace::doing).unwrap_or_default();
        if console::messages_are_seen() {
            show(&seen, &doing);
        } else if told.elapsed() >= EVERY {
            told = Instant::now();
            if let Some(line) = line(&seen, &doing) {
                say!("{line}");
            }
        }
    }
}

/// A bar, and the time that is left as it is told.
type Seen = (ProgressBar, String);

/// Shows the time that is left and the work behind the bar under way, and nothing behind the others.
fn show(bars: &[Seen], doing: &[String]) {
    bars.iter().for_each(|(bar, _)| bar.set_prefix(""));
    let under_way = bars.iter().filter(|(bar, _)| is_left(bar));
    if let Some((bar, left)) = under_way.max_by_key(|(bar, _)| bar.position() > 0) {
        let work = doing.iter().filter(|work| **work != bar.message()).cloned().collect::<Vec<_>>().join(", ");
        bar.set_prefix(format!("{} {work}", left.trim_start_matches(", ")).trim().to_owned());
    }
}

/// The line for the bars under way, and for the work of the loop. Before the first unit of work is done, the line tells of the first bar.
fn line(bars: &[Seen], doing: &[String]) -> Option<String> {
    let told = |(bar, left): &Seen| format!("{}{left}", text(bar));
    // The work tells more than a count of unknown length.
    let counts = |(bar, _): &&Seen| is_left(bar) && (doing.is_empty() || length_of(bar).is_some());
    let begun = bars.iter().filter(counts).filter(|(bar, _)| bar.position() > 0);
    let (names, begun): (Vec<String>, Vec<String>) = begun.map(|seen| (seen.0.message(), told(seen))).unzip();
    let work = doing.iter().filter(|work| !names.contains(work)).cloned().collect::<Vec<_>>().join(", ");
    let told = match (begun.is_empty(), work.is_empty()) {
        (true, true) => bars.iter().find(|(bar, _)| is_left(bar)).map(told)?,
        (true, false) => work,
        (false, true) => begun.join(", "),
        (false, false) => format!("{}; {work}", begun.join(", ")),
    };
    Some(format!("progress: {told}"))
}

/// Whether a bar is not at its end.
fn is_left(bar: &ProgressBar) -> bool {
    length_of(bar).is_none_or(|length| bar.position() < length)
}

/// The length of a bar. Work of unknown length has none, or a length of 0.
fn length_of(bar: &ProgressBar) -> Option<u64> {
    bar.length().filter(|length| *length > 0)
}

/// `steps 120 of 1000`.
fn text(bar: &ProgressBar) -> String {
    let (what, done) = (bar.message(), bar.position());
    length_of(bar).map_or_else(|| format!("{what} {done}"), |length| format!("{what} {done} of {length}"))
}

/// The flag of a command that can stop in order.
static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Longest wait for another program after a signal.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Longest time from the first signal to the end of the process. What was saved before stays.
const LONGEST_END: Duration = Duration::from_secs(30);

/// Exit code of a process that a signal ended.
const ENDED: i32 = 130;

/// A flag that the first Ctrl-C, SIGTERM or SIGHUP sets. The second ends the process at once.
pub(super) fn stop_flag() -> Arc<AtomicBool> {
    Arc::clone(STOP.get_or_init(Arc::default))
}

/// Handles signals. A command without a stop flag ends at once. No unfinished file stays.
pub(super) fn watch_signals() {
    let met = || {
        // A terminal shows the keys of Ctrl-C where its cursor is.
        say!("");
        match STOP.get() {
            Some(flag) if !flag.swap(true, Ordering::Relaxed) => {
                let seconds = LONGEST_END.as_secs();
                say!("stopping after this step, in {seconds} s at the latest; a second signal ends at once");
                // Without the thread a second signal still ends the process.
                let _ = std::thread::Builder::new().name("stop".to_owned()).spawn(end_late);
            }
            _ => end(""),
        }
    };
    // Without a handler a signal ends the process, which leaves unfinished files.
    let _ = watch(met);
}

/// Ends the process.
fn end(why: &str) -> ! {
    remove_unfinished();
    say!("stopped{why}");
    std::process::exit(ENDED);
}

/// Ends the process if the step under way does not come to its end, or once it waits for another program, which may never read.
fn end_late() -> ! {
    let signal = Instant::now();
    loop {
        std::thread::sleep(LONGEST_WAIT / 10);
        if signal.elapsed() > LONGEST_END {
            end(": the step under way takes too long");
        }
        if waited().is_some_and(|wait| wait > LONGEST_WAIT) {
            end(": nobody reads the output");
        }
    }
}

#[cfg(unix)]
fn watch(met: impl Fn() + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    // A file beyond the limit of `ulimit -f` then is an error of its writer, which names it, instead of the end of the process.
    signal_hook::flag::register(SIGXFSZ, Arc::default())?;
    let mut signals = vec![SIGINT, SIGTERM, SIGHUP];
    // `nohup` ignores SIGHUP, and that stays so. Scripts also ignore SIGINT for their background jobs, but one that is sent on purpose counts.
    signals.retain(|signal| *signal != SIGHUP || !is_ignored(*signal));
    let mut signals = signal_hook::iterator::Signals::new(signals)?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || signals.forever().for_each(|_| met()))?;
    Ok(())
}

/// Whether the process was started with a signal ignored. Only Linux tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(not(unix))]
fn watch(met: impl Fn() + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(met)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_of_what_is_under_way() {
        let bar = |what: &str, done: u64| {
            let bar = ProgressBar::hidden();
            bar.set_length(10);
            bar.set_message(what.to_owned());
            bar.set_position(done);
            bar
        };
        let told = |bars: &[ProgressBar], doing: &[&str]| {
            let seen: Vec<Seen> = bars.iter().map(|bar| (bar.clone(), String::new())).collect();
            line(&seen, &doing.iter().map(|work| (*work).to_owned()).collect::<Vec<_>>())
        };
        let is = |told: Option<String>, text: &str| assert_eq!(told, Some(format!("progress: {text}")));
        is(told(&[bar("warm-up", 0), bar("steps", 0)], &[]), "warm-up 0 of 10");
        is(told(&[bar("warm-up", 10), bar("steps", 3)], &[]), "steps 3 of 10");
        assert_eq!(told(&[bar("warm-up", 10)], &[]), None);
        let unknown = bar("warm-up", 5);
        unknown.set_length(0);
        is(told(&[unknown.clone(), bar("steps", 0)], &[]), "warm-up 5");
        let work = ["warm-up: orbit 2 of at most 40", "radiation between surfaces for pose 7", "casting rays"];
        is(told(&[unknown.clone(), bar("steps", 0)], &work), &work.join(", "));
        is(told(&[unknown, bar("steps", 4)], &["steps", "casting rays"]), "steps 4 of 10; casting rays");
        let spinner = ProgressBar::hidden();
        spinner.unset_length();
        spinner.set_message("time [s]");
        spinner.set_position(7);
        is(told(&[spinner], &[]), "time [s] 7");
    }
}
