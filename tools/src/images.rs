//! Images a second of `isotherm::Simulation` from poses on a circle round the craft, without Python and without files.
//!
//! `python/tests/measure.py` runs it beside the same loop in Python. The host's part of an image is the processor time of the thread that asks for it: a software
//! driver draws on threads of its own.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Instant;

use clap::Parser;
use glam::DVec3;
use isotherm::{CameraFrame, Pose, Reach, Scene, Simulation, Target};

/// Draw images of a scene at time 0. Prints how many a second, and on stderr the processor time of an image on this thread.
#[derive(Parser)]
struct Arguments {
    /// Scene file
    scene: PathBuf,
    /// Number of images
    #[arg(long, default_value_t = 10_000)]
    images: u32,
    /// Radius of the circle [m]
    #[arg(long, default_value_t = 2.5)]
    radius: f64,
    /// Device whose name contains NAME
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

/// Processor time of this thread so far [ms] (first number of `/proc/thread-self/schedstat` [ns]). NaN where the system does not tell it.
fn thread_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|first| first.parse::<f64>().ok()).map_or(f64::NAN, |ns| ns * 1e-6)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let scene = Scene::load_within(&arguments.scene, Reach::Anywhere)?;
    let mut simulation = Simulation::from_scene(scene, &Target::open(arguments.device.as_deref())?)?;
    let camera = simulation.camera()?.clone();
    let mut draw = |number: u32| {
        let angle = TAU * f64::from(number) / 500.0;
        let position = arguments.radius * DVec3::new(angle.cos(), angle.sin(), -0.6);
        let pose = Pose::look_at(CameraFrame::Body, position, DVec3::ZERO, DVec3::NEG_Z)?;
        Ok::<_, Box<dyn Error>>(simulation.image(&camera, &pose)?.part.iter().any(|part| *part != 0))
    };
    for number in 0..50 {
        draw(number)?;
    }
    let (began, before) = (Instant::now(), thread_ms());
    let mut seen = true;
    for number in 0..arguments.images {
        seen &= draw(number)?;
    }
    let rate = f64::from(arguments.images) / began.elapsed().as_secs_f64();
    println!("{rate:.1}");
    eprintln!("{:.3} ms of this thread an image", (thread_ms() - before) / f64::from(arguments.images));
    if !seen {
        return Err("an image does not show the craft".into());
    }
    Ok(())
}
