//! The Vulkan device as an engine: it steps and draws every node in f32.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::DAffine3;

use super::device_data::DeviceData;
use super::engine::{Delivered, Engine, EngineError, Order, Pixels, Step};
use super::network::NetworkRun;
use super::prepare::Prepared;
use super::surroundings::Finishes;
use super::viewpoint::device_view;
use crate::environment::StepLoad;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::layout;
use crate::gpu::renderer::{Heating, Renderer, Request, Submitted};
use crate::gpu::resources::check_plan;
use crate::gpu::timing::PassTimes;
use crate::saved::Saved;
use crate::scene::Camera;
use crate::trace::{Trace, Track};

/// A scene on a device. Results are delivered in the order of the steps.
pub struct DeviceEngine {
    /// The device state that steps and draws.
    pub renderer: Renderer,
    flying: VecDeque<Submitted>,
    /// Results that were fetched early because a network needed the device.
    ready: VecDeque<Delivered>,
    network: Option<NetworkRun>,
    steps: u64,
    /// Intrinsics for the projection.
    camera: Option<Camera>,
    finishes: Finishes,
    trace: Trace,
    context: Arc<Context>,
}

impl DeviceEngine {
    /// The scene on a Vulkan device. Images are drawn where `camera` is given.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn new(context: &Arc<Context>, prepared: &Prepared, camera: Option<&Camera>) -> Result<Self, GpuError> {
        let device = DeviceData::new(prepared);
        let data = device.scene_data(prepared, camera);
        let plan = data.plan();
        let of_network = prepared.network_bytes(&plan);
        check_plan(context, &plan, of_network.device + of_network.host, data.image)?;
        let renderer = Renderer::new(context, &data)?;
        let network = prepared.network.as_ref().map(|scene| NetworkRun::on_device(context, scene, renderer.spare()));
        Ok(Self {
            network: network.transpose()?,
            renderer,
            flying: VecDeque::new(),
            ready: VecDeque::new(),
            steps: 0,
            camera: camera.cloned(),
            finishes: device.finishes,
            trace: Trace::default(),
            context: Arc::clone(context),
        })
    }

    /// Steps the network under the load of a step. The host integrates between the loads and the temperatures, so frames under way must end first.
    fn step_network(&mut self, step: &Step<'_>) -> Result<(), EngineError> {
        let Some(network) = &mut self.network else { return Ok(()) };
        while let Some(submitted) = self.flying.pop_front() {
            self.ready.push_back(collect(&mut self.renderer, submitted, self.finishes.is_apart())?);
        }
        network.step_begins();
        let mut values = self.renderer.absorbed(step.load)?;
        network.step(network.scene().heat(|slot| f64::from(values[slot])), step.start, step.length)?;
        put(&mut self.renderer, network, &mut values)?;
        network.step_ends();
        Ok(())
    }

    /// Takes the switches of thermostats in frames that step the network.
    fn take_switches(&mut self) -> Result<(), EngineError> {
        let switches = self.renderer.take_switches();
        self.network.as_mut().map_or(Ok(()), |network| network.take_switches(&switches))
    }

    /// The camera pose against the body and against each joint.
    fn views(&self, order: &Order<'_>) -> Option<Vec<layout::View>> {
        let (pose, camera) = order.pose.as_ref().zip(self.camera.as_ref())?;
        let still = [DAffine3::IDENTITY];
        let joints = if order.joints.is_empty() { &still } else { order.joints };
        Some(joints.iter().map(|joint| device_view(camera, &(*pose * *joint))).collect())
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
        let Some(network) = &mut self.network else { return Ok(()) };
        let mut values = self.renderer.absorbed(load)?;
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

    fn submit(&mut self, step: Option<Step<'_>>, order: Order<'_>) -> Result<(), EngineError> {
        let trace = self.trace.clone();
        let _submits = trace.span(Track::Host, "submit");
        self.steps += u64::from(step.is_some());
        let mut powers = None;
        match (&step, &self.network) {
            (Some(step), Some(network)) if network.is_in_frames() => {
                powers = Some((step.start, network.scene().heater_powers(step.start, step.length)));
            }
            (Some(step), Some(_)) => self.step_network(step)?,
            _ => {}
        }
        let views = self.views(&order);
        self.flying.push_back(self.renderer.submit(Request {
            step: step.map(|step| (step.load, step.steps)),
            views: views.as_deref().unwrap_or_default(),
            temperatures: order.temperatures,
            surroundings: order.surroundings.as_ref().map(layout::Surroundings::new),
            lobes: order.surroundings.map_or(&[], |around| self.finishes.lobes.values_before(around.planet)),
            heating: powers.as_ref().map(|(start, powers)| Heating { start: *start, powers }),
            list: None,
        })?);
        Ok(())
    }

    fn deliver(&mut self) -> Result<Delivered, EngineError> {
        if let Some(delivered) = self.ready.pop_front() {
            return Ok(delivered);
        }
        let Some(submitted) = self.flying.pop_front() else { return Ok(Delivered::default()) };
        let waits = self.trace.span(Track::Host, "wait for the device");
        let delivered = collect(&mut self.renderer, submitted, self.finishes.is_apart())?;
        drop(waits);
        self.take_switches()?;
        self.renderer.take_frames().into_iter().for_each(|frame| self.trace.frame(frame));
        Ok(delivered)
    }

    fn forward(&mut self, passing: &[Step<'_>]) -> Result<(), EngineError> {
        if self.network.is_some() {
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
        self.take_switches()?;
        if let Some(network) = &mut self.network {
            saved.put_all("network", network.save()?);
        }
        Ok(saved)
    }

    fn restore(&mut self, saved: &Saved, most_times: usize) -> Result<(), EngineError> {
        if let Some(network) = &mut self.network {
            network.restore(&saved.part("network"), most_times)?;
        }
        self.renderer.restore(&saved.part("scene"))?;
        [self.steps] = saved.array("steps")?;
        Ok(())
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

/// Converts a frame to the result of a step.
fn collect(renderer: &mut Renderer, submitted: Submitted, apart: bool) -> Result<Delivered, GpuError> {
    let collected = renderer.collect(submitted)?;
    let pixels = collected.radiance.zip(collected.identity).map(|(radiance, identity)| Pixels {
        radiance_temperature_depth: radiance.iter().map(|[l, t, z, _]| [*l, *t, *z]).collect(),
        identity: identity.to_vec(),
        reflected: if apart { radiance.iter().map(|[.., reflected]| *reflected).collect() } else { Vec::new() },
    });
    Ok(Delivered { pixels, temperatures: collected.temperatures.map(<[f32]>::to_vec) })
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
