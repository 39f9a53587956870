//! The values of materials: thickness, density, balance temperature, and the time constant beside the step.

use super::finding::{Finding, named};
use super::shapes::{Shape, parts};
use crate::gpu::nodes::GROUP;
use crate::simulation::prepare::Prepared;
use crate::thermal::STEFAN_BOLTZMANN;
use crate::thermal::balance::{balance_temperature, emissivity_sum};
use crate::thermal::material::{Material, Response, Sides};

/// Temperature at which time constants are stated [K].
pub const AT: f64 = 300.0;
/// Thickness of a shell as a share of its part, above which it is no shell.
const THICK: f64 = 0.1;
/// Density below which it is probably in g/cm3 [kg/m3].
const LIGHT: f64 = 20.0;
/// Balance temperature that few surfaces stand [K].
const HOT: f64 = 500.0;

/// What is known of a material.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MaterialFacts {
    /// Name of the glTF material.
    pub name: String,
    /// Its response.
    pub response: &'static str,
    /// Area of its surface [m2].
    pub area_m2: f64,
    /// Balance temperature in full sunlight from straight ahead, without conduction [K].
    pub hottest_k: f64,
    /// Heat capacity per area [J/(m2 K)]. `None` where the response needs none, or a transition moves it.
    pub capacity: Option<f64>,
    /// Time constant: heat capacity over radiative conductance at 300 K, or the `t_max` of its transition [s].
    pub time_constant_s: Option<f64>,
    /// The time constant in steps of the scene.
    pub time_constant_steps: Option<f64>,
    /// Length over which conduction evens temperatures out: sqrt(k d / 4 eps sigma T^3) at 300 K [m].
    pub conduction_length_m: Option<f64>,
}

/// Conductance per area by radiation at 300 K [W/(m2 K)].
fn radiative_conductance(material: &Material) -> f64 {
    4.0 * emissivity_sum(material) * STEFAN_BOLTZMANN * AT.powi(3)
}

/// The facts of each material that the model uses.
pub(super) fn facts(prepared: &Prepared) -> Vec<MaterialFacts> {
    let mut areas = vec![0.0; prepared.materials.len()];
    for (slot, area) in prepared.nodes.areas.iter().enumerate() {
        areas[prepared.nodes.group_material[slot / GROUP] as usize] += area;
    }
    let step = prepared.scene.time.step;
    let environment = &prepared.scene.environment;
    let fact = |(material, area): (&Material, f64)| {
        let sun = environment.solar_constant.unwrap_or(0.0);
        let back = match material.sides {
            Sides::Outside => 0.0,
            Sides::Both { back } => back.absorptivity,
        };
        let absorbed = material.front.absorptivity.max(back) * sun;
        let space = environment.background_temperature.unwrap_or(0.0);
        let conductance = radiative_conductance(material);
        let bulk = &material.bulk;
        let stored = matches!(material.response, Response::Network | Response::Radiative(_));
        let capacity = bulk.capacity_per_area().ok().filter(|_| stored);
        let time_constant = match &material.response {
            Response::Instant => None,
            Response::Transition(transition) => {
                Some(step * transition.heating.t_max_steps.min(transition.cooling.t_max_steps))
            }
            Response::Network | Response::Radiative(_) => capacity.map(|capacity| capacity / conductance),
        };
        let sheet = |(conductivity, thickness): (f64, f64)| (conductivity * thickness / conductance).sqrt();
        let conducts = matches!(material.response, Response::Network);
        MaterialFacts {
            name: material.name.clone(),
            response: match material.response {
                Response::Instant => "instant",
                Response::Transition(_) => "transition",
                Response::Radiative(_) => "radiative",
                Response::Network => "network",
            },
            area_m2: area,
            hottest_k: balance_temperature(absorbed, emissivity_sum(material), space),
            capacity,
            time_constant_s: time_constant,
            time_constant_steps: time_constant.map(|seconds| seconds / step),
            conduction_length_m: bulk.conductivity.filter(|_| conducts).zip(bulk.thickness).map(sheet),
        }
    };
    prepared.materials.iter().zip(areas).map(fact).collect()
}

/// Checks the values of the materials.
pub(super) fn check(prepared: &Prepared, shapes: &[Shape], facts: &[MaterialFacts]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, (material, fact)) in prepared.materials.iter().zip(facts).enumerate() {
        if fact.area_m2 == 0.0 {
            continue;
        }
        let about = named("material", &[&material.name]);
        let mut find = |check, message: String, remedy: &str| {
            findings.push(Finding { check, about: about.clone(), message, remedy: remedy.to_owned() });
        };
        let stores = matches!(material.response, Response::Network | Response::Radiative(_));
        let over = material.bulk.over.as_ref().filter(|_| stores);
        let thicknesses = [("thickness", material.bulk.thickness), ("over.thickness", over.map(|over| over.thickness))];
        for (key, thickness) in
            thicknesses.into_iter().filter_map(|(key, value)| Some((key, value.filter(|_| stores)?)))
        {
            let thick = |shape: &&Shape| {
                let area = shape.materials.get(&(number as u32)).copied().unwrap_or(0.0);
                area > 0.0 && thickness > THICK * shape.extent().min(shape.area.sqrt())
            };
            let on: Vec<&Shape> = shapes.iter().filter(thick).collect();
            if let Some(smallest) = on.iter().map(|shape| shape.extent()).min_by(f64::total_cmp) {
                find(
                    "thickness",
                    format!(
                        "{key} = {thickness} m is over a tenth of {}, which measures {smallest:.3} m",
                        named("part", &parts(prepared, &on))
                    ),
                    "thickness is that of the sheet or wall in metres: state 0.002 for 2 mm",
                );
            }
        }
        let needed = material.bulk.heat_capacity_per_area.is_none();
        let densities =
            [("density", material.bulk.density.filter(|_| needed)), ("over.density", over.map(|over| over.density))];
        for (key, density) in densities.into_iter().filter_map(|(key, value)| Some((key, value.filter(|_| stores)?))) {
            if density > 0.0 && density < LIGHT {
                find(
                    "density",
                    format!("{key} = {density} kg/m3 is lighter than foam"),
                    "density is in kg/m3: multiply a value in g/cm3 by 1000",
                );
            }
        }
        if fact.hottest_k > HOT {
            find(
                "balance",
                format!(
                    "its balance temperature in full sunlight is {:.0} K (absorptivity {}, emissivity {})",
                    fact.hottest_k,
                    material.front.absorptivity,
                    emissivity_sum(material)
                ),
                "check absorptivity and emissivity; a second face (sides = \"both\") or a structure below (over) would cool it",
            );
        }
        if let Some((seconds, steps)) = fact.time_constant_s.zip(fact.time_constant_steps)
            && seconds > 0.0
            && steps < 1.0
        {
            find(
                "step",
                format!(
                    "its time constant of {seconds:.3} s is shorter than time.step = {} s",
                    prepared.scene.time.step
                ),
                "state a shorter time.step, or response = \"instant\" for it; if the value surprises, check thickness and density",
            );
        }
    }
    findings
}
