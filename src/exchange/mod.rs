//! Radiation between the surfaces of the craft, in f64.
//!
//! Nodes are gathered into patches ([`patches`]). Rays from every patch find the other patches and the space that it sees ([`cast`], and [`jointed_rays`] where joints turn). Their numbers
//! become view factors that are reciprocal and closed ([`factors`]). Diffuse reflections turn these into exchange areas, of infrared and of sunlight
//! apart ([`reflected`]). In every step a patch receives the light of all others, and the planet's light through the open part of its sky ([`step`],
//! [`sky`]).
//!
//! A patch has a uniform temperature and reflects diffusely, but for direct sunlight that it may mirror once ([`mirrors`]). The room knows triangles
//! and optical values, but no files and no Vulkan.

pub(crate) mod balance_sides;
pub(crate) mod between;
pub(crate) mod bundles;
pub(crate) mod cast;
pub(crate) mod defects;
pub(crate) mod directions;
mod echoes;
pub(crate) mod errors;
pub(crate) mod factors;
pub(crate) mod for_light;
pub(crate) mod hold;
pub(crate) mod jointed_rays;
mod late_light;
pub(crate) mod lead;
pub(crate) mod mirrors;
mod overlaps;
pub(crate) mod packed;
pub(crate) mod patches;
pub(crate) mod posed;
pub(crate) mod reflected;
pub(crate) mod scaling;
pub(crate) mod sky;
pub(crate) mod slopes;
pub(crate) mod sparse;
pub(crate) mod split;
pub(crate) mod step;
pub(crate) mod turn;
pub(crate) mod uncertainty;
pub(crate) mod uneven;
pub(crate) mod words;
