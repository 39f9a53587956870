//! Thermal inertia: how a node's temperature moves towards a target that may itself move (NUMERICS.md 1).
//!
//! A transition is `T = target - span w(r)`, where r is the share of its time that is left, w falls from w(1) = 1 to
//! w(0) = 0, and `span` is the distance from the origin to the target. Equations 1 to 4 of Vural et al. 2023 are
//! w = r (linear) and w = r^2 (quadratic); [`crate::thermal::function`] has the others. In the domain T4 the same holds
//! of (T / 100 K)^4 in place of T.
//!
//! Under the rule `merge` a target that moves by d leaves the gap u = g + d, with g = span w(r). Where the gap keeps its
//! direction the same curve goes on, with the share r' = u / (g / r + d) of its time left and the span u / w(r'): the
//! temperature goes on without a jump. Of a power the rate is that of both steps together, since g / r is the rate of the
//! curve under way; of another function it is near to that. r' / (1 - r') grows as the gap does: a change of the target
//! and its reverse cancel, its parts come to the same, and the limit of short steps exists for every function. Where the gap
//! does not keep its direction, or none was left, the transition is a fresh one from the present temperature, so that heating
//! and cooling may differ in function and in `t_max`. Between two commands T moves along one curve that falls to the target:
//! it never overshoots it and never turns back.

use crate::thermal::material::{Profile, Retarget, Transition};

#[cfg(test)]
mod tests;
#[cfg(test)]
mod walks;

/// What a node remembers between steps, in units of the transition's domain: K, or (100 K)^4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransitionState {
    /// What was last commanded.
    pub target: f64,
    /// `target` less the effective origin of the curve under way; positive while heating.
    pub span: f64,
    /// Time since that origin [steps]; the duration of the branch once settled.
    pub elapsed: f64,
}

impl TransitionState {
    /// A node at rest at a temperature [K].
    pub fn settled(temperature: f64, transition: &Transition) -> Self {
        let target = transition.domain.of(temperature);
        Self { target, span: 0.0, elapsed: transition.heating.duration() }
    }
}

/// The branch that a span runs on: heating where it is zero or positive.
pub fn branch(span: f64, transition: &Transition) -> &Profile {
    if span >= 0.0 { &transition.heating } else { &transition.cooling }
}

/// Share of a duration that is left; 0 where it is 0.
pub fn remaining_time(elapsed: f64, duration: f64) -> f64 {
    if duration > 0.0 { (1.0 - elapsed / duration).max(0.0) } else { 0.0 }
}

/// The state after a target is commanded (in units of the domain), before time advances.
pub fn retarget(state: TransitionState, commanded: f64, transition: &Transition) -> TransitionState {
    let change = commanded - state.target;
    if change == 0.0 {
        return state;
    }
    let profile = branch(state.span, transition);
    let duration = profile.duration();
    let r = remaining_time(state.elapsed, duration);
    // What is over has no gap, whatever rounding leaves of the function's end.
    let left = if r > 0.0 { state.span * profile.remaining(r) } else { 0.0 };
    let gap = left + change;
    if transition.retarget == Retarget::Merge && left * gap > 0.0 {
        let merged = (r / (left / gap + change / gap * r)).min(1.0);
        // Where the curve is too flat at its end for a span to reach the gap from there, the phase is kept.
        for phase in [merged, r] {
            let span = gap / profile.remaining(phase);
            if span.is_finite() {
                return TransitionState { target: commanded, span, elapsed: duration * (1.0 - phase) };
            }
        }
    }
    TransitionState { target: commanded, span: gap, elapsed: 0.0 }
}

/// Share of its time with no more than which left a transition is over: 2^-22.
///
/// A linear transition ends at full rate. Where its target moves on evenly, whether a step ends just before the end or on
/// it decides whether the next finds that rate again, and in exact arithmetic it often ends on it: rounding must not
/// decide. The step that this takes is 2.4e-7 of the span at most, of a linear transition.
const OVER: f64 = 1.0 / (1 << 22) as f64;

/// The state `steps_dt` steps later; time stops at the end of the branch.
pub fn advance(state: TransitionState, steps_dt: f64, transition: &Transition) -> TransitionState {
    let duration = branch(state.span, transition).duration();
    let elapsed = state.elapsed + steps_dt;
    TransitionState { elapsed: if elapsed < duration * (1.0 - OVER) { elapsed } else { duration }, ..state }
}

/// The temperature of a state [K]: the target once the branch has ended.
pub fn temperature(state: TransitionState, transition: &Transition) -> f64 {
    let profile = branch(state.span, transition);
    let r = remaining_time(state.elapsed, profile.duration());
    transition.domain.temperature(state.target - state.span * profile.remaining(r))
}

/// One step: retarget to a temperature [K], advance, read. Returns the new state and its temperature [K].
pub fn transition_step(
    state: TransitionState,
    commanded: f64,
    steps_dt: f64,
    transition: &Transition,
) -> (TransitionState, f64) {
    let state = advance(retarget(state, transition.domain.of(commanded), transition), steps_dt, transition);
    (state, temperature(state, transition))
}
