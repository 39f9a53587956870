//! Thermal inertia: the movement of a node's temperature towards a target that may itself move (docs/numerics.md 1).
//!
//! A transition is `T = target - span w(r)`. r is the share of its time left. w falls from w(1) = 1 to w(0) = 0. `span` is the distance from the origin to
//! the target. Equations 1 to 4 of Vural et al. 2023 are w = r (linear) and w = r^2 (quadratic). [`crate::thermal::function`] has the others. In the domain
//! T4 the same holds for (T / 100 K)^4.
//!
//! Under the rule `merge`, a target that moves by d leaves the gap u = g + d, with g = span w(r). If the gap keeps its direction, the same curve continues
//! with the share r' = u / (g / r + d) of its time left and the span u / w(r'). The temperature does not jump. For a power the new rate is the sum of the
//! rates of both changes, because g / r is proportional to the rate of the curve under way. For other functions this holds approximately. r' / (1 - r')
//! grows in proportion to the gap. Therefore a change and its reverse cancel, the parts of a change add up to the change, and short steps converge for
//! every function. If the gap changes direction, or no gap was left, a new transition starts at the present temperature. Heating and cooling may differ in
//! function and in `t_max`. Between two changes of the target T moves along one monotonic curve and never overshoots.

use crate::thermal::material::{Domain, Profile, Retarget, Transition};

#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod walks_tests;

/// Distance [K] from the stored target beyond which the rule `restart` counts a target as moved. The device takes this value too.
///
/// A restart changes the curve by a finite amount, however small the move. So device and reference must agree on the size of a move. f32 resolves
/// 3e-5 K at 300 K and 6e-5 K at 1000 K, and a balance temperature on the device varies by a few of these. This is 23 and 11 of them. Moves of round
/// size, such as 0.5 mK and 1 mK, lie several of them below and above. A slow drift is not lost, because the stored target stays until the drift from
/// it counts.
pub(crate) const MOVED: f64 = 7e-4;

/// State of a node between steps, in units of the transition's domain: K, or (100 K)^4.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TransitionState {
    /// Last target.
    pub target: f64,
    /// `target` minus the effective origin of the present curve, positive while heating.
    pub span: f64,
    /// Time since that origin [steps], the duration of the branch once settled.
    pub elapsed: f64,
}

impl TransitionState {
    /// A node at rest at a temperature [K].
    pub fn settled(temperature: f64, transition: &Transition) -> Self {
        let target = transition.domain.of(temperature);
        Self { target, span: 0.0, elapsed: transition.heating.duration() }
    }
}

/// The branch of a span: heating where the span is zero or positive.
pub(crate) fn branch(span: f64, transition: &Transition) -> &Profile {
    if span >= 0.0 { &transition.heating } else { &transition.cooling }
}

/// Share of a duration that is left. 0 where the duration is 0.
pub(crate) fn remaining_time(elapsed: f64, duration: f64) -> f64 {
    if duration > 0.0 { (1.0 - elapsed / duration).max(0.0) } else { 0.0 }
}

/// Whether a target counts as unmoved under `restart`. Both are in units of the domain. NaN counts as moved, so that it shows.
fn stays(present: f64, commanded: f64, domain: Domain) -> bool {
    (domain.temperature(commanded) - domain.temperature(present)).abs() <= MOVED
}

/// The state after a new target (in units of the domain), before time advances.
pub(crate) fn retarget(state: TransitionState, commanded: f64, transition: &Transition) -> TransitionState {
    let change = commanded - state.target;
    if change == 0.0 || transition.retarget == Retarget::Restart && stays(state.target, commanded, transition.domain) {
        return state;
    }
    let profile = branch(state.span, transition);
    let duration = profile.duration();
    let r = remaining_time(state.elapsed, duration);
    // A finished transition has no gap, even if its function rounds to more than 0 at the end.
    let left = if r > 0.0 { state.span * profile.remaining(r) } else { 0.0 };
    let gap = left + change;
    if transition.retarget == Retarget::Merge && left * gap > 0.0 {
        let merged = (r / (left / gap + change / gap * r)).min(1.0);
        // The phase is kept where the curve is too flat at its end for any span to produce the gap.
        for phase in [merged, r] {
            let span = gap / profile.remaining(phase);
            if span.is_finite() {
                return TransitionState { target: commanded, span, elapsed: duration * (1.0 - phase) };
            }
        }
    }
    TransitionState { target: commanded, span: gap, elapsed: 0.0 }
}

/// Share of its time left at which a transition counts as finished: 2^-22.
///
/// A linear transition ends at full rate. When its target moves on evenly, a step often ends exactly at the end in exact arithmetic. The next step
/// would then find this rate or not, depending on rounding. This threshold decides it. The threshold moves a linear transition by at most 2.4e-7 of
/// its span.
const OVER: f64 = 1.0 / (1 << 22) as f64;

/// The state `steps_dt` steps later. Time stops at the end of the branch.
pub(crate) fn advance(state: TransitionState, steps_dt: f64, transition: &Transition) -> TransitionState {
    let duration = branch(state.span, transition).duration();
    let elapsed = state.elapsed + steps_dt;
    TransitionState { elapsed: if elapsed < duration * (1.0 - OVER) { elapsed } else { duration }, ..state }
}

/// The temperature of a state [K], the target once the branch has ended.
pub fn temperature(state: TransitionState, transition: &Transition) -> f64 {
    let profile = branch(state.span, transition);
    let r = remaining_time(state.elapsed, profile.duration());
    transition.domain.temperature(state.target - state.span * profile.remaining(r))
}

/// One step: set the target [K], advance, read. Returns the new state and its temperature [K].
pub fn transition_step(
    state: TransitionState,
    commanded: f64,
    steps_dt: f64,
    transition: &Transition,
) -> (TransitionState, f64) {
    let state = advance(retarget(state, transition.domain.of(commanded), transition), steps_dt, transition);
    (state, temperature(state, transition))
}
