//! Speed against error, measured in one run and told on one page.
//!
//! [`plan`] says what is to be measured; [`run`] does it, within the time of [`clock`] where it is to be quick. [`limits`] is
//! what the device can do at best, [`responses`] what a node costs, [`frames`] what a whole step of a scene takes, [`models`]
//! what each choice of a model costs and changes, [`drivers`] how far devices are apart, [`hard`] what breaks without its
//! remedy. [`cases`] are four networks, [`schemes`] the ways to integrate them; [`integrators`] measures each against
//! [`truth`]. Each has the rows of what it finds; [`record`] holds all of them, and [`tables`], [`plots`], [`page`] and
//! [`files`] show them.

pub mod cases;
mod clock;
mod drivers;
pub mod files;
mod frames;
pub mod hard;
pub mod integrators;
mod limits;
pub mod models;
mod page;
pub(crate) mod plan;
mod plots;
pub mod record;
pub mod responses;
pub(crate) mod run;
pub mod schemes;
pub mod tables;
pub mod truth;
