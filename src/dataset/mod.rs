//! Data sets of labelled images: what a SPEC asks for, drawn, rendered and written.
//!
//! [`spec`] reads the SPEC, [`distribution`] and [`random`] draw its values, [`scene_values`] makes the scene of an orbit, and [`orbit`] runs it and takes
//! its images. [`store`] is the folder, [`orbit_folder`] that of an orbit, and [`make`] fills them. [`whole`] writes the files of the whole set, [`verify`] checks them, and [`preview`] shows
//! what a SPEC means.

pub mod camera_rule;
mod corner;
pub mod distribution;
mod distribution_reader;
pub mod error;
pub mod index;
pub mod life;
pub mod make;
pub mod orbit;
pub mod orbit_files;
pub mod orbit_folder;
pub mod preview;
pub mod random;
mod reader;
pub mod row;
mod scene_sections;
pub mod scene_values;
pub mod season;
mod sobol;
pub mod spec;
pub mod split;
pub mod store;
pub mod symmetry_rule;
pub mod time_rule;
mod toml_value;
pub mod verify;
pub mod view_check;
pub mod whole;
