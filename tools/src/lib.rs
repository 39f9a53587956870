//! Compiles all shaders in memory, for the `shaders` program and for the test that `spirv/` is up to date.

use std::fmt::Write as _;
use std::path::Path;

use isotherm::gpu::compile::{self, CompileError, expand_includes};
use isotherm::gpu::variant::{FusedVariant, ResponseVariant, ThermalVariant};
use isotherm::gpu::wide_variant::WideVariant;

/// Name and content of every file of `spirv/`, sorted: a module an entry point or variant, and `index.rs`.
///
/// # Errors
/// The first shader that cannot be read or compiled.
pub fn compile_all(glsl: &Path) -> Result<Vec<(String, Vec<u8>)>, CompileError> {
    let read_error = |source| CompileError::Read { path: glsl.display().to_string(), source };
    let mut entries: Vec<String> = std::fs::read_dir(glsl)
        .map_err(read_error)?
        .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
        .filter(|name| [".comp", ".vert", ".frag"].iter().any(|ending| name.ends_with(ending)))
        .collect();
    entries.sort();

    let read = |file: &str| {
        let path = glsl.join(file);
        let failed = |source| CompileError::Read { path: path.display().to_string(), source };
        std::fs::read_to_string(&path).map_err(failed)
    };
    let mut files = Vec::new();
    for entry in entries {
        let text = expand_includes(&entry, &read)?;
        let variants: Vec<(String, Vec<&str>)> = if entry == "thermal_step.comp" {
            ThermalVariant::all().iter().map(|variant| (variant.name(), variant.defines())).collect()
        } else if entry == "response.comp" {
            ResponseVariant::all().iter().map(|variant| (variant.name(), variant.defines())).collect()
        } else if entry == "network_fused.comp" {
            FusedVariant::all().iter().map(|variant| (variant.name(), variant.defines())).collect()
        } else if WideVariant::all().iter().any(|variant| variant.entry() == entry) {
            let of_entry = WideVariant::all().into_iter().filter(|variant| variant.entry() == entry);
            of_entry.map(|variant| (variant.name(), variant.defines())).collect()
        } else if entry == "solar_rays.comp" {
            vec![("solar_rays.first".to_owned(), vec!["FIRST"]), ("solar_rays.next".to_owned(), Vec::new())]
        } else {
            vec![(entry.clone(), Vec::new())]
        };
        for (name, defines) in variants {
            let words = compile::compile(&name, &entry, &text, &defines)?;
            files.push((format!("{name}.spv"), words.iter().flat_map(|word| word.to_le_bytes()).collect()));
        }
    }
    files.sort();

    let mut index = String::from("// Written by tools/src/shaders.rs: name and SPIR-V of every module.\n&[\n");
    for (file, _) in &files {
        let name = file.trim_end_matches(".spv");
        writeln!(index, "    (\"{name}\", include_bytes!(\"{file}\")),").expect("a string takes any text");
    }
    index.push_str("]\n");
    files.push(("index.rs".to_owned(), index.into_bytes()));
    Ok(files)
}
