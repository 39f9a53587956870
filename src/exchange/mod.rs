//! Radiation between the surfaces of the craft, in f64.
//!
//! Nodes are gathered into patches ([`patches`]). Rays from every patch find what it sees: other patches and space ([`cast`]). Their numbers become view
//! factors that are reciprocal and closed ([`factors`]). Diffuse reflections turn these into exchange areas, of infrared and of sunlight apart
//! ([`reflected`]). In every step a patch receives what all others send, and the planet's light through the open part of its sky ([`step`], [`sky`]).
//!
//! A patch has a uniform temperature and reflects diffusely, but for direct sunlight that it may mirror once ([`mirrors`]). The room knows triangles and optical values. It knows no files and no Vulkan.

pub mod between;
pub mod buried;
pub mod cast;
pub mod defects;
pub mod directions;
pub mod errors;
pub mod factors;
pub mod mirrors;
pub mod patches;
pub mod reflected;
pub mod sky;
pub mod sparse;
pub mod step;
pub mod turn;
pub mod words;
