//! The tests of `src/held.rs`. A library for Python has no test program of its own.

#[path = "../src/held.rs"]
#[allow(dead_code, reason = "the package uses all of it")]
mod held;
