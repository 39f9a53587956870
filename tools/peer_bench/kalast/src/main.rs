//! kalast's thermophysical model on its own GPU context, headless: the same columns as `peers columns`, first for their
//! temperatures, then for the time. Prints JSON.
//!
//! peer-kalast CASE.json OUTPUT.f32
//!
//! kalast steps explicitly (forward Euler) with the surface balanced by Newton's method; a step is one call of its public
//! `GpuTpm::step_sun`, which computes the sunlight on the device too. kalast has no timestamps: times are the host's
//! and of the processors.

#[path = "../../../src/peers/clock.rs"]
mod clock;
// kalast's own files, as README.md beside them says.
#[allow(dead_code)]
mod gpu;
#[allow(dead_code)]
mod tpm;

use std::error::Error;
use std::f64::consts::{PI, TAU};

use clock::Clock;
use gpu::Context;
use serde_json::{Value, json};
use tpm::gpu::GpuTpm;

/// W m-2 K-4, CODATA 2018.
const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;
/// One astronomical unit [m].
const AU: f64 = 149_597_870_700.0;
/// Newton's method at the surface: [K] and iterations, kalast's own defaults.
const NEWTON: (f32, u32) = (0.1, 100);

struct Case {
    facets: usize,
    nodes: usize,
    spacing: f64,
    conductivity: f64,
    heat_capacity: f64,
    emissivity: f64,
    absorbed: f64,
    start: f64,
    frames: usize,
    frame_s: f64,
    sub_steps: usize,
    followed: Vec<usize>,
    runs: usize,
}

impl Case {
    fn read(path: &str) -> Result<Self, Box<dyn Error>> {
        let value: Value = serde_json::from_str(&std::fs::read_to_string(path)?)?;
        let number = |key: &str| value[key].as_f64().ok_or(format!("{path}: {key} is no number"));
        let count = |key: &str| number(key).map(|number| number as usize);
        let followed = value["followed"].as_array().ok_or(format!("{path}: followed is no list"))?;
        Ok(Self {
            facets: count("facets")?,
            nodes: count("nodes")?,
            spacing: number("spacing")?,
            conductivity: number("conductivity")?,
            heat_capacity: number("heat_capacity")?,
            emissivity: number("emissivity")?,
            absorbed: number("absorbed")?,
            start: number("start")?,
            frames: count("frames")?,
            frame_s: number("frame_s")?,
            sub_steps: count("sub_steps")?,
            followed: followed.iter().filter_map(Value::as_u64).map(|facet| facet as usize).collect(),
            runs: count("runs")?,
        })
    }

    fn step(&self) -> f64 {
        self.frame_s / self.sub_steps as f64
    }

    /// Facets on a sphere (a Fibonacci lattice); only their normals matter.
    fn normals(&self) -> Vec<f32> {
        let normal = |facet: usize| {
            let z = 1.0 - (2.0 * facet as f64 + 1.0) / self.facets as f64;
            let longitude = facet as f64 * PI * (3.0 - 5.0_f64.sqrt());
            let radius = (1.0 - z * z).sqrt();
            [radius * longitude.cos(), radius * longitude.sin(), z].map(|x| x as f32)
        };
        (0..self.facets).flat_map(normal).collect()
    }

    fn model(&self) -> Result<GpuTpm, Box<dyn Error>> {
        let factor = (self.step() / (self.spacing * self.spacing)) as f32;
        let inner = vec![factor; self.nodes - 2];
        let diffusivity = vec![(self.conductivity / self.heat_capacity) as f32; self.nodes];
        let mut model = GpuTpm::new(
            Context::new()?,
            self.facets as u32,
            &inner,
            &inner,
            &diffusivity,
            (self.emissivity * STEFAN_BOLTZMANN) as f32,
            self.conductivity as f32,
            (2.0 * self.spacing) as f32,
            NEWTON.0,
            NEWTON.1,
        )?;
        model.set_geometry(&vec![0.0; 3 * self.facets], &self.normals())?;
        Ok(model)
    }

    fn frame(&self, model: &mut GpuTpm, frame: usize) -> Result<(), String> {
        let turn = TAU * (frame as f64 + 0.5) / self.frames as f64;
        let sun = [AU * turn.cos(), AU * turn.sin(), 0.0].map(|x| x as f32);
        (0..self.sub_steps).try_for_each(|_| model.step_sun(sun, self.absorbed as f32, AU as f32))
    }
}

fn wait(model: &GpuTpm) -> Result<(), Box<dyn Error>> {
    model.context().device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None })?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, case, output] = arguments.as_slice() else {
        return Err("usage: peer-kalast CASE.json OUTPUT.f32".into());
    };
    let case = Case::read(case)?;
    let mut model = case.model()?;
    let start = vec![case.start as f32; case.facets * case.nodes];
    model.upload(&start)?;

    let mut kept = Vec::new();
    for frame in 0..case.frames {
        case.frame(&mut model, frame)?;
        let temperatures = model.download();
        for facet in &case.followed {
            let column = &temperatures[facet * case.nodes..][..case.nodes];
            kept.extend(column.iter().flat_map(|kelvin| kelvin.to_le_bytes()));
        }
    }
    std::fs::write(output, kept)?;

    let mut clocks = Vec::new();
    for _ in 0..case.runs {
        model.upload(&start)?;
        wait(&model)?;
        let clock = Clock::start();
        for frame in 0..case.frames {
            case.frame(&mut model, frame)?;
        }
        wait(&model)?;
        clocks.push(clock.stop());
    }
    let info = model.context().device.adapter_info();
    let node_steps = (case.facets * case.nodes * case.frames * case.sub_steps) as u64;
    println!(
        "{}",
        json!({
            "device": info.name, "driver": info.driver_info, "backend": format!("{:?}", info.backend),
            "node_steps": node_steps, "sub_step_s": case.step(), "clock_ms": clocks,
        })
    );
    Ok(())
}
