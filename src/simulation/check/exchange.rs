//! Radiation between surfaces in f64 beside a run, and its errors in kelvin: noise of rays, pairs that were left out, light that is held, and the late
//! arrival of emission.

use std::sync::Arc;

use glam::DAffine3;

use crate::environment::StepLoad;
use crate::environment::shadow::Lit;
use crate::exchange::errors::at_most;
use crate::exchange::lead::Lead;
use crate::exchange::patches::Patch;
use crate::exchange::sky::{Due, LastFound, Renewal};
use crate::exchange::step::{CraftLight, Exchange};
use crate::simulation::exchange::ExchangeCraft;
use crate::simulation::exchange_poses::RowsBetween;
use crate::thermal::misfit::{Misfit, check_length};
use crate::thermal::received::FaceLoad;
use crate::trace::span;

/// Findings of infrared between two estimates of noise and of the bounces that are left out.
const EVERY: u64 = 20;

/// Below this mean temperature [K] a patch hardly radiates, so that a flux says little of its temperature.
const COLD: f64 = 85.0;

/// The exchange between patches in f64, beside the run.
pub(super) struct ExchangeCheck {
    craft: Arc<ExchangeCraft>,
    /// The poses between which the rows that hold lie, and these rows.
    now: (RowsBetween, Arc<Exchange>),
    renewal: Renewal,
    progress: ExchangeProgress,
}

/// What steps change of an exchange beside the run.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
struct ExchangeProgress {
    light: CraftLight,
    lead: Lead,
    /// Infrared that patches absorb since it was found last [W/m2], and what they would absorb of emission at that time.
    before: Vec<f64>,
    at_start: Vec<f64>,
    /// How often infrared was found.
    steps: u64,
    /// Errors so far: noise, bounces that are left out, late arrival, light that is held, and size of patches.
    errors: [ErrorSpread; 5],
}

/// The saved state of an exchange beside the run.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct ExchangeCheckState {
    last: LastFound,
    /// The poses between which the rows that hold lie.
    rows: RowsBetween,
    progress: ExchangeProgress,
}

/// Errors over patches and steps [K].
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct ErrorSpread {
    squares: f64,
    weight: f64,
    most: f64,
}

impl ErrorSpread {
    fn add(&mut self, error: f64, weight: f64) {
        self.squares += weight * error * error;
        self.weight += weight;
        self.most = self.most.max(error.abs());
    }

    fn told(&self) -> String {
        format!("{:.2} K (rms over area), at most {:.1} K", (self.squares / self.weight).sqrt(), self.most)
    }
}

/// The exchange for the poses between which rows lie.
type Ends = [Arc<Exchange>; 2];

impl ExchangeCheck {
    pub(crate) fn new(craft: &Arc<ExchangeCraft>, poses: &[DAffine3]) -> Self {
        let first = craft.cast(poses);
        let rows = RowsBetween { from: poses.to_vec(), to: poses.to_vec(), share: 0.0 };
        Self {
            now: (rows, first),
            renewal: craft.renewal(),
            craft: Arc::clone(craft),
            progress: ExchangeProgress::default(),
        }
    }

    /// The light on the faces of every node in a step. The load lasts `steps`. Rows that `turned` differ from those before. Nodes have temperatures [K] and lit areas.
    pub(crate) fn received(
        &mut self,
        load: &StepLoad,
        steps: f64,
        turned: bool,
        temperatures: &[f64],
        lit: &Lit,
    ) -> Vec<[FaceLoad; 2]> {
        if turned {
            self.renewal.new_rows();
        }
        let _exchanges = span("radiation between surfaces in f64");
        let exchange = Arc::clone(&self.now.1);
        let find = |before: &CraftLight, lead: f64| {
            let mirrored = self.craft.mirrors.as_ref().map(|mirrors| mirrors.mirrored(load));
            exchange.light_ahead(load, lit, mirrored.as_ref(), (before, lead))
        };
        let due = self.renewal.due(load, steps, self.progress.light.planet_shares.is_empty());
        if due == Due::Nothing {
            return exchange.of_nodes(&self.progress.before, &self.progress.light.planet_shares);
        }
        let mut held = None;
        let before = &self.progress.light;
        // Light that jumped was held up to the jump alone.
        let is_held = due != Due::All || self.renewal.last.lead > 0.0;
        if self.progress.steps.is_multiple_of(EVERY) && is_held && !before.planet_shares.is_empty() {
            held = Some(exchange.held_too_long(load, [before, &find(before, 0.0)], |node| temperatures[node]));
        }
        if due == Due::All {
            self.progress.light = find(before, self.renewal.last.lead);
        }
        let temperature = |node: usize| temperatures[node];
        let progress = &mut self.progress;
        let sent = progress.lead.sent(&exchange, load, &progress.light, temperature, self.renewal.held);
        let at_start = exchange.absorbed(&exchange.sent(load, &progress.light, temperature), &progress.light);
        let ends = self.progress.steps.is_multiple_of(EVERY).then(|| self.ends()).flatten();
        let absorbed = exchange.absorbed(&sent, &self.progress.light);
        let received = exchange.of_nodes(&absorbed, &self.progress.light.planet_shares);
        self.estimate(&sent, &at_start, temperatures, (turned, held, ends));
        (self.progress.before, self.progress.at_start) = (absorbed, at_start);
        self.progress.steps += 1;
        received
    }

    /// Makes the rows between the poses of the engine hold. Returns whether others held before.
    pub(super) fn turn(&mut self, rows: &RowsBetween) -> bool {
        if self.now.0 == *rows {
            return false;
        }
        self.now = (rows.clone(), self.craft.between(rows));
        true
    }

    /// The exchange for the poses between which the rows lie. `None` where no joint moves.
    fn ends(&self) -> Option<Ends> {
        let rows = &self.now.0;
        (rows.from != rows.to).then(|| [&rows.from, &rows.to].map(|poses| self.craft.cast(poses)))
    }

    fn estimate(
        &mut self,
        sent: &[f64],
        absorbed: &[f64],
        temperatures: &[f64],
        (turned, held, ends): (bool, Option<Vec<f64>>, Option<Ends>),
    ) {
        let ends = ends.as_ref().map(|ends| ends.each_ref().map(|exchange| &**exchange));
        let between = ends.map(|ends| self.now.1.with_factors_between(ends, self.now.0.share));
        let exchange = between.as_ref().unwrap_or(&self.now.1);
        let kelvin = exchange.kelvin_per_flux(|node| temperatures[node]);
        let warm = exchange.kelvin_per_flux(|_| COLD);
        let patches = || exchange.patches.iter().zip(kelvin.iter().zip(&warm)).enumerate();
        let nodes = |patch: &Patch| exchange.nodes[patch.nodes.clone()].iter();
        let temperature =
            |patch: &Patch| nodes(patch).map(|(node, share)| share * temperatures[*node as usize]).sum::<f64>();
        let error = |patch: &Patch, error: f64| at_most(error.abs(), temperature(patch));
        let warm_ones = || patches().filter(|(_, (_, (kelvin, warm)))| kelvin < warm);
        // Where rays were cast anew the rows changed, not the time.
        if !turned && self.progress.before.len() == absorbed.len() {
            for (number, (patch, (kelvin, _))) in warm_ones() {
                let middle = 0.5 * (absorbed[number] + self.progress.at_start[number]);
                self.progress.errors[2].add(error(patch, kelvin * (middle - self.progress.before[number])), patch.area);
            }
        }
        if self.progress.steps.is_multiple_of(EVERY) {
            let bounces = self.craft.settings.bounces;
            let errors = exchange.errors(sent, &self.progress.light, bounces);
            let uncertain = exchange.uncertainty(&errors, absorbed, held.as_deref());
            for (number, (patch, (kelvin, _))) in warm_ones() {
                self.progress.errors[0].add(error(patch, kelvin * uncertain[number].rays), patch.area);
                self.progress.errors[4].add(error(patch, kelvin * uncertain[number].size), patch.area);
                self.progress.errors[1].add(error(patch, kelvin * errors[number].left_out), patch.area);
                // The first light, and light that jumped, have no such error.
                let held = held.as_ref().map_or(0.0, |held| held[number]);
                self.progress.errors[3].add(error(patch, kelvin * held), patch.area);
            }
        }
    }

    /// The errors in words.
    pub(crate) fn remark(&self) -> Option<String> {
        let [noise, left_out, late, held, size] = &self.progress.errors;
        (noise.weight > 0.0).then(|| {
            let late = if late.weight > 0.0 { late.told() } else { "unknown yet".to_owned() };
            format!(
                "Radiation between surfaces, errors of a patch in balance: noise of {} rays {}; size of patches {}; pairs that were left out and rounding {}; light of Sun and planet that is held {}; \
                 arrival of emission that is held for up to {} s {late}. Patches below {COLD} K are left out.",
                self.craft.settings.rays,
                noise.told(),
                size.told(),
                left_out.told(),
                held.told(),
                self.craft.held_time()
            )
        })
    }

    pub(crate) fn save(&self) -> ExchangeCheckState {
        ExchangeCheckState {
            last: self.renewal.last.clone(),
            rows: self.now.0.clone(),
            progress: self.progress.clone(),
        }
    }

    /// Restores a saved state.
    ///
    /// # Errors
    /// A state of other patches.
    pub(crate) fn restore(&mut self, saved: &ExchangeCheckState) -> Result<(), Misfit> {
        let patches = self.craft.patches.all.len();
        saved.progress.light.check_patches(patches)?;
        saved.progress.lead.check_patches(patches)?;
        for values in [&saved.progress.before, &saved.progress.at_start].into_iter().filter(|values| !values.is_empty())
        {
            check_length("light that patches absorb", values, patches)?;
        }
        self.renewal.last.clone_from(&saved.last);
        self.turn(&saved.rows);
        self.progress.clone_from(&saved.progress);
        Ok(())
    }
}
