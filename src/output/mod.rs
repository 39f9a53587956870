//! The outputs of a run: EXR images, false-colour pictures, series, plots and the report.
//!
//! [`job`] runs a scene through all steps into a folder. [`frame`] is one image as plain arrays, and [`mod@exr`] stores
//! it without loss. [`colour`], [`canvas`] and [`picture`] draw it. [`statistics`] and [`series`] reduce node
//! temperatures to columns over time. [`plot`] and [`temperature_plots`] draw those. [`report`] and [`report_html`]
//! join everything on one page. [`folder`] writes each file whole or not at all and lists it in a [`manifest`]. [`growing`] appends to tables while a run
//! goes on, and [`state_file`] holds what it needs to go on after its end. [`destination`] decides where a single output goes.

pub mod apparent;
mod between;
pub mod canvas;
mod cdr;
pub mod clock;
pub mod colour;
mod colour_bar;
pub mod comparison;
pub mod comparison_plots;
pub(crate) mod console;
mod csv_rows;
pub mod destination;
pub mod difference_scale;
pub mod eclipses;
pub mod error;
pub mod exchange_pictures;
pub mod exr;
mod exr_header;
pub mod finite;
pub mod fits;
pub mod folder;
pub mod frame;
pub mod frame_maker;
mod frame_writer;
pub mod gray;
pub mod growing;
pub(crate) mod html;
pub mod image_index;
pub mod inputs;
pub mod job;
mod job_state;
mod job_terms;
pub mod joints;
pub mod manifest;
pub mod material_picture;
pub mod mcap;
pub mod panels;
pub mod picture;
pub mod plot;
pub mod plot_axis;
mod polyline;
pub mod pose_images;
mod recorder;
pub mod report;
pub mod report_html;
mod ros_schemas;
mod run_pictures;
pub mod sensor_files;
pub mod series;
pub mod series_lines;
pub mod settings;
pub mod state_file;
pub mod statistics;
pub mod step_cost;
pub mod tables;
pub mod temperature_plots;
pub mod temporary;
mod thinned;
pub mod ticks;
pub mod tiff;
pub mod video;
pub mod views;
mod whole_file;

pub use error::OutputError;
