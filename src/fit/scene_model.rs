//! Temperatures of sensors and pixels of a scene with other values.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DQuat, DVec3};

use super::FittingError;
use super::images::{ImageReader, MeasuredImage};
use super::measurements::{MeasuredGroup, MeasuredPoint, Measurements};
use super::prior::Unknown;
use super::result::FitModel;
use super::rules::fitted_rules;
use super::telemetry::{self, Places};
use crate::converge::RunNews;
use crate::environment::trajectory::Trajectory;
use crate::guard::is_off_craft;
use crate::output::apparent::Apparent;
use crate::scene::{Camera, CameraFrame, Draw, FitInput, Motion, Parameter, Probe, Scene, SensorPlace};
use crate::sensitivity::change::{change_materials, change_scene, values};
use crate::sensitivity::search::tighten;
use crate::sensitivity::variant::{TOLERANCE, VariantRun, VariantWalk};
use crate::simulation::engine::Engine;
use crate::simulation::image::Image;
use crate::simulation::orbit_end::with_halvings;
use crate::simulation::pose_of;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::PrepareStage;
use crate::simulation::state::BetweenSteps;
use crate::simulation::target::Target;
use crate::simulation::viewpoint::camera_from_body;
use crate::thermal::network::one_pass::HalvingCourse;

/// A scene and what was measured of it, before its first run.
pub(super) struct SceneCase {
    prepared: Prepared,
    parameters: Vec<Parameter>,
    /// Telemetry.
    measurements: Measurements,
    /// Part or probe of each sensor.
    columns: Vec<usize>,
    images: Vec<MeasuredImage>,
    apparent: Apparent,
}

impl SceneCase {
    /// Prepares a scene, and reads its telemetry and images.
    ///
    /// # Errors
    /// A wrong file, or a measured value that does not fit the scene.
    pub(super) fn load(
        mut scene: Scene,
        stated: &FitInput,
        [tables, images]: [&[PathBuf]; 2],
        progress: &mut dyn FnMut(PrepareStage),
    ) -> Result<(Self, Vec<Unknown>), FittingError> {
        if let Some(assumption) = tighten(&mut scene, TOLERANCE) {
            scene.assumptions.push(assumption);
        }
        scene.time.draw = Draw::None;
        let input = with_probes(stated, &mut scene);
        let start = scene.orbit.trajectory().map(Trajectory::start).or(scene.time.start);
        let end = f64::from(scene.time.steps) * scene.time.step;
        let mut prepared = Prepared::from_scene(scene, progress)?;
        for rule in &stated.sensors {
            if matches!(rule.place, SensorPlace::Position(place) if is_off_craft(&prepared, place)) {
                let message = "lies off the craft: a position is in metres, in the body frame and the file's pose";
                return Err(stated.error(rule.line, "sensor.position", message.to_owned()).into());
            }
        }
        let probes = prepared.scene.probes.iter().map(|probe| probe.name.clone()).collect();
        let places = Places { parts: prepared.parts.clone(), probes, nodes: Vec::new(), end, start };
        let (measurements, columns) = telemetry::read(&input, tables, &places)?;
        let unknown = |parameter: &Parameter| Unknown::new(parameter, &values(parameter, &prepared)?);
        let unknowns = input.parameters.iter().map(unknown).collect::<Result<_, FittingError>>()?;
        let apparent = Apparent::new(prepared.scene.band);
        let images = match (images.is_empty() && input.images.is_empty(), &prepared.scene.camera) {
            (true, _) => Vec::new(),
            (false, None) => {
                return Err(prepared.scene.require_camera().err().map_or(FittingError::Stopped, FittingError::from));
            }
            (false, Some(camera)) => {
                let size = [camera.width, camera.height];
                ImageReader { input: &input, band: prepared.scene.band, apparent: &apparent, size, end, start }
                    .read(images)?
            }
        };
        let mut scene = prepared.scene.clone();
        let times = measurements.points.iter().map(|point| point.time).chain(images.iter().map(|image| image.time));
        let last = times.fold(0.0, f64::max);
        scene.time.steps = ((last / scene.time.step - 1e-9).ceil() as u32).max(1);
        if !images.is_empty() {
            look_as_measured(&prepared, &images, &mut scene)?;
        }
        prepared = prepared.varied(scene, |_| ())?;
        Ok((Self { prepared, parameters: input.parameters, measurements, columns, images, apparent }, unknowns))
    }

    pub(super) fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// Runs the scene as it is, and chooses the pixels that count.
    ///
    /// # Errors
    /// A run that fails, or an image none of whose pixels counts.
    pub(super) fn open<'a>(
        self,
        target: &'a Target,
        stop: &'a AtomicBool,
        news: &'a dyn Fn(RunNews),
    ) -> Result<(SceneModel<'a>, Measurements), FittingError> {
        let Self { prepared, parameters, mut measurements, columns, images, apparent } = self;
        let kept: Vec<usize> = (0..images.len()).collect();
        let mut model = SceneModel {
            prepared,
            parameters,
            columns,
            sensed: Vec::new(),
            pixels: Vec::new(),
            surface: images.iter().map(|image| image.rule.surface).collect(),
            apparent,
            kept,
            base: Vec::new(),
            near: None,
            halvings: Arc::default(),
            engine: None,
            target,
            stop,
            news,
        };
        model.sensed = measurements.points.iter().map(|point| (point.time, model.columns[point.group])).collect();
        let ran = model.run_as_it_is()?;
        for (measured, (image, _)) in images.iter().zip(&ran.images) {
            let group = measurements.groups.len();
            let place = format!("{} x {} pixels at {} s", measured.size[0], measured.size[1], measured.time);
            measurements.groups.push(MeasuredGroup { kind: "image", name: measured.name.clone(), place });
            let temperature = |pixel: usize| measured.temperatures[pixel];
            let counts =
                |pixel: &usize| temperature(*pixel) > 0.0 && temperature(*pixel).is_finite() && is_inner(image, *pixel);
            let pixels: Vec<usize> = (0..image.part.len()).filter(counts).collect();
            if pixels.is_empty() {
                let reason = "no pixel counts: none that is measured shows a part with all its neighbours".to_owned();
                return Err(FittingError::Measured { path: measured.path.clone(), reason });
            }
            measurements.points.extend(pixels.iter().map(|pixel| MeasuredPoint {
                group,
                time: measured.time,
                value: f64::from(temperature(*pixel)),
                sigma: measured.rule.sigma,
                held_out: false,
            }));
            model.pixels.push(pixels);
        }
        model.base = model.measured_of(&ran)?;
        Ok((model, measurements))
    }
}

/// The sensors at places in the body frame become probes of the scene.
fn with_probes(input: &FitInput, scene: &mut Scene) -> FitInput {
    let mut input = input.clone();
    for rule in &mut input.sensors {
        if let SensorPlace::Position(position) = rule.place {
            let name = format!("sensor {}", rule.name);
            scene.probes.push(Probe { name: name.clone(), position, part: None });
            rule.place = SensorPlace::Probe(name);
        }
    }
    input
}

/// Lets a scene draw at the times and poses of measured images.
fn look_as_measured(prepared: &Prepared, images: &[MeasuredImage], scene: &mut Scene) -> Result<(), FittingError> {
    let Some(camera) = &mut scene.camera else { return Ok(()) };
    let pose = |image: &MeasuredImage| -> Result<(DVec3, DQuat), FittingError> {
        let stated = image.rule.pose.map(|(position, frame_from_camera)| {
            let still = Camera { motion: Motion::Still, position, frame_from_camera, ..camera.clone() };
            camera_from_body(&still, &prepared.loads.sky_model().sky(image.time))
        });
        let pose: Option<DAffine3> = stated.or(image.camera_from_body).or_else(|| pose_of(prepared, image.time, None));
        let body_from_camera = pose.map(|pose| pose.inverse()).ok_or_else(|| FittingError::Measured {
            path: image.path.clone(),
            reason: format!("the camera of the scene has no pose at {} s: state a pose", image.time),
        })?;
        Ok((body_from_camera.translation, DQuat::from_mat3(&body_from_camera.matrix3).normalize()))
    };
    let poses = images.iter().map(pose).collect::<Result<Vec<_>, _>>()?;
    scene.time.draw = Draw::Times(images.iter().map(|image| image.time).collect());
    (camera.motion, camera.frame) = (Motion::Listed(Arc::from(poses)), CameraFrame::Body);
    Ok(())
}

/// Whether a pixel and its neighbours show one part, wholly. The border of a part mixes temperatures and hangs on the pose.
fn is_inner(image: &Image, pixel: usize) -> bool {
    let [width, height] = [image.camera.width as usize, image.camera.height as usize];
    let (x, y) = (pixel % width, pixel / width);
    let part = image.part[pixel];
    let whole = |pixel: usize| image.coverage.get(pixel).is_none_or(|share| *share >= 1.0);
    let same = |x: usize, y: usize| image.part[y * width + x] == part && whole(y * width + x);
    part != 0
        && x > 0
        && y > 0
        && x + 1 < width
        && y + 1 < height
        && (x - 1..=x + 1).all(|x| (y - 1..=y + 1).all(|y| same(x, y)))
}

/// A scene that is run again and again with other values.
pub(super) struct SceneModel<'a> {
    prepared: Prepared,
    parameters: Vec<Parameter>,
    columns: Vec<usize>,
    /// Time and column of each row of telemetry.
    sensed: Vec<(f64, usize)>,
    /// The pixels that count in each image.
    pixels: Vec<Vec<usize>>,
    /// Whether each image shows temperatures of surfaces.
    surface: Vec<bool>,
    apparent: Apparent,
    kept: Vec<usize>,
    /// What the scene as it is computes.
    base: Vec<f64>,
    /// The state of the scene as it is at time 0, where that is periodic.
    near: Option<BetweenSteps>,
    /// Halvings of the steps of the scene as it is, which all runs take.
    halvings: Arc<[u32]>,
    /// The engine of the scene as it is keeps the view factors that all runs share.
    engine: Option<Box<dyn Engine>>,
    target: &'a Target,
    stop: &'a AtomicBool,
    news: &'a dyn Fn(RunNews),
}

impl SceneModel<'_> {
    fn walked<T>(&self, walk: impl FnOnce(&VariantWalk<'_>) -> Result<T, FittingError>) -> Result<T, FittingError> {
        let warned = |text: String| (self.news)(RunNews::Says(format!("warning: {text}")));
        let (target, kept, stop) = (self.target, &self.kept, self.stop);
        walk(&VariantWalk {
            name: "the scene",
            target,
            kept,
            nodes_every: None,
            stop,
            stepped: &|| (),
            warned: &warned,
        })
    }

    fn run_as_it_is(&mut self) -> Result<VariantRun, FittingError> {
        let prepared = &self.prepared;
        let (engine, near, (ran, halvings)) = self.walked(|walk| {
            let mut engine = walk.begin(prepared, None)?;
            let near =
                prepared.scene.time.periodic.map(|_| BetweenSteps::capture(0, &mut *engine, None)).transpose()?;
            let ran = with_halvings(&mut *engine, |engine| walk.run(prepared, engine))?;
            Ok((engine, near, ran))
        })?;
        (self.engine, self.near, self.halvings) = (Some(engine), near, halvings);
        Ok(ran)
    }

    fn changed(&self, factors: &[f64]) -> Result<Prepared, FittingError> {
        let mut scene = self.prepared.scene.clone();
        let pairs = || self.parameters.iter().zip(factors);
        pairs().for_each(|(parameter, factor)| change_scene(parameter, *factor, &mut scene));
        let change = |materials: &mut [_]| {
            pairs().for_each(|(parameter, factor)| change_materials(parameter, *factor, materials));
        };
        Ok(self.prepared.varied(scene, change)?)
    }

    /// The computed temperatures of all that was measured [K].
    fn measured_of(&self, ran: &VariantRun) -> Result<Vec<f64>, FittingError> {
        let sensed = |(time, column): &(f64, usize)| {
            let after = ran.times.partition_point(|other| other < time).min(ran.times.len() - 1);
            let before = after.saturating_sub(1);
            let at = |row: usize| {
                let none = || FittingError::Run(format!("a part without area has no temperature at {time} s"));
                ran.rows[row][*column].ok_or_else(none)
            };
            let length = ran.times[after] - ran.times[before];
            let share = if length > 0.0 { (time - ran.times[before]) / length } else { 0.0 };
            let [low, high] = [at(before)?, at(after)?];
            Ok(low + share.clamp(0.0, 1.0) * (high - low))
        };
        let mut all = self.sensed.iter().map(sensed).collect::<Result<Vec<f64>, FittingError>>()?;
        for (number, pixels) in self.pixels.iter().enumerate() {
            let image = &ran.images[number].0;
            let temperature = |pixel: &usize| match self.surface[number] {
                true => f64::from(image.temperature[*pixel]),
                false => f64::from(self.apparent.temperature(image.radiance[*pixel])),
            };
            all.extend(pixels.iter().map(temperature));
        }
        Ok(all)
    }
}

impl FitModel for SceneModel<'_> {
    fn computed(&mut self, factors: &[f64]) -> Result<Vec<f64>, FittingError> {
        if factors.iter().all(|factor| *factor == 1.0) {
            return Ok(self.base.clone());
        }
        let prepared = self.changed(factors)?;
        // The state of other nodes would not fit.
        let near = self.near.as_ref().filter(|_| prepared.nodes == self.prepared.nodes);
        let ran = self.walked(|walk| {
            let mut engine = walk.begin(&prepared, near)?;
            engine.take_halving_course(HalvingCourse::Followed(Arc::clone(&self.halvings), 0));
            Ok(walk.run(&prepared, &mut *engine)?)
        })?;
        self.measured_of(&ran)
    }

    fn fitted_text(&self, factors: &[f64], head: &[String]) -> String {
        fitted_rules(&self.prepared, &self.parameters, factors, head)
    }
}
