//! Items that the Python package of this repository uses besides the public face. Any name here may go at any time. Without the feature `programs` the rest of the crate
//! is compiled only where one of these items reaches it.

#[cfg(feature = "datasets")]
pub use crate::dataset::{
    make::make,
    order::{DatasetOrder, DatasetSummary, Shard},
    scene_values::SceneText,
    spec::Spec,
    store::Begin,
};
pub use crate::{
    fit::case::fit_files,
    gpu::context::{Context, devices},
    output::{
        colour::ColourScale,
        picture::picture,
        state_file::{decode, encode},
    },
    scene::Camera,
    sensitivity::node_sigma::find_image_sigma,
    simulation::{pose::check_camera, thermal_state::ThermalState},
    stop::{Stopped, until},
    thermal::budget::{CAUSES, CHANNELS},
};
