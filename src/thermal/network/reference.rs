//! The f64 twin of the device's network: every method of `Stepper`, one sub-step at a time.

use std::convert::Infallible;

use super::newton::Newton;
use super::stepper::{Attempt, Method, Stepper, WorkCounts};
use super::{Network, NodeKind, rkl2, tr_bdf2};

/// Pseudo-times [s] over which a steady state is approached where Newton's method does not reach it at once.
const PSEUDO_TIMES: [f64; 12] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8, 1e12];

/// Power and slope of the heat of every node.
#[derive(Debug, Clone, Default)]
pub(super) struct Heat {
    power: Vec<f64>,
    slope: Vec<f64>,
}

/// What does not change in a sub-step.
#[derive(Debug, Clone)]
pub(super) struct System {
    pub(super) network: Network,
    pub(super) heat: Heat,
    /// Balances of the arithmetic nodes.
    arithmetic: Newton,
    /// Balances of all nodes but boundaries; `None` until a method asks for them, for their matrix is large.
    all: Option<Newton>,
    pub(super) counts: WorkCounts,
}

impl System {
    /// Heat into every node [W]: its own at `t` and what it exchanges.
    pub(super) fn heat(&mut self, t: f64, temperatures: &[f64], out: &mut [f64]) {
        self.counts.stages += 1;
        heat(&self.network, &self.heat, t, temperatures, out);
    }

    /// dT/dt of diffusive nodes [K/s]; 0 for the others.
    pub(super) fn rate(&mut self, t: f64, temperatures: &[f64], out: &mut [f64]) {
        self.heat(t, temperatures, out);
        for (node, rate) in out.iter_mut().enumerate() {
            *rate = match self.network.kinds[node] {
                NodeKind::Diffusive => *rate / self.network.capacitances[node],
                NodeKind::Arithmetic | NodeKind::Boundary => 0.0,
            };
        }
    }

    /// Balances the arithmetic nodes at `t`, all together. Returns whether they do.
    pub(super) fn balance(&mut self, t: f64, temperatures: &mut [f64]) -> bool {
        if self.arithmetic.is_empty() {
            return true;
        }
        let (network, own) = (&self.network, &self.heat);
        let found = self.arithmetic.find(network, temperatures, |_| 0.0, |now, out| heat(network, own, t, now, out));
        self.counts.iterations += std::mem::take(&mut self.arithmetic.iterations);
        found
    }

    /// Seeks the temperatures at which C (T - T0) = span (W(T) + heat at `t`) for diffusive nodes, with `base` [W] =
    /// C T0 / span, and the balance of arithmetic ones.
    pub(super) fn implicit(&mut self, t: f64, span: f64, base: &[f64], temperatures: &mut [f64]) -> bool {
        let mut all = self.take_all();
        let (network, own) = (&self.network, &self.heat);
        let found = all.find(
            network,
            temperatures,
            |node| network.capacitances[node] / span,
            |now, out| {
                heat(network, own, t, now, out);
                for (node, out) in out.iter_mut().enumerate() {
                    if network.kinds[node] == NodeKind::Diffusive {
                        *out += network.capacitances[node] / span * (base[node] - now[node]);
                    }
                }
            },
        );
        self.put_all(all);
        found
    }

    /// Balances of all nodes but boundaries, made where they are not yet; to be given back by `put_all`.
    pub(super) fn take_all(&mut self) -> Newton {
        let network = &self.network;
        self.all.take().unwrap_or_else(|| Newton::new(network, |node| network.kinds[node] != NodeKind::Boundary))
    }

    pub(super) fn put_all(&mut self, mut all: Newton) {
        self.counts.iterations += std::mem::take(&mut all.iterations);
        self.all = Some(all);
    }
}

fn heat(network: &Network, own: &Heat, t: f64, temperatures: &[f64], out: &mut [f64]) {
    network.exchanged_heat(temperatures, out);
    for ((out, power), slope) in out.iter_mut().zip(&own.power).zip(&own.slope) {
        *out += power + slope * t;
    }
}

/// A network in f64.
#[derive(Debug, Clone)]
pub struct ReferenceStepper {
    system: System,
    sensors: Vec<usize>,
    kept: State,
    tried: State,
}

/// Temperatures, and their rates where these are known.
#[derive(Debug, Clone, Default)]
pub(super) struct State {
    pub(super) temperatures: Vec<f64>,
    /// dT/dt at `temperatures` [K/s].
    pub(super) rates: Vec<f64>,
    rates_known: bool,
}

impl ReferenceStepper {
    /// The network at its temperatures, without heat; `sensors` are the nodes that [`Attempt::sensed`] reports.
    pub fn new(network: Network, sensors: &[u32]) -> Self {
        let nothing = vec![0.0; network.len()];
        let kept = State { temperatures: network.temperatures.clone(), rates: nothing.clone(), rates_known: false };
        let arithmetic = Newton::new(&network, |node| network.kinds[node] == NodeKind::Arithmetic);
        let heat = Heat { power: nothing.clone(), slope: nothing };
        let system = System { network, heat, arithmetic, all: None, counts: WorkCounts::default() };
        Self { system, sensors: sensors.iter().map(|sensor| *sensor as usize).collect(), tried: kept.clone(), kept }
    }

    /// One sub-step from `tried`; the estimate of its error [K], infinite where it fails.
    fn sub_step(&mut self, method: Method, t: f64, step: f64) -> f64 {
        let state = &mut self.tried;
        if !state.rates_known {
            self.system.rate(t, &state.temperatures, &mut state.rates);
            state.rates_known = true;
        }
        self.system.counts.sub_steps += 1;
        let error = match method {
            Method::Euler => euler(&mut self.system, t, step, state),
            Method::Rkl2 { stages } => rkl2::step(&mut self.system, t, step, stages, state),
            Method::TrBdf2 => tr_bdf2::step(&mut self.system, t, step, state),
        };
        error.filter(|error| error.is_finite() && in_range(&state.temperatures)).unwrap_or(f64::INFINITY)
    }
}

/// Whether the network is defined at all temperatures.
pub(super) fn in_range(temperatures: &[f64]) -> bool {
    temperatures.iter().all(|temperature| temperature.is_finite() && *temperature >= 0.0)
}

/// Forward Euler. Its residual is what f32 loses; f64 loses nothing that matters. The error is h/2 dF.
fn euler(system: &mut System, t: f64, step: f64, state: &mut State) -> Option<f64> {
    for (temperature, rate) in state.temperatures.iter_mut().zip(&state.rates) {
        *temperature += step * rate;
    }
    if !in_range(&state.temperatures) || !system.balance(t + step, &mut state.temperatures) {
        return None;
    }
    let before = state.rates.clone();
    system.rate(t + step, &state.temperatures, &mut state.rates);
    Some(before.iter().zip(&state.rates).map(|(a, b)| (0.5 * step * (b - a)).abs()).fold(0.0, f64::max))
}

impl Stepper for ReferenceStepper {
    type Error = Infallible;

    fn set_heat(&mut self, power: &[f64], slope: &[f64]) -> Result<(), Infallible> {
        self.system.heat = Heat { power: power.to_vec(), slope: slope.to_vec() };
        self.kept.rates_known = false;
        Ok(())
    }

    fn balance(&mut self, t: f64) -> Result<bool, Infallible> {
        self.kept.rates_known = false;
        let mut temperatures = self.kept.temperatures.clone();
        let found = self.system.balance(t, &mut temperatures);
        if found {
            self.kept.temperatures = temperatures;
        }
        Ok(found)
    }

    fn attempt(&mut self, method: Method, t: f64, step: f64, count: u32) -> Result<Attempt, Infallible> {
        self.tried.clone_from(&self.kept);
        let mut attempt = Attempt::default();
        for sub_step in 0..count {
            let error = self.sub_step(method, t + f64::from(sub_step) * step, step);
            attempt.error = attempt.error.max(error);
            attempt.sensed.extend(self.sensors.iter().map(|sensor| self.tried.temperatures[*sensor]));
            if attempt.error.is_infinite() {
                break;
            }
        }
        Ok(attempt)
    }

    fn keep(&mut self) -> Result<(), Infallible> {
        std::mem::swap(&mut self.kept, &mut self.tried);
        Ok(())
    }

    fn temperatures(&mut self) -> Result<Vec<f64>, Infallible> {
        Ok(self.kept.temperatures.clone())
    }

    fn set_temperatures(&mut self, temperatures: &[f64]) -> Result<(), Infallible> {
        self.kept.temperatures = temperatures.to_vec();
        self.kept.rates_known = false;
        Ok(())
    }

    fn steady(&mut self, t: f64) -> Result<bool, Infallible> {
        self.kept.rates_known = false;
        let mut all = self.system.take_all();
        let (network, own) = (&self.system.network, &self.system.heat);
        let balance = |now: &[f64], out: &mut [f64]| heat(network, own, t, now, out);
        let mut temperatures = self.kept.temperatures.clone();
        let mut found = all.find(network, &mut temperatures, |_| 0.0, balance);
        if !found {
            // From afar, the path that a network of equal capacitances would take in ever longer implicit steps.
            temperatures.clone_from(&self.kept.temperatures);
            for span in PSEUDO_TIMES {
                let before = temperatures.clone();
                let step = |now: &[f64], out: &mut [f64]| {
                    balance(now, out);
                    for ((out, before), now) in out.iter_mut().zip(&before).zip(now) {
                        *out += (before - now) / span;
                    }
                };
                if !all.find(network, &mut temperatures, |_| 1.0 / span, step) {
                    temperatures = before;
                }
            }
            found = all.find(network, &mut temperatures, |_| 0.0, balance);
        }
        self.system.put_all(all);
        if found && in_range(&temperatures) {
            self.kept.temperatures = temperatures;
            return Ok(true);
        }
        Ok(false)
    }

    fn counts(&self) -> WorkCounts {
        self.system.counts
    }
}
