//! Refines each knob by itself until its change is small, then all, and chooses the cheapest settings within a stated error.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::ConvergeError;
use super::knobs::{KNOBS, Knob, KnobScene, Levels};
use super::pixels::{PixelDifference, between};
use super::walk::{VariantCost, VariantRun, cpu_seconds, kept_images, pilot, run};
use crate::scene::{Draw, Scene};
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;

/// Most settings that are run to verify a choice.
const MOST_CHOICES: usize = 6;
/// Share of the room for error that a choice takes after another one did not hold.
const CAUTION: f64 = 0.8;

/// The knob of a row that has none: the scene as it is.
pub(crate) const AS_STATED: &str = "scene";
/// All knobs at their finest.
pub(crate) const FINEST: &str = "all finer";
/// A choice that was run to verify it.
pub(crate) const CHOICE: &str = "choice";

/// What the search tells on its way.
pub(crate) enum ConvergeNews<'a> {
    /// A sentence for the user.
    Says(&'a str),
    /// More work is known: its predicted wall time [ms].
    Ahead(f64),
    /// A part of this work is done [ms].
    Done(f64),
    /// A run begins.
    Begins(&'a str),
}

/// A run with its settings.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub(crate) struct ConvergeRow {
    /// The knob, or the role of the run.
    pub(crate) knob: String,
    /// Value before and after, as TOML.
    pub(crate) before: String,
    pub(crate) after: String,
    /// Difference between before and after.
    pub(crate) change: Option<PixelDifference>,
    /// Difference from all knobs at their finest.
    pub(crate) error: Option<PixelDifference>,
    #[serde(skip)]
    pub(crate) cost: VariantCost,
    /// The reason if there are no numbers.
    pub(crate) failed: Option<String>,
}

/// The result of a search.
pub(crate) struct Converged {
    pub(crate) knobs: KnobScene,
    pub(crate) within: f64,
    pub(crate) rows: Vec<ConvergeRow>,
    /// The cheapest settings that were found within the error, and their difference from the finest. `None` if only the finest itself would do.
    pub(crate) chosen: Option<(Levels, PixelDifference)>,
    pub(crate) finest: Levels,
    /// Change that the last refinement of each knob made, added in squares: what the finest settings may still be off [K].
    pub(crate) finest_error: f64,
    /// Compared images of a run, and all images of the scene.
    pub(crate) images: usize,
    pub(crate) warnings: Vec<String>,
}

/// What all runs have in common.
pub(crate) struct Search<'a> {
    pub(crate) target: &'a Target,
    /// Error that the settings may have [K rms].
    pub(crate) within: f64,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) news: &'a dyn Fn(ConvergeNews<'_>),
}

/// A knob's runs by itself: level 0 is the scene.
struct OfKnob {
    knob: Knob,
    /// The runs of levels 1 and above.
    runs: Vec<VariantRun>,
    /// Change that the last level made [K rms].
    last_change: f64,
}

impl OfKnob {
    fn finest(&self) -> u32 {
        self.runs.len() as u32
    }

    /// Error of a level by itself [K rms], and its cost over the cost of the scene.
    fn level(&self, base: &VariantRun, level: u32) -> (f64, f64) {
        let run = |level: u32| if level == 0 { base } else { &self.runs[level as usize - 1] };
        let cost = run(level).cost.stepping_ms() / base.cost.stepping_ms().max(f64::MIN_POSITIVE);
        if level == self.finest() {
            return (0.0, cost.max(1.0));
        }
        let error = between(&run(level).images, &run(self.finest()).images).map_or(f64::INFINITY, |one| one.rms);
        (error, if level == 0 { 1.0 } else { cost.max(1.0) })
    }
}

impl Search<'_> {
    /// Searches the settings of a scene.
    ///
    /// # Errors
    /// A scene without images, a failed run of the scene itself or of the finest settings, or Ctrl-C.
    pub(crate) fn of(&self, scene: Scene, prepared: &Prepared) -> Result<Converged, ConvergeError> {
        let source = scene.source.clone();
        let knobs = KnobScene::new(prepared, scene);
        let kept = kept_images(prepared);
        if knobs.scene().camera.is_none() || knobs.scene().time.draw == Draw::None || kept.is_empty() {
            return Err(ConvergeError::NoImages(source));
        }
        let present = knobs.knobs();
        if present.is_empty() {
            return Err(ConvergeError::NoKnobs(source));
        }
        let forecast = self.forecast(&knobs, &present, prepared, kept.len())?;
        let base = self.run(&knobs, &[0; KNOBS], &kept, AS_STATED, forecast[0])?;
        if between(&base.images, &base.images).is_none() {
            return Err(ConvergeError::NoPixels(source));
        }
        let mut found = Converged {
            within: self.within,
            rows: vec![ConvergeRow { knob: AS_STATED.to_owned(), cost: base.cost, ..ConvergeRow::default() }],
            chosen: None,
            finest: [0; KNOBS],
            finest_error: 0.0,
            images: kept.len(),
            warnings: Vec::new(),
            knobs,
        };
        let limit = self.within / (present.len() as f64).sqrt();
        let mut of_knobs = Vec::new();
        for (knob, predicted) in present.iter().zip(&forecast[1..]) {
            of_knobs.push(self.refine(&mut found, &base, *knob, &kept, (limit, *predicted))?);
        }
        for one in &of_knobs {
            found.finest = one.knob.at(one.finest(), found.finest);
        }
        found.finest_error = of_knobs.iter().map(|one| one.last_change * one.last_change).sum::<f64>().sqrt();
        let ratio: f64 = of_knobs.iter().map(|one| one.level(&base, one.finest()).1).product();
        let predicted = (base.cost.wall_s * ratio).max(forecast.last().copied().unwrap_or(0.0));
        (self.news)(ConvergeNews::Ahead((predicted - forecast.last().copied().unwrap_or(0.0)) * 1e3));
        (self.news)(ConvergeNews::Says(&format!("all settings finer: about {}", seconds(predicted))));
        let finest = self.run(&found.knobs, &found.finest, &kept, FINEST, predicted).map_err(|error| match error {
            ConvergeError::Stopped => error,
            other => ConvergeError::Finest { path: source, reason: other.to_string() },
        })?;
        // Errors of the rows so far, in their order.
        let runs = std::iter::once(&base).chain(of_knobs.iter().flat_map(|one| &one.runs));
        for (row, run) in found.rows.iter_mut().filter(|row| row.failed.is_none()).zip(runs) {
            row.error = between(&run.images, &finest.images);
        }
        found.rows.push(ConvergeRow {
            knob: FINEST.to_owned(),
            change: between(&base.images, &finest.images),
            cost: finest.cost,
            ..ConvergeRow::default()
        });
        self.choose(&mut found, &base, &of_knobs, &kept, &finest)?;
        Ok(found)
    }

    /// Refines a knob by itself until its change is below `limit` [K rms], and adds the rows.
    fn refine(
        &self,
        found: &mut Converged,
        base: &VariantRun,
        knob: Knob,
        kept: &[usize],
        (limit, mut predicted): (f64, f64),
    ) -> Result<OfKnob, ConvergeError> {
        let mut of_knob = OfKnob { knob, runs: Vec::new(), last_change: 0.0 };
        let most = found.knobs.most(knob);
        for level in 1..=most {
            let [before, after] = [level - 1, level].map(|level| knob.at(level, [0; KNOBS]));
            let mut row = ConvergeRow {
                knob: knob.name().to_owned(),
                before: found.knobs.value(knob, &before),
                after: found.knobs.value(knob, &after),
                ..ConvergeRow::default()
            };
            if level > 1 {
                (self.news)(ConvergeNews::Ahead(predicted * 1e3));
            }
            let name = format!("{} = {}", knob.key(), row.after);
            let ran = match self.run(&found.knobs, &after, kept, &name, predicted) {
                Err(ConvergeError::Stopped) => return Err(ConvergeError::Stopped),
                Err(error) => {
                    found.warnings.push(format!("{name} failed, so it was not refined further: {error}"));
                    found.rows.push(ConvergeRow { failed: Some(error.to_string()), ..row });
                    break;
                }
                Ok(ran) => ran,
            };
            let last = of_knob.runs.last().unwrap_or(base);
            row.change = between(&last.images, &ran.images);
            row.cost = ran.cost;
            predicted = ran.cost.wall_s * (ran.cost.wall_s / last.cost.wall_s.max(1e-9)).max(1.0);
            of_knob.last_change = row.change.map_or(f64::INFINITY, |change| change.rms);
            found.rows.push(row);
            of_knob.runs.push(ran);
            if of_knob.last_change <= limit {
                break;
            }
            if level == most && most > 1 {
                found.warnings.push(format!(
                    "{}: still changes {:.3} K rms at {}, which is above {limit:.3} K; the finest settings may be off by as much",
                    knob.key(),
                    of_knob.last_change,
                    found.knobs.value(knob, &after)
                ));
            }
        }
        Ok(of_knob)
    }

    /// Chooses the cheapest settings whose measured difference from the finest is within the error.
    fn choose(
        &self,
        found: &mut Converged,
        base: &VariantRun,
        of_knobs: &[OfKnob],
        kept: &[usize],
        finest: &VariantRun,
    ) -> Result<(), ConvergeError> {
        let table: Vec<Vec<(f64, f64)>> =
            of_knobs.iter().map(|one| (0..=one.finest()).map(|level| one.level(base, level)).collect()).collect();
        let mut room = self.within;
        let mut tried: Vec<Levels> = Vec::new();
        while tried.len() < MOST_CHOICES {
            let levels = cheapest(&table, room);
            let levels = of_knobs.iter().zip(&levels).fold([0; KNOBS], |all, (one, level)| one.knob.at(*level, all));
            if levels == found.finest {
                break;
            }
            room *= CAUTION;
            if tried.contains(&levels) {
                continue;
            }
            tried.push(levels);
            let ran = if levels == [0; KNOBS] {
                base.clone()
            } else {
                let ratio: f64 = of_knobs
                    .iter()
                    .zip(&table)
                    .map(|(one, costs)| costs[levels[one.knob.index()] as usize].1)
                    .product();
                let predicted = base.cost.wall_s * ratio;
                (self.news)(ConvergeNews::Ahead(predicted * 1e3));
                match self.run(&found.knobs, &levels, kept, CHOICE, predicted) {
                    Ok(ran) => ran,
                    Err(ConvergeError::Stopped) => return Err(ConvergeError::Stopped),
                    Err(error) => {
                        found.warnings.push(format!("a choice of settings failed: {error}"));
                        continue;
                    }
                }
            };
            let error = between(&ran.images, &finest.images);
            if levels != [0; KNOBS] {
                let after = changed_keys(&found.knobs, &levels).join(", ");
                found.rows.push(ConvergeRow {
                    knob: CHOICE.to_owned(),
                    after,
                    change: between(&base.images, &ran.images),
                    error,
                    cost: ran.cost,
                    ..ConvergeRow::default()
                });
            }
            if let Some(error) = error.filter(|error| error.rms <= self.within) {
                found.chosen = Some((levels, error));
                break;
            }
        }
        Ok(())
    }

    /// Runs some levels, and counts its predicted wall time [s] as done.
    fn run(
        &self,
        knobs: &KnobScene,
        levels: &Levels,
        kept: &[usize],
        name: &str,
        predicted: f64,
    ) -> Result<VariantRun, ConvergeError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(ConvergeError::Stopped);
        }
        (self.news)(ConvergeNews::Begins(name));
        let began = (Instant::now(), cpu_seconds());
        let prepared = knobs.prepared(levels)?;
        let time = &prepared.scene.time;
        let warm_up = if time.periodic.is_some() { 0 } else { prepared.warm_up_steps() };
        let share = predicted * 1e3 / f64::from(warm_up.saturating_add(time.steps).max(1));
        run(&prepared, self.target, kept, began, self.stop, &mut || (self.news)(ConvergeNews::Done(share)))
    }

    /// Measures a few steps of the scene, of each knob by itself and of all, and tells how long the runs will take. Returns the wall times [s] in this order.
    fn forecast(
        &self,
        knobs: &KnobScene,
        present: &[Knob],
        prepared: &Prepared,
        images: usize,
    ) -> Result<Vec<f64>, ConvergeError> {
        let all = present.iter().fold([0; KNOBS], |all, knob| knob.at(1, all));
        let variants: Vec<Levels> = std::iter::once([0; KNOBS])
            .chain(present.iter().map(|knob| knob.at(1, [0; KNOBS])))
            .chain(std::iter::once(all))
            .collect();
        let time = &prepared.scene.time;
        let mut predicted = Vec::new();
        for levels in &variants {
            if self.stop.load(Ordering::Relaxed) {
                return Err(ConvergeError::Stopped);
            }
            let began = Instant::now();
            let measured = knobs.prepared(levels).map_err(ConvergeError::from).and_then(|prepared| {
                let warm_up = f64::from(prepared.warm_up_steps());
                pilot(&prepared, self.target, images, began, warm_up)
            });
            // A variant that fails here fails in its run too, and says why there.
            predicted.push(measured.unwrap_or(0.0));
        }
        let total: f64 = predicted.iter().sum();
        let most = if time.periodic.is_some() { "at most " } else { "" };
        let periodic = match time.periodic {
            Some(_) => format!(
                "; that counts {} orbits of warm-up a run, and a run takes fewer where it becomes periodic",
                time.warm_up_orbits
            ),
            None => String::new(),
        };
        let (name, longest) = present
            .iter()
            .map(|knob| knob.key())
            .chain([FINEST])
            .zip(&predicted[1..])
            .max_by(|a, b| a.1.total_cmp(b.1))
            .unwrap_or((AS_STATED, &0.0));
        (self.news)(ConvergeNews::Says(&format!(
            "forecast from measured steps: {} runs take {most}about {}, the longest ({name}) {}{periodic}. A setting that still changes the images is \
             refined again, and choices are verified: each such run adds to this, and is told",
            predicted.len(),
            seconds(total),
            seconds(*longest)
        )));
        (self.news)(ConvergeNews::Ahead(total * 1e3));
        Ok(predicted)
    }
}

/// The levels with the least product of costs whose errors, added in squares, are at most `room` [K]. `table` has error and cost of each level of each knob.
fn cheapest(table: &[Vec<(f64, f64)>], room: f64) -> Vec<u32> {
    // The level of each knob, with the sum of squares and the product so far. Dominated beginnings are dropped.
    let mut beginnings: Vec<(Vec<u32>, f64, f64)> = vec![(Vec::new(), 0.0, 1.0)];
    for levels in table {
        let mut next: Vec<(Vec<u32>, f64, f64)> = Vec::new();
        for (chosen, squares, cost) in &beginnings {
            for (level, (error, ratio)) in levels.iter().enumerate() {
                let squares = squares + error * error;
                if squares <= room * room {
                    let chosen = chosen.iter().copied().chain([level as u32]).collect();
                    next.push((chosen, squares, cost * ratio));
                }
            }
        }
        next.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.1.total_cmp(&b.1)));
        let mut least = f64::INFINITY;
        next.retain(|(_, squares, _)| {
            let better = *squares < least;
            least = least.min(*squares);
            better
        });
        beginnings = next;
    }
    let finest = || table.iter().map(|levels| levels.len() as u32 - 1).collect();
    beginnings.into_iter().next().map_or_else(finest, |one| one.0)
}

/// The settings that differ from the scene, as `key = value`.
pub(crate) fn changed_keys(knobs: &KnobScene, levels: &Levels) -> Vec<String> {
    let changed = Knob::ALL.into_iter().filter(|knob| levels[knob.index()] > 0);
    changed.map(|knob| format!("{} = {}", knob.key(), knobs.value(knob, levels))).collect()
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
    fn the_cheapest_levels_fill_the_room_for_error() {
        // Refining the first knob buys 0.4 K for twice the cost, the second one 0.3 K for ten times.
        let table = vec![vec![(0.4, 1.0), (0.1, 2.0), (0.0, 4.0)], vec![(0.3, 1.0), (0.0, 10.0)]];
        assert_eq!(cheapest(&table, 0.5), [0, 0]);
        assert_eq!(cheapest(&table, 0.499), [1, 0]);
        assert_eq!(cheapest(&table, 0.3), [2, 0]);
        assert_eq!(cheapest(&table, 0.29), [1, 1]);
        assert_eq!(cheapest(&table, 0.05), [2, 1]);
    }
}
