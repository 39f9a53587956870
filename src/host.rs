//! What the host tells of its memory: how much is free, and how much this process had at its peak.

/// Bytes of memory that the host has free; `None` where the system does not tell.
pub fn free_memory() -> Option<u64> {
    kilobytes("/proc/meminfo", "MemAvailable:")
}

/// Bytes of memory that this process had at its peak; `None` where the system does not tell.
pub fn peak_memory() -> Option<u64> {
    kilobytes("/proc/self/status", "VmHWM:")
}

/// The value of a line such as `MemAvailable:   22247400 kB`, in bytes.
fn kilobytes(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?.trim();
    Some(line.strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
