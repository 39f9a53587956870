//! A simulation that is driven from outside: it loads a scene, steps it to any time, and takes images from any camera and pose.
//!
//! Programs that use the library call this, and so does `isotherm render`. `run` in `simulation.rs` is the loop of a whole run with its files.

pub mod sensor;
pub mod temperatures;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DQuat, DVec3};

use super::engine::{Engine, EngineError, Order, Rows};
use super::facade_error::SimulationError;
use super::forward::{Passing, forward};
use super::image::Image;
use super::periodic::Periodic;
use super::pose::{CameraError, Pose, check_camera, draws_alike};
use super::prepare::Prepared;
use super::prepare_error::PrepareError;
use super::state::MOST_TIMES;
use super::surroundings::surroundings_at;
use super::target::Target;
use super::thermal_state::{begin_from, differences, take};
use super::{moments, pose_at, start};
use crate::environment::Sky;
use crate::environment::placements::Place;
use crate::environment::sky::SkyError;
use crate::environment::state::SLACK;
use crate::environment::step::StepLoads;
use crate::gpu::samples::Samples;
use crate::saved::Saved;
use crate::scene::{Background, Camera, Draw, Initial, Reflections, Scene};

/// Share of a step by which a time may be rounded.
const ROUNDING: f64 = 1e-9;

/// Where a craft is at a time, as something outside says. What is `None` is that of the scene's own orbit and attitude at this time.
///
/// All vectors are in the scene's inertial frame: GCRF on a trajectory, otherwise X to orbit noon and Z along the orbit normal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Placement {
    /// Time since the start [s].
    pub time: f64,
    /// The craft from the planet's centre [m].
    pub position: Option<DVec3>,
    /// Its velocity [m/s], for the axes of the orbit frame.
    pub velocity: Option<DVec3>,
    /// The Sun from the planet's centre [m].
    pub sun: Option<DVec3>,
    /// Rotates body vectors into the inertial frame.
    pub inertial_from_body: Option<DQuat>,
}

/// A scene that is stepped and drawn as its caller asks.
///
/// It begins at time 0, after the warm-up of the scene. Times do not fall, except by [`Simulation::restore`]. It may move to another thread, and several
/// simulations may share a device.
pub struct Simulation {
    prepared: Prepared,
    target: Target,
    engine: Box<dyn Engine>,
    /// The camera for which the engine was made.
    drawn: Option<Camera>,
    /// The camera of the scene.
    camera: Option<Camera>,
    /// Loads of the scene's own orbit, attitude and joints.
    own: StepLoads,
    /// Whether something outside gives the places.
    placed: bool,
    /// Whether the state is that of `time`. Before, it is that of no time.
    begun: bool,
    time: f64,
    periodic: Option<Periodic>,
}

impl Simulation {
    /// Loads the scene of a file on a device.
    ///
    /// # Errors
    /// A scene that can not be used, with file, line and key, or a device that can not hold it.
    pub fn load(path: &Path, target: &Target) -> Result<Self, SimulationError> {
        Self::from_scene(Scene::load(path)?, target)
    }

    /// Takes the text of a scene file as if it lay at `path`, from which its own paths begin. Nothing needs to be there.
    ///
    /// # Errors
    /// As for [`Simulation::load`].
    pub fn parse(text: &str, path: &Path, target: &Target) -> Result<Self, SimulationError> {
        let mut scene = Scene::parse(text, path)?;
        scene.files.retain(|file| file != path);
        Self::from_scene(scene, target)
    }

    /// Takes a scene that was read, and perhaps changed.
    ///
    /// # Errors
    /// As for [`Simulation::load`].
    pub fn from_scene(mut scene: Scene, target: &Target) -> Result<Self, SimulationError> {
        if scene.time.draw.is_between_steps() {
            // Images are of the time to which the caller steps.
            scene.time.draw = Draw::Every(1);
        }
        Self::new(Prepared::from_scene(scene, &mut |_| ())?, target)
    }

    /// Takes a scene that was prepared.
    ///
    /// # Errors
    /// A device that can not hold it.
    pub fn new(prepared: Prepared, target: &Target) -> Result<Self, SimulationError> {
        let camera = prepared.scene.camera.clone();
        let mut engine = target.engine(&prepared, camera.as_ref())?;
        engine.keep_few_times(MOST_TIMES);
        Ok(Self {
            own: prepared.loads.clone(),
            drawn: camera.clone(),
            camera,
            prepared,
            target: target.clone(),
            engine,
            placed: false,
            begun: false,
            time: 0.0,
            periodic: None,
        })
    }

    /// The scene as it was prepared: nodes, parts, materials, assumptions and warnings. Its camera is that of the last image.
    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// Name of the device, or `cpu (f64 reference)`.
    pub fn device_name(&self) -> String {
        self.engine.device_name()
    }

    /// The present time since the start [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The camera of the scene.
    ///
    /// # Errors
    /// The scene has none.
    pub fn camera(&self) -> Result<&Camera, SimulationError> {
        match &self.camera {
            Some(camera) => Ok(camera),
            None => Err(self
                .prepared
                .scene
                .require_camera()
                .err()
                .map_or_else(|| CameraError::Pose("the scene has none").into(), SimulationError::from)),
        }
    }

    /// Sun and planet in the body frame at the present time.
    pub fn sky(&self) -> Sky {
        self.prepared.loads.sky_model().sky(self.time)
    }

    /// How a periodic warm-up ended. `None` where the scene has none, and before it.
    pub fn periodic(&self) -> Option<&Periodic> {
        self.periodic.as_ref()
    }

    /// Brings the scene to time 0 by its warm-up, where that has not happened yet. [`Simulation::step_to`] and [`Simulation::image`] do it too.
    ///
    /// A craft that was placed from outside before begins at the time of the first place, in balance under the load there, or with the scene's initial
    /// temperature. It has no warm-up, because nothing says where it was before.
    ///
    /// # Errors
    /// A call that fails.
    pub fn begin(&mut self) -> Result<(), SimulationError> {
        self.begin_with(&AtomicBool::new(false), &mut || ()).map(|_| ())
    }

    /// The same with `progress` called for each step of the warm-up. `stop` ends it early, and it begins anew with the next call. Returns whether the
    /// scene is at its beginning.
    ///
    /// # Errors
    /// A call that fails.
    pub fn begin_with(&mut self, stop: &AtomicBool, progress: &mut dyn FnMut()) -> Result<bool, SimulationError> {
        if self.begun {
            return Ok(true);
        }
        if self.placed {
            match self.prepared.scene.initial {
                Initial::Balance => {
                    let load = self.prepared.loads.step_load(self.time, self.time);
                    self.engine.settle(&load, self.time)?;
                }
                Initial::Temperature(temperature) => {
                    self.engine.settle_at(temperature, self.prepared.nodes.vertex_of_node.len())?;
                }
            }
        } else {
            self.periodic = start(&self.prepared, &mut *self.engine, None, stop, progress)?;
        }
        self.begun = !stop.load(Ordering::Relaxed);
        Ok(self.begun)
    }

    /// Steps the temperatures to a time [s]. Steps end at multiples of the scene's step and at `time`, so a time between two multiples makes a shorter
    /// step. Other steps are those of `isotherm run`, bit for bit.
    ///
    /// # Errors
    /// A time before the present one, one that orbit, attitude or places do not cover, or a call that fails.
    pub fn step_to(&mut self, time: f64) -> Result<(), SimulationError> {
        self.step_to_with(time, &AtomicBool::new(false), &mut || ()).map(|_| ())
    }

    /// The same with `progress` called after each step. `stop` ends it after the step under way. Returns whether the time was reached.
    ///
    /// # Errors
    /// As for [`Simulation::step_to`].
    pub fn step_to_with(
        &mut self,
        time: f64,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(),
    ) -> Result<bool, SimulationError> {
        let length = self.prepared.scene.time.step;
        let slack = ROUNDING * length;
        if !time.is_finite() || time < self.time - slack {
            return Err(SimulationError::Time { time, now: self.time });
        }
        if !self.placed {
            self.prepared.cover(time)?;
        }
        self.prepared.loads.sky_model().check(self.time, time).map_err(|error| self.sky_error(error))?;
        if !self.begin_with(stop, progress)? {
            return Ok(false);
        }
        let mut ends = Vec::new();
        while self.time < time - slack {
            let next = ((self.time / length + ROUNDING).floor() + 1.0) * length;
            let (start, end) = (self.time, if next > time + slack { time } else { next });
            // The loop of a run has its steps begin at this sum, which may differ in the last bit.
            let whole = (end - start - length).abs() <= slack;
            let (start, steps) = if whole { (end - length, 1.0) } else { (start, (end - start) / length) };
            ends.push((Passing { start, end, steps }, end));
            self.time = end;
            let full = ends.len() == AT_ONCE || self.time >= time - slack;
            if full && !self.pass(&mut ends, stop, progress)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Makes steps whose ends stand beside them, and empties the list. After a stop the time is that of the last step made.
    fn pass(
        &mut self,
        steps: &mut Vec<(Passing, f64)>,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(),
    ) -> Result<bool, SimulationError> {
        let began = steps.first().map_or(self.time, |(passing, _)| passing.start);
        let mut done = 0;
        let mut told = || {
            done += 1;
            progress();
        };
        let passing = steps.iter().map(|(passing, _)| *passing);
        let went = forward(&self.prepared, &mut *self.engine, None, passing, stop, &mut told);
        self.time = if done == 0 { began } else { steps[done - 1].1 };
        steps.clear();
        Ok(went?)
    }

    fn sky_error(&self, source: SkyError) -> SimulationError {
        match source {
            SkyError::Place(error) => error.into(),
            source => PrepareError::Sky { path: self.prepared.scene.source.clone(), source }.into(),
        }
    }

    /// Says where the craft is from now on, instead of the scene's own orbit and attitude. Places come in order of time, and [`Simulation::step_to`] goes at
    /// most to the last one. Between two places, positions follow the arc round the planet, and attitudes the shorter arc.
    ///
    /// # Errors
    /// A value that is not finite, a position inside the planet, or a time that is not later than that of the last place.
    pub fn place(&mut self, placement: Placement) -> Result<(), SimulationError> {
        let place = self.filled(placement)?;
        let mut loads = self.prepared.loads.clone();
        let mut now = self.time;
        if !self.placed && !self.begun {
            now = place.time;
        } else if !self.placed && place.time > now + SLACK {
            // The way to the first place begins where the scene is.
            loads.place(self.filled(Placement { time: now, ..Placement::default() })?, now)?;
        } else if !self.placed && place.time < now - SLACK {
            return Err(SimulationError::Time { time: place.time, now });
        }
        loads.place(place, now)?;
        self.prepared.loads = loads;
        (self.placed, self.time) = (true, now);
        Ok(())
    }

    /// A placement with what the scene's own orbit and attitude say.
    fn filled(&self, placement: Placement) -> Result<Place, SimulationError> {
        let Placement { time, position, velocity, sun, inertial_from_body } = placement;
        let (model, mut own) = (self.own.sky_model(), None);
        if position.is_none() || sun.is_none() || inertial_from_body.is_none() {
            model.check(time, time).map_err(|error| self.sky_error(error))?;
            own = model.point(time);
        }
        let attitude = || DQuat::from_mat3(&model.sky(time).body_from_inertial.transpose()).normalize();
        Ok(Place {
            time,
            position: position.or(own.map(|point| point.position)).unwrap_or(DVec3::NAN),
            velocity,
            sun: sun.or(own.map(|point| point.sun)).unwrap_or(DVec3::NAN),
            inertial_from_body: inertial_from_body.unwrap_or_else(attitude),
        })
    }

    /// Holds a joint at a position [rad or m] from the present time on, whatever its rate. Names are those of glTF nodes ([`Simulation::joints`]).
    ///
    /// # Errors
    /// There is no such joint, it plays an animation, or the position lies outside its limits.
    pub fn set_joint(&mut self, name: &str, position: f64) -> Result<(), SimulationError> {
        Ok(self.prepared.loads.set_joint(name, position, self.time)?)
    }

    /// Name and present position of each joint [rad or m].
    pub fn joints(&self) -> Vec<(String, f64)> {
        let names = self.prepared.loads.joints().joints().iter().map(|joint| joint.name.clone());
        names.zip(self.prepared.loads.joints_at(self.time).0).collect()
    }

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
        let time = self.time;
        let prepared = &self.prepared;
        let camera = prepared.scene.camera.as_ref().and_then(|camera| camera.at(time, None).ok());
        let (Some(camera), Some(pose)) = (camera, pose_at(prepared, time)) else {
            return Err(CameraError::Pose("its path has no pose at this time").into());
        };
        let joints = prepared.loads.joints_at(time).1;
        let moments = moments(prepared, time, None);
        let rows = moments.as_ref().map(|moments| Rows(moments));
        let surroundings = surroundings_at(prepared, time, &pose);
        let order = Order { pose: Some(pose), joints: &joints, rows, surroundings, time, ..Order::default() };
        self.engine.submit(None, order)?;
        let pixels = self.engine.deliver()?.pixels.unwrap_or_default();
        let width = camera.width as usize;
        let mut image = Image::new(camera, pose, time, pixels);
        if prepared.scene.sensor.as_ref().is_none_or(|sensor| sensor.kelvin_per_count.is_none()) {
            image.counts = None;
        }
        match image.not_finite() {
            None => Ok(image),
            Some((what, pixel)) => Err(SimulationError::NotFinite { time, what, x: pixel % width, y: pixel / width }),
        }
    }

    fn check(&self, camera: &Camera) -> Result<(), SimulationError> {
        let known = |drawn: &Camera| draws_alike(drawn, camera, false) && drawn.near == camera.near;
        if !self.drawn.as_ref().is_some_and(known) {
            check_camera(camera)?;
        }
        camera.check_times(std::iter::once(self.time))?;
        let surrounded = &self.prepared.scene.surrounded;
        let around = surrounded.reflections != Reflections::Off || surrounded.background != Background::Off;
        if camera.line_time > 0.0 && around {
            let message = "line_time cannot be combined with radiance.reflections or radiance.background";
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
        let state = take(&self.prepared, &mut *self.engine, None, self.time)?;
        let before = self.prepared.scene.camera.replace(camera.clone());
        match self.engine_with(state, Some(&camera)) {
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

    /// Another engine for a camera, in a thermal state. Its sensor begins anew.
    fn engine_with(&self, state: Saved, camera: Option<&Camera>) -> Result<Box<dyn Engine>, SimulationError> {
        let mut engine = self.target.engine(&self.prepared, camera)?;
        engine.keep_few_times(MOST_TIMES);
        let state = with_sensor_of(state, &engine.save()?, true);
        begin_from(&state, &mut *engine, None)?;
        Ok(engine)
    }

    /// Median device time of each group of passes [ms], by name, of the steps and images that were timed. Empty for the reference, and on a device without
    /// timestamps.
    pub fn pass_times(&self) -> Vec<(String, f64)> {
        let median = |(name, samples): (&String, &Samples<f64>)| {
            let mut sorted = samples.to_vec();
            sorted.sort_by(f64::total_cmp);
            Some((name.clone(), *sorted.get(sorted.len() / 2)?))
        };
        self.engine.pass_times().into_iter().flatten().filter_map(median).collect()
    }

    /// The thermal state and the sensor's, bit for bit, with the present time. `output::state_file` writes it to a file, as `--save-state` does.
    ///
    /// # Errors
    /// A call that fails.
    pub fn save(&mut self) -> Result<Saved, SimulationError> {
        self.begin()?;
        Ok(take(&self.prepared, &mut *self.engine, None, self.time)?)
    }

    /// Goes back to a saved state and to its time. Places and joints that were set from outside are forgotten: the craft follows the scene's own orbit until
    /// it is placed again.
    ///
    /// # Errors
    /// A state of another craft or of another kind of device, or a call that fails.
    pub fn restore(&mut self, saved: &Saved) -> Result<(), SimulationError> {
        let time = saved.array::<f64, 1>("of.time").map_err(SimulationError::NoState)?[0];
        self.restore_at(saved, time)
    }

    /// Goes to a saved state as the state at a time [s], whatever its own time. With 0 this is `--from-state`.
    ///
    /// # Errors
    /// As for [`Simulation::restore`].
    pub fn restore_at(&mut self, saved: &Saved, time: f64) -> Result<(), SimulationError> {
        if !time.is_finite() {
            return Err(SimulationError::Time { time, now: self.time });
        }
        let on_device = self.target.device().is_some();
        let found = differences(saved, &self.prepared, on_device).map_err(SimulationError::NoState)?;
        if !found.is_empty() {
            return Err(SimulationError::State(found.join("; ")));
        }
        let fits = match &self.prepared.scene.sensor {
            Some(_) => with_sensor_of(saved.clone(), &self.engine.save()?, false),
            None => saved.clone(),
        };
        begin_from(&fits, &mut *self.engine, None).map_err(|error| match error {
            EngineError::Saved(error) => SimulationError::NoState(error),
            error => error.into(),
        })?;
        self.prepared.loads = self.own.clone();
        (self.placed, self.begun, self.time) = (false, true, time);
        Ok(())
    }
}

/// Steps that are handed to the engine at once. It takes up to 32 in a dispatch.
const AT_ONCE: usize = 1024;

/// A state with the lists of an engine's sensor, all of them or those that do not fit it.
fn with_sensor_of(mut state: Saved, fresh: &Saved, all: bool) -> Saved {
    for (name, bytes) in fresh.lists() {
        let own = format!("state.engine.{name}");
        let is_sensor = name.starts_with("sensor.") || name.starts_with("scene.sensor.");
        let fits = state.list::<u8>(&own).is_ok_and(|list: Vec<u8>| list.len() == bytes.len());
        if is_sensor && (all || !fits) {
            state.put(own, bytes);
        }
    }
    state
}
