//! What an engine is asked for, and what it leaves.

use glam::DAffine3;

use crate::environment::TickLoad;

/// One tick as an engine takes it.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Mean load of the tick.
    pub load: &'a TickLoad,
    /// Its length in steps.
    pub steps: f64,
    /// When it starts [s].
    pub start: f64,
    /// Its length [s].
    pub length: f64,
}

/// What a tick is asked to leave.
#[derive(Debug, Clone, Copy, Default)]
pub struct Order<'a> {
    /// Pose of the camera, where an image is wanted.
    pub pose: Option<DAffine3>,
    /// Poses of the body and of the joints in the image; empty where nothing moves.
    pub joints: &'a [DAffine3],
    /// Whether all temperatures are wanted.
    pub temperatures: bool,
}

/// Pixels of an image, row after row from the top.
#[derive(Debug, Clone, Default)]
pub struct Pixels {
    /// Radiance [W m-2 sr-1], temperature [K], depth [m]; 0 where nothing is.
    pub radiance_temperature_depth: Vec<[f32; 3]>,
    /// Part and material, each plus 1; 0 where nothing is.
    pub identity: Vec<[u32; 2]>,
}

/// What a tick left.
#[derive(Debug, Clone, Default)]
pub struct Delivered {
    /// The image, where one was ordered.
    pub pixels: Option<Pixels>,
    /// Temperatures of all nodes in device order, padding included [K].
    pub temperatures: Option<Vec<f32>>,
}
