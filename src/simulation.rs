//! The loop: step, draw, collect.
