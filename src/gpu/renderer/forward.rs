//! Steps without outputs, many in one dispatch.

use super::Renderer;
use crate::environment::StepLoad;
use crate::gpu::effects::thermal::load::DeviceLoad;
use crate::gpu::error::GpuError;
use crate::gpu::layout::FUSED_STEPS;
use crate::gpu::request::{Request, Submitted};
use crate::trace::timed;

impl Renderer {
    /// Takes steps without outputs, each with a load and a duration in steps. A dispatch takes up to 32 steps with the
    /// same kinds of light, and ends before light is found anew. Nodes of thermal networks do not change.
    ///
    /// # Errors
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
    pub(crate) fn fused_steps(&self) -> u64 {
        self.fused_steps
    }

    /// Number of steps that the next dispatch takes.
    fn at_once(&self, steps: &[(&StepLoad, f64)]) -> usize {
        let first = steps[0].0;
        // With an unchanged load, single steps are cheaper.
        if !self.fuses || self.scene.commanded == Some(DeviceLoad::new(first, self.scene.joints)) {
            return 1;
        }
        let mut redraw = self.scene.light.as_ref().map(|light| light.redraw.clone());
        if let Some(redraw) = &mut redraw {
            redraw.due(first);
        }
        let light_holds = |load: &StepLoad| redraw.as_ref().is_none_or(|redraw| redraw.holds(load));
        let like_first = |(load, _): &&(&StepLoad, f64)| {
            let alike = load.sun.is_empty() == first.sun.is_empty() && load.albedo.is_some() == first.albedo.is_some();
            alike && light_holds(load)
        };
        1 + steps[1..].iter().take(FUSED_STEPS - 1).take_while(like_first).count()
    }

    fn submit_fused(&mut self, steps: &[(&StepLoad, f64)]) -> Result<Submitted, GpuError> {
        let (first, last) = (steps[0].0, steps[steps.len() - 1]);
        self.renew_light(first)?;
        let frame = self.scene.fused(first);
        let pack = |(load, length): &(&StepLoad, f64)| (DeviceLoad::new(load, self.scene.joints), *length);
        let loads: Vec<_> = timed("writing for the device", || steps.iter().map(pack).collect());
        let slot = self.slots.free()?;
        timed("writing for the device", || DeviceLoad::write_fused(&loads, &mut self.resources, slot))?;
        self.fused_steps += steps.len() as u64;
        self.scene.commanded = loads.into_iter().next_back().map(|(load, _)| load);
        self.send(&frame, Request::step(last.0, last.1))
    }
}
