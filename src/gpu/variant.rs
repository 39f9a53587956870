//! The compiled variants of `thermal_step.comp`: what a scene does not have is absent from its pipeline.
//!
//! Plain data without dependencies: the shader compiler in `tools/` includes this file to know what to compile.

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
}

/// One variant of the thermal step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ThermalVariant {
    /// What moves the nodes.
    pub kind: StepKind,
    /// Whether the back exchanges heat too.
    pub both_sides: bool,
    /// Sunlight.
    pub sun: bool,
    /// Planet infrared.
    pub planet_ir: bool,
    /// Reflected sunlight; only with a Sun.
    pub albedo: bool,
}

impl ThermalVariant {
    /// Every variant that a scene can ask for.
    pub fn all() -> Vec<Self> {
        let advance = Self { kind: StepKind::Advance, both_sides: false, sun: false, planet_ir: false, albedo: false };
        let mut all = vec![advance];
        for kind in [StepKind::Instant, StepKind::Merge, StepKind::Restart] {
            for both_sides in [false, true] {
                for (sun, planet_ir, albedo) in [
                    (false, false, false),
                    (true, false, false),
                    (false, true, false),
                    (true, true, false),
                    (true, false, true),
                    (true, true, true),
                ] {
                    all.push(Self { kind, both_sides, sun, planet_ir, albedo });
                }
            }
        }
        all
    }

    /// The least variant that still computes a tick: in umbra there is no Sun, in the dark no albedo.
    pub fn for_tick(self, has_sun: bool, has_albedo: bool) -> Self {
        let albedo = self.albedo && has_albedo;
        Self { sun: self.sun && (has_sun || albedo), albedo, ..self }
    }

    /// Name of the compiled file without `.spv`: `thermal_step.merge.sun.planet_ir.albedo.both_sides`.
    pub fn name(&self) -> String {
        let kind = match self.kind {
            StepKind::Instant => "instant",
            StepKind::Merge => "merge",
            StepKind::Restart => "restart",
            StepKind::Advance => "advance",
        };
        let mut name = format!("thermal_step.{kind}");
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
            StepKind::Merge => vec!["COMMAND", "TRANSITION", "MERGE"],
            StepKind::Restart => vec!["COMMAND", "TRANSITION", "RESTART"],
            StepKind::Advance => vec!["TRANSITION"],
        };
        let words = ["SUN", "PLANET_IR", "ALBEDO", "BOTH_SIDES"];
        for ((present, _), word) in self.switches().into_iter().zip(words) {
            if present {
                defines.push(word);
            }
        }
        defines
    }

    fn switches(&self) -> [(bool, &'static str); 4] {
        [(self.sun, "sun"), (self.planet_ir, "planet_ir"), (self.albedo, "albedo"), (self.both_sides, "both_sides")]
    }
}
