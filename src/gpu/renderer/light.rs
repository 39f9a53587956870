//! Sunlight on the nodes: found on the host where the last light no longer holds, and brought to the device.

use super::Renderer;
use crate::environment::StepLoad;
use crate::environment::shadow::{Lit, LitArea, LitAreas};
use crate::gpu::effects::light::{LIT_FRONT, LIT_X, LIT_Y, LIT_Z};
use crate::gpu::error::GpuError;
use crate::trace::span;

/// A number of a lit area.
type Component = fn(&LitArea) -> f64;

impl Renderer {
    /// Finds the lit areas where a load needs it. Returns whether it did.
    pub(super) fn renew_light(&mut self, load: &StepLoad) -> Result<bool, GpuError> {
        let Some(light) = &mut self.scene.light else { return Ok(false) };
        let Some(lit) = light.find(load) else { return Ok(false) };
        // Frames in flight may still read the light before.
        self.slots.wait()?;
        let _brings = span("bringing the light to the device");
        let mut values = vec![0.0f32; self.nodes];
        let components: [(_, Component); 4] = [
            (&LIT_X, |area| area.vector.x),
            (&LIT_Y, |area| area.vector.y),
            (&LIT_Z, |area| area.vector.z),
            (&LIT_FRONT, |area| area.front),
        ];
        for (resource, component) in components {
            for (slot, area) in light.numbers().zip(&lit) {
                values[slot] = component(area) as f32;
            }
            self.resources.upload(&mut self.once, resource, &values)?;
        }
        Ok(true)
    }

    /// The lit areas that hold now. `None` before the first finding, and where normals tell the light.
    ///
    /// # Errors
    /// A call that fails.
    pub(crate) fn found_light(&mut self) -> Result<Option<Lit>, GpuError> {
        let found = self.scene.light.as_ref().filter(|light| light.redraw.found_for.is_some());
        let Some(by_rays) = found.map(LitAreas::by_rays) else { return Ok(None) };
        Ok(Some(Lit { areas: self.lit_areas()?, by_rays }))
    }

    /// The lit area of each node of the device, from the last time that it was found: its vector, and the share of the light on its front. Empty where
    /// normals tell the light.
    pub fn lit_areas(&mut self) -> Result<Vec<LitArea>, GpuError> {
        self.wait()?;
        if self.scene.light.is_none() {
            return Ok(Vec::new());
        }
        let mut of = |resource| self.resources.download(&mut self.once, resource, self.nodes);
        let (x, y, z, front): (Vec<f32>, Vec<f32>, Vec<f32>, Vec<f32>) =
            (of(&LIT_X)?, of(&LIT_Y)?, of(&LIT_Z)?, of(&LIT_FRONT)?);
        let area = |node: usize| LitArea {
            vector: glam::Vec3::new(x[node], y[node], z[node]).as_dvec3(),
            front: f64::from(front[node]),
        };
        Ok((0..self.nodes).map(area).collect())
    }
}
