//! Time that is left of counted work. The time is told only while units end at a steady rate.

/// Units that must have ended before a time is told, as a share of all of them.
const LEAST_SHARE: f64 = 0.05;
/// Time over which units must have ended before a time is told [s].
const LEAST_TIME: f64 = 2.0;
/// Most by which the rate of the later half of the units may differ from the rate of all of them.
const STEADY: f64 = 1.5;
/// Nothing is told after so many times the usual time of a unit without an end.
const STALLED: f64 = 3.0;
/// Most ends that are kept.
const MOST: usize = 512;

/// When units of work ended: time [s], and how many had ended.
#[derive(Debug, Default)]
pub(super) struct WorkPace(Vec<(f64, u64)>);

impl WorkPace {
    /// Sees that `done` units have ended by a time [s].
    pub(crate) fn see(&mut self, now: f64, done: u64) {
        if self.0.last().map_or(0, |last| last.1) < done {
            self.0.push((now, done));
        }
        if self.0.len() > MOST {
            let mut number = 0;
            self.0.retain(|_| {
                number += 1;
                number % 2 == 1
            });
        }
    }

    /// Time that is left of `length` units [s]. `None` where units end at no steady rate, or none has ended for long.
    fn left(&self, now: f64, length: u64) -> Option<f64> {
        let ((first, before), (last, done)) = (*self.0.first()?, *self.0.last()?);
        let ended = done - before;
        let (middle, by_middle) = *self.0.iter().find(|(_, done)| done - before >= ended / 2)?;
        let rate = |from: f64, units: u64| (last - from) / units.max(1) as f64;
        let (all, later) = (rate(first, ended), rate(middle, done - by_middle));
        let steady = later > 0.0 && (all / later).max(later / all) <= STEADY;
        let long = last - first >= LEAST_TIME && ended as f64 >= LEAST_SHARE * length as f64;
        let since = now - last;
        let goes_on = since <= STALLED * later.max(LEAST_TIME / STALLED);
        (steady && long && goes_on).then(|| (length.saturating_sub(done) as f64 * later - since).max(0.0))
    }

    /// `, about 44 s left`, or nothing.
    pub(crate) fn told(&self, now: f64, length: u64) -> String {
        self.left(now, length).map_or(String::new(), |left| format!(", about {} left", duration(left)))
    }
}

/// A time to one or two digits.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "1 s".to_owned(),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3600.0),
        s => format!("{:.0} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The times told for units that take these times [s], seen every quarter of a second, each with the time that was left.
    fn told(lengths: &[f64]) -> Vec<(f64, f64)> {
        let mut ends: Vec<f64> = Vec::new();
        lengths.iter().for_each(|length| ends.push(ends.last().unwrap_or(&0.0) + length));
        let end = ends.last().copied().unwrap_or(0.0);
        let mut pace = WorkPace::default();
        let looks = (0..).map(|look| 0.25 * f64::from(look)).take_while(|now| *now < end);
        looks
            .filter_map(|now| {
                pace.see(now, ends.iter().filter(|end| **end <= now).count() as u64);
                Some((pace.left(now, lengths.len() as u64)?, end - now))
            })
            .collect()
    }

    #[test]
    fn a_time_is_told_within_a_factor_of_two_or_not_at_all() {
        let steady = vec![0.1; 600];
        let slow_at_first = [vec![1.5; 12], vec![0.1; 600]].concat();
        let with_images: Vec<f64> = (0..400).map(|step| if step % 10 == 0 { 0.5 } else { 0.05 }).collect();
        for (name, lengths) in [("steady", steady), ("slow at first", slow_at_first), ("with images", with_images)] {
            let told = told(&lengths);
            assert!(told.len() > 40, "{name}: {} times", told.len());
            let wrong =
                told.iter().find(|(left, exact)| (left - exact).abs() > 1.0 && (left / exact).max(exact / left) > 2.0);
            assert_eq!(wrong, None, "{name}");
        }
    }

    #[test]
    fn times_have_units() {
        for (seconds, text) in [(0.2, "1 s"), (90.0, "90 s"), (600.0, "10 min"), (36_000.0, "10 h"), (1e6, "12 days")] {
            assert_eq!(duration(seconds), text);
        }
    }

    #[test]
    fn nothing_is_told_while_nothing_ends() {
        let mut pace = WorkPace::default();
        (1..=100).for_each(|done| pace.see(0.1 * done as f64, done));
        assert_eq!(pace.told(10.0, 200), ", about 10 s left");
        assert_eq!(pace.told(11.0, 200), ", about 9 s left");
        assert_eq!(pace.told(13.0, 200), "");
        // A single unit says nothing of the others.
        let mut pace = WorkPace::default();
        pace.see(3.0, 1);
        assert_eq!(pace.told(4.0, 40), "");
    }
}
