//! Measures speed and error together, and shows them on one page.
//!
//! `plan` lists the measurements and `run` does them, with `clock` as the time limit of a quick run. `limits`
//! measures the device, `responses` a node, `frames` a whole step, `models` each model choice, and `drivers`
//! the differences between devices. `hard` has the cases that fail without remedies. `cases` are four networks,
//! `schemes` the ways to integrate them. `integrators` compares each with `truth`. `record` holds all results.
//! `tables`, `plots`, `page` and `files` show them.

pub(crate) mod cases;
mod clock;
mod drivers;
pub(crate) mod files;
mod frames;
mod frontier;
pub(crate) mod hard;
pub(crate) mod integrators;
mod limits;
pub(crate) mod models;
mod page;
pub(crate) mod plan;
mod plots;
pub(crate) mod record;
pub(crate) mod responses;
pub(crate) mod run;
pub(crate) mod schemes;
pub(crate) mod tables;
pub(crate) mod truth;
