//! Creation of compute and graphics pipelines.

use ash::vk;

use super::context::Context;
use super::error::{During as _, GpuError};
use super::kept_pipelines::{Pipeline, PipelineKind};
use super::pass::Drawing;
use super::resource::Role;
use super::shaders::{Shader, module};

/// Format of the radiance image.
pub(crate) const RADIANCE_FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
/// Format of the image with part and material of each pixel.
pub(crate) const IDENTITY_FORMAT: vk::Format = vk::Format::R32G32_UINT;
/// Format of the image with mean radiance and coverage.
pub(crate) const MEAN_FORMAT: vk::Format = vk::Format::R32G32_SFLOAT;
/// Format of the image with normal times depth and face of each texel.
pub(crate) const SURFACE_FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
/// Format of the depth buffer.
pub(crate) const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

impl Pipeline {
    /// Makes a compute pipeline from number and type of its bindings and the size of its push constants [bytes].
    pub(crate) fn compute(
        context: &Context,
        shader: &Shader,
        bindings: &[(u32, vk::DescriptorType)],
        constants: u32,
    ) -> Result<Self, GpuError> {
        let stages = vk::ShaderStageFlags::COMPUTE;
        let (shaders, bindings) = (vec![shader.clone()], bindings.to_vec());
        let kind = PipelineKind { shaders, bindings, constants, drawn: None };
        Self::kept(context, kind, stages, &shader.name(), |layout| {
            let module = Module::new(context, shader)?;
            let stage = module.stage(vk::ShaderStageFlags::COMPUTE);
            let create = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
            // SAFETY: the module and the layout live through the call.
            let made = unsafe { context.device.create_compute_pipelines(context.pipelines.raw, &create, None) };
            made.map_err(|(_, result)| GpuError::Call { call: "creating a compute pipeline", result })
        })
    }

    /// Makes the pipeline of a draw: vertices read from storage buffers, no face culling. Depth is reversed.
    pub(crate) fn draw(
        context: &Context,
        name: &str,
        drawing: &Drawing,
        bindings: &[(u32, vk::DescriptorType)],
    ) -> Result<Self, GpuError> {
        Self::graphics(context, name, &drawing.shaders, bindings, drawing, vk::CompareOp::GREATER)
    }

    /// Makes the pipeline of what is drawn where nothing is: its depth is the depth of the cleared image.
    pub(crate) fn behind(
        context: &Context,
        drawing: &Drawing,
        shaders: &[Shader],
        bindings: &[(u32, vk::DescriptorType)],
    ) -> Result<Self, GpuError> {
        Self::graphics(context, "background", shaders, bindings, drawing, vk::CompareOp::EQUAL)
    }

    /// Makes a pipeline for triangles without face culling. `nearer` is the depth test, and `shaders` are the vertex shader
    /// and, if there are colours, the fragment shader.
    fn graphics(
        context: &Context,
        name: &str,
        shaders: &[Shader],
        bindings: &[(u32, vk::DescriptorType)],
        drawing: &Drawing,
        nearer: vk::CompareOp,
    ) -> Result<Self, GpuError> {
        let format = |role| match role {
            Role::Colour(format) => format,
            _ => DEPTH_FORMAT,
        };
        let formats: Vec<_> = drawing.colours.iter().map(|(image, _)| format(image.role)).collect();
        let stages = if formats.is_empty() {
            vk::ShaderStageFlags::VERTEX
        } else {
            vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT
        };
        let kind = PipelineKind {
            shaders: shaders.to_vec(),
            bindings: bindings.to_vec(),
            constants: drawing.constants.len() as u32,
            drawn: Some((nearer, formats.clone(), drawing.samples)),
        };
        Self::kept(context, kind, stages, name, |layout| {
            Self::make_graphics(context, shaders, &formats, drawing.samples, nearer, layout)
        })
    }

    fn make_graphics(
        context: &Context,
        shaders: &[Shader],
        formats: &[vk::Format],
        samples: u32,
        nearer: vk::CompareOp,
        layout: vk::PipelineLayout,
    ) -> Result<Vec<vk::Pipeline>, GpuError> {
        let modules = shaders.iter().map(|shader| Module::new(context, shader)).collect::<Result<Vec<_>, _>>()?;
        let kinds = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
        let stages: Vec<_> = modules.iter().zip(kinds).map(|(module, kind)| module.stage(kind)).collect();

        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        // Triangles are counter-clockwise from outside in the body frame. They stay so in an image with Y down and Z
        // forward, because both frames are right-handed.
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(samples));
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(nearer);
        let whole = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let attachments = vec![whole; formats.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(formats)
            .depth_attachment_format(DEPTH_FORMAT);
        let create = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering)];
        // SAFETY: modules, layout and all state above live through the call.
        let made = unsafe { context.device.create_graphics_pipelines(context.pipelines.raw, &create, None) };
        made.map_err(|(_, result)| GpuError::Call { call: "creating a graphics pipeline", result })
    }

    /// The pipeline of a kind that the context keeps, made where there is none. `make` makes it with a layout.
    fn kept(
        context: &Context,
        kind: PipelineKind,
        stages: vk::ShaderStageFlags,
        name: &str,
        make: impl FnOnce(vk::PipelineLayout) -> Result<Vec<vk::Pipeline>, GpuError>,
    ) -> Result<Self, GpuError> {
        let bind_point = match kind.drawn {
            None => vk::PipelineBindPoint::COMPUTE,
            Some(_) => vk::PipelineBindPoint::GRAPHICS,
        };
        context.made.get_or_make(kind, |kind| {
            let mut pipeline = Self { bind_point, ..Self::default() };
            let made = pipeline.add_layouts(context, kind, stages).and_then(|()| make(pipeline.layout));
            match made {
                Ok(made) => pipeline.raw = made[0],
                Err(error) => {
                    pipeline.destroy(&context.device);
                    return Err(error);
                }
            }
            context.set_name(pipeline.raw, name);
            Ok(pipeline)
        })
    }

    fn add_layouts(
        &mut self,
        context: &Context,
        kind: &PipelineKind,
        stages: vk::ShaderStageFlags,
    ) -> Result<(), GpuError> {
        let PipelineKind { bindings, constants, .. } = kind;
        let bindings: Vec<_> = bindings
            .iter()
            .map(|(binding, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(*binding)
                    .descriptor_type(*kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let create = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device is alive, and the bindings live through the call.
        self.set_layout = unsafe { context.device.create_descriptor_set_layout(&create, None) }
            .during("creating a descriptor set layout")?;
        let layouts = [self.set_layout];
        let range = [vk::PushConstantRange { stage_flags: stages, offset: 0, size: *constants }];
        let ranges = if *constants == 0 { &range[..0] } else { &range[..] };
        let create = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(ranges);
        // SAFETY: the device is alive, and the ranges live through the call.
        self.layout =
            unsafe { context.device.create_pipeline_layout(&create, None) }.during("creating a pipeline layout")?;
        Ok(())
    }
}

/// A shader module, needed only while a pipeline is created.
struct Module<'a> {
    context: &'a Context,
    raw: vk::ShaderModule,
}

impl<'a> Module<'a> {
    fn new(context: &'a Context, shader: &Shader) -> Result<Self, GpuError> {
        let compiled = module(shader)?;
        let create = vk::ShaderModuleCreateInfo::default().code(&compiled.words);
        // SAFETY: the words are SPIR-V that naga wrote and validated; tests run spirv-val on it.
        let raw = unsafe { context.device.create_shader_module(&create, None) }.during("creating a shader module")?;
        Ok(Self { context, raw })
    }

    fn stage(&self, stage: vk::ShaderStageFlags) -> vk::PipelineShaderStageCreateInfo<'_> {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(self.raw).name(c"main")
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: a module may be destroyed after its pipelines are created.
        unsafe { self.context.device.destroy_shader_module(self.raw, None) };
    }
}
