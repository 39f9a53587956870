//! How every material moves in each of the three runs.

use std::path::Path;

use super::CompareError;
use crate::scene::Scene;
use crate::simulation::prepare::Prepared;
use crate::simulation::prepare_error::{PrepareError, Stage};
use crate::thermal::function::{Function, Kind};
use crate::thermal::material::{Bulk, Domain, Material, Profile, Response, Sides, Transition};
use crate::thermal::shell::{ShellError, ShellMaterial};
use crate::thermal::step_response::{Fitted, Plate};

/// Where the transition of a material comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Origin {
    /// The scene states it.
    Stated,
    /// Fitted to the step response of the material's network.
    Fitted(Box<Fitted>),
    /// The material is `instant` in all runs.
    Kept,
}

/// The transition of a material.
#[derive(Debug, Clone, PartialEq)]
pub struct OfMaterial {
    pub name: String,
    /// What moves it in the run `transition`; `None` where it is `instant`.
    pub transition: Option<Transition>,
    /// Where that comes from.
    pub origin: Origin,
}

/// Whether a material stays `instant` in all three runs: it is so in the scene, and states nothing that a network needs.
pub fn is_kept(material: &Material) -> bool {
    let silent = Bulk { conductivity: None, ..material.bulk } == Bulk::default();
    material.response == Response::Instant && silent
}

/// The scene with every material as `instant`.
pub fn instant(scene: &Scene, progress: &mut dyn FnMut(Stage)) -> Result<Prepared, PrepareError> {
    let change = |materials: &mut [Material]| materials.iter_mut().for_each(|one| one.response = Response::Instant);
    Prepared::with_materials(without_network(scene), change, progress)
}

/// The scene with every material as `transition`, one entry of `of` for each.
pub fn transition(scene: &Scene, of: &[OfMaterial], progress: &mut dyn FnMut(Stage)) -> Result<Prepared, PrepareError> {
    let change = |materials: &mut [Material]| {
        for (material, of) in materials.iter_mut().zip(of) {
            material.response = of.transition.clone().map_or(Response::Instant, Response::Transition);
        }
    };
    Prepared::with_materials(without_network(scene), change, progress)
}

/// The scene with every material as `network`, but for those that are kept.
///
/// # Errors
/// Materials that lack what a network needs, all of them in one error; and as [`Prepared::new`].
pub fn network(scene: &Scene, progress: &mut dyn FnMut(Stage)) -> Result<Prepared, CompareError> {
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
    // What a contact or a heater says of a material that lacks something would hide the reason.
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

/// Keys with units that a network needs and the material does not state.
pub fn lacking(material: &Material) -> Vec<String> {
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

/// Contacts and heaters belong to the network alone.
fn without_network(scene: &Scene) -> Scene {
    Scene { contacts: Vec::new(), heaters: Vec::new(), ..scene.clone() }
}

/// The transition of every material: as the scene states it, or fitted to the step response of a plate of it between the
/// two temperatures [K] of `swings`.
///
/// # Errors
/// A material that nothing fits.
pub fn transitions(network: &Prepared, swings: &[[f64; 2]]) -> Result<Vec<OfMaterial>, CompareError> {
    let of = |(material, between): (&Material, &[f64; 2])| {
        let (transition, origin) = match (&material.response, &material.transition) {
            (Response::Network, Some(stated)) => (Some(stated.clone()), Origin::Stated),
            (Response::Network, None) => {
                let fitted = plate(material)
                    .fit(*between, network.scene.time.step)
                    .map_err(|source| CompareError::Fit { material: material.name.clone(), source })?;
                (Some(fitted.transition.clone()), Origin::Fitted(Box::new(fitted)))
            }
            _ => (None, Origin::Kept),
        };
        Ok(OfMaterial { name: material.name.clone(), transition, origin })
    };
    network.materials.iter().zip(swings).map(of).collect()
}

/// The plate that a node of the material is, what lies below its outer sheet left out.
fn plate(material: &Material) -> Plate {
    let bulk = &material.bulk;
    let product = [bulk.thickness, bulk.density, bulk.specific_heat]
        .iter()
        .try_fold(1.0, |product, value| value.map(|v| product * v));
    let back = match material.sides {
        Sides::Outside => 0.0,
        Sides::Both { back } => back.emissivity,
    };
    Plate { capacitance: product.unwrap_or(0.0), emissivity: material.front.emissivity + back }
}

/// A profile as a scene file states it.
pub fn profile_text(profile: &Profile, step: f64) -> String {
    let own = match &profile.function {
        Function::Shaped(shape) => match &shape.kind {
            Kind::Exponential { rate } | Kind::Logarithmic { rate } => format!("{}, rate {rate:.3}", shape.kind.name()),
            Kind::Polynomial(polynomial) => format!("polynomial {:.4?}", polynomial.coefficients()),
            Kind::Table(_) | Kind::Expression(_) => profile.function.to_string(),
        },
        Function::Linear | Function::Quadratic => profile.function.to_string(),
    };
    format!("{own}, t_max {:.0} s", profile.t_max_steps * step)
}

/// What a transition moves, as a scene file writes it.
pub fn domain_text(domain: Domain) -> &'static str {
    match domain {
        Domain::Temperature => "T",
        Domain::FourthPower => "T4",
    }
}

/// What is to be said of the runs beside what the scene assumes.
pub fn notes(network: &Prepared, of: &[OfMaterial], scene_file: &Path) -> Vec<String> {
    let mut notes = Vec::new();
    let names = |which: &dyn Fn(&OfMaterial) -> bool| {
        of.iter().filter(|one| which(one)).map(|one| one.name.clone()).collect::<Vec<_>>().join(", ")
    };
    let kept = names(&|one| one.origin == Origin::Kept);
    if !kept.is_empty() {
        notes.push(format!("These materials are 'instant' in all three runs, since they state no thickness, density and specific_heat: {kept}."));
    }
    let stated = names(&|one| one.origin == Origin::Stated);
    if !stated.is_empty() {
        notes.push(format!("Functions are those of {} for: {stated}.", scene_file.display()));
    }
    let fitted = names(&|one| matches!(one.origin, Origin::Fitted(_)));
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
