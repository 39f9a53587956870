//! Runs the scene as it is and with each parameter changed, and takes the differences.

use std::sync::atomic::AtomicBool;

use super::SensitivityError;
use super::change::{change_materials, change_scene, values};
use super::side_by_side::do_side_by_side;
use super::variant::{BaseRun, VariantRun, VariantWalk};
use crate::converge::RunNews;
use crate::output::frame::FrameHeader;
use crate::scene::{Draw, Parameter, ParameterRange, Scene};
use crate::simulation::engine::Engine;
use crate::simulation::image::Image;
use crate::simulation::is_drawn;
use crate::simulation::orbit_end::Displacement;
use crate::simulation::prepare::Prepared;
use crate::simulation::target::Target;
use crate::trace::span;

/// Change over an orbit below which the warm-up of the scene as it is ends [K]. What is left is in all runs alike.
const BASE_TOLERANCE: f64 = 0.01;

/// Derivative and its error: for a change by all of the value [K].
pub(super) type Derivative = [f64; 2];

/// How temperatures depend on a parameter.
pub(crate) struct Sensitivity {
    pub(super) parameter: Parameter,
    /// The value, where all owners have one.
    pub(super) value: Option<f64>,
    /// Of parts and probes at each step. A part without area has none.
    pub(super) rows: Vec<Vec<Option<Derivative>>>,
    /// Of the pixels of each image, and the error of each.
    pub(super) images: Vec<[Vec<f32>; 2]>,
}

impl Sensitivity {
    /// Ends of the stated range, as shares of the value by which it changes.
    pub(super) fn range(&self) -> [f64; 2] {
        self.parameter.range.shares(self.value)
    }
}

/// The results of all runs.
pub(crate) struct Sensitivities {
    pub(super) scene: String,
    /// Parts, then probes, each with its kind.
    pub(super) places: Vec<(&'static str, String)>,
    pub(super) times: Vec<f64>,
    /// Temperatures of the places in the scene as it is [K].
    pub(super) temperatures: Vec<Vec<Option<f64>>>,
    pub(super) images: Vec<(Image, FrameHeader)>,
    pub(super) of: Vec<Sensitivity>,
}

/// A search, and how it tells its progress.
pub(crate) struct Search<'a> {
    pub(crate) target: &'a Target,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) news: &'a dyn Fn(RunNews),
    /// Numbers of the images whose pixels are differenced.
    pub(crate) kept: &'a [usize],
    /// The steps whose temperatures of nodes are kept, as in [`VariantWalk`].
    pub(crate) nodes_every: Option<u32>,
}

/// Gives the scene of a sensitivity its warm-up. Returns an assumption for the user where that is not periodic.
pub(crate) fn settle(scene: &mut Scene) -> Option<String> {
    tighten(scene, BASE_TOLERANCE)
}

/// Gives a scene a warm-up to a tolerance [K] where it asks for its periodic state. Returns an assumption for the user where it does not.
pub(crate) fn tighten(scene: &mut Scene, most: f64) -> Option<String> {
    // Surface temperatures are differenced, which no sensor, error or budget changes.
    scene.sensor = None;
    (scene.images.error, scene.images.budget) = (false, false);
    match &mut scene.time.periodic {
        Some(tolerance) => {
            *tolerance = tolerance.min(most);
            None
        }
        None => Some("each run begins with the scene's own warm-up, which is not periodic (time.warm_up)".to_owned()),
    }
}

/// Leaves out the images at ends of steps that are not kept, which each run would draw for nothing. Returns the numbers of the others.
pub(crate) fn draw_kept(scene: &mut Scene, kept: Vec<usize>) -> Vec<usize> {
    if scene.time.draw.is_between_steps() {
        return kept;
    }
    let steps: Vec<u32> = (0..=scene.time.steps).filter(|step| is_drawn(&scene.time.draw, *step)).collect();
    scene.time.draw = Draw::Steps(kept.iter().filter_map(|number| steps.get(*number).copied()).collect());
    (0..kept.len()).collect()
}

/// Refuses parameters that a scene lacks, and ranges that do not hold the value or that no value can fill. Returns the value of each where all of its owners
/// have one.
///
/// # Errors
/// The first parameter that does not fit, or a scene whose temperatures come from a file.
pub(crate) fn check(parameters: &[Parameter], prepared: &Prepared) -> Result<Vec<Option<f64>>, SensitivityError> {
    let value = |parameter: &Parameter| {
        let values = values(parameter, prepared)?;
        let (kind, value) = (parameter.kind, values[0]);
        let same = values.iter().all(|other| (other - value).abs() <= 1e-12 * value.abs());
        let largest = values.iter().copied().fold(f64::MIN, f64::max);
        let (key, message) = match parameter.range {
            ParameterRange::Values(_) if !same => {
                ("range", format!("names values from {values:?}, which have no common range: state percent"))
            }
            ParameterRange::Values([low, high]) if (low - value).max(value - high) > 1e-9 * value.abs() => {
                ("range", format!("{low} to {high} leaves out the value in the scene, {value}"))
            }
            ParameterRange::Percent(percent) if kind.is_share() && largest * (1.0 + percent / 100.0) > 1.0 + 1e-9 => {
                let most = 100.0 / largest - 100.0;
                let word = kind.word();
                (
                    "percent",
                    format!(
                        "{percent} takes {largest} above 1, and {word} is at most 1: state at most {most:.3}, or a range"
                    ),
                )
            }
            ParameterRange::Percent(percent) if percent > 100.0 && !kind.is_power() => {
                ("percent", format!("{percent} takes {} below 0: state at most 100", kind.word()))
            }
            _ => return Ok(same.then_some(value)),
        };
        Err(parameter.error(key, message).into())
    };
    parameters.iter().map(value).collect()
}

impl Search<'_> {
    /// All runs: the scene as it is, and two for each parameter, whose values [`check`] gave.
    ///
    /// # Errors
    /// A run that fails, or Ctrl-C.
    pub(crate) fn of(
        &self,
        prepared: &Prepared,
        parameters: Vec<Parameter>,
        values: Vec<Option<f64>>,
    ) -> Result<Sensitivities, SensitivityError> {
        let (base, _engine) = self.run_base(prepared)?;
        let mut of = Vec::new();
        let take = |number: usize, runs: [VariantRun; 2]| {
            let parameter: &Parameter = &parameters[number];
            let differences = Differences { base: &base.run, runs: &runs, step: parameter.step };
            of.push(differences.sensitivity(parameter.clone(), values[number]));
        };
        self.runs(prepared, &base, &parameters, take)?;
        let base = base.run;
        let parts = prepared.parts.iter().map(|name| ("part", name.clone()));
        let probes = prepared.scene.probes.iter().map(|probe| ("probe", probe.name.clone()));
        Ok(Sensitivities {
            scene: prepared.scene.name.clone(),
            places: parts.chain(probes).collect(),
            times: base.times,
            temperatures: base.rows,
            images: base.images,
            of,
        })
    }

    /// The scene as it is, and then for each parameter the runs with its value up and down by its step. `take` gets the number of the parameter and both runs.
    ///
    /// # Errors
    /// A run that fails, or Ctrl-C.
    pub(super) fn pairs(
        &self,
        prepared: &Prepared,
        parameters: &[Parameter],
        take: &mut dyn FnMut(usize, [VariantRun; 2]),
    ) -> Result<VariantRun, SensitivityError> {
        let (base, _engine) = self.run_base(prepared)?;
        self.runs(prepared, &base, parameters, take)?;
        Ok(base.run)
    }

    /// Runs the scene as it is. While the engine lives, runs of the same geometry share its view factors.
    fn run_base(&self, prepared: &Prepared) -> Result<(BaseRun, Box<dyn Engine>), SensitivityError> {
        let steps = u64::from(prepared.warm_up_steps()) + u64::from(prepared.scene.time.steps);
        let name = "the scene as it is".to_owned();
        (self.news)(RunNews::Begins(name.clone(), steps));
        let _runs = span(name.clone());
        let stepped = || (self.news)(RunNews::Stepped);
        let warned = |text: String| (self.news)(RunNews::Says(format!("warning: {text}")));
        let Self { target, kept, nodes_every, stop, .. } = *self;
        VariantWalk { name: &name, target, kept, nodes_every, stop, stepped: &stepped, warned: &warned }
            .run_base(prepared)
    }

    /// The runs of each parameter, with its value up and down by its step. `take` gets them in the order of the parameters. A share that the step would take
    /// above 1 goes down by one and by two steps, and these and the scene as it is give the run above.
    fn runs(
        &self,
        prepared: &Prepared,
        as_it_is: &BaseRun,
        parameters: &[Parameter],
        take: impl FnMut(usize, [VariantRun; 2]),
    ) -> Result<(), SensitivityError> {
        let Self { target, kept, nodes_every, stop, news } = *self;
        let count = 2 * parameters.len() as u64;
        news(RunNews::Begins(format!("{count} runs with other values"), count));
        let work = |number: usize, news: &dyn Fn(RunNews)| {
            let parameter: &Parameter = &parameters[number];
            let above_one = |value: &f64| parameter.kind.is_share() && value * (1.0 + parameter.step) > 1.0;
            let is_bound = values(parameter, prepared)?.iter().any(above_one);
            let changes = if is_bound { [-1.0, -2.0] } else { [1.0, -1.0] };
            // The first run tells where the other begins to settle: at its own share of the distance of the first from the scene as it is.
            let mut first: Option<Displacement> = None;
            let mut run = |times: f64| {
                let share = times * parameter.step;
                let varied = changed(prepared, parameter, 1.0 + share)?;
                let name = format!("{} {:+} %", parameter.name, 100.0 * share);
                let warned = |text: String| news(RunNews::Says(format!("warning: {text}")));
                let walk =
                    VariantWalk { name: &name, target, kept, nodes_every, stop, stepped: &|| (), warned: &warned };
                // The state of other nodes would not fit.
                let base = Some(as_it_is).filter(|_| varied.nodes == prepared.nodes);
                let shift = first.as_ref().map(|first| (first, times / changes[0]));
                let (run, settled) = walk.run_beside(base, shift, &varied)?;
                first = settled;
                news(RunNews::Stepped);
                Ok::<_, SensitivityError>(run)
            };
            let [near, far] = [run(changes[0])?, run(changes[1])?];
            Ok(if is_bound { [VariantRun::beyond(&as_it_is.run, &near, &far), near] } else { [near, far] })
        };
        do_side_by_side(parameters.len(), news, work, take)
    }
}

/// A scene with the values of a parameter times a factor.
fn changed(base: &Prepared, parameter: &Parameter, factor: f64) -> Result<Prepared, SensitivityError> {
    let mut scene = base.scene.clone();
    change_scene(parameter, factor, &mut scene);
    Ok(base.varied(scene, |materials| change_materials(parameter, factor, materials))?)
}

/// Runs with a value as it is, and more and less by the step.
struct Differences<'a> {
    base: &'a VariantRun,
    runs: &'a [VariantRun; 2],
    step: f64,
}

impl Differences<'_> {
    /// The derivative for a change by all of the value, and its error: the distance of the differences to one side from it, and what the warm-ups left.
    fn derivative(&self, base: f64, [up, down]: [f64; 2]) -> Derivative {
        let left = self.runs[0].unsettled + self.runs[1].unsettled;
        [(up - down) / (2.0 * self.step), ((up - 2.0 * base + down).abs() + left) / (2.0 * self.step)]
    }

    fn sensitivity(&self, parameter: Parameter, value: Option<f64>) -> Sensitivity {
        let row = |number: usize| {
            let at = |(place, base): (usize, &Option<f64>)| {
                let [up, down] = self.runs.each_ref().map(|run| run.rows[number][place]);
                Some(self.derivative((*base)?, [up?, down?]))
            };
            self.base.rows[number].iter().enumerate().map(at).collect()
        };
        let image = |number: usize| {
            let of = |run: &VariantRun, pixel: usize| f64::from(run.images[number].0.temperature[pixel]);
            let at = |pixel: usize| {
                let changed = self.runs.each_ref().map(|run| of(run, pixel));
                self.derivative(of(self.base, pixel), changed).map(|value| value as f32)
            };
            let pixels: Vec<[f32; 2]> = (0..self.base.images[number].0.temperature.len()).map(at).collect();
            [0, 1].map(|part| pixels.iter().map(|pixel| pixel[part]).collect())
        };
        Sensitivity {
            parameter,
            value,
            rows: (0..self.base.rows.len()).map(row).collect(),
            images: (0..self.base.images.len()).map(image).collect(),
        }
    }
}
