//! The positions of joints step after step, made as they are asked for.
//!
//! Two blocks of steps are kept, the present one and the one before. Positions at even distances are kept too, so that an earlier time need not be walked to from
//! the start. When they are too many, every second one is dropped. The memory is therefore bounded however many steps there are.

use std::sync::{Mutex, MutexGuard, PoisonError};

const BLOCK: u64 = 1024;
/// Most positions at even distances.
const MOST_MARKS: usize = 2048;

#[derive(Debug, Default)]
pub(crate) struct JointTrack {
    start: f64,
    first: Vec<f64>,
    memory: Mutex<WalkMemory>,
}

/// The positions of a walk that are kept.
#[derive(Debug, Default)]
struct WalkMemory {
    /// Blocks by number, the present one last. Each has the positions at its steps and at the first step of the next block.
    blocks: Vec<(u64, Vec<Vec<f64>>)>,
    /// Positions at every `spacing` blocks.
    marks: Vec<Vec<f64>>,
    spacing: u64,
}

/// Equality compares the starts only, because the kept positions follow from them.
impl PartialEq for JointTrack {
    fn eq(&self, other: &Self) -> bool {
        (self.start, &self.first) == (other.start, &other.first)
    }
}

impl Clone for JointTrack {
    fn clone(&self) -> Self {
        Self::new(self.start, self.first.clone())
    }
}

impl JointTrack {
    /// A walk from a time [s] and the positions at that time.
    pub(crate) fn new(start: f64, first: Vec<f64>) -> Self {
        let memory = WalkMemory { blocks: Vec::new(), marks: vec![first.clone()], spacing: 1 };
        Self { start, first, memory: Mutex::new(memory) }
    }

    /// Time at which it starts [s].
    pub(crate) fn start(&self) -> f64 {
        self.start
    }

    /// Positions after `number` steps and after one more. `next` gives the positions after a number of steps from the positions one step before.
    pub(crate) fn pair(&self, number: u64, next: &dyn Fn(u64, &[f64]) -> Vec<f64>) -> [Vec<f64>; 2] {
        let mut memory = self.seen();
        let block = memory.block(number / BLOCK, next);
        let place = (number % BLOCK) as usize;
        [block[place].clone(), block[place + 1].clone()]
    }

    #[cfg(test)]
    pub(crate) fn stored(&self) -> usize {
        let memory = self.seen();
        let blocks = memory.blocks.iter().flat_map(|(_, block)| block).map(Vec::len).sum::<usize>();
        blocks + memory.marks.iter().map(Vec::len).sum::<usize>()
    }

    /// A thread that ended by a panic leaves nothing half done that matters: blocks and marks are put in whole.
    fn seen(&self) -> MutexGuard<'_, WalkMemory> {
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl WalkMemory {
    /// A block, walked to from the nearest known positions before it.
    fn block(&mut self, wanted: u64, next: &dyn Fn(u64, &[f64]) -> Vec<f64>) -> &[Vec<f64>] {
        if let Some(known) = self.blocks.iter().position(|(number, _)| *number == wanted) {
            return &self.blocks[known].1;
        }
        let mark = (wanted / self.spacing).min(self.marks.len() as u64 - 1);
        let ended = |(number, block): &(u64, Vec<Vec<f64>>)| Some((number + 1, block.last()?.clone()));
        let ends = self.blocks.iter().filter_map(ended).filter(|(number, _)| *number <= wanted);
        let (mut number, mut now) = ends
            .max_by_key(|(number, _)| *number)
            .filter(|(number, _)| *number >= mark * self.spacing)
            .unwrap_or_else(|| (mark * self.spacing, self.marks[mark as usize].clone()));
        loop {
            self.mark(number, &now);
            if number == wanted {
                break;
            }
            for step in number * BLOCK..(number + 1) * BLOCK {
                now = next(step + 1, &now);
            }
            number += 1;
        }
        let mut block = vec![now];
        for step in wanted * BLOCK..(wanted + 1) * BLOCK {
            let after = next(step + 1, &block[block.len() - 1]);
            block.push(after);
        }
        if self.blocks.len() > 1 {
            self.blocks.remove(0);
        }
        self.blocks.push((wanted, block));
        &self.blocks[self.blocks.len() - 1].1
    }

    /// Keeps the positions at the start of a block where they are the next at their distance.
    fn mark(&mut self, block: u64, now: &[f64]) {
        if block != self.marks.len() as u64 * self.spacing {
            return;
        }
        self.marks.push(now.to_vec());
        if self.marks.len() > MOST_MARKS {
            let mut number = 0;
            self.marks.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.spacing *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// A walk whose position depends on the whole way: x -> 3.9 x (1 - x), which forgets nothing.
    fn step(_: u64, last: &[f64]) -> Vec<f64> {
        last.iter().map(|x| 3.9 * x * (1.0 - x)).collect()
    }

    #[test]
    fn any_order_gives_the_bits_of_the_whole_walk() {
        let mut whole = vec![vec![0.3, 0.7]];
        for number in 0..20_000 {
            let next = step(number, &whole[number as usize]);
            whole.push(next);
        }
        let track = JointTrack::new(0.0, whole[0].clone());
        for number in [0, 1, 1023, 1024, 1025, 9000, 8999, 3, 19_998, 2048, 5000, 4999, 5000, 0] {
            let expected = [whole[number as usize].clone(), whole[number as usize + 1].clone()];
            assert_eq!(track.pair(number, &step), expected, "step {number}");
        }
        assert_ne!(track.pair(7, &step)[0], whole[8], "a step beside shows");
        assert_eq!(track, track.clone());
    }

    /// Five million steps, forwards, and then back: what is kept stays below 4096 positions of blocks and as many marks.
    #[test]
    fn what_is_kept_does_not_grow() {
        let made = Cell::new(0u64);
        let count = |_: u64, last: &[f64]| {
            made.set(made.get() + 1);
            vec![last[0] + 1.0]
        };
        let track = JointTrack::new(0.0, vec![0.0]);
        let all = 5_000_000;
        for number in (0..all).step_by(4) {
            let [a, b] = track.pair(number, &count);
            assert!(a[0] == number as f64 && b[0] == a[0] + 1.0);
        }
        assert!(made.get() < all + 3 * BLOCK, "{} steps were made", made.get());
        assert!(track.stored() < 2 * 1025 + MOST_MARKS + 1, "{}", track.stored());
        made.set(0);
        assert_eq!(track.pair(17, &count)[0], [17.0]);
        // The distance of marks is four blocks by now.
        assert!(made.get() <= 5 * BLOCK, "{} steps were made again", made.get());
    }
}
