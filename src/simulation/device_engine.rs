//! The Vulkan device as an engine: it steps and draws every node in f32.

mod camera;
mod frames;
mod host_step;

use std::sync::Arc;

use camera::DeviceCamera;
use frames::{Flying, Fourth, Frames};

use super::device_data::{DeviceData, sensor_tables};
use super::engine::{Delivered, Engine, EngineError, EngineStep, ImageMoments, Order, SurfaceState};
use super::engine_state::{DeviceEngineState, EngineState};
use super::exchange_device::DeviceExchange;
use super::exchange_poses::RowsBetween;
use super::given::GivenTemperatures;
use super::image::Image;
use super::network::NetworkRun;
use super::pixel_light::PastLight;
use super::prepare::Prepared;
use super::surroundings::{Finishes, MappedPlanet};
use crate::environment::StepLoad;
use crate::gpu::context::Context;
use crate::gpu::effects::image::sampling::SubFrame;
use crate::gpu::error::GpuError;
use crate::gpu::layout;
use crate::gpu::plan::check_plan;
use crate::gpu::renderer::{Heating, Renderer, Request};
use crate::gpu::request::PixelSource;
use crate::gpu::timing::PassTimes;
use crate::scene::{Camera, MotionBlur};
use crate::thermal::misfit::{Misfit, part};
use crate::thermal::network::one_pass::HalvingCourse;
use crate::trace::span;

/// A scene on a device. Results are delivered in the order of the steps.
pub struct DeviceEngine {
    /// The device state that steps and draws.
    pub renderer: Renderer,
    frames: Frames,
    network: Option<NetworkRun>,
    /// Patches that radiate to each other, and what was found for poses of the joints.
    exchange: Option<DeviceExchange>,
    /// Temperatures of a file.
    given: Option<Arc<GivenTemperatures>>,
    /// Nodes with a structure below them.
    structures: Vec<usize>,
    steps: u64,
    camera: Option<DeviceCamera>,
    /// Whether the image has a sensor.
    senses: bool,
    finishes: Finishes,
    context: Arc<Context>,
}

impl DeviceEngine {
    /// The scene on a Vulkan device. Images are drawn where `camera` is given.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn new(context: &Arc<Context>, prepared: &Prepared, camera: Option<&Camera>) -> Result<Self, GpuError> {
        let poses = prepared.loads.joints_at(0.0).1;
        let exchange = prepared.exchange.as_ref().map(|craft| DeviceExchange::new(craft, &poses));
        let _fills = span("filling the device");
        let tables = exchange.as_ref().map(|own| own.tables().clone());
        let device = DeviceData::new(prepared).with_exchange(tables);
        let data = device.scene_data_with(prepared, camera, context.info.sample_counts);
        let plan = data.plan();
        check_plan(context, &plan, data.drawn())?;
        let renderer = Renderer::new(context, &data)?;
        Ok(Self {
            network: prepared.network.as_ref().map(NetworkRun::beside_device),
            exchange,
            frames: Frames::new(device.heat.clone()),
            given: prepared.given.clone(),
            structures: prepared.structures(),
            renderer,
            steps: 0,
            senses: data.sensor.is_some(),
            camera: camera.map(|camera| DeviceCamera::new(prepared, camera, data.sampling)),
            finishes: device.finishes,
            context: Arc::clone(context),
        })
    }

    /// What the fourth value of a pixel is. A scene is refused where it is both.
    fn fourth(&self) -> Fourth {
        if self.camera.as_ref().is_some_and(DeviceCamera::has_coverage) {
            Fourth::Coverage
        } else if self.finishes.is_apart() {
            Fourth::Reflected
        } else {
            Fourth::Nothing
        }
    }

    /// Sends the frame of an order. A sub-frame of an exposure is told with the time of the whole image [s]. Light in pixels may need the `temperatures` of the
    /// nodes [K].
    fn send(
        &mut self,
        step: Option<EngineStep<'_>>,
        order: &Order<'_>,
        exposed: Option<(SubFrame, f64)>,
        temperatures: &[f64],
    ) -> Result<Flying, EngineError> {
        self.steps += u64::from(step.is_some());
        if let Some(step) = &step {
            self.change_over(step.start)?;
            self.follow_joints(step)?;
        }
        let (mut powers, mut heat) = (None, None);
        let mut keep = order.keep;
        match (&step, &self.network) {
            (Some(step), Some(network)) if network.is_in_frames() => {
                powers = Some((step.start, network.scene().heater_powers(step.start, step.length)));
            }
            (Some(step), Some(_)) => {
                heat = self.step_network(step, order)?;
                keep = false;
            }
            (Some(step), None) => {
                if let Some(given) = self.given.clone() {
                    self.take_given(&given, step.start + step.length, order.keep)?;
                    keep = false;
                }
            }
            _ => {}
        }
        let camera = self.camera.as_ref();
        let (views, distant) = camera.map(|camera| camera.drawn(order)).unwrap_or_default();
        let changes = camera.and_then(|camera| camera.changes(order, temperatures)).map(Arc::new);
        let image = camera.and_then(|camera| camera.image(order));
        let image = image.map(|image| Image { changes: changes.clone(), ..image });
        let rolling_sky = camera.and_then(|camera| camera.rolling_sky(order));
        let shutters = camera.map(|camera| camera.shutters(order)).unwrap_or_default();
        if let Some(around) = &order.surroundings {
            self.finishes.look_at(around);
            if let Some(map) = self.finishes.planet.as_mut().and_then(MappedPlanet::take_new_map) {
                self.take_planet_map(&map)?;
            }
        }
        if let Some(traced) = self.finishes.traced.as_mut().filter(|_| order.pose.is_some()) {
            traced.follow(order.joints);
        }
        let finishes = &mut self.finishes;
        let lobes = order.surroundings.map_or(&[][..], |around| finishes.lobes.values_before(around.planet));
        let planet = order.surroundings.zip(finishes.planet.as_ref()).and_then(|(around, planet)| planet.told(&around));
        let submitted = self.renderer.submit(Request {
            step: step.map(|step| (step.load, step.steps)),
            views: &views,
            shutters: (&shutters, rolling_sky),
            temperatures: order.temperatures,
            absorbed: order.absorbed,
            time: Some(exposed.map_or(order.time, |(_, time)| time)),
            surroundings: order.surroundings.as_ref().map(|around| (layout::Surroundings::new(around), lobes)),
            planet,
            traced: order.pose.as_ref().and(finishes.traced.as_ref()).map(|traced| traced.told(order.time)),
            pixels: match (distant, &changes) {
                (Some(distant), _) => PixelSource::Crop(distant),
                (None, Some(changes)) => PixelSource::Changed(&changes.values),
                (None, None) => PixelSource::Nodes,
            },
            heating: powers.as_ref().map(|(start, powers)| Heating { start: *start, powers }),
            keep,
            between: order.between.map(|share| share as f32),
            sub_frame: exposed.map(|(sub_frame, _)| sub_frame),
            list: None,
        })?;
        Ok(Flying { submitted, image, heat })
    }

    /// Takes the step of an order, then draws the sub-frames of its exposure one after another. The result is ready at once.
    fn expose(
        &mut self,
        step: Option<EngineStep<'_>>,
        order: &Order<'_>,
        exposure: MotionBlur,
        ImageMoments(moment): ImageMoments<'_>,
    ) -> Result<(), EngineError> {
        let mut delivered = self.advance_first(step, order)?;
        let mut last = None;
        for (number, offset) in (0..).zip(exposure.offsets()) {
            let (instant, later) = (moment(offset), |later: f64| moment(offset + later));
            let sub_frame = SubFrame { number, count: exposure.sub_frames };
            let drawn = order.sub_frame(offset, &instant, ImageMoments(&later));
            last = Some(self.send(None, &drawn, Some((sub_frame, order.time)), &[])?);
        }
        if let Some(last) = last {
            let image = self.camera.as_ref().and_then(|camera| camera.image(order));
            let fourth = self.fourth();
            delivered.image = self.frames.collect(&mut self.renderer, Flying { image, ..last }, fourth)?.image;
        }
        self.frames.keep(delivered);
        Ok(())
    }

    /// Takes the step of an order without its image. No frame is under way afterwards.
    fn advance_first(&mut self, step: Option<EngineStep<'_>>, order: &Order<'_>) -> Result<Delivered, EngineError> {
        let fourth = self.fourth();
        self.frames.end(&mut self.renderer, fourth)?;
        if step.is_none() && !order.temperatures {
            return Ok(Delivered::default());
        }
        let without_image = Order { pose: None, moments: None, surroundings: None, ..*order };
        let stepped = self.send(step, &without_image, None, &[])?;
        let delivered = self.frames.collect(&mut self.renderer, stepped, fourth)?;
        self.take_switches()?;
        Ok(delivered)
    }

    /// Takes the step of an order, then draws its image with the light of pixels, which needs the temperatures of the nodes. The result is ready at once.
    fn draw_after(&mut self, step: Option<EngineStep<'_>>, order: &Order<'_>) -> Result<(), EngineError> {
        let mut delivered = self.advance_first(step, order)?;
        let temperatures = self.renderer.temperatures()?;
        let drawn = Order { keep: false, temperatures: false, absorbed: false, ..*order };
        let drawn = self.send(None, &drawn, None, &temperatures)?;
        let fourth = self.fourth();
        delivered.image = self.frames.collect(&mut self.renderer, drawn, fourth)?.image;
        self.frames.keep(delivered);
        Ok(())
    }
}

impl Engine for DeviceEngine {
    fn device_name(&self) -> String {
        self.context.info.name.clone()
    }

    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError> {
        self.renderer.settle(load)?;
        match self.given.clone() {
            Some(given) => self.take_given(&given, time, false),
            None => self.settle_network(load, time),
        }
    }

    fn settle_at(&mut self, temperature: f64, nodes: usize) -> Result<(), EngineError> {
        if let Some(network) = &mut self.network {
            network.settle_at(temperature);
            self.renderer.set_network(&network.temperatures(), network.on())?;
        }
        Ok(self.renderer.settle_at(&vec![temperature as f32; nodes])?)
    }

    fn take_camera(&mut self, camera: &Camera) -> bool {
        self.camera.as_mut().is_some_and(|own| own.take(camera, self.senses))
    }

    fn take_sensor(&mut self, prepared: &Prepared) -> Result<bool, EngineError> {
        let tables = sensor_tables(prepared).filter(|_| self.senses);
        Ok(tables.map(|tables| self.renderer.take_sensor(tables)).transpose()?.unwrap_or(false))
    }

    fn submit(&mut self, step: Option<EngineStep<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        let exposure = self.camera.as_ref().and_then(DeviceCamera::exposure).filter(|_| order.pose.is_some());
        let Some((exposure, moments)) = exposure.zip(order.moments) else {
            let past = self.camera.as_ref().and_then(|camera| camera.past(&order)).filter(|_| order.pose.is_some());
            if past.is_some_and(PastLight::needs_temperatures) {
                return self.draw_after(step, &order);
            }
            let flying = self.send(step, &order, None, &[])?;
            self.frames.push(flying);
            return Ok(());
        };
        self.expose(step, &order, exposure, moments)
    }

    fn deliver(&mut self) -> Result<Delivered, EngineError> {
        if let Some(delivered) = self.frames.ready() {
            return Ok(delivered);
        }
        let Some(flying) = self.frames.oldest() else { return Ok(Delivered::default()) };
        let fourth = self.fourth();
        let delivered = self.frames.collect(&mut self.renderer, flying, fourth)?;
        self.take_switches()?;
        Ok(delivered)
    }

    fn forward(&mut self, passing: &[EngineStep<'_>]) -> Result<(), EngineError> {
        if self.network.is_some() || self.exchange.is_some() || self.given.is_some() {
            return self.pass_singly(passing);
        }
        self.steps += passing.len() as u64;
        let loads: Vec<_> = passing.iter().map(|step| (step.load, step.steps)).collect();
        Ok(self.renderer.forward(&loads)?)
    }

    fn wait(&mut self) -> Result<(), EngineError> {
        Ok(self.renderer.wait()?)
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn fused_steps(&self) -> u64 {
        self.renderer.fused_steps()
    }

    fn device_bytes(&self) -> Option<u64> {
        Some(self.renderer.device_bytes())
    }

    fn pass_times(&self) -> Option<&PassTimes> {
        Some(self.renderer.pass_times())
    }

    fn keep_few_times(&mut self, most: usize) {
        self.renderer.keep_few_times(most);
        if let Some(network) = &mut self.network {
            network.keep_few_costs(most);
        }
    }

    fn save(&mut self) -> Result<EngineState, EngineError> {
        let scene = self.renderer.save()?;
        self.take_switches()?;
        Ok(EngineState::Device(Box::new(DeviceEngineState {
            steps: self.steps,
            scene,
            exchange: self.exchange.as_ref().map(DeviceExchange::save),
            network: self.network.as_ref().map(NetworkRun::save),
        })))
    }

    fn restore(&mut self, saved: &EngineState, most_times: usize) -> Result<(), EngineError> {
        let EngineState::Device(saved) = saved.of_craft() else {
            return Err(Misfit::Absent("a device".to_owned()).into());
        };
        if let Some(network) = &mut self.network {
            network.restore(part("a network", &saved.network)?, most_times)?;
            if !network.is_in_frames() {
                self.renderer.end_network();
            }
        }
        if let Some(exchange) = &mut self.exchange
            && let Some(new) = exchange.restore(part("radiation between surfaces", &saved.exchange)?)
        {
            self.renderer.set_exchange(exchange.tables(), new)?;
        }
        self.renderer.restore(&saved.scene)?;
        self.steps = saved.steps;
        Ok(())
    }

    fn show(&mut self, temperatures: &[f32]) -> Result<(), EngineError> {
        self.take_shown(temperatures)
    }

    fn surfaces(&mut self) -> Result<SurfaceState, EngineError> {
        let received = match &self.exchange {
            Some(exchange) => exchange.of_nodes(&self.renderer.face_loads()?),
            None => Vec::new(),
        };
        let lit = self.renderer.found_light()?;
        let temperatures = self.renderer.temperatures()?;
        Ok(SurfaceState {
            temperatures,
            lit,
            received,
            network: self.network_temperatures()?.unwrap_or_default(),
            structures: self.structures()?,
        })
    }

    fn structures(&mut self) -> Result<Vec<f64>, EngineError> {
        if self.structures.is_empty() {
            return Ok(Vec::new());
        }
        let of_nodes = self.renderer.structures()?;
        Ok(self.structures.iter().map(|node| f64::from(of_nodes[*node])).collect())
    }

    fn set_structures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        Ok(self.renderer.set_structures(&self.structures, temperatures)?)
    }

    fn network(&self) -> Option<&NetworkRun> {
        self.network.as_ref()
    }

    fn network_mut(&mut self) -> Option<&mut NetworkRun> {
        self.network.as_mut()
    }

    fn take_halving_course(&mut self, course: HalvingCourse) -> HalvingCourse {
        if self.renderer.halving().is_some() {
            return self.renderer.take_halving_course(course);
        }
        self.network.as_mut().map(|network| network.take_halving_course(course)).unwrap_or_default()
    }

    fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, EngineError> {
        let found = self.renderer.network_temperatures()?;
        self.take_switches()?;
        match found {
            Some(temperatures) => Ok(Some(temperatures)),
            None => Ok(self.network.as_ref().map(NetworkRun::temperatures)),
        }
    }

    fn exchange_rows(&self) -> Option<RowsBetween> {
        self.exchange.as_ref().and_then(DeviceExchange::rows)
    }

    fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        self.exchange.as_ref().map(|exchange| exchange.exchanged_infrared(black)).unwrap_or_default()
    }

    fn exchange_description(&self) -> Vec<(String, String)> {
        self.exchange.as_ref().map(DeviceExchange::description).unwrap_or_default()
    }

    fn network_description(&mut self) -> Vec<(String, String)> {
        // A device that is lost by now leaves the estimate out.
        let told = self.renderer.network_estimate().ok().flatten();
        let Some(network) = &mut self.network else { return Vec::new() };
        network.take_estimate(told);
        network.description()
    }

    fn set_network_temperatures(&mut self, temperatures: &[f64]) -> Result<(), EngineError> {
        let Some(network) = &mut self.network else { return Ok(()) };
        network.set_temperatures(temperatures);
        Ok(self.renderer.set_network(temperatures, network.on())?)
    }
}
