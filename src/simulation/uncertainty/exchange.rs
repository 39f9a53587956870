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
use crate::exchange::uncertainty::{PatchSizes, held_rows};
use crate::simulation::exchange::ExchangeCraft;
use crate::thermal::misfit::{Misfit, check_length};

/// Findings of infrared between two estimates.
const EVERY: u64 = 10;

/// Poses in a row whose rays are kept.
const POSES: usize = 3;

/// Error of straight lines between rows of poses, in the root mean square over the way, over the second difference of three rows as far apart: 1/4 in the middle,
/// and the root of 8/15 for a parabola.
const BETWEEN_ROWS: f64 = 0.25 * 0.73;

/// Errors of what nodes absorb from each other.
pub(super) struct ExchangeErrors {
    craft: Arc<ExchangeCraft>,
    sizes: PatchSizes,
    renewal: Renewal,
    /// Exchanges for the poses of the state.
    casts: Vec<Arc<Exchange>>,
    state: ExchangeErrorState,
}

/// The saved state of these errors.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct ExchangeErrorState {
    last: LastFound,
    /// The last poses of the joints for which rays were cast.
    poses: Vec<Vec<DAffine3>>,
    light: CraftLight,
    lead: Lead,
    /// Flux that each patch absorbs since infrared was found, what it would absorb of emission at that time, and the uncertainty; and the excess by late arrival, with its
    /// sign [W/m2].
    absorbed: Vec<f64>,
    at_start: Vec<f64>,
    uncertain: Vec<f64>,
    late: Vec<f64>,
    /// Half of the difference between what each node absorbs and what the nodes beside it absorb [W/m2].
    lines: Vec<f64>,
    /// Findings of infrared.
    found: u64,
}

impl ExchangeErrors {
    pub(super) fn new(craft: &Arc<ExchangeCraft>) -> Self {
        Self {
            sizes: PatchSizes::new(&craft.surface, &craft.patches),
            renewal: craft.renewal(),
            craft: Arc::clone(craft),
            casts: Vec::new(),
            state: ExchangeErrorState::default(),
        }
    }

    /// Takes a step that ends at temperatures [K], with the lit area of each node.
    pub(super) fn take(&mut self, load: &StepLoad, temperatures: &[f32], lit: &Lit) {
        let turned = self.turn(&load.joints);
        let due = self.renewal.due(load, 1.0, self.state.absorbed.is_empty());
        let Some(exchange) = self.casts.last().filter(|_| due != Due::Nothing) else { return };
        let temperature = |node: usize| f64::from(temperatures[node]);
        let mut held = None;
        if due == Due::All {
            let mirrored = self.craft.mirrors.as_ref().map(|mirrors| mirrors.mirrored(load));
            let fresh = exchange.light(load, lit, mirrored.as_ref());
            let before = std::mem::replace(&mut self.state.light, fresh);
            if !before.planet_shares.is_empty() {
                // Light is right when it is found, and is off by the difference before the next finding.
                let off = exchange.held_too_long(load, [&before, &self.state.light], temperature);
                held = Some(off.iter().map(|off| off / 3f64.sqrt()).collect::<Vec<_>>());
            }
        }
        let light = &self.state.light;
        let at_start = exchange.absorbed(&exchange.sent(load, light, temperature), light);
        // The infrared that was held, less the mean of emission at both ends of the time.
        let late = |((now, before), held): ((&f64, &f64), &f64)| 0.5 * (now + before) - held;
        self.state.late = match !turned && due == Due::Infrared {
            true => at_start.iter().zip(&self.state.at_start).zip(&self.state.absorbed).map(late).collect(),
            false => vec![0.0; at_start.len()],
        };
        let sent = self.state.lead.sent(exchange, load, light, temperature, self.renewal.held);
        let absorbed = exchange.absorbed(&sent, light);
        if due == Due::All || turned || self.state.found.is_multiple_of(EVERY) {
            let errors = exchange.errors(&sent, light, self.craft.settings.bounces);
            let uncertain = exchange.uncertainty(&errors, &absorbed, &self.sizes, held.as_deref());
            let rows = self.between_rows(&sent);
            let rows = |patch: usize| rows.as_ref().map_or(0.0, |rows| rows[patch]);
            self.state.uncertain =
                uncertain.iter().enumerate().map(|(patch, flux)| flux.all().hypot(rows(patch))).collect();
            self.state.lines = self.lines(&absorbed);
        }
        (self.state.absorbed, self.state.at_start) = (absorbed, at_start);
        self.state.found += 1;
    }

    /// Casts rays for poses that differ from the last ones by more than the scene's angle. Returns whether it did.
    fn turn(&mut self, poses: &[DAffine3]) -> bool {
        let holds = |last: &Vec<DAffine3>| turned(last, poses) <= self.craft.settings.redraw_angle;
        if self.state.poses.last().is_some_and(holds) {
            return false;
        }
        if self.casts.len() == POSES {
            self.casts.remove(0);
            self.state.poses.remove(0);
        }
        self.casts.push(self.craft.cast(poses));
        self.state.poses.push(poses.to_vec());
        self.renewal.new_rows();
        true
    }

    /// Uncertainty of what patches absorb [W/m2] by rows that are means of two poses, and are held. `None` where no joint has moved.
    fn between_rows(&self, sent: &[f64]) -> Option<Vec<f64>> {
        let absorbed: Vec<Vec<f64>> =
            self.casts.iter().map(|exchange| exchange.absorbed(sent, &self.state.light)).collect();
        let [.., first, second] = &absorbed[..] else { return None };
        let [.., from, to] = &self.casts[..] else { return None };
        let mut rows = held_rows(first, second, from.share_to_hold(to));
        if let [before, first, second] = &absorbed[..] {
            for (patch, error) in rows.iter_mut().enumerate() {
                *error = error.hypot(BETWEEN_ROWS * (before[patch] - 2.0 * first[patch] + second[patch]));
            }
        }
        Some(rows)
    }

    /// Half of the difference between what each node absorbs, where its patches absorb some flux [W/m2], and the mean of the nodes beside it. An image draws straight
    /// lines between nodes: on an even mesh they leave out a quarter of this difference in their middle. At a rim, where a node stands for what lies within it, they leave out more. A patch of several nodes tells the gradient itself ([`PatchSizes`]).
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

    /// Uncertainty of the flux on a node, and its excess by late arrival, with its sign [W/m2].
    pub(super) fn of_node(&self, node: usize) -> [f64; 2] {
        let faces = self.craft.patches.of_node[node].iter().filter(|patch| **patch != NONE);
        let lines = self.state.lines.get(node).copied().unwrap_or(0.0);
        faces.fold([lines, 0.0], |[uncertain, late], patch| {
            let of_patch = |values: &[f64]| values.get(*patch as usize).copied().unwrap_or(0.0);
            [uncertain.hypot(of_patch(&self.state.uncertain)), late + of_patch(&self.state.late)]
        })
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
        let state = [&saved.absorbed, &saved.at_start, &saved.uncertain, &saved.late];
        for values in state.into_iter().filter(|values| !values.is_empty()) {
            check_length("light that patches absorb", values, patches)?;
        }
        if !saved.lines.is_empty() {
            check_length("differences between nodes", &saved.lines, self.craft.patches.of_node.len())?;
        }
        self.casts = saved.poses.iter().take(POSES).map(|poses| self.craft.cast(poses)).collect();
        self.renewal.last.clone_from(&saved.last);
        self.state.clone_from(saved);
        Ok(())
    }
}
