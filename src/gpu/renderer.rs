//! A scene on the device: its resources, its frame lists, and two slots that are submitted and collected in turn.

mod culling;
mod forward;

use std::sync::Arc;
use std::time::Instant;

use ash::vk;
use glam::DAffine3;

use culling::Culling;

use super::bindings::Bindings;
use super::context::Context;
use super::error::{Context as _, GpuError};
use super::frame::{Frame, StepRange, TriangleRun, Wanted};
use super::layout;
use super::load::DeviceLoad;
use super::memory::Buffer;
use super::once::{Once, command_buffers};
use super::pass::{Pass, Resource};
use super::record::Recorder;
use super::resources::{Resources, SLOTS, SceneData};
use super::timing::{DeviceFrame, PassTimes, Timing};
use super::variant::StepKind;
use crate::environment::TickLoad;
use crate::environment::shadow::{Jointed, Method, Redraw, SUN_RAYS, disc_directions};

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
    triangles: Vec<TriangleRun>,
    size: [u32; 2],
    culling: Culling,
    occluders: Vec<TriangleRun>,
    /// The body and its joints.
    joints: u32,
    /// Whether many ticks may pass in one dispatch.
    fuses: bool,
    /// Ticks that passed so.
    fused_ticks: u64,
    /// What rays are tried against, where parts move.
    casters: Option<Jointed>,
    /// Poses of the joints for which shadows were last found.
    poses: Vec<DAffine3>,
    redraw: Option<Redraw>,
    /// The load that every target is the balance of, where it is known.
    commanded: Option<DeviceLoad>,
    /// Boxes of the tree and where its rays start [m], where rays find the shadows.
    tree: Option<(u32, f64)>,
    sun_rays: Vec<layout::SunRay>,
    /// The Sun's view of the frame that is submitted next, one a joint, where it draws it.
    sun_view: Vec<layout::SunView>,
    times: PassTimes,
    /// Frames since they were last taken, where they are kept.
    frames: Option<Vec<DeviceFrame>>,
    next: usize,
    slots: Vec<Slot>,
    command_pool: vk::CommandPool,
    bindings: Bindings,
    /// What takes many ticks in a dispatch, once it was asked for.
    fused: Option<Bindings>,
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
        let whole = |count: usize| vec![TriangleRun { joint: 0, triangles: (0, count as u32) }];
        let triangles = data.runs();
        let occluders = data.shadows.as_ref().map_or(0, |shadows| shadows.occluders.len());
        let occluders = data.joints.as_ref().map_or_else(|| whole(occluders), |joints| joints.occluders.to_vec());
        let mut frames = Vec::new();
        for (has_sun, has_albedo) in [(true, true), (true, false), (false, false)] {
            let ranges = ranges_of_tick(&data.ranges, has_sun, has_albedo);
            frames.extend([Frame::step_in_runs(&ranges, wanted, &triangles), Frame::settle(&ranges)]);
        }
        frames.push(Frame::step_in_runs(&idle(&data.ranges), wanted, &triangles));
        let tree = data.shadows.as_ref().and_then(|shadows| shadows.tree);
        let method = if tree.is_some() { Method::Exact } else { Method::Depth };
        let shadows = Frame::shadows(&data.ranges, method);
        let passes = frames.iter().map(|frame| frame.passes().count()).max().unwrap_or(0) + shadows.passes().count();
        frames.push(shadows);
        let joints = data.joints.as_ref().map_or(1, |joints| joints.count);
        let bindings = Bindings::new(context, &resources, &frames.iter().collect::<Vec<_>>(), joints)?;
        let (command_pool, commands) = command_buffers(context, SLOTS as u32)?;
        let mut renderer = Self {
            ranges: data.ranges.clone(),
            nodes: data.normals.len(),
            culling: Culling::new(&triangles, data.triangles, data.positions),
            triangles,
            size: data.image.unwrap_or_default(),
            occluders,
            joints,
            fuses: data.fuses(),
            fused_ticks: 0,
            casters: data.joints.as_ref().and_then(|joints| joints.casters.clone()),
            poses: Vec::new(),
            redraw: data.shadows.as_ref().map(|shadows| shadows.redraw.clone()),
            commanded: None,
            tree: tree.map(|tree| (tree.tree.nodes.len() as u32, tree.start)),
            sun_rays: Vec::new(),
            sun_view: Vec::new(),
            times: PassTimes::new(),
            frames: None,
            next: 0,
            slots: Vec::new(),
            command_pool,
            bindings,
            fused: None,
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
        let frame = self.shadows(load)?.then(Frame::settle(&ranges_of_load(&self.ranges, load)));
        let submitted = self.submit_views_frame(&frame, Some((load, 1.0)), None, Wanted::default())?;
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
        self.submit_views(tick, view.map(std::slice::from_ref), temperatures)
    }

    /// The same of a craft with joints: a view for the body and one for each joint, as what hangs on it sees the camera.
    ///
    /// # Errors
    /// A call that fails.
    pub fn submit_views(
        &mut self,
        tick: Option<(&TickLoad, f64)>,
        views: Option<&[layout::View]>,
        temperatures: bool,
    ) -> Result<Submitted, GpuError> {
        let mut views = views.map(<[layout::View]>::to_vec);
        let culled = views.as_mut().map_or(Vec::new(), |views| self.culling.due(views));
        let cull = culled.iter().map(|run| run.triangles.1 - run.triangles.0).sum();
        let wanted = Wanted { image: views.is_some(), cull, temperatures };
        let mut ranges = tick.map_or(Vec::new(), |(load, _)| ranges_of_load(&self.ranges, load));
        // What the host steps has its temperatures by now.
        ranges.retain(|range| range.variant.kind != StepKind::Absorb);
        let shadows = match tick {
            Some((load, _)) => self.shadows(load)?,
            None => Frame { steps: Vec::new() },
        };
        if let Some((load, _)) = tick {
            // Under the load that commanded them last, nodes have nothing to do but to go on.
            let load = Some(DeviceLoad::new(load, self.joints));
            if shadows.steps.is_empty() && self.commanded == load {
                ranges = idle(&ranges);
            } else {
                self.commanded = load;
            }
        }
        let frame = shadows.then(Frame::step_in_runs(&ranges, wanted, &culled));
        self.submit_views_frame(&frame, tick, views.as_deref(), wanted)
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
        let frame = self.shadows(load)?.then(Frame::step(&ranges, wanted));
        let submitted = self.submit_views_frame(&frame, Some((load, 1.0)), None, wanted)?;
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
        self.resources.device_bytes()
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
    fn shadows(&mut self, load: &TickLoad) -> Result<Frame, GpuError> {
        let Some(view) = self.redraw.as_mut().and_then(|redraw| redraw.view(load)) else {
            return Ok(Frame { steps: Vec::new() });
        };
        let Some((mut boxes, mut start)) = self.tree else {
            let pose = |joint: u32| load.joints.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
            self.sun_view = (0..self.joints).map(|joint| layout::SunView::new(&view.in_joint(&pose(joint)))).collect();
            return Ok(Frame::shadows(&self.ranges, Method::Depth));
        };
        if let Some(casters) = &self.casters
            && self.poses != load.joints
        {
            let tree = casters.occluders(&load.joints);
            // Frames in flight may still read the last tree.
            (0..self.slots.len()).try_for_each(|number| self.finish(number))?;
            self.resources.upload_tree(&mut self.once, &tree)?;
            (boxes, start) = (tree.tree.nodes.len() as u32, tree.start);
            self.tree = Some((boxes, start));
            self.poses.clone_from(&load.joints);
        }
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let ray = |direction| layout::SunRay {
            sun: with(view.sun, start),
            direction: with(direction, 1.0 / SUN_RAYS as f64),
            boxes,
            unused: [0; 3],
        };
        self.sun_rays = disc_directions(view.sun).map(ray).to_vec();
        Ok(Frame::shadows(&self.ranges, Method::Exact))
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
        // What the list commands is its own affair.
        self.commanded = None;
        self.submit_views_frame(frame, tick, view.map(std::slice::from_ref), wanted)
    }

    fn submit_views_frame(
        &mut self,
        frame: &Frame,
        tick: Option<(&TickLoad, f64)>,
        views: Option<&[layout::View]>,
        wanted: Wanted,
    ) -> Result<Submitted, GpuError> {
        let number = self.next;
        self.next = (self.next + 1) % SLOTS;
        self.finish(number)?;
        if let Some((load, step)) = tick {
            DeviceLoad::new(load, self.joints).write(&mut self.resources, number, step);
        }
        if let Some(views) = views {
            self.resources.write_slices(Resource::View, number, views);
        }
        let sun_views = std::mem::take(&mut self.sun_view);
        if !sun_views.is_empty() {
            self.resources.write_slices(Resource::SunView, number, &sun_views);
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
            triangles: &self.triangles,
            occluders: &self.occluders,
            sun_rays: &self.sun_rays,
            poses: &self.poses,
            size: self.size,
        };
        let bound = |pass: &Pass, joint: u32| {
            let fused = self.fused.as_ref().filter(|_| pass.is_fused());
            fused.unwrap_or(&self.bindings).of(pass, joint, number)
        };
        recorder.frame(frame, bound, &mut slot.timing);
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
}

/// The ranges with the least variants that compute a tick under a load.
fn ranges_of_load(ranges: &[StepRange], load: &TickLoad) -> Vec<StepRange> {
    ranges_of_tick(ranges, !load.sun.is_empty(), load.albedo.is_some())
}

/// The ranges under a load that has not changed: balances stand, transitions go on.
fn idle(ranges: &[StepRange]) -> Vec<StepRange> {
    let moving = ranges.iter().filter(|range| range.variant.kind.has_state());
    moving.map(|range| StepRange { variant: range.variant.idle(), ..*range }).collect()
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
