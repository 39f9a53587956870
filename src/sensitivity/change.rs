//! The values of a parameter in a scene, and their change.

use wildmatch::WildMatch;

use super::SensitivityError;
use crate::scene::{ContactRule, MeshHeater, OwnerPatterns, Parameter, ParameterKind, Scene};
use crate::simulation::pixel_light::gains::OwnDerivatives;
use crate::simulation::prepare::Prepared;
use crate::text::plain;
use crate::thermal::balance::emissivity_sum;
use crate::thermal::material::{Material, Optics, Radiative, Response, Sides};
use crate::thermal::shell::ContactConductance;

/// The values of a parameter before it is changed.
///
/// # Errors
/// A scene whose temperatures come from a file, owners that the scene lacks, or a value that is absent or 0.
pub(crate) fn values(parameter: &Parameter, prepared: &Prepared) -> Result<Vec<f64>, SensitivityError> {
    if prepared.scene.temperatures.is_some() {
        return Err(SensitivityError::Given(prepared.scene.source.clone()));
    }
    let values = values_in(parameter, &mut prepared.scene.clone(), &mut prepared.materials.clone());
    let key = parameter.owner_key;
    let names = prepared.materials.iter().map(|material| material.name.as_str());
    let heated = prepared.scene.heaters.iter().flat_map(|heater| &heater.parts).map(String::as_str);
    let sides = prepared.scene.contacts.iter().flat_map(|rule| &rule.between).map(OwnerPatterns::pattern);
    let unknown = match key {
        "" => None,
        "material" => parameter.unknown_owner(names),
        "part" => parameter.unknown_owner(heated),
        _ => parameter.unknown_owner(sides),
    };
    if let Some((owner, near)) = unknown {
        let message = match key {
            "material" => format!("no material '{owner}' is in the model{near}"),
            "part" => format!("the scene has no heater of '{owner}'{near}"),
            _ => format!("the scene has no contact of '{}'{near}", parameter.owners.join("' and '")),
        };
        return Err(parameter.error(key, message).into());
    }
    if values.is_empty() {
        let what = parameter.kind.word();
        let message = match key {
            "" => return Err(parameter.error("vary", format!("the scene states no {what}")).into()),
            "material" if parameter.back => {
                format!("no material '{}' has a back with {what} of its own", parameter.owners.join("', '"))
            }
            "material" => {
                let known: Vec<&str> = prepared.materials.iter().map(|material| material.name.as_str()).collect();
                let owners = parameter.owners.join("', '");
                format!("no material '{owners}' of the model states its {what}; it has: {}", plain(&known.join(", ")))
            }
            _ => format!("the scene has no {what} of '{}'", parameter.owners.join("' and '")),
        };
        return Err(parameter.error(key, message).into());
    }
    if values.iter().all(|value| *value == 0.0) {
        let message = "is 0, and a difference changes it by a share of its value".to_owned();
        return Err(parameter.error("vary", message).into());
    }
    Ok(values)
}

fn values_in(parameter: &Parameter, scene: &mut Scene, materials: &mut [Material]) -> Vec<f64> {
    let mut values: Vec<f64> = of_scene(parameter, scene).into_iter().map(|value| *value).collect();
    values.extend(fitting(parameter, materials).filter_map(|material| of_material(parameter, material)));
    values
}

/// Whether two parameters of one kind vary the same value.
pub(super) fn overlap([a, b]: [&Parameter; 2], prepared: &Prepared) -> bool {
    let (mut scene, mut materials) = (prepared.scene.clone(), prepared.materials.clone());
    let before = values_in(b, &mut scene, &mut materials);
    change_scene(a, 0.5, &mut scene);
    change_materials(a, 0.5, &mut materials);
    a.kind == b.kind && before != values_in(b, &mut scene, &mut materials)
}

/// Multiplies the values of a parameter in a scene.
pub(crate) fn change_scene(parameter: &Parameter, factor: f64, scene: &mut Scene) {
    if parameter.kind == ParameterKind::Heater {
        let powers = heaters(parameter, &mut scene.heaters).flat_map(|heater| &mut heater.power.powers);
        powers.for_each(|power| *power *= factor);
    } else {
        of_scene(parameter, scene).into_iter().for_each(|value| *value *= factor);
    }
}

/// Multiplies the values of a parameter in materials.
pub(crate) fn change_materials(parameter: &Parameter, factor: f64, materials: &mut [Material]) {
    for material in fitting(parameter, materials) {
        let bulk = &mut material.bulk;
        match parameter.kind {
            ParameterKind::Absorptivity => {
                face(material, parameter.back).into_iter().for_each(|face| face.absorptivity *= factor);
            }
            ParameterKind::Emissivity => {
                face(material, parameter.back).into_iter().for_each(|face| face.emissivity *= factor);
            }
            ParameterKind::Thickness => bulk.thickness.iter_mut().for_each(|thickness| *thickness *= factor),
            ParameterKind::Conductivity => {
                bulk.conductivity.iter_mut().for_each(|conductivity| *conductivity *= factor);
            }
            ParameterKind::Capacity => {
                let stated = bulk.heat_capacity_per_area.as_mut().or(bulk.specific_heat.as_mut());
                stated.into_iter().for_each(|capacity| *capacity *= factor);
            }
            ParameterKind::EffectiveEmittance => {
                bulk.over.iter_mut().for_each(|over| over.effective_emittance *= factor);
            }
            _ => {}
        }
        if let Response::Radiative(plate) = &mut material.response
            && let Ok(changed) = Radiative::of(&material.bulk, plate.step)
        {
            *plate = Radiative { hottest: plate.hottest, ..changed };
        }
    }
}

/// Values of a parameter that the scene itself states. Of a heater, the largest power of its table.
fn of_scene<'a>(parameter: &Parameter, scene: &'a mut Scene) -> Vec<&'a mut f64> {
    let environment = &mut scene.environment;
    match parameter.kind {
        ParameterKind::SolarConstant => environment.solar_constant.iter_mut().collect(),
        ParameterKind::Albedo => environment.albedo.iter_mut().collect(),
        ParameterKind::PlanetIr => environment.planet_ir.iter_mut().collect(),
        ParameterKind::Heater => {
            let largest = |powers: &'a mut Vec<f64>| powers.iter_mut().max_by(|a, b| a.abs().total_cmp(&b.abs()));
            heaters(parameter, &mut scene.heaters).filter_map(|heater| largest(&mut heater.power.powers)).collect()
        }
        ParameterKind::Contact => {
            let conductance = |rule: &'a mut ContactRule| match &mut rule.conductance {
                ContactConductance::Total(value) | ContactConductance::PerArea(value) => value,
            };
            scene.contacts.iter_mut().filter(|rule| is_between(parameter, rule)).map(conductance).collect()
        }
        _ => Vec::new(),
    }
}

/// By how much more a place of foil changes with a parameter than its nodes show, for a change by all of its value [K].
pub(super) fn own_derivative(parameter: &Parameter, material: &Material, own: &OwnDerivatives) -> f64 {
    let is_own = || parameter.owners.iter().any(|owner| WildMatch::new(owner).matches(&material.name));
    let face = if parameter.back { material.back() } else { material.front };
    match parameter.kind {
        ParameterKind::SolarConstant => own.sunlight,
        ParameterKind::Absorptivity if is_own() && parameter.back == own.behind => own.sunlight,
        ParameterKind::Emissivity if is_own() => own.emission * face.emissivity / emissivity_sum(material),
        ParameterKind::Capacity | ParameterKind::Thickness if is_own() => own.capacity,
        _ => 0.0,
    }
}

fn heaters<'a>(parameter: &Parameter, heaters: &'a mut [MeshHeater]) -> impl Iterator<Item = &'a mut MeshHeater> {
    let patterns: Vec<WildMatch> = parameter.owners.iter().map(|pattern| WildMatch::new(pattern)).collect();
    heaters
        .iter_mut()
        .filter(move |heater| heater.parts.iter().any(|part| patterns.iter().any(|one| one.matches(part))))
}

/// Whether a contact has the two sides of a parameter, in any order.
fn is_between(parameter: &Parameter, rule: &ContactRule) -> bool {
    let by_part = parameter.owner_key == "between";
    let [first, second] = rule.between.each_ref().map(|side| (matches!(side, OwnerPatterns::Parts(_)), side.pattern()));
    let fits = |pattern: &str, (parts, side): (bool, &str)| parts == by_part && WildMatch::new(pattern).matches(side);
    let [a, b] = [&parameter.owners[0], &parameter.owners[1]];
    (fits(a, first) && fits(b, second)) || (fits(a, second) && fits(b, first))
}

/// The materials that a parameter names.
fn fitting<'a>(parameter: &Parameter, materials: &'a mut [Material]) -> impl Iterator<Item = &'a mut Material> {
    let own = if parameter.owner_key == "material" { &parameter.owners[..] } else { &[] };
    let patterns: Vec<WildMatch> = own.iter().map(|pattern| WildMatch::new(pattern)).collect();
    materials.iter_mut().filter(move |material| patterns.iter().any(|pattern| pattern.matches(&material.name)))
}

fn face(material: &mut Material, back: bool) -> Option<&mut Optics> {
    match &mut material.sides {
        Sides::Both { back: optics } if back => Some(optics),
        _ if back => None,
        _ => Some(&mut material.front),
    }
}

fn of_material(parameter: &Parameter, material: &mut Material) -> Option<f64> {
    let bulk = material.bulk;
    match parameter.kind {
        ParameterKind::Absorptivity => face(material, parameter.back).map(|face| face.absorptivity),
        ParameterKind::Emissivity => face(material, parameter.back).map(|face| face.emissivity),
        ParameterKind::Thickness => bulk.thickness,
        ParameterKind::Conductivity => bulk.conductivity,
        ParameterKind::Capacity => bulk.capacity_per_area().ok(),
        ParameterKind::EffectiveEmittance => bulk.over.map(|over| over.effective_emittance),
        _ => None,
    }
}
