//! The uncertainty of a run from the ranges of its parameters: T_sigma^2 = J S J^T, with J by central differences of whole runs (docs/numerics.md 12).
//!
//! A range holds 95 % of the values that a parameter may have, so it is four standard deviations wide. S has the mean squares of the deviations from the values
//! of the scene: the variance of each parameter, and the products of the distances from the values to the middles of their ranges.

use std::sync::Arc;

use rayon::prelude::*;

use super::SensitivityError;
use super::change::{overlap, own_derivative};
use super::search::{Search, check, settle};
use super::variant::VariantRun;
use crate::output::sigma::{PlaceSigma, RunSigma, SigmaCause};
use crate::scene::work::image_times;
use crate::scene::{Parameter, ParameterKind, Scene};
use crate::simulation::image::ImageSigma;
use crate::simulation::pixel_light::gains::OwnDerivatives;
use crate::simulation::prepare::Prepared;
use crate::thermal::material::Material;

/// Most pixels of all images together.
const MOST_PIXELS: usize = 1 << 23;

/// Standard deviations in a range that holds 95 % of the values.
const RANGE: f64 = 4.0;

/// The parameters of a scene that asks for its uncertainty: the list in `[uncertainty]`, and the ranges that its materials state for the outside.
/// A parameter of `[uncertainty]` takes the place of the range of a material.
fn parameters(scene: &Scene, prepared: &Prepared) -> Result<Vec<Parameter>, SensitivityError> {
    let mut all = scene.uncertainty.clone().unwrap_or_default();
    let listed = all.len();
    for material in &prepared.materials {
        let optics = [material.front.absorptivity, material.front.emissivity];
        let kinds = [ParameterKind::Absorptivity, ParameterKind::Emissivity];
        for ((kind, value), range) in kinds.into_iter().zip(optics).zip(material.ranges) {
            let Some(range) = range.filter(|_| value > 0.0) else { continue };
            let parameter = Parameter::of_material(kind, &material.name, range, &scene.source);
            if !all[..listed].iter().any(|other| other.varies(kind, &material.name)) {
                all.push(parameter);
            }
        }
    }
    if all.is_empty() {
        return Err(SensitivityError::NoRange(scene.source.clone()));
    }
    Ok(all)
}

/// A parameter of a scene, and how its deviation from the value is distributed, in shares of the value.
pub(super) struct Uncertain {
    parameter: Parameter,
    pub(super) cause: SigmaCause,
    /// Standard deviation.
    spread: f64,
    /// Mean.
    shift: f64,
}

impl Uncertain {
    fn new(parameter: Parameter, value: Option<f64>) -> Self {
        let [a, b] = parameter.range.shares(value);
        let range = [a.min(b), a.max(b)];
        let cause = SigmaCause {
            name: parameter.name.clone(),
            value,
            unit: parameter.kind.unit(),
            range_share: range,
            largest_k: 0.0,
        };
        Self { parameter, cause, spread: (range[1] - range[0]) / RANGE, shift: 0.5 * (range[0] + range[1]) }
    }

    /// By how much more a place of foil changes than its nodes show, for a change by all of the value [K].
    pub(super) fn own_derivative(&self, material: &Material, own: &OwnDerivatives) -> f64 {
        own_derivative(&self.parameter, material, own)
    }
}

/// The mean square of a deviation, as its parameters add to it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Deviation {
    variance: f64,
    mean: f64,
    /// The largest mean square of a parameter by itself, and its number.
    largest: f64,
    cause: u32,
}

impl Deviation {
    /// Adds a parameter, whose derivative is for a change by all of its value. Returns its mean square.
    pub(super) fn add(&mut self, derivative: f64, number: usize, of: &Uncertain) -> f64 {
        let (spread, shift) = (derivative * of.spread, derivative * of.shift);
        self.variance += spread * spread;
        self.mean += shift;
        let own = spread * spread + shift * shift;
        if own > self.largest {
            (self.largest, self.cause) = (own, number as u32);
        }
        own
    }

    pub(super) fn sigma(&self) -> f64 {
        (self.variance + self.mean * self.mean).sqrt()
    }

    /// The number of the parameter that adds most, plus 1. 0 where none adds anything.
    pub(super) fn label(&self) -> u32 {
        if self.largest > 0.0 { self.cause + 1 } else { 0 }
    }
}

/// The scene without what does not change its temperatures, its parameters, and how they are distributed.
///
/// # Errors
/// A scene without ranges, or a parameter that does not fit.
pub(super) fn uncertain_scene(
    prepared: &Prepared,
) -> Result<(Prepared, Vec<Parameter>, Vec<Uncertain>), SensitivityError> {
    let parameters = parameters(&prepared.scene, prepared)?;
    let mut scene = prepared.scene.clone();
    settle(&mut scene);
    let base = prepared.varied(scene, |_| ())?;
    let values = check(&parameters, &base)?;
    for (number, parameter) in parameters.iter().enumerate() {
        if let Some(other) = parameters[..number].iter().find(|other| overlap([other, parameter], &base)) {
            let message = format!("'{}' varies a value that '{}' varies too", parameter.name, other.name);
            return Err(parameter.error("vary", message).into());
        }
    }
    let uncertain = parameters.iter().cloned().zip(values).map(|(parameter, value)| Uncertain::new(parameter, value));
    let uncertain = uncertain.collect();
    Ok((base, parameters, uncertain))
}

/// Finds the uncertainty of a run.
///
/// # Errors
/// A scene without ranges or with more images than memory would hold, a parameter that does not fit, a run that fails, or Ctrl-C.
pub(crate) fn find_sigma(prepared: &Prepared, search: &Search<'_>) -> Result<RunSigma, SensitivityError> {
    let (base, parameters, mut uncertain) = uncertain_scene(prepared)?;
    let mut rows: Vec<Vec<Deviation>> = Vec::new();
    let mut images: Vec<Vec<[Deviation; 2]>> = Vec::new();
    let mut take = |number: usize, [up, down]: [VariantRun; 2]| {
        let of = &mut uncertain[number];
        let over = 0.5 / of.parameter.step;
        rows.resize_with(up.rows.len(), Vec::new);
        for (sums, (up, down)) in rows.iter_mut().zip(up.rows.iter().zip(&down.rows)) {
            sums.resize_with(up.len(), Deviation::default);
            for (sum, (up, down)) in sums.iter_mut().zip(up.iter().zip(down)) {
                let own = up.zip(*down).map_or(0.0, |(up, down)| sum.add(over * (up - down), number, of));
                of.cause.largest_k = of.cause.largest_k.max(own.sqrt());
            }
        }
        images.resize_with(up.images.len(), Vec::new);
        for (sums, ((up, _), (down, _))) in images.iter_mut().zip(up.images.iter().zip(&down.images)) {
            sums.resize_with(up.temperature.len(), Default::default);
            sums.par_iter_mut().enumerate().for_each(|(pixel, sums)| {
                let over = |up: &[f32], down: &[f32]| over * (f64::from(up[pixel]) - f64::from(down[pixel]));
                sums[0].add(over(&up.temperature, &down.temperature), number, of);
                sums[1].add(over(&up.radiance, &down.radiance), number, of);
            });
        }
    };
    let run = search.pairs(&base, &parameters, &mut take)?;
    let place = |(sum, temperature): (&Deviation, &Option<f64>)| {
        temperature.map(|_| PlaceSigma { kelvin: sum.sigma(), cause: sum.cause as usize })
    };
    let rows = rows.iter().zip(&run.rows).map(|(sums, row)| sums.iter().zip(row).map(place).collect()).collect();
    let names: Arc<Vec<String>> = Arc::new(uncertain.iter().map(|of| of.cause.name.clone()).collect());
    let image = |sums: Vec<[Deviation; 2]>| ImageSigma {
        temperature: sums.iter().map(|[sum, _]| sum.sigma() as f32).collect(),
        radiance: sums.iter().map(|[_, sum]| sum.sigma() as f32).collect(),
        cause: sums.iter().map(|[sum, _]| sum.label()).collect(),
        causes: Arc::clone(&names),
    };
    let parts = base.parts.iter().map(|name| ("part", name.clone()));
    let probes = base.scene.probes.iter().map(|probe| ("probe", probe.name.clone()));
    Ok(RunSigma {
        causes: uncertain.into_iter().map(|of| of.cause).collect(),
        places: parts.chain(probes).collect(),
        times: run.times,
        rows,
        images: run
            .images
            .iter()
            .map(|(_, header)| (header.step, header.image))
            .zip(images.into_iter().map(image))
            .collect(),
    })
}

/// Numbers of the images of a run, all of which get an uncertainty.
///
/// # Errors
/// More pixels than [`MOST_PIXELS`].
pub(crate) fn all_images(scene: &Scene) -> Result<Vec<usize>, SensitivityError> {
    let count = image_times(&scene.time).count();
    let pixels = scene.camera.as_ref().map_or(0, |camera| camera.width as usize * camera.height as usize);
    if count * pixels > MOST_PIXELS {
        return Err(SensitivityError::ManyPixels { path: scene.source.clone(), images: count, pixels });
    }
    Ok((0..count).collect())
}
