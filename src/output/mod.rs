//! The outputs of a run: EXR images, false-colour pictures, series, plots and the report.
//!
//! [`job`] runs a scene through all steps into a folder. [`frame`] is one image as plain arrays, and [`mod@exr`] stores
//! it without loss. [`colour`], [`canvas`] and [`picture`] draw it. [`statistics`] and [`series`] reduce node
//! temperatures to columns over time. [`plot`] and [`temperature_plots`] draw these columns. [`report`] and [`report_html`] join everything on one
//! page. [`folder`] writes each file whole or not at all and lists it in a [`manifest`]. [`growing`] appends to tables while a run goes on, and
//! [`state_file`] holds the state from which a run goes on after its end. [`destination`] decides where a single output goes.

pub(crate) mod apparent;
mod between;
pub(crate) mod budgets;
pub(crate) mod canvas;
pub(crate) mod casts_file;
mod cdr;
pub(crate) mod clock;
pub(crate) mod colour;
mod colour_bar;
pub(crate) mod comparison;
pub(crate) mod comparison_plots;
pub(crate) mod console;
mod csv_rows;
pub(crate) mod destination;
pub(crate) mod difference_scale;
pub(crate) mod eclipses;
pub(crate) mod error;
pub(crate) mod exchange_pictures;
pub(crate) mod exr;
mod exr_blocks;
mod exr_header;
pub(crate) mod finite;
pub(crate) mod fits;
pub(crate) mod folder;
pub(crate) mod frame;
pub(crate) mod frame_maker;
mod frame_writer;
pub(crate) mod gray;
pub(crate) mod growing;
pub(crate) mod guarded;
pub(crate) mod html;
pub(crate) mod image_index;
pub(crate) mod inputs;
pub(crate) mod job;
mod job_terms;
pub(crate) mod joints;
mod keeper;
pub(crate) mod manifest;
pub(crate) mod material_picture;
#[cfg(feature = "programs")]
pub(crate) mod mcap;
pub(crate) mod panels;
pub(crate) mod picture;
pub(crate) mod plot;
pub(crate) mod plot_axis;
mod polyline;
pub(crate) mod pose_images;
mod recorder;
pub(crate) mod report;
pub(crate) mod report_html;
mod ros_schemas;
pub(crate) mod run_pictures;
pub(crate) mod run_state;
pub(crate) mod sensor_files;
pub(crate) mod series;
pub(crate) mod series_lines;
pub(crate) mod settings;
pub(crate) mod sigma;
pub(crate) mod state_file;
pub(crate) mod statistics;
pub(crate) mod step_cost;
pub(crate) mod tables;
pub(crate) mod temperature_plots;
pub(crate) mod temporary;
mod thinned;
pub(crate) mod ticks;
pub(crate) mod tiff;
pub(crate) mod tornado;
mod typeface;
pub(crate) mod video;
pub(crate) mod views;
pub(crate) mod waiting;
mod whole_file;

pub(crate) use error::OutputError;
