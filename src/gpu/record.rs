//! Turns the frame list into commands: barriers as written, each pass under its label and between its timestamps.

use ash::vk;
use glam::{DAffine3, DMat3};

use super::context::Context;
use super::frame::{Frame, TRIANGLES_A_DRAW, TriangleRun};
use super::layout::{self, SunRay};
use super::memory::Image;
use super::pass::{Barrier, Pass, Resource, Step, Work};
use super::pipeline::Pipeline;
use super::resources::{NODES_PER_WORKGROUP, Resources};
use super::timing::Timing;

/// What recording reads; the passes come with their pipelines and descriptor sets in the order of the list.
pub(super) struct Recorder<'a> {
    pub context: &'a Context,
    pub resources: &'a Resources,
    pub slot: usize,
    pub commands: vk::CommandBuffer,
    pub triangles: &'a [TriangleRun],
    pub occluders: &'a [TriangleRun],
    pub sun_rays: &'a [SunRay],
    /// Poses of the body and of the joints for which the rays are found; empty where nothing moves.
    pub poses: &'a [DAffine3],
    pub size: [u32; 2],
}

impl Recorder<'_> {
    /// Records the whole list; `bound` gives the pipeline and descriptor set of a pass that has one, for what hangs on a
    /// joint.
    pub fn frame<'p>(
        &self,
        frame: &Frame,
        bound: impl Fn(&Pass, u32) -> Option<(&'p Pipeline, vk::DescriptorSet)>,
        timing: &mut Timing,
    ) {
        timing.begin_frame(self.commands);
        for step in &frame.steps {
            match step {
                Step::Barriers(barriers) => self.barriers(barriers),
                Step::Pass(pass) => {
                    self.context.begin_label(self.commands, &pass.name);
                    timing.begin_pass(self.commands, &pass.name);
                    let first = bound(pass, 0);
                    if let Some((pipeline, set)) = first {
                        self.bind(pipeline, set);
                    }
                    let bind_joint = |joint: u32| {
                        if let Some((pipeline, set)) = bound(pass, joint) {
                            self.bind(pipeline, set);
                        }
                    };
                    let layout = first.map_or(vk::PipelineLayout::null(), |(pipeline, _)| pipeline.layout);
                    self.work(pass, layout, &bind_joint);
                    timing.end_pass(self.commands);
                    self.context.end_label(self.commands);
                }
            }
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
                let buffer = self.resources.buffer(barrier.resource, self.slot);
                buffers.push(
                    vk::BufferMemoryBarrier2::default()
                        .src_stage_mask(barrier.before.stage)
                        .src_access_mask(barrier.before.access)
                        .dst_stage_mask(barrier.after.stage)
                        .dst_access_mask(barrier.after.access)
                        .buffer(buffer.raw)
                        .size(vk::WHOLE_SIZE),
                );
            }
        }
        let dependency = vk::DependencyInfo::default().buffer_memory_barriers(&buffers).image_memory_barriers(&images);
        // SAFETY: the buffers and images belong to the scene being recorded.
        unsafe { self.context.device.cmd_pipeline_barrier2(self.commands, &dependency) };
    }

    fn bind(&self, pipeline: &Pipeline, set: vk::DescriptorSet) {
        // SAFETY: the set was made for this pipeline's layout and points to buffers of this scene.
        unsafe {
            self.context.device.cmd_bind_pipeline(self.commands, pipeline.bind_point, pipeline.raw);
            self.context.device.cmd_bind_descriptor_sets(
                self.commands,
                pipeline.bind_point,
                pipeline.layout,
                0,
                &[set],
                &[],
            );
        }
    }

    fn work(&self, pass: &Pass, pipeline_layout: vk::PipelineLayout, bind_joint: &dyn Fn(u32)) {
        match pass.work {
            Work::Thermal { groups: (first, end), .. } => {
                let workgroups = (end - first).div_ceil(NODES_PER_WORKGROUP as u32 / 4);
                // SAFETY: the pipeline is bound, and the range holds whole workgroups.
                unsafe { self.context.device.cmd_dispatch(self.commands, workgroups, 1, 1) };
            }
            Work::Cull { triangles: (first, end) } => {
                let workgroups = (end - first).div_ceil(TRIANGLES_A_DRAW);
                // SAFETY: the pipeline is bound and takes this constant; it leaves lanes beyond the last triangle idle.
                unsafe {
                    let (device, stages) = (&self.context.device, vk::ShaderStageFlags::COMPUTE);
                    device.cmd_push_constants(self.commands, pipeline_layout, stages, 0, &first.to_le_bytes());
                    device.cmd_dispatch(self.commands, workgroups, 1, 1);
                }
            }
            Work::SunDepth => self.draw_solar_depth(bind_joint),
            Work::Visibility { groups: (first, end) } => {
                let workgroups = (end - first).div_ceil(NODES_PER_WORKGROUP as u32 / 4);
                // SAFETY: the pipeline is bound, and the range holds whole workgroups.
                unsafe { self.context.device.cmd_dispatch(self.commands, workgroups, 1, 1) };
            }
            Work::SunRay { ray, joint, groups: (first, end) } => {
                let pose = self.poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
                let ray = &self.sun_rays[ray as usize];
                let push = [bytemuck::bytes_of(ray), bytemuck::bytes_of(&layout::rows(&pose))].concat();
                let workgroups = (end - first).div_ceil(16);
                // SAFETY: the pipeline is bound and takes these constants; the range holds whole workgroups.
                unsafe {
                    let (device, stages) = (&self.context.device, vk::ShaderStageFlags::COMPUTE);
                    device.cmd_push_constants(self.commands, pipeline_layout, stages, 0, &push);
                    device.cmd_dispatch(self.commands, workgroups, 1, 1);
                }
            }
            Work::Radiance => self.draw(bind_joint),
            // Networks have a command buffer of their own: src/gpu/network/wide.rs.
            Work::Network(_) => {}
            Work::Copy { from, to } if from.is_image() => self.copy_image(from, to),
            Work::Copy { from, to } => {
                let (from, to) = (self.resources.buffer(from, self.slot), self.resources.buffer(to, self.slot));
                let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size: from.bytes.min(to.bytes) }];
                // SAFETY: the copy stays within both buffers.
                unsafe { self.context.device.cmd_copy_buffer(self.commands, from.raw, to.raw, &copy) };
            }
            Work::Clear(resource) => {
                let buffer = self.resources.buffer(resource, self.slot);
                // SAFETY: the buffer may be a transfer destination; all-zero bytes are the float 0.
                unsafe {
                    self.context.device.cmd_fill_buffer(self.commands, buffer.raw, 0, vk::WHOLE_SIZE, 0);
                }
            }
        }
    }

    fn draw(&self, bind_joint: &dyn Fn(u32)) {
        let clear = |view: &Image, value: vk::ClearValue, store: vk::AttachmentStoreOp| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view.view)
                .image_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(store)
                .clear_value(value)
        };
        let floats = vk::ClearValue { color: vk::ClearColorValue { float32: [0.0; 4] } };
        let integers = vk::ClearValue { color: vk::ClearColorValue { uint32: [0; 4] } };
        let far = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } };
        let image = |resource| self.resources.image(resource);
        let colours = [
            clear(image(Resource::RadianceImage), floats, vk::AttachmentStoreOp::STORE),
            clear(image(Resource::IdentityImage), integers, vk::AttachmentStoreOp::STORE),
        ];
        let depth = clear(image(Resource::DepthImage), far, vk::AttachmentStoreOp::DONT_CARE);
        let [width, height] = self.size;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 };
        let rendering = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colours)
            .depth_attachment(&depth);
        let device = &self.context.device;
        let indices = self.resources.buffer(Resource::VisibleTriangles, self.slot);
        // SAFETY: the radiance pipeline is bound, the images are in attachment layout by the barriers of the list, and the
        // index buffer holds three node indices a triangle. It is bound whole: lavapipe 22.3 forgets the offset of a binding in
        // indirect draws.
        unsafe {
            device.cmd_begin_rendering(self.commands, &rendering);
            device.cmd_set_viewport(self.commands, 0, &[viewport]);
            device.cmd_set_scissor(self.commands, 0, &[area]);
            device.cmd_bind_index_buffer(self.commands, indices.raw, 0, vk::IndexType::UINT32);
        }
        for run in self.triangles.iter().copied() {
            if run.joint > 0 {
                bind_joint(run.joint);
            }
            self.draw_visible(run);
        }
        // SAFETY: rendering was begun.
        unsafe { device.cmd_end_rendering(self.commands) };
    }

    /// Draws what culling left of a run of triangles.
    fn draw_visible(&self, run: TriangleRun) {
        let device = &self.context.device;
        let draws = self.resources.buffer(Resource::Draws, self.slot);
        let stride = size_of::<layout::DrawCommand>() as u32;
        for piece in run.pieces() {
            let (first, end) = piece.draws();
            let offset = u64::from(first) * u64::from(stride);
            // SAFETY: within a rendering; the pipeline is bound, and the draws lie in their buffer.
            unsafe { device.cmd_draw_indexed_indirect(self.commands, draws.raw, offset, end - first, stride) };
        }
    }

    fn draw_solar_depth(&self, bind_joint: &dyn Fn(u32)) {
        let image = self.resources.image(Resource::SunDepthImage);
        let [width, height] = image.size;
        let far = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } };
        let depth = vk::RenderingAttachmentInfo::default()
            .image_view(image.view)
            .image_layout(vk::ImageLayout::ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(far);
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 };
        let rendering = vk::RenderingInfo::default().render_area(area).layer_count(1).depth_attachment(&depth);
        let indices = self.resources.buffer(Resource::Occluders, self.slot);
        let device = &self.context.device;
        // SAFETY: the pipeline of this pass is bound, the image is in attachment layout by the barriers of the list, and
        // the index buffer holds three node indices a triangle.
        unsafe {
            device.cmd_begin_rendering(self.commands, &rendering);
            device.cmd_set_viewport(self.commands, 0, &[viewport]);
            device.cmd_set_scissor(self.commands, 0, &[area]);
            device.cmd_bind_index_buffer(self.commands, indices.raw, 0, vk::IndexType::UINT32);
        }
        for TriangleRun { joint, triangles: (first, end) } in self.occluders.iter().copied() {
            if joint > 0 {
                bind_joint(joint);
            }
            // SAFETY: within the rendering; the pipeline is bound, and so are indices for all runs.
            unsafe { device.cmd_draw_indexed(self.commands, 3 * (end - first), 1, 3 * first, 0, 0) };
        }
        // SAFETY: rendering was begun.
        unsafe { device.cmd_end_rendering(self.commands) };
    }

    fn copy_image(&self, from: Resource, to: Resource) {
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
        let buffer = self.resources.buffer(to, self.slot);
        // SAFETY: the barriers of the list put the image in transfer layout; the buffer holds all its texels.
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
            // SAFETY: a label was begun.
            unsafe { labels.cmd_end_debug_utils_label(commands) };
        }
    }
}

/// The tick as the device reads it, for nodes that stand still in a frame.
pub(super) fn tick_of(load: &crate::environment::TickLoad, step: f64, joint_from_body: DMat3) -> layout::Tick {
    let planet = load.planet.as_ref();
    let extend = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
    let sine = planet.map_or(0.0, |planet| 1.0 / planet.distance_ratio);
    let cosine = (1.0 - sine * sine).sqrt();
    let nadir = joint_from_body * planet.map_or(glam::DVec3::Z, |planet| planet.nadir);
    let sunward = joint_from_body * planet.map_or(glam::DVec3::X, |planet| planet.sunward);
    layout::Tick {
        nadir: extend(nadir, sine),
        sunward: extend(sunward, cosine),
        across: extend(nadir.cross(sunward), 0.0),
        planet_ir: planet.map_or(0.0, |planet| planet.planet_ir) as f32,
        albedo_flux: planet.map_or(0.0, |planet| planet.albedo_flux) as f32,
        background_temperature_4: load.background_temperature.powi(4) as f32,
        step: step as f32,
        albedo_resolution: crate::environment::albedo::RESOLUTION as f32,
        count: 1.0,
        unused: [0.0; 2],
    }
}
