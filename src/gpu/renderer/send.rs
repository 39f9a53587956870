//! Sends a list to the device, with the buffers that the host fills for each frame.

use super::Renderer;
use crate::gpu::effects::exchange::{MIRRORS, POSES};
use crate::gpu::effects::image::resources::{
    DISTANT, LOBES, PIXEL_CHANGES, PLANET_MEANS, PLANET_VIEW, SHUTTER, SHUTTER_SKY, SURROUNDINGS, VIEW,
};
use crate::gpu::effects::sensor::SETTINGS;
use crate::gpu::effects::thermal::load::DeviceLoad;
use crate::gpu::effects::traced::{TRACE_BOXES, TRACE_TRIANGLES, TRACING};
use crate::gpu::error::GpuError;
use crate::gpu::layout;
use crate::gpu::pass::Frame;
use crate::gpu::record::Recorder;
use crate::gpu::request::{PixelSource, Request, Submitted};
use crate::trace::timed;

impl Renderer {
    /// Writes what the passes of a list read from the host, and submits the list.
    pub(super) fn send(&mut self, list: &Frame, request: Request<'_>) -> Result<Submitted, GpuError> {
        timed("making passes", || self.bindings.add(&self.resources, list.passes()))?;
        let slot = self.slots.free()?;
        timed("writing for the device", || self.write(slot, &request))?;
        let (context, bindings) = (self.resources.context.as_ref(), Some(&self.bindings));
        let recorder = |commands| {
            let recorder = Recorder::new(context, commands, &self.resources, bindings);
            recorder.drawing(slot, &self.scene.triangles)
        };
        self.slots.submit(list, recorder).map(Submitted)
    }

    /// Writes the buffers of a slot that the host fills for each frame.
    fn write(&mut self, slot: usize, request: &Request<'_>) -> Result<(), GpuError> {
        let (resources, scene) = (&mut self.resources, &mut self.scene);
        if let Some((load, steps)) = request.step {
            DeviceLoad::new(load, scene.joints).write(resources, slot, steps)?;
        }
        resources.write_slices(&VIEW, slot, request.views)?;
        let (shutters, sky) = request.shutters;
        resources.write_slices(&SHUTTER, slot, shutters)?;
        if let Some(turns) = sky {
            resources.write(&SHUTTER_SKY, slot, &[turns])?;
        }
        if let PixelSource::Crop(distant) = request.pixels {
            resources.write(&DISTANT, slot, &[distant])?;
        }
        if let Some((around, lobes)) = request.surroundings {
            resources.write(&SURROUNDINGS, slot, &[around])?;
            resources.write(&LOBES, slot, lobes)?;
        }
        if let Some(traced) = request.traced {
            let [width, _] = scene.drawn[usize::from(request.pixels.is_crop())];
            let (texels, surface_width) = (scene.texels(request.pixels.is_crop()), scene.drawn[0][0]);
            let settings = layout::Tracing { width, texels, surface_width, ..traced.settings };
            resources.write(&TRACING, slot, &[settings])?;
            if self.trees[slot] != Some(traced.version) {
                resources.write(&TRACE_BOXES, slot, traced.boxes)?;
                resources.write(&TRACE_TRIANGLES, slot, traced.triangles)?;
                self.trees[slot] = Some(traced.version);
            }
        }
        if scene.has_pixel_changes() && !request.views.is_empty() {
            // Without a width there are none.
            let changes = if let PixelSource::Changed(changes) = request.pixels { changes } else { &[[0.0; 2]][..] };
            resources.write(&PIXEL_CHANGES, slot, changes)?;
        }
        if let Some((view, means)) = request.planet {
            resources.write(&PLANET_VIEW, slot, &[view])?;
            resources.write(&PLANET_MEANS, slot, means)?;
        }
        if let Some(exchange) = &mut scene.exchange {
            resources.write(&POSES, slot, &std::mem::take(&mut exchange.poses))?;
            resources.write(&MIRRORS, slot, &std::mem::take(&mut exchange.mirrored))?;
        }
        if let Some(sensor) = &scene.sensor {
            resources.write(&SETTINGS, slot, &[sensor.settings])?;
        }
        Ok(())
    }
}
