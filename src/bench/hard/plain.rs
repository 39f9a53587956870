//! Simple code on the processor that replaces the remedies. Each method is written in its textbook form.

use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::network::{Network, NodeKind, radiated};

/// The remedy that a plain transition omits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Omission {
    /// Time may pass t_max.
    Clamp,
    /// A new target keeps the phase of the running curve in either direction. A node at rest starts a curve.
    FreshStart,
    /// There is no check for t_max = 0 before the division.
    Immediate,
    /// The temperature is evaluated before time advances.
    AdvanceFirst,
    /// Any change of the target starts a new curve.
    Merge,
}

/// Temperatures [K] in f64 after every step, for a power of the remaining time, with one remedy left out.
pub(crate) fn transition(power: i32, t_max: f64, initial: f64, targets: &[f32], omitted: Omission) -> Vec<f64> {
    let (mut old, mut target, mut elapsed, mut now) = (initial, initial, t_max, initial);
    let left = |elapsed: f64| {
        let r = if omitted != Omission::Immediate && t_max == 0.0 { 0.0 } else { 1.0 - elapsed / t_max };
        if r < 0.0 && omitted != Omission::Clamp { 0.0 } else { r }
    };
    let step = |commanded: &f32| {
        let commanded = f64::from(*commanded);
        if commanded != target {
            if omitted == Omission::FreshStart && left(elapsed) > 0.0 {
                target = commanded;
            } else {
                let curve = target - (target - old) * left(elapsed).powi(power);
                // A new curve starts at the temperature that was read last, if the start was read.
                let present = if omitted == Omission::AdvanceFirst { now } else { curve };
                (old, target, elapsed) = (present, commanded, 0.0);
            }
        }
        let read = if omitted == Omission::AdvanceFirst { elapsed } else { elapsed + 1.0 };
        now = target - (target - old) * left(read).powi(power);
        elapsed += 1.0;
        now
    };
    targets.iter().map(step).collect()
}

/// The merge rule of docs/numerics.md 1 in f32. The state is only the old temperature, the target and the elapsed
/// steps. The span is computed as their difference.
pub(crate) fn merge_f32(power: i32, t_max: f32, initial: f32, targets: &[f32]) -> Vec<f64> {
    let (mut old, mut target, mut elapsed) = (initial, initial, t_max);
    let step = |commanded: &f32| {
        let d = commanded - target;
        if d != 0.0 {
            let span = target - old;
            let mut r = (1.0 - elapsed / t_max).max(0.0);
            let u = span * r.powi(power) + d;
            let q = if r > 0.0 { span * r.powi(power - 1) } else { 0.0 } + d;
            target = *commanded;
            let span = if u * q <= 0.0 || q.abs() < u.abs() {
                elapsed = 0.0;
                u
            } else {
                r = u / q;
                elapsed = t_max * (1.0 - r);
                u / r.powi(power)
            };
            old = target - span;
        }
        elapsed = (elapsed + 1.0).min(t_max);
        let w = (1.0 - elapsed / t_max).powi(power);
        f64::from(if elapsed == t_max { target } else { old * w + target * (1.0 - w) })
    };
    targets.iter().map(step).collect()
}

/// A simple step in f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlainStep {
    /// Forward Euler.
    Euler,
    /// Each node relaxes exponentially towards its balance with the neighbours before the step.
    Exponential,
    /// Forward Euler for nodes that store heat. Each arithmetic node is balanced once, with the neighbours before the
    /// step.
    OneSweep,
}

/// Equal steps in f64 under constant heat. Returns the unchecked temperatures [K] after each step.
pub(crate) fn steps(network: &Network, heat: &[f64], step: f64, count: u32, kind: PlainStep) -> Vec<Vec<f64>> {
    let mut now = network.temperatures.clone();
    let mut rows = Vec::new();
    for _ in 0..count {
        let mut gained = vec![0.0; now.len()];
        network.exchanged_heat(&now, &mut gained);
        let mut sums = vec![0.0; now.len()];
        for conductor in &network.linear {
            for node in conductor.nodes {
                sums[node as usize] += conductor.conductance;
            }
        }
        for node in 0..now.len() {
            let gain = gained[node] + heat[node];
            now[node] += match (network.kinds[node], kind) {
                (NodeKind::Boundary, _) => 0.0,
                (NodeKind::Arithmetic, _) => gain / sums[node],
                (NodeKind::Diffusive, PlainStep::Exponential) => {
                    gain / sums[node] * -(-sums[node] * step / network.capacitances[node]).exp_m1()
                }
                (NodeKind::Diffusive, PlainStep::Euler | PlainStep::OneSweep) => {
                    step * gain / network.capacitances[node]
                }
            };
        }
        rows.push(now.clone());
    }
    rows
}

/// Forward Euler at its stability limit for a body that only radiates: its temperature [K] at a time [s].
pub(crate) fn cooling_at_the_bound(capacitance: f64, area: f64, space: f64, from: f64, times: &[f64]) -> Vec<f64> {
    let (mut now, mut t) = (from, 0.0);
    let mut temperatures = Vec::new();
    for time in times {
        while t < *time {
            // dt lambda = 1 with lambda = 2 x 4 e sigma T^3 / C (docs/numerics.md 3).
            let bound = capacitance / (8.0 * area * STEFAN_BOLTZMANN * now.powi(3));
            let step = bound.min(time - t);
            now += step * area * radiated(space, now) / capacitance;
            t += step;
        }
        temperatures.push(now);
    }
    temperatures
}
