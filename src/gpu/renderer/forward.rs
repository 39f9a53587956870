//! Ticks that leave nothing but the nodes' state, many in one dispatch.

use super::super::bindings::Bindings;
use super::super::error::GpuError;
use super::super::frame::{Frame, StepRange, Wanted};
use super::super::load::{DeviceLoad, FUSED_TICKS};
use super::super::pass::Step;
use super::super::variant::ThermalVariant;
use super::{Renderer, ranges_of_load, ranges_of_tick};
use crate::environment::TickLoad;

impl Renderer {
    /// Lets ticks pass, each a load and a number of steps, that leave nothing but the nodes' state: as many in one dispatch
    /// as are lit alike, up to 32, until shadows must be found anew. Nodes that the host steps are left as they are.
    ///
    /// # Errors
    /// A call that fails.
    pub fn forward(&mut self, ticks: &[(&TickLoad, f64)]) -> Result<(), GpuError> {
        let mut rest = ticks;
        while !rest.is_empty() {
            let (now, later) = rest.split_at(self.at_once(rest));
            rest = later;
            // A slot that is submitted anew waits for what it was submitted with.
            let _ = match now {
                [one] => self.submit(Some(*one), None, false)?,
                many => self.submit_fused(many)?,
            };
        }
        Ok(())
    }

    /// Ticks that passed in dispatches of many.
    pub fn fused_ticks(&self) -> u64 {
        self.fused_ticks
    }

    /// How many of the ticks the next dispatch takes.
    fn at_once(&self, ticks: &[(&TickLoad, f64)]) -> usize {
        let first = ticks[0].0;
        // Under the load that commanded them last, nodes have less to do one tick at a time.
        if !self.fuses || self.commanded == Some(DeviceLoad::new(first, self.joints)) {
            return 1;
        }
        let mut redraw = self.redraw.clone();
        if let Some(redraw) = &mut redraw {
            redraw.view(first);
        }
        let like_first = |(load, _): &&(&TickLoad, f64)| {
            let alike = load.sun.is_empty() == first.sun.is_empty() && load.albedo.is_some() == first.albedo.is_some();
            alike && redraw.as_ref().is_none_or(|redraw| redraw.holds(load))
        };
        1 + ticks[1..].iter().take(FUSED_TICKS - 1).take_while(like_first).count()
    }

    fn submit_fused(&mut self, ticks: &[(&TickLoad, f64)]) -> Result<super::Submitted, GpuError> {
        self.bind_fused()?;
        let (first, last) = (ticks[0].0, ticks[ticks.len() - 1]);
        let ranges = fused(&ranges_of_load(&self.ranges, first));
        let mut stepped = Frame::step(&ranges, Wanted::default());
        for step in &mut stepped.steps {
            if let Step::Pass(pass) = step {
                // Its time is that of many ticks.
                pass.name = format!("forward {}", pass.name);
            }
        }
        let frame = self.shadows(first)?.then(stepped);
        let loads: Vec<(DeviceLoad, f64)> =
            ticks.iter().map(|(load, steps)| (DeviceLoad::new(load, self.joints), *steps)).collect();
        self.finish(self.next)?;
        DeviceLoad::write_fused(&loads, &mut self.resources, self.next);
        self.fused_ticks += ticks.len() as u64;
        self.commanded = loads.into_iter().next_back().map(|(load, _)| load);
        self.submit_views_frame(&frame, Some(last), None, Wanted::default())
    }

    /// Makes the pipelines of many ticks when they are first needed: most runs have no use for them.
    fn bind_fused(&mut self) -> Result<(), GpuError> {
        if self.fused.is_some() {
            return Ok(());
        }
        let loads = [(true, true), (true, false), (false, false)];
        let frames = loads.map(|(has_sun, has_albedo)| {
            let mut frame = Frame::step(&fused(&ranges_of_tick(&self.ranges, has_sun, has_albedo)), Wanted::default());
            frame.steps.retain(|step| matches!(step, Step::Pass(pass) if pass.is_fused()));
            frame
        });
        self.fused = Some(Bindings::new(&self.context, &self.resources, &frames.each_ref(), self.joints)?);
        Ok(())
    }
}

/// The ranges with many ticks in a dispatch; what keeps no state is left by the last of them alone.
fn fused(ranges: &[StepRange]) -> Vec<StepRange> {
    let variant = |variant: ThermalVariant| variant.fused().unwrap_or(variant);
    ranges.iter().map(|range| StepRange { variant: variant(range.variant), ..*range }).collect()
}
