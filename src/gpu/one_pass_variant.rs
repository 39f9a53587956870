//! Shader variants of `one_pass.comp` and `one_pass_stage.comp`, the step of a thermal network in one pass.

use super::shaders::Shader;
use crate::thermal::network::one_pass::EstimatePart;

/// Work of a dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OnePassKind {
    /// Nodes without conductors take the whole step.
    Alone,
    /// Nodes without capacity take the temperatures of their balance.
    Balance,
    /// Other nodes outside blocks take the whole step.
    Advance,
    /// Computes what the nodes of blocks receive.
    Drive,
    /// Conduction inside the blocks.
    Conduct,
}

/// A variant of `one_pass.comp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OnePassVariant {
    /// Work.
    pub kind: OnePassKind,
    /// Whether the temperatures stay, because the step is taken to learn its change.
    pub trial: bool,
    /// Its part in the estimate of the error.
    pub sample: EstimatePart,
    /// Whether the drawn nodes take the temperatures.
    pub shown: bool,
    /// Whether nodes radiate to each other.
    pub radiative: bool,
    /// Whether the local step takes the closed form.
    pub fast: bool,
    /// Whether the conduction is that of large blocks, which stages found.
    pub large: bool,
}

impl OnePassVariant {
    /// The variant without switches that its work does not depend on.
    pub fn lean(self) -> Self {
        let (drives, conducts) = (self.kind == OnePassKind::Drive, self.kind == OnePassKind::Conduct);
        let (alone, balances) = (self.kind == OnePassKind::Alone, self.kind == OnePassKind::Balance);
        let shown = self.shown && !drives && !self.trial;
        let sampled = !(self.trial || alone || balances || conducts && self.sample == EstimatePart::Note);
        Self {
            trial: self.trial && !balances,
            sample: if sampled { self.sample } else { EstimatePart::None },
            shown,
            radiative: self.radiative && !conducts && !alone || balances,
            fast: self.fast && !conducts && !balances,
            large: self.large && conducts,
            ..self
        }
    }

    /// Every variant in any scene.
    pub fn all() -> Vec<Self> {
        let kinds =
            [OnePassKind::Alone, OnePassKind::Balance, OnePassKind::Advance, OnePassKind::Drive, OnePassKind::Conduct];
        let mut all: Vec<Self> = kinds
            .into_iter()
            .flat_map(|kind| {
                let samples = [EstimatePart::None, EstimatePart::Note, EstimatePart::Estimate];
                samples.into_iter().flat_map(move |sample| {
                    (0..32).map(move |bits| {
                        let is = |bit: u32| bits >> bit & 1 == 1;
                        let [trial, shown, radiative, fast, large] = [0, 1, 2, 3, 4].map(is);
                        Self { kind, trial, sample, shown, radiative, fast, large }.lean()
                    })
                })
            })
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Its shader, such as `one_pass.advance.shown.radiative`.
    pub fn shader(&self) -> Shader {
        let kind = match self.kind {
            OnePassKind::Alone => "alone",
            OnePassKind::Balance => "balance",
            OnePassKind::Advance => "advance",
            OnePassKind::Drive => "drive",
            OnePassKind::Conduct => "conduct",
        };
        let words = [
            (true, kind),
            (self.large, "large"),
            (self.trial, "trial"),
            (self.sample == EstimatePart::Note, "note"),
            (self.sample == EstimatePart::Estimate, "estimate"),
            (self.shown, "shown"),
            (self.radiative, "radiative"),
            (self.fast, "fast"),
        ];
        Shader::new("one_pass.comp", words.into_iter().filter_map(|(is, word)| is.then_some(word)).collect())
    }
}

/// A variant of `one_pass_stage.comp`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StageVariant {
    /// Whether it makes the first vector.
    pub begins: bool,
    /// Whether the estimated errors spread too.
    pub estimates: bool,
}

impl StageVariant {
    /// Every variant.
    pub fn all() -> Vec<Self> {
        [false, true].into_iter().flat_map(|begins| [false, true].map(|estimates| Self { begins, estimates })).collect()
    }

    /// Its shader, such as `one_pass_stage.begin.estimate`.
    pub fn shader(self) -> Shader {
        let words = [(self.begins, "begin"), (self.estimates, "estimate")];
        let words = words.into_iter().filter_map(|(is, word)| is.then_some(word)).collect();
        Shader::new("one_pass_stage.comp", words)
    }
}
