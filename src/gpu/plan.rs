//! Memory of a scene: the sizes of all its buffers and images, and their making and filling.

use std::sync::Arc;

use super::context::Context;
use super::effects;
use super::error::GpuError;
use super::once::Once;
use super::resource::{Pieces, Resource, Role};
use super::scene_data::SceneData;
use super::store::Resources;
use crate::gpu::layout::slice_of;

/// A planned buffer or image.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Resource.
    pub resource: &'static Resource,
    /// Size of all its copies [bytes].
    pub bytes: u64,
}

impl SceneData<'_> {
    /// Everything that the scene needs on the device, in the order of the effects.
    pub fn plan(&self) -> Vec<Planned> {
        let planned = |resource: &'static Resource| {
            let joints = self.joints.as_ref().filter(|_| resource.per_joint).map(|joints| joints.count as usize);
            let one = resource.element * (resource.count)(self);
            let bytes = (resource.copies() * joints.map_or(one, |joints| joints * slice_of(one))) as u64;
            (bytes > 0).then_some(Planned { resource, bytes })
        };
        effects::all().filter_map(planned).collect()
    }

    /// Whether every pass of the scene binds only a part of a buffer.
    fn binds_in_pieces(&self, resource: &Resource) -> bool {
        match resource.pieces {
            Pieces::Never => false,
            Pieces::WithoutImage => self.image.is_none(),
            Pieces::WithoutNormals => {
                let variant = self.shown.variant;
                self.image.is_none() || !variant.needs_normals() || variant.crinkled
            }
            Pieces::Always => true,
        }
    }
}

/// Part of a plan that grows with the nodes and triangles [bytes], without buffers that only the host reads.
pub fn device_bytes(plan: &[Planned]) -> u64 {
    plan.iter().filter(|planned| planned.resource.grows_with_nodes()).map(|planned| planned.bytes).sum()
}

/// Checks that the device can hold a plan, before anything is allocated.
///
/// # Errors
/// The plan needs more memory than the device has, or the image is larger than the device can draw.
pub(crate) fn check_plan(context: &Context, plan: &[Planned], image: Option<[u32; 2]>) -> Result<(), GpuError> {
    let info = &context.info;
    let needed = plan.iter().map(|planned| planned.bytes).sum::<u64>();
    let available = context.free_memory();
    if needed > available {
        let of_images = plan.iter().filter(|planned| planned.resource.grows_with_images());
        let images = of_images.map(|planned| planned.bytes).sum();
        return Err(GpuError::OutOfMemory { needed, images, device: info.name.clone(), available });
    }
    match image {
        Some([width, height]) if width.max(height) > info.max_framebuffer_side => {
            Err(GpuError::ImageTooLarge { width, height, device: info.name.clone(), limit: info.max_framebuffer_side })
        }
        _ => Ok(()),
    }
}

impl Resources {
    /// Makes and fills all resources of a scene.
    pub(crate) fn of_scene(context: &Arc<Context>, once: &mut Once, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let plan = data.plan();
        check_plan(context, &plan, data.drawn())?;
        let mut resources = Self::new(context);
        for Planned { resource, bytes } in &plan {
            if resource.role.is_image() {
                let size = (resource.size)(data);
                let texels = u64::from(size[0]) * u64::from(size[1]) * resource.element as u64;
                resources.make_image(resource, size, (bytes / texels.max(1)) as u32)?;
                continue;
            }
            for slot in 0..resource.copies() {
                let bytes = bytes / resource.copies() as u64;
                resources.make_in(resource, slot, bytes, data.binds_in_pieces(resource))?;
            }
        }
        for Planned { resource, .. } in plan {
            let Some(contents) = resource.contents.map(|contents| contents(data)) else { continue };
            match resource.role {
                Role::Uniform => resources.write(resource, 0, &contents)?,
                _ => resources.upload(once, resource, &contents)?,
            }
        }
        resources.free_staging();
        Ok(resources)
    }
}
