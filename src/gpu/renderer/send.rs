//! Sends a list to the device: the buffers that the host fills for each frame, and the push constants of its passes.

use super::exchanging::Exchanging;
use super::one_pass::OnePass;
use super::{Renderer, Request, Submitted};
use crate::gpu::error::GpuError;
use crate::gpu::frame::Frame;
use crate::gpu::layout::{self, HeatPass};
use crate::gpu::load::DeviceLoad;
use crate::gpu::pass::Said;
use crate::gpu::record::Recorder;
use crate::gpu::resource::Resource;

impl Renderer {
    /// Writes what the passes of a list read from the host, and submits the list.
    pub(super) fn send(&mut self, list: &Frame, request: Request<'_>) -> Result<Submitted, GpuError> {
        let slot = self.slots.free()?;
        self.write(slot, &request)?;
        let told = |said: Said| match said {
            Said::Share => request.between.unwrap_or(1.0).to_le_bytes().to_vec(),
            Said::Triangle(first) | Said::Texel(first) => first.to_le_bytes().to_vec(),
            Said::Ray(ray, joint) => self.shadows.ray(ray, joint),
            Said::OnePass { first, end, since } => {
                let constants = |one: &OnePass| bytemuck::bytes_of(&one.constants(first, end, since)).to_vec();
                self.one_pass.as_ref().map(constants).unwrap_or_default()
            }
            Said::Stage { number } => {
                let constants = |one: &OnePass| bytemuck::bytes_of(&one.stage_constants(number)).to_vec();
                self.one_pass.as_ref().map(constants).unwrap_or_default()
            }
            Said::Heaters { number, first, trial } => {
                let constants =
                    |one: &OnePass| bytemuck::bytes_of(&one.heater_constants(number, first, trial)).to_vec();
                self.one_pass.as_ref().map(constants).unwrap_or_default()
            }
            Said::Patches { first, end } => {
                let constants = |own: &Exchanging| bytemuck::bytes_of(&own.constants(first, end)).to_vec();
                self.exchange.as_ref().map(constants).unwrap_or_default()
            }
            Said::Heat { first } => {
                let space = request.step.map_or(0.0, |(load, _)| load.background_temperature);
                bytemuck::bytes_of(&HeatPass { first, background_temperature_4: space.powi(4) as f32 }).to_vec()
            }
            Said::Nothing => Vec::new(),
        };
        let (context, bindings) = (self.resources.context.as_ref(), Some(&self.bindings));
        let recorder = |commands| {
            let recorder = Recorder::new(context, commands, &self.resources, bindings, &told);
            recorder.drawing(slot, &self.triangles, &self.shadows.occluders)
        };
        self.slots.submit(list, recorder).map(Submitted)
    }

    /// Writes the buffers of a slot that the host fills for each frame.
    fn write(&mut self, slot: usize, request: &Request<'_>) -> Result<(), GpuError> {
        if let Some((load, steps)) = request.step {
            DeviceLoad::new(load, self.joints).write(&mut self.resources, slot, steps)?;
        }
        self.resources.write_slices(Resource::View, slot, request.views)?;
        self.resources.write_slices(Resource::Shutter, slot, request.shutters)?;
        if let Some(distant) = request.distant {
            self.resources.write(Resource::Distant, slot, &[distant])?;
        }
        if let Some(around) = request.surroundings {
            self.resources.write(Resource::Surroundings, slot, &[around])?;
            self.resources.write(Resource::Lobes, slot, request.lobes)?;
        }
        if let Some(traced) = request.traced {
            let [width, _] = self.drawn[usize::from(request.distant.is_some())];
            let (texels, surface_width) = (self.texels(request.distant.is_some()), self.drawn[0][0]);
            let settings = layout::Tracing { width, texels, surface_width, ..traced.settings };
            self.resources.write(Resource::Tracing, slot, &[settings])?;
            if self.trees[slot] != Some(traced.version) {
                self.resources.write(Resource::TraceBoxes, slot, traced.boxes)?;
                self.resources.write(Resource::TraceTriangles, slot, traced.triangles)?;
                self.trees[slot] = Some(traced.version);
            }
        }
        if let Some((view, means)) = request.planet {
            self.resources.write(Resource::PlanetView, slot, &[view])?;
            self.resources.write(Resource::PlanetMeans, slot, means)?;
        }
        self.resources.write_slices(Resource::SunView, slot, &std::mem::take(&mut self.shadows.views))?;
        if let Some(exchange) = &mut self.exchange {
            self.resources.write(Resource::ExchangePoses, slot, &std::mem::take(&mut exchange.poses))?;
            self.resources.write(Resource::ExchangeMirrors, slot, &std::mem::take(&mut exchange.mirrored))?;
        }
        if let Some(sensor) = &self.sensor {
            self.resources.write(Resource::Sensor, slot, &[sensor.settings])?;
        }
        Ok(())
    }
}
