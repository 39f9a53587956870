//! Steps that leave nothing but the nodes' state, many in one dispatch.

use super::super::error::GpuError;
use super::super::frame::{Frame, StepRange, Wanted};
use super::super::layout::FUSED_STEPS;
use super::super::load::DeviceLoad;
use super::super::pass::Entry;
use super::super::variant::ThermalVariant;
use super::{Renderer, Request, Submitted, ranges_of_load, ranges_of_step};
use crate::environment::StepLoad;

impl Renderer {
    /// Lets steps pass, each a load and a number of steps, that leave nothing but the nodes' state: as many in one dispatch
    /// as are lit alike, up to 32, until shadows must be found anew. Nodes that the host steps are left as they are.
    ///
    /// # Errors
    /// A call that fails.
    pub fn forward(&mut self, steps: &[(&StepLoad, f64)]) -> Result<(), GpuError> {
        let mut rest = steps;
        while !rest.is_empty() {
            let (now, later) = rest.split_at(self.at_once(rest));
            rest = later;
            // A slot that is submitted anew waits for what it was submitted with.
            let _ = match now {
                [(load, length)] => self.submit(Request::step(load, *length))?,
                many => self.submit_fused(many)?,
            };
        }
        Ok(())
    }

    /// Steps that passed in dispatches of many.
    pub fn fused_steps(&self) -> u64 {
        self.fused_steps
    }

    /// How many of the steps the next dispatch takes.
    fn at_once(&self, steps: &[(&StepLoad, f64)]) -> usize {
        let first = steps[0].0;
        // Under the load that commanded them last, nodes have less to do one step at a time.
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
                // Its time is that of many steps.
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

    /// Makes the pipelines of many steps when they are first needed: most runs have no use for them.
    fn bind_fused(&mut self) -> Result<(), GpuError> {
        let loads = [(true, true), (true, false), (false, false)];
        let frames = loads.map(|(has_sun, has_albedo)| {
            Frame::step(&fused(&ranges_of_step(&self.ranges, has_sun, has_albedo)), Wanted::default())
        });
        self.bindings.add(&self.resources, frames.iter().flat_map(Frame::passes))
    }
}

/// The ranges with many steps in a dispatch; what keeps no state is left by the last of them alone.
fn fused(ranges: &[StepRange]) -> Vec<StepRange> {
    let variant = |variant: ThermalVariant| variant.fused().unwrap_or(variant);
    ranges.iter().map(|range| StepRange { variant: variant(range.variant), ..*range }).collect()
}
