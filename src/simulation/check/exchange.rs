//! Radiation between surfaces in f64 beside a run, and its errors in kelvin: noise of rays, pairs that were left out, light that is held, and arrival from the
//! start of each step.

use std::sync::Arc;

use glam::DAffine3;

use crate::environment::StepLoad;
use crate::environment::shadow::Lit;
use crate::exchange::sky::{Due, LastFound, Renewal};
use crate::exchange::step::{CraftLight, Exchange};
use crate::simulation::exchange::ExchangeCraft;
use crate::thermal::misfit::{Misfit, check_length};
use crate::thermal::received::FaceLoad;

/// Findings of infrared between two estimates of noise and of the bounces that are left out.
const EVERY: u64 = 20;

/// Most poses whose rays are kept. The pose that was used longest ago makes room.
const MOST: usize = 32;

/// Below this mean temperature [K] a patch hardly radiates, so that a flux says little of its temperature.
const COLD: f64 = 85.0;

/// The exchange between patches in f64, beside the run.
pub(super) struct ExchangeCheck {
    craft: Arc<ExchangeCraft>,
    /// Poses of the joints for which rays were cast, each with its exchange. The last pair holds.
    found: Vec<(Vec<DAffine3>, Exchange)>,
    renewal: Renewal,
    progress: ExchangeProgress,
}

/// What steps change of an exchange beside the run.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
struct ExchangeProgress {
    light: CraftLight,
    /// Infrared that patches absorb since it was found last [W/m2].
    before: Vec<f64>,
    /// How often infrared was found.
    steps: u64,
    /// Errors so far: noise, bounces that are left out, late arrival, and light that is held.
    errors: [ErrorSpread; 4],
}

/// The saved state of an exchange beside the run.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct ExchangeCheckState {
    last: LastFound,
    /// Poses for which the rays that hold were cast.
    poses: Vec<DAffine3>,
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

impl ExchangeCheck {
    pub(crate) fn new(craft: &Arc<ExchangeCraft>, poses: &[DAffine3]) -> Self {
        Self {
            found: vec![(poses.to_vec(), craft.cast(poses))],
            renewal: craft.renewal(),
            craft: Arc::clone(craft),
            progress: ExchangeProgress::default(),
        }
    }

    /// The light on the faces of every node in a step, from rays for the poses that the engine uses. The load lasts `steps`. Nodes have temperatures [K] and
    /// lit areas.
    pub(crate) fn received(
        &mut self,
        load: &StepLoad,
        steps: f64,
        poses: Option<&[DAffine3]>,
        temperatures: &[f64],
        lit: &Lit,
    ) -> Vec<[FaceLoad; 2]> {
        let turned = poses.is_some_and(|poses| self.turn(poses));
        let Some((_, exchange)) = self.found.last() else { return Vec::new() };
        let find = || {
            let mirrored = self.craft.mirrors.as_ref().map(|mirrors| mirrors.mirrored(load));
            exchange.light(load, lit, mirrored.as_ref())
        };
        let of_nodes = |absorbed: &[f64], light: &CraftLight| -> Vec<[FaceLoad; 2]> {
            (0..temperatures.len()).map(|node| exchange.of_node(node, absorbed, &light.planet_shares)).collect()
        };
        let due = self.renewal.due(load, steps, turned || self.progress.light.planet_shares.is_empty());
        if due == Due::Nothing {
            return of_nodes(&self.progress.before, &self.progress.light);
        }
        let mut held = None;
        if due == Due::All {
            self.progress.light = find();
        } else if self.progress.steps.is_multiple_of(EVERY) {
            held = Some(exchange.held_too_long(load, [&self.progress.light, &find()], |node| temperatures[node]));
        }
        let sent = exchange.sent(load, &self.progress.light, |node| temperatures[node]);
        let absorbed = exchange.absorbed(&sent, &self.progress.light);
        let received = of_nodes(&absorbed, &self.progress.light);
        self.estimate(&sent, &absorbed, temperatures, (turned, held));
        self.progress.before = absorbed;
        self.progress.steps += 1;
        received
    }

    /// Puts the exchange for poses last. Returns whether another exchange was last before.
    fn turn(&mut self, poses: &[DAffine3]) -> bool {
        let Some(place) = self.found.iter().rposition(|(own, _)| own == poses) else {
            if self.found.len() >= MOST {
                self.found.remove(0);
            }
            self.found.push((poses.to_vec(), self.craft.cast(poses)));
            return true;
        };
        let held = place + 1 == self.found.len();
        let known = self.found.remove(place);
        self.found.push(known);
        !held
    }

    fn estimate(
        &mut self,
        sent: &[f64],
        absorbed: &[f64],
        temperatures: &[f64],
        (turned, held): (bool, Option<Vec<f64>>),
    ) {
        let Some((_, exchange)) = self.found.last() else { return };
        let kelvin = exchange.kelvin_per_flux(|node| temperatures[node]);
        let warm = exchange.kelvin_per_flux(|_| COLD);
        let patches = || exchange.patches.iter().zip(kelvin.iter().zip(&warm)).enumerate();
        let warm_ones = || patches().filter(|(_, (_, (kelvin, warm)))| kelvin < warm);
        // Where rays were cast anew the rows changed, not the time.
        if !turned && self.progress.before.len() == absorbed.len() {
            for (number, (patch, (kelvin, _))) in warm_ones() {
                self.progress.errors[2]
                    .add(0.5 * kelvin * (absorbed[number] - self.progress.before[number]), patch.area);
            }
        }
        if self.progress.steps.is_multiple_of(EVERY) {
            let errors = exchange.errors(sent, &self.progress.light, self.craft.settings.bounces);
            for (number, (patch, (kelvin, _))) in warm_ones() {
                self.progress.errors[0].add(kelvin * errors[number].noise, patch.area);
                self.progress.errors[1].add(kelvin * errors[number].left_out, patch.area);
                // Light that was found for this very step has no such error.
                self.progress.errors[3].add(kelvin * held.as_ref().map_or(0.0, |held| held[number]), patch.area);
            }
        }
    }

    /// The errors in words.
    pub(crate) fn remark(&self) -> Option<String> {
        let [noise, left_out, late, held] = &self.progress.errors;
        (noise.weight > 0.0).then(|| {
            let late = if late.weight > 0.0 { late.told() } else { "unknown yet".to_owned() };
            format!(
                "Radiation between surfaces, errors of a patch in balance: noise of {} rays {}; pairs that were left out and rounding {}; light of Sun and planet that is held {}; \
                 arrival from the temperatures of up to {} s before a step {late}. Patches below {COLD} K are left out.",
                self.craft.settings.rays,
                noise.told(),
                left_out.told(),
                held.told(),
                self.craft.settings.hold
            )
        })
    }

    pub(crate) fn save(&self) -> ExchangeCheckState {
        ExchangeCheckState {
            last: self.renewal.last.clone(),
            poses: self.found.last().map(|(poses, _)| poses.clone()).unwrap_or_default(),
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
        if !saved.progress.before.is_empty() {
            check_length("light that patches absorb", &saved.progress.before, patches)?;
        }
        self.renewal.last.clone_from(&saved.last);
        self.turn(&saved.poses);
        self.progress.clone_from(&saved.progress);
        Ok(())
    }
}
