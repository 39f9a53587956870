//! Images a second of `isotherm::Simulation` from poses on a circle round the craft, without Python and without files.
//!
//! `python/tests/measure.py` runs it beside the same loop in Python.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use glam::DVec3;
use isotherm::{CameraFrame, Pose, Simulation, Target};

/// Draw images of a scene at time 0 and print how many a second.
#[derive(Parser)]
struct Arguments {
    /// Scene file
    scene: PathBuf,
    /// Number of images
    #[arg(long, default_value_t = 10_000)]
    images: u32,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut simulation = Simulation::load(&arguments.scene, &Target::open(None)?)?;
    let camera = simulation.camera()?.clone();
    let mut draw = |number: u32| {
        let angle = TAU * f64::from(number) / 500.0;
        let position = DVec3::new(2.5 * angle.cos(), 2.5 * angle.sin(), -1.5);
        let pose = Pose::look_at(CameraFrame::Body, position, DVec3::ZERO, DVec3::NEG_Z)?;
        Ok::<_, Box<dyn Error>>(simulation.image(&camera, &pose)?.part.iter().any(|part| *part != 0))
    };
    for number in 0..50 {
        draw(number)?;
    }
    let began = Instant::now();
    let mut seen = true;
    for number in 0..arguments.images {
        seen &= draw(number)?;
    }
    let rate = f64::from(arguments.images) / began.elapsed().as_secs_f64();
    println!("{rate:.1}");
    if !seen {
        return Err("an image does not show the craft".into());
    }
    Ok(())
}
