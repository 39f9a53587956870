//! Measures speed and error together, and shows them on one page.
//!
//! `plan` lists the measurements and `run` does them, with `clock` as the time limit of a quick run. `limits`
//! measures the device, `responses` a node, `frames` a whole step, `models` each model choice, and `drivers`
//! the differences between devices. `hard` has the cases that fail without remedies. `cases` are four networks,
//! `schemes` the ways to integrate them. `integrators` compares each with `truth`. `record` holds all results.
//! `tables`, `plots`, `page` and `files` show them.

pub mod cases;
mod clock;
mod drivers;
pub mod files;
mod frames;
mod frontier;
pub mod hard;
pub mod integrators;
mod limits;
pub mod models;
mod page;
pub(crate) mod plan;
mod plots;
pub mod record;
pub mod responses;
pub(crate) mod run;
pub mod schemes;
pub mod tables;
pub mod truth;
