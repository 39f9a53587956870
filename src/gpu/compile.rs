//! Compilation of GLSL to SPIR-V by naga, with every option set explicitly.

use naga::back::spv;
use naga::front::glsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::spirv;

/// A shader that does not compile.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}: {message}")]
pub struct CompileError {
    /// Entry point and words (see `Shader`).
    pub(crate) name: String,
    /// Message of naga. Its line numbers count the text after includes are expanded.
    pub(crate) message: String,
}

/// Compiles the text of an entry point `main` with the given preprocessor names and their values defined. The extension
/// of the file name gives the shader stage.
pub(super) fn compile(
    name: &str,
    file: &str,
    text: &str,
    definitions: impl Iterator<Item = (String, String)>,
) -> Result<Vec<u32>, CompileError> {
    let failed = |message: String| CompileError { name: name.to_owned(), message };
    let stage = match file.rsplit('.').next() {
        Some("vert") => naga::ShaderStage::Vertex,
        Some("frag") => naga::ShaderStage::Fragment,
        _ => naga::ShaderStage::Compute,
    };
    let mut options = glsl::Options::from(stage);
    options.defines.extend(definitions);
    let parsed = glsl::Frontend::default().parse(&options, text);
    let mut module = parsed.map_err(|errors| failed(errors.emit_to_string(text)))?;
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    for function in functions.chain(module.entry_points.iter_mut().map(|entry| &mut entry.function)) {
        narrow_barriers(&mut function.body);
    }
    let info = Validator::new(ValidationFlags::all(), Capabilities::IMMEDIATES | Capabilities::MULTISAMPLED_SHADING)
        .validate(&module)
        .map_err(|error| failed(error.emit_to_string(text)))?;
    let entry = spv::PipelineOptions { shader_stage: stage, entry_point: "main".to_owned() };
    let words = spv::write_vec(&module, &info, &writer_options(), Some(&entry));
    words.map(|words| spirv::mended(&words)).map_err(|error| failed(error.to_string()))
}

/// Replaces every control barrier by one for the workgroup and storage buffers, which is what GLSL's `barrier()` means.
/// naga's GLSL reader also includes the subgroup, and its SPIR-V writer then waits for the subgroup only.
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

/// Options of the SPIR-V writer. All are set, so that debug and release builds of naga write the same bytes.
fn writer_options() -> spv::Options<'static> {
    spv::Options {
        lang_version: (1, 5),
        // ADJUST_COORDINATE_SPACE is off because it flips the image to WebGPU's axes. Names stay for debuggers and
        // tests.
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
