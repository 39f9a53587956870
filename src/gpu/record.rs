//! Recording of frame lists into a command buffer.

use ash::vk;

use super::bindings::Bindings;
use super::context::Context;
use super::effects::image::runs::TriangleRun;
use super::kept_pipelines::Pipeline;
use super::layout;
use super::memory::Image;
use super::pass::{Barrier, Drawing, Frame, ListEntry, Pass, PassWork};
use super::resource::{Resource, Role};
use super::store::Resources;
use super::timing::Timing;

/// Recorder with everything that recording reads besides the lists.
pub(super) struct Recorder<'a> {
    context: &'a Context,
    commands: vk::CommandBuffer,
    resources: &'a Resources,
    bindings: Option<&'a Bindings>,
    /// Pipeline and descriptor set that were bound last.
    bound: (vk::Pipeline, vk::DescriptorSet),
    /// Slot of resources with one copy for each frame in flight.
    slot: usize,
    /// Triangles of the image.
    triangles: &'a [TriangleRun],
}

impl<'a> Recorder<'a> {
    /// A recorder for lists that do not draw.
    pub(crate) fn new(
        context: &'a Context,
        commands: vk::CommandBuffer,
        resources: &'a Resources,
        bindings: Option<&'a Bindings>,
    ) -> Self {
        let bound = Default::default();
        Self { context, commands, resources, bindings, bound, slot: 0, triangles: &[] }
    }

    /// Prepares the recorder for lists of a slot that draw.
    pub(crate) fn drawing(self, slot: usize, triangles: &'a [TriangleRun]) -> Self {
        Self { slot, triangles, ..self }
    }

    /// Records a list. With `timing`, each pass gets a debug label, and passes between barriers a time.
    pub(crate) fn record(&mut self, list: &Frame, mut timing: Option<&mut Timing>) {
        for entry in &list.entries {
            match entry {
                ListEntry::Barriers(barriers) => {
                    if let Some(timing) = &mut timing {
                        timing.end_group(self.commands);
                    }
                    self.barriers(barriers);
                }
                ListEntry::Pass(pass) => {
                    if let Some(timing) = &mut timing {
                        self.context.begin_label(self.commands, &pass.name);
                        timing.begin_pass(self.commands, &pass.name);
                    }
                    self.pass(pass);
                    if timing.is_some() {
                        self.context.end_label(self.commands);
                    }
                }
            }
        }
        if let Some(timing) = timing {
            timing.end_group(self.commands);
        }
    }

    fn barriers(&self, barriers: &[Barrier]) {
        let mut buffers = Vec::new();
        let mut images = Vec::new();
        for barrier in barriers {
            if let Some((old, new)) = barrier.layouts {
                let image = self.resources.image(barrier.resource);
                images.push(
                    vk::ImageMemoryBarrier2::default()
                        .src_stage_mask(barrier.before.stage)
                        .src_access_mask(barrier.before.access)
                        .dst_stage_mask(barrier.after.stage)
                        .dst_access_mask(barrier.after.access)
                        .old_layout(old)
                        .new_layout(new)
                        .image(image.raw)
                        .subresource_range(image.whole()),
                );
            } else {
                let region = self.resources.region(barrier.resource, self.slot);
                buffers.push(
                    vk::BufferMemoryBarrier2::default()
                        .src_stage_mask(barrier.before.stage)
                        .src_access_mask(barrier.before.access)
                        .dst_stage_mask(barrier.after.stage)
                        .dst_access_mask(barrier.after.access)
                        .buffer(region.buffer.raw)
                        .offset(region.offset)
                        .size(region.bytes),
                );
            }
        }
        let dependency = vk::DependencyInfo::default().buffer_memory_barriers(&buffers).image_memory_barriers(&images);
        // SAFETY: the buffers and images stay alive until the commands complete.
        unsafe { self.context.device.cmd_pipeline_barrier2(self.commands, &dependency) };
    }

    /// Binds pipeline and descriptor set of a pass for a joint. It returns `None` for copies.
    fn bind(&mut self, pass: &Pass, joint: u32) -> Option<&'a Pipeline> {
        let (pipeline, set) = self.bindings?.of(pass, joint, self.slot)?;
        if self.bound != (pipeline.raw, set) {
            self.bound = (pipeline.raw, set);
            let (device, point) = (&self.context.device, pipeline.bind_point);
            // SAFETY: the set was made for this pipeline's layout and points to buffers that outlive the commands.
            unsafe {
                device.cmd_bind_pipeline(self.commands, point, pipeline.raw);
                device.cmd_bind_descriptor_sets(self.commands, point, pipeline.layout, 0, &[set], &[]);
            }
        }
        Some(pipeline)
    }

    fn pass(&mut self, pass: &Pass) {
        let device = &self.context.device;
        match &pass.work {
            PassWork::Dispatch { workgroups, constants, .. } => {
                let Some(pipeline) = self.bind(pass, 0) else { return };
                // SAFETY: the bound pipeline has these push constants. Its nodes fill whole workgroups, or invocations
                // beyond the last return at once.
                unsafe {
                    if !constants.is_empty() {
                        let stages = vk::ShaderStageFlags::COMPUTE;
                        device.cmd_push_constants(self.commands, pipeline.layout, stages, 0, constants);
                    }
                    device.cmd_dispatch(self.commands, *workgroups, 1, 1);
                }
            }
            PassWork::Draw(drawing) => self.draw(pass, drawing),
            PassWork::Copy { from, to } if from.role.is_image() => self.copy_image(from, to),
            PassWork::Copy { from, to } => {
                let (from, to) = (self.resources.region(from, self.slot), self.resources.region(to, self.slot));
                let copy =
                    [vk::BufferCopy { src_offset: from.offset, dst_offset: to.offset, size: from.bytes.min(to.bytes) }];
                // SAFETY: the copy stays within both buffers.
                unsafe { device.cmd_copy_buffer(self.commands, from.buffer.raw, to.buffer.raw, &copy) };
            }
            PassWork::Fill(resource, word) => {
                let region = self.resources.region(resource, self.slot);
                // SAFETY: the buffer allows transfer writes and is at least as long as the region.
                unsafe {
                    device.cmd_fill_buffer(self.commands, region.buffer.raw, region.offset, region.bytes, *word);
                }
            }
        }
    }

    /// Begins rendering to attachments of one size and binds an index buffer.
    fn begin_drawing(&self, rendering: vk::RenderingInfo<'_>, [width, height]: [u32; 2], indices: &'static Resource) {
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 };
        let rendering = rendering.render_area(area).layer_count(1);
        let indices = &self.resources.region(indices, self.slot).buffer;
        let device = &self.context.device;
        // SAFETY: the barriers of the list put the images in attachment layout, and the index buffer holds three
        // indices for each triangle. It is bound whole because lavapipe 22.3 ignores the binding's offset in indirect
        // draws.
        unsafe {
            device.cmd_begin_rendering(self.commands, &rendering);
            device.cmd_set_viewport(self.commands, 0, &[viewport]);
            device.cmd_set_scissor(self.commands, 0, &[area]);
            device.cmd_bind_index_buffer(self.commands, indices.raw, 0, vk::IndexType::UINT32);
        }
    }

    fn end_drawing(&self) {
        // SAFETY: rendering has begun.
        unsafe { self.context.device.cmd_end_rendering(self.commands) };
    }

    fn draw(&mut self, pass: &Pass, drawing: &Drawing) {
        let image = |resource| self.resources.image(resource);
        let (store, discard) = (vk::AttachmentStoreOp::STORE, vk::AttachmentStoreOp::DONT_CARE);
        let colours: Vec<_> = drawing
            .colours
            .iter()
            .map(|(colour, mean)| match mean {
                Some(mean) => averaged(cleared(image(colour), nothing(colour.role), discard), image(mean)),
                None => cleared(image(colour), nothing(colour.role), store),
            })
            .collect();
        // Reversed depth begins with 0.
        let depth = image(drawing.depth);
        let attachment = cleared(depth, depth_of(0.0), discard);
        let rendering = vk::RenderingInfo::default().color_attachments(&colours).depth_attachment(&attachment);
        let pipeline = self.bind(pass, 0);
        self.begin_drawing(rendering, depth.size, drawing.indices);
        if let Some(pipeline) = pipeline.filter(|_| !drawing.constants.is_empty()) {
            let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
            let device = &self.context.device;
            // SAFETY: the bound pipeline has these push constants, and the pipeline of what stands behind has them too.
            unsafe { device.cmd_push_constants(self.commands, pipeline.layout, stages, 0, &drawing.constants) };
        }
        for run in self.triangles.iter().copied() {
            self.bind(pass, run.joint);
            self.draw_visible(run, drawing.commands);
        }
        self.draw_behind(pass);
        self.end_drawing();
    }

    /// Draws the triangles of a run that culling kept.
    fn draw_visible(&self, run: TriangleRun, commands: &'static Resource) {
        let device = &self.context.device;
        let draws = &self.resources.region(commands, self.slot).buffer;
        let stride = size_of::<layout::DrawCommand>() as u32;
        for piece in run.pieces() {
            let (first, end) = piece.draws();
            let at_once = if self.context.info.draws_many { end - first } else { 1 };
            for draw in (first..end).step_by(at_once.max(1) as usize) {
                let offset = u64::from(draw) * u64::from(stride);
                // SAFETY: rendering has begun, the pipeline is bound, and the draw commands are within their buffer.
                unsafe { device.cmd_draw_indexed_indirect(self.commands, draws.raw, offset, at_once, stride) };
            }
        }
    }

    /// Draws what stands where no triangle is.
    fn draw_behind(&mut self, pass: &Pass) {
        let Some(pipeline) = self.bindings.and_then(|bindings| bindings.behind(pass)) else { return };
        self.bind(pass, 0);
        self.bound.0 = pipeline.raw;
        let device = &self.context.device;
        // SAFETY: rendering has begun. The bound set was made for a layout with the bindings, stages and push constants of this pipeline.
        unsafe {
            device.cmd_bind_pipeline(self.commands, pipeline.bind_point, pipeline.raw);
            device.cmd_draw(self.commands, 3, 1, 0, 0);
        }
    }

    fn copy_image(&self, from: &'static Resource, to: &'static Resource) {
        let image = self.resources.image(from);
        let [width, height] = image.size;
        let copy = [vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: image.whole().aspect_mask,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(vk::Extent3D { width, height, depth: 1 })];
        let buffer = &self.resources.region(to, self.slot).buffer;
        // SAFETY: the barriers of the list put the image in transfer layout, and the buffer holds all texels.
        unsafe {
            self.context.device.cmd_copy_image_to_buffer(
                self.commands,
                image.raw,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                buffer.raw,
                &copy,
            );
        }
    }
}

impl Context {
    fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        if let (Some(labels), Ok(name)) = (&self.labels, std::ffi::CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: the command buffer is being recorded.
            unsafe { labels.cmd_begin_debug_utils_label(commands, &label) };
        }
    }

    fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(labels) = &self.labels {
            // SAFETY: a label has begun.
            unsafe { labels.cmd_end_debug_utils_label(commands) };
        }
    }
}

/// An attachment that is cleared to a value.
fn cleared(image: &Image, value: vk::ClearValue, store: vk::AttachmentStoreOp) -> vk::RenderingAttachmentInfo<'_> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(store)
        .clear_value(value)
}

/// An attachment whose samples are averaged into an image at the end of the draw.
fn averaged<'a>(attachment: vk::RenderingAttachmentInfo<'a>, to: &'a Image) -> vk::RenderingAttachmentInfo<'a> {
    attachment
        .resolve_mode(vk::ResolveModeFlags::AVERAGE)
        .resolve_image_view(to.view)
        .resolve_image_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
}

/// The value to which a colour is cleared.
fn nothing(role: Role) -> vk::ClearValue {
    let integers = role == Role::Colour(super::pipeline::IDENTITY_FORMAT);
    let color =
        if integers { vk::ClearColorValue { uint32: [0; 4] } } else { vk::ClearColorValue { float32: [0.0; 4] } };
    vk::ClearValue { color }
}

fn depth_of(depth: f32) -> vk::ClearValue {
    vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 } }
}
