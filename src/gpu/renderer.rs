//! A scene on the device: its resources, its frame lists, and two slots that are submitted and collected in turn.

mod culling;
mod forward;
mod shadows;
mod slots;

use std::sync::Arc;

use culling::Culling;
use shadows::Shadows;
use slots::Slots;

use super::bindings::Bindings;
use super::context::Context;
use super::error::GpuError;
use super::frame::{Frame, StepRange, TriangleRun, Wanted};
use super::layout;
use super::load::DeviceLoad;
use super::memory::Buffer;
use super::once::Once;
use super::pass::Said;
use super::record::Recorder;
use super::resource::{Resource, SLOTS};
use super::resources::SceneData;
use super::store::Resources;
use super::timing::{DeviceFrame, PassTimes};
use super::variant::StepKind;
use crate::environment::StepLoad;

/// What a frame is asked to do and to leave.
#[derive(Default, Clone, Copy)]
pub struct Request<'a> {
    /// Steps the nodes under a load for a number of steps.
    pub step: Option<(&'a StepLoad, f64)>,
    /// Draws the nodes afterwards: from a view for the body and one for each joint, as what hangs on it sees the camera. Nothing
    /// is drawn from no views.
    pub views: &'a [layout::View],
    /// Whether the temperatures of all nodes are read.
    pub temperatures: bool,
    /// A list to submit in place of what follows from the above, which is what its passes read: tests leave a barrier out.
    pub list: Option<&'a Frame>,
}

impl<'a> Request<'a> {
    /// Steps the nodes under a load for a number of steps, and leaves nothing.
    pub fn step(load: &'a StepLoad, steps: f64) -> Self {
        Self { step: Some((load, steps)), ..Self::default() }
    }

    /// Reads the temperatures as well.
    pub fn and_temperatures(self) -> Self {
        Self { temperatures: true, ..self }
    }
}

/// What the host reads of a frame.
#[derive(Default)]
pub struct Collected<'a> {
    /// Radiance [W m-2 sr-1], temperature [K], depth [m] and 1 of every pixel; 0 where nothing is.
    pub radiance: Option<&'a [[f32; 4]]>,
    /// Part and material of every pixel, each plus 1; 0 where nothing is.
    pub identity: Option<&'a [[u32; 2]]>,
    /// Temperature of every node [K].
    pub temperatures: Option<&'a [f32]>,
}

/// A frame that was submitted: hand it back to `collect`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use = "what the frame leaves is read by `collect`"]
pub struct Submitted(usize);

/// A scene on the device.
pub struct Renderer {
    ranges: Vec<StepRange>,
    nodes: usize,
    pixels: usize,
    triangles: Vec<TriangleRun>,
    culling: Culling,
    /// The body and its joints.
    joints: u32,
    /// Whether many steps may pass in one dispatch.
    fuses: bool,
    /// Steps that passed so.
    fused_steps: u64,
    shadows: Shadows,
    /// The load that every target is the balance of, where it is known.
    commanded: Option<DeviceLoad>,
    /// Dropped first: it waits for the device.
    slots: Slots,
    bindings: Bindings,
    resources: Resources,
    once: Once,
}

impl Renderer {
    /// Makes everything that the scene needs on the device.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn new(context: &Arc<Context>, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let mut once = Once::new(context)?;
        let resources = Resources::of_scene(context, &mut once, data)?;
        let wanted = Wanted { image: data.image.is_some(), cull: data.triangles.len() as u32, temperatures: true };
        let triangles = data.runs();
        let mut frames = Vec::new();
        for (has_sun, has_albedo) in [(true, true), (true, false), (false, false)] {
            let ranges = ranges_of_step(&data.ranges, has_sun, has_albedo);
            frames.extend([Frame::step_in_runs(&ranges, wanted, &triangles), Frame::settle(&ranges)]);
        }
        frames.push(Frame::step_in_runs(&idle(&data.ranges), wanted, &triangles));
        let shadows = Shadows::new(data);
        let found = shadows.frame(&data.ranges);
        let passes = frames.iter().map(|frame| frame.passes().count()).max().unwrap_or(0) + found.passes().count();
        frames.push(found);
        let joints = data.joints.as_ref().map_or(1, |joints| joints.count);
        let mut bindings = Bindings::new(context, joints, SLOTS);
        bindings.add(&resources, frames.iter().flat_map(Frame::passes))?;
        Ok(Self {
            ranges: data.ranges.clone(),
            nodes: data.normals.len(),
            pixels: data.image.map_or(0, |[width, height]| width as usize * height as usize),
            culling: Culling::new(&triangles, data.triangles, data.positions),
            triangles,
            joints,
            fuses: data.fuses(),
            fused_steps: 0,
            shadows,
            commanded: None,
            slots: Slots::new(context, passes)?,
            bindings,
            resources,
            once,
        })
    }

    /// Settles every node at the balance temperature of a load.
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle(&mut self, load: &StepLoad) -> Result<(), GpuError> {
        let frame = self.shadows(load)?.then(Frame::settle(&ranges_of_load(&self.ranges, load)));
        let submitted = self.send(&frame, Request::step(load, 1.0))?;
        self.commanded = Some(DeviceLoad::new(load, self.joints));
        self.collect(submitted).map(|_| ())
    }

    /// Settles every node at its own temperature [K], one a node.
    ///
    /// # Errors
    /// A call that fails.
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

    /// Submits what a request asks for. At most two frames are in flight; a third waits for the first, whose results are then
    /// gone.
    ///
    /// # Errors
    /// A call that fails.
    pub fn submit(&mut self, request: Request<'_>) -> Result<Submitted, GpuError> {
        if let Some(list) = request.list {
            // What the list commands is its own affair.
            self.commanded = None;
            return self.send(list, request);
        }
        let mut views = request.views.to_vec();
        let culled = self.culling.due(&mut views);
        let cull = culled.iter().map(|run| run.triangles.1 - run.triangles.0).sum();
        let wanted = Wanted { image: !views.is_empty(), cull, temperatures: request.temperatures };
        let mut ranges = request.step.map_or(Vec::new(), |(load, _)| ranges_of_load(&self.ranges, load));
        // What the host steps has its temperatures by now.
        ranges.retain(|range| range.variant.kind != StepKind::Absorb);
        let mut frame = Frame::default();
        if let Some((load, _)) = request.step {
            frame = self.shadows(load)?;
            // Under the load that commanded them last, nodes have nothing to do but to go on.
            let load = Some(DeviceLoad::new(load, self.joints));
            if frame.entries.is_empty() && self.commanded == load {
                ranges = idle(&ranges);
            } else {
                self.commanded = load;
            }
        }
        let frame = frame.then(Frame::step_in_runs(&ranges, wanted, &culled));
        self.send(&frame, Request { views: &views, ..request })
    }

    /// The flux that the nodes of thermal networks absorb under a load [W/m2], with the temperatures [K] of all others,
    /// one a node. The networks' temperatures are gone afterwards: `set_temperatures` brings the new ones. Frames in
    /// flight must be collected before.
    ///
    /// # Errors
    /// A call that fails.
    pub fn absorbed(&mut self, load: &StepLoad) -> Result<Vec<f32>, GpuError> {
        let mut ranges = ranges_of_load(&self.ranges, load);
        ranges.retain(|range| range.variant.kind == StepKind::Absorb);
        let wanted = Wanted { temperatures: true, ..Wanted::default() };
        let frame = self.shadows(load)?.then(Frame::step(&ranges, wanted));
        let submitted = self.send(&frame, Request::step(load, 1.0))?;
        Ok(self.collect(submitted)?.temperatures.unwrap_or_default().to_vec())
    }

    /// Replaces the temperatures of all nodes [K], one a node; the state of transitions stays.
    ///
    /// # Errors
    /// A call that fails.
    pub fn set_temperatures(&mut self, temperatures: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        self.resources.upload(&mut self.once, Resource::Temperature, temperatures)
    }

    /// Bytes of the buffers, as they were allocated, that follow the number of nodes; what only the host reads is not counted.
    pub fn device_bytes(&self) -> u64 {
        self.resources.bytes(|resource| resource.row().grows_with_nodes())
    }

    /// Buffers that the scene has to spare while its network is stepped and no frame is in flight. Where anything was written
    /// to them, say so by `spare_was_used`, and bring the temperatures by `set_temperatures`.
    pub fn spare(&self) -> Vec<Arc<Buffer>> {
        self.resources.spare()
    }

    /// The culled triangles are gone: the next image finds them again.
    pub fn spare_was_used(&mut self) {
        self.culling.forget();
    }

    /// What finds the shadows anew, where a load asks for it; the Sun's view goes to the slot that is submitted next.
    fn shadows(&mut self, load: &StepLoad) -> Result<Frame, GpuError> {
        let Some(view) = self.shadows.due(load) else { return Ok(Frame::default()) };
        if let Some(tree) = self.shadows.moved_tree(load) {
            // Frames in flight may still read the last tree.
            self.slots.wait()?;
            self.resources.upload_tree(&mut self.once, &tree)?;
        }
        self.shadows.turn(&view, load);
        Ok(self.shadows.frame(&self.ranges))
    }

    /// Share of the Sun that each node sees, as last found; empty where the craft does not shadow itself.
    ///
    /// # Errors
    /// A call that fails.
    pub fn visibility(&mut self) -> Result<Vec<f32>, GpuError> {
        self.wait()?;
        if !self.shadows.are_cast() {
            return Ok(Vec::new());
        }
        self.resources.download(&mut self.once, Resource::Visibility, self.nodes)
    }

    /// Writes what the passes of a list read, and submits it.
    fn send(&mut self, list: &Frame, request: Request<'_>) -> Result<Submitted, GpuError> {
        let slot = self.slots.free()?;
        if let Some((load, steps)) = request.step {
            DeviceLoad::new(load, self.joints).write(&mut self.resources, slot, steps)?;
        }
        self.resources.write_slices(Resource::View, slot, request.views)?;
        self.resources.write_slices(Resource::SunView, slot, &std::mem::take(&mut self.shadows.views))?;
        let told = |said: Said| match said {
            Said::Triangle(first) => first.to_le_bytes().to_vec(),
            Said::Ray(ray, joint) => self.shadows.ray(ray, joint),
            Said::Nothing | Said::Network(_) => Vec::new(),
        };
        let (context, bindings) = (self.resources.context.as_ref(), Some(&self.bindings));
        let recorder = |commands| {
            let recorder = Recorder::new(context, commands, &self.resources, bindings, &told);
            recorder.drawing(slot, &self.triangles, &self.shadows.occluders)
        };
        self.slots.submit(list, recorder).map(Submitted)
    }

    /// Waits for a frame and gives what it leaves, until its slot is submitted again.
    ///
    /// # Errors
    /// A lost device.
    pub fn collect(&mut self, submitted: Submitted) -> Result<Collected<'_>, GpuError> {
        let number = submitted.0;
        self.slots.finish(number)?;
        let left = |resource| self.slots.left(number, resource);
        let (resources, readback) = (&self.resources, Resource::RadianceReadback);
        Ok(Collected {
            radiance: left(readback).then(|| resources.read(readback, number, self.pixels)),
            identity: left(Resource::IdentityReadback)
                .then(|| resources.read(Resource::IdentityReadback, number, self.pixels)),
            temperatures: left(Resource::TemperatureReadback)
                .then(|| resources.read(Resource::TemperatureReadback, number, self.nodes)),
        })
    }

    /// Waits for all frames in flight.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait(&mut self) -> Result<(), GpuError> {
        self.slots.wait()
    }

    /// Device milliseconds of every pass so far, by name.
    pub fn pass_times(&self) -> &PassTimes {
        &self.slots.times
    }

    /// Keeps from now on when each pass of each frame began and ended.
    pub fn keep_frames(&mut self) {
        self.slots.frames.get_or_insert_default();
    }

    /// The frames that were kept since the last call.
    pub fn take_frames(&mut self) -> Vec<DeviceFrame> {
        self.slots.frames.as_mut().map(std::mem::take).unwrap_or_default()
    }
}

/// The ranges with the least variants that compute a step under a load.
fn ranges_of_load(ranges: &[StepRange], load: &StepLoad) -> Vec<StepRange> {
    ranges_of_step(ranges, !load.sun.is_empty(), load.albedo.is_some())
}

/// The ranges under a load that has not changed: balances stand, transitions go on.
fn idle(ranges: &[StepRange]) -> Vec<StepRange> {
    let moving = ranges.iter().filter(|range| range.variant.kind.has_state());
    moving.map(|range| StepRange { variant: range.variant.idle(), ..*range }).collect()
}

fn ranges_of_step(ranges: &[StepRange], has_sun: bool, has_albedo: bool) -> Vec<StepRange> {
    ranges.iter().map(|range| StepRange { variant: range.variant.for_step(has_sun, has_albedo), ..*range }).collect()
}
