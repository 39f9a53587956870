//! Sets the response of every material in each of the three runs.

use std::path::Path;

use super::CompareError;
use crate::scene::Scene;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::{PrepareError, PrepareStage};
use crate::thermal::function::{Function, FunctionKind};
use crate::thermal::material::{Bulk, Domain, Material, Profile, Radiative, Response, Sides, Transition};
use crate::thermal::shell::{ShellError, ShellMaterial};
use crate::thermal::step_response::{Fitted, MaterialPlate};

/// The origin of a material's transition.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ResponseOrigin {
    /// The scene states it.
    Stated,
    /// Fitted to the step response of the material's network.
    Fitted(Box<Fitted>),
    /// None: the material is `instant` in all runs.
    Kept,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OfMaterial {
    pub(crate) name: String,
    /// The transition in the run `transition`. `None` for an `instant` material.
    pub(crate) transition: Option<Transition>,
    pub(crate) origin: ResponseOrigin,
}

/// Whether a material stays `instant` in all runs: the scene says so, and it states no network values.
pub(crate) fn is_kept(material: &Material) -> bool {
    let silent = Bulk { conductivity: None, ..material.bulk } == Bulk::default();
    material.response == Response::Instant && silent
}

/// The scene with every material `instant`.
pub(crate) fn instant(scene: &Scene, progress: &mut dyn FnMut(PrepareStage)) -> Result<Prepared, PrepareError> {
    let change = |materials: &mut [Material]| materials.iter_mut().for_each(|one| one.response = Response::Instant);
    Prepared::with_materials(without_network(scene), change, progress)
}

/// The scene with every material a `transition`. `of` has an entry for each material.
pub(crate) fn transition(
    scene: &Scene,
    fits: &[OfMaterial],
    progress: &mut dyn FnMut(PrepareStage),
) -> Result<Prepared, PrepareError> {
    let change = |materials: &mut [Material]| {
        for (material, fit) in materials.iter_mut().zip(fits) {
            material.response = fit.transition.clone().map_or(Response::Instant, Response::Transition);
        }
    };
    Prepared::with_materials(without_network(scene), change, progress)
}

/// The scene with every material that stores heat `radiative`. A material that stores none follows its load at once.
pub(crate) fn radiative(scene: &Scene, progress: &mut dyn FnMut(PrepareStage)) -> Result<Prepared, PrepareError> {
    let change = |materials: &mut [Material]| {
        for material in materials.iter_mut() {
            let plate = Radiative::of(&material.bulk, scene.time.step).ok();
            material.response = plate.map_or(Response::Instant, Response::Radiative);
        }
    };
    Prepared::with_materials(without_network(scene), change, progress)
}

/// The scene with every material a `network`, except for the kept ones.
///
/// # Errors
/// All materials that lack network values, in one error. Also as [`Prepared::new`].
pub(crate) fn network(scene: &Scene, progress: &mut dyn FnMut(PrepareStage)) -> Result<Prepared, CompareError> {
    let mut lacks = Vec::new();
    let mut any = false;
    let change = |materials: &mut [Material]| {
        for material in materials.iter_mut().filter(|material| !is_kept(material)) {
            any = true;
            let keys = lacking(material);
            if keys.is_empty() {
                material.response = Response::Network;
            } else {
                lacks.push(format!("'{}': {}", material.name, keys.join(", ")));
                material.response = Response::Instant;
            }
        }
    };
    // Errors about contacts and heaters would hide the missing values, so those are checked first.
    let prepared = Prepared::with_materials(scene.clone(), change, progress);
    if !lacks.is_empty() {
        return Err(CompareError::Lacks { path: scene.source.clone(), lacks: lacks.join("; ") });
    }
    let prepared = prepared?;
    if !any {
        return Err(CompareError::NothingToCompare(scene.source.clone()));
    }
    Ok(prepared)
}

/// The missing network keys of a material, with units.
pub(crate) fn lacking(material: &Material) -> Vec<String> {
    let mut filled = material.clone();
    let mut keys = Vec::new();
    while let Err(ShellError::Lacks { key, .. }) = ShellMaterial::of(&filled) {
        let bulk = &mut filled.bulk;
        let value = match key.split(' ').next() {
            Some("thickness") => &mut bulk.thickness,
            Some("density") => &mut bulk.density,
            Some("specific_heat") => &mut bulk.specific_heat,
            _ => break,
        };
        if value.replace(1.0).is_some() {
            break;
        }
        keys.push(key);
    }
    keys
}

/// The scene without contacts and heaters, which only act in a network.
fn without_network(scene: &Scene) -> Scene {
    Scene { contacts: Vec::new(), heaters: Vec::new(), ..scene.clone() }
}

/// The transition of every material: stated by the scene, or fitted to the step response of a plate between two
/// temperatures [K], `swings`.
///
/// # Errors
/// No transition fits a material.
pub(crate) fn transitions(network: &Prepared, swings: &[[f64; 2]]) -> Result<Vec<OfMaterial>, CompareError> {
    let fit = |(material, between): (&Material, &[f64; 2])| {
        let (transition, origin) = match (&material.response, &material.transition) {
            (Response::Network, Some(stated)) => (Some(stated.clone()), ResponseOrigin::Stated),
            (Response::Network, None) => {
                let fitted = plate(material)
                    .fit(*between, network.scene.time.step)
                    .map_err(|source| CompareError::Fit { material: material.name.clone(), source })?;
                if let Some(reason) = is_none(&fitted, network.scene.time.step, network.scene.orbit.period()) {
                    let (material, between) = (material.name.clone(), fitted.between);
                    return Err(CompareError::NoFit { material, between, reason });
                }
                (Some(fitted.transition.clone()), ResponseOrigin::Fitted(Box::new(fitted)))
            }
            _ => (None, ResponseOrigin::Kept),
        };
        Ok(OfMaterial { name: material.name.clone(), transition, origin })
    };
    network.materials.iter().zip(swings).map(fit).collect()
}

/// Most orbits that a fitted transition may take. In orbit the target of a longer one turns back long before it comes near.
const LONGEST_ORBITS: f64 = 10.0;
/// Largest root mean square difference of a fit from its step response, as a share of the step. A constant in the middle of the data errs by a quarter or so.
const LARGEST_SHARE: f64 = 0.1;

/// Why a fit is none, in a scene with steps of `step` [s] and orbits of `period` [s].
fn is_none(fitted: &Fitted, step: f64, period: f64) -> Option<String> {
    let Fitted { transition, between: [cold, hot], .. } = fitted;
    let branches =
        [("heating", &transition.heating, fitted.heating[0]), ("cooling", &transition.cooling, fitted.cooling[0])];
    branches.into_iter().find_map(|(branch, profile, rms)| {
        let (t_max, share) = (profile.t_max_steps * step, rms / (hot - cold));
        if share > LARGEST_SHARE || share.is_nan() {
            return Some(format!(
                "the best {branch} is {rms:.1} K rms off the data, {:.0} % of the step",
                100.0 * share
            ));
        }
        (t_max > LONGEST_ORBITS * period).then(|| {
            format!(
                "the best {branch} takes {t_max:.0} s, {:.0} orbits, so it would hardly move in one",
                t_max / period
            )
        })
    })
}

/// The plate of a material, without the structure below its outer layer.
fn plate(material: &Material) -> MaterialPlate {
    let bulk = &material.bulk;
    let product = [bulk.thickness, bulk.density, bulk.specific_heat]
        .iter()
        .try_fold(1.0, |product, value| value.map(|v| product * v));
    let back = match material.sides {
        Sides::Outside => 0.0,
        Sides::Both { back } => back.emissivity,
    };
    MaterialPlate { capacitance: product.unwrap_or(0.0), emissivity: material.front.emissivity + back }
}

/// Warnings for the user about a material's fitted transition in a run of `steps` steps of `step` [s], with its warm-up.
pub(crate) fn fit_warnings(fit: &OfMaterial, steps: f64, step: f64) -> Vec<String> {
    let (ResponseOrigin::Fitted(fitted), Some(transition)) = (&fit.origin, &fit.transition) else { return Vec::new() };
    let mut warnings: Vec<String> =
        fitted.doubts.iter().map(|doubt| format!("The fit of '{}' is doubtful. {doubt}.", fit.name)).collect();
    for (branch, profile) in [("heating", &transition.heating), ("cooling", &transition.cooling)] {
        if profile.t_max_steps > steps {
            warnings.push(format!(
                "The fitted {branch} of '{}' takes {:.0} s, longer than the run with its warm-up, {:.0} s: it does not reach \
                 its target in the run.",
                fit.name,
                profile.t_max_steps * step,
                steps * step
            ));
        }
    }
    warnings
}

/// A profile in the syntax of a scene file.
pub(crate) fn profile_text(profile: &Profile, step: f64) -> String {
    let parameters = match &profile.function {
        Function::Shaped(shape) => match &shape.kind {
            FunctionKind::Exponential { rate } | FunctionKind::Logarithmic { rate } => {
                format!("{}, rate {rate:.3}", shape.kind.name())
            }
            FunctionKind::Polynomial(polynomial) => format!("polynomial {:.4?}", polynomial.coefficients()),
            FunctionKind::Table(_) | FunctionKind::Expression(_) => profile.function.to_string(),
        },
        Function::Linear | Function::Quadratic => profile.function.to_string(),
    };
    format!("{parameters}, t_max {:.0} s", profile.t_max_steps * step)
}

/// A domain in the syntax of a scene file.
pub(crate) fn domain_text(domain: Domain) -> &'static str {
    match domain {
        Domain::Temperature => "T",
        Domain::FourthPower => "T4",
    }
}

/// Notes on the runs, besides the scene's assumptions.
pub(crate) fn notes(network: &Prepared, fits: &[OfMaterial], scene_file: &Path) -> Vec<String> {
    let mut notes = Vec::new();
    let names = |which: &dyn Fn(&OfMaterial) -> bool| {
        fits.iter().filter(|one| which(one)).map(|one| one.name.clone()).collect::<Vec<_>>().join(", ")
    };
    let kept = names(&|one| one.origin == ResponseOrigin::Kept);
    if !kept.is_empty() {
        notes.push(format!("These materials are 'instant' in all three runs, since they state no thickness, density and specific_heat: {kept}."));
    }
    let stated = names(&|one| one.origin == ResponseOrigin::Stated);
    if !stated.is_empty() {
        notes.push(format!("Functions are those of {} for: {stated}.", scene_file.display()));
    }
    let fitted = names(&|one| matches!(one.origin, ResponseOrigin::Fitted(_)));
    if !fitted.is_empty() {
        notes.push(format!(
            "Functions are fitted to the step response of a plate between the mean coldest and the mean hottest balance \
             temperature of the material's nodes, for: {fitted}. What a plate does not know: conduction, what lies below an \
             outer layer, and neighbours."
        ));
    }
    let silent: Vec<&str> = network
        .materials
        .iter()
        .filter(|one| one.response == Response::Network && one.bulk.conductivity.is_none())
        .map(|one| one.name.as_str())
        .collect();
    if !silent.is_empty() {
        notes.push(format!("Without a conductivity, these materials conduct nothing: {}.", silent.join(", ")));
    }
    if !network.scene.heaters.is_empty() || !network.scene.contacts.is_empty() {
        notes.push("Heaters and contacts act in the network only: the other two responses know neither.".to_owned());
    }
    notes
}
