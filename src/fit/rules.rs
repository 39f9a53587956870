//! Fitted values of a scene as TOML: a `[[material]]` for each material whose values were fitted, and the other values as lines to replace.

use std::fmt::Write;

use crate::scene::{OwnerPatterns, Parameter, ParameterKind};
use crate::sensitivity::change::{change_materials, change_scene};
use crate::simulation::prepare::Prepared;
use crate::text::plain;
use crate::thermal::emissivity::BandEmissivity;
use crate::thermal::material::{Bulk, Gloss, Material, Optics, Response, Sides};
use crate::thermal::shell::ContactConductance;

/// The rules of the materials that parameters change, with the values of the fit, and the other fitted values as comments.
pub(super) fn fitted_rules(prepared: &Prepared, parameters: &[Parameter], factors: &[f64], head: &[String]) -> String {
    let mut materials = prepared.materials.clone();
    let mut scene = prepared.scene.clone();
    for (parameter, factor) in parameters.iter().zip(factors) {
        change_materials(parameter, *factor, &mut materials);
        change_scene(parameter, *factor, &mut scene);
    }
    let mut text = String::new();
    for line in head {
        let _ = writeln!(text, "# {}", plain(line));
    }
    let of_materials = |parameter: &&Parameter| parameter.owner_key == "material";
    if parameters.iter().any(|parameter| of_materials(&parameter)) {
        text.push_str(
            "# Put these before the first [[material]] of the scene: the first rule that fits a material holds.\n",
        );
    }
    for (fitted, before) in materials.iter().zip(&prepared.materials).filter(|(fitted, before)| fitted != before) {
        rule(&mut text, fitted, before, &materials);
    }
    let others = parameters.iter().filter(|parameter| !of_materials(parameter));
    for parameter in others {
        let _ = writeln!(text, "\n# {}", plain(&parameter.name));
        match parameter.kind {
            ParameterKind::SolarConstant => {
                stated(&mut text, "environment.solar_constant", scene.environment.solar_constant);
            }
            ParameterKind::Albedo => stated(&mut text, "environment.albedo", scene.environment.albedo),
            ParameterKind::PlanetIr => stated(&mut text, "environment.planet_ir", scene.environment.planet_ir),
            ParameterKind::Contact => {
                let pairs =
                    scene.contacts.iter().zip(&prepared.scene.contacts).filter(|(fitted, before)| fitted != before);
                for (contact, _) in pairs {
                    let [a, b] = contact.between.each_ref().map(OwnerPatterns::pattern);
                    let (key, value) = match contact.conductance {
                        ContactConductance::Total(value) => ("conductance", value),
                        ContactConductance::PerArea(value) => ("conductance_per_area", value),
                    };
                    let _ = writeln!(text, "# [[contact]] of '{}' and '{}': {key} = {value:?}", plain(a), plain(b));
                }
            }
            ParameterKind::Heater => {
                let pairs = scene
                    .heaters
                    .iter()
                    .zip(&prepared.scene.heaters)
                    .filter(|(fitted, before)| fitted.power != before.power);
                for (heater, _) in pairs {
                    let _ = writeln!(
                        text,
                        "# [[heater]] of '{}': power {:?}",
                        plain(&heater.parts.join("', '")),
                        heater.power.powers
                    );
                }
            }
            _ => {}
        }
    }
    text
}

fn stated(text: &mut String, key: &str, value: Option<f64>) {
    if let Some(value) = value {
        let _ = writeln!(text, "# {key} = {value:?}");
    }
}

/// The rule of a material. Where a rule of numbers cannot say all or would fit others, the changed values alone stand there as comments.
fn rule(text: &mut String, fitted: &Material, before: &Material, all: &[Material]) {
    let response = match &fitted.response {
        Response::Instant => "instant",
        Response::Network => "network",
        Response::Radiative(_) => "radiative",
        Response::Transition(_) | Response::Given => "",
    };
    let plain_optics = fitted.gloss.iter().all(|gloss| *gloss == Gloss::default())
        && fitted.in_band.iter().all(BandEmissivity::is_plain)
        && fitted.bulk.over.is_none();
    // A material of some parts alone has a name that no material of the model has. The rule of the other parts would take its place, as the first that
    // fits, and a name with a wildcard would be a rule of other materials too.
    let of_parts = format!("{} of ", fitted.name);
    let names_it_alone = !fitted.name.contains(" of ")
        && !fitted.name.contains(['*', '?'])
        && !all.iter().any(|other| other.name.starts_with(&of_parts));
    let whole = !response.is_empty() && plain_optics && names_it_alone;
    let mark = if whole { "" } else { "# " };
    let name = toml::Value::String(fitted.name.clone());
    let Optics { absorptivity, emissivity } = fitted.front;
    if whole {
        let _ = writeln!(text, "\n[[material]]\nmatch = {name}\nresponse = \"{response}\"");
    } else {
        let _ = writeln!(
            text,
            "\n# material {name}: replace these values in its own rule, whose place a rule of numbers can not take"
        );
    }
    let mut line = |key: &str, value: f64| {
        let _ = writeln!(text, "{mark}{key} = {value:?}");
    };
    line("absorptivity", absorptivity);
    line("emissivity", emissivity);
    let bulk = &fitted.bulk;
    let emittance = |bulk: &Bulk| bulk.over.map(|over| over.effective_emittance);
    for (key, value, stands) in [
        ("thickness", bulk.thickness, before.bulk.thickness),
        ("density", bulk.density, before.bulk.density),
        ("specific_heat", bulk.specific_heat, before.bulk.specific_heat),
        ("heat_capacity_per_area", bulk.heat_capacity_per_area, before.bulk.heat_capacity_per_area),
        ("conductivity", bulk.conductivity, before.bulk.conductivity),
        ("over.effective_emittance", emittance(bulk), emittance(&before.bulk)),
    ] {
        if let Some(value) = value.filter(|_| whole || value != stands) {
            line(key, value);
        }
    }
    if let Sides::Both { back } = fitted.sides {
        let side = if whole { "sides = \"both\"\n" } else { "" };
        let _ = writeln!(
            text,
            "{side}{mark}back = {{ absorptivity = {:?}, emissivity = {:?} }}",
            back.absorptivity, back.emissivity
        );
    }
}

#[cfg(test)]
mod tests;
