//! The effects of a scene, one file each: buffers, shaders, passes and barriers. `gpu/frame.rs` puts the passes in order.

use super::resource::Resource;

macro_rules! effects {
    ($($effect:ident)*) => {
        $(pub(crate) mod $effect;)*

        /// The buffers and images of each effect.
        const TABLES: &[&[&Resource]] = &[$($effect::RESOURCES),*];
    };
}

effects! { thermal light exchange network heat image traced sensor }

/// Every buffer and image: those of scenes, and those of commands outside scenes.
pub fn all() -> impl Iterator<Item = &'static Resource> {
    TABLES.iter().chain([&super::lists::RESOURCES]).flat_map(|table| table.iter().copied())
}
