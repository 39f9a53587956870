//! A scene on the device: its resources, frame lists, and two frames in flight.

mod culling;
mod exchange;
mod exchanging;
mod forward;
mod network;
mod one_pass;
mod ranges;
mod request;
mod saved;
mod send;
mod sensor;
mod shadows;
mod slots;
mod structures;

use std::sync::Arc;

use culling::Culling;
use exchanging::Exchanging;
use one_pass::{OnePass, is_of_network};
use ranges::{idle, ranges_of_load, ranges_of_step, without_exchange};
pub use request::{Collected, Heating, Request, Submitted, Traced};
use sensor::ImageSensor;
use shadows::Shadows;
use slots::Slots;

use super::bindings::Bindings;
use super::context::Context;
use super::error::GpuError;
use super::frame::{Frame, StepRange, TriangleRun, Wanted};
use super::heat::{HeatOf, HeatTables, absorbed_heat};
use super::load::DeviceLoad;
use super::once::Once;
use super::radiance_variant::RadianceVariant;
use super::resource::Resource;
use super::resource_row::SLOTS;
use super::resources::SceneData;
use super::sampling::{Distance, Sampled};
use super::sensor::SensorTables;
use super::store::Resources;
use super::timing::{DeviceFrame, PassTimes};
use crate::environment::StepLoad;

/// A scene on the device.
pub struct Renderer {
    ranges: Vec<StepRange>,
    nodes: usize,
    /// Runs of nodes whose absorbed heat is summed.
    runs: usize,
    pixels: usize,
    /// How images are made from finer ones, if they are.
    sampled: Option<Sampled>,
    triangles: Vec<TriangleRun>,
    culling: Culling,
    /// Whether images lie between steps.
    between: bool,
    /// Number of joints, counting the body.
    joints: u32,
    /// Whether one dispatch may take many steps.
    fuses: bool,
    /// Number of steps in such dispatches so far.
    fused_steps: u64,
    shadows: Shadows,
    /// Radiation between surfaces, if the scene has it.
    exchange: Option<Exchanging>,
    /// Whether what nodes receive in the next step was found already.
    exchanged: bool,
    /// The network, if the frames step it.
    one_pass: Option<OnePass>,
    /// Runs of nodes whose absorbed heat is summed, by the place where it is found.
    heat: Vec<(HeatOf, (u32, u32))>,
    /// The sensor, if the image has one.
    sensor: Option<ImageSensor>,
    /// Width and height of the largest image that is drawn, and of the one with one sample of a texel, from which the image of a distant craft is made
    /// [texels].
    drawn: [[u32; 2]; 2],
    /// Versions of the trees for reflections of the craft in the slots.
    trees: [Option<u64>; SLOTS],
    /// What the pixels of an image show.
    shows: RadianceVariant,
    /// The load whose balance is the target of every node, if known.
    commanded: Option<DeviceLoad>,
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
        let (sampled, shows) = (data.sampled(), data.shown.variant);
        let cull = data.triangles.len() as u32;
        let wanted = Wanted {
            image: data.image.is_some(),
            sampled,
            cull,
            temperatures: true,
            shows,
            texels: data.texels() as u32,
        };
        let triangles = data.runs();
        let mut frames = Vec::new();
        for (has_sun, has_albedo) in [(true, true), (true, false), (false, false)] {
            let ranges = ranges_of_step(&data.ranges, has_sun, has_albedo);
            let wanted = Wanted { image: wanted.image && !data.between, ..wanted };
            frames.extend([Frame::step_in_runs(&ranges, wanted, &triangles), Frame::settle(&ranges)]);
            if data.exchange.is_some() {
                frames.push(Frame::step(&without_exchange(ranges), Wanted::default()));
            }
        }
        let drawn = if data.between { Wanted { image: false, ..wanted } } else { wanted };
        frames.push(Frame::step_in_runs(&idle(&data.ranges), drawn, &triangles));
        if data.between {
            frames.push(Frame::keep().then(Frame::between(&data.ranges, wanted, &triangles)));
        }
        if let Some(sampled) = sampled.filter(|sampled| sampled.distance == Distance::MayBeFar) {
            let texels = data.drawn_singly().map_or(0, |[width, height]| width * height);
            let far = Wanted { sampled: Some(sampled.far()), texels, ..wanted };
            frames.push(match data.between {
                true => Frame::keep().then(Frame::between(&data.ranges, far, &triangles)),
                false => Frame::step_in_runs(&idle(&data.ranges), far, &triangles),
            });
        }
        let shadows = Shadows::new(data);
        let found = shadows.frame(&data.ranges);
        let exchange = data.exchange.as_ref().map(|data| Exchanging::new(data));
        let lights = [(true, true), (true, false), (false, false)];
        let of_ranges = |(sun, albedo)| data.ranges.first().map(|range| range.variant.for_step(sun, albedo));
        let exchanged = exchange.as_ref().map(|own| own.frames(lights.into_iter().filter_map(of_ranges)));
        let exchanged = exchanged.unwrap_or_default();
        let one_pass = data.network.map(OnePass::new);
        let stepped = one_pass.as_ref().map(OnePass::frames).unwrap_or_default();
        let heat = data.heat.map(HeatTables::sections).unwrap_or_default();
        let most = |frames: &[Frame]| frames.iter().map(|frame| frame.passes().count()).max().unwrap_or(0);
        let passes = most(&frames) + most(&stepped) + most(&exchanged) + found.passes().count();
        let summed = absorbed_heat(&heat);
        let passes = passes + summed.passes().count();
        frames.extend([found, summed]);
        frames.extend(stepped);
        frames.extend(exchanged);
        let sensor =
            data.sensor.filter(|_| data.image.is_some()).map(|sensor| ImageSensor::new(sensor, data.shown_in()));
        let passes = passes + sensor.as_ref().map_or(0, |sensor| sensor.frame.passes().count());
        frames.extend(sensor.iter().map(|sensor| sensor.frame.clone()));
        let joints = data.joints.as_ref().map_or(1, |joints| joints.count);
        let mut bindings = Bindings::new(context, joints, SLOTS);
        bindings.add(&resources, frames.iter().flat_map(Frame::passes))?;
        Ok(Self {
            ranges: data.ranges.clone(),
            nodes: data.normals.len(),
            runs: data.heat.map_or(0, |heat| heat.runs.len()),
            pixels: data.image.map_or(0, |[width, height]| width as usize * height as usize),
            sampled,
            culling: Culling::new(&triangles, data.triangles, data.positions),
            triangles,
            between: data.between,
            joints,
            fuses: data.fuses(),
            fused_steps: 0,
            shadows,
            exchange,
            exchanged: false,
            one_pass,
            heat,
            sensor,
            drawn: [data.drawn(), data.drawn_singly()].map(Option::unwrap_or_default),
            trees: [None; SLOTS],
            shows,
            commanded: None,
            slots: Slots::new(context, passes)?,
            bindings,
            resources,
            once,
        })
    }

    /// Sets every node to the balance temperature of a load.
    pub fn settle(&mut self, load: &StepLoad) -> Result<(), GpuError> {
        self.exchange.iter_mut().for_each(|own| own.fresh = true);
        let frame = self.shadows(load)?.then(Frame::settle(&ranges_of_load(&self.ranges, load)));
        let submitted = self.send(&frame, Request::step(load, 1.0))?;
        self.commanded = Some(DeviceLoad::new(load, self.joints));
        self.collect(submitted).map(|_| ())
    }

    /// Sets every node to its own temperature [K], with one value for each node.
    pub fn settle_at(&mut self, temperatures: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        self.commanded = None;
        let zeros = vec![0.0f32; self.nodes];
        for (resource, values) in [
            (Resource::Temperature, temperatures),
            (Resource::Target, temperatures),
            (Resource::Span, &zeros),
            (Resource::Elapsed, &zeros),
        ] {
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
            self.commanded = None;
            return self.send(list, request);
        }
        let mut views = request.views.to_vec();
        if self.sampled.is_some_and(|sampled| sampled.shutter.is_some()) {
            // The view of the first row does not tell how the others moved.
            self.culling.forget();
        }
        let culled = self.culling.due(&mut views);
        let cull = culled.iter().map(|run| run.triangles.1 - run.triangles.0).sum();
        let (image, temperatures) = (!views.is_empty(), request.temperatures);
        let sampled = self.sampled.map(|sampled| if request.distant.is_some() { sampled.far() } else { sampled });
        let texels = self.texels(request.distant.is_some());
        let wanted = Wanted { image, sampled, cull, temperatures, shows: self.shows, texels };
        let mut ranges = request.step.map_or(Vec::new(), |(load, _)| ranges_of_load(&self.ranges, load));
        let mut loaded = Vec::new();
        if self.steps_network() {
            loaded.extend(ranges.iter().copied().filter(|range| is_of_network(range.variant.kind)));
        }
        // The other ranges of a network have temperatures that the host has already written.
        ranges.retain(|range| !is_of_network(range.variant.kind));
        let mut frame = if request.keep { Frame::keep() } else { Frame::default() };
        let mut network = Frame::default();
        let mut summed = Frame::default();
        if let Some((load, steps)) = request.step {
            let shadows = self.shadows(load)?;
            let still_shaded = shadows.entries.is_empty();
            frame = frame.then(shadows);
            if !std::mem::take(&mut self.exchanged) {
                frame = frame.then(self.exchange_frame(load, steps));
            }
            network = self.network_frame(steps, request.heating)?;
            if request.absorbed {
                summed = self.summed();
            }
            // If the load is unchanged, a cheaper variant continues the transitions.
            let load = Some(DeviceLoad::new(load, self.joints));
            if still_shaded && self.commanded == load && self.exchange.is_none() {
                ranges = idle(&ranges);
            } else {
                self.commanded = load;
            }
        }
        ranges.extend(loaded);
        let shown = self.image(wanted, &culled, request.between);
        let frame = frame.then(Frame::step(&ranges, Wanted::default())).then(summed).then(network).then(shown);
        let exposed = self.sensor.as_mut().zip(request.time.filter(|_| wanted.image));
        let frame = exposed.map(|(sensor, time)| sensor.expose(time)).into_iter().fold(frame, Frame::then);
        self.send(&frame, Request { views: &views, ..request })
    }

    /// The passes that sum absorbed heat. Where the host steps the network, temperatures stand in the place of its flux.
    fn summed(&self) -> Frame {
        let of_frame = |(of, _): &&(HeatOf, (u32, u32))| *of != HeatOf::Flux || self.steps_network();
        absorbed_heat(&self.heat.iter().filter(of_frame).copied().collect::<Vec<_>>())
    }

    /// The list of an image and of the readback. The image lies `between` two steps, or shows the present temperatures.
    fn image(&self, wanted: Wanted, culled: &[TriangleRun], between: Option<f32>) -> Frame {
        if !self.between || !wanted.image {
            return Frame::step_in_runs(&[], wanted, culled);
        }
        // The present temperatures lie between themselves.
        let kept = if between.is_none() { Frame::keep() } else { Frame::default() };
        kept.then(Frame::between(&self.ranges, wanted, culled))
    }

    /// Texels whose reflections of the craft itself are traced, if any are.
    fn texels(&self, is_distant: bool) -> u32 {
        let [width, height] = self.drawn[usize::from(is_distant)];
        width * height
    }

    /// Keeps the temperatures before a step that the host takes for its network. Collect the frames in flight before.
    pub fn keep_temperatures(&mut self) -> Result<(), GpuError> {
        let submitted = self.send(&Frame::keep(), Request::default())?;
        self.collect(submitted).map(|_| ())
    }

    /// Flux absorbed by the nodes of thermal networks [W/m2], and temperature of all other nodes [K], one value for
    /// each node. It overwrites the networks' temperatures, so call `set_temperatures` afterwards. Collect the frames
    /// in flight before. A load that lasts some steps exchanges radiation between surfaces, and the start of a run does not.
    pub fn absorbed(&mut self, load: &StepLoad, steps: Option<f64>) -> Result<Vec<f32>, GpuError> {
        let mut ranges = ranges_of_load(&self.ranges, load);
        ranges.retain(|range| is_of_network(range.variant.kind));
        let wanted = Wanted { temperatures: true, ..Wanted::default() };
        let mut frame = self.shadows(load)?;
        if let Some(steps) = steps {
            frame = frame.then(self.exchange_frame(load, steps));
            self.exchanged = true;
        } else {
            ranges = without_exchange(ranges);
        }
        let frame = frame.then(Frame::step(&ranges, wanted));
        let submitted = self.send(&frame, Request::step(load, 1.0))?;
        Ok(self.collect(submitted)?.temperatures.unwrap_or_default().to_vec())
    }

    /// Replaces the temperatures of all nodes [K], one for each node. The state of transitions stays.
    pub fn set_temperatures(&mut self, temperatures: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        self.resources.upload(&mut self.once, Resource::Temperature, temperatures)
    }

    /// Takes another sensor for the images from here on. Returns whether it needs no other resources; otherwise nothing changes.
    pub fn take_sensor(&mut self, tables: SensorTables) -> Result<bool, GpuError> {
        let Some(sensor) = self.sensor.as_mut().filter(|sensor| sensor.takes(&tables)) else { return Ok(false) };
        let kernel = tables.kernel.clone();
        sensor.take(tables);
        // The image before may still read the weights.
        self.wait()?;
        self.resources.write(Resource::SensorKernel, 0, &kernel)?;
        Ok(true)
    }

    /// Allocated memory that grows with the number of nodes [bytes], without buffers that only the host reads.
    pub fn device_bytes(&self) -> u64 {
        self.resources.bytes(|resource| resource.row().grows_with_nodes())
    }

    /// The passes that update the shadows, empty if the load does not need them. Also writes the shadow map's
    /// transform.
    fn shadows(&mut self, load: &StepLoad) -> Result<Frame, GpuError> {
        let Some(view) = self.shadows.due(load) else { return Ok(Frame::default()) };
        if let Some(tree) = self.shadows.moved_tree(load) {
            // Frames in flight may still read the old tree.
            self.slots.wait()?;
            self.resources.upload_tree(&mut self.once, &tree)?;
        }
        self.shadows.turn(&view, load);
        Ok(self.shadows.frame(&self.ranges))
    }

    /// Share of the Sun that each node sees, from the last update. It is empty if the craft does not shadow itself.
    pub fn visibility(&mut self) -> Result<Vec<f32>, GpuError> {
        self.wait()?;
        if !self.shadows.are_cast() {
            return Ok(Vec::new());
        }
        self.resources.download(&mut self.once, Resource::Visibility, self.nodes)
    }

    /// Waits for a frame and returns its outputs. They are valid until its slot is submitted again.
    pub fn collect(&mut self, submitted: Submitted) -> Result<Collected<'_>, GpuError> {
        let number = submitted.0;
        self.slots.finish(number)?;
        self.read_log(number);
        let left = |resource| self.slots.left(number, resource);
        let (resources, readback) = (&self.resources, Resource::RadianceReadback);
        Ok(Collected {
            radiance: left(readback).then(|| resources.read(readback, number, self.pixels)),
            identity: left(Resource::IdentityReadback)
                .then(|| resources.read(Resource::IdentityReadback, number, self.pixels)),
            absorbed: left(Resource::AbsorbedHeat).then(|| resources.read(Resource::AbsorbedHeat, number, self.runs)),
            readings: self.sensor.as_ref().filter(|_| left(Resource::SensorReadback)).map(|sensor| {
                sensor.unpadded(resources.read(Resource::SensorReadback, number, sensor.padded_pixels()))
            }),
            temperatures: left(Resource::TemperatureReadback)
                .then(|| resources.read(Resource::TemperatureReadback, number, self.nodes)),
        })
    }

    /// Waits for all frames in flight.
    pub fn wait(&mut self) -> Result<(), GpuError> {
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

    /// Starts to keep the measured times of each frame.
    pub fn keep_frames(&mut self) {
        self.slots.frames.get_or_insert_default();
    }

    /// Takes the times that were kept since the last call.
    pub fn take_frames(&mut self) -> Vec<DeviceFrame> {
        self.slots.frames.as_mut().map(std::mem::take).unwrap_or_default()
    }
}
