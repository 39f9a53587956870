//! Values of past steps in bounded memory. Where they do not fit, every second step is dropped.

use std::collections::BTreeMap;

/// Values of steps. The value of step 0 is never dropped.
pub(crate) struct Kept<T> {
    values: BTreeMap<u32, (T, usize)>,
    /// Only multiples of this number are kept.
    every: u32,
    bytes: usize,
    most: usize,
}

impl<T> Kept<T> {
    /// Nothing yet. Steps are kept that are a multiple of `every`, in about `most` bytes.
    pub(crate) fn new(every: u32, most: usize) -> Self {
        Self { values: BTreeMap::new(), every: every.max(1), bytes: 0, most }
    }

    /// Whether the value of a step is wanted.
    pub(crate) fn wants(&self, step: u32) -> bool {
        step.is_multiple_of(self.every) && !self.values.contains_key(&step)
    }

    /// Keeps the value of a step, which takes so many bytes.
    pub(crate) fn keep(&mut self, step: u32, value: T, bytes: usize) {
        if !self.wants(step) {
            return;
        }
        self.bytes += bytes;
        self.values.insert(step, (value, bytes));
        while self.bytes > self.most && self.values.len() > 1 {
            self.every = self.every.saturating_mul(2);
            let every = self.every;
            self.values.retain(|step, _| step.is_multiple_of(every));
            self.bytes = self.values.values().map(|(_, bytes)| bytes).sum();
        }
    }

    /// The last step up to a step, and its value.
    pub(crate) fn before(&self, step: u32) -> Option<(u32, &T)> {
        self.values.range(..=step).next_back().map(|(step, (value, _))| (*step, value))
    }

    /// Steps and values in order.
    pub(crate) fn all(&self) -> impl Iterator<Item = (u32, &T)> {
        self.values.iter().map(|(step, (value, _))| (*step, value))
    }
}

#[cfg(test)]
mod tests {
    use super::Kept;

    #[test]
    fn memory_is_bounded_and_the_beginning_stays() {
        let mut kept = Kept::new(1, 100);
        for step in 0..1000 {
            kept.keep(step, step, 10);
        }
        let steps: Vec<u32> = kept.all().map(|(step, _)| step).collect();
        assert!(steps.len() <= 10 && steps.len() >= 5, "{steps:?}");
        assert_eq!(steps[0], 0);
        assert!(kept.all().all(|(step, value)| step == *value));
        let gaps: Vec<u32> = steps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(gaps.iter().all(|gap| *gap == gaps[0]), "{gaps:?}");
        assert_eq!(kept.before(steps[3] + 1), Some((steps[3], &steps[3])));
        assert!(!kept.wants(steps[3]));
    }

    #[test]
    fn one_value_too_large_for_the_bound_stays() {
        let mut kept = Kept::new(4, 10);
        kept.keep(0, 'a', 50);
        kept.keep(4, 'b', 50);
        assert_eq!(kept.before(9), Some((0, &'a')));
        assert!(!kept.wants(3));
    }
}
