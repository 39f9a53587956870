//! Who computes: a Vulkan device in f32, or the f64 reference. Both take ticks and leave images and temperatures.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::DAffine3;

use super::device_data::DeviceData;
use super::network::{NetworkRun, TickCost};
use super::prepare::Prepared;
use super::reference_engine::ReferenceEngine;
use super::viewpoint::device_view;
use crate::environment::TickLoad;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::renderer::{Renderer, Request, Submitted};
use crate::gpu::resources::check_plan;
use crate::gpu::timing::PassTimes;
use crate::scene::Camera;
use crate::trace::{Trace, Track};

/// One tick as an engine takes it.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Mean load of the tick.
    pub load: &'a TickLoad,
    /// Its length in steps.
    pub steps: f64,
    /// When it starts [s].
    pub start: f64,
    /// Its length [s].
    pub length: f64,
}

/// What a tick is asked to leave.
#[derive(Debug, Clone, Copy, Default)]
pub struct Order<'a> {
    /// Pose of the camera, where an image is wanted.
    pub pose: Option<DAffine3>,
    /// Poses of the body and of the joints in the image; empty where nothing moves.
    pub joints: &'a [DAffine3],
    /// Whether all temperatures are wanted.
    pub temperatures: bool,
}

/// Pixels of an image, row after row from the top.
#[derive(Debug, Clone, Default)]
pub struct Pixels {
    /// Radiance [W m-2 sr-1], temperature [K], depth [m]; 0 where nothing is.
    pub radiance_temperature_depth: Vec<[f32; 3]>,
    /// Part and material, each plus 1; 0 where nothing is.
    pub identity: Vec<[u32; 2]>,
}

/// What a tick left.
#[derive(Debug, Clone, Default)]
pub struct Delivered {
    /// The image, where one was ordered.
    pub pixels: Option<Pixels>,
    /// Temperatures of all nodes in device order, padding included [K].
    pub temperatures: Option<Vec<f32>>,
}

/// A Vulkan device or the f64 reference.
pub enum Engine {
    /// In f32 on a device; deliveries come in the order of the ticks.
    Device {
        /// The scene on the device.
        renderer: Box<Renderer>,
        /// Frames not delivered yet.
        flying: VecDeque<Submitted>,
        /// Delivered ahead of their call, because a network needed the device.
        ready: VecDeque<Delivered>,
        /// The thermal network, where the scene has one.
        network: Option<Box<NetworkRun>>,
        /// Ticks submitted.
        ticks: u64,
        /// For the projection.
        camera: Option<Box<Camera>>,
        /// When what was done.
        trace: Trace,
        /// Its device.
        context: Arc<Context>,
    },
    /// In f64 on the processor.
    Reference(Box<ReferenceEngine>),
}

impl Engine {
    /// The scene on a Vulkan device. Images are drawn where `camera` is given.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn on_device(context: &Arc<Context>, prepared: &Prepared, camera: Option<&Camera>) -> Result<Self, GpuError> {
        let device = DeviceData::new(prepared);
        let data = device.scene_data(prepared, camera);
        let plan = data.plan();
        let of_network = prepared.network_bytes(&plan);
        check_plan(context, &plan, of_network.device + of_network.host, data.image)?;
        let renderer = Renderer::new(context, &data)?;
        let network = prepared.network.as_ref().map(|scene| NetworkRun::on_device(context, scene, renderer.spare()));
        Ok(Self::Device {
            network: network.transpose()?.map(Box::new),
            renderer: Box::new(renderer),
            flying: VecDeque::new(),
            ready: VecDeque::new(),
            ticks: 0,
            camera: camera.cloned().map(Box::new),
            trace: Trace::default(),
            context: Arc::clone(context),
        })
    }

    /// The scene on the f64 reference.
    pub fn reference(prepared: &Prepared, camera: Option<&Camera>) -> Self {
        Self::Reference(Box::new(ReferenceEngine::new(prepared, camera)))
    }

    /// Keeps when what is done from now on; the reference has host spans only.
    pub fn record(&mut self, trace: Trace) {
        match self {
            Self::Device { renderer, trace: own, .. } => {
                if trace.is_recording() {
                    renderer.keep_frames();
                }
                *own = trace;
            }
            Self::Reference(engine) => engine.trace = trace,
        }
    }

    /// Where that is kept.
    pub fn trace(&self) -> Trace {
        match self {
            Self::Device { trace, .. } => trace.clone(),
            Self::Reference(engine) => engine.trace.clone(),
        }
    }

    /// Name of the device, or `cpu`.
    pub fn device_name(&self) -> String {
        match self {
            Self::Device { context, .. } => context.info.name.clone(),
            Self::Reference(_) => "cpu (f64 reference)".to_owned(),
        }
    }

    /// Settles every node at the balance temperature of a load, and networks at their steady state at a time [s].
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle(&mut self, load: &TickLoad, time: f64) -> Result<(), GpuError> {
        match self {
            Self::Device { renderer, network, .. } => {
                renderer.settle(load)?;
                let Some(network) = network else { return Ok(()) };
                let mut values = renderer.absorbed(load)?;
                network.settle(network.scene().heat(|slot| f64::from(values[slot])), time)?;
                put(renderer, network, &mut values)
            }
            Self::Reference(engine) => engine.settle(load, time),
        }
    }

    /// Settles every node at a temperature [K].
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle_at(&mut self, temperature: f64, nodes: usize) -> Result<(), GpuError> {
        match self {
            Self::Device { renderer, network, .. } => {
                if let Some(network) = network {
                    network.settle_at(temperature)?;
                }
                renderer.settle_at(&vec![temperature as f32; nodes])
            }
            Self::Reference(engine) => engine.settle_at(temperature),
        }
    }

    /// Gives a tick (or, without one, the present state) to the engine; at most two may be under way.
    ///
    /// # Errors
    /// A call that fails.
    pub fn submit(&mut self, tick: Option<Tick<'_>>, order: Order<'_>) -> Result<(), GpuError> {
        match self {
            Self::Device { renderer, flying, ready, network, ticks, camera, trace, .. } => {
                let _submits = trace.span(Track::Host, "submit");
                *ticks += u64::from(tick.is_some());
                if let (Some(network), Some(tick)) = (network, &tick) {
                    // The host sits between the loads and the temperatures, so what is under way must land first.
                    while let Some(submitted) = flying.pop_front() {
                        ready.push_back(collect(renderer, submitted)?);
                    }
                    network.tick_begins();
                    let mut values = renderer.absorbed(tick.load)?;
                    network.tick(network.scene().heat(|slot| f64::from(values[slot])), tick.start, tick.length)?;
                    put(renderer, network, &mut values)?;
                    network.tick_ends();
                }
                let views = order.pose.as_ref().zip(camera.as_ref()).map(|(pose, camera)| {
                    let still = [DAffine3::IDENTITY];
                    let joints = if order.joints.is_empty() { &still } else { order.joints };
                    joints.iter().map(|joint| device_view(camera, &(*pose * *joint))).collect::<Vec<_>>()
                });
                flying.push_back(renderer.submit(Request {
                    tick: tick.map(|tick| (tick.load, tick.steps)),
                    views: views.as_deref().unwrap_or_default(),
                    temperatures: order.temperatures,
                    list: None,
                })?);
                Ok(())
            }
            Self::Reference(engine) => {
                let trace = engine.trace.clone();
                let _computes = trace.span(Track::Host, "f64 reference");
                engine.run(tick, order)
            }
        }
    }

    /// Lets ticks pass that leave nothing but the state; on a device many in one dispatch where nodes do not interact and
    /// nothing moves.
    ///
    /// # Errors
    /// A call that fails.
    pub fn forward(&mut self, passing: &[Tick<'_>]) -> Result<(), GpuError> {
        if let Self::Device { renderer, network: None, ticks, trace, .. } = self {
            let _submits = trace.span(Track::Host, "submit");
            *ticks += passing.len() as u64;
            let loads: Vec<_> = passing.iter().map(|tick| (tick.load, tick.steps)).collect();
            return renderer.forward(&loads);
        }
        for tick in passing {
            self.submit(Some(*tick), Order::default())?;
            self.deliver()?;
        }
        Ok(())
    }

    /// Waits until all that was given to the device is done.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait(&mut self) -> Result<(), GpuError> {
        match self {
            Self::Device { renderer, .. } => renderer.wait(),
            Self::Reference(_) => Ok(()),
        }
    }

    /// What the oldest tick under way leaves; empty where none is.
    ///
    /// # Errors
    /// A lost device.
    pub fn deliver(&mut self) -> Result<Delivered, GpuError> {
        match self {
            Self::Device { renderer, flying, ready, trace, .. } => {
                if let Some(delivered) = ready.pop_front() {
                    return Ok(delivered);
                }
                let Some(submitted) = flying.pop_front() else { return Ok(Delivered::default()) };
                let waits = trace.span(Track::Host, "wait for the device");
                let delivered = collect(renderer, submitted)?;
                drop(waits);
                renderer.take_frames().into_iter().for_each(|frame| trace.frame(frame));
                Ok(delivered)
            }
            Self::Reference(engine) => Ok(engine.delivered.pop_front().unwrap_or_default()),
        }
    }

    /// Ticks so far, those of a warm-up included.
    pub fn ticks(&self) -> u64 {
        match self {
            Self::Device { ticks, .. } => *ticks,
            Self::Reference(engine) => engine.ticks,
        }
    }

    /// Those of them that passed in dispatches of many.
    pub fn fused_ticks(&self) -> u64 {
        match self {
            Self::Device { renderer, .. } => renderer.fused_ticks(),
            Self::Reference(_) => 0,
        }
    }

    /// Bytes on the device, as they were allocated, that follow the number of nodes; what only the host reads is not counted.
    /// `None` for the reference.
    pub fn device_bytes(&self) -> Option<u64> {
        match self {
            Self::Device { renderer, network, .. } => {
                let of_network = network.as_ref().and_then(|network| network.device_bytes());
                Some(renderer.device_bytes() + of_network.unwrap_or(0))
            }
            Self::Reference(_) => None,
        }
    }

    /// The network under way, where the scene has one.
    pub fn network(&self) -> Option<&NetworkRun> {
        match self {
            Self::Device { network, .. } => network.as_deref(),
            Self::Reference(engine) => engine.network.as_ref(),
        }
    }

    /// Cost of the network in every tick so far; empty where the scene has none.
    pub fn network_costs(&self) -> &[TickCost] {
        self.network().map_or(&[], NetworkRun::costs)
    }

    /// From now on the network's ticks may err by ten times its tolerance, or no longer.
    pub fn set_coarse(&mut self, coarse: bool) {
        let network = match self {
            Self::Device { network, .. } => network.as_deref_mut(),
            Self::Reference(engine) => engine.network.as_mut(),
        };
        if let Some(network) = network {
            network.set_coarse(coarse);
        }
    }

    /// Temperatures of the network's nodes [K], where the scene has a network.
    ///
    /// # Errors
    /// A call that fails.
    pub fn network_temperatures(&mut self) -> Result<Option<Vec<f64>>, GpuError> {
        match self {
            Self::Device { network, .. } => network.as_mut().map(|network| network.temperatures()).transpose(),
            Self::Reference(engine) => engine.network.as_mut().map(NetworkRun::temperatures).transpose(),
        }
    }

    /// Replaces the temperatures of the network's nodes [K]; they show after the next tick.
    ///
    /// # Errors
    /// A call that fails.
    pub fn set_network_temperatures(&mut self, temperatures: &[f64]) -> Result<(), GpuError> {
        match self {
            Self::Device { network: Some(network), .. } => network.set_temperatures(temperatures),
            Self::Device { network: None, .. } => Ok(()),
            Self::Reference(engine) => match &mut engine.network {
                Some(network) => network.set_temperatures(temperatures),
                None => Ok(()),
            },
        }
    }

    /// How the network was integrated, in words; empty where the scene has none.
    pub fn network_description(&self) -> Vec<(String, String)> {
        self.network().map(NetworkRun::description).unwrap_or_default()
    }

    /// Device milliseconds of every pass so far; `None` for the reference.
    pub fn pass_times(&self) -> Option<&PassTimes> {
        match self {
            Self::Device { renderer, .. } => Some(renderer.pass_times()),
            Self::Reference(_) => None,
        }
    }
}

/// What a frame leaves.
fn collect(renderer: &mut Renderer, submitted: Submitted) -> Result<Delivered, GpuError> {
    let collected = renderer.collect(submitted)?;
    let pixels = collected.radiance.zip(collected.identity).map(|(radiance, identity)| Pixels {
        radiance_temperature_depth: radiance.iter().map(|[l, t, z, _]| [*l, *t, *z]).collect(),
        identity: identity.to_vec(),
    });
    Ok(Delivered { pixels, temperatures: collected.temperatures.map(<[f32]>::to_vec) })
}

/// Puts a network's temperatures where the device draws from, in place of the fluxes in `values`.
fn put(renderer: &mut Renderer, network: &mut NetworkRun, values: &mut [f32]) -> Result<(), GpuError> {
    if network.wrote_spare() {
        renderer.spare_was_used();
    }
    let temperatures = network.temperatures()?;
    network.scene().scatter(&temperatures, |slot, temperature| values[slot] = temperature as f32);
    renderer.set_temperatures(values)
}
