//! A scene on the device: its resources, its frame lists, and two slots that are submitted and collected in turn.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::bindings::Bindings;
use super::context::Context;
use super::error::{Context as _, GpuError};
use super::frame::{Frame, StepRange, Wanted};
use super::layout;
use super::once::{Once, command_buffers};
use super::pass::Resource;
use super::record::{Recorder, tick_of};
use super::resources::{Resources, SLOTS, SceneData};
use super::timing::{DeviceFrame, PassTimes, Timing};
use super::variant::StepKind;
use crate::environment::shadow::{Method, Redraw, SUN_RAYS, disc_directions};
use crate::environment::{MAX_SUN_SAMPLES, TickLoad};

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

struct Slot {
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    timing: Timing,
    pending: bool,
    submitted: Instant,
    wanted: Wanted,
}

/// A scene on the device.
pub struct Renderer {
    ranges: Vec<StepRange>,
    nodes: usize,
    triangles: u32,
    size: [u32; 2],
    /// The view that the visible triangles are those of.
    culled_for: Option<layout::View>,
    occluders: u32,
    redraw: Option<Redraw>,
    /// Boxes of the tree and where its rays start [m], where rays find the shadows.
    tree: Option<(u32, f64)>,
    sun_rays: Vec<layout::SunRay>,
    /// The Sun's view of the frame that is submitted next, where it draws it.
    sun_view: Option<layout::SunView>,
    times: PassTimes,
    /// Frames since they were last taken, where they are kept.
    frames: Option<Vec<DeviceFrame>>,
    next: usize,
    slots: Vec<Slot>,
    command_pool: vk::CommandPool,
    bindings: Bindings,
    resources: Resources,
    once: Once,
    context: Arc<Context>,
}

impl Renderer {
    /// Makes everything that the scene needs on the device.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn new(context: &Arc<Context>, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let mut once = Once::new(context)?;
        let resources = Resources::new(context, &mut once, data)?;
        once.free_staging();
        let wanted = Wanted { image: data.image.is_some(), cull: data.triangles.len() as u32, temperatures: true };
        let mut frames = Vec::new();
        for (has_sun, has_albedo) in [(true, true), (true, false), (false, false)] {
            let ranges = ranges_of_tick(&data.ranges, has_sun, has_albedo);
            frames.extend([Frame::step(&ranges, wanted), Frame::settle(&ranges)]);
        }
        let tree = data.shadows.as_ref().and_then(|shadows| shadows.tree);
        let method = if tree.is_some() { Method::Exact } else { Method::Depth };
        let shadows = Frame::shadows(&data.ranges, method);
        let passes = frames.iter().map(|frame| frame.passes().count()).max().unwrap_or(0) + shadows.passes().count();
        frames.push(shadows);
        let bindings = Bindings::new(context, &resources, &frames.iter().collect::<Vec<_>>(), data.shapes)?;
        let (command_pool, commands) = command_buffers(context, SLOTS as u32)?;
        let mut renderer = Self {
            ranges: data.ranges.clone(),
            nodes: data.normals.len(),
            triangles: data.triangles.len() as u32,
            size: data.image.unwrap_or_default(),
            culled_for: None,
            occluders: data.shadows.as_ref().map_or(0, |shadows| shadows.occluders.len() as u32),
            redraw: data.shadows.as_ref().map(|shadows| shadows.redraw.clone()),
            tree: tree.map(|tree| (tree.tree.nodes.len() as u32, tree.start)),
            sun_rays: Vec::new(),
            sun_view: None,
            times: PassTimes::new(),
            frames: None,
            next: 0,
            slots: Vec::new(),
            command_pool,
            bindings,
            resources,
            once,
            context: Arc::clone(context),
        };
        for commands in commands {
            let create = vk::FenceCreateInfo::default();
            let timing = Timing::new(context, passes)?;
            // SAFETY: the device is alive.
            let fence = unsafe { context.device.create_fence(&create, None) }.during("creating a fence")?;
            renderer.slots.push(Slot {
                commands,
                fence,
                timing,
                pending: false,
                submitted: Instant::now(),
                wanted: Wanted::default(),
            });
        }
        Ok(renderer)
    }

    /// Settles every node at the balance temperature of a load.
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle(&mut self, load: &TickLoad) -> Result<(), GpuError> {
        let frame = self.shadows(load).then(Frame::settle(&ranges_of_load(&self.ranges, load)));
        let submitted = self.submit_frame(&frame, Some((load, 1.0)), None, Wanted::default())?;
        self.collect(submitted).map(|_| ())
    }

    /// Settles every node at its own temperature [K], one a node.
    ///
    /// # Errors
    /// A call that fails.
    pub fn settle_at(&mut self, temperatures: &[f32]) -> Result<(), GpuError> {
        self.wait()?;
        let zeros = vec![0.0f32; self.nodes];
        for (resource, values) in [
            (Resource::Temperature, temperatures),
            (Resource::Target, temperatures),
            (Resource::Span, &zeros),
            (Resource::Elapsed, &zeros),
        ] {
            self.resources.upload(&mut self.once, resource, values)?;
        }
        self.once.free_staging();
        Ok(())
    }

    /// Submits one tick: `tick` steps the nodes under a load for a number of steps, `view` draws them afterwards.
    /// At most two frames are in flight; a third waits for the first, whose results are then gone.
    ///
    /// # Errors
    /// A call that fails.
    pub fn submit(
        &mut self,
        tick: Option<(&TickLoad, f64)>,
        view: Option<&layout::View>,
        temperatures: bool,
    ) -> Result<Submitted, GpuError> {
        let cull = if view == self.culled_for.as_ref() { 0 } else { self.triangles };
        let wanted = Wanted { image: view.is_some(), cull, temperatures };
        let mut ranges = tick.map_or(Vec::new(), |(load, _)| ranges_of_load(&self.ranges, load));
        // What the host steps has its temperatures by now.
        ranges.retain(|range| range.variant.kind != StepKind::Absorb);
        let shadows = tick.map_or(Frame { steps: Vec::new() }, |(load, _)| self.shadows(load));
        let frame = shadows.then(Frame::step(&ranges, wanted));
        let submitted = self.submit_frame(&frame, tick, view, wanted)?;
        if let Some(view) = view {
            self.culled_for = Some(*view);
        }
        Ok(submitted)
    }

    /// The flux that the nodes of thermal networks absorb under a load [W/m2], with the temperatures [K] of all others,
    /// one a node. The networks' temperatures are gone afterwards: `set_temperatures` brings the new ones. Frames in
    /// flight must be collected before.
    ///
    /// # Errors
    /// A call that fails.
    pub fn absorbed(&mut self, load: &TickLoad) -> Result<Vec<f32>, GpuError> {
        let mut ranges = ranges_of_load(&self.ranges, load);
        ranges.retain(|range| range.variant.kind == StepKind::Absorb);
        let wanted = Wanted { temperatures: true, ..Wanted::default() };
        let frame = self.shadows(load).then(Frame::step(&ranges, wanted));
        let submitted = self.submit_frame(&frame, Some((load, 1.0)), None, wanted)?;
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

    /// What finds the shadows anew, where a load asks for it; the Sun's view goes to the slot that is submitted next.
    fn shadows(&mut self, load: &TickLoad) -> Frame {
        let Some(view) = self.redraw.as_mut().and_then(|redraw| redraw.view(load)) else {
            return Frame { steps: Vec::new() };
        };
        let Some((boxes, start)) = self.tree else {
            self.sun_view = Some(layout::SunView::new(&view));
            return Frame::shadows(&self.ranges, Method::Depth);
        };
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let ray = |direction| layout::SunRay {
            sun: with(view.sun, start),
            direction: with(direction, 1.0 / SUN_RAYS as f64),
            boxes,
            unused: [0; 3],
        };
        self.sun_rays = disc_directions(view.sun).map(ray).to_vec();
        Frame::shadows(&self.ranges, Method::Exact)
    }

    /// Share of the Sun that each node sees, as last found; empty where the craft does not shadow itself.
    ///
    /// # Errors
    /// A call that fails.
    pub fn visibility(&mut self) -> Result<Vec<f32>, GpuError> {
        self.wait()?;
        if self.redraw.is_none() {
            return Ok(Vec::new());
        }
        self.once.download(self.resources.buffer(Resource::Visibility, 0), self.nodes)
    }

    /// Submits a given list; tests pass one without a barrier.
    ///
    /// # Errors
    /// A call that fails.
    pub fn submit_frame(
        &mut self,
        frame: &Frame,
        tick: Option<(&TickLoad, f64)>,
        view: Option<&layout::View>,
        wanted: Wanted,
    ) -> Result<Submitted, GpuError> {
        let number = self.next;
        self.next = (self.next + 1) % SLOTS;
        self.finish(number)?;
        if let Some((load, step)) = tick {
            self.write_tick(load, step, number);
        }
        if let Some(view) = view {
            self.resources.write(Resource::View, number, &[*view]);
        }
        if let Some(view) = self.sun_view.take() {
            self.resources.write(Resource::SunView, number, &[view]);
        }

        let slot = &mut self.slots[number];
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last frame is complete, so its command buffer may be recorded anew.
        unsafe { self.context.device.begin_command_buffer(slot.commands, &begin) }.during("recording")?;
        let recorder = Recorder {
            context: &self.context,
            resources: &self.resources,
            slot: number,
            commands: slot.commands,
            triangles: self.triangles,
            occluders: self.occluders,
            sun_rays: &self.sun_rays,
            size: self.size,
        };
        recorder.frame(frame, |pass| self.bindings.of(pass, number), &mut slot.timing);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(slot.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        slot.submitted = Instant::now();
        // SAFETY: the command buffer is complete and the fence unsignalled.
        unsafe {
            self.context.device.end_command_buffer(slot.commands).during("recording")?;
            self.context.device.queue_submit2(self.context.queue, &submit, slot.fence).during("submitting a frame")?;
        }
        slot.pending = true;
        slot.wanted = wanted;
        Ok(Submitted(number))
    }

    /// Waits for a frame and gives what it leaves, until its slot is submitted again.
    ///
    /// # Errors
    /// A lost device.
    pub fn collect(&mut self, submitted: Submitted) -> Result<Collected<'_>, GpuError> {
        let number = submitted.0;
        self.finish(number)?;
        let wanted = self.slots[number].wanted;
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let buffer = |resource| self.resources.buffer(resource, number);
        Ok(Collected {
            radiance: wanted.image.then(|| buffer(Resource::RadianceReadback).read(pixels)),
            identity: wanted.image.then(|| buffer(Resource::IdentityReadback).read(pixels)),
            temperatures: wanted.temperatures.then(|| buffer(Resource::TemperatureReadback).read(self.nodes)),
        })
    }

    /// Waits for all frames in flight.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait(&mut self) -> Result<(), GpuError> {
        (0..self.slots.len()).try_for_each(|number| self.finish(number))
    }

    /// Device milliseconds of every pass so far, by name.
    pub fn pass_times(&self) -> &PassTimes {
        &self.times
    }

    /// Keeps from now on when each pass of each frame began and ended.
    pub fn keep_frames(&mut self) {
        self.frames.get_or_insert_default();
    }

    /// The frames that were kept since the last call.
    pub fn take_frames(&mut self) -> Vec<DeviceFrame> {
        self.frames.as_mut().map(std::mem::take).unwrap_or_default()
    }

    fn finish(&mut self, number: usize) -> Result<(), GpuError> {
        let slot = &mut self.slots[number];
        if slot.pending {
            // SAFETY: the fence was submitted with the slot's frame.
            unsafe {
                self.context.device.wait_for_fences(&[slot.fence], true, u64::MAX).during("waiting for a frame")?;
                self.context.device.reset_fences(&[slot.fence]).during("resetting a fence")?;
            }
            slot.pending = false;
            let passes = slot.timing.collect()?;
            for (name, _, length) in &passes {
                self.times.entry(name.clone()).or_default().push(length * 1e-6);
            }
            if let Some(frames) = &mut self.frames {
                frames.push(DeviceFrame { submitted: slot.submitted, done: Instant::now(), passes });
            }
        }
        Ok(())
    }

    fn write_tick(&mut self, load: &TickLoad, step: f64, slot: usize) {
        self.resources.write(Resource::Tick, slot, &[tick_of(load, step)]);
        // Samples beyond those of the tick have no flux.
        let mut samples = [[0.0f32; 4]; MAX_SUN_SAMPLES];
        for (sample, value) in samples.iter_mut().zip(&load.sun) {
            let d = value.direction;
            *sample = [d.x as f32, d.y as f32, d.z as f32, value.flux as f32];
        }
        self.resources.write(Resource::SunSamples, slot, &samples);
        if let Some(table) = &load.albedo {
            let values: Vec<f32> = table.values.iter().map(|value| *value as f32).collect();
            self.resources.write(Resource::AlbedoValues, slot, &values);
        }
    }
}

/// The ranges with the least variants that compute a tick under a load.
fn ranges_of_load(ranges: &[StepRange], load: &TickLoad) -> Vec<StepRange> {
    ranges_of_tick(ranges, !load.sun.is_empty(), load.albedo.is_some())
}

fn ranges_of_tick(ranges: &[StepRange], has_sun: bool, has_albedo: bool) -> Vec<StepRange> {
    ranges.iter().map(|range| StepRange { variant: range.variant.for_tick(has_sun, has_albedo), ..*range }).collect()
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // SAFETY: the device is idle before anything of the scene goes.
        unsafe {
            let _ = self.context.device.device_wait_idle();
            for slot in &self.slots {
                self.context.device.destroy_fence(slot.fence, None);
            }
            self.context.device.destroy_command_pool(self.command_pool, None);
        }
    }
}
