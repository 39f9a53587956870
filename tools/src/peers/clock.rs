//! Measures wall time, and processor time of this program, which does not depend on other programs.

use std::time::Instant;

/// A running measurement.
pub struct Clock {
    began: Instant,
    busy: f64,
}

impl Clock {
    pub fn start() -> Self {
        let busy = processor_ms();
        Self { began: Instant::now(), busy }
    }

    /// Wall time and processor time [ms].
    pub fn stop(&self) -> [f64; 2] {
        let elapsed = self.began.elapsed().as_secs_f64() * 1e3;
        [elapsed, processor_ms() - self.busy]
    }
}

/// Sum over the living threads (first number of `/proc/self/task/*/schedstat` [ns]). NaN if the system does not provide
/// it.
fn processor_ms() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return f64::NAN };
    let one = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    let nanoseconds: Option<f64> = tasks.flatten().map(one).sum();
    nanoseconds.map_or(f64::NAN, |nanoseconds| nanoseconds * 1e-6)
}
