//! Free and peak memory of the host, the memory that this process may take, and the load of the processors.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// Free memory of the host, within the address space of this process [bytes]. `None` where the system does not report it.
pub(crate) fn free_memory() -> Option<u64> {
    let free = kilobytes("/proc/meminfo", "MemAvailable:")?;
    Some(address_space_left().map_or(free, |left| left.min(free)))
}

/// Memory of this process [bytes].
pub(crate) fn resident_memory() -> Option<u64> {
    kilobytes("/proc/self/status", "VmRSS:")
}

/// Address space that a limit (`ulimit -v`) leaves to this process [bytes]. `None` without a limit.
fn address_space_left() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let most: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(most.saturating_sub(kilobytes("/proc/self/status", "VmSize:")?))
}

/// Peak memory of this process [bytes]. `None` where the system does not report it.
pub fn peak_memory() -> Option<u64> {
    kilobytes("/proc/self/status", "VmHWM:")
}

/// Processor time of all threads of this process so far. `None` where the system does not report it.
pub(crate) fn processor_time() -> Option<Duration> {
    #[cfg(unix)]
    return Duration::try_from(rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime)).ok();
    #[cfg(not(unix))]
    None
}

/// Share of the free memory that a process takes unless it is told otherwise.
const SHARE: f64 = 0.75;
/// Sessions of a server that fit into the memory of a process.
const SESSIONS: u64 = 4;
/// Smaller requests are not checked [bytes].
const SMALL: u64 = 1 << 20;

/// Memory that this process may take [bytes]. `None` where the system does not report any.
static BUDGET: OnceLock<Option<u64>> = OnceLock::new();

/// A request that would take more memory than there may be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} needs {} MiB of memory; {} of the {} MiB of {whose} are left (--max-memory)", .bytes >> 20, .left >> 20, .budget >> 20)]
pub struct OverBudget {
    /// The request, in words.
    pub(crate) what: String,
    /// Memory that it needs [bytes].
    pub(crate) bytes: u64,
    /// Memory that is left [bytes].
    pub(crate) left: u64,
    /// Memory that there may be in all [bytes].
    pub(crate) budget: u64,
    /// Whose memory it is, in words.
    pub(crate) whose: &'static str,
}

/// Sets the memory that this process may take [bytes], before anything asks for it.
pub(crate) fn set_memory_budget(bytes: u64) {
    // A budget that stands already is the same: the command line has one.
    let _ = BUDGET.set(Some(bytes));
}

/// Memory that this process may take [bytes].
fn memory_budget() -> Option<u64> {
    *BUDGET.get_or_init(|| Some((SHARE * free_memory()? as f64) as u64 + resident_memory()?))
}

/// Memory that was promised to large requests under way.
struct Promised {
    bytes: u64,
    /// Memory of this process when the first of them came [bytes].
    before: u64,
}

static PROMISED: Mutex<Promised> = Mutex::new(Promised { bytes: 0, before: 0 });

fn promised() -> MutexGuard<'static, Promised> {
    PROMISED.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Promised {
    /// Memory that this process may still take, beside the part of the promises that is not taken yet [bytes].
    fn left(&self) -> Option<u64> {
        let resident = resident_memory()?;
        let left = memory_budget()?.saturating_sub(resident).min(free_memory()?);
        let ahead = if self.bytes > 0 { (self.before + self.bytes).saturating_sub(resident) } else { 0 };
        Some(left.saturating_sub(ahead))
    }
}

/// Memory that this process may still take [bytes]. `None` where the system does not report any.
pub(crate) fn memory_left() -> Option<u64> {
    promised().left()
}

/// Memory that is kept for a large request as long as this lives.
#[derive(Debug)]
pub(crate) struct Reservation(u64);

impl Drop for Reservation {
    fn drop(&mut self) {
        promised().bytes -= self.0;
    }
}

/// Keeps memory for a large request, so that several at once find room only for all of them. `what` names the request.
///
/// # Errors
/// The process would take more memory than it may, or the system gives none.
pub(crate) fn reserve_memory(bytes: u64, what: impl FnOnce() -> String) -> Result<Reservation, OverBudget> {
    let mut promised = promised();
    if bytes > SMALL
        && let Some((budget, left)) = memory_budget().zip(promised.left())
    {
        let refused = |what: String| OverBudget { what, bytes, left, budget, whose: "this process" };
        if bytes > left {
            return Err(refused(what()));
        }
        // The system may refuse what it reports as free. A piece that nobody touches costs nothing.
        if Vec::<u8>::new().try_reserve_exact(usize::try_from(bytes).unwrap_or(usize::MAX)).is_err() {
            return Err(refused(format!("{}, for which the system gives no memory,", what())));
        }
    }
    if promised.bytes == 0 {
        promised.before = resident_memory().unwrap_or_default();
    }
    promised.bytes += bytes;
    Ok(Reservation(bytes))
}

/// Checks a large request before it is made. `what` names it.
///
/// # Errors
/// The process would take more memory than it may.
pub(crate) fn check_memory(bytes: u64, what: impl FnOnce() -> String) -> Result<(), OverBudget> {
    reserve_memory(bytes, what).map(drop)
}

/// The same for everything that a session of a server asks for together: its share is a fourth.
///
/// # Errors
/// The session or the process would take more memory than it may.
pub(crate) fn check_session_memory(bytes: u64, what: impl Fn() -> String) -> Result<(), OverBudget> {
    match memory_budget().map(|budget| budget / SESSIONS) {
        Some(budget) if bytes > budget => {
            Err(OverBudget { what: what(), bytes, left: budget, budget, whose: "a session" })
        }
        _ => check_memory(bytes, what),
    }
}

/// Work of all processors since the machine started, in units of the kernel's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ProcessorTime {
    /// Work that was asked for, both done and waiting for other guests of the same host.
    pub(crate) asked: u64,
    /// Part of it that waited.
    pub(crate) stolen: u64,
}

impl ProcessorTime {
    /// The work until now. `None` where the system does not report it.
    pub(crate) fn now() -> Option<Self> {
        Self::of(&std::fs::read_to_string("/proc/stat").ok()?)
    }

    /// Fields of the first line of /proc/stat (proc(5)): user, nice, system, idle, iowait, irq, softirq, steal.
    fn of(stat: &str) -> Option<Self> {
        let line = stat.lines().next()?.strip_prefix("cpu ")?;
        let times: Vec<u64> = line.split_whitespace().map_while(|time| time.parse().ok()).collect();
        let [user, nice, system, _idle, _waiting, interrupt, soft, stolen, ..] = times[..] else { return None };
        Some(Self { asked: user + nice + system + interrupt + soft + stolen, stolen })
    }

    /// Share of the work since an earlier time that waited for other guests. `None` where no work was asked for.
    pub(crate) fn stolen_since(self, earlier: Self) -> Option<f64> {
        let asked = self.asked.saturating_sub(earlier.asked);
        (asked > 0).then(|| self.stolen.saturating_sub(earlier.stolen) as f64 / asked as f64)
    }
}

/// Ticks in a second of the times of `/proc/self/stat` (proc(5)): Linux fixes them for programs.
const TICKS: f64 = 100.0;

/// Processor time of this process over all its threads [s]. `None` where the system does not report it.
pub(crate) fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program is in parentheses and may hold spaces.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / TICKS)
}

/// The value of a line such as `MemAvailable:   22247400 kB`, in bytes.
fn kilobytes(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?.trim();
    Some(line.strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_other_guests_take_is_a_share_of_what_was_asked_for() {
        let before = ProcessorTime::of("cpu  100 10 20 5000 7 1 2 30 0 0\ncpu0 1 2 3\n").expect("a line of /proc/stat");
        assert_eq!(before, ProcessorTime { asked: 163, stolen: 30 });
        let after = ProcessorTime::of("cpu  160 10 20 9000 7 1 2 50 0 0\n").expect("a line of /proc/stat");
        assert_eq!(after.stolen_since(before), Some(0.25));
        assert_eq!(after.stolen_since(after), None);
        assert_eq!(ProcessorTime::of("cpu 1 2 3\n"), None);
    }

    #[test]
    fn a_request_beyond_the_memory_names_itself() {
        let free = free_memory().expect("Linux tells");
        let refused = check_memory(free + (1 << 30), || "an image of 9 x 9 pixels".to_owned()).unwrap_err();
        assert!(refused.left <= free && refused.budget < free + (1 << 34), "{refused:?}");
        let said = refused.to_string();
        assert!(
            said.starts_with("an image of 9 x 9 pixels needs ") && said.ends_with("are left (--max-memory)"),
            "{said}"
        );
        assert_eq!(check_memory(SMALL, || unreachable!("it is small")), Ok(()));
        assert_eq!(check_memory(2 * SMALL, || unreachable!("it fits")), Ok(()));
        let budget = memory_budget().expect("Linux tells");
        // What one request was promised is not left for the next.
        let half = memory_left().expect("Linux tells") / 5 * 3;
        let first = reserve_memory(half, || "the first".to_owned()).expect("it fits");
        let refused = reserve_memory(half, || "the second".to_owned()).unwrap_err();
        assert!(refused.what == "the second" && refused.left < half, "{refused:?}");
        drop(first);
        drop(reserve_memory(half, || unreachable!("the first has gone")).expect("it fits now"));
        let refused = check_session_memory(budget / 3, || "eight images".to_owned()).unwrap_err();
        assert_eq!((refused.whose, refused.budget), ("a session", budget / 4));
    }
}
