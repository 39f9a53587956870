//! The compiled variants of `thermal_step.comp`, `response.comp` and the networks' shaders: what is not needed is absent from a pipeline.
//!
//! Powers are compiled ahead (`spirv/`); what moves along other functions is compiled when the scene that has them loads.

/// What moves the nodes of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum StepKind {
    /// The balance temperature of the tick; also how every node is settled at the start.
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
    /// Whether a dispatch takes many ticks, each under its own load.
    pub fused: bool,
}

/// One variant of the response to given targets: the transition of a thermal step alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResponseVariant {
    /// `Merge` or `Restart`.
    pub kind: StepKind,
    /// How the transition is evaluated.
    pub curve: Curve,
}

impl ResponseVariant {
    /// Every variant that is compiled ahead.
    pub fn all() -> Vec<Self> {
        [StepKind::Merge, StepKind::Restart].map(|kind| Self { kind, curve: Curve::Power }).to_vec()
    }

    /// Name of the compiled file without `.spv`: `response.merge`.
    pub fn name(&self) -> String {
        format!("response.{}{}", self.kind.word(), self.curve.suffix())
    }

    /// Preprocessor definitions that select it.
    pub fn defines(&self) -> Vec<&'static str> {
        let mut defines = vec![if self.kind == StepKind::Restart { "RESTART" } else { "MERGE" }];
        defines.extend(self.curve.defines());
        defines
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

    /// Every variant.
    pub fn all() -> Vec<Self> {
        let mut kinds = vec![FusedKind::Implicit, FusedKind::Settle];
        for radiative in [false, true] {
            kinds.extend([false, true].map(|elimination| FusedKind::Explicit { radiative, elimination }));
        }
        kinds.into_iter().flat_map(|kind| Self::LANES.map(|lanes| Self { kind, lanes })).collect()
    }

    /// Name of the compiled file without `.spv`: `network_fused.explicit.radiative.64`.
    pub fn name(&self) -> String {
        let words = match self.kind {
            FusedKind::Explicit { radiative, elimination } => {
                let radiative = if radiative { ".radiative" } else { "" };
                format!("explicit{radiative}{}", if elimination { ".elimination" } else { "" })
            }
            FusedKind::Implicit => "implicit".to_owned(),
            FusedKind::Settle => "settle".to_owned(),
        };
        format!("network_fused.{words}.{}", self.lanes)
    }

    /// Preprocessor definitions that select it.
    pub fn defines(&self) -> Vec<&'static str> {
        let (word, radiative, elimination) = match self.kind {
            FusedKind::Explicit { radiative, elimination } => ("EXPLICIT", radiative, elimination),
            FusedKind::Implicit => ("IMPLICIT", true, true),
            FusedKind::Settle => ("SETTLE", true, true),
        };
        let mut defines = vec![word];
        if radiative {
            defines.push("RADIATIVE");
        }
        if elimination {
            defines.push("ELIMINATION");
        }
        defines.push(match self.lanes {
            8 => "LANES_8",
            64 => "LANES_64",
            _ => "LANES_256",
        });
        defines
    }
}

impl StepKind {
    /// Whether nodes keep a state between ticks in the buffers of a transition.
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
    fn suffix(self) -> &'static str {
        match self {
            Self::Power => "",
            Self::Shaped { fourth_power: false } => ".shaped",
            Self::Shaped { fourth_power: true } => ".shaped_t4",
        }
    }

    /// Preprocessor definitions that select it.
    pub fn defines(self) -> &'static [&'static str] {
        match self {
            Self::Power => &[],
            Self::Shaped { fourth_power: false } => &["SHAPED"],
            Self::Shaped { fourth_power: true } => &["SHAPED", "FOURTH_POWER"],
        }
    }
}

impl ThermalVariant {
    /// Every variant that is compiled ahead: those of powers.
    pub fn all() -> Vec<Self> {
        Self::all_of(Curve::Power)
    }

    /// Every variant of a curve that a scene can ask for.
    pub fn all_of(curve: Curve) -> Vec<Self> {
        let mut all = vec![Self::advance(curve)];
        let stateless: &[StepKind] = if curve == Curve::Power { &[StepKind::Instant, StepKind::Absorb] } else { &[] };
        for kind in stateless.iter().copied().chain([StepKind::Merge, StepKind::Restart]) {
            for both_sides in [false, true] {
                for (sun, planet_ir, albedo) in [
                    (false, false, false),
                    (true, false, false),
                    (false, true, false),
                    (true, true, false),
                    (true, false, true),
                    (true, true, true),
                ] {
                    let plain = Self { kind, curve, both_sides, sun, planet_ir, albedo, shadow: false, fused: false };
                    let shadowed = sun.then_some(Self { shadow: true, ..plain });
                    let unfused = [Some(plain), shadowed].into_iter().flatten();
                    all.extend(unfused.flat_map(|variant| [Some(variant), variant.fused()]).flatten());
                }
            }
        }
        all
    }

    /// The least variant that still computes a tick: in umbra there is no Sun, in the dark no albedo.
    pub fn for_tick(self, has_sun: bool, has_albedo: bool) -> Self {
        let albedo = self.albedo && has_albedo;
        let sun = self.sun && (has_sun || albedo);
        Self { sun, albedo, shadow: self.shadow && has_sun, ..self }
    }

    /// The same with many ticks in a dispatch; `None` of what keeps no state, where only the last tick counts, and of what
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

    /// Name of the compiled file without `.spv`: `thermal_step.merge.sun.planet_ir.albedo.both_sides`.
    pub fn name(&self) -> String {
        let mut name = format!("thermal_step.{}{}", self.kind.word(), self.curve.suffix());
        for (present, word) in self.switches() {
            if present {
                name.push('.');
                name.push_str(word);
            }
        }
        name
    }

    /// Preprocessor definitions that select it.
    pub fn defines(&self) -> Vec<&'static str> {
        let mut defines = match self.kind {
            StepKind::Instant => vec!["COMMAND"],
            StepKind::Absorb => vec!["COMMAND", "ABSORB"],
            StepKind::Merge => vec!["COMMAND", "TRANSITION", "MERGE"],
            StepKind::Restart => vec!["COMMAND", "TRANSITION", "RESTART"],
            StepKind::Advance => vec!["TRANSITION"],
        };
        defines.extend(self.curve.defines());
        let words = ["FUSED", "SUN", "PLANET_IR", "ALBEDO", "SHADOW", "BOTH_SIDES"];
        for ((present, _), word) in self.switches().into_iter().zip(words) {
            if present {
                defines.push(word);
            }
        }
        defines
    }

    fn switches(&self) -> [(bool, &'static str); 6] {
        [
            (self.fused, "fused"),
            (self.sun, "sun"),
            (self.planet_ir, "planet_ir"),
            (self.albedo, "albedo"),
            (self.shadow, "shadow"),
            (self.both_sides, "both_sides"),
        ]
    }
}
