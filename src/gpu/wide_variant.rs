//! The variants of `network_wide.comp` and `network_solve.comp`: a pass over the nodes of a large network each.

use super::shaders::Shader;

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
    /// All of them in order: the word of each, and whether it goes through the conductors of its nodes.
    pub const ALL: [(Self, &'static str, bool); 15] = [
        (Self::Begin, "begin", true),
        (Self::First, "first", false),
        (Self::Stage, "stage", true),
        (Self::Lone, "lone", true),
        (Self::Last, "last", true),
        (Self::Sense, "sense", false),
        (Self::Start, "start", true),
        (Self::Balance, "balance", true),
        (Self::Residual, "residual", true),
        (Self::Product, "product", true),
        (Self::Scalars, "scalars", false),
        (Self::Update, "update", false),
        (Self::Move, "move", false),
        (Self::Middle, "middle", false),
        (Self::Estimate, "estimate", true),
    ];

    /// Whether it goes through the conductors of its nodes.
    pub fn evaluates(self) -> bool {
        Self::ALL[self as usize].2
    }
}

impl WideVariant {
    /// The variant for a network with or without radiative conductors and long rows.
    pub fn of(kind: WideKind, radiative: bool, tails: bool) -> Self {
        Self { kind, radiative: radiative && kind.evaluates(), tails: tails && kind.evaluates() }
    }

    /// What is compiled, such as `network_wide.stage.radiative`.
    pub fn shader(&self) -> Shader {
        let entry = if self.kind < WideKind::Start { "network_wide.comp" } else { "network_solve.comp" };
        let mut words = vec![WideKind::ALL[self.kind as usize].1];
        words.extend(self.radiative.then_some("radiative"));
        words.extend(self.tails.then_some("tails"));
        Shader::new(entry, words)
    }
}
