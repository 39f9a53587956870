//! Columns of regolith under a moving Sun as a thermal network in f64 on the processor. kalast's conduction step does the same
//! work.
//!
//! A column of 1 m2 has a node every `spacing` [m] from the surface down. The first and last node are half a cell. The
//! heat of the surface is constant over a frame.

use std::f64::consts::TAU;
use std::path::Path;

use serde::Deserialize;
use serde_json::{Value, json};

use isotherm::internals::{LinearConductor, Network, NodeKind, ReferenceStepper, StepMethod};

use super::AnyError;
use super::clock::Clock;

/// The input of both programs.
#[derive(Debug, Deserialize)]
struct Case {
    facets: usize,
    /// Nodes of a column.
    nodes: usize,
    spacing: f64,
    conductivity: f64,
    /// Density x specific heat [J m-3 K-1].
    heat_capacity: f64,
    emissivity: f64,
    /// Sunlight that a facet absorbs with the Sun overhead [W/m2].
    absorbed: f64,
    /// Temperature at the start [K].
    start: f64,
    /// Frames of one rotation.
    frames: usize,
    frame_s: f64,
    /// Facets whose temperatures are stored.
    followed: Vec<usize>,
    /// Number of timed rotations.
    runs: usize,
}

impl Case {
    /// Heat of every node in a frame [W]. The Sun is over the equator of the facets' sphere (a Fibonacci lattice).
    fn heat(&self, frame: usize) -> Vec<f64> {
        let turn = TAU * (frame as f64 + 0.5) / self.frames as f64;
        let mut heat = vec![0.0; self.facets * self.nodes];
        for facet in 0..self.facets {
            let z = 1.0 - (2.0 * facet as f64 + 1.0) / self.facets as f64;
            let longitude = facet as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
            let cosine = (1.0 - z * z).sqrt() * (longitude - turn).cos();
            heat[facet * self.nodes] = self.absorbed * cosine.max(0.0);
        }
        heat
    }

    fn network(&self) -> Network {
        let size = self.facets * self.nodes;
        let last = self.nodes - 1;
        let share = |node: usize| if node.is_multiple_of(self.nodes) || node % self.nodes == last { 0.5 } else { 1.0 };
        let conductance = self.conductivity / self.spacing;
        let inner = (0..size).filter(|node| node % self.nodes != last);
        Network {
            // kalast's surfaces radiate to 0 K.
            space_temperature: 0.0,
            kinds: vec![NodeKind::Diffusive; size],
            capacitances: (0..size).map(|node| share(node) * self.heat_capacity * self.spacing).collect(),
            emissive_areas: (0..size)
                .map(|node| if node.is_multiple_of(self.nodes) { self.emissivity } else { 0.0 })
                .collect(),
            temperatures: vec![self.start; size],
            linear: inner.map(|node| LinearConductor { nodes: [node as u32, node as u32 + 1], conductance }).collect(),
            radiative: Vec::new(),
        }
    }
}

/// Runs one rotation for the temperatures, then `runs` rotations for the time. `stages` 1 means Euler.
pub fn measure(case: &Path, output: &Path, stages: u32, sub_steps: u32) -> Result<Value, AnyError> {
    let case: Case = serde_json::from_str(&std::fs::read_to_string(case)?)?;
    let method = if stages == 1 { StepMethod::Euler } else { StepMethod::Rkl2 { stages } };
    let network = case.network();
    let mut stepper = ReferenceStepper::new(network.clone(), &[]);
    let heat: Vec<Vec<f64>> = (0..case.frames).map(|frame| case.heat(frame)).collect();
    let slope = vec![0.0; network.len()];
    let step = case.frame_s / f64::from(sub_steps);

    let mut kept = Vec::new();
    for heat in &heat {
        frame(&mut stepper, method, heat, &slope, step, sub_steps)?;
        let temperatures = stepper.temperatures();
        for facet in &case.followed {
            let column = &temperatures[facet * case.nodes..][..case.nodes];
            kept.extend(column.iter().flat_map(|kelvin| (*kelvin as f32).to_le_bytes()));
        }
    }
    std::fs::write(output, kept)?;

    let mut clocks = Vec::new();
    for _ in 0..case.runs {
        stepper.set_temperatures(&network.temperatures);
        let clock = Clock::start();
        for heat in &heat {
            frame(&mut stepper, method, heat, &slope, step, sub_steps)?;
        }
        clocks.push(clock.stop());
    }
    let node_steps = network.len() as u64 * case.frames as u64 * u64::from(sub_steps * stages);
    Ok(json!({
        "method": method.to_string(), "nodes": network.len(), "node_steps": node_steps, "sub_step_s": step,
        "clock_ms": clocks,
    }))
}

fn frame(
    stepper: &mut ReferenceStepper,
    method: StepMethod,
    heat: &[f64],
    slope: &[f64],
    step: f64,
    sub_steps: u32,
) -> Result<(), AnyError> {
    stepper.set_heat(heat, slope);
    let attempt = stepper.attempt(method, 0.0, step, sub_steps);
    if attempt.error.is_infinite() {
        return Err("the step is not stable: a temperature left its range".into());
    }
    stepper.keep();
    Ok(())
}
