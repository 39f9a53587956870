//! The folder of the copied file.

pub mod gpu;
