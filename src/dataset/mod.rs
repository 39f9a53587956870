//! Data sets of labelled images: the wishes of a SPEC, drawn at random, rendered and written.
//!
//! [`spec`] reads the SPEC, [`distribution`] and [`random`] draw its values, [`scene_values`] makes the scene of an orbit, and [`orbit`] runs it and takes
//! its images. [`store`] is the folder, [`orbit_folder`] is the folder of an orbit, and [`make`] fills them. [`whole`] writes the files of the whole
//! set, [`verify`] checks them, and [`preview`] shows samples of a SPEC.

pub(crate) mod camera_rule;
mod corner;
pub(crate) mod distribution;
mod distribution_reader;
pub(crate) mod error;
pub(crate) mod index;
pub(crate) mod life;
pub(crate) mod make;
pub(crate) mod orbit;
pub(crate) mod orbit_files;
pub(crate) mod orbit_folder;
mod orbits_at_once;
pub(crate) mod order;
pub(crate) mod preview;
pub(crate) mod random;
mod reader;
pub(crate) mod row;
mod scene_sections;
pub(crate) mod scene_values;
pub(crate) mod season;
mod sobol;
pub(crate) mod spec;
pub(crate) mod split;
pub(crate) mod store;
pub(crate) mod sums;
pub(crate) mod symmetry_rule;
pub(crate) mod time_rule;
mod toml_value;
pub(crate) mod verify;
pub(crate) mod view_check;
pub(crate) mod whole;
