//! How the nodes of a range change in a step. Each variant compiles only what it needs.

/// How a range's nodes change in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum StepKind {
    /// Sets the balance temperature of the step. It also settles every node at the start of a run.
    Instant,
    /// Transition with the merge rule (docs/numerics.md, section 1).
    Merge,
    /// Transition with the restart rule.
    Restart,
    /// Transition with an unchanged target. It reads no load.
    Advance,
    /// Energy balance of the node by itself.
    Radiative {
        /// Whether there is a structure below.
        over: bool,
        /// Whether the outside takes the closed form of its local step.
        fast: bool,
    },
    /// Computes the flux absorbed by a thermal network [W/m2] instead of a temperature.
    Absorb,
}

/// Evaluation of a transition's curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Curve {
    /// A power of the remaining time. It also stands for no transition.
    Power,
    /// Any function, as cubic pieces.
    Shaped {
        /// Whether the transition moves the fourth power of the temperature.
        fourth_power: bool,
    },
}

/// How nodes know the sunlight on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LightBy {
    /// By their normals. The nodes are flat, and nothing hides the Sun.
    Normal,
    /// By lit area vectors. Nothing hides the Sun.
    Area,
    /// By lit area vectors, from rays past the craft.
    Rays,
}

/// A variant of `thermal_step.comp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ThermalVariant {
    /// How the nodes change.
    pub kind: StepKind,
    /// Evaluation of their transition.
    pub curve: Curve,
    /// Whether the back exchanges heat too.
    pub both_sides: bool,
    /// Whether there is sunlight.
    pub sun: bool,
    /// Whether there is planet infrared.
    pub planet_ir: bool,
    /// Whether there is reflected sunlight, which needs `sun`.
    pub albedo: bool,
    /// Whether planet infrared is a mean over all orientations.
    pub tumble: bool,
    /// How nodes know the sunlight on them.
    pub light: LightBy,
    /// Whether surfaces radiate to each other.
    pub exchange: bool,
    /// Whether a dispatch takes many steps, each with its own load.
    pub fused: bool,
}

/// A range of nodes with one pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepRange {
    /// Shader variant.
    pub variant: ThermalVariant,
    /// First group of four nodes and the one after the last.
    pub groups: (u32, u32),
    /// Joint of the nodes; 0 is the body.
    pub joint: u32,
}

impl StepKind {
    /// Whether nodes keep a state between steps.
    pub fn has_state(self) -> bool {
        !matches!(self, Self::Instant | Self::Absorb)
    }

    /// Whether that state has three numbers, not only the rest of the temperature.
    pub(crate) fn has_full_state(self) -> bool {
        self.has_state() && !matches!(self, Self::Radiative { over: false, .. })
    }

    /// Whether the nodes follow a transition.
    pub(crate) fn is_transition(self) -> bool {
        matches!(self, Self::Merge | Self::Restart | Self::Advance)
    }

    pub(crate) fn words(self) -> &'static [&'static str] {
        match self {
            Self::Instant => &["instant"],
            Self::Merge => &["merge"],
            Self::Restart => &["restart"],
            Self::Advance => &["advance"],
            Self::Radiative { over: false, fast: false } => &["radiative"],
            Self::Radiative { over: false, fast: true } => &["radiative", "fast"],
            Self::Radiative { over: true, fast: false } => &["radiative", "over"],
            Self::Radiative { over: true, fast: true } => &["radiative", "over", "fast"],
            Self::Absorb => &["absorb"],
        }
    }
}

impl LightBy {
    /// Words of the shaders: whether there are lit area vectors, and whether they come from rays.
    pub(crate) fn words(self) -> [(bool, &'static str); 2] {
        [(self != Self::Normal, "lit"), (self == Self::Rays, "by_rays")]
    }
}

impl Curve {
    pub(crate) fn words(self) -> &'static [&'static str] {
        match self {
            Self::Power => &[],
            Self::Shaped { fourth_power: false } => &["shaped"],
            Self::Shaped { fourth_power: true } => &["shaped", "fourth_power"],
        }
    }
}

impl ThermalVariant {
    /// The smallest variant for a step: without Sun in umbra, without albedo over the night side.
    pub(crate) fn for_step(self, has_sun: bool, has_albedo: bool) -> Self {
        let albedo = self.albedo && has_albedo;
        let sun = self.sun && (has_sun || albedo);
        Self { sun, albedo, light: if has_sun { self.light } else { LightBy::Normal }, ..self }
    }

    /// The fused variant. It is `None` without a state, where only the last step counts, and for variants without a
    /// load.
    pub fn fused(self) -> Option<Self> {
        let loaded = self.kind.has_state() && self.kind != StepKind::Advance;
        loaded.then_some(Self { fused: true, ..self })
    }

    /// The variant for a step whose load has not changed. A plate needs its load in every step.
    pub(crate) fn idle(&self) -> Self {
        if self.kind.is_transition() && !self.exchange { Self::bare(StepKind::Advance, self.curve) } else { *self }
    }

    /// A variant of a response without any load, for nodes that exchange heat on one side.
    pub const fn bare(kind: StepKind, curve: Curve) -> Self {
        Self {
            kind,
            curve,
            both_sides: false,
            sun: false,
            planet_ir: false,
            albedo: false,
            tumble: false,
            light: LightBy::Normal,
            exchange: false,
            fused: false,
        }
    }

    /// The variant that settles the same nodes at the start of a run.
    pub(crate) fn settling(&self) -> Self {
        Self { kind: StepKind::Instant, curve: Curve::Power, exchange: false, fused: false, ..*self }
    }
}
