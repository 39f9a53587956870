//! Measurements of a run in bounded memory.

use std::ops::Deref;

/// Samples in order of time. Beyond a bound every second one is dropped, and later ones are taken half as often.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Samples<T> {
    kept: Vec<T>,
    most: usize,
    /// One of so many samples is kept.
    every: u64,
    offered: u64,
    count: u64,
}

impl<T: Copy> Samples<T> {
    /// No samples yet, and at most so many at any time.
    pub(crate) fn at_most(most: usize) -> Self {
        Self { kept: Vec::new(), most: most.max(2), every: 1, offered: 0, count: 0 }
    }

    /// Changes the bound.
    pub(crate) fn bound(&mut self, most: usize) {
        self.most = most.max(2);
        while self.kept.len() > self.most {
            self.thin();
        }
    }

    /// Adds a sample.
    pub(crate) fn push(&mut self, sample: T) {
        if self.offered.is_multiple_of(self.every) {
            if self.kept.len() >= self.most {
                self.thin();
            }
            if self.offered.is_multiple_of(self.every) {
                self.kept.push(sample);
            }
        }
        self.offered += 1;
        self.count += 1;
    }

    /// Counts something that was not measured.
    pub(crate) fn skip(&mut self) {
        self.count += 1;
    }

    fn thin(&mut self) {
        let mut number = 0;
        self.kept.retain(|_| {
            number += 1;
            number % 2 == 1
        });
        self.every = self.every.saturating_mul(2);
    }

    /// Number of samples so far, with those that were dropped or skipped.
    pub fn count(&self) -> u64 {
        self.count
    }
}

impl<T> Default for Samples<T> {
    fn default() -> Self {
        Self { kept: Vec::new(), most: usize::MAX, every: 1, offered: 0, count: 0 }
    }
}

impl<T> Deref for Samples<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stay_even_and_few() {
        let mut samples = Samples::at_most(100);
        (0..100_000u32).for_each(|value| samples.push(value));
        samples.skip();
        assert_eq!(samples.count(), 100_001);
        assert!((50..=100).contains(&samples.len()), "{}", samples.len());
        let every = samples.every as u32;
        assert!(samples.windows(2).all(|pair| pair[1] - pair[0] == every) && samples[0] == 0);
        let mut all = Samples::default();
        (0..1000u32).for_each(|value| all.push(value));
        assert_eq!(all.len(), 1000);
    }
}
