//! Speed against error, measured in one run and told on one page.
//!
//! [`cases`] are the networks of NUMERICS.md 3, [`schemes`] the ways to integrate them, and [`integrators`] measures each
//! against [`truth`]. [`run`] does all of it, within the time of [`clock`] where it is to be quick. [`limits`] is what the device can do at best, [`responses`] what a node costs, [`frames`] what a
//! whole tick of a scene takes, [`models`] what each choice of a model costs and changes, [`drivers`] how far devices are apart, [`hard`] what breaks without
//! its remedy. [`record`] holds what was
//! found; [`tables`], [`plots`], [`page`] and [`files`] show it.

pub mod cases;
pub mod clock;
pub mod drivers;
pub mod files;
pub mod frames;
pub mod hard;
pub mod integrators;
pub mod limits;
pub mod models;
pub mod page;
pub mod plots;
pub mod record;
pub mod responses;
pub mod run;
pub mod schemes;
pub mod tables;
pub mod truth;

/// A part of the measurements that can be asked for alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// Copies and an empty dispatch.
    Limits,
    /// Nanoseconds a node and step of each response.
    Responses,
    /// Whole ticks of scenes with their images, pass by pass.
    Frames,
    /// What each choice of a model costs and changes.
    Models,
    /// The same scene on every device.
    Drivers,
    /// Every integrator on the cases of NUMERICS.md 3.
    Integrators,
    /// The hard cases with and without their remedies.
    Hard,
}

impl Section {
    /// All, in the order in which they run.
    pub const ALL: [Self; 7] =
        [Self::Limits, Self::Responses, Self::Frames, Self::Models, Self::Drivers, Self::Integrators, Self::Hard];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Limits => "limits",
            Self::Responses => "responses",
            Self::Frames => "frames",
            Self::Models => "models",
            Self::Drivers => "drivers",
            Self::Integrators => "integrators",
            Self::Hard => "hard",
        }
    }

    /// The section of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|section| section.name() == name)
    }
}
