//! What several tools use.

pub mod section;
