//! The Vulkan device as an engine: it steps and draws every node in f32.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::DAffine3;

use super::device_data::DeviceData;
use super::distant::{Distance, told};
use super::energy::absorbed_heat;
use super::engine::{Delivered, Engine, EngineError, Moment, Order, Pixels, Rows, Step};
use super::exchange_device::DeviceExchange;
use super::given::Given;
use super::network::NetworkRun;
use super::pose::draws_alike;
use super::prepare::Prepared;
use super::surroundings::Finishes;
use super::viewpoint::{device_view, rolling, source_view};
use crate::environment::StepLoad;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::heat::{HeatOf, HeatTables};
use crate::gpu::layout;
use crate::gpu::renderer::{Heating, Renderer, Request, Submitted};
use crate::gpu::resources::check_plan;
use crate::gpu::sampling::Sampling;
use crate::gpu::timing::PassTimes;
use crate::saved::Saved;
use crate::scene::Camera;
use crate::trace::{Trace, Track};

/// What the fourth value of a pixel is, after radiance, temperature and depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fourth {
    /// Nothing that is an output.
    Nothing,
    /// Share of the samples that show a surface.
    Coverage,
    /// Reflected radiance.
    Reflected,
}

/// A frame under way.
struct Flying {
    submitted: Submitted,
    /// Heat that each run of network nodes absorbs in the step [W], where the host steps the network.
    heat: Option<Vec<f64>>,
}

/// A scene on a device. Results are delivered in the order of the steps.
pub struct DeviceEngine {
    /// The device state that steps and draws.
    pub renderer: Renderer,
    flying: VecDeque<Flying>,
    /// Results that were fetched early because a network needed the device.
    ready: VecDeque<Delivered>,
    network: Option<NetworkRun>,
    /// Patches that radiate to each other, and what was found for poses of the joints.
    exchange: Option<DeviceExchange>,
    /// Runs of nodes whose absorbed heat is summed.
    heat: Option<HeatTables>,
    /// Temperatures of a file.
    given: Option<Arc<Given>>,
    /// Nodes with a structure below them.
    structures: Vec<usize>,
    steps: u64,
    /// Intrinsics for the projection.
    camera: Option<Camera>,
    /// How the camera's image is made, without the map of the lens.
    sampling: Option<Sampling>,
    /// Whether the image has a sensor.
    senses: bool,
    finishes: Finishes,
    /// The boxes of a craft that may be far away.
    distance: Option<Distance>,
    trace: Trace,
    context: Arc<Context>,
}

impl DeviceEngine {
    /// The scene on a Vulkan device. Images are drawn where `camera` is given.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn new(context: &Arc<Context>, prepared: &Prepared, camera: Option<&Camera>) -> Result<Self, GpuError> {
        let poses = prepared.loads.joints_at(0.0).1;
        let found = prepared.exchange.as_ref().map(|craft| DeviceExchange::new(context, craft, &poses));
        let exchange = found.transpose()?;
        let tables = exchange.as_ref().and_then(|own| own.tables().cloned());
        let device = DeviceData::new(prepared).with_exchange(tables);
        let data = device.scene_data_with(prepared, camera, context.info.sample_counts);
        let plan = data.plan();
        let of_network = prepared.network_bytes(&plan);
        check_plan(context, &plan, of_network.device + of_network.host, data.drawn())?;
        let renderer = Renderer::new(context, &data)?;
        let network = prepared.network.as_ref().map(|scene| NetworkRun::on_device(context, scene, renderer.spare()));
        Ok(Self {
            network: network.transpose()?,
            exchange,
            heat: device.heat.clone(),
            given: prepared.given.clone(),
            structures: prepared.structures(),
            renderer,
            flying: VecDeque::new(),
            ready: VecDeque::new(),
            steps: 0,
            camera: camera.cloned(),
            distance: data
                .sampling
                .as_ref()
                .filter(|sampling| sampling.distant)
                .zip(camera)
                .and_then(|(_, camera)| Distance::new(prepared, camera)),
            sampling: data.sampling.map(|sampling| Sampling { map: Vec::new(), ..sampling }),
            senses: data.sensor.is_some(),
            finishes: device.finishes,
            trace: Trace::default(),
            context: Arc::clone(context),
        })
    }

    /// Steps the network under the load of a step, and before it keeps the temperatures where the order says so. The host integrates between the loads and
    /// the temperatures, so frames under way must end first.
    fn step_network(&mut self, step: &Step<'_>, order: &Order<'_>) -> Result<Option<Vec<f64>>, EngineError> {
        let fourth = self.fourth();
        while let Some(flying) = self.flying.pop_front() {
            self.ready.push_back(collect(&mut self.renderer, flying, self.heat.as_ref(), fourth)?);
        }
        if order.keep && self.network.is_some() {
            self.renderer.keep_temperatures()?;
        }
        let Some(network) = &mut self.network else { return Ok(None) };
        network.step_begins();
        let mut values = self.renderer.absorbed(step.load, Some(step.steps))?;
        network.step(network.scene().heat(|slot| f64::from(values[slot])), step.start, step.length)?;
        let tables = self.heat.as_ref().filter(|_| order.absorbed);
        let heat = tables.map(|tables| absorbed_heat(tables, |slot| f64::from(values[slot])));
        put(&mut self.renderer, network, &mut values)?;
        network.step_ends();
        Ok(heat)
    }

    /// Writes the temperatures of a file at a time [s], and before them keeps those before the step where the order says so.
    fn take_given(&mut self, given: &Given, time: f64, keep: bool) -> Result<(), EngineError> {
        let fourth = self.fourth();
        while let Some(flying) = self.flying.pop_front() {
            self.ready.push_back(collect(&mut self.renderer, flying, self.heat.as_ref(), fourth)?);
        }
        if keep {
            self.renderer.keep_temperatures()?;
        }
        let temperatures: Vec<f32> = given.at(time).iter().map(|kelvin| *kelvin as f32).collect();
        Ok(self.renderer.set_temperatures(&temperatures)?)
    }

    /// Leaves the network to sub-steps if its frames do not keep the tolerance, before a step from `start` [s].
    fn change_over(&mut self, start: f64) -> Result<(), EngineError> {
        let (Some(network), Some(halving)) = (&self.network, self.renderer.halving()) else { return Ok(()) };
        if !network.gives_up(halving) {
            return Ok(());
        }
        let fourth = self.fourth();
        while let Some(flying) = self.flying.pop_front() {
            self.ready.push_back(collect(&mut self.renderer, flying, self.heat.as_ref(), fourth)?);
        }
        self.take_switches()?;
        let estimate = self.renderer.network_estimate()?.map(|(estimate, _)| estimate).unwrap_or_default();
        let temperatures = self.renderer.network_temperatures()?.unwrap_or_default();
        self.renderer.end_network();
        self.network.as_mut().map_or(Ok(()), |network| network.change_over(&temperatures, estimate, start))
    }

    /// Casts the rays of patches anew where a joint has moved.
    fn follow_joints(&mut self, step: &Step<'_>) -> Result<(), EngineError> {
        let fourth = self.fourth();
        let Some(exchange) = &mut self.exchange else { return Ok(()) };
        if let Some(tables) = exchange.turn(&step.load.joints, step.load.is_warm_up())? {
            while let Some(flying) = self.flying.pop_front() {
                self.ready.push_back(collect(&mut self.renderer, flying, self.heat.as_ref(), fourth)?);
            }
            self.renderer.set_exchange(tables)?;
        }
        Ok(())
    }

    /// Takes the switches of thermostats in frames that step the network.
    fn take_switches(&mut self) -> Result<(), EngineError> {
        let switches = self.renderer.take_switches();
        self.network.as_mut().map_or(Ok(()), |network| network.take_switches(&switches))
    }

    /// What the fourth value of a pixel is. A scene is refused where it is both.
    fn fourth(&self) -> Fourth {
        if self.camera.as_ref().is_some_and(|camera| camera.samples > 1) {
            Fourth::Coverage
        } else if self.finishes.is_apart() {
            Fourth::Reflected
        } else {
            Fourth::Nothing
        }
    }

    /// The camera pose against the body and against each joint.
    fn views(&self, order: &Order<'_>) -> Option<Vec<layout::View>> {
        let (pose, camera) = order.pose.as_ref().zip(self.camera.as_ref())?;
        let still = [DAffine3::IDENTITY];
        let joints = if order.joints.is_empty() { &still } else { order.joints };
        let view = |joint: &DAffine3| match &self.sampling {
            Some(sampling) => source_view(sampling, camera.near, &(*pose * *joint)),
            None => device_view(camera, &(*pose * *joint)),
        };
        Some(joints.iter().map(view).collect())
    }

    /// The views of the crop of an image of a craft that is far away, and how its texels are put into pixels.
    fn crop(&self, order: &Order<'_>) -> Option<(Vec<layout::View>, layout::Distant)> {
        let (pose, camera) = order.pose.as_ref().zip(self.camera.as_ref())?;
        let crop = self.distance.as_ref()?.crop(camera, pose, order.joints)?;
        Some(told(camera, &crop, pose, order.joints))
    }

    /// The rolling shutter against the body and against each joint. Empty if all rows see one pose.
    fn shutters(&self, order: &Order<'_>) -> Vec<layout::Shutter> {
        let shutter = self.sampling.as_ref().and_then(|sampling| sampling.shutter.as_ref());
        let (Some((_, shutter)), Some(camera), Some(Rows(moment))) = (shutter, &self.camera, order.rows) else {
            return Vec::new();
        };
        let last = f64::from(camera.height - 1);
        let [middle, last] = [0.5 * last, last].map(|row| {
            let Moment { pose, joints } = moment(row);
            let of_joint = |joint: &DAffine3| pose * *joint;
            if joints.is_empty() { vec![pose] } else { joints.iter().map(of_joint).collect() }
        });
        middle.iter().zip(&last).map(|(middle, last)| rolling(shutter, middle, last)).collect()
    }
}

impl Engine for DeviceEngine {
    fn record(&mut self, trace: Trace) {
        if trace.is_recording() {
            self.renderer.keep_frames();
        }
        self.trace = trace;
    }

    fn trace(&self) -> Trace {
        self.trace.clone()
    }

    fn device_name(&self) -> String {
        self.context.info.name.clone()
    }

    fn settle(&mut self, load: &StepLoad, time: f64) -> Result<(), EngineError> {
        self.renderer.settle(load)?;
        if let Some(given) = self.given.clone() {
            return self.take_given(&given, time, false);
        }
        let Some(network) = &mut self.network else { return Ok(()) };
        let mut values = self.renderer.absorbed(load, None)?;
        network.settle(network.scene().heat(|slot| f64::from(values[slot])), time)?;
        put(&mut self.renderer, network, &mut values)?;
        Ok(self.renderer.set_network(&network.temperatures()?, network.on())?)
    }

    fn settle_at(&mut self, temperature: f64, nodes: usize) -> Result<(), EngineError> {
        if let Some(network) = &mut self.network {
            network.settle_at(temperature)?;
            self.renderer.set_network(&network.temperatures()?, network.on())?;
        }
        Ok(self.renderer.settle_at(&vec![temperature as f32; nodes])?)
    }

    fn take_camera(&mut self, camera: &Camera) -> bool {
        let any_lens = self.sampling.is_none() && !self.senses;
        let fits = self.camera.as_ref().is_some_and(|own| draws_alike(own, camera, any_lens));
        if fits {
            self.camera = Some(camera.clone());
        }
        fits
    }

    fn submit(&mut self, step: Option<Step<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        let trace = self.trace.clone();
        let _submits = trace.span(Track::Host, "submit");
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
                heat = self.step_network(step, &order)?;
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
        let crop = self.crop(&order);
        let (views, distant) = match &crop {
            Some((views, distant)) => (Some(views.clone()), Some(*distant)),
            None => (self.views(&order), None),
        };
        let shutters = self.shutters(&order);
        if let Some(around) = &order.surroundings {
            self.finishes.look_at(around);
        }
        if let Some(traced) = self.finishes.traced.as_mut().filter(|_| order.pose.is_some()) {
            traced.follow(order.joints);
        }
        let finishes = &mut self.finishes;
        let lobes = order.surroundings.map_or(&[][..], |around| finishes.lobes.values_before(around.planet));
        let planet = order.surroundings.zip(finishes.planet.as_ref()).and_then(|(around, planet)| planet.told(&around));
        let submitted = self.renderer.submit(Request {
            step: step.map(|step| (step.load, step.steps)),
            views: views.as_deref().unwrap_or_default(),
            shutters: &shutters,
            temperatures: order.temperatures,
            absorbed: order.absorbed,
            time: Some(order.time),
            surroundings: order.surroundings.as_ref().map(layout::Surroundings::new),
            lobes,
            planet,
            traced: order.pose.as_ref().and(finishes.traced.as_ref()).map(|traced| traced.told(order.time)),
            distant,
            heating: powers.as_ref().map(|(start, powers)| Heating { start: *start, powers }),
            keep,
            between: order.between.map(|share| share as f32),
            list: None,
        })?;
        self.flying.push_back(Flying { submitted, heat });
        Ok(())
    }

    fn deliver(&mut self) -> Result<Delivered, EngineError> {
        if let Some(delivered) = self.ready.pop_front() {
            return Ok(delivered);
        }
        let Some(flying) = self.flying.pop_front() else { return Ok(Delivered::default()) };
        let waits = self.trace.span(Track::Host, "wait for the device");
        let fourth = self.fourth();
        let delivered = collect(&mut self.renderer, flying, self.heat.as_ref(), fourth)?;
        drop(waits);
        self.take_switches()?;
        self.renderer.take_frames().into_iter().for_each(|frame| self.trace.frame(frame));
        Ok(delivered)
    }

    fn forward(&mut self, passing: &[Step<'_>]) -> Result<(), EngineError> {
        if self.network.is_some() || self.exchange.is_some() || self.given.is_some() {
            return self.pass_singly(passing);
        }
        let _submits = self.trace.span(Track::Host, "submit");
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
        let of_network = self.network.as_ref().and_then(NetworkRun::device_bytes);
        Some(self.renderer.device_bytes() + of_network.unwrap_or(0))
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

    fn save(&mut self) -> Result<Saved, EngineError> {
        let mut saved = Saved::default();
        saved.put("steps", &[self.steps]);
        saved.put_all("scene", self.renderer.save()?);
        if let Some(exchange) = &self.exchange {
            saved.put_all("exchange_rays", exchange.save());
        }
        self.take_switches()?;
        if let Some(network) = &mut self.network {
            saved.put_all("network", network.save()?);
        }
        Ok(saved)
    }

    fn restore(&mut self, saved: &Saved, most_times: usize) -> Result<(), EngineError> {
        if let Some(network) = &mut self.network {
            network.restore(&saved.part("network"), most_times)?;
            if !network.is_in_frames() {
                self.renderer.end_network();
            }
        }
        if let Some(exchange) = &mut self.exchange
            && let Some(tables) = exchange.restore::<EngineError>(&saved.part("exchange_rays"))?
        {
            self.renderer.set_exchange(tables)?;
        }
        self.renderer.restore(&saved.part("scene"))?;
        [self.steps] = saved.array("steps")?;
        Ok(())
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

    fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, EngineError> {
        let found = self.renderer.network_temperatures()?;
        self.take_switches()?;
        match found {
            Some(temperatures) => Ok(Some(temperatures)),
            None => self.network.as_mut().map(NetworkRun::temperatures).transpose(),
        }
    }

    fn exchange_poses(&self) -> Option<&[DAffine3]> {
        self.exchange.as_ref().and_then(DeviceExchange::poses)
    }

    fn exchanged_infrared(&self, black: &[f64]) -> Vec<f64> {
        let tables = self.exchange.as_ref().and_then(DeviceExchange::tables);
        tables.map(|tables| tables.exchanged_infrared(black)).unwrap_or_default()
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
        network.set_temperatures(temperatures)?;
        Ok(self.renderer.set_network(temperatures, network.on())?)
    }
}

/// Converts a frame to the result of a step. `fourth` says what the fourth value of a pixel is.
fn collect(
    renderer: &mut Renderer,
    flying: Flying,
    tables: Option<&HeatTables>,
    fourth: Fourth,
) -> Result<Delivered, GpuError> {
    let collected = renderer.collect(flying.submitted)?;
    let mut absorbed: Option<Vec<f64>> =
        collected.absorbed.map(|heat| heat.iter().map(|watts| f64::from(*watts)).collect());
    if let (Some(tables), Some(of_network)) = (tables, flying.heat) {
        let absorbed = absorbed.get_or_insert_with(|| vec![0.0; tables.runs.len()]);
        for (number, _) in tables.runs.iter().enumerate().filter(|(_, run)| run.of == HeatOf::Flux) {
            absorbed[number] = of_network[number];
        }
    }
    let pixels = collected.radiance.zip(collected.identity).map(|(radiance, identity)| {
        let [coverage, reflected] = [Fourth::Coverage, Fourth::Reflected].map(|wanted| {
            if wanted == fourth { radiance.iter().map(|[.., value]| *value).collect() } else { Vec::new() }
        });
        Pixels {
            radiance_temperature_depth: radiance.iter().map(|[l, t, z, _]| [*l, *t, *z]).collect(),
            identity: identity.to_vec(),
            coverage,
            reflected,
            readings: collected.readings,
        }
    });
    Ok(Delivered { pixels, temperatures: collected.temperatures.map(<[f32]>::to_vec), absorbed })
}

/// Writes a network's temperatures over the fluxes in `values`, from which the device draws.
fn put(renderer: &mut Renderer, network: &mut NetworkRun, values: &mut [f32]) -> Result<(), EngineError> {
    if network.wrote_spare() {
        renderer.spare_was_used();
    }
    let temperatures = network.temperatures()?;
    network.scene().scatter(&temperatures, |slot, temperature| values[slot] = temperature as f32);
    Ok(renderer.set_temperatures(values)?)
}
