//! The names that a scene expects in its model: all that are missing are told at once.

use wildmatch::WildMatch;

use super::joints;
use super::prepare_error::PrepareError;
use crate::misspelt::suggestion;
use crate::model::Model;
use crate::scene::{OwnerPatterns, Scene};
use crate::thermal::material::Material;

/// The materials of the model, if it has everything that the scene names.
///
/// # Errors
/// The only error, or all of them: materials without values, joints, probes, contacts and heaters on parts that the model lacks.
pub(super) fn materials(scene: &mut Scene, model: &Model) -> Result<Vec<Material>, PrepareError> {
    let found = scene.materials.resolve(model, &mut scene.files).map_err(PrepareError::from);
    let mut errors = Vec::new();
    errors.extend(joints::joints(scene, model).err());
    let names: Vec<&str> = model.parts.iter().map(|part| part.name.as_str()).collect();
    let near_part = |pattern: &str| suggestion(pattern, names.iter().copied());
    for probe in &scene.probes {
        if let Some(part) = probe.part.as_deref().filter(|part| !names.contains(part)) {
            errors.push(PrepareError::ProbePart {
                path: scene.source.clone(),
                probe: probe.name.clone(),
                part: part.to_owned(),
                near: near_part(part),
            });
        }
    }
    for rule in &scene.contacts {
        for owners in &rule.between {
            let pattern = owners.pattern();
            let (key, kind, fits, near) = match owners {
                OwnerPatterns::Parts(_) => {
                    ("between", "part", names.iter().any(|part| owners.fits(part, "")), near_part(pattern))
                }
                OwnerPatterns::Materials(_) => {
                    let materials = model.materials.iter().map(|material| material.name.as_str());
                    let fits = materials.clone().any(|material| owners.fits("", material));
                    ("between_materials", "material", fits, suggestion(pattern, materials))
                }
            };
            if !fits {
                let [first, second] = rule.between.each_ref().map(OwnerPatterns::pattern);
                let message =
                    format!("contact.{key}: of '{first}' and '{second}' the model has no {kind} '{pattern}'{near}");
                errors.push(PrepareError::network(scene, message));
            }
        }
    }
    for heater in &scene.heaters {
        let idle = |pattern: &&String| !names.iter().any(|part| WildMatch::new(pattern).matches(part));
        for pattern in heater.parts.iter().filter(idle) {
            let message = format!("heater.part: the model has no part '{pattern}'{}", near_part(pattern));
            errors.push(PrepareError::network(scene, message));
        }
    }
    match (found, errors.len()) {
        (Ok(materials), 0) => Ok(materials),
        (Err(error), 0) => Err(error),
        (Ok(_), 1) => Err(errors.remove(0)),
        (found, _) => Err(PrepareError::Several(found.err().into_iter().chain(errors).collect())),
    }
}
