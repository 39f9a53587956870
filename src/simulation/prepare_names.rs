//! The names that a scene expects in its model: all that are missing are told at once.

use wildmatch::WildMatch;

use super::joints;
use super::prepare_error::PrepareError;
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
    for probe in &scene.probes {
        if let Some(part) = probe.part.as_deref().filter(|part| !names.contains(part)) {
            errors.push(PrepareError::ProbePart {
                path: scene.source.clone(),
                probe: probe.name.clone(),
                part: part.to_owned(),
                parts: names.join(", "),
            });
        }
    }
    for rule in &scene.contacts {
        for owners in &rule.between {
            let (kind, fits) = match owners {
                OwnerPatterns::Parts(_) => ("part", names.iter().any(|part| owners.fits(part, ""))),
                OwnerPatterns::Materials(_) => {
                    ("material", model.materials.iter().any(|material| owners.fits("", &material.name)))
                }
            };
            if !fits {
                let [first, second] = rule.between.each_ref().map(OwnerPatterns::pattern);
                let pattern = owners.pattern();
                let message = format!("contact between '{first}' and '{second}': the model has no {kind} '{pattern}'");
                errors.push(PrepareError::network(scene, message));
            }
        }
    }
    for heater in &scene.heaters {
        let fits = |pattern: &String| names.iter().any(|part| WildMatch::new(pattern).matches(part));
        if !heater.parts.iter().any(fits) {
            let message = format!("heater: no part '{}' is in the network", heater.parts.join("', '"));
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
