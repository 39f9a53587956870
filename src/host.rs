//! Free and peak memory of the host, and the load of its processors.

/// Free memory of the host [bytes]. `None` where the system does not report it.
pub(crate) fn free_memory() -> Option<u64> {
    kilobytes("/proc/meminfo", "MemAvailable:")
}

/// Peak memory of this process [bytes]. `None` where the system does not report it.
pub fn peak_memory() -> Option<u64> {
    kilobytes("/proc/self/status", "VmHWM:")
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
}
