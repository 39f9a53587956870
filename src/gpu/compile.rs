//! GLSL to SPIR-V by naga, with every option that shapes the output set explicitly.
//!
//! What is checked in, what a test compiles and what a scene compiles when it loads come from here.

use std::collections::BTreeSet;

use naga::back::spv;
use naga::front::glsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// What went wrong, with the shader's name.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// A file could not be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The stage does not follow from the file name.
    #[error("{0}: a shader's name ends in .comp, .vert or .frag")]
    Stage(String),
    /// The GLSL does not parse.
    #[error("{name}: {message}")]
    Parse {
        /// Shader and variant.
        name: String,
        /// naga's message, with lines of the text after includes.
        message: String,
    },
    /// The module is not valid.
    #[error("{name}: {message}")]
    Validate {
        /// Shader and variant.
        name: String,
        /// naga's message.
        message: String,
    },
    /// SPIR-V could not be written.
    #[error("{name}: {message}")]
    Write {
        /// Shader and variant.
        name: String,
        /// naga's message.
        message: String,
    },
}

/// The shaders that a scene may compile when it loads, with what they include, as they stand in glsl/.
const SOURCES: &[(&str, &str)] = &[
    ("thermal_step.comp", include_str!("../../glsl/thermal_step.comp")),
    ("response.comp", include_str!("../../glsl/response.comp")),
    ("types.glsl", include_str!("../../glsl/types.glsl")),
    ("balance.glsl", include_str!("../../glsl/balance.glsl")),
    ("transition.glsl", include_str!("../../glsl/transition.glsl")),
    ("planet.glsl", include_str!("../../glsl/planet.glsl")),
    ("albedo.glsl", include_str!("../../glsl/albedo.glsl")),
    ("shaped_transition.glsl", include_str!("../../glsl/shaped_transition.glsl")),
];

/// A file of glsl/ that is part of the library; empty for one that is not.
fn source(name: &str) -> &'static str {
    SOURCES.iter().find(|(file, _)| *file == name).map_or("", |(_, text)| text)
}

/// Text of a shader with `#include "file"` replaced by what `read` makes of the file, once each (naga accepts no
/// includes).
///
/// # Errors
/// What `read` says of a file.
pub fn expand_includes(
    file: &str,
    read: &dyn Fn(&str) -> Result<String, CompileError>,
) -> Result<String, CompileError> {
    fn expand(
        file: &str,
        read: &dyn Fn(&str) -> Result<String, CompileError>,
        seen: &mut BTreeSet<String>,
        text: &mut String,
    ) -> Result<(), CompileError> {
        for line in read(file)?.lines() {
            let included = line.strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"'));
            match included {
                Some(file) if seen.insert(file.to_owned()) => expand(file, read, seen, text)?,
                Some(_) => {}
                None => {
                    text.push_str(line);
                    text.push('\n');
                }
            }
        }
        Ok(())
    }
    let mut text = String::new();
    expand(file, read, &mut BTreeSet::new(), &mut text)?;
    Ok(text)
}

/// Compiles an entry point of the library.
///
/// # Errors
/// Text that does not parse or validate, by naga's message.
pub fn compile_own(name: &str, file: &str, defines: &[&str]) -> Result<Vec<u32>, CompileError> {
    compile(name, file, &expand_includes(file, &|file| Ok(source(file).to_owned()))?, defines)
}

/// Compiles the text of one entry point `main`. The stage follows from `file_name`, `defines` are defined as 1.
///
/// # Errors
/// Text that does not parse or validate, by naga's message.
pub fn compile(name: &str, file_name: &str, text: &str, defines: &[&str]) -> Result<Vec<u32>, CompileError> {
    let stage = match file_name.rsplit('.').next() {
        Some("comp") => naga::ShaderStage::Compute,
        Some("vert") => naga::ShaderStage::Vertex,
        Some("frag") => naga::ShaderStage::Fragment,
        _ => return Err(CompileError::Stage(file_name.to_owned())),
    };
    let mut options = glsl::Options::from(stage);
    for define in defines {
        options.defines.insert((*define).to_owned(), "1".to_owned());
    }
    let mut module = glsl::Frontend::default()
        .parse(&options, text)
        .map_err(|errors| CompileError::Parse { name: name.to_owned(), message: errors.emit_to_string(text) })?;
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    for function in functions.chain(module.entry_points.iter_mut().map(|entry| &mut entry.function)) {
        narrow_barriers(&mut function.body);
    }
    let info = Validator::new(ValidationFlags::all(), Capabilities::IMMEDIATES)
        .validate(&module)
        .map_err(|error| CompileError::Validate { name: name.to_owned(), message: error.emit_to_string(text) })?;
    spv::write_vec(
        &module,
        &info,
        &writer_options(),
        Some(&spv::PipelineOptions { shader_stage: stage, entry_point: "main".to_owned() }),
    )
    .map_err(|error| CompileError::Write { name: name.to_owned(), message: error.to_string() })
}

/// naga reads `barrier()` as a barrier of everything, subgroups included, and then writes one that waits for the subgroup
/// alone. What GLSL means is one for the workgroup; storage buffers are included.
fn narrow_barriers(block: &mut naga::Block) {
    for statement in block.iter_mut() {
        match statement {
            naga::Statement::ControlBarrier(barrier) => {
                *barrier = naga::Barrier::STORAGE | naga::Barrier::WORK_GROUP;
            }
            naga::Statement::Block(inner) => narrow_barriers(inner),
            naga::Statement::If { accept, reject, .. } => {
                narrow_barriers(accept);
                narrow_barriers(reject);
            }
            naga::Statement::Loop { body, continuing, .. } => {
                narrow_barriers(body);
                narrow_barriers(continuing);
            }
            naga::Statement::Switch { cases, .. } => {
                for case in cases {
                    narrow_barriers(&mut case.body);
                }
            }
            _ => {}
        }
    }
}

/// Every option set, so that debug and release builds of naga write the same bytes.
fn writer_options() -> spv::Options<'static> {
    spv::Options {
        lang_version: (1, 5),
        // No ADJUST_COORDINATE_SPACE: naga would flip the image to WebGPU's axes. Names stay for debuggers and tests.
        flags: spv::WriterFlags::DEBUG | spv::WriterFlags::LABEL_VARYINGS,
        fake_missing_bindings: true,
        binding_map: spv::BindingMap::default(),
        capabilities: None,
        bounds_check_policies: naga::proc::BoundsCheckPolicies {
            index: naga::proc::BoundsCheckPolicy::Unchecked,
            buffer: naga::proc::BoundsCheckPolicy::Unchecked,
            image_load: naga::proc::BoundsCheckPolicy::Unchecked,
            binding_array: naga::proc::BoundsCheckPolicy::Unchecked,
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        ray_query_initialization_tracking: false,
        trace_ray_argument_validation: false,
        use_storage_input_output_16: false,
        debug_info: None,
        task_dispatch_limits: None,
        mesh_shader_primitive_indices_clamp: false,
        emit_int_div_checks: false,
    }
}
