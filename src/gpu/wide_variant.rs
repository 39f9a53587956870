//! Shader variants of `network_wide.comp` and `network_solve.comp`, the passes over a network.

use super::shaders::Shader;

/// Work of a pass over a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WideKind {
    /// Computes the rates at the start.
    Begin,
    /// Rebases temperatures and computes the first stage.
    First,
    /// Computes a later stage.
    Stage,
    /// Balances the arithmetic nodes without an arithmetic neighbour.
    Lone,
    /// Computes the rates at the end and the error.
    Last,
    /// Stores the sensor temperatures.
    Sense,
    /// Starts a sub-step of TR-BDF2.
    Start,
    /// Computes residual and diagonal of a steady balance.
    Balance,
    /// Computes residual and diagonal of a TR-BDF2 stage.
    Residual,
    /// Multiplies the solver's matrix by a vector.
    Product,
    /// Sums the partial results and decides how the solver continues.
    Scalars,
    /// Updates the vectors of the solver.
    Update,
    /// Adds the solution to the temperatures.
    Move,
    /// Stores the change of the first TR-BDF2 stage.
    Middle,
    /// Computes the error of TR-BDF2.
    Estimate,
}

/// A variant of the shaders for networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct WideVariant {
    /// Work.
    pub kind: WideKind,
    /// Whether nodes exchange heat by radiation. It is false if the work does not depend on it.
    pub radiative: bool,
    /// Whether some nodes have more conductors than a row holds. It is false if the work does not depend on it.
    pub tails: bool,
}

impl WideKind {
    /// All kinds in order, each with its word and whether it reads the conductors.
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

    /// Whether it reads the conductors of its nodes.
    pub fn evaluates(self) -> bool {
        Self::ALL[self as usize].2
    }
}

impl WideVariant {
    /// The variant for a network.
    pub fn of(kind: WideKind, radiative: bool, tails: bool) -> Self {
        Self { kind, radiative: radiative && kind.evaluates(), tails: tails && kind.evaluates() }
    }

    /// Its shader, such as `network_wide.stage.radiative`.
    pub fn shader(&self) -> Shader {
        let entry = if self.kind < WideKind::Start { "network_wide.comp" } else { "network_solve.comp" };
        let mut words = vec![WideKind::ALL[self.kind as usize].1];
        words.extend(self.radiative.then_some("radiative"));
        words.extend(self.tails.then_some("tails"));
        Shader::new(entry, words)
    }
}
