//! How uncertain the flux is that nodes absorb from the rest of the craft, from rays that are cast beside the run.

use std::sync::Arc;

use glam::DAffine3;

use crate::environment::StepLoad;
use crate::environment::shadow::Lit;
use crate::exchange::lead::Lead;
use crate::exchange::patches::NONE;
use crate::exchange::sky::{Due, LastFound, Renewal};
use crate::exchange::step::{CraftLight, Exchange};
use crate::exchange::turn::turned;
use crate::exchange::uncertainty::{FluxUncertainty, held_rows};
use crate::exchange::uneven::{SentFrom, Unevenness};
use crate::simulation::exchange::ExchangeCraft;
use crate::thermal::misfit::{Misfit, check_length};
use crate::trace::span;

/// Findings of infrared between two estimates.
const EVERY: u64 = 10;
/// Change of the flux that all patches absorb, over this flux, that makes an earlier estimate too old.
const CHANGED: f64 = 0.05;

/// Poses in a row whose rays are kept.
const POSES: usize = 3;

/// Error of straight lines between rows of poses, in the root mean square over the way, over the second difference of three rows as far apart: 1/4 in the middle,
/// and the root of 8/15 for a parabola.
const BETWEEN_ROWS: f64 = 0.25 * 0.73;

/// Errors of what nodes absorb from each other.
pub(super) struct ExchangeErrors {
    craft: Arc<ExchangeCraft>,
    renewal: Renewal,
    /// Exchanges for the poses of the state.
    casts: Vec<Arc<Exchange>>,
    state: ExchangeErrorState,
}

/// The saved state of these errors.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct ExchangeErrorState {
    last: LastFound,
    /// The last poses of the joints for which rays were cast, and when [s].
    poses: Vec<(f64, Vec<DAffine3>)>,
    light: CraftLight,
    lead: Lead,
    /// Flux that each patch absorbs since infrared was found, and what it would absorb of the true emission at that time [W/m2].
    absorbed: Vec<f64>,
    at_start: Vec<f64>,
    /// Uncertainty of this flux that is alike over the patch, and that differs within it; flux that the patch lacks because others send unevenly, with its sign [W/m2].
    uncertain: Vec<[f64; 3]>,
    /// Uncertainty by rows that are held while a joint moves [W/m2], empty before one has, and the time for which they are [s].
    rows: Vec<f64>,
    rows_held_for: f64,
    /// Flux that a patch lacks because infrared arrives late, with its sign [W/m2]: as the last time for which infrared was held told it, and by how much this differs from the
    /// value before.
    late: Vec<f64>,
    corrected: Vec<f64>,
    /// Change over the last time for which infrared was held of the flux that a patch would absorb of the true emission [W/m2]. Empty but in the step that ends this time, so no saved state needs it.
    #[serde(skip)]
    rising: Vec<f64>,
    /// Half of the difference between what each node absorbs and what the nodes beside it absorb [W/m2].
    lines: Vec<f64>,
    /// Findings of infrared, and the sum of what patches absorbed in the last estimate [W/m2].
    found: u64,
    estimated_for: f64,
}

/// Errors of the flux that a node absorbs from the rest of the craft.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct NodeFluxError {
    /// Uncertainty that differs from node to node [W/m2].
    pub(super) own: f64,
    /// Uncertainty that is alike over the nodes of a patch [W/m2].
    pub(super) alike: f64,
    /// Uncertainty by rows that are held, which err both ways in turn [W/m2].
    pub(super) rows: f64,
    /// Area of the largest patch of the node [m2].
    pub(super) area: f64,
    /// Lack because others send unevenly, with its sign [W/m2].
    pub(super) uneven: f64,
    /// Lack by late arrival, with its sign [W/m2].
    pub(super) late: f64,
    /// What was missing in this lack [W/m2], for the time before the present step for which infrared was held.
    pub(super) corrected: f64,
    /// Change of the flux over the time for which infrared was held, in the step that ends this time [W/m2].
    pub(super) rising: f64,
}

/// Uncertainty of what patches absorb while joints move [W/m2]: by rows that are held, and for how long they are [s], and by straight lines between rows of poses.
#[derive(Debug, Default)]
struct BetweenRows {
    held: Vec<f64>,
    held_for: f64,
    bent: Vec<f64>,
}

impl ExchangeErrors {
    pub(super) fn new(craft: &Arc<ExchangeCraft>) -> Self {
        Self {
            renewal: craft.renewal(),
            craft: Arc::clone(craft),
            casts: Vec::new(),
            state: ExchangeErrorState::default(),
        }
    }

    /// Whether no infrared was found yet.
    pub(super) fn is_fresh(&self) -> bool {
        self.state.absorbed.is_empty()
    }

    /// Takes an interval of `steps` steps that ends at temperatures [K], with the lit area of each node. `spreads` gives the standard deviation of the temperature within the cell of each node [K]. `late` is how much colder than the truth a node is by infrared that arrives late [K].
    pub(super) fn take(
        &mut self,
        load: &StepLoad,
        steps: f64,
        temperatures: &[f32],
        late: impl Fn(usize) -> f64 + Sync,
        spreads: impl FnOnce() -> Vec<f64>,
        lit: &Lit,
    ) {
        self.state.corrected.clear();
        self.state.rising.clear();
        let turned = self.turn(load.start, &load.joints);
        let _errs = span("errors of radiation between surfaces");
        let due = self.renewal.due(load, steps, self.state.absorbed.is_empty());
        let Some(exchange) = self.casts.last().filter(|_| due != Due::Nothing) else { return };
        let temperature = |node: usize| f64::from(temperatures[node]);
        let true_temperature = |node: usize| temperature(node) + late(node);
        let emitted = |light: &CraftLight| exchange.absorbed(&exchange.sent(load, light, true_temperature), light);
        // Rows of another pose tell nothing of the last time: what they told before goes on.
        if !turned && !self.state.absorbed.is_empty() {
            let now = emitted(&self.state.light);
            // The mean of emission at both ends of the time, less the infrared that was held.
            let lack = |((now, before), held): ((&f64, &f64), &f64)| 0.5 * (now + before) - held;
            let last = now.iter().zip(&self.state.at_start).zip(&self.state.absorbed).map(lack).collect();
            let told = std::mem::replace(&mut self.state.late, last);
            self.state.corrected = self.state.late.iter().zip(told).map(|(now, told)| now - told).collect();
            self.state.rising = now.iter().zip(&self.state.at_start).map(|(now, before)| now - before).collect();
        }
        let mut held = None;
        if due == Due::All {
            let mirrored = self.craft.mirrors.as_ref().map(|mirrors| mirrors.mirrored(load));
            let fresh = exchange.light(load, lit, mirrored.as_ref());
            let before = std::mem::replace(&mut self.state.light, fresh);
            if !before.planet_shares.is_empty() {
                // Light is right when it is found, and is off by as much as at the last finding before the next one. Where it leads, it is right in the middle, and off by half of it at both ends.
                let off = exchange.held_too_long(load, [&before, &self.state.light], temperature);
                let share = if self.renewal.last.lead > 0.0 { 1.0 / 12f64.sqrt() } else { 1.0 / 3f64.sqrt() };
                held = Some(off.iter().map(|off| share * off).collect::<Vec<_>>());
            }
        }
        let light = &self.state.light;
        let at_start = emitted(light);
        self.state.late.resize(at_start.len(), 0.0);
        let sent = self.state.lead.sent(exchange, load, light, temperature, self.renewal.held);
        let absorbed = exchange.absorbed(&sent, light);
        let sum: f64 = absorbed.iter().map(|flux| flux.abs()).sum();
        let changed = (sum - self.state.estimated_for).abs() > CHANGED * self.state.estimated_for;
        if due == Due::All || turned || changed || self.state.found.is_multiple_of(EVERY) {
            self.state.estimated_for = sum;
            let errors = exchange.errors(&sent, light, self.craft.settings.bounces);
            let uncertain = exchange.uncertainty(&errors, &absorbed, held.as_deref());
            let between = self.between_rows(&sent).unwrap_or_default();
            let bent = |patch: usize| between.bent.get(patch).unwrap_or(&0.0);
            let spreads = spreads();
            let sent_from = SentFrom { temperature, spread: |node: usize| spreads[node] };
            let uneven = exchange.unevenness(load, lit, &sent_from, self.craft.mirrors.is_some());
            let all = |(patch, flux): (usize, &FluxUncertainty)| {
                let Unevenness { missed, beside } = uneven[patch];
                [flux.rays.hypot(flux.held).hypot(*bent(patch)), flux.size.hypot(beside), missed]
            };
            self.state.uncertain = uncertain.iter().enumerate().map(all).collect();
            (self.state.rows, self.state.rows_held_for) = (between.held, between.held_for);
            self.state.lines = self.lines(&absorbed);
        }
        (self.state.absorbed, self.state.at_start) = (absorbed, at_start);
        self.state.found += 1;
    }

    /// Casts rays for poses that differ from the last ones by more than the scene's angle. Returns whether it did.
    fn turn(&mut self, now: f64, poses: &[DAffine3]) -> bool {
        let holds = |(_, last): &(f64, Vec<DAffine3>)| turned(last, poses) <= self.craft.settings.redraw_angle;
        if self.state.poses.last().is_some_and(holds) {
            return false;
        }
        if self.casts.len() == POSES {
            self.casts.remove(0);
            self.state.poses.remove(0);
        }
        self.casts.push(self.craft.cast(poses));
        self.state.poses.push((now, poses.to_vec()));
        self.renewal.new_rows();
        true
    }

    /// Uncertainty of what patches absorb by rows that are means of two poses, and are held. `None` where no joint has moved.
    fn between_rows(&self, sent: &[f64]) -> Option<BetweenRows> {
        let absorbed: Vec<Vec<f64>> =
            self.casts.iter().map(|exchange| exchange.absorbed(sent, &self.state.light)).collect();
        let [.., first, second] = &absorbed[..] else { return None };
        let [.., from, to] = &self.casts[..] else { return None };
        let [.., (start, _), (end, _)] = &self.state.poses[..] else { return None };
        let hold = from.share_to_hold(to);
        // The first step begins when its past ends.
        let time = if end == start { f64::INFINITY } else { (end - start).abs() };
        let mut between = BetweenRows { held: held_rows(first, second, hold), held_for: hold * time, bent: Vec::new() };
        if let ([before, first, second], [way_before, ..]) = (&absorbed[..], &self.casts[..]) {
            let [before_from, from_to] = [0, 1].map(|at| turned(&self.state.poses[at].1, &self.state.poses[at + 1].1));
            // A way that bends is halved.
            let halved = if from.bends([way_before, to], from_to / before_from) { 0.25 } else { 1.0 };
            let bent = |patch: usize| halved * BETWEEN_ROWS * (before[patch] - 2.0 * first[patch] + second[patch]);
            between.bent = (0..first.len()).map(bent).collect();
        }
        Some(between)
    }

    /// Half of the difference between what each node absorbs, where its patches absorb some flux [W/m2], and the mean of the nodes beside it. An image draws straight
    /// lines between nodes: on an even mesh they leave out a quarter of this difference in their middle. At a rim, where a node stands for what lies within it, they leave out more. Over a patch of several nodes lines are right.
    fn lines(&self, absorbed: &[f64]) -> Vec<f64> {
        let ExchangeCraft { patches, surface, .. } = &*self.craft;
        let of_face = |node: u32, side: usize| absorbed.get(patches.of_node[node as usize][side] as usize);
        let mut lines = vec![0.0f64; patches.of_node.len()];
        for side in [0, 1] {
            let mut sums = vec![[0.0, 0.0]; lines.len()];
            for [a, b, c] in &surface.triangles {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    if let (Some(first), Some(second)) = (of_face(*from, side), of_face(*to, side)) {
                        for (node, apart) in [(from, second - first), (to, first - second)] {
                            sums[*node as usize][0] += apart;
                            sums[*node as usize][1] += 1.0;
                        }
                    }
                }
            }
            let is_alone = |node: usize| {
                patches.all.get(patches.of_node[node][side] as usize).is_some_and(|patch| patch.nodes.len() == 1)
            };
            for (node, [sum, count]) in sums.into_iter().enumerate().filter(|(node, _)| is_alone(*node)) {
                lines[node] = lines[node].hypot(0.5 * sum / f64::max(count, 1.0));
            }
        }
        lines
    }

    /// Errors of the flux on a node.
    pub(super) fn of_node(&self, node: usize) -> NodeFluxError {
        let faces = self.craft.patches.of_node[node].iter().filter(|patch| **patch != NONE);
        let lines = self.state.lines.get(node).copied().unwrap_or(0.0);
        let alone = NodeFluxError { own: lines, ..NodeFluxError::default() };
        faces.fold(alone, |both, patch| {
            let of_patch = |values: &[f64]| values.get(*patch as usize).copied().unwrap_or(0.0);
            let [alike, own, uneven] = self.state.uncertain.get(*patch as usize).copied().unwrap_or_default();
            NodeFluxError {
                own: both.own.hypot(own),
                alike: both.alike.hypot(alike),
                rows: both.rows.hypot(of_patch(&self.state.rows)),
                area: both.area.max(self.craft.patches.all[*patch as usize].area),
                uneven: both.uneven + uneven,
                late: both.late + of_patch(&self.state.late),
                corrected: both.corrected + of_patch(&self.state.corrected),
                rising: both.rising + of_patch(&self.state.rising),
            }
        })
    }

    /// Time for which the last infrared was held [s].
    pub(super) fn held_time(&self) -> f64 {
        self.renewal.held
    }

    /// Time for which rows are held while a joint moves [s].
    pub(super) fn rows_held_for(&self) -> f64 {
        self.state.rows_held_for
    }

    pub(super) fn save(&self) -> ExchangeErrorState {
        ExchangeErrorState { last: self.renewal.last.clone(), ..self.state.clone() }
    }

    /// Takes a saved state, and casts the rays of its poses again.
    ///
    /// # Errors
    /// A state of other patches.
    pub(super) fn restore(&mut self, saved: &ExchangeErrorState) -> Result<(), Misfit> {
        let patches = self.craft.patches.all.len();
        saved.light.check_patches(patches)?;
        saved.lead.check_patches(patches)?;
        check_length("uncertain light", &saved.uncertain, if saved.uncertain.is_empty() { 0 } else { patches })?;
        let state = [&saved.absorbed, &saved.at_start, &saved.late, &saved.corrected, &saved.rows];
        for values in state.into_iter().filter(|values| !values.is_empty()) {
            check_length("light that patches absorb", values, patches)?;
        }
        if !saved.lines.is_empty() {
            check_length("differences between nodes", &saved.lines, self.craft.patches.of_node.len())?;
        }
        self.casts = saved.poses.iter().take(POSES).map(|(_, poses)| self.craft.cast(poses)).collect();
        self.renewal.last.clone_from(&saved.last);
        self.state.clone_from(saved);
        Ok(())
    }
}
