//! What a file may expand to in memory. A reader charges what it is about to make, before it asks for the memory.

use std::cell::Cell;

use crate::host::free_memory;

/// Bytes in memory for each byte of a file.
const RATIO: u64 = 256;
/// Most bytes that DEFLATE makes of one, rounded up: an image without a craft comes near this.
const DEFLATE: u64 = 1040;
/// Bytes that every file may expand to, however short it is.
pub(crate) const FLOOR: u64 = 256 << 20;
/// Most bytes that any file expands to. Three quarters of the free memory are a bound too.
const MOST: u64 = 16 << 30;

/// The contents of a file take more memory than they may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the file has {size} bytes, and its contents take more than {most}, the most that they may")]
pub(crate) struct Expands {
    size: u64,
    most: u64,
}

/// What is left of the bytes that a file may expand to.
#[derive(Debug)]
pub(crate) struct Expansion {
    size: u64,
    most: u64,
    left: Cell<u64>,
}

impl Expansion {
    /// A file of `size` bytes.
    pub(crate) fn of(size: usize) -> Self {
        Self::by(size, RATIO)
    }

    /// An image of `size` bytes in a format that isotherm writes, PNG or EXR.
    pub(crate) fn of_image(size: usize) -> Self {
        Self::by(size, DEFLATE)
    }

    fn by(size: usize, ratio: u64) -> Self {
        let size = size as u64;
        let free = free_memory().map_or(MOST, |free| free / 4 * 3);
        let most = size.saturating_mul(ratio).clamp(FLOOR, MOST).min(free);
        Self { size, most, left: Cell::new(most) }
    }

    /// Most bytes in all.
    pub(crate) fn most(&self) -> usize {
        usize::try_from(self.most).unwrap_or(usize::MAX)
    }

    /// Counts `count` things of `each` bytes.
    ///
    /// # Errors
    /// [`Expands`] where more than the bound is asked for, in one charge or in all of them.
    pub(crate) fn charge(&self, count: usize, each: usize) -> Result<(), Expands> {
        let bytes = (count as u64).saturating_mul(each as u64);
        match self.left.get().checked_sub(bytes) {
            Some(left) => {
                self.left.set(left);
                Ok(())
            }
            None => Err(Expands { size: self.size, most: self.most }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charges_add_up_to_the_bound_and_no_further() {
        let expansion = Expansion::of(10);
        assert_eq!(expansion.most(), FLOOR as usize);
        expansion.charge(FLOOR as usize / 2, 1).unwrap();
        let message = expansion.charge(FLOOR as usize / 2 + 1, 1).unwrap_err().to_string();
        assert!(message.contains("has 10 bytes") && message.contains("268435456"), "{message}");
        // A charge that was refused takes nothing.
        expansion.charge(FLOOR as usize / 2, 1).unwrap();
        assert!(expansion.charge(1, 1).is_err());
        assert!(Expansion::of(10).charge(usize::MAX, usize::MAX).is_err());
    }

    #[test]
    fn a_long_file_may_expand_to_more() {
        let most = |expansion: Expansion| expansion.most() as u64;
        assert_eq!(most(Expansion::of(2 << 20)), 512 << 20);
        assert_eq!(most(Expansion::of_image(1 << 19)), DEFLATE << 19);
        assert!(most(Expansion::of(usize::MAX)) <= MOST);
    }
}
