//! The plan of the one pass for a network and one length of step: weak conductors by node, and the matrices of the blocks.

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::blocks::{Division, Unfit};
use super::conduction::{BlockKind, Conduction};
use super::halving::HALVINGS_AT_MOST;
use super::large::Large;
use super::order::ordered;
use super::rows::{ExchangeLink, ExchangeRows};
use super::series::ChebyshevSeries;
use crate::thermal::local_step as local;
use crate::thermal::network::{Network, NodeKind, radiative_slope};

/// Excess of a length over whole steps that is rounding.
const ROUNDING: f64 = 1e-6;
const PLANS_AT_MOST: usize = 4;
/// Relative difference up to which two blocks are copies of each other.
const ALIKE: f64 = 1e-5;

/// Nodes that conduct to each other exactly.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    /// The nodes. Nodes that conduct to each other stand close.
    pub(crate) nodes: Vec<u32>,
    pub(crate) conduction: u32,
    /// Mean capacitance of its nodes [J/K].
    pub(crate) capacitance: f64,
}

/// The parts of a plan that do not depend on the length of a step.
#[derive(Debug)]
struct PlanBase {
    network: Network,
    /// Longest step [s].
    longest: f64,
    /// How often the step of the scene was halved for it.
    halvings: u32,
    blocks: Vec<Block>,
    kinds: Vec<BlockKind>,
    weak: ExchangeRows,
    large: Option<Large>,
    /// Greatest rate of radiation of each node [1/s]. 0 without a capacity.
    fading: Vec<f64>,
}

/// A network ready for steps of one length.
#[derive(Debug)]
pub struct OnePassPlan {
    shape: Arc<PlanBase>,
    step: f64,
    conductions: Vec<Conduction>,
    series: Option<ChebyshevSeries>,
}

impl OnePassPlan {
    /// Prepares a network for steps of at most `step` [s]. No node is expected to be hotter than its value in `hottest`
    /// [K].
    ///
    /// # Errors
    /// The reason why one pass can not take the network.
    pub(crate) fn new(network: &Network, step: f64, hottest: &[f64]) -> Result<Arc<Self>, Unfit> {
        Self::halved(network, step, hottest, 0)
    }

    pub(super) fn halved(network: &Network, step: f64, hottest: &[f64], halvings: u32) -> Result<Arc<Self>, Unfit> {
        let step = step / f64::from(1u32 << halvings);
        let division = Division::new(network, step, hottest)?;
        let (blocks, kinds) = kinds(network, &division);
        let linear = network.linear.iter().zip(&division.inside);
        let weak = linear.filter(|(_, inside)| !**inside).map(|(one, _)| one);
        let rate = |node: usize| match network.kinds[node] {
            NodeKind::Diffusive => {
                network.emissive_areas[node] * radiative_slope(hottest[node]) / network.capacitances[node]
            }
            NodeKind::Arithmetic | NodeKind::Boundary => 0.0,
        };
        let fading = (0..network.len()).map(rate).collect();
        let shape = PlanBase {
            network: network.clone(),
            longest: step,
            halvings,
            blocks,
            kinds,
            weak: ExchangeRows::new(network.len(), weak, &network.radiative),
            large: Large::new(network, &division),
            fading,
        };
        Ok(Self::of_shape(&Arc::new(shape), step))
    }

    /// A plan of the longest steps, among `step` [s], its half, its quarter and its eighth, that one pass can take.
    ///
    /// # Errors
    /// The reason why one pass can not take the network in steps of `step`.
    pub(crate) fn fitting(network: &Network, step: f64, hottest: &[f64]) -> Result<Arc<Self>, Unfit> {
        Self::new(network, step, hottest).or_else(|unfit| {
            let parts = if unfit.depends_on_the_step() { 1..=HALVINGS_AT_MOST } else { 0..=0 };
            let shorter = |halvings| Self::halved(network, step, hottest, halvings).ok();
            parts.into_iter().find_map(shorter).ok_or(unfit)
        })
    }

    fn of_shape(shape: &Arc<PlanBase>, step: f64) -> Arc<Self> {
        let conductions = shape.kinds.par_iter().map(|kind| Conduction::new(kind, step)).collect();
        let series = shape.large.as_ref().map(|large| ChebyshevSeries::new(step * large.fastest));
        Arc::new(Self { shape: Arc::clone(shape), step, conductions, series })
    }

    pub(crate) fn network(&self) -> &Network {
        &self.shape.network
    }

    /// Length of a step [s].
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// The longest step for which the blocks were found [s].
    pub(crate) fn longest(&self) -> f64 {
        self.shape.longest
    }

    /// How often the step of the scene was halved so that the network fits.
    pub fn halvings(&self) -> u32 {
        self.shape.halvings
    }

    /// Runge-Kutta steps in a local step of the fastest node.
    pub(crate) fn local_steps(&self) -> u32 {
        let fastest = self.shape.fading.iter().copied().fold(0.0, f64::max);
        (self.step * fastest / local::SHARE).ceil().max(f64::from(local::SLOW_STEPS)) as u32
    }

    /// Whether a node takes the closed form in its local step, because Runge-Kutta steps would not do for the longest step.
    pub(crate) fn is_fast(&self, node: usize) -> bool {
        self.shape.longest * self.shape.fading[node] > f64::from(local::SLOW_STEPS) * local::SHARE
    }

    /// Whether a node stores no heat.
    pub(crate) fn is_massless(&self, node: usize) -> bool {
        self.network().kinds[node] == NodeKind::Arithmetic
    }

    pub(crate) fn blocks(&self) -> &[Block] {
        &self.shape.blocks
    }

    pub(crate) fn conductions(&self) -> &[Conduction] {
        &self.conductions
    }

    /// The exchanges of a node outside its block.
    pub(crate) fn weak_of(&self, node: usize) -> &[ExchangeLink] {
        self.shape.weak.of(node)
    }

    /// The large blocks, where there are any.
    pub fn large(&self) -> Option<&Large> {
        self.shape.large.as_ref()
    }

    /// How large blocks conduct, where there are any.
    pub(crate) fn series(&self) -> Option<&ChebyshevSeries> {
        self.series.as_ref()
    }

    /// Change of a node in a step [K] by 1 W that goes to nodes by their shares. The node's own heat and the conduction inside its block count.
    pub(crate) fn response(&self, node: usize, shares: &[(u32, f64)]) -> f64 {
        let direct = |node: usize, share: f64| match self.network().capacitances[node] {
            0.0 => 0.0,
            capacitance => self.step * share / capacitance,
        };
        let heated = shares.iter().filter(|(heated, _)| *heated as usize == node);
        let heat: f64 = heated.map(|(_, share)| direct(node, *share)).sum();
        if let (Some(large), Some(series)) = (self.large(), &self.series)
            && let Some(place) = large.place(node as u32)
        {
            let mut vector = vec![0.0; large.nodes().len()];
            for (heated, share) in shares {
                if let Some(at) = large.place(*heated) {
                    vector[at] += direct(*heated as usize, *share);
                }
            }
            return series.apply(vector, |vector| large.rates(self.network(), self.step, vector))[place];
        }
        let place_in = |block: &Block, node: u32| block.nodes.iter().position(|one| *one == node);
        let in_block = self.blocks().iter().find_map(|block| Some((block, place_in(block, node as u32)?)));
        let Some((block, row)) = in_block else { return heat };
        let conduction = &self.conductions[block.conduction as usize];
        let factor = block.capacitance / self.network().capacitances[node];
        // The change by conduction acts on differences to the node.
        let gained: f64 = shares
            .iter()
            .filter_map(|(heated, share)| {
                let [drive, _] = conduction.at(row, place_in(block, *heated)?);
                Some(drive * direct(*heated as usize, *share))
            })
            .sum();
        let [first, end] = conduction.columns(row);
        let all: f64 = (first..end).map(|column| conduction.at(row, column)[0]).sum();
        heat + factor * (gained - heat * all)
    }

    /// Number of weights of all blocks, with copies.
    pub(crate) fn weights(&self) -> usize {
        self.blocks().iter().map(|block| block.nodes.len().pow(2)).sum()
    }

    /// The change of each node by conduction inside its block [K], from its change by the heat received in the step and its temperature at the start
    /// [K].
    pub(super) fn conduct(&self, drives: &[f64], starts: &[f64], out: &mut [f64]) {
        for block in self.blocks() {
            let conduction = &self.conductions[block.conduction as usize];
            for (row, node) in block.nodes.iter().map(|node| *node as usize).enumerate() {
                let mut sum = 0.0;
                let [first, end] = conduction.columns(row);
                for column in first..end {
                    let [of_drive, of_start] = conduction.at(row, column);
                    let other = block.nodes[column] as usize;
                    sum += of_drive * (drives[other] - drives[node]) + of_start * (starts[other] - starts[node]);
                }
                out[node] = sum * block.capacitance / self.network().capacitances[node];
            }
        }
        let (Some(large), Some(series)) = (self.large(), &self.series) else { return };
        let of_large =
            |values: &[f64]| -> Vec<f64> { large.nodes().iter().map(|node| values[*node as usize]).collect() };
        let rates = |vector: &[f64]| large.rates(self.network(), self.step, vector);
        let (drives, lost) = (of_large(drives), rates(&of_large(starts)));
        let changes = series.apply(drives.iter().zip(&lost).map(|(drive, lost)| drive - lost).collect(), rates);
        for ((node, change), drive) in large.nodes().iter().zip(changes).zip(drives) {
            out[*node as usize] = change - drive;
        }
    }
}

/// A plan, and the plans of other lengths of step that were used last.
#[derive(Debug, Clone)]
pub(crate) struct Plans(Vec<Arc<OnePassPlan>>);

impl Plans {
    /// The plan of the longest step.
    pub(crate) fn new(plan: &Arc<OnePassPlan>) -> Self {
        Self(vec![Arc::clone(plan)])
    }

    /// Divides a length [s] into equal steps that are not longer than the longest, and each of these into `parts`. Returns the plan of these steps and
    /// their number.
    pub(crate) fn over(&mut self, length: f64, parts: u32) -> (Arc<OnePassPlan>, u32) {
        let count = (length / self.0[0].longest() - ROUNDING).ceil().max(1.0) * f64::from(parts);
        let step = length / count;
        let known = self.0.iter().find(|plan| (plan.step / step - 1.0).abs() < ROUNDING).map(Arc::clone);
        let plan = known.unwrap_or_else(|| {
            // The plan of the longest step stays.
            self.0.truncate(PLANS_AT_MOST - 1);
            self.0.insert(1, OnePassPlan::of_shape(&self.0[0].shape, step));
            Arc::clone(&self.0[1])
        });
        (plan, count as u32)
    }
}

fn kinds(network: &Network, division: &Division) -> (Vec<Block>, Vec<BlockKind>) {
    let mut place = vec![(u32::MAX, 0u32); network.len()];
    for (number, nodes) in division.blocks.iter().enumerate() {
        nodes.iter().enumerate().for_each(|(at, node)| place[*node as usize] = (number as u32, at as u32));
    }
    let mut inside = vec![Vec::new(); division.blocks.len()];
    for (conductor, _) in network.linear.iter().zip(&division.inside).filter(|(_, inside)| **inside) {
        let [a, b] = conductor.nodes.map(|node| place[node as usize]);
        if a.0 != u32::MAX && a.1 != b.1 {
            inside[a.0 as usize].push(([a.1, b.1], conductor.conductance));
        }
    }
    let mut known = HashMap::new();
    let (mut blocks, mut kinds) = (Vec::new(), Vec::new());
    for (nodes, mut rates) in division.blocks.iter().zip(inside) {
        let pairs: Vec<[u32; 2]> = rates.iter().map(|(pair, _)| *pair).collect();
        let order = ordered(nodes.len(), &pairs);
        let nodes: Vec<u32> = order.iter().map(|at| nodes[*at]).collect();
        let mut place = vec![0; nodes.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old] = new as u32);
        for (pair, _) in &mut rates {
            let [a, b] = pair.map(|at| place[at as usize]);
            *pair = [a.min(b), a.max(b)];
        }
        let capacitances = nodes.iter().map(|node| network.capacitances[*node as usize]);
        let capacitance = capacitances.clone().sum::<f64>() / nodes.len() as f64;
        let shares: Vec<f64> = capacitances.map(|one| one / capacitance).collect();
        rates.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        rates.iter_mut().for_each(|(_, rate)| *rate /= capacitance);
        let rounded = |value: &f64| (value.ln() / ALIKE).round() as i64;
        let key: (Vec<i64>, Vec<([u32; 2], i64)>) =
            (shares.iter().map(rounded).collect(), rates.iter().map(|(pair, rate)| (*pair, rounded(rate))).collect());
        let conduction = *known.entry(key).or_insert_with(|| {
            kinds.push(BlockKind { shares, rates });
            kinds.len() as u32 - 1
        });
        blocks.push(Block { nodes, conduction, capacitance });
    }
    (blocks, kinds)
}
