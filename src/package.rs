//! Items that the Python package of this repository uses besides the public face. Any name here may go at any time. Without the feature `programs` the rest of the crate
//! is compiled only where one of these items reaches it.

pub use crate::{
    dataset::{
        make::{DatasetOrder, DatasetSummary, Shard, make},
        scene_values::SceneText,
        spec::Spec,
        store::Begin,
    },
    fit::case::fit_files,
    gpu::context::{Context, devices},
    output::{
        colour::ColourScale,
        picture::picture,
        state_file::{decode, encode},
    },
    scene::Camera,
    simulation::{pose::check_camera, thermal_state::ThermalState},
    stop::{Stopped, until},
    thermal::budget::{CAUSES, CHANNELS},
};

/// Whether the index of a data set can be written.
pub const HAS_INDEX: bool = cfg!(feature = "datasets");
