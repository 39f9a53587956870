//! Isotherm's half of `tools/peers`, which compares it with other programs. Prints JSON.

mod clock;
mod columns;
mod image;
mod network;
mod rayon_loop;
mod transition;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use isotherm::Target;
use isotherm::internals::Context;
use serde_json::{Value, json};

type AnyError = Box<dyn std::error::Error>;

/// Measure Isotherm for tools/peers, which runs this program; prints JSON.
///
/// Example: cargo run --release -p isotherm-tools --bin peers -- transition --nodes 1000000
#[derive(Parser)]
struct Arguments {
    /// Device whose name contains NAME
    #[arg(long, value_name = "NAME", global = true)]
    device: Option<String>,
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// The thermal pass of transitions and a hand-written rayon loop
    Transition {
        /// Numbers of nodes
        #[arg(long, value_delimiter = ',', default_values_t = [10_000, 100_000, 1_000_000, 10_000_000])]
        nodes: Vec<usize>,
        /// Steps of each measurement
        #[arg(long, default_value_t = 40)]
        steps: usize,
    },
    /// Heat conduction in columns of regolith, as a network
    Columns {
        /// The case, as tools/peer_bench/columns.py writes it
        case: PathBuf,
        /// File that receives the temperatures of the followed facets [K], f32
        #[arg(long)]
        output: PathBuf,
        /// Stages of RKL2, an odd number; 1: Euler
        #[arg(long)]
        stages: u32,
        /// Sub-steps a frame
        #[arg(long)]
        sub_steps: u32,
    },
    /// A thermal network, as `isotherm network` solves it
    Network {
        /// The network (TOML)
        file: PathBuf,
        /// File for the rows of temperatures [K], f64
        #[arg(long)]
        output: PathBuf,
        /// Target error [K]
        #[arg(long)]
        tolerance: f64,
        /// Number of timed solutions, after one that is not timed
        #[arg(long, default_value_t = 2)]
        runs: usize,
    },
    /// Images of a scene at time 0
    Image {
        /// The scene
        scene: PathBuf,
        /// Folder for the images and the triangles
        #[arg(long)]
        output: PathBuf,
        /// Factors on the width and height of the scene's image
        #[arg(long, value_delimiter = ',', default_values_t = [1])]
        scale: Vec<u32>,
        /// Images of each size
        #[arg(long, default_value_t = 10)]
        frames: usize,
    },
}

fn main() -> ExitCode {
    match measure(&Arguments::parse()) {
        Ok(measured) => {
            println!("{measured}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &Arguments) -> Result<Value, AnyError> {
    let context = Context::open(arguments.device.as_deref(), false)?;
    let mut measured = match &arguments.what {
        What::Transition { nodes, steps } => transition::measure(&context, nodes, *steps)?,
        What::Columns { case, output, stages, sub_steps } => columns::measure(case, output, *stages, *sub_steps)?,
        What::Network { file, output, tolerance, runs } => network::measure(file, output, *tolerance, *runs)?,
        What::Image { scene, output, scale, frames } => image::measure(&context, scene, output, scale, *frames)?,
    };
    let on_device = !matches!(arguments.what, What::Columns { .. } | What::Network { .. });
    measured["device"] = if on_device { json!(context.info.name) } else { json!(Target::Reference.name()) };
    measured["driver"] = json!(context.info.driver);
    Ok(measured)
}

/// Sums of differences from a reference.
#[derive(Debug, Clone, Copy, Default)]
struct Differences {
    squares: f64,
    count: f64,
    largest: f64,
}

impl Differences {
    fn add(&mut self, values: impl Iterator<Item = f64>, exact: &[f64]) {
        for (value, exact) in values.zip(exact) {
            let difference = (value - exact).abs();
            self.squares += difference * difference;
            self.count += 1.0;
            // A NaN counts as infinite.
            self.largest = if difference.is_nan() { f64::INFINITY } else { self.largest.max(difference) };
        }
    }

    fn json(self) -> Value {
        json!({ "rms": (self.squares / self.count).sqrt(), "max": self.largest })
    }
}
