//! Who computes: a Vulkan device in f32, or the f64 reference. Both take ticks and leave images and temperatures.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::DAffine3;

use super::check::shade;
use super::network::{NetworkRun, TickCost};
use super::prepare::Prepared;
use super::viewpoint::{device_view, raster_view};
use crate::environment::load::{albedo_flux, planet_ir_flux, solar_flux};
use crate::environment::shadow::{Jointed, Shadows};
use crate::environment::{TickLoad, load};
use crate::gpu::blackbody::band_table;
use crate::gpu::context::Context;
use crate::gpu::error::GpuError;
use crate::gpu::layout;
use crate::gpu::renderer::{Renderer, Submitted};
use crate::gpu::resources::{JointData, SceneData, ShadowData, check_plan};
use crate::gpu::shapes::Shapes;
use crate::gpu::timing::PassTimes;
use crate::raster::{self, Surface, rasterise};
use crate::scene::Camera;
use crate::thermal::balance::Incident;
use crate::thermal::brightness::BrightnessTable;
use crate::thermal::material::{Material, Response, Sides};
use crate::thermal::nodes::{GROUP, PADDING};
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::radiance_f32::RadianceTableF32;
use crate::thermal::reference::{Reference, ReferenceNode};
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

/// Fluxes on a plate, by the twins of the device's functions.
pub fn incident(load: &TickLoad, normal: glam::DVec3) -> Incident {
    Incident {
        solar: solar_flux(load, normal),
        albedo: albedo_flux(load, normal),
        planet_ir: planet_ir_flux(load, normal),
    }
}

/// The same with the albedo's exact integral in place of its table.
pub fn exact_incident(load: &TickLoad, normal: glam::DVec3) -> Incident {
    Incident { albedo: load::exact_albedo_flux(load, normal), ..incident(load, normal) }
}

/// How the reference finds what falls on a plate.
pub type IncidentFunction = fn(&TickLoad, glam::DVec3) -> Incident;

/// The f64 reference of all nodes, and its rasteriser.
pub struct ReferenceEngine {
    reference: Reference<IncidentFunction>,
    shadows: Option<Shadows>,
    node_of_slot: Vec<u32>,
    slots: usize,
    /// What is drawn, in the file's pose.
    surface: Jointed,
    parts: Vec<u32>,
    materials: Vec<u32>,
    emissivities: Vec<[f64; 2]>,
    network: Option<NetworkRun>,
    ticks: u64,
    camera: Option<Camera>,
    table: RadianceTable,
    delivered: VecDeque<Delivered>,
    trace: Trace,
}

impl Engine {
    /// The scene on a Vulkan device. Images are drawn where `camera` is given.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn on_device(context: &Arc<Context>, prepared: &Prepared, camera: Option<&Camera>) -> Result<Self, GpuError> {
        let device = DeviceData::new(prepared);
        let data = device.scene_data(prepared, camera);
        check_plan(context, &data.plan(), prepared.network_bytes(), data.image)?;
        let renderer = Renderer::new(context, &data)?;
        Ok(Self::Device {
            renderer: Box::new(renderer),
            flying: VecDeque::new(),
            ready: VecDeque::new(),
            network: prepared
                .network
                .as_ref()
                .map(|scene| NetworkRun::on_device(context, scene).map(Box::new))
                .transpose()?,
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
            Self::Reference(engine) => {
                engine.shade(load);
                engine.reference.settle(load);
                let heat = engine.heat(load);
                match &mut engine.network {
                    Some(network) => network.settle(heat, time)?,
                    None => return Ok(()),
                }
                engine.take_network()
            }
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
            Self::Reference(engine) => {
                engine.reference.settle_at(temperature);
                engine.network.as_mut().map_or(Ok(()), |network| network.settle_at(temperature))
            }
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
                let views: Option<Vec<layout::View>> =
                    order.pose.as_ref().zip(camera.as_ref()).map(|(pose, camera)| {
                        let still = [DAffine3::IDENTITY];
                        let joints = if order.joints.is_empty() { &still } else { order.joints };
                        joints.iter().map(|joint| device_view(camera, &(*pose * *joint))).collect()
                    });
                let tick = tick.map(|tick| (tick.load, tick.steps));
                flying.push_back(renderer.submit_views(tick, views.as_deref(), order.temperatures)?);
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
    let temperatures = network.temperatures()?;
    network.scene().scatter(&temperatures, |slot, temperature| values[slot] = temperature as f32);
    renderer.set_temperatures(values)
}

/// What the device needs beside the arrays of `Prepared`.
pub struct DeviceData {
    materials: Vec<layout::Material>,
    shapes: Shapes,
    band_table: Vec<f32>,
}

impl DeviceData {
    /// Rounds the scene's materials and band to f32.
    pub fn new(prepared: &Prepared) -> Self {
        let table = RadianceTable::new(prepared.scene.band);
        let table = RadianceTableF32::new(&table, &BrightnessTable::new(&table));
        let shapes = Shapes::of(&prepared.materials);
        let materials = prepared.materials.iter().map(device_material).collect();
        Self { materials, shapes, band_table: band_table(&table) }
    }

    /// The scene as plain numbers for the device.
    pub fn scene_data<'a>(&'a self, prepared: &'a Prepared, camera: Option<&Camera>) -> SceneData<'a> {
        SceneData {
            ranges: prepared.step_ranges(),
            group_material: &prepared.nodes.group_material,
            group_part: &prepared.nodes.group_part,
            normals: &prepared.nodes.normals,
            positions: &prepared.nodes.positions,
            triangles: &prepared.triangles,
            materials: &self.materials,
            shapes: &self.shapes,
            band_table: &self.band_table,
            image: camera.map(|camera| [camera.width, camera.height]),
            shadows: prepared.redraw().map(|redraw| ShadowData {
                occluders: &prepared.occluders,
                redraw,
                tree: prepared.shadow_tree.as_ref(),
            }),
            joints: (prepared.joints() > 1).then(|| JointData {
                count: prepared.joints() as u32,
                triangles: &prepared.triangle_runs,
                occluders: &prepared.occluder_runs,
                casters: prepared.shadow_tree.as_ref().map(|_| prepared.casters()),
            }),
        }
    }
}

/// A material rounded to f32. Where only the outside exchanges heat, the back looks like the front.
pub fn device_material(material: &Material) -> layout::Material {
    let back = back_optics(material);
    let mut device = layout::Material {
        absorptivity: material.front.absorptivity as f32,
        emissivity: material.front.emissivity as f32,
        back_absorptivity: back.absorptivity as f32,
        back_emissivity: back.emissivity as f32,
        ..bytemuck::Zeroable::zeroed()
    };
    if let Response::Transition(transition) = &material.response {
        device.set_transition(transition);
    }
    device
}

fn back_optics(material: &Material) -> crate::thermal::material::Optics {
    match material.sides {
        Sides::Outside => material.front,
        Sides::Both { back } => back,
    }
}

impl ReferenceEngine {
    fn new(prepared: &Prepared, camera: Option<&Camera>) -> Self {
        let nodes = &prepared.nodes;
        let node_of_slot: Vec<u32> = (0..nodes.vertex_of_node.len() as u32)
            .filter(|slot| nodes.vertex_of_node[*slot as usize] != PADDING)
            .collect();
        let of_group = |group: &[u32]| (0..nodes.vertex_of_node.len()).map(|slot| group[slot / GROUP]).collect();
        let moves = prepared.joints() > 1;
        let own_joints = |slots: &[u32]| {
            if moves { prepared.joints_of(slots.iter().map(|slot| *slot as usize)) } else { Vec::new() }
        };
        let joints = own_joints(&node_of_slot);
        let position_joints = own_joints(&(0..nodes.vertex_of_node.len() as u32).collect::<Vec<_>>());
        let reference_nodes = node_of_slot
            .iter()
            .map(|slot| ReferenceNode {
                normal: nodes.normals[*slot as usize].as_dvec3(),
                material: nodes.group_material[*slot as usize / GROUP],
            })
            .collect();
        Self {
            reference: Reference::new(reference_nodes, prepared.materials.clone(), incident as IncidentFunction)
                .with_joints(joints),
            shadows: prepared.shadows(node_of_slot.iter().map(|slot| *slot as usize)),
            slots: nodes.vertex_of_node.len(),
            node_of_slot,
            surface: Jointed {
                positions: nodes.positions.iter().map(|position| position.as_dvec3()).collect(),
                triangles: prepared.triangles.clone(),
                joints: position_joints,
            },
            parts: of_group(&nodes.group_part),
            materials: of_group(&nodes.group_material),
            emissivities: prepared
                .materials
                .iter()
                .map(|material| [material.front.emissivity, back_optics(material).emissivity])
                .collect(),
            network: prepared.network.as_ref().map(NetworkRun::reference),
            ticks: 0,
            camera: camera.cloned(),
            table: RadianceTable::new(prepared.scene.band),
            delivered: VecDeque::new(),
            trace: Trace::default(),
        }
    }

    /// Finds the shadows of a load, where the last ones do not hold.
    fn shade(&mut self, load: &TickLoad) {
        shade(&mut self.reference, &mut self.shadows, load);
    }

    /// Heat of the network's nodes [W]; empty where there is no network.
    fn heat(&self, load: &TickLoad) -> Vec<f64> {
        let Some(network) = &self.network else { return Vec::new() };
        let absorbed = self.reference.absorbed(load);
        let mut of_slot = vec![0.0; self.slots];
        for (slot, absorbed) in self.node_of_slot.iter().zip(absorbed) {
            of_slot[*slot as usize] = absorbed;
        }
        network.scene().heat(|slot| of_slot[slot])
    }

    /// Hands the network's temperatures to the nodes.
    fn take_network(&mut self) -> Result<(), GpuError> {
        let Some(network) = &mut self.network else { return Ok(()) };
        let temperatures = network.temperatures()?;
        let mut of_slot = vec![f64::NAN; self.slots];
        network.scene().scatter(&temperatures, |slot, temperature| of_slot[slot] = temperature);
        for (node, slot) in self.node_of_slot.iter().enumerate() {
            if !of_slot[*slot as usize].is_nan() {
                self.reference.set_temperature(node, of_slot[*slot as usize]);
            }
        }
        Ok(())
    }

    fn run(&mut self, tick: Option<Tick<'_>>, order: Order<'_>) -> Result<(), GpuError> {
        if let Some(tick) = tick {
            self.ticks += 1;
            self.shade(tick.load);
            self.reference.step(tick.load, tick.steps);
            if let Some(network) = &mut self.network {
                network.tick_begins();
            }
            let heat = self.heat(tick.load);
            if let Some(network) = &mut self.network {
                network.tick(heat, tick.start, tick.length)?;
            }
            self.take_network()?;
            if let Some(network) = &mut self.network {
                network.tick_ends();
            }
        }
        let mut temperatures = vec![0.0f64; self.slots];
        for (slot, temperature) in self.node_of_slot.iter().zip(self.reference.temperatures()) {
            temperatures[*slot as usize] = *temperature;
        }
        let pixels = order.pose.as_ref().zip(self.camera.as_ref()).map(|(pose, camera)| {
            let placed;
            let positions = if self.surface.joints.is_empty() {
                &self.surface.positions
            } else {
                placed = self.surface.placed(order.joints);
                &placed
            };
            let surface = Surface {
                positions,
                triangles: &self.surface.triangles,
                temperatures: &temperatures,
                vertex_part: &self.parts,
                vertex_material: &self.materials,
                emissivities: &self.emissivities,
            };
            let drawn = rasterise(&surface, &raster_view(camera, pose), |t| band_radiance(&self.table, t));
            let value = |pixel: &raster::Pixel| match pixel.part {
                0 => [0.0; 3],
                _ => [pixel.radiance as f32, pixel.temperature as f32, pixel.depth as f32],
            };
            Pixels {
                radiance_temperature_depth: drawn.iter().map(value).collect(),
                identity: drawn.iter().map(|pixel| [pixel.part, pixel.material]).collect(),
            }
        });
        let temperatures = order.temperatures.then(|| temperatures.iter().map(|t| *t as f32).collect());
        self.delivered.push_back(Delivered { pixels, temperatures });
        Ok(())
    }
}
