//! What a surface is made of, as numbers: optics, bulk, and the response that moves its temperature.

pub use super::function::Function;

/// Solar absorptivity and infrared emissivity of one face of a sheet or body, both in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// Share of the incident sunlight that is absorbed.
    pub absorptivity: f64,
    /// Grey-body emissivity; also the share of the incident planet infrared that is absorbed.
    pub emissivity: f64,
}

/// What exchanges heat with the surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sides {
    /// Only the side its normal points to: the skin of a closed body.
    Outside,
    /// Both faces, the back with optics of its own: an array sheet, a radiator panel.
    Both {
        /// Optics of the face against the normal.
        back: Optics,
    },
}

/// Longest time to the target [steps]. The device's clock counts whole parts of a step, between 2^30 and 2^31 in
/// `t_max`, of which rule `restart` keeps parts of 128: from 2^24 steps on it would stand still.
pub const LONGEST_T_MAX: f64 = 10_000_000.0;

/// One branch (heating or cooling) of a transition.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Shape of the curve.
    pub function: Function,
    /// Time to reach the target, in simulation steps; 0 is an immediate response.
    pub t_max_steps: f64,
}

impl Profile {
    /// Time until nothing is left of the way [steps]; `t_max_steps` but for a function that reaches its target early.
    pub fn duration(&self) -> f64 {
        self.t_max_steps * self.function.active()
    }

    /// Share of the way left when the share `r` of the duration is left.
    pub fn remaining(&self, r: f64) -> f64 {
        let active = self.function.active();
        self.function.remaining(1.0 - active + active * r)
    }
}

/// What happens to a transition under way when its target moves (docs/numerics.md 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retarget {
    /// Go on along the curve under way from another place, without a jump of the temperature; of a power the rates of the
    /// transition under way and of the new step add up.
    Merge,
    /// Start afresh from the present temperature at every change.
    Restart,
}

/// The quantity that a transition moves (docs/numerics.md 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Domain {
    /// The temperature.
    Temperature,
    /// Its fourth power: the emitted power. Nearer to a radiating node.
    FourthPower,
}

impl Domain {
    /// Unit of the fourth power: 100 K, so that what f32 holds of it stays near 1.
    const UNIT: f64 = 100.0;

    /// What moves, of a temperature [K]: K, or units of (100 K)^4.
    pub fn of(self, temperature: f64) -> f64 {
        match self {
            Self::Temperature => temperature,
            Self::FourthPower => (temperature / Self::UNIT).powi(4),
        }
    }

    /// The temperature [K] of what moves.
    pub fn temperature(self, value: f64) -> f64 {
        match self {
            Self::Temperature => value,
            // An effective origin may lie below 0, and rounding may take a node there: it is then at 0 K.
            Self::FourthPower => Self::UNIT * value.max(0.0).sqrt().sqrt(),
        }
    }
}

/// The paper's thermal inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Branch taken when the target lies above the origin.
    pub heating: Profile,
    /// Branch taken when the target lies below the origin.
    pub cooling: Profile,
    /// Rule for a target that moves.
    pub retarget: Retarget,
    /// What moves.
    pub domain: Domain,
}

impl Transition {
    /// Whether T moves, and both branches are powers of the remaining time.
    pub fn is_power(&self) -> bool {
        self.domain == Domain::Temperature
            && self.heating.function.power().is_some()
            && self.cooling.function.power().is_some()
    }
}

/// How the temperature of a node moves.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// The balance temperature of the moment: no state.
    Instant,
    /// The paper's thermal inertia.
    Transition(Transition),
    /// The energy balance of the node in a thermal network, from the bulk properties.
    Network,
}

/// Bulk properties; what only `network` needs may be absent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bulk {
    /// Thickness [m].
    pub thickness: Option<f64>,
    /// Density [kg/m3].
    pub density: Option<f64>,
    /// Specific heat [J/(kg K)].
    pub specific_heat: Option<f64>,
    /// Conductivity [W/(m K)].
    pub conductivity: Option<f64>,
    /// The structure below, of a layered material.
    pub over: Option<Structure>,
}

/// A sheet behind the one that is seen, with which it exchanges heat by radiation: what an MLI blanket covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structure {
    /// GR per area between the two: the blanket's effective emittance.
    pub effective_emittance: f64,
    /// Thickness [m].
    pub thickness: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Specific heat [J/(kg K)].
    pub specific_heat: f64,
    /// Conductivity [W/(m K)].
    pub conductivity: f64,
}

/// A material as the simulation uses it: every value checked and in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name of the glTF material.
    pub name: String,
    /// Optics of the outside.
    pub front: Optics,
    /// Which faces exchange heat.
    pub sides: Sides,
    /// Bulk properties.
    pub bulk: Bulk,
    /// How its nodes move.
    pub response: Response,
    /// The transition that its values state, whatever its response: what `isotherm compare` runs it with.
    pub transition: Option<Transition>,
    /// Where the values come from, for the report: "scene.toml, rule 3; table white_paint (Fortescue 11.3)".
    pub source: String,
}
