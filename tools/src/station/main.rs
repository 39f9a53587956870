//! Writes `models/station.glb`: an articulated station of ISS size and original design, with thermal materials by name.

mod glb;
mod layout;
mod material;
mod mesh;
mod modules;
mod panels;
#[cfg(test)]
mod tests;
mod truss;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

/// Generate the station model; the same bytes on every run.
///
/// Example: cargo run -p isotherm-tools --bin station -- -o models/station.glb
#[derive(Parser)]
struct Arguments {
    /// File to write
    #[arg(short, long, default_value = "models/station.glb")]
    output: PathBuf,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let station = layout::station();
    let bytes = glb::write(&station);
    if let Err(error) = std::fs::write(&arguments.output, &bytes) {
        eprintln!("station: cannot write {}: {error}", arguments.output.display());
        return ExitCode::from(2);
    }
    let (path, kilobytes) = (arguments.output.display(), bytes.len() / 1000);
    println!("{path}: {} triangles drawn, {kilobytes} kB", layout::triangles_drawn(&station));
    ExitCode::SUCCESS
}
