//! Runs a decoder of another crate. If it panics on a damaged file, that is an error of the file.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs `work` on this thread. A panic on another thread would end the program.
///
/// # Errors
/// An error of `work`, or its panic.
pub(crate) fn decode<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err("is damaged: the decoder gave up".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        assert_eq!(decode(|| Ok(1)), Ok(1));
        assert_eq!(decode::<()>(|| Err("no".to_owned())), Err("no".to_owned()));
        assert!(decode::<()>(|| panic!("on purpose")).is_err());
    }
}
