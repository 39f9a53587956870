//! Frames of a device under way, and the results of steps that they become.

use std::collections::VecDeque;

use crate::gpu::effects::heat::tables::{HeatOf, HeatTables};
use crate::gpu::error::GpuError;
use crate::gpu::renderer::{Renderer, Submitted};
use crate::simulation::engine::{Delivered, Pixels};

/// What the fourth value of a pixel is, after radiance, temperature and depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fourth {
    /// Nothing that is an output.
    Nothing,
    /// Share of the samples that show a surface.
    Coverage,
    /// Reflected radiance.
    Reflected,
}

/// A frame under way.
pub(super) struct Flying {
    pub(crate) submitted: Submitted,
    /// Heat that each run of network nodes absorbs in the step [W], where the host steps the network.
    pub(crate) heat: Option<Vec<f64>>,
}

/// Frames under way, and the results of those that ended before somebody asked for them.
pub(super) struct Frames {
    flying: VecDeque<Flying>,
    ready: VecDeque<Delivered>,
    /// Runs of nodes whose absorbed heat is summed.
    pub(crate) tables: Option<HeatTables>,
}

impl Frames {
    /// No frame yet.
    pub(crate) fn new(tables: Option<HeatTables>) -> Self {
        Self { flying: VecDeque::new(), ready: VecDeque::new(), tables }
    }

    /// Takes a frame that was submitted.
    pub(crate) fn push(&mut self, frame: Flying) {
        self.flying.push_back(frame);
    }

    /// Waits for all frames under way, because the host needs the device. `fourth` says what the fourth value of a pixel is.
    pub(crate) fn end(&mut self, renderer: &mut Renderer, fourth: Fourth) -> Result<(), GpuError> {
        while let Some(flying) = self.flying.pop_front() {
            let delivered = self.collect(renderer, flying, fourth)?;
            self.ready.push_back(delivered);
        }
        Ok(())
    }

    /// The oldest result that is ready.
    pub(crate) fn ready(&mut self) -> Option<Delivered> {
        self.ready.pop_front()
    }

    /// The oldest frame under way.
    pub(crate) fn oldest(&mut self) -> Option<Flying> {
        self.flying.pop_front()
    }

    /// Waits for a frame, and makes it the result of a step. `fourth` says what the fourth value of a pixel is.
    pub(crate) fn collect(
        &self,
        renderer: &mut Renderer,
        flying: Flying,
        fourth: Fourth,
    ) -> Result<Delivered, GpuError> {
        let collected = renderer.collect(flying.submitted)?;
        let mut absorbed: Option<Vec<f64>> =
            collected.absorbed.map(|heat| heat.iter().map(|watts| f64::from(*watts)).collect());
        if let (Some(tables), Some(of_network)) = (&self.tables, flying.heat) {
            let absorbed = absorbed.get_or_insert_with(|| vec![0.0; tables.runs.len()]);
            for (number, _) in tables.runs.iter().enumerate().filter(|(_, run)| run.of == HeatOf::Flux) {
                absorbed[number] = of_network[number];
            }
        }
        let pixels = collected.radiance.zip(collected.identity).map(|(radiance, identity)| {
            let [coverage, reflected] = [Fourth::Coverage, Fourth::Reflected].map(|wanted| {
                if wanted == fourth { radiance.iter().map(|[.., value]| *value).collect() } else { Vec::new() }
            });
            Pixels {
                radiance_temperature_depth: radiance.iter().map(|[l, t, z, _]| [*l, *t, *z]).collect(),
                identity: identity.to_vec(),
                coverage,
                reflected,
                readings: collected.readings,
            }
        });
        Ok(Delivered { pixels, temperatures: collected.temperatures.map(<[f32]>::to_vec), absorbed })
    }
}
