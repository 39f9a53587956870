//! Tries that are taken back: a shorter sub-step, or the reason why none is short enough.

use super::{Control, ControlError, PlannedTry, RATE_AGE, STIFFEST};
use crate::thermal::network::stepper::StepMethod;
use crate::thermal::network::{LinearConductor, Network, NodeKind};

/// Shortest sub-step [s].
const SHORTEST: f64 = 1e-18;

impl<W: FnMut(f64) -> bool> Control<'_, W> {
    pub(super) fn reject(&mut self, plan: PlannedTry, error: f64) -> Result<(), ControlError> {
        self.series.rejected += 1;
        self.rate_age = RATE_AGE;
        if plan.method == StepMethod::Euler {
            self.euler_pause = 64;
            return Ok(());
        }
        let factor = if error.is_finite() { (0.8 * (self.limit / error).cbrt()).clamp(0.05, 0.8) } else { 0.1 };
        self.step = plan.step * factor;
        if self.heat.since + self.step > self.heat.since && self.step > SHORTEST {
            return Ok(());
        }
        if let Some((rate, [a, b], conductance)) = stiffest(self.network).filter(|(rate, ..)| *rate > STIFFEST) {
            return Err(ControlError::Stiff { time: self.now(), nodes: [a as usize, b as usize], conductance, rate });
        }
        let temperatures = self.stepper.temperatures();
        let coldest = temperatures.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
        let (node, temperature) = coldest.map_or((0, 0.0), |(node, temperature)| (node, *temperature));
        Err(ControlError::NoStep { time: self.now(), node, temperature })
    }
}

/// The linear conductor with the greatest GL over the capacitance of one of its nodes [1/s], with its nodes and GL [W/K].
fn stiffest(network: &Network) -> Option<(f64, [u32; 2], f64)> {
    let rate = |conductor: &LinearConductor| {
        let stores = |node: &u32| network.kinds[*node as usize] == NodeKind::Diffusive;
        let capacitances =
            conductor.nodes.iter().filter(|node| stores(node)).map(|node| network.capacitances[*node as usize]);
        conductor.conductance / capacitances.fold(f64::INFINITY, f64::min)
    };
    let rates = network.linear.iter().map(|conductor| (rate(conductor), conductor.nodes, conductor.conductance));
    rates.max_by(|a, b| a.0.total_cmp(&b.0))
}
