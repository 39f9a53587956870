//! The shader compiler: compiles every entry point of `glsl/` in its plainest variant to `spirv/`.

use std::path::PathBuf;

use clap::Parser;
use isotherm::internals::{ENTRY_POINTS, Shader};

/// Compile the entry points of glsl/ to spirv/.
///
/// Example: cargo run -p isotherm-tools --bin shaders
#[derive(Parser)]
struct Arguments {
    /// Folder that receives the SPIR-V
    #[arg(long, default_value = "spirv")]
    spirv: PathBuf,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = Arguments::parse();
    for (entry, _) in ENTRY_POINTS {
        let words = Shader::new(entry, Vec::new()).compile()?;
        let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        std::fs::write(arguments.spirv.join(format!("{entry}.spv")), bytes)?;
    }
    println!("{} files written to {}", ENTRY_POINTS.len(), arguments.spirv.display());
    Ok(())
}
