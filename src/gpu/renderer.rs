//! A scene on the device: its resources, and two frames in flight.

mod exchange;
mod forward;
mod light;
mod network;
mod saved;
mod send;
mod slots;
mod structures;

use std::sync::Arc;

use slots::Slots;

pub use self::saved::RendererState;
use super::bindings::Bindings;
use super::context::Context;
use super::effects::heat::ABSORBED_HEAT;
use super::effects::image::resources::PLANET_MAP;
use super::effects::image::resources::{IDENTITY_READBACK, RADIANCE_READBACK};
use super::effects::network::state::OnePass;
use super::effects::sensor;
use super::effects::sensor::tables::SensorTables;
use super::effects::thermal::load::DeviceLoad;
use super::effects::thermal::ranges::ranges_of_load;
use super::effects::thermal::{ELAPSED, SPAN, TARGET, TEMPERATURE, TEMPERATURE_READBACK};
use super::error::GpuError;
use super::frame::{Frame, compose};
use super::once::Once;
pub use super::request::Collected;
pub use super::request::Request;
pub(crate) use super::request::{Heating, Submitted, TracedTree};
use super::resource::SLOTS;
use super::scene_data::SceneData;
use super::scene_frames::SceneFrames;
use super::store::Resources;
use super::timing::PassTimes;
use crate::environment::StepLoad;
use crate::trace::timed;

/// A scene on the device.
pub struct Renderer {
    /// What its frames do.
    scene: SceneFrames,
    nodes: usize,
    /// Runs of nodes whose absorbed heat is summed.
    runs: usize,
    pixels: usize,
    /// Whether one dispatch may take many steps.
    fuses: bool,
    /// Number of steps in such dispatches so far.
    fused_steps: u64,
    /// Versions of the trees for reflections of the craft in the slots.
    trees: [Option<u64>; SLOTS],
    /// The frames in flight. The field is dropped first, because its destructor waits for the device.
    slots: Slots,
    bindings: Bindings,
    resources: Resources,
    once: Once,
}

impl Renderer {
    /// Makes and fills everything that the scene needs on the device.
    pub fn new(context: &Arc<Context>, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let mut once = Once::new(context)?;
        let resources = Resources::of_scene(context, &mut once, data)?;
        let scene = SceneFrames::new(data);
        let (frames, steps) = (scene.every(), scene.network.as_ref().map(OnePass::frames).unwrap_or_default());
        let most = |frames: &[Frame]| frames.iter().map(|frame| frame.passes().count()).max().unwrap_or(0);
        let passes = most(&frames) + most(&steps);
        let mut bindings = Bindings::new(context, scene.joints, SLOTS);
        bindings.add(&resources, frames.iter().chain(&steps).flat_map(Frame::passes))?;
        Ok(Self {
            scene,
            nodes: data.normals.len(),
            runs: data.heat.map_or(0, |heat| heat.runs.len()),
            pixels: data.image.map_or(0, |[width, height]| width as usize * height as usize),
            fuses: data.fuses(),
            fused_steps: 0,
            trees: [None; SLOTS],
            slots: Slots::new(context, passes)?,
            bindings,
            resources,
            once,
        })
    }

    /// Sets every node to the balance temperature of a load.
    pub fn settle(&mut self, load: &StepLoad) -> Result<(), GpuError> {
        self.scene.exchange.iter_mut().for_each(|own| own.fresh = true);
        self.renew_light(load)?;
        let frame = Frame::settle(&ranges_of_load(&self.scene.ranges, load));
        let submitted = self.send(&frame, Request::step(load, 1.0))?;
        self.scene.commanded = Some(DeviceLoad::new(load, self.scene.joints));
        self.collect(submitted).map(|_| ())
    }

    /// Sets every node to its own temperature [K], with one value for each node.
    pub fn settle_at(&mut self, temperatures: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        self.scene.commanded = None;
        let zeros = vec![0.0f32; self.nodes];
        for (resource, values) in
            [(&TEMPERATURE, temperatures), (&TARGET, temperatures), (&SPAN, &zeros), (&ELAPSED, &zeros)]
        {
            self.resources.upload(&mut self.once, resource, values)?;
        }
        self.resources.free_staging();
        Ok(())
    }

    /// Submits a request. At most two frames are in flight. A third submission waits for the first frame and discards
    /// its outputs.
    pub fn submit(&mut self, request: Request<'_>) -> Result<Submitted, GpuError> {
        if let Some(list) = request.list {
            // The load of a given list is unknown.
            self.scene.commanded = None;
            return self.send(list, request);
        }
        let mut lit = false;
        if let Some((load, steps)) = request.step {
            lit = self.renew_light(load)?;
            self.renew_network(steps, request.heating)?;
        }
        let mut views = request.views.to_vec();
        let list = timed("composing a frame", || compose(&self.scene.recipe(&request, &mut views, lit)));
        self.send(&list, Request { views: &views, ..request })
    }

    /// Keeps the temperatures before a step that the host takes for its network. Collect the frames in flight before.
    pub(crate) fn keep_temperatures(&mut self) -> Result<(), GpuError> {
        let submitted = self.send(&Frame::keep(), Request::default())?;
        self.collect(submitted).map(|_| ())
    }

    /// Flux absorbed by the nodes of thermal networks [W/m2], and temperature of all other nodes [K], one value for
    /// each node. It overwrites the networks' temperatures, so call `set_temperatures` afterwards. Collect the frames
    /// in flight before. A load that lasts some steps exchanges radiation between surfaces, and the start of a run does not.
    pub(crate) fn absorbed(&mut self, load: &StepLoad, steps: Option<f64>) -> Result<Vec<f32>, GpuError> {
        self.renew_light(load)?;
        let frame = compose(&self.scene.flux(load, steps));
        let submitted = self.send(&frame, Request::step(load, 1.0))?;
        Ok(self.collect(submitted)?.temperatures.unwrap_or_default().to_vec())
    }

    /// Replaces the temperatures of all nodes [K], one for each node. The state of transitions stays.
    pub(crate) fn set_temperatures(&mut self, temperatures: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        self.resources.upload(&mut self.once, &TEMPERATURE, temperatures)
    }

    /// Replaces the map of the planet by one of the same size. No image is under way.
    pub(crate) fn set_planet_map(&mut self, values: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        self.resources.upload(&mut self.once, &PLANET_MAP, values)
    }

    /// Takes another sensor for the images from here on. Returns whether it needs no other resources; otherwise nothing changes.
    pub(crate) fn take_sensor(&mut self, tables: SensorTables) -> Result<bool, GpuError> {
        let Some(sensor) = self.scene.sensor.as_mut().filter(|sensor| sensor.takes(&tables)) else {
            return Ok(false);
        };
        let kernels = [(&sensor::ROW_KERNEL, tables.row_kernel.clone()), (&sensor::KERNEL, tables.kernel.clone())];
        sensor.take(tables);
        // The image before may still read the weights.
        self.wait()?;
        for (resource, weights) in kernels {
            self.resources.write(resource, 0, &weights)?;
        }
        Ok(true)
    }

    /// Allocated memory that grows with the number of nodes [bytes], without buffers that only the host reads.
    pub(crate) fn device_bytes(&self) -> u64 {
        self.resources.bytes(super::resource::Resource::grows_with_nodes)
    }

    /// Waits for a frame and returns its outputs. They are valid until its slot is submitted again.
    pub fn collect(&mut self, submitted: Submitted) -> Result<Collected<'_>, GpuError> {
        let number = submitted.0;
        self.slots.finish(number)?;
        self.read_log(number);
        let left = |resource| self.slots.left(number, resource);
        let resources = &self.resources;
        let sensor = self.scene.sensor.as_ref().filter(|_| left(&sensor::READBACK));
        Ok(Collected {
            radiance: left(&RADIANCE_READBACK).then(|| resources.read(&RADIANCE_READBACK, number, self.pixels)),
            identity: left(&IDENTITY_READBACK).then(|| resources.read(&IDENTITY_READBACK, number, self.pixels)),
            absorbed: left(&ABSORBED_HEAT).then(|| resources.read(&ABSORBED_HEAT, number, self.runs)),
            readings: sensor.map(|one| one.unpadded(resources.read(&sensor::READBACK, number, one.padded_pixels()))),
            temperatures: left(&TEMPERATURE_READBACK)
                .then(|| resources.read(&TEMPERATURE_READBACK, number, self.nodes)),
        })
    }

    /// Waits for all frames in flight.
    pub(crate) fn wait(&mut self) -> Result<(), GpuError> {
        self.slots.wait()?;
        // The frame of the next slot is the older one.
        let older = self.slots.free()?;
        (0..SLOTS).for_each(|later| self.read_log((older + later) % SLOTS));
        Ok(())
    }

    /// Device time of every pass so far [ms], by name.
    pub fn pass_times(&self) -> &PassTimes {
        &self.slots.times
    }

    /// The names of the passes that each frame recorded since the last call. The first call begins to keep them.
    pub fn take_pass_names(&mut self) -> Vec<Vec<String>> {
        self.slots.names.replace(Vec::new()).unwrap_or_default()
    }
}
