//! Thermal inertia: how a node's temperature moves towards a target that may itself move (NUMERICS.md 1).
//!
//! A transition is `T = target - span w(r)`, where r is the share of its time that is left, w falls from w(1) = 1 to
//! w(0) = 0, and `span` is the distance from the origin to the target. Equations 1 to 4 of Vural et al. 2023 are
//! w = r (linear) and w = r^2 (quadratic).

use crate::thermal::material::{Function, Profile, Retarget};

#[cfg(test)]
mod tests;

/// What a node remembers between ticks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransitionState {
    /// Temperature that was last commanded [K].
    pub target: f64,
    /// `target` less the effective origin of the curve under way [K]; positive while heating.
    pub span: f64,
    /// Time since that origin [steps]; `t_max_steps` of the branch once settled.
    pub elapsed: f64,
}

impl TransitionState {
    /// A node at rest at a temperature [K].
    pub fn settled(temperature: f64, heating: &Profile) -> Self {
        Self { target: temperature, span: 0.0, elapsed: heating.t_max_steps }
    }
}

/// The shape of a curve, as all that the retarget rules need of it.
impl Function {
    /// Share w of the span that is left when the share `r` of the time is left.
    pub fn remaining(self, r: f64) -> f64 {
        match self {
            Function::Linear => r,
            Function::Quadratic => r * r,
        }
    }

    /// How fast that share falls, dw/dr, in spans over `t_max`; 0 once the curve has ended (r = 0).
    pub fn rate(self, r: f64) -> f64 {
        match self {
            Function::Linear if r > 0.0 => 1.0,
            Function::Linear => 0.0,
            Function::Quadratic => 2.0 * r,
        }
    }

    /// The r in (0, 1] at which a curve of this shape has this gap to its target [K] and closes it at this rate
    /// [K over `t_max`]; `None` where the two differ in sign or the curve is nowhere so slow.
    ///
    /// For w = r^p the relative rate is p/r, so r = p gap / rate: the `u/q` of NUMERICS.md 1, whose q is `rate/p`.
    pub fn matching_phase(self, gap: f64, rate: f64) -> Option<f64> {
        let power = match self {
            Function::Linear => 1.0,
            Function::Quadratic => 2.0,
        };
        if gap * rate <= 0.0 || rate.abs() < power * gap.abs() {
            return None;
        }
        Some(power * gap / rate)
    }
}

/// The branch that a span runs on: heating where it is zero or positive.
pub fn branch<'a>(span: f64, heating: &'a Profile, cooling: &'a Profile) -> &'a Profile {
    if span >= 0.0 { heating } else { cooling }
}

/// Share of the time that is left; 0 where `t_max_steps` is 0.
pub fn remaining_time(elapsed: f64, t_max_steps: f64) -> f64 {
    if t_max_steps > 0.0 { (1.0 - elapsed / t_max_steps).max(0.0) } else { 0.0 }
}

/// The state after a target [K] is commanded, before time advances (NUMERICS.md 1).
///
/// `Merge` adds the new step's gap and rate to those of the curve under way and goes on from the point of the same
/// curve that has both, so that T and its rate are continuous; where there is none (a change of direction) it starts
/// afresh from the present temperature, as `Restart` does at every change.
pub fn retarget(
    state: TransitionState,
    commanded: f64,
    heating: &Profile,
    cooling: &Profile,
    rule: Retarget,
) -> TransitionState {
    let change = commanded - state.target;
    if change == 0.0 {
        return state;
    }
    let Profile { function, t_max_steps } = *branch(state.span, heating, cooling);
    let r = remaining_time(state.elapsed, t_max_steps);
    let gap = state.span * function.remaining(r) + change;
    let phase = match rule {
        Retarget::Merge => function.matching_phase(gap, state.span * function.rate(r) + change * function.rate(1.0)),
        Retarget::Restart => None,
    };
    match phase {
        Some(r) => {
            TransitionState { target: commanded, span: gap / function.remaining(r), elapsed: t_max_steps * (1.0 - r) }
        }
        None => TransitionState { target: commanded, span: gap, elapsed: 0.0 },
    }
}

/// The state `steps_dt` steps later; time stops at the end of the branch.
pub fn advance(state: TransitionState, steps_dt: f64, heating: &Profile, cooling: &Profile) -> TransitionState {
    let t_max_steps = branch(state.span, heating, cooling).t_max_steps;
    TransitionState { elapsed: (state.elapsed + steps_dt).min(t_max_steps), ..state }
}

/// The temperature of a state [K]: exactly the target once the branch has ended.
pub fn temperature(state: TransitionState, heating: &Profile, cooling: &Profile) -> f64 {
    let Profile { function, t_max_steps } = *branch(state.span, heating, cooling);
    let r = remaining_time(state.elapsed, t_max_steps);
    state.target - state.span * function.remaining(r)
}

/// One tick: retarget, advance, read. Returns the new state and its temperature [K].
pub fn transition_step(
    state: TransitionState,
    commanded: f64,
    steps_dt: f64,
    heating: &Profile,
    cooling: &Profile,
    rule: Retarget,
) -> (TransitionState, f64) {
    let state = advance(retarget(state, commanded, heating, cooling, rule), steps_dt, heating, cooling);
    (state, temperature(state, heating, cooling))
}
