//! Progress on standard error, and signals. A terminal shows bars. A file or pipe gets a line every 10 seconds.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once, OnceLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, WeakProgressBar};

use crate::output::console::{self, say};
use crate::output::temporary::remove_unfinished;
use crate::output::waiting::waited;
use crate::simulation::prepare_error::PrepareStage;

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(10);

/// The bars that the lines tell of, in the order in which they were made.
static BARS: Mutex<Vec<WeakProgressBar>> = Mutex::new(Vec::new());

/// A progress bar on standard error.
pub(super) fn progress_bar(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{msg:>12} [{bar:40}] {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ");
    bar.set_style(style);
    bar.set_message(what.to_owned());
    tell(&bar);
    bar
}

pub(super) fn building_bar() -> ProgressBar {
    progress_bar(PrepareStage::COUNT, "building")
}

pub(super) fn show_stage(bar: &ProgressBar, stage: PrepareStage) {
    bar.set_message(stage.to_string());
    bar.set_position(stage.number());
}

/// A counter on standard error for work of unknown length.
pub(super) fn spinner(what: &str) -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    let style = ProgressStyle::with_template("{msg:>12} {spinner} {human_pos}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    bar.set_style(style);
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(120));
    tell(&bar);
    bar
}

/// Tells of a bar in lines, where standard error is no terminal.
pub(super) fn tell(bar: &ProgressBar) {
    static TELLER: Once = Once::new();
    if console::messages_are_seen() {
        return;
    }
    if let Ok(mut bars) = BARS.lock() {
        bars.push(bar.downgrade());
    }
    TELLER.call_once(|| {
        // A program without this thread is still right, only silent.
        let _ = std::thread::Builder::new().name("progress".to_owned()).spawn(|| {
            loop {
                std::thread::sleep(EVERY);
                let Ok(mut bars) = BARS.lock() else { return };
                bars.retain(|bar| bar.upgrade().is_some_and(|bar| !bar.is_finished()));
                let line = line(&bars.iter().filter_map(WeakProgressBar::upgrade).collect::<Vec<_>>());
                drop(bars);
                if let Some(line) = line {
                    say!("{line}");
                }
            }
        });
    });
}

/// The line for the bars under way. Before the first unit of work is done, the line tells of the first bar.
fn line(bars: &[ProgressBar]) -> Option<String> {
    let left = |bar: &&ProgressBar| length_of(bar).is_none_or(|length| bar.position() < length);
    let begun = bars.iter().filter(left).filter(|bar| bar.position() > 0).map(text);
    let begun = begun.collect::<Vec<_>>().join(", ");
    if begun.is_empty() { bars.iter().find(left).map(text) } else { Some(begun) }
}

/// The length of a bar. Work of unknown length has none, or a length of 0.
fn length_of(bar: &ProgressBar) -> Option<u64> {
    bar.length().filter(|length| *length > 0)
}

/// A longer rest [s] is not told: the estimate grows without bound while a step takes very long.
const LONGEST_REST: u64 = 30 * 86_400;

/// `steps: 120 of 1000, 44 s left`.
fn text(bar: &ProgressBar) -> String {
    let (what, done) = (bar.message(), bar.position());
    let Some(length) = length_of(bar) else { return format!("progress: {what} {done}") };
    let eta = bar.eta().as_secs();
    let eta = if done > 0 && (1..LONGEST_REST).contains(&eta) { format!(", {eta} s left") } else { String::new() };
    format!("progress: {what} {done} of {length}{eta}")
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
        let told = |bars: &[ProgressBar]| line(bars).map(|line| line.split(" s left").next().unwrap_or("").to_owned());
        assert_eq!(told(&[bar("warm-up", 0), bar("steps", 0)]), Some("progress: warm-up 0 of 10".to_owned()));
        assert!(told(&[bar("warm-up", 10), bar("steps", 3)]).unwrap().starts_with("progress: steps 3 of 10"));
        assert_eq!(told(&[bar("warm-up", 10)]), None);
        let unknown = bar("warm-up", 5);
        unknown.set_length(0);
        assert_eq!(told(&[unknown, bar("steps", 0)]), Some("progress: warm-up 5".to_owned()));
        let spinner = ProgressBar::hidden();
        spinner.unset_length();
        spinner.set_message("time [s]");
        spinner.set_position(7);
        assert_eq!(told(&[spinner]), Some("progress: time [s] 7".to_owned()));
    }
}
