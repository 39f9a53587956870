//! The interface of an engine: it takes steps and returns images and temperatures.

use glam::{DAffine3, DMat3};

pub use super::engine_error::EngineError;
use super::engine_state::EngineState;
use super::exchange_poses::RowsBetween;
use super::image::Image;
use super::network::{NetworkRun, StepCost};
use super::pixel_light::PastLight;
use super::prepare::Prepared;
use crate::environment::StepLoad;
use crate::environment::shadow::Lit;
use crate::gpu::timing::PassTimes;
use crate::scene::Camera;
use crate::thermal::network::one_pass::HalvingCourse;
use crate::thermal::received::FaceLoad;
use crate::thermal::surroundings::Surroundings;

/// One step for an engine.
#[derive(Debug, Clone, Copy)]
pub struct EngineStep<'a> {
    /// Mean load of the step.
    pub load: &'a StepLoad,
    /// Its length in steps.
    pub steps: f64,
    /// When it starts [s].
    pub start: f64,
    /// Its length [s].
    pub length: f64,
}

/// Poses of the camera and of the joints at one instant.
#[derive(Debug, Clone, Default)]
pub struct InstantPoses {
    /// Pose of the camera.
    pub pose: DAffine3,
    /// Poses of the body and of the joints. Empty where nothing moves.
    pub(crate) joints: Vec<DAffine3>,
    /// What surrounds the craft, in the axes of the camera. `None` where no pixel shows it.
    pub(crate) surroundings: Option<Surroundings>,
    /// Rotates vectors of the orbit frame into the axes of the camera.
    pub(crate) camera_from_orbit: DMat3,
}

/// The moments of an image that is not taken in one instant. The function takes a time after the image's [s].
#[derive(Clone, Copy)]
pub struct ImageMoments<'a>(pub &'a dyn Fn(f64) -> InstantPoses);

impl std::fmt::Debug for ImageMoments<'_> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str("Moments")
    }
}

/// The results that a step must return.
#[derive(Debug, Clone, Copy, Default)]
pub struct Order<'a> {
    /// Pose of the camera. `None` without an image.
    pub pose: Option<DAffine3>,
    /// Poses of the body and of the joints in the image. Empty where nothing moves.
    pub joints: &'a [DAffine3],
    /// Whether the temperatures before the step are kept, for images between them and those after it.
    pub keep: bool,
    /// Share of the last step that has passed at the image's time, in a scene whose images have their own times.
    pub between: Option<f64>,
    /// Moments of the rows with a rolling shutter, and of the sub-frames of an exposure. `None` if the image is of one instant.
    pub moments: Option<ImageMoments<'a>>,
    /// Whether all temperatures are needed.
    pub temperatures: bool,
    /// Whether the absorbed heat is needed.
    pub absorbed: bool,
    /// Time of the image [s].
    pub time: f64,
    /// Number of an image at its own time.
    pub number: Option<u32>,
    /// What surrounds the craft in the image, in the axes of the camera. `None` where no pixel shows it.
    pub surroundings: Option<Surroundings>,
    /// The light up to the time of the image, where pixels have light of their own.
    pub past: Option<&'a PastLight>,
}

impl Order<'_> {
    /// The image of a camera that the order asks for, still without pixels. `None` without a pose.
    pub(crate) fn image_of(&self, camera: &Camera) -> Option<Image> {
        let camera = camera.at(self.time, self.number).unwrap_or_else(|_| camera.clone());
        Some(Image::blank(camera, self.pose?, self.time))
    }

    /// The order of a sub-frame, which is taken so long after the image [s]. `instant` is the moment there, and `moments` gives later ones.
    pub(crate) fn sub_frame<'b>(&self, offset: f64, instant: &'b InstantPoses, moments: ImageMoments<'b>) -> Order<'b> {
        Order {
            pose: Some(instant.pose),
            joints: &instant.joints,
            moments: Some(moments),
            surroundings: instant.surroundings,
            time: self.time + offset,
            between: self.between,
            ..Order::default()
        }
    }
}

/// The results of a step.
#[derive(Debug, Clone, Default)]
pub struct Delivered {
    /// The image, where one was asked for.
    pub image: Option<Image>,
    /// Temperatures of all nodes in device order, padding included [K].
    pub temperatures: Option<Vec<f32>>,
    /// Heat that each run of nodes absorbed in the step [W] (see `energy::heat_tables`), where it was asked for.
    pub absorbed: Option<Vec<f64>>,
}

/// The light and the temperatures of all nodes. Lists are in device order, padding included.
#[derive(Debug, Clone, Default)]
pub struct SurfaceState {
    /// Temperatures [K].
    pub(crate) temperatures: Vec<f64>,
    /// Lit areas. `None` before the first finding, and where normals tell the light.
    pub(crate) lit: Option<Lit>,
    /// Light from the craft on the two faces of each node. Empty where surfaces do not see each other.
    pub(crate) received: Vec<[FaceLoad; 2]>,
    /// Temperatures of the network's nodes [K]. Empty without a network.
    pub(crate) network: Vec<f64>,
    /// Temperatures of the structures below plates [K], in the order of `Prepared::structures`.
    pub(crate) structures: Vec<f64>,
}

/// A scene on a Vulkan device or on the f64 reference.
pub trait Engine: Send {
    /// Name of the device, or `cpu`.
    fn device_name(&self) -> String;

    /// Settles every node at the balance temperature of a load, and networks at their steady state at a time [s].
    ///
    /// # Errors
    /// A call that fails, or no steady state.
    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError>;

    /// Settles every node at a temperature [K].
    ///
    /// # Errors
    /// A call that fails.
    fn settle_at(&mut self, temperature: f64, nodes: usize) -> Result<(), EngineError>;

    /// Takes another camera for the images from here on. Returns whether its images need no other resources; otherwise nothing changes.
    fn take_camera(&mut self, camera: &Camera) -> bool;

    /// Takes the sensor of a scene in which nothing else has changed, for the images from here on. None may be under way. Returns whether it needs no
    /// other resources; otherwise nothing changes.
    ///
    /// # Errors
    /// A lost device.
    fn take_sensor(&mut self, prepared: &Prepared) -> Result<bool, EngineError>;

    /// Submits a step, or without one the present state. At most two may be under way.
    ///
    /// # Errors
    /// A call that fails, or a network whose temperatures can not be found.
    fn submit(&mut self, step: Option<EngineStep<'_>>, order: Order<'_>) -> Result<(), EngineError>;

    /// Results of the oldest step under way. Empty where none is.
    ///
    /// # Errors
    /// A lost device.
    fn deliver(&mut self) -> Result<Delivered, EngineError>;

    /// Advances through steps that return nothing but the state. Where nodes do not interact and nothing moves, a device takes many steps in one dispatch.
    ///
    /// # Errors
    /// As for `submit`.
    fn forward(&mut self, passing: &[EngineStep<'_>]) -> Result<(), EngineError> {
        self.pass_singly(passing)
    }

    /// Advances through the same steps one by one.
    ///
    /// # Errors
    /// As for `submit`.
    fn pass_singly(&mut self, passing: &[EngineStep<'_>]) -> Result<(), EngineError> {
        for step in passing {
            self.submit(Some(*step), Order::default())?;
            self.deliver()?;
        }
        Ok(())
    }

    /// Waits until the engine has finished all submitted work.
    ///
    /// # Errors
    /// A lost device.
    fn wait(&mut self) -> Result<(), EngineError> {
        Ok(())
    }

    /// Number of steps so far, including the warm-up.
    fn steps(&self) -> u64;

    /// Number of these steps that shared a dispatch.
    fn fused_steps(&self) -> u64 {
        0
    }

    /// Allocated device memory that grows with the number of nodes [bytes], without buffers that only the host reads. `None` for the reference.
    fn device_bytes(&self) -> Option<u64> {
        None
    }

    /// Device time of every pass so far [ms]. `None` for the reference.
    fn pass_times(&self) -> Option<&PassTimes> {
        None
    }

    /// The network of the scene, where it has one.
    fn network(&self) -> Option<&NetworkRun>;

    /// The network of the scene for changes.
    fn network_mut(&mut self) -> Option<&mut NetworkRun>;

    /// Takes another course of halvings of a network in one pass, from the next step on. Returns the course so far.
    fn take_halving_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        self.network_mut().map(|network| network.take_halving_course(course)).unwrap_or_default()
    }

    /// Cost of the network in every step so far. Empty without a network.
    fn network_costs(&self) -> &[StepCost] {
        self.network().map_or(&[], NetworkRun::costs)
    }

    /// Bounds the measured times that are kept from here on.
    fn keep_few_times(&mut self, most: usize) {
        if let Some(network) = self.network_mut() {
            network.keep_few_costs(most);
        }
    }

    /// The state between two steps, bit for bit. No step is under way.
    ///
    /// # Errors
    /// A call that fails.
    fn save(&mut self) -> Result<EngineState, EngineError>;

    /// Takes what `save` gave. Call `keep_few_times` before with the same number.
    ///
    /// # Errors
    /// A state of another scene or engine, or a call that fails.
    fn restore(&mut self, saved: &EngineState, most_times: usize) -> Result<(), EngineError>;

    /// Sets whether the steps of the network may err by ten times its tolerance.
    fn set_coarse(&mut self, coarse: bool) {
        if let Some(network) = self.network_mut() {
            network.set_coarse(coarse);
        }
    }

    /// Temperatures of the network's nodes [K], where the scene has a network.
    ///
    /// # Errors
    /// A call that fails.
    fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, EngineError> {
        Ok(self.network().map(NetworkRun::temperatures))
    }

    /// Replaces the temperatures of the network's nodes [K]. They appear after the next step.
    ///
    /// # Errors
    /// A call that fails.
    fn set_network_temperatures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        if let Some(network) = self.network_mut() {
            network.set_temperatures(temperatures);
        }
        Ok(())
    }

    /// Temperatures of the structures below plates [K], in the order of `Prepared::structures`.
    ///
    /// # Errors
    /// A call that fails.
    fn structures(&mut self) -> Result<Vec<f64>, EngineError>;

    /// Replaces these temperatures [K].
    ///
    /// # Errors
    /// A call that fails.
    fn set_structures(&mut self, temperatures: &[f64]) -> Result<(), EngineError>;

    /// Poses of the joints between which the rows of patches lie that the last step used. `None` without radiation between surfaces.
    fn exchange_rows(&self) -> Option<RowsBetween> {
        None
    }

    /// Puts other temperatures of all nodes in device order [K] in place of its own, for an engine that takes no steps.
    ///
    /// # Errors
    /// A call that fails.
    fn show(&mut self, temperatures: &[f32]) -> Result<(), EngineError>;

    /// The light and the temperatures after the last step that was submitted, for a budget. No work is under way.
    ///
    /// # Errors
    /// A call that fails.
    fn surfaces(&mut self) -> Result<SurfaceState, EngineError>;

    /// Infrared that nodes absorb from each other [W/m2], if each emits like a black body of this flux [W/m2]. Empty without radiation between surfaces.
    fn exchanged_infrared(&self, _black: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// What was found of radiation between surfaces, in words. Empty without it.
    fn exchange_description(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// How the network was integrated, in words. Empty without a network.
    fn network_description(&mut self) -> Vec<(String, String)> {
        self.network().map(NetworkRun::description).unwrap_or_default()
    }
}
