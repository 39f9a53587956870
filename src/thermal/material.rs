//! Surface material as numbers: optics, bulk properties, and thermal response.

use super::emissivity::BandEmissivity;
pub(crate) use super::function::Function;

/// Solar absorptivity and infrared emissivity of one face of a sheet or body, both in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// Share of the incident sunlight that is absorbed.
    pub absorptivity: f64,
    /// Grey-body emissivity, also the absorbed share of incident planet infrared.
    pub emissivity: f64,
}

/// How a face reflects in the band of the images. The reflectivity is 1 minus the emissivity (Kirchhoff's law).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gloss {
    /// Share of the reflected light that leaves about the mirror direction, in [0, 1]. The rest is diffuse.
    pub specular: f64,
    /// Roughness alpha of the mirror (GGX). 0 is a smooth one.
    pub roughness: f64,
    /// Variance of the slope of waves that a pixel does not resolve, such as waves of crinkled foil.
    pub slope_variance: f64,
    /// Variance of slopes that are drawn instead of averaged.
    pub drawn_variance: f64,
    /// Seed of the drawn slopes.
    pub seed: u32,
}

impl Gloss {
    /// Roughness of the mirror with its waves. Variances of slopes add up, and alpha^2 is the variance of normally distributed slopes (Beckmann).
    pub fn alpha(&self) -> f64 {
        (self.roughness * self.roughness + self.slope_variance).sqrt()
    }
}

/// The faces that exchange heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sides {
    /// Only the face of the normal, as on the skin of a closed body.
    Outside,
    /// Both faces, as on an array sheet or a radiator panel. The back has its own optics.
    Both {
        /// Optics of the face against the normal.
        back: Optics,
    },
}

/// Longest time to the target [steps]. The device's clock divides `t_max` into 2^30 to 2^31 parts, and rule `restart` counts in units of 128 parts. From
/// 2^24 steps on the clock would not advance.
pub(crate) const LONGEST_T_MAX: f64 = 10_000_000.0;
/// Shortest transition that is not 0 [steps]. The device divides by it.
pub(crate) const SHORTEST_T_MAX: f64 = 1e-6;

/// One branch (heating or cooling) of a transition.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Shape of the curve.
    pub function: Function,
    /// Time to the target [steps]. 0 is an immediate response.
    pub t_max_steps: f64,
}

impl Profile {
    /// Time until no way is left [steps], less than `t_max_steps` where a function reaches its target early.
    pub(crate) fn duration(&self) -> f64 {
        self.t_max_steps * self.function.active()
    }

    /// Share of the way left when the share `r` of the duration is left.
    pub(crate) fn remaining(&self, r: f64) -> f64 {
        let active = self.function.active();
        self.function.remaining(1.0 - active + active * r)
    }
}

/// Rule for a transition under way whose target moves (docs/numerics.md 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retarget {
    /// Continue on the same curve from another phase, without a jump of the temperature. For powers the rates of the old and the new change add up.
    Merge,
    /// Start a new transition from the present temperature where the target has moved ([`crate::thermal::transition::MOVED`]).
    Restart,
}

/// The quantity that a transition moves (docs/numerics.md 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Domain {
    /// The temperature.
    Temperature,
    /// The fourth power of the temperature, which is proportional to the emitted power. More accurate for a radiating node.
    FourthPower,
}

impl Domain {
    /// Unit of the fourth power: 100 K, so that its values stay near 1 in f32.
    const UNIT: f64 = 100.0;

    /// Converts a temperature [K] to the unit of the domain: K, or (100 K)^4.
    pub(crate) fn of(self, temperature: f64) -> f64 {
        match self {
            Self::Temperature => temperature,
            Self::FourthPower => (temperature / Self::UNIT).powi(4),
        }
    }

    /// Converts a value of the domain to a temperature [K].
    pub(crate) fn temperature(self, value: f64) -> f64 {
        match self {
            Self::Temperature => value,
            // An effective origin may lie below 0. A node that rounding takes below 0 is at 0 K.
            Self::FourthPower => Self::UNIT * value.max(0.0).sqrt().sqrt(),
        }
    }
}

/// A transition: the thermal inertia of Vural et al. 2023.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Branch for a target above the origin.
    pub heating: Profile,
    /// Branch for a target below the origin.
    pub cooling: Profile,
    /// Rule for a target that moves.
    pub retarget: Retarget,
    /// Quantity that moves.
    pub domain: Domain,
}

impl Transition {
    /// Whether T moves and both branches are powers of the time left.
    pub(crate) fn is_power(&self) -> bool {
        self.domain == Domain::Temperature
            && self.heating.function.power().is_some()
            && self.cooling.function.power().is_some()
    }
}

/// A plate by itself: the energy balance of a node without conduction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radiative {
    /// Heat capacity per area [J/(m2 K)]. 0 is in balance at every step.
    pub capacity: f64,
    /// The structure below.
    pub over: Option<Below>,
    /// Length of a step of the scene [s].
    pub step: f64,
    /// Temperature that no node of the material is expected to exceed [K], infinite where unknown.
    pub hottest: f64,
}

/// Why a material can not be a plate by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoPlate {
    /// A value is missing; its key.
    Lacks(&'static str),
    /// The outside stores no heat, and neither does anything below it.
    StoresNothing,
    EmptyStructure,
}

impl Radiative {
    /// The plate of a material, in steps of `step` [s].
    ///
    /// # Errors
    /// Values that are missing, or no heat that is stored.
    pub(crate) fn of(bulk: &Bulk, step: f64) -> Result<Self, NoPlate> {
        let capacity = bulk.capacity_per_area().map_err(NoPlate::Lacks)?;
        let below = |over: InnerStructure| Below {
            capacity: over.capacity_per_area(),
            effective_emittance: over.effective_emittance,
        };
        let over = bulk.over.map(below);
        match over {
            None if capacity <= 0.0 => Err(NoPlate::StoresNothing),
            Some(over) if over.capacity <= 0.0 => Err(NoPlate::EmptyStructure),
            over => Ok(Self { capacity, over, step, hottest: f64::INFINITY }),
        }
    }
}

/// A structure below a plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Below {
    /// Heat capacity per area [J/(m2 K)], above 0.
    pub capacity: f64,
    /// Radiative conductance per area between the two, divided by the Stefan-Boltzmann constant.
    pub effective_emittance: f64,
}

/// Thermal response of a node.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// The present balance temperature, without state.
    Instant,
    /// A transition.
    Transition(Transition),
    /// The energy balance of the node by itself.
    Radiative(Radiative),
    /// The energy balance of the node in a thermal network, from the bulk properties.
    Network,
    /// A temperature that another program found.
    Given,
}

impl Response {
    /// The name that scenes give it.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Instant => "instant",
            Self::Transition(_) => "transition",
            Self::Radiative(_) => "radiative",
            Self::Network => "network",
            Self::Given => "given",
        }
    }

    /// Whether the temperature of a node by itself depends on its past.
    pub(crate) fn has_memory(&self) -> bool {
        match self {
            Self::Instant | Self::Network | Self::Given => false,
            Self::Radiative(plate) => plate.capacity > 0.0 || plate.over.is_some(),
            Self::Transition(transition) => {
                [&transition.heating, &transition.cooling].iter().all(|profile| profile.t_max_steps > 0.0)
            }
        }
    }
}

/// Bulk properties. Values that only `network` needs may be absent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bulk {
    /// Thickness [m].
    pub thickness: Option<f64>,
    /// Density [kg/m3].
    pub density: Option<f64>,
    /// Specific heat [J/(kg K)].
    pub specific_heat: Option<f64>,
    /// Heat capacity per area [J/(m2 K)]. Where it is stated, density and specific heat are not needed.
    pub(crate) heat_capacity_per_area: Option<f64>,
    /// Conductivity [W/(m K)].
    pub conductivity: Option<f64>,
    pub(crate) over: Option<InnerStructure>,
}

impl Bulk {
    /// Heat capacity per area [J/(m2 K)]: as stated, else thickness x density x specific heat. `Err` has the first missing key.
    ///
    /// # Errors
    /// The key of a value that is missing.
    pub(crate) fn capacity_per_area(&self) -> Result<f64, &'static str> {
        if let Some(stated) = self.heat_capacity_per_area {
            return Ok(stated);
        }
        // The product is 0 if one factor is 0, even where another is missing.
        if self.density == Some(0.0) || self.specific_heat == Some(0.0) {
            return Ok(0.0);
        }
        let thickness = self.thickness.ok_or("thickness")?;
        Ok(thickness * self.density.ok_or("density")? * self.specific_heat.ok_or("specific_heat")?)
    }
}

impl InnerStructure {
    /// Heat capacity per area [J/(m2 K)].
    pub(crate) fn capacity_per_area(&self) -> f64 {
        self.thickness * self.density * self.specific_heat
    }
}

/// A sheet behind the visible one that exchanges heat with it by radiation, such as the structure below an MLI blanket.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InnerStructure {
    /// Radiative conductance (GR) per area between the two: the blanket's effective emittance.
    pub(crate) effective_emittance: f64,
    /// Thickness [m].
    pub(crate) thickness: f64,
    /// Density [kg/m3].
    pub(crate) density: f64,
    /// Specific heat [J/(kg K)].
    pub(crate) specific_heat: f64,
    /// Conductivity [W/(m K)].
    pub(crate) conductivity: f64,
}

/// A material with every value checked and in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name of the glTF material.
    pub name: String,
    /// Optics of the outside.
    pub front: Optics,
    /// Which faces exchange heat.
    pub sides: Sides,
    /// How front and back reflect in the band of the images.
    pub gloss: [Gloss; 2],
    /// Emissivity of front and back in the band of the images.
    pub in_band: [BandEmissivity; 2],
    /// Bulk properties.
    pub bulk: Bulk,
    /// Thermal response of its nodes.
    pub response: Response,
    /// The transition that its values state, even where the response is another. `isotherm compare` uses it.
    pub transition: Option<Transition>,
    /// Source of the values, for the report: "scene.toml, rule 3; table white_paint (Fortescue 11.3)".
    pub source: String,
    /// Ranges in which absorptivity and emissivity of the outside are known, where the scene or its table states them.
    pub ranges: [Option<[f64; 2]>; 2],
}

impl Material {
    /// Whether its nodes have a structure below them that is no node of a network.
    pub(crate) fn has_own_structure(&self) -> bool {
        matches!(self.response, Response::Radiative(Radiative { over: Some(_), .. }))
    }

    /// Optics of the back. A material that exchanges heat outside only has the same on both faces.
    pub(crate) fn back(&self) -> Optics {
        match self.sides {
            Sides::Outside => self.front,
            Sides::Both { back } => back,
        }
    }
}
