//! The variants of `network_wide.comp` and `network_solve.comp`: a pass over the nodes of a large network each.

/// A pass over the nodes of a large network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WideKind {
    /// Rates at the start.
    Begin,
    /// Rebases, and the first stage.
    First,
    /// Any other stage.
    Stage,
    /// Balances arithmetic nodes that have no arithmetic neighbour.
    Lone,
    /// Rates at the end, and the error.
    Last,
    /// The sensors.
    Sense,
    /// The start of a sub-step of TR-BDF2.
    Start,
    /// Residual and diagonal of balances without stored heat.
    Balance,
    /// Residual and diagonal of a stage of TR-BDF2.
    Residual,
    /// The matrix of the solver times a vector.
    Product,
    /// What the solver decides.
    Scalars,
    /// The vectors of the solver.
    Update,
    /// The solution is added to the temperatures.
    Move,
    /// The change of the first stage of TR-BDF2.
    Middle,
    /// The error of TR-BDF2.
    Estimate,
}

/// One variant of the wide kernels of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct WideVariant {
    /// What it does.
    pub kind: WideKind,
    /// Whether nodes exchange heat by radiation; false where that is of no matter.
    pub radiative: bool,
    /// Whether some nodes have more conductors than a row holds; likewise.
    pub tails: bool,
}

impl WideKind {
    /// All of them.
    const ALL: [Self; 15] = [
        Self::Begin,
        Self::First,
        Self::Stage,
        Self::Lone,
        Self::Last,
        Self::Sense,
        Self::Start,
        Self::Balance,
        Self::Residual,
        Self::Product,
        Self::Scalars,
        Self::Update,
        Self::Move,
        Self::Middle,
        Self::Estimate,
    ];

    /// Whether it goes through the conductors of its nodes.
    pub fn evaluates(self) -> bool {
        matches!(
            self,
            Self::Begin
                | Self::Stage
                | Self::Lone
                | Self::Last
                | Self::Start
                | Self::Balance
                | Self::Residual
                | Self::Product
                | Self::Estimate
        )
    }

    /// Preprocessor definitions that select it, its own name first.
    fn defines(self) -> Vec<&'static str> {
        match self {
            Self::Begin => vec!["BEGIN", "GATHERS"],
            Self::First => vec!["FIRST"],
            Self::Stage => vec!["STAGE", "GATHERS"],
            Self::Lone => vec!["LONE", "GATHERS", "SUMS", "MOVES", "LISTED"],
            Self::Last => vec!["LAST", "GATHERS", "SUMS"],
            Self::Sense => vec!["SENSE", "GATHERS"],
            Self::Start => vec!["START", "GATHERS", "HERE"],
            Self::Balance => vec!["BALANCE", "GATHERS", "SUMS", "HERE", "RIGHT_SIDE", "LISTED"],
            Self::Residual => vec!["RESIDUAL", "GATHERS", "SUMS", "HERE", "STEPS", "RIGHT_SIDE", "LISTED"],
            Self::Product => vec!["PRODUCT", "REDUCES", "LISTED"],
            Self::Scalars => vec!["SCALARS", "REDUCES"],
            Self::Update => vec!["UPDATE", "LISTED"],
            Self::Move => vec!["MOVE", "MOVES", "HERE", "REDUCES", "LISTED"],
            Self::Middle => vec!["MIDDLE", "HERE", "STEPS", "LISTED"],
            Self::Estimate => vec!["ESTIMATE", "GATHERS", "HERE", "STEPS", "LISTED"],
        }
    }
}

impl WideVariant {
    /// Every variant.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for kind in WideKind::ALL {
            for (radiative, tails) in [(false, false), (true, false), (false, true), (true, true)] {
                all.push(Self::of(kind, radiative, tails));
            }
        }
        all.dedup();
        all
    }

    /// The variant for a network with or without radiative conductors and long rows.
    pub fn of(kind: WideKind, radiative: bool, tails: bool) -> Self {
        Self { kind, radiative: radiative && kind.evaluates(), tails: tails && kind.evaluates() }
    }

    /// Shader that it is a variant of.
    pub fn entry(&self) -> &'static str {
        if self.kind < WideKind::Start { "network_wide.comp" } else { "network_solve.comp" }
    }

    /// Name of the compiled file without `.spv`: `network_wide.stage.radiative`.
    pub fn name(&self) -> String {
        let word = self.defines()[0].to_lowercase();
        let entry = self.entry().trim_end_matches(".comp");
        let radiative = if self.radiative { ".radiative" } else { "" };
        format!("{entry}.{word}{radiative}{}", if self.tails { ".tails" } else { "" })
    }

    /// Preprocessor definitions that select it.
    pub fn defines(&self) -> Vec<&'static str> {
        let mut defines = self.kind.defines();
        defines.extend(self.radiative.then_some("RADIATIVE"));
        defines.extend(self.tails.then_some("TAILS"));
        defines
    }
}
