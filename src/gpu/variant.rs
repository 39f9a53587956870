//! The variants of `thermal_step.comp`, `response.comp` and the fused networks' shader: what is not needed is absent from a
//! pipeline.

use super::shaders::Shader;

/// What moves the nodes of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum StepKind {
    /// The balance temperature of the step; also how every node is settled at the start.
    Instant,
    /// Transition, merge rule.
    Merge,
    /// Transition, restart rule.
    Restart,
    /// Transition whose target has not moved: time passes, no load is read.
    Advance,
    /// The flux that a thermal network takes in [W/m2], in place of a temperature.
    Absorb,
}

/// How the curve of a transition is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Curve {
    /// A power of the remaining time; also where there is no transition.
    Power,
    /// Any function, in pieces.
    Shaped {
        /// Whether it moves the fourth power of the temperature.
        fourth_power: bool,
    },
}

/// One variant of the thermal step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ThermalVariant {
    /// What moves the nodes.
    pub kind: StepKind,
    /// How their transition is evaluated.
    pub curve: Curve,
    /// Whether the back exchanges heat too.
    pub both_sides: bool,
    /// Sunlight.
    pub sun: bool,
    /// Planet infrared.
    pub planet_ir: bool,
    /// Reflected sunlight; only with a Sun.
    pub albedo: bool,
    /// The craft's shadow on itself; only with a Sun.
    pub shadow: bool,
    /// Whether a dispatch takes many steps, each under its own load.
    pub fused: bool,
}

/// One variant of the response to given targets: the transition of a thermal step alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResponseVariant {
    /// `Merge` or `Restart`.
    pub kind: StepKind,
    /// How the transition is evaluated.
    pub curve: Curve,
}

impl ResponseVariant {
    /// What is compiled.
    pub fn shader(&self) -> Shader {
        let words = [self.kind.word()].into_iter().chain(self.curve.words().iter().copied());
        Shader::new("response.comp", words.collect())
    }
}

/// What a fused kernel of a network does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FusedKind {
    /// Euler and RKL2.
    Explicit {
        /// Whether nodes exchange heat by radiation.
        radiative: bool,
        /// Whether arithmetic nodes are coupled to each other.
        elimination: bool,
    },
    /// TR-BDF2.
    Implicit,
    /// Puts nodes into balance.
    Settle,
}

/// One variant of the fused kernels of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FusedVariant {
    /// What it does.
    pub kind: FusedKind,
    /// Invocations of its workgroup: one of [`FusedVariant::LANES`].
    pub lanes: u32,
}

impl FusedVariant {
    /// Sizes of the workgroup.
    pub const LANES: [u32; 3] = [8, 64, 256];

    /// What is compiled.
    pub fn shader(&self) -> Shader {
        let (word, radiative, elimination) = match self.kind {
            FusedKind::Explicit { radiative, elimination } => ("explicit", radiative, elimination),
            FusedKind::Implicit => ("implicit", false, false),
            FusedKind::Settle => ("settle", false, false),
        };
        let lanes = match self.lanes {
            8 => "lanes_8",
            64 => "lanes_64",
            _ => "lanes_256",
        };
        let words = [(true, word), (radiative, "radiative"), (elimination, "elimination"), (true, lanes)];
        Shader::new("network_fused.comp", present(&words).collect())
    }
}

impl StepKind {
    /// Whether nodes keep a state between steps in the buffers of a transition.
    pub fn has_state(self) -> bool {
        !matches!(self, Self::Instant | Self::Absorb)
    }

    fn word(self) -> &'static str {
        match self {
            Self::Instant => "instant",
            Self::Merge => "merge",
            Self::Restart => "restart",
            Self::Advance => "advance",
            Self::Absorb => "absorb",
        }
    }
}

impl Curve {
    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Power => &[],
            Self::Shaped { fourth_power: false } => &["shaped"],
            Self::Shaped { fourth_power: true } => &["shaped", "fourth_power"],
        }
    }
}

/// The words that are present.
fn present(words: &[(bool, &'static str)]) -> impl Iterator<Item = &'static str> {
    words.iter().filter_map(|(present, word)| present.then_some(*word))
}

impl ThermalVariant {
    /// What is compiled, such as `thermal_step.merge.sun.planet_ir.albedo.both_sides`.
    pub fn shader(&self) -> Shader {
        let switches = [
            (self.fused, "fused"),
            (self.sun, "sun"),
            (self.planet_ir, "planet_ir"),
            (self.albedo, "albedo"),
            (self.shadow, "shadow"),
            (self.both_sides, "both_sides"),
        ];
        let words = [self.kind.word()].into_iter().chain(self.curve.words().iter().copied()).chain(present(&switches));
        Shader::new("thermal_step.comp", words.collect())
    }

    /// The least variant that still computes a step: in umbra there is no Sun, in the dark no albedo.
    pub fn for_step(self, has_sun: bool, has_albedo: bool) -> Self {
        let albedo = self.albedo && has_albedo;
        let sun = self.sun && (has_sun || albedo);
        Self { sun, albedo, shadow: self.shadow && has_sun, ..self }
    }

    /// The same with many steps in a dispatch; `None` of what keeps no state, where only the last step counts, and of what
    /// reads no load.
    pub fn fused(self) -> Option<Self> {
        matches!(self.kind, StepKind::Merge | StepKind::Restart).then_some(Self { fused: true, ..self })
    }

    /// The same nodes under the load that commanded them last: time alone passes.
    pub fn idle(&self) -> Self {
        Self::advance(self.curve)
    }

    /// Time passes without a load.
    fn advance(curve: Curve) -> Self {
        let kind = StepKind::Advance;
        Self {
            kind,
            curve,
            both_sides: false,
            sun: false,
            planet_ir: false,
            albedo: false,
            shadow: false,
            fused: false,
        }
    }

    /// What settles the same nodes at the start.
    pub fn settling(&self) -> Self {
        Self { kind: StepKind::Instant, curve: Curve::Power, fused: false, ..*self }
    }
}
