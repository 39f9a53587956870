//! Where the heat that nodes absorb is found, which selects the shader that sums it.

use super::shaders::Shader;

/// Where the absorbed heat of nodes is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum HeatOf {
    /// In their temperatures, which are those of balance: an instant response.
    Balance,
    /// In their targets: a transition.
    Target,
    /// In the flux that stands in the place of their temperatures: a network before its step.
    Flux,
}

impl HeatOf {
    /// Its shader.
    pub fn shader(self) -> Shader {
        let words = match self {
            Self::Balance => vec![],
            Self::Target => vec!["target"],
            Self::Flux => vec!["flux"],
        };
        Shader::new("absorbed_heat.comp", words)
    }
}
