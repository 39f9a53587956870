//! The shader compiler: every entry point of `glsl/` and its variants to `spirv/`, with an index for the crate.

use std::path::{Path, PathBuf};

use clap::Parser;
use isotherm_tools::compile_all;

/// Compile glsl/ to spirv/.
///
/// Example: cargo run -p isotherm-tools --bin shaders
#[derive(Parser)]
struct Arguments {
    /// Folder with the GLSL entry points.
    #[arg(long, default_value = "glsl")]
    glsl: PathBuf,
    /// Folder that receives the SPIR-V and index.rs.
    #[arg(long, default_value = "spirv")]
    spirv: PathBuf,
}

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    match write(&arguments.glsl, &arguments.spirv) {
        Ok(count) => {
            println!("{count} files written to {}", arguments.spirv.display());
            std::process::ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn write(glsl: &Path, spirv: &Path) -> Result<usize, Box<dyn std::error::Error>> {
    let files = compile_all(glsl)?;
    for entry in std::fs::read_dir(spirv)? {
        std::fs::remove_file(entry?.path())?;
    }
    for (name, bytes) in &files {
        std::fs::write(spirv.join(name), bytes)?;
    }
    Ok(files.len())
}
