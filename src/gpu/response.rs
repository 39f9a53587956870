//! Response of nodes to given targets, computed on the device with the transition of the thermal step.

use std::sync::Arc;

use super::bindings::Bindings;
use super::context::Context;
use super::effects::thermal::{ELAPSED, MATERIALS, SHAPES, SPAN, TARGET};
use super::error::GpuError;
use super::layout;
use super::lists::{self, RESPONSE_STEPS, RESPONSE_TARGETS, RESPONSE_TEMPERATURES};
use super::once::Once;
use super::pass::Frame;
use super::shapes::{Shapes, curve};
use super::store::Resources;
use crate::thermal::material::Transition;

/// Nodes of a workgroup: 64 invocations of four.
const NODES: usize = 256;
/// Steps of a dispatch, few enough that no driver stops it as hanging.
const STEPS: usize = 128;

/// A node at rest, and its targets.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseRun {
    /// Temperature at step 0 [K].
    pub initial: f32,
    /// Target of each step, from step 1 [K].
    pub targets: Vec<f32>,
}

/// Temperatures of every run [K] at the steps from 1, as many as the run has targets.
pub fn respond(
    context: &Arc<Context>,
    transition: &Transition,
    runs: &[ResponseRun],
) -> Result<Vec<Vec<f32>>, GpuError> {
    let steps = runs.iter().map(|run| run.targets.len()).max().unwrap_or(0);
    let nodes = runs.len().next_multiple_of(NODES);
    let mut device = Device::new(context, transition, runs, nodes)?;
    let mut temperatures: Vec<Vec<f32>> = runs.iter().map(|run| Vec::with_capacity(run.targets.len())).collect();
    for first in (0..steps).step_by(STEPS) {
        let count = STEPS.min(steps - first);
        let mut commanded = vec![0.0f32; count * nodes];
        for (node, run) in runs.iter().enumerate() {
            // A run that has ended keeps its last target.
            let last = run.targets.last().copied().unwrap_or(run.initial);
            for step in 0..count {
                commanded[step * nodes + node] = run.targets.get(first + step).copied().unwrap_or(last);
            }
        }
        let found = device.steps(&commanded, count, nodes)?;
        for (node, run) in runs.iter().enumerate() {
            let taken = count.min(run.targets.len().saturating_sub(first));
            temperatures[node].extend((0..taken).map(|step| found[step * nodes + node]));
        }
    }
    Ok(temperatures)
}

/// The nodes on the device. Fields are dropped in order.
struct Device {
    once: Once,
    bindings: Bindings,
    resources: Resources,
    list: Frame,
}

impl Device {
    fn new(
        context: &Arc<Context>,
        transition: &Transition,
        runs: &[ResponseRun],
        nodes: usize,
    ) -> Result<Self, GpuError> {
        let shapes = Shapes::one(transition);
        let (kind, curve) = curve(transition);
        let mut material: layout::Material = bytemuck::Zeroable::zeroed();
        material.set_transition(transition, &shapes);
        let mut at_rest: Vec<f32> = runs.iter().map(|run| run.initial).collect();
        at_rest.resize(nodes, 0.0);
        let zeros = vec![0.0f32; nodes];

        let mut once = Once::new(context)?;
        let mut resources = Resources::new(context);
        resources.make_of(&RESPONSE_STEPS, 1)?;
        resources.make_of(&RESPONSE_TARGETS, STEPS * nodes)?;
        resources.make_of(&RESPONSE_TEMPERATURES, STEPS * nodes)?;
        resources.make_of(&MATERIALS, 1)?;
        resources.upload(&mut once, &MATERIALS, &[material])?;
        for (resource, values) in [(&TARGET, &at_rest), (&SPAN, &zeros), (&ELAPSED, &zeros)] {
            resources.make(resource, 4 * nodes as u64)?;
            resources.upload(&mut once, resource, values)?;
        }
        if !shapes.values.is_empty() {
            resources.make_of(&SHAPES, shapes.values.len())?;
            resources.upload(&mut once, &SHAPES, &shapes.values)?;
        }
        resources.free_staging();
        let list = lists::respond(kind, curve, (nodes / NODES) as u32);
        let mut bindings = Bindings::new(context, 1, 1);
        bindings.add(&resources, list.passes())?;
        Ok(Self { once, bindings, resources, list })
    }

    /// Takes `count` steps and waits. Targets and temperatures are ordered by step.
    fn steps(&mut self, commanded: &[f32], count: usize, nodes: usize) -> Result<&[f32], GpuError> {
        let steps = layout::Steps { count: count as u32, groups: (nodes / 4) as u32 };
        self.resources.write(&RESPONSE_STEPS, 0, &[steps])?;
        self.resources.write(&RESPONSE_TARGETS, 0, commanded)?;
        self.once.run([&self.list], &self.resources, Some(&self.bindings))?;
        Ok(self.resources.read(&RESPONSE_TEMPERATURES, 0, count * nodes))
    }
}
