//! A craft that a client moves: its thermal state follows the states that arrive, and images show it.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::course::{CourseState, between};
use super::error::Refusal;
use super::listen::Server;
use super::sessions::Session;
use crate::host::check_session_memory;
use crate::lens::Lens;
use crate::scene::{Camera, CameraFrame, Motion, MotionBlur, Scene, USUAL_SAMPLES};
use crate::simulation::facade::Simulation;
use crate::simulation::facade_error::SimulationError;
use crate::simulation::image::Image;
use crate::simulation::pose::Pose;
use crate::simulation::target::Target;
use crate::simulation::thermal_state::ThermalState;

/// Most pixels of an image that a client may ask for.
pub(crate) const MOST_PIXELS: u64 = 1 << 24;
/// Places that are handed to the simulation before it steps to the last of them.
const AT_ONCE: usize = 32;

/// A camera as a protocol describes it. Camera axes follow OpenCV.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ProtocolCamera {
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    /// Focal lengths in pixels (x, y). The principal point is the middle of the image.
    pub(crate) focal: [f64; 2],
    /// Position in the axes and from the origin of the craft's body frame, in the client's metres.
    pub(crate) position: DVec3,
    /// Rotates camera axes into the craft's body frame.
    pub(crate) body_from_camera: DMat3,
    /// Metres of the client for a metre of the scene.
    pub(crate) scale: f64,
}

pub(crate) struct ServedCraft {
    simulation: Simulation,
    /// The state from which the craft begins at its first place. `None` after it, and without a state.
    start: Option<Arc<ThermalState>>,
    /// Length of a step [s].
    step: f64,
    last: Option<CourseState>,
}

impl ServedCraft {
    /// A craft that nobody has moved.
    ///
    /// # Errors
    /// The device can not hold it, the state is of another craft, or the call was stopped.
    pub(crate) fn new(scene: &Scene, server: &Server, session: &Session) -> Result<Self, Refusal> {
        let turn = session.turn()?;
        let simulation = session.until_ended(|| {
            let prepared = Simulation::prepare(scene.clone())?;
            server.scenes.lend_casts(&prepared);
            Simulation::new(prepared, &server.target)
        })??;
        let step = simulation.prepared().scene.time.step;
        let mut craft = Self { simulation, start: server.state.clone(), step, last: None };
        if let Some(state) = &craft.start {
            craft.simulation.restore_at(state, 0.0)?;
        }
        if server.warm_up && craft.start.is_none() {
            drop(turn);
            craft.step_along(0.0, session)?;
            let _turn = session.turn()?;
            craft.start = Some(Arc::new(craft.simulation.save()?));
        }
        Ok(craft)
    }

    /// Begins at the first place that the client states, at a time [s]: with the state that the server was given or the warm-up has left. Without either this does
    /// nothing, and at later places too.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn begin_at(&mut self, time: f64) -> Result<(), Refusal> {
        match self.start.take() {
            Some(start) => Ok(self.simulation.restore_at(&start, time)?),
            None => Ok(()),
        }
    }

    /// Moves the craft to a state, and steps its temperatures to the last end of a step before it. The first state begins the simulation.
    ///
    /// # Errors
    /// A state that can not be used, or one that is too far from the last.
    pub(crate) fn observe(&mut self, state: CourseState, session: &Session) -> Result<(), Refusal> {
        let Some(last) = &self.last else {
            self.begin_at(state.time.seconds())?;
            self.simulation.place(state.placement())?;
            self.last = Some(state);
            return Ok(());
        };
        let places = between(last, &state, self.step)?;
        for some in places.chunks(AT_ONCE) {
            for place in some {
                self.simulation.place(*place)?;
                // The next gap begins at the last place that was taken, also where a later one is refused.
                self.last = Some(state.at(place)?);
            }
            let end = some.last().map_or(state.time.seconds(), |place| place.time);
            self.step_to(((end / self.step + 1e-9).floor() * self.step).min(end), session)?;
        }
        self.last = Some(state);
        Ok(())
    }

    /// Length of a step [s], where the last state lies between the ends of two steps. An image then cuts a step.
    pub(crate) fn cut_step(&self) -> Option<f64> {
        let steps = self.last?.time.seconds() / self.step;
        ((steps - steps.round()).abs() > 1e-6).then_some(self.step)
    }

    /// Steps to a time, if it lies ahead. Other sessions take turns with the steps.
    fn step_to(&mut self, time: f64, session: &Session) -> Result<(), Refusal> {
        if time > self.simulation.time() { self.step_along(time, session) } else { Ok(()) }
    }

    /// The simulation, for what a protocol asks besides images.
    pub(crate) fn simulation(&mut self) -> &mut Simulation {
        &mut self.simulation
    }

    /// Steps to a time of the scene's own orbit, or of the places that the craft was given.
    ///
    /// # Errors
    /// A time that can not be reached, or a call that was stopped.
    pub(crate) fn step_along(&mut self, time: f64, session: &Session) -> Result<(), Refusal> {
        let mut turn = session.turn()?;
        let mut step = || self.simulation.step_to_with(time, session.cancel(), &mut || turn.pass_on());
        let went = session.until_ended(&mut step)??;
        if went { Ok(()) } else { Err(Refusal::Stopped) }
    }

    /// Checks the memory of an image of several craft, each of which is drawn by itself.
    ///
    /// # Errors
    /// The image has too many pixels, or the session too many images.
    pub(crate) fn check_images(target: &Target, craft: usize, [width, height]: [u32; 2]) -> Result<(), Refusal> {
        let pixels = u64::from(width) * u64::from(height);
        if pixels > MOST_PIXELS {
            return Err(Refusal::because(format!("an image of {width} x {height} pixels is too large")));
        }
        let bytes = pixels * target.image_bytes(craft as u64);
        check_session_memory(bytes, || format!("an image of {width} x {height} pixels of {craft} craft"))?;
        Ok(())
    }

    /// An image at the time of the last state.
    ///
    /// # Errors
    /// A camera that can not be used, or a call that fails.
    pub(crate) fn image(&mut self, view: &ProtocolCamera, session: &Session) -> Result<Image, Refusal> {
        let [width, height] = view.size;
        if let Some(state) = self.last {
            self.step_to(state.time.seconds(), session)?;
        }
        let _turn = session.turn()?;
        let rotation = DQuat::from_mat3(&view.body_from_camera).normalize();
        let position = view.position / view.scale;
        let pose = Pose::new(CameraFrame::Body, position, rotation).map_err(SimulationError::from)?;
        let camera = self.simulation.camera().ok();
        let camera = Camera {
            width,
            height,
            lens: Lens::pinhole(view.focal, [0.5 * f64::from(width), 0.5 * f64::from(height)]),
            samples: camera.map_or(USUAL_SAMPLES, |camera| camera.samples),
            line_time: camera.map_or(0.0, |camera| camera.line_time),
            exposure: camera.map_or(MotionBlur::default(), |camera| camera.exposure),
            motion: Motion::Still,
            frame: CameraFrame::Body,
            position,
            frame_from_camera: rotation,
            near: camera.map_or(0.1, |camera| camera.near),
        };
        let mut image = session.until_ended(|| self.simulation.image(&camera, &pose))??;
        if view.scale != 1.0 {
            image.depth.iter_mut().for_each(|depth| *depth = (f64::from(*depth) * view.scale) as f32);
        }
        Ok(image)
    }
}

/// Shows several craft in one image: in each pixel the nearest surface. `None` without an image. All have the same size. At most two images are held at a
/// time.
///
/// # Errors
/// The error of an image.
pub(crate) fn nearest(images: impl IntoIterator<Item = Result<Image, Refusal>>) -> Result<Option<Image>, Refusal> {
    let mut images = images.into_iter();
    let Some(first) = images.next().transpose()? else { return Ok(None) };
    let both = images.try_fold(first, |mut near, far| {
        let far = far?;
        for pixel in 0..near.part.len().min(far.part.len()) {
            let (there, here) = (far.part[pixel] != 0, near.part[pixel] != 0);
            if there && (!here || far.depth[pixel] < near.depth[pixel]) {
                near.radiance[pixel] = far.radiance[pixel];
                near.temperature[pixel] = far.temperature[pixel];
                near.depth[pixel] = far.depth[pixel];
                near.part[pixel] = far.part[pixel];
                near.material[pixel] = far.material[pixel];
                if let (Some(near), Some(far)) = (&mut near.digital_numbers, &far.digital_numbers) {
                    near[pixel] = far[pixel];
                }
            }
        }
        Ok::<_, Refusal>(near)
    })?;
    Ok(Some(both))
}
