//! What only the light of Sun and planet needs of a pose. Rows follow joints at nearly every step, and light is found anew much less often, so this is made when
//! light first asks for it.

use std::sync::{Arc, LazyLock};

use super::reflected::Areas;

/// Exchange areas of sunlight, and the sky.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightAreas {
    /// Exchange areas of sunlight.
    pub sunlight: Areas,
    /// Bundles of rays that keep the sky, the same number for each patch.
    pub sky: Vec<u32>,
}

/// Areas that are made when they are asked for.
pub(crate) type LateLightAreas = Arc<LazyLock<LightAreas, Box<dyn FnOnce() -> LightAreas + Send>>>;

/// Areas that will be made so.
pub(super) fn late(make: impl FnOnce() -> LightAreas + Send + 'static) -> LateLightAreas {
    Arc::new(LazyLock::new(Box::new(make)))
}
