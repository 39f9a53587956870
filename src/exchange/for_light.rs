//! What only the light of Sun and planet needs of a pose. Rows follow joints at nearly every step, and light is found anew much less often, so this is made when
//! light first asks for it.

use std::fmt;
use std::ops::Deref;
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

type Making = Box<dyn FnOnce() -> LightAreas + Send>;

/// Areas that are made when they are asked for.
#[derive(Clone)]
pub struct LateLightAreas(Arc<LazyLock<LightAreas, Making>>);

impl LateLightAreas {
    pub(super) fn new(make: impl FnOnce() -> LightAreas + Send + 'static) -> Self {
        Self(Arc::new(LazyLock::new(Box::new(make))))
    }
}

impl Deref for LateLightAreas {
    type Target = LightAreas;

    fn deref(&self) -> &LightAreas {
        &self.0
    }
}

impl fmt::Debug for LateLightAreas {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(out)
    }
}
