//! An engine for several bands: the first engine steps the craft and draws its first band, and one for each further band draws the same temperatures.
//!
//! All engines draw the same triangles from the same pose, so a pixel shows the same surface in every band. Each drawn image waits for the temperatures
//! of the first engine, so frames do not overlap.

use rayon::prelude::*;

use super::engine::{Delivered, Engine, EngineError, EngineStep, ImageMoments, InstantPoses, Order, SurfaceState};
use super::engine_state::EngineState;
use super::exchange_poses::RowsBetween;
use super::image::{BandImage, BandImages, Image, RatioImage};
use super::network::NetworkRun;
use super::prepare::Prepared;
use super::surroundings::surroundings_in_band;
use crate::environment::StepLoad;
use crate::gpu::timing::PassTimes;
use crate::scene::{BandRatio, Camera, Scene};
use crate::thermal::between::between;
use crate::thermal::network::one_pass::HalvingCourse;
use crate::thermal::sensor::Sensor;

/// A further band: its scene and its engine, which takes no steps.
struct FurtherBand {
    prepared: Prepared,
    engine: Box<dyn Engine>,
}

/// A scene with several bands.
pub(super) struct BandsEngine {
    /// Steps the craft and draws the first band.
    craft: Box<dyn Engine>,
    further: Vec<FurtherBand>,
    ratio: Option<BandRatio>,
    camera: Option<Camera>,
    /// Whether the sensor of the first band counts temperatures.
    counts: bool,
    /// Temperatures before and after the last part of a step, for images between both [K].
    ends: [Vec<f32>; 2],
    delivered: Vec<Delivered>,
}

impl BandsEngine {
    /// Joins the engine of a scene and the engines of its further bands, each with its scene.
    pub(super) fn new(
        craft: Box<dyn Engine>,
        scene: &Scene,
        camera: Option<&Camera>,
        further: Vec<(Prepared, Box<dyn Engine>)>,
    ) -> Self {
        let further = further.into_iter().map(|(prepared, engine)| FurtherBand { prepared, engine }).collect();
        Self {
            craft,
            further,
            ratio: scene.ratio.clone(),
            camera: camera.cloned(),
            counts: counts(scene),
            ends: Default::default(),
            delivered: Vec::new(),
        }
    }

    /// Temperatures of all nodes as they are [K].
    fn temperatures(&mut self) -> Result<Vec<f32>, EngineError> {
        self.craft.submit(None, Order { temperatures: true, ..Order::default() })?;
        Ok(self.craft.deliver()?.temperatures.unwrap_or_default())
    }

    /// Temperatures of the nodes in an image [K]. `now` are those after the last step.
    fn shown(&self, order: &Order<'_>, now: &[f32]) -> Vec<f32> {
        let Some(share) = order.between else { return now.to_vec() };
        let [before, after] = &self.ends;
        let at = |(before, after): (&f32, &f32)| between(f64::from(*before), f64::from(*after), share) as f32;
        before.par_iter().zip(after).map(at).collect()
    }

    /// Adds what the bands show to an image.
    fn draw(&mut self, order: &Order<'_>, temperatures: &[f32], image: &mut Image) -> Result<(), EngineError> {
        let first = BandImage {
            radiance: image.radiance.clone(),
            digital_numbers: image.digital_numbers.clone(),
            counts: image.counts.clone().filter(|_| self.counts),
        };
        let mut images = vec![first];
        for FurtherBand { prepared, engine } in &mut self.further {
            engine.show(temperatures)?;
            let surroundings = order.surroundings.map(|around| surroundings_in_band(prepared, around));
            let in_band = |later: f64| {
                let moment = order.moments.map(|ImageMoments(moment)| moment(later)).unwrap_or_default();
                let surroundings = moment.surroundings.map(|around| surroundings_in_band(prepared, around));
                InstantPoses { surroundings, ..moment }
            };
            let moments = order.moments.map(|_| ImageMoments(&in_band));
            let of_image = Order { surroundings, moments, temperatures: false, keep: false, between: None, ..*order };
            engine.submit(None, Order { absorbed: false, ..of_image })?;
            let drawn = engine.deliver()?.image;
            let counts = counts(&prepared.scene);
            images.extend(drawn.map(|drawn| BandImage {
                radiance: drawn.radiance,
                digital_numbers: drawn.digital_numbers,
                counts: drawn.counts.filter(|_| counts),
            }));
        }
        let ratio = self.ratio.as_ref().map(|ratio| ratio_image(ratio, &images));
        image.bands = BandImages { images, ratio };
        Ok(())
    }
}

/// The temperature of each pixel from two of its radiances.
fn ratio_image(ratio: &BandRatio, images: &[BandImage]) -> RatioImage {
    let [first, second] = ratio.bands.map(|band| &images[band].radiance);
    let of_pixel = |(first, second): (&f32, &f32)| {
        let told = ratio.table.temperature([f64::from(*first), f64::from(*second)], ratio.noise);
        told.unwrap_or_default().map(|kelvin| kelvin as f32)
    };
    let pixels: Vec<[f32; 2]> = first.par_iter().zip(second).map(of_pixel).collect();
    let [temperature, error] = [0, 1].map(|value| pixels.iter().map(|pixel| pixel[value]).collect());
    RatioImage { temperature, error }
}

/// Whether the sensor of a scene counts temperatures.
fn counts(scene: &Scene) -> bool {
    scene.sensor.as_ref().is_some_and(|sensor| sensor.kelvin_per_count.is_some())
}

/// Whether a sensor remembers the image before.
fn lags(sensor: Option<&Sensor>) -> bool {
    sensor.is_some_and(|sensor| sensor.time_constant.is_some())
}

impl Engine for BandsEngine {
    fn device_name(&self) -> String {
        self.craft.device_name()
    }

    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError> {
        self.craft.settle(load, time)
    }

    fn settle_at(&mut self, temperature: f64, nodes: usize) -> Result<(), EngineError> {
        self.craft.settle_at(temperature, nodes)
    }

    fn take_camera(&mut self, camera: &Camera) -> bool {
        let mut engines: Vec<&mut Box<dyn Engine>> = vec![&mut self.craft];
        engines.extend(self.further.iter_mut().map(|band| &mut band.engine));
        let refuses = engines.iter_mut().position(|engine| !engine.take_camera(camera));
        if let (Some(place), Some(before)) = (refuses, &self.camera) {
            engines[..place].iter_mut().for_each(|engine| {
                engine.take_camera(before);
            });
        }
        if refuses.is_none() {
            self.camera = Some(camera.clone());
        }
        refuses.is_none()
    }

    fn take_sensor(&mut self, prepared: &Prepared) -> Result<bool, EngineError> {
        self.craft.take_sensor(prepared)
    }

    fn submit(&mut self, step: Option<EngineStep<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        if order.keep {
            self.ends[0] = self.temperatures()?;
        }
        let is_drawn = order.pose.is_some();
        let needs = order.keep || (is_drawn && order.between.is_none());
        self.craft.submit(step, Order { temperatures: order.temperatures || needs, ..order })?;
        let mut delivered = self.craft.deliver()?;
        if let Some(image) = &mut delivered.image {
            let now = delivered.temperatures.as_deref().unwrap_or_default();
            let temperatures = self.shown(&order, now);
            self.draw(&order, &temperatures, image)?;
        }
        if order.keep {
            self.ends[1] = delivered.temperatures.clone().unwrap_or_default();
        }
        delivered.temperatures = delivered.temperatures.filter(|_| order.temperatures);
        self.delivered.push(delivered);
        Ok(())
    }

    fn deliver(&mut self) -> Result<Delivered, EngineError> {
        Ok(if self.delivered.is_empty() { Delivered::default() } else { self.delivered.remove(0) })
    }

    fn forward(&mut self, passing: &[EngineStep<'_>]) -> Result<(), EngineError> {
        self.craft.forward(passing)
    }

    fn wait(&mut self) -> Result<(), EngineError> {
        self.craft.wait()
    }

    fn steps(&self) -> u64 {
        self.craft.steps()
    }

    fn fused_steps(&self) -> u64 {
        self.craft.fused_steps()
    }

    fn device_bytes(&self) -> Option<u64> {
        let further = self.further.iter().filter_map(|band| band.engine.device_bytes());
        self.craft.device_bytes().map(|bytes| bytes + further.sum::<u64>())
    }

    fn pass_times(&self) -> Option<&PassTimes> {
        self.craft.pass_times()
    }

    fn network(&self) -> Option<&NetworkRun> {
        self.craft.network()
    }

    fn network_mut(&mut self) -> Option<&mut NetworkRun> {
        self.craft.network_mut()
    }

    fn take_halving_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        self.craft.take_halving_course(course)
    }

    fn keep_few_times(&mut self, most: usize) {
        self.craft.keep_few_times(most);
        self.further.iter_mut().for_each(|band| band.engine.keep_few_times(most));
    }

    fn save(&mut self) -> Result<EngineState, EngineError> {
        let mut bands = Vec::new();
        for FurtherBand { prepared, engine } in &mut self.further {
            bands.push(if lags(prepared.scene.sensor.as_ref()) { Some(engine.save()?) } else { None });
        }
        Ok(EngineState::Bands(Box::new(self.craft.save()?), bands))
    }

    fn restore(&mut self, saved: &EngineState, most_times: usize) -> Result<(), EngineError> {
        self.craft.restore(saved.of_craft(), most_times)?;
        if let EngineState::Bands(_, bands) = saved {
            for (band, state) in self.further.iter_mut().zip(bands) {
                if let Some(state) = state.as_ref().filter(|_| lags(band.prepared.scene.sensor.as_ref())) {
                    band.engine.restore(state, most_times)?;
                }
            }
        }
        Ok(())
    }

    fn set_coarse(&mut self, coarse: bool) {
        self.craft.set_coarse(coarse);
    }

    fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, EngineError> {
        self.craft.network_temperatures()
    }

    fn set_network_temperatures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        self.craft.set_network_temperatures(temperatures)
    }

    fn structures(&mut self) -> Result<Vec<f64>, EngineError> {
        self.craft.structures()
    }

    fn set_structures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        self.craft.set_structures(temperatures)
    }

    fn exchange_rows(&self) -> Option<RowsBetween> {
        self.craft.exchange_rows()
    }

    fn show(&mut self, temperatures: &[f32]) -> Result<(), EngineError> {
        self.craft.show(temperatures)
    }

    fn surfaces(&mut self) -> Result<SurfaceState, EngineError> {
        self.craft.surfaces()
    }

    fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        self.craft.exchanged_infrared(black)
    }

    fn exchange_description(&self) -> Vec<(String, String)> {
        self.craft.exchange_description()
    }

    fn network_description(&mut self) -> Vec<(String, String)> {
        self.craft.network_description()
    }
}
