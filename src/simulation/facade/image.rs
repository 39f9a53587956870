//! Images of a simulation that is driven from outside, from any camera and pose.

use super::Simulation;
use crate::gpu::error::GpuError;
use crate::scene::{Camera, rays_follow_no_joints};
use crate::simulation::budget::{draw_budgets, node_budgets};
use crate::simulation::engine::{ImageMoments, Order};
use crate::simulation::facade_error::SimulationError;
use crate::simulation::image::Image;
use crate::simulation::pose::{CameraError, Pose, check_camera, draws_alike};
use crate::simulation::surroundings::surroundings_at;
use crate::simulation::thermal_state::ThermalState;
use crate::simulation::{moments, pose_at};
use crate::stop::whole;

impl Simulation {
    /// What a camera sees at the present time. The camera need not be that of the scene. Pose and lens of a camera without distortion may change from image
    /// to image at no cost. Another size, another distortion or another number of samples makes the resources of the image anew, and with a sensor any other lens.
    ///
    /// # Errors
    /// A camera or a pose that can not be used, an image beyond the device, or a call that fails.
    pub fn image(&mut self, camera: &Camera, pose: &Pose) -> Result<Image, SimulationError> {
        let camera = pose.of(camera);
        self.check(&camera)?;
        self.begin()?;
        self.take_camera(camera)?;
        let camera = &self.drawn;
        let room = camera.as_ref().map(|camera| self.target.reserve_image(camera)).transpose();
        let _room = room.map_err(GpuError::from)?;
        let mut image = self.draw()?;
        let sensor = self.prepared.scene.sensor.as_ref();
        if sensor.is_none_or(|sensor| sensor.kelvin_per_count.is_none()) {
            image.counts = None;
        }
        self.with_errors(|errors| errors.draw(&mut image, None));
        if self.prepared.scene.images.budget {
            let budgets = node_budgets(&self.prepared, &mut *self.engine, self.last, self.time)?;
            draw_budgets(&self.prepared, &budgets, &mut image, None);
        }
        let (time, width) = (self.time, image.camera.width as usize);
        match image.not_finite() {
            None => Ok(image),
            Some((what, pixel, _)) => {
                Err(SimulationError::NotFinite { time, what, x: pixel % width, y: pixel / width })
            }
        }
    }

    /// Draws for the camera that the engine has.
    fn draw(&mut self) -> Result<Image, SimulationError> {
        let time = self.time;
        let prepared = &self.prepared;
        let absent = || SimulationError::from(CameraError::Pose("its path has no pose at this time"));
        let pose = pose_at(prepared, time).ok_or_else(absent)?;
        let joints = prepared.loads.joints_at(time).1;
        let moments = moments(prepared, time, None);
        let moments = moments.as_ref().map(|moments| ImageMoments(moments));
        let surroundings = surroundings_at(prepared, time, &pose);
        let past = prepared.past_light(time);
        let past = past.as_ref();
        let order = Order { pose: Some(pose), joints: &joints, moments, surroundings, past, time, ..Order::default() };
        self.engine.submit(None, order)?;
        self.engine.deliver()?.image.ok_or_else(absent)
    }

    fn check(&self, camera: &Camera) -> Result<(), SimulationError> {
        let known = |drawn: &Camera| draws_alike(drawn, camera, false) && drawn.near == camera.near;
        if !self.drawn.as_ref().is_some_and(known) {
            check_camera(camera)?;
        }
        camera.check_times(std::iter::once(self.time))?;
        let surrounded = &self.prepared.scene.surrounded;
        if rays_follow_no_joints(surrounded, camera, self.prepared.joints() > 1) {
            let message = "line_time cannot be combined with radiance.reflections = \"traced\" and joints";
            return Err(CameraError::Combination(message).into());
        }
        if camera.samples > 1 && surrounded.channels {
            return Err(CameraError::Combination("samples above 1 cannot be combined with output.channels").into());
        }
        Ok(())
    }

    /// Makes the engine draw for a camera.
    fn take_camera(&mut self, camera: Camera) -> Result<(), SimulationError> {
        if self.drawn.as_ref() == Some(&camera) {
            return Ok(());
        }
        if self.engine.take_camera(&camera) {
            self.prepared.scene.camera = Some(camera.clone());
            self.drawn = Some(camera);
            return Ok(());
        }
        let state = ThermalState::take(&self.prepared, &mut *self.engine, None, self.time)?;
        let before = self.prepared.scene.camera.replace(camera.clone());
        // An engine that is half made would leave the camera of neither.
        match whole(|| self.engine_with(&state, Some(&camera))) {
            Ok(engine) => {
                self.engine = engine;
                self.drawn = Some(camera);
                Ok(())
            }
            Err(error) => {
                self.prepared.scene.camera = before;
                Err(error)
            }
        }
    }
}
