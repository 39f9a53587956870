//! The images of an orbit: one thermal run that stops at the times of its images.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::Value as Json;

use super::camera_rule::CameraRule;
use super::error::DatasetError;
use super::random::RandomStream;
use super::scene_values::{NAMES, OrbitScene, OrbitValues, SceneText};
use super::spec::Spec;
use super::split::split_of;
use super::time_rule::NoTime;
use super::view_check::{Reason, points, rejected};
use crate::guard;
use crate::guard::finding::{CheckEffort, Finding};
use crate::labels::craft::Craft;
use crate::labels::from_scene::{craft, labelled};
use crate::labels::image::ImageIdentity;
use crate::labels::image::LabelledImage;
use crate::labels::key_points::{CHOSEN, check_names, chosen, given};
use crate::labels::label_target::targets;
use crate::labels::symmetry::{self, symmetries};
use crate::scene::Scene;
use crate::sensitivity::node_sigma::find_image_sigma;
use crate::simulation::facade::Simulation;
use crate::simulation::image::Image;
use crate::simulation::target::Target;
use crate::simulation::viewpoint::camera_from_body;

/// How many attempts were rejected, by reason.
pub type Rejections = BTreeMap<Reason, u64>;

/// The receiver of the images of an orbit.
pub(crate) type Take<'a> = dyn FnMut(&Craft, &Simulation, Image, LabelledImage) -> Result<(), DatasetError> + 'a;

/// An orbit that is ready to run.
pub struct OrbitRun<'a> {
    spec: &'a Spec,
    scenes: &'a SceneText,
    number: u64,
    values: OrbitValues,
    simulation: Simulation,
    /// The craft with its key points.
    pub(crate) craft: Craft,
}

/// The result of an orbit.
#[derive(Debug, Clone, Default)]
pub struct OrbitOutcome {
    /// Rejected attempts.
    pub rejections: Rejections,
    /// Whether a signal ended it.
    pub(crate) stopped: bool,
}

impl<'a> OrbitRun<'a> {
    /// Makes the simulation of an orbit.
    ///
    /// # Errors
    /// A scene that can not be used, or key points that the craft does not have.
    pub fn new(spec: &'a Spec, scenes: &'a SceneText, target: &Target, number: u64) -> Result<Self, DatasetError> {
        let OrbitScene { scene, values } = scenes.of_orbit(spec, number)?;
        check(spec, &scene)?;
        let mut simulation = Simulation::from_scene(scene, target)?;
        simulation.share_albedo(&scenes.albedo);
        let mut craft = craft(simulation.prepared());
        if let Some(name) = &spec.labels.object {
            craft.name.clone_from(name);
        }
        let wrong = |message: String| DatasetError::Spec { path: spec.path.clone(), message };
        craft.targets = targets(&craft, &spec.labels.targets).map_err(|error| wrong(error.to_string()))?;
        craft.key_points = if spec.labels.key_points.is_empty() {
            chosen(&craft, CHOSEN)
        } else {
            let each = spec.labels.key_points.iter().map(|point| {
                given(&craft, &point.name, point.position, point.part.as_deref())
                    .map_err(|error| wrong(error.to_string()))
            });
            each.collect::<Result<Vec<_>, _>>()?
        };
        check_names(&craft.key_points).map_err(|error| wrong(error.to_string()))?;
        craft.symmetries = symmetries(&craft, &spec.labels.symmetries).map_err(|error| wrong(error.to_string()))?;
        Ok(Self { spec, scenes, number, values, simulation, craft })
    }

    /// What is probably wrong in the scene. The SPEC states the camera.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let prepared = self.simulation.prepared();
        let findings = guard::check(prepared, CheckEffort::NO_IMAGE).findings;
        let points = self.craft.key_points.iter().map(|point| (point.name.as_str(), point.position));
        let off = guard::key_points_off(prepared, points);
        prepared.warnings.iter().cloned().chain(findings.iter().chain(&off).map(Finding::to_string)).collect()
    }

    /// What the scene assumes.
    pub(crate) fn assumptions(&self) -> &[String] {
        &self.simulation.prepared().scene.assumptions
    }

    /// Refuses symmetries that the mesh does not have. The mesh is the same in all orbits, so the check of one orbit is enough.
    ///
    /// # Errors
    /// The first symmetry after which the mesh is another.
    pub(crate) fn check_symmetries(&self) -> Result<(), DatasetError> {
        let wrong = |error: symmetry::SymmetryError| DatasetError::Spec {
            path: self.spec.path.clone(),
            message: error.to_string(),
        };
        symmetry::check(&self.craft, &self.spec.labels.symmetries).map_err(wrong)
    }

    /// Number of nodes of the craft.
    pub(super) fn nodes(&self) -> usize {
        self.simulation.prepared().nodes.real().count()
    }

    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Values that were drawn for the orbit, by section.
    pub(crate) fn drawn(&self) -> &Json {
        &self.values.drawn
    }

    /// Times of the images [s], each with its number in the data set and its rejected attempts, in the order of time.
    ///
    /// # Errors
    /// An image for which no time is found.
    fn times(&self) -> Result<Vec<(f64, u64, u32)>, DatasetError> {
        let sky = self.simulation.prepared().loads.sky_model();
        let attempts = self.spec.attempts;
        let mut times = Vec::new();
        for image in self.spec.images_of(self.number) {
            let no_sample = |reasons: &str| DatasetError::NoSample {
                image,
                orbit: self.number,
                attempts,
                reasons: reasons.to_owned(),
            };
            let (time, rejected) =
                self.spec.drawn.time.draw(&self.spec.plan, image, sky, attempts).map_err(|reason| match reason {
                    NoTime::NoEclipse => no_sample("the orbit has no eclipse from which [time] counts"),
                    NoTime::NoLight => no_sample("no time after the start has the light that [time] asks for"),
                })?;
            times.push((time, image, rejected));
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        Ok(times)
    }

    /// Runs the orbit once through and hands over its images in the order of time. `wanted` says which images are drawn.
    ///
    /// # Errors
    /// No sample after all attempts, a call that fails, or an error of `take`.
    pub fn run(
        &mut self,
        wanted: &dyn Fn(u64) -> bool,
        stop: &AtomicBool,
        take: &mut Take,
    ) -> Result<OrbitOutcome, DatasetError> {
        let mut outcome = OrbitOutcome::default();
        let times = self.times()?;
        let sigma = match (times.last(), &self.simulation.prepared().scene.uncertainty) {
            (Some((until, ..)), Some(_)) => Some(find_image_sigma(&self.simulation, *until, stop)),
            _ => None,
        };
        if stop.load(Ordering::Relaxed) {
            outcome.stopped = true;
            return Ok(outcome);
        }
        let sigma = sigma.transpose().map_err(DatasetError::Uncertainty)?;
        for (time, image, rejected) in times {
            if rejected > 0 {
                *outcome.rejections.entry(Reason::Light).or_default() += u64::from(rejected);
            }
            if !self.simulation.step_to_with(time, stop, &mut || ())? || stop.load(Ordering::Relaxed) {
                outcome.stopped = true;
                return Ok(outcome);
            }
            if wanted(image) {
                let drawn = self.take_sensor(image)?;
                let mut taken = self.image(image, time, &mut outcome.rejections)?;
                if let Some(sigma) = &sigma {
                    sigma(&self.simulation, &mut taken);
                }
                let labelled = labelled(self.place(image, &drawn), self.simulation.prepared(), taken.clone());
                take(&self.craft, &self.simulation, taken, labelled)?;
            }
        }
        Ok(outcome)
    }

    /// Takes the sensor of an image. Returns the values that were drawn for it, by section.
    fn take_sensor(&mut self, image: u64) -> Result<Json, DatasetError> {
        let Some(drawn_sensor) = self.scenes.of_image(self.spec, (self.number, &self.values), image)? else {
            return Ok(Json::Null);
        };
        self.simulation.set_sensor(drawn_sensor.sensor)?;
        Ok(drawn_sensor.drawn)
    }

    /// Draws poses until one is accepted.
    fn image(&mut self, image: u64, time: f64, all: &mut Rejections) -> Result<Image, DatasetError> {
        let spec = self.spec;
        let camera = self.simulation.camera()?.clone();
        let sky = self.simulation.sky();
        let craft = points(self.simulation.prepared(), time);
        let mut reasons = Rejections::new();
        let drawn = (0..spec.attempts).find_map(|attempt| {
            let source = spec.plan.source(RandomStream::Image, image, attempt);
            let rule = CameraRule::choose(&spec.cameras, &source);
            let reason = match rule.draw(&source, &camera, time) {
                Err(_) => Reason::NoPose,
                Ok(pose) => {
                    let in_camera = camera_from_body(&pose.of(&camera), &sky);
                    match rejected(&spec.reject, &camera, &in_camera, &craft, &sky) {
                        Some(reason) => reason,
                        None => match self.simulation.image(&camera, &pose) {
                            Err(error) => return Some(Err(error)),
                            Ok(image) => {
                                let shows = |part: &&u32| self.craft.target_of_pixel(**part).is_some();
                                let pixels = image.part.iter().filter(shows).count() as u64;
                                if pixels >= spec.reject.visible_pixels {
                                    return Some(Ok(image));
                                }
                                Reason::TooFewPixels
                            }
                        },
                    }
                }
            };
            *reasons.entry(reason).or_default() += 1;
            None
        });
        for (reason, count) in &reasons {
            *all.entry(*reason).or_default() += count;
        }
        match drawn {
            Some(image) => Ok(image?),
            None => {
                let told: Vec<String> =
                    reasons.iter().map(|(reason, count)| format!("{count} {}", reason.words())).collect();
                Err(DatasetError::NoSample {
                    image,
                    orbit: self.number,
                    attempts: spec.attempts,
                    reasons: told.join(", "),
                })
            }
        }
    }

    /// An image without pixels, for labels that depend on the camera alone.
    ///
    /// # Errors
    /// The scene has no camera.
    pub(crate) fn blank(&self) -> Result<LabelledImage, DatasetError> {
        let camera = self.simulation.camera()?.clone();
        let image = Image::blank(camera, glam::DAffine3::IDENTITY, 0.0);
        let first = self.spec.images_of(self.number).start;
        Ok(labelled(self.place(first, &Json::Null), self.simulation.prepared(), image))
    }

    fn place(&self, image: u64, drawn_for_image: &Json) -> ImageIdentity {
        let mut drawn = Vec::new();
        for values in [&self.values.drawn, drawn_for_image] {
            numbers("", values, &mut drawn);
        }
        let (sensor, bits) = sensor_of(&self.simulation.prepared().scene);
        ImageIdentity {
            sample: image,
            orbit: self.number as u32,
            number: (image - self.spec.images_of(self.number).start) as u32,
            split: split_of(self.spec, self.number),
            bits,
            sensor,
            drawn,
        }
    }
}

/// Refuses a scene that can not give the images of a SPEC.
fn check(spec: &Spec, scene: &Scene) -> Result<(), DatasetError> {
    let wrong = |message: &str| Err(DatasetError::Spec { path: spec.path.clone(), message: message.to_owned() });
    let camera = scene.require_camera()?;
    if camera.line_time > 0.0 {
        return wrong("camera.line_time of the scene is above 0, and a labelled image has one pose: leave it out");
    }
    if scene.sensor.is_none() && spec.images.contains(&super::spec::ImageKind::Numbers) {
        return wrong(
            "images asks for numbers, and the scene has no [sensor], which makes them: state [each_orbit.sensor]",
        );
    }
    if scene.images.error && !spec.images.contains(&super::spec::ImageKind::Radiance) {
        return wrong(
            "the scene asks for T_error (output.error), which only images of radiance have: add \"radiance\" to images, or leave output.error out",
        );
    }
    if scene.images.budget && !spec.images.contains(&super::spec::ImageKind::Radiance) {
        return wrong(
            "the scene asks for budgets (output.budget), which only images of radiance have: add \"radiance\" to images, or leave output.budget out",
        );
    }
    if scene.uncertainty.is_some() && !spec.images.contains(&super::spec::ImageKind::Radiance) {
        return wrong(
            "the scene asks for T_sigma ([uncertainty]), which only images of radiance have: add \"radiance\" to images, or leave [uncertainty] out",
        );
    }
    if spec.cameras.iter().any(CameraRule::is_on_path) && !matches!(camera.motion, crate::scene::Motion::Path(_)) {
        return wrong("[camera] is of kind \"path\", and the scene has no camera.path");
    }
    Ok(())
}

/// Settings of the sensor by name, and the bits of its digital numbers.
fn sensor_of(scene: &Scene) -> (Vec<(String, f64)>, u32) {
    let Some(sensor) = &scene.sensor else { return (Vec::new(), 16) };
    let mut settings = vec![
        ("seed".to_owned(), f64::from(sensor.seed)),
        ("serial".to_owned(), f64::from(sensor.detector.serial)),
        ("bits".to_owned(), f64::from(sensor.bits)),
        ("range_low_K".to_owned(), sensor.range[0]),
        ("range_high_K".to_owned(), sensor.range[1]),
        ("netd_K".to_owned(), sensor.noise.as_ref().map_or(0.0, |noise| noise.kelvin)),
        ("transmission".to_owned(), sensor.optics.transmission),
        ("bad_pixels".to_owned(), sensor.detector.bad_pixels),
    ];
    if let Some(halo) = sensor.halo {
        settings.extend([("stray_share".to_owned(), halo.share), ("stray_radius_px".to_owned(), halo.radius)]);
    }
    let temperatures = [("lens_temperature_K", sensor.optics.lens), ("housing_temperature_K", sensor.optics.housing)];
    for (name, value) in temperatures {
        settings.extend(value.map(|value| (name.to_owned(), value)));
    }
    if let Some(pattern) = &sensor.pattern {
        settings.extend([
            ("offset_pattern_K".to_owned(), pattern.offset),
            ("gain_pattern".to_owned(), pattern.gain),
            ("drift_K_per_s".to_owned(), pattern.drift),
            ("shutter_temperature_K".to_owned(), pattern.shutter),
        ]);
        settings.extend(pattern.interval.map(|interval| ("shutter_interval_s".to_owned(), interval)));
    }
    (settings, sensor.bits)
}

/// The numbers in drawn values, by the path to each. An item of a list is named by its first key among [`NAMES`], otherwise by its index.
fn numbers(path: &str, value: &Json, named: &mut Vec<(String, f64)>) {
    let joined = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        Json::Number(number) => named.extend(number.as_f64().map(|number| (path.to_owned(), number))),
        Json::Object(values) => values.iter().for_each(|(key, value)| numbers(&joined(key), value, named)),
        Json::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                let name = NAMES.iter().find_map(|key| item.get(*key)?.as_str());
                numbers(&joined(name.unwrap_or(&index.to_string())), item, named);
            }
        }
        _ => {}
    }
}
