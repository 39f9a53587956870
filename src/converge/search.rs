//! Refines each knob by itself, then all, and chooses the cheapest settings within a stated error.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use super::knobs::{KnobScene, Refined, knobs_of};
use super::pixels::{PixelDifference, between};
use super::walk::{Expected, VariantCost, VariantRun, VariantWalk, kept_images};
use super::{ConvergeError, RunNews};
use crate::scene::{Draw, Scene};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::trace::span;

/// Most runs that verify a choice.
const MOST_CHOICES: usize = 2;
/// Share of the room for error that the next choice takes after one did not hold.
const CAUTION: f64 = 0.7;

/// A run with its settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ConvergeRow {
    pub(crate) refined: Refined,
    /// Difference from the scene as it is. `None` for the scene itself.
    pub(crate) change: Option<PixelDifference>,
    /// Difference from the run with all settings finer. `None` for this run.
    pub(crate) error: Option<PixelDifference>,
    pub(crate) cost: VariantCost,
}

/// The result of a search.
pub(crate) struct Converged {
    pub(crate) knobs: KnobScene,
    /// Error that settings may have [K rms].
    pub(crate) within: f64,
    /// The scene as it is, all settings finer, each by itself, and choices that were run to verify them.
    pub(crate) rows: Vec<ConvergeRow>,
    /// Estimated error of the run with all settings finer [K rms].
    pub(crate) left: f64,
    /// Number of the row with the cheapest settings whose difference from the finest, with the error of the finest, is within the error.
    pub(crate) chosen: Option<usize>,
    /// Number of compared images of a run.
    pub(crate) images: usize,
}

/// What all runs have in common.
pub(crate) struct Search<'a> {
    pub(crate) target: &'a Target,
    /// Error that settings may have [K rms].
    pub(crate) within: f64,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) news: &'a dyn Fn(RunNews),
}

/// The runs that all others are compared with.
struct Ends {
    base: VariantRun,
    finest: VariantRun,
}

impl Ends {
    fn row(&self, refined: Refined, run: &VariantRun) -> ConvergeRow {
        let [change, error] = [&self.base, &self.finest].map(|end| between(&end.images, &run.images));
        ConvergeRow { refined, change, error, cost: run.cost }
    }
}

/// Whether pixels can tell what the settings of a scene change.
///
/// # Errors
/// A scene without images, or with temperatures from a file.
pub(crate) fn check(scene: &Scene) -> Result<(), ConvergeError> {
    let source = || scene.source.clone();
    if scene.temperatures.is_some() {
        return Err(ConvergeError::Given(source()));
    }
    if scene.camera.is_none() || scene.time.draw == Draw::None {
        return Err(ConvergeError::NoImages(source()));
    }
    Ok(())
}

impl Search<'_> {
    /// Searches the settings of a scene that [`check`] let pass. `preparing` is how long its preparation took.
    ///
    /// # Errors
    /// A run that fails, or Ctrl-C.
    pub(crate) fn of(
        &self,
        scene: Scene,
        prepared: &Prepared,
        preparing: Duration,
    ) -> Result<Converged, ConvergeError> {
        let source = scene.source.clone();
        let kept = kept_images(&scene, 1);
        let knobs = KnobScene::new(prepared, scene);
        let all = knobs.all;
        let count = all.count_ones() + 2;
        self.forecast(&knobs, &kept, prepared, preparing)?;
        let base = self.run(&knobs, 0, &kept, &format!("1 of {count}: the scene as it is"))?;
        if between(&base.images, &base.images).is_none() {
            return Err(ConvergeError::NoPixels(source));
        }
        let finest = self.run(&knobs, all, &kept, &format!("2 of {count}: all finer"))?;
        let ends = Ends { base, finest };
        let [base, finest] = [&ends.base, &ends.finest].map(|run| run.cost.wall_s);
        let rest = f64::from(count - 2) * base + finest;
        (self.news)(RunNews::Says(format!(
            "these took {}; the rest takes about {}",
            seconds(base + finest),
            seconds(rest)
        )));
        let mut rows = vec![
            ConvergeRow { change: None, ..ends.row(0, &ends.base) },
            ConvergeRow { error: None, ..ends.row(all, &ends.finest) },
        ];
        let mut left = 0.0;
        for (number, (bit, knob)) in (3..).zip(knobs_of(all)) {
            let name = format!("{number} of {count}: {}", knobs.sentence(bit));
            let row = ends.row(bit, &self.run(&knobs, bit, &kept, &name)?);
            left += row.change.map_or(0.0, |change| (knob.left * change.rms).powi(2));
            rows.push(row);
        }
        let mut converged =
            Converged { knobs, within: self.within, rows, left: left.sqrt(), chosen: None, images: kept.len() };
        self.choose(&mut converged, &ends, &kept)?;
        Ok(converged)
    }

    /// Chooses the cheapest settings. A choice that was not run yet is run to verify it.
    fn choose(&self, converged: &mut Converged, ends: &Ends, kept: &[usize]) -> Result<(), ConvergeError> {
        let room = converged.within - converged.left;
        let mut trusted = room;
        let mut runs = 0;
        for (refined, predicted) in candidates(&converged.rows) {
            let known = converged.rows.iter().position(|row| row.refined == refined);
            let index = match known {
                Some(index) => index,
                None if predicted > trusted || runs == MOST_CHOICES => continue,
                None => {
                    runs += 1;
                    let name = format!("to verify: {}", converged.knobs.sentence(refined));
                    let run = self.run(&converged.knobs, refined, kept, &name)?;
                    converged.rows.push(ends.row(refined, &run));
                    converged.rows.len() - 1
                }
            };
            if converged.rows[index].error.is_some_and(|error| error.rms <= room) {
                converged.chosen = Some(index);
                break;
            }
            if known.is_none() {
                trusted *= CAUTION;
            }
        }
        Ok(())
    }

    fn run(
        &self,
        knobs: &KnobScene,
        refined: Refined,
        kept: &[usize],
        name: &str,
    ) -> Result<VariantRun, ConvergeError> {
        let began = Instant::now();
        let _runs = span(name.to_owned());
        let prepared = knobs.prepared(refined)?;
        let steps = u64::from(prepared.warm_up_steps()) + u64::from(prepared.scene.time.steps);
        (self.news)(RunNews::Begins(name.to_owned(), steps));
        let walk = VariantWalk { prepared: &prepared, target: self.target, kept, stop: self.stop };
        let run = walk.run(began, &|| (self.news)(RunNews::Stepped))?;
        if let (Some(orbits), true) = (run.orbits, refined == 0) {
            let text = format!(
                "the warm-up became periodic after {orbits} orbits, and took the scene as it is {} with its steps",
                seconds(run.cost.wall_s)
            );
            (self.news)(RunNews::Says(text));
        }
        Ok(run)
    }

    /// Measures a few steps of the scene and of all settings finer, and tells how long the runs will take.
    ///
    /// Runs of one finer setting take as long together as the finest run and the scene as it is, the latter as often as there are settings but one, if costs
    /// add; where they multiply, the runs take less. The forecast counts half the finest run for them, and half for choices that are run to verify them.
    fn forecast(
        &self,
        knobs: &KnobScene,
        kept: &[usize],
        prepared: &Prepared,
        preparing: Duration,
    ) -> Result<(), ConvergeError> {
        let scene = knobs.scene();
        let time = &scene.time;
        let pilot = |prepared: &Prepared, began| {
            VariantWalk { prepared, target: self.target, kept, stop: self.stop }.pilot(began)
        };
        let mut began = Instant::now();
        let base = pilot(prepared, began.checked_sub(preparing).unwrap_or(began))?;
        (self.news)(RunNews::Says(format!(
            "a run of the scene as it is takes about {}, so all {} take {} at least; a few steps with all settings finer are measured next: {}",
            seconds(base.run_s + base.warm_up_s),
            knobs.all.count_ones() + 2,
            seconds(f64::from(knobs.all.count_ones() + 2) * (base.run_s + base.warm_up_s)),
            knobs.sentence(knobs.all)
        )));
        began = Instant::now();
        let finest = knobs.prepared(knobs.all).map_err(|reason| ConvergeError::Finest {
            path: scene.source.clone(),
            settings: knobs.sentence(knobs.all),
            reason: reason.to_string(),
        })?;
        let finest = pilot(&finest, began)?;
        let runs = knobs.all.count_ones();
        let whole = |of: fn(&Expected) -> f64| (f64::from(runs) + 1.0) * of(&base) + 2.0 * of(&finest);
        let (run_s, warm_up_s) = (whole(|one| one.run_s), whole(|one| one.warm_up_s));
        let each = |one: &Expected| seconds(one.run_s + if time.periodic.is_some() { 0.0 } else { one.warm_up_s });
        let (total, periodic) = match time.periodic {
            None => (run_s + warm_up_s, String::new()),
            Some(_) => (
                run_s,
                format!(
                    "; each orbit of warm-up adds {}, and a run takes at most {} of them",
                    seconds(warm_up_s),
                    time.warm_up_orbits
                ),
            ),
        };
        (self.news)(RunNews::Says(format!(
            "forecast from measured steps: about {} for the scene as it is ({}), all settings finer ({}), {runs} runs of one finer setting and up to \
             {MOST_CHOICES} that verify a choice{periodic}",
            seconds(total),
            each(&base),
            each(&finest)
        )));
        Ok(())
    }
}

/// All settings but the finest, the cheapest first, each with its predicted difference from the finest [K rms]. Changes of single settings add in squares,
/// their costs multiply, and a finer setting costs no less. Of equal costs the fewest settings come first.
fn candidates(rows: &[ConvergeRow]) -> Vec<(Refined, f64)> {
    let [base, finest, singles @ ..] = rows else { return Vec::new() };
    let predicted = |refined: Refined| -> (Refined, f64, f64) {
        let (mut squares, mut cost) = (0.0, base.cost.stepping_ms());
        for row in singles {
            if row.refined & refined == 0 {
                squares += row.change.map_or(0.0, |change| change.rms * change.rms);
            } else {
                cost *= (row.cost.stepping_ms() / base.cost.stepping_ms().max(f64::MIN_POSITIVE)).max(1.0);
            }
        }
        (refined, squares.sqrt(), cost)
    };
    let mut all: Vec<_> = (0..finest.refined).filter(|refined| refined & !finest.refined == 0).map(predicted).collect();
    all.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.count_ones().cmp(&b.0.count_ones())));
    all.into_iter().map(|(refined, error, _)| (refined, error)).collect()
}

/// A wall time in words.
pub(crate) fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cheapest_settings_come_first() {
        let kelvin = |rms: f64| Some(PixelDifference { rms, ..PixelDifference::default() });
        let row = |refined, change, step_ms| ConvergeRow {
            refined,
            change: kelvin(change),
            error: None,
            cost: VariantCost { step_ms, steps: 1, ..VariantCost::default() },
        };
        // The first setting buys 0.4 K for twice the cost, the third one 0.3 K for ten times. The scene has no second one.
        let rows = [row(0, 0.0, 1.0), row(0b101, 0.5, 20.0), row(0b001, 0.4, 2.0), row(0b100, 0.3, 10.0)];
        let candidates = candidates(&rows);
        let refined: Vec<Refined> = candidates.iter().map(|one| one.0).collect();
        assert_eq!(refined, [0, 0b001, 0b100]);
        for ((_, error), expected) in candidates.iter().zip([0.5, 0.3, 0.4]) {
            assert!((error - expected).abs() < 1e-12, "{candidates:?}");
        }
    }
}
