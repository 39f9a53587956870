//! Steps without outputs, many in one dispatch.

use super::super::error::GpuError;
use super::super::frame::{Frame, Wanted};
use super::super::layout::FUSED_STEPS;
use super::super::load::DeviceLoad;
use super::super::pass::Entry;
use super::ranges::{fused, ranges_of_load, ranges_of_step};
use super::{Renderer, Request, Submitted};
use crate::environment::StepLoad;

impl Renderer {
    /// Takes steps without outputs, each with a load and a duration in steps. A dispatch takes up to 32 steps with the
    /// same kinds of light, and ends before shadows need an update. Nodes of thermal networks do not change.
    /// A call that fails.
    pub fn forward(&mut self, steps: &[(&StepLoad, f64)]) -> Result<(), GpuError> {
        let mut rest = steps;
        while !rest.is_empty() {
            let (now, later) = rest.split_at(self.at_once(rest));
            rest = later;
            // The slot may only be written after its last submission is complete.
            let _ = match now {
                [(load, length)] => self.submit(Request::step(load, *length))?,
                many => self.submit_fused(many)?,
            };
        }
        Ok(())
    }

    /// Number of steps in fused dispatches so far.
    pub fn fused_steps(&self) -> u64 {
        self.fused_steps
    }

    /// Number of steps that the next dispatch takes.
    fn at_once(&self, steps: &[(&StepLoad, f64)]) -> usize {
        let first = steps[0].0;
        // With an unchanged load, single steps are cheaper.
        if !self.fuses || self.commanded == Some(DeviceLoad::new(first, self.joints)) {
            return 1;
        }
        let shadows_hold = self.shadows.hold(first);
        let like_first = |(load, _): &&(&StepLoad, f64)| {
            let alike = load.sun.is_empty() == first.sun.is_empty() && load.albedo.is_some() == first.albedo.is_some();
            alike && shadows_hold(load)
        };
        1 + steps[1..].iter().take(FUSED_STEPS - 1).take_while(like_first).count()
    }

    fn submit_fused(&mut self, steps: &[(&StepLoad, f64)]) -> Result<Submitted, GpuError> {
        self.bind_fused()?;
        let (first, last) = (steps[0].0, steps[steps.len() - 1]);
        let ranges = fused(&ranges_of_load(&self.ranges, first));
        let mut stepped = Frame::step(&ranges, Wanted::default());
        for entry in &mut stepped.entries {
            if let Entry::Pass(pass) = entry {
                // Timestamps of many steps get another name.
                pass.name = format!("forward {}", pass.name);
            }
        }
        let frame = self.shadows(first)?.then(stepped);
        let loads: Vec<(DeviceLoad, f64)> =
            steps.iter().map(|(load, length)| (DeviceLoad::new(load, self.joints), *length)).collect();
        let slot = self.slots.free()?;
        DeviceLoad::write_fused(&loads, &mut self.resources, slot)?;
        self.fused_steps += steps.len() as u64;
        self.commanded = loads.into_iter().next_back().map(|(load, _)| load);
        self.send(&frame, Request::step(last.0, last.1))
    }

    /// Makes the pipelines of fused dispatches at first use, because most runs do not need them.
    fn bind_fused(&mut self) -> Result<(), GpuError> {
        let loads = [(true, true), (true, false), (false, false)];
        let frames = loads.map(|(has_sun, has_albedo)| {
            Frame::step(&fused(&ranges_of_step(&self.ranges, has_sun, has_albedo)), Wanted::default())
        });
        self.bindings.add(&self.resources, frames.iter().flat_map(Frame::passes))
    }
}
