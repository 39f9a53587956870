//! How uncertain the flux is that nodes absorb from the rest of the craft, from rays that are cast beside the run.

use std::sync::Arc;

use glam::DAffine3;

use crate::environment::StepLoad;
use crate::environment::shadow::Lit;
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
    /// Flux that each patch absorbs, and its uncertainty; and the excess by late arrival, with its sign [W/m2].
    absorbed: Vec<f64>,
    uncertain: Vec<f64>,
    late: Vec<f64>,
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
        let sent = exchange.sent(load, light, temperature);
        let absorbed = exchange.absorbed(&sent, light);
        // Infrared is that of the start of the time for which it is held.
        self.state.late = match !turned && due == Due::Infrared {
            true => absorbed.iter().zip(&self.state.absorbed).map(|(now, before)| 0.5 * (now - before)).collect(),
            false => vec![0.0; absorbed.len()],
        };
        if due == Due::All || turned || self.state.found.is_multiple_of(EVERY) {
            let errors = exchange.errors(&sent, light, self.craft.settings.bounces);
            let uncertain = exchange.uncertainty(&errors, &absorbed, &self.sizes, held.as_deref());
            let rows = self.between_rows(&sent);
            let rows = |patch: usize| rows.as_ref().map_or(0.0, |rows| rows[patch]);
            self.state.uncertain =
                uncertain.iter().enumerate().map(|(patch, flux)| flux.all().hypot(rows(patch))).collect();
        }
        self.state.absorbed = absorbed;
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

    /// Uncertainty of the flux on a node, and its excess by late arrival, with its sign [W/m2].
    pub(super) fn of_node(&self, node: usize) -> [f64; 2] {
        let faces = self.craft.patches.of_node[node].iter().filter(|patch| **patch != NONE);
        faces.fold([0.0f64; 2], |[uncertain, late], patch| {
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
        for values in [&saved.absorbed, &saved.uncertain, &saved.late].into_iter().filter(|values| !values.is_empty()) {
            check_length("light that patches absorb", values, patches)?;
        }
        self.casts = saved.poses.iter().take(POSES).map(|poses| self.craft.cast(poses)).collect();
        self.renewal.last.clone_from(&saved.last);
        self.state.clone_from(saved);
        Ok(())
    }
}
