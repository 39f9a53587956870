//! Structures of a step of the nodes: their materials, the load, and the sum of absorbed heat.

use super::shared::shared;
use crate::gpu::shapes::Shapes;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::material::{Profile, Radiative, Transition};

/// Most steps of one fused dispatch (STEPS in glsl/thermal_step.comp). Their Sun samples take 4 of the 16 KiB that
/// every device allows for a uniform buffer.
pub const FUSED_STEPS: usize = 32;

shared! {
    /// Properties of a material.
    pub struct Material {
        /// Solar absorptivity of the front.
        pub absorptivity: f32,
        /// Infrared emissivity of the front.
        pub emissivity: f32,
        /// Solar absorptivity of the back. The value equals the front's if only the front exchanges heat.
        pub back_absorptivity: f32,
        /// Infrared emissivity of the back, or of the front if only the front exchanges heat.
        pub back_emissivity: f32,
        /// Response on heating: the power of the remaining share, or the value of `Shapes::place` for a shaped
        /// transition.
        pub heating_function: f32,
        /// Duration of the transition on heating [steps].
        pub heating_t_max: f32,
        /// Response on cooling, like `heating_function`.
        pub cooling_function: f32,
        /// Duration of the transition on cooling [steps].
        pub cooling_t_max: f32,
        /// Change of a plate in a step by a flux of 1 W/m2 [K m2/W].
        pub share: f32,
        /// Emission of a plate to space and to its structure [W/(m2 K4)].
        pub emission: f32,
        /// Emission of a plate to space [W/(m2 K4)].
        pub own_emission: f32,
        /// Radiative conductance between a plate and its structure [W/(m2 K4)].
        pub exchange: f32,
        /// Change of the structure in a step by a flux of 1 W/m2 [K m2/W].
        pub structure_share: f32,
        /// Parts of a step in which the structure is held.
        pub parts: f32,
    }

    /// Load of one step, common to all nodes.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(crate) struct Step {
        /// Unit vector to the planet's centre, body frame; w: sine of the planet's angular radius.
        pub(crate) nadir: [f32; 4],
        /// Unit vector perpendicular to nadir, on the Sun's side; w: cosine of the planet's angular radius.
        pub(crate) sunward: [f32; 4],
        /// Cross product nadir x sunward; w: 0.
        pub(crate) across: [f32; 4],
        /// Infrared exitance of the planet [W/m2].
        pub(crate) planet_ir: f32,
        /// Planet albedo times solar constant [W/m2].
        pub(crate) albedo_flux: f32,
        /// Fourth power of the radiative temperature of space [K4].
        pub(crate) background_temperature_4: f32,
        /// Length [steps].
        pub(crate) length: f32,
        /// Intervals of the albedo table along each axis.
        pub(crate) albedo_resolution: f32,
        /// Number of steps of a fused dispatch, set in the first of them.
        pub(crate) count: f32,
        /// Sine of the zenith angle of the Sun below the craft.
        pub(crate) sun_sine: f32,
        /// Its cosine.
        pub(crate) sun_cosine: f32,
    }

    /// Size of a response dispatch.
    pub(crate) struct Steps {
        /// Number of steps.
        pub(crate) count: u32,
        /// Groups of four nodes of one step.
        pub(crate) groups: u32,
    }

    /// Push constants of a dispatch that sums absorbed heat.
    pub(crate) struct HeatPass {
        /// First run of nodes.
        pub(crate) first: u32,
        /// Fourth power of the radiative temperature of space [K4].
        pub(crate) background_temperature_4: f32,
    }
}

impl Material {
    /// Sets the response functions and durations.
    pub(crate) fn set_transition(&mut self, transition: &Transition, shapes: &Shapes) {
        let function = |profile: &Profile| match profile.function.power().filter(|_| transition.is_power()) {
            Some(power) => power as f32,
            None => shapes.place(&profile.function),
        };
        [self.heating_function, self.cooling_function] = [function(&transition.heating), function(&transition.cooling)];
        self.heating_t_max = transition.heating.duration() as f32;
        self.cooling_t_max = transition.cooling.duration() as f32;
    }

    /// Sets the values of a plate whose faces have this sum of emissivities.
    pub(crate) fn set_plate(&mut self, plate: &Radiative, emissivity: f64) {
        let own = STEFAN_BOLTZMANN * emissivity;
        self.share = plate.share() as f32;
        self.emission = (own + plate.exchange()) as f32;
        self.own_emission = own as f32;
        self.exchange = plate.exchange() as f32;
        self.structure_share = plate.structure_share() as f32;
        self.parts = plate.parts() as f32;
    }
}
