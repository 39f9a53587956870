//! What a surface is made of, as numbers: optics, bulk, and the response that moves its temperature.

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

/// The share of the way done as a function of the share of the time gone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Function {
    /// Equations 1 and 2 of Vural et al. 2023.
    Linear,
    /// Equations 3 and 4 of Vural et al. 2023, held at the target after `t_max`.
    Quadratic,
}

/// One branch (heating or cooling) of a transition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// Shape of the curve.
    pub function: Function,
    /// Time to reach the target, in simulation steps; 0 is an immediate response.
    pub t_max_steps: f64,
}

/// What happens to a transition under way when its target moves (NUMERICS.md 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retarget {
    /// Superpose gap and rate of the transition under way with those of the new step.
    Merge,
    /// Start afresh from the present temperature at every change.
    Restart,
}

/// How the temperature of a node moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Response {
    /// The balance temperature of the moment: no state.
    Instant,
    /// The paper's thermal inertia.
    Transition {
        /// Branch taken when the target lies above the origin.
        heating: Profile,
        /// Branch taken when the target lies below the origin.
        cooling: Profile,
        /// Rule for a target that moves.
        retarget: Retarget,
    },
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
    /// Where the values come from, for the report: "scene.toml, rule 3; table white_paint (Fortescue 11.3)".
    pub source: String,
}
