//! TR-BDF2: the trapezoidal rule over the share gamma of a sub-step, then BDF2 over the whole (Bank et al., IEEE Trans. CAD 4, 1985). Form and error
//! estimate follow the ESDIRK method of Hosea & Shampine, Appl. Numer. Math. 20, 1996, 21.

use super::NodeKind;
use super::system::{System, SystemState, in_range};

/// gamma = 2 - sqrt 2. With this gamma both implicit stages have the same matrix.
pub(crate) const GAMMA: f64 = 2.0 - std::f64::consts::SQRT_2;
/// gamma / 2: weight of a stage's own rate.
pub(crate) const DIAGONAL: f64 = 0.5 * GAMMA;
/// sqrt 2 / 4: weight of the first two rates in the result.
pub(crate) const WEIGHT: f64 = std::f64::consts::SQRT_2 / 4.0;

/// Takes a sub-step. Returns the estimate of its error [K], or `None` where it fails.
///
/// The estimate is the difference from the embedded method of order 3. One solution with the matrix of the stages keeps fast components from
/// exaggerating the difference, and extends it to arithmetic nodes.
pub(super) fn step(system: &mut System, t: f64, step: f64, state: &mut SystemState) -> Option<f64> {
    let start = state.temperatures.clone();
    let size = start.len();
    let span = DIAGONAL * step;

    let base: Vec<f64> = (0..size).map(|node| start[node] + span * state.rates[node]).collect();
    if !system.implicit(t + GAMMA * step, span, &base, &mut state.temperatures) || !in_range(&state.temperatures) {
        return None;
    }
    let diffusive = |node: usize| system.network.kinds[node] == NodeKind::Diffusive;
    // The rates are computed from the stages. Evaluated directly, they would contain the residual of Newton's method times the stiffness.
    let middle: Vec<f64> = (0..size)
        .map(|node| if diffusive(node) { (state.temperatures[node] - base[node]) / span } else { 0.0 })
        .collect();
    let base: Vec<f64> =
        (0..size).map(|node| start[node] + step * WEIGHT * (state.rates[node] + middle[node])).collect();

    for (temperature, start) in state.temperatures.iter_mut().zip(&start) {
        *temperature += (*temperature - start) * (1.0 - GAMMA) / GAMMA;
    }
    if !in_range(&state.temperatures) {
        state.temperatures.clone_from(&start);
    }
    if !system.implicit(t + step, span, &base, &mut state.temperatures) || !in_range(&state.temperatures) {
        return None;
    }
    let mut error = vec![0.0; size];
    for node in 0..size {
        if system.network.kinds[node] != NodeKind::Diffusive {
            continue;
        }
        let last = (state.temperatures[node] - base[node]) / span;
        let rates = (4.0 * WEIGHT - 1.0) / 3.0 * state.rates[node] - middle[node] / 3.0 + 2.0 / 3.0 * DIAGONAL * last;
        error[node] = system.network.capacitances[node] / span * step * rates;
        state.rates[node] = last;
    }
    system.counts.stages += 2;
    let mut all = system.take_all();
    let network = &system.network;
    let capacity =
        |node: usize| if network.kinds[node] == NodeKind::Diffusive { network.capacitances[node] / span } else { 0.0 };
    let factored = all.factor(network, &state.temperatures, capacity);
    if factored {
        all.solve(&mut error);
    }
    system.put_all(all);
    if !factored {
        return None;
    }
    Some(error.iter().map(|error| error.abs()).fold(0.0, f64::max))
}
