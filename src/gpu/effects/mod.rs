//! The effects of a scene, one file each: buffers, shaders, passes and barriers. `gpu/frame.rs` puts the passes in order.

pub(crate) mod exchange;
pub(crate) mod heat;
pub(crate) mod image;
pub(crate) mod light;
pub(crate) mod network;
pub(crate) mod sensor;
pub(crate) mod thermal;
pub(crate) mod traced;

use super::lists;
use super::resource::Resource;

/// The buffers and images of each effect.
const TABLES: &[&[&Resource]] = &[
    thermal::RESOURCES,
    light::RESOURCES,
    exchange::RESOURCES,
    network::RESOURCES,
    heat::RESOURCES,
    image::RESOURCES,
    traced::RESOURCES,
    sensor::RESOURCES,
    lists::RESOURCES,
];

/// Every buffer and image of scenes and of commands outside scenes.
pub fn all() -> impl Iterator<Item = &'static Resource> {
    TABLES.iter().flat_map(|table| table.iter().copied())
}
