//! A simulation that is driven from outside: it loads a scene, steps it to any time, and takes images from any camera and pose.
//!
//! Programs that use the library call this, and so does `isotherm render`. `run` in `simulation.rs` is the loop of a whole run with its files.

mod errors;
pub(crate) mod flows;
mod image;
mod place;
pub(crate) mod sensor;
mod state;
pub(crate) mod temperatures;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub use place::Placement;

use super::engine::Engine;
use super::facade_error::SimulationError;
use super::forward::forward;
use super::orbits::Periodic;
use super::parts::Passing;
use super::pose::CameraError;
use super::prepare::Prepared;
use super::prepare_error::PrepareError;
use super::start;
use super::state::MOST_TIMES;
use super::target::Target;
use super::uncertainty::Uncertainty;
use super::uncertainty::rest::RestingErrors;
use crate::environment::Sky;
use crate::environment::albedo_field::AlbedoFields;
use crate::environment::scene_time::{ROUNDING, SceneTime};
use crate::environment::sky::SkyError;
use crate::environment::step::StepLoads;
use crate::gpu::samples::Samples;
use crate::scene::work::MOST_STEPS;
use crate::scene::{Camera, Draw, Initial, Scene};

/// Steps that are handed to the engine at once. It takes up to 32 in a dispatch.
const AT_ONCE: usize = 1024;

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
    /// Whether a joint was set from outside.
    turned: bool,
    /// Whether the state is that of `time`. Before the start, the state belongs to no time.
    begun: bool,
    time: f64,
    /// The last step. `None` before the first one, and after a restored state.
    last: Option<Passing>,
    periodic: Option<Periodic>,
    /// The errors of the temperatures, where the scene asks for them.
    errors: Option<RestingErrors>,
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
    pub fn from_scene(scene: Scene, target: &Target) -> Result<Self, SimulationError> {
        Self::new(Self::prepare(scene)?, target)
    }

    /// Prepares a scene for [`Simulation::new`].
    ///
    /// # Errors
    /// As for [`Simulation::load`].
    pub(crate) fn prepare(mut scene: Scene) -> Result<Prepared, SimulationError> {
        if scene.time.draw.is_between_steps() {
            // Images are of the time to which the caller steps.
            scene.time.draw = Draw::Every(1);
        }
        let mut prepared = Prepared::from_scene(scene, &mut |_| ())?;
        if prepared.scene.uncertainty.is_some() {
            prepared.warnings.push(
                "[uncertainty] takes two runs for each parameter: isotherm run, render and dataset make them, and find_sigma in Python"
                    .to_owned(),
            );
        }
        Ok(prepared)
    }

    /// Takes the albedo from fields that other simulations share.
    pub(crate) fn share_albedo(&mut self, fields: &Arc<AlbedoFields>) {
        self.prepared.loads.share_albedo(fields);
        self.own = self.prepared.loads.clone();
    }

    /// Takes a scene that was prepared.
    ///
    /// # Errors
    /// A device that can not hold it.
    pub(crate) fn new(prepared: Prepared, target: &Target) -> Result<Self, SimulationError> {
        let camera = prepared.scene.camera.clone();
        let mut engine = target.engine(&prepared, camera.as_ref())?;
        engine.keep_few_times(MOST_TIMES);
        Ok(Self {
            own: prepared.loads.clone(),
            errors: prepared.scene.images.error.then(|| Uncertainty::new(&prepared).rest()),
            drawn: camera.clone(),
            camera,
            prepared,
            target: target.clone(),
            engine,
            placed: false,
            turned: false,
            begun: false,
            time: 0.0,
            last: None,
            periodic: None,
        })
    }

    /// The scene as it was prepared: nodes, parts, materials, assumptions and warnings. Its camera is that of the last image.
    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// Where it computes.
    pub(crate) fn target(&self) -> &Target {
        &self.target
    }

    /// Whether the craft is still on the orbit of its scene, with the joints of its scene.
    pub(crate) fn is_on_orbit(&self) -> bool {
        !self.placed && !self.turned
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

    /// Whether the scene is past its warm-up.
    pub fn has_begun(&self) -> bool {
        self.begun
    }

    /// How a periodic warm-up ended. `None` where the scene has none, and before it.
    pub(crate) fn periodic(&self) -> Option<&Periodic> {
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

    /// The same with `progress` called for each step of the warm-up, or each orbit of a periodic one. `stop` ends it early, and it begins anew with the next call. Returns whether the
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
        if !stop.load(Ordering::Relaxed) {
            self.begin_errors()?;
            self.begun = true;
        }
        Ok(self.begun)
    }

    /// Steps the temperatures to a time [s]. Steps end at multiples of the scene's step and at `time`, so a time between two multiples makes a shorter
    /// step. Other steps are those of `isotherm run`, bit for bit.
    ///
    /// # Errors
    /// A time before the present one, one that orbit, attitude or places do not cover, more than 1e9 steps, or a call that fails.
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
        let goal = SceneTime::new(time)?;
        if time < self.time - slack {
            return Err(SimulationError::Time { time, now: self.time });
        }
        let between = SceneTime::new(self.time)?.ends_of_steps(goal, length, MOST_STEPS)?;
        if !self.placed {
            self.prepared.cover(time)?;
        }
        self.prepared.loads.sky_model().check(self.time, time).map_err(|error| self.sky_error(error))?;
        if !self.begin_with(stop, progress)? {
            return Ok(false);
        }
        if self.time >= time - slack {
            return Ok(true);
        }
        // The last end of a step that is rounded otherwise than the time is the time.
        let last = (time / length).round() * length;
        let last = if (last - time).abs() <= slack { last } else { time };
        let mut ends = Vec::new();
        for end in between.chain([last]) {
            let start = self.time;
            // The loop of a run has its steps begin at this sum, which may differ in the last bit.
            let whole = (end - start - length).abs() <= slack;
            let (start, steps) = if whole { (end - length, 1.0) } else { (start, (end - start) / length) };
            ends.push((Passing { start, end, steps }, end));
            self.time = end;
            if ends.len() == AT_ONCE && !self.pass(&mut ends, stop, progress)? {
                return Ok(false);
            }
        }
        self.pass(&mut ends, stop, progress)
    }

    /// Makes steps whose ends stand beside them, and empties the list. After a stop the time is that of the last step made.
    fn pass(
        &mut self,
        steps: &mut Vec<(Passing, f64)>,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(),
    ) -> Result<bool, SimulationError> {
        if self.errors.is_some() {
            let went = self.pass_with_errors(steps, stop, progress);
            steps.clear();
            return went;
        }
        let began = steps.first().map_or(self.time, |(passing, _)| passing.start);
        let mut done = 0;
        let mut told = || {
            done += 1;
            progress();
        };
        let passing = steps.iter().map(|(passing, _)| *passing);
        let went = forward(&self.prepared, &mut *self.engine, None, passing, stop, &mut told);
        self.time = if done == 0 { began } else { steps[done - 1].1 };
        self.last = done.checked_sub(1).map(|number| steps[number].0).or(self.last);
        steps.clear();
        Ok(went?)
    }

    fn sky_error(&self, source: SkyError) -> SimulationError {
        match source {
            SkyError::Place(error) => error.into(),
            source => PrepareError::Sky { path: self.prepared.scene.source.clone(), source }.into(),
        }
    }

    /// Median device time of each group of passes [ms], by name, of the steps and images that were timed. Empty for the reference, and on a device without
    /// timestamps.
    pub(crate) fn pass_times(&self) -> Vec<(String, f64)> {
        let median = |(name, samples): (&String, &Samples<f64>)| {
            let mut sorted = samples.to_vec();
            sorted.sort_by(f64::total_cmp);
            Some((name.clone(), *sorted.get(sorted.len() / 2)?))
        };
        self.engine.pass_times().into_iter().flatten().filter_map(median).collect()
    }
}
